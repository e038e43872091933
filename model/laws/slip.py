"""Slip: a part of a spring that slides where it carries more than it can hold."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Memory, Shape


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """Share of the load it can hold, after loading straight from rest, shape (1, rows) [-]."""
    (knee,) = shapes
    return jnp.clip(stretch / knee, -1.0, 1.0)[None]


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """``knee dz = d(stretch)``, held between -1 and 1; exact while the motion keeps its way."""
    (knee,), (z,) = shapes, memory
    return jnp.clip(z + (after[0] - before[0]) / knee, -1.0, 1.0)[None]


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """Force ``F z`` [N or N m]."""
    return strength * memory[0]


LAW = Law(
    name="slip",
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
            lambda scales: (0.2 * scales.stretch, 0.6 * scales.stretch, 1.2 * scales.stretch),
        ),
    ),
    limit="coulomb_friction",
    limit_share=0.05,  # as for hysteresis
    formula="f = F z, knee dz/dt = v while |z| < 1, else z = sign(v)",
    sentence="The {place} slips: a part of it holds no more than {value} and slides beyond.",
    cure="Clamp it harder, roughen or glue what slides, or clean it of grease.",
    source="Iwan 1966, doi:10.1115/1.3625199: a spring in a row with dry friction",
)
