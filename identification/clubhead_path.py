"""Smoothed paths: local polynomials in time that never look across an impact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

DEGREE = 3
"""Degree of the local polynomials [-]."""


@dataclass(frozen=True, eq=False)
class Smooth:
    """Values and slopes of local polynomials.

    Attributes:
        value: shape (n, k) [the curves' unit]; nan where too few frames are near.
        slope: shape (n, k) [the curves' unit a second].
        value_weights: of the frames in the window, shape (n, width) [-].
        slope_weights: of the frames in the window, shape (n, width) [1/s].
        rows: the frames in the window, shape (n, width) [-].
    """

    value: np.ndarray
    slope: np.ndarray
    value_weights: np.ndarray
    slope_weights: np.ndarray
    rows: np.ndarray

    def variance(self, weights: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Variance of a weighted sum of independent frames.

        Args:
            weights: `value_weights` or `slope_weights`, in their units.
            own: variance of each frame, shape (n, ...); the square of the curves' unit.

        Returns:
            Shape (n, ...), in units of the weights' square times that.
        """
        near = np.nan_to_num(own)[self.rows]
        return np.einsum("nw,nw...->n...", weights**2, near)


def smooth_path(
    curves: np.ndarray,
    found: np.ndarray,
    rate: float,
    width: int | np.ndarray,
    segment: np.ndarray,
) -> Smooth:
    """Fits a polynomial to the frames around each frame, inside its segment.

    Args:
        curves: shape (n, k), any unit; nan where not found.
        found: frames that count, shape (n,).
        rate: frames a second [Hz].
        width: of the window, for all frames or for each, shape (n,) [frames].
        segment: number of each frame's segment, shape (n,), not falling.

    Returns:
        Values, slopes [1/s] and the weights that made them.
    """
    count = len(curves)
    first = np.searchsorted(segment, segment)
    last = np.searchsorted(segment, segment, side="right")
    row, width = np.arange(count), np.broadcast_to(width, (count,))
    start = np.clip(row - width // 2, first, np.maximum(last - width, first))
    offsets = np.arange(width.max())
    rows = start[:, None] + offsets
    inside = (rows < last[:, None]) & (offsets < width[:, None])
    rows = np.minimum(rows, count - 1)
    counts = inside & found[rows]
    powers = ((rows - row[:, None]) * 2.0 / width[:, None])[..., None] ** np.arange(DEGREE + 1)
    powers = powers * counts[..., None]
    gram = np.swapaxes(powers, 1, 2) @ powers
    enough = counts.sum(axis=1) > DEGREE + 1
    gram[~enough] = np.eye(DEGREE + 1)
    weights = np.linalg.solve(gram, np.swapaxes(powers, 1, 2))
    weights[~enough] = np.nan
    near = np.nan_to_num(curves)[rows]
    value_weights, slope_weights = weights[:, 0], weights[:, 1] * (2.0 * rate / width)[:, None]
    value = np.einsum("nw,nwk->nk", value_weights, near, optimize=True)
    slope = np.einsum("nw,nwk->nk", slope_weights, near, optimize=True)
    return Smooth(value, slope, value_weights, slope_weights, rows)


def bandwidth(width: int, rate: float, at_end: bool = False) -> float:
    """Lowest frequency at which a smoothed slope is 3 dB off the true one.

    Args:
        width: of the window [frames].
        rate: frames a second [Hz].
        at_end: whether the slope is taken at the end of the window, as just before an impact,
            rather than in its middle.

    Returns:
        The frequency [Hz].
    """
    offsets = np.arange(width) - (width - 1.0 if at_end else 0.5 * (width - 1))
    powers = (offsets / width)[:, None] ** np.arange(DEGREE + 1)
    weights = np.linalg.pinv(powers)[1] * rate / width
    frequencies = np.linspace(0.02, 8.0, 1600) * rate / width
    turns = 2j * np.pi * frequencies[:, None]
    ratio = np.abs(np.exp(turns * offsets / rate) @ weights) / (2 * np.pi * frequencies)
    off = np.flatnonzero(np.abs(20 * np.log10(np.maximum(ratio, 1e-12))) > 3.0)
    return float(frequencies[off[0]]) if off.size else 0.5 * rate


def notch(
    center: np.ndarray, found: np.ndarray, rate: float, noise: np.ndarray, contact: float
) -> tuple[float, float] | None:
    """The frame after which the club suddenly loses speed.

    Straight lines are fitted before and after a gap as long as a contact; the largest loss of
    speed between them is the impact.

    Args:
        center: of the face, shape (n, 3) [m].
        found: frames that count, shape (n,).
        rate: frames a second [Hz].
        noise: standard deviation of `center` along its path, shape (n,) [m].
        contact: how long a contact lasts [s].

    Returns:
        Frame, in frames from 0, and the loss of speed [m/s]; None where none stands out.
    """
    width, gap = 8, max(1, int(np.ceil(contact * rate)))
    rows = np.arange(width - 1, len(center) - gap - width)
    if not len(rows):
        return None
    offsets = np.arange(width) - 0.5 * (width - 1)
    weights = offsets / np.sum(offsets**2) * rate
    whole = np.convolve(found, np.ones(width), "valid") == width
    steady = np.nan_to_num(center)
    slopes = np.stack([np.convolve(x, weights[::-1], "valid") for x in steady.T], axis=1)
    speed = np.where(whole, np.linalg.norm(slopes, axis=1), np.nan)
    before, after = speed[rows - width + 1], speed[rows + gap]
    # what the swing itself takes where it slows, from windows that end before any contact begins
    late = np.maximum(rows - width + 1 - 2, 0)
    early = np.maximum(late - width, 0)
    apart = np.maximum(late - early, 1)
    steady_loss = np.maximum(speed[early] - speed[late], 0.0) / apart * (width + gap)
    loss = before - after
    if not np.isfinite(loss).any():
        return None
    best = int(np.nanargmax(loss))
    doubt = float(np.nanmedian(noise)) * rate * np.sqrt(2 / np.sum(offsets**2))
    least = max(1.0, 8 * doubt, 0.05 * before[best], 3 * float(np.nan_to_num(steady_loss[best])))
    return (float(rows[best]), float(loss[best])) if loss[best] > least else None
