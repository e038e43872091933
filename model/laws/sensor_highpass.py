"""Sensor highpass: a channel that forgets what is slow."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import lfilter

from ..law import Fault, Law
from .sensor_lowpass import lag, weights


def _read(strength: Any, shapes: Any, values: Any, step: float, gathered: float = 0.0) -> Any:
    """Reading ``y - u`` with ``du/dt = corner (y - u)``, u = 0 where the record begins [unit].

    So u is the corner times all that was read since.
    """
    return values - lag(weights(strength * step)[0], values, strength * gathered)


def _along(
    strength: Any,
    shapes: Any,
    values: Any,
    step: float,
    by: Any,
    by_shapes: Any,
    moved: Any,
    gathered: float = 0.0,
) -> Any:
    weight, change = weights(strength * step)
    slow = lag(weight, values, strength * gathered)
    push = np.zeros_like(values)
    push[0] = gathered / step
    push[1:] = change[0] * slow[:-1] + change[1] * values[:-1] + change[2] * values[1:]
    slope = step * np.asarray(lfilter([1.0], [1.0, -weight[0]], push))
    return moved - lag(weight, moved, 0.0) - slope[:, None] * by


LAW = Law(
    name="sensor_highpass",
    kind="reading",
    symbol="corner",
    dimension=(0, 0, -1),
    natural=lambda scales: 0.1 / scales.time,
    slot="fault",
    fault=Fault(_read, _along, remembers=True, gathers=True),
    signed=False,
    formula="y = y_true - u, du/dt = corner (y_true - u)",
    sentence="The channel {place} forgets what is slow, below a corner of {value}.",
    cure="Use a coupling that passes the lowest mode, or let the model carry the filter.",
    source="first-order high-pass, as of a piezoelectric charge amplifier",
)
