"""Clearance: play inside which a spring carries no load."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``-k clip(d, -gap, gap)``: it takes the spring away inside the gap [N or N m]."""
    width = place.stretch_width
    beyond = jnp.sqrt((stretch + strength) ** 2 + width * width)
    within = jnp.sqrt((stretch - strength) ** 2 + width * width)
    return -0.5 * place.stiffness * (beyond - within)


LAW = Law(
    name="clearance",
    kind="link",
    symbol="gap",
    dimension=(0, 1, 0),
    natural=lambda scales: 0.3 * scales.stretch,
    force=force,
    signed=False,
    formula="f = k (d - clip(d, -gap, gap))",
    sentence="The {place} has play: up to {value} it carries no load.",
    cure="Tighten or preload the joint.",
    source="dead zone; Wiercigroch and de Kraker 2000, chapter 2",
)
