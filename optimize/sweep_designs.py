"""Scores and dominant modes of the designs of one tile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from ..model.drives import Drive
from ..model.linear import Mechanism, Port
from . import sweep_scores as score
from .sweep_decay import SCORES as DECAYS, decay_scores
from .sweep_dominant import dominant_mode
from .sweep_tile import Grid, Tile, doubtful, exactly_sampled, lowest_bins, samples, tile_of

BINS = 16
"""First bins of the spectrum, among which the largest is looked for at first [-]."""

CHUNK_SAMPLES = 2**18
"""Samples that are worked on together, so that they stay near the processor [-]."""

GRIP = Port("grip", "position", "collet")
"""What a grip's peak displacement is read from [m]."""


class Asked(Protocol):
    """What is asked of every design; see `supple.optimize.sweep.SweepTask` [SI]."""

    @property
    def mechanism(self) -> Mechanism:
        """A chain or robot."""
        ...

    @property
    def numbers(self) -> Mapping[str, float]:
        """Its numbers by name [SI]."""
        ...

    @property
    def drive(self) -> Drive:
        """What moves it."""
        ...

    @property
    def sensor(self) -> Port:
        """What is scored."""
        ...

    @property
    def scores(self) -> tuple[str, ...]:
        """Names of the scores."""
        ...

    @property
    def planar(self) -> bool:
        """Whether a robot moves in the plane."""
        ...


def tile_scores(
    task: Asked, grid: Grid, scales: np.ndarray, varied: Mapping[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Fields and mode shapes of one tile of designs.

    Args:
        task: what is asked.
        grid: its samples that count.
        scales: weights that make coordinates comparable, shape (coordinates,) [1/m or 1/rad].
        varied: numbers of the designs, by name, each of shape (designs,) [SI].

    Returns:
        Scores and frequency and damping of the dominant mode by name, each of shape (designs,)
        [SI]; its shape to unit length, real and imaginary, (designs, coordinates, 2) [1].
    """
    fixed = {name: v for name, v in task.numbers.items() if name not in varied}
    sensors = (task.sensor, GRIP) if "grip_displacement_peak" in task.scores else (task.sensor,)
    tile = tile_of(task.mechanism, varied, fixed, task.drive, grid, sensors)
    mode = dominant_mode(tile, scales)
    size = np.hypot(2 * np.pi * mode.frequency, mode.decay)
    found = {
        "dominant_frequency": mode.frequency,
        "dominant_damping_ratio": mode.decay / np.where(size > 0, size, 1.0),
    }
    if "log_decrement_modal" in task.scores:
        found["log_decrement_modal"] = mode.decrement
    sampled = tuple(name for name in task.scores if name != "log_decrement_modal")
    if sampled:
        found |= _sampled(task, grid, tile, varied, sensors, sampled)
    shape = np.stack([np.real(mode.shape), np.imag(mode.shape)], axis=2)
    return found, shape.astype(np.float32)


def _sampled(
    task: Asked,
    grid: Grid,
    tile: Tile,
    varied: Mapping[str, np.ndarray],
    sensors: tuple[Port, ...],
    names: tuple[str, ...],
) -> dict[str, np.ndarray]:
    """Scores of samples, bounded or all of them; the latter chunk by chunk, period by period."""
    count, within = len(tile.poles), grid.times[grid.low : grid.high]
    found = {name: np.empty(count) for name in names}
    order, bins = np.arange(count), None
    mechanism, planar = task.mechanism, task.planar
    modal = bool(tile.segments) and not planar
    if modal and tile.is_free and set(names) <= set(DECAYS) and grid.count > 2 * BINS:
        found, certain = decay_scores(tile, grid, names)
        order = np.flatnonzero(~certain)
    if "log_decrement" in names and modal and tile.is_whole and grid.count > 2 * BINS:
        bins = np.full((count, BINS), np.nan)
        bins[order] = lowest_bins(tile.take(order), grid, 0, BINS)
        order = order[np.argsort(np.argmax(bins[order], axis=1), kind="stable")]
    width = max(1, CHUNK_SAMPLES // grid.count)
    for low in range(0, len(order), width):
        chosen = order[low : low + width]
        exactly, curves, peaks = np.ones(len(chosen), bool), None, []
        if modal:
            part = tile.take(chosen)
            curves = [samples(part, grid, k) for k in range(len(sensors))]
            peaks = [score.peak(y) for y in curves]
            doubts = [doubtful(part, k, largest) for k, largest in enumerate(peaks)]
            exactly = np.any(doubts, axis=0)
        if exactly.any():
            own = {name: values[chosen[exactly]] for name, values in varied.items()}
            told = exactly_sampled(mechanism, task.numbers, own, task.drive, grid, sensors, planar)
            curves = curves or [np.empty(told.shape[:2]) for _ in sensors]
            for k, curve in enumerate(curves):
                curve[exactly] = told[:, :, k]
            peaks = [score.peak(y) for y in curves]
        assert curves is not None
        known = None if bins is None else bins[chosen]
        told = score.scores_of(names, within, curves, peaks, known, exactly)
        for name, values in told.items():
            found[name][chosen] = np.where(np.isfinite(peaks[0]), values, np.nan)
    return found
