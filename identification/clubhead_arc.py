"""The arc on which a club swings: what a smooth motion before an impact is told beside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RADII = 0.2, 10.0
"""Radii that an arc of a swing may have [m]; others tell of a straight or a wild path."""

LEAST_TURN = 0.05
"""An arc must turn by this at least to be told from a straight line [rad]."""

ANGLE_DEGREE = 3
"""Degree of the polynomial that an arc's angle follows in time [-]."""


@dataclass(frozen=True, eq=False)
class Arc:
    """A point on a circle, and a body that turns with it.

    Polynomials follow what differs from it far longer than the motion itself: of a swing's
    turning, that is little and slow.

    Attributes:
        center: of the circle, shape (3,) [m].
        axis: about which it is run through, shape (3,) [-].
        spoke: from the center to the point at time 0, shape (3,) [m].
        angle: coefficients of the angle's polynomial in time, the first 0, shape (4,) [rad, rad/s,
            ...]; all 0 where there is no arc.
    """

    center: np.ndarray
    axis: np.ndarray
    spoke: np.ndarray
    angle: np.ndarray

    def state(self, times: np.ndarray) -> tuple[np.ndarray, ...]:
        """Point [m], turn since time 0 as matrices, velocity [m/s] and angular velocity [rad/s].

        Args:
            times: shape (n,) [s].

        Returns:
            Shapes (n, 3), (n, 3, 3), (n, 3) and (n, 3).
        """
        from scipy.spatial.transform import Rotation

        powers = times[:, None] ** np.arange(ANGLE_DEGREE + 1)
        turned = powers @ self.angle
        rate = powers[:, :-1] @ (np.arange(1, ANGLE_DEGREE + 1) * self.angle[1:])
        turn = Rotation.from_rotvec(turned[:, None] * self.axis).as_matrix()
        spoke = turn @ self.spoke
        turning = rate[:, None] * self.axis
        return self.center + spoke, turn, np.cross(turning, spoke), turning


STRAIGHT = Arc(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros(ANGLE_DEGREE + 1))
"""No arc: at the origin, without a turn."""


def arc_of(times: np.ndarray, places: np.ndarray) -> Arc:
    """The arc near a path; it need not be exact, since what differs from it is fitted beside it.

    Args:
        times: 0 at the last, shape (n,) [s].
        places: of one point, shape (n, 3) [m].

    Returns:
        The arc by least squares; `STRAIGHT` where the path shows none.

    Source: Coope 1993, doi:10.1007/BF00939613 (the circle as a linear problem);
    tests/identification/test_clubhead_arc.py.
    """
    if len(times) <= ANGLE_DEGREE + 3:
        return STRAIGHT
    middle = places.mean(axis=0)
    _, sizes, (first, second, axis) = np.linalg.svd(places - middle, full_matrices=False)
    if not sizes[1] > 0:
        return STRAIGHT
    flat = (places - middle) @ np.stack([first, second], axis=1)
    design = np.column_stack([2.0 * flat, np.ones(len(flat))])
    (x, y, rest), *_ = np.linalg.lstsq(design, np.sum(flat**2, axis=1), rcond=None)
    radius = float(np.sqrt(max(rest + x**2 + y**2, 0.0)))
    if not RADII[0] < radius < RADII[1]:
        return STRAIGHT
    angles = np.unwrap(np.arctan2(flat[:, 1] - y, flat[:, 0] - x))
    if not np.ptp(angles) > LEAST_TURN:
        return STRAIGHT
    scale = float(np.ptp(times))
    powers = (times / scale)[:, None] ** np.arange(ANGLE_DEGREE + 1)
    solved = np.linalg.lstsq(powers, angles, rcond=None)[0]
    begun, angle = solved[0], solved / scale ** np.arange(ANGLE_DEGREE + 1)
    angle[0] = 0.0
    axis = np.cross(first, second)
    spoke = radius * (np.cos(begun) * first + np.sin(begun) * second)
    return Arc(middle + x * first + y * second, axis, spoke, angle)
