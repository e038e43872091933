"""Data sets drawn from our own model and its priors: for tests of calibration and nothing else."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from supple.identification.fit import Fit, solve
from supple.identification.free import Entry
from supple.identification.noise import Noise
from supple.identification.prepare import shortened
from supple.identification.problem import Key, Model, Problem, make_problem
from supple.identification.records import read_record
from supple.identification.sample import Plan, sample
from supple.identification.uneven import Uneven, likeliest_law, motion_of
from supple.model.rig import read_rig
from tests.identification.benches import DAMPING, STIFFNESS

SIZE = 1e-3
SIZES = (0.5 * SIZE, 2.0 * SIZE)
SHORT = 400
QUICK = Plan(walkers=16, warm_up=40, block=100, most_steps=110)
NAMES = ("links.spring.stiffness", "links.spring.damping")


@dataclass(frozen=True)
class Replicate:
    """A problem with drawn data, and the truth behind them."""

    problem: Problem
    entries: tuple[Entry, ...]
    truth: dict[str, float]


def small(sidecar: Path, rig: Path, count: int = SHORT) -> Problem:
    """One short decay of the cart."""
    problem = make_problem([read_record(sidecar)], read_rig(rig))
    return replace(problem, records=(shortened(problem.records[0], count),))


def entries_of(problem: Problem, damping: float = DAMPING) -> tuple[Entry, ...]:
    """Two constants and the nuisances of the record, each with a proper prior."""
    name = problem.records[0].name
    constants = [
        Entry(label, "numbers", (label,), None, value, 0.0, np.inf, value, std, value, unit, False)
        for label, value, std, unit in (
            (NAMES[0], STIFFNESS, 3.0, "N/m"),
            (NAMES[1], damping, 0.4 * DAMPING, "N s/m"),
        )
    ]
    nuisances = [
        Entry(label, slot, (key,), name, center, scale=std, prior=std, center=center)
        for label, slot, key, center, std in (
            ("cart.start", "start", "0", 0.015, 0.004),
            ("cart.start_velocity", "start", "1", 0.0, 0.05),
            ("see_cart.offset", "offset", "0", 0.0, 5e-4),
        )
    ]
    return (*constants, *nuisances)


def drawn(
    problem: Problem,
    chance: np.random.Generator,
    memory: float | None = None,
    entries: Sequence[Entry] | None = None,
    growth: float = 0.0,
    tail: float = 0.0,
    sizes: tuple[float, float] = SIZES,
) -> Replicate:
    """A truth drawn from the priors, and a record that it would leave.

    The noise's size is drawn from a flat density of its logarithm, and so is its memory from a
    flat one where none is given. It grows with the motion, or is Student's, where that is told.
    """
    entries = tuple(entries or entries_of(problem))
    values = []
    for entry in entries:
        value = -np.inf
        while value <= entry.low:
            value = entry.center + entry.prior * chance.standard_normal()
        values.append(value)
    model = Model(problem, entries, (), {})
    x = np.array(values) / model.scale
    prepared = problem.records[0]
    key = prepared.name, prepared.sensors[0].channel.name
    size = float(np.exp(chance.uniform(*np.log(sizes))))
    rho = float(chance.uniform(-0.98, 0.98)) if memory is None else memory
    count, told = len(prepared.sensors[0].values), model.predict(x)[key]
    new = chance.standard_t(1 / tail, count) if tail else chance.standard_normal(count)
    new[0] /= np.sqrt(1 - rho**2)
    noise = size * np.asarray(lfilter([1.0], [1.0, -rho], new))
    seen = told + noise * np.sqrt(1.0 + (growth * motion_of(told)) ** 2)
    sensor = replace(prepared.sensors[0], values=seen)
    truth = dict(zip((entry.label for entry in entries), values))
    truth |= {f"{key[1]}.noise[{key[0]}]": size, f"{key[1]}.memory_1[{key[0]}]": rho}
    records = (replace(prepared, sensors=(sensor,)),)
    truth |= {f"{key[1]}.growth[{key[0]}]": growth, f"{key[1]}.tail[{key[0]}]": tail}
    return Replicate(replace(problem, records=records), entries, truth)


def fit_of(replicate: Replicate, order: int) -> Fit:
    """Least squares under a noise law of a stated order, from the middle of the priors."""
    prepared = replicate.problem.records[0]
    key: Key = (prepared.name, prepared.sensors[0].channel.name)
    model = Model(replicate.problem, replicate.entries, (), {key: Noise((0.3,) * order, SIZE)})
    fit = solve(model, np.array([e.value / e.scale for e in replicate.entries]))
    jacobian = fit.model.jacobian(fit.x)
    return replace(fit, covariance=np.linalg.inv(jacobian.T @ jacobian))


def under_law(fit: Fit, growing: bool, heavy: bool) -> Fit:
    """The fit again under uneven noise of a stated form."""
    (key,) = fit.keys
    values = fit.sensor_of(key).values
    for _ in range(4):
        noise = fit.model.noises[key]
        assert isinstance(noise, Noise)
        motion = motion_of(fit.predicted[key])
        parts = float(growing), 0.1 * heavy
        law = Uneven(noise.coefficients, noise.std, *parts, motion, np.ones(len(values)))
        found = likeliest_law(law, fit.residual_of(key), values)
        fit = solve(replace(fit.model, noises={key: found}), fit.x)
    law = fit.model.noises[key]
    assert isinstance(law, Uneven)
    jacobian = replace(fit.model, noises={key: law.expected}).jacobian(fit.x)
    return replace(fit, covariance=np.linalg.inv(jacobian.T @ jacobian))


def ranks(fit: Fit, truth: dict[str, float], plan: Plan, count: int = 99) -> dict[str, float]:
    """Share of the draws below each truth, of `count` draws far apart; jittered to be continuous.

    The jitter comes from the draws themselves: nothing else is drawn by chance here.
    """
    posterior = sample(fit, plan)
    found = {}
    for unknown in posterior.unknowns:
        draws = posterior.of(unknown.label)
        few = draws[np.linspace(0, len(draws) - 1, count).astype(int)]
        below = float(np.sum(few < truth[unknown.label]))
        jitter = np.random.default_rng([plan.seed, len(found)]).random()
        found[unknown.label] = (below + jitter) / (count + 1)
    return found


def main(sidecar: str, rig: str, folder: str) -> None:
    """Sample one replicate with a checkpoint in a folder, and leave the draws there."""
    replicate = drawn(small(Path(sidecar), Path(rig)), np.random.default_rng(3))
    place = Path(folder)
    plan = replace(QUICK, block=8, most_steps=250, seed=5)
    fit = fit_of(replicate, 1)
    (place / "begun").touch()
    posterior = sample(fit, plan, place / "chain.h5")
    np.save(place / "draws.npy", posterior.draws)


if __name__ == "__main__":
    main(*sys.argv[1:])
