"""Support flexibility: what the club is clamped in gives way, and rings on its own spring."""

from __future__ import annotations

from typing import Any

import jax.numpy as jnp

from ..law import Law, Memory, Shape
from ..ringing import frequencies_above, rung


def _oscillator(shapes: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Own frequency squared, that under load, half the damping, then stiffness and damping above.

    With ``1/compliance = m w^2`` the support follows ``u'' + 2 z w u' + w^2 u = w^2 a R``, where
    ``R = k (d - u) + c (d' - u')`` is what the place above it carries.
    """
    frequency, ratio, a, k, c = shapes
    turn = 2 * jnp.pi * frequency
    own = turn * turn
    return own, own * (1.0 + a * k), ratio * turn + 0.5 * own * a * c, k, c


def _begin(shapes: Any, stretch: Any, rate: Any) -> Any:
    """Loaded slowly the support shares the way with what it carries, shape (2, rows)."""
    _, _, a, k, _ = shapes
    share = a * k / (1.0 + a * k)
    return jnp.stack(jnp.broadcast_arrays(share * stretch, share * rate))


def _advance(shapes: Any, memory: Any, before: Any, after: Any, step: Any) -> Any:
    """Exact for a stretch that is cubic within the step: the forced part is a cubic too."""
    own, square, decay, k, c = _oscillator(shapes)
    share, lag, soft = own * shapes[2] / square, 2 * decay / square, 1 / square
    # the forced part by the stretch and its derivatives: what solves the equation term by term
    slope = c - lag * k
    by_bend = -lag * slope - soft * k
    by_jerk = -lag * by_bend - soft * slope
    line = [share * part for part in (k, slope, by_bend, by_jerk)]
    (x0, v0), (x1, v1) = before, after
    chord = (x1 - x0) / step
    bend = (6 * chord - 4 * v0 - 2 * v1) / step  # the stretch's second derivative at the start
    jerk = 6 * (v0 + v1 - 2 * chord) / step**2
    shift = line[0] * x0 + line[1] * v0 + line[2] * bend + line[3] * jerk
    first = line[0] * v0 + line[1] * bend + line[2] * jerk
    ended = bend + step * jerk
    e, rate = rung(memory[0] - shift, memory[1] - first, square, decay, step)
    forced = line[0] * x1 + line[1] * v1 + line[2] * ended + line[3] * jerk
    fast = line[0] * v1 + line[1] * ended + line[2] * jerk
    return jnp.stack(jnp.broadcast_arrays(e + forced, rate + fast))


def _force(strength: Any, shapes: Any, memory: Any, stretch: Any, rate: Any) -> Any:
    """What the place above carries less, as its lower end gives way [N]."""
    *_, k, c = shapes
    return -(k * memory[0] + c * memory[1])


RATIOS = (0.03, 0.2)
"""Damping ratios that are tried [-]. A support that gives way a little is felt at another frequency
than its own; the wider resonance is seen where the narrow one has moved away."""

LAW = Law(
    name="support_flexibility",
    kind="support",
    symbol="compliance",
    dimension=(-1, 1, 0),
    natural=lambda scales: 20.0 * scales.stretch / scales.force,
    signed=False,
    rotation=False,
    memory=Memory(2, _begin, _advance, _force, placed=True),
    shapes=(
        Shape("frequency", (0, 0, -1), frequencies_above),
        Shape("damping_ratio", (0, 0, 0), lambda scales: RATIOS),
    ),
    formula="f = -(k u + c u'), u'' + 2 z w u' + w^2 u = w^2 compliance (k (d - u) + c (d' - u')), "
    "w = 2 pi frequency; d, k and c of all that the support carries",
    sentence="The {place} gives way by {value} of force on it, and rings there by itself.",
    cure="Bolt the robot to a heavier foundation, or measure the motion of its foot and record it.",
    source="foundation on a spring; Den Hartog 1956, Mechanical Vibrations, chapter 3",
)
