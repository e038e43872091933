"""Planar motions of many designs under one drive, marched side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from . import planar
from .drives import Drive
from .linear import Port
from .motion import TOLERANCE, uniform
from .planar_march import Course, Legs, Plane, begin, legs
from .planar_motion import (
    CHUNK,
    THIRD_ORDER,
    UNSETTLED,
    begun_signals,
    case_of,
    legs_of,
    pushes_of,
    sampled_signals,
    start_of,
    steps_of,
)
from .planar_sensors import planar_samples, track_of
from .robot import Robot
from .shaft import LARGEST_TILT

TILE = 64
"""Designs that are marched at once [-]; the last tile is filled up."""

MOST_REFINEMENT = 16
"""How often the first steps are cut at most, as a factor [-]."""


@dataclass(frozen=True)
class PlanarBatch:
    """What sensors see of many designs in the plane.

    Attributes:
        samples: shape (designs, t, sensors); not a number where a motion cannot be trusted [SI].
        errors: estimated error of each design's worst state as a share of its largest value;
            infinite where it ran away, shape (designs,) [-].
        bends: largest bend of each design's shaft, shape (designs,) [m].
        tilts: largest angle of each design's grip against the collet, shape (designs,) [rad].
        most_bends: bend up to which each shaft is good, shape (designs,) [m].
    """

    samples: np.ndarray
    errors: np.ndarray
    bends: np.ndarray
    tilts: np.ndarray
    most_bends: np.ndarray

    @property
    def trusted(self) -> np.ndarray:
        """Which converged, and bent and tilted no further than is good, shape (designs,) [-]."""
        return _is_trusted(self.errors, self.bends, self.tilts, self.most_bends)


def respond_planar_batch(
    robot: Robot,
    table: Mapping[str, float | np.ndarray],
    drive: Drive,
    times: np.ndarray,
    sensors: tuple[Port, ...],
) -> PlanarBatch:
    """Planar motions of many designs, without laws.

    Args:
        robot: any of the six models.
        table: its numbers by name: one for all, or an array of shape (designs,) [SI].
        drive: what moves every design.
        times: uniform samples from 0 on, at least two [s].
        sensors: what is measured, see `planar_samples`.

    Returns:
        Samples, estimated errors, largest bends and tilts. All designs of a tile have the same
        steps, which are halved until the error that this shows is within `TOLERANCE` for each of
        them or `MOST_REFINEMENT` is reached.

    Raises:
        ValueError: as for `respond_planar`.

    Source: as for `respond_planar`; tests/model/test_planar_batch.py.
    """
    times = uniform(times)
    named = {name: np.asarray(value, float) for name, value in table.items()}
    count = max((value.size for value in named.values()), default=1)
    whole = {name: np.broadcast_to(value, (count,)) for name, value in named.items()}
    samples = np.full((count, len(times), len(sensors)), np.nan)
    errors, bends, tilts = np.full((3, count), np.inf)
    most = planar.most_bend(whole)
    signals, tile = sampled_signals(drive, times), min(TILE, count)
    for low in range(0, count, tile):
        chosen = np.minimum(np.arange(low, low + tile), count - 1)
        designs = [{name: float(v[k]) for name, v in whole.items()} for k in chosen]
        found, *told = _refined(robot, designs, drive, times)
        for lane in range(min(tile, count - low)):
            at = low + lane
            errors[at], bends[at], tilts[at] = (part[lane] for part in told)
            if _is_trusted(errors[at], bends[at], tilts[at], most[at]):
                q, v, a = found[lane]
                track = track_of(q, v, a, signals)
                for index, port in enumerate(sensors):
                    samples[at, :, index] = planar_samples(designs[lane], track, port)
    return PlanarBatch(samples, errors, bends, tilts, most)


def _is_trusted(errors: Any, bends: Any, tilts: Any, most_bends: Any) -> Any:
    return (errors <= TOLERANCE) & (bends <= most_bends) & (tilts <= LARGEST_TILT)


def _refined(
    robot: Robot, designs: list[dict[str, float]], drive: Drive, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities, accelerations (designs, 3, t, 4); errors, bends, tilts (designs,)."""
    cases = [case_of(robot, design, drive, times) for design in designs]
    starts = [start_of(case) for case in cases]
    planes: Plane = jax.tree.map(lambda *x: jnp.stack(x), *(_arrays(c.plane) for c in cases))
    given = (
        jnp.asarray(np.stack([q for q, _ in starts])),
        jnp.asarray(np.stack([v for _, v in starts])),
    )
    run = partial(_march, cases[0].model, planes, *given, drive, times)
    refinement, coarse = 1, run(1)[0]
    at = planar.points_of(designs[0])
    levers = np.array([at.head, 1.0, at.lever, 1.0])
    while True:
        refinement *= 2
        fine, change, *far = run(refinement)
        reach = np.max(np.abs(fine[:, 0]) * levers, axis=(1, 2))[:, None, None]
        worst = np.zeros(len(designs))
        for order in (0, 1):
            size = np.max(np.abs(fine[:, order]), axis=1, keepdims=True)
            size = np.maximum(size, np.maximum(1e-4 * reach / levers, 1e-300))
            off = np.abs(fine[:, order] - coarse[:, order]) / size
            worst = np.maximum(worst, np.max(off, axis=(1, 2)))
        sound = np.isfinite(worst) & (change <= UNSETTLED)
        errors = np.where(sound, worst / THIRD_ORDER, np.inf)
        if np.all(errors <= TOLERANCE) or refinement >= MOST_REFINEMENT:
            bend, tilt = np.nan_to_num(far, nan=np.inf, posinf=np.inf)
            return fine, errors, bend, tilt
        coarse = fine


def _arrays(plane: Plane) -> Plane:
    return jax.tree.map(lambda x: jnp.asarray(x, float), plane)


def _march(
    model: str,
    planes: Plane,
    q: Any,
    v: Any,
    drive: Drive,
    times: np.ndarray,
    refinement: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Motion (designs, 3, t, 4); largest last change, bend and tilt of the grip (designs,)."""
    starts, kept = steps_of(drive, times, refinement)
    steps, pushes = np.append(np.diff(starts), 0.0), pushes_of(drive, starts)
    course = _begin(model, planes, q, v, jnp.asarray(begun_signals(drive)))
    tables, (change, bend, tilt) = [], np.zeros((3, len(q)))
    p = {name: np.asarray(number)[:, None] for name, number in planes.numbers.items()}
    for low in range(0, len(starts), CHUNK):
        part = slice(low, min(low + CHUNK, len(starts)))
        ahead = legs_of(drive, starts[part], steps[part], pushes[part])
        course, found = _legs(model, planes, course, ahead)
        here = part.stop - low
        at, rate, acceleration, moved = (np.asarray(each)[:, :here] for each in found)
        bent = np.abs(planar.bend(p, np.moveaxis(at, 2, 0)))
        bend = np.maximum(bend, np.max(np.nan_to_num(bent, nan=np.inf), axis=1))
        turned = np.nan_to_num(np.abs(at[:, :, 2]), nan=np.inf)
        tilt = np.maximum(tilt, np.max(turned, axis=1))
        change = np.maximum(change, np.max(np.nan_to_num(moved, nan=np.inf), axis=1))
        own = (kept >= low) & (kept < part.stop)
        tables.append(np.stack([at, rate, acceleration], axis=1)[:, :, kept[own] - low])
    return np.concatenate(tables, axis=2), change, bend, tilt


@partial(jax.jit, static_argnums=0)
def _begin(model: str, planes: Plane, q: Any, v: Any, u: Any) -> Course:
    return jax.vmap(lambda plane, q, v: begin(model, (), plane, q, v, u))(planes, q, v)


@partial(jax.jit, static_argnums=0)
def _legs(model: str, planes: Plane, courses: Course, ahead: Legs) -> tuple[Course, Any]:
    many = jax.vmap(lambda plane, course: legs(model, (), plane, course, ahead))
    return many(planes, courses)
