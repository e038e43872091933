"""Sensor drift: a channel whose zero creeps while the record runs."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..law import Fault, Law


def _read(strength: Any, shapes: Any, values: Any, step: float, since: float = 0.0) -> Any:
    """Reading ``y + d t`` [unit], t from where the channel's record begins."""
    return values + strength * (since + step * np.arange(len(values)))


def _along(
    strength: Any,
    shapes: Any,
    values: Any,
    step: float,
    by: Any,
    by_shapes: Any,
    moved: Any,
    since: float = 0.0,
) -> Any:
    return moved + (since + step * np.arange(len(values)))[:, None] * by


LAW = Law(
    name="sensor_drift",
    kind="reading",
    symbol="drift",
    dimension=(0, 0, -1),
    natural=lambda scales: scales.stretch / (100.0 * scales.time),
    slot="fault",
    fault=Fault(_read, _along, counts=True),
    of_channel=True,
    formula="y = y_true + d t",
    sentence="The channel {place} drifts by {value}.",
    cure="Let the amplifier warm up, or filter its lowest frequencies away.",
    source="VIM 2012, 4.21 (instrumental drift)",
)
