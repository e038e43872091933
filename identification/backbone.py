"""Frequency and damping against amplitude, read off the peaks of a decay."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, find_peaks, sosfiltfilt

_FEWEST_PEAKS = 4  # in one point of the backbone
_SHORT = 16  # a decay with fewer extrema has a point for every three in a row
_MOST_POINTS = 20


@dataclass(frozen=True)
class Backbone:
    """How a decay's frequency and damping change as it dies away.

    Attributes:
        amplitude: half of the swing from peak to peak, ``(b,)`` [unit of the values].
        frequency: cycles in a second at that amplitude, ``(b,)`` [Hz].
        damping_ratio: equivalent viscous damping at that amplitude, ``(b,)`` [1].
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    damping_ratio: np.ndarray


def backbone(times: np.ndarray, values: np.ndarray, noise: float = 0.0) -> Backbone:
    """Read the backbone off the extrema of a decay.

    Extrema are located by a parabola through the samples around them. Those smaller than three
    times the noise are left out. Points of the backbone are means over at least four extrema; of
    a short decay, over each three in a row.
    An offset does not matter, a second mode does unless it is three times higher.

    Args:
        times: equally spaced instants, ``(t,)`` [s].
        values: the decay at these instants, ``(t,)`` [any unit].
        noise: standard deviation of the noise [same unit].

    Returns:
        The backbone; empty where the decay has fewer than six extrema above the noise.

    Source: own derivation, checked by tests/identification/test_backbone.py against closed forms.
    """
    empty = Backbone(np.empty(0), np.empty(0), np.empty(0))
    if len(values) < 32 or not np.ptp(values) > 0.0:
        return empty
    interval = float(times[1] - times[0])
    period = period_of(values)
    smooth = _low_pass(values, 3.0 / period)
    instants, extrema = extrema_of(smooth, period, 3.0 * noise)
    if len(instants) < 6:
        return empty
    amplitude = np.abs(extrema[1:-1] - 0.5 * (extrema[:-2] + extrema[2:])) / 2.0
    frequency = 1.0 / ((instants[2:] - instants[:-2]) * interval)
    times_of = instants[1:-1] * interval
    loud = amplitude > max(3.0 * noise, 1e-3 * amplitude.max())
    return _points(times_of[loud], amplitude[loud], frequency[loud])


def counted_change(values: np.ndarray, rate: float) -> tuple[float, float]:
    """How a decay's frequency changes from the smallest swings to the largest, without any model.

    Args:
        values: the decay; what comes before its largest excursion is left out, ``(t,)``.
        rate: samples a second [Hz].

    Returns:
        Relative change of frequency over the square of the amplitude, and its standard error from
        the scatter of the cycles [1]; both zero where there are too few cycles.

    Source: Duffing's backbone to second order; tests/identification/test_backbone.py.
    """
    first = int(np.argmax(np.abs(values - np.mean(values))))
    kept = values[first:]
    curve = backbone(np.arange(len(kept)) / rate, kept)
    if len(curve.amplitude) < 4:
        return 0.0, 0.0
    square = (curve.amplitude / curve.amplitude.max()) ** 2
    (slope, level), spread = np.polyfit(square, curve.frequency, 1, cov=True)
    return float(slope / level), float(np.sqrt(spread[0, 0]) / level)


def period_of(values: np.ndarray) -> float:
    """Samples in one period of the strongest line of the spectrum [-]; `values` of shape (t,)."""
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values))))
    return len(values) / max(int(np.argmax(spectrum[2:])) + 2, 1)


def _low_pass(values: np.ndarray, corner: float) -> np.ndarray:
    """Zero-phase low pass at `corner` cycles in a sample, where that is below the limit."""
    if corner > 0.4:
        return values
    return sosfiltfilt(butter(2, 2.0 * corner, output="sos"), values)


def extrema_of(
    values: np.ndarray, period: float, prominence: float
) -> tuple[np.ndarray, np.ndarray]:
    """Alternating maxima and minima: their places in samples [-], and their values [any unit]."""
    least = max(prominence, 1e-4 * float(np.ptp(values)))
    rules = {"distance": max(1.0, 0.3 * period), "prominence": least}
    found = [(i, 1.0) for i in find_peaks(values, **rules)[0]]
    found += [(i, -1.0) for i in find_peaks(-values, **rules)[0]]
    kept: list[tuple[int, float]] = []
    for place, sign in sorted(found):
        if kept and kept[-1][1] == sign:
            if sign * values[place] > sign * values[kept[-1][0]]:
                kept[-1] = (place, sign)
        else:
            kept.append((place, sign))
    half = max(1, round(0.08 * period))
    refined = [_vertex(values, place, half) for place, _ in kept]
    return np.array([r[0] for r in refined]), np.array([r[1] for r in refined])


def _vertex(values: np.ndarray, place: int, half: int) -> tuple[float, float]:
    """Vertex of the parabola through the samples around `place`."""
    first, last = max(0, place - half), min(len(values), place + half + 1)
    offsets = np.arange(first, last) - place
    if len(offsets) < 3:
        return float(place), float(values[place])
    bend, slope, level = np.polyfit(offsets, values[first:last], 2)
    shift = -slope / (2.0 * bend) if bend != 0.0 else 0.0
    if abs(shift) > half:
        return float(place), float(values[place])
    return place + float(shift), float(level + slope * shift / 2.0)


def _points(times: np.ndarray, amplitude: np.ndarray, frequency: np.ndarray) -> Backbone:
    """Means over groups of extrema that lie near each other in amplitude."""
    level = np.log(amplitude)
    points = []
    for group in _groups(level):
        rate = -float(np.polyfit(times[group], level[group], 1)[0])
        mean = float(np.mean(frequency[group]))
        points.append((float(np.exp(np.mean(level[group]))), mean, rate))
    table = np.array(points).reshape(-1, 3)
    angular = 2.0 * np.pi * table[:, 1]
    return Backbone(table[:, 0], table[:, 1], table[:, 2] / np.hypot(angular, table[:, 2]))


def _groups(level: np.ndarray) -> list[slice]:
    if len(level) < _SHORT:
        return [slice(first, first + 3) for first in range(len(level) - 2)]
    step = float(np.ptp(level)) / _MOST_POINTS
    groups, first = [], 0
    for last in range(1, len(level) + 1):
        if last - first >= _FEWEST_PEAKS and abs(level[last - 1] - level[first]) >= step:
            groups.append(slice(first, last))
            first = last
    return groups
