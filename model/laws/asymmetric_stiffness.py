"""Asymmetric stiffness: a spring that is stiffer one way than the other."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``k_a |d|``, its corner rounded by ``d tanh(d / width)`` [N or N m].

    Beyond the corner that is ``|d|`` itself. A hyperbola through zero stays below it by the width
    wherever the motion is: a steady force, which records of any length show.
    """
    return strength * stretch * jnp.tanh(stretch / place.stretch_width)


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
