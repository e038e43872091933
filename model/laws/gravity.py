"""Gravity on a body that turns: a torque with the sine of its angle."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Place
from ..swung import SwungRows, Told


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Torque ``m g l sin(angle)`` [N m]."""
    return strength * jnp.sin(stretch)


def _swing(strength: Any, stretch: Any, told: Told, rows: SwungRows) -> Any:
    """The same on what a told motion swings: on every mass, and in the head's tension."""
    across = rows.first * jnp.sin(told.lean + stretch)
    return strength / told.moment * (across + rows.weight * jnp.cos(told.lean) * stretch)


LAW = Law(
    name="gravity",
    kind="mass",
    also=("swung",),
    symbol="moment",
    dimension=(1, 0, 0),
    natural=lambda scales: scales.force / scales.stretch,
    force=force,
    swing=_swing,
    rotation=True,
    formula="f = m g l sin(angle)",
    sentence="Gravity pulls the {place} back with the sine of its angle, up to {value}: the linear "
    "spring of the rig is not what acts.",
    cure="Keep the sine in the model; for small angles it is a spring.",
    source="Huygens 1673, Horologium oscillatorium",
)
