"""From a checked record to the arrays of a fit: window, inputs on the grid, sampling of sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.sparse import csr_matrix

from ..model.chain import DERIVATIVES, FORCES
from ..model.linear import Mechanism, Port
from ..model.robot import Robot
from .decay import glance
from .noise import periodogram
from .records import Channel, Record
from .window import begins_at_rest, begun_at, calm_from, faded_at, opening_seconds, window

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
        before: the same for samples of its interval that lie before these; None where none does.
        since: how long the channel's record has run at the first of these [s].
        gathered: integral over time of what it read before these and `before` [SI times s].
    """

    channel: Channel
    port: Port
    values: np.ndarray
    times: np.ndarray
    sampling: csr_matrix | None = None
    before: csr_matrix | None = None
    since: float = 0.0
    gathered: float = 0.0

    @property
    def step(self) -> float:
        """Its sampling interval, longer than the channel's own where it was thinned [s]."""
        return float(self.times[1] - self.times[0])


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
        since: how long before its start an unrecorded blow threw it out of its rest [s]: one
            sampling interval; 0 where none is told.
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
    since: float = 0.0

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
    start, reason = window(record, isinstance(mechanism, Robot))
    rate = record.sample_rate
    moved = any(np.ptp(channel.values) > 0 for channel in record.inputs)
    calm = calm_from(record, isinstance(mechanism, Robot))
    used = max(start, int(np.ceil(calm * rate - 1e-6)))  # the first one that counts
    end = len(record.times)
    if end - used >= 16:
        end = _told_until(record) if moved else faded_at(record, used)
    times = np.arange(start, end) / rate
    if end - used < 16:
        raise ValueError(
            f"{record.path.name}: expected at least 16 samples after the release, found "
            f"{max(end - used, 0)}. Mend: give a longer record or [start] at."
        )
    count = len(times)
    padded = bucket(count)
    columns = [_on_grid(channel, times) for channel in record.inputs]
    ports = tuple(Port(c.place, c.quantity, held=c.held) for c in record.inputs)
    told = np.stack(columns, axis=1) if columns else np.zeros((count, 0))
    inputs = _continued(told, ports, padded)
    drives = [(channel.quantity, _as_read(channel)) for channel in record.inputs]
    sensors = tuple(_sensor(channel, times, rate, padded, calm) for channel in responses)
    first = sensors[0].values
    free = not any(np.ptp(column) > 0 for column in columns)
    frequency = glance(first, sensors[0].channel.sample_rate).frequency
    own = dict(numbers) | record.parameters
    opening = opening_seconds(mechanism, own, frequency if free else 0.0, count / rate, 1 / rate)
    if calm > 0:
        opening += calm - times[0]
        if not free:
            reason = f"driven; used from {calm:.3f} s on, when the blow's ringing has died away"
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
        not free
        and (calm > 0 or begins_at_rest([(s.port.quantity, s.values) for s in sensors], drives)),
        tuple(channel.name for channel in record.inputs),
        _since(record),
    )


def _told_until(record: Record) -> int:
    """One past the last sample whose every input is told, or rests where told last [-]."""
    end = len(record.times)
    for channel in record.inputs:
        values = channel.values
        last = channel.start_time + (len(values) - 1) / channel.sample_rate
        gap = record.times[-1] - last
        if gap <= 1.0 / record.sample_rate or len(values) < 4:
            continue
        moves = abs(values[-1] - values[-4]) / 3.0 * gap * channel.sample_rate
        if moves > STIRS * np.ptp(values):
            end = min(end, int(last * record.sample_rate + 1e-6) + 1)
    return end


STIRS = 1e-3
"""A told input that would go on by more than this share of its range is not taken to rest [-]."""


def _since(record: Record) -> float:
    """Time from an unrecorded blow to the start of the motion that follows it [s].

    One sampling interval; 0 where none is told.
    """
    struck = record.test == "impact" and begun_at(record) is not None
    return 1.0 / record.sample_rate if struck else 0.0


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
        sensors.append(
            replace(sensor, sampling=sampling, before=_before(sensor.times, prepared.step, count))
        )
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


def _as_read(channel: Channel) -> np.ndarray:
    """Its samples from the record's first one on [SI]: a spline between them smooths noise."""
    early = -channel.start_time * channel.sample_rate
    return np.asarray(channel.values)[max(int(np.ceil(early - 1e-6)), 0) :]


def _on_grid(channel: Channel, times: np.ndarray) -> np.ndarray:
    offset = channel.start_time
    own = offset + np.arange(len(channel.values)) / channel.sample_rate
    if len(own) == len(times) and np.allclose(own, times):
        return np.asarray(channel.values)
    if DERIVATIVES.get(channel.quantity) == 0 and not channel.held and len(own) > 3:
        # a body moves smoothly; straight lines between slow samples would kink it
        inside = np.clip(times, own[0], own[-1])
        return CubicSpline(own, channel.values)(inside)
    return np.interp(times, own, channel.values)


def _sensor(
    channel: Channel, times: np.ndarray, rate: float, padded: int, calm: float = 0.0
) -> Sensor:
    offset = channel.start_time
    own = offset + np.arange(len(channel.values)) / channel.sample_rate
    port = Port(channel.place, channel.quantity, channel.frame)
    inside = (own >= max(times[0], calm) - 1e-9) & (own <= times[-1] + 1e-9)
    values, at = np.asarray(channel.values)[inside], own[inside] - times[0]
    since = float(own[inside][0] - own[0]) if inside.any() else 0.0
    position = at * rate
    if np.allclose(position, np.arange(len(at)), atol=1e-6):
        return Sensor(channel, port, values, at, None, None, since, _gathered(channel, since))
    keep = position <= len(times) - 1
    sampling = sampling_matrix(position[keep], padded)
    early = _before(at[keep], 1 / rate, padded)
    begun = since - (0 if early is None else (len(early.indptr) - 1)) / channel.sample_rate
    gathered = _gathered(channel, begun)
    return Sensor(channel, port, values[keep], at[keep], sampling, early, since, gathered)


def _gathered(channel: Channel, until: float) -> float:
    """Integral of what a channel reads in the first so many seconds of its record [SI times s]."""
    read = channel.values[: max(round(until * channel.sample_rate), 0) + 1]
    return float(np.trapezoid(read)) / channel.sample_rate


def _before(times: np.ndarray, step: float, count: int) -> csr_matrix | None:
    """From a grid of `count` points, `step` apart, to samples that lie before a sensor's [s]."""
    if len(times) < 2:
        return None
    own = times[1] - times[0]
    more = int(times[0] / own + 1e-6)
    earlier = times[0] - own * np.arange(more, 0, -1)
    return sampling_matrix(earlier / step, count) if more else None


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


def coarser(prepared: Prepared) -> Prepared:
    """The record on a grid with forty samples in the shortest period that matters.

    Forces are averaged over each coarse interval, which keeps their impulse; motions are not.
    """
    bands = [_band(s.values, s.channel.sample_rate) for s in prepared.sensors]
    factor = int(1.0 / prepared.step / (40.0 * float(np.median(bands))))
    if factor < 2:
        return prepared
    count = (prepared.count - 1) // factor + 1
    padded, step = bucket(count), prepared.step * factor
    columns, width = [], np.ones(factor) / factor
    for port, column in zip(prepared.ports, prepared.inputs.T, strict=True):
        told = column[: prepared.count]
        if port.quantity in FORCES:
            told = np.convolve(told, width, mode="same")
        columns.append(told[::factor][:count])
    told = np.stack(columns, axis=1) if columns else np.zeros((count, 0))
    inputs = _continued(told, prepared.ports, padded)
    sensors = tuple(_coarser(s, factor, step, count, padded) for s in prepared.sensors)
    return replace(prepared, step=step, count=count, inputs=inputs, sensors=sensors)


def _coarser(sensor: Sensor, factor: int, step: float, count: int, padded: int) -> Sensor:
    """The samples of one channel that a coarse grid keeps."""
    if sensor.sampling is None:
        kept = slice(None, factor * count, factor)
        return replace(sensor, values=sensor.values[kept], times=sensor.times[kept])
    every = max(1, int(step * sensor.channel.sample_rate))
    times = sensor.times[::every]
    keep = times <= (count - 1) * step
    values, times = sensor.values[::every][keep], times[keep]
    sampling, before = sampling_matrix(times / step, padded), _before(times, step, padded)
    return replace(sensor, values=values, times=times, sampling=sampling, before=before)


def _band(values: np.ndarray, rate: float) -> float:
    """Frequency below which lies what matters of a channel [Hz].

    Either all but a thousandth of its rate of change's power, or all that stands six times above
    the upper half of its frequencies, its noise; the lower of the two.
    """
    frequency, power = periodogram(values - np.mean(values))
    floor = float(np.median(power[len(power) // 2 :]))
    weight = np.cumsum(power * frequency**2)
    signal = np.maximum.accumulate(np.maximum(weight - floor * np.cumsum(frequency**2), 0.0))
    most = int(np.searchsorted(signal, 0.999 * signal[-1]))
    loud = np.flatnonzero(np.convolve(power, np.ones(9) / 9, mode="same") > 6.0 * floor)
    return float(frequency[min(most, int(loud[-1]) if len(loud) else most)] * rate)


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
        kept = replace(sensor, values=sensor.values[:keep], times=sensor.times[:keep])
        before = _before(kept.times, prepared.step, padded)
        sensors.append(replace(kept, sampling=sampling, before=before))
    return replace(prepared, count=count, inputs=inputs, sensors=tuple(sensors))


def opening(prepared: Prepared) -> Prepared:
    """The part of a record that tells its start state."""
    return shortened(prepared, int(prepared.opening / prepared.step) + 2)


def driven_by_force(prepared: Prepared) -> bool:
    """Whether a force or torque drives the record, so that masses are visible."""
    return not prepared.free and any(port.quantity in FORCES for port in prepared.ports)
