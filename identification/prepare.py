"""From a checked record to the arrays of a fit: window, inputs on the grid, sampling of sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_matrix

from ..model.chain import DERIVATIVES, FORCES
from ..model.linear import Mechanism, Port, modes
from .decay import free_from, glance
from .records import Channel, Record

ROTATING = ("angle", "angular_velocity", "angular_acceleration", "torque")


@dataclass(frozen=True)
class Sensor:
    """A measured channel, ready to be compared.

    Attributes:
        channel: as read at the door [SI].
        port: where it sits on the mechanism.
        values: measured samples inside the window, shape (n,) [SI].
        times: their times on the record's clock, from the window's start, shape (n,) [s].
        sampling: matrix from the simulation's grid to these samples; None where they coincide.
    """

    channel: Channel
    port: Port
    values: np.ndarray
    times: np.ndarray
    sampling: csr_matrix | None = None


@dataclass(frozen=True)
class Prepared:
    """One record, ready for a fit.

    Attributes:
        record: as read at the door.
        start: first sample used; the hand or the pre-trigger lies before it.
        reason: why it starts there, in words.
        step: simulation's sampling interval [s].
        count: samples of the simulation's grid.
        inputs: shape (padded, inputs), piecewise linear between samples [SI].
        ports: where the inputs act.
        drives: the channel behind each input; empty where this record has none there.
        sensors: the measured channels.
        frequency: dominant frequency of the responses [Hz].
        free: whether nothing drives it.
        numbers: what differed from the rig on that day, by name [SI].
        opening: how much of it tells its start state [s].
        at_rest: whether it is driven and begins at rest.
    """

    record: Record
    start: int
    reason: str
    step: float
    count: int
    inputs: np.ndarray
    ports: tuple[Port, ...]
    sensors: tuple[Sensor, ...]
    frequency: float
    free: bool
    numbers: dict[str, float] = field(default_factory=dict)
    opening: float = 0.0
    at_rest: bool = False
    drives: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The record's name."""
        return self.record.name


def bucket(count: int) -> int:
    """Padded length for `count` samples, so that few lengths are ever compiled [-]."""
    power = 2 ** max(9, int(np.ceil(np.log2(max(count, 1)))))
    if power <= 2048:
        return power
    for factor in (0.625, 0.75, 0.875):
        if count <= power * factor:
            return int(power * factor)
    return power


BLOW = 0.01
"""How long an impact that no channel recorded is taken to last [s]."""

FADED = 0.05
"""A free decay is used until it has fallen below this share of its start [-]: what is left tells
of other, smaller things."""


def _faded(record: Record, start: int) -> int:
    """One past the last grid sample before every response has faded away."""
    rate, ends = record.sample_rate, [start + 64]
    for channel in record.responses:
        first = max(0, round((start / rate - channel.start_time) * channel.sample_rate))
        values = channel.values[first:]
        swing = np.abs(values - np.mean(values[-max(8, len(values) // 3) :]))
        loud = np.flatnonzero(swing > FADED * np.quantile(swing, 0.97))
        seconds = channel.start_time + (first + int(loud[-1]) + 1) / channel.sample_rate
        ends.append(int(np.ceil(seconds * rate)))
    return min(max(ends), len(record.times))


def prepare(record: Record, mechanism: Mechanism, numbers: Mapping[str, float]) -> Prepared:
    """Cut, align and pad one record.

    Args:
        record: as read at the door.
        mechanism: what it was measured on; tells where channels act.
        numbers: the rig's numbers by name [SI].

    Returns:
        The record as a fit sees it.

    Raises:
        ValueError: for a record without a response, or one whose window is empty.
    """
    responses = record.responses
    if not responses:
        raise ValueError(
            f"{record.path.name}: [channels]: expected at least one with role = 'response', "
            "found none. Mend: say which channel was measured."
        )
    start, reason = _window(record)
    rate = record.sample_rate
    moved = any(np.ptp(channel.values) > 0 for channel in record.inputs)
    end = len(record.times) if moved else _faded(record, start)
    times = np.arange(start, end) / rate
    if len(times) < 16:
        raise ValueError(
            f"{record.path.name}: expected at least 16 samples after the release, found "
            f"{len(times)}. Mend: give a longer record or [start] at."
        )
    count = len(times)
    padded = bucket(count)
    columns = [_on_grid(channel, times) for channel in record.inputs]
    ports = tuple(Port(c.place, c.quantity, held=c.held) for c in record.inputs)
    told = np.stack(columns, axis=1) if columns else np.zeros((count, 0))
    inputs = _continued(told, ports, padded)
    sensors = tuple(_sensor(channel, times, rate, padded) for channel in responses)
    first = sensors[0].values
    free = not any(np.ptp(column) > 0 for column in columns)
    frequency = glance(first, sensors[0].channel.sample_rate).frequency
    own = dict(numbers) | record.parameters
    opening = _opening_seconds(mechanism, own, frequency if free else 0.0, count / rate, 1 / rate)
    return Prepared(
        record,
        start,
        reason,
        1.0 / rate,
        count,
        inputs,
        ports,
        sensors,
        frequency,
        free,
        dict(record.parameters),
        opening,
        not free and _begins_at_rest(sensors),
        tuple(channel.name for channel in record.inputs),
    )


def prepare_all(
    records: Sequence[Record], mechanism: Mechanism, numbers: Mapping[str, float]
) -> tuple[Prepared, ...]:
    """`prepare` for each record of a rig with the given numbers [SI].

    A force that drives only some of them is a force of nothing in the others, and shorter records
    are filled up: all share one compiled plant.
    """
    found = [prepare(record, mechanism, numbers) for record in records]
    longest = max((len(prepared.inputs) for prepared in found), default=0)
    found = [_padded(p, longest) if 2 * len(p.inputs) >= longest else p for p in found]
    forces = {key for prepared in found for key in _forces(prepared)}
    return tuple(_with_forces(prepared, sorted(forces)) for prepared in found)


def _continued(inputs: np.ndarray, ports: tuple[Port, ...], count: int) -> np.ndarray:
    """Inputs on a longer grid: they stay at their last value, and positions go on as they went.

    A position that stopped dead would be a kink, which reaches back into the last samples.
    """
    more = np.arange(1, count - len(inputs) + 1)
    moves = [DERIVATIVES.get(port.quantity) == 0 for port in ports]
    slope = np.where(moves, inputs[-1] - inputs[-2], 0.0) if moves else np.zeros(0)
    return np.concatenate([inputs, inputs[-1] + more[:, None] * slope])


def _padded(prepared: Prepared, count: int) -> Prepared:
    """The record on a longer grid."""
    more = count - len(prepared.inputs)
    if not more:
        return prepared
    inputs = _continued(prepared.inputs, prepared.ports, count)
    sensors = []
    for sensor in prepared.sensors:
        sampling = sensor.sampling
        if sampling is not None:
            sampling = sampling.copy()
            sampling.resize(sampling.shape[0], count)
        sensors.append(replace(sensor, sampling=sampling))
    return replace(prepared, inputs=inputs, sensors=tuple(sensors))


ForceKey = tuple[str, str, bool, int]


def _forces(prepared: Prepared) -> dict[ForceKey, int]:
    """Index of each force by place, quantity, whether held, and which of several."""
    found: dict[ForceKey, int] = {}
    for index, port in enumerate(prepared.ports):
        if port.quantity in FORCES:
            alike = sum(port == other for other in prepared.ports[:index])
            found[port.place, port.quantity, port.held, alike] = index
    return found


def _with_forces(prepared: Prepared, forces: Sequence[ForceKey]) -> Prepared:
    """The record with these forces in this order, then its motion of the ground."""
    own = _forces(prepared)
    ports, drives, columns = [], [], []
    for key in forces:
        at = own.get(key)
        ports.append(Port(key[0], key[1], held=key[2]))
        drives.append("" if at is None else prepared.drives[at])
        columns.append(np.zeros(len(prepared.inputs)) if at is None else prepared.inputs[:, at])
    for index, port in enumerate(prepared.ports):
        if port.quantity not in FORCES:
            ports.append(port)
            drives.append(prepared.drives[index])
            columns.append(prepared.inputs[:, index])
    inputs = np.stack(columns, axis=1) if columns else prepared.inputs
    return replace(prepared, ports=tuple(ports), drives=tuple(drives), inputs=inputs)


REST = 0.1
"""A driven record whose first samples move slower than this share of its fastest motion began at
rest [-]."""


def _begins_at_rest(sensors: tuple[Sensor, ...]) -> bool:
    for sensor in sensors:
        if DERIVATIVES[sensor.port.quantity] == 0:
            rate = np.abs(np.gradient(sensor.values))
        else:
            rate = np.abs(sensor.values)
        few = max(4, len(rate) // 10000)
        if np.max(rate[:few]) > REST * np.max(rate):
            return False
    return True


def _opening_seconds(
    mechanism: Mechanism, numbers: Mapping[str, float], free: float, whole: float, step: float
) -> float:
    """Three periods of a decay, ten of a driven record or at most a fiftieth of it.

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


def _window(record: Record) -> tuple[int, str]:
    rate = record.sample_rate
    at = record.start.get("at")
    driven = [channel for channel in record.inputs if np.ptp(channel.values) > 0]
    if at is not None and not driven:
        if record.test == "impact":
            after = max(3 / rate, BLOW)
            return (
                round((at + after) * rate),
                f"used from {1e3 * after:.0f} ms after the impact at {at:g} s; the blow itself is "
                "not modelled",
            )
        return round(at * rate), f"used from the release at {at:g} s, as the sidecar says"
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


def _on_grid(channel: Channel, times: np.ndarray) -> np.ndarray:
    offset = channel.start_time
    own = offset + np.arange(len(channel.values)) / channel.sample_rate
    if len(own) == len(times) and np.allclose(own, times):
        return np.asarray(channel.values)
    return np.interp(times, own, channel.values)


def _sensor(channel: Channel, times: np.ndarray, rate: float, padded: int) -> Sensor:
    offset = channel.start_time
    own = offset + np.arange(len(channel.values)) / channel.sample_rate
    port = Port(channel.place, channel.quantity, channel.frame)
    inside = (own >= times[0] - 1e-9) & (own <= times[-1] + 1e-9)
    values, at = np.asarray(channel.values)[inside], own[inside] - times[0]
    position = at * rate
    if np.allclose(position, np.arange(len(at)), atol=1e-6):
        return Sensor(channel, port, values, at)
    keep = position <= len(times) - 1
    return Sensor(channel, port, values[keep], at[keep], sampling_matrix(position[keep], padded))


def sampling_matrix(position: np.ndarray, count: int) -> csr_matrix:
    """Values between grid points by Lagrange polynomials through six neighbors.

    Args:
        position: where values are wanted, in samples of the grid, shape (n,).
        count: length of the grid.

    Returns:
        Sparse matrix, shape (n, count) [1].
    """
    low = np.clip(np.floor(position).astype(int) - 2, 0, count - 6)
    part = position - low
    rows, columns, weights = [], [], []
    for j in range(6):
        weight = np.ones_like(part)
        for i in range(6):
            if i != j:
                weight = weight * (part - i) / (j - i)
        rows.append(np.arange(len(position)))
        columns.append(low + j)
        weights.append(weight)
    data = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    return csr_matrix(data, shape=(len(position), count))


def shortened(prepared: Prepared, count: int) -> Prepared:
    """The first `count` grid samples of a record."""
    if prepared.count <= count:
        return prepared
    padded = bucket(count)
    inputs = _continued(prepared.inputs[:count], prepared.ports, padded)
    sensors = []
    for sensor in prepared.sensors:
        keep = int(np.sum(sensor.times <= (count - 4) * prepared.step))
        if sensor.sampling is None:
            keep, sampling = count, None
        else:
            sampling = sensor.sampling[:keep, :padded]
        sensors.append(
            replace(
                sensor, values=sensor.values[:keep], times=sensor.times[:keep], sampling=sampling
            )
        )
    return replace(prepared, count=count, inputs=inputs, sensors=tuple(sensors))


def opening(prepared: Prepared) -> Prepared:
    """The part of a record that tells its start state."""
    return shortened(prepared, int(prepared.opening / prepared.step) + 2)


def driven_by_force(prepared: Prepared) -> bool:
    """Whether a force or torque drives the record, so that masses are visible."""
    return not prepared.free and any(port.quantity in FORCES for port in prepared.ports)
