"""Measured against simulated: error, lag, peak ratio and what is left of an oscillation."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .runs import rms

SLOW = 2.5
"""Low-pass below which a swing moves, and above which its club oscillates [Hz]."""

RESTS, WATCHED = 0.6, 0.55
"""When after impact a golfer's arms have come to rest, and how long a club is watched then [s]."""

LATEST, STEP = 0.1, 5e-4
"""How far a lag is looked for, and how finely [s]."""


@dataclass(frozen=True)
class Comparison:
    """One channel of one swing, simulated against measured.

    Attributes:
        error: RMS of the difference over that of what was measured, up to impact [-].
        correlation: of the two up to impact [-].
        lag: by which the simulation comes late [s]; negative where it is early. Where the
            correlation is best, looked for within `LATEST`.
        aligned: correlation there [-].
        peak_ratio: largest simulated over largest measured magnitude up to impact [-].
        left_measured: `left` of what was measured [-].
        left_simulated: `left` of what was simulated [-].
    """

    error: float
    correlation: float
    lag: float
    aligned: float
    peak_ratio: float
    left_measured: float
    left_simulated: float

    def told(self) -> dict[str, Any]:
        """As JSON holds it."""
        return asdict(self)


def compare(
    times: np.ndarray,
    measured: np.ndarray,
    simulated: np.ndarray,
    unstruck: np.ndarray,
    before: np.ndarray,
    rests: tuple[float, float],
) -> Comparison:
    """Compares a simulated channel with a measured one.

    Args:
        times: even, shape (n,) [s].
        measured: nan where unknown, shape (n,) [any unit].
        simulated: shape (n,) [same unit].
        unstruck: simulated without the ball, so that a blow does not show before a lag is taken
            out, shape (n,) [same unit].
        before: which points count up to impact, shape (n,) [-].
        rests: from when the golfer's arms and the simulation's drive rest [s].

    Returns:
        The comparison [-, s].
    """
    own, other = measured[before], simulated[before]
    lags = np.arange(-LATEST, LATEST + 0.5 * STEP, STEP)
    alike = [_alike(own, np.interp(times[before] + lag, times, unstruck)) for lag in lags]
    best = int(np.argmax(alike))
    return Comparison(
        rms(other - own) / rms(own),
        _alike(own, other),
        float(lags[best]),
        alike[best],
        float(np.max(np.abs(other)) / np.max(np.abs(own))),
        left(times, measured, before, rests[0]),
        left(times, simulated, before, rests[1]),
    )


def _alike(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.corrcoef(one, other)[0, 1])


def left(times: np.ndarray, values: np.ndarray, before: np.ndarray, rests: float) -> float:
    """What still oscillates once the drive rests.

    Args:
        times: even, shape (n,) [s].
        values: shape (n,) [any unit].
        before: which points count up to impact, shape (n,) [-].
        rests: from when it does [s].

    Returns:
        RMS about the mean for `WATCHED` from then on, over the largest magnitude up to impact [-].
    """
    after = values[(times >= rests) & (times <= rests + WATCHED)]
    return float(np.nanstd(after) / np.nanmax(np.abs(values[before])))


def oscillation(times: np.ndarray, values: np.ndarray) -> np.ndarray:
    """What is left of a channel above the swing's own pace.

    Args:
        times: even, shape (n,) [s].
        values: shape (n,) [any unit].

    Returns:
        Less a zero-phase low-pass at `SLOW`, shape (n,) [same unit].
    """
    from ...identification.lowpass import zero_phase_lowpass

    return values - zero_phase_lowpass(values, 1.0 / float(times[1] - times[0]), SLOW)
