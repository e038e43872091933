"""Coordinates in which a posterior is sampled: straight ones, or such as follow a bent valley."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .compliances import Compliances, root_of
from .likelihood import LogPosterior
from .valley import Valley, effective, find_valley

HEALTHY = 0.2
"""Share of Laplace's draws that must count for straight coordinates to do [-]."""

DRAWS = 192
"""Draws by which that is judged [-]."""


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Where walkers walk: numbers of order one, uncorrelated as far as is known.

    Attributes:
        natural: values [SI] of points, shape (..., d).
        log_density: of points, shape (n, d) -> (n,), up to a constant [-].
        best: where the fit lies in coordinates that were learned, shape (d,) [-]; None in others,
            whose middle it is.
    """

    natural: Callable[[np.ndarray], np.ndarray]
    log_density: Callable[[np.ndarray], np.ndarray]
    best: np.ndarray | None = None


def coordinates_of(density: LogPosterior, seed: int) -> Coordinates:
    """Coordinates that suit a log posterior.

    Args:
        density: in coordinates without bounds, with Laplace's approximation.
        seed: of the draws by which a valley is learned.

    Returns:
        Straight ones where Laplace's approximation serves; else such as follow the valley. The
        same whenever asked.

    Source: tests/identification/test_valley.py.
    """
    root = root_of(density.covariance)

    def straight(points: np.ndarray) -> np.ndarray:
        return density(density.mean + points @ root.T)

    plain = Coordinates(lambda points: density.natural(density.mean + points @ root.T), straight)
    chance = np.random.default_rng([seed, 0])
    draws = chance.standard_normal((DRAWS, len(density.mean)))
    if effective(straight(draws) + 0.5 * np.sum(draws**2, axis=1)) > HEALTHY:
        return plain
    told = Compliances(density)
    if not told.leads:
        return plain
    valley = find_valley(told, chance)
    return plain if valley is None else _along(valley)


def _along(valley: Valley) -> Coordinates:
    def log_density(points: np.ndarray) -> np.ndarray:
        return np.sum(valley.told.parts(valley.point(points)), axis=0)

    best = valley.straight(np.zeros((1, len(valley.mean))))[0]
    return Coordinates(lambda points: valley.told.natural(valley.point(points)), log_density, best)
