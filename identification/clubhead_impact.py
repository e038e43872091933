"""The last frames before an impact, as one smooth motion: when, where and how the face arrived."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import chdtri, stdtrit  # scipy.stats takes half a second to import

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

LOUD = 7.0
"""Power of a tone, in that of the noise, from which it is part of the motion [-]: one of a thousand
tones of noise is."""

CHANCE = 1e-3
"""Chance of a misfit from which it is none [-]."""

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
    times: np.ndarray | None = None,
) -> Approach:
    """Gathers the frames before an impact.

    Args:
        center: of the face, shape (n, 3) [m].
        axes: of the face in the room, shape (n, 3, 3) [-].
        covariance: of center and turn, shape (n, 6, 6) [m^2, m rad, rad^2].
        rows: the frames; the last is the reference.
        rate: frames a second [Hz].
        arc: on which the face swings; as the frames tell where None.
        times: from the last frame, none later, shape (n,) [s]; by the rate where None.

    Returns:
        The frames.
    """
    turn = axes[rows[-1]]
    at: np.ndarray = (rows - rows[-1]) / rate if times is None else times
    arc = arc_of(at, center[rows]) if arc is None else arc
    on_arc, turned, _, _ = arc.state(at)
    unturned = np.swapaxes(turned, 1, 2)
    vector = Rotation.from_matrix(unturned @ axes[rows] @ turn.T).as_rotvec()
    back = np.linalg.inv(turn_rate(vector)) @ unturned
    whole = np.zeros((len(rows), 6, 6))
    whole[:, :3, :3], whole[:, 3:, 3:] = np.eye(3), back
    own = whole @ covariance[rows] @ np.swapaxes(whole, 1, 2)
    values = np.concatenate([center[rows] - on_arc, vector], axis=1)
    return Approach(at, values, own, turn, arc)


def fit(approach: Approach, count: int, degree: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Polynomials through the last frames of an approach.

    Args:
        approach: the frames.
        count: how many of the last.
        degree: of the polynomials [-].

    Returns:
        Coefficients (degree + 1, 6) in time over that of the first frame fitted, their covariance
        [m^2, m rad, rad^2], and the reduced chi2 [-].
    """
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


def window_of(approach: Approach, shortest: int = SHORTEST) -> int:
    """The longest window whose truncation is small beside its noise, and not below `shortest`.

    Args:
        approach: the frames.
        shortest: in frames [-].

    Returns:
        Its length [frames].
    """
    longest = len(approach.times)
    if longest <= shortest:
        return longest
    solved, covariance, _ = fit(approach, longest, DEGREE + 1)
    # of what noise alone may have made of it, nothing is held against a window
    noise = np.sqrt(np.diag(covariance).reshape(solved.shape)[-1])
    fourth = solved[-1] * np.maximum(1.0 - (noise / solved[-1]) ** 2, 0.0)
    span = -approach.times[0]
    for count in range(longest, shortest, -1):
        times = approach.times[-count:]
        scale = -times[0]
        powers = (times / scale)[:, None] ** np.arange(DEGREE + 1)
        solver = np.linalg.pinv(powers)
        missed = (solver @ (times / span) ** (DEGREE + 1))[1] / scale * fourth
        own = np.einsum("n,nii->i", solver[1] ** 2, approach.covariance[-count:]) / scale**2
        if np.all(np.abs(missed) <= TRUNCATION * np.sqrt(own)):
            return count
    return shortest


def _unlikely(chi2: float, count: int, degree: int) -> bool:
    free = 6 * (count - degree - 1)
    return bool(chi2 > chdtri(free, CHANCE) / free)


def tones_beside(approach: Approach, solved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What frames do beside a smooth motion, as a ringing shaft does: tones out of the noise.

    Args:
        approach: the frames.
        solved: coefficients of a fit to all of them, shape (degree + 1, 6).

    Returns:
        Angular frequencies, shape (f,) [rad/s], and powers, shape (f, 6) [m^2 or rad^2].
    """
    times, own, count = approach.times, approach.covariance, len(approach.times)
    powers = (times / -times[0])[:, None] ** np.arange(len(solved))
    rest = approach.values - powers @ solved
    beat = 2 * np.pi * np.arange(1, count // 2) / (-times[0])
    tones = 2 * np.abs(np.exp(-1j * np.outer(beat, times)) @ rest) ** 2 / count**2
    noise = 2 * np.diagonal(own, axis1=1, axis2=2).mean(axis=0) / count
    tones = np.where(tones > LOUD * noise, tones, 0.0)
    return beat, tones


def _missed(approach: Approach, count: int, beat: np.ndarray, tones: np.ndarray) -> np.ndarray:
    """Covariance of what tones of unknown phase make of a fit to the last frames, (24, 24).

    A tone is still there at the impact: what is missed is its own place and speed there, less
    what a cubic makes of it.
    """
    times = approach.times[-count:]
    scale = -times[0]
    solver = np.linalg.pinv((times / scale)[:, None] ** np.arange(DEGREE + 1))
    missed = solver @ np.exp(1j * np.outer(times, beat))
    missed[0] -= 1.0
    missed[1] -= 1j * beat * scale
    block = np.einsum("pf,qf,fk->pqk", missed, missed.conj(), tones).real
    whole = np.zeros((DEGREE + 1, 6, DEGREE + 1, 6))
    for k in range(6):
        whole[:, k, :, k] = block[:, :, k]
    return whole.reshape(6 * (DEGREE + 1), -1)


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
        self,
        coefficients: np.ndarray,
        times: np.ndarray,
        ball: np.ndarray | None,
        points: np.ndarray,
    ) -> np.ndarray:
        """All of UNITS, and the speeds of some points, shape (n, 10 + k) or (n, 14 + k)."""
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
        for point in points:
            columns.append(np.linalg.norm(velocity + np.cross(turning, axes @ point), axis=1))
        return np.stack(columns, axis=1)


def arrive(
    approach: Approach,
    face: Face,
    ball: Ball | None,
    after: tuple[float, float],
    freedom: int,
    points: Mapping[str, np.ndarray] | None = None,
) -> tuple[dict[str, float], dict[str, float], int, float, float]:
    """Fits the approach and reads the impact off it, with errors.

    Args:
        approach: frames before the impact.
        face: of the club.
        ball: at rest; None where there is none.
        after: instant from the last frame and its standard deviation [s], used without a ball.
        freedom: degrees of freedom behind the noise [-].
        points: of the club, by name, in the face's axes from its middle, shape (3,) each [m].

    Returns:
        Values and standard deviations by name (SI units as in UNITS, time from the last frame;
        ``NAME_speed`` of each point [m/s]), frames fitted, reduced chi2, and the quantile of a
        95 % interval [-].
    """
    count = window_of(approach)
    solved, covariance, chi2 = fit(approach, count, DEGREE)
    if _unlikely(chi2, count, DEGREE):
        covariance = covariance * chi2
    longest, finer = len(approach.times), DEGREE + 2
    if longest > 2 * finer:
        followed, _, misfit = fit(approach, longest, finer)
        if _unlikely(misfit, longest, finer):
            covariance = covariance + _missed(approach, count, *tones_beside(approach, followed))
    arrival = _Arrival(approach, -approach.times[-count], face, ball.radius if ball else 0.0)
    size = solved.size
    own = np.zeros((size + 3, size + 3))
    own[:size, :size] = covariance
    own[size:, size:] = np.diag([after[1] ** 2, 1e-30, 1e-30]) if ball is None else ball.covariance
    base = np.concatenate([solved.ravel(), [after[0], 0, 0] if ball is None else ball.center])
    step = np.maximum(np.sqrt(np.diag(own)), 1e-9)
    tried = np.concatenate([base[None], base + np.diag(step), base - np.diag(step)])
    coefficients, extra = tried[:, :size].reshape(-1, DEGREE + 1, 6), tried[:, size:]
    away = np.array(list((points or {}).values())).reshape(-1, 3)
    if ball is None:
        found = arrival.results(coefficients, extra[:, 0], None, away)
    else:
        found = arrival.results(coefficients, arrival.instant(coefficients, extra), extra, away)
    many, known = len(base), list(UNITS)[: found.shape[1] - len(away)]
    slopes = (found[1 : many + 1] - found[many + 1 :]) / (2 * step[:, None])
    stds = np.sqrt(np.maximum(np.einsum("pk,pq,qk->k", slopes, own, slopes), 0.0))
    names = [*known, *(f"{name}_speed" for name in points or {})]
    quantile = float(stdtrit(max(1, freedom), 0.975))
    values = dict(zip(names, found[0].tolist(), strict=True))
    return values, dict(zip(names, stds.tolist(), strict=True)), count, chi2, quantile


def extrapolated(approach: Approach, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the middle of the face would be without the blow.

    Args:
        approach: frames before it.
        time: from the last of them [s].

    Returns:
        Place [m], its covariance [m^2] and velocity [m/s], shapes (3,), (3, 3) and (3,).
    """
    count = window_of(approach)
    solved, covariance, _ = fit(approach, count, DEGREE)
    scale = -approach.times[-count]
    arrival = _Arrival(approach, scale, Face(), 0.0)
    place, _, velocity, _ = arrival.state(solved[None], np.array([time]))
    powers = (time / scale) ** np.arange(DEGREE + 1)
    pick = np.kron(powers, np.eye(6)[:3])
    return place[0], pick @ covariance @ pick.T, velocity[0]
