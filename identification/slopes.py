"""Derivatives of a residual, by records: what a descent needs of them without the whole matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .allowance import Marginal

WILD = 1e60
"""Largest slope that is taken for one [-]: a motion that runs away has none."""


LANES = 8
"""Directions of a Jacobian are padded to a multiple of this, so that few shapes are compiled."""


def padded_lanes(count: int) -> int:
    """`count` directions filled up to one of few numbers [-]."""
    return -(-max(count, 1) // LANES) * LANES


@dataclass(frozen=True, eq=False)
class Block:
    """The rows of one record.

    Attributes:
        rows: whitened derivatives before its allowance is summed out, shape (samples, own) [-].
        which: the unknowns that move it, shape (own,) [-].
        marginal: what sums its allowance out, if it has one.
    """

    rows: np.ndarray
    which: np.ndarray
    marginal: Marginal | None = None

    @cached_property
    def gram(self) -> np.ndarray:
        """Products of its columns, the allowance summed out, shape (own, own) [-]."""
        whole = self.rows.T @ self.rows
        if self.marginal is None:
            return whole
        return whole - self.marginal.hidden(self.rows)

    def pull(self, residual: np.ndarray) -> np.ndarray:
        """Products of its columns with a residual that knows of the allowance, shape (own,) [-]."""
        if self.marginal is not None:  # its root is symmetric
            residual = self.marginal.apply(residual)
        return self.rows.T @ residual

    def along(self, step: np.ndarray) -> np.ndarray:
        """How its residual moves along a step of all unknowns, shape (samples,) [-]."""
        moved = self.rows @ step[self.which]
        return moved if self.marginal is None else self.marginal.apply(moved)

    def matrix(self, count: int) -> np.ndarray:
        """The rows with their allowance summed out, by all `count` unknowns [-]."""
        found = np.zeros((len(self.rows), count))
        own = self.rows if self.marginal is None else self.marginal.apply(self.rows)
        found[:, self.which] = own
        return found


@dataclass(frozen=True, eq=False)
class Slopes:
    """How a residual moves with d unknowns.

    Where hundreds of numbers are summed out, the products of its columns take half the work of the
    columns; and a record's own unknowns move no other record.

    Attributes:
        blocks: rows of the records, in their order; the last ones may be of priors.
        count: d.

    Source: tests/identification/test_slopes.py.
    """

    blocks: Sequence[Block]
    count: int

    @staticmethod
    def of(matrix: np.ndarray) -> Slopes:
        """Slopes of a whole matrix, shape (n, d) [-]; what is none of them is zero."""
        tame = np.clip(np.nan_to_num(matrix), -WILD, WILD)
        return Slopes((Block(tame, np.arange(matrix.shape[1])),), matrix.shape[1])

    @cached_property
    def gram(self) -> np.ndarray:
        """Products of the columns, shape (d, d) [-]."""
        found = np.zeros((self.count, self.count))
        for block in self.blocks:
            found[np.ix_(block.which, block.which)] += block.gram
        return found

    def pull(self, residual: np.ndarray) -> np.ndarray:
        """Products of the columns with a residual of shape (n,), shape (d,) [-]."""
        found, low = np.zeros(self.count), 0
        for block in self.blocks:
            high = low + len(block.rows)
            found[block.which] += block.pull(residual[low:high])
            low = high
        return found

    def along(self, step: np.ndarray) -> np.ndarray:
        """How the residual moves along a step of shape (d,), shape (n,) [-]."""
        return np.concatenate([block.along(step) for block in self.blocks])

    def matrix(self) -> np.ndarray:
        """The whole matrix, shape (n, d) [-]."""
        return np.concatenate([block.matrix(self.count) for block in self.blocks])
