"""Log densities of a batch of points, compiled once: linear numbers are integrated on the way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..model.acting import space_of
from ..model.delay import shift
from ..model.linear import Array, make_step
from ..model.plant import Plant
from ..model.pushed import is_pushed, pushed
from ..model.respond import simulate
from .coast import Coast, CoastData, coasted, eliminated
from .tails import expanded


@dataclass(frozen=True)
class Kind:
    """What records must share to be simulated by one compiled batch.

    Attributes:
        plant: what is simulated.
        substeps: steps of the integrator a sample [-].
        moves: whether more than its start state moves it, so that it has to be marched.
        delayed: whether a channel is late.
        clocked: whether a channel has a clock of its own.
        starts: elements of z that hold its own unknown start states.
        offsets: sensors with an unknown offset of their own.
        shared: what all records share and the response is linear in: (slot, index) each.
        growing: whether noise of a channel grows with its motion.
        heavy: whether noise of a channel has heavy tails.
    """

    plant: Plant
    substeps: int
    moves: bool
    delayed: bool
    clocked: bool
    starts: tuple[int, ...]
    offsets: tuple[int, ...]
    shared: tuple[tuple[str, int], ...]
    growing: bool = False
    heavy: bool = False


class Data(NamedTuple):
    """Arrays of the records of one kind; the first axis is the record. Not seen by users."""

    z: Any
    scatter: Any
    inputs: Any
    step: Any
    widths: Any
    values: Any
    mask: Any
    index: Any
    weight: Any
    noise: Any
    motion: Any
    extra: Any
    scale: Any
    center: Any
    rate: Any
    shared_scale: Any
    shared_at: Any


class Prior(NamedTuple):
    """Transforms and priors of the unknowns, and priors of shared linear numbers, as arrays."""

    kind: Any
    low: Any
    high: Any
    scale: Any
    center: Any
    rate: Any
    jacobian: Any
    shared_center: Any
    shared_rate: Any


@partial(jax.jit, static_argnums=0)
def log_densities(
    kinds: tuple[Kind | Coast, ...], free: Array, prior: Prior, data: tuple[Data | CoastData, ...]
) -> Array:
    """Log density of each point, up to a constant.

    Args:
        kinds: of records (static).
        free: points in coordinates without bounds, shape (n, d) [-].
        prior: transforms and priors.
        data: arrays of the records of each kind.

    Returns:
        Shape (n,) [-].
    """
    return jax.vmap(lambda one: _one(kinds, one, prior, data))(free)


def _one(
    kinds: tuple[Kind | Coast, ...], free: Array, prior: Prior, data: tuple[Data | CoastData, ...]
) -> Array:
    """Log density of one point."""
    value, change = _natural(free, prior)
    pull = jnp.sum(((value - prior.center) * prior.rate) ** 2)
    total = jnp.sum(prior.jacobian * change) - 0.5 * pull
    known = jnp.append(value, 0.0)
    rate = prior.shared_rate
    information = jnp.diag(rate**2)
    push = rate**2 * prior.shared_center
    for kind, several in zip(kinds, data, strict=True):
        parts = _told_by(kind, value, known, several, prior)
        total = total + jnp.sum(parts[0])
        if kind.shared:
            at = several.shared_at
            push = push.at[at].add(parts[1])
            information = information.at[at[:, :, None], at[:, None, :]].add(parts[2])
    if len(rate):
        total = total + _integrated(information, push)
    return total


def _told_by(kind: Kind | Coast, value: Array, known: Array, data: Any, prior: Prior) -> Any:
    """What records tell, in closed form where nothing drives them while they are seen."""
    if isinstance(kind, Coast):
        return coasted(kind, value, known, data)
    return jax.vmap(lambda one: _told(kind, value, known, one, prior))(data)


def _integrated(information: Array, push: Array) -> Array:
    """Log of the integral of a normal density's exponent over all its numbers."""
    root = jnp.linalg.cholesky(information)
    half = jax.scipy.linalg.solve_triangular(root, push, lower=True)
    return 0.5 * jnp.sum(half**2) - jnp.sum(jnp.log(jnp.diag(root)))


def _natural(free: Array, prior: Prior) -> tuple[Array, Array]:
    """Values [SI] of a point, and the log slope of each transform."""
    low, high, scale = prior.low, prior.high, prior.scale
    bounded = prior.kind > 0
    grown = scale * jnp.exp(jnp.where(bounded, free, 0.0))
    share = jax.nn.sigmoid(free)
    value = jnp.select(
        [prior.kind == 0, prior.kind == 1, prior.kind == 2],
        [free * scale, low + grown, high - grown],
        low + (high - low) * share,
    )
    between = jax.nn.log_sigmoid(free) + jax.nn.log_sigmoid(-free)
    change = jnp.select([prior.kind == 0, prior.kind == 3], [0.0 * free, between], free)
    return value, change


def _told(
    kind: Kind, value: Array, known: Array, data: Data, prior: Prior
) -> tuple[Array, Array, Array]:
    """What one record tells: log density, and push on and information of shared numbers.

    Its own start states, offsets and allowances are integrated, as departures from the fit.
    """
    z = data.z + data.scatter @ value
    base, columns = _responses(kind, z, data)
    gap = data.values - base
    offsets = jnp.eye(len(kind.plant.sensors))[jnp.array(kind.offsets, dtype=int)]
    steady = jnp.broadcast_to(offsets.T[:, :, None], (*offsets.T.shape, gap.shape[1]))
    n_starts = len(kind.starts)
    own = jnp.concatenate([columns[:, :n_starts], steady], axis=1) * data.scale[:, None]
    common = columns[:, n_starts:] * data.shared_scale[:, None]
    design = jnp.concatenate([own, data.extra, common, gap[:, None]], axis=1)
    noise, log_size = known[data.noise], jnp.zeros(())
    if kind.growing:
        size = jnp.sqrt(1.0 + (noise[:, 3, None] * data.motion) ** 2)
        log_size = jnp.sum(data.mask * jnp.log(size))
        design = design / size[:, None]
    white, level = jax.vmap(_innovations)(design, data.mask, noise)
    log_size = log_size + jnp.sum(level)
    if kind.heavy:
        at = data.shared_at
        rate = jnp.concatenate([data.rate, prior.shared_rate[at]])
        center = jnp.concatenate([data.center, prior.shared_center[at]])
        whole = expanded(white, data.mask, noise[:, 4], rate, center)
    else:
        whole = jnp.sum(jax.vmap(lambda rows: rows @ rows.T)(white), axis=0)
    log, push, information = eliminated(whole, data.rate, data.center)
    return log - log_size, push, information


def _responses(kind: Kind, z: Array, data: Data) -> tuple[Array, Array]:
    """Prediction, shape (sensors, n), and columns of linear numbers, (sensors, columns, n) [SI]."""
    plant, count = kind.plant, data.inputs.shape[0]
    first = plant.slots["start"].start
    gain = 1.0 + z[plant.slots["gain"]]
    late = z[plant.slots["delay"]] / data.step
    seen = rows = jnp.zeros((len(plant.sensors), 0, count))
    if kind.starts or not kind.moves:
        space = space_of(plant, z)
        seen = _observed(make_step(space, data.step).free[1], space.c, count)
        rows = seen[:, jnp.array(kind.starts, dtype=int) - first]
        rows = _sensed(kind, rows, gain, late)
    if kind.moves:
        base = _simulated(kind, z, data)
    else:
        free = jnp.einsum("snt,n->st", seen, z[plant.slots["start"]])
        base = _sensed(kind, free[:, None], gain, late)[:, 0]
        base = base + z[plant.slots["offset"]][:, None]
    columns = [rows]
    for slot, at in kind.shared:
        if slot == "offset":
            one = jnp.zeros_like(base).at[at].set(1.0)
        else:
            one = _simulated(kind, z.at[at].add(1.0), data) - base
        columns.append(one[:, None])
    return _sampled(kind, base[:, None], data)[:, 0], _sampled(
        kind, jnp.concatenate(columns, axis=1), data
    )


def _simulated(kind: Kind, z: Array, data: Data) -> Array:
    if is_pushed(kind.plant) and not kind.delayed and kind.substeps == 1:
        moved = pushed(kind.plant, z, data.inputs, data.step)
        gain, offset = z[kind.plant.slots["gain"]], z[kind.plant.slots["offset"]]
        return moved * (1.0 + gain[:, None]) + offset[:, None]
    moved = simulate(kind.plant, kind.substeps, z, data.inputs, data.step, data.widths)
    return moved[:, :-1].T


def _observed(transition: Array, outputs: Array, count: int) -> Array:
    """Response of each sensor to each unit start state, shape (sensors, states, count) [SI].

    By doubling: the second half of a response is the first half after the transition over it.
    """
    doublings = max(0, math.ceil(math.log2(count / 8.0)))
    short = -(-count // 2**doublings)
    rows = [outputs]
    for _ in range(short - 1):
        rows.append(rows[-1] @ transition)
    seen = jnp.stack(rows, axis=-1)
    power = jnp.linalg.matrix_power(transition, short)
    for _ in range(doublings):
        later = jnp.einsum("sit,ij->sjt", seen, power)
        seen = jnp.concatenate([seen, later], axis=-1)
        power = power @ power
    return seen[:, :, :count]


def _sensed(kind: Kind, rows: Array, gain: Array, late: Array) -> Array:
    """Responses, shape (sensors, columns, t), as their sensors tell them."""
    if kind.delayed and rows.shape[1]:
        shifted = [shift(own.T, delay).T for own, delay in zip(rows, late, strict=True)]
        rows = jnp.stack(shifted)
    return rows * gain[:, None, None]


def _sampled(kind: Kind, rows: Array, data: Data) -> Array:
    """Responses at each sensor's own samples, shape (sensors, columns, n)."""
    if kind.clocked:
        near = jax.vmap(lambda row, index: row[:, index])(rows, data.index)
        return jnp.einsum("scnk,snk->scn", near, data.weight)
    return rows


def _innovations(design: Array, mask: Array, noise: Array) -> tuple[Array, Array]:
    """Whitened rows of `design`, and the log size of the noise.

    The first two samples have the law's stationary density, later ones its innovations'.
    """
    std, first, second = noise[0], noise[1], noise[2]
    after = jnp.sqrt(1.0 - second**2)
    before = after * jnp.sqrt(1.0 - first**2)
    once = jnp.pad(design, ((0, 0), (1, 0)))[:, :-1]
    twice = jnp.pad(design, ((0, 0), (2, 0)))[:, :-2]
    white = design - first * (1.0 - second) * once - second * twice
    white = white.at[:, 0].set(design[:, 0] * before)
    white = white.at[:, 1].set((design[:, 1] - first * design[:, 0]) * after)
    white = white * (mask / std)
    count = jnp.sum(mask)
    return white, count * jnp.log(std) - jnp.log(before) - jnp.log(after)
