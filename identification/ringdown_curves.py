"""How frequency and damping of a ring-down change with amplitude, point by point, with errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .backbone import period_of
from .ringdown import ring_modes

FALL = 0.25
"""Fall of the logarithm of the amplitude over one point of a curve [-]."""

FEWEST_PERIODS = 3.0
"""Periods of one point [-]."""

MOST_POINTS = 24
"""Points of a curve [-]."""

QUIETEST = 4.0
"""Amplitude over noise below which a curve ends [-]."""


@dataclass(frozen=True)
class Curves:
    """Frequency and damping against amplitude.

    Attributes:
        amplitude: at which each point counts, falling, shape (points,) [unit of the values].
        frequency: damped, shape (points,) [Hz].
        frequency_std: standard errors, shape (points,) [Hz].
        damping_ratio: equivalent viscous, shape (points,) [-].
        damping_ratio_std: standard errors, shape (points,) [-].
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    frequency_std: np.ndarray
    damping_ratio: np.ndarray
    damping_ratio_std: np.ndarray


def amplitude_curves(values: np.ndarray, rate: float) -> Curves:
    """Frequency and damping against amplitude, from fits of one mode to one stretch at a time.

    Stretches do not overlap, so that errors of points are independent. A point's amplitude is
    the one at which a frequency that changes with the amplitude's square is its mean.

    Args:
        values: a ring-down of one mode from its first free sample on, shape (t,) [any unit].
        rate: samples a second [Hz].

    Returns:
        The curves; without points where nothing rings.

    Source: own derivation; tests/identification/test_ringdown.py holds it to Duffing's backbone
    and to quadratic damping, coverage included.
    """
    period = period_of(values)
    points, start = [], 0
    whole = ring_modes(values, rate, count=1)
    if not whole.rings:
        return Curves(*(np.empty(0) for _ in range(5)))
    decay = 2 * np.pi * whole.rings[0].frequency * whole.rings[0].damping_ratio
    noise = float(np.std(np.diff(values, 3)) / np.sqrt(20.0))
    shortest = max(int(FEWEST_PERIODS * period), 32)
    least = max(shortest, len(values) // MOST_POINTS)
    while start + shortest <= len(values) and len(points) < MOST_POINTS:
        length = max(least, int(FALL / max(decay, 1e-9) * rate))
        piece = values[start : start + length]
        found = ring_modes(piece, rate, count=1)
        start += length
        if not found.rings or len(piece) < shortest:
            continue
        ring = found.rings[0]
        rate_of_fall = 2 * np.pi * ring.frequency * ring.damping_ratio
        size = ring.amplitude * np.exp(-rate_of_fall * np.arange(len(piece)) / rate)
        if size[-1] < QUIETEST * noise:
            break
        decay = max(rate_of_fall, 0.2 * decay)
        at = float(np.sqrt(np.sum(size**4) / np.sum(size**2)))
        points.append(
            (
                at,
                ring.frequency,
                ring.frequency_std,
                ring.damping_ratio,
                ring.damping_ratio_std,
            )
        )
    table = np.array(points).reshape(-1, 5)
    return Curves(*(table[:, k] for k in range(5)))
