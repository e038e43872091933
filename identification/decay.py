"""What a ring-down tells at a glance: its frequency, its damping, and when it was let go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks


@dataclass(frozen=True)
class Glance:
    """First look at an oscillating channel.

    Attributes:
        frequency: dominant frequency [Hz]; 0 where none is seen.
        damping_ratio: from the decay of the peaks [-].
        rest: level about which it swings [channel's unit].
        amplitude: largest distance from that level [channel's unit].
    """

    frequency: float
    damping_ratio: float
    rest: float
    amplitude: float


def glance(values: np.ndarray, sample_rate: float) -> Glance:
    """Dominant frequency by the peak of the spectrum, damping by the slope of log peaks.

    Args:
        values: samples, shape (t,) [any unit].
        sample_rate: [Hz].

    Returns:
        The first look; good enough to start a fit, never a result.
    """
    count = len(values)
    rest = float(np.mean(values[-max(8, count // 3) :]))
    swing = values - rest
    spectrum = np.abs(np.fft.rfft(swing * np.hanning(count)))
    spectrum[0] = 0.0
    top = int(np.argmax(spectrum))
    if 0 < top < len(spectrum) - 1 and spectrum[top] > 0:
        low, mid, high = np.log(np.maximum(spectrum[top - 1 : top + 2], 1e-300))
        bend = low - 2 * mid + high
        shift = 0.5 * (low - high) / bend if bend < 0 else 0.0
    else:
        shift = 0.0
    frequency = (top + shift) * sample_rate / count
    amplitude = float(np.max(np.abs(swing)))
    return Glance(frequency, _damping(swing, sample_rate, frequency), rest, amplitude)


def _damping(swing: np.ndarray, sample_rate: float, frequency: float) -> float:
    if frequency <= 0:
        return 0.0
    apart = max(1, int(0.7 * sample_rate / frequency))
    peaks = find_peaks(np.abs(swing), distance=max(1, apart // 2))[0]
    heights = np.abs(swing)[peaks]
    peaks = peaks[heights > 0.1 * heights.max()] if len(heights) else peaks
    if len(peaks) < 3:
        return 0.01
    slope = np.polyfit(peaks / sample_rate, np.log(np.abs(swing)[peaks]), 1)[0]
    return float(np.clip(-slope / (2 * np.pi * frequency), 1e-4, 0.5))


def free_from(values: np.ndarray, sample_rate: float) -> int:
    """First sample of a decay at which no hand holds the system any more.

    A hand that lets go, or a hold before, bends the first quarter of a swing (real records show
    it); it does not follow the system through rest. So a decay counts from its first crossing of
    rest after the first large excursion.

    Args:
        values: samples of one channel, shape (t,) [any unit].
        sample_rate: [Hz].

    Returns:
        Index of the first free sample; 0 where nothing swings.
    """
    look = glance(values, sample_rate)
    if look.frequency <= 0:
        return 0
    swing = values - look.rest
    first = int(np.argmax(np.abs(swing) > 0.5 * look.amplitude))
    crossed = np.flatnonzero(np.sign(swing[first:]) != np.sign(swing[first]))
    return first + int(crossed[0]) if len(crossed) else 0
