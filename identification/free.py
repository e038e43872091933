"""Which numbers a fit varies: by name, with bounds, priors and scales."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from ..model.chain import DERIVATIVES, FORCES
from ..model.law import Law
from ..model.linear import Mechanism, mass_matrix, stiffness_matrix
from ..model.parameters import Parameter
from ..model.respond import Plant
from .prepare import Prepared, Sensor
from .window import begun_at

OFFSET_TOLERANCE = 0.01
"""Standard deviation of a response's unknown zero, as a share of its largest excursion [-]."""

DRIVE_TOLERANCE = 0.05
"""Standard deviation of a force's unknown zero, as a share of its largest value [-]."""


@dataclass(frozen=True)
class Entry:
    """One number that a fit varies.

    Attributes:
        name: rig's name, ``PLACE/LAW`` for a law's strength, ``CHANNEL.offset`` and the like.
        slot: part of the plant's vector: numbers, strengths, start, drive, offset, gain, delay,
            tilt, ripple; ``fault`` for what only a channel's reading knows.
        keys: which elements of the slot it sets: names, or indices as text.
        record: the only record it belongs to; None where all share it.
        value: start value [SI].
        low: lower bound [SI].
        high: upper bound [SI].
        scale: size of a natural change [SI]; fits work in value / scale.
        prior: prior standard deviation about `center` [SI]; inf without one.
        center: prior mean [SI].
        unit: SI unit as text [-].
        nuisance: whether it is no constant of the rig or of a law.
    """

    name: str
    slot: str
    keys: tuple[str, ...]
    record: str | None
    value: float
    low: float = -math.inf
    high: float = math.inf
    scale: float = 1.0
    prior: float = math.inf
    center: float = 0.0
    unit: str = ""
    nuisance: bool = True

    @property
    def label(self) -> str:
        """Name with the record it belongs to, unique in a fit."""
        return self.name if self.record is None else f"{self.name}[{self.record}]"

    def at(self, value: float) -> Entry:
        """The same entry with another start value [SI], kept inside its bounds."""
        return replace(self, value=float(np.clip(value, self.low, self.high)))


def rig_entries(
    parameters: Mapping[str, Parameter], records: Sequence[Prepared]
) -> tuple[Entry, ...]:
    """Entries of the rig's free numbers and of those known to a tolerance [SI]."""
    found = []
    for name, number in parameters.items():
        given = {name in prepared.numbers for prepared in records}
        if not number.varies or given == {True}:
            continue
        scale = abs(number.value) or number.std or 1.0
        low, high = number.low, number.high
        if number.free and math.isinf(low) and number.value > 0:
            low = 0.0
        prior = number.std if number.std is not None else math.inf
        # what a record gives of its own is held there
        own = [p.name for p in records if name not in p.numbers]
        for record in own if number.per_record else [None]:
            found.append(
                Entry(
                    name,
                    "numbers",
                    (name,),
                    record,
                    number.value,
                    low,
                    high,
                    scale,
                    prior,
                    number.value,
                    number.unit,
                    nuisance=not number.free,
                )
            )
    return tuple(found)


def nuisance_entries(
    mechanism: Mechanism, numbers: Mapping[str, float], prepared: Prepared
) -> tuple[Entry, ...]:
    """Start state, offsets and tolerances of one record, each with its prior [SI]."""
    found = _start_entries(mechanism, dict(numbers) | prepared.numbers, prepared)
    for index, sensor in enumerate(prepared.sensors):
        found += _channel_entries(sensor, index, prepared)
    return tuple(found)


DAY_TOLERANCE = 0.005
"""Standard deviation of a number that a record says differed on its day, as a share of it [-]:
what a kitchen scale and a rule of thumb leave open."""


def day_entries(parameters: Mapping[str, Parameter], prepared: Prepared) -> tuple[Entry, ...]:
    """The numbers of one record's own `[parameters]`, each known to a tolerance [SI]."""
    found = []
    for name, value in prepared.numbers.items():
        number = parameters[name]
        std = number.std if number.std is not None else DAY_TOLERANCE * abs(value)
        if std > 0:
            found.append(
                Entry(
                    name,
                    "numbers",
                    (name,),
                    prepared.name,
                    value,
                    scale=std,
                    prior=std,
                    center=value,
                    unit=number.unit,
                )
            )
    return tuple(found)


def drive_entries(records: Sequence[Prepared]) -> tuple[Entry, ...]:
    """The unknown zero of each force or torque that drives, one a channel, shared by records.

    An amplifier's zero stays from test to test; what is learned of it on some records holds for
    others. A hammer shows its own before and after the blow.
    """
    found: dict[str, Entry] = {}
    for prepared in records:
        for channel in prepared.record.inputs:
            if channel.quantity not in FORCES or not np.ptp(channel.values) > 0:
                continue
            reach = DRIVE_TOLERANCE * float(np.max(np.abs(channel.values)))
            std, zero = channel.tolerance.get("offset", reach), 0.0
            if prepared.record.test == "impact":
                zero, known = _shown_zero(channel.values)
                std = min(std, max(known, LEAST_KNOWN * reach))
            name, keys, unit = f"{channel.name}.offset", (channel.name,), channel.unit
            entry = Entry(
                name, "drive", keys, None, zero, scale=std, prior=std, center=zero, unit=unit
            )
            if name not in found or found[name].prior < std:
                found[name] = entry
    return tuple(found.values())


LEAST_KNOWN = 1e-4
"""Share of its usual tolerance to which a hammer's zero is known at best [-]."""

CALM, MOSTLY = 0.05, 0.75
"""Share of its range within which a hammer reads nothing, and of its samples that must [-]."""

SLOW = 6.0
"""By how much longer noise takes to average out than white noise [-]: AR(1) of 0.95."""


def _shown_zero(values: np.ndarray) -> tuple[float, float]:
    """What is to be added to a hammer's readings, and its standard deviation [SI].

    Most of them are from before and after the blow; where they are not, nothing is known.
    """
    middle = float(np.median(values))
    if np.mean(np.abs(values - middle) < CALM * np.ptp(values)) < MOSTLY:
        return 0.0, math.inf
    noise = 1.4826 * float(np.median(np.abs(values - middle)))
    return -middle, SLOW * noise / np.sqrt(len(values))


def _start_entries(
    mechanism: Mechanism, numbers: Mapping[str, float], prepared: Prepared
) -> list[Entry]:
    n = len(mechanism.coordinates)
    position, velocity = _start_scales(mechanism, numbers, prepared)
    # before a recorded blow a mechanism rests where its springs do: what it does before the first
    # sample that is used can be seen nowhere, and would take the blow's place
    struck = prepared.record.test == "impact" and not prepared.free
    told = begun_at(prepared.record) is not None
    entries = []
    for index, coordinate in enumerate(mechanism.coordinates):
        for what, offset, size in (("start", 0, position), ("start_velocity", n, velocity)):
            name, scale = f"{coordinate}.{what}", float(size[index])
            still = prepared.at_rest and (offset or struck)
            # struck it stands where it hung, let go it has no speed yet
            near = told and (not offset if prepared.since > 0 else offset)
            std = 1e-4 * scale if still else (NEAR if near else 10.0) * scale
            entry = _nuisance(name, "start", index + offset, prepared, std, "")
            entries.append(replace(entry, scale=scale))
    return entries


NEAR = 0.1
"""Standard deviation of what a told blow or release leaves at rest, of its natural size [-]: a
hand, and an instant that is a hundredth of a second off."""


def _start_scales(
    mechanism: Mechanism, numbers: Mapping[str, float], prepared: Prepared
) -> tuple[np.ndarray, np.ndarray]:
    """Natural size of each coordinate's start: how it moves when a sensor's place is pushed.

    Or a share of how it moves in the mode that rings: a push on a collet bends no shaft, and yet
    the head swings.
    """
    n = len(mechanism.coordinates)
    rows = mechanism.rows(numbers)
    mass = np.asarray(mass_matrix(rows))[:n, :n]
    omega = 2 * np.pi * max(prepared.frequency, 0.5 / (prepared.count * prepared.step))
    dynamic = np.asarray(stiffness_matrix(rows))[:n, :n] + 1e-3 * omega**2 * mass
    mode = np.abs(_ringing_mode(np.asarray(stiffness_matrix(rows))[:n, :n], mass, omega))
    best = np.zeros(n)
    for sensor in prepared.sensors:
        port = sensor.port
        row = np.asarray(mechanism.sensor_row(port.place, port.quantity, port.frame, numbers))[:n]
        shape = np.abs(np.linalg.solve(dynamic, row))
        seen = float(np.abs(row) @ shape)
        size = np.ptp(_telling(sensor, prepared)) / omega ** DERIVATIVES[port.quantity]
        if seen > 0:
            best = np.maximum(best, size * np.maximum(shape, 1e-3 * shape.max()) / seen)
        moved = float(np.abs(row) @ mode)
        if moved * np.sqrt(shape @ mass @ shape) > BLIND * seen:
            best = np.maximum(best, RINGS * size * mode / moved)
    best[best == 0] = best.max() or 1.0
    return best, best * omega


RINGS = 0.3
"""Share of a mode's size that a start's natural size is at least [-]; priors are ten times that."""

BLIND = 0.03
"""What a sensor sees of the mode, over what it sees of a push at its place, at the same energy of
motion [-], from which it says nothing of how large the mode is."""


def _ringing_mode(stiffness: np.ndarray, mass: np.ndarray, omega: float) -> np.ndarray:
    """The mode whose frequency is nearest to `omega` [rad/s], over the coordinates [-]."""
    squares, modes = eigh(stiffness, mass)
    return modes[:, int(np.argmin(np.abs(np.sqrt(np.maximum(squares, 0.0)) - omega)))]


def _telling(sensor: Sensor, prepared: Prepared) -> np.ndarray:
    """Samples that say how large things are: of a decay its opening, which is largest anyway.

    So what comes later in a held-out decay cannot reach its forecast.
    """
    if not prepared.free or prepared.opening <= 0:
        return sensor.values
    return sensor.values[sensor.times <= prepared.opening]


def _channel_entries(sensor: Sensor, index: int, prepared: Prepared) -> list[Entry]:
    channel = sensor.channel
    reach = float(np.max(np.abs(_telling(sensor, prepared))))
    tolerance = dict(channel.tolerance)
    offset = tolerance.get("offset", OFFSET_TOLERANCE * reach)
    name = channel.name
    entries = [_nuisance(f"{name}.offset", "offset", index, prepared, offset, channel.unit)]
    gain = math.hypot(tolerance.get("gain", 0.0), tolerance.get("radius", 0.0))
    if gain > 0:
        entries.append(_nuisance(f"{name}.gain", "gain", index, prepared, gain, "1"))
    delay = tolerance.get("delay", 0.0)
    if channel.clock_unknown and channel.clock_offset is None:
        delay = max(delay, 0.05)
    if delay > 0:
        entries.append(_nuisance(f"{name}.delay", "delay", index, prepared, delay, "s"))
    return entries


def _nuisance(name: str, slot: str, index: int, prepared: Prepared, std: float, unit: str) -> Entry:
    return Entry(name, slot, (str(index),), prepared.name, 0.0, scale=std, prior=std, unit=unit)


def law_entry(
    law: Law, place: str, natural: float, unit: str, records: Sequence[Prepared]
) -> Entry:
    """Entry of a law's strength at a place or channel, shared by all records [SI]."""
    name = f"{place}/{law.name}"
    low, high = -math.inf if law.signed else 0.0, math.inf
    slot, keys = "strengths", (place, law.name, "")
    if law.slot:
        is_input = any(c.name == place for p in records for c in p.record.inputs)
        slot, keys = ("drive" if is_input else SLOTS.get(law.slot, law.slot)), (place,)
        if law.slot == "ripple":
            keys = (place, law.name, "")
        elif law.slot == "gain":
            low, high = GAINS
        elif law.fault is not None:
            keys = (place, law.name, "")
    return Entry(name, slot, keys, None, 0.0, low, high, abs(natural), unit=unit, nuisance=False)


GAINS = -1.0, 1.0
"""Errors of gain that a channel which measures at all may have [-]: it reads nothing, or double."""

SLOTS = {"axis": "tilt"}
"""Part of a plant's vector that a law of a sensor moves, where it has another name [-]."""

SHAPE_REACH = 300.0, 30.0
"""How far a law's shape may go below and above its trial value, as a factor [-]: what slips may be
next to rigid before it does."""


def shape_entries(
    law: Law, place: str, values: Sequence[float], rotation: bool, channel_unit: str = ""
) -> list[Entry]:
    """Entries of a law's further numbers, shared by all records, of trial values [SI].

    Those that every record has of its own are made by `own_shapes`.

    Args:
        law: with as many shapes as there are values.
        place: where it acts.
        values: to begin with [SI].
        rotation: whether the place turns.
        channel_unit: unit of the channel, for laws of a sensor.
    """
    return [
        Entry(
            f"{place}/{law.name}.{shape.symbol}",
            law.slot or "strengths",
            (place, law.name, shape.symbol),
            None,
            value,
            value / SHAPE_REACH[0],
            value * SHAPE_REACH[1],
            value,
            unit=shape.unit(rotation, channel_unit),
            nuisance=False,
        )
        for shape, value in zip(law.shapes, values, strict=True)
        if shape.guess is None
    ]


def own_shapes(
    law: Law, place: str, shared: Sequence[float], residuals: Mapping[str, tuple[np.ndarray, float]]
) -> list[Entry]:
    """Entries of those numbers of a law that every record has of its own, as they look there [SI].

    Args:
        law: of a channel.
        place: the channel.
        shared: the law's numbers that records share, in their order [SI].
        residuals: by record, what the channel shows beyond the model, shape (n,) [SI], and its
            sampling interval [s].
    """
    return [
        Entry(
            f"{place}/{law.name}.{shape.symbol}",
            law.slot or "strengths",
            (place, law.name, shape.symbol),
            record,
            shape.guess(residual, step, tuple(shared)),
            unit=shape.unit(False),
        )
        for shape in law.shapes
        if shape.guess is not None
        for record, (residual, step) in residuals.items()
    ]


def slot_index(plant: Plant, prepared: Prepared, entry: Entry) -> int | None:
    """Where an entry lies in a plant's vector for one record; None where it has no place [-]."""
    if entry.slot == "fault" or (entry.record is not None and entry.record != prepared.name):
        return None
    base = plant.slots[entry.slot].start
    if entry.slot == "numbers":
        given = entry.name in prepared.numbers and entry.record is None
        if given or entry.keys[0] not in plant.mechanism.names:
            return None
        return base + plant.mechanism.names.index(entry.keys[0])
    if entry.slot == "strengths":
        for index, (place, law, symbol) in enumerate(plant.law_numbers):
            if (place, law.name, symbol) == entry.keys:
                return base + index
        return None
    if entry.slot == "ripple":
        return base + ("", "frequency", "phase", "onset").index(entry.keys[2])
    if entry.keys[0].isdigit():
        return base + int(entry.keys[0])
    names = (
        list(prepared.drives)
        if entry.slot == "drive"
        else [sensor.channel.name for sensor in prepared.sensors]
    )
    return base + names.index(entry.keys[0]) if entry.keys[0] in names else None
