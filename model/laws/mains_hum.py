"""Mains hum: a tone of the grid in a channel."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..law import Fault, Law, Shape


def _phase(shapes: Any, count: int, step: float) -> np.ndarray:
    frequency, phase = shapes
    return 2 * np.pi * frequency * step * np.arange(count) + phase


def _read(strength: Any, shapes: Any, values: Any, step: float) -> Any:
    """Reading ``y + A sin(2 pi f t + phase)`` [unit]."""
    return values + strength * np.sin(_phase(shapes, len(values), step))


def _along(
    strength: Any, shapes: Any, values: Any, step: float, by: Any, by_shapes: Any, moved: Any
) -> Any:
    at = _phase(shapes, len(values), step)
    turn = 2 * np.pi * step * np.arange(len(values))[:, None] * by_shapes[0] + by_shapes[1]
    return moved + np.sin(at)[:, None] * by + strength * np.cos(at)[:, None] * turn


def _phase_in(residual: np.ndarray, step: float, others: tuple[float, ...]) -> float:
    """Phase of a tone of that frequency beside what is slow [rad]; a grid asks nobody's clock."""
    count = len(residual)
    turn = _phase((others[0], 0.0), count, step)
    slow = np.vander(np.linspace(-1.0, 1.0, count), min(6, max(count // 8, 1)))
    parts = np.column_stack([np.sin(turn), np.cos(turn), slow])
    along, across = np.linalg.lstsq(parts, residual, rcond=None)[0][:2]
    return float(np.arctan2(across, along))


LAW = Law(
    name="mains_hum",
    kind="reading",
    symbol="amplitude",
    dimension=(0, 0, 0),
    natural=lambda scales: scales.stretch,
    slot="fault",
    fault=Fault(_read, _along),
    of_channel=True,
    shapes=(
        Shape("frequency", (0, 0, -1), lambda scales: (50.0, 60.0)),
        Shape("phase", (0, 0, 0), lambda scales: (0.5 * np.pi,), guess=_phase_in),
    ),
    formula="y = y_true + A sin(2 pi f t + phase)",
    sentence="The channel {place} hums with the mains, with an amplitude of {value}.",
    cure="Mend the shielding and the ground loop.",
    source="50 Hz and 60 Hz grids",
)
