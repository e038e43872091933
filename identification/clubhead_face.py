"""The face of a club: its axes, the three angles of the thesis, and where a ball touches it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

REACH = 0.03
"""Distance of the points called toe and heel from the middle of the face [m]."""

_ROUNDS = 40


@dataclass(frozen=True)
class Face:
    """The face in the cloud's own coordinates.

    The axes of the room, and of a club that stands square at address, are those of the thesis's
    signs: x to the target, z up, y to the left of the target.

    Attributes:
        center: middle of the face, shape (3,) [m].
        normal: out of the face, to the target, shape (3,) [-].
        up: along the face, shape (3,) [-]; only its part across `normal` counts.
        bulge: radius of curvature from heel to toe [m]; infinite for a flat face.
        roll: radius of curvature from sole to crown [m].
        hand: of the golfer; a right-handed one has the toe on the right of the target.
    """

    center: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (1.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    bulge: float = float("inf")
    roll: float = float("inf")
    hand: Literal["right", "left"] = "right"

    @property
    def sign(self) -> float:
        """1 for a right-handed golfer, -1 for a left-handed one [-]."""
        return 1.0 if self.hand == "right" else -1.0

    @property
    def axes(self) -> np.ndarray:
        """Normal, left and up as columns in the cloud's coordinates, shape (3, 3) [-]."""
        normal = np.array(self.normal) / np.linalg.norm(self.normal)
        up = np.array(self.up) - normal * (normal @ np.array(self.up))
        up = up / np.linalg.norm(up)
        return np.stack([normal, np.cross(up, normal), up], axis=1)

    @property
    def toe(self) -> np.ndarray:
        """The point called toe, in the face's axes from its middle, shape (3,) [m]."""
        return np.array([0.0, -self.sign * REACH, 0.0])

    def angles(self, rotation: np.ndarray) -> np.ndarray:
        """Lie, dynamic loft and face angle.

        The rotation is ``Rx(roll) Ry(pitch) Rz(yaw)``. Positive lie is toe down, positive dynamic
        loft is less loft, positive face is closed; for a left-handed golfer the signs of roll and
        yaw are turned, so that the words stay true.

        Args:
            rotation: from the face's axes to the room's, shape (n, 3, 3) [-].

        Returns:
            Shape (n, 3) [rad]; nan where a rotation is.

        Source: thesis eq. 1 to 3 and sections 3.3.1 to 3.3.3.
        """
        told = np.isfinite(rotation).all(axis=(1, 2))
        found = np.full((len(rotation), 3), np.nan)
        if told.any():
            found[told] = Rotation.from_matrix(rotation[told]).as_euler("XYZ")
        return found * np.array([self.sign, 1.0, self.sign])

    def angle_rates(self, rotation: np.ndarray) -> np.ndarray:
        """Derivative of the three angles by a small turn about the room's axes.

        Args:
            rotation: shape (n, 3, 3) [-].

        Returns:
            Shape (n, 3, 3) [-]; it grows without bound towards a pitch of 90 degrees.
        """
        lie, pitch, _ = self.angles(rotation).T
        roll = self.sign * lie
        # columns: the axes about which roll, pitch and yaw turn, in the room
        turned = np.zeros((len(rotation), 3, 3))
        turned[:, 0, 0] = 1.0
        turned[:, 1, 1], turned[:, 2, 1] = np.cos(roll), np.sin(roll)
        turned[:, 0, 2] = np.sin(pitch)
        turned[:, 1, 2] = -np.sin(roll) * np.cos(pitch)
        turned[:, 2, 2] = np.cos(roll) * np.cos(pitch)
        inverse = np.linalg.pinv(turned)
        return inverse * np.array([self.sign, 1.0, self.sign])[None, :, None]

    def touch(self, ball: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The point of the face nearest to a ball's center.

        Args:
            ball: centers in the face's axes from its middle, shape (n, 3) [m].

        Returns:
            The points, shape (n, 3) [m], and the signed distances to the centers, shape (n,) [m].
        """
        x, y, z = ball.T
        left, up = y, z
        for _ in range(_ROUNDS if self._curved else 1):
            ahead = x + np.minimum(self._depth(left, up), 0.1)
            left = y / np.maximum(1 + ahead / self.bulge, 0.2)
            up = z / np.maximum(1 + ahead / self.roll, 0.2)
        foot = np.stack([-self._depth(left, up), left, up], axis=1)
        return foot, np.linalg.norm(ball - foot, axis=1) * np.sign(x + self._depth(y, z))

    def pierced(self, ball: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Where a line through a ball's center meets the face.

        Args:
            ball: in the face's axes from its middle, shape (n, 3) [m].
            direction: of the line, in the same axes, shape (n, 3), any unit.

        Returns:
            Shape (n, 3) [m].

        Source: thesis, section 3.4.5.
        """
        point = ball
        for _ in range(_ROUNDS if self._curved else 1):
            target = -self._depth(point[:, 1], point[:, 2]) if self._curved else 0.0
            share = (target - ball[:, 0]) / direction[:, 0]
            point = ball + share[:, None] * direction
        return point

    @property
    def _curved(self) -> bool:
        return bool(np.isfinite(self.bulge) or np.isfinite(self.roll))

    def _depth(self, left: np.ndarray, up: np.ndarray) -> np.ndarray:
        """How far a curved face lies behind the plane that touches its middle [m]."""
        return left**2 / (2 * self.bulge) + up**2 / (2 * self.roll)


def turn_matrix(vector: np.ndarray) -> np.ndarray:
    """Rotations of rotation vectors [rad], shape (n, 3, 3) [-]."""
    return Rotation.from_rotvec(vector).as_matrix()


def turn_rate(vector: np.ndarray) -> np.ndarray:
    """Matrices that turn the rate of a rotation vector into an angular velocity in the room.

    Args:
        vector: shape (n, 3) [rad].

    Returns:
        The left Jacobian of the rotation group, shape (n, 3, 3) [-].
    """
    angle = np.linalg.norm(vector, axis=1)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(small, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    cross = np.cross(vector[:, None, :], np.eye(3)[None], axis=2).swapaxes(1, 2)
    return np.eye(3) + first[:, None, None] * cross + second[:, None, None] * cross @ cross
