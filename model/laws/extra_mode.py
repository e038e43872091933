"""Extra mode: something that rides on a mass by a spring and a dashpot of its own."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import INERTIA, Law, Memory, Shape

MOST_RATIO = 0.95
"""Largest damping ratio of a rider: beyond 1 nothing rings [-]."""


def _rates(shapes: Any) -> tuple[Any, Any]:
    """Undamped angular frequency [rad/s] and damping ratio [-]."""
    frequency, ratio = shapes
    return 2.0 * jnp.pi * frequency, jnp.minimum(ratio, MOST_RATIO)


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """The rider goes with what it rides on: its place and its rate, shape (2, rows)."""
    return jnp.stack([stretch, rate])


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """``y'' = w^2 (x - y) + 2 z w (x' - y')``, exact for a push that is linear within the step."""
    w, z = _rates(shapes)
    y, rate = memory
    decay, turn = z * w, w * jnp.sqrt(1.0 - z * z)
    pushes = [w * w * x + 2.0 * decay * v for x, v in (before, after)]
    slope = (pushes[1] - pushes[0]) / step
    follow = slope / (w * w)  # rate at which the rider would follow the push without ringing
    off, off_rate = y - (pushes[0] - 2.0 * z * slope / w) / (w * w), rate - follow
    fade = jnp.exp(-decay * step)
    cos, sin = fade * jnp.cos(turn * step), fade * jnp.sin(turn * step) / turn
    new = (pushes[1] - 2.0 * z * slope / w) / (w * w)
    new = new + off * cos + (off_rate + decay * off) * sin
    return jnp.stack([new, follow + off_rate * cos - (decay * off_rate + w * w * off) * sin])


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """Force ``m y''`` [N or N m]."""
    w, z = _rates(shapes)
    y, own = memory
    return strength * (w * w * (stretch - y) + 2.0 * z * w * (rate - own))


LAW = Law(
    name="extra_mode",
    kind="mass",
    symbol="mass",
    dimension=INERTIA,
    natural=lambda scales: 0.05 * scales.force / scales.stretch * scales.time**2,
    signed=False,
    dissipative=True,
    memory=Memory(2, _begin, _advance, _force),
    shapes=(
        Shape(
            "frequency",
            (0, 0, -1),
            lambda scales: tuple(k / (6.283185307179586 * scales.time) for k in TRIED),
        ),
        Shape("ratio", (0, 0, 0), lambda scales: (0.02,)),
    ),
    formula="f = m y'', y'' = w^2 (x - y) + 2 ratio w (x' - y'), w = 2 pi frequency",
    sentence="Something rides on the {place}: {value} on a spring of its own, which the model "
    "lacks.",
    cure="Find what is loose or bends there: a cable, a holder, a second bending mode; fix it or "
    "keep it in the model.",
    source="Den Hartog 1956, Mechanical Vibrations, section 3.2",
)
TRIED = (1.5, 1.8, 2.2, 2.7, 3.3, 4.0, 4.8, 5.8, 7.0, 8.5)
"""Frequencies of a rider that are tried, in those of the place's main oscillation [-]."""
