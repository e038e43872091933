"""Arm and wrist motions made up after the thesis's descriptions, since it prints no records."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .runs import driven, eased, pieced

if TYPE_CHECKING:
    from ...model.drives import Drive

ACROSS = ((0.0, 0.0), (1.0, np.pi))
"""Arm of Figure 90, 0 to 180 degrees, slowed or quickened as needed [s, rad]."""

BACK_AND_FORTH = ((0.0, 0.0), (1.0, -np.pi / 2), (2.2, np.pi / 2), (3.2, 0.0))
"""Arm of Figure 91, 0 to -90 to 90 to 0 degrees [s, rad]."""

TURN = 1.0
"""Two thirds of a profile of Figure 99, in which the arm turns by 180 degrees [s]."""

IMPACT = 1.8
"""When a full swing meets the ball [s]; line 1923."""

FULL = {
    "arm": ((0.2, 0.0, 0.0), (1.2, -2.6, 0.0), (IMPACT, 0.0, 9.0), (2.6, 2.6, 0.0)),
    "wrist": ((0.2, 0.0, 0.0), (1.3, -1.6, 0.0), (IMPACT, 0.0, 16.0), (2.5, 1.6, 0.0)),
}
"""Waypoints of a full swing: time, angle and velocity, without acceleration [s, rad, rad/s]."""


def stretched(points: tuple[tuple[float, float], ...], factor: float) -> Any:
    """The same points of a motion, later by a factor [-]: times [s], angles [rad]."""
    return tuple((factor * time, angle) for time, angle in points)


def arm(points: tuple[tuple[float, float], ...], duration: float) -> Drive:
    """An arm that rests at each point [s, rad] and moves by a sine wave of acceleration."""
    return driven(duration, arm=eased(points))


def turns() -> dict[str, Drive]:
    """The four drives of Figure 99: the arm from 0 to 180 degrees in 1 s, then at rest.

    Returns:
        By name: a jump to a constant speed, a square wave of acceleration, half a wave of a
        cosine, and a whole sine wave, which begins gently.
    """
    from ...model.drives import Drive

    end, far = TURN, np.pi
    rest = (far, 0.0, 0.0, 0.0)
    bend = 4 * far / end**2
    square = ((0.0, 0.0, bend, 0.0), (far / 2, bend * end / 2, -bend, 0.0), rest)
    s = np.arange(241) / 240
    half = end * s, far * (1 - np.cos(np.pi * s)) / 2
    joints = {
        "instantaneous": pieced("arm", 0.0, (0.0, end), ((0.0, far / end, 0.0, 0.0), rest)),
        "square wave": pieced("arm", 0.0, (0.0, end / 2, end), square),
    }
    drives = {name: Drive(joints=(joint,)) for name, joint in joints.items()}
    drives["half sine wave"] = driven(1.5 * end, arm=half)
    drives["gentle sine wave"] = driven(1.5 * end, arm=eased(((0.0, 0.0), (end, far)), 240))
    return drives


def full_angles(times: np.ndarray, lag: float = 0.0) -> dict[str, np.ndarray]:
    """Arm and wrist of a full swing at given times [s], late by `lag` [s].

    Returns:
        By joint, the angle [rad]; quintics between the waypoints.
    """
    from scipy.interpolate import BPoly

    found = {}
    for joint, points in FULL.items():
        knots = [time for time, _, _ in points]
        curve = BPoly.from_derivatives(knots, [(angle, speed, 0.0) for _, angle, speed in points])
        found[joint] = curve(np.clip(times - lag, knots[0], knots[-1]))
    return found


def full_swing(duration: float, is_struck: bool = True) -> Drive:
    """A full swing as programmed, with a ball of 1 kN for 0.5 ms (line 1857) where struck.

    Args:
        duration: of the motion [s].
        is_struck: whether there is a ball.

    Returns:
        The drive of arm and wrist.
    """
    from dataclasses import replace

    from ...model.drives import impact

    times = np.arange(round(2.8 / 0.02) + 1) * 0.02
    angles = full_angles(times)
    drive = driven(duration, **{joint: (times, a) for joint, a in angles.items()})
    if not is_struck:
        return drive
    return replace(impact("clubhead", -1000.0, IMPACT, 5e-4), joints=drive.joints)


def fed_back(
    duration: float, stretch: float, ripple: float = 2e-3, until: float = 2.7, lag: float = 0.03
) -> Drive:
    """A full swing as a robot plays it: late, and with ripples at 6 and 11 Hz while it moves.

    Args:
        duration: of the motion [s].
        stretch: how much slower than the full swing [-].
        ripple: amplitude of each joint at 6 Hz; half of it at 11 Hz [rad].
        until: end of the ripple, on the full swing's clock [s].
        lag: of arm and wrist behind their command [s].

    Returns:
        The drive of arm and wrist, without a ball.
    """
    times = np.arange(round(duration / 0.01) + 1) * 0.01
    own = times / stretch
    moving = np.clip((own - 0.2) / 0.1, 0.0, 1.0) * np.clip((until - own) / 0.1, 0.0, 1.0)
    fade = moving**2 * (3 - 2 * moving)
    shake = np.sin(2 * np.pi * 6.0 * times) + 0.5 * np.sin(2 * np.pi * 11.0 * times + 1.0)
    angles = full_angles(own, lag / stretch)
    return driven(duration, **{j: (times, a + ripple * fade * shake) for j, a in angles.items()})
