"""Proposals drawn from wherever a walker stands: a heavy-tailed cloud, learned once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

TAILS = 6.0
"""Fewest degrees of freedom of the independent proposals [-]; as many as there are unknowns keep
tails that are heavier than any posterior's without wasting most of the draws on them."""


@dataclass(frozen=True, eq=False)
class Aim:
    """A heavy-tailed density about a middle.

    Attributes:
        middle: shape (d,) [-].
        root: lower root of its covariance, shape (d, d) [-].
        share: how often proposals come from it [-].
    """

    middle: np.ndarray
    root: np.ndarray
    share: float

    @property
    def tails(self) -> float:
        """Degrees of freedom [-]."""
        return max(TAILS, float(len(self.middle)))

    def log_density(self, points: np.ndarray) -> np.ndarray:
        """Log density of points, shape (n, d) -> (n,), up to a constant [-]."""
        near = np.linalg.solve(self.root, (points - self.middle).T)
        power = -0.5 * (self.tails + len(self.middle))
        return power * np.log1p(np.sum(near**2, axis=0) / self.tails)

    def drawn(self, count: int, chance: Any) -> np.ndarray:
        """Draws, shape (count, d), by a generator of NumPy's older kind [-]."""
        wide = np.sqrt(self.tails / chance.chisquare(self.tails, size=count))
        return self.middle + (chance.randn(count, len(self.middle)) * wide[:, None]) @ self.root.T


def round_aim(size: int, share: float) -> Aim:
    """A cloud of size one about zero [-]."""
    return Aim(np.zeros(size), np.eye(size), share)


def learned_aim(points: np.ndarray, share: float) -> Aim:
    """The cloud of points, shape (n, d) [-]."""
    size = points.shape[1]
    spread = np.atleast_2d(np.cov(points.T))
    # as good as the samples are few: shrink towards a round cloud of the same size
    part = size / len(points)
    spread = (1 - part) * spread + part * np.diag(np.diag(spread)) + 1e-9 * np.eye(size)
    return Aim(np.mean(points, axis=0), np.linalg.cholesky(spread), share)
