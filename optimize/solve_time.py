"""When to hit and when to stop, where a task leaves that open."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from ..model.rig import Rig
from .solve_newton import settle
from .solve_problem import first_guess
from .solve_scenarios import nominal_of, plant_of, stated
from .task import Robust, SwingTask

POINTS, SPLINES = 201, 40
"""Points and splines of a trial [-]."""

EARLIEST, STOP = 0.4, 0.1
"""Earliest impact, and shortest time to stop, as shares of the duration [-]."""

FINEST, ROUNDS, SCANNED = 2e-3, 2, 13
"""How well an instant is found [s], how often both are found in turn, and how many are tried to
begin with [-]."""

FORBIDDEN = 1e6
"""Cost of a trial that limits forbid, with as much more as they would have to be wider [-]."""


def timed(
    task: SwingTask,
    rig: Rig,
    golfer: Mapping[str, np.ndarray] | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> SwingTask:
    """The task with the instant of impact and the duration of least cost.

    Trials are swings of the linear robot alone, coarser than the one that is wanted: they tell
    when, and the swing itself is then found for the fidelity and the scenarios of the task.

    Args:
        task: its impact time may be None, its duration a range [s].
        rig: the robot.
        golfer: see `supple.optimize.solve.solve` [s, rad].
        tell: told what is being done.

    Returns:
        The same task where nothing is open; otherwise one with both times fixed.

    Source: search of one dimension after the other; tests/optimize/test_solve_time.py.
    """
    (low, high), hit = task.duration, task.impact.time
    if hit is not None and low == high:
        return task
    linear = replace(rig, fidelity="thesis")

    def cost(duration: float, instant: float) -> float:
        return _cost(task, linear, golfer, duration, instant)

    end = high
    instant = hit if hit is not None else 0.75 * end
    for number in range(1 if hit is not None or low == high else ROUNDS):
        tell(f"when to hit and to stop, round {number + 1}")
        if hit is None:
            last = end * (1.0 - STOP) - task.impact.duration
            instant = _least(lambda at: cost(end, at), EARLIEST * end, last)  # noqa: B023
        if low < high:
            first = max(low, instant + task.impact.duration + FINEST)
            end = _least(lambda stop: cost(stop, instant), first, high)  # noqa: B023
    tell(f"impact at {instant:.4g} s of {end:.4g} s")
    impact = replace(task.impact, time=float(instant))
    return replace(task, impact=impact, duration=(float(end), float(end)))


def _least(cost: Callable[[float], float], low: float, high: float) -> float:
    """Where a cost is least: a few tries, then a search about the best of them [s]."""
    tries = np.linspace(low, high, SCANNED)
    values = [cost(float(one)) for one in tries]
    best = int(np.argmin(values))
    bounds = tries[max(best - 1, 0)], tries[min(best + 1, SCANNED - 1)]
    found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": FINEST})
    return float(found.x) if found.fun <= values[best] else float(tries[best])


def _cost(
    task: SwingTask,
    rig: Rig,
    golfer: Mapping[str, np.ndarray] | None,
    duration: float,
    instant: float,
) -> float:
    """Cost of a trial; one that breaks limits costs more the more it does."""
    own = replace(
        task, duration=(duration, duration), points=min(task.points, POINTS), robust=Robust(),
        impact=replace(task.impact, time=instant),
    )  # fmt: skip
    problem = stated(own, rig, golfer, (nominal_of(own),), SPLINES)
    found = settle(problem, plant_of(problem, rig), first_guess(problem))
    if not found.feasible:
        return FORBIDDEN * (1.0 + found.answer.widened)
    return found.cost if found.settled else FORBIDDEN
