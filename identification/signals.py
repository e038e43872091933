"""What one channel shows by itself: its main frequency, noise, steps of its converter, clipping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

HIGH_BAND = 0.8
"""Noise is read between this share of the Nyquist frequency and the Nyquist frequency [-]."""

SHORTEST_FLAT = 3
"""Equal samples in a row that may be a flat top [-]."""

FALL = 10.0
"""Steps by which a signal falls at least within three samples beside a flat top [-]."""

ROUNDED = 2.5
"""Times that a rounded peak with so many equal samples falls there [-]: of 20000 such peaks under
noise of up to two steps eight were taken for flat."""

MOST_FOR_SPECTRUM = 1 << 19
"""Samples from which a spectrum is taken at most [-]; further ones change no estimate."""


@dataclass(frozen=True)
class Clipping:
    """Flat tops at the ends of a sensor's range.

    Attributes:
        share: of all samples that stand on a flat top [-].
        runs: how many flat tops there are [-].
        low: level of the flat bottoms in the channel's unit; None where there are none.
        high: level of the flat tops in the channel's unit; None where there are none.
    """

    share: float
    runs: int
    low: float | None
    high: float | None


def spectrum_of(values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Power density of a channel without its straight trend, through a Hann window.

    Args:
        values: shape (n,), at least 4.
        rate: samples a second [Hz].

    Returns:
        Frequencies [Hz] without zero, and one-sided power densities [unit^2/Hz].
    """
    y = values[:MOST_FOR_SPECTRUM]
    n = len(y)
    index = np.arange(n) - 0.5 * (n - 1)
    y = y - y.mean() - index * (np.sum(index * (y - y.mean())) / np.sum(index**2))
    window = np.hanning(n)
    power = np.abs(np.fft.rfft(y * window)) ** 2 * 2.0 / (rate * np.sum(window**2))
    return np.fft.rfftfreq(n, 1.0 / rate)[1:], power[1:]


def dominant_frequency(values: np.ndarray, rate: float) -> float | None:
    """The frequency with the highest peak [Hz]; None where none stands out.

    Args:
        values: shape (n,).
        rate: samples a second [Hz].

    Returns:
        The peak, interpolated between the lines of the spectrum.
    """
    if len(values) < 16:
        return None
    frequencies, power = spectrum_of(values, rate)
    peak = int(np.argmax(power))
    if power[peak] < 10.0 * np.median(power) or peak == 0:
        return None
    if peak + 1 < len(power):
        left, top, right = np.log(power[peak - 1 : peak + 2] + 1e-300)
        bend = left - 2.0 * top + right
        shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    else:
        shift = 0.0
    return float(frequencies[peak] + shift * (frequencies[1] - frequencies[0]))


def noise_std(values: np.ndarray, rate: float) -> float | None:
    """Standard deviation of the noise if it is white, from the highest frequencies.

    A median makes single lines harmless. It is an upper bound where the signal itself reaches
    there, and too low for noise that is strongest at low frequencies.

    Args:
        values: shape (n,).
        rate: samples a second [Hz].

    Returns:
        The standard deviation in the channel's unit; None for too few samples.
    """
    if len(values) < 64:
        return None
    frequencies, power = spectrum_of(values, rate)
    band = power[frequencies >= HIGH_BAND * 0.5 * rate]
    return float(np.sqrt(np.median(band) / np.log(2.0) * 0.5 * rate))


def quantization_step(values: np.ndarray) -> float | None:
    """The step of the converter or of the printed digits; None where none shows.

    Args:
        values: shape (n,).

    Returns:
        The smallest step between levels, in the channel's unit, where the levels repeat and all
        distances are multiples of it.
    """
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > 0.9 * len(values):
        return None
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * (levels[-1] - levels[0])]
    step = float(gaps.min())
    near = gaps[gaps < 20.5 * step]  # small multiples tell; the rest adds rounding only
    step = float(np.sum(near) / np.sum(np.round(near / step)))
    off = np.abs(near / step - np.round(near / step))
    return step if float(np.quantile(off, 0.9)) < 0.15 else None


def clipping(values: np.ndarray) -> Clipping | None:
    """Flat tops at the largest or smallest value that a smooth signal would not have.

    A flat top of a converter's steps, a rest at the end of a travel and a square wave are no
    clipping: there the signal arrives slowly, or in one leap. A clipped one arrives at full speed.

    Args:
        values: shape (n,), in any unit.

    Returns:
        What was found, its share [-]; None where nothing is clipped.
    """
    step = _smallest_step(values)
    found = {sign: _flat_tops(sign * values, step) for sign in (1.0, -1.0)}
    count = sum(sum(lengths) for lengths in found.values())
    if not count:
        return None
    return Clipping(
        share=count / len(values),
        runs=sum(map(len, found.values())),
        low=float(values.min()) if found[-1.0] else None,
        high=float(values.max()) if found[1.0] else None,
    )


def _smallest_step(values: np.ndarray) -> float:
    levels = np.unique(values)
    gaps = np.diff(levels)
    gaps = gaps[gaps > 1e-9 * (levels[-1] - levels[0])] if gaps.size else gaps
    return float(gaps.min()) if gaps.size else 0.0


def _flat_tops(values: np.ndarray, step: float) -> list[int]:
    """Lengths of the runs at the largest value that are met at full speed.

    Rest before and after an event is none: runs at the ends and at zero are passed over.
    """
    if values.max() == 0.0:
        return []
    top = np.concatenate([[False], values == values.max(), [False]])
    turns = np.flatnonzero(np.diff(top.astype(np.int8)))
    lengths = []
    for start, stop in zip(turns[0::2], turns[1::2], strict=True):
        if stop - start < SHORTEST_FLAT or start == 0 or stop == len(values):
            continue
        sides = [values[start - 1 :: -1][:6], values[stop:][:6]]
        gaps = stop - start - 1
        # a parabola that rounds to as many equal samples as these is one step high over them
        steps = max(FALL, ROUNDED * 12.0 * (gaps + 3.0) / gaps**2)
        if any(_at_full_speed(values[start] - side, steps * step) for side in sides):
            lengths.append(int(stop - start))
    return lengths


def _at_full_speed(drop: np.ndarray, least: float) -> bool:
    """Whether a signal leaves a flat top with a slope that does not grow from zero."""
    if len(drop) < 6:
        return False
    near, far = drop[2], drop[5] - drop[2]
    smooth = drop[0] < 0.9 * drop[2]  # a leap of a square wave is no slope
    return bool(smooth and near > least and near > 0.5 * far > 0.0)
