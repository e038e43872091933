"""What the figures need of a record: decimation, the telling window, residuals in noise units."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..identification.views import RecordView

_PERIODS_IN_ZOOM = 6


@dataclass(frozen=True)
class Cloud:
    """Residuals of several records against one quantity, before and after the extension.

    Attributes:
        axis: what they are drawn against: time, displacement or velocity.
        unit: unit of that quantity.
        x: its values, ``(t,)`` [unit].
        before: residual without the causes, ``(t,)`` [noise standard deviations].
        after: residual with the causes, ``(t,)`` [noise standard deviations].
    """

    axis: str
    unit: str
    x: np.ndarray
    before: np.ndarray
    after: np.ndarray


def envelope(
    times: np.ndarray, values: np.ndarray, n_bins: int = 500
) -> tuple[np.ndarray, np.ndarray]:
    """Thin a long record so that its drawing looks the same: smallest and largest of each bin.

    Args:
        times: instants, ``(t,)`` [s].
        values: values at these instants, ``(t,)`` [any unit].
        n_bins: number of bins; a record of up to four samples in a bin is returned as it is.

    Returns:
        Instants [s] and values [same unit], at most ``2 * n_bins`` of each, in order of time.
    """
    if len(times) <= 4 * n_bins:
        return times, values
    edges = np.linspace(0, len(times), n_bins + 1).astype(int)
    low = [first + int(np.argmin(values[first:last])) for first, last in pairwise(edges)]
    high = [first + int(np.argmax(values[first:last])) for first, last in pairwise(edges)]
    keep = np.sort(np.unique(np.concatenate([low, high])))
    return times[keep], values[keep]


def telling_window(view: "RecordView") -> tuple[float, float]:
    """Where the model without the causes is worst, a few periods wide.

    Args:
        view: one channel of one record.

    Returns:
        First and last instant of the window [s].
    """
    spectrum = np.abs(np.fft.rfft(view.measured - np.mean(view.measured)))
    strongest = 1 + int(np.argmax(spectrum[1:])) if len(spectrum) > 1 else 1
    n_samples = len(view.time)
    width = int(np.clip(_PERIODS_IN_ZOOM * n_samples / strongest, 40, 2000))
    width = min(width, n_samples)
    power = np.concatenate([[0.0], np.cumsum((view.before - view.measured) ** 2)])
    first = int(np.argmax(power[width:] - power[:-width])) if width < n_samples else 0
    return float(view.time[first]), float(view.time[first + width - 1])


def clouds(views: Sequence["RecordView"]) -> list[Cloud]:
    """Pool the residuals of the records against time, displacement and velocity.

    Records whose place moves in another unit than most are left out of the last two.

    Args:
        views: channels of records, one or more.

    Returns:
        Three clouds at most; one without any spread in its quantity is left out.
    """
    pooled = []
    for axis, unit_name in (
        ("time", None),
        ("displacement", "unit_displacement"),
        ("velocity", "unit_velocity"),
    ):
        units = [getattr(view, unit_name) if unit_name else "s" for view in views]
        sizes = {
            unit: sum(len(v.time) for v, u in zip(views, units, strict=True) if u == unit)
            for unit in units
        }
        unit = max(sizes, key=lambda name: sizes[name])
        chosen = [view for view, own in zip(views, units, strict=True) if own == unit]
        x = np.concatenate([np.asarray(getattr(view, axis)) for view in chosen])
        before = np.concatenate([_in_noise_units(view, view.before) for view in chosen])
        after = np.concatenate([_in_noise_units(view, view.after) for view in chosen])
        usable = np.isfinite(x) & np.isfinite(before) & np.isfinite(after)
        if usable.any() and np.ptp(x[usable]) > 0.0:
            pooled.append(Cloud(axis, unit, x[usable], before[usable], after[usable]))
    return pooled


def _in_noise_units(view: "RecordView", simulated: np.ndarray) -> np.ndarray:
    scale = view.noise_std if view.noise_std > 0.0 else float(np.std(view.measured)) or 1.0
    return (np.asarray(view.measured) - np.asarray(simulated)) / scale


def binned_mean(x: np.ndarray, y: np.ndarray, n_bins: int = 40) -> tuple[np.ndarray, ...]:
    """Mean of a cloud along its axis, in bins of equal width.

    Args:
        x: places of the points, ``(t,)`` [any unit].
        y: their heights, ``(t,)`` [any unit].
        n_bins: number of bins; those with fewer than eight points are left out.

    Returns:
        Middles of the bins [unit of x], means and standard errors of the means [unit of y].
    """
    low, high = np.percentile(x, [0.2, 99.8])
    inside = (x >= low) & (x <= high)
    y = y[inside]
    index = ((x[inside] - low) / (high - low) * n_bins).astype(int).clip(0, n_bins - 1)
    counts = np.bincount(index, minlength=n_bins)
    keep = counts >= 8
    n_kept = np.maximum(counts, 1)
    means = np.bincount(index, y, n_bins) / n_kept
    spread = np.bincount(index, (y - means[index]) ** 2, n_bins) / n_kept
    middles = low + (np.arange(n_bins) + 0.5) * (high - low) / n_bins
    return middles[keep], means[keep], np.sqrt(spread / n_kept)[keep]


def normalized_error(view: "RecordView", simulated: np.ndarray) -> float:
    """Root mean square error over the standard deviation of the measured channel.

    Args:
        view: one channel of one record.
        simulated: the simulated channel, ``(t,)`` [unit of the view].

    Returns:
        The normalized error [1]; NaN for a channel that never moves.
    """
    spread = float(np.std(view.measured))
    error = float(np.sqrt(np.mean((np.asarray(view.measured) - np.asarray(simulated)) ** 2)))
    return error / spread if spread > 0.0 else float("nan")
