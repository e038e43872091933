"""Coordinates in which a bent valley of a posterior is straight, learned before it is sampled.

Where two constants trade off, as a stiff sleeve and a soft shaft do, the posterior is a valley a
thousand times longer than wide, and bent: no straight coordinates follow it. A shear that is a
polynomial of the few numbers that run along the valley does, and changes no volume. It is learned
along all of the valley, as if nothing but the records and the tolerances told where one is in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from .compliances import Compliances

PARTICLES = 800
"""Points by which a valley is learned [-]."""

KEPT = 0.3
"""Share of effective points that is kept from one temperature to the next [-]."""

COOLEST = 1e-12
"""Smallest power of the likelihood that is begun with [-]."""

MOST_LEVELS = 80
"""Powers of the likelihood after which a valley is given up [-]."""

NOWHERE = -1e12
"""Log likelihood of what cannot be simulated [-]."""

WIDER = 1.1
"""How much wider than a valley its own draws are [-]."""

SWEEPS = 6
"""Moves of every point at each temperature [-]."""

ANCHORS = 240
"""Points that are put about the fit [-]."""

SETTLING = 45
"""Further moves under the whole likelihood [-]."""

DEGREE = 5.0
"""Largest degree of the polynomial [-]."""

WEIGHTS = (1.0, 1.5, 2.5, 2.5, 2.5, 2.5)
"""What each lead, the longest first, counts in it [-]."""

FAR = 6.0
"""Standard deviations of what is felt beyond which a polynomial is not followed [-]."""


@dataclass(frozen=True, eq=False)
class Valley:
    """A change of coordinates that straightens a valley: what leads, then the rest about its bend.

    Attributes:
        told: the density and its coordinates.
        order: coordinates that lead, then the rest that may bend, then the others, shape (d,) [-].
        mean: in this order, shape (d,) [-].
        lead: lower root of the leads' covariance, shape (r, r) [-].
        middle: of what is felt of the leads, shape (r,) [-].
        size: its standard deviation, shape (r,) [-].
        bend: coefficients of the rest's polynomial in it, shape (terms, d - r) [-].
        rest: lower root of what is left of the rest's covariance, shape (d - r, d - r) [-].
    """

    told: Compliances
    order: np.ndarray
    mean: np.ndarray
    lead: np.ndarray
    middle: np.ndarray
    size: np.ndarray
    bend: np.ndarray
    rest: np.ndarray

    def _bent(self, along: np.ndarray) -> np.ndarray:
        felt = (self.told.felt(along) - self.middle) / self.size
        return _terms(np.clip(felt, -FAR, FAR)) @ self.bend

    def point(self, straight: np.ndarray) -> np.ndarray:
        """Points of straight coordinates, shape (..., d) [-]."""
        count = len(self.lead)
        along = straight[..., :count] @ self.lead.T + self.mean[:count]
        across = straight[..., count:] @ self.rest.T + self.mean[count:] + self._bent(along)
        found = np.empty_like(straight)
        found[..., self.order] = np.concatenate([along, across], axis=-1)
        return found

    def straight(self, points: np.ndarray) -> np.ndarray:
        """Straight coordinates of points, shape (..., d) [-]."""
        count = len(self.lead)
        both = points[..., self.order]
        left = both[..., count:] - self.mean[count:] - self._bent(both[..., :count])
        parts = [
            np.linalg.solve(root, part[..., None])[..., 0]
            for root, part in (
                (self.lead, both[..., :count] - self.mean[:count]),
                (self.rest, left),
            )
        ]
        return np.concatenate(parts, axis=-1)


def _terms(felt: np.ndarray) -> np.ndarray:
    """Monomials of what is felt, shape (..., terms), the constant first [-]."""
    found = [np.prod(felt**powers, axis=-1) for powers in _powers(felt.shape[-1])]
    return np.stack(found, axis=-1)


@cache
def _powers(count: int) -> tuple[tuple[int, ...], ...]:
    """Powers of the leads in each monomial."""
    found = product(*(range(int(DEGREE / weight) + 1) for weight in WEIGHTS[:count]))
    return tuple(p for p in found if np.dot(p, WEIGHTS[:count]) <= DEGREE)


def find_valley(told: Compliances, chance: np.random.Generator) -> Valley | None:
    """Learn a valley by points that follow it while the likelihood grows sharp.

    Args:
        told: the density, in coordinates in which valleys are bent as little as may be.
        chance: draws.

    Returns:
        The valley in those coordinates; None where none is found.

    Source: Del Moral, Doucet and Jasra 2006, doi:10.1111/j.1467-9868.2006.00553.x;
    tests/identification/test_valley.py.
    """
    path = _Path(told)
    cloud = path.begin(chance)
    for _ in range(MOST_LEVELS):
        if cloud.power >= 1.0:
            return path.settled(cloud, chance).valley
        cloud = path.sharper(cloud, chance)
    return None


@dataclass(frozen=True, eq=False)
class _Cloud:
    """Points on the path, what they are worth, and the valley in which they lie."""

    points: np.ndarray
    worth: np.ndarray
    power: float
    valley: Valley


@dataclass(frozen=True, eq=False)
class _Path:
    """From a round cloud about the fit to the posterior: the likelihood's power grows."""

    told: Compliances

    def worth(self, points: np.ndarray) -> np.ndarray:
        """What makes the density at points, in logarithms, shape (4, n).

        The round cloud, what is known along the valley, likelihood, what the whole prior adds.
        """
        pulls, volume, likelihood = self.told.parts(points)
        likelihood = np.nan_to_num(likelihood, nan=NOWHERE, neginf=NOWHERE)
        away = points / self.told.reach
        round_ = -0.5 * np.sum(away[:, self.told.bent] ** 2, axis=1)
        along = 0.5 * np.sum(away[:, self.told.free_leads] ** 2, axis=1)
        known = np.maximum(pulls - along, NOWHERE)
        return np.array([round_, known, np.maximum(likelihood, NOWHERE), volume + along])

    @staticmethod
    def mixed(worth: np.ndarray, power: float) -> np.ndarray:
        """Log density where the likelihood has a power, shape (n,); of 2 the posterior's own."""
        if power > 1.0:
            return worth[1] + worth[2] + worth[3]
        share = power**0.25
        return (1.0 - share) * worth[0] + share * worth[1] + power * worth[2]

    def begin(self, chance: np.random.Generator) -> _Cloud:
        """The round cloud."""
        size, bent = self.told.reach, self.told.bent
        points = np.zeros((PARTICLES, len(size)))
        points[:, bent] = chance.standard_normal((PARTICLES, len(bent))) * size[bent]
        valley = learned(self.told, points)
        return _Cloud(points, self.worth(points), 0.0, valley)

    def sharper(self, cloud: _Cloud, chance: np.random.Generator) -> _Cloud:
        """The cloud under a higher power of the likelihood."""
        now = self.mixed(cloud.worth, cloud.power)

        def kept(power: float) -> float:
            return effective(self.mixed(cloud.worth, power) - now)

        low, high = max(cloud.power, COOLEST), 1.0
        if kept(high) < KEPT:
            for _ in range(40):
                middle = np.sqrt(low * high)
                low, high = (middle, high) if kept(middle) > KEPT else (low, middle)
            high = max(low, 1.01 * cloud.power)
        weight = self.mixed(cloud.worth, high) - now
        weight = np.exp(weight - np.max(weight))
        valley = learned(self.told, cloud.points, weight)
        which = _drawn(weight, chance)
        points, worth = cloud.points[which], cloud.worth[:, which]
        for sweep in range(SWEEPS):
            points, worth = self.moved(points, worth, high, valley, sweep % 2 == 0, chance)
            valley = learned(self.told, points)
        return _Cloud(points, worth, high, valley)

    def settled(self, cloud: _Cloud, chance: np.random.Generator) -> _Cloud:
        """The cloud after some more moves, so that it fills the valley, and then the posterior.

        Some of it is put about the fit first, for a valley that misses the fit is none.
        """
        points, worth, valley = cloud.points, cloud.worth, cloud.valley
        near = self.told.near_fit(ANCHORS, chance)
        points, worth = points.copy(), worth.copy()
        points[:ANCHORS], worth[:, :ANCHORS] = near, self.worth(near)
        seen = [points]
        valley = learned(self.told, points)
        for sweep in range(SETTLING):
            power = 1.0 if 3 * sweep < SETTLING else 2.0
            points, worth = self.moved(points, worth, power, valley, sweep % 2 == 0, chance)
            if sweep % 3 == 2:
                seen.append(points)
                valley = learned(self.told, np.concatenate(seen))
        return _Cloud(points, worth, 1.0, valley)

    def moved(
        self,
        points: np.ndarray,
        worth: np.ndarray,
        power: float,
        valley: Valley,
        alone: bool,
        chance: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Every point moved once: drawn from the valley alone, or by a difference of two others."""
        now, size = valley.straight(points), len(points)
        inner = len(self.told.bent)
        if alone:
            new = WIDER * chance.standard_normal((size, inner))
            back = 0.5 * np.sum(new**2 - now[:, :inner] ** 2, axis=1) / WIDER**2
        else:
            one, two = (now[chance.permutation(size), :inner] for _ in range(2))
            length = 2.38 / np.sqrt(2.0 * inner) * (0.2 + 0.8 * chance.random((size, 1)))
            new = now[:, :inner] + length * (one - two) + 0.01 * chance.standard_normal(one.shape)
            back = np.zeros(size)
        new = np.concatenate([new, now[:, inner:]], axis=1)
        tried = valley.point(new)
        told = self.worth(tried)
        rise = self.mixed(told, power) - self.mixed(worth, power) + back
        taken = np.log(chance.random(size)) < rise
        return np.where(taken[:, None], tried, points), np.where(taken, told, worth)


def effective(log_weight: np.ndarray) -> float:
    """Share of draws that count, of draws with these log weights, shape (n,) [-]."""
    log_weight = np.nan_to_num(log_weight, nan=-np.inf, neginf=-np.inf)
    if not np.any(np.isfinite(log_weight)):
        return 0.0
    weight = np.exp(log_weight - np.max(log_weight))
    return float(np.sum(weight) ** 2 / np.sum(weight**2) / len(weight))


def _drawn(weight: np.ndarray, chance: np.random.Generator) -> np.ndarray:
    """Systematic draws by weight."""
    at = (np.arange(len(weight)) + chance.random()) / len(weight)
    return np.minimum(np.searchsorted(np.cumsum(weight) / np.sum(weight), at), len(weight) - 1)


def learned(told: Compliances, points: np.ndarray, weight: np.ndarray | None = None) -> Valley:
    """The valley of points, shape (n, d), that may have weights, shape (n,) [-].

    Of a noise's numbers Laplace's approximation is believed.
    """
    share = np.ones(len(points)) if weight is None else weight
    weight = share / np.sum(share)
    leads = list(told.leads)
    rest = [i for i in told.bent if i not in leads]
    others = [i for i in range(len(told.bends)) if i not in leads and i not in rest]
    mean = weight @ points
    along = points[:, leads]
    felt = told.felt(along)
    middle = weight @ felt
    size = np.sqrt(weight @ (felt - middle) ** 2) + 1e-12
    terms = _terms(np.clip((felt - middle) / size, -FAR, FAR))
    across, root = points[:, rest] - mean[rest], np.sqrt(weight)[:, None]
    ridge = 1e-4 * np.eye(terms.shape[1])
    bend = np.linalg.lstsq(
        np.concatenate([terms * root, ridge]),
        np.concatenate([across * root, np.zeros((len(ridge), len(rest)))]),
        rcond=None,
    )[0]
    inner = len(rest)
    width = np.zeros((inner + len(others), inner + len(others)))
    width[:inner, :inner] = _root_of(across - terms @ bend, weight)
    width[inner:, inner:] = np.linalg.cholesky(told.covariance[np.ix_(others, others)])
    order = np.array([*leads, *rest, *others], dtype=int)
    center = np.concatenate([mean[[*leads, *rest]], np.zeros(len(others))])
    bend = np.pad(bend, ((0, 0), (0, len(others))))
    lead = _root_of(along - mean[leads], weight)
    return Valley(told, order, center, lead, middle, size, bend, width)


def _root_of(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Lower root of a weighted covariance, shrunk a little towards no correlation."""
    size = values.shape[1]
    spread = (values * weight[:, None]).T @ values
    share = min(0.5, size * float(np.sum(weight**2)) / np.sum(weight) ** 2)
    spread = (1.0 - share) * spread + share * np.diag(np.diag(spread))
    std = np.sqrt(np.maximum(np.diag(spread), 1e-300))
    return std[:, None] * np.linalg.cholesky(spread / np.outer(std, std) + 1e-12 * np.eye(size))
