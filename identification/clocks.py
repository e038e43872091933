"""Records on other clocks: offset and drift against each other, and resampling to given points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import correlate, find_peaks

from .lowpass import zero_phase_lowpass

CLEAR = 0.7
"""Correlation from which two channels show the same event [-]."""

ROOM = 0.8
"""Share of the new Nyquist frequency that resampling keeps [-]."""

FEWEST = 32
"""Fewest samples that two records must share [-]."""


EVEN = 1e-3
"""By which share points may be wider apart than samples and need no low-pass [-]."""

TRIED = 5
"""Peaks of the correlation from which least squares starts [-]."""


@dataclass(frozen=True)
class Shift:
    """How another clock stands against ours: ours = offset + (1 + drift) theirs.

    Attributes:
        offset: of its zero [s].
        offset_std: standard deviation [s].
        drift: by which share it is slow [-]; 0 where it was not sought.
        drift_std: standard deviation [-].
        correlation: of the two once aligned; nan where events were matched [-].
        status: ``aligned`` or ``in_doubt``.
    """

    offset: float
    offset_std: float
    drift: float
    drift_std: float
    correlation: float
    status: str

    def ours(self, times: np.ndarray) -> np.ndarray:
        """Times of the other clock on ours, shape (n,) [s]."""
        return self.offset + (1.0 + self.drift) * np.asarray(times, dtype=float)


def shift_of_events(ours: tuple[float, float], theirs: tuple[float, float]) -> Shift:
    """Two clocks by one event that both saw, such as the impact.

    Args:
        ours: its time on our clock, and the standard deviation [s].
        theirs: its time on the other clock, and the standard deviation [s].

    Returns:
        The offset; the drift stays 0.
    """
    offset, std = ours[0] - theirs[0], math.hypot(ours[1], theirs[1])
    return Shift(
        offset, std, 0.0, 0.0, math.nan, "aligned" if math.isfinite(offset) else "in_doubt"
    )


def shift_of_signals(
    ours: tuple[np.ndarray, np.ndarray], theirs: tuple[np.ndarray, np.ndarray], drifts: bool = False
) -> Shift:
    """Two clocks by a motion that both saw, with gain and zero of the channels free.

    Args:
        ours: even times [s] and values [any unit], each shape (n,).
        theirs: even times on their own clock [s] and values [may be another unit], shape (m,).
        drifts: whether the rates are told apart too.

    Returns:
        Offset and drift with their errors by least squares; the rates may differ.

    Raises:
        ValueError: where a record is too short.
    """
    (t, x), (u, y) = ((np.asarray(a, float), np.asarray(b, float)) for a, b in (ours, theirs))
    if min(len(t), len(u)) < FEWEST:
        raise ValueError(
            f"records: expected at least {FEWEST} samples in each, found {len(t)} and {len(u)}. "
            "Mend: name longer ones."
        )
    step = max(t[1] - t[0], u[1] - u[0])
    found = [_refined(t, x, u, y, guess, drifts) for guess in _coarse(t, x, u, y, step)]
    return max(found, key=lambda one: one[0])[1]


def _refined(
    t: np.ndarray, x: np.ndarray, u: np.ndarray, y: np.ndarray, guess: float, drifts: bool
) -> tuple[float, Shift]:
    """Least squares from a first offset: the logarithm of its likelihood, and what was found."""
    numbers = np.array([guess, 0.0])
    smooth, middle = CubicSpline(u, y), float(u.mean())
    covariance, correlation, free = np.zeros((2, 2)), 0.0, 1
    for _ in range(12):
        own = middle + (t - numbers[0] - middle) * (1.0 - numbers[1])
        inside = (own >= u[0]) & (own <= u[-1])
        if inside.sum() < FEWEST:
            return 0.0, Shift(guess, math.inf, 0.0, math.inf, 0.0, "in_doubt")
        seen, slope = smooth(own[inside]), smooth(own[inside], 1)
        columns = np.stack([np.ones(len(seen)), seen], axis=1)
        weights, *_ = np.linalg.lstsq(columns, x[inside], rcond=None)
        left = x[inside] - columns @ weights
        moves = -weights[1] * np.stack([slope, slope * (t[inside] - numbers[0] - middle)], axis=1)
        whole = np.concatenate([moves if drifts else moves[:, :1], columns], axis=1)
        change = np.linalg.lstsq(whole, left, rcond=None)[0][:-2]
        numbers[: len(change)] += change
        free = max(1, len(left) - whole.shape[1])
        inverse = np.linalg.pinv(whole.T @ whole)[: len(change), : len(change)]
        covariance[: len(change), : len(change)] = inverse * float(left @ left) / free
        correlation = float(np.corrcoef(x[inside], seen)[0, 1])
        if abs(change[0]) < 1e-12:
            break
    # own = middle + (t - numbers[0] - middle)(1 - numbers[1])  <=>  t = offset + (1 + drift) own
    drift = 1.0 / (1.0 - numbers[1]) - 1.0
    told = Shift(
        float(numbers[0] - drift * middle),
        math.hypot(math.sqrt(covariance[0, 0]), middle * math.sqrt(covariance[1, 1])),
        float(drift),
        math.sqrt(covariance[1, 1]),
        correlation,
        "aligned" if abs(correlation) >= CLEAR else "in_doubt",
    )
    return -free * math.log(max(1e-15, 1.0 - correlation**2)), told


def _coarse(t: np.ndarray, x: np.ndarray, u: np.ndarray, y: np.ndarray, step: float) -> list[float]:
    """Offsets with the largest correlations, within a step [s]."""
    a, b = (np.interp(np.arange(one[0], one[-1], step), one, v) for one, v in ((t, x), (u, y)))
    a, b = a - a.mean(), b - b.mean()
    whole = correlate(a, b, mode="full")
    lags = np.arange(-len(b) + 1, len(a))
    power_a = correlate(a**2, np.ones_like(b), mode="full")
    power_b = correlate(np.ones_like(a), b**2, mode="full")
    shared = correlate(np.ones_like(a), np.ones_like(b), mode="full")
    likeness = np.abs(whole) / np.sqrt(np.maximum(power_a * power_b, 1e-300))
    likeness[shared < max(FEWEST, 0.4 * min(len(a), len(b)))] = 0.0
    tops = find_peaks(likeness)[0]
    tops = tops[np.argsort(likeness[tops])][-TRIED:] if len(tops) else [int(np.argmax(likeness))]
    return [float(t[0] - u[0] + step * lags[top]) for top in tops]


@dataclass(frozen=True, eq=False)
class Points:
    """A channel at given points.

    Attributes:
        values: shape (p,); nan where the record does not reach [channel's unit].
        is_known: whether it does, shape (p,) [-].
        cutoff: of the low-pass before it; None where the points are closer than the samples [Hz].
    """

    values: np.ndarray
    is_known: np.ndarray
    cutoff: float | None


def on_points(times: np.ndarray, values: np.ndarray, points: np.ndarray) -> Points:
    """A channel at the points of a profile, without what they are too far apart to show.

    Args:
        times: of its samples on the points' clock, even, shape (n,) [s].
        values: shape (n,) [any unit].
        points: such as the 1000 of a profile, even, shape (p,) [s].

    Returns:
        By a zero-phase low-pass and a cubic spline; nan beyond the record, and said so.

    Source: thesis line 1811, with nan for padding; the low-pass is ours: it took every n-th
    sample.
    """
    step, wide = float(times[1] - times[0]), float(points[1] - points[0])
    cutoff = ROOM * 0.5 / wide if wide > step * (1.0 + EVEN) else None
    kept = values if cutoff is None else zero_phase_lowpass(values, 1.0 / step, cutoff)
    is_known = (points >= times[0]) & (points <= times[-1])
    found = np.full(len(points), np.nan)
    found[is_known] = CubicSpline(times, kept)(points[is_known])
    return Points(found, is_known, cutoff)
