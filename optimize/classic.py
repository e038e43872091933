"""Classic swings to compare with: least jerk, shaped or not, same limits, same impact."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..model.linear import modes
from ..model.rig import Rig
from ..model.robot import Robot
from .profile import SwingProfile
from .shaper import Shaper
from .solve import HELD, ROUGHLY, SOFTER, Tell, profile_of
from .solve_grid import SPLINES, jerk_splines, make_grid
from .solve_newton import Found, settle
from .solve_problem import Problem, first_guess, problem_of
from .solve_scenarios import between_scenarios, nominal_of, plant_of, stated
from .swing_check import rig_numbers
from .task import Cost, Robust, SwingTask

MOST_SOFT = 12
"""Programs on the way to a classic of the planar robot [-]."""


@dataclass(frozen=True)
class Classic:
    """A classic swing that obeys the motors' limits, impact and duration of a task.

    Attributes:
        name: of the method.
        problem: what was solved.
        found: its unknowns.
        dense: factors of the shaft's frequency, shape (f,) [-].
        rings: largest distance of the clubhead from rest after the end there, shape (f,) [m].
    """

    name: str
    problem: Problem
    found: Found
    dense: np.ndarray
    rings: np.ndarray

    @property
    def profile(self) -> SwingProfile:
        """Its points, see `supple.optimize.profile.SwingProfile`."""
        return profile_of(self.problem, self.found)

    @property
    def works(self) -> bool:
        """Whether it obeys the limits and meets impact."""
        return self.found.feasible and self.found.settled


def slow_mode(rig: Rig) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio [-] of the slowest oscillation of the club on its wrist."""
    numbers = rig_numbers(rig)
    found = modes(Robot("pinned_wrist", tuple(numbers)), numbers)
    slowest = int(np.flatnonzero(found.damped_frequencies > 0)[0])
    return float(found.frequencies[slowest]), float(found.damping_ratios[slowest])


def shaped_basis(
    intervals: int, step: float, shaper: Shaper | None, splines: int = SPLINES
) -> np.ndarray:
    """Jerks that a shaper makes of splines of jerk, so that whatever is solved for is shaped.

    Args:
        intervals: between the points [-].
        step: between points [s].
        shaper: its impulses; one between two points is shared by both. None: unshaped.
        splines: an axis [-].

    Returns:
        Shape (intervals, splines) [1].
    """
    if shaper is None:
        return jerk_splines(intervals, splines)
    left = intervals - int(np.ceil(shaper.duration / step))
    plain = jerk_splines(left, splines)
    found = np.zeros((intervals, splines))
    for share, late in zip(shaper.amplitudes, shaper.times, strict=True):
        first = int(late / step)
        part = late / step - first
        for shift, weight in ((first, 1.0 - part), (first + 1, part)):
            if weight > 0 and shift + left <= intervals:
                found[shift : shift + left] += share * weight * plain
    return found


def classic(
    task: SwingTask, rig: Rig, shaper: Shaper | None = None, tell: Tell = lambda text: None
) -> Classic:
    """The swing of least jerk, passed through a shaper, that meets the task's impact.

    It keeps the task's limits of the shaft too.

    Args:
        task: limits of the motors, impact and duration.
        rig: the robot.
        shaper: for one of its modes; None for plain least jerk.
        tell: told what is being done.

    Returns:
        The swing, with its ring over the task's factors.
    """
    robust = replace(task.robust, impact=False) if task.robust.parameter else Robust()
    plain = replace(task, cost=Cost(1.0, 0.0, 0.0), shaft=task.shaft, robust=robust, golfer=None)
    first = stated(plain, rig, None, (nominal_of(task),))
    hit = task.impact
    basis = shaped_basis(task.points - 1, first.grid.step, shaper)
    contact = hit.duration if hit.force else 0.0
    grid = make_grid(
        float(first.grid.points[-1]), task.points, float(first.grid.marks[first.grid.impact]),
        contact, basis=basis,
    )  # fmt: skip
    problem = problem_of(plain, grid, first.scenarios, 0)
    plant = plant_of(problem, rig)
    begin, states = first_guess(problem), None
    if not plant.constant:  # the way there is shorter for a club that is kept from whipping
        kept = replace(problem, task=replace(plain, cost=Cost(1.0, 1.0, 0.0)), ring=SOFTER[0][0])
        soft = settle(kept, plant, begin, None, tell, MOST_SOFT, HELD, ROUGHLY)
        begin, states = soft.c, soft.states
    found = settle(problem, plant, begin, states, tell)
    name = "least jerk" if shaper is None else f"least jerk, {shaper.name}"
    if not found.feasible or not np.isfinite(found.cost):
        return Classic(name, problem, found, np.zeros(0), np.zeros(0))
    return Classic(
        name, problem, found, *between_scenarios(problem, rig, found, (nominal_of(task),))
    )
