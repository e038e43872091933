"""The best design of a map, certified: polished off the grid, and checked on a finer grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.ndimage import minimum_filter
from scipy.optimize import minimize

from ..model.drives import Drive
from ..model.exact import Plan, plan_of, traced_outputs
from .sweep import Map, SweepTask, score_designs
from .sweep_designs import GRIP

HIGHEST = ("log_decrement", "log_decrement_local", "log_decrement_modal")
"""Scores whose best value is the highest; of the others it is the lowest."""

SMOOTH = ("rms", "peak", "grip_displacement_peak")
"""Scores with a gradient."""

STARTS = 3
"""Lowest points of the grid from which a polish begins [-]."""

FINER = 10
"""How many times finer the grid is on which an optimum is checked [-]."""

MOST_DESIGNS = 10_000
"""Designs of that grid at most [-]; beyond three parameters it reaches less far."""

AGREES = 1e-6
"""Share by which no design of the finer grid may be better [1]."""

PRICE = 0.01
"""How much worse a score may become while a parameter is said to be free to move [1]."""

LINE = 121
"""Designs on a line through the optimum, from bound to bound [-]."""

FLAT, SHARP = 0.3, 0.1
"""Moves of a parameter at that price above which it is flat, below which it is sharp [1]."""

LEVELS = 100
"""Local grids at most [-]."""

ROUNDS = 6
"""How often the samples that may be the largest are chosen anew [-]."""

NEAR_TOP, MOST_TOPS = 0.6, 80
"""Share of the peak from which on a sample counts [1], and the most that do [-]."""

CLOSE = 1e-9
"""Share of a cell at which a local grid is close enough [1]."""


@dataclass(frozen=True)
class Optimum:
    """The best design of a map.

    Attributes:
        score: its name.
        is_lowest: whether the lowest value is the best; otherwise the highest.
        design: the axes' numbers by name [SI].
        value: the score there [SI unit of the score].
        on_grid: the best value of the map itself [same unit].
        how: ``gradient`` where it was polished by exact derivatives, ``grid`` where by ever finer
            grids around it.
        finer: the best value of the grid `FINER` times finer around it [same unit].
        finer_designs: how many designs that grid has [-].
        bounds: ``low`` or ``high`` for each number that stands at an end of its axis.
        elasticity: change of the score for a change of each number, both as shares; empty where
            the score has no gradient [1].
        curvature: second derivative of the score by the logarithms of the numbers, as a share of
            it, shape (numbers, numbers); by the numbers themselves where an axis passes zero;
            None where the score has corners [1].
        reach: lowest and highest value of each number, all others held, at which the score is
            worse by `PRICE`; None where that lies beyond the axis [SI].
        status: ``certified``, or ``not_certified`` where the finer grid holds a better design.
    """

    score: str
    is_lowest: bool
    design: dict[str, float]
    value: float
    on_grid: float
    how: str
    finer: float
    finer_designs: int
    bounds: dict[str, str]
    elasticity: dict[str, float]
    curvature: np.ndarray | None
    reach: dict[str, tuple[float | None, float | None]]
    status: str

    def sharpness(self, name: str) -> str:
        """``flat``, ``sharp`` or ``even``: how far a number may move at the price of `PRICE`."""
        value, (low, high) = self.design[name], self.reach[name]
        moves = [abs(end - value) for end in (low, high) if end is not None]
        if not moves:
            return "flat"
        share = min(moves) / abs(value) if value else np.inf
        return "sharp" if share < SHARP else "flat" if share > FLAT else "even"


@dataclass(frozen=True)
class Scale:
    """Numbers as coordinates: by their logarithm where an axis lies above zero.

    Attributes:
        names: of the numbers.
        logs: which count by their logarithm, shape (n,) [-].
        low: lowest coordinate of each, shape (n,) [1 or SI].
        high: highest coordinate of each, shape (n,) [1 or SI].
        ends: lowest and highest number, shape (2, n) [SI].
    """

    names: tuple[str, ...]
    logs: np.ndarray
    low: np.ndarray
    high: np.ndarray
    ends: np.ndarray

    def to(self, values: np.ndarray) -> np.ndarray:
        """Coordinates [1 or SI] of numbers [SI], shape (..., n)."""
        safe = np.where(self.logs, values, 1.0)
        return np.where(self.logs, np.log(safe), values)

    def back(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """Numbers by name [SI] of points of shape (designs, n)."""
        points = np.clip(points, self.low, self.high)
        values = np.where(self.logs, np.exp(np.where(self.logs, points, 0.0)), points)
        values = np.clip(values, self.ends[0], self.ends[1])
        values = np.where(points <= self.low, self.ends[0], values)
        values = np.where(points >= self.high, self.ends[1], values)
        return {name: values[:, k] for k, name in enumerate(self.names)}


def varied(task: SweepTask) -> tuple[SweepTask, Scale]:
    """A task over those axes alone that have several values, and its numbers as coordinates.

    Args:
        task: with at least one such axis.

    Returns:
        The task, other axes held at their value, and its scale [units as in `Scale`].
    """
    axes = [axis for axis in task.axes if len(axis.values) > 1]
    ends = np.array([[axis.values.min(), axis.values.max()] for axis in axes]).T
    raw = Scale(tuple(axis.name for axis in axes), ends[0] > 0, ends[0], ends[1], ends)
    held = {axis.name: float(axis.values[0]) for axis in task.axes if len(axis.values) == 1}
    task = replace(task, numbers={**task.numbers, **held}, axes=tuple(axes))
    return task, replace(raw, low=raw.to(ends[0]), high=raw.to(ends[1]))


def certify(found: Map, name: str) -> Optimum | None:
    """Polish the best designs of a map for one score, and check the outcome on a finer grid.

    Args:
        found: the map.
        name: of one of its scores.

    Returns:
        The optimum; None where no design of the map has a finite score, or no axis two values.

    Source: exact derivatives, by jax through the exact response; L-BFGS-B for the root mean
    square; SLSQP for peaks, as a bound on all samples; grids drawn closer where a score jumps;
    tests/optimize/test_optimum.py.
    """
    lowest, sign = name not in HIGHEST, 1.0 if name not in HIGHEST else -1.0
    values = sign * np.asarray(found.scores[name], float)
    values = np.where(np.isfinite(values), values, np.inf)
    if max(found.task.shape) < 2 or not np.isfinite(values).any():
        return None
    task, scale = varied(replace(found.task, scores=(name,)))
    values = values.reshape(task.shape)
    starts, cells = _starts(task, scale, values)

    def losses(points: np.ndarray) -> np.ndarray:
        told = sign * score_designs(task, scale.back(points))[name]
        return np.where(np.isfinite(told), told, np.inf)

    slope, points = _slope(task, scale, name) if name in SMOOTH else None, starts
    if slope is not None:
        downhill = _polished if name == "rms" else _lowered
        points = np.array([downhill(slope, scale, point) for point in starts])
    if name != "rms":
        least = points[int(np.argmin(losses(points)))]
        points = _drawn_close(losses, scale, least, cells)[None]
    told = losses(np.concatenate([points, starts]))
    best = np.concatenate([points, starts])[int(np.argmin(told))]
    grid = _finer(scale, best, cells)
    finer = losses(grid)
    value, least = float(told.min()), float(finer.min())
    whole = {key: float(v[0]) for key, v in scale.back(best[None]).items()}
    elasticity, curvature = _shape(slope, scale, best, has_corners=name != "rms")
    return Optimum(
        name,
        lowest,
        whole,
        sign * value,
        sign * float(values.min()),
        "grid" if slope is None else "gradient",
        sign * least,
        len(grid),
        _bounds(scale, best),
        elasticity,
        curvature,
        _reach(losses, scale, best, value),
        "certified" if least >= value - AGREES * abs(value) else "not_certified",
    )


def _starts(task: SweepTask, scale: Scale, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The lowest of the grid's local minima, and the cells around the lowest of all."""
    places = np.flatnonzero((values == minimum_filter(values, 3, mode="nearest")).ravel())
    flat = values.ravel()
    places = places[np.isfinite(flat[places])]
    places = places[np.argsort(flat[places], kind="stable")][:STARTS]
    numbers = task.numbers_of(places)
    starts = np.stack([numbers[name] for name in scale.names], axis=1)
    cells = []
    for k, axis in enumerate(task.axes):
        own = np.sort(axis.values)
        line = np.log(own) if scale.logs[k] else own
        at = int(np.argmin(np.abs(own - starts[0, k])))
        gaps = np.diff(line)[max(0, at - 1) : at + 1]
        cells.append(float(gaps.max()))
    return np.array([scale.to(start) for start in starts]), np.array(cells)


Slope = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def _slope(task: SweepTask, scale: Scale, name: str) -> Slope:
    """What a score is the largest of, and its exact derivatives at a point.

    The root mean square is the largest of one; a peak of the magnitudes of all samples.
    """
    sensor = GRIP if name == "grip_displacement_peak" else task.sensor
    plan, grid = plan_of(task.mechanism, task.drive, (sensor,)), task.grid()
    fixed = {key: float(task.numbers[key]) for key in task.mechanism.names}
    span = (float(task.times[-1]), len(task.times))
    response = _response(plan, task.drive, span, scale.names, tuple(scale.logs.tolist()))

    def slope(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        samples, changes = (np.asarray(one, float) for one in response(point, fixed))
        samples, changes = samples[grid.low : grid.high], changes[grid.low : grid.high]
        if name != "rms":
            return np.abs(samples), np.sign(samples)[:, None] * changes
        value = np.sqrt(np.mean(samples**2))
        return value[None], (samples @ changes / (len(samples) * value or 1.0))[None]

    return slope


@lru_cache(maxsize=8)
def _response(
    plan: Plan,
    drive: Drive,
    span: tuple[float, int],
    names: tuple[str, ...],
    logs: tuple[bool, ...],
) -> Callable[[np.ndarray, Mapping[str, float]], tuple[jax.Array, jax.Array]]:
    """Samples at the plan's sensor with their derivatives by the coordinates, compiled once."""
    times = np.linspace(0.0, *span)

    def one(point: jax.Array, fixed: Mapping[str, Any]) -> jax.Array:
        own = dict(fixed)
        for k, key in enumerate(names):
            own[key] = jnp.exp(point[k]) if logs[k] else point[k]
        table = {key: jnp.reshape(value, (1,)) for key, value in own.items()}
        return traced_outputs(plan, table, drive, times)[0][0, :, 0]

    def both(point: jax.Array, fixed: Mapping[str, Any]) -> tuple[jax.Array, jax.Array]:
        """The samples, worked out once, and their slope along each coordinate."""

        def along(way: jax.Array) -> tuple[jax.Array, jax.Array]:
            return jax.jvp(lambda moved: one(moved, fixed), (point,), (way,))

        return jax.vmap(along, out_axes=(None, -1))(jnp.eye(len(names)))

    return jax.jit(both)


def _polished(slope: Slope, scale: Scale, start: np.ndarray) -> np.ndarray:
    """Downhill by the gradient, inside the map."""
    size = float(slope(start)[0][0]) or 1.0

    def shares(point: np.ndarray) -> tuple[float, np.ndarray]:
        values, gradients = slope(point)
        return float(values[0]) / size, gradients[0] / size

    found = minimize(
        shares,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=list(zip(scale.low, scale.high, strict=True)),
        options={"ftol": 1e-16, "gtol": 1e-10, "maxiter": 200},
    )
    return found.x if np.isfinite(found.fun) else start


def _lowered(slope: Slope, scale: Scale, start: np.ndarray) -> np.ndarray:
    """The largest of many is lowered: a bound above the high ones, as low as it can be."""
    point, bounds = start, [*zip(scale.low, scale.high, strict=True), (0.0, None)]
    for _ in range(ROUNDS):
        values, _ = slope(point)
        size = float(values.max()) or 1.0
        tops = np.flatnonzero(values >= NEAR_TOP * size)
        tops = tops[np.argsort(values[tops])][-MOST_TOPS:]

        def room(z: np.ndarray, tops: np.ndarray = tops, size: float = size) -> np.ndarray:
            return z[-1] - slope(z[:-1])[0][tops] / size

        def change(z: np.ndarray, tops: np.ndarray = tops, size: float = size) -> np.ndarray:
            return np.column_stack([-slope(z[:-1])[1][tops] / size, np.ones(len(tops))])

        found = minimize(
            lambda z: z[-1],
            np.append(point, 1.0),
            jac=lambda z: np.append(np.zeros(len(z) - 1), 1.0),
            method="SLSQP",
            bounds=bounds,
            constraints={"type": "ineq", "fun": room, "jac": change},
            options={"ftol": 1e-13, "maxiter": 60},
        )
        after = np.clip(found.x[:-1], scale.low, scale.high)
        reached = float(slope(after)[0].max())
        if not reached < size * (1.0 - 1e-12):
            break
        point = after
    return point


def _drawn_close(
    losses: Callable[[np.ndarray], np.ndarray], scale: Scale, start: np.ndarray, cells: np.ndarray
) -> np.ndarray:
    """The lowest point of grids around the lowest so far, drawn closer where that lies inside."""
    size = len(start)
    half = {1: 20, 2: 5, 3: 2}.get(size, 1)
    offsets = np.array(list(product(range(-half, half + 1), repeat=size))) / half
    best, width = start, 1.0
    lowest = float(losses(best[None])[0])
    for _ in range(LEVELS):
        points = np.clip(best + width * offsets * cells, scale.low, scale.high)
        told = losses(points)
        at = int(np.argmin(told))
        inside = np.all(np.abs(offsets[at]) <= 0.5)
        if told[at] < lowest:
            best, lowest = points[at], float(told[at])
            width = width / 3.0 if inside else width
        else:
            width /= 3.0
        if width < CLOSE:
            break
    return best


def _finer(scale: Scale, best: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """A grid around a point, `FINER` times finer than the map and a cell wide to each side."""
    size = len(best)
    half = min(FINER, int((MOST_DESIGNS ** (1.0 / size) - 1.0) // 2))
    offsets = np.array(list(product(range(-half, half + 1), repeat=size))) / FINER
    return np.clip(best + offsets * cells, scale.low, scale.high)


def _bounds(scale: Scale, best: np.ndarray) -> dict[str, str]:
    found = {}
    for k, name in enumerate(scale.names):
        near = 1e-9 * (scale.high[k] - scale.low[k])
        if best[k] <= scale.low[k] + near:
            found[name] = "low"
        elif best[k] >= scale.high[k] - near:
            found[name] = "high"
    return found


def _shape(
    slope: Slope | None, scale: Scale, best: np.ndarray, has_corners: bool
) -> tuple[dict[str, float], np.ndarray | None]:
    """Elasticities, and the curvature from differences of exact gradients."""
    if slope is None:
        return {}, None
    values, gradients = slope(best)
    value, gradient = values.max(), gradients[int(np.argmax(values))]
    own = np.where(scale.logs, 1.0, best)
    shares = gradient * own / value
    told = {name: float(share) for name, share in zip(scale.names, shares, strict=True)}
    if has_corners:
        return told, None
    step, rows = 1e-4, []
    for k in range(len(best)):
        own = step * (1.0 if scale.logs[k] else scale.high[k] - scale.low[k])
        ends = [slope(best + own * sign * np.eye(len(best))[k])[1][0] for sign in (1.0, -1.0)]
        rows.append((ends[0] - ends[1]) / (2.0 * own))
    curvature = np.array(rows) / value
    return told, 0.5 * (curvature + curvature.T)


def _reach(
    losses: Callable[[np.ndarray], np.ndarray], scale: Scale, best: np.ndarray, value: float
) -> dict[str, tuple[float | None, float | None]]:
    """Where each number, moved alone, has made the score worse by `PRICE`."""
    found = {}
    limit = value + PRICE * abs(value)
    for k, name in enumerate(scale.names):
        ends: list[float | None] = []
        for end in (scale.low[k], scale.high[k]):
            points = np.tile(best, (LINE, 1))
            points[:, k] = best[k] + (end - best[k]) * np.linspace(0.0, 1.0, LINE) ** 2
            told = losses(points)
            worse = np.flatnonzero(told > limit)
            if not len(worse) or worse[0] == 0:
                ends.append(None)
                continue
            at = int(worse[0])
            low, high = told[at - 1], told[at]
            share = (limit - low) / (high - low) if np.isfinite(high) else 0.0
            point = points[at - 1] + share * (points[at] - points[at - 1])
            ends.append(float(scale.back(point[None])[name][0]))
        found[name] = (ends[0], ends[1])
    return found
