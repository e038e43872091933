"""Posteriors: exact algebra, a second sampler, calibration, the gate, kills, files."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray
from arviz_stats.summary import summary
from hypothesis import given, strategies as st
from scipy import stats
from scipy.linalg import cho_factor, cho_solve, toeplitz
from scipy.optimize import minimize

from supple.identification.agreement import departure, laplace_sentence, posterior_json
from supple.identification.coast import Coast
from supple.identification.convergence import CONVERGED, judge
from supple.identification.fit import Fit, solve
from supple.identification.likelihood import LogPosterior, log_posterior
from supple.identification.noise import Noise, partials
from supple.identification.posterior import Posterior
from supple.identification.prepare import sampling_matrix, shortened
from supple.identification.problem import (
    Model,
    Problem,
    base_entries,
    make_problem,
    rough_noise,
)
from supple.identification.records import read_record
from supple.identification.sample import Plan, sample
from supple.identification.sample_file import read_chain, write_posterior
from supple.identification.unknowns import Unknown, absorbed, is_linear
from tests.identification.benches import DAMPING, STIFFNESS, Bench, make_bench
from tests.identification.replicates import (
    NAMES,
    QUICK,
    Replicate,
    drawn,
    entries_of,
    fit_of,
    ranks,
    small,
)

ROOT = Path(__file__).resolve().parent.parent.parent


@pytest.fixture(scope="module")
def fine(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Decays sampled so often that noise with a memory looks like drift."""
    return make_bench(tmp_path_factory.mktemp("fine"), finer=4)


@pytest.fixture(scope="module")
def problem(fine: Bench) -> Problem:
    return small(fine.paths[0], fine.rig.path)


@pytest.fixture(scope="module")
def replicate(problem: Problem) -> Replicate:
    return drawn(problem, np.random.default_rng(3))


@pytest.fixture(scope="module")
def posterior(replicate: Replicate) -> Posterior:
    return sample(fit_of(replicate, 1), Plan(walkers=16, warm_up=60, block=200, seed=5))


# the density


def closed_form(fit: Fit, orders: dict) -> Callable[[np.ndarray], float]:
    """Log density of the unknowns [SI] by multivariate normal densities of whole channels."""
    model = fit.model
    linear = [i for i, e in enumerate(model.entries) if is_linear(model, e)]
    prior = np.array([model.entries[i].prior / model.entries[i].scale for i in linear])
    center = np.array([model.entries[i].center / model.entries[i].scale for i in linear])
    rest = [i for i in range(len(model.entries)) if i not in linear]

    def value(natural: np.ndarray) -> float:
        x = fit.x.copy()
        x[linear] = center
        x[rest] = natural[: len(rest)] / model.scale[rest]
        base = model.predict(x)
        moved = []
        for i in linear:
            away = x.copy()
            away[i] += 1.0
            moved.append(model.predict(away))
        columns = np.concatenate(
            [np.stack([m[key] - base[key] for m in moved], axis=1) for key in fit.keys]
        )
        gap = np.concatenate([fit.sensor_of(key).values - base[key] for key in fit.keys])
        covariance = columns * prior**2 @ columns.T
        low, at = 0, len(rest)
        for key in fit.keys:
            high = low + len(base[key])
            numbers = natural[at : at + 1 + orders[key]]
            covariance[low:high, low:high] += noise_covariance(numbers, high - low)
            low, at = high, at + len(numbers)
        root = cho_factor(covariance)
        total = -0.5 * gap @ cho_solve(root, gap, check_finite=False) - np.sum(
            np.log(np.diag(root[0]))
        )
        for i in rest:
            entry = model.entries[i]
            if np.isfinite(entry.prior):
                total += stats.norm.logpdf(x[i] * entry.scale, entry.center, entry.prior)
        return float(total)

    return value


def noise_covariance(numbers: np.ndarray, count: int) -> np.ndarray:
    """Covariance of autoregressive noise from its innovations' deviation and partials."""
    std, *memory = numbers
    phi = (memory[0] * (1 - memory[1]), memory[1]) if len(memory) == 2 else (*memory, 0.0, 0.0)
    level = std**2 / np.prod(1 - np.square(memory))
    row = [1.0, phi[0] / (1 - phi[1])]
    while len(row) < count:
        row.append(phi[0] * row[-1] + phi[1] * row[-2])
    return level * toeplitz(np.array(row[:count]))


def log_slope(density: LogPosterior, free: np.ndarray) -> Any:
    """Log slope of the transforms, of whatever is flat in itself; by finite differences."""
    total = 0.0
    for unknown, at in zip(density.unknowns, free):
        if not unknown.is_scale:
            slope = (unknown.natural(at + 1e-6) - unknown.natural(at - 1e-6)) / 2e-6
            total += np.log(np.abs(slope))
    return total


def test_the_density_is_that_of_whole_channels(tmp_path):
    """A driven record and a decay: a zero of the drive, a delay, a gain, a clock, two laws."""
    driven = make_bench(tmp_path / "a", reaches=(1.0,), held=(), driven=True, prefix="a_")
    decay = make_bench(tmp_path / "b", reaches=(1.0,), held=(), prefix="b_")
    path = driven.paths[0]
    tolerance = "\n[channels.see_cart.tolerance]\ngain = 0.01\ndelay = 0.002\n"
    path.write_text(path.read_text() + tolerance)
    problem = make_problem([read_record(path), *decay.records], driven.rig)
    first, second = (shortened(prepared, 300) for prepared in problem.records)
    sampling = sampling_matrix(np.arange(4, 280) + 0.4, len(first.inputs))
    late = replace(first.sensors[0], values=first.sensors[0].values[4:280], sampling=sampling)
    problem = replace(problem, records=(replace(first, sensors=(late,)), second))
    entries = base_entries(problem)
    truth = {NAMES[0]: STIFFNESS, NAMES[1]: DAMPING}
    x = np.array([truth.get(entry.name, entry.value) / entry.scale for entry in entries])
    model = Model(problem, entries, (), rough_noise(problem))
    keys = solve(model, x, 0).keys
    laws = (Noise((0.5, -0.3), 2e-4), Noise((0.6,), 2e-4))
    fit = solve(replace(model, noises=dict(zip(keys, laws))), x, 0)
    fit = replace(fit, covariance=1e-4 * np.eye(len(x)))
    density = log_posterior(fit, 4)
    labels = [unknown.label for unknown in density.unknowns]
    assert any("delay" in label for label in labels) and any("gain" in label for label in labels)
    assert not any("start" in label or "offset" in label for label in labels)
    assert [bool(kind.shared) for kind in density.kinds] == [True, False]
    assert [isinstance(kind, Coast) for kind in density.kinds] == [False, True]
    wanted_of = closed_form(absorbed(fit), dict(zip(keys, (2, 1))))
    chance = np.random.default_rng(2)
    root = np.linalg.cholesky(density.covariance)
    points = density.mean + 1.5 * chance.standard_normal((4, len(density.mean))) @ root.T
    told = density(points)
    wanted = [wanted_of(density.natural(p)) + log_slope(density, p) for p in points]
    assert np.ptp(told) > 1.0
    assert told - told[0] == pytest.approx(np.array(wanted) - wanted[0], rel=1e-6, abs=1e-4)


def test_laplace_is_the_curvature_of_the_density(replicate):
    density = log_posterior(fit_of(replicate, 1), 8)
    root = np.linalg.cholesky(density.covariance)
    chance = np.random.default_rng(0)
    points = chance.standard_normal((400, len(density.mean)))
    fall = density(density.mean)[0] - density(density.mean + 0.5 * points @ root.T)
    assert np.mean(fall) == pytest.approx(0.125 * len(density.mean), rel=0.25)


@given(
    st.floats(-3, 3),
    st.sampled_from([(-np.inf, np.inf), (2.0, np.inf), (-np.inf, 9.0), (2.0, 9.0)]),
)
def test_transforms_go_there_and_back(free, bounds):
    unknown = Unknown("k", "N/m", 4.0, 0.1, *bounds, scale=2.0)
    value = unknown.natural(free)
    assert bounds[0] < value < bounds[1]
    assert unknown.free(value) == pytest.approx(free, abs=1e-9)
    here = unknown.free(4.0)
    slope = (unknown.natural(here + 1e-6) - unknown.natural(here - 1e-6)) / 2e-6
    assert unknown.slope == pytest.approx(slope, rel=1e-6)


@given(st.floats(-0.95, 0.95), st.floats(-0.45, 0.45))
def test_partial_autocorrelations_are_those_of_the_law(first, second):
    law = (first * (1 - second), second)
    assert partials(law) == pytest.approx((first, second), abs=1e-12)
    assert partials(law[1:]) == law[1:] and partials(()) == ()


def test_a_fit_without_noise_laws_is_refused(replicate):
    fit = fit_of(replicate, 1)
    weights = dict.fromkeys(fit.keys)
    with pytest.raises(ValueError, match="expected a fit with noise laws"):
        log_posterior(replace(fit, model=replace(fit.model, noises=weights)))


# a second sampler


def decay_density(replicate: Replicate, order: int) -> Callable[[np.ndarray], float]:
    """Log density of (k, c, size, memory) from the closed form of a free decay."""
    prepared = replicate.problem.records[0]
    values = prepared.sensors[0].values
    time = np.arange(len(values)) * prepared.step
    mass = replicate.problem.numbers["masses.cart.mass"]
    stiffness, damping, *linear = replicate.entries
    prior = np.array([entry.prior for entry in linear])
    center = np.array([entry.center for entry in linear])

    def value(natural: np.ndarray) -> float:
        k, c = natural[:2]
        if min(k, c, natural[2]) <= 0 or np.any(np.abs(natural[3:]) >= 0.98):
            return -np.inf
        a = c / (2 * mass)
        if a**2 >= k / mass:  # does not swing: far outside of what these priors leave
            return -np.inf
        w = np.sqrt(k / mass - a**2)
        fade = np.exp(-a * time)
        sine = fade * np.sin(w * time) / w
        columns = np.stack([fade * np.cos(w * time) + a * sine, sine, np.ones_like(time)], axis=1)
        covariance = noise_covariance(natural[2 : 3 + order], len(values))
        root = cho_factor(covariance + columns * prior**2 @ columns.T, check_finite=False)
        gap = values - columns @ center
        total = -0.5 * gap @ cho_solve(root, gap, check_finite=False) - np.sum(
            np.log(np.diag(root[0]))
        )
        for entry, number in ((stiffness, k), (damping, c)):
            total -= 0.5 * ((number - entry.center) / entry.prior) ** 2
        return float(total - np.log(natural[2]))

    return value


def weighted(density: Callable[[np.ndarray], float], start: np.ndarray, seed: int) -> tuple:
    """Means and standard deviations by importance sampling in three rounds, and its size.

    In logarithms, and for the memory in an area hyperbolic tangent: there the mode lies inside.
    """
    chance = np.random.default_rng(seed)

    def natural(free: np.ndarray) -> np.ndarray:
        return np.concatenate([np.exp(free[:3]), 0.98 * np.tanh(free[3:])])

    def log_density(free: np.ndarray) -> float:
        slope = np.sum(free[:3]) - 2 * np.sum(np.log(np.cosh(free[3:])))
        return density(natural(free)) + slope

    first = np.concatenate([np.log(start[:3]), np.arctanh(start[3:] / 0.98)])
    search: dict[str, Any] = {"method": "Nelder-Mead", "options": {"maxfev": 1500, "fatol": 1e-3}}
    middle = minimize(lambda free: -max(log_density(free), -1e9), first, **search).x
    spread = np.diag(np.repeat(0.05, len(start)) ** 2)
    weight = points = values = np.zeros(0)
    for count in (3000, 2000, 6000):
        family: Any = stats.multivariate_t
        law = family(middle, 1.2 * spread, df=6, seed=chance)
        points = law.rvs(count)
        log = np.array([log_density(point) for point in points]) - law.logpdf(points)
        weight = np.exp(log - np.max(log))
        weight /= np.sum(weight)
        middle = weight @ points
        spread = (points - middle).T * weight @ (points - middle)
        spread += 0.01 * np.diag(np.diag(spread))
        values = np.array([natural(point) for point in points])
    mean = weight @ values
    return mean, np.sqrt(weight @ (values - mean) ** 2), 1.0 / np.sum(weight**2)


CASES = {
    "ar1": (1, 0.8, 0.126),
    "white": (0, 0.0, 0.126),
    "at its bound": (0, 0.0, 0.005),
    "fast noise": (1, -0.6, 0.126),
    "faint memory": (1, 0.2, 0.126),
    "long memory": (1, 0.93, 0.126),
    "damped": (1, 0.5, 0.3),
    "well damped": (0, 0.0, 0.6),
    "well damped, ar1": (1, 0.7, 0.6),
    "a memory that is not there": (1, 0.0, 0.126),
}


@pytest.mark.parametrize(
    "name",
    [name if name == "ar1" else pytest.param(name, marks=pytest.mark.slow) for name in CASES],
)
def test_two_samplers_agree(fine, name):
    """Means within 0.1 standard deviation, widths within 5 %; the other knows nothing of ours."""
    order, memory, damping = CASES[name]
    problem = small(fine.paths[0], fine.rig.path, 120)
    entries = entries_of(problem, damping)
    one = drawn(problem, np.random.default_rng(8), memory, entries)
    ours = sample(fit_of(one, order), Plan(walkers=16, warm_up=60, block=400))
    assert ours.status == CONVERGED
    density = decay_density(one, order)
    start = np.array([u.value for u in ours.unknowns])
    mean, std, size = weighted(density, start, 2)
    assert size > 2000
    for index, unknown in enumerate(ours.unknowns):
        draws = ours.of(unknown.label)
        assert abs(np.mean(draws) - mean[index]) < 0.1 * std[index], unknown.label
        assert np.std(draws) == pytest.approx(std[index], rel=0.05), unknown.label


@pytest.fixture(scope="module")
def checked(posterior: Posterior) -> Posterior:
    """The posterior beside a fit under the noise that is there."""
    fit = absorbed(posterior.fit)
    jacobian = fit.model.jacobian(fit.x)
    fit = replace(fit, covariance=np.linalg.inv(jacobian.T @ jacobian))
    return replace(posterior, fit=fit)


def test_least_squares_agrees_where_all_is_normal(checked):
    for unknown in checked.unknowns[:2]:
        shift, width = departure(checked, unknown.label)
        assert abs(shift) < 0.1 and width == pytest.approx(1.0, abs=0.07)
    assert laplace_sentence(checked) == ""


def test_it_is_said_where_least_squares_disagrees(checked):
    narrow = replace(checked.fit, covariance=checked.fit.covariance / 4)
    said = laplace_sentence(replace(checked, fit=narrow))
    assert said.count("times as wide") == 2 and "disagree" in said


# calibration


def p_values(problem: Problem, count: int, memory: float | None, order: int) -> list[float]:
    """Of uniform ranks, and of ranks as often in the middle as outside, for each unknown."""
    table: dict[str, list[float]] = {}
    for seed in range(count):
        one = drawn(problem, np.random.default_rng([11, seed]), memory)
        found = ranks(fit_of(one, order), one.truth, replace(QUICK, seed=seed))
        for label, rank in found.items():
            table.setdefault(label, []).append(rank)
    told = []
    for label, several in table.items():
        if memory is None or label in NAMES:
            shares = np.array(several)
            told.append(stats.kstest(shares, "uniform").pvalue)
            told.append(stats.kstest(2 * np.abs(shares - 0.5), "uniform").pvalue)
    return told


def worst_after_holm(told: list[float]) -> float:
    """Smallest p-value, corrected for the number of them."""
    return min(told) * len(told)


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform(problem):
    assert worst_after_holm(p_values(problem, 20, None, 1)) > 0.01


@pytest.mark.slow
def test_a_wrong_likelihood_fails_the_same_test(problem):
    """White noise assumed, where its memory is 0.9."""
    assert worst_after_holm(p_values(problem, 14, 0.9, 0)) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.0, 0.9, None])
def test_ranks_of_the_truth_are_uniform_in_200_replicates(problem, memory):
    order = 0 if memory == 0.0 else 1
    assert worst_after_holm(p_values(problem, 200, memory, order)) > 0.01


# the gate


def walks(steps: int, memory: float, seed: int = 0, apart: float = 0.0) -> np.ndarray:
    """Draws of one unknown by four ensembles of ten walkers, autoregressive in time."""
    chance = np.random.default_rng(seed)
    draws = np.zeros((steps, 4, 10, 1))
    now = chance.standard_normal((4, 10, 1))
    for step in range(steps):
        now = memory * now + np.sqrt(1 - memory**2) * chance.standard_normal(now.shape)
        draws[step] = now + apart * np.arange(4)[:, None, None]
    return draws


def test_the_gate_lets_independent_draws_pass():
    told = judge(walks(400, 0.0), np.ones(1))
    assert told.passed and told.status == CONVERGED
    assert told.ess_bulk[0] == pytest.approx(16000, rel=0.1)


@pytest.mark.parametrize(
    ("draws", "memory"),
    [
        (walks(60, 0.9), 19.0),
        (walks(400, 0.0, apart=0.3), 1.0),
        (np.zeros((400, 4, 10, 1)), 1.0),
        (walks(400, 0.0), 9.0),
    ],
    ids=["short", "apart", "stuck", "memory"],
)
def test_the_gate_stops(draws, memory):
    told = judge(draws, np.array([memory]))
    assert not told.passed
    assert told.status == f"not converged: run longer (estimated {told.wanted_steps} steps)"
    assert told.wanted_steps > len(draws) and told.wanted_steps % 100 == 0


def test_the_estimated_steps_are_enough():
    short = judge(walks(300, 0.8), np.full(1, 9.0))
    assert not short.passed
    assert judge(walks(short.wanted_steps, 0.8), np.full(1, 9.0)).passed


def test_a_short_run_says_that_it_is_short(replicate, posterior):
    short = sample(fit_of(replicate, 1), Plan(walkers=16, warm_up=60, most_steps=100, seed=5))
    assert not short.converged and short.status.startswith("not converged: run longer (estimated")
    assert np.isfinite(short.draws).all()
    assert posterior.converged and posterior.status == CONVERGED
    told = posterior_json(posterior)
    json.dumps(told, allow_nan=False)
    for one in (told["parameters"] | told["nuisances"]).values():
        assert one["r_hat"] <= 1.01 and min(one["ess_bulk"], one["ess_tail"]) >= 400
        assert one["low"] < one["mean"] < one["high"]
    assert set(told["parameters"]) == set(NAMES)
    assert len(told["integrated"]) == 3


def test_plans_that_cannot_be_kept_are_refused(replicate):
    fit = fit_of(replicate, 1)
    for plan in (Plan(ensembles=3), Plan(walkers=4), Plan(walkers=26), Plan(most_steps=50)):
        with pytest.raises(ValueError, match=r"expected .* found .* Mend:"):
            sample(fit, plan)


# checkpoints


class Interrupted(Exception):
    """Stands for a kill in the same process."""


def interrupted(fit: Fit, plan: Plan, path: Path, after: int) -> None:
    def stop(done: int, wanted: int) -> None:
        if done >= after:
            raise Interrupted

    with pytest.raises(Interrupted):
        sample(fit, plan, path, stop)


def test_what_was_interrupted_goes_on_to_the_same_chain(replicate, tmp_path):
    fit, plan = fit_of(replicate, 1), replace(QUICK, block=20)
    whole = sample(fit, plan)
    path = tmp_path / "here" / "chain.h5"
    for after in (50, 80):
        interrupted(fit, plan, path, after)
        assert path.is_file()
    again = sample(fit, plan, path)
    assert np.array_equal(again.draws, whole.draws)
    assert np.array_equal(again.log_density, whole.log_density)
    assert np.array_equal(again.acceptance, whole.acceptance)
    longer = sample(fit, replace(plan, most_steps=160), path)
    assert len(longer.draws) > len(whole.draws)
    assert np.array_equal(longer.draws[: len(whole.draws)], whole.draws)
    told = []
    sample(fit, replace(plan, most_steps=160), path, lambda done, wanted: told.append(done))
    assert not told, "a chain that is complete is not sampled again"


def test_other_chains_and_broken_files_are_not_taken_up(replicate, tmp_path):
    fit, plan = fit_of(replicate, 1), replace(QUICK, block=20)
    path = tmp_path / "chain.h5"
    first = sample(fit, plan, path)
    other = sample(fit, replace(plan, seed=1), path)
    assert not np.array_equal(first.draws, other.draws)
    path.write_bytes(path.read_bytes()[:5000])
    assert read_chain(path, "") is None
    assert np.array_equal(sample(fit, plan, path).draws, first.draws)


def test_ensembles_start_apart_and_wide(replicate, tmp_path):
    path = tmp_path / "chain.h5"
    sample(fit_of(replicate, 1), replace(QUICK, warm_up=20, most_steps=28, block=8), path)
    with h5py.File(path) as file:
        first = np.asarray(file["points"])[0]
    assert np.mean(np.std(first, axis=(0, 1))) > 1.3
    assert np.mean(np.std(np.mean(first, axis=1), axis=0)) > 0.5


def test_a_place_that_cannot_be_written_to_is_said(replicate, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match="a place to write to"):
        sample(fit_of(replicate, 1), QUICK, tmp_path / "file" / "chain.h5")


def killed_runs(fine: Bench, folder: Path, kills: int, seed: int) -> list[np.ndarray]:
    """Draws of runs that were killed at random moments of sampling, and each time taken up.

    Whenever one comes to its end before all kills are done, another is begun from nothing.
    """
    folder.mkdir()
    command = [sys.executable, "-m", "tests.identification.replicates"]
    command += [str(fine.paths[0]), str(fine.rig.path), str(folder)]
    settings = {"JAX_COMPILATION_CACHE_DIR": str(folder.parent / "compiled")}
    settings |= {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
    chance, ends, begun = np.random.default_rng(seed), [], folder / "begun"
    while kills > 0 or not ends:
        begun.unlink(missing_ok=True)
        run = subprocess.Popen(command, cwd=ROOT, env=os.environ | settings)
        while run.poll() is None and not begun.exists():
            time.sleep(0.005)
        try:
            run.wait(float(chance.uniform(0.0, 1.5)) if kills > 0 else None)
        except subprocess.TimeoutExpired:
            run.send_signal(signal.SIGKILL)
            run.wait()
            kills -= 1
            continue
        assert run.returncode == 0
        ends.append(np.load(folder / "draws.npy"))
        (folder / "chain.h5").unlink()
    return ends


def uninterrupted(problem: Problem) -> np.ndarray:
    one = drawn(problem, np.random.default_rng(3))
    return sample(fit_of(one, 1), replace(QUICK, block=8, most_steps=250, seed=5)).draws


@pytest.mark.slow
@pytest.mark.parametrize("kills", [2, 20])
def test_killed_processes_go_on_to_the_same_chain(fine, problem, tmp_path, kills):
    wanted = uninterrupted(problem)
    for found in killed_runs(fine, tmp_path / "run", kills, 1):
        assert np.array_equal(found, wanted)


# files


def test_another_program_reads_the_file(posterior, tmp_path):
    path = write_posterior(posterior, tmp_path / "posterior.nc", {"seed": "5"})
    assert [file.name for file in tmp_path.iterdir()] == ["posterior.nc"]
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        assert {"posterior", "sample_stats", "constant_data"} <= set(tree.children)
        assert tree.attrs["inference_library"] == "emcee" and tree.attrs["status"] == CONVERGED
        read = tree["posterior"].to_dataset()
        assert set(read.data_vars) == {unknown.label for unknown in posterior.unknowns}
        assert read.sizes == {"chain": 4 * 16, "draw": len(posterior.draws)}
        assert sorted(set(read["ensemble"].values)) == [0, 1, 2, 3]
        index = posterior.index(NAMES[0])
        one = read[NAMES[0]]
        assert one.attrs["units"] == "N/m"
        assert np.array_equal(one.values[17], posterior.draws[:, 1, 1, index])
        assert tree["sample_stats"]["lp"].shape == one.shape
        options: dict[str, Any] = {"kind": "diagnostics", "round_to": "none"}
        told = summary(tree, **options)
    for number, unknown in enumerate(posterior.unknowns):
        row = told.loc[unknown.label]
        assert row["r_hat"] <= posterior.convergence.r_hat[number] + 1e-9
        assert row["ess_bulk"] == pytest.approx(posterior.convergence.ess_bulk[number])


def test_names_with_a_slash_open_no_group(posterior, tmp_path):
    first = replace(posterior.unknowns[0], label="spring/cubic_stiffness")
    named = replace(posterior, unknowns=(first, *posterior.unknowns[1:]))
    path = write_posterior(named, tmp_path / "posterior.nc", {})
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        assert tree["posterior"]["spring:cubic_stiffness"].attrs["long_name"] == first.label


def test_noise_sizes_are_found(posterior, replicate):
    for unknown in posterior.unknowns[2:]:
        draws = posterior.of(unknown.label)
        truth = replicate.truth[unknown.label]
        assert abs(np.mean(draws) - truth) < 4 * np.std(draws)
