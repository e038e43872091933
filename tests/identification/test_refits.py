"""Of many laws few are refitted whole; those that a stand-in put aside get their turn after it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from supple.identification import refits, search as searching
from supple.identification.fit import Fit
from supple.identification.refits import Quick, quick_refits, whole_refits
from supple.identification.screen import Candidate, screen
from supple.identification.told import Begun
from supple.identification.trial import NO_GAIN, Trial
from tests.identification.test_told import diagnosed
from tests.identification.test_trial import candidate


@pytest.fixture
def plain(monkeypatch):
    """Fits that carry nothing but their cost, and a solver that returns where it stands."""
    monkeypatch.setattr(refits, "solve", lambda model, x, *patience: model.fit)
    monkeypatch.setattr(refits, "replace", lambda model, **changes: model)
    monkeypatch.setattr(refits, "delta_bic", lambda before, after: before.cost - after.cost)


def stand_in(cost: float) -> Any:
    fit = SimpleNamespace(cost=cost, x=None, problem=None, misfits={})
    fit.model = SimpleNamespace(fit=fit, allowances=None, entries=())
    return fit


def rank_bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """Quick refits of stand-ins: records as they are, each law promises enough, all are misfits."""
    monkeypatch.setattr(refits, "thinned", lambda model: model)
    monkeypatch.setattr(refits, "solve", lambda model, x, *patience: model.fit)
    monkeypatch.setattr(refits, "promising", lambda fit, chosen, least: chosen)
    monkeypatch.setattr(refits, "misfit_chance", lambda fit: 0.0)


def names(trials: list[Trial]) -> list[str]:
    return [trial.candidate.law.name for trial in trials]


def ranking(**costs: float) -> Quick:
    ranked = sorted(costs.items(), key=lambda one: one[1])
    return Quick(stand_in(5000.0), tuple((stand_in(cost), candidate(law)) for law, cost in ranked))


def test_what_the_best_one_leaves_far_behind_waits(plain):
    quick = ranking(stiffness_drift=1000.0, hysteresis=2600.0, slip=2700.0)
    best, aside = whole_refits(stand_in(5000.0), quick)
    assert names(best) == ["stiffness_drift"]
    assert [one.law.name for _, one in aside.tried] == ["hysteresis", "slip"]
    rest, nothing = whole_refits(stand_in(5000.0), aside)
    assert names(rest) == ["hysteresis", "slip"] and nothing.tried == ()


def test_the_fourth_of_equals_waits_and_none_is_lost(plain):
    laws = ("quadratic_damping", "cubic_stiffness", "gravity", "clearance", "relaxation")
    quick = ranking(**{law: 1000.0 + k for k, law in enumerate(laws)})
    best, aside = whole_refits(stand_in(5000.0), quick)
    assert len(best) == 3
    assert {*names(best), *(one.law.name for _, one in aside.tried)} == set(laws)


def test_the_simpler_law_of_the_best_one_is_never_put_aside(plain):
    quick = ranking(hysteresis=1000.0, coulomb_friction=4000.0)
    best, aside = whole_refits(stand_in(5000.0), quick)
    assert sorted(names(best)) == ["coulomb_friction", "hysteresis"] and aside.tried == ()


def test_quick_refits_rank_the_true_law_first(softening_diagnosis):
    base = softening_diagnosis.base
    told: list[str] = []
    quick = quick_refits(base, screen(base), [], told.append)
    costs = [fit.cost for fit, _ in quick.tried]
    assert costs == sorted(costs) and costs[0] < 0.3 * quick.start.cost
    assert quick.tried[0][1].name == "spring/cubic_stiffness"
    assert "trying spring/cubic_stiffness" in told


@pytest.mark.parametrize("verdict", [NO_GAIN, "refused: it would have to be larger than it can be"])
def test_what_foretells_no_better_hides_nothing_that_does(
    softening_diagnosis, monkeypatch, verdict
):
    right = replace(softening_diagnosis.accepted[0], verdict="")
    wrong = Trial(candidate("stiffness_drift"), right.fit, right.delta_bic)
    rounds = [[wrong], [right]]
    waiting = Quick(right.fit, ((right.fit, right.candidate),))

    def next_round(fit: Any, quick: Quick) -> tuple[list[Trial], Quick]:
        return rounds.pop(0), Quick(right.fit, waiting.tried if rounds else ())

    def judge(self: Any, trial: Trial, before: Any) -> Trial:
        return replace(trial, verdict=verdict if trial is wrong else "accepted")

    monkeypatch.setattr(searching, "quick_refits", lambda *arguments: waiting)
    monkeypatch.setattr(searching, "whole_refits", next_round)
    monkeypatch.setattr(searching.Search, "_judge", judge)
    monkeypatch.setattr(searching.Search, "_pair", lambda self, first: False)
    search = searching.Search(softening_diagnosis.base, None, cast(Any, lambda text: None))
    assert search.step() is (verdict == NO_GAIN)
    assert [one.candidate for one in search.accepted] == (
        [right.candidate] if verdict == NO_GAIN else []
    )


def begun(law: Candidate, cost: float) -> Begun:
    return Begun(law, cast(Any, None), np.zeros(0), cost)


@pytest.mark.parametrize(("ratio", "tried"), [(50.0, ["clearance"]), (2.0, [])])
def test_what_no_step_asks_for_is_tried_where_all_else_leaves_errors_that_dominate(
    monkeypatch, ratio, tried
):
    """A sleeve's dry friction: a slipping shaft was accepted, and what was left had no name."""
    one, play = candidate("cubic_stiffness", 90.0), candidate("clearance", 0.0)
    found = stand_in(3000.0)
    rank_bare(monkeypatch)
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: ratio)
    monkeypatch.setattr(refits, "is_swung", lambda problem, cause: False)
    monkeypatch.setattr(refits, "extend", lambda fit, law, evaluations: found)
    monkeypatch.setattr(refits, "told_trials", lambda fit, always: (fit, [one]))
    monkeypatch.setattr(refits, "unasked_trials", lambda told, names: [play])
    monkeypatch.setattr(
        refits, "begun_from_told", lambda told, law, start, evaluations: begun(law, 1.0)
    )
    monkeypatch.setattr(refits, "weighed_as", lambda start, begun, evaluations: found)
    quick = quick_refits(stand_in(5000.0), [one], [], lambda words: None)
    laws = [law.law.name for _, law in quick.tried]
    assert laws == ["cubic_stiffness", "cubic_stiffness", *tried]


@pytest.mark.parametrize(
    ("before", "left", "pull", "asked"),
    [
        (1000.0, 24.0, 1.0, False),
        (1000.0, 26.0, 1.0, True),
        (50.0, 1.9, 1.0, False),
        (9.0, 1.9, 1.0, True),  # errors of the model did not dominate: the rig may have made room
        (1000.0, 1.0, 7.0, True),
    ],
)
def test_a_law_that_leaves_next_to_nothing_needs_no_told_constants(
    monkeypatch, before, left, pull, asked
):
    law, found, told = candidate("cubic_stiffness", 90.0), stand_in(3000.0), []
    rank_bare(monkeypatch)
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: left if fit is found else before)
    monkeypatch.setattr(refits, "worst_pull", lambda fit: pull if fit is found else 9.0)
    monkeypatch.setattr(refits, "extend", lambda fit, law, evaluations: found)

    def told_trials(fit: Fit, always: Any) -> tuple[Fit, list[Candidate]]:
        told.append(fit)
        return fit, []

    monkeypatch.setattr(refits, "told_trials", told_trials)
    quick_refits(stand_in(5000.0), [law], [], lambda words: None)
    assert bool(told) == asked


def test_of_laws_that_no_step_asks_for_those_are_weighed_that_fit_best(monkeypatch):
    costs = {"a": 900.0, "b": 30.0, "c": 500.0, "d": 700.0, "e": 400.0}
    laws = [candidate("clearance", 0.0, place) for place in [*costs, "idle"]]
    told, found = candidate("cubic_stiffness", 90.0), stand_in(3000.0)
    rank_bare(monkeypatch)
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: 50.0)
    monkeypatch.setattr(refits, "extend", lambda fit, law, evaluations: found)
    monkeypatch.setattr(refits, "told_trials", lambda fit, always: (fit, [told]))
    monkeypatch.setattr(refits, "unasked_trials", lambda told, names: laws)

    def begin(told: Fit, law: Candidate, start: Fit, evaluations: int) -> Begun | None:
        return None if law.place == "idle" else begun(law, costs.get(law.place, 1e4))

    monkeypatch.setattr(refits, "begun_from_told", begin)
    monkeypatch.setattr(refits, "weighed_as", lambda start, one, evaluations: stand_in(one.cost))
    quick = quick_refits(stand_in(5000.0), [told], [], lambda words: None)
    assert [law.place for _, law in quick.tried][:4] == ["b", "e", "c", "d"]
    assert len(quick.tried) == 6  # with the told law by both ways


def test_what_rings_has_longer_to_find_its_own_frequency(monkeypatch):
    laws = [candidate(law, 90.0) for law in ("cubic_stiffness", "support_flexibility")]
    budgets = {}

    def extend(fit: Fit, law: Candidate, evaluations: int) -> Any:
        budgets[law.law.name] = evaluations
        return stand_in(3000.0)

    rank_bare(monkeypatch)
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: 2.0)
    monkeypatch.setattr(refits, "extend", extend)
    monkeypatch.setattr(refits, "told_trials", lambda fit, always: (fit, []))
    quick_refits(stand_in(5000.0), laws, [], lambda words: None)
    assert budgets == {"cubic_stiffness": refits.QUICK, "support_flexibility": refits.RINGING}


@pytest.mark.parametrize(("ratio", "tried"), [(50.0, ["base", "shaft"]), (2.0, [])])
def test_what_was_tried_beside_drawn_away_constants_is_tried_from_told_ones(
    monkeypatch, ratio, tried
):
    """A support that yields: beside a clubhead and a collet too light it rang at no frequency."""
    laws = [
        candidate("support_flexibility", 90.0, "base"),
        candidate("sensor_saturation", 80.0, "head"),
        candidate("slip", 70.0, "shaft"),
        candidate("cubic_stiffness", 60.0, "wrist"),
    ]
    asked: list[str] = []
    found = stand_in(3000.0)
    rank_bare(monkeypatch)
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: ratio)
    monkeypatch.setattr(refits, "is_swung", lambda problem, cause: False)
    monkeypatch.setattr(refits, "extend", lambda fit, law, evaluations: found)
    monkeypatch.setattr(refits, "told_trials", lambda fit, always: (fit, laws[3:]))
    monkeypatch.setattr(refits, "unasked_trials", lambda told, names: [])
    monkeypatch.setattr(refits, "weighed_as", lambda start, begun, evaluations: found)

    def screen(told: Any, causes: Any) -> list[Candidate]:
        return [law for law in laws if law.cause in causes]

    def begin(told: Fit, law: Candidate, start: Fit, evaluations: int) -> Begun:
        asked.append(law.place)
        return begun(law, 1.0)

    monkeypatch.setattr(refits, "screen", screen)
    monkeypatch.setattr(refits, "begun_from_told", begin)
    quick_refits(stand_in(5000.0), laws, [], lambda words: None)
    assert sorted(asked) == [*tried, "wrist"]


@pytest.mark.parametrize(("pull", "tried"), [(2.0, ["sleeve"]), (9.0, ["sleeve", "collet"])])
def test_what_strains_the_rig_is_not_all_that_is_tried(monkeypatch, pull, tried):
    """A sleeve that hardens left no misfit beside a shaft of twenty times its weight."""
    monkeypatch.setattr(refits, "THREADS", 1)
    laws = [candidate("cubic_stiffness", 90.0, "sleeve"), candidate("extra_mode", 80.0, "collet")]
    found, start = stand_in(3000.0), stand_in(5000.0)
    rank_bare(monkeypatch)
    monkeypatch.setattr(refits, "misfit_chance", lambda fit: 1.0 if fit is found else 0.0)
    monkeypatch.setattr(refits, "worst_ratio", lambda fit: 1.0)
    monkeypatch.setattr(refits, "worst_pull", lambda fit: pull)
    monkeypatch.setattr(refits, "may_rival", lambda one, other: False)
    monkeypatch.setattr(refits, "extend", lambda fit, law, evaluations: found)
    monkeypatch.setattr(refits, "told_trials", lambda fit, always: (fit, []))
    quick = quick_refits(start, laws, [], lambda words: None)
    assert [law.place for _, law in quick.tried] == tried


@pytest.mark.parametrize(("pulls", "begins"), [((9.0, 2.0), 1), ((2.0, 9.0), 2), ((2.0, 2.0), 0)])
def test_a_strained_refit_starts_again_from_where_nothing_strains(monkeypatch, pulls, begins):
    quick, found, eased = stand_in(3000.0), stand_in(2500.0), stand_in(2000.0)
    quick.x, found.x = 1, 2
    pull = {id(quick): pulls[0], id(found): pulls[1]}
    monkeypatch.setattr(refits, "worst_pull", lambda fit: pull[id(fit)])
    monkeypatch.setattr(refits, "eased_start", lambda model, x: -x)
    monkeypatch.setattr(
        refits, "solve", lambda model, x, patience: found if x > 0 else (asked.append(-x), eased)[1]
    )
    asked: list[int] = []
    assert refits._at_minimum(quick) is (eased if begins else found)
    assert asked == ([begins] if begins else [])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bench", "seed", "decibels", "name"),
    [
        ("A", 101005, "30", "sleeve/hysteresis"),  # dry friction: a shaft that slips stood in
        ("A", 105040, "30", "sleeve/quadratic_damping"),  # the shaft's, their constants swapped
        ("A", 102003, "40", "clubhead/linear_stiffness"),  # a gauge's delay left no misfit either
        ("A", 102002, "30", "clubhead/linear_stiffness"),  # a gain cost less, and left an encoder
        ("B", 98414, "30", "sleeve/hysteresis"),  # a fixed club's shaft was reached first
        ("B", 101001, "30", "sleeve/hysteresis"),  # nearly all of a sleeve's spring gives way
        ("B", 106014, "30", "base/support_flexibility"),  # a rider had been nearer at first
        ("A", 107026, "30", "base/support_flexibility"),  # with a shaft that weighed too much
        ("B", 107026, "30", "head_acc/sensor_lowpass"),  # nothing drives it: it lags all others
    ],
)
def test_a_bench_whose_cause_others_had_stood_in_for(tmp_path, bench, seed, decibels, name):
    names, found = diagnosed(tmp_path, "--bench", bench, "--seed", str(seed), "--snr-db", decibels)
    assert (names, found.status) == ([name], "named")
    assert found.held_after is not None
    assert found.held_after.nrmse < 1.25 * found.held_after.noise_floor
