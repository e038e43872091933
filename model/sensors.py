"""Sensors: what sees a motion, what it weighs, and what it misreads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from . import planar
from .delay import shift
from .drives import Drive
from .extended import refusal, stated
from .law import Law, library
from .linear import Mechanism, Port
from .motion import Motion, sensor_name
from .planar_motion import sampled_signals
from .planar_sensors import felt_accelerations, track_of
from .robot import INCLINATION, STRAIN_PER_BEND, Robot

FEEDBACK_RATE = 250.0
"""How often the robot's encoders report [Hz]; thesis line 1683."""

_CARRIERS = {"clubhead": "clubhead_mass", "grip": "grip_mass"}
_ON_TIME = 1e-9


@dataclass(frozen=True)
class Effect:
    """What is wrong with a sensor, or what its electronics do.

    Attributes:
        law: one of the library's laws of a sensor.
        strength: in the law's unit [SI].
        shapes: the law's further numbers [SI].
    """

    law: Law
    strength: float
    shapes: tuple[float, ...] = ()


@dataclass(frozen=True)
class Sensor:
    """One sensor.

    Attributes:
        name: of its column.
        port: where it sits, what it sees, and in which frame.
        effects: in the order in which they act; all act on what the frame shows, but a tilt, which
            turns the axis of the sensor itself.
        scale: factor from what is there to what it tells, before all effects [-].
        rate: how often it reads; what it read is held in between; None: at every sample [Hz].
        quantum: step of what it can tell; 0 for any [SI unit of its quantity].
    """

    name: str
    port: Port
    effects: tuple[Effect, ...] = ()
    scale: float = 1.0
    rate: float | None = None
    quantum: float = 0.0


def plain_sensor(port: Port, name: str = "") -> Sensor:
    """A sensor that tells what is there; its column is named after its port."""
    return Sensor(name or sensor_name(port), port)


def accelerometer(
    port: Port,
    name: str = "",
    *,
    mass: float = 0.0,
    tilt: float = 0.0,
    delay: float = 0.0,
    gain: float = 0.0,
    highpass: float = 0.0,
    lowpass: float | None = None,
    offset: float = 0.0,
    saturation: float | None = None,
) -> Sensor:
    """An accelerometer with its amplifier.

    Args:
        port: where it sits.
        name: of its column.
        mass: what it weighs, with the part of its cable that rides along [kg].
        tilt: how far its axis leans outwards along the club [rad].
        delay: of the channel [s].
        gain: error of the sensitivity; 0.02 reads two per cent too large [-].
        highpass: corner of the charge amplifier; 0 passes constants [Hz].
        lowpass: corner of the filter; None for none [Hz].
        offset: of the amplifier's zero [m/s^2].
        saturation: largest reading; None for none [m/s^2].

    Returns:
        The sensor; its effects act in the order of the arguments.

    Raises:
        ValueError: for a number that cannot be.
    """
    turn = 2 * np.pi
    listed = [
        _effect("sensor_mass", mass),
        _effect("sensor_tilt", tilt),
        _effect("sensor_delay", delay),
        _effect("sensor_gain", gain),
        _effect("sensor_highpass", turn * highpass),
        _effect(
            "sensor_lowpass", 0.0 if lowpass is None else 1.0 / (turn * _above("lowpass", lowpass))
        ),
        _effect("sensor_offset", offset),
    ]
    if saturation is not None:
        listed.append(_effect("sensor_saturation", 1.0, _above("saturation", saturation)))
    kept = tuple(effect for effect in listed if effect.strength != 0)
    return replace(plain_sensor(port, name), effects=kept)


def strain_gauge(
    port: Port,
    name: str = "",
    *,
    calibration: float = STRAIN_PER_BEND,
    offset: float = 0.0,
    drift: float = 0.0,
) -> Sensor:
    """A strain gauge on the shaft.

    Args:
        port: strain or deflection of the shaft.
        name: of its column.
        calibration: strain for one metre of bend that its electronics assume [1/m]. The shaft's own
            is `STRAIN_PER_BEND`: a deflection is told by the strain over the calibration.
        offset: of its zero [1 or m].
        drift: of its zero [1/s or m/s].

    Returns:
        The sensor.

    Raises:
        ValueError: for a number that cannot be.

    Source: thesis line 1833.
    """
    listed = (_effect("sensor_offset", offset), _effect("sensor_drift", drift))
    wrong = STRAIN_PER_BEND / _above("calibration", calibration)
    return replace(
        plain_sensor(port, name),
        scale=wrong if port.quantity == "deflection" else 1.0 / wrong,
        effects=tuple(effect for effect in listed if effect.strength != 0),
    )


def encoder(
    port: Port,
    name: str = "",
    *,
    rate: float = FEEDBACK_RATE,
    quantum: float = 0.0,
    offset: float = 0.0,
    delay: float = 0.0,
) -> Sensor:
    """An encoder: it reads at its own rate, in whole steps, and its last reading is held.

    Args:
        port: a joint's angle.
        name: of its column.
        rate: readings a second [Hz].
        quantum: one step; 0 for any angle [rad].
        offset: of its zero [rad].
        delay: from the joint to the reading [s].

    Returns:
        The sensor.

    Raises:
        ValueError: for a number that cannot be.
    """
    listed = (_effect("sensor_delay", delay), _effect("sensor_offset", offset))
    kept = tuple(effect for effect in listed if effect.strength != 0)
    if not (np.isfinite(quantum) and quantum >= 0):
        raise _wrong("quantum", "a finite step of at least 0 rad", quantum)
    return Sensor(plain_sensor(port, name).name, port, kept, 1.0, _above("rate", rate), quantum)


def _effect(name: str, strength: float, *shapes: float) -> Effect:
    law = library()[name]
    if not np.isfinite(strength) or (strength < 0 and not law.signed):
        raise _wrong(name.removeprefix("sensor_"), "a finite number of at least 0", strength)
    return Effect(law, float(strength), shapes)


def _above(key: str, value: float) -> float:
    if not (np.isfinite(value) and value > 0):
        raise _wrong(key, "a number above 0", value)
    return float(value)


def _wrong(key: str, expected: str, found: float) -> ValueError:
    return ValueError(f"{key}: expected {expected}, found {found:g}. Mend: correct it.")


def with_laws(
    sensors: Sequence[Sensor], tables: Iterable[Mapping[str, Any]], mechanism: Mechanism
) -> tuple[tuple[Sensor, ...], dict[str, float], tuple[int, ...]]:
    """Sensors with the laws that a rig states of them.

    Args:
        sensors: what is asked for.
        tables: ``law``, ``place`` and ``parameters`` of an extended rig; a law of a sensor has the
            sensor's name for its place, a mass also the place where it rides.
        mechanism: tells what can carry a mass.

    Returns:
        The sensors, what further masses they and the rig's laws put where (by the name of the
        number) [kg or kg m^2], and which of the tables were used.

    Raises:
        ValueError: for a law whose numbers are missing or cannot be, a mass where nothing carries
            it, or a tilt of what is no accelerometer.
    """
    known = {sensor.name: sensor for sensor in sensors}
    loads: dict[str, float] = {}
    used = []
    for index, table in enumerate(tables):
        law, place = library().get(str(table["law"])), str(table["place"])
        if law is None or not law.slot:
            continue
        at = known[place].port.place if place in known else place
        if place not in known and (law.slot != "load" or not carrier(mechanism, at)):
            continue
        effect = _stated(index, table, law)
        used.append(index)
        if place in known:
            sensor = known[place]
            known[place] = replace(sensor, effects=(*sensor.effects, effect))
        else:
            name = carrier(mechanism, at)
            loads[name] = loads.get(name, 0.0) + effect.strength
    for sensor in known.values():
        for effect in sensor.effects:
            _check(sensor, effect.law, mechanism)
            if effect.law.slot == "load":
                name = carrier(mechanism, sensor.port.place)
                loads[name] = loads.get(name, 0.0) + effect.strength
    return tuple(known.values()), loads, tuple(used)


def _stated(index: int, table: Mapping[str, Any], law: Law) -> Effect:
    refuse = refusal(index)
    units = [law.unit(False, "unit of the channel")]
    units += [shape.unit(False, "unit of the channel") for shape in law.shapes]
    given = stated(table, law.symbol, law, units, refuse)
    strength = given[law.symbol]
    if strength < 0 and not law.signed:
        raise refuse(law.symbol, "a number of at least 0", f"{strength:g}", "correct it")
    return Effect(law, strength, tuple(given[shape.symbol] for shape in law.shapes))


def carrier(mechanism: Mechanism, place: str) -> str:
    """Name of the number that a mass at a place adds to; empty where there is none [-]."""
    if isinstance(mechanism, Robot):
        return _CARRIERS.get(place, "")
    ends = ("inertia", "mass")
    return next((n for n in mechanism.names if n in [f"masses.{place}.{end}" for end in ends]), "")


def _check(sensor: Sensor, law: Law, mechanism: Mechanism) -> None:
    port = sensor.port
    if law.slot == "load" and not carrier(mechanism, port.place):
        expected, found = "a place that carries it: clubhead, grip or a mass", f"'{port.place}'"
    elif law.slot == "axis" and port.quantity != "acceleration":
        expected, found = "an accelerometer", f"one of '{port.quantity}'"
    elif law.slot == "axis" and not isinstance(mechanism, Robot):
        expected, found = "a robot, whose club turns", "a chain, which moves along one line"
    else:
        return
    raise ValueError(
        f"sensor '{sensor.name}', {law.name}: expected {expected}, found {found}. "
        f"Mend: remove this law, or place the sensor elsewhere."
    )


def loaded(numbers: Mapping[str, float], loads: Mapping[str, float]) -> dict[str, float]:
    """Numbers of a mechanism with what its sensors weigh [SI].

    Args:
        numbers: by name [SI].
        loads: see `with_laws` [kg or kg m^2].
    """
    return {name: value + loads.get(name, 0.0) for name, value in numbers.items()}


def seen_ports(sensors: Iterable[Sensor]) -> tuple[Port, ...]:
    """What a simulation has to give so that all sensors can read, each port once [-]."""
    ports: list[Port] = []
    for sensor in sensors:
        ports.append(sensor.port)
        if any(effect.law.slot == "axis" for effect in sensor.effects):
            ports.append(replace(sensor.port, frame="absolute"))
    return tuple(dict.fromkeys(ports))


def readings(
    sensors: Sequence[Sensor],
    mechanism: Mechanism,
    numbers: Mapping[str, float],
    drive: Drive,
    motion: Motion,
) -> dict[str, np.ndarray]:
    """What the sensors say of a motion.

    Args:
        sensors: with all their effects.
        mechanism: chain or robot.
        numbers: its numbers by name, as the motion had them [SI].
        drive: what moved it.
        motion: with at least the ports of `seen_ports`.

    Returns:
        One array of shape (t,) a sensor, by its name [SI unit of its quantity].

    Raises:
        ValueError: for two sensors of one name.
    """
    found: dict[str, np.ndarray] = {}
    for sensor in sensors:
        if sensor.name in found:
            raise ValueError(
                f"sensor '{sensor.name}': expected names that differ, found it twice. "
                "Mend: rename one, or ask for each sensor once."
            )
        values = _there(sensor, mechanism, numbers, drive, motion)
        found[sensor.name] = read(sensor, values, motion.times)
    return found


def read(sensor: Sensor, values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """What a sensor says of what is there, shape (t,) [SI unit of its quantity].

    Args:
        sensor: its mass and tilt are passed over: they change what is there.
        values: what is there, shape (t,).
        times: uniform [s].
    """
    step, values = float(times[-1] - times[0]) / (len(times) - 1), sensor.scale * values
    for effect in sensor.effects:
        law, strength = effect.law, effect.strength
        if law.fault is not None:
            values = np.asarray(law.fault.read(strength, effect.shapes, values, step))
        elif law.slot == "delay":
            late = shift(jnp.asarray(values)[:, None], jnp.asarray([strength / step]))
            values = np.asarray(late)[:, 0]
        elif law.slot == "gain":
            values = (1.0 + strength) * values
        elif law.slot == "offset":
            values = values + strength
    if sensor.rate is not None:
        instants = np.floor((times - times[0]) * sensor.rate + _ON_TIME) / sensor.rate
        values = CubicSpline(times, values)(times[0] + instants)
    if sensor.quantum:
        values = sensor.quantum * np.round(values / sensor.quantum)
    return values


def _there(
    sensor: Sensor,
    mechanism: Mechanism,
    numbers: Mapping[str, float],
    drive: Drive,
    motion: Motion,
) -> np.ndarray:
    """What is there to be read, along the axis of the sensor."""
    column = motion.samples[:, motion.sensors.index(sensor.port)]
    tilt = sum(effect.strength for effect in sensor.effects if effect.law.slot == "axis")
    if not tilt:
        return column
    across = motion.samples[:, motion.sensors.index(replace(sensor.port, frame="absolute"))]
    p = {name: float(number) for name, number in numbers.items()}
    pull = planar.GRAVITY * float(np.sin(p.get(INCLINATION, 0.0)))
    track = track_of(
        motion.positions, motion.velocities, motion.accelerations,
        sampled_signals(drive, motion.times),
    )  # fmt: skip
    outwards = felt_accelerations(p, track, sensor.port.place, pull)[1]
    assert isinstance(mechanism, Robot), "checked where the sensor was made"
    return column + (np.cos(tilt) - 1.0) * across + np.sin(tilt) * outwards
