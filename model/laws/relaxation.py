"""Relaxation: a spring in series with a dashpot, which stiffens what is moved fast."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Memory, Shape


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """The dashpot has had time to follow, shape (1, rows) [m or rad]."""
    return stretch[None]


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """``tau ds/dt = d - s``, exact for a stretch that is linear within the step."""
    (tau,), (s,) = shapes, memory
    part = step / tau
    left = jnp.exp(-part)
    slope = (after[0] - before[0]) / step
    lag = slope * tau
    return (after[0] - lag + (s - before[0] + lag) * left)[None]


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """Force ``k (d - s)`` [N or N m]."""
    return strength * (stretch - memory[0])


LAW = Law(
    name="relaxation",
    kind="link",
    symbol="stiffness",
    dimension=(1, -1, 0),
    natural=lambda scales: scales.force / scales.stretch,
    signed=False,
    dissipative=True,
    memory=Memory(1, _begin, _advance, _force),
    shapes=(
        Shape(
            "time",
            (0, 0, 1),
            lambda scales: (0.1 * scales.time, scales.time, 10.0 * scales.time),
        ),
    ),
    formula="f = k (d - s), time ds/dt = d - s",
    sentence="The {place} relaxes: moved fast it is stiffer by {value} than held.",
    cure="Fit a Zener element to the material, or test it at the frequency of use.",
    source="Zener 1948, Elasticity and Anelasticity of Metals, chapter V",
)
