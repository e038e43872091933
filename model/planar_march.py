"""The planar robot marched over steps of any length: cut where its drive jumps, laws remembered."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from . import planar
from .kept import keepable, kept
from .lagrange import Acting, Array, Past, PlanarPlant
from .radau import NODES, Numbers, at_stages, continued, iteration_matrix, one_step

LEAST = 1.0
"""Accelerations below this are not told apart when a step is settled [m/s^2 or rad/s^2]."""

IDLE = 1e-9
"""What a step of no length counts as where something is divided by it [s]."""


@keepable
class Plane(NamedTuple):
    """The numbers of one planar robot, as data.

    Attributes:
        numbers: by contract name, each of shape () [SI].
        pull: gravity in the plane, towards the ball [m/s^2].
        strengths: of the laws in force, shape (laws,) [SI].
        widths: rounding of their corners in stretch and rate, shape (laws, 2) [SI].
        shapes: their further numbers [SI].
    """

    numbers: Mapping[str, Any]
    pull: Any
    strengths: Any
    widths: Any
    shapes: tuple[tuple[Any, ...], ...]


@keepable
class Course(NamedTuple):
    """Where a march stands; n of the coordinates move.

    Attributes:
        q: coordinates that move, shape (n,) [SI].
        v: their rates, shape (n,) [SI].
        stages: accelerations at the stages of the last step, shape (n, 3) [SI].
        before: length of that step [s].
        scale: largest accelerations so far, shape (n,) [SI].
        memory: what laws remember, one array of shape (numbers,) a law and row.
    """

    q: Any
    v: Any
    stages: Any
    before: Any
    scale: Any
    memory: tuple[Any, ...]


@keepable
class Legs(NamedTuple):
    """What drives some steps.

    Attributes:
        steps: their lengths; nothing happens in one of 0 but its push, shape (steps,) [s].
        signals: arm and wrist angle, their rates, the arm's acceleration, torque on the collet,
            force on clubhead and grip across the collet's axis, at the start and at the three
            stages of each step, shape (steps, 8, 4) [SI].
        pushes: jumps at the start of each step: of the arm's rate, of the wrist drive's angle,
            shape (steps, 2) [rad/s, rad].
    """

    steps: Any
    signals: Any
    pushes: Any


def plant_of(model: str, acting: tuple[Acting, ...], plane: Plane) -> PlanarPlant:
    """Lagrange's equations of a model with laws, of the numbers of `plane` [SI]."""
    return PlanarPlant(
        model, acting, plane.numbers, plane.pull, plane.strengths, plane.widths, plane.shapes
    )


@kept((0, 1))
def begin(
    model: str, acting: tuple[Acting, ...], plane: Plane, q: Array, v: Array, u: Array
) -> Course:
    """The course at its start.

    Args:
        model: one of `lagrange.MODELS` (static).
        acting: laws in force (static).
        plane: the numbers.
        q: coordinates, shape (4,) [SI].
        v: their rates, shape (4,) [SI].
        u: signals at the start, shape (8,) [SI].

    Returns:
        The course; laws that remember have been loaded slowly from rest.
    """
    plant, free = plant_of(model, acting, plane), slice(int(model == "fixed_collet"), 4)
    signals = _signals(plant, u)
    memory = tuple(
        plant.remember(which, *plant.stretches(which[1], tuple(q), tuple(v), signals), None)
        for which in plant.remembered
    )
    n = free.stop - free.start
    return Course(q[free], v[free], jnp.zeros((n, 3)), 0.0 * u[0], jnp.full(n, LEAST), memory)


@kept((0, 1))
def legs(
    model: str, acting: tuple[Acting, ...], plane: Plane, course: Course, ahead: Legs
) -> tuple[Course, tuple[Array, Array, Array, Array]]:
    """March some steps.

    Args:
        model: one of `lagrange.MODELS` (static).
        acting: laws in force (static).
        plane: the numbers.
        course: where the march stands.
        ahead: the steps.

    Returns:
        The course after them; and at the start of each step, after its push: positions,
        velocities and accelerations, shape (steps, 4) each [SI], and the last change of an
        acceleration when the step was settled, shape (steps,) [-].

    Source: Hairer and Wanner 1996, section IV.8; tests/model/test_planar_motion.py.
    """
    plant = plant_of(model, acting, plane)
    return jax.lax.scan(partial(_advance, plant), course, ahead)


def _advance(plant: PlanarPlant, course: Course, leg: Legs) -> tuple[Course, tuple[Array, ...]]:
    """One step, and what was at its start."""
    h, q = leg.steps, course.q
    start, stages = _signals(plant, leg.signals[:, 0]), _signals(plant, leg.signals[:, 1:])
    v, bend = _pushed(plant, course, start, leg.pushes)
    length = jnp.where(h > 0, h, IDLE)
    ratio = jnp.minimum(h / jnp.maximum(course.before, IDLE), 1.0)
    # as the last step went on, from where this one truly starts
    guess = continued(course.stages, ratio) + (bend - course.stages[:, 2])[:, None]
    at, rate = at_stages(q, v, guess, h)
    entries = _entries(plant, course, v, start)
    last = tuple(x[..., 2] for x in stages)
    inverse = _inverse(plant, (at[:, 2], rate[:, 2], last), Past(entries, length), h)
    known = (*plant.ready(tuple(at)), Past(entries, length * jnp.asarray(NODES)))

    def imbalance(q: Array, v: Array, a: Array) -> Array:
        return jnp.stack(plant.imbalance(tuple(q), tuple(v), tuple(a), stages, known))

    end, v_end, a, change = one_step(imbalance, q, v, guess, h, inverse, course.scale)
    seen = tuple(jnp.stack(plant.whole(tuple(part))) for part in (q, v, bend))
    after = Course(
        end, v_end, a, jnp.where(h > 0, h, course.before),
        jnp.maximum(course.scale, jnp.max(jnp.abs(a), axis=1)),
        _remembered(plant, (end, v_end, last), Past(entries, length), h > 0),
    )  # fmt: skip
    return after, (*seen, change)


def _signals(plant: PlanarPlant, given: Array) -> Numbers:
    """Signals as the plant takes them, out of those of `Legs`, shape (8, ...) [SI]."""
    u = given
    down, side = planar.pivot_acceleration(plant.p, (u[0], u[2], u[4]), plant.pull, jnp)
    return (u[0], u[1], u[2], u[3], down, side, u[5], u[6], u[7])


def _inverse(
    plant: PlanarPlant, state: tuple[Array, Array, Numbers], past: Past, step: Array
) -> Array:
    """Of the stage equations about a state, shape (n, n, 3, 3); all slopes in one go."""
    q, v, u = state
    n, known = len(q), (*plant.ready(tuple(q)), past)

    def left(q: Array, v: Array, a: Array) -> Array:
        return jnp.stack(plant.imbalance(tuple(q), tuple(v), tuple(a), u, known))

    def slope(unit: Array) -> Array:
        return jax.jvp(left, (q, v, jnp.zeros(n)), tuple(unit.reshape(3, n)))[1]

    k, c, m = jax.vmap(slope)(jnp.eye(3 * n)).reshape(3, n, n).transpose(0, 2, 1)
    return iteration_matrix(m, c, k, step)


def _entries(plant: PlanarPlant, course: Course, v: Array, u: Numbers) -> tuple[Any, ...]:
    """What each law that remembers knows, with stretch and rate at the start of a step."""
    q, rate = plant.whole(tuple(course.q)), plant.whole(tuple(v))
    return tuple(
        (memory, plant.stretches(which[1], q, rate, u))
        for which, memory in zip(plant.remembered, course.memory, strict=True)
    )


def _remembered(
    plant: PlanarPlant, end: tuple[Array, Array, Numbers], past: Past, moves: Array
) -> tuple[Any, ...]:
    """What laws remember at the end of a step."""
    q, v, u = plant.whole(tuple(end[0])), plant.whole(tuple(end[1])), end[2]
    return tuple(
        jnp.where(moves, plant.remember(which, *plant.stretches(which[1], q, v, u), past), old)
        for which, (old, _) in zip(plant.remembered, past.entries, strict=True)
    )


def _pushed(plant: PlanarPlant, course: Course, u: Numbers, push: Array) -> tuple[Array, Array]:
    """Velocities after a push, and the accelerations then, shape (n,) each [SI].

    A joint that starts dead gives the masses an impulse; a wrist drive whose angle leaps gives
    one through its damper.
    """
    q, p, n = tuple(course.q), plant.p, len(course.q)
    known, still = plant.ready(q), (jnp.zeros(()),) * len(course.q)

    def inertia(a: Numbers, pivot: tuple[Array, Array]) -> Array:
        at, rate, bend = (plant.whole(part) for part in (q, still, a))
        return jnp.stack(plant.kept(planar.inertia_forces(p, at, rate, bend, pivot, known[1:])))

    mass = jax.vmap(lambda a: inertia(tuple(a), (still[0], still[0])))(jnp.eye(n)).T
    turn = p["arm_length"] * push[0]
    impulse = -inertia(still, (-turn * jnp.sin(u[0]), turn * jnp.cos(u[0])))
    if plant.wrist:
        impulse = impulse.at[0].add(p["wrist_damping"] * push[1])
    inverse = jnp.linalg.inv(mass)
    v = course.v + inverse @ impulse
    past = Past(_entries(plant, course, v, u), None)
    return v, -inverse @ jnp.stack(plant.imbalance(q, tuple(v), still, u, (*known, past)))
