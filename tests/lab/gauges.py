"""Channels of a record: what an instrument shows, its clock, its tolerances and its faults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import bilinear, lfilter

from .march import Moved
from .structure import Structure

TO_FILE = {"m/s^2": 1.0, "g": 1 / 9.80665, "mm": 1e3, "deg": 180 / np.pi}
MAINS = 50.0


@dataclass(frozen=True)
class Gauge:
    """One instrument; `errors` are its true gain, offset, delay and radius within tolerance [SI].

    `rate` is its own rate; a rate that is not the record's means a file and a clock of its own.
    """

    name: str
    view: str
    unit: str
    rate: float
    tolerance: Mapping[
        str, float
    ]  # standard deviations: gain [1], offset [SI], delay [s], radius [m]
    errors: Mapping[str, float] = field(default_factory=dict)
    step: float = 0.0  # of its quantisation, in `unit`; 0 for noise of the case's kind
    role: str = "response"


@dataclass(frozen=True)
class Fault:
    """What is wrong with one channel; `size` in SI units, `other` as the table of `faulty` says."""

    law: str
    channel: str
    size: float
    other: float = 0.0


def row_of(gauge: Gauge, structure: Structure) -> np.ndarray:
    """The row that an instrument sees, its place along the club off by its radius error."""
    row = structure.views[gauge.view].row
    off = gauge.errors.get("radius", 0.0)
    if off and "head_turn" in structure.points and gauge.view.startswith("head"):
        row = row + off * structure.points["head_turn"]
    return row


def seen(gauge: Gauge, structure: Structure, moved: Moved) -> np.ndarray:
    """What the instrument's place does, at the record's samples [SI]."""
    if gauge.role == "input":
        return moved.angle
    return moved.orders()[structure.views[gauge.view].order] @ row_of(gauge, structure)


def clock(gauge: Gauge, rate: float, count: int) -> np.ndarray:
    """Times of the instrument's samples on its own clock [s]."""
    if gauge.rate == rate:
        return np.arange(count) / rate
    return np.arange(int((count - 1) / rate * gauge.rate) - 1) / gauge.rate


def shown(
    gauge: Gauge,
    structure: Structure,
    moved: Moved,
    rate: float,
    faults: tuple[Fault, ...] = (),
    phase: float = 0.0,
) -> np.ndarray:
    """What the instrument writes without noise [SI], at the times of its own clock."""
    values = seen(gauge, structure, moved)
    mine = [fault for fault in faults if fault.channel == gauge.name]
    for fault in mine:
        if fault.law == "sensor_tilt":
            speed = moved.velocity @ structure.points["clubhead"]
            inward = -(speed**2) / fault.other
            values = np.cos(fault.size) * values + np.sin(fault.size) * inward
    late = sum(fault.size for fault in mine if fault.law == "sensor_delay")
    late = late + gauge.errors.get("delay", 0.0)
    times = clock(gauge, rate, len(values))
    if late or gauge.rate != rate:
        own = np.arange(len(values)) / rate
        at = np.clip(times - late, 0.0, own[-1])
        values = CubicSpline(own, values)(at)
    for fault in mine:
        values = faulty(fault, values, gauge.rate, phase)
    return values * (1 + gauge.errors.get("gain", 0.0)) + gauge.errors.get("offset", 0.0)


def faulty(fault: Fault, values: np.ndarray, rate: float, phase: float) -> np.ndarray:
    """A channel with a fault that needs to know nothing but the channel.

    offset: + size. drift: + size t / T. gain: times 1 + size. highpass, lowpass: of first order,
    size is the corner's time constant [s]. saturation: clipped at size. rectified: + size |y|.
    mains_hum: + size sin(2 pi 50 t + phase).
    """
    law, size, count = fault.law, fault.size, len(values)
    if size == 0.0 or law in ("sensor_delay", "sensor_tilt"):
        return values
    if law == "sensor_offset":
        return values + size
    if law == "sensor_drift":
        return values + size * np.linspace(0.0, 1.0, count)
    if law == "sensor_gain":
        return values * (1 + size)
    if law == "sensor_saturation":
        return np.clip(values, -size, size)
    if law == "sensor_rectified":
        return values + size * np.abs(values)
    if law == "mains_hum":
        return values + size * np.sin(2 * np.pi * MAINS * np.arange(count) / rate + phase)
    top = [size, 0.0] if law == "sensor_highpass" else [1.0]
    forth, back = bilinear(top, [size, 1.0], rate)
    if law == "sensor_highpass":
        return np.asarray(lfilter(forth, back, values))
    settled = np.asarray([forth[-1] - back[-1] * 1.0]) * values[0]  # it has shown the first value
    return np.asarray(lfilter(forth, back, values, zi=settled)[0])
