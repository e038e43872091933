"""All roots of many real polynomials side by side."""

from __future__ import annotations

from typing import Any

import numpy as np

FIRST_STEPS, MOST_STEPS = 4, 14
"""Steps that every design is given, and after how many a root counts as not found [-]."""

LAST_STEP = 2e-5
"""A step smaller than this share of a root is its last: what is left is of its cube [-]."""

SOUND = 1e-8
"""Newton's step after that, as a share of a root, up to which it is believed [-]."""

FITTING = 1e-8
"""How well sums and product of the roots have to fit the polynomial [-]."""


def roots_of(coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All roots of real polynomials that decay or stand, side by side.

    Args:
        coefficients: not below zero, the constant first, shape (degree + 1, designs) [any].

    Returns:
        Roots, shape (degree, designs), real ones without an imaginary part [unit of the
        variable]; the polynomials' slopes there, same shape; whether those of a design are all
        found, shape (designs,).

    Source: Aberth 1973, doi:10.1090/S0025-5718-1973-0329236-7, from the radii of Newton's polygon
    (Bini 1996, doi:10.1007/BF02207694). What a design gets does not depend on its neighbors.
    """
    whole = coefficients.astype(complex)
    with np.errstate(all="ignore"):
        z = _first_guesses(coefficients)
        step = np.zeros_like(z)
        for _ in range(FIRST_STEPS):
            step = _step(whole, z)
            z -= step
        left = np.flatnonzero(~_all_small(step, z, LAST_STEP))
        for _ in range(MOST_STEPS - FIRST_STEPS):
            if not len(left):
                break
            own, near = whole[:, left], z[:, left]
            step = _step(own, near)
            near -= step
            z[:, left] = near
            left = left[~_all_small(step, near, LAST_STEP)]
        z = _real_or_paired(z)
        value, slope = _horner(whole, z)
        step = value / slope
        z -= step
        sound = _all_small(step, z, SOUND) & _fits(coefficients, z)
        sound[left] = False
        return z, coefficients[-1] * _each_other(z)[0], sound


def _step(coefficients: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Aberth's step: Newton's, held off the other roots."""
    value, slope = _horner(coefficients, z)
    product, total = _each_other(z)
    slope *= product
    total *= value
    slope -= total
    value *= product
    value /= slope
    return value


def _first_guesses(coefficients: np.ndarray) -> np.ndarray:
    """Radii of Newton's polygon, unsymmetric to the left, nearer to real where one is alone."""
    slopes = _polygon(coefficients)
    around = np.full((len(slopes) + 1, slopes.shape[1]), np.inf)
    np.abs(np.diff(slopes, axis=0), out=around[1:-1])
    turn = np.cos(2.4 * np.arange(len(slopes)) + 0.3)[:, None]
    aside = 2.0 * turn * np.exp(-2.0 * np.minimum(around[:-1], around[1:]))
    z: Any = np.empty(slopes.shape, complex)
    z.real = np.exp(-slopes) / -np.sqrt(1.0 + aside * aside)
    z.imag = z.real * aside
    return z


def _polygon(coefficients: np.ndarray) -> np.ndarray:
    """Slopes of the least concave curve above the coefficients' logarithms, one a root."""
    size = np.log(np.maximum(coefficients, 1e-300))
    count = len(size)
    found = np.full((count - 1, size.shape[1]), np.inf)
    for i in range(count - 1):
        steepest = (size[i + 1 :] - size[i]) / np.arange(1, count - i)[:, None]
        for k in range(count - 2, i - 1, -1):
            if k < count - 2:
                np.maximum(steepest[k - i], steepest[k - i + 1], out=steepest[k - i])
            np.minimum(found[k], steepest[k - i], out=found[k])
    return found


def _square(z: np.ndarray) -> np.ndarray:
    return np.real(z) ** 2 + np.imag(z) ** 2


def _all_small(step: np.ndarray, z: np.ndarray, share: float) -> np.ndarray:
    return np.all(_square(step) <= share**2 * _square(z), axis=0)


def _horner(coefficients: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Value and slope of polynomials with complex coefficients."""
    value = coefficients[-1] * z
    value += coefficients[-2]
    slope = coefficients[-1] * z
    slope += value
    value *= z
    value += coefficients[-3]
    for one in coefficients[-4::-1]:
        slope *= z
        slope += value
        value *= z
        value += one
    return value, slope


def _each_other(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Product of ``z_i - z_j`` over the other roots, and that times the sum of ``1 / (...)``."""
    twice = np.concatenate([z, z])
    product = z - twice[1 : len(z) + 1]
    total = np.ones_like(z)
    for k in range(2, len(z)):
        gap = z - twice[k : len(z) + k]
        total *= gap
        total += product
        product *= gap
    return product, total


def _real_or_paired(z: Any) -> np.ndarray:
    """Make roots real, or conjugates of the root that is nearest to being it."""
    twice = np.concatenate([z, z]).conj()
    nearest, apart = np.full(z.shape, np.inf), np.zeros(z.shape, np.int8)
    for k in range(1, len(z)):
        gap = _square(z - twice[k : len(z) + k])
        np.copyto(apart, k, where=gap < nearest)
        np.minimum(nearest, gap, out=nearest)
    z.imag[4.0 * z.imag**2 <= nearest] = 0.0
    root, design = np.nonzero(z.imag > 0)
    z[(root + apart[root, design]) % len(z), design] = z[root, design].conj()
    return z


def _fits(coefficients: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Whether the roots' sum, sum of inverses and product are those of the polynomial."""
    low, last = coefficients[0], coefficients[-1]
    turned = 1.0 / z
    found = (np.sum(np.sign(np.imag(z)), axis=0) == 0) & (low > 0)
    for total, told, size in (
        (z.sum(axis=0), -coefficients[-2] / last, np.abs(z).sum(axis=0)),
        (turned.sum(axis=0), -coefficients[1] / low, np.abs(turned).sum(axis=0)),
        (np.prod(z, axis=0), (-1) ** len(z) * low / last, low / last),
    ):
        found &= np.abs(total - told) <= FITTING * size
    return found
