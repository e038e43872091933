"""What is asked of a swing, with everything that it names, and what moves under the motors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from .solve_grid import Grid, Motors, Steps, motors
from .solve_program import RING, jerk_cost, rest_equations
from .solve_quadratic import reduce
from .task import SwingTask


class Plant(Protocol):
    """What moves under the motors, in every scenario."""

    @property
    def constant(self) -> bool:
        """Whether its steps are the same wherever it is."""
        ...

    def steps(self, states: np.ndarray, drive: np.ndarray) -> Steps:
        """Steps about states (scenarios, marks, 8) and motors (marks, 2, 4) [SI]."""
        ...

    def start(self) -> np.ndarray:
        """State at the first mark, shape (scenarios, 8) [SI]."""
        ...

    def rest(self, arm: float, wrist: float) -> np.ndarray:
        """Coordinates at rest behind drives that stand [rad], shape (scenarios, 4) [SI]."""
        ...


@dataclass(frozen=True)
class Problem:
    """A task with everything that it names.

    Attributes:
        task: what is asked.
        grid: the clock.
        drive: the motors' motion.
        scenarios: numbers of the robots for which the swing must do [SI].
        nominal: which of them is the robot itself [-].
        golfer: arm and wrist angle at the marks, shape (marks, 2) [rad]; None without one.
        most_speed: whether the fastest swing is looked for, not the one asked for.
        ring: see `supple.optimize.solve_program.RING` [-].
        flat: whether the robot is the linear one.
    """

    task: SwingTask
    grid: Grid
    drive: Motors
    scenarios: tuple[Mapping[str, float], ...]
    nominal: int
    golfer: np.ndarray | None = None
    most_speed: bool = False
    ring: float = RING
    flat: bool = True

    @property
    def struck(self) -> tuple[int, ...]:
        """The scenarios in which impact must be met."""
        return tuple(range(len(self.scenarios))) if self.task.robust.impact else (self.nominal,)


def problem_of(
    task: SwingTask,
    grid: Grid,
    scenarios: Sequence[Mapping[str, float]],
    nominal: int,
    golfer: np.ndarray | None = None,
) -> Problem:
    """A problem with its motors; unknowns in limits of jerk, `golfer` in rad [SI otherwise]."""
    jerks = task.limits.arm.jerk, task.limits.wrist.jerk
    drive = motors(grid, task.start, jerks)
    return Problem(task, grid, drive, tuple(scenarios), nominal, golfer)


def first_guess(problem: Problem, share: float = 1.0) -> np.ndarray:
    """Unknowns that bring the motors, without any limit, through the pose with little jerk.

    Args:
        problem: what is asked.
        share: of the speed asked for [-].

    Returns:
        Shape (unknowns,) [limits of jerk].
    """
    task, drive, at = problem.task, problem.drive, problem.grid.impact
    cost = jerk_cost(task, problem.grid)
    rows, sides = rest_equations(task, drive)
    hit = task.impact
    pose = np.array([hit.arm_angle, hit.wrist_angle]) - drive.level[at, :, 0]
    speed = share * hit.clubhead_speed
    arms, clubs = 0.65, 1.09  # rates that share the speed evenly enough to begin with
    rates = np.array([0.3 * speed / arms, 0.7 * speed / clubs - 0.3 * speed / arms])
    equations = [rows, drive.slope[at, :, 0], drive.slope[at, :, 1]]
    sides = np.concatenate([sides, pose, rates])
    reduced = reduce(cost, np.zeros(len(cost)), np.concatenate(equations), sides)
    return reduced.foot + reduced.back @ reduced.target


def faster(problem: Problem) -> Problem:
    """The same problem, asking for the fastest swing."""
    return replace(problem, most_speed=True)
