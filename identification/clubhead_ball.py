"""The ball as the best sphere of known radius through the markers on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

RADIUS = 0.02135
"""Radius of a golf ball [m]: the rules demand a diameter of at least 42.67 mm."""

MARKER_NOISE = 5e-5
"""Noise of one coordinate where it is not stated [m]; thesis, section 3.2.1.3: 0.01 to 0.05 mm."""

MISFIT = 6.0
"""Misfit, in the noise, beyond which the markers do not lie on such a sphere [-]."""


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball at rest.

    Attributes:
        center: shape (3,) [m].
        covariance: of the center, shape (3, 3) [m^2].
        radius: [m].
        misfit: root mean square distance of the markers from the sphere [m].
        warnings: what is in doubt, in sentences.
    """

    center: np.ndarray
    covariance: np.ndarray
    radius: float = RADIUS
    misfit: float = 0.0
    warnings: tuple[str, ...] = ()


def fit_ball(places: np.ndarray, radius: float = RADIUS, noise: float = MARKER_NOISE) -> Ball:
    """The sphere of known radius nearest to some markers.

    Three markers allow a sphere on either side of their plane, and more on a small cap hardly
    tell: where both fit, the lower one is taken, because cameras look from above.

    Args:
        places: of the markers, shape (n, 3) [m]; n at least 3.
        radius: [m].
        noise: standard deviation of one coordinate [m].

    Returns:
        The ball, with the covariance of its center.

    Raises:
        ValueError: for fewer than three markers, or ones that lie in a line or too far apart.

    Source: thesis, section 3.4.5.
    """
    if len(places) < 3:
        raise ValueError(
            f"ball: expected at least 3 markers, found {len(places)}. Mend: mark three or more."
        )
    middle = places.mean(axis=0)
    _, size, axes = np.linalg.svd(places - middle)
    reach = np.linalg.norm(places - middle, axis=1).max()
    if reach > 2 * radius or size[1] < 1e-3 * radius:
        found = f"markers {1e3 * reach:.3g} mm from their middle" if reach > radius else "a line"
        raise ValueError(
            f"ball: expected markers spread over a sphere of radius {1e3 * radius:.4g} mm, "
            f"found {found}. Mend: check the unit and the markers."
        )
    height = np.sqrt(max(radius**2 - np.mean(np.sum((places - middle) ** 2, axis=1)), 0.0))

    def rest(center: np.ndarray) -> np.ndarray:
        return np.linalg.norm(places - center, axis=1) - radius

    starts = [middle + side * (height + 0.1 * radius) * axes[2] for side in (-1.0, 1.0)]
    fits = [least_squares(rest, start, xtol=1e-15, ftol=1e-15, gtol=1e-15) for start in starts]
    best = min(fit.cost for fit in fits)
    near = [fit for fit in fits if fit.cost <= best + 6.0 * noise**2]
    chosen = min(near, key=lambda fit: fit.x[2])
    away = (chosen.x - places) / np.linalg.norm(chosen.x - places, axis=1)[:, None]
    free = len(places) - 3
    misfit = float(np.sqrt(np.mean(chosen.fun**2)))
    words = ()
    if free and np.sqrt(2 * chosen.cost / free) > MISFIT * noise:
        words = (
            f"The ball's markers miss a sphere of radius {1e3 * radius:.4g} mm by "
            f"{1e3 * misfit:.2g} mm: another radius, or a marker that is not on the ball.",
        )
        noise = float(np.sqrt(2 * chosen.cost / free))
    return Ball(chosen.x, noise**2 * np.linalg.inv(away.T @ away), radius, misfit, words)
