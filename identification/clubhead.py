"""From markers on a club to its angles, speed and path, and where the ball met the face."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from .clubhead_arc import STRAIGHT
from .clubhead_ball import Ball
from .clubhead_face import Face
from .clubhead_impact import (
    LONGEST,
    ROUGH,
    SHORTEST,
    UNITS,
    Impact,
    approach_of,
    arrive,
    window_of,
)
from .clubhead_path import DEGREE, Smooth, notch, smooth_path
from .clubhead_pose import FEWEST, Poses, fit_poses

CONTACT = 0.0006
"""How long a ball stays on the face at most [s]; thesis, section 3.2: typically 0.5 ms."""

PRACTICE = 0.012
"""Stretch over which a swing without an impact is smoothed [s]."""

NEAR_FACE = 0.06
"""Distance from the middle of the face within which a ball can be met [m]."""

LEAST_ROUGHNESS = 1e-6
"""Misfit of the smooth motion that passes in silence, however exact the markers are [m]."""

SPAN = (0.01, 0.8)
"""Radius of gyration of a club's markers that passes for one in metres [m]."""

UNITS_APART = {1e3: "mm read as m", 1e-3: "m read as mm", 25.4: "inches read as mm",
               1 / 25.4: "mm read as inches", 10.0: "mm read as cm", 0.1: "cm read as mm",
               100.0: "cm read as m", 0.01: "m read as cm", 39.37: "inches read as m",
               0.0254: "m read as inches"}  # fmt: skip
"""Ratios of the markers' distances to the cloud's, and what makes them [-]."""

GOOD = "good"
NO_IMPACT = "no_impact"
IN_DOUBT = "in_doubt"


@dataclass(frozen=True, eq=False)
class Club:
    """Markers on a club, measured once at rest.

    Attributes:
        names: of the markers.
        cloud: their places, shape (m, 3) [m].
        face: in the cloud's coordinates.
    """

    names: tuple[str, ...]
    cloud: np.ndarray
    face: Face = field(default_factory=Face)


@dataclass(frozen=True, eq=False)
class Swing:
    """Markers in the room, frame by frame.

    Attributes:
        name: of the swing.
        path: its file.
        rate: frames a second [Hz].
        names: of the markers.
        places: shape (n, m, 3) [m], x to the target and z up; nan where a marker was lost.
        files: every file read, with its SHA-256.
    """

    name: str
    path: Path
    rate: float
    names: tuple[str, ...]
    places: np.ndarray
    files: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Clubhead:
    """What a swing's markers tell.

    Attributes:
        swing: the markers.
        club: the cloud.
        ball: None where there is none.
        poses: of the club, with the middle of the face as origin.
        angles: lie, dynamic loft, face of each frame, shape (n, 3) [rad]; see `Face.angles`.
        angle_stds: shape (n, 3) [rad].
        speeds: of the middle of the face, toe and heel, smoothed, shape (n, 3) [m/s]; nan within a
            contact.
        speed_stds: shape (n, 3) [m/s].
        path_angle: of the smoothed velocity, to the left of the target, shape (n,) [rad].
        attack_angle: of the smoothed velocity, upward, shape (n,) [rad].
        direction_std: of both, shape (n,) [rad].
        raw_speed: distance from the frame before, times the rate, shape (n,) [m/s].
        raw_speed_std: shape (n,) [m/s].
        raw_attack_angle: of that step against the floor, shape (n,) [rad].
        width: of the smoothing [frames].
        impact: None where there was none.
        losses: speed lost through impact by middle, toe and heel, each with its standard
            deviation, shape (3, 2) [m/s]; None where not told.
        status: ``good``, ``no_impact`` or ``in_doubt``.
        warnings: what was found, in sentences.
    """

    swing: Swing
    club: Club
    ball: Ball | None
    poses: Poses
    angles: np.ndarray
    angle_stds: np.ndarray
    speeds: np.ndarray
    speed_stds: np.ndarray
    path_angle: np.ndarray
    attack_angle: np.ndarray
    direction_std: np.ndarray
    raw_speed: np.ndarray
    raw_speed_std: np.ndarray
    raw_attack_angle: np.ndarray
    width: int
    impact: Impact | None
    losses: np.ndarray | None
    status: str
    warnings: tuple[str, ...]


def measure_clubhead(swing: Swing, club: Club, ball: Ball | None = None) -> Clubhead:
    """Pose, angles, speed and path of every frame, and the impact.

    Args:
        swing: markers in the room.
        club: markers on the club; matched by name.
        ball: at rest before the impact.

    Returns:
        Everything with its error; doubts are in its status and warnings.

    Raises:
        ValueError: where the cloud gives no pose, names do not match, or the units cannot be.

    Source: thesis chapter 3. Its ``dividing the distance by the sampling rate`` (section 3.4.6)
    is read as by the time between frames.
    """
    names, cloud, places = _matched(swing, club)
    said = _check_size(swing, cloud, places)
    poses = fit_poses(cloud - np.array(club.face.center), places, names)
    axes = poses.rotation @ club.face.axes
    if poses.found.sum() <= DEGREE + 2:
        expected = f"more than {DEGREE + 2} frames with {FEWEST} markers that agree with the cloud"
        raise _wrong(swing, expected, f"{poses.found.sum()} of {len(places)}", "check the names")
    impact, told = _impact(swing, club, ball, poses, axes)
    width = impact.smoothed if impact else max(SHORTEST, round(PRACTICE * swing.rate))
    segment = _segments(len(places), swing.rate, impact)
    curves = _curves(club.face, poses, axes, swing.rate, width, segment)
    losses, more = _losses(curves, impact, segment)
    warnings = (*said, *poses.warnings, *told, *more)
    if ball is not None:
        warnings += ball.warnings
    doubt = bool(told) or poses.drifting or poses.found.mean() < 0.5 or bool(ball and ball.warnings)
    status = IN_DOUBT if doubt else GOOD if impact else NO_IMPACT
    return Clubhead(
        swing=swing, club=club, ball=ball, poses=poses, **curves, width=width, impact=impact,
        losses=losses, status=status, warnings=warnings,
    )  # fmt: skip


def _wrong(swing: Swing, expected: str, found: str, mend: str) -> ValueError:
    return ValueError(f"{swing.path}: expected {expected}, found {found}. Mend: {mend}.")


def _matched(swing: Swing, club: Club) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """The markers that cloud and swing share."""
    for label, names in (("cloud", club.names), ("swing", swing.names)):
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise _wrong(swing, f"one {label} marker '{twice}'", "it twice", "rename one")
    shared = tuple(name for name in club.names if name in swing.names)
    if len(shared) < FEWEST:
        expected = f"at least {FEWEST} markers named as in the cloud"
        listed = ", ".join(shared) or "none"
        raise _wrong(swing, expected, listed, "name the columns as the cloud names its markers")
    cloud = club.cloud[[club.names.index(name) for name in shared]]
    size = np.linalg.svd(cloud - cloud.mean(axis=0), compute_uv=False)
    if not size[1] > 0.01 * size[0]:
        found = "a line, about which the club could turn unseen"
        raise _wrong(swing, "a cloud spread over a plane at least", found, "add a marker beside it")
    return shared, cloud, swing.places[:, [swing.names.index(name) for name in shared]]


def _check_size(swing: Swing, cloud: np.ndarray, places: np.ndarray) -> list[str]:
    """Refuses what can only be a wrong unit, and tells a scale that is slightly off."""
    gyration = float(np.sqrt(np.mean(np.sum((cloud - cloud.mean(axis=0)) ** 2, axis=1))))
    there = np.asarray(np.isfinite(places).all(axis=2))
    full = np.flatnonzero(there.sum(axis=1) >= FEWEST)
    if not len(full):
        raise _wrong(swing, f"frames with {FEWEST} markers", "none", "check the columns")
    rows = full[:: max(1, len(full) // 400)]
    weight = there[rows].astype(float) / there[rows].sum(axis=1, keepdims=True)
    seen = np.where(there[rows][..., None], places[rows], 0.0)
    ratios = np.sqrt(_spread(seen, weight) / _spread(cloud[None] + 0 * seen, weight))
    ratio = float(np.median(ratios))
    if not 0.8 < ratio < 1.25:
        likely = [text for value, text in UNITS_APART.items() if 0.9 < ratio / value < 1.1]
        hint = f" ({likely[0]}?)" if likely else ""
        found = f"them {ratio:.4g} times as far apart{hint}"
        raise _wrong(swing, "markers as far apart as in the cloud", found, "correct the unit")
    if not SPAN[0] < gyration < SPAN[1]:
        found = f"markers some {gyration:.3g} m from their middle"
        raise _wrong(swing, "a club", found, "correct the unit of cloud and swing: mm or m")
    error = np.std(ratios) / np.sqrt(len(ratios)) + 1e-9
    if abs(ratio - 1) > max(0.005, 6 * error):
        return [f"The markers are {100 * (ratio - 1):+.2g} % further apart than in the cloud."]
    return []


def _spread(places: np.ndarray, weight: np.ndarray) -> np.ndarray:
    middle = np.einsum("nm,nmi->ni", weight, places)
    return np.einsum("nm,nmi->n", weight, (places - middle[:, None]) ** 2)


def _impact(
    swing: Swing, club: Club, ball: Ball | None, poses: Poses, axes: np.ndarray
) -> tuple[Impact | None, list[str]]:
    """The impact, by the ball where there is one, by the loss of speed elsewhere; and doubts."""
    along = np.sqrt(np.trace(poses.covariance[:, :3, :3], axis1=1, axis2=2) / 3)
    found = notch(poses.position, poses.found, swing.rate, along, CONTACT)
    words: list[str] = []
    if ball is not None:
        frame = _reached(club.face, ball, poses, axes, found[0] if found else 0.0)
        if frame is None:
            return None, ["The face never reaches the ball: check its place, or the axes."]
        late = CONTACT * swing.rate + 3
        if found is not None and abs(found[0] - frame) > late:
            words.append(
                f"The face reaches the ball after frame {frame}, but speed is lost after frame "
                f"{found[0]:.0f}: the ball, or the middle of the face, is not where it is said."
            )
    elif found is not None:
        frame = int(found[0])
    else:
        return None, []
    longest = round(LONGEST * swing.rate)
    rows = np.flatnonzero(poses.found[: frame + 1])
    rows = rows[rows > rows[-1] - longest] if len(rows) else rows
    if len(rows) < DEGREE + 3:
        return None, [f"Only {len(rows)} frames come before the impact: too few for its speed."]
    seen = poses.position, axes, poses.covariance, rows, swing.rate
    approach, smoothed = approach_of(*seen), window_of(approach_of(*seen, STRAIGHT))
    after = ((0.5 + frame - rows[-1]) / swing.rate, 0.6 / swing.rate)
    values, stds, count, chi2, quantile = arrive(approach, club.face, ball, after, poses.freedom)
    if chi2 > ROUGH and np.sqrt(chi2) * poses.noise > LEAST_ROUGHNESS:
        words.append(
            f"The {count} frames before the impact are no smooth motion: their misfit has "
            f"{chi2:.2g} times the power of the noise. The errors were widened by that."
        )
    if not all(map(np.isfinite, (*values.values(), *stds.values()))):
        return None, ["The frames before the impact give no motion towards the ball."]
    values["time"] += rows[-1] / swing.rate
    by = "notch" if ball is None else "ball"
    return Impact(values, stds, quantile, frame, count, smoothed, chi2, by, tuple(words)), words


def _reached(face: Face, ball: Ball, poses: Poses, axes: np.ndarray, likely: float) -> int | None:
    """The last frame before the face touches the ball; of several, the one nearest to `likely`."""
    rows = np.flatnonzero(poses.found)
    own = np.einsum("nij,ni->nj", axes[rows], ball.center - poses.position[rows])
    foot, distance = face.touch(own)
    gap = distance - ball.radius
    near = np.linalg.norm(foot, axis=1) < NEAR_FACE
    crossed = np.flatnonzero((gap[:-1] > 0) & (gap[1:] <= 0) & near[1:])
    if not crossed.size:
        return None
    return int(rows[crossed[np.abs(rows[crossed] - likely).argmin()]])


def _segments(count: int, rate: float, impact: Impact | None) -> np.ndarray:
    """0 before, 1 during and 2 after a contact, shape (n,)."""
    if impact is None:
        return np.zeros(count, dtype=int)
    last = impact.frame + int(np.ceil(CONTACT * rate))
    row = np.arange(count)
    return (row > impact.frame).astype(int) + (row > last)


def _curves(
    face: Face, poses: Poses, axes: np.ndarray, rate: float, width: int, segment: np.ndarray
) -> dict[str, np.ndarray]:
    rates = face.angle_rates(np.nan_to_num(axes) + np.where(poses.found, 0.0, 1.0)[:, None, None])
    turn = rates @ poses.covariance[:, 3:, 3:] @ np.swapaxes(rates, 1, 2)
    angle_stds = np.sqrt(np.diagonal(turn, axis1=1, axis2=2))
    place = poses.position
    speeds, speed_stds, smooth = [], [], None
    for side in (0.0, 1.0, -1.0):
        arm = side * axes @ face.toe
        path = smooth_path(place + arm, poses.found, rate, width, segment)
        size = np.linalg.norm(path.slope, axis=1)
        speeds.append(size)
        own = _moved(poses.covariance, arm)
        speed_stds.append(_along(path, path.slope / size[:, None], own))
        smooth = smooth or path
    assert smooth is not None
    slope, own = smooth.slope, poses.covariance[:, :3, :3]
    flat = np.hypot(slope[:, 0], slope[:, 1])
    left = np.stack([-slope[:, 1], slope[:, 0], 0 * flat], axis=1) / flat[:, None]
    step = np.full((len(place), 3), np.nan)
    step[1:] = np.diff(place, axis=0)
    size = np.linalg.norm(step, axis=1)
    both = own.copy()
    both[1:] += own[:-1]
    spread = np.einsum("ni,nij,nj->n", step, both, step) / size**2
    return {
        "angles": face.angles(axes),
        "angle_stds": angle_stds,
        "speeds": np.stack(speeds, axis=1),
        "speed_stds": np.stack(speed_stds, axis=1),
        "path_angle": np.arctan2(slope[:, 1], slope[:, 0]),
        "attack_angle": np.arctan2(slope[:, 2], flat),
        "direction_std": _along(smooth, left, own) / speeds[0],
        "raw_speed": size * rate,
        "raw_speed_std": np.sqrt(spread) * rate,
        "raw_attack_angle": np.arctan2(step[:, 2], np.hypot(step[:, 0], step[:, 1])),
    }


def _moved(covariance: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Covariance of a point beside the origin, shape (n, 3, 3) [m^2]."""
    cross = np.cross(np.eye(3)[None], arm[:, None, :]).swapaxes(1, 2)
    whole = np.concatenate([np.broadcast_to(np.eye(3), cross.shape), cross], axis=2)
    return whole @ covariance @ np.swapaxes(whole, 1, 2)


def _along(path: Smooth, direction: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Standard deviation of a slope along a direction, shape (n,)."""
    whole = path.variance(path.slope_weights, own.reshape(len(own), 9)).reshape(-1, 3, 3)
    return np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", direction, whole, direction), 0.0))


def _losses(
    curves: dict[str, np.ndarray], impact: Impact | None, segment: np.ndarray
) -> tuple[np.ndarray | None, list[str]]:
    """Speed lost by middle, toe and heel; a sentence where toe and heel part."""
    if impact is None:
        return None, []
    rows = np.flatnonzero((segment == 2) & np.isfinite(curves["speeds"][:, 0]))
    if not len(rows):
        return None, []
    after, stds = curves["speeds"][rows[0]], curves["speed_stds"][rows[0]]
    before = np.array([impact.values[key] for key in ("speed", "toe_speed", "heel_speed")])
    own = np.array([impact.stds[key] for key in ("speed", "toe_speed", "heel_speed")])
    losses = np.stack([before - after, np.hypot(own, stds)], axis=1)
    parted = losses[1, 0] - losses[2, 0]
    if abs(parted) < 4 * np.hypot(losses[1, 1], losses[2, 1]):
        return losses, []
    side, other = ("toe", "heel") if parted > 0 else ("heel", "toe")
    return losses, [
        f"The {side} lost {abs(parted):.2g} m/s more than the {other}: an impact off the center, "
        f"on the {side} side."
    ]


def intervals(impact: Impact) -> dict[str, tuple[float, float]]:
    """95 % intervals of an impact's values.

    Args:
        impact: of a swing.

    Returns:
        Lower and upper end by name, in the SI units of the values.
    """
    return {
        name: (
            impact.values[name] - impact.quantile * impact.stds[name],
            impact.values[name] + impact.quantile * impact.stds[name],
        )
        for name in UNITS
        if name in impact.values
    }


def with_face(club: Club, three: np.ndarray) -> Club:
    """A club whose face is the plane through three of its markers.

    Args:
        club: whose face tells which way the normal points, and what is up.
        three: places in the cloud's coordinates, shape (3, 3) [m].

    Returns:
        The club with that face; its middle is the middle of the three.

    Raises:
        ValueError: where the three lie in a line.

    Source: thesis, section 3.4.5.
    """
    normal = np.cross(three[1] - three[0], three[2] - three[0])
    size = np.linalg.norm(normal)
    if size < 1e-8:
        raise ValueError("face: expected three markers in a triangle, found a line. Mend: others.")
    normal = normal / size * np.sign(normal @ np.array(club.face.normal) or 1.0)
    center = three.mean(axis=0)
    face = replace(club.face, center=tuple(center.tolist()), normal=tuple(normal.tolist()))
    return replace(club, face=face)
