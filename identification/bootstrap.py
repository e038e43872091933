"""Parametric bootstrap of a close decision: what each of two laws would show if it were true."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .fit import Fit

SETS = 400
"""Sets of records that are made of each law [-]."""

BLOCK = 32
"""Samples whose whitened residuals change sign together [-]: what colour is left stays in them."""


@dataclass(frozen=True)
class Contest:
    """Two laws that explain the same records about as well.

    Attributes:
        gap: cost of the second over that of the first, as measured [-].
        first: chance of a gap as small where the first law is true [-].
        second: chance of a gap as large where the second law is true [-].
        sets: how many sets of each were made [-].
    """

    gap: float
    first: float
    second: float
    sets: int

    @property
    def share(self) -> float:
        """Of the first law in the two chances [-]."""
        least = 1.0 / (self.sets + 1)
        first, second = max(self.first, least), max(self.second, least)
        return first / (first + second)


def contest(first: Fit, second: Fit, sets: int = SETS, seed: int = 0) -> Contest:
    """Make sets of records of each of two fits, and fit both laws to each set again.

    The noise of a set is the fit's own whitened residual, its sign drawn anew for every block, so
    that scale, outliers and colour are those of the records. The refits are one step of Gauss and
    Newton: both fits explain the same records, and are no farther apart than their noise.

    Args:
        first: with a law, on the whole records.
        second: with another law, on the same records by the same weights.
        sets: of records made of each law.
        seed: of the signs.

    Raises:
        ValueError: where the two were not fitted to the same records.

    Source: Cox 1961, "Tests of separate families of hypotheses"; Wu 1986,
    doi:10.1214/aos/1176350142 (signs); tests/identification/test_bootstrap.py.
    """
    if first.problem is not second.problem and first.keys != second.keys:
        raise ValueError(
            f"contest: expected two fits of the same records, found {first.keys} and "
            f"{second.keys}. Mend: fit both laws to one problem."
        )
    one, two = _Refit(first), _Refit(second)
    apart = one.data - two.data
    gap = two.cost - one.cost
    rng = np.random.default_rng(seed)
    own = [_gap(one, two, one.signed(rng), -apart) for _ in range(sets)]
    other = [-_gap(two, one, two.signed(rng), apart) for _ in range(sets)]
    return Contest(
        float(gap), float(np.mean(np.array(own) <= gap)), float(np.mean(np.array(other) >= gap)),
        sets,
    )  # fmt: skip


def _gap(true: _Refit, false: _Refit, noise: np.ndarray, apart: np.ndarray) -> float:
    """Cost of the false law over that of the true one, refitted to a set of the true one's."""
    return false.left(noise + apart) - true.left(noise)


class _Refit:
    """A fit as a plane: what is left of any whitened data once its numbers follow."""

    def __init__(self, fit: Fit) -> None:
        white, jacobian = fit.model.residual(fit.x), fit.model.jacobian(fit.x)
        samples = sum(len(fit.residual_of(key)) for key in fit.keys)
        self.data, self.pulls = white[:samples], white[samples:]
        kept = np.linalg.norm(jacobian, axis=0) > 0.0
        sizes = np.linalg.norm(jacobian[:, kept], axis=0)
        basis, strengths, _ = np.linalg.svd(jacobian[:, kept] / sizes, full_matrices=False)
        self.basis = basis[:, strengths > 1e-10 * strengths[:1]]
        self.cost = float(white @ white)

    def left(self, data: np.ndarray) -> float:
        """Cost of these data after one step, priors pulling as they do now [-]."""
        whole = np.append(data, self.pulls)
        along = self.basis.T @ whole
        return float(whole @ whole - along @ along)

    def signed(self, rng: np.random.Generator) -> np.ndarray:
        """Its own whitened residuals, their signs drawn anew block by block [-]."""
        blocks = -(-len(self.data) // BLOCK)
        signs = rng.choice([-1.0, 1.0], blocks)
        return self.data * np.repeat(signs, BLOCK)[: len(self.data)]
