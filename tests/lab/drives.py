"""Forces that the bench applies and records: multisine, chirp, filtered noise, hammer blows."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfilt

SHAPES = ("multisine", "chirp", "noise")


def draw_drive(
    shape: str, count: int, rate: float, band: tuple[float, float], rng: np.random.Generator
) -> np.ndarray:
    """A force of unit size at `count` samples, faded in and out at both ends.

    Raises:
        ValueError: if the shape is not known.
    """
    times = np.arange(count) / rate
    low, high = band
    if shape == "multisine":
        tones = rng.uniform(low, high, 24)
        phases = rng.uniform(0, 2 * np.pi, 24)
        force = np.sin(2 * np.pi * np.outer(times, tones) + phases).sum(axis=1)
    elif shape == "chirp":
        speed = (high - low) / times[-1]
        force = np.sin(2 * np.pi * (low + speed * times / 2) * times)
    elif shape == "noise":
        top = min(high / (rate / 2), 0.9)
        force = np.asarray(sosfilt(butter(2, top, output="sos"), rng.standard_normal(count)))
    else:
        raise ValueError(f"drive {shape!r}: expected one of {SHAPES}")
    fade = max(count // 20, 2)
    window = np.ones(count)
    window[:fade] = 0.5 - 0.5 * np.cos(np.pi * np.arange(fade) / fade)
    window[-fade:] = window[:fade][::-1]
    force = force * window
    return force / np.abs(force).max()


def blow(count: int, start: int, width: int) -> np.ndarray:
    """A half sine of unit height, `width` sample intervals long from sample `start`."""
    force = np.zeros(count)
    force[start : start + width + 1] = np.sin(np.pi * np.arange(width + 1) / width)
    return force
