"""What the studies of the thesis simulate: its clubs, blows and driven joints, by our models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ...model.drives import Drive
    from ...model.linear import Port
    from ...model.motion import Motion
    from ...model.prescribed import Prescribed

TABLE_4 = {0: (290e3, 6000.0), 25: (180e3, 8000.0), 50: (130e3, 12000.0)}
"""Stiffness [N/m] and damping [N s/m] of a sleeve by its deadener [%]; lines 1246-1248."""

RIGID_GRIP = (500e3, 0.0)
"""Stiffness [N/m] and damping [N s/m] of a grip without a sleeve; lines 1157, 1161."""

RIGID_WRIST, FINAL_WRIST = (1e5, 2.0), (300.0, 15.0)
"""Stiffness [N m/rad] and damping [N m s/rad]; lines 1469 and 1801."""

IMPULSE = 0.255
"""Of the blow, fitted to the smallest RMS of line 1495 [N s]; see the study thesis/maps."""

RATE = 2048.0
"""Samples a second [Hz]; line 1058."""


def club(grip: tuple[float, float], wrist: tuple[float, float] = RIGID_WRIST, **more: float):
    """Numbers of preset robo_v with a grip [N/m, N s/m] and a wrist [N m/rad, N m s/rad].

    Args:
        grip: stiffness and damping of one of the four elements.
        wrist: its stiffness and damping.
        more: further numbers by name [SI].

    Returns:
        Every number by its name [SI].
    """
    from ...model.robot import PRESETS

    own = {"sleeve_stiffness": grip[0], "sleeve_damping": grip[1]}
    own |= {"wrist_stiffness": wrist[0], "wrist_damping": wrist[1]}
    return PRESETS["robo_v"] | own | more


def spaced(spacing: float) -> dict[str, float]:
    """Another distance between the two sets of springs [m], the butt of the club at the pivot."""
    return {"sleeve_spacing": spacing, "sleeve_offset": (0.250 - spacing) / 2}


@dataclass(frozen=True)
class Swing:
    """The slowest oscillation of a club.

    Attributes:
        frequency: damped [Hz].
        ratio: of damping [-].
    """

    frequency: float
    ratio: float


def slowest(p: Mapping[str, float], model: str = "fixed_collet") -> Swing:
    """The slowest oscillating mode of a robot with the numbers p [SI]."""
    from ...model.linear import modes
    from ...model.robot import Robot

    found = modes(Robot(model), p)
    return Swing(float(found.damped_frequencies[0]), float(found.damping_ratios[0]))


def head(place: str = "clubhead", quantity: str = "acceleration", frame: str = "collet") -> Port:
    """The sensor of the figures: relative to the collet, as the thesis subtracts it."""
    from ...model.linear import Port

    return Port(place, quantity, frame)


def instants(duration: float, rate: float = RATE) -> np.ndarray:
    """Uniform samples from 0 to `duration` [s]."""
    return np.arange(round(duration * rate) + 1) / rate


def move(model: str, p: Mapping[str, float], drive: Drive, times: np.ndarray) -> Motion:
    """One motion in the thesis's fidelity; its sensor is the clubhead's relative acceleration.

    Args:
        model: one of the six.
        p: its numbers by name [SI].
        drive: what moves it.
        times: uniform samples [s].

    Returns:
        The motion, exact.
    """
    from ...model.motion import respond
    from ...model.robot import Robot

    return respond(Robot(model), p, drive, times, (head(),))


def struck(
    p: Mapping[str, float], times: np.ndarray, impulse: float = IMPULSE, model: str = "pinned_wrist"
) -> np.ndarray:
    """Relative acceleration of the clubhead after a blow; t = 0 is the end of the blow.

    Args:
        p: numbers by name [SI].
        times: uniform samples from 0 on [s].
        impulse: of the blow on the clubhead [N s].
        model: one of the six.

    Returns:
        Shape (t,) [m/s^2].
    """
    from ...model.linear import Port
    from ...model.ringdown import after_impulse, free_samples
    from ...model.robot import Robot

    free = after_impulse(Robot(model), p, Port("clubhead", "force"), impulse, head())
    return np.asarray(free_samples(free, float(times[1]), len(times)))


def maxima(y: np.ndarray, share: float = 0.05) -> int:
    """How many positive maxima stand above a share of the largest magnitude [-]; any unit."""
    top = (y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:]) & (y[1:-1] > share * np.max(np.abs(y)))
    return int(np.sum(top))


def rms(y: np.ndarray) -> float:
    """Root mean square of samples [their unit]."""
    return float(np.sqrt(np.mean(np.asarray(y) ** 2)))


def eased(points: Sequence[tuple[float, float]], count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Rests at each point, and between two of them a sine wave of acceleration.

    Args:
        points: times [s] and angles [rad].
        count: rows of the profile between two points [-].

    Returns:
        Times [s] and angles [rad] of a profile, with three rows at rest before and after, so that
        a spline through it begins and ends without a jerk.
    """
    times, angles = [points[0][0]], [points[0][1]]
    for (t0, a0), (t1, a1) in pairwise(points):
        s = np.arange(1, count + 1) / count
        times += [*(t0 + s * (t1 - t0))]
        angles += [*(a0 + (a1 - a0) * (s - np.sin(2 * np.pi * s) / (2 * np.pi)))]
    rest = np.arange(1, 4) / count
    before = points[0][0] - rest[::-1] * (points[1][0] - points[0][0])
    after = points[-1][0] + rest * (points[-1][0] - points[-2][0])
    held = np.full(3, angles[0]), angles, np.full(3, angles[-1])
    return np.concatenate([before, times, after]), np.concatenate(held)


def driven(duration: float, **profiles: tuple[np.ndarray, np.ndarray]) -> Drive:
    """Joints that follow profiles: by joint, times [s] and angles [rad]; at rest beyond them."""
    from ...model.drives import Drive
    from ...model.prescribed import through

    joints = (
        through(joint, times.tolist(), angles.tolist(), duration)
        for joint, (times, angles) in profiles.items()
    )
    return Drive(joints=tuple(joints))


def square_turn(joint: str = "wrist", half: float = 0.5) -> Drive:
    """From -90 to 90 degrees by one constant acceleration and its opposite, `half` [s] each."""
    from ...model.drives import Drive

    far = np.pi / 2
    bend = far / (half * half / 2)
    pieces = ((-far, 0.0, bend, 0.0), (0.0, bend * half, -bend, 0.0), (far, 0.0, 0.0, 0.0))
    return Drive(joints=(pieced(joint, -far, (0.0, half, 2 * half), pieces),))


def pieced(joint: str, start: float, edges: Sequence[float], pieces: Sequence[Any]) -> Prescribed:
    """A joint at rest at `start` [rad], then cubic pieces [rad, rad/s, rad/s^2, rad/s^3]."""
    from ...model.prescribed import Prescribed

    return Prescribed(joint, (start, 0.0), tuple(edges), tuple(pieces))
