"""When the club met the ball: the first leap of the lead/lag acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

LEAP = 30.0
"""Change from one sample to the next that tells an impact [m/s^2]; thesis line 1811."""

NOISE = 8.0
"""Leaps of noise, in its standard deviations, that an impact must be above [-]."""


CONTACT = 5e-4
"""How long a ball stays on the face [s]; thesis line 1857."""


@dataclass(frozen=True)
class Instant:
    """An impact in one channel.

    Attributes:
        time: of the leap, halfway between the last sample before and the first after it [s];
            nan where there is none.
        std: half a sampling step either way, evenly likely [s].
        leap: the leap that told it [m/s^2].
        threshold: from which a leap counts [m/s^2].
        margin: the threshold over the largest leap of the 50 ms before [-].
        status: ``found``, ``none`` or ``in_doubt``.
        sentence: what was found, in words.
    """

    time: float
    std: float
    leap: float
    threshold: float
    margin: float
    status: str
    sentence: str


def impact_instant(
    acceleration: np.ndarray, rate: float, start: float = 0.0, threshold: float = LEAP
) -> Instant:
    """The first sample at which the acceleration's differential reaches a threshold.

    Args:
        acceleration: perpendicular to the face, shape (n,), unfiltered [m/s^2].
        rate: samples a second [Hz].
        start: time of the first sample [s].
        threshold: leap from sample to sample [m/s^2]; raised to eight standard deviations of the
            channel's own leaps where those are larger.

    Returns:
        The impact, or in words why there is none.

    Source: thesis line 1811.
    """
    values = np.asarray(acceleration, dtype=float)
    if len(values) < 16 or not np.isfinite(values).all():
        raise ValueError(
            "acceleration: expected at least 16 finite samples, found fewer or others. Mend: cut "
            "the record to where it is known."
        )
    leaps = np.diff(values)
    usual = float(np.median(np.abs(leaps))) / 0.6745
    level = max(threshold, NOISE * usual)
    over = np.flatnonzero(np.abs(leaps) >= level)
    step = 1.0 / rate
    if not over.size:
        most = float(np.max(np.abs(leaps)))
        text = f"No impact: the largest leap between samples is {most:.3g} of {level:.3g} m/s^2."
        return Instant(math.nan, math.nan, most, level, math.nan, "none", text)
    first = int(over[0])
    before = np.abs(leaps[max(0, first - round(0.05 * rate)) : first])
    margin = level / float(before.max()) if before.size and before.max() > 0 else math.inf
    time = start + (first + 0.5) * step
    text = f"Impact at {time:.5f} s, where the acceleration leaps by {leaps[first]:.3g} m/s^2."
    burst = over[over <= first + max(3, round(0.005 * rate))]
    lone = burst[-1] - first < 0.5 * CONTACT * rate
    doubts = []
    if level > threshold:
        doubts.append(f"the channel's noise raised the threshold to {level:.3g} m/s^2")
    if margin < 1.5:
        doubts.append("leaps shortly before come close to the threshold")
    if lone:
        doubts.append("it is a lone spike, shorter than any blow")
    status = "in_doubt" if lone or margin < 1.5 else "found"
    if doubts:
        text += f" In doubt: {'; '.join(doubts)}." if status != "found" else f" {doubts[0]}."
    return Instant(
        time, step / math.sqrt(12.0), float(abs(leaps[first])), level, margin, status, text
    )
