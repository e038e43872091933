"""The planar swing by a second solver: SLSQP from the same start, every derivative exact."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from supple.model.rig import read_rig
from supple.optimize.solve import settled
from supple.optimize.solve_newton import _about, _conditions, closed, settle
from supple.optimize.solve_problem import first_guess
from supple.optimize.solve_program import rest_equations
from supple.optimize.solve_scenarios import plant_of, stated
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task

SPLINES = 24


class Reduced:
    """A planar problem as a function of its unknowns alone: the motion is closed at each of them.

    Coordinates are those in which the first quadratic model of the cost is a plain distance.
    """

    def __init__(self, problem, plant, c, states):
        self.problem, self.plant = problem, plant
        self.states = closed(problem, plant, c, states)
        self.back: Any = np.eye(len(c))
        costs = self.at(c).costs
        upper = np.linalg.qr(costs.rows, mode="r")
        self.back = solve_triangular(upper, np.eye(len(c)))
        self.start = upper @ c

    def at(self, w):
        """Everything about one motion; the last one is the guess of the next."""
        c = self.back @ w
        states = closed(self.problem, self.plant, c, self.states)
        assert np.isfinite(states).all()
        self.states = states
        return _about(self.problem, self.plant, c, states)

    def cost(self, w):
        here = self.at(w)
        left = here.costs.rows @ here.c - here.costs.aim
        return 1e3 * here.cost, 2e3 * (here.costs.rows.T @ left) @ self.back

    def equal(self, w):
        here, found = self.at(w), _conditions(self.problem, self.at(w))
        rest, sides = rest_equations(self.problem.task, self.problem.drive)
        values = np.concatenate([rest @ here.c - sides, [value for _, _, value in found]])
        rows = np.concatenate([rest, [slope for _, slope, _ in found]])
        size = np.abs(rows @ self.back).max(axis=1)
        return values / size, (rows @ self.back) / size[:, None]

    def inside(self, w):
        here = self.at(w)
        level = np.concatenate([one.slope @ here.c + one.level for one in here.families])
        rows = np.concatenate([one.slope for one in here.families]) @ self.back
        return np.concatenate([1.0 - level, 1.0 + level]), np.concatenate([-rows, rows])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*encountered.*:RuntimeWarning")
def test_another_solver_finds_the_same_planar_cost_from_the_same_start(tmp_path):
    task = read_task(write_task(tmp_path, "planar", points=101))
    rig = read_rig(task.rig)
    ours = settled(task, rig, None, (1.0,), splines=SPLINES)[0]
    problem = stated(task, rig, None, (1.0,), SPLINES)
    plant = plant_of(problem, rig)
    # both begin from what the linear robot's motion makes of the first guess
    soft = settle(problem, plant, first_guess(problem), None, most=3, hold=0.1, still=0.1)
    other = Reduced(problem, plant, soft.c, soft.states)
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
    assert ours.cost == pytest.approx(1e-3 * done.fun, rel=0.01)
