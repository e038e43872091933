"""Which wrist to buy: stiffness and damping on a grid, each design simulated under one drive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..model.drives import Drive
from ..model.exact import exact_outputs, plan_of
from ..model.extended import Acting, acting_laws, law_places, strengths, widths
from ..model.linear import Mechanism, Port
from ..model.motion import respond_batch
from ..model.plant import Plant, numbers_vector
from ..model.respond import law_geometry, simulate

STIFFNESS, DAMPING = "wrist_stiffness", "wrist_damping"

STEPS = 8
"""Steps of the integrator a sample where laws act [-]; half as many give the error."""


@dataclass(frozen=True)
class WristTask:
    """What is asked of a wrist.

    Attributes:
        drive: what moves every design, from rest; its jumps fall on samples.
        times: uniform samples from 0 on, shape (t,) [s].
        window: first and last time that count [s].
        sensor: whose root mean square is to be small.
        stiffness: grid of wrist stiffnesses, ascending, shape (k,) [N m/rad].
        damping: grid of wrist dampings, ascending, shape (c,) [N m s/rad].
    """

    drive: Drive
    times: np.ndarray
    window: tuple[float, float]
    sensor: Port
    stiffness: np.ndarray
    damping: np.ndarray


@dataclass(frozen=True)
class WristMap:
    """Every design of a grid with its score.

    Attributes:
        task: what was asked.
        rms: root mean square of the sensor in the window, shape (k, c) [unit of the sensor].
        error: largest change of it when the integrator's steps are halved; 0 where exact [-].
    """

    task: WristTask
    rms: np.ndarray
    error: float

    @property
    def best(self) -> tuple[int, int]:
        """Row and column of the design with the smallest score [-]."""
        row, column = np.unravel_index(int(np.argmin(self.rms)), self.rms.shape)
        return int(row), int(column)

    @property
    def is_inside(self) -> bool:
        """Whether the best design has neighbors on every side, so that it is a minimum."""
        return all(0 < at < size - 1 for at, size in zip(self.best, self.rms.shape, strict=True))

    def design(self, at: tuple[int, int]) -> dict[str, float]:
        """Stiffness [N m/rad], damping [N m s/rad] and score of one design."""
        row, column = at
        stiffness, damping = self.task.stiffness[row], self.task.damping[column]
        score = self.rms[row, column]
        return {STIFFNESS: float(stiffness), DAMPING: float(damping), "rms": float(score)}


def map_wrists(
    mechanism: Mechanism,
    numbers: Mapping[str, float],
    task: WristTask,
    laws: Iterable[Mapping[str, Any]] = (),
) -> WristMap:
    """Simulate every design of a grid: exactly, or with laws by the implicit integrator.

    Args:
        mechanism: a robot with a flexible wrist.
        numbers: its other numbers by name [SI].
        task: the grid, the drive and the score.
        laws: tables of an extended rig: ``law``, ``place``, ``parameters``; laws of sensors are
            passed over.

    Returns:
        The map.

    Raises:
        ValueError: for a rig without a flexible wrist, a drive that jumps between samples, a law
            that does not fit, or a motion that grows beyond all bounds.

    Source: tests/optimize/test_wrist.py, against `supple.model.motion.respond`.
    """
    is_known = STIFFNESS in mechanism.names and DAMPING in mechanism.names
    if not (is_known and "wrist" in mechanism.law_places()):
        raise ValueError(
            "rig: expected a flexible wrist, found none. Mend: use a model such as 'pinned_wrist'."
        )
    _check_jumps(task)
    acting = acting_laws(laws, mechanism)
    table = _table(mechanism, numbers, task)
    if acting:
        coarse = _score(task, _with_laws(mechanism, table, task, acting, max(STEPS // 2, 1)))
        fine = _score(task, _with_laws(mechanism, table, task, acting, STEPS))
        error = float(np.max(np.abs(coarse / fine - 1.0)))
    else:
        found = respond_batch(mechanism, table, task.drive, task.times, (task.sensor,))
        fine, error = _score(task, found[:, :, 0]), 0.0
    shape = len(task.stiffness), len(task.damping)
    return WristMap(task, fine.reshape(shape), error)


def _check_jumps(task: WristTask) -> None:
    step = float(task.times[1] - task.times[0])
    position = np.asarray(task.drive.edges) / step
    if np.any(np.abs(position - np.round(position)) > 1e-6):
        raise ValueError(
            f"drive: expected jumps on samples, found one {np.max(position % 1):.3g} of a sample "
            "late. Mend: choose a sample_rate of which the pulse is a whole number of samples."
        )


def _table(
    mechanism: Mechanism, numbers: Mapping[str, float], task: WristTask
) -> dict[str, np.ndarray]:
    """Numbers of every design by name, each of shape (designs,); damping runs fastest."""
    count = len(task.stiffness) * len(task.damping)
    table = {name: np.full(count, float(numbers[name])) for name in mechanism.names}
    grid = np.meshgrid(task.stiffness, task.damping, indexing="ij")
    table[STIFFNESS], table[DAMPING] = (axis.ravel() for axis in grid)
    return table


def _score(task: WristTask, samples: np.ndarray) -> np.ndarray:
    low, high = task.window
    inside = (task.times >= low) & (task.times <= high)
    score = np.sqrt(np.mean(samples[:, inside] ** 2, axis=1))
    if not np.all(np.isfinite(score)):
        raise ValueError(
            "designs: expected motions that stay bounded, found one that grows beyond all "
            "numbers. Mend: look for a law or a constant of the wrong sign or size."
        )
    return score


def _with_laws(
    mechanism: Mechanism,
    table: Mapping[str, np.ndarray],
    task: WristTask,
    laws: tuple[Acting, ...],
    steps: int,
) -> np.ndarray:
    """Samples of the sensor, shape (designs, t) [unit of the sensor]."""
    places = law_places(laws)
    names = tuple(dict.fromkeys(one.law.name for one in laws))
    plant = Plant(mechanism, task.drive.ports, (task.sensor,), places, names)
    rows = [{name: values[i] for name, values in table.items()} for i in range(_count(table))]
    z = np.stack([numbers_vector(plant, numbers) for numbers in rows])
    z[:, plant.slots["strengths"]] = strengths(plant, laws)
    rounding = _rounding(plant, z, table, task, laws)
    inputs = jnp.asarray(task.drive.sampled(task.times))
    step = jnp.asarray(task.times[1] - task.times[0])

    def one(vector: jax.Array, corners: jax.Array) -> jax.Array:
        return simulate(plant, steps, vector, inputs, step, corners)[:, 0]

    return np.asarray(jax.jit(jax.vmap(one))(jnp.asarray(z), jnp.asarray(rounding)))


def _count(table: Mapping[str, np.ndarray]) -> int:
    return len(next(iter(table.values())))


def _rounding(
    plant: Plant,
    z: np.ndarray,
    table: Mapping[str, np.ndarray],
    task: WristTask,
    laws: tuple[Acting, ...],
) -> np.ndarray:
    """Widths of each design's corners, from its linear motion, shape (designs, places, 2) [SI]."""
    plan = replace(plan_of(plant.mechanism, task.drive, ()), whole=True)
    n2 = 2 * len(plant.mechanism.coordinates)
    moved = exact_outputs(plan, table, task.drive, task.times)[:, :, :n2]
    own = dict(zip(plant.mechanism.names, z[0, plant.slots["numbers"]], strict=True))
    ends = np.cumsum([len(plant.mechanism.place_rows(place, own)[1]) for place in plant.law_places])
    look = jax.jit(jax.vmap(lambda vector: law_geometry(plant, vector)[:2]))(jnp.asarray(z))
    sizes = []
    for rows in look:
        squares = np.mean(np.einsum("dtz,drz->dtr", moved, np.asarray(rows)[:, :, :n2]) ** 2, 1)
        parts = np.split(squares, ends[:-1], axis=1)
        sizes.append(np.sqrt(np.stack([np.mean(part, axis=1) for part in parts], axis=1)))
    pairs = zip(*sizes, strict=True)
    return np.stack([widths(plant, laws, stretch, rate) for stretch, rate in pairs])


def decide(before: WristMap, after: WristMap) -> dict[str, Any]:
    """What a cause changes: the best wrist without and with it, and the loss when it is ignored.

    Args:
        before: map of the model without the cause.
        after: map of the model with it, over the same grid.

    Returns:
        ``best_before`` and ``best_after`` with stiffness [N m/rad], damping [N m s/rad] and score
        [unit of the sensor], each by its own model; ``loss_if_ignored``: how much larger the score
        of ``best_before`` is than that of ``best_after``, both by the model with the cause [-].
    """
    ignored = after.design(before.best)["rms"]
    best = after.design(after.best)
    return {
        "best_before": before.design(before.best),
        "best_after": best,
        "loss_if_ignored": {"rms": ignored / best["rms"] - 1.0},
    }
