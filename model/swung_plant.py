"""A plant whose told joints swing a club: what they tell at every instant, and what feels it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import jax.numpy as jnp

from . import swung
from .law import Law
from .linear import Array, Mechanism, moved_grounds
from .plant import Plant, mechanism_laws
from .robot import Robot
from .swung import Felt, SwungRows, Told, first_moment, told_from


@cache
def swings_of(mechanism: Mechanism) -> tuple[Law, ...]:
    """The laws of what a told motion swings on a mechanism, in the order of its numbers [-]."""
    if not isinstance(mechanism, Robot):
        return ()
    return tuple(law for law in mechanism_laws(mechanism) if law.swing is not None)


def swung_rows(mechanism: Mechanism, p: Mapping[str, Any]) -> SwungRows:
    """First rows and weights over all law rows of a mechanism, zero where nothing is swung [SI]."""
    first, weight = [jnp.zeros(0)], [jnp.zeros(0)]
    for place in mechanism.law_places():
        if isinstance(mechanism, Robot) and place in swung.KINDS:
            own = swung.weights(place, p)
            first.append(jnp.eye(len(own))[0])
            weight.append(jnp.asarray([value + 0.0 * p["club_length"] for value in own]))
        else:
            none = jnp.zeros(len(mechanism.place_rows(place, p)[1]))
            first, weight = [*first, none], [*weight, none]
    return SwungRows(jnp.concatenate(first), jnp.concatenate(weight))


def force_at_rest(p: Mapping[str, Any], law: Law, place: str, strength: Any, stretch: Any) -> Array:
    """Force of a law of a told motion in a place's rows where all joints rest at 0 [N or N m]."""
    assert law.swing is not None
    own = swung.weights(place, p)
    rows = SwungRows(jnp.eye(len(own))[0], jnp.asarray(own))
    return law.swing(strength, stretch, _told([], p, jnp.zeros(())), rows)


def told_at(plant: Plant, p: Mapping[str, Any], x: Array, w: Array) -> Told:
    """What told joints tell at states under inputs.

    Args:
        plant: its joints are marched by their acceleration.
        p: its mechanism's numbers [SI].
        x: states, shape (..., states) [SI].
        w: inputs, shape (..., inputs) [SI].
    """
    low = 2 * len(plant.mechanism.coordinates)
    joints = [
        (plant.inputs[ground.index].place, x[..., at], x[..., at + 1], w[..., ground.index])
        for ground in moved_grounds(plant.inputs)
        for at in (low + ground.state,)
    ]
    return _told(joints, p, jnp.zeros(x.shape[:-1]))


def told_within(
    plant: Plant, p: Mapping[str, Any], x: Array, w: tuple[Array, Array], step: Array
) -> Told:
    """The same in the middle and at the end of a step, from the state at its start on.

    Args:
        plant: as for `told_at`.
        p: its mechanism's numbers [SI].
        x: shape (states,) [SI].
        w: inputs at the start and at the end, linear in between, shape (inputs,) each [SI].
        step: length of the step [s].

    Returns:
        With a first axis of two.
    """
    low, t = 2 * len(plant.mechanism.coordinates), step * jnp.array([0.5, 1.0])
    joints = []
    for ground in moved_grounds(plant.inputs):
        at, bend = low + ground.state, w[0][ground.index]
        slope = (w[1][ground.index] - bend) / step
        angle = x[at] + t * (x[at + 1] + t * (bend / 2 + t * slope / 6))
        rate = x[at + 1] + t * (bend + t * slope / 2)
        joints.append((plant.inputs[ground.index].place, angle, rate, bend + t * slope))
    return _told(joints, p, jnp.zeros(2))


TOLD = Told._fields[:5]
"""What of a swing changes with its motion, and in proportion to it; the rest is the robot's [-]."""


def _told(joints: list[tuple[str, Any, Any, Any]], p: Mapping[str, Any], none: Any) -> Told:
    return told_from(joints, p.get("arm_length", 0.0), first_moment(p), none)


def swung_readings(
    plant: Plant, p: Mapping[str, Any], strengths: Mapping[str, Any], x: Array, w: Array
) -> Array:
    """What laws of a told motion add to what sensors read: accelerometers ride on the club.

    Args:
        plant: its sensors are meant.
        p: its mechanism's numbers [SI].
        strengths: by name of a law [in the law's unit]; others do not act.
        x: states, shape (t, states) [SI].
        w: inputs, shape (t, inputs) [SI].

    Returns:
        Shape (t, sensors) [m/s^2], zero for sensors of anything else.

    Source: `planar_sensors.planar_samples` to first order; tests/model/test_swung.py.
    """
    found, told = [jnp.zeros((len(x), 0))], told_at(plant, p, x, w)
    turn = x[:, 0] - told.lean[:, 0]
    for port in plant.sensors:
        total = jnp.zeros((len(x), 1))
        if port.quantity == "acceleration":
            moved, tilt, spun = swung.felt_rows(port.place, port.frame, p)
            ways = (sum(k * x[:, i] for i, k in enumerate(row)) for row in (tilt, spun))
            felt = Felt(moved, turn[:, None], *(jnp.asarray(way)[..., None] for way in ways))
            for law in swings_of(plant.mechanism):
                if law.felt is not None and law.name in strengths:
                    total = total + law.felt(strengths[law.name], told, felt)
        found.append(total)
    return jnp.concatenate(found, axis=1)
