"""Marks on a map: where nothing oscillates, the dominant mode changes, or the grip goes too far."""

from __future__ import annotations

from typing import Any

import numpy as np

ALIKE = 0.5
"""Squared cosine between the shapes of neighbors below which their mode is another one [-]."""


def mark_changes(
    grid: tuple[int, ...],
    still: Any,
    shapes: Any,
    overdamped: Any,
    changes: Any,
    width: int = 2**16,
) -> None:
    """Mark overdamped designs, and those whose dominant mode is another one next to them.

    Args:
        grid: designs along each axis; the last runs fastest [-].
        still: frequency of each design's mode, 0 where it does not oscillate, shape (designs,)
            [Hz].
        shapes: of these modes, shape (designs, coordinates, 2) [1].
        overdamped: gets 1 where nothing oscillates, shape (designs,) [-].
        changes: gets 1 where a neighbor's mode is another one, shape (designs,) [-].
        width: designs that are looked at together [-].
    """
    count = int(np.prod(grid))
    for low in range(0, count, width):
        part = slice(low, low + width)
        overdamped[part] = np.asarray(still[part]) == 0.0
        changes[part] = 0
    stride = count
    for size in grid:
        stride //= size
        for low in range(0, count, width):
            own = np.arange(low, min(low + width, count))
            own = own[(own // stride) % size < size - 1]
            next_to = own + stride
            differ = (still[own] == 0.0) != (still[next_to] == 0.0)
            differ |= _likeness(shapes[own], shapes[next_to]) < ALIKE
            changes[own[differ]] = 1
            changes[next_to[differ]] = 1


def mark_beyond(moved: Any, limit: float, beyond: Any, width: int = 2**16) -> None:
    """Mark designs whose grip moves more than a limit; without a number nothing is marked.

    Args:
        moved: largest displacement of each design's grip, shape (designs,) [m].
        limit: what it may be [m].
        beyond: gets 1 where it is larger, shape (designs,) [-].
        width: designs that are looked at together [-].
    """
    for low in range(0, len(moved), width):
        part = slice(low, low + width)
        beyond[part] = np.asarray(moved[part]) > limit


def _likeness(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Squared cosine between complex shapes of unit length (modal assurance criterion)."""
    first = one[:, :, 0].astype(float) + 1j * one[:, :, 1]
    second = other[:, :, 0].astype(float) + 1j * other[:, :, 1]
    return np.abs(np.sum(np.conj(first) * second, axis=1)) ** 2
