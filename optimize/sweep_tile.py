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
from .sweep_growth import by_design, growth, halves, powers
from .sweep_poles import Modes, gain_of, has_minors, modes_of

BLOCK = 64
"""Samples that one block of powers spans [-]."""

MOST_JUMPS = 16
"""Jumps of a drive up to which its response is put together from modes [-]."""

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

    @property
    def is_free(self) -> bool:
        """Whether it is left to itself all along."""
        return self.is_whole and not self.segments[0].force

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

    Source: `modes_of` where it can be asked and is sound, otherwise eigenvectors of the state
    matrix; tests/optimize/test_sweep.py against an integration and `supple.model.motion`.
    """
    told = mechanism, drive.ports, sensors, drive.hold, varied, fixed
    found = None
    if not drive.joints and has_minors(mechanism, tuple(varied)):
        found = modes_of(*told)
    if found is None or not found.sound.all():
        slowly = _eigenvectors(*told)
        found = slowly if found is None else found.completed(slowly)
    if drive.hold is not None:
        check_balance(found.start, found.held, drive.hold)
    segments: tuple[Segment, ...] = ()
    if not drive.joints and not drive.frequency and len(drive.edges) <= MOST_JUMPS:
        segments = tuple(_segments(found, drive, grid))
    last = segments[-1] if segments else None
    free = found.push if last is None else last.state
    duration = grid.count * grid.step if last is None else (last.high - last.low) * grid.step
    return Tile(found.poles, found.vectors, found.seen, found.rest, segments, free, duration)


def _eigenvectors(
    mechanism: Mechanism,
    inputs: tuple[Port, ...],
    sensors: tuple[Port, ...],
    hold: Hold | None,
    varied: Mapping[str, np.ndarray],
    fixed: Mapping[str, float],
) -> Modes:
    """Modes of any designs, by LAPACK."""
    made = _matrices(mechanism, inputs, sensors, hold, dict(varied), dict(fixed))
    a, b, c, d, start, held = (np.asarray(one) for one in made)
    poles, vectors = np.linalg.eig(a)
    poles, vectors = poles.astype(complex, copy=False), vectors.astype(complex, copy=False)
    begin = np.concatenate([start, np.zeros_like(start)], axis=1)
    try:
        both = np.linalg.solve(vectors, np.stack([begin, b], axis=2).astype(complex))
    except np.linalg.LinAlgError:  # two vectors in one: left to the exact response
        both = np.full((*b.shape, 2), np.nan, complex)
    n, sound = len(mechanism.coordinates), np.ones(len(a), bool)
    state, push, seen = both[:, :, 0], both[:, :, 1], c @ vectors
    rest = d - np.real(np.einsum("dsm,dm->ds", seen, gain_of(poles, push)))
    return Modes(poles, vectors[:, :n], seen, state, push, rest, start, held, sound)


def _segments(modes: Modes, drive: Drive, grid: Grid) -> Iterator[Segment]:
    """The stretches between jumps that reach into the window."""
    poles, state, gain = modes.poles, modes.state, modes.gain
    step = grid.step
    edges = [0.0, *drive.edges]
    levels = [0.0, *drive.levels]
    landings = [int(np.ceil(edge / step - ON_SAMPLE)) for edge in edges] + [grid.high]
    force = 0.0
    for at, (edge, level) in enumerate(zip(edges, levels, strict=True)):
        if at:
            over = growth(poles, edge - edges[at - 1])
            state = over * (state + gain * force) - gain * force if force else over * state
        force = level
        low, high = max(landings[at], grid.low), min(landings[at + 1], grid.high)
        if low < high:
            left = low * step - edge
            left = 0.0 if abs(left) <= ON_SAMPLE * step else left
            around = growth(poles, left) * (state + gain * force if force else state)
            yield Segment(low - grid.low, high - grid.low, around, force)


def samples(tile: Tile, grid: Grid, sensor: int) -> np.ndarray:
    """Exact samples of a sensor in the window.

    Args:
        tile: designs whose response is made of segments.
        grid: the samples that count.
        sensor: which of the tile's sensors [-].

    Returns:
        Shape (designs, samples) [SI unit of the sensor].
    """
    ratio, (column, row) = growth(tile.poles, grid.step), halves(tile.poles)
    inside = by_design(powers(row, ratio, BLOCK)).transpose(0, 2, 1)
    jump = ratio**BLOCK
    found = []
    for one in tile.segments:
        blocks = -(-(one.high - one.low) // BLOCK)
        starts = powers(column * one.state * tile.seen[:, sensor], jump, blocks)
        part = np.matmul(by_design(starts), inside)
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
    ratio = growth(tile.poles, grid.step)
    whole = tile.segments[0].state * tile.seen[:, sensor]
    whole = whole * (1.0 - growth(tile.poles, grid.step * count))
    turns = np.exp(-2j * np.pi * np.arange(1, bins + 1) / count)
    below = 1.0 - ratio[:, :, None] * turns
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.sum(np.divide(whole[:, :, None], below, out=below), axis=1)
    return np.real(found) ** 2 + np.imag(found) ** 2
