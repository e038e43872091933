"""Scores of samples of many designs, quick: the definitions are those of the model's scores."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model.score import FADED, SETTLED

SCORES = (
    "rms",
    "log_decrement",
    "log_decrement_local",
    "log_decrement_modal",
    "peak",
    "settling",
    "grip_displacement_peak",
)
"""Every score that a sweep knows."""


def rms(samples: np.ndarray) -> np.ndarray:
    """Root mean square, shape (designs,) of samples of shape (designs, t) [any unit]."""
    return np.sqrt(np.einsum("dt,dt->d", samples, samples) / samples.shape[1])


def peak(samples: np.ndarray) -> np.ndarray:
    """Largest magnitude, shape (designs,) of samples of shape (designs, t) [any unit]."""
    return np.maximum(samples.max(axis=1), -samples.min(axis=1))


def settling(samples: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Time until the magnitude stays below 5 % of the peak.

    Args:
        samples: shape (designs, t) [any unit].
        times: shape (t,) [s].

    Returns:
        Shape (designs,), from the first sample on [s]; infinite where the last is still too large,
        0 for nothing but zeros.

    Source: `supple.model.score.settling`.
    """
    size = np.abs(samples)
    limit = SETTLED * size.max(axis=1)
    above, rows = size > limit[:, None], np.arange(len(size))
    last = size.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)
    after = np.minimum(last + 1, size.shape[1] - 1)
    drop = size[rows, last] - size[rows, after]
    part = (size[rows, last] - limit) / np.where(drop > 0, drop, 1.0)
    crossed = times[last] + part * (times[after] - times[last])
    found = np.where(size[:, -1] > limit, np.inf, crossed - times[0])
    return np.where(above.any(axis=1), found, 0.0)


def largest_bins(samples: np.ndarray) -> np.ndarray:
    """Largest bin of the plain spectrum without its constant, shape (designs,) [-]."""
    return 1 + np.argmax(np.abs(np.fft.rfft(samples, axis=1))[:, 1:], axis=1)


def certified(samples: np.ndarray, size: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """Whether no bin beyond the first ones can be larger than the largest of them.

    What energy is left of the samples without the known bins is all that the others can have.

    Args:
        samples: shape (designs, t) [any unit].
        size: their `rms`, shape (designs,) [same unit].
        bins: squared magnitudes of bins 1, 2, ..., shape (designs, bins) [squared unit].

    Returns:
        Shape (designs,), truth values [-].
    """
    whole = (samples.shape[1] * size) ** 2
    left = whole - samples.sum(axis=1) ** 2 - 2.0 * bins.sum(axis=1)
    return left < bins.max(axis=1)


def log_decrement(samples: np.ndarray, bins: np.ndarray) -> np.ndarray:
    """Logarithmic decrement from the maxima of whole periods, down to 1 % of the first.

    Designs whose largest bins are equal and neighbors are read together: sort them first.

    Args:
        samples: shape (designs, t) [any unit].
        bins: largest bin of each design, shape (designs,) [-].

    Returns:
        Shape (designs,) [-]; NaN where fewer than two positive maxima stand.

    Source: `supple.model.score.log_decrement`.
    """
    count = samples.shape[1]
    found = np.full(len(samples), np.nan)
    if count < 4:
        return found
    starts = np.flatnonzero(np.diff(bins, prepend=-1))
    for low, high in zip(starts, [*starts[1:], len(bins)], strict=True):
        period = int(np.round(count / bins[low]))
        whole = count // period
        if whole < 2:
            continue
        turns = samples[low:high, : whole * period].reshape(high - low, whole, period)
        found[low:high] = _followed(turns.max(axis=2))
    return found


def log_decrement_local(samples: np.ndarray) -> np.ndarray:
    """Logarithmic decrement from the successive positive maxima, down to 1 % of the first.

    Args:
        samples: shape (designs, t) [any unit].

    Returns:
        Shape (designs,) [-]; NaN where fewer than two positive maxima stand.

    Source: `supple.model.score.log_decrement` with its reading ``local``.
    """
    found = np.full(len(samples), np.nan)
    if samples.shape[1] < 4:
        return found
    inner, rows = samples[:, 1:-1], np.arange(len(samples))
    tops = (inner > samples[:, :-2]) & (inner >= samples[:, 2:]) & (inner > 0)
    first = inner[rows, np.argmax(tops, axis=1)]
    faded = np.cumsum(tops & (inner < FADED * first[:, None]), axis=1) > 0
    kept = tops & (~faded | (np.cumsum(tops, axis=1) <= 2))
    count = np.sum(kept, axis=1) - 1
    last = inner[rows, inner.shape[1] - 1 - np.argmax(kept[:, ::-1], axis=1)]
    told = count > 0
    ratio = np.where(told, first, 1.0) / np.where(told, last, 1.0)
    return np.where(told, np.log(ratio) / np.maximum(count, 1), np.nan)


def _followed(maxima: np.ndarray) -> np.ndarray:
    faded = maxima < FADED * maxima[:, :1]
    kept = np.where(faded.any(axis=1), np.argmax(faded, axis=1), maxima.shape[1])
    last = np.clip(kept - 1, 1, maxima.shape[1] - 1)
    first, end = maxima[:, 0], maxima[np.arange(len(maxima)), last]
    told = (first > 0) & (end > 0)
    ratio = np.where(told, first, 1.0) / np.where(told, end, 1.0)
    return np.where(told, np.log(ratio) / last, np.nan)


def scores_of(
    names: tuple[str, ...],
    times: np.ndarray,
    curves: Sequence[np.ndarray],
    peaks: Sequence[np.ndarray],
    bins: np.ndarray | None,
    exactly: np.ndarray,
) -> dict[str, np.ndarray]:
    """Scores of some designs' samples.

    Args:
        names: out of `SCORES`, without the modal one.
        times: of the samples, shape (t,) [s].
        curves: samples of the sensor and perhaps of the grip, each of shape (designs, t) [SI].
        peaks: their `peak`, each of shape (designs,) [SI].
        bins: squared magnitudes of the first bins of the spectrum, shape (designs, bins); None
            where they are not known [squared unit].
        exactly: of which designs the bins are not those of the samples, shape (designs,) [-].

    Returns:
        By name, each of shape (designs,) [SI unit of the score].
    """
    seen, found, size = curves[0], {}, rms(curves[0])
    if "rms" in names:
        found["rms"] = size
    if "peak" in names:
        found["peak"] = peaks[0]
    if "settling" in names:
        found["settling"] = settling(seen, times)
    if "log_decrement_local" in names:
        found["log_decrement_local"] = log_decrement_local(seen)
    if "grip_displacement_peak" in names:
        found["grip_displacement_peak"] = peaks[1]
    if "log_decrement" in names:
        largest = np.ones(len(seen), int)
        unsure = np.ones(len(seen), bool)
        if bins is not None:
            largest = 1 + np.argmax(bins, axis=1)
            unsure = exactly | ~certified(seen, size, bins)
        if unsure.any():
            largest[unsure] = largest_bins(seen[unsure])
        found["log_decrement"] = log_decrement(seen, largest)
    return found
