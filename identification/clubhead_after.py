"""The first frames after an impact: a club that spins about a point other than its face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .clubhead_arc import STRAIGHT
from .clubhead_face import turn_matrix
from .clubhead_impact import LONGEST, Approach, approach_of, fit, window_of
from .clubhead_path import DEGREE
from .clubhead_rigid import moved, swing_of

FEWEST_FRAMES = 8
"""Fewest frames over which a spinning club is smoothed [-]."""

NEAR = 0.05
"""How far from the middle of the face the point is looked for that goes straightest [m]."""

MOST_TURN = 1.0
"""Largest turn of the club within the frames that are fitted [rad]."""


@dataclass(frozen=True, eq=False)
class Departure:
    """The club in the first frame after a contact.

    Attributes:
        frame: counted from 0.
        smoothed: over how many frames toe and heel can be smoothed by cubics [-].
        place: of the middle of the face, shape (3,) [m].
        axes: of the face in the room, shape (3, 3) [-].
        velocity: of the middle of the face, shape (3,) [m/s].
        turning: angular velocity, shape (3,) [rad/s].
        covariance: of place, turn, velocity and turning, shape (12, 12) [SI].
    """

    frame: int
    smoothed: int
    place: np.ndarray
    axes: np.ndarray
    velocity: np.ndarray
    turning: np.ndarray
    covariance: np.ndarray

    def speeds(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Speeds of points of the club, and their standard deviations.

        Args:
            points: in the face's axes from its middle, shape (k, 3) [m].

        Returns:
            Shapes (k,) and (k,) [m/s].
        """
        arms = points @ self.axes.T
        moving = self.velocity + np.cross(self.turning, arms)
        size = np.linalg.norm(moving, axis=1)
        along = moving / size[:, None]
        turned = np.cross(arms, np.cross(along, self.turning))
        slopes = np.concatenate([0 * along, turned, along, np.cross(arms, along)], axis=1)
        return size, np.sqrt(np.einsum("ki,ij,kj->k", slopes, self.covariance, slopes))


def depart(
    center: np.ndarray,
    axes: np.ndarray,
    covariance: np.ndarray,
    rows: np.ndarray,
    rate: float,
    toe: np.ndarray,
) -> Departure | None:
    """Fits the frames after a contact.

    A struck club turns about a point near its center of mass: the face runs on a cycloid that no
    cubic follows for long. The point of the club that goes straightest is found first; it and
    the turn are followed by cubics.

    Args:
        center: middle of the face, shape (n, 3) [m].
        axes: of the face in the room, shape (n, 3, 3) [-].
        covariance: of center and turn, shape (n, 6, 6) [m^2, m rad, rad^2].
        rows: frames after the contact, rising.
        rate: frames a second [Hz].
        toe: from the middle of the face, in its axes, shape (3,) [m].

    Returns:
        None where the frames are too few.

    Source: tests/identification/test_clubhead_blow.py.
    """
    rows = rows[rows < rows[0] + round(LONGEST * rate)] if len(rows) else rows
    if len(rows) < DEGREE + 3:
        return None
    cosine = 0.5 * (np.einsum("nij,ij->n", axes[rows], axes[rows[0]]) - 1.0)
    wide = np.flatnonzero(cosine < np.cos(MOST_TURN))
    rows = rows[: max(int(wide[0]), DEGREE + 3)] if len(wide) else rows
    first, many = int(rows[0]), len(rows)
    center, axes, covariance = center[rows], axes[rows], covariance[rows]
    own = _straightest((rows - first) / rate, center, axes, covariance)
    arm = axes @ own
    whole = np.broadcast_to(np.eye(6), (many, 6, 6)).copy()
    whole[:, :3, 3:] = swing_of(arm)
    spread = whole @ covariance @ np.swapaxes(whole, 1, 2)
    back = np.arange(many)[::-1]  # an approach ends at its reference: time runs backward
    times = (first - rows[back]) / rate
    approach = approach_of(center + arm, axes, spread, back, rate, STRAIGHT, times)
    count = window_of(approach, min(FEWEST_FRAMES, many))
    solved, variance, chi2 = fit(approach, count, DEGREE)
    rates = 1.0 / approach.times[-count]  # negative: time runs backward
    pick = np.zeros((12, solved.size))
    pick[:6, :6], pick[6:, 6:12] = np.eye(6), rates * np.eye(6)
    state = pick @ solved.ravel()
    here = turn_matrix(state[None, 3:6])[0] @ axes[0]
    arm, turning = here @ own, state[9:]
    move = np.eye(12)  # from the straightest point to the middle of the face
    move[:3, 3:6] = move[6:9, 9:] = swing_of(-arm)
    move[6:9, 3:6] = swing_of(turning).T @ swing_of(-arm)
    place, velocity = state[:3] - arm, state[6:9] - np.cross(turning, arm)
    told = move @ (pick @ variance @ pick.T * max(1.0, chi2)) @ move.T
    smoothed = window_of(_tips(times, center, axes, covariance, toe), min(FEWEST_FRAMES, many))
    return Departure(first, smoothed, place, here, velocity, turning, told)


def _straightest(
    times: np.ndarray, center: np.ndarray, axes: np.ndarray, covariance: np.ndarray
) -> np.ndarray:
    """The point, in the face's axes, whose path is nearest to a cubic, shape (3,) [m]."""
    noise = np.sqrt(np.trace(covariance[:, :3, :3], axis1=1, axis2=2) / 3)
    powers = (times / max(times[-1], 1e-12))[:, None] ** np.arange(DEGREE + 1)
    paths = np.einsum("np,ij->nipj", powers, np.eye(3)).reshape(len(times), 3, -1)
    rows = np.concatenate([paths, -axes], axis=2) / noise[:, None, None]
    held = np.concatenate([np.zeros((3, paths.shape[2])), np.eye(3) / NEAR], axis=1)
    wanted = np.append((center / noise[:, None]).ravel(), np.zeros(3))
    design = np.concatenate([rows.reshape(-1, rows.shape[2]), held])
    return np.linalg.lstsq(design, wanted, rcond=None)[0][-3:]


def _tips(
    times: np.ndarray, center: np.ndarray, axes: np.ndarray, covariance: np.ndarray, toe: np.ndarray
) -> Approach:
    """The paths of toe and heel backward in time, as what a window is chosen for."""
    values, spread = [], np.zeros((len(center), 6, 6))
    for part, side in ((slice(0, 3), 1.0), (slice(3, 6), -1.0)):
        arm = side * axes @ toe
        values.append(center + arm)
        spread[:, part, part] = moved(covariance, arm)
    both = np.concatenate(values, axis=1)[::-1]
    return Approach(times, both, spread[::-1], np.eye(3), STRAIGHT)
