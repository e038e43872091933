"""Sensor lowpass: a channel that rounds off what is fast."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import lfilter, lfiltic

from ..law import Fault, Law


def weights(share: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of a first-order lag over a step, and their derivatives by its corner.

    ``u' = a u + b0 y + b1 y'``, exact for readings that are linear within the step.

    Args:
        share: step over time constant [-].

    Returns:
        (a, b0, b1) and their derivatives by `share`, each of shape (3,) [-].
    """
    a = np.exp(-share)
    if share < 1e-3:  # the closed form loses its digits
        c, dc = 1.0 - share / 2 + share**2 / 6, -0.5 + share / 3 - share**2 / 8
    else:
        c, dc = (1.0 - a) / share, (a * share - (1.0 - a)) / share**2
    return np.array([a, c - a, 1.0 - c]), np.array([-a, dc + a, -dc])


def lag(weight: np.ndarray, values: np.ndarray, begin: np.ndarray | float) -> np.ndarray:
    """A first-order lag of readings, shape (n, ...) [unit], from its state at the first sample."""
    a, b0, b1 = weight
    first = np.broadcast_to(begin, values.shape[1:])
    found = np.empty_like(values)
    found[0] = first
    if values.ndim == 1:
        state = lfiltic([b1, b0], [1.0, -a], [float(first)], [values[0]])
        found[1:] = lfilter([b1, b0], [1.0, -a], values[1:], zi=state)[0]
        return found
    state = (b0 * values[0] + a * first)[None]
    found[1:] = lfilter([b1, b0], [1.0, -a], values[1:], axis=0, zi=state)[0]
    return found


def _read(strength: Any, shapes: Any, values: Any, step: float) -> Any:
    """Reading ``u`` of ``tau du/dt = y - u``, settled at the first sample [unit]."""
    if not strength > 0:
        return values
    return lag(weights(step / strength)[0], values, values[0])


def _along(
    strength: Any, shapes: Any, values: Any, step: float, by: Any, by_shapes: Any, moved: Any
) -> Any:
    if not strength > 0:
        slope = -np.diff(values, prepend=values[0]) / step
        return moved + slope[:, None] * by
    share = step / strength
    weight, change = weights(share)
    read = lag(weight, values, values[0])
    push = np.zeros_like(values)
    push[1:] = change[0] * read[:-1] + change[1] * values[:-1] + change[2] * values[1:]
    slope = lfilter([1.0], [1.0, -weight[0]], push) * (-share / strength)
    return lag(weight, moved, moved[0]) + slope[:, None] * by


LAW = Law(
    name="sensor_lowpass",
    kind="response",
    symbol="time_constant",
    dimension=(0, 0, 1),
    natural=lambda scales: 0.1 * scales.time,
    slot="fault",
    fault=Fault(_read, _along, remembers=True),
    signed=False,
    formula="time_constant dy/dt = y_true - y",
    sentence="The channel {place} rounds off what is fast, with a time constant of {value}.",
    cure="Raise the corner of its filter, or let the model carry the filter.",
    source="first-order lag",
)
