"""A second opinion on a linear swing: the same program with its nonlinear impact, by IPOPT."""

from __future__ import annotations

from dataclasses import dataclass

import casadi
import numpy as np
from scipy.linalg import solve_triangular

from .solve_grid import Steps, condensed
from .solve_problem import Problem, first_guess
from .solve_program import (
    HELD,
    impact_of,
    jerk_cost,
    motor_families,
    rest_equations,
    shaft_families,
    vibration_cost,
    wanted,
)
from .solve_quadratic import triangle_of
from .solve_torque import torque_families

OPTIONS = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "print_time": 0,
    "ipopt.tol": 1e-11,
    "ipopt.max_iter": 300,
}
"""What IPOPT is told."""


@dataclass(frozen=True)
class Opinion:
    """What another solver makes of a problem.

    Attributes:
        cost: of the task [-].
        c: unknowns, shape (n,) [limits of jerk].
        status: of IPOPT, in its words.
    """

    cost: float
    c: np.ndarray
    status: str


def second_opinion(problem: Problem, steps: Steps, start: np.ndarray) -> Opinion:
    """Solve a linear problem by IPOPT, with every row of every limit and the exact impact.

    The states are the same functions of the unknowns as in `supple.optimize.solve_newton`;
    conditions at impact are not linearized, and derivatives are casadi's.

    Args:
        problem: of fidelity ``thesis``, without a golfer.
        steps: of every scenario.
        start: state at the first mark, shape (scenarios, 8) [SI].

    Returns:
        Cost and unknowns; it begins where the other solver begins.
    """
    grid, drive, task = problem.grid, problem.drive, problem.task
    maps = condensed(steps, drive, start)
    jerk = jerk_cost(task, grid)
    rows, aim = vibration_cost(task, problem.scenarios, grid, maps, drive, problem.ring)
    whole = np.column_stack(
        [np.concatenate([jerk, rows]), np.concatenate([np.zeros(len(jerk)), aim])]
    )
    upper = triangle_of(whole)
    n = len(jerk)
    triangle, target, rest = upper[:n, :n], upper[:n, n], float(upper[n, n] ** 2)
    back = solve_triangular(triangle, np.eye(n))  # coordinates in which the cost is a distance
    w = casadi.MX.sym("w", n)
    c = casadi.mtimes(casadi.DM(back), w)
    families = motor_families(task, grid, drive)
    first = first_guess(problem)
    begun = maps.at(first)
    families += shaft_families(task, problem.scenarios, grid, maps, begun, flat=True)
    families += torque_families(problem, maps, begun, first, flat=True)
    limits = np.concatenate([one.slope for one in families])
    level = np.concatenate([one.level for one in families])
    still, sides = rest_equations(task, drive)
    hit = _impact(problem, maps.slope, maps.level, c)
    found = casadi.vertcat(
        casadi.mtimes(casadi.DM(still @ back), w), *hit, casadi.mtimes(casadi.DM(limits @ back), w)
    )
    goal = np.concatenate([sides, np.zeros(len(hit))])
    cost = casadi.sumsqr(w - casadi.DM(target)) + rest
    solver = casadi.nlpsol("swing", "ipopt", {"x": w, "f": cost, "g": found}, OPTIONS)
    answer = solver(
        x0=triangle @ first,
        lbg=np.concatenate([goal, -1.0 - level]),
        ubg=np.concatenate([goal, 1.0 - level]),
    )
    unknowns = back @ np.asarray(answer["x"]).ravel()
    return Opinion(float(answer["f"]), unknowns, str(solver.stats()["return_status"]))


def _impact(
    problem: Problem, slope: np.ndarray, level: np.ndarray, c: casadi.MX
) -> list[casadi.MX]:
    """What is read at impact less what must hold, as casadi sees the energies' kinematics."""
    at, drive, found = problem.grid.impact, problem.drive, []

    def moved(rows: np.ndarray, first: np.ndarray) -> list[casadi.MX]:
        return casadi.vertsplit(casadi.mtimes(casadi.DM(rows), c) + casadi.DM(first))

    angles, rates = (moved(drive.slope[at, :, k], drive.level[at, :, k]) for k in (0, 1))
    for index in problem.struck:
        x = moved(slope[index, at], level[index, at])
        seen = impact_of(problem.scenarios[index], x, angles, rates, True, casadi)
        for name, value in wanted(problem.task).items():
            if index == problem.struck[0] or name not in ("arm", *HELD["drive"]):
                found.append(seen[name] - value)
    return found
