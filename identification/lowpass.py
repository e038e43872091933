"""Two low-passes without delay: a rectangular window on the FFT, and Butterworth's both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

STRAIN_CUTOFFS = (15.0, 30.0)
"""Cut-offs of the thesis for strain, in chapters 4 and 8 [Hz]; lines 847 and 1844."""

ORDER = 4
"""Order of the Butterworth filter, run forth and back [-]."""

MOST = 0.45
"""Largest cut-off as a share of the sample rate [-]."""


@dataclass(frozen=True, eq=False)
class Filtered:
    """One channel through both filters.

    Attributes:
        cutoff: of both [Hz].
        by_fft: through the rectangular window, shape (n,) [channel's unit].
        zero_phase: through the Butterworth filter forth and back, shape (n,) [channel's unit].
        rms: root mean square of their difference, away from the ends [channel's unit].
        rms_at_ends: the same within a period of the cut-off of either end [channel's unit].
        largest: largest difference [channel's unit].
        at: where that is, from the first sample [s].
        ringing: largest that the FFT's filter makes of the record's first calm part, less what the
            other makes of it [channel's unit].
        removed: root mean square of what the zero-phase filter takes away [channel's unit].
    """

    cutoff: float
    by_fft: np.ndarray
    zero_phase: np.ndarray
    rms: float
    rms_at_ends: float
    largest: float
    at: float
    ringing: float
    removed: float


def fft_lowpass(values: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    """What the thesis does: all lines of the spectrum above the cut-off become zero.

    The record is taken for periodic, and sharp events ring at the cut-off, before them too.

    Args:
        values: shape (n,) [any unit].
        rate: samples a second [Hz].
        cutoff: last frequency that stays [Hz].

    Returns:
        Shape (n,) [same unit].

    Raises:
        ValueError: where the cut-off is not between 0 and `MOST` of the rate.

    Source: thesis lines 847, 863, 1844.
    """
    _check(values, rate, cutoff)
    spectrum = np.fft.rfft(values)
    spectrum[np.fft.rfftfreq(len(values), 1.0 / rate) > cutoff] = 0.0
    return np.fft.irfft(spectrum, len(values))


def zero_phase_lowpass(values: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    """A Butterworth filter forth and back: no delay, no ringing ahead, half power at the cut-off.

    Args:
        values: shape (n,) [any unit].
        rate: samples a second [Hz].
        cutoff: where the power of both passes together is a half [Hz].

    Returns:
        Shape (n,) [same unit].

    Raises:
        ValueError: where the cut-off is not between 0 and `MOST` of the rate.
    """
    _check(values, rate, cutoff)
    # two passes: each may lose a factor of sqrt(sqrt(1/2)) of the amplitude at the cut-off
    own = cutoff / (np.sqrt(2.0) - 1.0) ** (1.0 / (2 * ORDER))
    sections = butter(ORDER, min(own, 0.49 * rate), fs=rate, output="sos")
    return np.asarray(
        sosfiltfilt(sections, values, padlen=min(len(values) - 1, int(2 * rate / cutoff)))
    )


def _check(values: np.ndarray, rate: float, cutoff: float) -> None:
    if not 0.0 < cutoff <= MOST * rate:
        raise ValueError(
            f"cutoff: expected between 0 and {MOST * rate:g} Hz, found {cutoff:g} Hz. Mend: lower "
            "it, or measure at a higher rate."
        )
    if len(values) < 8 or not np.isfinite(values).all():
        raise ValueError(
            "values: expected at least 8 finite samples, found fewer or others. Mend: cut the "
            "record to where it is known."
        )


def both_filters(values: np.ndarray, rate: float, cutoff: float) -> Filtered:
    """A channel through both filters, and where they differ.

    Args:
        values: shape (n,) [any unit].
        rate: samples a second [Hz].
        cutoff: of both [Hz].

    Returns:
        Both, and their difference in numbers.

    Raises:
        ValueError: where the cut-off is not between 0 and `MOST` of the rate.
    """
    values = np.asarray(values, dtype=float)
    by_fft, smooth = fft_lowpass(values, rate, cutoff), zero_phase_lowpass(values, rate, cutoff)
    off, count = by_fft - smooth, len(values)
    edge = min(count // 4, max(1, round(rate / cutoff)))
    ends = np.r_[np.arange(edge), np.arange(count - edge, count)]
    inner = off[edge : count - edge]
    worst = int(np.argmax(np.abs(off)))
    calm = slice(edge, max(edge + 1, count // 10))
    zero = np.median(values[calm])
    ringing = np.max(np.abs(by_fft[calm] - zero)) - np.max(np.abs(smooth[calm] - zero))
    return Filtered(
        cutoff,
        by_fft,
        smooth,
        float(np.sqrt(np.mean(inner**2))),
        float(np.sqrt(np.mean(off[ends] ** 2))),
        float(np.abs(off[worst])),
        worst / rate,
        float(ringing),
        float(np.sqrt(np.mean((values - smooth) ** 2))),
    )
