"""Samples that stand out alone of a smooth channel: a lost bit, a spark, a loose plug."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import median_filter

from .records import Channel, Record

REACH = 4
"""Neighbours on either side through which a cubic is laid [-]."""

STANDS_OUT = 5.0
"""Distance of a sample from its neighbours' cubic, over what is usual around, beyond which it may
be a spike [-]; of normal noise one in two million goes as far."""

ORDINARY = 6.0
"""Squared distances of the neighbours themselves from their cubic, over what is usual around [-];
of normal noise one in two thousand goes as far. A step, a kink or a blow leaves more."""

ROUNDED = 1.25
"""Largest distance of a sample that rounding alone makes, over its step [-]."""

AROUND = (33, 129)
"""Samples around by which what is usual is judged [-]: the larger of both counts, since noise that
grows with the motion does so within a period, and few samples tell little."""

TO_NORMAL = 1.4826
"""Standard deviation of normal noise over its median size [-]."""


def spikes_of(values: np.ndarray) -> np.ndarray:
    """Which samples stand out alone of a channel.

    A sample is held against the cubic through its neighbours, on the scale of the median of such
    distances around. What lasts for more than a sample is left alone, be it a blow, a step or a
    stop: there the neighbours themselves lie on no cubic.

    Args:
        values: shape (n,) [any unit].

    Returns:
        Shape (n,), true where there is a spike.

    Source: after Hampel 1974, doi:10.1080/01621459.1974.10482962;
    tests/identification/test_spikes.py.
    """
    found = np.zeros(len(values), dtype=bool)
    if len(values) < max(AROUND):
        return found
    told, left = _cubics(values)
    gap = np.abs(values[REACH:-REACH] - told)
    usual, scatter = TO_NORMAL * _usual(gap), _usual(left)
    step = float(np.min(np.diff(np.unique(values)), initial=np.inf))
    loud = (gap - ROUNDED * step > STANDS_OUT * usual) & (usual > 0)
    found[REACH:-REACH] = loud & (left < ORDINARY * scatter)
    return found


def _usual(sizes: np.ndarray) -> np.ndarray:
    """The larger of the medians around, shape (n,)."""
    near, far = (median_filter(sizes, count, mode="reflect") for count in AROUND)
    return np.maximum(near, far)


def _cubics(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the neighbours of each inner sample say of it, and their own squared distances.

    Args:
        values: shape (n,).

    Returns:
        Two of shape (n - 2 REACH,).

    Source: least squares of a cubic, Savitzky and Golay 1964, doi:10.1021/ac60214a047, with the
    middle left out.
    """
    offsets = np.delete(np.arange(-REACH, REACH + 1.0), REACH)
    basis = np.linalg.qr(np.vander(offsets, 4, increasing=True))[0]
    solve = np.linalg.pinv(np.vander(offsets, 4, increasing=True))[0]
    around = np.delete(sliding_window_view(values, 2 * REACH + 1), REACH, axis=1)
    left = around - (around @ basis) @ basis.T
    return around @ solve, np.sum(left**2, axis=1)


def without_spikes(record: Record) -> Record:
    """The record with spikes of its responses taken for what their neighbours say, and a warning.

    One sample in a hundred that is ten times the noise off doubles its power, and hides as much.
    Where the start is told, a blow may last one sample: there and before nothing is a spike.

    Args:
        record: as read at the door.

    Returns:
        The record itself where it has none.

    Source: tests/identification/test_spikes.py.
    """
    changed: dict[str, Channel] = {}
    words: list[str] = []
    for channel in record.channels:
        spikes = spikes_of(channel.values) if channel.role == "response" else np.zeros(0, bool)
        spikes[: _until(record, channel)] = False
        if not spikes.any():
            continue
        values = channel.values.copy()
        at = np.flatnonzero(spikes)
        values[at] = _cubics(channel.values)[0][at - REACH]
        values.setflags(write=False)
        changed[channel.name] = replace(channel, values=values)
        words.append(_words(record.name, channel.name, at / channel.sample_rate))
    if not changed:
        return record
    channels = tuple(changed.get(channel.name, channel) for channel in record.channels)
    return replace(record, channels=channels, warnings=(*record.warnings, *words))


def _until(record: Record, channel: Channel) -> int:
    """How many samples of a channel may be of a blow or a release, and before, where told [-]."""
    at = record.start.get("at")
    if at is None:
        return 0
    return max(int((at - channel.start_time) * channel.sample_rate) + REACH, 0)


def _words(record: str, channel: str, times: Sequence[float] | np.ndarray) -> str:
    count = "1 sample stands" if len(times) == 1 else f"{len(times)} samples stand"
    return (
        f"{record}, channel {channel}: {count} out alone, the first at {times[0]:.4g} s; taken for "
        "what the neighbours say."
    )
