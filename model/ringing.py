"""A damped oscillator: what it has become after a time alone, and where one is looked for."""

from __future__ import annotations

import math
from typing import Any

import jax.numpy as jnp

from .law import Scales

SPACING = 1.08
"""Ratio of neighboring frequencies that are tried [-]: a resonance of 3 % is felt 8 % wide."""

TRIALS = 30
"""How many are tried [-]."""


def frequencies_above(scales: Scales) -> tuple[float, ...]:
    """From just above a place's main motion to the tenth of it, a light resonance apart [Hz]."""
    return tuple(1.3 * SPACING**n / (2 * math.pi * scales.time) for n in range(TRIALS))


NEAR = 1e-3
"""Square of a phase [rad^2] below which sine and cosine are series: exact to 1e-16 there."""


def rung(e: Any, rate: Any, square: Any, decay: Any, step: Any) -> tuple[Any, Any]:
    """Motion of ``e'' + 2 decay e' + square e = 0`` after a step.

    Args:
        e: what it is displaced by at the start [any unit].
        rate: of that [a second].
        square: of its frequency without damping [rad^2/s^2], not below 0.
        decay: half its damping over its mass [1/s].
        step: time gone [s].

    Returns:
        Displacement and rate at the end [any unit, and a second].

    Source: the closed solution; tests/model/test_ringing.py.
    """
    cosine, sine = _waves((square - decay * decay) * step * step, decay * step)
    new = e * (cosine + decay * step * sine) + rate * step * sine
    fast = rate * (cosine - decay * step * sine) - e * square * step * sine
    return new, fast


def _waves(square: Any, fade: Any) -> tuple[Any, Any]:
    """cos(q) and sin(q) / q of the root q of `square`, imaginary below 0, both faded [-].

    The two halves of a hyperbolic cosine are faded each: together they may be too large to tell.
    Near none both are series, so that their slopes are right there too.
    """
    q, p = jnp.sqrt(jnp.maximum(square, NEAR)), jnp.sqrt(jnp.maximum(-square, NEAR))
    rise, fall, left = jnp.exp(p - fade), jnp.exp(-p - fade), jnp.exp(-fade)
    near = jnp.abs(square) < NEAR
    s = jnp.where(near, square, 0.0)
    cosine = jnp.where(square > 0, left * jnp.cos(q), (rise + fall) / 2)
    sine = jnp.where(square > 0, left * jnp.sin(q) / q, (rise - fall) / (2 * p))
    return (
        jnp.where(near, left * (1 - s / 2 * (1 - s / 12 * (1 - s / 30))), cosine),
        jnp.where(near, left * (1 - s / 6 * (1 - s / 20 * (1 - s / 42))), sine),
    )
