"""Which part of a record counts: after the hand, the blow and the ringing, until it has faded."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..model.chain import DERIVATIVES, FORCES
from ..model.linear import Mechanism, modes
from .decay import free_from
from .noise import periodogram
from .records import Record

BLOW = 0.01
"""How long an impact that no channel recorded is taken to last [s]."""

CALM = {"release": 0.015, "blow": 0.06}
"""What passes until a club moves in its lower modes alone, after a release and after a blow [s]:
before that its higher ones ring, which no lumped model has. Source: the independent bench, where
a blow leaves 12 noise units in the first 10 ms and 4 in the next 50."""

FADED = 0.05
"""A free decay is used until it has fallen below this share of its start [-]: what is left tells
of other, smaller things."""


def faded_at(record: Record, start: int) -> int:
    """One past the last grid sample [-] before every response has faded away."""
    rate, ends = record.sample_rate, [start + 64]
    for channel in record.responses:
        first = max(0, round((start / rate - channel.start_time) * channel.sample_rate))
        values = channel.values[first:]
        swing = np.abs(values - np.mean(values[-max(8, len(values) // 3) :]))
        loud = np.flatnonzero(swing > FADED * np.quantile(swing, 0.97))
        seconds = channel.start_time + (first + int(loud[-1]) + 1) / channel.sample_rate
        ends.append(int(np.ceil(seconds * rate)))
    return min(max(ends), len(record.times))


REST = 0.1
"""A driven record whose first samples move slower than this share of its fastest motion began at
rest [-], unless what drives it moves already."""

STILL = 1e-3
"""A told motion that begins faster than this share of its fastest moves already [-]: a swing's
record may begin in the middle of it, where all is slow beside the impact but not at rest."""


FEW = 8
"""Samples below which nothing is said of a channel's noise or period [-]."""


QUIET = 10.0
"""How far that share must stand above the noise of the first samples that it is asked of [-]."""


def begins_at_rest(
    seen: Sequence[tuple[str, np.ndarray]], told: Sequence[tuple[str, np.ndarray]] = ()
) -> bool:
    """Whether a driven record begins at rest.

    Args:
        seen: quantity and values of each response [SI].
        told: the same of each input; forces and accelerations may begin at once.
    """
    for quantity, values in told:
        order = DERIVATIVES.get(quantity, 2)
        if order > 1 or not np.ptp(values) > 0:
            continue
        rate = np.diff(values) if order == 0 else values
        most, opening = STILL * np.max(np.abs(rate)), rate[:3]
        first, unsure = float(np.mean(opening)), 0.0
        if 3.0 * _noise(values) > most * len(opening):  # a few samples tell noise alone
            first, unsure = _first_rate(values, order)
        if abs(first) > most + 3.0 * unsure:
            return False
    for quantity, values in seen:
        rate, few = _quiet_rate(np.asarray(values), DERIVATIVES[quantity])
        if np.max(rate[:few]) > REST * np.max(rate):
            return False
    return True


def _quiet_rate(values: np.ndarray, order: int) -> tuple[np.ndarray, int]:
    """Speed by blocks of no more samples than its noise asks for, and how many tell the start.

    A record that is pushed from its first sample on is no more at rest within longer ones.
    """
    most = max(1, min(int(_period(values) / 20.0), len(values) // 200))
    noise, count = _noise(values) * (np.sqrt(2.0) if order == 0 else 1.0), 1
    while True:
        means = values[: len(values) // count * count].reshape(-1, count).mean(axis=1)
        rate = np.abs(np.gradient(means)) if order == 0 else np.abs(means)
        if count == most or QUIET * noise / np.sqrt(count) <= REST * np.max(rate):
            return rate, max(1, 4 // count)
        count = min(2 * count, most)


def _period(values: np.ndarray) -> float:
    """That of the strongest oscillation, all of a few samples [samples]."""
    if len(values) < FEW:
        return float(len(values))
    frequency, power = periodogram(values - np.mean(values))
    return 1.0 / float(frequency[int(np.argmax(power))])


def _noise(values: np.ndarray) -> float:
    """What third differences show: of 20 times its power, where it is white [as the values].

    A few samples show none.
    """
    if len(values) < FEW:
        return 0.0
    return float(np.std(np.diff(values, 3))) / np.sqrt(20.0)


def _first_rate(values: np.ndarray, order: int) -> tuple[float, float]:
    """Rate at the first sample and its standard error, by a parabola through what follows."""
    count = int(np.clip(_period(values) / 5.0, 4, max(len(values) // 4, 4)))
    steps = np.arange(count)[:, None] ** np.arange(3 if order == 0 else 2)
    which = 1 if order == 0 else 0
    numbers = np.linalg.lstsq(steps, values[:count], rcond=None)[0]
    spread = np.linalg.pinv(steps.T @ steps)[which, which]
    return float(numbers[which]), _noise(values) * float(np.sqrt(spread))


def opening_seconds(
    mechanism: Mechanism, numbers: Mapping[str, float], free: float, whole: float, step: float
) -> float:
    """Three periods of a decay, ten of a driven record or at most a fiftieth of it [s].

    Only a few samples where nothing oscillates: there the model's errors would bend the start
    state at once.
    """
    if free > 0:
        return max(3.0 / free, 24 * step)
    found = modes(mechanism, numbers).damped_frequencies
    oscillating = found[found > 0]
    if not len(oscillating):
        return 24 * step
    return max(min(10.0 / float(oscillating.min()), 0.02 * whole), 24 * step)


def calm_from(record: Record, club: bool) -> float:
    """When a blow or a release has rung out [s]; 0 where there is none, or none is told.

    Args:
        record: as read at the door.
        club: whether a club moves, which rings on.
    """
    at = begun_at(record)
    if at is not None and record.test == "impact":
        return at + max(3 / record.sample_rate, CALM["blow"] if club else BLOW)
    if at is not None:
        return at + CALM["release"] if club else 0.0
    if record.test != "impact" or not club:
        return 0.0
    ends = [0.0]
    for channel in record.inputs:
        loud = np.flatnonzero(np.abs(channel.values) > FADED * np.max(np.abs(channel.values)))
        if channel.quantity in FORCES and len(loud):
            ends.append(channel.start_time + (int(loud[-1]) + 1) / channel.sample_rate)
    return max(ends) + CALM["blow"] if max(ends) > 0 else 0.0


def begun_at(record: Record) -> float | None:
    """When a free motion was told to begin, by a blow or a release [s].

    None where nobody says, or where that was before the first sample.
    """
    driven = any(np.ptp(channel.values) > 0 for channel in record.inputs)
    at = record.start.get("at", -1.0)
    return None if driven or at < 0 else at


def window(record: Record, club: bool) -> tuple[int, str]:
    """First sample that is used, and why.

    Args:
        record: as read at the door.
        club: whether a club moves, which rings on after a release or a blow.

    Returns:
        An index of the record's samples [-] and a sentence.
    """
    rate, at = record.sample_rate, begun_at(record)
    driven = [channel for channel in record.inputs if np.ptp(channel.values) > 0]
    if at is not None:
        first, after = math.ceil(at * rate - 1e-6), 1e3 * (calm_from(record, club) - at)
        if record.test == "impact":
            return first, (
                f"used from {after:.0f} ms after the impact at {at:g} s; the blow itself is not "
                "modelled"
            )
        if club:
            return first, f"used from {after:.0f} ms after the release"
        return first, f"used from the release at {at:g} s, as the sidecar says"
    if record.test in ("decay", "impact") and not driven:
        channel = max(record.responses, key=lambda c: len(c.values))
        index = free_from(channel.values, channel.sample_rate)
        seconds = index / channel.sample_rate
        if index == 0:
            return 0, "used from its first sample"
        return (
            round(seconds * rate),
            f"let go by hand; used from the first crossing of rest at {seconds:.3f} s",
        )
    return 0, "driven; used whole, with an unknown start state"
