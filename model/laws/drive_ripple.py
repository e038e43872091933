"""Drive ripple: a drive that shakes about what it is told."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..law import Law, Shape
from ..ripple import RISE

LOWEST, HIGHEST, SPACING = 3.0, 100.0, 0.1
"""Frequencies at which a ripple is looked for, and their spacing [Hz]."""


def _loudest(left: Mapping[str, tuple[np.ndarray, float]]) -> tuple[float, ...]:
    """The frequency with most power in the errors of all told motions [Hz]."""
    tones = np.arange(LOWEST, HIGHEST, SPACING)
    power = np.zeros(len(tones))
    for errors, step in left.values():
        turn = 2 * np.pi * step * np.outer(tones, np.arange(len(errors)))
        power += np.abs(np.exp(-1j * turn) @ (errors - np.mean(errors))) ** 2 / len(errors)
        power[tones > 0.4 / step] = 0.0
    return (float(tones[int(np.argmax(power))]),)


def _phase_in(errors: np.ndarray, step: float, others: tuple[float, ...]) -> float:
    """Phase of a tone of that frequency in a told motion's errors [rad]."""
    turn = 2 * np.pi * others[0] * step * np.arange(len(errors))
    parts = np.column_stack([np.sin(turn), np.cos(turn), np.ones(len(errors))])
    along, across = np.linalg.lstsq(parts, errors, rcond=None)[0][:2]
    return float(np.arctan2(across, along))


def _onset_in(errors: np.ndarray, step: float, others: tuple[float, ...]) -> float:
    """When a tone of that frequency sets in, in a told motion's errors [s]."""
    times = step * np.arange(len(errors))
    turn = 2 * np.pi * others[0] * times
    waves = np.column_stack([np.sin(turn), np.cos(turn)])
    trials = np.arange(0.0, max(times[-1] - RISE, step), max(step, RISE / 20))
    left = []
    for onset in trials:
        rise = np.clip((times - onset) / RISE, 0.0, 1.0)
        parts = np.column_stack([waves * rise[:, None], np.ones(len(errors))])
        best = np.linalg.lstsq(parts, errors, rcond=None)[0]
        left.append(float(np.sum((errors - parts @ best) ** 2)))
    return float(trials[int(np.argmin(left))])


LAW = Law(
    name="drive_ripple",
    kind="drive",
    symbol="amplitude",
    dimension=(0, 1, 0),
    natural=lambda scales: 0.1 * scales.stretch,
    slot="ripple",
    shapes=(
        Shape("frequency", (0, 0, -1), lambda scales: (10.0, 30.0), sought=_loudest),
        Shape("phase", (0, 0, 0), lambda scales: (0.5 * np.pi,), guess=_phase_in),
        Shape("onset", (0, 0, 1), lambda scales: (0.1,), guess=_onset_in),
    ),
    formula="theta = theta_told + A sin(2 pi f t + phase), rising within 0.1 s from its onset on",
    sentence="The {place} shakes about what it is told, with an amplitude of {value}.",
    cure="Look at the drive's current and gears at that frequency, or smooth the command.",
    source="torque ripple of geared servo drives; tests/model/test_ripple.py",
)
