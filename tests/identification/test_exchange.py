"""A law that was reached first gives way to one that looks like it and explains more."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock

import numpy as np
import pytest

from supple.identification import refits, search as searching
from supple.identification.bootstrap import Contest
from supple.identification.free import Entry
from supple.identification.refits import Quick, elsewhere, ends_swapped, exchanged
from supple.identification.screen import Candidate
from supple.identification.trial import TAKEN, Trial
from tests.identification.test_refits import stand_in
from tests.identification.test_told import diagnosed, lumped
from tests.identification.test_trial import candidate


@pytest.fixture
def costs(monkeypatch) -> dict[str, float]:
    """Costs of refits by name, which a test fills in, for a machine without any model."""
    found: dict[str, float] = {}
    monkeypatch.setattr(refits, "solve", lambda model, x, *patience: model.fit)
    monkeypatch.setattr(refits, "without", lambda fit, place, law: fit)
    monkeypatch.setattr(refits, "extend", lambda fit, one, evaluations: stand_in(found[one.name]))
    monkeypatch.setattr(refits, "delta_bic", lambda before, after: before.cost - after.cost)
    return found


def facing(one: Candidate, *column: float) -> Candidate:
    return replace(one, column=np.array(column) / np.linalg.norm(column))


def test_only_what_looks_like_a_law_and_explains_as_much_may_take_its_place(costs, monkeypatch):
    late = facing(candidate("sensor_delay", 900.0, "head"), 1.0, 0.0)
    slow = facing(candidate("sensor_lowpass", 850.0, "head"), 1.0, 0.1)
    worse = facing(candidate("servo_lag", 800.0, "drive"), 1.0, 0.2)
    other = facing(candidate("gravity", 700.0, "head"), 0.0, 1.0)
    asked: list[str] = []

    def screen(fit: Any, causes: Any) -> list[Candidate]:
        asked.extend(f"{place}/{law.name}" for place, law in causes)
        return [late, slow, worse]

    monkeypatch.setattr(refits, "screen", screen)
    costs.update({"head/sensor_lowpass": 100.0, "drive/servo_lag": 205.0})
    trial = Trial(late, cast(Any, stand_in(200.0)), 4800.0)
    found = exchanged(trial, [late, slow, worse, other])
    assert [(one.candidate.name, one.delta_bic) for one in found] == [
        ("head/sensor_lowpass", 4900.0),
        ("drive/servo_lag", 4795.0),  # none can tell it from the delay
    ]
    assert asked == ["head/sensor_delay", "head/sensor_lowpass", "drive/servo_lag"]
    costs["drive/servo_lag"] = 207.0
    found = exchanged(trial, [late, slow, worse, other])
    assert [one.candidate.name for one in found] == ["head/sensor_lowpass"]


def test_nothing_looks_like_a_law_nothing_is_computed(costs):
    one = facing(candidate("gravity", 9.0), 1.0, 0.0)
    other = facing(candidate("cubic_stiffness", 8.0), 0.0, 1.0)
    trial = Trial(one, cast(Any, stand_in(1.0)), 10.0)
    assert exchanged(trial, [one, other]) == []


@pytest.mark.slow
def test_a_filter_is_no_delay(tmp_path: Path):
    """A delay of 11.7 ms explains nearly all of what a filter of 11.2 ms does."""
    names, found = diagnosed(tmp_path, *lumped("sensor_lowpass", "head_acc", 87000))
    assert found.status == "named" and names == ["head_acc/sensor_lowpass"]
    assert found.final.value(found.final.index(names[0])) == pytest.approx(0.01121, rel=0.03)


@pytest.mark.parametrize("far", [True, False])
def test_what_holds_a_law_as_its_simplest_case_is_tried_where_much_is_left(costs, monkeypatch, far):
    """A sleeve that slid was called Coulomb friction, with 35 times the noise left."""
    simple = facing(candidate("coulomb_friction", 900.0, "sleeve"), 1.0, 0.0)
    general = facing(candidate("hysteresis", 500.0, "sleeve"), 0.0, 1.0)  # by its first step unlike
    other = facing(candidate("hysteresis", 500.0, "shaft"), 0.0, 1.0)
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: 35.0 if far else 2.0)
    monkeypatch.setattr(refits, "screen", lambda fit, causes: [simple, general])
    costs.update({"sleeve/hysteresis": 100.0, "shaft/hysteresis": 50.0})
    trial = Trial(simple, cast(Any, stand_in(200.0)), 4800.0)
    found = exchanged(trial, [simple, general, other])
    assert [one.candidate.name for one in found] == (["sleeve/hysteresis"] if far else [])


def test_a_law_is_tried_from_its_constants_at_places_that_share_its_motion(costs, monkeypatch):
    """A fixed club's sleeve had been named as its shaft, whose law was reached first."""
    shaft = candidate("hysteresis", 6000.0, "shaft")
    sleeve, wrist = (replace(shaft, place=place) for place in ("sleeve", "wrist"))
    wrist = replace(wrist, gain=2000.0)  # less than half: it moves otherwise
    asked: list[str] = []

    def screen(fit: Any, causes: Any) -> list[Candidate]:
        asked.extend(f"{place}/{law.name}" for place, law in causes)
        return [shaft, sleeve, wrist]

    monkeypatch.setattr(refits, "screen", screen)
    unlike = candidate("slip", 6000.0, "sleeve")
    trial = Trial(shaft, cast(Any, stand_in(200.0)), 4800.0)
    for cost, wanted in ((100.0, [4900.0]), (203.0, [4797.0]), (300.0, [])):
        costs["sleeve/hysteresis"] = cost
        found = elsewhere(trial, [shaft, sleeve, wrist, unlike], trial.fit)
        assert [one.delta_bic for one in found] == wanted
    assert set(asked) == {"shaft/hysteresis", "sleeve/hysteresis", "wrist/hysteresis"}
    asked.clear()
    channel = Trial(candidate("sensor_gain", 9.0, "head"), cast(Any, stand_in(1.0)), 10.0)
    twin = candidate("sensor_gain", 9.0, "gauge")
    assert elsewhere(channel, [channel.candidate, twin], channel.fit) == []
    assert asked == []


@pytest.mark.parametrize(
    ("before", "left", "found"), [(500.0, 5.7, 1), (500.0, 1.5, 0), (9.0, 5.7, 0)]
)
def test_a_place_whose_constants_lie_elsewhere_is_tried_from_where_it_began(
    costs, monkeypatch, before, left, found
):
    """At zero strength a sleeve's hysteresis gained next to nothing: its shaft had been named."""
    shaft = candidate("hysteresis", 6000.0, "shaft")
    sleeve = replace(shaft, place="sleeve", gain=2.0)
    begun, now = cast(Any, stand_in(5000.0)), cast(Any, stand_in(200.0))
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: before if fit is begun else left)
    monkeypatch.setattr(refits, "screen", lambda fit, causes: [shaft, sleeve][-len(causes) :])
    monkeypatch.setattr(refits, "as_weighed", lambda fit, by, evaluations: fit)
    trial = Trial(shaft, now, 4800.0)
    costs["sleeve/hysteresis"] = 100.0
    assert [one.delta_bic for one in elsewhere(trial, [shaft, sleeve], begun)] == [4900.0] * found
    costs["sleeve/hysteresis"] = 201.0  # worse than where the law stands
    assert elsewhere(trial, [shaft, sleeve], begun) == []


@pytest.mark.parametrize("verdict", ["accepted", "refused"])
def test_the_place_that_explains_most_is_named_where_it_stands(monkeypatch, verdict):
    here, there = (candidate("hysteresis", 9.0, place) for place in ("shaft", "sleeve"))
    first = Trial(here, cast(Any, stand_in(200.0)), 4800.0, verdict="accepted")
    better = Trial(there, cast(Any, stand_in(100.0)), 4900.0)
    search = searching.Search(cast(Any, stand_in(5000.0)), None, lambda words: None)
    search.trials.append(first)
    monkeypatch.setattr(searching, "elsewhere", lambda trial, left, before: [better])
    monkeypatch.setattr(search, "_judge", lambda trial, before: replace(trial, verdict=verdict))
    trial, near = search._placed(first)
    if verdict == "accepted":
        assert trial.candidate is there and near == [better, first]
        assert [one.verdict for one in search.trials] == [TAKEN, "accepted"]
    else:
        assert trial is first and near == [better]
        assert [one.verdict for one in search.trials] == ["accepted", "refused"]


@pytest.mark.parametrize("better", [4790.0, 4797.0, 4803.0, 4810.0])
def test_what_explains_as_much_from_the_same_constants_is_a_rival(monkeypatch, better):
    """A delay had been named as a filter, whose cost was less by 0.6."""
    slow, late = candidate("sensor_lowpass", 9.0, "head"), candidate("sensor_delay", 9.0, "head")
    first = Trial(slow, cast(Any, stand_in(200.0)), 4800.0, verdict="accepted")
    poor = Trial(late, cast(Any, stand_in(240.0)), 4760.0)
    other = Trial(late, cast(Any, stand_in(5000.0 - better)), better)
    search = searching.Search(cast(Any, stand_in(5000.0)), None, lambda words: None)
    accept = Mock()
    monkeypatch.setattr(
        searching, "whole_refits", lambda fit, quick: ([first, poor], Quick(fit, ()))
    )
    monkeypatch.setattr(searching, "exchanged", lambda trial, left: [other])
    monkeypatch.setattr(searching, "elsewhere", lambda trial, left, before: [])
    monkeypatch.setattr(searching, "ends_swapped", lambda trial, left: None)
    monkeypatch.setattr(searching, "as_weighed", lambda fit, by: fit)
    monkeypatch.setattr(searching, "contest", lambda one, two: Contest(0.0, 1.0, 1.0, 99))
    monkeypatch.setattr(search, "_judge", lambda trial, before: replace(trial, verdict="accepted"))
    monkeypatch.setattr(search, "_accept", accept)
    assert search._tried(Quick(search.fit, ((search.fit, slow),)))
    [[best], rivals] = accept.call_args.args
    assert best.candidate is (late if better > 4806.0 else slow)
    wanted = [late] if 4794.0 < better < 4806.0 else []
    assert [one.candidate for one in rivals] == wanted


def ended(monkeypatch, verdict: str) -> tuple[list[Trial], list[Trial], list[Trial]]:
    """A shaft's law and the sleeve's that the rig's guesses ask for, and what is accepted."""
    here, there = (candidate("quadratic_damping", 9.0, place) for place in ("shaft", "sleeve"))
    first = Trial(here, cast(Any, stand_in(200.0)), 4800.0, verdict="accepted")
    other = Trial(there, cast(Any, stand_in(210.0)), 4790.0)
    search = searching.Search(cast(Any, stand_in(5000.0)), None, lambda words: None)
    accept = Mock()
    monkeypatch.setattr(searching, "whole_refits", lambda fit, quick: ([first], Quick(fit, ())))
    monkeypatch.setattr(searching, "exchanged", lambda trial, left: [])
    monkeypatch.setattr(searching, "elsewhere", lambda trial, left, before: [first])
    monkeypatch.setattr(searching, "ends_swapped", lambda trial, left: other)
    monkeypatch.setattr(searching, "quietest_first", lambda fit, trials: trials)
    monkeypatch.setattr(searching, "as_weighed", lambda fit, by: fit)
    monkeypatch.setattr(searching, "contest", lambda one, two: Contest(0.0, 1.0, 1.0, 99))
    judged = {"shaft": "accepted", "sleeve": verdict}
    monkeypatch.setattr(
        search,
        "_judge",
        lambda trial, before: replace(trial, verdict=judged[trial.candidate.place]),
    )
    monkeypatch.setattr(search, "_accept", accept)
    assert search._tried(Quick(search.fit, ((search.fit, here),)))
    best, rivals = accept.call_args.args
    return best, rivals, search.trials


def test_the_end_that_the_rig_asks_for_is_named_without_the_other(monkeypatch):
    """A sleeve's damping by the square had been named as the shaft's, their constants swapped."""
    [[best], rivals, trials] = ended(monkeypatch, "accepted")
    assert best.candidate.place == "sleeve" and rivals == []
    assert [one.verdict for one in trials] == [TAKEN, "accepted"]


def test_an_end_that_is_refused_is_none(monkeypatch):
    [[best], _, _] = ended(monkeypatch, "refused")
    assert best.candidate.place == "shaft"


@pytest.mark.parametrize("cost", [190.0, 219.0, 221.0])
@pytest.mark.parametrize("place", ["shaft", "sleeve", "wrist"])
def test_a_law_goes_to_the_other_end_where_the_rig_says_so(monkeypatch, place, cost):
    entry = Entry("strength", "strengths", (), None, 0.0, scale=2.0)
    own = replace(candidate("quadratic_damping", 9.0, place), entry=entry)
    there = replace(own, place={"shaft": "sleeve", "sleeve": "shaft"}.get(place, place))
    model = SimpleNamespace(causes=(own.cause,))
    fit = SimpleNamespace(cost=200.0, x=np.array([1.0, 2.0, 3.0]), model=model)
    fit.index, fit.value = lambda label: 2, lambda index: 3.0 * own.entry.scale
    begun = []

    def solve(model: Any, x: np.ndarray, *patience: Any) -> Any:
        begun.append((model, x))
        return SimpleNamespace(cost=cost, x=x)

    bare = SimpleNamespace(x=np.array([2.0, 1.0]))
    monkeypatch.setattr(refits, "swapped_ends", lambda model, x: np.array([2.0, 1.0, 3.0]))
    monkeypatch.setattr(refits, "farness", lambda model, x: 10.0 if x is fit.x else 0.0)
    monkeypatch.setattr(refits, "replace", lambda fit, x: fit)
    monkeypatch.setattr(refits, "without", lambda fit, place, law: bare)
    monkeypatch.setattr(refits, "extended_model", lambda fit, one: one.place)
    monkeypatch.setattr(
        refits,
        "at_other_end",
        lambda model, x, place, numbers: [2.0 * value for value, _ in numbers],
    )
    monkeypatch.setattr(refits, "constants_held", lambda model, x, evaluations: x)
    monkeypatch.setattr(refits, "solve", solve)
    monkeypatch.setattr(refits, "delta_bic", lambda before, after: before.cost - after.cost)
    trial = Trial(own, cast(Any, fit), 4800.0)
    found = ends_swapped(trial, [own, there])
    if cost > 220.0:
        assert found is None
        return
    assert found is not None and found.delta_bic == 5000.0 - cost
    assert found.candidate is (own if place == "wrist" else there)
    [(where, x)] = begun
    assert where is (model if place == "wrist" else there.place)
    assert x.tolist() == [2.0, 1.0, 3.0 if place == "wrist" else 6.0]
    if place != "wrist":
        assert ends_swapped(trial, [own]) is None, "no such law at the other end"
    model.causes = (("sleeve", own.law), own.cause)
    assert ends_swapped(trial, [own, there]) is None, "an earlier law stands there"
