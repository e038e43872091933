"""How far an optimum moves with what is not known, and which design is best in spite of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from .optimum import HIGHEST, Scale, varied
from .sweep import Map, score_designs

COARSE = 400
"""Designs of the grid on which each draw's optimum is looked for at first, about [-]."""

LONGEST = 41
"""Values along an axis of that grid at most [-]."""

CLOSE = 1e-4
"""Share of a cell of that grid at which a local grid is close enough [1]."""

LEVELS = 60
"""Local grids at most [-]."""

SHARE = 0.9
"""Share of the draws that an interval holds [1]."""


@dataclass(frozen=True)
class Spread:
    """Optima of a score over draws of what is not known.

    Attributes:
        score: its name.
        is_lowest: whether the lowest value is the best; otherwise the highest.
        unknown: names of the numbers that differ from draw to draw.
        designs: each draw's own optimum: the axes' numbers by name, each of shape (draws,) [SI].
        values: the score there, shape (draws,) [SI unit of the score].
        best: the design whose score, averaged over all draws, is the best [SI].
        of_best: its score for each draw, shape (draws,) [SI unit of the score].
        of_nominal: that of the optimum of the rig as it stands, shape (draws,); None where that
            has none [SI unit of the score].
    """

    score: str
    is_lowest: bool
    unknown: tuple[str, ...]
    designs: dict[str, np.ndarray]
    values: np.ndarray
    best: dict[str, float]
    of_best: np.ndarray
    of_nominal: np.ndarray | None

    def interval(self, name: str) -> tuple[float, float]:
        """Between which values a number's optimum lies for `SHARE` of the draws [SI]."""
        low, high = np.quantile(self.designs[name], [0.5 - SHARE / 2, 0.5 + SHARE / 2])
        return float(low), float(high)

    def price(self, scores: np.ndarray) -> np.ndarray:
        """How much worse scores [SI unit] are than each draw's own optimum, as shares (draws,)."""
        sign = 1.0 if self.is_lowest else -1.0
        return sign * (scores - self.values) / np.abs(self.values)


def spread(
    found: Map,
    name: str,
    draws: Mapping[str, np.ndarray],
    nominal: Mapping[str, float] | None = None,
) -> Spread | None:
    """Find the optimum of a score for each draw, and the one design for all of them.

    Args:
        found: the map, whose axes say where to look.
        name: of the score.
        draws: numbers of the mechanism that are not known, by name, each of shape (draws,); those
            of the map's own axes are designed, and passed over [SI].
        nominal: the optimum of the mechanism as it stands [SI].

    Returns:
        The spread; None where some draw has no design with a finite score, or no axis two values.

    Raises:
        ValueError: for draws that say nothing of the mechanism's other numbers.

    Source: grids drawn closer, all draws side by side; tests/optimize/test_spread.py against the
    closed form of a released cart.
    """
    own = found.task
    designed = {axis.name for axis in own.axes}
    unknown = {
        key: np.asarray(values, float)
        for key, values in draws.items()
        if key in own.numbers and key not in designed
    }
    if not unknown:
        raise ValueError(
            f"draws: expected numbers of the rig besides {', '.join(sorted(designed))}, found "
            f"{', '.join(draws) or 'none'}. Mend: sample a rig that leaves other numbers open."
        )
    if not any(len(axis.values) > 1 for axis in own.axes):
        return None
    task, scale = varied(replace(own, scores=(name,)))
    sign = -1.0 if name in HIGHEST else 1.0
    count = len(next(iter(unknown.values())))

    def losses(points: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Of points of shape (p, n), each under the draw of that number."""
        numbers = {**scale.back(points), **{key: v[which] for key, v in unknown.items()}}
        told = sign * score_designs(task, numbers)[name]
        return np.where(np.isfinite(told), told, np.inf)

    def each(points: np.ndarray) -> np.ndarray:
        """Losses of points of shape (draws, p, n), each under its own draw."""
        which = np.repeat(np.arange(count), points.shape[1])
        return losses(points.reshape(-1, points.shape[2]), which).reshape(points.shape[:2])

    def average(points: np.ndarray) -> np.ndarray:
        """Losses of points of shape (1, p, n), averaged over all draws."""
        every = np.repeat(points[0], count, axis=0)
        told = losses(every, np.tile(np.arange(count), points.shape[1]))
        return told.reshape(points.shape[1], count).mean(axis=1)[None]

    grid, cells = _coarse(scale)
    if nominal is not None:
        told = np.array([nominal[key] for key in scale.names])
        grid = np.concatenate([grid, scale.to(told)[None]])
    rough = each(np.broadcast_to(grid, (count, *grid.shape)))
    if not np.isfinite(rough).any(axis=1).all():
        return None
    optima, values = _drawn_close(each, grid[np.argmin(rough, axis=1)], cells, scale)
    middle = grid[[int(np.argmin(rough.mean(axis=0)))]]
    best, _ = _drawn_close(average, middle, cells, scale)
    of_nominal = None if nominal is None else sign * rough[:, -1]
    return Spread(
        name,
        sign > 0,
        tuple(unknown),
        scale.back(optima),
        sign * values,
        {key: float(v[0]) for key, v in scale.back(best).items()},
        sign * each(np.broadcast_to(best, (count, *best.shape)))[:, 0],
        of_nominal,
    )


def _coarse(scale: Scale) -> tuple[np.ndarray, np.ndarray]:
    """A grid over all axes, shape (points, n), and its cells."""
    size = len(scale.names)
    each = max(3, min(LONGEST, round(COARSE ** (1.0 / size))))
    lines = [np.linspace(low, high, each) for low, high in zip(scale.low, scale.high, strict=True)]
    return np.array(list(product(*lines))), (scale.high - scale.low) / (each - 1)


def _drawn_close(
    losses: Callable[[np.ndarray], np.ndarray],
    starts: np.ndarray,
    cells: np.ndarray,
    scale: Scale,
) -> tuple[np.ndarray, np.ndarray]:
    """The lowest points of grids around the lowest so far, for several searches side by side.

    Args:
        losses: of points of shape (searches, points, n), shape (searches, points).
        starts: shape (searches, n).
        cells: size of the first grids, shape (n,).
        scale: the bounds.

    Returns:
        Points, shape (searches, n), and their losses.
    """
    half = {1: 5, 2: 2}.get(starts.shape[1], 1)
    offsets = np.array(list(product(range(-half, half + 1), repeat=starts.shape[1]))) / half
    best, widths, rows = starts.copy(), np.ones(len(starts)), np.arange(len(starts))
    lowest = losses(best[:, None])[:, 0]
    for _ in range(LEVELS):
        points = best[:, None] + widths[:, None, None] * offsets * cells
        points = np.clip(points, scale.low, scale.high)
        told = losses(points)
        at = np.argmin(told, axis=1)
        better = told[rows, at] < lowest
        inside = np.all(np.abs(offsets[at]) <= 0.5, axis=1)
        best = np.where(better[:, None], points[rows, at], best)
        lowest = np.where(better, told[rows, at], lowest)
        widths = np.where(better & ~inside, widths, widths / 2.0)
        if widths.max() < CLOSE:
            break
    return best, lowest
