"""Asymmetric stiffness: a spring that is stiffer one way than the other."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``k_a |d|``, its corner rounded [N or N m]."""
    width = place.stretch_width
    return strength * (jnp.sqrt(stretch * stretch + width * width) - width)


LAW = Law(
    name="asymmetric_stiffness",
    kind="link",
    symbol="stiffness_difference",
    dimension=(1, -1, 0),
    natural=lambda scales: scales.force / scales.stretch,
    force=force,
    formula="f = k_a |d|",
    sentence="The {place} is stiffer one way than the other: half of the difference is {value}.",
    cure="Look for a contact or a preload that is lost on one side.",
    source="bilinear oscillator, Shaw and Holmes 1983, doi:10.1016/0022-460X(83)90407-8",
)
