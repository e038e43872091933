"""From the strain of a shaft to the deflection of its head, with the calibration's error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

STRAIN_PER_METER = 0.024
"""Strain of the gauge below the grip for a metre of deflection at the head [1/m]; line 1833."""

FEWEST = 3
"""Fewest points of a calibration [-]."""


@dataclass(frozen=True)
class Calibration:
    """How a gauge reads when the head is bent aside by known distances.

    Attributes:
        gain: strain for a metre of deflection [1/m].
        gain_std: its standard deviation [1/m].
        zero: strain of the straight shaft [1].
        zero_std: its standard deviation [1].
        covariance: of gain and zero [1/m].
        scatter: standard deviation of one reading about the line [1].
        curvature_p: how likely such a bend of the line is by chance; None for too few points [-].
        count: points [-].
    """

    gain: float = STRAIN_PER_METER
    gain_std: float = 0.0
    zero: float = 0.0
    zero_std: float = 0.0
    covariance: float = 0.0
    scatter: float = 0.0
    curvature_p: float | None = None
    count: int = 0


@dataclass(frozen=True, eq=False)
class Deflection:
    """A strain as the deflection of the head.

    Attributes:
        values: shape (n,) [m].
        std: what the calibration leaves unknown of each, shape (n,) [m].
    """

    values: np.ndarray
    std: np.ndarray


def calibrate(deflections: np.ndarray, strains: np.ndarray) -> Calibration:
    """The straight line through readings at known deflections, its errors, and whether it bends.

    Args:
        deflections: shape (n,), as set [m].
        strains: shape (n,), as read [1].

    Returns:
        The calibration; with few points the errors are those of Student's distribution with
        n - 2 degrees of freedom.

    Raises:
        ValueError: for too few points, all at one deflection, or a line without a slope.

    Source: thesis lines 649 and 1833, a clamped grip with the head pushed aside.
    """
    x, y = np.asarray(deflections, dtype=float), np.asarray(strains, dtype=float)
    if len(x) != len(y) or len(x) < FEWEST or not (np.isfinite(x) & np.isfinite(y)).all():
        raise ValueError(
            f"calibration: expected at least {FEWEST} pairs of finite numbers, found {len(x)} "
            f"deflections and {len(y)} strains. Mend: read the gauge at more deflections."
        )
    middle = float(x.mean())
    spread = float(np.sum((x - middle) ** 2))
    if spread <= 0.0:
        raise ValueError(
            "calibration: expected several deflections, found one. Mend: bend the shaft both ways."
        )
    gain = float(np.sum((x - middle) * y) / spread)
    zero = float(y.mean()) - gain * middle
    left = y - zero - gain * x
    scatter = math.sqrt(float(np.sum(left**2)) / (len(x) - 2))
    if gain == 0.0:
        raise ValueError(
            "calibration: expected strain that follows the deflection, found none. Mend: check "
            "the gauge's direction."
        )
    return Calibration(
        gain,
        scatter / math.sqrt(spread),
        zero,
        scatter * math.sqrt(1 / len(x) + middle**2 / spread),
        -(scatter**2) * middle / spread,
        scatter,
        _curvature(x, y),
        len(x),
    )


def _curvature(x: np.ndarray, y: np.ndarray) -> float | None:
    """p-value of a square term beside the line."""
    n = len(x)
    if n < 5:
        return None
    columns = np.stack([np.ones(n), x, x**2], axis=1)
    weights, *_ = np.linalg.lstsq(columns, y, rcond=None)
    rest = float(np.sum((y - columns @ weights) ** 2)) / (n - 3)
    inverse = np.linalg.pinv(columns.T @ columns)
    if rest <= 1e-24 * float(np.sum(y**2)):
        return 1.0
    return float(2 * stats.t.sf(abs(weights[2]) / math.sqrt(rest * inverse[2, 2]), n - 3))


def deflection(strain: np.ndarray, calibration: Calibration | None = None) -> Deflection:
    """Deflection of the head from the strain below the grip.

    Args:
        strain: shape (n,) [1].
        calibration: of the gauge; the thesis's number, taken for exact, where None.

    Returns:
        The deflection, and what the calibration's errors make of it [m].

    Source: thesis line 1833: 0.024 of strain for a metre.
    """
    one = calibration or Calibration()
    values = (np.asarray(strain, dtype=float) - one.zero) / one.gain
    variance = (
        one.zero_std**2 + 2 * values * one.covariance + (values * one.gain_std) ** 2
    ) / one.gain**2
    return Deflection(values, np.sqrt(np.maximum(variance, 0.0)))
