"""The classic motions from rest to rest: torque waves, minimum jerk and the S-curve."""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np
from scipy.interpolate import PPoly

Shape = Literal[
    "instantaneous", "square", "half_sine", "suppressed_half_sine", "minimum_jerk", "s_curve"
]
"""Motions by name; the first four are the torques of the thesis, section 8.2.3."""

SHAPES: tuple[Shape, ...] = get_args(Shape)
"""All of them, the roughest first."""

_LEAST = 1e-13


def rise(shape: Shape, times: np.ndarray, duration: float, order: int = 0) -> np.ndarray:
    """A motion from 0 to 1 that begins and ends at rest.

    ``instantaneous`` jumps to a constant speed and back; ``square`` pushes and pulls with a
    constant torque; ``half_sine`` goes from push to pull along half a wave, and
    ``suppressed_half_sine`` along a whole one, which begins and ends without torque;
    ``minimum_jerk`` is the quintic without acceleration at its ends; ``s_curve`` has a jerk of one
    size, in four equal parts.

    Args:
        shape: one of `SHAPES`.
        times: shape (t,) [s].
        duration: of the motion, which begins at 0 [s].
        order: 0 for the position, 1 to 3 for its derivatives, without the impulses at jumps.

    Returns:
        Shape of `times` [1, 1/s, 1/s^2 or 1/s^3]; 0 before the motion, and 1 (its derivatives 0)
        after it.

    Raises:
        ValueError: for a shape that is not known, or a duration that is not positive.

    Source: thesis, section 8.2.3, where half a sine wave and the suppressed gradient are told in
    words alone; T. Flash, N. Hogan, J. Neuroscience 5, 1985, for the minimum of jerk.
    """
    if shape not in SHAPES:
        raise ValueError(
            f"shape: expected one of {', '.join(SHAPES)}, found {shape!r}. Mend: write one of them."
        )
    if not duration > 0.0:
        raise ValueError(
            f"duration: expected more than 0 s, found {duration:g}. Mend: state it in s."
        )
    share = np.asarray(times, dtype=float) / duration
    inside = np.clip(share, 0.0, 1.0)
    moves = (share >= 0.0) & (share <= 1.0)
    value = _waves(shape, inside, order) if "sine" in shape else _pieces(shape)(inside, order)
    if order == 0:
        return value
    return np.where(moves, value / duration**order, 0.0)


def _waves(shape: Shape, s: np.ndarray, order: int) -> np.ndarray:
    turn = math.pi if shape == "half_sine" else 2 * math.pi
    phase = turn * s + order * math.pi / 2
    if shape == "half_sine":  # (1 - cos(pi s)) / 2
        return (order == 0) * 0.5 - 0.5 * turn**order * np.cos(phase)
    straight = s if order == 0 else np.full_like(s, float(order == 1))
    return straight - turn ** (order - 1) * np.sin(phase)  # s - sin(2 pi s) / (2 pi)


def _pieces(shape: Shape) -> PPoly:
    """A motion of polynomials on the unit interval."""
    if shape == "instantaneous":
        return PPoly(np.array([[1.0], [0.0]]), np.array([0.0, 1.0]))
    if shape == "minimum_jerk":
        rows = np.array([6.0, -15.0, 10.0, 0.0, 0.0, 0.0])[:, None]
        return PPoly(rows, np.array([0.0, 1.0]))
    if shape == "square":
        return PPoly(np.array([[4.0, -4.0]]), np.array([0.0, 0.5, 1.0])).antiderivative(2)
    jerks = np.array([[32.0, -32.0, -32.0, 32.0]])
    return PPoly(jerks, np.linspace(0.0, 1.0, 5)).antiderivative(3)


def s_curve(distance: float, velocity: float, acceleration: float, jerk: float) -> PPoly:
    """The quickest motion from rest to rest within limits of velocity, acceleration and jerk.

    Args:
        distance: to go, of either sign [rad].
        velocity: largest [rad/s].
        acceleration: largest [rad/s^2].
        jerk: largest [rad/s^3].

    Returns:
        The position over time, from 0 to `distance`; its knots are the instants at which the
        jerk changes, its last knot the duration [rad, s].

    Raises:
        ValueError: for a distance of 0 or a limit that is not positive.

    Source: seven pieces of constant jerk, as the convolution of three boxes of the widths
    d/v, v/a and a/j; where one of them does not fit, that limit is not reached.
    """
    limits = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
    for name, limit in limits.items():
        if not 0.0 < limit < math.inf:
            raise ValueError(
                f"S-curve, {name}: expected more than 0, found {limit:g}. Mend: state a limit."
            )
    if not (math.isfinite(distance) and distance):
        raise ValueError(
            f"S-curve, distance: expected a number other than 0, found {distance:g}. Mend: state "
            "where to go."
        )
    far = abs(distance)
    top = min(velocity, _reached(far, acceleration, jerk))
    bend = min(acceleration, math.sqrt(top * jerk))
    ramp, push, cruise = bend / jerk, top / bend, far / top
    marks = [0.0, ramp, push, push + ramp]
    marks += [cruise + mark for mark in marks]
    jerks = [jerk, 0.0, -jerk, 0.0, -jerk, 0.0, jerk]
    knots = np.array(marks)
    kept = np.diff(knots) > _LEAST * knots[-1]
    edges = np.append(knots[:-1][kept], knots[-1])
    wave = PPoly(np.sign(distance) * np.array(jerks)[kept][None], edges)
    return wave.antiderivative(3)


def _reached(far: float, acceleration: float, jerk: float) -> float:
    """The highest speed that a motion of a distance has room for [rad/s]."""
    soft = (far**2 * jerk / 4) ** (1 / 3)  # ramps of jerk alone: far = 2 v sqrt(v / j)
    if soft * jerk <= acceleration**2:
        return soft
    half = acceleration**2 / jerk / 2  # far = v (v / a + a / j)
    return math.sqrt(half**2 + far * acceleration) - half
