"""Hysteresis: a force that yields with the way gone, whatever its speed."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Memory, Shape


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """Share of the full force after loading straight from rest, shape (1, rows) [-]."""
    (knee,) = shapes
    return (jnp.sign(stretch) * -jnp.expm1(-jnp.abs(stretch) / knee))[None]


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """Exact while the motion keeps its direction: straight while it unloads, then to the full."""
    (knee,), (z,) = shapes, memory
    way = (after[0] - before[0]) / knee
    side = jnp.where(way < 0.0, -1.0, 1.0)
    to_go, share = side * way, side * z
    back = jnp.minimum(to_go, jnp.maximum(-share, 0.0))
    loaded = 1.0 - (1.0 - share - back) * jnp.exp(back - to_go)
    return (side * loaded)[None]


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """Force ``F z`` [N or N m]."""
    return strength * memory[0]


LAW = Law(
    name="hysteresis",
    kind="link",
    symbol="force",
    dimension=(1, 0, 0),
    natural=lambda scales: scales.force,
    signed=False,
    dissipative=True,
    memory=Memory(1, _begin, _advance, _force),
    shapes=(
        Shape(
            "knee",
            (0, 1, 0),
            lambda scales: (0.1 * scales.stretch, 0.4 * scales.stretch, 1.6 * scales.stretch),
        ),
    ),
    limit="coulomb_friction",
    limit_share=0.05,  # dry contacts slide after a small part of their way
    formula="f = F z, knee dz/dt = v - (|v| z + v |z|) / 2",
    sentence="The {place} has hysteresis: up to {value} of its force lags behind the way gone.",
    cure="Look for rubbing layers or a sticking contact line; a smaller preload narrows the loop.",
    source="Wen 1976, doi:10.1061/JMCEA3.0002106, with n = 1 and beta = gamma",
)
