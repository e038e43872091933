"""The optimal swing of the linear robot as a user of rockit would write it: stages and IPOPT."""

from __future__ import annotations

import importlib
import importlib.util
import time
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ...model.rig import Rig
from ...optimize.solve_grid import Grid
from ...optimize.solve_linear import linear_steps, robot_of
from ...optimize.solve_problem import Problem, first_guess
from ...optimize.solve_program import (
    RING,
    bend_rows,
    impact_of,
    motor_families,
    ring_factor,
    swing_rows,
    wanted,
)

STAGES = (400, 1, 99)
"""Steps before the ball, under it and after it [-]: half of ours; a thousand take it minutes."""

OPTIONS = {
    "expand": True, "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes",
    "ipopt.tol": 1e-8,
}  # fmt: skip
"""What rockit hands to IPOPT: expanded graphs are its fastest."""


@dataclass(frozen=True)
class Solved:
    """What a peer made of a swing.

    Attributes:
        seconds: wall time from an empty problem to the solution [s].
        cost: of the task, by the peer's own sum [-].
        words: what it says of itself.
    """

    seconds: float
    cost: float
    words: str


def has_rockit() -> bool:
    """Whether rockit, an extra that only this needs, is installed."""
    return importlib.util.find_spec("rockit") is not None


class _Symbols:
    """The functions of `impact_of`, as methods of symbols."""

    def __getattr__(self, name: str) -> Any:
        return lambda x: getattr(x, name)()


def by_rockit(problem: Problem, rig: Rig) -> Solved:
    """Solve a linear swing by multiple shooting, with the exact discrete steps as a gift.

    Args:
        problem: of fidelity ``thesis``, with a ball and limits of the shaft.
        rig: the robot.

    Returns:
        Time, cost and status.
    """
    rockit: Any = importlib.import_module("rockit")
    began = time.perf_counter()
    task, numbers = problem.task, problem.scenarios
    assert task.impact.time is not None
    hit, contact, end = task.impact.time, task.impact.duration, task.duration[0]
    spans = (hit, contact, end - hit - contact)
    lengths = np.array([span / count for span, count in zip(spans, STAGES, strict=True)])
    clock = Grid(lengths, lengths, lengths, 0, np.array([False, True, False]), np.eye(1), np.eye(1))
    steps = linear_steps(robot_of(rig), numbers, clock, task.impact.force)
    ocp = rockit.Ocp()
    stages, begin = [], 0.0
    for k, span in enumerate(spans):
        stage = ocp.stage(t0=begin, T=span)
        stages.append(_stage(stage, problem, steps, k, lengths[k]))
        stage.method(rockit.MultipleShooting(N=STAGES[k], M=1))
        begin += span
    _begin(stages, problem, np.cumsum([0.0, *spans]))
    for before, after in pairwise(stages):
        for name in ("motors", "clubs"):
            one, other = before[name], after[name]
            ocp.subject_to(before["stage"].at_tf(one) == after["stage"].at_t0(other))
    _ends(ocp, stages, problem)
    ocp.solver("ipopt", OPTIONS)
    try:
        solution = ocp.solve()
        parts = [solution(one["stage"]).value(one["stage"].objective) for one in stages]
        cost, words = float(solution.value(ocp.objective)) + float(np.sum(parts)), "solved"
    except RuntimeError as error:  # what casadi raises where IPOPT fails
        cost, words = float("nan"), str(error).splitlines()[0][:60]
    return Solved(time.perf_counter() - began, cost, words)


def _stage(stage: Any, problem: Problem, steps: Any, k: int, h: float) -> dict[str, Any]:
    """One stage: states, jerks, their steps, what it costs, and its limits."""
    task, count = problem.task, len(problem.scenarios)
    motors, clubs, jerk = stage.state(6), stage.state(8 * count), stage.control(2)
    limits = task.limits.arm, task.limits.wrist
    drift = np.array([[1.0, h, h * h / 2], [0.0, 1.0, h], [0.0, 0.0, 1.0]])
    push = np.array([h**3 / 6, h * h / 2, h])
    moved = np.kron(np.eye(2), drift)
    pushed = np.zeros((6, 2))
    pushed[:3, 0], pushed[3:, 1] = push * limits[0].jerk, push * limits[1].jerk
    stage.set_next(motors, moved @ motors + pushed @ jerk)
    own = np.zeros((8 * count, 8 * count))
    by_motors, by_jerk = np.zeros((8 * count, 6)), np.zeros((8 * count, 2))
    level = np.zeros(8 * count)
    for s in range(count):
        rows = slice(8 * s, 8 * s + 8)
        own[rows, rows], level[rows] = steps.a[s, k], steps.d[s, k]
        for axis in (0, 1):
            by_motors[rows, 3 * axis : 3 * axis + 3] = steps.e[s, k, :, axis, :3]
            by_jerk[rows, axis] = steps.e[s, k, :, axis, 3] * limits[axis].jerk
    stage.set_next(clubs, own @ clubs + by_motors @ motors + by_jerk @ jerk + level)
    share = h / task.duration[0]
    cost = task.cost.jerk * jerk.T @ jerk
    speed, weight = task.impact.clubhead_speed, task.cost.vibration / count
    rates = [motors[1], motors[4]]
    for s, numbers in enumerate(problem.scenarios):
        x = [clubs[8 * s + i] for i in range(8)]
        moved_by: Any = swing_rows(numbers, x[4:], rates)  # type: ignore[arg-type]
        cost = cost + weight * (moved_by / speed) ** 2
    stage.add_objective(stage.sum(share * cost))
    _limits(stage, problem, motors, clubs, jerk, k)
    return {"stage": stage, "motors": motors, "clubs": clubs, "jerk": jerk}


def within(problem: Problem) -> list[list[tuple[float, float]]]:
    """What arm and wrist may do, the same margins for rounding off as ours [SI, shares of jerk].

    Args:
        problem: tells the limits.

    Returns:
        Lowest and highest angle, velocity, acceleration and jerk, of arm and wrist.
    """
    families = motor_families(problem.task, problem.grid, problem.drive)
    found: list[list[tuple[float, float]]] = [[], []]
    for one in families:
        axis = 0 if one.axis == "arm" else 1
        unit = getattr(problem.task.limits, one.axis).jerk if one.quantity == "jerk" else 1.0
        half = float(one.half.min())
        found[axis].append(((one.middle - half) / unit, (one.middle + half) / unit))
    return found


def _limits(stage: Any, problem: Problem, motors: Any, clubs: Any, jerk: Any, k: int) -> None:
    """Limits of motors and shaft in one stage, at its points alone."""
    task = problem.task
    for axis, rows in enumerate(within(problem)):
        for order, (low, high) in enumerate(rows[:3]):
            stage.subject_to(low <= (motors[3 * axis + order] <= high))
        stage.subject_to(rows[3][0] <= (jerk[axis] <= rows[3][1]))
    most = task.shaft.deflection_before if k == 0 else task.shaft.deflection_after
    for s, numbers in enumerate(problem.scenarios):
        bend = bend_rows(numbers, [clubs[8 * s + i] for i in range(4)], True)  # type: ignore[arg-type]
        stage.subject_to(-most <= (bend <= most))


def _ends(ocp: Any, stages: list[dict[str, Any]], problem: Problem) -> None:
    """At rest at both ends, at the ball between them, and what rings on."""
    task, count = problem.task, len(problem.scenarios)
    first, last = stages[0], stages[-1]
    start = np.array([task.start[0], 0.0, 0.0, task.start[1], 0.0, 0.0])
    club = np.zeros(8)
    club[0] = sum(task.start)
    ocp.subject_to(first["stage"].at_t0(first["motors"]) == start)
    ocp.subject_to(first["stage"].at_t0(first["clubs"]) == np.tile(club, count))
    still = last["stage"].at_tf(last["motors"])
    for index in (1, 2, 4, 5):
        ocp.subject_to(still[index] == 0.0)
    x = first["stage"].at_tf(first["clubs"])
    z = first["stage"].at_tf(first["motors"])
    nominal = problem.nominal
    own = [x[8 * nominal + i] for i in range(8)]
    angles, rates = [z[0], z[3]], [z[1], z[4]]
    seen = impact_of(problem.scenarios[nominal], own, angles, rates, True, _Symbols())
    for name, goal in wanted(task).items():
        ocp.subject_to(seen[name] == goal)
    ends = last["stage"].at_tf(last["clubs"])
    speed, weight = task.impact.clubhead_speed, task.cost.vibration / count
    for s, numbers in enumerate(problem.scenarios):
        scale = np.sqrt(weight / (RING * 0.5 * numbers["clubhead_mass"] * speed**2))
        factor = scale * ring_factor(numbers)
        away = ends[8 * s : 8 * s + 8] - np.eye(8)[:, :1] @ (still[0] + still[3])
        left = factor @ away
        ocp.add_objective(left.T @ left)


def _begin(stages: list[dict[str, Any]], problem: Problem, edges: np.ndarray) -> None:
    """The beginning that the other solver has: motors by least jerk, clubs that follow rigidly."""
    c, marks = first_guess(problem), problem.grid.marks
    motion = problem.drive.at(c)
    for k, one in enumerate(stages):
        times = np.linspace(edges[k], edges[k + 1], STAGES[k] + 1)
        rows = [np.interp(times, marks, motion[:, a, o]) for a in (0, 1) for o in range(3)]
        one["stage"].set_initial(one["motors"], np.stack(rows))
        club = np.zeros((8, len(times)))
        club[0], club[4] = rows[0] + rows[3], rows[1] + rows[4]
        one["stage"].set_initial(one["clubs"], np.tile(club, (len(problem.scenarios), 1)))
