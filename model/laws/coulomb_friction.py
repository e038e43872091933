"""Coulomb friction: a force of constant size against the motion."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``F tanh(v / width)`` [N or N m]."""
    return strength * jnp.tanh(rate / place.rate_width)


LAW = Law(
    name="coulomb_friction",
    kind="link",
    symbol="force",
    dimension=(1, 0, 0),
    natural=lambda scales: scales.force,
    force=force,
    signed=False,
    dissipative=True,
    formula="f = F sign(v)",
    sentence="The {place} has Coulomb friction of {value} that the model lacks.",
    cure="Look for dry contact: bearing, seal, clamp; lubricate it or keep the friction.",
    source="Coulomb 1785; regularized with tanh",
)
