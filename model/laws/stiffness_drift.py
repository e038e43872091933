"""Stiffness drift: a spring that changes steadily while the record runs."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Memory


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """No time has passed, shape (1, rows) [s]."""
    return jnp.zeros_like(stretch)[None]


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """Time since the record's start [s]."""
    return memory + step


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """Force ``k' t d`` [N or N m]."""
    return strength * memory[0] * stretch


LAW = Law(
    name="stiffness_drift",
    kind="link",
    symbol="stiffness_rate",
    dimension=(1, -1, -1),
    natural=lambda scales: 0.01 * scales.force / scales.stretch / scales.time,
    memory=Memory(1, _begin, _advance, _force),
    formula="f = k' t d",
    sentence="The {place} changes its stiffness while the record runs, by {value}.",
    cure="Begin one record with a small swing: in a decay what goes with time and what goes with "
    "amplitude look alike. Then let it warm up, or tighten the clamp.",
    source="linear drift, the first term of any slow change",
)
