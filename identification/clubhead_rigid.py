"""A rigid cloud of points laid onto measured ones: rotation, position, and their covariance."""

from __future__ import annotations

import numpy as np

THINNEST = 1e-4
"""Least spread across the longest line of the markers seen, as a share of that along it [-]."""


def rigid_fit(
    cloud: np.ndarray, seen: np.ndarray, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Least-squares rotation and position of a cloud in every frame.

    Args:
        cloud: places on the club, shape (m, 3) [m].
        seen: places in the room, shape (n, m, 3) [m].
        used: which of them count, shape (n, m).

    Returns:
        Rotations, shape (n, 3, 3) [-], and positions of the cloud's origin, shape (n, 3) [m].

    Source: W. Kabsch, Acta Crystallographica A 34 (1978) 827; proper rotations only.
    """
    weights = used.astype(float)
    count = np.maximum(weights.sum(axis=1), 1.0)[:, None]
    places = np.where(used[..., None], seen, 0.0)
    middle = places.sum(axis=1) / count
    own = weights @ cloud / count
    away = np.where(used[..., None], seen - middle[:, None], 0.0)
    cross = np.swapaxes(away, 1, 2) @ (cloud[None] - own[:, None])
    left, _, right = np.linalg.svd(cross)
    left[..., 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    rotation = left @ right
    return rotation, middle - np.einsum("nij,nj->ni", rotation, own)


def pose_covariance(
    cloud: np.ndarray, rotation: np.ndarray, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of every pose for markers of unit noise, and how far each marker is its own judge.

    Args:
        cloud: shape (m, 3) [m].
        rotation: shape (n, 3, 3) [-].
        used: shape (n, m).

    Returns:
        Covariances of position and turn, shape (n, 6, 6) [1, 1/m, 1/m^2], and the mean leverage
        of a marker's three coordinates, shape (n, m) [-]; nan where the markers lie in one line.
    """
    weights = used.astype(float)
    count = np.maximum(weights.sum(axis=1), 1.0)
    own = weights @ cloud / count[:, None]
    away = cloud[None] - own[:, None]
    second = np.einsum("nm,nmi,nmj->nij", weights, away, away, optimize=True)
    size = np.linalg.eigvalsh(second)
    thin = size[:, 1] <= THINNEST**2 * np.maximum(size[:, 2], 1e-300)
    turning = size.sum(axis=1)[:, None, None] * np.eye(3) - second
    turning[thin] = np.eye(3)
    local = np.linalg.inv(turning)
    turn = rotation @ local @ np.swapaxes(rotation, 1, 2)
    arm = _cross_matrix(np.einsum("nij,nj->ni", rotation, own))
    covariance = np.empty((len(used), 6, 6))
    covariance[:, :3, :3] = np.eye(3) / count[:, None, None] + arm @ turn @ np.swapaxes(arm, 1, 2)
    covariance[:, :3, 3:] = arm @ turn
    covariance[:, 3:, :3] = np.swapaxes(covariance[:, :3, 3:], 1, 2)
    covariance[:, 3:, 3:] = turn
    covariance[thin] = np.nan
    # trace of [a] L [a]' is a'(tr(L) I - L)a
    spread = np.trace(local, axis1=1, axis2=2)[:, None, None] * np.eye(3) - local
    turned = np.einsum("nmi,nmi->nm", away @ spread, away)
    return covariance, 1.0 / count[:, None] + turned / 3.0


def moved(covariance: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Covariance of a point beside the origin.

    Args:
        covariance: of the origin and a small turn, shape (n, 6, 6) [m^2, m rad, rad^2].
        arm: from the origin to the point, in the room, shape (n, 3) [m].

    Returns:
        Shape (n, 3, 3) [m^2].
    """
    whole = np.concatenate([np.broadcast_to(np.eye(3), (len(arm), 3, 3)), swing_of(arm)], axis=2)
    return whole @ covariance @ np.swapaxes(whole, 1, 2)


def swing_of(arm: np.ndarray) -> np.ndarray:
    """Matrices that turn a small turn into the move of a point beside the origin.

    Args:
        arm: from the origin to the point, shape (..., 3) [m].

    Returns:
        Shape (..., 3, 3) [m].
    """
    return -_cross_matrix(arm)


def _cross_matrix(vectors: np.ndarray) -> np.ndarray:
    """Matrices [a] with [a] b = a x b, shape (n, 3, 3)."""
    matrix = np.zeros((*vectors.shape[:-1], 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrix[..., k, j] = vectors[..., i]
        matrix[..., j, k] = -vectors[..., i]
    return matrix
