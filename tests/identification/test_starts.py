"""Other starts: two springs in a row give the same frequencies in two ways."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification import base
from supple.identification.base import fit_base
from supple.identification.fit import solve
from supple.identification.problem import Model, base_entries, make_problem, rough_noise
from supple.identification.records import read_record, split_records
from supple.identification.starts import (
    MOST,
    STRAINED,
    eased_start,
    has_basins,
    other_starts,
    told_start,
)
from supple.identification.tolerances import PULLED, worst_pull
from supple.model.rig import read_rig
from tests.identification.test_told import drawn
from tests.lab.draw import draw_case

SPRINGS = ("links.spring_a.stiffness", "links.spring_b.stiffness")


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    """A chain of two masses and the pair of stiffnesses that gives its two frequencies again."""
    case = draw_case(tmp_path_factory.mktemp("twin"), 70036, bench="chain", snr_db=40.0)
    problem = make_problem([read_record(path) for path in case.train], read_rig(case.rig))
    return problem, case.truth["constants"]


def test_a_start_in_the_wrong_basin_ends_in_the_right_one(twin):
    problem, truth = twin
    first, second = (truth[name] for name in SPRINGS)
    masses = [number.value for name, number in problem.rig.parameters.items() if "mass" in name]
    # k_a k_b and the sum of squares of the frequencies stay: swap which spring is the stiff one
    ratio = (masses[0] + masses[1]) / masses[1] if len(masses) > 1 else 2.0
    wrong = {SPRINGS[0]: ratio * second, SPRINGS[1]: first / ratio}
    parameters = {
        name: number.at(wrong.get(name, number.value))
        for name, number in problem.rig.parameters.items()
    }
    fit = fit_base(replace(problem, rig=replace(problem.rig, parameters=parameters)))
    for name in SPRINGS:
        index = fit.index(name)
        assert fit.value(index) == pytest.approx(truth[name], abs=5 * fit.std(index)), name
    assert fit.reduced_chi2 < 1.2


def test_starts_lie_inside_their_bounds_and_differ(twin):
    problem, _ = twin
    model = Model(problem, base_entries(problem), (), rough_noise(problem))
    assert has_basins(model)
    x = np.array([entry.value / entry.scale for entry in model.entries])
    found = other_starts(model, x)
    assert 0 < len(found) <= MOST
    for start in found:
        for entry, value in zip(model.entries, start, strict=True):
            assert entry.low <= value * entry.scale <= entry.high, entry.label
    own = [model.entries.index(e) for e in model.entries if e.name in SPRINGS]
    ratios = [start[own[0]] / start[own[1]] for start in found]
    assert max(ratios) > 1.2 * min(ratios)


def test_one_spring_has_one_basin(clean_fit):
    assert not has_basins(clean_fit.model)


def test_constants_go_back_to_what_the_rig_says_and_records_keep_their_own(twin):
    problem, _ = twin
    model = Model(problem, base_entries(problem), (), rough_noise(problem))
    far = np.array([2.0 + k for k in range(len(model.entries))])
    start = told_start(model, far)
    shared = [e.slot == "numbers" and e.record is None for e in model.entries]
    assert 0 < sum(shared) < len(shared)
    for entry, own, was, now in zip(model.entries, shared, far, start, strict=True):
        wanted = entry.value / entry.scale if own else was
        inside = np.clip(wanted, entry.low / entry.scale, entry.high / entry.scale)
        assert now == pytest.approx(inside), entry.label


def test_what_strains_its_tolerance_goes_back_and_springs_stay(twin):
    problem, _ = twin
    entries = list(base_entries(problem))
    shared = [k for k, e in enumerate(entries) if e.slot == "numbers" and e.record is None]
    bound, free = shared[:2], shared[2:]
    assert len(bound) == 2 and free and all(entries[k].prior == np.inf for k in free)
    for k in bound:
        entries[k] = replace(entries[k], center=entries[k].value, prior=0.1 * entries[k].value)
    model = Model(problem, tuple(entries), (), rough_noise(problem))
    x = np.array([3.0 * entry.value / entry.scale for entry in entries])
    near = bound[0]
    x[near] = (entries[near].center + 0.9 * STRAINED * entries[near].prior) / entries[near].scale
    start = eased_start(model, x)
    for k, entry in enumerate(entries):
        back = k == bound[1]
        assert start[k] == pytest.approx(entry.center / entry.scale if back else x[k]), entry.label


@pytest.mark.parametrize("pull", [2.0 * PULLED, 0.5 * PULLED])
def test_constants_that_were_drawn_away_come_back_where_that_fits_better(twin, monkeypatch, pull):
    problem, truth = twin
    whole = fit_base(problem)
    far = whole.x.copy()
    for name, factor in zip(SPRINGS, (2.5, 0.4), strict=True):
        far[whole.index(name)] *= factor
    away = solve(whole.model, far, 0)
    monkeypatch.setattr(base, "worst_pull", lambda fit: pull)
    found = base.back_in_place(away, whole.x, 0.0)
    assert (found is away) == (pull < PULLED)
    if found is not away:
        assert found.cost < 0.1 * away.cost
        for name in SPRINGS:
            index = found.index(name)
            assert found.value(index) == pytest.approx(truth[name], abs=5 * found.std(index)), name
    assert base.back_in_place(whole, far, 0.0) is whole


def test_what_strains_alone_goes_back_where_nothing_else_fits_better(twin, monkeypatch):
    problem, _ = twin
    whole = fit_base(problem)
    far = whole.x.copy()
    far[whole.index(SPRINGS[0])] *= 1.05
    away = solve(whole.model, far, 0)
    monkeypatch.setattr(base, "worst_pull", lambda fit: (3.0 if fit is away else 2.0) * PULLED)
    monkeypatch.setattr(base, "constants_held", lambda model, x, evaluations: x)
    monkeypatch.setattr(base, "told_start", lambda model, x: whole.x)
    monkeypatch.setattr(base, "DEEPER", 0.0)  # whatever begins elsewhere, it is not far better
    monkeypatch.setattr(base, "eased_start", lambda model, x: whole.x)
    found = base.back_in_place(away, far, 0.0)
    assert found.cost < away.cost and found.cost == pytest.approx(whole.cost, rel=1e-3)
    monkeypatch.setattr(base, "worst_pull", lambda fit: (3.0 if fit is away else 4.0) * PULLED)
    assert base.back_in_place(away, far, 0.0) is away  # a better fit that strains yet more
    monkeypatch.setattr(base, "worst_pull", lambda fit: (3.0 if fit is away else 2.0) * PULLED)
    monkeypatch.setattr(base, "eased_start", lambda model, x: 3.0 * x)
    monkeypatch.setattr(base, "solve", lambda model, x, *patience: solve(model, x, 0))
    assert base.back_in_place(away, far, 0.0) is away


@pytest.mark.slow
def test_a_club_keeps_what_the_rig_states_of_it_where_that_fits_better(tmp_path):
    """A collet 14 % too light, six of its tolerances, beside a shaft that was too heavy."""
    records, rig = drawn(tmp_path, "--bench", "B", "--seed", "107041")
    train, _, _ = split_records(records, ())
    assert worst_pull(fit_base(make_problem(train, rig))) < 4.0
