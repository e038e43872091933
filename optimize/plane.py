"""From a golfer's points to the swing plane, the instant of impact, and arm, wrist and grip."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .markers import Filled, GolferPoints

BALL_RADIUS = 0.021
"""Radius of a ball as the thesis takes it [m]; section 8.2.2."""

SECTOR = math.pi / 4
"""How far from impact the clubhead's path counts for the plane, on either side [rad]."""

SLOW = 0.25
"""Share of the largest clubhead speed below which the downswing begins and ends [-]."""

TOP = math.radians(1.0)
"""How far the arm may be from its extreme at the top of the backswing [rad]."""

APPROACH = 0.020
"""How long before impact the paths are read to place it [s]; nothing of the blow is in it."""

FEWEST = 7
"""Fewest frames of that [-]."""

FAR = 0.15
"""Distance of clubhead and ball at impact that is passed over in silence [m]."""

OFF_PLANE = 0.10
"""RMS distance of the hands from the plane near impact that is passed over in silence [m]."""

TURN = 1.0
"""Most that an angle turns between frames before it is doubted [rad]."""


@dataclass(frozen=True)
class Impact:
    """When and how the clubhead comes to the ball.

    Attributes:
        time: instant at which the clubhead is nearest to where the ball is touched [s].
        distance: of the two at that instant [m].
        speed: of the clubhead on a straight shaft [m/s]; markers of 0.5 mm at 400 Hz tell it
            within some 0.5 m/s.
        bottom_time: when the clubhead is lowest near impact, for comparison [s].
    """

    time: float
    distance: float
    speed: float
    bottom_time: float


@dataclass(frozen=True, eq=False)
class SwingPlane:
    """The plane that fits the clubhead's path near impact best.

    Attributes:
        point: on it, shape (3,) [m].
        axes: rows: along the ground to the target, up the slope, normal; shape (3, 3) [-].
        inclination: angle between plane and ground [rad].
        about_target: first rotation, about the target line, which lifts the level axis to the
            left of the target up the slope; above a right angle for a left-handed golfer [rad].
        about_vertical: second rotation, of the line in which the plane meets the ground, to the
            left of the target line [rad].
        scatter: RMS distance of the clubhead from it within the sector [m].
        frames: of the sector [-].
    """

    point: np.ndarray
    axes: np.ndarray
    inclination: float
    about_target: float
    about_vertical: float
    scatter: float
    frames: int


@dataclass(frozen=True, eq=False)
class PlaneSwing:
    """A swing in its plane.

    Attributes:
        times: of the frames, shape (n,) [s].
        angles: arm, wrist and grip, shape (n, 3) [rad]. The arm is 0 where it hangs down the slope
            and grows toward the target; the wrist is the shaft's angle less the arm's; the grip
            grows clockwise as seen from above and is 0 at impact.
        impact: when and how.
        top_time: top of the backswing, where the arm turns back [s].
        plane: of the swing.
        arm_length: hub to hand in the plane, mean within the sector [m].
        off_plane: RMS distance of hands and of head from the plane, the whole swing [m].
        tee_piece_angle: of the tee piece about the shaft at impact, from the plane's normal [rad].
        filled: of the markers.
        warnings: what was found, in sentences.
        doubts: what makes the angles not to be trusted, in sentences.
    """

    times: np.ndarray
    angles: np.ndarray
    impact: Impact
    top_time: float
    plane: SwingPlane
    arm_length: float
    off_plane: tuple[float, float]
    tee_piece_angle: float
    filled: tuple[Filled, ...]
    warnings: tuple[str, ...]
    doubts: tuple[str, ...]


def plane_swing(
    points: GolferPoints,
    tee: np.ndarray,
    radius: float = BALL_RADIUS,
    target: np.ndarray | None = None,
) -> PlaneSwing:
    """Finds impact and swing plane, and the three angles of the robot in it.

    Args:
        points: of golfer and club; z up.
        tee: the marker on the tee, shape (3,) [m].
        radius: of the ball [m].
        target: level direction of the shot, shape (3,); x where None [-].

    Returns:
        The swing in its plane [s, rad, m].

    Raises:
        ValueError: where there is no downswing to be seen, or no plane.

    Source: thesis, sections 4.3.3 and 8.2.2; the instant between frames and the signs are ours.
    """
    along = _level(np.array([1.0, 0.0, 0.0]) if target is None else np.asarray(target, float))
    impact = find_impact(points, tee, radius, along)
    near = _sector(points, impact)
    plane = fit_plane(points.head[near], along)
    level, slope, normal = plane.axes
    arm = _turned(points.hand - points.hub, level, slope, points.times, impact.time)
    club = _turned(points.shaft, level, slope, points.times, impact.time)
    grip = _grip(points, normal)
    at_impact = float(_approach(points.times, grip[:, None], impact.time)[0][0])
    wrist = club - arm
    wrist -= 2 * math.pi * round(float(np.interp(impact.time, points.times, wrist)) / math.tau)
    angles = np.stack([arm, wrist, grip - at_impact], axis=1)
    reach = np.linalg.norm(((points.hand - points.hub) @ plane.axes.T)[:, :2], axis=1)
    off = [(one - plane.point) @ normal for one in (points.hand, points.head)]
    hands, head = (math.sqrt(float(np.mean(one**2))) for one in off)
    near_hands = math.sqrt(float(np.mean(off[0][near] ** 2)))
    return PlaneSwing(
        points.times,
        angles,
        impact,
        _top(points.times, arm, impact.time),
        plane,
        float(reach[near].mean()),
        (hands, head),
        math.remainder(at_impact, math.tau),
        points.filled,
        points.warnings,
        tuple(_doubts(impact, angles, near_hands)),
    )


def _top(times: np.ndarray, arm: np.ndarray, impact: float) -> float:
    """Middle of the instants at which the arm is within a degree of where it turns back [s]."""
    before = np.flatnonzero(times < impact)
    far = int(before[np.argmin(arm[before])])
    away = np.flatnonzero(arm[before] > arm[far] + TOP)
    first = int(away[away < far][-1]) + 1 if np.any(away < far) else 0
    last = int(away[away > far][0]) - 1 if np.any(away > far) else far
    return float(times[first] + times[last]) / 2


def _level(target: np.ndarray) -> np.ndarray:
    flat = np.array([target[0], target[1], 0.0])
    length = float(np.linalg.norm(flat))
    if not length > 0.0:
        raise ValueError(
            f"target: expected a level direction, found {target.tolist()}. Mend: write [1, 0, 0]."
        )
    return flat / length


def _doubts(impact: Impact, angles: np.ndarray, off: float) -> list[str]:
    found = []
    if impact.distance > FAR:
        found.append(
            f"At impact the clubhead is {1e3 * impact.distance:.0f} mm from the ball's edge; the "
            "tee's marker may belong to another day."
        )
    if off > OFF_PLANE:
        found.append(
            f"Near impact the hands are {1e3 * off:.0f} mm (RMS) off the clubhead's plane."
        )
    steps = np.max(np.abs(np.diff(angles, axis=0)), axis=0)
    for name, step in zip(("arm", "wrist", "grip"), steps.tolist(), strict=True):
        if step > TURN:
            found.append(
                f"The {name} turns by {math.degrees(step):.0f} degrees between two frames; it "
                "points across the plane there, and its angle means little."
            )
    return found


def find_impact(points: GolferPoints, tee: np.ndarray, radius: float, target: np.ndarray) -> Impact:
    """The instant at which the clubhead is nearest to the near edge of the ball.

    Looked for in the downswing and the follow-through, while the clubhead is quicker than a quarter
    of its largest speed, so that its rest behind the ball does not count. Placed between frames by
    a cubic through the last 20 ms before it, so that the blow does not count either.

    Args:
        points: of golfer and club.
        tee: the marker on the tee, where the ball's middle is, shape (3,) [m].
        radius: of the ball [m].
        target: level direction of the shot, of length 1, shape (3,) [-].

    Returns:
        The impact [s, m, m/s].

    Raises:
        ValueError: where no downswing is to be seen.
    """
    times, head = points.times, points.head
    speed = np.linalg.norm(np.gradient(head, times, axis=0), axis=1)
    fastest = int(np.argmax(speed))
    slow = np.flatnonzero(speed[:fastest] < SLOW * speed[fastest])
    later = np.flatnonzero(speed[fastest:] < SLOW * speed[fastest])
    end = fastest + int(later[0]) if later.size else len(times)
    if not slow.size or fastest - slow[-1] < FEWEST:
        raise ValueError(
            "clubhead: expected a downswing from near rest, found none in the frames that have all "
            "markers. Mend: use frames from before the top of the backswing on."
        )
    top = int(slow[-1])
    edge = np.asarray(tee, dtype=float) - radius * target
    away = np.linalg.norm(head - edge, axis=1)
    near = top + int(np.argmin(away[top:end]))
    instant = float(times[near])
    for _ in range(20):
        place, velocity = _approach(times, head, instant)
        step = float((edge - place) @ velocity / (velocity @ velocity))
        instant += step
        if abs(step) < 1e-9:
            break
    place, velocity = _approach(times, head, instant)
    bottom = top + int(np.argmin(head[top:end, 2]))
    return Impact(
        instant,
        float(np.linalg.norm(place - edge)),
        float(np.linalg.norm(velocity)),
        float(times[bottom]),
    )


def _approach(
    times: np.ndarray, values: np.ndarray, instant: float
) -> tuple[np.ndarray, np.ndarray]:
    """Value and rate at an instant, from a cubic through the frames just before it."""
    step = float(times[1] - times[0])
    last = int(np.searchsorted(times, instant + 0.25 * step, side="right"))
    last = min(max(last, FEWEST), len(times))
    first = max(0, last - max(FEWEST, round(APPROACH / step) + 1))
    since = (times[first:last] - instant) / step
    weights = np.linalg.lstsq(np.vander(since, 4, increasing=True), values[first:last], rcond=None)
    return weights[0][0], weights[0][1] / step


def _sector(points: GolferPoints, impact: Impact) -> np.ndarray:
    """Frames in which the clubhead, seen from the hub, is within 45 degrees of impact."""
    at = int(np.argmin(np.abs(points.times - impact.time)))
    arms = points.head - points.hub[at]
    arms /= np.linalg.norm(arms, axis=1)[:, None]
    inside = arms @ arms[at] >= math.cos(SECTOR)
    outside = np.flatnonzero(~inside)
    first = int(outside[outside < at][-1]) + 1 if np.any(outside < at) else 0
    last = int(outside[outside > at][0]) if np.any(outside > at) else len(inside)
    if last - first < FEWEST:
        raise ValueError(
            f"clubhead: expected at least {FEWEST} frames within 45 degrees of impact, found "
            f"{last - first}. Mend: measure at a higher rate."
        )
    return np.arange(first, last)


def fit_plane(path: np.ndarray, target: np.ndarray) -> SwingPlane:
    """The plane with the smallest sum of squared distances from a path.

    Args:
        path: shape (n, 3) [m], z up.
        target: level direction of the shot, of length 1, shape (3,) [-].

    Returns:
        The plane, with its two rotations [rad].

    Raises:
        ValueError: where the path is a straight line, or its plane is level.
    """
    point = path.mean(axis=0)
    _, sizes, rows = np.linalg.svd(path - point, full_matrices=False)
    normal = rows[2]
    upright = np.array([0.0, 0.0, 1.0])
    level = np.cross(upright, normal)
    if sizes[1] < 1e-3 * sizes[0] or np.linalg.norm(level) < 1e-3:
        raise ValueError(
            "clubhead: expected a curved path in a sloping plane near impact, found "
            f"{'a straight line' if sizes[1] < 1e-3 * sizes[0] else 'a level plane'}. Mend: check "
            "the axes of the room; z is up."
        )
    level /= np.linalg.norm(level)
    if level @ target < 0:
        level, normal = -level, -normal
    slope = np.cross(normal, level)
    left = np.cross(upright, target)
    return SwingPlane(
        point,
        np.stack([level, slope, normal]),
        math.acos(min(1.0, abs(float(normal[2])))),
        math.atan2(float(slope[2]), float(slope @ np.cross(upright, level))),
        math.atan2(float(level @ left), float(level @ target)),
        float(sizes[2]) / math.sqrt(len(path)),
        len(path),
    )


def _turned(
    arrows: np.ndarray, level: np.ndarray, slope: np.ndarray, times: np.ndarray, impact: float
) -> np.ndarray:
    """Angle of arrows in the plane, 0 down the slope, unbroken and within a turn at impact."""
    angle = np.unwrap(np.arctan2(arrows @ level, -(arrows @ slope)))
    return angle - math.tau * round(float(np.interp(impact, times, angle)) / math.tau)


def _grip(points: GolferPoints, normal: np.ndarray) -> np.ndarray:
    """Rotation of the tee piece about the shaft, from the plane's normal, unbroken."""
    shaft, piece = points.shaft, points.tee_piece
    across = normal - (shaft @ normal)[:, None] * shaft
    across /= np.linalg.norm(across, axis=1)[:, None]
    third = np.cross(shaft, across)
    cosine, sine = np.sum(piece * across, axis=1), np.sum(piece * third, axis=1)
    return np.unwrap(np.arctan2(sine, cosine))
