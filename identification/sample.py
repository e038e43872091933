"""sample(fit) -> Posterior: ensembles of walkers that survive a kill and pass a gate."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import emcee
import numpy as np

from .aim import TAILS, Aim, learned_aim, round_aim
from .convergence import DROPPED, judge
from .coordinates import Coordinates, coordinates_of
from .fit import Fit
from .likelihood import LogPosterior, log_posterior
from .posterior import Posterior
from .sample_file import Chain, read_chain, write_chain

Progress = Callable[[int, int], None]

SPREAD = 2.0
"""How far ensembles start from the fit, and walkers from their ensemble's middle, in standard
deviations of Laplace's approximation over the square root of 2 [-]."""

SHARES = (0.25, 0.75)
"""Smallest and largest share of independent proposals [-]: twice what is accepted of them."""

NEAR_FIT = 6
"""One walker in so many begins at the fit, where coordinates follow a bent valley [-]."""

MIXTURE = {"differences": 0.5, "jumps": 0.1, "snooker": 0.15, "stretch": 0.25}
"""Shares of the other proposals in what is left [-]."""


@dataclass(frozen=True)
class Plan:
    """How much is sampled.

    Attributes:
        ensembles: independent ensembles, at least four [-].
        walkers: of each ensemble; 0 for a number that suits the unknowns [-].
        warm_up: steps after which the proposals have learned and counting begins [-].
        block: steps between two checkpoints, at least [-]; later blocks grow with the chain.
        most_steps: where an ensemble stops whether converged or not [-].
        seed: of everything that is drawn.
    """

    ensembles: int = 4
    walkers: int = 0
    warm_up: int = 150
    block: int = 250
    most_steps: int = 6000
    seed: int = 0


def sample(
    fit: Fit,
    plan: Plan | None = None,
    checkpoint: Path | None = None,
    progress: Progress = lambda done, wanted: None,
) -> Posterior:
    """Sample the posterior of a fit until the gate is passed.

    The ensembles start overdispersed about Laplace's approximation, each about a middle of its
    own; where that does not serve, in coordinates along a bent valley that is learned first.
    Walkers move by differences, jumps, snooker and stretch moves of their own ensemble, and by
    proposals drawn independently of where they stand, from a heavy-tailed density that is learned
    once, in the warm-up.

    Args:
        fit: with errors attached.
        plan: how much is sampled.
        checkpoint: HDF5 file that is replaced whole after every block; where it holds the
            beginning of this very chain, that is taken up, and the end is the same to the last
            bit. It is left there, with the whole chain.
        progress: told the steps done and the steps thought to be needed [-].

    Returns:
        The posterior; `status` says whether it has converged, or how long to go on.

    Raises:
        ValueError: for a plan that cannot be kept, or a checkpoint that cannot be written.

    Source: Foreman-Mackey et al. 2013, doi:10.1086/670067; ter Braak and Vrugt 2008,
    doi:10.1007/s11222-008-9104-9; tests/identification/test_sample.py.
    """
    density = log_posterior(fit)
    plan = _checked(plan or Plan(), len(density.unknowns))
    density = replace(density, batch=plan.walkers // 2)  # emcee moves half of them at once
    where = coordinates_of(density, plan.seed)
    told = _fingerprint(fit, density, where, plan)
    chain = read_chain(checkpoint, told) if checkpoint is not None else None
    if chain is None:
        chain = _begin(density, where, plan)
    verdict = None
    while True:
        if chain.steps >= plan.warm_up + plan.block or chain.steps >= plan.most_steps:
            dropped = max(plan.warm_up, int(DROPPED * chain.steps))
            kept = chain.points[dropped:]
            draws = where.natural(kept)
            verdict = judge(draws, _memory(kept), dropped)
            if verdict.passed or chain.steps >= plan.most_steps:
                break
        wanted = verdict.wanted_steps if verdict else plan.warm_up + 2 * plan.block
        step = min(_length(chain.steps, plan), plan.most_steps - chain.steps)
        chain = _advance(where, plan, chain, step, lambda n, w=wanted: progress(n, w))
        if checkpoint is not None:
            write_chain(checkpoint, told, chain)
    acceptance = np.mean(chain.accepted, axis=1) / max(chain.steps, 1)
    return Posterior(
        fit,
        density.unknowns,
        draws,
        chain.density[dropped:],
        acceptance,
        dropped,
        verdict,
        verdict.status,
    )


def _checked(plan: Plan, size: int) -> Plan:
    """The plan with a number of walkers that suits `size` unknowns."""
    walkers = plan.walkers or 4 * max(5, math.ceil((size + 1) / 2))
    for what, found, least in (
        ("ensembles", plan.ensembles, 4),
        ("walkers", walkers, 2 * size),
        ("warm_up", plan.warm_up, 20),
        ("block", plan.block, 8),
        ("most_steps", plan.most_steps, plan.warm_up + 8),
    ):
        if found < least:
            raise ValueError(
                f"plan: {what}: expected at least {least}, found {found}. Mend: ask for more."
            )
    if walkers % 4:
        raise ValueError(
            f"plan: walkers: expected a multiple of 4, found {walkers}. Mend: ask for "
            f"{walkers + 4 - walkers % 4}."
        )
    return replace(plan, walkers=walkers)


def _length(steps: int, plan: Plan) -> int:
    """Steps of the next block: the warm-up is one, later ones grow with the chain."""
    return plan.warm_up - steps if steps < plan.warm_up else max(plan.block, steps // 4)


def _fingerprint(fit: Fit, density: LogPosterior, where: Coordinates, plan: Plan) -> str:
    """Sum of all that decides a chain, but its length."""
    import jax

    model = fit.model
    words = (
        emcee.__version__,
        jax.__version__,
        model.problem.rig.sha256,
        [(place, law.name) for place, law in model.causes],
        [(p.name, p.ports, [sensor.port for sensor in p.sensors]) for p in model.problem.records],
        [(unknown.label, unknown.transform, unknown.is_scale) for unknown in density.unknowns],
        replace(plan, most_steps=0, block=0),
        (SPREAD, TAILS, SHARES, MIXTURE),
    )
    digest = hashlib.sha256(repr(words).encode())
    for array in (
        density.mean,
        density.covariance,
        *jax.tree.leaves((density.prior, density.data)),
    ):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(where.natural(0.1 * np.eye(len(density.mean))).tobytes())
    return digest.hexdigest()


def _begin(density: LogPosterior, where: Coordinates, plan: Plan) -> Chain:
    """Overdispersed starts at which the density is not zero, and a generator an ensemble."""
    size, spread = len(density.unknowns), SPREAD / math.sqrt(2.0)
    points, states, densities = [], [], []
    for ensemble in range(plan.ensembles):
        seed = np.random.SeedSequence([plan.seed, ensemble]).generate_state(1)
        chance = np.random.RandomState(seed)
        middle = spread * chance.randn(size)
        start = np.zeros((plan.walkers, size))
        known = np.full(plan.walkers, -np.inf)
        if where.best is not None:  # some from the fit: a valley that misses it must not pass
            few = plan.walkers // NEAR_FIT
            start[:few] = where.best + 0.1 * chance.randn(few, size)
            known[:few] = where.log_density(start[:few])
        for attempt in range(40):
            lost = ~np.isfinite(known)
            if not lost.any():
                break
            near = 0.8**attempt  # draws that were nowhere are drawn nearer to the fit
            start[lost] = near * (middle + spread * chance.randn(int(lost.sum()), size))
            known[lost] = where.log_density(start[lost])
        points.append(start)
        densities.append(known)
        states.append(chance.get_state())
    if not np.all(np.isfinite(densities)):
        raise ValueError(
            "posterior: expected a density that is positive near the fit, found zero there. "
            "Mend: fit again from another start."
        )
    empty = np.zeros((0, plan.ensembles, plan.walkers, size))
    return Chain(
        empty,
        empty[..., 0],
        np.zeros((plan.ensembles, plan.walkers)),
        np.array(points),
        np.array(densities),
        tuple(states),
    )


def _advance(
    where: Coordinates,
    plan: Plan,
    chain: Chain,
    steps: int,
    progress: Callable[[int], None],
) -> Chain:
    """The chain, longer by some steps; ensembles go side by side, each with its own generator."""
    aim = _learned(where, plan, chain)

    def one(index: int) -> tuple[emcee.EnsembleSampler, Any]:
        sampler = emcee.EnsembleSampler(
            plan.walkers,
            chain.last.shape[-1],
            where.log_density,
            moves=_moves(aim),
            vectorize=True,
        )
        start = emcee.State(
            chain.last[index],
            log_prob=chain.last_density[index],
            random_state=chain.states[index],
            copy=True,
        )
        run = sampler.sample(start, iterations=steps, skip_initial_state_check=True)
        for done, _ in enumerate(run, chain.steps + 1):
            if index == 0 and done % 10 == 0:
                progress(done)
        return sampler, sampler.get_last_sample()

    with ThreadPoolExecutor(min(plan.ensembles, os.cpu_count() or 1)) as pool:
        ends = list(pool.map(one, range(plan.ensembles)))
    points = np.stack([np.asarray(sampler.get_chain()) for sampler, _ in ends], axis=1)
    densities = np.stack([np.asarray(sampler.get_log_prob()) for sampler, _ in ends], axis=1)
    return Chain(
        np.concatenate([chain.points, points]),
        np.concatenate([chain.density, densities]),
        chain.accepted + np.array([sampler.backend.accepted for sampler, _ in ends]),
        np.array([state.coords for _, state in ends]),
        np.array([state.log_prob for _, state in ends]),
        tuple(state.random_state for _, state in ends),
    )


def _moves(aim: Aim) -> list[tuple[Any, float]]:
    """New moves, for one ensemble alone: some keep numbers from step to step."""

    def proposed(points: np.ndarray, chance: Any) -> tuple[np.ndarray, np.ndarray]:
        new = aim.drawn(len(points), chance)
        return new, aim.log_density(points) - aim.log_density(new)

    others = {
        "differences": emcee.moves.DEMove(sigma=0.05),
        "jumps": emcee.moves.DEMove(sigma=1e-5, gamma0=1.0),
        "snooker": emcee.moves.DESnookerMove(),
        "stretch": emcee.moves.StretchMove(),
    }
    left = [(move, (1 - aim.share) * MIXTURE[name]) for name, move in others.items()]
    return [(emcee.moves.MHMove(proposed), aim.share), *left]


def _learned(where: Coordinates, plan: Plan, chain: Chain) -> Aim:
    """The independent proposals, in units of Laplace's approximation.

    Before the warm-up ends they are Laplace's own; afterwards those of the warm-up's second half,
    walkers that have not yet found the bulk left out. How many are accepted says how often they
    are worth a try.
    """
    size = chain.last.shape[-1]
    if chain.steps < plan.warm_up:
        return round_aim(size, SHARES[0])
    points, density = _bulk(chain, plan)
    aim = learned_aim(points, SHARES[0])
    tried = aim.drawn(2 * plan.walkers, np.random.RandomState(plan.seed))
    weight = where.log_density(tried) - aim.log_density(tried)
    now = density - aim.log_density(points)
    every = now[:: max(1, len(now) // 500)]
    accepted = np.mean(np.exp(np.minimum(0.0, weight[:, None] - every[None, :])))
    return replace(aim, share=float(np.clip(2.0 * accepted, *SHARES)))


def _bulk(chain: Chain, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """Points of the warm-up's second half and their log density, but for those still lost."""
    size = chain.last.shape[-1]
    half = slice(plan.warm_up // 2, plan.warm_up)
    points = chain.points[half].reshape(-1, size)
    density = chain.density[half].ravel()
    found = density > np.max(density) - size - 5.0 * math.sqrt(size) - 5.0
    return points[found], density[found]


def _memory(points: np.ndarray) -> np.ndarray:
    """Autocorrelation time of each unknown [steps], over all walkers of all ensembles."""
    steps, ensembles, walkers, size = points.shape
    flat = points.reshape(steps, ensembles * walkers, size)
    with np.errstate(invalid="ignore", divide="ignore"):  # a walker that never moved
        return np.asarray(emcee.autocorr.integrated_time(flat, tol=0, quiet=True))
