"""A swing profile: points for arm, wrist and grip, limits of the motors, the robot's files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

from ..model.door import write_beside
from .profile_file import PodHeader, csv_text, read_pod_text, write_pod

AXES = ("arm", "wrist", "grip")
"""Axes of the robot, in the order of every table here."""

QUANTITIES = ("angle", "velocity", "acceleration", "jerk")
"""What is limited, in the order of the derivatives."""

UNITS = ("rad", "rad/s", "rad/s^2", "rad/s^3")
"""Units of the quantities."""

POINTS = 1000
"""Points of each axis in the robot's file [-]; thesis, section 8.2.2."""

TOLERANCE = 1e-3
"""Share by which a limit may be passed in silence [-]: no task states one more exactly."""

EVEN = 1e-6
"""How far a point may lie off equal steps [of a step]."""

CSV, POD = "profile.csv", "profile.pod"
"""Names of the two files of a profile."""

Interpolation = Literal["cubic", "pchip", "linear"]
"""How the controller joins points: a C2 spline at rest at both ends, PCHIP, or straight lines."""


class Course(NamedTuple):
    """A motion of the three axes at some instants.

    Attributes:
        angles: shape (t, 3) [rad].
        velocities: shape (t, 3) [rad/s].
        accelerations: shape (t, 3) [rad/s^2].
        jerks: shape (t, 3) [rad/s^3].
    """

    angles: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    jerks: np.ndarray


@dataclass(frozen=True, eq=False)
class SwingProfile:
    """What the robot is told: equally spaced points for each axis, and how it joins them.

    Attributes:
        time: of the points, from 0 in equal steps, shape (n,) [s].
        arm_angle: shape (n,) [rad].
        wrist_angle: shape (n,) [rad].
        grip_angle: shape (n,) [rad].
        impact_time: instant of impact, which need not be a point [s].
        quantum: last digit of the file [degrees]; 0 for angles that are not rounded.
        interpolation: ``cubic``, a C2 spline clamped to rest at both ends; ``pchip``; ``linear``.
        phases: instants by name, such as start, top, impact and end [s].
    """

    time: np.ndarray
    arm_angle: np.ndarray
    wrist_angle: np.ndarray
    grip_angle: np.ndarray
    impact_time: float
    quantum: float = 1e-4
    interpolation: Interpolation = "cubic"
    phases: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("time", "arm_angle", "wrist_angle", "grip_angle"):
            values = np.array(getattr(self, name), dtype=float)
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        _check(self)

    @property
    def angles(self) -> np.ndarray:
        """The angles as they were given, one column an axis, shape (n, 3) [rad]."""
        return np.stack([self.arm_angle, self.wrist_angle, self.grip_angle], axis=1)

    @cached_property
    def read_angles(self) -> np.ndarray:
        """The angles as the robot reads them, rounded to the quantum, shape (n, 3) [rad]."""
        if not self.quantum:
            return self.angles
        return np.radians(np.rint(np.degrees(self.angles) / self.quantum) * self.quantum + 0.0)

    @cached_property
    def curve(self) -> PPoly:
        """The motion that the robot makes of the points: one cubic a step and axis.

        Its coefficients have shape (4, n - 1, 3) [rad/s^3 ... rad], the highest power first.
        """
        points = self.read_angles
        if self.interpolation == "cubic":
            return CubicSpline(self.time, points, bc_type="clamped")
        if self.interpolation == "pchip":
            return PchipInterpolator(self.time, points)
        slopes = np.diff(points, axis=0) / np.diff(self.time)[:, None]
        none = np.zeros_like(slopes)
        return PPoly(np.stack([none, none, slopes, points[:-1]]), self.time)

    def at(self, times: np.ndarray) -> Course:
        """The motion as the robot plays it; at rest before the first point and after the last.

        Args:
            times: any instants, shape (t,) [s].

        Returns:
            Angles, velocities, accelerations and jerks, each of shape (t, 3), columns as in `AXES`
            [rad, rad/s, rad/s^2, rad/s^3]; just after a point where one of them jumps there.
        """
        times = np.asarray(times, dtype=float)
        first, last = self.time[0], self.time[-1]
        moves = ((times >= first) & (times <= last))[:, None]
        inside = np.clip(times, first, last)
        found = [self.curve(inside, order) for order in range(4)]
        return Course(found[0], *(np.where(moves, one, 0.0) for one in found[1:]))


def _check(profile: SwingProfile) -> None:
    count = len(profile.time)
    for name in ("time", "arm_angle", "wrist_angle", "grip_angle"):
        values = getattr(profile, name)
        if values.shape != (count,) or count < 4:
            found = f"shape {values.shape}"
            raise _wrong(name, f"at least 4 points, as many as in 'time' ({count})", found)
        if not np.isfinite(values).all():
            raise _wrong(name, "finite numbers", f"{values[~np.isfinite(values)][0]}")
    end = profile.time[-1]
    even = np.linspace(0.0, end, count)
    if end <= 0 or np.max(np.abs(profile.time - even)) > EVEN * even[1]:
        raise _wrong("time", "equal steps from 0", f"{profile.time[:3]} ...", "resample the swing")
    for name, instant in {"impact_time": profile.impact_time, **profile.phases}.items():
        if not 0.0 <= instant <= end * (1 + EVEN):
            raise _wrong(name, f"an instant between 0 and {end:g} s", f"{instant:g} s")
    for name in profile.phases:
        if not name.isidentifier():
            raise _wrong("phases", "names of letters, digits and underscores", f"'{name}'")
    if not (math.isfinite(profile.quantum) and profile.quantum >= 0.0):
        raise _wrong("quantum", "degrees, 0 or more", f"{profile.quantum}")
    if profile.interpolation not in ("cubic", "pchip", "linear"):
        expected = "'cubic', 'pchip' or 'linear'"
        raise _wrong("interpolation", expected, f"'{profile.interpolation}'")


def _wrong(name: str, expected: str, found: str, mend: str = "correct it") -> ValueError:
    return ValueError(f"swing profile: {name}: expected {expected}, found {found}. Mend: {mend}.")


@dataclass(frozen=True)
class AxisLimits:
    """What the motor of one axis can do; infinite where it is not limited.

    Attributes:
        angle: lowest and highest [rad].
        velocity: largest magnitude [rad/s].
        acceleration: largest magnitude [rad/s^2].
        jerk: largest magnitude [rad/s^3].
    """

    angle: tuple[float, float] = (-math.inf, math.inf)
    velocity: float = math.inf
    acceleration: float = math.inf
    jerk: float = math.inf

    def __post_init__(self) -> None:
        low, high = self.angle
        if not low < high or math.isinf(low) != math.isinf(high):
            found = f"[{low:g}, {high:g}]"
            raise _wrong("limits, angle", "two numbers, the lower one first", found)
        for name in QUANTITIES[1:]:
            if not getattr(self, name) > 0.0:
                raise _wrong(f"limits, {name}", "more than 0", f"{getattr(self, name)}")

    def most(self, quantity: str) -> tuple[float, float]:
        """Middle and half width of what is allowed of a quantity [SI units of the quantity]."""
        if quantity != "angle":
            return 0.0, getattr(self, quantity)
        low, high = self.angle
        return (0.0, math.inf) if math.isinf(low) else ((low + high) / 2, (high - low) / 2)


@dataclass(frozen=True)
class Limits:
    """Limits of the three motors.

    Attributes:
        arm: of the arm.
        wrist: of the wrist.
        grip: of the grip's rotation; not limited where nothing is known.
    """

    arm: AxisLimits = AxisLimits()
    wrist: AxisLimits = AxisLimits()
    grip: AxisLimits = AxisLimits()


ROBO_V = Limits(
    arm=AxisLimits((-3.5, 3.5), 25.0, 600.0, 2.0e4),
    wrist=AxisLimits((-2.2, 2.2), 60.0, 1200.0, 8.0e4),
)
"""Limits assumed of the Robo V where none are stated; its maker's are not public."""


@dataclass(frozen=True)
class Use:
    """How much of one limit a profile uses at most, and where.

    Attributes:
        axis: arm, wrist or grip.
        quantity: angle, velocity, acceleration or jerk.
        ratio: 1 on the limit; of an angle, its distance from the middle of what is allowed over
            half of that [-].
        time: instant of the largest use [s].
        value: of the quantity there [SI units of the quantity].
        limit: the bound on that side [SI units of the quantity].
        unit: of value and limit.
    """

    axis: str
    quantity: str
    ratio: float
    time: float
    value: float
    limit: float
    unit: str


def excess(profile: SwingProfile, limits: Limits) -> tuple[Use, ...]:
    """The largest use of every limit, at and between the points, of what the robot plays.

    Between points the motion is a cubic, so its extremes and those of its derivatives are found in
    closed form, not by sampling. Outside the profile the robot rests. Where a derivative jumps, at
    a point of ``pchip`` or ``linear`` or at an end, the jump counts as spread over one step: no
    drive does better than its clock.

    Args:
        profile: rounded and joined as it states.
        limits: of the motors.

    Returns:
        Twelve uses: the four quantities of arm, of wrist and of grip, with units as in `Use`.
    """
    found = []
    courses = [_extremes(profile, order) for order in range(4)]
    for column, axis in enumerate(AXES):
        bounds: AxisLimits = getattr(limits, axis)
        for order, quantity in enumerate(QUANTITIES):
            times, values = courses[order][0], courses[order][1][:, column]
            middle, half = bounds.most(quantity)
            at = int(np.argmax(np.abs(values - middle)))
            value, time = float(values[at]), float(times[at, column])
            bound = middle + math.copysign(half, value - middle)
            ratio = abs(value - middle) / half
            found.append(Use(axis, quantity, ratio, time, value, bound, UNITS[order]))
    return tuple(found)


def _extremes(profile: SwingProfile, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Where a derivative can be extreme, and what it is there, shapes (k, 3) [s; SI units]."""
    c, knots = profile.curve.c, profile.curve.x
    steps = np.broadcast_to(np.diff(knots)[:, None], c[0].shape)
    inner = {0: _roots(3 * c[0], 2 * c[1], c[2]), 1: _roots(0 * c[0], 3 * c[0], c[1])}
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for offset in (np.zeros_like(steps), steps, *inner.get(order, ())):
        reached = np.clip(np.where(np.isfinite(offset), offset, 0.0), 0.0, steps)
        found.append((knots[:-1, None] + reached, _derivative(c, reached, order)))
    if order >= 2:
        found.append((knots, _jumps(c, steps, order - 1)))
    if order == 3:  # a velocity that jumps: the acceleration spread over a step changes in turn
        lines = np.diff(_jumps(c, steps, 1), axis=0, prepend=0.0, append=0.0) / steps[0]
        found.append((np.append(knots, knots[-1]), lines))
    shaped = [np.broadcast_to(t.reshape(len(t), -1), v.shape) for t, v in found]
    return np.concatenate(shaped), np.concatenate([values for _, values in found])


def _roots(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Real roots of ``a x^2 + b x + c``; not finite where there is none."""
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - 4 * a * c)
        q = -0.5 * (b + np.where(b < 0, -1.0, 1.0) * root)
        return q / a, c / q


def _derivative(c: np.ndarray, s: np.ndarray, order: int) -> np.ndarray:
    if order == 0:
        return ((c[0] * s + c[1]) * s + c[2]) * s + c[3]
    if order == 1:
        return (3 * c[0] * s + 2 * c[1]) * s + c[2]
    return 6 * c[0] * s + 2 * c[1] if order == 2 else 6 * c[0] + 0 * s


def _jumps(c: np.ndarray, steps: np.ndarray, order: int) -> np.ndarray:
    """Jumps of a derivative at the points, rest outside, each spread over a step, (n, 3)."""
    after = np.concatenate([_derivative(c, 0.0 * c[0], order), np.zeros((1, 3))])
    before = np.concatenate([np.zeros((1, 3)), _derivative(c, steps + 0.0 * c[0], order)])
    return (after - before) / steps[0]


def check_limits(profile: SwingProfile, limits: Limits) -> None:
    """Refuses a profile that breaks a limit at or between its points.

    Args:
        profile: what the robot shall play.
        limits: of the motors; a share of `TOLERANCE` above one passes.

    Raises:
        ValueError: with axis, quantity, value, instant and factor of the worst excess, and the
            factors of the others [SI units of the quantity, s, -].
    """
    over = [use for use in excess(profile, limits) if not use.ratio <= 1.0 + TOLERANCE]
    if not over:
        return
    worst, *others = sorted(over, key=lambda use: -use.ratio)
    found = f"{worst.value:.6g} at {worst.time:.6g} s, {worst.ratio:.6g} times the limit"
    listed = ", ".join(f"{one.axis} {one.quantity} {one.ratio:.4g} times" for one in others)
    raise _wrong(
        f"{worst.axis} {worst.quantity}", f"at most {worst.limit:.6g} {worst.unit}",
        f"{found} (and {listed})" if others else found,
        "smooth or slow the swing; where only jerk is too large, also by a smaller quantum",
    )  # fmt: skip


def write(profile: SwingProfile, directory: Path | str, limits: Limits) -> tuple[Path, Path]:
    """Writes ``profile.csv`` and ``profile.pod``, unless the profile breaks a limit.

    Args:
        profile: what the robot shall play; both files hold its rounded angles.
        directory: folder for the files; made where it is missing.
        limits: of the motors; a share of `TOLERANCE` above one passes.

    Returns:
        The two files.

    Raises:
        ValueError: with axis, quantity, instant and factor of the worst excess, and nothing is
            written; or where the folder cannot be written to.
    """
    csv, pod = Path(directory) / CSV, Path(directory) / POD
    try:
        check_limits(profile, limits)
    except ValueError as error:
        raise ValueError(f"{pod}: {error}") from None
    write_beside(csv, csv_text(profile.time, profile.read_angles))
    write_pod(pod, _header(profile), np.degrees(profile.read_angles))
    return csv, pod


def _header(profile: SwingProfile) -> PodHeader:
    pose = np.degrees(profile.at(np.array([profile.impact_time])).angles[0])
    return PodHeader(
        points=len(profile.time),
        swing_time=float(profile.time[-1]),
        impact_time=float(profile.impact_time),
        impact_pose=(float(pose[0]), float(pose[1]), float(pose[2])),
        quantum=float(profile.quantum),
        interpolation=profile.interpolation,
        phases={name: float(instant) for name, instant in profile.phases.items()},
    )


def read_pod(path: Path | str) -> SwingProfile:
    """Reads a robot's file and verifies its checksum.

    Args:
        path: ``profile.pod``.

    Returns:
        The profile, as the robot reads it [s, rad].

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    header, degrees = read_pod_text(Path(path))
    angles = np.radians(degrees)
    return SwingProfile(
        np.linspace(0.0, header.swing_time, header.points),
        *angles.T,
        impact_time=header.impact_time,
        quantum=header.quantum,
        interpolation=header.interpolation,  # type: ignore[arg-type]
        phases=header.phases,
    )
