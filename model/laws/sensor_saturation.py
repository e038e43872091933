"""Sensor saturation: a channel that cuts off what goes beyond its limit."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..law import Fault, Law, Shape


def _read(strength: Any, shapes: Any, values: Any, step: float) -> Any:
    """Reading ``y + s (clip(y, -limit, limit) - y)`` [unit]."""
    (limit,) = shapes
    return values + strength * (np.clip(values, -limit, limit) - values)


def _along(
    strength: Any, shapes: Any, values: Any, step: float, by: Any, by_shapes: Any, moved: Any
) -> Any:
    (limit,) = shapes
    beyond = np.where(np.abs(values) > limit, np.sign(values), 0.0)[:, None]
    cut = (np.clip(values, -limit, limit) - values)[:, None]
    return (1.0 - strength * np.abs(beyond)) * moved + cut * by + strength * beyond * by_shapes[0]


LAW = Law(
    name="sensor_saturation",
    kind="reading",
    symbol="share",
    dimension=(0, 0, 0),
    natural=lambda scales: 1.0,
    slot="fault",
    fault=Fault(_read, _along),
    signed=False,
    shapes=(
        Shape(
            "limit",
            (0, 0, 0),
            lambda scales: (12.0 * scales.stretch, 20.0 * scales.stretch, 30.0 * scales.stretch),
            of_channel=True,
        ),
    ),
    formula="y = y_true + s (clip(y_true, -limit, limit) - y_true)",
    sentence="The channel {place} is cut off at its limit: a share of {value} of what goes beyond "
    "is lost.",
    cure="Choose a wider range of the sensor or of its amplifier.",
    source="VIM 2012, 4.7 (measuring interval); a hard limit is the case s = 1",
)
