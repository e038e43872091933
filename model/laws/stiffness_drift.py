"""Stiffness drift: a spring that changes while it is moved, and settles in the end."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Memory, Shape


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """No time has passed since the motion began, shape (1, rows) [s]."""
    return jnp.zeros_like(stretch)[None]


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """Time since the motion began [s]: what rests does not warm."""
    return memory + step


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """Force ``-k' time (exp(-t / time) - 1) d`` [N or N m]."""
    (time,) = shapes
    return -strength * time * jnp.expm1(-memory[0] / time) * stretch


LAW = Law(
    name="stiffness_drift",
    kind="link",
    symbol="stiffness_rate",
    dimension=(1, -1, -1),
    natural=lambda scales: 0.01 * scales.force / scales.stretch / scales.time,
    memory=Memory(1, _begin, _advance, _force),
    shapes=(Shape("time", (0, 0, 1), lambda scales: (10.0 * scales.time, 100.0 * scales.time)),),
    formula="f = k' time (1 - exp(-t / time)) d",
    sentence="The {place} changes its stiffness while the record runs, by {value}.",
    cure="Begin one record with a small swing: in a decay what goes with time and what goes with "
    "amplitude look alike. Then let it warm up, or tighten the clamp.",
    source="one that warms settles exponentially: Newton's law of cooling; at first it is k' t d",
)
