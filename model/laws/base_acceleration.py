"""Base acceleration: an arm's pull on every mass, turned by the wrist's angle."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law
from ..swung import Felt, SwungRows, Told


def _across(told: Told, turn: Any) -> Any:
    """Pull of the pivot across the club beyond that on an arm in line with it [m/s^2]."""
    angle = told.wrist + turn
    turned = told.bend * (jnp.cos(angle) - 1.0) + told.rate * told.rate * jnp.sin(angle)
    return told.length * turned


def _inwards(told: Told) -> Any:
    """Pull of the pivot along the club, towards the butt [m/s^2]."""
    centered = told.rate * told.rate * jnp.cos(told.wrist) - told.bend * jnp.sin(told.wrist)
    return told.length * centered


def _swing(strength: Any, stretch: Any, told: Told, rows: SwungRows) -> Any:
    """The pull on the masses, and what a pull along the club does to what is displaced."""
    along = rows.weight * _inwards(told) * stretch
    return strength * (rows.first * _across(told, stretch) + along)


def _felt(strength: Any, told: Told, felt: Felt) -> Any:
    """What a rider on the club reads more: the pivot's acceleration along its axis [m/s^2]."""
    return strength * (felt.moved * _across(told, felt.turn) + _inwards(told) * felt.tilt)


LAW = Law(
    name="base_acceleration",
    kind="arm",
    symbol="share",
    dimension=(0, 0, 0),
    natural=lambda scales: 1.0,
    swing=_swing,
    felt=_felt,
    formula="a = share l (bend (cos w - 1) + rate^2 sin w) on every mass, w the wrist's angle",
    sentence="The pull of the {place} on every mass turns with the wrist's angle, which the model "
    "leaves out: {value} times what full kinematics have of it, 1 being all.",
    cure="Simulate swings with fidelity = 'planar', or keep the pull in the model.",
    source="acceleration of the wrist's pivot in the collet's axes; errata A6 and A8 of the "
    "thesis's eq. 40 and 41",
)
