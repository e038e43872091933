"""Polynomials in whole numbers: Sturm's chain, Hankel's minors, and real roots, all exact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

Matrix = list[list[Fraction]]
Polynomial = list[int]  # coefficients, the highest power first, without leading zeros

SHARP = 1e-9
"""Width to which a root is enclosed, as a share of it [-]."""


def determinant(matrix: Sequence[Sequence[Fraction]]) -> Fraction:
    """The determinant, by elimination.

    Args:
        matrix: rows of fractions, square.

    Returns:
        The exact determinant [-].
    """
    rows, sign = [list(row) for row in matrix], 1
    result = Fraction(1)
    for k in range(len(rows)):
        swap = next((i for i in range(k, len(rows)) if rows[i][k] != 0), None)
        if swap is None:
            return Fraction(0)
        if swap != k:
            rows[k], rows[swap], sign = rows[swap], rows[k], -sign
        result *= rows[k][k]
        for i in range(k + 1, len(rows)):
            part = rows[i][k] / rows[k][k]
            if part:
                rows[i] = [a - part * b for a, b in zip(rows[i], rows[k], strict=True)]
    return sign * result


def rank_of(matrix: Matrix) -> int:
    """The exact rank of a square matrix of fractions [-]."""
    rows, rank = [list(row) for row in matrix], 0
    for column in range(len(matrix)):
        lead = next((i for i in range(rank, len(rows)) if rows[i][column] != 0), None)
        if lead is None:
            continue
        rows[rank], rows[lead] = rows[lead], rows[rank]
        for i in range(rank + 1, len(rows)):
            part = rows[i][column] / rows[rank][column]
            rows[i] = [a - part * b for a, b in zip(rows[i], rows[rank], strict=True)]
        rank += 1
    return rank


def interpolated(values: Sequence[Fraction]) -> Polynomial:
    """The polynomial with these values at 0, 1, 2 ..., to a positive factor, by Newton."""
    table = list(values)
    for level in range(1, len(table)):
        for i in range(len(table) - 1, level - 1, -1):
            table[i] = (table[i] - table[i - 1]) / level
    result = [Fraction(0)]
    for k in range(len(table) - 1, -1, -1):  # times (s - k), plus the next difference
        grown = [*result, Fraction(0)]
        for i, value in enumerate(result):
            grown[i + 1] -= k * value
        grown[-1] += table[k]
        result = grown
    return _whole(result)


def _whole(coefficients: Sequence[Fraction]) -> Polynomial:
    """Coefficients without leading zeros, as whole numbers without a common factor."""
    start = next((i for i, value in enumerate(coefficients) if value != 0), len(coefficients) - 1)
    kept = coefficients[start:]
    scale = math.lcm(*(value.denominator for value in kept))
    whole = [value.numerator * (scale // value.denominator) for value in kept]
    common = math.gcd(*whole) or 1
    return [value // common for value in whole]


def degree_of(polynomial: Polynomial) -> int:
    """The degree of a polynomial without leading zeros [-]."""
    return len(polynomial) - 1


def sturm_chain(polynomial: Polynomial) -> list[Polynomial]:
    """Sturm's chain; its last member is the greatest common divisor with the derivative."""
    degree = degree_of(polynomial)
    chain = [polynomial]
    rest = [value * (degree - i) for i, value in enumerate(polynomial[:-1])]
    while any(rest):
        chain.append(_whole([Fraction(value) for value in rest]))
        rest = _negative_remainder(chain[-2], chain[-1])
    return chain


def _negative_remainder(dividend: Polynomial, divisor: Polynomial) -> Polynomial:
    """Minus the remainder, to a positive factor."""
    rest, lead = list(dividend), divisor[0]
    for i in range(len(dividend) - len(divisor) + 1):
        first = rest[i]
        size, sign = abs(lead), 1 if lead > 0 else -1
        rest = [value * size for value in rest]
        for j, value in enumerate(divisor):
            rest[i + j] -= sign * first * value
    rest = rest[len(dividend) - len(divisor) + 1 :]
    common = math.gcd(*rest) or 1 if rest else 1
    return [-value // common for value in rest]


def _value(polynomial: Polynomial, at: Fraction) -> int:
    """A number with the sign of the polynomial's value."""
    top, bottom, result, power = at.numerator, at.denominator, 0, 1
    for value in polynomial:
        result = result * top + value * power
        power *= bottom
    return result


def variations(chain: list[Polynomial], at: Fraction | None) -> int:
    """Changes of sign along the chain at a point; None stands for minus infinity."""
    if at is None:
        values = [own[0] * (-1) ** degree_of(own) for own in chain]
    else:
        values = [_value(own, at) for own in chain]
    kept = [value > 0 for value in values if value != 0]
    return sum(a != b for a, b in pairwise(kept))


def hankel_minors(polynomial: Polynomial) -> tuple[Fraction, ...]:
    """Leading principal minors of the power sums of the roots, by Newton's identities."""
    n = degree_of(polynomial)
    c = [Fraction(value, polynomial[0]) for value in polynomial]
    sums = [Fraction(n)]
    for k in range(1, 2 * n - 1):
        known = sum((c[i] * sums[k - i] for i in range(1, min(k - 1, n) + 1)), Fraction(0))
        sums.append(-known - (k * c[k] if k <= n else 0))
    return tuple(
        determinant([[sums[i + j] for j in range(size)] for i in range(size)])
        for size in range(1, n + 1)
    )


def positive_roots(polynomial: Polynomial) -> list[tuple[Fraction, Fraction]]:
    """Narrow intervals (low, high] around each positive root, ascending."""
    while polynomial[-1] == 0 and len(polynomial) > 1:
        polynomial = polynomial[:-1]
    polynomial = _quotient(polynomial, sturm_chain(polynomial)[-1])  # every root once
    chain = sturm_chain(polynomial)
    bound = max(abs(value) // abs(polynomial[0]) + 2 for value in polynomial)  # Cauchy's
    high = Fraction(1 << bound.bit_length())
    counts: dict[Fraction, int] = {}

    def changes(at: Fraction) -> int:
        if at not in counts:
            counts[at] = variations(chain, at)
        return counts[at]

    wide, found = [(Fraction(0), high)], []
    while wide:
        low, high = wide.pop()
        roots = changes(low) - changes(high)
        if roots == 0:
            continue
        if roots == 1 and low > 0 and high - low <= SHARP * low:
            found.append((low, high))
            continue
        middle = _middle(low, high)
        wide += [(low, middle), (middle, high)]
    return sorted(found)


def _quotient(dividend: Polynomial, divisor: Polynomial) -> Polynomial:
    rest, result = [Fraction(value) for value in dividend], []
    for i in range(len(dividend) - len(divisor) + 1):
        result.append(rest[i] / divisor[0])
        for j, value in enumerate(divisor):
            rest[i + j] -= result[-1] * value
    return _whole(result)


def _middle(low: Fraction, high: Fraction) -> Fraction:
    """A short number between two positive ones, by their ratio where that is large."""
    if low == 0:
        return high / 2**16
    if high > 4 * low:
        bits = (math.log2(low) + math.log2(high)) / 2
        return Fraction(2) ** round(bits) if high > 8 * low else (low + high) / 2
    return (low + high) / 2
