"""The response of a mechanism: exact for its linear part, implicit exponential where laws act."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .acting import ActingRows, LinearPart, linear_part, space_of
from .kept import kept
from .linear import Array, StateSpace, make_step
from .march import March, march_rows
from .plant import Plant
from .ripple import rippled
from .sensed import read_out
from .told import accelerated
from .varied import Point, is_varied, step_matrices, varied_linear, varied_motion

OLDER = "xla_cpu_use_fusion_emitters=false"
FUSED = {"xla_cpu_use_fusion_emitters": True} if OLDER in os.environ.get("XLA_FLAGS", "") else None
"""How what reads many directions at once is compiled where the package asks for the older emitters:
this alone runs three times as fast by the newer ones."""


@kept((0, 1))
def _simulate(
    bare: Plant,
    substeps: int,
    z: Array,
    acting: ActingRows,
    inputs: Array,
    step: Array,
    linear: LinearPart | None = None,
    pushes: Array | None = None,
) -> tuple[Array, March]:
    bare, z, inputs = _told(bare, z, inputs, step)
    linear = linear_part(bare, substeps, z, acting, step) if linear is None else linear
    motion = march_rows(bare, substeps, z, acting, inputs, step, linear, pushes)
    made = z, acting.strengths, linear, inputs
    outputs = read_out(bare, acting, step, Point(*made), (motion.states, motion.forces), pushes)
    return jnp.concatenate([outputs, motion.defect[:, None]], axis=1), motion


def _told(bare: Plant, z: Array, inputs: Array, step: Array) -> tuple[Plant, Array, Array]:
    """The plant, its z and its inputs as they are marched, see `accelerated`."""
    return accelerated(bare, z, rippled(bare, z[bare.slots["ripple"]], inputs, step), step)


def _split(plant: Plant, z: Any) -> tuple[Any, Any]:
    """The bare plant's z, and the strength of every law on every row; also for directions."""
    xp = jnp if isinstance(z, Tracer) else np
    z = xp.asarray(z)
    own = plant.slots["strengths"]
    bare = xp.concatenate([z[..., : own.start], z[..., own.stop :]], axis=-1)
    return bare, xp.einsum("lrs,...s->...lr", plant.wiring.spread, z[..., own])


def _acting(plant: Plant, strengths: Any, widths: Any) -> ActingRows:
    wiring = plant.wiring
    xp = jnp if isinstance(widths, Tracer) else np
    rounded = wiring.owner @ xp.asarray(widths).reshape(-1, 2) + wiring.unused[:, None]
    return ActingRows(strengths, wiring.select, rounded, wiring.unused)


@kept((0, 1, 6))
def _linear(
    lawless: Plant, substeps: int, z: Array, select: Array, unused: Array, step: Array, pushed: bool
) -> LinearPart:
    return linear_part(lawless, substeps, z, ActingRows(None, select, None, unused), step, pushed)


@kept((0, 1))
def _linear_along(
    lawless: Plant,
    substeps: int,
    z: Array,
    by_z: Array,
    select: Array,
    unused: Array,
    step: Array,
) -> tuple[LinearPart, LinearPart]:
    """The linear part, and its derivatives along directions on a first axis."""

    def at(z: Array) -> LinearPart:
        return _linear(lawless, substeps, z, select, unused, step, False)

    return jax.vmap(lambda by: jax.jvp(at, (z,), (by,)), out_axes=(None, 0))(by_z)


def simulate(
    plant: Plant,
    substeps: int,
    z: Any,
    inputs: Array,
    step: Array,
    widths: Any,
) -> Array:
    """Samples of every sensor.

    Args:
        plant: what is simulated (static).
        substeps: steps of the integrator a sample; 1 is exact where no law acts (static).
        z: all that varies, see `Plant` [SI].
        inputs: sampled inputs, shape (t, inputs) [N, N m, m, ...].
        step: sampling interval [s].
        widths: rounding of corners in (stretch, rate) at each law place, shape (places, 2).

    Returns:
        Shape (t, sensors + 1) [SI]; the last column is what the last Newton step still changed of
        the law forces [N or N m], a measure of the integrator's success. Where a chain's
        ground is driven by its position, a sensor that feels the ground's rate reads the mean of
        the slopes before and after the sample; a robot's joint is driven smoothly, see
        `supple.model.told`.
    """
    bare, strengths = _split(plant, z)
    acting = _acting(plant, strengths, widths)
    return _simulate(*_marched(plant, substeps, bare, acting, inputs, step))[0]


def _marched(
    plant: Plant, substeps: int, z: Any, acting: ActingRows, inputs: Array, step: Any
) -> tuple[Any, ...]:
    """What `_simulate` is called with: where laws act, with the linear part found before."""
    linear = None
    if plant.law_places:
        rows = acting.select, acting.unused
        linear = _linear(plant.lawless, substeps, z, *rows, step, False)
    return plant.bare, substeps, z, acting, inputs, step, linear


def tangents(
    plant: Plant,
    substeps: int,
    z: Any,
    directions: Any,
    inputs: Array,
    step: Array,
    widths: Any,
) -> Array:
    """Derivatives of `simulate` along `directions`, exact, forward mode.

    Args:
        plant: what is simulated (static).
        substeps: steps a sample (static).
        z: point [SI].
        directions: shape (k, size of z).
        inputs: as for `simulate`.
        step: sampling interval [s].
        widths: as for `simulate`.

    Returns:
        Shape (k, t, sensors) [SI per unit of direction].
    """
    bare, strengths = _split(plant, z)
    acting = _acting(plant, strengths, widths)
    by_z, by_strength = _split(plant, directions)
    rows = acting.select, acting.unused
    linear, by_linear = _linear_along(plant.lawless, substeps, bare, by_z, *rows, step)
    by = by_z, by_strength, by_linear
    given = acting, inputs, step, linear
    if not plant.law_places or is_varied(plant.bare):
        return _varied(plant.bare, substeps, bare, by, *given)
    return _tangents(plant.bare, substeps, bare, by, *given)


@kept((0, 1))
def _tangents(
    bare: Plant,
    substeps: int,
    z: Array,
    directions: tuple[Array, Array, LinearPart],
    acting: ActingRows,
    inputs: Array,
    step: Array,
    linear: LinearPart,
) -> Array:
    """Derivatives through every operation of the march."""

    def outputs(z: Array, strengths: Array, linear: LinearPart) -> Array:
        now = acting._replace(strengths=strengths)
        return _simulate(bare, substeps, z, now, inputs, step, linear)[0][:, :-1]

    def along(*by: Any) -> Array:
        return jax.jvp(outputs, (z, acting.strengths, linear), by)[1]

    return jax.vmap(along)(*directions)


def _varied(
    bare: Plant,
    substeps: int,
    z: Array,
    directions: tuple[Array, Array, LinearPart],
    acting: ActingRows,
    inputs: Array,
    step: Array,
    linear: LinearPart,
) -> Array:
    """As `_tangents`, by the march's own variational equation: several times less to compute."""
    by_z, by_strength, by_linear = directions
    told, by_told = _told_along(bare, z, by_z, inputs, step)
    at = Point(told[0], acting.strengths, linear, told[1])
    along = Point(by_told[0], by_strength, by_linear, by_told[1])
    plant = replace(bare, inputs=bare.marched)
    if not acting.select.shape[0]:
        if substeps != 1:
            raise ValueError("a linear motion needs one step a sample; expected substeps = 1")
        motion, by_motion = varied_linear(plant, at, along, step)
        return _read_along(plant, acting, step, at, motion, along, by_motion)
    known = step_matrices(plant, substeps, at, acting, step)
    by_motion = varied_motion(plant, substeps, at, along, acting, step, known)
    return _read_along(plant, acting, step, at, known.motion, along, by_motion)


@kept((0,))
def _told_along(bare: Plant, z: Array, by_z: Array, inputs: Array, step: Array) -> Any:
    """What varies and the inputs as they are marched, and how they move along directions."""

    def told(z: Array) -> tuple[Array, Array]:
        return _told(bare, z, inputs, step)[1:]

    return told(z), jax.vmap(lambda by: jax.jvp(told, (z,), (by,))[1])(by_z)


@kept((0,), FUSED)
def _read_along(
    plant: Plant, acting: ActingRows, step: Array, at: Point, motion: Any, *along: Any
) -> Array:
    """How what the sensors tell moves, shape (k, t, sensors) [SI]."""

    def read(at: Point, motion: tuple[Array, Array]) -> Array:
        return read_out(plant, acting, step, at, motion)

    return jax.vmap(lambda *by: jax.jvp(read, (at, motion), by)[1])(*along)


def still_tangents(plant: Plant, z: Any, directions: Any, inputs: Array, step: Array) -> Array:
    """As `tangents` where no law acts, along directions that hold the mechanism's numbers.

    What starts, is offset, or misread moves through matrices that stay: far less to compute than
    where they move too.

    Args:
        plant: what is simulated, without law places (static).
        z: point [SI].
        directions: shape (k, size of z); the mechanism's numbers are not moved, whatever these say.
        inputs: as for `simulate`.
        step: sampling interval [s].

    Returns:
        Shape (k, t, sensors) [SI per unit of direction].

    Source: tests/model/test_respond.py (`tangents`).
    """
    bare, strengths = _split(plant, z)
    acting = _acting(plant, strengths, np.zeros((0, 2)))
    rows = acting.select, acting.unused
    linear = _linear(plant.lawless, 1, bare, *rows, step, False)
    by_z = np.array(_split(plant, directions)[0])
    by_z[:, plant.bare.slots["numbers"]] = 0.0
    return _still(plant.bare, bare, by_z, acting, inputs, step, linear)


@kept((0,))
def _still(
    bare: Plant,
    z: Array,
    directions: Array,
    acting: ActingRows,
    inputs: Array,
    step: Array,
    linear: LinearPart,
) -> Array:
    def outputs(z: Array) -> Array:
        return _simulate(bare, 1, z, acting, inputs, step, linear)[0][:, :-1]

    return jax.vmap(lambda by: jax.jvp(outputs, (z,), (by,))[1])(directions)


def pushed_tangents(
    plant: Plant,
    substeps: int,
    z: Any,
    pushes: Array,
    inputs: Array,
    step: Array,
    widths: Any,
) -> Array:
    """Derivatives of `simulate` by forces at law places, which are none.

    About a motion under laws this is what one more law would change, while its strength is still
    nothing: all of them share one program.

    Args:
        plant: what is simulated; laws act on it (static).
        substeps: steps a sample (static).
        z: point [SI].
        pushes: forces that resist every law row of the mechanism, its law places in their order,
            linear between samples, shape (k, t, all law rows) [N or N m].
        inputs: as for `simulate`.
        step: sampling interval [s].
        widths: as for `simulate`.

    Returns:
        Shape (k, t, sensors) [SI per unit of `pushes`].

    Source: tests/model/test_pushed_tangents.py (differences of a law's strength).
    """
    bare, strengths = _split(plant, z)
    acting = _acting(plant, strengths, widths)
    rows = acting.select, acting.unused
    linear = _linear(plant.lawless, substeps, bare, *rows, step, True)
    return _pushed(plant.bare, substeps, bare, acting, inputs, step, linear, pushes)


@kept((0, 1))
def _pushed(
    bare: Plant,
    substeps: int,
    z: Array,
    acting: ActingRows,
    inputs: Array,
    step: Array,
    linear: LinearPart,
    pushes: Array,
) -> Array:
    def outputs(push: Array) -> Array:
        return _simulate(bare, substeps, z, acting, inputs, step, linear, push)[0][:, :-1]

    none = jnp.zeros(pushes.shape[1:])
    return jax.vmap(lambda push: jax.jvp(outputs, (none,), (push,))[1])(pushes)


def state_history(
    plant: Plant,
    substeps: int,
    z: Array,
    inputs: Array,
    step: Any,
    widths: Array,
    memory: Any = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A motion with its inside; see `simulate`.

    Args:
        plant: what is simulated (static).
        substeps: steps of the integrator a sample (static).
        z: all that varies, see `Plant` [SI].
        inputs: sampled inputs, shape (t, inputs) [SI].
        step: sampling interval [s].
        widths: rounding of corners at each law place, shape (places, 2) [SI].
        memory: what laws remember of a run before; None where there was none.

    Returns:
        States (t, states), law forces (t, law rows) [SI], and what laws remember at the end.
    """
    bare, strengths = _split(plant, z)
    acting = _acting(plant, strengths, widths)._replace(memory=memory)
    _, motion = _simulate(*_marched(plant, substeps, bare, acting, inputs, jnp.asarray(step)))
    forces = np.asarray(motion.forces)[:, : plant.rows]
    return np.asarray(motion.states), forces, np.asarray(motion.memory)


@kept((0,))
def law_geometry(plant: Plant, z: Array) -> tuple[Array, Array, Array]:
    """Rows that turn states and inputs into stretches and rates of the law places.

    Args:
        plant: its law places are meant (static).
        z: see `Plant` [SI].

    Returns:
        stretch (law rows, states) [1 or m], rate (law rows, states) [1 or m], and what a moving
        ground adds to the rate (law rows, inputs) [1].
    """
    space = space_of(plant, z)
    return space.stretch, space.rate, space.rate_input


@kept((0,))
def force_responses(plant: Plant, z: Array, forces: Array, step: Array) -> Array:
    """Linear response of the sensors to forces at the law places, from rest.

    Args:
        plant: its law places say where the forces act, its laws are not in force (static).
        z: point of linearization, see `Plant` [SI].
        forces: resisting forces, linear between samples, shape (k, t, law rows) [N or N m].
        step: sampling interval [s].

    Returns:
        Shape (k, t, sensors) [SI].
    """
    space, states = _forced(plant, z, forces, step)
    return states @ space.c.T + forces @ space.d[:, len(plant.inputs) :].T


@kept((0,))
def forced_motion(plant: Plant, z: Array, forces: Array, step: Array) -> tuple[Array, Array]:
    """Stretch and rate of the law rows under forces there, from rest; as `force_responses`.

    Args:
        plant: its law places say where the forces act (static).
        z: point of linearization [SI].
        forces: shape (k, t, law rows) [N or N m].
        step: sampling interval [s].

    Returns:
        Two of shape (k, t, law rows) [m or rad, and a second].
    """
    space, states = _forced(plant, z, forces, step)
    return states @ space.stretch.T, states @ space.rate.T


def _forced(plant: Plant, z: Array, forces: Array, step: Array) -> tuple[StateSpace, Array]:
    """States under forces at the law places, from rest, shape (k, t, states)."""
    space = space_of(plant, z)
    matrices = make_step(space, step)
    start, middle, end = (node[:, len(plant.inputs) :] for node in matrices.nodes[1])
    pushes = forces[:, :-1] @ (start + 0.5 * middle).T + forces[:, 1:] @ (end + 0.5 * middle).T

    def advance(x: Array, push: Array) -> tuple[Array, Array]:
        new = x @ matrices.free[1].T + push
        return new, new

    rest = jnp.zeros((forces.shape[0], plant.n_states))
    _, states = jax.lax.scan(advance, rest, jnp.swapaxes(pushes, 0, 1))
    return space, jnp.swapaxes(jnp.concatenate([rest[None], states]), 0, 1)
