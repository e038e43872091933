"""Torque waves as swings: each axis one motion from rest to rest that passes the ball."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from ..model.rig import Rig
from .profile import SwingProfile, excess
from .shape import Shape, rise
from .solve_grid import Grid, Motors, followed, played
from .solve_newton import closed
from .solve_problem import Plant, Problem
from .solve_program import impact_of, wanted
from .solve_scenarios import plant_of, stated
from .task import Robust, SwingTask

BEGINNINGS = 24
"""Instants at which each axis may begin, between the start and shortly before impact [-]."""

LATEST = 0.97
"""Latest beginning, as a share of the time until impact [-]."""

TURNS, MET, CLOSE = 12, 1e-6, 1e-4
"""Newton steps on speed and pose, the error that ends them, and the largest that counts as none
[-, m/s or rad]."""


@dataclass(frozen=True)
class Wave:
    """A swing of one wave an axis.

    Attributes:
        name: of the wave.
        profile: its points.
        begins: instants at which arm and wrist begin [s].
        met: whether pose and speed at impact are met in the robot itself.
        worst: largest use of a motor's limit; above 1 the robot cannot play it [-].
    """

    name: str
    profile: SwingProfile
    begins: tuple[float, float]
    met: bool
    worst: float


def wave(task: SwingTask, rig: Rig, shape: Shape) -> Wave | None:
    """The swing of one wave an axis, both ending with the swing, that meets impact.

    Where the wrist begins is scanned; where the arm begins follows from the speed, the angle
    that the wrist goes from the pose. Of all that meet impact, the one that uses the motors least
    is taken, limits or not.

    Args:
        task: impact, duration and limits.
        rig: the robot; its fidelity is obeyed.
        shape: of `supple.optimize.shape.rise`.

    Returns:
        The swing; None where no beginning meets impact.

    Source: thesis, section 8.2.3; tests/optimize/test_classic_wave.py.
    """
    plain = replace(task, robust=Robust(), golfer=None)
    linear = replace(rig, fidelity="thesis")
    stage = _Stage(plain, linear, shape)
    found = [one for begin in stage.beginnings for one in stage.swings_from(begin)]
    if not found:
        return None
    used = [stage.use(p) for p in found]
    best = found[int(np.argmin(used))]
    if rig.fidelity != "planar":
        return stage.told(best, met=True)
    return _Stage(plain, rig, shape).tuned(best)


@dataclass(frozen=True)
class _Told:
    """Unknowns of a wave: beginnings [s] and ways [rad] of arm and wrist."""

    begins: tuple[float, float]
    ways: tuple[float, float]


class _Stage:
    """A task, a robot and a wave."""

    def __init__(self, task: SwingTask, rig: Rig, shape: Shape) -> None:
        self.task = task
        self.shape: Shape = shape
        self.problem: Problem = stated(task, rig, None, (1.0,), splines=8)
        self.plant: Plant = plant_of(self.problem, rig)
        self.grid: Grid = self.problem.grid
        self.numbers = self.problem.scenarios[0]
        self.hit = float(self.grid.marks[self.grid.impact])
        early = np.linspace(1.0, np.sqrt(1.0 - LATEST), BEGINNINGS)
        self.beginnings = self.hit * (1.0 - early**2)
        self.pose = next(one for one in wanted(task) if one not in ("arm", "speed"))
        self.units: dict[tuple[int, float], tuple[np.ndarray, np.ndarray]] = {}
        if self.plant.constant:
            self._run_backwards()

    def _run_backwards(self) -> None:
        """Effect of the motors' motion at every mark on the state at impact, shape (k, 8, 2, 4)."""
        none = np.zeros((1, len(self.grid.marks), 8))
        steps = self.plant.steps(none, np.zeros((len(self.grid.marks), 2, 4)))
        carried, rest = np.eye(8), np.zeros(8)
        self.effects = np.zeros((self.grid.impact, 8, 2, 4))
        for k in range(self.grid.impact - 1, -1, -1):
            self.effects[k] = np.einsum("ij,jao->iao", carried, steps.e[0, k])
            rest = rest + carried @ steps.d[0, k]
            carried = carried @ steps.a[0, k]
        rest = rest + carried @ self.plant.start()[0]
        angles = self.effects[..., 0].sum(axis=0)  # what motors that stand do
        self.rest = rest + angles @ np.array(self.task.start)
        self._join_points()

    def _join_points(self) -> None:
        """Effect of every point of an axis on the state at impact, and on angle and rate there.

        The controller's spline is linear in its points: shapes (8, 2, points) and (2, points).
        """
        at, marks = self.grid.impact, self.grid.marks
        spline = CubicSpline(self.grid.points, np.eye(len(self.grid.points)), bc_type="clamped")
        middles = 0.5 * (marks[:at] + marks[1 : at + 1])
        tables = [spline(marks[:at], order) for order in range(3)] + [spline(middles, 3)]
        parts = [self.effects[..., k].transpose(1, 2, 0) @ table for k, table in enumerate(tables)]
        self.by_points = np.sum(parts, axis=0)
        self.read_at_impact = np.stack([spline(marks[at], order) for order in (0, 1)])

    def angles(self, told: _Told) -> np.ndarray:
        """Points of arm and wrist, shape (n, 2) [rad]."""
        end, columns = self.grid.points[-1], []
        for axis in (0, 1):
            begin = told.begins[axis]
            share = rise(self.shape, self.grid.points - begin, end - begin)
            columns.append(self.task.start[axis] + told.ways[axis] * share)
        return np.stack(columns, axis=1)

    def profile(self, told: _Told) -> SwingProfile:
        """The points as a profile."""
        angles, none = self.angles(told), np.zeros(len(self.grid.points))
        return SwingProfile(
            self.grid.points, angles[:, 0], angles[:, 1], none, self.hit, self.task.quantum
        )

    def missed(self, told: _Told) -> dict[str, float]:
        """What is read at impact less what must hold [m/s or rad]."""
        if self.plant.constant:
            x, z = self.rest.copy(), np.array([[one, 0.0] for one in self.task.start])
            for axis in (0, 1):
                moved, turned = self._unit(axis, told.begins[axis])
                x += told.ways[axis] * moved
                z[axis] += told.ways[axis] * turned
        else:
            motion = played(self.grid, replace(self.profile(told), quantum=0.0))
            x, z = self._moved(motion)[0, self.grid.impact], motion[self.grid.impact, :, :2]
        seen = impact_of(self.numbers, x, z[:, 0], z[:, 1], self.plant.constant)
        return {name: float(seen[name] - goal) for name, goal in wanted(self.task).items()}

    def _unit(self, axis: int, begin: float) -> tuple[np.ndarray, np.ndarray]:
        """State at impact (8,), and angle and rate of the axis there, for a way of 1 rad."""
        key = (axis, begin)
        if key not in self.units:
            points = self.grid.points
            share = rise(self.shape, points - begin, points[-1] - begin)
            self.units[key] = self.by_points[:, axis] @ share, self.read_at_impact @ share
        return self.units[key]

    def _moved(self, motion: np.ndarray) -> np.ndarray:
        """Motion in the plane, begun from that of the linear robot (1, marks, 8) [SI]."""
        states = np.zeros((1, len(motion), 8))
        states[0, :, 0], states[0, :, 4] = motion[:, :, 0].sum(1), motion[:, :, 1].sum(1)
        steps = self.plant.steps(states, motion)
        states = followed(steps, motion, self.plant.start())
        drive = Motors(np.zeros((len(motion), 2, 4, 1)), motion)
        return closed(replace(self.problem, drive=drive), self.plant, np.zeros(1), states)

    def use(self, told: _Told) -> float:
        """Largest use of a motor's limit [-]."""
        return max(one.ratio for one in excess(self.profile(told), self.task.limits))

    def told(self, told: _Told, met: bool) -> Wave:
        """The wave as it is told to others."""
        return Wave(self.shape, self.profile(told), told.begins, met, self.use(told))

    def swings_from(self, wrist: float) -> list[_Told]:
        """All beginnings of the arm that meet speed and pose with this one of the wrist [s]."""
        values = [self._off(begin, wrist)[0] for begin in self.beginnings]
        found = []
        for k in range(len(values) - 1):
            if values[k] * values[k + 1] < 0.0:
                low, high = self.beginnings[k], self.beginnings[k + 1]
                root: Any = brentq(lambda b: self._off(b, wrist)[0], low, high, xtol=1e-10)
                told = self._off(float(root), wrist)[1]
                if max(map(abs, self.missed(told).values())) <= CLOSE:
                    found.append(told)
        return found

    def _off(self, arm: float, wrist: float) -> tuple[float, _Told]:
        """Error of the speed [m/s] once both axes go so far that the pose is met."""
        name = self.pose
        goal = self.task.impact.arm_angle - self.task.start[0]
        end = float(self.grid.points[-1])
        share = float(rise(self.shape, np.array([self.hit - arm]), end - arm)[0])
        ways = [goal / share, 0.0]

        def pose(way: float) -> tuple[float, float]:
            seen = self.missed(_Told((arm, wrist), (ways[0], way)))
            return seen[name], seen["speed"]

        way, other = 1.5, 2.5
        first = second = pose(way)
        for _ in range(TURNS):
            second = pose(other)
            if abs(second[0]) <= MET or second[0] == first[0]:
                break
            way, other = other, other - second[0] * (other - way) / (second[0] - first[0])
            first = second
        return second[1], _Told((arm, wrist), (ways[0], other))

    def tuned(self, told: _Told) -> Wave:
        """The same wave with speed and pose met in the plane, as far as Newton's steps go."""
        name = self.pose
        end, goal = float(self.grid.points[-1]), self.task.impact.arm_angle - self.task.start[0]

        def made(x: np.ndarray) -> _Told:
            share = float(rise(self.shape, np.array([self.hit - x[0]]), end - x[0])[0])
            return _Told((float(x[0]), told.begins[1]), (goal / share, float(x[1])))

        def off(x: np.ndarray) -> np.ndarray:
            seen = self.missed(made(x))
            return np.array([seen["speed"], seen[name]])

        x, met = _newton(off, np.array([told.begins[0], told.ways[1]]))
        x[0] = np.clip(x[0], 0.0, LATEST * self.hit)
        return self.told(made(x), met)


def _newton(off: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> tuple[np.ndarray, bool]:
    """Two unknowns by damped Newton steps with differences, and whether errors are gone."""
    here = off(x)
    for _ in range(TURNS):
        if np.abs(here).max() <= MET:
            return x, True
        slopes = np.stack([(off(x + h) - here) / 1e-4 for h in 1e-4 * np.eye(2)], axis=1)
        if not np.isfinite(slopes).all() or abs(np.linalg.det(slopes)) < 1e-12:
            break
        move, share = np.linalg.solve(slopes, -here), 1.0
        while share > 1e-2:
            after = off(x + share * move)
            if np.isfinite(after).all() and np.abs(after).max() < np.abs(here).max():
                break
            share *= 0.5
        else:
            break
        x, here = x + share * move, after
    return x, bool(np.abs(here).max() <= CLOSE)
