"""What a record leaves open and nobody asks for: numbers felt linearly, summed out.

Hundreds of them cost nothing: with Gaussian priors they only change how residuals are weighed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .noise import Noise, Trust


@dataclass(frozen=True, eq=False)
class Allowance:
    """Linear nuisances of one record.

    Attributes:
        kinds: what each number is, of length m: ``drive`` (an error of a told motion),
            ``delay`` (of a told motion's clock), ``ringing`` (a higher mode's amplitude), ``lever``
            (of a sensor at the head) or ``ripple`` (what a lumped club misses of it).
        columns: for each sensor its response to each number, shapes (n, m) [SI per unit].
        priors: standard deviations of the numbers, shape (m,) [SI].
    """

    kinds: tuple[str, ...]
    columns: tuple[np.ndarray, ...]
    priors: np.ndarray

    @property
    def lengths(self) -> tuple[int, ...]:
        """Samples of each sensor [-]."""
        return tuple(len(block) for block in self.columns)


@dataclass(frozen=True, eq=False)
class Followed:
    """A told motion as it is believed to have been, and what its errors did.

    What a mechanism makes of errors depends on its constants. By the told motion alone that counts
    as noise which they could lessen, and they are drawn to where it is least.

    Attributes:
        inputs: the record's, less estimated errors of what is told, on the simulation's grid,
            shape (padded, inputs) [SI].
        moved: for each sensor what these errors did to it by the constants they were estimated
            with, shapes (n,) [SI].

    Source: errors in variables, Fuller 1987, section 3.2; tests/identification/test_followed.py.
    """

    inputs: np.ndarray
    moved: tuple[np.ndarray, ...]

    def fits(self, inputs: np.ndarray, lengths: Sequence[int]) -> bool:
        """Whether it is of a record with such inputs and sensors [-]: none that was thinned."""
        same = self.inputs.shape == inputs.shape
        return same and [len(part) for part in self.moved] == list(lengths)


def joined(parts: Sequence[Allowance]) -> Allowance | None:
    """Several allowances of one record as one; None for none."""
    if not parts:
        return None
    kinds = tuple(kind for part in parts for kind in part.kinds)
    blocks = zip(*(part.columns for part in parts), strict=True)
    columns = tuple(np.concatenate(block, axis=1) for block in blocks)
    return Allowance(kinds, columns, np.concatenate([part.priors for part in parts]))


@dataclass(frozen=True, eq=False)
class Marginal:
    """An allowance under a noise law: whitened responses ``A`` as ``basis sizes turn'``.

    With unknowns summed out a whitened residual r has the covariance ``1 + A A'``; `apply` is the
    inverse root of it, so that the sum of squares stays the cost.

    Attributes:
        basis: orthonormal columns, shape (samples, rank) [-].
        sizes: shape (rank,) [-].
        turn: shape (m, rank), orthonormal columns [-].

    Source: Lindley and Smith 1972, doi:10.1111/j.2517-6161.1972.tb00885.x, section 2;
    tests/identification/test_allowance.py.
    """

    basis: np.ndarray
    sizes: np.ndarray
    turn: np.ndarray

    def apply(self, white: np.ndarray) -> np.ndarray:
        """Whitened rows, shape (samples, ...), with the allowance summed out [-]."""
        share = 1.0 - 1.0 / np.sqrt(1.0 + self.sizes**2)
        along = self.basis.T @ white
        return white - self.basis @ (share.reshape((-1,) + (1,) * (white.ndim - 1)) * along)

    def hidden(self, white: np.ndarray) -> np.ndarray:
        """By how much products of whitened columns fall once it is summed out, (k, k) [-]."""
        along = self.basis.T @ white
        return along.T @ ((self.sizes**2 / (1.0 + self.sizes**2))[:, None] * along)

    def estimate(self, white: np.ndarray) -> np.ndarray:
        """Best numbers in units of their priors, shape (m,), for whitened residuals [-]."""
        return self.turn @ (self.sizes / (1.0 + self.sizes**2) * (self.basis.T @ white))

    def taken(self) -> np.ndarray:
        """How much of each whitened sample the estimates follow, shape (samples,), 0 to 1 [-]."""
        return self.basis**2 @ (self.sizes**2 / (1.0 + self.sizes**2))


LEAST_SIZE = 1e-6
"""Directions that move a record by less than this, in noise units, are left out [-]."""


def marginal_of(allowance: Allowance, whitened: np.ndarray) -> Marginal:
    """Sum out an allowance.

    Args:
        allowance: of one record.
        whitened: its columns of all sensors, stacked and whitened, shape (samples, m) [1/SI].

    Returns:
        What `Marginal` says.
    """
    scaled = whitened * allowance.priors
    squares, turn = np.linalg.eigh(scaled.T @ scaled)
    keep = squares > max(LEAST_SIZE**2, 1e-13 * float(squares[-1]))
    sizes, turn = np.sqrt(squares[keep]), turn[:, keep]
    return Marginal(scaled @ turn / sizes, sizes, turn)


@lru_cache(maxsize=16)
def summed_out(allowance: Allowance, noises: tuple[Noise | Trust, ...]) -> Marginal:
    """Sum out an allowance whose sensors have these noise laws.

    Fits that differ in what varies alone share it: of a driven record it takes as long as tens of
    simulations.
    """
    blocks = zip(noises, allowance.columns, strict=True)
    return marginal_of(allowance, np.concatenate([noise.whiten(block) for noise, block in blocks]))


MANY = 2.0
"""Root mean square of hundreds of numbers, in units of their priors, that is no chance [-]: were
the prior right it would stay below 1."""

FEW = 4.0
"""Size of a single number, in units of its prior, that is a finding and no nuisance more [-]."""


@dataclass(frozen=True)
class Used:
    """How far the numbers of one kind in one record had to go.

    Attributes:
        record: its name.
        kind: as in `Allowance.kinds`.
        count: how many there are [-].
        rms: root mean square in units of their priors [-].
        largest: largest size in units of its prior [-].
    """

    record: str
    kind: str
    count: int
    rms: float
    largest: float

    @property
    def beyond(self) -> bool:
        """Whether they went further than their tolerance lets them; a ringing has none."""
        if self.kind == "ringing":
            return False
        return self.rms > MANY if self.count > 50 else self.largest > FEW


def used(record: str, allowance: Allowance, estimate: np.ndarray) -> list[Used]:
    """How far each kind of numbers of a record's allowance had to go.

    Args:
        record: its name.
        allowance: what was left open.
        estimate: best numbers in units of their priors, shape (m,) [-].

    Returns:
        One entry a kind, in the order of the kinds.
    """
    kinds, found = np.array(allowance.kinds), []
    for kind in dict.fromkeys(allowance.kinds):
        own = estimate[kinds == kind]
        rms, largest = float(np.sqrt(np.mean(own**2))), float(np.max(np.abs(own)))
        found.append(Used(record, str(kind), len(own), rms, largest))
    return found
