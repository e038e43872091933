"""The mode of each design that carries most of its response."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .sweep_growth import less_one
from .sweep_tile import Tile


@dataclass(frozen=True)
class Dominant:
    """The mode of each design that carries most of the squared response.

    Attributes:
        frequency: ``imag(pole) / (2 pi)``; 0 where it is overdamped, shape (designs,) [Hz].
        decay: ``-real(pole)``, shape (designs,) [1/s].
        shape: its displacement part to unit length, shape (designs, coordinates) [1].
        decrement: ``2 pi zeta / sqrt(1 - zeta^2)`` of the oscillating mode that carries most;
            infinite where nothing oscillates, shape (designs,) [-].
    """

    frequency: np.ndarray
    decay: np.ndarray
    shape: np.ndarray
    decrement: np.ndarray


def dominant_mode(tile: Tile, scales: np.ndarray, sensor: int = 0) -> Dominant:
    """Which mode carries most of the squared response after the last jump.

    Args:
        tile: the designs.
        scales: weights that make coordinates comparable, shape (coordinates,) [1/m or 1/rad].
        sensor: which of the tile's sensors [-].

    Returns:
        The modes; of a pair of conjugates the one that turns forward.

    Source: energies as in `supple.model.score.modal_decrement`, up to the end of the window.
    """
    share, poles = tile.free * tile.seen[:, sensor], tile.poles
    span = tile.duration
    slow = np.minimum(np.real(poles), -1e-12 * np.maximum(np.abs(poles), 1e-300))
    safe = np.where(np.abs(poles) > 0, poles, -1e-300)
    alone = np.abs(share) ** 2 * -np.expm1(2 * slow * span) / -slow
    beat = np.real(share**2 * -less_one(safe, 2 * span) / safe)
    turns = np.imag(poles) > 1e-9 * np.abs(poles)
    carried = np.where(turns, alone - beat, np.where(np.imag(poles) < 0, -np.inf, 0.5 * alone))
    carried = np.nan_to_num(carried, nan=-np.inf, posinf=np.inf)
    rows = np.arange(len(poles))
    most = np.argmax(carried, axis=1)
    swings = np.argmax(np.where(turns, carried, -np.inf), axis=1)
    pole, turn = poles[rows, most], np.imag(poles[rows, swings])
    any_turns = turns.any(axis=1)
    decrement = -2 * np.pi * np.real(poles[rows, swings]) / np.where(any_turns, turn, 1.0)
    shape = tile.vectors[rows, :, most] * scales
    shape = shape / np.maximum(np.linalg.norm(shape, axis=1, keepdims=True), 1e-300)
    return Dominant(
        np.where(turns[rows, most], np.imag(pole), 0.0) / (2 * np.pi),
        -np.real(pole),
        shape,
        np.where(any_turns, decrement, np.inf),
    )
