"""Coordinates in which constants that trade off do so along a straight line: compliances add.

Springs in a row add their compliances ``1 / k``, and dashpots beside them their losses ``c / k^2``;
what a record tells is mostly a sum of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import expit, log_ndtr, ndtr, ndtri

from .descent import spring_pairs
from .likelihood import LogPosterior
from .unknowns import Unknown

FELT_LINEARLY = 0.01
"""How much a number without bounds, as a gain, bends what is seen, beside a logarithm [-]."""

REACH = 1.5
"""How far a compliance may lie from the fit before anything is told, as a share of it [-]."""

LONG = 0.1
"""Error of a compliance, as a share of it, from which on it leads along a valley [-]."""

TOLD = 0.003
"""The same of a tolerance [-]."""

MOST_LEADS = 5
"""Numbers that lead [-]."""


@dataclass(frozen=True, eq=False)
class Compliances:
    """A log posterior told in compliances and losses, as shares of the fit's; 0 is the fit.

    Numbers that are no stiffness of this kind, and those that lead along a valley, keep their
    coordinates without bounds, less the fit's. Outside of any bound the density is zero.

    Attributes:
        density: in coordinates without bounds.
    """

    density: LogPosterior

    @cached_property
    def pairs(self) -> tuple[tuple[int, int | None], ...]:
        """Every positive constant stiffness, with its damping where that is unknown too."""
        unknowns = self.density.unknowns
        return spring_pairs([one.label for one in unknowns], [_positive(one) for one in unknowns])

    @cached_property
    def leads(self) -> tuple[int, ...]:
        """What leads along the valley: the least known spring, then tolerances that are felt.

        Another spring leads only where it is hardly known beside these.
        """
        left, found = self._shares.copy(), list[int]()
        springs = [pair[0] for pair in self.pairs]
        tied = {i for pair in self.pairs for i in pair if i is not None}
        loose = [i for i in range(len(self.bends)) if self.bends[i] == 1.0 and i not in tied]
        for group, least in ((springs, LONG), (loose, TOLD), (springs, LONG)):
            while len(found) < MOST_LEADS:
                std = np.sqrt(np.maximum(np.diag(left), 0.0))
                open_ = [i for i in group if i not in found]
                worst = max(open_, key=lambda i: std[i], default=None)
                if worst is None or std[worst] < least:
                    break
                pair = next((pair for pair in self.pairs if worst in pair), (worst,))
                for i in (i for i in pair if i is not None):
                    row = left[i] / np.sqrt(max(left[i, i], 1e-300))
                    left = left - np.outer(row, row)
                    found.append(i)
                if group is springs:
                    break
        return tuple(found)

    @cached_property
    def free_leads(self) -> list[int]:
        """Leads of which no prior is known."""
        return [i for i in self.leads if not np.isfinite(self.density.unknowns[i].prior)]

    @cached_property
    def springs(self) -> tuple[tuple[int, int | None], ...]:
        """Those pairs that are told by compliance and loss, because they do not lead."""
        return tuple(pair for pair in self.pairs if pair[0] not in self.leads)

    def felt(self, along: np.ndarray) -> np.ndarray:
        """Compliances and losses of what leads, as shares of the fit's, shape (..., leads) [-]."""
        found = np.array(along, dtype=float)
        at = {index: number for number, index in enumerate(self.leads)}
        for index, other in self.pairs:
            if index in at:
                value = self._natural(index, along[..., at[index]])
                soft = self.best[index] / value
                found[..., at[index]] = soft - 1.0
                if other in at:
                    loss = self._natural(other, along[..., at[other]]) / self.best[other]
                    found[..., at[other]] = loss * soft**2 - 1.0
        return found

    @cached_property
    def _between(self) -> frozenset[int]:
        """Leads between two bounds, told by the normal quantile of the share of the way.

        In it a flat density is a normal one.
        """
        unknowns = self.density.unknowns
        return frozenset(i for i in self.leads if unknowns[i].transform == "between")

    def _natural(self, index: int, away: np.ndarray) -> np.ndarray:
        """Value [SI] of a number that is no compliance and no loss."""
        unknown, best = self.density.unknowns[index], self.density.mean[index]
        if index in self._between:
            share = ndtr(ndtri(expit(best)) + away)
            return unknown.low + (unknown.high - unknown.low) * share
        return unknown.natural(best + away)

    def _free(self, index: int, away: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Its coordinate without bounds, and the log slope of that [-]."""
        best = self.density.mean[index]
        if index not in self._between:
            return best + away, np.zeros_like(away)
        at = ndtri(expit(best)) + away
        free = log_ndtr(at) - log_ndtr(-at)
        slope = -0.5 * at**2 - log_ndtr(at) - log_ndtr(-at)
        return free, slope

    @cached_property
    def best(self) -> np.ndarray:
        """The fit, shape (d,) [SI]."""
        return np.array([unknown.value for unknown in self.density.unknowns])

    @cached_property
    def _others(self) -> np.ndarray:
        taken = {index for pair in self.springs for index in pair if index is not None}
        return np.array([i for i in range(len(self.best)) if i not in taken], dtype=int)

    @cached_property
    def bends(self) -> np.ndarray:
        """How much each may bend a valley, 0 for a noise's numbers, shape (d,) [-]."""
        found = np.ones(len(self.best))
        for index, unknown in enumerate(self.density.unknowns):
            if unknown.transform == "identity":
                found[index] = FELT_LINEARLY
            if unknown.is_noise:
                found[index] = 0.0
        return found

    @cached_property
    def bent(self) -> np.ndarray:
        """Which may bend a valley, as indices [-]."""
        return np.flatnonzero(self.bends)

    @cached_property
    def unit(self) -> np.ndarray:
        """Units in which those are compared, shape (bent,) [-]."""
        return 1.0 / self.bends[self.bent]

    def _change(self, pairs: Sequence[tuple[int, int | None]]) -> np.ndarray:
        """Slope of these coordinates by those without bounds, at the fit, shape (d, d) [-]."""
        unknowns = self.density.unknowns
        change = np.eye(len(unknowns))
        for index, other in pairs:
            ratio = unknowns[index].slope / self.best[index]
            change[index, index] = -ratio
            if other is not None:
                change[other, index] = -2.0 * ratio
                change[other, other] = unknowns[other].slope / self.best[other]
        return change

    @cached_property
    def _shares(self) -> np.ndarray:
        change = self._change(self.pairs)
        return change @ self.density.covariance @ change.T

    @cached_property
    def covariance(self) -> np.ndarray:
        """Laplace's approximation in these coordinates, shape (d, d) [-]."""
        change = self._change(self.springs)
        for i in self._between:
            step = 1e-4
            change[i, i] = 2 * step / float(np.ptp(self._free(i, np.array([-step, step]))[0]))
        return change @ self.density.covariance @ change.T

    @cached_property
    def reach(self) -> np.ndarray:
        """How far each may lie from the fit before anything is told, shape (d,) [-]."""
        found = []
        std = np.sqrt(np.diag(self.covariance))
        springs = {index for pair in self.springs for index in pair if index is not None}
        for index, unknown in enumerate(self.density.unknowns):
            if index in springs:
                found.append(REACH)
            else:
                found.append(max(min(1.0, unknown.prior / abs(unknown.slope)), std[index]))
        return np.array(found)

    def near_fit(self, count: int, chance: np.random.Generator) -> np.ndarray:
        """Draws so near to the fit that no valley bends, shape (count, d) [-]."""
        size = len(self.best)
        away = chance.standard_normal((count, size)) * chance.uniform(0.02, 0.1, (count, 1))
        points = away @ root_of(self.covariance).T
        points[:, self.bends == 0.0] = 0.0
        return points

    def natural(self, points: np.ndarray) -> np.ndarray:
        """Values [SI] of points, shape (..., d); outside of their bounds where these end."""
        found = np.array(points, dtype=float)
        for i in self._others:
            found[..., i] = self._natural(i, points[..., i])
        for index, other in self.springs:
            soft = np.maximum(1.0 + points[..., index], 1e-12)
            found[..., index] = self.best[index] / soft
            if other is not None:
                found[..., other] = self.best[other] * (1.0 + points[..., other]) / soft**2
        return found

    def parts(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Logarithms of what makes the density of points, shape (n, d) -> (n,) each.

        Normal priors, what the rest of the prior and the coordinates add, and likelihood [-];
        minus infinity out of bounds.
        """
        unknowns = self.density.unknowns
        values = self.natural(points)
        inside = np.ones(len(points), dtype=bool)
        volume = np.zeros(len(points))
        for index, other in self.springs:
            soft = 1.0 + points[:, index]
            inside &= soft > 1e-9
            volume -= (2.0 if other is None else 4.0) * np.log(np.maximum(soft, 1e-9))
            for i in (index,) if other is None else (index, other):
                inside &= (values[:, i] > unknowns[i].low) & (values[:, i] < unknowns[i].high)
        pulls, likelihood = (np.full(len(points), -np.inf) for _ in range(2))
        if inside.any():
            free = np.empty_like(points[inside])
            for i in self._others:
                free[:, i], slope = self._free(i, points[inside, i])
                volume[inside] += slope
            for pair in self.springs:
                for i in (i for i in pair if i is not None):
                    free[:, i] = unknowns[i].free(values[inside, i])
                    volume[inside] -= unknowns[i].log_slope(free[:, i])
            before = self.density.log_prior(free)
            pulls[inside] = self._pulls(values[inside])
            volume[inside] += before - pulls[inside]
            likelihood[inside] = self.density(free) - before
        return pulls, volume, likelihood

    def _pulls(self, values: np.ndarray) -> np.ndarray:
        """Log of the normal priors, up to a constant, of values of shape (n, d) [SI]."""
        center = np.array([unknown.center for unknown in self.density.unknowns])
        prior = np.array([unknown.prior for unknown in self.density.unknowns])
        return -0.5 * np.sum(((values - center) / prior) ** 2, axis=1)


def _positive(unknown: Unknown) -> bool:
    return unknown.is_constant and unknown.low >= 0.0 and unknown.value > 0.0


def root_of(covariance: np.ndarray) -> np.ndarray:
    """A square root of a covariance; directions that rounding has lost are kept, however thin.

    Both of shape (d, d), in squared units of what they tell and in these units.
    """
    std = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(std, std))
    return std[:, None] * vectors * np.sqrt(np.maximum(values, 1e-14 * values[-1]))
