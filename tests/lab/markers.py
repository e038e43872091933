"""Made-up swings seen by cameras: a rigid club on an exact motion, its markers, and a blow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BALL_RADIUS = 0.02135
MASS = 0.2
INERTIA = np.array([3.0e-4, 2.5e-4, 4.5e-4])  # about the face's normal, left, up [kg m^2]
CENTER_OF_MASS = np.array([-0.03, 0.0, 0.0])  # behind the middle of the face [m]


WANDER = np.array([9.0, 14.0, 6.0])  # how fast the swing's axis wanders: ahead, aside, up [rad/s]
PHASES = np.array([0.0, 1.2, 0.5])


def turning(axis: str, angle: np.ndarray | float) -> np.ndarray:
    """The matrices as the thesis prints them, eq. 3a, 3b, 3c."""
    angle = np.asarray(angle, dtype=float)
    c, s, o, i = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    rows = {
        "x": [[i, o, o], [o, c, -s], [o, s, c]],
        "y": [[c, o, s], [o, i, o], [-s, o, c]],
        "z": [[c, -s, o], [s, c, o], [o, o, i]],
    }[axis]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


@dataclass(frozen=True)
class Truth:
    """What was made up: SI units, angles of the thesis, points from the middle of the face."""

    lie: float
    loft: float
    face: float
    speed: float
    path: float
    attack: float
    toe: float
    up: float
    time: float
    toe_speed: float
    heel_speed: float
    closing: float


@dataclass(frozen=True)
class MadeUp:
    """Markers of a swing: cloud (m, 3), seen (n, m, 3) with nan where lost, the ball, the truth."""

    cloud: np.ndarray
    seen: np.ndarray
    ball: np.ndarray
    rate: float
    truth: Truth
    rotation: np.ndarray
    position: np.ndarray
    frame: float


def make_cloud(count: int, rng: np.random.Generator) -> np.ndarray:
    """Markers on crown, toe and hosel, behind the face: a flattened shell; never in a line."""
    while True:
        around = rng.uniform(-np.pi, np.pi, count)
        height = rng.uniform(0.0, 0.9, count)
        ring = np.sqrt(1 - height**2)
        cloud = np.stack(
            [-0.045 + 0.045 * ring * np.cos(around), 0.055 * ring * np.sin(around), 0.035 * height],
            axis=1,
        )
        size = np.linalg.svd(cloud - cloud.mean(axis=0), compute_uv=False)
        if size[1] > 0.02 * np.sqrt(count):
            return cloud


def make_swing(
    seed: int,
    markers: int = 12,
    noise: float = 5e-5,
    lost: float = 0.0,
    rate: float = 5000.0,
    before: int = 75,
    after: int = 40,
    blow: bool = True,
    touch: tuple[float, float] | None = None,
    curved: tuple[float, float] | None = None,
    least: int = 3,
    hub: float = 0.0,
) -> MadeUp:
    """One swing: the club turns about an axis behind the golfer, on a slanted plane, and closes.

    The middle of the face moves on a circle whose angular speed grows; the club also turns
    about its own up axis. Nothing here is a polynomial. The ball is put where the face meets it.

    Args:
        touch: where the ball touches, toe and up [m]; drawn where None.
        curved: radii of bulge and roll [m]; flat where None.
        lost: most that may be lost of the markers in a frame; `least` always stay.
        hub: how far the axis wanders meanwhile, so that the path is no circle [m].
    """
    rng = np.random.default_rng(seed)
    speed, radius = rng.uniform(30.0, 52.0), rng.uniform(1.5, 1.9)
    slant, path, attack = rng.uniform(0.6, 0.9), rng.normal(0.0, 0.05), rng.normal(-0.02, 0.04)
    alpha, beta, gamma = rng.normal(0.0, 0.06, 3)
    closing, gain = rng.uniform(10.0, 35.0), rng.uniform(-1.0, 2.0)
    place = rng.normal(0.0, 0.3, 3)
    toe, up = rng.uniform(-0.02, 0.02), rng.uniform(-0.012, 0.012)
    if touch is not None:
        toe, up = touch
    late = rng.uniform(0.05, 0.95)
    times = (np.arange(before + after) - before + 1 - late) / rate  # 0 at the impact
    heading = turning("z", path) @ turning("y", -attack)
    turn_axis = heading @ turning("x", slant) @ np.array([0.0, 0.0, 1.0])
    spoke = heading @ turning("x", slant) @ np.array([0.0, -radius, 0.0])
    omega = speed / radius
    square = turning("x", alpha) @ turning("y", beta) @ turning("z", gamma)

    def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angle = omega * t + 0.5 * gain * omega * t**2 * 20.0
        swung = about(turn_axis, angle)
        own = about(square[:, 2], closing * t * np.cos(8.0 * t))
        waves = np.sin(np.outer(t, WANDER) + PHASES) - np.sin(PHASES)
        away = place + hub * waves @ heading.T
        return swung @ own @ square, away + np.einsum("nij,j->ni", swung, spoke) - spoke

    rotation, position = motion(times)
    rate_of_turn = omega * turn_axis + closing * square[:, 2]
    velocity = np.cross(omega * turn_axis, spoke)
    velocity = velocity + hub * heading @ (WANDER * np.cos(PHASES))
    foot, normal = np.array([0.0, -toe, up]), np.array([1.0, 0.0, 0.0])
    if curved is not None:
        foot[0] = -(toe**2) / (2 * curved[0]) - up**2 / (2 * curved[1])
        normal = np.array([1.0, -toe / curved[0], up / curved[1]])
        normal /= np.linalg.norm(normal)
    ball = place + square @ (foot + BALL_RADIUS * normal)
    if blow:
        _strike(times, rotation, position, velocity, rate_of_turn, square, foot, normal)
    cloud = make_cloud(markers, rng)
    exact = np.einsum("nij,mj->nmi", rotation, cloud) + position[:, None]
    seen = exact + noise * rng.standard_normal(exact.shape)
    order = rng.random(seen.shape[:2]).argsort(axis=1).argsort(axis=1)
    gone = np.minimum(rng.integers(0, int(lost * markers) + 1, len(times)), markers - least)
    seen[order < np.maximum(gone, 0)[:, None]] = np.nan
    # angles of the thesis, from R = Rx Ry Rz; their rate about the room's axes
    columns = np.stack(
        [[1.0, 0, 0], turning("x", alpha)[:, 1], (turning("x", alpha) @ turning("y", beta))[:, 2]],
        1,
    )
    rates = np.linalg.solve(columns, rate_of_turn)
    arm = np.cross(rate_of_turn, square @ np.array([0.0, -0.03, 0.0]))
    truth = Truth(
        alpha, beta, gamma, float(np.linalg.norm(velocity)),
        float(np.arctan2(velocity[1], velocity[0])),
        float(np.arctan2(velocity[2], np.hypot(velocity[0], velocity[1]))), toe, up,
        (before - 1 + late) / rate, float(np.linalg.norm(velocity + arm)),
        float(np.linalg.norm(velocity - arm)), float(rates[2]),
    )  # fmt: skip
    return MadeUp(cloud, seen, ball, rate, truth, rotation, position, before - 1 + late)


def about(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotations about a unit axis, after Rodrigues, shape (n, 3, 3)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle)[:, None, None]
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def _strike(
    times: np.ndarray,
    rotation: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    turn: np.ndarray,
    square: np.ndarray,
    foot: np.ndarray,
    normal: np.ndarray,
) -> None:
    """After the touch, the free club loses what the ball takes, over half a millisecond."""
    pulse, contact = 0.046 * 1.4 * np.linalg.norm(velocity), 5e-4
    push = -pulse * (square @ normal)
    inertia = square @ np.diag(INERTIA) @ square.T
    lever = square @ (foot - CENTER_OF_MASS)
    spin = np.linalg.solve(inertia, np.cross(lever, push))
    slowed = push / MASS + np.cross(spin, square @ -CENTER_OF_MASS)
    after = times > 0
    t = times[after]
    # a half sine of force: its integral twice
    grown = np.where(
        t < contact,
        0.5 * (t - contact / np.pi * np.sin(np.pi * t / contact)),
        t - 0.5 * contact,
    )
    size = np.linalg.norm(spin)
    axis = spin / size if size > 0 else np.array([0.0, 0.0, 1.0])
    rotation[after] = about(axis, size * grown) @ rotation[after]
    position[after] += grown[:, None] * slowed


def ball_markers(center: np.ndarray, count: int, noise: float, seed: int) -> np.ndarray:
    """Markers on the upper half of a ball, shape (count, 3)."""
    rng = np.random.default_rng(seed)
    around = rng.uniform(0, 2 * np.pi) + np.arange(count) * 2.4
    height = rng.uniform(0.1, 0.9, count)
    ring = np.sqrt(1 - height**2)
    out = np.stack([ring * np.cos(around), ring * np.sin(around), height], axis=1)
    return center + BALL_RADIUS * out + noise * rng.standard_normal((count, 3))
