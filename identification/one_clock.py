"""Channels with clocks of their own on one clock: told, or found by what both of them saw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..model.door import fault, one_of
from .clock import Clock
from .clocks import ROOM, Shift, on_points, shift_of_events, shift_of_signals
from .instant import CONTACT
from .lowpass import MOST, zero_phase_lowpass
from .records import Channel

ALIKE = 15.0
"""Low-pass before two channels are compared [Hz]."""

ENOUGH = 240.0
"""Samples a second that such a comparison needs [Hz]."""

CLEAR = 0.020
"""How long before a blow the comparison of an accelerometer with a gauge ends [s]."""

MOTION_STD = 0.008
"""Error of a gauge's clock where the motion alone tells it [s]: 7 ms on made-up swings, since the
head feels more than the shaft's spring; it leans with the shaft."""

NEAR, SIDE = 0.050, 0.004
"""How far from where the motion has it a blow's kink is sought, and how much on either side tells
the slope [s]."""

KINK = 8.0
"""Size from which a kink of a gauge is a blow [of the usual change of its slope]."""


@dataclass(frozen=True)
class OwnClock:
    """How one channel's clock stands on that of the first channel.

    Attributes:
        name: of the channel.
        clock: its rate [Hz], and its first sample on the first channel's clock [s].
        std: standard deviation of that instant [s]; 0 where it is told.
        way: ``own`` where it has the record's clock, ``told`` by `clock_offset`, or ``found``.
        correlation: with the channel that it was found by; nan where it was not found [-].
        sentence: in words; empty where it has the record's clock.
    """

    name: str
    clock: Clock
    std: float
    way: str
    correlation: float
    sentence: str


def own_clocks(
    path: Path,
    channels: Sequence[Channel],
    partners: Mapping[str, str],
    blow: float | None = None,
) -> tuple[OwnClock, ...]:
    """Every channel's clock on that of the first, found by what both saw where it is not told.

    Args:
        path: the record's sidecar, for messages.
        channels: of one record; the first one's clock is that of the others, the record's own
            unless its offset is not told.
        partners: by the name of a channel, one that moves as it does, but for its size.
        blow: an instant on the first channel's clock from which on partners differ, and which
            shows as a kink in the channels that have one [s]; None for none.

    Returns:
        As many clocks; channels of one file share one.

    Raises:
        ValueError: where a clock is not told, and nothing in common tells it.
    """
    by_name = {one.name: one for one in channels}
    found: dict[str, OwnClock] = {}
    for one in channels:
        if one.name in found:
            continue
        alike = [each for each in channels if _whose(each) == _whose(one)]
        if _whose(one) == _whose(channels[0]):
            found |= {each.name: _told(each) for each in alike}
            continue
        pairs = [(by_name[partners[each.name]], each) for each in alike
                 if partners.get(each.name) in found]  # fmt: skip
        if not pairs:
            raise _untold(path, one, "none, and no channel that moves like it")
        shift, by, ours = _shift(path, [(o, found[o.name].clock, t) for o, t in pairs], blow)
        words = (
            f"{one_of(each.name for each in alike)}: the clock is not told; {by}, which "
            f"{ours.name} saw too, puts its zero at {shift.offset:.5f} ± {shift.offset_std:.5f} s."
        )
        for each in alike:
            clock = Clock(each.sample_rate, each.start_time + shift.offset)
            found[each.name] = OwnClock(
                each.name, clock, shift.offset_std, "found", shift.correlation, words
            )
    return tuple(found[one.name] for one in channels)


def _whose(one: Channel) -> Path | None:
    """The file whose clock a channel has; None for the record's."""
    return one.file if one.clock_unknown else None


def _told(one: Channel) -> OwnClock:
    clock, way, said = Clock(one.sample_rate, one.start_time), "own", ""
    if one.clock_offset is not None:
        way = "told"
        said = (
            f"{one.name}: {one.sample_rate:.6g} Hz from {one.start_time:.5g} s on, as its file and "
            "'clock_offset' tell."
        )
    return OwnClock(one.name, clock, 0.0, way, math.nan, said)


def _untold(path: Path, one: Channel, found: str) -> ValueError:
    mend = "write clock_offset, or record a motion that both see"
    place = f"[channels.{one.name}] clock_offset"
    return fault(
        path, place, "an offset in s, since the channel has a file of its own", found, mend
    )


def _times(clock: Clock, count: int) -> np.ndarray:
    return clock.start + np.arange(count) / clock.rate


def _shift(
    path: Path, pairs: Sequence[tuple[Channel, Clock, Channel]], blow: float | None
) -> tuple[Shift, str, Channel]:
    """Where another clock's zero lies, what told it in words, and which of our channels saw it.

    Pairs are a channel of ours, its clock, and the one on the other clock that moves like it.
    """
    shifts = [_by_motion(path, *pair, blow) for pair in pairs]
    best = int(np.argmax([abs(one.correlation) for one in shifts]))
    found, (ours, _, theirs) = shifts[best], pairs[best]
    if found.status != "aligned":
        text = f"motions that are unlike (correlation {abs(found.correlation):.2f})"
        raise _untold(path, theirs, text)
    if blow is None:
        return found, "the motion", ours
    kinks = [_kink(each, blow - found.offset) for _, _, each in pairs]
    clearest = int(np.argmax([one.size for one in kinks]))
    kink, (ours, _, _) = kinks[clearest], pairs[clearest]
    if kink.size < KINK:
        std = max(found.offset_std, MOTION_STD)
        return replace(found, offset_std=std), "the motion alone", ours
    exact = shift_of_events((blow, 0.0), (kink.time, kink.std))
    return replace(exact, correlation=found.correlation), "the blow", ours


def _by_motion(
    path: Path, ours: Channel, clock: Clock, theirs: Channel, blow: float | None
) -> Shift:
    times, values = _times(clock, len(ours.values)), np.asarray(ours.values)
    if blow is not None:
        values, times = values[times < blow - CLEAR], times[times < blow - CLEAR]
    own = Clock(theirs.sample_rate, theirs.start_time)
    other = _slow(_times(own, len(theirs.values)), np.asarray(theirs.values), own.rate)
    try:
        return shift_of_signals(_slow(times, values, clock.rate), other)
    except ValueError:
        raise _untold(path, theirs, "records that are too short to compare") from None


def _slow(times: np.ndarray, values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """What both can show: below `ALIKE`, and no more samples than that needs."""
    if ALIKE <= MOST * rate and len(values) > 8:
        values = zero_phase_lowpass(values, rate, ALIKE)
    stride = max(1, int(rate / ENOUGH))
    return times[::stride], values[::stride]


class _Kink(NamedTuple):
    """A leap of a channel's slope: its size in usual changes [-], when, and how sure [s]."""

    size: float
    time: float
    std: float


def _kink(one: Channel, near: float) -> _Kink:
    """The largest leap of a channel's slope near an instant, on its own clock."""
    values, rate = np.asarray(one.values), one.sample_rate
    wide = max(3, round(SIDE * rate))
    slope = (values[wide:] - values[:-wide]) / wide
    leap = np.abs(slope[wide:] - slope[:-wide])
    times = one.start_time + (np.arange(len(leap)) + wide) / rate
    inside = np.flatnonzero(np.abs(times - near) <= NEAR)
    if not inside.size:
        return _Kink(0.0, near, math.inf)
    at = int(inside[np.argmax(leap[inside])])
    first = max(0, at - wide)
    part = values[first : at + 3 * wide + 1]
    found, std = _bend(np.arange(len(part)) / rate, part, SIDE)
    return _Kink(
        float(leap[at] / max(float(np.median(leap)), 1e-300)),
        one.start_time + first / rate + found - CONTACT / 2,
        math.hypot(std, CONTACT / math.sqrt(12.0)),
    )


def _bend(times: np.ndarray, values: np.ndarray, least: float) -> tuple[float, float]:
    """Where a parabola that may kink once does so, by least squares, and how sure [s]."""
    tried = np.linspace(times[0] + least / 2, times[-1] - least / 2, 401)
    left = np.empty(len(tried))
    for k, at in enumerate(tried):
        columns = np.stack([np.ones(len(times)), times, times**2, np.maximum(times - at, 0.0)], 1)
        weights, *_ = np.linalg.lstsq(columns, values, rcond=None)
        left[k] = np.sum((values - columns @ weights) ** 2)
    best = int(np.argmin(left))
    free = max(1, len(times) - 5)
    alike = tried[left <= left[best] * (1 + 1 / free)]
    step = tried[1] - tried[0]
    return float(tried[best]), max(step, 0.5 * float(alike[-1] - alike[0]))


@dataclass(frozen=True, eq=False)
class Together:
    """Channels at common instants.

    Attributes:
        rate: samples a second [Hz].
        start: the first of them on the first channel's clock [s].
        values: one column a channel, shape (n, channels) [each channel's SI unit].
        is_found: whether a clock was found by the motion, not told.
        words: what was done, in sentences; empty where nothing was.
    """

    rate: float
    start: float
    values: np.ndarray
    is_found: bool
    words: tuple[str, ...]


def together(path: Path, channels: Sequence[Channel], partners: Mapping[str, str]) -> Together:
    """Channels of a record at the instants of the slowest one, where all of them reach.

    Faster ones are low-passed without phase at 0.8 of the new Nyquist frequency; all others are
    joined by a cubic spline. Nothing is continued beyond the support of a channel.

    Args:
        path: the record's sidecar, for messages.
        channels: which of it.
        partners: as of `own_clocks`.

    Returns:
        The channels, as they are where they share a clock already.

    Raises:
        ValueError: where a clock is not to be found, or where they share no half second.
    """
    told = own_clocks(path, channels, partners)
    clocks, counts = [one.clock for one in told], [len(one.values) for one in channels]
    if len(set(clocks)) == 1 and len(set(counts)) == 1:
        whole = np.stack([one.values for one in channels], axis=1)
        return Together(clocks[0].rate, clocks[0].start, whole, False, _said(told))
    slow = clocks[int(np.argmin([one.rate for one in clocks]))]
    first = max(one.start for one in clocks)
    last = min(one.start + (n - 1) / one.rate for one, n in zip(clocks, counts, strict=True))
    if last - first < 0.5:
        mend = "correct clock_offset, or name records of the same motion"
        found = f"{max(last - first, 0.0):.3g} s"
        raise fault(path, "[channels]", "half a second that all channels saw", found, mend)
    skip = math.ceil((first - slow.start) * slow.rate - 1e-6)
    count = math.floor((last - slow.start) * slow.rate + 1e-6) - skip + 1
    points = slow.start + (skip + np.arange(count)) / slow.rate
    points = np.clip(points, first, last)
    columns = [_at(one, clock, points) for one, clock in zip(channels, clocks, strict=True)]
    words = (
        f"{one_of(one.name for one in channels)} were brought to {slow.rate:.6g} Hz, {count} "
        f"samples that all of them saw: low-passed without phase at {ROOM * slow.rate / 2:.4g} Hz "
        "where they were faster, then a cubic spline."
    )
    is_found = any(one.way == "found" for one in told)
    whole = np.stack(columns, axis=1)
    return Together(slow.rate, float(points[0]), whole, is_found, (*_said(told), words))


def _said(told: Sequence[OwnClock]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(one.sentence for one in told if one.sentence))


def _at(one: Channel, clock: Clock, points: np.ndarray) -> np.ndarray:
    times, values = _times(clock, len(one.values)), np.asarray(one.values)
    if len(points) == len(times) and np.allclose(times, points, atol=1e-9):
        return values
    return on_points(times, values, points).values
