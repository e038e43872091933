"""Critical damping after Bulatovic: where all eigenvalues are real and negative, exactly."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from fractions import Fraction

import numpy as np

from .energies import Rows, damping_matrix, mass_matrix, stiffness_matrix
from .linear import Mechanism
from .polynomial import (
    Matrix,
    Polynomial,
    degree_of,
    determinant,
    hankel_minors,
    interpolated,
    positive_roots,
    rank_of,
    sturm_chain,
    variations,
)

MOST_COORDINATES = 6
"""Most coordinates for which exact arithmetic stays a matter of seconds [-]."""


@dataclass(frozen=True)
class Aperiodic:
    """Whether the free motion of M, C, K never swings, by Hankel's minors and by Sturm's count.

    Attributes:
        minors: leading principal minors of the Hankel matrix of power sums of the eigenvalues;
            exact; all positive where the eigenvalues are real and distinct.
        n_negative: how many distinct negative real eigenvalues there are, by Sturm's chain.
        n_distinct: how many distinct eigenvalues there are.
        is_stable: whether a real eigenvalue can only be negative: no coefficient of the
            characteristic polynomial is zero or of another sign.
    """

    minors: tuple[Fraction, ...]
    n_negative: int
    n_distinct: int
    is_stable: bool

    @property
    def is_aperiodic(self) -> bool:
        """Whether all eigenvalues are real and negative, repeated ones allowed."""
        return self.n_negative == self.n_distinct

    @property
    def satisfies_bulatovic(self) -> bool:
        """Whether all minors are positive and all coefficients too: real, negative, distinct."""
        return self.is_stable and all(minor > 0 for minor in self.minors)


@dataclass(frozen=True)
class CriticalDamping:
    """Where a damping makes every eigenvalue real and negative.

    Attributes:
        name: the damping that was searched.
        unit: of that damping, as text.
        intervals: ends of each interval of it, ascending; the last end may be infinite. In its
            unit.
    """

    name: str
    unit: str
    intervals: tuple[tuple[float, float], ...]

    @property
    def status(self) -> str:
        """``found`` or ``none``."""
        return "found" if self.intervals else "none"

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        if not self.intervals:
            return f"No {self.name} whatever makes all eigenvalues real and negative."
        spans = [f"from {low:.6g} to {high:.6g} {self.unit}" for low, high in self.intervals]
        return f"All eigenvalues are real and negative for {self.name} {' and '.join(spans)}."


def check_aperiodic(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> Aperiodic:
    """Tests exactly whether all roots of ``det(s^2 M + s C + K)`` are real and negative.

    The numbers are taken as the fractions that they are in the machine; nothing is rounded.

    Args:
        mass: shape (n, n), regular; need not be symmetric [kg or kg m^2].
        damping: shape (n, n) [N s/m or N m s/rad].
        stiffness: shape (n, n) [N/m or N m/rad].

    Returns:
        Minors, counts and verdicts.

    Raises:
        ValueError: for matrices of unlike shapes, numbers that are not finite, a singular mass,
            or more than `MOST_COORDINATES`.

    Source: Bulatovic 2001 as the thesis tells it in eq. 26-31, lines 1327-1350, where eq. 27
    should be the product of squared differences; tests/model/test_critical.py.
    """
    polynomial = _characteristic(*_exact(mass, damping, stiffness))
    chain = sturm_chain(polynomial)
    negative = variations(chain, None) - variations(chain, Fraction(0))
    signs = {(value > 0) - (value < 0) for value in polynomial}
    return Aperiodic(
        hankel_minors(polynomial),
        negative - (polynomial[-1] == 0),
        degree_of(polynomial) - degree_of(chain[-1]),
        len(signs) == 1 and 0 not in signs,
    )


def critical_damping(mechanism: Mechanism, p: Mapping[str, float], name: str) -> CriticalDamping:
    """Finds every interval of one damping in which all eigenvalues are real and negative.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI].
        name: which of them is searched, such as ``sleeve_damping`` or ``links.spring.damping``.

    Returns:
        The intervals, ends included in none; none where no value does it.

    Raises:
        ValueError: where that name is no damping of the mechanism, or a number is missing; see
            also `check_aperiodic`.

    Source: thesis 6.4, lines 1325-1357; tests/model/test_critical.py.
    """
    n = len(mechanism.coordinates)
    if name not in mechanism.names or "damping" not in name:
        known = ", ".join(other for other in mechanism.names if "damping" in other)
        raise ValueError(
            f"damping: expected one of {known}, found {name!r}. Mend: name one of these."
        )
    missing = [other for other in mechanism.names if other != name and other not in p]
    if missing:
        raise ValueError(
            f"numbers: expected every number of the mechanism, found none for {missing[0]!r}. "
            "Mend: add it."
        )
    zero, one = (_exact_rows(mechanism, p, name, value) for value in (0.0, 1.0))
    mass, without, with_one, stiffness = (
        matrix[:n, :n]
        for matrix in (
            mass_matrix(zero),
            damping_matrix(zero),
            damping_matrix(one),
            stiffness_matrix(zero),
        )
    )
    intervals = damping_intervals(mass, without, stiffness, with_one - without)
    unit = "N m s/rad" if mechanism.turns(name.partition("_")[0]) else "N s/m"
    return CriticalDamping(name, unit, intervals)


def _exact_rows(mechanism: Mechanism, p: Mapping[str, float], name: str, value: float) -> Rows:
    """Rows with one damping at a value, in fractions."""
    rows = mechanism.rows({key: float(number) for key, number in p.items()} | {name: value}, np)
    return Rows(*(_fractions(np.asarray(getattr(rows, each.name))) for each in fields(rows)))


def damping_intervals(
    mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, unit_damping: np.ndarray
) -> tuple[tuple[float, float], ...]:
    """Every interval of c > 0 in which ``M, C + c C1, K`` has real, negative eigenvalues only.

    The kind of the eigenvalues changes only where the discriminant, a polynomial in c, vanishes:
    its positive roots are separated exactly, and one point between two of them is tested.

    Args:
        mass: shape (n, n), regular [kg or kg m^2].
        damping: shape (n, n), without the one searched [N s/m or N m s/rad].
        stiffness: shape (n, n) [N/m or N m/rad].
        unit_damping: shape (n, n), what one unit of c adds [1 or m^2].

    Returns:
        Ends of the intervals, ascending; the last may be infinite [N s/m or N m s/rad].

    Raises:
        ValueError: as `check_aperiodic`.
    """
    fixed = _exact(mass, damping, stiffness)
    (step,) = _exact(unit_damping)

    def polynomial(c: Fraction) -> Polynomial:
        pairs = [zip(a, b, strict=True) for a, b in zip(fixed[1], step, strict=True)]
        return _characteristic(fixed[0], [[a + c * b for a, b in row] for row in pairs], fixed[2])

    def holds(c: Fraction) -> bool:
        chain = sturm_chain(own := polynomial(c))
        negative = variations(chain, None) - variations(chain, Fraction(0))
        return negative - (own[-1] == 0) == degree_of(own) - degree_of(chain[-1])

    ends = positive_roots(_discriminant(polynomial, len(fixed[0]), rank_of(step)))
    tests = [_between(low, high) for low, high in zip([None, *ends], [*ends, None], strict=True)]
    found: list[tuple[float, float]] = []
    edges = [Fraction(0), *(low for low, _ in ends)]
    for k, test in enumerate(tests):
        if not holds(test):
            continue
        high = float(edges[k + 1]) if k < len(ends) else math.inf
        if found and found[-1][1] == float(edges[k]):
            found[-1] = (found[-1][0], high)
        else:
            found.append((float(edges[k]), high))
    return tuple(found)


def _fractions(values: np.ndarray) -> np.ndarray:
    """The same numbers, each as the fraction that it is in the machine."""
    wild = [x for x in values.flat if not (isinstance(x, Fraction) or np.isfinite(x))]
    if wild:
        raise ValueError(
            f"matrices: expected finite numbers, found {wild[0]}. Mend: correct the masses, "
            "stiffnesses and dampings that they are made of."
        )
    return np.vectorize(Fraction, otypes=[object])(values)


def _exact(*matrices: np.ndarray) -> list[Matrix]:
    """Matrices of one shape in fractions, after checking them."""
    found = [np.asarray(matrix) for matrix in matrices]
    n = len(found[0])
    if any(matrix.shape != (n, n) for matrix in found) or not 1 <= n <= MOST_COORDINATES:
        shapes = ", ".join(str(matrix.shape) for matrix in found)
        raise ValueError(
            f"matrices: expected square ones of one size up to {MOST_COORDINATES}, found {shapes}. "
            "Mend: give mass, damping and stiffness over the same coordinates."
        )
    return [_fractions(matrix).tolist() for matrix in found]


def _characteristic(mass: Matrix, damping: Matrix, stiffness: Matrix) -> Polynomial:
    """``det(s^2 M + s C + K)`` with whole coefficients, by its values at whole s."""
    n = len(mass)
    values = []
    for s in range(2 * n + 1):
        rows = zip(mass, damping, stiffness, strict=True)
        values.append(
            determinant(
                [[s * s * m + s * c + k for m, c, k in zip(*row, strict=True)] for row in rows]
            )
        )
    polynomial = interpolated(values)
    if degree_of(polynomial) < 2 * n:
        raise ValueError(
            "mass: expected a regular matrix, found a singular one. Mend: give every coordinate "
            "some inertia."
        )
    return polynomial


def _discriminant(polynomial: Callable[[Fraction], Polynomial], n: int, rank: int) -> Polynomial:
    """The last Hankel minor that does not vanish for every c, as a polynomial in c.

    Monic coefficients are of degree `rank` in c at most, and minor k is of degree 2 k - 2 in them.
    """
    count = (4 * n - 2) * rank + 1
    minors = [hankel_minors(polynomial(Fraction(c))) for c in range(count)]
    last = max(k for k in range(2 * n) if any(row[k] != 0 for row in minors))
    return interpolated([row[last] for row in minors])


def _between(
    low: tuple[Fraction, Fraction] | None, high: tuple[Fraction, Fraction] | None
) -> Fraction:
    """A point between two neighboring roots."""
    if low is None:
        return Fraction(1) if high is None else high[0] / 2
    return 2 * low[1] if high is None else (low[1] + high[0]) / 2
