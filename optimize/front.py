"""The price list of a swing: jerk, acceleration, torque and duration against vibration."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model.rig import Rig
from .solve import Begin, settled
from .solve_newton import Found
from .solve_problem import Problem
from .solve_program import swing_rows
from .solve_scenarios import between_scenarios, scenarios_of
from .solve_torque import arm_torque, wrist_torque
from .task import SwingTask

WEIGHTS = (1e-6, 1e-5, 1e-4, 1e-2, 1.0)
"""Weights of vibration, as shares of the task's [-]."""

SPLINES = 60
"""Cubic splines of jerk an axis [-]; fewer than a swing has, for a list is made of many."""

STRETCHES = (1.0, 1.1, 1.2, 1.35, 1.5)
"""Times from impact to the end, as shares of the task's [-]."""


@dataclass(frozen=True)
class Price:
    """One swing of a price list.

    Attributes:
        weight: of vibration, as a share of the task's [-].
        duration: of the swing [s].
        rms_jerk: of arm and wrist [rad/s^3].
        peak_acceleration: of arm and wrist [rad/s^2].
        peak_torque: of arm and wrist [N m].
        vibration: rms of the clubhead's velocity against a rigid club's, in the robot itself [m/s].
        ring: largest distance of the clubhead from rest after the end, over the task's factors [m].
        feasible: whether limits and impact are met.
        efficient: whether no other is better in one of these and worse in none.
    """

    weight: float
    duration: float
    rms_jerk: tuple[float, float]
    peak_acceleration: tuple[float, float]
    peak_torque: tuple[float, float]
    vibration: float
    ring: float
    feasible: bool
    efficient: bool = False


def front(
    task: SwingTask,
    rig: Rig,
    golfer: Mapping[str, np.ndarray] | None = None,
    weights: Sequence[float] = WEIGHTS,
    stretches: Sequence[float] = STRETCHES,
    tell: Callable[[str], None] = lambda text: None,
) -> tuple[Price, ...]:
    """Swings of the same impact for other weights of vibration and other times to stop.

    Args:
        task: with fixed times.
        rig: the robot; its fidelity is obeyed.
        golfer: see `supple.optimize.solve.solve` [s, rad].
        weights: see `WEIGHTS` [-].
        stretches: see `STRETCHES` [-].
        tell: told what is being done.

    Returns:
        One price each; each scenario of the task is solved for, none is added.
    """
    assert task.impact.time is not None
    factors, found = scenarios_of(task), []
    begin: Begin | None = None
    for stretch in stretches:
        for weight in sorted(weights, reverse=True):
            end = task.impact.time + stretch * (task.duration[0] - task.impact.time)
            cost = replace(task.cost, vibration=weight * task.cost.vibration)
            own = replace(task, duration=(end, end), cost=cost)
            tell(f"price list: {len(found) + 1} of {len(weights) * len(stretches)}")
            one, problem = settled(own, rig, golfer, factors, begin, splines=SPLINES)
            if one.settled and one.feasible:
                begin = Begin(one.c, one.states, factors, one.looked)
            found.append(_price(one, problem, rig, (weight, end), factors))
    best = _efficient(found)
    return tuple(replace(one, efficient=good) for one, good in zip(found, best, strict=True))


def _price(
    found: Found, problem: Problem, rig: Rig, told: tuple[float, float], factors: tuple[float, ...]
) -> Price:
    """What one swing costs."""
    motion = problem.drive.at(found.c)
    x, numbers = found.states[problem.nominal].T, problem.scenarios[problem.nominal]
    angles, rates = motion[:, :, 0].T, motion[:, :, 1].T
    ends = [(part[:, :-1], part[:, 1:]) for part in (x, angles, rates)]
    force = problem.task.impact.force * problem.grid.struck
    flat = rig.fidelity != "planar"
    before, after = ([part[side] for part in ends] for side in (0, 1))
    arm = arm_torque(numbers, before, after, problem.grid.lengths, force, flat)
    wrist = wrist_torque(numbers, x, angles, rates)
    moved = swing_rows(numbers, x[4:], rates)
    share = np.gradient(problem.grid.marks) / problem.grid.points[-1]
    works = found.feasible and found.settled
    ring = float(between_scenarios(problem, rig, found, factors)[1].max()) if works else np.nan
    tables = (motion[:, :, 3], motion[:, :, 2])
    jerk, bend = np.sqrt(np.mean(tables[0] ** 2, axis=0)), np.abs(tables[1]).max(axis=0)
    return Price(
        *told, (float(jerk[0]), float(jerk[1])), (float(bend[0]), float(bend[1])),
        (float(np.abs(arm).max()), float(np.abs(wrist).max())),
        float(np.sqrt(share @ moved**2)), ring, works,
    )  # fmt: skip


def _efficient(found: Sequence[Price]) -> list[bool]:
    """Which are not beaten; prices within a thousandth of each other are alike."""
    table = np.array([
        [*one.rms_jerk, *one.peak_acceleration, *one.peak_torque, one.duration, one.ring]
        for one in found
    ])  # fmt: skip
    works = [
        one.feasible and bool(np.isfinite(row).all()) for one, row in zip(found, table, strict=True)
    ]
    best = []
    for index, row in enumerate(table):
        beaten = any(
            works[other]
            and np.all(table[other] <= 1.001 * row)
            and np.any(table[other] < 0.99 * row)
            for other in range(len(table))
            if other != index
        )
        best.append(works[index] and not beaten)
    return best
