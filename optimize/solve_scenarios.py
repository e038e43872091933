"""For which robots a swing must do, and how it does for those in between."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..model.rig import Rig
from .solve_grid import SPLINES, Grid, make_grid
from .solve_linear import LinearPlant, free_rings
from .solve_newton import Found, closed
from .solve_problem import Plant, Problem, problem_of
from .solve_program import RING, reach
from .swing_check import FACTORS, robots_at
from .task import POSTERIOR, SwingTask

DENSE, DENSE_PLANAR = FACTORS, 11
"""Factors at which the ring after the end is looked at between the scenarios, by fidelity [-]."""

RING_PLANAR = 1e-4
"""`RING` of a planar swing [-]: below it the clubhead's path bends within what a program sees."""


def scenarios_of(task: SwingTask) -> tuple[float, ...]:
    """Factors of the scenarios, the robot itself among them [-]; of draws, their numbers from 1 on.

    Args:
        task: as read; for ``posterior`` with its draws.

    Returns:
        Ascending; `nominal_of` is one of them.
    """
    robust = task.robust
    if not robust.parameter:
        return (1.0,)
    if robust.parameter == POSTERIOR:
        picked = np.linspace(1, len(robust.draws), min(robust.scenarios, len(robust.draws)))
        return (0.0, *sorted({float(round(one)) for one in picked}))
    found = np.linspace(*robust.factors, robust.scenarios) if robust.scenarios > 1 else [1.0]
    return tuple(sorted({*(round(float(one), 12) for one in found), 1.0}))


def nominal_of(task: SwingTask) -> float:
    """The factor of the robot itself [-]."""
    return 0.0 if task.robust.parameter == POSTERIOR else 1.0


def stated(
    task: SwingTask,
    rig: Rig,
    golfer: Mapping[str, np.ndarray] | None,
    factors: tuple[float, ...],
    splines: int | None = SPLINES,
) -> Problem:
    """The problem of a task for some robots.

    Args:
        task: as read; duration and impact's time are the first that it allows.
        rig: the robot.
        golfer: see `solve` [s, rad].
        factors: of the scenarios, 1 among them [-].
        splines: see `solve` [-].

    Returns:
        The problem.
    """
    duration, hit = task.duration[0], task.impact
    assert hit.time is not None
    contact = hit.duration if hit.force else 0.0
    grid = make_grid(duration, task.points, hit.time, contact, splines)
    robots, nominal = robots_at(task, rig, factors), factors.index(nominal_of(task))
    problem = problem_of(task, grid, robots, nominal, followed(golfer, grid))
    flat = rig.fidelity != "planar"
    return replace(problem, ring=RING if flat else RING_PLANAR, flat=flat)


def followed(golfer: Mapping[str, np.ndarray] | None, grid: Grid) -> np.ndarray | None:
    """The golfer's arm and wrist angle at the marks, held beyond its ends, (marks, 2) [rad]."""
    if golfer is None:
        return None
    names = ("arm_angle", "wrist_angle")
    columns = [np.interp(grid.marks, golfer["time"], golfer[name]) for name in names]
    return np.stack(columns, axis=1)


def plant_of(problem: Problem, rig: Rig) -> Plant:
    """What moves in a problem, by the rig's fidelity."""
    if rig.fidelity != "planar":
        return LinearPlant(problem, rig)
    from .solve_planar import PlanarSteps

    return PlanarSteps(problem, rig)


def dense_factors(task: SwingTask, count: int) -> np.ndarray:
    """Factors of a task's parameter, or numbers of its draws, shape (f,) [-]."""
    if task.robust.parameter == POSTERIOR:
        return np.unique(np.round(np.linspace(0, len(task.robust.draws), count)))
    low, high = task.robust.factors if task.robust.parameter else (0.9, 1.1)
    low, high = (low, high) if high > low else (0.9, 1.1)
    return np.linspace(low, high, count)


def between_scenarios(
    problem: Problem, rig: Rig, found: Found, base: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """The ring of a solution at many factors of the task's parameter.

    Args:
        problem: what was solved.
        rig: the robot.
        found: its unknowns.
        base: factors of its scenarios, ascending [-].

    Returns:
        Factors, shape (f,) [-], and the largest distance of the clubhead from rest after the end
        there, shape (f,) [m].
    """
    motion, planar = problem.drive.at(found.c), rig.fidelity == "planar"
    dense = dense_factors(problem.task, DENSE_PLANAR if planar else DENSE)
    robots = robots_at(problem.task, rig, dense)
    others = replace(problem, scenarios=robots)
    linear = LinearPlant(others, rig, laws=not planar)
    if not planar:
        return dense, linear.rings(motion, reach(robots[0]))
    plant = plant_of(others, rig)
    states = closed(others, plant, found.c, between(base, found.states, dense))
    end = states[:, -1].copy()
    end[:, :4] -= plant.rest(*motion[-1, :, 0])
    return dense, free_rings(linear.known.a[:, 0], end, reach(robots[0]), problem.grid.step)


def between(base: tuple[float, ...], states: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """Motions at other factors, on lines between those of the scenarios.

    Args:
        base: factors of the scenarios, ascending [-].
        states: their motions, shape (scenarios, marks, 8) [SI].
        factors: others [-].

    Returns:
        Shape (factors, marks, 8) [SI].
    """
    if len(base) == 1:
        return np.repeat(states, len(factors), axis=0)
    after = np.clip(np.searchsorted(base, factors), 1, len(base) - 1)
    known = np.asarray(base)
    share = (factors - known[after - 1]) / (known[after] - known[after - 1])
    share = share[:, None, None]
    return (1.0 - share) * states[after - 1] + share * states[after]
