"""The planar swing by a second solver: SLSQP from the same start, every derivative exact."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from supple.model.rig import read_rig
from supple.optimize.solve import HELD, SOFTER
from supple.optimize.solve_newton import _about, _conditions, closed, settle
from supple.optimize.solve_problem import first_guess
from supple.optimize.solve_program import rest_equations
from supple.optimize.solve_scenarios import plant_of, stated
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task

SPLINES, FAR = 24, 1e9


class Reduced:
    """A planar problem as a function of its unknowns alone: the motion is closed at each of them.

    Coordinates are those in which the first quadratic model of the cost is a plain distance. Where
    the motion runs away everything is large, so that a line search comes back.
    """

    def __init__(self, problem, plant, c, states):
        self.problem, self.plant = problem, plant
        self.states = closed(problem, plant, c, states)
        self.back: Any = np.eye(len(c))
        self.known: Any = None
        self.scale: Any = None
        self.sizes = [0, 0]
        costs = self.at(c).costs
        upper = np.linalg.qr(costs.rows, mode="r")
        self.back = solve_triangular(upper, np.eye(len(c)))
        self.start, self.known = upper @ c, None

    def at(self, w):
        """Everything about one motion, None where it runs away; the last one is the next guess."""
        if self.known is None or not np.array_equal(self.known[0], w):
            c = self.back @ w
            states = closed(self.problem, self.plant, c, self.states)
            here = None
            if np.isfinite(states).all():
                self.states = states
                here = _about(self.problem, self.plant, c, states)
            self.known = w.copy(), here
        return self.known[1]

    def cost(self, w):
        here = self.at(w)
        if here is None:
            return FAR, np.zeros_like(w)
        left = here.costs.rows @ here.c - here.costs.aim
        return 1e3 * here.cost, 2e3 * (here.costs.rows.T @ left) @ self.back

    def equal(self, w):
        here = self.at(w)
        if here is None:
            return np.full(self.sizes[0], FAR), np.zeros((self.sizes[0], len(w)))
        rest, sides = rest_equations(self.problem.task, self.problem.drive)
        found = _conditions(self.problem, here)
        values = np.concatenate([rest @ here.c - sides, [value for _, _, value in found]])
        rows = np.concatenate([rest, [slope for _, slope, _ in found]]) @ self.back
        if self.scale is None:
            self.scale = np.abs(rows).max(axis=1)
        self.sizes[0] = len(values)
        return values / self.scale, rows / self.scale[:, None]

    def inside(self, w):
        here = self.at(w)
        if here is None:
            return np.full(self.sizes[1], -FAR), np.zeros((self.sizes[1], len(w)))
        level = np.concatenate([one.slope @ here.c + one.level for one in here.families])
        rows = np.concatenate([one.slope for one in here.families]) @ self.back
        self.sizes[1] = 2 * len(level)
        return np.concatenate([1.0 - level, 1.0 + level]), np.concatenate([-rows, rows])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*encountered.*:RuntimeWarning")
def test_another_solver_finds_the_same_planar_cost_from_the_same_start(tmp_path):
    task = read_task(write_task(tmp_path, "planar", points=101))
    rig = read_rig(task.rig)
    problem = stated(task, rig, None, (1.0,), SPLINES)
    plant = plant_of(problem, rig)
    c, states = first_guess(problem), None
    for ring, most in SOFTER:  # from farther away a single shot runs away
        hold = HELD if states is None else 0.0
        soft = settle(
            replace(problem, ring=ring), plant, c, states, most=most, hold=hold, still=0.1
        )
        c, states = soft.c, soft.states
    ours = settle(problem, plant, c, states)
    other = Reduced(problem, plant, c, states)
    begun = other.at(other.start).cost
    done = minimize(
        other.cost, other.start, jac=True, method="SLSQP",
        constraints=[
            {"type": "eq", "fun": lambda w: other.equal(w)[0], "jac": lambda w: other.equal(w)[1]},
            {"type": "ineq", "fun": lambda w: other.inside(w)[0],
             "jac": lambda w: other.inside(w)[1]},
        ],
        options={"maxiter": 400, "ftol": 1e-10},
    )  # fmt: skip
    missed = np.abs(other.equal(done.x)[0]).max(), other.inside(done.x)[0].min()
    assert ours.settled and done.success, done.message
    assert missed[0] < 1e-6 and missed[1] > -1e-6
    assert begun > 2.0 * ours.cost
    assert ours.cost == pytest.approx(1e-3 * done.fun, rel=0.01)
