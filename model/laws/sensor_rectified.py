"""Sensor rectified: a channel that loses the sign of what it reads."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..law import Fault, Law


def _read(strength: Any, shapes: Any, values: Any, step: float) -> Any:
    """Reading ``(1 - |s|) y + s |y|`` [unit]."""
    return (1.0 - abs(strength)) * values + strength * np.abs(values)


def _along(
    strength: Any, shapes: Any, values: Any, step: float, by: Any, by_shapes: Any, moved: Any
) -> Any:
    slope = (1.0 - abs(strength)) + strength * np.sign(values)
    grown = np.abs(values) - np.sign(strength) * values  # at the null what a gain does is left out
    return slope[:, None] * moved + grown[:, None] * by


LAW = Law(
    name="sensor_rectified",
    kind="reading",
    symbol="share",
    dimension=(0, 0, 0),
    natural=lambda scales: 0.3,
    slot="fault",
    fault=Fault(_read, _along),
    formula="y = (1 - |s|) y_true + s |y_true|",
    sentence="The channel {place} loses the sign of what it reads, by a share of {value} "
    "(below 0: all reads as negative).",
    cure="Look for a magnitude or root mean square that was stored instead of the reading.",
    source="full-wave rectifier, the case s = 1, and s = -1 with its poles changed",
)
