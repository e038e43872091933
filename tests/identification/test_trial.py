"""Which of several laws goes first: the simpler one, unless the general one earns its numbers."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from supple.identification import trial as trying
from supple.identification.noise import choose_noise
from supple.identification.screen import Candidate
from supple.identification.search import Search
from supple.identification.trial import (
    GENERAL,
    LEAST_EVIDENCE,
    Trial,
    has_corners,
    interval,
    is_named_alike,
    may_rival,
    of_other_kind,
    quietest_first,
    simplest_first,
    with_limits,
    with_other_places,
    without_general,
)
from supple.model.law import library


def candidate(law: str, gain: float = 1.0, place: str = "spring") -> Candidate:
    entry = cast(Any, None)
    return Candidate(place, library()[law], entry, gain, 0.0, 1.0, np.ones(3), 1.0)


def trial(law: str, evidence: float) -> Trial:
    return Trial(candidate(law), cast(Any, None), evidence)


def order(*trials: Trial) -> list[str]:
    return [one.candidate.law.name for one in simplest_first(trials)]


def test_a_general_law_must_be_better_beyond_doubt():
    friction = trial("coulomb_friction", 100.0)
    hardly = trial("hysteresis", 100.0 + 0.9 * LEAST_EVIDENCE)
    clearly = trial("hysteresis", 100.0 + 1.1 * LEAST_EVIDENCE)
    assert order(hardly, friction) == ["coulomb_friction", "hysteresis"]
    assert order(friction, clearly) == ["hysteresis", "coulomb_friction"]
    other = trial("cubic_stiffness", 500.0)
    assert order(hardly, friction, other)[0] == "cubic_stiffness"


def test_a_general_law_waits_where_the_simpler_one_gains_nearly_as_much():
    general = candidate("hysteresis", 10.0)
    near, far = (candidate("coulomb_friction", 10.0 * GENERAL * k) for k in (1.1, 0.9))
    elsewhere = candidate("coulomb_friction", 10.0, place="damper")
    assert without_general([general, near]) == [near]
    assert without_general([general, far]) == [general, far]
    assert without_general([general, elsewhere]) == [general, elsewhere]
    assert with_limits([general], [general, far, elsewhere]) == [general, far]


def test_the_longest_sampling_interval_of_a_channel_counts():
    channels = [SimpleNamespace(name=n, sample_rate=r) for n, r in (("a", 50.0), ("b", 10.0))]
    more = [SimpleNamespace(name="a", sample_rate=20.0)]
    records = [SimpleNamespace(record=SimpleNamespace(channels=c)) for c in (channels, more)]
    fit = cast(Any, SimpleNamespace(problem=SimpleNamespace(records=records)))
    assert interval(Trial(candidate("sensor_delay", place="a"), fit, 0.0)) == pytest.approx(0.05)


@pytest.mark.parametrize("size, found", [(0.0, False), (0.3, True)])
def test_a_tone_where_the_model_does_not_move_is_misfit(size, found):
    rng, at = np.random.default_rng(2), np.arange(4096)
    predicted = 10.0 * np.exp(-at / 2000) * np.sin(0.2 * at)
    residual = 0.1 * rng.standard_normal(4096) + size * np.sin(1.7 * at)
    _, misfit = choose_noise(residual, predicted)
    assert (misfit.p_value < 1e-6) is found
    assert (misfit.ratio > 3.0) is found


def test_the_best_law_is_tried_at_every_place_that_is_open():
    worth = [candidate("hysteresis", 9.0, "shaft"), candidate("clearance", 8.0, "wrist")]
    faint = [candidate("clearance", 0.2, "sleeve"), candidate("hysteresis", 0.1, "sleeve")]
    chosen = with_other_places(worth, [*worth, *faint], 2)
    assert [c.name for c in chosen] == ["shaft/hysteresis", "wrist/clearance", "sleeve/hysteresis"]
    alone = with_other_places(worth[:1], [*worth, *faint], 2)
    assert [c.name for c in alone] == ["shaft/hysteresis", "sleeve/hysteresis"]


def test_one_tone_brings_all_laws_that_ring():
    """A yielding support sounded like a mass that rides on the head, and was never asked."""
    worth = [candidate("extra_mode", 4600.0, "clubhead"), candidate("cubic_stiffness", 4000.0)]
    faint = [candidate("support_flexibility", 530.0, "base"), candidate("clearance", 500.0)]
    faint.append(candidate("extra_mode", 400.0, "collet"))
    chosen = with_other_places(worth, [*worth, *faint], 2)
    assert [one.name for one in chosen[2:]] == ["base/support_flexibility", "collet/extra_mode"]
    assert with_other_places(worth[1:], [*worth[1:], *faint], 2) == worth[1:]


@pytest.mark.parametrize(
    ("dominated", "there", "taken"),
    [
        (False, 900.0, True),
        (False, 995.0, False),
        (False, 1100.0, False),
        (True, 850.0, True),
        (True, 950.0, False),
        (True, 1100.0, False),
        (True, 700.0, True),
    ],
)
def test_an_accepted_law_is_fitted_from_the_rig_too(monkeypatch, dominated, there, taken):
    """A sleeve that had locked itself where a wrist's law was missing stayed so with the law.

    Where errors of the model dominate, what is left beyond the noise counts and no cost: weights
    that took an encoder's misfit for noise hid a minimum with an eighth of it.
    """
    here = SimpleNamespace(model=None, x=np.zeros(2), cost=1000.0, count=800)

    def begun(model: Any, x: np.ndarray, *patience: float) -> Any:
        assert x.tolist() == [1.0, 1.0], "from what the rig says"
        return SimpleNamespace(model=model, x=x, cost=there, count=800)

    monkeypatch.setattr(trying, "settle", lambda fit, at_last: fit)
    monkeypatch.setattr(trying, "loudness", lambda fit: fit.cost)
    monkeypatch.setattr(trying, "worst_ratio", lambda fit: 20.0 if dominated else 1.0)
    monkeypatch.setattr(trying, "told_start", lambda model, x: x + 1.0)
    monkeypatch.setattr(trying, "solve", begun)
    found = trying.retold(cast(Any, here))
    assert (found is not here) is taken


@pytest.mark.parametrize(
    ("left", "dominated", "first"),
    [
        ((6000.0, 40.0), True, "linear_stiffness"),
        ((60.0, 40.0), True, "sensor_gain"),
        ((6000.0, 40.0), False, "sensor_gain"),
    ],
)
def test_what_leaves_far_less_goes_first_where_errors_dominate(monkeypatch, left, dominated, first):
    """A gain that left an encoder as wrong as it was cost less than the spring that was there."""
    monkeypatch.setattr(trying, "loudness", lambda fit: fit)
    monkeypatch.setattr(trying, "worst_ratio", lambda fit: 6000.0 if dominated else 2.0)
    laws = ("sensor_gain", "linear_stiffness")
    trials = [Trial(candidate(law), cast(Any, one), 0.0) for law, one in zip(laws, left)]
    found = quietest_first(cast(Any, None), trials)
    assert found[0].candidate.law.name == first and len(found) == 2


def test_of_the_other_kind_are_the_best_of_the_mechanism_beside_an_instrument():
    delay, spring = candidate("sensor_delay", 90.0), candidate("linear_stiffness", 20.0)
    gain, damping = candidate("sensor_gain", 80.0), candidate("linear_damping", 10.0)
    assert of_other_kind([delay, gain, spring, damping], 1) == [spring]
    assert of_other_kind([spring, delay, gain], 2) == [delay, gain]
    assert of_other_kind([delay, gain], 2) == []


def test_only_laws_with_corners_are_tried_with_sharper_ones():
    sharp = {name for name, law in library().items() if has_corners(law)}
    assert {"coulomb_friction", "clearance"} <= sharp
    assert not {"cubic_stiffness", "gravity", "linear_damping", "hysteresis", "sensor_gain"} & sharp


def test_of_two_that_ring_either_may_explain_it_all():
    mode, support = candidate("extra_mode"), candidate("support_flexibility", place="base")
    support = replace(support, column=np.array([1.0, -1.0, 0.0]))
    square = replace(candidate("quadratic_damping"), column=support.column)
    assert may_rival(support, mode)
    assert not may_rival(square, mode)


def contact(law: str, knee: float) -> Trial:
    """A trial of a sleeve's contact that sticks over so much of its reach [-]."""
    (shape,) = (cast(Any, SimpleNamespace(label=law)),)
    problem = SimpleNamespace(left_out=(), scales={"sleeve": SimpleNamespace(stretch=1.0)})
    fit = SimpleNamespace(
        problem=problem, misfits={}, index=lambda label: 0, value=lambda index: knee
    )
    one = replace(candidate(law, place="sleeve"), shapes=(shape,))
    return Trial(one, cast(Any, fit), 10.0)


@pytest.mark.parametrize(("knee", "same"), [(1e-4, True), (0.5, False)])
def test_slip_and_hysteresis_of_next_to_no_way_are_one_friction(knee, same):
    """A sleeve's friction was called ambiguous: it or itself."""
    both = [contact(law, knee) for law in ("hysteresis", "slip")]
    assert is_named_alike(*both) is same
    assert same is (both[0].law.name == "coulomb_friction")
    elsewhere = replace(both[1], candidate=replace(both[1].candidate, place="shaft"))
    cast(Any, elsewhere.fit).problem.scales["shaft"] = SimpleNamespace(stretch=1.0)
    assert not is_named_alike(both[0], elsewhere)


@pytest.mark.parametrize(("settles", "rivals"), [(1e-4, 0), (0.5, 1)])
def test_what_settles_as_the_best_ones_likeness_is_no_rival(monkeypatch, settles, rivals):
    """Before its noise was learned a slip of a sleeve stuck a little further than friction does."""
    close = SimpleNamespace(first=0.5, second=0.5)
    monkeypatch.setattr("supple.identification.search.contest", lambda one, other: close)
    best, other = contact("hysteresis", 1e-4), contact("slip", 0.5)
    judged = replace(contact("slip", settles), verdict="accepted")
    search: Any = SimpleNamespace(
        fit=best.fit, stages=[best.fit], trials=[], _judge=lambda trial, before: judged
    )
    assert len(Search._rivals(search, best, [other])) == rivals
