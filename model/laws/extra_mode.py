"""Extra mode: a small mass on a spring of its own, riding on what the model takes for rigid."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import INERTIA, Law, Memory, Shape
from ..ringing import frequencies_above, rung


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """The rider rests on what carries it: its displacement and rate against that, (2, rows)."""
    return jnp.zeros((2, *jnp.shape(stretch)))


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """``e'' + 2 z w e' + w^2 e = -x''``, exact for an x that is cubic within the step."""
    turn, ratio = 2 * jnp.pi * shapes[0], shapes[1]
    (x0, v0), (x1, v1) = before, after
    chord = (x1 - x0) / step
    bend = (6 * chord - 4 * v0 - 2 * v1) / step  # x'' at the start
    jerk = 6 * (v0 + v1 - 2 * chord) / step**2
    drift = -jerk / turn**2  # the forced part is a straight line
    shift = -(bend + 2 * ratio * turn * drift) / turn**2
    e, rate = memory[0] - shift, memory[1] - drift
    new, fast = rung(e, rate, turn * turn, ratio * turn, step)
    return jnp.stack(jnp.broadcast_arrays(new + shift + drift * step, fast + drift))


def _struck(shapes: Any, stretch: Any, rate: Any) -> Any:
    """What a blow leaves: it threw the carrier out of its rest and left the rider behind."""
    return jnp.stack(jnp.broadcast_arrays(-stretch, -rate))


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """Force ``-m (w^2 e + 2 z w e')`` on what carries it [N or N m]."""
    turn = 2 * jnp.pi * shapes[0]
    return -strength * (turn**2 * memory[0] + 2 * shapes[1] * turn * memory[1])


LAW = Law(
    name="extra_mode",
    kind="body",
    also=("head", "mass"),
    symbol="mass",
    dimension=INERTIA,
    natural=lambda scales: scales.force * scales.time**2 / scales.stretch,
    signed=False,
    memory=Memory(2, _begin, _advance, _force, _struck),
    shapes=(
        Shape("frequency", (0, 0, -1), frequencies_above),
        Shape("damping_ratio", (0, 0, 0), lambda scales: (0.03,)),
    ),
    formula="f = -m (w^2 e + 2 z w e'), e'' + 2 z w e' + w^2 e = -x'', w = 2 pi frequency",
    sentence="Something of {value} rides on the {place} and rings there by itself.",
    cure="Tap the place and look for what is loose or slender on it; tighten or damp it.",
    source="appended oscillator; Den Hartog 1956, Mechanical Vibrations, chapter 3",
)
