"""Which records nothing drives where they are seen, and their arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..model.chain import FORCES
from .allowance import Allowance
from .coast import BLOCK, Channel, Coast, CoastData, Seen
from .fit import Fit
from .noise import Noise
from .prepare import Prepared, Sensor

MOST_PUSHED = 256
"""Steps with inputs beyond which a record is marched [-]."""

MOST_ALLOWED = 12
"""Allowances beyond which a record is marched [-]."""

LENGTH = 16
"""Binary digits of the steps before anything is seen [-]."""

LATE = 5.0
"""Standard deviations of a delay that must have passed before a sample counts [-]."""


def coasts(fit: Fit, prepared: Prepared) -> bool:
    """Whether nothing drives a record where it is seen, but for an unknown constant force."""
    model, allowance = fit.model, fit.model.allowances.get(prepared.name)
    if model.places or (allowance is not None and len(allowance.kinds) > MOST_ALLOWED):
        return False
    moved = [port for port, u in zip(prepared.ports, prepared.inputs.T, strict=True) if np.any(u)]
    if any(port.quantity not in FORCES for port in moved):
        return False
    first, last = _pushed(prepared)
    silent = min(sensor.times[0] for sensor in prepared.sensors) >= last * prepared.step - 1e-12
    even = all(np.ptp(np.diff(s.times)) < 1e-6 * s.step for s in prepared.sensors)
    # closed sums know no sample from another: noise has to be even
    laws = all(type(model.noises[prepared.name, s.channel.name]) is Noise for s in prepared.sensors)
    return silent and even and laws and last - first <= MOST_PUSHED


def _pushed(prepared: Prepared) -> tuple[int, int]:
    """Steps between which inputs act [-]."""
    acting = np.flatnonzero(np.any(prepared.inputs != 0.0, axis=1))
    if not len(acting):
        return 0, 0
    return max(int(acting[0]) - 1, 0), min(int(acting[-1]) + 1, len(prepared.inputs) - 1)


def coast_of(
    fit: Fit,
    prepared: Prepared,
    z: np.ndarray,
    scatter: np.ndarray,
    linear: tuple[Sequence[int], Sequence[int], Sequence[tuple[int, int]]],
    noise: np.ndarray,
) -> tuple[Coast, CoastData]:
    """One record that coasts as a kind and its arrays.

    Args:
        fit: what is sampled around.
        prepared: the record.
        z: the plant's vector without the unknowns [SI].
        scatter: from unknowns to it.
        linear: entries of its own starts, of its own offsets, and shared ones with their place.
        noise: for each sensor, where the numbers of its noise stand, shape (sensors, 3).
    """
    model = fit.model
    plant = model.plant(prepared).bare
    links = dict(model.links(prepared))
    starts, offsets, common = linear
    allowance = model.allowances.get(prepared.name)
    count = 0 if allowance is None else len(allowance.kinds)
    first, last = _pushed(prepared)
    seen, channels = [], []
    for index, sensor in enumerate(prepared.sensors):
        law = model.noises[prepared.name, sensor.channel.name]
        assert isinstance(law, Noise)
        which = _felt(allowance, index)
        series = _series(sensor, allowance, index, which)
        late = _late(fit, prepared, index)
        skipped = int(np.sum(sensor.times - last * prepared.step < late))
        one, two = _channel(sensor, series[:, skipped:], len(law.coefficients), skipped)
        since = sensor.times[skipped] / prepared.step - last
        whole = round(since) if abs(since - round(since)) < 1e-6 else math.floor(since)
        whole = max(whole - math.ceil(late / prepared.step), 0)
        rest = (since - whole) * prepared.step
        even = bool(np.isclose(two.step, prepared.step, rtol=1e-9, atol=0.0))
        seen.append(Seen(*one, even, bool(late or abs(rest) > 1e-9 * prepared.step), which))
        before = _bits(whole, LENGTH)
        channels.append(two._replace(first=np.array(rest), before=before, noise=noise[index]))
    ordered = [model.entries[i] for i in (*starts, *offsets)]
    scale = np.array([e.scale for e in ordered])
    best = fit.x[[*starts, *offsets]]
    kind = Coast(
        plant,
        tuple(seen),
        last - first,
        tuple(links[i] for i in starts),
        tuple(links[i] - plant.slots["offset"].start for i in offsets),
        tuple(links[i] - plant.slots["drive"].start for _, i in common),
        count,
    )
    return kind, CoastData(
        z,
        scatter,
        np.array(prepared.step),
        _bits(first, LENGTH),
        prepared.inputs[first : last + 1],
        tuple(channels),
        scale,
        np.append(np.array([e.center for e in ordered]) / scale - best, np.zeros(count)),
        np.append(scale / np.array([e.prior for e in ordered]), np.ones(count)),
        np.array([model.entries[i].scale for _, i in common]),
        np.array([n for n, _ in common], dtype=int),
    )


def _felt(allowance: Allowance | None, index: int) -> tuple[int, ...]:
    """Numbers of an allowance that one sensor feels."""
    if allowance is None:
        return ()
    block = allowance.columns[index]
    return tuple(int(i) for i in np.flatnonzero(np.any(block != 0.0, axis=0)))


def _series(
    sensor: Sensor, allowance: Allowance | None, index: int, which: Sequence[int]
) -> np.ndarray:
    """Samples, and columns of the allowance in units of their priors, shape (1 + felt, n)."""
    rows = [sensor.values]
    if allowance is not None:
        rows += [allowance.columns[index][:, i] * allowance.priors[i] for i in which]
    return np.array(rows)


def _late(fit: Fit, prepared: Prepared, index: int) -> float:
    """Time that must have passed before a sensor that may be late is believed [s]."""
    links, plant = fit.model.links(prepared), fit.model.plant(prepared)
    for i, at in links:
        if at == plant.slots["delay"].start + index:
            return abs(fit.value(i)) + LATE * min(fit.model.entries[i].prior, fit.std(i))
    return 0.0


def _channel(
    sensor: Sensor, series: np.ndarray, order: int, skipped: int
) -> tuple[tuple[int, int, int], Channel]:
    """Sums of samples with themselves, and their blocks at every lag of the noise law."""
    count = series.shape[1] - order
    blocks = 2 ** math.ceil(math.log2(max(count, BLOCK) / BLOCK))
    lagged = np.array([series[:, order - lag : order - lag + count] for lag in range(order + 1)])
    wide = np.zeros((order + 1, len(series), blocks * BLOCK))
    wide[..., :count] = lagged
    products = np.einsum("isn,jtn->ijst", lagged, lagged)
    doublings = round(math.log2(blocks * BLOCK))
    return (order, blocks, doublings), Channel(
        np.array((sensor.times[-1] - sensor.times[skipped]) / (series.shape[1] - 1)),
        np.array(0.0),
        _bits(0, LENGTH),
        _bits(count, doublings + 1).astype(float),
        np.array(float(series.shape[1])),
        wide.reshape(order + 1, len(series), blocks, BLOCK),
        products,
        series[:, :order].T,
        np.zeros(3, dtype=int),
    )


def _bits(number: int, length: int) -> np.ndarray:
    """Binary digits, the lowest first."""
    return np.array([(number >> bit) & 1 for bit in range(length)], dtype=bool)


def are_alike(kind: Coast, several: Sequence[CoastData]) -> bool:
    """Whether records of one kind have all constants and sampling intervals in common."""
    numbers, first = kind.plant.slots["numbers"], several[0]
    return all(
        np.array_equal(one.z[numbers], first.z[numbers])
        and np.array_equal(one.scatter[numbers], first.scatter[numbers])
        and np.isclose(one.step, first.step, rtol=1e-12, atol=0.0)
        and all(
            np.isclose(a.step, b.step, rtol=1e-9, atol=0.0)
            for a, b in zip(one.channels, first.channels, strict=True)
        )
        for one in several
    )


def together(several: Sequence[CoastData]) -> CoastData:
    """Arrays of the records of one kind along a first axis."""
    channels = tuple(
        Channel(*(np.stack(column) for column in zip(*of_one, strict=True)))
        for of_one in zip(*(data.channels for data in several), strict=True)
    )
    columns: Mapping[str, np.ndarray] = {
        name: np.stack([getattr(data, name) for data in several])
        for name in CoastData._fields
        if name != "channels"
    }
    return CoastData(channels=channels, **columns)
