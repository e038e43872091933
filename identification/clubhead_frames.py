"""Frames that a camera lost, or showed twice: the club's own steps tell where the count slips."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

BESIDE = 6
"""Steps on either side that tell how far the club goes in a frame [-]."""

SURE = 10.0
"""A step must be so many standard deviations of it long, to be counted in frames [-]."""

STEADY = 0.12
"""The speeds on both sides may differ by this share at most: a blow slips no frame [-]."""

OFF = 0.2
"""How far from a whole number of frames a slip may lie [-]."""

MOST = 12
"""Most frames that are filled in at one place [-]: of more, the club's speed no longer tells."""

WIDEST = 3
"""Frames without a pose over which slips are still looked for, and one [-]."""


def slips(position: np.ndarray, found: np.ndarray, noise: float) -> list[tuple[int, int]]:
    """Where a row is followed by more, or fewer, frames than the table has.

    Args:
        position: of the club, shape (n, 3) [m].
        found: rows that count, shape (n,).
        noise: standard deviation of a coordinate of `position` [m].

    Returns:
        Each (row, frames): after that row so many frames are missing; where negative, so many
        rows are too many. Only where the club moves steadily and fast enough to tell.

    Source: tests/identification/test_clubhead_blow.py.
    """
    rows = np.flatnonzero(found)
    if len(rows) < 2 * BESIDE + 3:
        return []
    apart = np.diff(rows)
    steps = np.linalg.norm(np.diff(position[rows], axis=0), axis=1)
    medians = np.median(sliding_window_view(steps / apart, BESIDE), axis=1)
    here = np.arange(BESIDE, len(steps) - BESIDE)
    before, after = medians[here - BESIDE], medians[here + 1]
    usual = 0.5 * (before + after)
    frames = steps[here] / np.maximum(usual, 1e-300)
    extra = np.round(frames) - apart[here]
    sure = usual > SURE * noise * np.sqrt(2.0)
    sure &= (np.abs(before - after) < STEADY * usual) & (apart[here] <= WIDEST)
    sure &= (np.abs(frames - np.round(frames)) < OFF) & (extra != 0) & (extra <= MOST)
    return [(int(rows[here[k]]), int(extra[k])) for k in np.flatnonzero(sure)]


def mended(places: np.ndarray, found: list[tuple[int, int]]) -> tuple[np.ndarray, np.ndarray]:
    """Markers as if no frame had slipped: gaps where frames are missing, no row twice.

    Args:
        places: shape (n, m, 3) [m].
        found: of `slips`.

    Returns:
        The places, shape (k, m, 3) [m], and the row of the table that each came from, shape (k,);
        -1 for a gap.
    """
    rows = list(range(len(places)))
    for row, extra in sorted(found, reverse=True):
        if extra > 0:
            rows[row + 1 : row + 1] = [-1] * extra
        else:
            del rows[row + 1 : row + 1 - extra]
    source = np.array(rows)
    filled = np.where((source < 0)[:, None, None], np.nan, places[source])
    return filled, source


def sentences(found: list[tuple[int, int]]) -> list[str]:
    """What was done, one sentence a slip.

    Args:
        found: of `slips`.

    Returns:
        The sentences; rows are counted from 0, as the table has them.
    """
    told = []
    for row, extra in found:
        many = abs(extra)
        if extra > 0:
            what = "frame is" if many == 1 else "frames are"
            text = (
                f"After frame {row} the club goes {extra + 1} times as far as before: {many} {what}"
                " missing. A gap was put there, and later times are later by that."
            )
        else:
            what = "frame too many was" if many == 1 else "frames too many were"
            text = (
                f"After frame {row} the club does not go on: {many} {what} taken out, and later "
                "times are earlier by that."
            )
        told.append(text)
    return told
