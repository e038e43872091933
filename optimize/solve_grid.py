"""The clock of a swing: points, impact between them, and motors that splines of jerk move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from .profile import SwingProfile

SPLINES = 80
"""Cubic splines of jerk an axis [-]."""

NEAR = 1e-9
"""Instants nearer than this share of a step are one [-]."""


@dataclass(frozen=True)
class Grid:
    """Points of the file, marks of the motion, and what one unit of each unknown does.

    Jerk is constant between points, so the angles are a cubic spline of two derivatives through
    the points. Marks are the points, the instant of impact, and the end of the ball's force.

    Attributes:
        points: shape (n,) [s].
        marks: shape (m,) [s].
        lengths: of the steps between marks, shape (m - 1,) [s].
        impact: mark of impact.
        struck: steps in which the ball pushes, shape (m - 1,) [-].
        basis: jerk in each interval between points for a unit of each unknown, shape
            (n - 1, unknowns) [1].
        moves: angle, velocity, acceleration at each mark and jerk after it, for jerks of `basis`
            in rad/s^3, shape (m, 4, unknowns) [s^3, s^2, s, 1].
    """

    points: np.ndarray
    marks: np.ndarray
    lengths: np.ndarray
    impact: int
    struck: np.ndarray
    basis: np.ndarray
    moves: np.ndarray

    @property
    def unknowns(self) -> int:
        """Of one axis [-]."""
        return self.basis.shape[1]

    @property
    def at_points(self) -> np.ndarray:
        """Which marks are points, shape (n,) [-]."""
        return np.searchsorted(self.marks, self.points - NEAR * self.step)

    @property
    def step(self) -> float:
        """Between points [s]."""
        return float(self.points[1] - self.points[0])


def make_grid(
    duration: float,
    points: int,
    impact: float,
    contact: float,
    splines: int | None = SPLINES,
    basis: np.ndarray | None = None,
) -> Grid:
    """The clock of one swing.

    Args:
        duration: of the swing [s].
        points: of the file [-].
        impact: instant of impact [s].
        contact: how long the ball pushes [s]; 0 for none.
        splines: cubic splines of jerk; None for a jerk of its own in every interval [-].
        basis: jerks to be used instead, see `Grid.basis` [1].

    Returns:
        The grid.
    """
    times = np.linspace(0.0, duration, points)
    step = times[1]
    events = [impact, impact + contact] if contact else [impact]
    marks = list(times)
    for event in events:
        if np.min(np.abs(np.asarray(marks) - event)) > NEAR * step:
            marks.append(event)
    marks = np.sort(marks)
    middle = 0.5 * (marks[1:] + marks[:-1])
    which = np.minimum((middle / step).astype(int), points - 2)
    at = int(np.argmin(np.abs(marks - impact)))
    struck = (middle > impact) & (middle < impact + contact)
    if basis is None:
        basis = np.eye(points - 1) if splines is None else jerk_splines(points - 1, splines)
    lengths = np.diff(marks)
    return Grid(times, marks, lengths, at, struck, basis, _moves(basis, which, lengths))


def jerk_splines(intervals: int, count: int) -> np.ndarray:
    """Cubic B-splines [1] at the middles of the intervals; jerk begins and ends at zero.

    The first two intervals have one jerk, and so the last two: then a spline that is clamped,
    natural or not-a-knot is the same curve.
    """
    inner = np.linspace(0.0, 1.0, count)  # 2 + count splines, of which the outer two are left out
    knots = np.concatenate([[0.0] * 3, inner, [1.0] * 3])
    middle = (np.arange(intervals) + 0.5) / intervals
    table = BSpline.design_matrix(middle, knots, 3).toarray()[:, 1:-1]
    table[0], table[-1] = table[1], table[-2]
    return table


def _moves(basis: np.ndarray, which: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """See `Grid.moves`; exact, for jerk is constant within a step."""
    jerks = basis[which]
    found = np.zeros((len(lengths) + 1, 4, basis.shape[1]))
    angle, speed, bend = np.zeros((3, basis.shape[1]))
    for k, h in enumerate(lengths):
        u = jerks[k]
        found[k] = angle, speed, bend, u
        angle = angle + h * (speed + h * (bend / 2 + h * u / 6))
        speed = speed + h * (bend + h * u / 2)
        bend = bend + h * u
    found[-1] = angle, speed, bend, jerks[-1]
    return found


@dataclass(frozen=True)
class Steps:
    """One step of every scenario: ``x' = a x + e z + d`` with z the motors' motion at its start.

    The state x is collet angle, grip displacement, grip angle, clubhead displacement and their
    rates; z is, of arm and wrist each, angle, velocity, acceleration and jerk [SI].

    Attributes:
        a: shape (scenarios, steps, 8, 8) [SI].
        e: shape (scenarios, steps, 8, 2, 4) [SI].
        d: shape (scenarios, steps, 8) [SI].
    """

    a: np.ndarray
    e: np.ndarray
    d: np.ndarray


@dataclass(frozen=True)
class Maps:
    """States of every scenario at every mark as ``slope c + level``.

    Attributes:
        slope: shape (scenarios, marks, 8, unknowns) [SI].
        level: shape (scenarios, marks, 8) [SI].
    """

    slope: np.ndarray
    level: np.ndarray

    def at(self, c: np.ndarray) -> np.ndarray:
        """States for some unknowns, shape (scenarios, marks, 8) [SI]."""
        return self.slope @ c + self.level


@dataclass(frozen=True)
class Motors:
    """The motors' motion as ``slope c + level``, arm and wrist.

    Attributes:
        slope: shape (marks, 2, 4, unknowns of both) [SI].
        level: shape (marks, 2, 4) [SI].
    """

    slope: np.ndarray
    level: np.ndarray

    def at(self, c: np.ndarray) -> np.ndarray:
        """Angle, velocity, acceleration and jerk after each mark, shape (marks, 2, 4) [SI]."""
        return self.slope @ c + self.level


def motors(grid: Grid, start: tuple[float, float], jerks: tuple[float, float]) -> Motors:
    """The motors' motion at every mark.

    Args:
        grid: the clock.
        start: arm and wrist angle at rest [rad].
        jerks: what one unit of an unknown is worth, arm and wrist [rad/s^3].

    Returns:
        The motion; the arm's unknowns come first.
    """
    m, n = len(grid.marks), grid.unknowns
    slope, level = np.zeros((m, 2, 4, 2 * n)), np.zeros((m, 2, 4))
    for axis in (0, 1):
        slope[:, axis, :, axis * n : (axis + 1) * n] = jerks[axis] * grid.moves
        level[:, axis, 0] = start[axis]
    return Motors(slope, level)


def condensed(steps: Steps, drive: Motors, start: np.ndarray) -> Maps:
    """States as functions of the unknowns: the recursion of `Steps` carried out.

    Args:
        steps: of every scenario.
        drive: the motors' motion.
        start: state at the first mark, shape (scenarios, 8) [SI].

    Returns:
        The maps.
    """
    count, number = steps.d.shape[:2]
    n = drive.slope.shape[-1]
    pushed = np.zeros((count, number, 8, n + 1))
    for axis in (0, 1):
        own = np.flatnonzero(drive.slope[:, axis].any(axis=(0, 1)))
        part = slice(own[0], own[-1] + 1) if len(own) else slice(0, 0)
        pushed[..., part] += steps.e[:, :, :, axis] @ drive.slope[:-1, axis, :, part]
    pushed[..., n] = np.einsum("skxaj,kaj->skx", steps.e, drive.level[:-1]) + steps.d
    found = np.empty((count, number + 1, 8, n + 1))
    now = np.zeros((count, 8, n + 1))
    now[..., n] = start
    found[:, 0] = now
    for k in range(number):
        now = steps.a[:, k] @ now
        now += pushed[:, k]
        found[:, k + 1] = now
    return Maps(found[..., :n], found[..., n])


def followed(steps: Steps, motion: np.ndarray, start: np.ndarray) -> np.ndarray:
    """States at every mark for one motion of the motors, by the recursion of `Steps`.

    Args:
        steps: of every scenario.
        motion: of the motors, shape (marks, 2, 4) [SI].
        start: state at the first mark, shape (scenarios, 8) [SI].

    Returns:
        Shape (scenarios, marks, 8) [SI].
    """
    pushed = np.einsum("skxaj,kaj->skx", steps.e, motion[:-1]) + steps.d
    found = np.empty((len(start), len(motion), 8))
    found[:, 0] = now = start
    for k in range(len(motion) - 1):
        now = (steps.a[:, k] @ now[..., None])[..., 0] + pushed[:, k]
        found[:, k + 1] = now
    return found


def played(grid: Grid, profile: SwingProfile) -> np.ndarray:
    """The motors' motion at the marks as a profile plays it, shape (marks, 2, 4) [SI]."""
    course = profile.at(grid.marks)
    jerks = profile.at(0.5 * (grid.marks[:-1] + grid.marks[1:])).jerks
    jerks = np.concatenate([jerks, jerks[-1:]])
    tables = (course.angles, course.velocities, course.accelerations, jerks)
    return np.stack([table[:, :2] for table in tables], axis=-1)
