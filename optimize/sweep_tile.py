"""A tile of designs as modes: where each is after the drive's jumps, and its samples by blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..model.drives import ON_SAMPLE, Drive, Hold, check_balance, equilibrium, hold_rows
from ..model.linear import Mechanism, Port, state_space
from ..model.motion import respond_batch
from ..model.planar_batch import respond_planar_batch
from ..model.robot import Robot

BLOCK = 64
"""Samples that one block of powers spans [-]."""

MOST_JUMPS = 16
"""Jumps of a drive up to which its response is put together from modes [-]."""

STILL = 1e-12
"""A pole smaller than this share of the largest is one at rest [-]."""

CANCELS = 1e4
"""Modes this much larger than what they add up to have lost too many digits [-]."""


@dataclass(frozen=True)
class Grid:
    """The samples that count: those of a window.

    Attributes:
        times: all uniform samples from 0 on, shape (t,) [s].
        low: first sample in the window [-].
        high: one past its last sample [-].
    """

    times: np.ndarray
    low: int
    high: int

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return float(self.times[-1]) / (len(self.times) - 1)

    @property
    def count(self) -> int:
        """Samples in the window [-]."""
        return self.high - self.low


@dataclass(frozen=True)
class Segment:
    """A stretch of the window without a jump: decaying modes around a constant.

    Attributes:
        low: its first sample, counted from the window's first [-].
        high: one past its last [-].
        state: modal state around the constant at its first sample, shape (designs, modes) [1].
        force: what acts all along [N or N m].
    """

    low: int
    high: int
    state: np.ndarray
    force: float


@dataclass(frozen=True)
class Tile:
    """Designs side by side, each as its modes.

    Attributes:
        poles: shape (designs, modes) [1/s].
        vectors: displacement rows of each mode, shape (designs, coordinates, modes) [m or rad].
        seen: each mode at each sensor, shape (designs, sensors, modes) [SI unit of the sensor].
        rest: each sensor under a constant unit force, shape (designs, sensors) [SI].
        segments: the window, jump by jump; empty where the response is not made of modes.
        free: modal state that tells which mode carries most, shape (designs, modes) [1].
        duration: how long that state is followed [s].
    """

    poles: np.ndarray
    vectors: np.ndarray
    seen: np.ndarray
    rest: np.ndarray
    segments: tuple[Segment, ...]
    free: np.ndarray
    duration: float

    @property
    def is_whole(self) -> bool:
        """Whether one segment fills the window."""
        return len(self.segments) == 1

    def take(self, chosen: np.ndarray) -> Tile:
        """Some of the designs, in the order of their indices [-]."""
        segments = tuple(
            Segment(one.low, one.high, one.state[chosen], one.force) for one in self.segments
        )
        own = (self.poles, self.vectors, self.seen, self.rest)
        poles, vectors, seen, rest = (array[chosen] for array in own)
        return Tile(poles, vectors, seen, rest, segments, self.free[chosen], self.duration)


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _matrices(
    mechanism: Mechanism,
    inputs: tuple[Port, ...],
    sensors: tuple[Port, ...],
    hold: Hold | None,
    varied: Mapping[str, Any],
    fixed: Mapping[str, Any],
) -> tuple[jax.Array, ...]:
    """A, first column of B and D, C, start and what the hand sees of it, designs leading."""
    n = len(mechanism.coordinates)

    def one(own: Mapping[str, Any]) -> tuple[jax.Array, ...]:
        p = {**fixed, **own}
        space = state_space(mechanism, p, inputs, sensors)
        start, seen = jnp.zeros(n), jnp.zeros(())
        if hold is not None:
            start, _ = equilibrium(mechanism, p, hold)
            seen = hold_rows(mechanism, p, hold)[1] @ start
        b, d = jnp.zeros(2 * n), jnp.zeros(len(sensors))
        if inputs:
            b, d = space.b[: 2 * n, 0], space.d[:, 0]
        return space.a[: 2 * n, : 2 * n], b, space.c[:, : 2 * n], d, start, seen

    return jax.vmap(one)(varied)


def tile_of(
    mechanism: Mechanism,
    varied: Mapping[str, np.ndarray],
    fixed: Mapping[str, float],
    drive: Drive,
    grid: Grid,
    sensors: tuple[Port, ...],
) -> Tile:
    """The modes of some designs, and where the drive's jumps leave them.

    Args:
        mechanism: chain or robot.
        varied: numbers that differ, each of shape (designs,) [SI].
        fixed: the others, one for all [SI].
        drive: what moves every design.
        grid: the samples that count.
        sensors: what is seen.

    Returns:
        The tile; without segments for a drive of joints, of a sine, or of many jumps.

    Raises:
        ValueError: for a release without a balance.

    Source: eigenvectors of the state matrix; tests/optimize/test_sweep.py against an integration
    and `supple.model.motion`.
    """
    found = _matrices(mechanism, drive.ports, sensors, drive.hold, dict(varied), dict(fixed))
    a, b, c, d, start, seen = (np.asarray(one) for one in found)
    if drive.hold is not None:
        check_balance(start, seen, drive.hold)
    n = len(mechanism.coordinates)
    poles, vectors = np.linalg.eig(a)
    poles, vectors = poles.astype(complex, copy=False), vectors.astype(complex, copy=False)
    begin = np.concatenate([start, np.zeros_like(start)], axis=1)
    try:
        both = np.linalg.solve(vectors, np.stack([begin, b], axis=2).astype(complex))
    except np.linalg.LinAlgError:  # two vectors in one: left to the exact response
        both = np.full((*b.shape, 2), np.nan, complex)
    state, push = both[:, :, 0], both[:, :, 1]
    size = np.abs(poles)
    moving = size > STILL * size.max(axis=1, keepdims=True)
    gain = np.where(moving, push / np.where(moving, poles, 1.0), np.nan if drive.port else 0.0)
    looks = c @ vectors
    segments: tuple[Segment, ...] = ()
    if not drive.joints and not drive.frequency and len(drive.edges) <= MOST_JUMPS:
        segments = tuple(_segments(poles, state, gain, drive, grid))
    rest = d - np.real(np.einsum("dsm,dm->ds", looks, gain))
    last = segments[-1] if segments else None
    free = push if last is None else last.state
    duration = grid.count * grid.step if last is None else (last.high - last.low) * grid.step
    return Tile(poles, vectors[:, :n], looks, rest, segments, free, duration)


def _segments(
    poles: np.ndarray, state: np.ndarray, gain: np.ndarray, drive: Drive, grid: Grid
) -> Iterator[Segment]:
    """The stretches between jumps that reach into the window."""
    step = grid.step
    edges = [0.0, *drive.edges]
    levels = [0.0, *drive.levels]
    landings = [int(np.ceil(edge / step - ON_SAMPLE)) for edge in edges] + [grid.high]
    force = 0.0
    for at, (edge, level) in enumerate(zip(edges, levels, strict=True)):
        if at:
            over = np.exp(poles * (edge - edges[at - 1]))
            state = over * (state + gain * force) - gain * force
        force = level
        low, high = max(landings[at], grid.low), min(landings[at + 1], grid.high)
        if low < high:
            left = low * step - edge
            left = 0.0 if abs(left) <= ON_SAMPLE * step else left
            around = np.exp(poles * left) * (state + gain * force)
            yield Segment(low - grid.low, high - grid.low, around, force)


def powers(first: np.ndarray, ratio: np.ndarray, count: int) -> np.ndarray:
    """Geometric sequences, by doubling.

    Args:
        first: shape (...,) [any unit].
        ratio: shape (...,) [1].
        count: terms [-].

    Returns:
        ``first ratio^k`` for k < count, shape (..., count) [unit of `first`].
    """
    found = np.empty((*first.shape, count), complex)
    found[..., 0] = first
    done, jump = 1, ratio
    while done < count:
        more = min(done, count - done)
        np.multiply(found[..., :more], jump[..., None], out=found[..., done : done + more])
        done, jump = done + more, jump * jump
    return found


def samples(tile: Tile, grid: Grid, sensor: int) -> np.ndarray:
    """Exact samples of a sensor in the window.

    Args:
        tile: designs whose response is made of segments.
        grid: the samples that count.
        sensor: which of the tile's sensors [-].

    Returns:
        Shape (designs, samples) [SI unit of the sensor].
    """
    ratio, turn = np.exp(tile.poles * grid.step), np.imag(tile.poles)
    # of two conjugates the first carries twice the real part, the second the imaginary one
    row = np.where(turn < 0, -1j, 1.0)
    column = np.where(turn > 0, 2.0, np.where(turn < 0, 2j, 1.0))
    inside = np.ascontiguousarray(np.real(powers(row, ratio, BLOCK)))
    jump = ratio**BLOCK
    found = []
    for one in tile.segments:
        blocks = -(-(one.high - one.low) // BLOCK)
        starts = powers(column * one.state * tile.seen[:, sensor], jump, blocks)
        columns = np.ascontiguousarray(np.real(starts)).transpose(0, 2, 1)
        part = np.matmul(columns, inside)
        part = part.reshape(len(ratio), -1)[:, : one.high - one.low]
        if one.force:
            part += one.force * tile.rest[:, sensor, None]
        found.append(part)
    return found[0] if len(found) == 1 else np.concatenate(found, axis=1)


def exactly_sampled(
    mechanism: Mechanism,
    numbers: Mapping[str, float],
    varied: Mapping[str, np.ndarray],
    drive: Drive,
    grid: Grid,
    sensors: tuple[Port, ...],
    planar: bool,
) -> np.ndarray:
    """Samples without modes; few shapes are compiled.

    Args:
        mechanism: chain or robot; for planar motions a robot.
        numbers: those of all designs [SI].
        varied: numbers that differ, each of shape (designs,) [SI].
        drive: what moves every design.
        grid: the samples that count.
        sensors: what is seen.
        planar: whether the robot moves in the plane.

    Returns:
        Shape (designs, samples, sensors) [SI]; those of a planar motion that cannot be trusted
        are no numbers.
    """
    count = len(next(iter(varied.values())))
    filled = np.minimum(np.arange(-(-count // 16) * 16), count - 1)
    table = dict(numbers) | {name: values[filled] for name, values in varied.items()}
    if planar:
        assert isinstance(mechanism, Robot), "checked at the door of the rig"
        asked = mechanism, table, drive, grid.times, sensors
        return respond_planar_batch(*asked).samples[:count, grid.low : grid.high]
    found = respond_batch(mechanism, table, drive, grid.times, sensors)
    return found[:count, grid.low : grid.high]


def doubtful(tile: Tile, sensor: int, largest: np.ndarray) -> np.ndarray:
    """Which designs have modes that nearly cancel, as near two equal poles.

    Args:
        tile: designs whose response is made of segments.
        sensor: which of the tile's sensors [-].
        largest: largest magnitude of its samples, shape (designs,) [SI unit of the sensor].

    Returns:
        Shape (designs,), truth values [-].
    """
    sizes = [np.abs(one.state * tile.seen[:, sensor]).sum(axis=1) for one in tile.segments]
    whole = np.max(sizes, axis=0)
    return ~(whole <= CANCELS * largest)


def lowest_bins(tile: Tile, grid: Grid, sensor: int, bins: int) -> np.ndarray:
    """Squared magnitudes of the first bins of the plain spectrum, by geometric sums.

    Args:
        tile: designs with one segment that fills the window.
        grid: the samples that count.
        sensor: which of the tile's sensors [-].
        bins: how many, from the first above zero on [-].

    Returns:
        Shape (designs, bins) [squared unit of the sensor].
    """
    count = grid.count
    ratio = np.exp(tile.poles * grid.step)
    whole = tile.segments[0].state * tile.seen[:, sensor]
    whole = whole * (1.0 - np.exp(tile.poles * (grid.step * count)))
    turns = np.exp(-2j * np.pi * np.arange(1, bins + 1) / count)
    below = 1.0 - ratio[:, :, None] * turns
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.sum(np.divide(whole[:, :, None], below, out=below), axis=1)
    return np.real(found) ** 2 + np.imag(found) ** 2


@dataclass(frozen=True)
class Dominant:
    """The mode of each design that carries most of the squared response.

    Attributes:
        frequency: ``imag(pole) / (2 pi)``; 0 where it is overdamped, shape (designs,) [Hz].
        decay: ``-real(pole)``, shape (designs,) [1/s].
        shape: its displacement part to unit length, shape (designs, coordinates) [1].
        decrement: ``2 pi zeta / sqrt(1 - zeta^2)`` of the oscillating mode that carries most;
            infinite where nothing oscillates, shape (designs,) [-].
    """

    frequency: np.ndarray
    decay: np.ndarray
    shape: np.ndarray
    decrement: np.ndarray


def dominant_mode(tile: Tile, scales: np.ndarray, sensor: int = 0) -> Dominant:
    """Which mode carries most of the squared response after the last jump.

    Args:
        tile: the designs.
        scales: weights that make coordinates comparable, shape (coordinates,) [1/m or 1/rad].
        sensor: which of the tile's sensors [-].

    Returns:
        The modes; of a pair of conjugates the one that turns forward.

    Source: energies as in `supple.model.score.modal_decrement`, up to the end of the window.
    """
    share, poles = tile.free * tile.seen[:, sensor], tile.poles
    span = tile.duration
    slow = np.minimum(np.real(poles), -1e-12 * np.maximum(np.abs(poles), 1e-300))
    safe = np.where(np.abs(poles) > 0, poles, -1e-300)
    alone = np.abs(share) ** 2 * -np.expm1(2 * slow * span) / -slow
    beat = np.real(share**2 * -np.expm1(2 * safe * span) / safe)
    turns = np.imag(poles) > 1e-9 * np.abs(poles)
    carried = np.where(turns, alone - beat, np.where(np.imag(poles) < 0, -np.inf, 0.5 * alone))
    carried = np.nan_to_num(carried, nan=-np.inf, posinf=np.inf)
    rows = np.arange(len(poles))
    most = np.argmax(carried, axis=1)
    swings = np.argmax(np.where(turns, carried, -np.inf), axis=1)
    pole, turn = poles[rows, most], np.imag(poles[rows, swings])
    any_turns = turns.any(axis=1)
    decrement = -2 * np.pi * np.real(poles[rows, swings]) / np.where(any_turns, turn, 1.0)
    shape = tile.vectors[rows, :, most] * scales
    shape = shape / np.maximum(np.linalg.norm(shape, axis=1, keepdims=True), 1e-300)
    return Dominant(
        np.where(turns[rows, most], np.imag(pole), 0.0) / (2 * np.pi),
        -np.real(pole),
        shape,
        np.where(any_turns, decrement, np.inf),
    )
