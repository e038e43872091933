"""The linear part of a march: the mechanism with the law rows that act, and one step's matrices."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import jax.numpy as jnp

from .kept import keepable
from .linear import Array, StateSpace, Step, make_step, state_space
from .plant import Plant


@keepable
class ActingRows(NamedTuple):
    """What acts, as data.

    Attributes:
        strengths: strength and shapes of every law on every row, shape (numbers, rows) [SI].
        select: rows in force, shape (rows, all rows) [-].
        widths: rounding of corners in stretch and rate, shape (rows, 2) [SI].
        unused: 1 for rows on which nothing acts, shape (rows,) [-].
        memory: what laws remember at the start, shape (numbers, rows) [SI]; None: as they begin.
    """

    strengths: Any
    select: Any
    widths: Any
    unused: Any
    memory: Any = None


@keepable
class LinearPart(NamedTuple):
    """What the march takes of the mechanism itself: compiled once for whatever laws act.

    Attributes:
        space: state space with the law rows in force [SI].
        matrices: of one step of the integrator [SI].
    """

    space: StateSpace
    matrices: Step


def space_of(plant: Plant, z: Array) -> StateSpace:
    """State space of a plant at z [SI], its own law places as they are."""
    numbers = plant.numbers(z)
    return state_space(plant.mechanism, numbers, plant.marched, plant.sensors, plant.law_places)


def acting_space(bare: Plant, z: Array, acting: ActingRows, pushed: bool = False) -> StateSpace:
    """State space [SI] with the selected law rows; where nothing acts, with unit stiffness.

    Args:
        bare: without law places.
        z: see `Plant` [SI].
        acting: the rows; their strengths are not needed.
        pushed: whether forces on all law rows of the mechanism are further inputs.
    """
    select, count = acting.select, len(bare.inputs)
    if select.shape[0] == 0 and not pushed:
        return space_of(bare, z)
    whole = space_of(replace(bare, law_places=tuple(bare.mechanism.law_places())), z)
    known = whole.b.shape[1] if pushed else count

    def narrow(matrix: Array) -> Array:
        return jnp.concatenate([matrix[:, :known], matrix[:, count:] @ select.T], axis=1)

    return replace(
        whole,
        b=narrow(whole.b),
        d=narrow(whole.d),
        stretch=select @ whole.stretch,
        rate=select @ whole.rate,
        rate_input=jnp.pad(select @ whole.rate_input, ((0, 0), (0, known - count))),
        stiffness=select @ whole.stiffness + acting.unused,
        damping=select @ whole.damping + acting.unused,
    )


def linear_part(
    plant: Plant, substeps: int, z: Array, acting: ActingRows, step: Array, pushed: bool = False
) -> LinearPart:
    """The linear part of a march, see `march_rows` and `acting_space` [SI]."""
    space = acting_space(plant, z, acting, pushed)
    return LinearPart(space, make_step(space, step / substeps))
