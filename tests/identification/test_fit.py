"""The fit: truth recovered within honest errors, exact Jacobians, nuisances, bounds, sandwich."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification import fit as module
from supple.identification.base import fit_base
from supple.identification.constants import fit_json
from supple.identification.evidence import excess, on_bounds
from supple.identification.fit import (
    CONVERGED,
    PATIENCE,
    STOPPED,
    Fit,
    settle,
    solve,
    with_errors,
)
from supple.identification.identifiable import identifiability
from supple.identification.problem import make_problem
from supple.identification.records import read_record
from supple.identification.screen import entry_of
from supple.model.law import library
from supple.model.rig import read_rig
from tests.identification.benches import DAMPING, MASS, STIFFNESS, Bench, make_bench, with_rig

ALL_FREE = ("masses.cart.mass", "links.spring.stiffness", "links.spring.damping")
TRUTH = {
    "masses.cart.mass": MASS,
    "links.spring.stiffness": STIFFNESS,
    "links.spring.damping": DAMPING,
}


def fitted(bench: Bench) -> Fit:
    """The bench's records fitted by its rig."""
    return fit_base(make_problem(bench.records, bench.rig))


def constants(fit: Fit) -> dict[str, tuple[float, float]]:
    """Value and standard error of every free constant."""
    entries = enumerate(fit.model.entries)
    return {e.label: (fit.value(i), fit.std(i)) for i, e in entries if e.slot == "numbers"}


def test_decays_give_back_the_truth_within_their_errors(clean_fit):
    for name, (value, std) in constants(clean_fit).items():
        assert abs(value - TRUTH[name]) < 4 * std, name
        assert 0 < std < 0.05 * TRUTH[name], name
    assert clean_fit.converged and clean_fit.status == CONVERGED
    assert clean_fit.reduced_chi2 == pytest.approx(1.0, abs=0.1)
    assert excess(clean_fit) < 0.3


@pytest.mark.parametrize("dominates", [True, False])
def test_what_dominates_is_not_followed_to_the_end(clean_fit, monkeypatch, dominates):
    asked = []
    monkeypatch.setattr(module, "dominated", lambda fit: dominates)

    def stopped(model, start, evaluations=40, crawling=0.0):
        asked.append((evaluations, crawling))
        return solve(model, start, 1)

    monkeypatch.setattr(module, "solve", stopped)
    settle(clean_fit, crawling=1e-3)
    assert asked[-1] == (PATIENCE, 1e-3 if dominates else 0.0)


def test_a_driven_record_gives_the_mass_too(tmp_path):
    fit = fitted(make_bench(tmp_path, driven=True, free=ALL_FREE))
    found = constants(fit)
    assert set(found) == set(ALL_FREE)
    for name, (value, std) in found.items():
        assert abs(value - TRUTH[name]) < 4 * std, name
        assert std < 0.02 * TRUTH[name], name
    told = identifiability(fit)
    assert {one["identifiable"] for one in told.values()} == {"yes"}


def test_stated_errors_are_honest(tmp_path):
    scores = []
    for seed in range(20):
        fit = fitted(make_bench(tmp_path / str(seed), seed=seed, snr_db=30.0))
        for name, (value, std) in constants(fit).items():
            scores.append((value - TRUTH[name]) / std)
    table = np.array(scores).reshape(20, 2)
    assert np.all(np.abs(table.mean(axis=0)) < 4 / np.sqrt(20))
    assert np.all((table.std(axis=0) > 0.6) & (table.std(axis=0) < 1.5)), table.std(axis=0)
    assert np.abs(table).max() < 4.5


def test_the_start_does_not_decide_the_end(tmp_path):
    bench = make_bench(tmp_path)
    rig = with_rig(bench, "70.0", "25.0")
    near, far = fitted(bench), fit_base(make_problem(bench.records, rig))
    for name, (value, std) in constants(near).items():
        assert constants(far)[name][0] == pytest.approx(value, abs=0.05 * std)


def test_the_jacobian_is_the_slope_of_the_residual(softening_fit):
    fit = softening_fit
    cause = "spring", library()["cubic_stiffness"]
    entry = entry_of(fit, cause)
    model = replace(fit.model, entries=(*fit.model.entries, entry), causes=(cause,))
    x = np.append(fit.x, -0.1)
    exact = model.jacobian(x)
    for column in range(len(x)):
        step = 1e-5 * max(1.0, abs(x[column]))
        move = np.zeros(len(x))
        move[column] = step
        slope = (model.residual(x + move) - model.residual(x - move)) / (2 * step)
        size = np.linalg.norm(exact[:, column])
        gap = np.linalg.norm(slope - exact[:, column])
        assert gap < 1e-6 * size + 1e-7, model.entries[column].label


@pytest.mark.parametrize("acting", [False, True], ids=["bare", "with a law"])
def test_columns_are_those_of_the_jacobian(softening_fit, acting):
    fit = softening_fit
    model, x = fit.model, fit.x
    if acting:
        cause = "spring", library()["cubic_stiffness"]
        entries = (*model.entries, entry_of(fit, cause))
        model, x = replace(model, entries=entries, causes=(cause,)), np.append(x, -0.1)
    which = [i for i, entry in enumerate(model.entries) if entry.slot in ("start", "offset")]
    assert 0 < len(which) < len(x)
    assert any(np.isfinite(model.entries[i].prior) for i in which), "rows of priors are there too"
    wanted = model.jacobian(x)[:, which]
    np.testing.assert_allclose(model.columns(x, which), wanted, rtol=1e-9, atol=1e-9)


def test_a_constant_of_its_own_for_each_record(tmp_path):
    one = make_bench(tmp_path / "a", reaches=(1.0,), held=(), damping=0.1, prefix="a_")
    two = make_bench(tmp_path / "b", reaches=(1.0,), held=(), damping=0.3, prefix="b_")
    text = one.rig.path.read_text()
    at = text.index("damping")
    text = text[:at] + text[at:].replace("free = true", 'free = true, per = "record"', 1)
    one.rig.path.write_text(text)
    rig = with_rig(one, 'per = "record"', 'per = "record"')
    fit = fit_base(make_problem([*one.records, *two.records], rig))
    found = constants(fit)
    assert len(found) == 3
    for name, truth in (("a_train_01", 0.1), ("b_train_01", 0.3)):
        value, std = found[f"links.spring.damping[{name}]"]
        assert abs(value - truth) < 4 * std and std < 0.02
    value, std = found["links.spring.stiffness"]
    assert abs(value - STIFFNESS) < 4 * std


def test_what_a_record_gives_of_its_own_is_held_there(tmp_path):
    one = make_bench(tmp_path / "a", reaches=(1.0,), held=(), damping=0.1, prefix="a_")
    two = make_bench(tmp_path / "b", reaches=(1.0,), held=(), damping=0.3, prefix="b_")
    text = one.rig.path.read_text()
    at = text.index("damping")
    text = text[:at] + text[at:].replace("free = true", 'free = true, per = "record"', 1)
    one.rig.path.write_text(text)
    (path,) = two.paths
    path.write_text(path.read_text() + '\n[parameters]\n"links.spring.damping" = 0.3\n')
    records = [*one.records, read_record(path)]
    fit = fit_base(make_problem(records, read_rig(one.rig.path)))
    labels = [entry.label for entry in fit.model.entries]
    assert len(labels) == len(set(labels))
    found = constants(fit)
    assert abs(found["links.spring.damping[a_train_01]"][0] - 0.1) < 0.02
    value, std = found["links.spring.damping[b_train_01]"]
    assert value == pytest.approx(0.3, rel=0.01) and std < 0.0016, "known to half a percent"


def test_a_tolerance_of_the_mass_widens_what_hangs_on_it(tmp_path, clean_fit):
    bench = make_bench(tmp_path)
    rig = with_rig(bench, "mass = 0.5", "mass = { value = 0.5, std = 0.01 }")
    fit = fit_base(make_problem(bench.records, rig))
    value, std = constants(fit)["links.spring.stiffness"]
    _, before = constants(clean_fit)["links.spring.stiffness"]
    assert std == pytest.approx(STIFFNESS * 0.01 / MASS, rel=0.05)
    assert std > 20 * before and abs(value - STIFFNESS) < std
    mass, spread = constants(fit)["masses.cart.mass"]
    assert (mass, spread) == (pytest.approx(MASS, abs=1e-4), pytest.approx(0.01, rel=0.02))
    shown = fit_json(fit, {})
    assert "masses.cart.mass" not in shown["parameters"]
    assert shown["nuisances"]["masses.cart.mass"]["tolerance"] == 0.01


def test_a_bound_that_holds_is_reported(tmp_path):
    bench = make_bench(tmp_path)
    text = bench.rig.path.read_text()
    start, end = text.index("max = "), text.index(",", text.index("max = "))
    rig = with_rig(bench, text[start:end], "max = 75.0")
    fit = fit_base(make_problem(bench.records, rig))
    assert "links.spring.stiffness" in on_bounds(fit)
    free = fit_base(make_problem(bench.records, bench.rig))
    assert not on_bounds(free, 2.0) and "links.spring.damping" in on_bounds(free, 1e4)
    told = identifiability(fit)["links.spring.stiffness"]
    assert told["identifiable"] == "one_sided" and "bound" in told["note"]
    assert constants(fit)["links.spring.stiffness"][0] == pytest.approx(75.0, rel=1e-3)


def test_two_constants_that_trade_off_are_named_with_each_other(tmp_path):
    fit = fitted(make_bench(tmp_path, free=ALL_FREE))
    told = identifiability(fit)
    doubted = {name for name, one in told.items() if one["identifiable"] != "yes"}
    assert {"masses.cart.mass", "links.spring.stiffness"} <= doubted, told
    stiffness = told["links.spring.stiffness"]
    assert stiffness["identifiable"] == "coupled"
    assert stiffness["partner"] in ("masses.cart.mass", "links.spring.damping")
    value, std = constants(fit)["masses.cart.mass"]
    assert std > value, "a free decay tells ratios alone"


def naive(fit: Fit) -> np.ndarray:
    """Covariance were every whitened residual white."""
    jacobian = fit.model.jacobian(fit.x)
    return np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)


def test_errors_grow_where_misfit_is_left_and_only_there(clean_fit, softening_fit):
    # noise of one size seems louder here and there by chance
    assert clean_fit.covariance == pytest.approx(naive(clean_fit), rel=0.05, abs=1e-18)
    index = softening_fit.index("links.spring.stiffness")
    grown = softening_fit.covariance[index, index] / naive(softening_fit)[index, index]
    assert grown > 1.5
    value, std = softening_fit.value(index), softening_fit.std(index)
    assert std > 20 * clean_fit.std(clean_fit.index("links.spring.stiffness"))
    assert value < STIFFNESS


def test_covariance_is_one(softening_fit, clean_fit):
    for fit in (softening_fit, clean_fit):
        spread = with_errors(fit).covariance
        assert spread == pytest.approx(spread.T, rel=1e-6, abs=1e-12)
        assert np.linalg.eigvalsh(spread).min() > -1e-9 * np.abs(spread).max()


def test_a_fit_that_was_cut_short_says_so(softening_fit):
    away = softening_fit.x.copy()
    away[0] *= 0.8
    found = solve(softening_fit.model, away, 1)
    assert found.status == STOPPED and not found.converged


def test_keys_of_channels(clean_fit):
    for key in clean_fit.keys:
        assert clean_fit.residual_of(key).shape == clean_fit.sensor_of(key).values.shape
    with pytest.raises(KeyError):
        clean_fit.sensor_of(("nobody", "nothing"))


def test_coloured_noise_widens_errors(tmp_path, clean_fit):
    coloured = make_bench(tmp_path, noise="ar1", noise_law={"rho": 0.9})
    fit = fitted(coloured)
    laws = {noise.law for noise in fit.problem.floor.values()}
    assert laws <= {"ar1", "ar2"}
    for name, (value, std) in constants(fit).items():
        assert abs(value - TRUTH[name]) < 4 * std, name
