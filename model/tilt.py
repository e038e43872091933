"""What an accelerometer reads whose axis leans out along the club: the pull towards the pivot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp

from .linear import Array, Port, moved_grounds
from .plant import Plant
from .robot import Robot


def leans(port: Port) -> bool:
    """Whether a sensor on a robot may lean: an accelerometer on the clubhead against the ground."""
    return (port.place, port.quantity, port.frame) == ("clubhead", "acceleration", "absolute")


def tilted(plant: Plant, p: Mapping[str, Any], tilt: Array, x: Array, read: Array) -> Array:
    """What tilts add to what sensors read.

    Args:
        plant: its sensors are meant.
        p: its mechanism's numbers [SI].
        tilt: of each sensor outwards, shape (sensors,) [rad].
        x: states, shape (t, states) [SI].
        read: by sensors that do not lean, shape (t, sensors) [SI].

    Returns:
        Shape (t, sensors) [m/s^2], zero for sensors that cannot lean.

    Source: ``a cos(tilt) - v^2 / R sin(tilt)``, R from the pivot to the head; of a robot only;
    tests/model/test_tilt.py.
    """
    which = [leans(port) for port in plant.sensors]
    if not isinstance(plant.mechanism, Robot) or not any(which):
        return jnp.zeros_like(read)
    n = len(plant.mechanism.coordinates)
    row = plant.mechanism.sensor_row("clubhead", "velocity", "absolute", p)
    speed = x[:, n : 2 * n] @ row[:n]
    for ground in moved_grounds(plant.inputs):
        told = plant.mechanism.grounds.index(plant.inputs[ground.index].place)
        speed = speed + row[n + told] * x[:, 2 * n + ground.state + 1]
    reach = p["sleeve_offset"] + p["sleeve_spacing"] / 2 + p["club_length"] - p["grip_length"] / 2
    pull = -(speed[:, None] ** 2) / reach
    mask = jnp.asarray(which, dtype=float)
    return mask * ((jnp.cos(tilt) - 1.0) * read + jnp.sin(tilt) * pull)
