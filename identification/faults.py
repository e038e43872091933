"""How faulty channels read what a simulation says: readings and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model.chain import DERIVATIVES
from ..model.law import Fault, Law
from .free import Entry
from .prepare import Prepared, Sensor


@dataclass(frozen=True)
class FaultyReading:
    """One fault of one channel, with where its numbers stand.

    Attributes:
        law: its law.
        fault: how it reads.
        values: strength, then shapes [SI].
        entries: index of each among a model's entries; None where it is held.
        since: how long the channel's record has run at its first sample that is used [s].
        gathered: integral over that time of what was read [unit s].
    """

    law: Law
    fault: Fault
    values: tuple[float, ...]
    entries: tuple[int | None, ...]
    since: float = 0.0
    gathered: float = 0.0

    @property
    def _counted(self) -> dict[str, float]:
        found = {"since": self.since} if self.fault.counts else {}
        return found | ({"gathered": self.gathered} if self.fault.gathers else {})

    def read(self, readings: np.ndarray, step: float) -> np.ndarray:
        """What the channel says of true readings, shape (n,) [unit]."""
        return self.fault.read(self.values[0], self.values[1:], readings, step, **self._counted)

    def along(
        self, readings: np.ndarray, columns: np.ndarray, step: float, scale: np.ndarray
    ) -> np.ndarray:
        """Derivative by a model's scaled unknowns.

        Args:
            readings: true ones, shape (n,) [unit].
            columns: their derivatives, shape (n, unknowns) [unit].
            step: sampling interval [s].
            scale: of each unknown [SI].

        Returns:
            Shape (n, unknowns) [unit].
        """
        by = np.zeros((len(self.values), len(scale)))
        for number, index in enumerate(self.entries):
            if index is not None:
                by[number, index] = scale[index]
        strength, shapes = self.values[0], self.values[1:]
        along = by[0], list(by[1:]), columns
        return self.fault.along(strength, shapes, readings, step, *along, **self._counted)


def misread(
    faults: Sequence[FaultyReading], early: np.ndarray, seen: np.ndarray, step: float
) -> np.ndarray:
    """What a channel with faults says, shape (n,) [unit].

    Args:
        faults: in force on it, in their order.
        early: true readings at its interval before its first sample, shape (m,) [unit].
        seen: true readings at its samples, shape (n,) [unit].
        step: its sampling interval [s].
    """
    none = np.zeros((len(early), 0)), np.zeros((len(seen), 0))
    return misread_along(faults, (early, seen), none, step, np.zeros(0))[0]


def misread_along(
    faults: Sequence[FaultyReading],
    readings: tuple[np.ndarray, np.ndarray],
    columns: tuple[np.ndarray, np.ndarray],
    step: float,
    scale: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """What a channel with faults says, shape (n,) [unit], and its derivative, shape (n, unknowns).

    A fault that remembers, as a filter does, hangs on what was there before the first sample.

    Args:
        faults: in force on it, in their order.
        readings: true ones before its first sample and from there, shapes (m,) and (n,) [unit].
        columns: their derivatives by a model's scaled unknowns, shapes (m, k) and (n, k) [unit].
        step: its sampling interval [s].
        scale: of each unknown, shape (k,) [SI].

    Source: tests/identification/test_faults.py.
    """
    first = len(readings[0])
    values, moved = np.concatenate(readings), np.concatenate(columns)
    for faulty in faults:
        low = 0 if faulty.fault.remembers else first
        own = values[low:]
        if len(scale):
            turned = faulty.along(own, moved[low:], step, scale)
            moved = np.concatenate([moved[:low], turned])
        values = np.concatenate([values[:low], faulty.read(own, step)])
    return values[first:], moved[first:]


DRIVE = "drive"
"""The place of what moves a mechanism from outside."""


def felt(place: str, law: Law, sensor: Sensor, driven: bool) -> bool:
    """Whether a channel feels a fault at a place; `driven`: a told motion moves its record [-]."""
    return place == sensor.channel.name or (law.kind == DRIVE and place == DRIVE and driven)


def told_motion(prepared: Prepared) -> bool:
    """Whether a told motion moves a record [-]."""
    return any(
        DERIVATIVES.get(port.quantity) == 0 and np.ptp(column) > 0
        for port, column in zip(prepared.ports, prepared.inputs.T, strict=True)
    )


def faulty_readings(
    causes: Sequence[tuple[str, Law]],
    entries: Sequence[Entry],
    values: Sequence[float] | np.ndarray,
    held: Sequence[tuple[Entry, float]],
    sensor: Sensor,
    driven: bool = False,
    record: str | None = None,
) -> list[FaultyReading]:
    """The faults in force on one channel, in their order.

    A fault of the drive is felt by every channel of a record that it moves.

    Args:
        causes: laws in force with their places.
        entries: what a model varies.
        values: of these entries [SI].
        held: further entries with their values [SI].
        sensor: the channel.
        driven: whether a told motion moves its record.
        record: the channel's; numbers that others have of their own do not count.
    """
    found = []
    known: dict[tuple[str, ...], tuple[float, int | None]] = {
        entry.keys: (value, None)
        for entry, value in held
        if entry.slot == "fault" and entry.record in (None, record)
    }
    for index, entry in enumerate(entries):
        if entry.slot == "fault" and entry.record in (None, record):
            known[entry.keys] = (values[index], index)
    for place, law in causes:
        if law.fault is None or not felt(place, law, sensor, driven):
            continue
        numbers = [known[place, law.name, ""]]
        for shape in law.shapes:
            key = place, law.name, shape.symbol
            # of a record that was never seen nobody knows its own numbers: 0 is as good as any
            numbers.append(known[key] if shape.guess is None else known.get(key, (0.0, None)))
        at, which = tuple(n[0] for n in numbers), tuple(n[1] for n in numbers)
        past = sensor.since, sensor.gathered
        found.append(FaultyReading(law, law.fault, at, which, *past))
    return found
