"""Angles, speeds and directions of every frame, smoothed, each with its error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .clubhead_face import Face
from .clubhead_path import Smooth, smooth_path
from .clubhead_pose import Poses
from .clubhead_rigid import moved


def curves_of(
    face: Face,
    poses: Poses,
    axes: np.ndarray,
    rate: float,
    width: np.ndarray,
    segment: np.ndarray,
    points: Mapping[str, np.ndarray],
) -> dict[str, np.ndarray]:
    """What a swing's frames tell of a club.

    Args:
        face: of the club.
        poses: with the middle of the face as origin.
        axes: of the face in the room, shape (n, 3, 3) [-].
        rate: frames a second [Hz].
        width: of the smoothing, shape (n,) [frames].
        segment: before, during or after a contact, shape (n,) [-]; see `smooth_path`.
        points: of the club by name, in the face's axes from its middle, shape (3,) each [m].

    Returns:
        Arrays of `Clubhead`, by name.
    """
    rates = face.angle_rates(np.where(poses.found[:, None, None], axes, np.eye(3)))
    turn = rates @ poses.covariance[:, 3:, 3:] @ np.swapaxes(rates, 1, 2)
    place, own = poses.position, poses.covariance[:, :3, :3]
    arms = (np.zeros(3), face.toe, -face.toe, *points.values())
    speeds, stds = np.empty((2, len(place), len(arms)))
    smooth = smooth_path(place, poses.found, rate, width, segment)
    for k, point in enumerate(arms):
        arm = axes @ point
        path = smooth_path(place + arm, poses.found, rate, width, segment) if k else smooth
        speeds[:, k] = np.linalg.norm(path.slope, axis=1)
        spread = moved(poses.covariance, arm)
        stds[:, k] = _along(path, path.slope / speeds[:, k : k + 1], spread)
    slope = smooth.slope
    flat = np.hypot(slope[:, 0], slope[:, 1])
    left, up = _aside(slope)
    step = np.full((len(place), 3), np.nan)
    step[1:] = np.diff(place, axis=0)
    size = np.linalg.norm(step, axis=1)
    both = own.copy()
    both[1:] += own[:-1]

    def raw(direction: np.ndarray) -> np.ndarray:
        return np.sqrt(np.einsum("ni,nij,nj->n", direction, both, direction))

    return {
        "angles": face.angles(axes),
        "angle_stds": np.sqrt(np.diagonal(turn, axis1=1, axis2=2)),
        "speeds": speeds,
        "speed_stds": stds,
        "path_angle": np.arctan2(slope[:, 1], slope[:, 0]),
        "path_std": _along(smooth, left, own) / flat,
        "attack_angle": np.arctan2(slope[:, 2], flat),
        "attack_std": _along(smooth, up, own) / speeds[:, 0],
        "raw_speed": size * rate,
        "raw_speed_std": raw(step / size[:, None]) * rate,
        "raw_attack_angle": np.arctan2(step[:, 2], np.hypot(step[:, 0], step[:, 1])),
        "raw_attack_std": raw(_aside(step)[1]) / size,
    }


def _aside(moving: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions in which a velocity changes its path, and its attack, alone; shapes (n, 3) [-]."""
    flat = np.hypot(moving[:, 0], moving[:, 1])
    left = np.stack([-moving[:, 1], moving[:, 0], 0 * flat], axis=1) / flat[:, None]
    ahead = moving / np.linalg.norm(moving, axis=1)[:, None]
    return left, np.cross(ahead, left)


def _along(path: Smooth, direction: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Standard deviation of a slope along a direction, shape (n,)."""
    whole = path.variance(path.slope_weights, own.reshape(len(own), 9)).reshape(-1, 3, 3)
    return np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", direction, whole, direction), 0.0))
