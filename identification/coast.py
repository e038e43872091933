"""What a record tells that nothing drives where it is seen: its sums in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..model.acting import space_of
from ..model.linear import Array, discretize
from ..model.plant import Plant

BLOCK = 64
"""Samples of a block: responses are made for one block, and carried on to the others."""

DOUBLINGS = round(math.log2(BLOCK))


@dataclass(frozen=True)
class Seen:
    """What is static of one sensor.

    Attributes:
        order: of its noise law, 0 to 2 [-].
        blocks: of its samples, a power of two [-].
        doublings: after which all of its samples are seen [-].
        on_grid: whether its samples are as far apart as those of the inputs.
        late: whether its delay is unknown, or it begins between samples of the inputs.
        extra: which allowances it feels.
    """

    order: int
    blocks: int
    doublings: int
    on_grid: bool
    late: bool
    extra: tuple[int, ...]


@dataclass(frozen=True)
class Coast:
    """What records must share to be told by one compiled batch.

    Attributes:
        plant: what moves, without laws.
        seen: of each sensor.
        pushed: steps during which inputs act, before anything is seen [-].
        starts: elements of z that hold its own unknown start states.
        offsets: sensors with an unknown offset of their own.
        drives: inputs with an unknown zero that all records share.
        allowances: numbers that are summed out [-].
        alike: whether all records have all constants in common.
    """

    plant: Plant
    seen: tuple[Seen, ...]
    pushed: int
    starts: tuple[int, ...]
    offsets: tuple[int, ...]
    drives: tuple[int, ...]
    allowances: int
    alike: bool = False

    @property
    def shared(self) -> bool:
        """Whether there are numbers that all records share and the response is linear in."""
        return bool(self.drives)


class Channel(NamedTuple):
    """One sensor's samples; a first axis is the record. Not seen by users."""

    step: Any
    first: Any
    before: Any
    bits: Any
    count: Any
    series: Any
    products: Any
    opening: Any
    noise: Any


class CoastData(NamedTuple):
    """Arrays of the records of one kind; the first axis is the record. Not seen by users."""

    z: Any
    scatter: Any
    step: Any
    before: Any
    inputs: Any
    channels: tuple[Channel, ...]
    scale: Any
    center: Any
    rate: Any
    shared_scale: Any
    shared_at: Any


class Carried(NamedTuple):
    """How one sensor sees a motion go on: by powers of two of its samples. Not seen by users."""

    row: Any
    powers: Any
    grams: Any
    rows: Any


class Way(NamedTuple):
    """What records share that have all constants in common. Not seen by users."""

    motion: tuple[Any, Any]
    transition: Any
    nodes: tuple[Any, Any]
    carried: tuple[Carried, ...]


def coasted(kind: Coast, value: Array, known: Array, data: CoastData) -> tuple[Array, Array, Array]:
    """What records of one kind tell.

    Args:
        kind: static.
        value: unknowns [SI].
        known: the same, and a zero behind them.
        data: of the records; the first axis is the record.

    Returns:
        For each record log density, push on and information of numbers that all records share;
        its own start states, offsets and allowances are integrated, as departures from the fit.
    """

    def way(one: CoastData) -> Way:
        return _way(kind, one.z + one.scatter @ value, one)

    def told(one: CoastData, along: Way) -> tuple[Array, Array, Array]:
        return _told(kind, along, value, known, one)

    if not kind.alike:
        return jax.vmap(told)(data, jax.vmap(way)(data))
    first = jax.tree.map(lambda leaf: leaf[0], data)
    return jax.vmap(told, in_axes=(0, None))(data, way(first))


def _way(kind: Coast, z: Array, data: CoastData) -> Way:
    """How a motion goes on from sample to sample of the grid, and of each sensor."""
    space, drives = space_of(kind.plant, z), jnp.array(kind.drives, dtype=int)
    free, parts = discretize(space.a, space.b, data.step, 2)
    transition = _with_drives(free, parts[0][:, drives])
    carried = []
    for index, (seen, channel) in enumerate(zip(kind.seen, data.channels, strict=True)):
        row = jnp.concatenate([space.c[index], space.d[index, drives], jnp.ones(1)])
        own = transition if seen.on_grid else _grown((space.a, space.b[:, drives]), channel.step)
        carried.append(_carried(seen, row, _with_one(own)))
    later = parts[1] / data.step
    return Way((space.a, space.b[:, drives]), transition, (parts[0] - later, later), tuple(carried))


def _told(
    kind: Coast, way: Way, value: Array, known: Array, data: CoastData
) -> tuple[Array, Array, Array]:
    z = data.z + data.scatter @ value
    columns = _begun(kind, way, z, data)
    whole, total = jnp.zeros(()), jnp.zeros(())
    for index in range(len(kind.seen)):
        gram, size = _channel(kind, index, way, z, columns, known, data)
        whole, total = whole + gram, total - size
    log, push, information = eliminated(whole, data.rate, data.center)
    scale = data.shared_scale
    return total + log, push * scale, information * scale[:, None] * scale


def eliminated(whole: Array, rate: Array, center: Array) -> tuple[Array, Array, Array]:
    """Integrate a record's own numbers out of the products of its whitened columns.

    Args:
        whole: products of own columns, columns of shared numbers, and gap, in this order.
        rate: of the own numbers' priors, inverse standard deviations.
        center: their means.

    Returns:
        Log density up to a constant, push on the shared numbers, information on them [-].
    """
    own, prior = len(rate), rate**2
    rest = whole[:own, own:].at[:, -1].add(prior * center)
    root = jnp.linalg.cholesky(whole[:own, :own] + jnp.diag(prior))
    half = jax.scipy.linalg.solve_triangular(root, rest, lower=True)
    left = whole[own:, own:] - half.T @ half
    total = -0.5 * left[-1, -1] - jnp.sum(jnp.log(jnp.diag(root)))
    return total - 0.5 * jnp.sum(prior * center**2), left[:-1, -1], left[:-1, :-1]


def _grown(motion: tuple[Array, Array], step: Any) -> Array:
    """Transition of (states, zeros of drives) over a time."""
    free, parts = discretize(*motion, step, 1)
    return _with_drives(free, parts[0])


def _with_drives(free: Array, pushed: Array) -> Array:
    """A transition with the zeros of drives as more states."""
    count = pushed.shape[1]
    low = jnp.concatenate([jnp.zeros((count, len(free))), jnp.eye(count)], axis=1)
    return jnp.concatenate([jnp.concatenate([free, pushed], axis=1), low])


def _begun(kind: Coast, way: Way, z: Array, data: CoastData) -> Array:
    """States and zeros of drives when inputs have fallen silent.

    One column a number, and the last the best of them, shape (states + drives, numbers + 1).
    """
    plant, drives = kind.plant, len(kind.drives)
    first = plant.slots["start"].start
    unit = jnp.eye(plant.n_states + drives)
    at = [i - first for i in kind.starts] + [plant.n_states + i for i in range(drives)]
    zeros = z[plant.slots["drive"]][jnp.array(kind.drives, dtype=int)]
    best = jnp.concatenate([z[plant.slots["start"]], zeros])
    columns = jnp.concatenate([unit[:, jnp.array(at, dtype=int)], best[:, None]], axis=1)
    columns = _after(way.transition, columns, data.before)
    if not kind.pushed:
        return columns
    early, late = way.nodes
    held = jnp.array([port.held for port in plant.inputs])
    then = jnp.where(held, data.inputs[:-1], data.inputs[1:])
    pushes = data.inputs[:-1] @ early.T + then @ late.T
    pushes = jnp.pad(pushes, ((0, 0), (0, drives)))

    def advance(now: Array, push: Array) -> tuple[Array, None]:
        return (way.transition @ now).at[:, -1].add(push), None

    return jax.lax.scan(advance, columns, pushes)[0]


def _after(transition: Array, columns: Array, steps: Array) -> Array:
    """States after a number of steps that is told by its binary digits."""
    power = transition
    for bit in range(steps.shape[0]):
        columns = jnp.where(steps[bit], power @ columns, columns)
        power = power @ power
    return columns


def _channel(
    kind: Coast, index: int, way: Way, z: Array, columns: Array, known: Array, data: CoastData
) -> tuple[Array, Array]:
    """Products of one sensor's whitened columns, and the log size of its noise."""
    plant, seen, channel = kind.plant, kind.seen[index], data.channels[index]
    carried, order = way.carried[index], seen.order
    gain = 1.0 + z[plant.slots["gain"]][index]
    offset = z[plant.slots["offset"]][index]
    reached = _after(way.transition, columns, channel.before)
    if seen.late:
        rest = channel.first - z[plant.slots["delay"]][index]
        reached = _grown(way.motion, jnp.maximum(rest, 0.0)) @ reached
    row, transition = carried.row, carried.powers[0]
    std, one, two = (known[channel.noise[i]] for i in range(3))
    states, crossed = _sums(seen, carried, channel)
    phi = (1.0, -one * (1.0 - two), -two)[: order + 1]
    shaped = jnp.zeros_like(transition)
    series = jnp.zeros_like(crossed[0])
    for lag, part in enumerate(phi):
        shaped = shaped + part * jnp.linalg.matrix_power(transition, order - lag)
        series = series + part * crossed[lag]
    series = series @ shaped
    both = sum(
        first * second * channel.products[i, j]
        for i, first in enumerate(phi)
        for j, second in enumerate(phi)
    )
    products = jnp.block([[shaped.T @ states @ shaped, series.T], [series, both]])
    after = jnp.sqrt(1.0 - two**2)
    before = after * jnp.sqrt(1.0 - one**2)
    if order:
        early = jnp.concatenate([row, channel.opening[0]])
        ahead = before * early
        products = products + jnp.outer(ahead, ahead)
        if order > 1:
            later = jnp.concatenate([row @ transition, channel.opening[1]])
            ahead = after * (later - one * early)
            products = products + jnp.outer(ahead, ahead)
    told = _told_by(kind, index, gain * reached, offset, data.scale)
    size = channel.count * jnp.log(std) - jnp.log(before) - jnp.log(after)
    return told.T @ products @ told / std**2, size


def _with_one(transition: Array) -> Array:
    """A transition with the sensor's zero as one more state."""
    return jnp.pad(transition, ((0, 1), (0, 1))).at[-1, -1].set(1.0)


def _carried(seen: Seen, row: Array, transition: Array) -> Carried:
    """Responses to unit states by doubling: what 2 k samples tell is what k tell, twice."""
    rows, power, gram = row[None], transition, jnp.outer(row, row)
    powers, grams = [power], [gram]
    for bit in range(seen.doublings):
        gram = gram + power.T @ gram @ power
        if bit < DOUBLINGS:
            rows = jnp.concatenate([rows, rows @ power])
        power = power @ power
        powers.append(power)
        grams.append(gram)
    return Carried(row, jnp.stack(powers), jnp.stack(grams), rows)


def _sums(seen: Seen, carried: Carried, channel: Channel) -> tuple[Array, Array]:
    """Products of responses to unit states, summed over all samples, and of those with series."""
    size = len(carried.row)
    total, sofar = jnp.zeros((size, size)), jnp.eye(size)
    for bit in range(channel.bits.shape[0]):
        use, power = channel.bits[bit], carried.powers[bit]
        total = total + use * (sofar.T @ carried.grams[bit] @ sofar)
        sofar = jnp.where(use > 0, sofar @ power, sofar)
    found = jnp.einsum("lsbn,nq->lsbq", channel.series, carried.rows)
    for level in range(round(math.log2(seen.blocks))):
        found = found[:, :, 0::2] + found[:, :, 1::2] @ carried.powers[DOUBLINGS + level]
    return total, found[:, :, 0]


def _told_by(kind: Coast, index: int, reached: Array, offset: Array, scale: Array) -> Array:
    """Columns of all numbers in terms of a sensor's first state, its zero and its series."""
    extra = kind.seen[index].extra
    starts, offsets, drives = len(kind.starts), len(kind.offsets), len(kind.drives)
    zero = jnp.array([float(i == index) for i in kind.offsets]) * scale[starts:]
    begun = jnp.pad(reached[:, :starts] * scale[:starts], ((0, 1), (0, 0)))
    still = jnp.zeros((len(reached) + 1, offsets)).at[-1].set(zero)
    common = jnp.pad(reached[:, starts : starts + drives], ((0, 1), (0, 0)))
    best = -jnp.append(reached[:, -1], offset)[:, None]
    open_ = jnp.zeros((len(reached) + 1, kind.allowances))
    above = jnp.concatenate([begun, still, open_, common, best], axis=1)
    below = jnp.zeros((1 + len(extra), above.shape[1])).at[0, -1].set(1.0)
    for number, which in enumerate(extra, 1):
        below = below.at[number, starts + offsets + which].set(1.0)
    return jnp.concatenate([above, below])
