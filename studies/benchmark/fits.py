"""A fit and a posterior by this package, beside lmfit, emcee and PINTS over scipy's solve_ivp."""

from __future__ import annotations

import importlib
import importlib.util
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ...identification.fit import Fit, solve, with_errors
from ...identification.likelihood import LogPosterior, log_posterior
from ...identification.noise import Noise
from ...identification.problem import Model, Problem, base_entries, make_problem
from ...identification.records import read_record
from ...identification.sample import sample
from ...model.rig import read_rig

RECORDS, SAMPLES, RATE, LOUD = 10, 2000, 100.0, 30.0
"""Of the data: how many, how long, how often a second [Hz], and how far above the noise [dB]."""

MASSES = (0.8, 0.5, 0.3)
STIFFNESSES = (900.0, 500.0, 250.0)
DAMPINGS = (0.6, 0.4, 0.2)
TRUTH = np.array([*MASSES[1:], *STIFFNESSES, *DAMPINGS])
START = TRUTH * np.array([1.01, 0.99, 0.99, 1.01, 1.015, 1.4, 0.7, 1.3])
"""Two masses [kg], three stiffnesses [N/m], three dampings [N s/m]; and a first guess of them:
in frequency so near that records of 20 s do not lead into another minimum."""

TOLERANCES = (1e-6, 1e-9)
"""Relative [-] and absolute [SI], of `solve_ivp` as the peers call it."""

TIGHT, ROUGH = (1e-8, 1e-11), 1e-8
"""The same as lmfit calls it, and the squared relative step of its finite differences [-]: with
looser ones, and with its own step, which trusts sixteen digits where the solver gives six, it
stopped 20 to 30 standard errors away."""

NEAR = TRUTH * np.array([1.003, 0.997, 0.997, 1.003, 1.004, 1.1, 0.9, 1.1])
"""Where lmfit starts: nearer than this package does, which begins at `START`."""

GOALS = {"fit": 2.0, "lmfit": 50.0, "emcee": 30.0, "PINTS": 30.0, "posterior": 60.0}
"""Seconds of a fit after it is compiled [s]; how many times lmfit may take; effective samples a
second over those of emcee and PINTS [-]; seconds of a posterior that passes the gate [s]."""

AGREE = 2.0
"""Standard errors by which answers may differ and still be the same one [-]: what the records can
tell apart. By finite differences of an adaptive solver lmfit stopped 1.2 away."""

STEPS, WALKERS, CHAIN, PHASE = 3000, 40, 20_000, 200
"""Of emcee's stretch moves, and length of PINTS' chains, and of their first phase [-]."""


@dataclass(frozen=True)
class Race:
    """Processor times of one fit and one posterior, and that one's time on the clock.

    Attributes:
        fit: ours [s].
        lmfit: theirs [s]; NaN where it is not installed.
        apart: largest difference of the two answers, in standard errors [-].
        worse: how much more than ours their answer leaves of the sum of squares, which both
            least-squares fits want least, by solve_ivp [-].
        posterior: ours on the clock, gate passed, on all the cores that there are [s].
        work: the same in processor time [s].
        converged: whether it was.
        ours: effective samples of the worst constant a second of ours [1/s].
        emcee: of emcee with its own moves over solve_ivp [1/s].
        pints: of PINTS over solve_ivp [1/s]; NaN where it is not installed.
        likelihood: one by solve_ivp [s].
    """

    fit: float
    lmfit: float
    apart: float
    worse: float
    posterior: float
    work: float
    converged: bool
    ours: float
    emcee: float
    pints: float
    likelihood: float


def has(name: str) -> bool:
    """Whether a peer, an extra that only this needs, is installed."""
    return importlib.util.find_spec(name) is not None


def forces() -> np.ndarray:
    """A force on the last mass for each record, of many tones, shape (records, samples) [N]."""
    chance, times = np.random.default_rng(1), np.arange(SAMPLES) / RATE
    tones = np.arange(0.5, 9.0, 0.35)
    phases = chance.uniform(0, 2 * np.pi, (RECORDS, len(tones), 1))
    waves = np.sum(np.sin(2 * np.pi * tones[:, None] * times + phases), axis=1)
    return waves * np.minimum(1.0, np.minimum(times, times[-1] - times))


def by_solve_ivp(constants: np.ndarray, force: np.ndarray, tolerances: Any) -> np.ndarray:
    """Position of the last mass at all samples, from rest, shape (samples,) [m].

    Args:
        constants: the eight [SI].
        force: shape (samples,), straight lines between [N].
        tolerances: relative [-] and absolute [SI].
    """
    mass = np.array([MASSES[0], *constants[:2]])
    k, c = constants[2:5], constants[5:]
    matrix = np.zeros((6, 6))
    matrix[:3, 3:] = np.eye(3)
    stretch = np.eye(3) - np.eye(3, k=-1)
    matrix[3:, :3] = -(stretch.T * k @ stretch) / mass[:, None]
    matrix[3:, 3:] = -(stretch.T * c @ stretch) / mass[:, None]
    last = SAMPLES - 2

    def slope(time: float, state: np.ndarray) -> np.ndarray:
        at = min(int(time * RATE), last)
        share = time * RATE - at
        rate = matrix @ state
        rate[5] += (force[at] + share * (force[at + 1] - force[at])) / mass[2]
        return rate

    times = np.arange(SAMPLES) / RATE
    run = solve_ivp(
        slope, (0.0, times[-1]), np.zeros(6), t_eval=times, rtol=tolerances[0], atol=tolerances[1]
    )
    return run.y[2]


def written(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Write the records and their rig; returns forces [N] and readings [m], one row a record."""
    chance, pushed = np.random.default_rng(2), forces()
    seen = np.array([by_solve_ivp(TRUTH, force, (1e-10, 1e-13)) for force in pushed])
    level = np.sqrt(np.mean(seen**2, axis=1, keepdims=True)) * 10 ** (-LOUD / 20)
    seen = seen + level * chance.standard_normal(seen.shape)
    names, ends = ("one", "two", "three"), ("ground", "one", "two", "three")
    lines = ['[rig]\nkind = "chain"']
    for index, name in enumerate(names):
        told = f"{MASSES[0]}" if not index else _free(START[index - 1])
        lines.append(f"[masses.{name}]\nmass = {told}")
        between = f'["{ends[index]}", "{ends[index + 1]}"]'
        lines.append(f"[links.spring_{name}]\nbetween = {between}")
        lines.append(f"stiffness = {_free(START[2 + index])}\ndamping = {_free(START[5 + index])}")
    (folder / "rig.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    for index, (force, values) in enumerate(zip(pushed, seen, strict=True)):
        table = np.column_stack([np.arange(SAMPLES) / RATE, force, values])
        name = f"record_{index:02d}"
        np.savetxt(folder / f"{name}.csv", table, "%.10g", ",", header="t,push,tip", comments="")
        (folder / f"{name}.toml").write_text(_SIDECAR, encoding="utf-8")
    return pushed, seen


def _free(value: float) -> str:
    return f"{{ value = {value:.6g}, min = 0.0, free = true }}"


_SIDECAR = """[record]
test = "driven"
rig = "rig.toml"
[channels.time]
column = "t"
unit = "s"
[channels.push]
column = "push"
unit = "N"
role = "input"
quantity = "force"
place = "three"
[channels.tip]
column = "tip"
unit = "m"
role = "response"
quantity = "position"
place = "three"
"""


def raced() -> Race:
    """Run all of it; some minutes, nearly all of them lmfit's [s]."""
    with tempfile.TemporaryDirectory() as name:
        pushed, seen = written(Path(name))
        paths = sorted(Path(name).glob("record_*.toml"))
        rig = read_rig(Path(name) / "rig.toml")
        problem = make_problem([read_record(path) for path in paths], rig)
    level = np.sqrt(np.mean(seen**2, axis=1)) * 10 ** (-LOUD / 20)
    fit, seconds = _ours(problem, level)
    order = [_place(entry.label) for entry in fit.model.entries]
    found, error = np.zeros(8), np.zeros(8)
    for index, at in enumerate(order):
        found[at], error[at] = fit.value(index), fit.std(index)

    def residual(constants: np.ndarray, tolerances: Any = TIGHT) -> np.ndarray:
        told = [by_solve_ivp(constants, force, tolerances) for force in pushed]
        return ((seen - np.array(told)) / level[:, None]).ravel()

    began = time.process_time()
    residual(found, TOLERANCES)
    likelihood = time.process_time() - began
    theirs, answer = _by_lmfit(residual) if has("lmfit") else (np.nan, np.full(8, np.nan))
    least = float(np.sum(residual(found) ** 2))
    apart = float(np.max(np.abs(answer - found) / error))
    worse = float(np.sum(residual(answer) ** 2)) / least - 1.0 if has("lmfit") else np.nan
    sample(fit)  # compiles
    clock, began = time.perf_counter(), time.process_time()
    posterior = sample(fit)
    clock, spent = time.perf_counter() - clock, time.process_time() - began
    constants = [i for i, u in enumerate(posterior.unknowns) if u.is_constant]
    ours = float(np.min(posterior.convergence.ess_bulk[constants])) / spent
    emcee = 1.0 / (_emcee_memory(log_posterior(fit, WALKERS), constants) * likelihood)
    pints = np.nan
    if has("pints"):
        pints = 1.0 / (_pints_memory(log_posterior(fit, 1), constants) * likelihood)
    return Race(
        seconds,
        theirs,
        apart,
        worse,
        clock,
        spent,
        posterior.converged,
        ours,
        emcee,
        pints,
        likelihood,
    )


def _ours(problem: Problem, level: np.ndarray) -> tuple[Fit, float]:
    """The fit of the eight constants with its errors, and its seconds once it is compiled [s]."""
    entries = tuple(e for e in base_entries(problem) if e.slot == "numbers" and not e.nuisance)
    keys = [(p.name, s.channel.name) for p in problem.records for s in p.sensors]
    noises = {key: Noise((), float(std)) for key, std in zip(keys, level, strict=True)}
    model = Model(problem, entries, (), noises)
    start = np.array([entry.value / entry.scale for entry in entries])
    solve(model, start)
    began = time.process_time()
    fit = solve(model, start)
    seconds = time.process_time() - began
    return with_errors(fit), seconds


def _place(label: str) -> int:
    """Which of the eight constants a label names [-]."""
    names, kind = ("one", "two", "three"), label.rsplit(".", 1)[1]
    at = names.index(label.split(".")[1].removeprefix("spring_"))
    return {"mass": at - 1, "stiffness": 2 + at, "damping": 5 + at}[kind]


def _by_lmfit(residual: Callable[[np.ndarray], np.ndarray]) -> tuple[float, np.ndarray]:
    """Seconds of lmfit's least squares [s], and its answer [SI]."""
    lmfit: Any = importlib.import_module("lmfit")
    parameters = lmfit.Parameters()
    for index, value in enumerate(NEAR):
        parameters.add(f"p{index}", value=value, min=0.0)
    began = time.process_time()
    run = lmfit.minimize(
        lambda p: residual(np.array(list(p.valuesdict().values()))), parameters, epsfcn=ROUGH
    )
    return time.process_time() - began, np.array(list(run.params.valuesdict().values()))


def _emcee_memory(density: LogPosterior, constants: list[int]) -> float:
    """Likelihoods that emcee's stretch moves need for one effective sample of the worst constant.

    The density is ours: which program computes it changes the time of a chain, not the chain.
    """
    emcee: Any = importlib.import_module("emcee")
    chance = np.random.default_rng(3)
    root = np.linalg.cholesky(density.covariance)
    start = density.mean + chance.standard_normal((WALKERS, len(root))) @ root.T
    sampler = emcee.EnsembleSampler(WALKERS, len(root), density, vectorize=True)
    sampler.random_state = np.random.RandomState(3).get_state()
    sampler.run_mcmc(start, STEPS)
    chain = sampler.get_chain(discard=STEPS // 4)
    return float(np.max(emcee.autocorr.integrated_time(chain, tol=0, quiet=True)[constants]))


def _pints_memory(density: LogPosterior, constants: list[int]) -> float:
    """The same for PINTS' usual sampler, one chain of it, after its warm-up."""
    pints: Any = importlib.import_module("pints")
    emcee: Any = importlib.import_module("emcee")
    np.random.seed(4)  # noqa: NPY002  it draws from the global generator
    sampler = pints.HaarioBardenetACMC(density.mean, np.diag(density.covariance))
    rows = []
    for step in range(CHAIN):
        if step == PHASE:  # from here on it learns, as PINTS' own controller has it
            sampler.set_initial_phase(False)
        point = sampler.ask()
        told = sampler.tell(float(density(point)[0]))
        if told is not None:
            rows.append(np.array(told[0]))
    chain = np.array(rows[len(rows) // 4 :])[:, None]
    return float(np.max(emcee.autocorr.integrated_time(chain, tol=0, quiet=True)[constants]))
