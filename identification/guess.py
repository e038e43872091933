"""First guesses out of the records themselves, so that no user has to supply one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .prepare import driven_by_force
from .problem import Model

LINEAR = ("start", "drive", "offset")
STIFFNESS_STEPS = np.exp(np.linspace(-1.4, 1.4, 41))
DAMPING_STEPS = (0.1, 0.3, 1.0, 3.0, 10.0)
"""Factors on all stiffnesses and on all dampings of the rig that are tried [-]."""


def first_guess(model: Model) -> np.ndarray:
    """Start values of all unknowns, in units of their scales [-].

    Stiffnesses and dampings are first scaled together until the first periods fit best; start
    states and offsets follow in closed form, since the linear response is linear in them.

    Args:
        model: linear model (no laws) with rough noise.

    Returns:
        Scaled unknowns inside their bounds.
    """
    x = np.array([entry.value / entry.scale for entry in model.entries])
    near = replace(model, horizon=5.0)
    stiff = constants_named(model, "stiffness")
    damped = constants_named(model, "damping")
    if stiff:
        x = _best_scaling(near, x, stiff, STIFFNESS_STEPS)
    if damped:
        x = _best_scaling(near, x, damped, np.array(DAMPING_STEPS))
    return bounded(model, solve_linear(near, x)[0])


def _best_scaling(model: Model, x: np.ndarray, which: list[int], steps: np.ndarray) -> np.ndarray:
    best, best_cost = x, np.inf
    for factor in steps:
        trial = x.copy()
        trial[which] *= factor
        trial = bounded(model, trial)
        scaled, cost = solve_linear(model, trial, with_gain=True)
        if cost < best_cost:
            best, best_cost = scaled, cost
    return best


def solve_linear(model: Model, x: np.ndarray, with_gain: bool = False) -> tuple[np.ndarray, float]:
    """Best start states and offsets for given constants, in closed form.

    Args:
        model: linear model.
        x: scaled unknowns.
        with_gain: also find the common factor of all inertias, springs and dashpots (the forced
            response's amplitude) where a force drives the records and every inertia is free.

    Returns:
        The unknowns with the linear ones solved, and the cost that is left [-].
    """
    linear = [i for i, entry in enumerate(model.entries) if entry.slot in LINEAR]
    x = x.copy()
    x[linear] = 0.0
    residual = model.residual(x)
    columns = model.columns(x, linear)
    gain = with_gain and _masses_free(model)
    if gain:
        forced = _forced(model, x, residual)
        columns = np.column_stack([columns, -forced])
        base = residual + forced
    else:
        base = residual
    # normal equations: the columns are start states and offsets with priors, well conditioned
    square = columns.T @ columns
    change = -np.linalg.pinv(square, rcond=1e-13, hermitian=True) @ (columns.T @ base)
    left = float(np.sum((base + columns @ change) ** 2))
    x[linear] = change[: len(linear)]
    if gain and change[-1] > 0:
        constants = [
            i for i, e in enumerate(model.entries) if e.slot == "numbers" and not e.nuisance
        ]
        x[constants] /= change[-1]
    return x, left


def _masses_free(model: Model) -> bool:
    driven = all(driven_by_force(prepared) for prepared in model.problem.records)
    free = {entry.keys[0] for entry in model.entries if entry.slot == "numbers"}
    wanted = [n for n in model.problem.mechanism.names if n.startswith(("masses.", "links."))]
    given = model.problem.numbers
    return (
        driven and bool(wanted) and all(name in free or given.get(name) == 0.0 for name in wanted)
    )


def _forced(model: Model, x: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Whitened forced response: what the residual lacks of the measured values."""
    silent = []
    for prepared in model.problem.records:
        sensors = tuple(replace(s, values=np.zeros_like(s.values)) for s in prepared.sensors)
        silent.append(replace(prepared, sensors=sensors))
    problem = replace(model.problem, records=tuple(silent))
    return -replace(model, problem=problem).residual(x)


def constants_named(model: Model, word: str) -> list[int]:
    """Indices of the free constants of the rig with this word in their names [-]."""
    return [
        i
        for i, entry in enumerate(model.entries)
        if entry.slot == "numbers" and not entry.nuisance and word in entry.keys[0]
    ]


def bounded(model: Model, x: np.ndarray) -> np.ndarray:
    """Scaled unknowns moved inside their bounds [-]."""
    low = np.array([entry.low / entry.scale for entry in model.entries])
    high = np.array([entry.high / entry.scale for entry in model.entries])
    room = np.minimum(high - low, 1.0) * 1e-6
    return np.clip(x, low + room, high - room)
