"""The last frames before an impact, as one smooth motion: when, where and how the face arrived."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import t as student

from .clubhead_arc import Arc, arc_of
from .clubhead_ball import Ball
from .clubhead_face import Face, turn_matrix, turn_rate
from .clubhead_path import DEGREE

LONGEST = 0.015
"""Longest stretch before the impact that is fitted [s]."""

SHORTEST = 12
"""Fewest frames that are fitted [-]."""

TRUNCATION = 0.25
"""Largest truncation that a window may have, in standard deviations of its velocity [-]."""

ROUGH = 2.0
"""Misfit of the smooth motion, in the power of the noise, from which it is told [-]."""

UNITS = {
    "time": "s", "lie_angle": "rad", "dynamic_loft": "rad", "face_angle": "rad", "speed": "m/s",
    "path_angle": "rad", "attack_angle": "rad", "toe_speed": "m/s", "heel_speed": "m/s",
    "closing_rate": "rad/s", "impact_toe": "m", "impact_up": "m", "impact_toe_by_path": "m",
    "impact_up_by_path": "m",
}  # fmt: skip
"""What an impact has, with units [-]; without a ball the last four are left out."""


@dataclass(frozen=True, eq=False)
class Impact:
    """What the face did at the instant of impact.

    Attributes:
        values: by name: time from the first frame [s]; lie_angle, dynamic_loft, face_angle,
            path_angle (positive to the left), attack_angle (positive upward) [rad]; speed of the
            middle of the face, toe_speed, heel_speed [m/s]; closing_rate [rad/s]; impact_toe and
            impact_up, where the ball first touches, from the middle of the face [m], and the same
            ``_by_path``, on the line along the face's travel through the ball's center [m].
        stds: their standard deviations, in the same units.
        quantile: half of a 95 % interval in standard deviations [-].
        frame: the last frame before the impact.
        frames: how many were fitted [-].
        smoothed: over how many polynomials follow the club without its arc [-].
        reduced_chi2: misfit of the smooth motion in the power of the noise [-].
        by: ``ball`` or ``notch``: what told the instant.
        warnings: what is in doubt, in sentences.
    """

    values: dict[str, float]
    stds: dict[str, float]
    quantile: float
    frame: int
    frames: int
    smoothed: int
    reduced_chi2: float
    by: str
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Approach:
    """Frames before an impact, ready to be fitted.

    Attributes:
        times: from the last frame, shape (n,) [s].
        values: middle of the face beside its arc [m], and turn from the last frame of a face that
            went back along the arc [rad], shape (n, 6).
        covariance: shape (n, 6, 6) [m^2, m rad, rad^2].
        turn: the face's axes in the last frame, shape (3, 3) [-].
        arc: on which the face swings.
    """

    times: np.ndarray
    values: np.ndarray
    covariance: np.ndarray
    turn: np.ndarray
    arc: Arc


def approach_of(
    center: np.ndarray,
    axes: np.ndarray,
    covariance: np.ndarray,
    rows: np.ndarray,
    rate: float,
    arc: Arc | None = None,
) -> Approach:
    """Gathers the frames before an impact.

    Args:
        center: of the face, shape (n, 3) [m].
        axes: of the face in the room, shape (n, 3, 3) [-].
        covariance: of center and turn, shape (n, 6, 6) [m^2, m rad, rad^2].
        rows: the frames; the last is the reference.
        rate: frames a second [Hz].
        arc: on which the face swings; as the frames tell where None.

    Returns:
        The frames.
    """
    turn, times = axes[rows[-1]], (rows - rows[-1]) / rate
    arc = arc_of(times, center[rows]) if arc is None else arc
    on_arc, turned, _, _ = arc.state(times)
    unturned = np.swapaxes(turned, 1, 2)
    vector = Rotation.from_matrix(unturned @ axes[rows] @ turn.T).as_rotvec()
    back = np.linalg.inv(turn_rate(vector)) @ unturned
    whole = np.zeros((len(rows), 6, 6))
    whole[:, :3, :3], whole[:, 3:, 3:] = np.eye(3), back
    own = whole @ covariance[rows] @ np.swapaxes(whole, 1, 2)
    values = np.concatenate([center[rows] - on_arc, vector], axis=1)
    return Approach(times, values, own, turn, arc)


def _fit(approach: Approach, count: int, degree: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients (degree + 1, 6) in scaled time, their covariance, and the reduced chi2."""
    times, values = approach.times[-count:], approach.values[-count:]
    scale = -times[0]
    powers = (times / scale)[:, None] ** np.arange(degree + 1)
    own = approach.covariance[-count:]
    white = np.linalg.inv(np.linalg.cholesky(own))
    design = np.einsum("nij,np->nipj", white, powers).reshape(6 * count, -1)
    wanted = np.einsum("nij,nj->ni", white, values).ravel()
    size = np.linalg.norm(design, axis=0)
    left, sizes, right = np.linalg.svd(design / size, full_matrices=False)
    solved = right.T @ ((left.T @ wanted) / sizes) / size
    rest = wanted - design @ solved
    covariance = (right.T / sizes**2) @ right / size[:, None] / size
    free = 6 * (count - degree - 1)
    return solved.reshape(degree + 1, 6), covariance, float(rest @ rest) / free


def window_of(approach: Approach) -> int:
    """The longest window whose truncation is small beside its noise [frames]."""
    longest = len(approach.times)
    if longest <= SHORTEST:
        return longest
    solved, covariance, _ = _fit(approach, longest, DEGREE + 1)
    # of what noise alone may have made of it, nothing is held against a window
    noise = np.sqrt(np.diag(covariance).reshape(solved.shape)[-1])
    fourth = solved[-1] * np.maximum(1.0 - (noise / solved[-1]) ** 2, 0.0)
    span = -approach.times[0]
    for count in range(longest, SHORTEST, -1):
        times = approach.times[-count:]
        scale = -times[0]
        powers = (times / scale)[:, None] ** np.arange(DEGREE + 1)
        solver = np.linalg.pinv(powers)
        missed = (solver @ (times / span) ** (DEGREE + 1))[1] / scale * fourth
        own = np.einsum("n,nii->i", solver[1] ** 2, approach.covariance[-count:]) / scale**2
        if np.all(np.abs(missed) <= TRUNCATION * np.sqrt(own)):
            return count
    return SHORTEST


class _Arrival:
    """The smooth motion, evaluated for many sets of coefficients at once."""

    def __init__(self, approach: Approach, scale: float, face: Face, radius: float) -> None:
        self.turn, self.arc = approach.turn, approach.arc
        self.scale, self.face, self.radius = scale, face, radius

    def state(self, coefficients: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, ...]:
        """Center [m], axes, velocity [m/s] and angular velocity [rad/s] at some times [s]."""
        powers = (times / self.scale)[:, None] ** np.arange(DEGREE + 1)
        place = np.einsum("np,npk->nk", powers, coefficients)
        rates = np.arange(1, DEGREE + 1) * powers[:, :-1] / self.scale
        slope = np.einsum("np,npk->nk", rates, coefficients[:, 1:])
        on_arc, turned, velocity, along = self.arc.state(times)
        axes = turned @ turn_matrix(place[:, 3:]) @ self.turn
        own = np.einsum("nij,nj->ni", turn_rate(place[:, 3:]), slope[:, 3:])
        turning = along + np.einsum("nij,nj->ni", turned, own)
        return on_arc + place[:, :3], axes, velocity + slope[:, :3], turning

    def gap(
        self, coefficients: np.ndarray, times: np.ndarray, ball: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Distance of face and ball [m], the point that is nearest [m], the ball [m], the speed."""
        center, axes, velocity, turning = self.state(coefficients, times)
        own = np.einsum("nij,ni->nj", axes, ball - center)
        foot, distance = self.face.touch(own)
        there = np.einsum("nij,nj->ni", axes, foot)
        moving = velocity + np.cross(turning, there)
        out = own - foot
        out /= np.linalg.norm(out, axis=1)[:, None] * np.sign(distance)[:, None]
        closing = np.einsum("ni,nij,nj->n", moving, axes, out)
        return distance - self.radius, foot, own, closing

    def instant(self, coefficients: np.ndarray, ball: np.ndarray) -> np.ndarray:
        """When the face first touches the ball, from the last frame [s]."""
        times = np.zeros(len(coefficients))
        for _ in range(12):
            distance, _, _, closing = self.gap(coefficients, times, ball)
            times = times + np.clip(distance / closing, -self.scale, self.scale)
        return times

    def results(
        self, coefficients: np.ndarray, times: np.ndarray, ball: np.ndarray | None
    ) -> np.ndarray:
        """All of UNITS, shape (n, 10) or (n, 14)."""
        _, axes, velocity, turning = self.state(coefficients, times)
        toe = np.cross(turning, axes @ self.face.toe)
        angles = self.face.angles(axes)
        closing = np.einsum("nij,nj->ni", self.face.angle_rates(axes), turning)[:, 2]
        flat = np.hypot(velocity[:, 0], velocity[:, 1])
        columns = [
            times, *angles.T, np.linalg.norm(velocity, axis=1),
            np.arctan2(velocity[:, 1], velocity[:, 0]), np.arctan2(velocity[:, 2], flat),
            np.linalg.norm(velocity + toe, axis=1), np.linalg.norm(velocity - toe, axis=1), closing,
        ]  # fmt: skip
        if ball is not None:
            _, foot, own, _ = self.gap(coefficients, times, ball)
            line = self.face.pierced(own, np.einsum("nij,ni->nj", axes, velocity))
            for point in (foot, line):
                columns += [-self.face.sign * point[:, 1], point[:, 2]]
        return np.stack(columns, axis=1)


def arrive(
    approach: Approach, face: Face, ball: Ball | None, after: tuple[float, float], freedom: int
) -> tuple[dict[str, float], dict[str, float], int, float, float]:
    """Fits the approach and reads the impact off it, with errors.

    Args:
        approach: frames before the impact.
        face: of the club.
        ball: at rest; None where there is none.
        after: instant from the last frame and its standard deviation [s], used without a ball.
        freedom: degrees of freedom behind the noise [-].

    Returns:
        Values and standard deviations by name (SI units as in UNITS, time from the last frame),
        frames fitted, reduced chi2, and the quantile of a 95 % interval [-].
    """
    count = window_of(approach)
    solved, covariance, chi2 = _fit(approach, count, DEGREE)
    covariance = covariance * max(1.0, chi2 if chi2 > ROUGH else 1.0)
    arrival = _Arrival(approach, -approach.times[-count], face, ball.radius if ball else 0.0)
    size = solved.size
    own = np.zeros((size + 3, size + 3))
    own[:size, :size] = covariance
    own[size:, size:] = np.diag([after[1] ** 2, 1e-30, 1e-30]) if ball is None else ball.covariance
    base = np.concatenate([solved.ravel(), [after[0], 0, 0] if ball is None else ball.center])
    step = np.maximum(np.sqrt(np.diag(own)), 1e-9)
    points = np.concatenate([base[None], base + np.diag(step), base - np.diag(step)])
    coefficients, extra = points[:, :size].reshape(-1, DEGREE + 1, 6), points[:, size:]
    if ball is None:
        found = arrival.results(coefficients, extra[:, 0], None)
    else:
        found = arrival.results(coefficients, arrival.instant(coefficients, extra), extra)
    many = len(base)
    slopes = (found[1 : many + 1] - found[many + 1 :]) / (2 * step[:, None])
    stds = np.sqrt(np.maximum(np.einsum("pk,pq,qk->k", slopes, own, slopes), 0.0))
    names = list(UNITS)[: found.shape[1]]
    quantile = float(student.isf(0.025, max(1, freedom)))
    values = dict(zip(names, found[0].tolist(), strict=True))
    return values, dict(zip(names, stds.tolist(), strict=True)), count, chi2, quantile
