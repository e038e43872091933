"""Tests that a lab could make next, with what its records show that it has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..model.chain import DERIVATIVES, FORCES
from ..model.linear import Mechanism, Port
from ..model.robot import Robot
from .fit import Fit
from .prepare import Prepared, Sensor
from .records import Channel

SMALLER = 0.5
"""The smaller amplitude that is proposed, as a factor [-]."""

FASTER = 1.4
"""How much faster a told motion is proposed [-]; its forces grow by the square of that."""

ADDED_MASS = 0.2
"""A known mass that is proposed to ride along, as a share of that of the rig [-]."""

NAME = "next_test"

ROBOT_SENSORS = (
    ("clubhead", "acceleration", "m/s^2", "an accelerometer at the clubhead"),
    ("shaft", "strain", "1", "a strain gauge on the shaft"),
    ("collet", "angle", "rad", "an encoder at the collet"),
)


@dataclass(frozen=True)
class Planned:
    """A test that could be made.

    Attributes:
        words: what to do, for the report.
        kind: decay, impact or driven.
        template: name of the record that it is made after.
        factor: on that record's amplitude [-].
        prepared: the test as a fit would see it; its values are nought.
        added: place and quantity of a sensor that no record has; empty where there is none.
    """

    words: str
    kind: str
    template: str
    factor: float
    prepared: Prepared
    added: str = ""


def planned_tests(fit: Fit, most: float) -> list[Planned]:
    """Tests after the pattern of the records, and what could be added to them.

    Args:
        fit: of the records made so far.
        most: largest factor on amplitudes and forces that the rig may bear [-].

    Returns:
        Repeats at other amplitudes, faster motions, further sensors and a known mass, each after
        the record of its kind that moves most.

    Source: tests/identification/test_experiment.py.
    """
    found: list[Planned] = []
    for kind, prepared in _templates(fit).items():
        found += _louder_or_softer(kind, prepared, most)
        found += _faster(kind, prepared) if FASTER**2 <= most else ()
        found += _with_sensors(fit, kind, prepared)
        found += _with_mass(fit, kind, prepared)
    return found


def _templates(fit: Fit) -> dict[str, Prepared]:
    """The record of each kind of test that moves most."""
    found: dict[str, Prepared] = {}
    for prepared in fit.problem.records:
        kind = prepared.record.test
        if kind not in found or _reach(prepared) > _reach(found[kind]):
            found[kind] = prepared
    return found


def _reach(prepared: Prepared) -> float:
    return float(np.ptp(prepared.sensors[0].values))


def _blank(prepared: Prepared, **changes: object) -> Prepared:
    """A record like another one, not yet made."""
    record = replace(prepared.record, name=NAME)
    sensors = changes.pop("sensors", prepared.sensors)
    assert isinstance(sensors, tuple)
    silent = tuple(replace(sensor, values=np.zeros(len(sensor.values))) for sensor in sensors)
    return replace(prepared, record=record, sensors=silent, **changes)  # type: ignore[arg-type]


def _forced(prepared: Prepared) -> bool:
    return any(
        port.quantity in FORCES and np.ptp(column) > 0
        for port, column in zip(prepared.ports, prepared.inputs.T, strict=True)
    )


def _louder_or_softer(kind: str, prepared: Prepared, most: float) -> Iterator[Planned]:
    forced = _forced(prepared)
    doing = "Release" if prepared.free else "Strike" if kind == "impact" else "Drive"
    for factor in sorted({SMALLER, 1.0, most}):
        if factor > most:
            continue  # more than the rig may bear
        words = (
            f"{doing} as in '{prepared.name}', {factor:g} times as {'hard' if forced else 'far'}"
        )
        if factor == 1.0:
            words = f"Repeat '{prepared.name}' as it was"
        yield Planned(
            words, kind, prepared.name, factor, _blank(prepared, inputs=factor * prepared.inputs)
        )


def _faster(kind: str, prepared: Prepared) -> Iterator[Planned]:
    told = [DERIVATIVES.get(port.quantity) == 0 for port in prepared.ports]
    moved = [bool(np.ptp(column) > 0) for column in prepared.inputs.T]
    if not any(motion and moves for motion, moves in zip(told, moved, strict=True)):
        return
    grid = np.arange(len(prepared.inputs), dtype=float)
    later = np.minimum(grid * FASTER, grid[-1])
    columns = [
        np.interp(later, grid, column) if motion else column
        for motion, column in zip(told, prepared.inputs.T, strict=True)
    ]
    words = f"Drive as in '{prepared.name}', {FASTER:g} times as fast"
    yield Planned(
        words, kind, prepared.name, 1.0, _blank(prepared, inputs=np.stack(columns, axis=1))
    )


def _sensors_there_are(mechanism: Mechanism) -> list[tuple[str, str, str, str]]:
    if isinstance(mechanism, Robot):
        return list(ROBOT_SENSORS)
    turns = {name: mechanism.turns(name) for name in mechanism.coordinates}
    return [
        (name, "angle", "rad", f"an encoder at {name}")
        if turning
        else (name, "position", "m", f"a displacement sensor at {name}")
        for name, turning in turns.items()
    ]


def _with_sensors(fit: Fit, kind: str, prepared: Prepared) -> Iterator[Planned]:
    mechanism, numbers = fit.problem.mechanism, fit.problem.numbers
    had = {(s.port.place, s.port.quantity) for s in prepared.sensors}
    for place, quantity, unit, words in _sensors_there_are(mechanism):
        if (place, quantity) in had:
            continue
        try:
            mechanism.sensor_row(place, quantity, "absolute", numbers, np)
        except ValueError:
            continue  # this model has no such place
        first = prepared.sensors[0]
        count = min(prepared.count, len(prepared.inputs))
        times = np.arange(count) * prepared.step
        channel = Channel(
            f"{place}_{quantity}", "response", quantity, place, "absolute", unit,
            np.zeros(count), None, {}, False, 1.0 / prepared.step, first.channel.start_time,
        )  # fmt: skip
        added = Sensor(channel, Port(place, quantity), np.zeros(count), times)
        test = _blank(prepared, sensors=(*prepared.sensors, added))
        words = f"Repeat '{prepared.name}' with {words}"
        yield Planned(words, kind, prepared.name, 1.0, test, added=f"{place} {quantity}")


def _with_mass(fit: Fit, kind: str, prepared: Prepared) -> Iterator[Planned]:
    problem = fit.problem
    if isinstance(problem.mechanism, Robot):
        names = [("clubhead_mass", "the clubhead")]
    else:
        names = [
            (name, name.split(".")[1])
            for name in problem.numbers
            if name.startswith("masses.") and name.endswith((".mass", ".inertia"))
        ]
    for name, place in names:
        if name not in problem.numbers or name in prepared.numbers:
            continue
        own = [i for i, entry in enumerate(fit.model.entries) if entry.keys == (name,)]
        if any(fit.model.entries[i].slot == "numbers" for i in own):
            continue  # a shared unknown cannot differ from test to test
        more = (1.0 + ADDED_MASS) * problem.numbers[name]
        unit = problem.rig.parameters[name].unit
        words = f"Repeat '{prepared.name}' with {more - problem.numbers[name]:.3g} {unit} more"
        test = _blank(prepared, numbers={**prepared.numbers, name: more})
        yield Planned(f"{words} at {place}, weighed", kind, prepared.name, 1.0, test)
