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
    """``knee dz = d(stretch) - z |d(stretch)|``, exact while the motion keeps its direction."""
    (knee,), (z,) = shapes, memory
    way = (after[0] - before[0]) / knee
    left = jnp.exp(-jnp.abs(way))
    return (z * left + jnp.sign(way) * (1.0 - left))[None]


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
    formula="f = F z, knee dz/dt = v - |v| z",
    sentence="The {place} has hysteresis: up to {value} of its force lags behind the way gone.",
    cure="Look for rubbing layers or a sticking contact line; a smaller preload narrows the loop.",
    source="Dahl 1968, TOR-0158(3107-18)-1: the Bouc-Wen law with n = 1, beta = 1, gamma = 0",
)
