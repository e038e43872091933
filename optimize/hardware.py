"""What other hardware would do for a swing: slopes of its least cost, and the best hardware."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from ..model.rig import Rig
from .solve import Begin, settled
from .solve_grid import Maps, Motors, followed
from .solve_newton import Found, _about, _conditions, closed, settle
from .solve_problem import Plant, Problem
from .solve_program import reading, rest_equations, shaft_families, vibration_cost
from .solve_scenarios import plant_of, scenarios_of
from .solve_torque import torque_families
from .task import SwingTask

NAMES = ("wrist_stiffness", "wrist_damping", "collet_inertia")
"""What can be bought of a wrist and a collet."""

CHANGE = 1e-5
"""Share by which a parameter is changed under a swing that stays as it is [-]; small, for what
rings on is weighed so much that a held swing's cost bends sharply."""

WEIGHTS = ((-2, 1 / 12), (-1, -8 / 12), (1, 8 / 12), (2, -1 / 12))
"""Steps and weights of a difference of fourth order [-]."""

WEIGHED = 0.05
"""Share by which the weight of vibration is changed [-]."""

TURNS = 25
"""Steps of the search for the best hardware [-]."""

ENOUGH = 1e-5
"""Change of the least cost, as a share of it, that ends the search [-]."""

AT_END = 1e-6
"""Share of a parameter within which it stands at an end of its range [-]."""


@dataclass(frozen=True)
class Slopes:
    """How what a swing costs at best changes with the hardware.

    Attributes:
        cost: change of the least cost of the task when a parameter grows e-fold, at the rate that
            it has where it stands, by name [-].
        vibration: the same of the vibration's part, the swing being the best one before and
            after, by name [-].
        left: largest share by which the conditions of an optimum are missed [-].
    """

    cost: Mapping[str, float]
    vibration: Mapping[str, float]
    left: float


def slopes(problem: Problem, found: Found, rig: Rig, names: Sequence[str] = NAMES) -> Slopes:
    """Slopes of the least cost by parameters, of the solution and its multipliers alone.

    At an optimum a swing that adapts gains nothing to first order, so the slope of the cost is
    that of the Lagrangian with swing and multipliers held. The vibration's own slope is how that
    slope changes with the weight of vibration, for which two more swings are solved.

    Args:
        problem: what was solved.
        found: its solution, settled and feasible.
        rig: the robot.
        names: of its parameters.

    Returns:
        The slopes.

    Raises:
        ValueError: for a swing that is not settled, or a parameter that the robot does not have.

    Source: the envelope theorem, e.g. Fiacco 1976, doi:10.1007/BF01580677;
    tests/optimize/test_hardware.py.
    """
    _check(problem, found, names)
    plant = plant_of(problem, rig)
    here, left = _slopes(problem, plant, found, rig, names)
    weight, ends = problem.task.cost.vibration, []
    for share in (1.0 - WEIGHED, 1.0 + WEIGHED):
        cost = replace(problem.task.cost, vibration=share * weight)
        other = replace(problem, task=replace(problem.task, cost=cost))
        again = settle(other, plant, found.c, found.states, looked=found.looked)
        ends.append(_slopes(other, plant, again, rig, names)[0])
    vibration = {name: (ends[1][name] - ends[0][name]) / (2 * WEIGHED) for name in names}
    return Slopes(here, vibration, left)


def held(
    problem: Problem, found: Found, rig: Rig, numbers: Mapping[str, float]
) -> tuple[float, dict[str, float]]:
    """What other hardware does under a swing that was made for this one.

    Args:
        problem: what was solved.
        found: its solution.
        rig: the robot.
        numbers: of the other hardware, by name [SI].

    Returns:
        Vibration's part of the cost [-], and the errors at impact of the robot itself, by name
        [m/s or rad].
    """
    motion = problem.drive.at(found.c)
    scenarios = tuple({**one, **numbers} for one in problem.scenarios)
    still = Motors(np.zeros((*motion.shape, 0)), motion)
    other = replace(problem, drive=still, scenarios=scenarios)
    states = _moved(other, rig, found)
    x, z = states[problem.nominal, problem.grid.impact], motion[problem.grid.impact]
    seen = reading(problem.task, scenarios[problem.nominal], x, z, problem.flat)
    errors = dict(zip(seen.names, map(float, seen.values), strict=True))
    return _vibration(other, states), errors


def _check(problem: Problem, found: Found, names: Sequence[str]) -> None:
    if not (found.settled and found.feasible):
        raise ValueError(
            "hardware: expected a swing that is settled within its limits, found one that is not. "
            "Mend: solve a task that is feasible."
        )
    known = problem.scenarios[problem.nominal]
    for name in names:
        if not known.get(name, 0.0) > 0.0:
            expected = ", ".join(one for one, value in known.items() if value > 0.0)
            raise ValueError(
                f"hardware: expected parameters above 0 of {expected}, found '{name}'. "
                "Mend: name one of these."
            )


@dataclass(frozen=True)
class _Pulls:
    """Multipliers of a solution: of the limits' rows and of the conditions at impact [cost]."""

    prices: np.ndarray
    conditions: np.ndarray
    left: float


def _slopes(
    problem: Problem, plant: Plant, found: Found, rig: Rig, names: Sequence[str]
) -> tuple[dict[str, float], float]:
    """Slopes of the least cost by the logarithm of each parameter, and what the optimum misses."""
    pulls = _pulls(problem, plant, found)
    motion = problem.drive.at(found.c)
    none = np.zeros((*motion.shape, 0))
    still = replace(problem, drive=Motors(none, motion))
    by = {}
    for name in names:
        by[name] = sum(
            weight * _lagrangian(_changed(still, name, 1.0 + k * CHANGE), rig, found, pulls)
            for k, weight in WEIGHTS
        ) / CHANGE  # fmt: skip
    return by, pulls.left


def _changed(problem: Problem, name: str, share: float) -> Problem:
    """The same problem for robots of which one number is changed."""
    scenarios = tuple({**one, name: one[name] * share} for one in problem.scenarios)
    return replace(problem, scenarios=scenarios)


def _pulls(problem: Problem, plant: Plant, found: Found) -> _Pulls:
    """Multipliers; those of equations by what is left of the gradient."""
    here = _about(problem, plant, found.c, found.states)
    slope = 2.0 * here.costs.rows.T @ (here.costs.rows @ found.c - here.costs.aim)
    size, prices, low = np.abs(slope).max(), 2.0 * found.answer.prices, 0
    for family, rows in zip(here.families, found.looked, strict=True):
        slope = slope + family.slope[rows].T @ prices[low : low + len(rows)]
        low += len(rows)
    rest = rest_equations(problem.task, problem.drive)[0]
    hit = np.stack([slope for _, slope, _ in _conditions(problem, here)])
    whole = np.concatenate([rest, hit])
    scale = np.abs(whole).max(axis=1)
    pulls = np.linalg.lstsq((whole / scale[:, None]).T, -slope, rcond=None)[0] / scale
    left = float(np.abs(slope + whole.T @ pulls).max() / max(size, 1e-300))
    return _Pulls(prices, pulls[len(rest) :], left)


def _lagrangian(problem: Problem, rig: Rig, found: Found, pulls: _Pulls) -> float:
    """What depends on the robot of cost, limits and conditions, the motors' motion being held."""
    task, grid, none = problem.task, problem.grid, np.zeros(0)
    motion, states = problem.drive.level, _moved(problem, rig, found)
    total, maps = _vibration(problem, states), Maps(np.zeros((*states.shape, 0)), states)
    families = shaft_families(task, problem.scenarios, grid, maps, states, problem.flat)
    families += torque_families(problem, maps, states, none, problem.flat)
    bound = len(found.families) - len(families)  # those of the motors' own motion come first
    low = sum(len(rows) for rows in found.looked[:bound])
    for family, rows in zip(families, found.looked[bound:], strict=True):
        total += float(pulls.prices[low : low + len(rows)] @ family.level[rows])
        low += len(rows)
    values = []
    for index in problem.struck:
        z, x = motion[grid.impact], states[index, grid.impact]
        seen = reading(task, problem.scenarios[index], x, z, problem.flat)
        for name, value in zip(seen.names, seen.values, strict=True):
            if index == problem.struck[0] or name not in ("arm", "wrist"):
                values.append(value)
    return total + float(pulls.conditions @ np.array(values))


def _moved(problem: Problem, rig: Rig, found: Found) -> np.ndarray:
    """What the robots of a problem do under motors whose motion is held, as of `Found.states`."""
    plant, motion = plant_of(problem, rig), problem.drive.level
    if plant.constant:
        return followed(plant.steps(found.states, motion), motion, plant.start())
    return closed(problem, plant, np.zeros(0), found.states)


def _vibration(problem: Problem, states: np.ndarray) -> float:
    """Vibration's part of the cost of a motion."""
    task, maps = problem.task, Maps(np.zeros((*states.shape, 0)), states)
    if not task.cost.vibration:
        return 0.0
    given = task, problem.scenarios, problem.grid, maps, problem.drive, problem.ring
    aim = vibration_cost(*given)[1]
    return float(aim @ aim)


@dataclass(frozen=True)
class Hardware:
    """The hardware whose best swing costs least.

    Attributes:
        numbers: of what was varied, by name [SI].
        cost: of the best swing there [-].
        begun: of the best swing on the rig as it is [-].
        at_bound: of what was varied, what stands at an end of its range.
        swings: how many were solved [-].
    """

    numbers: Mapping[str, float]
    cost: float
    begun: float
    at_bound: tuple[str, ...]
    swings: int


def best_hardware(
    task: SwingTask,
    rig: Rig,
    ranges: Mapping[str, tuple[float, float]],
    tell: Callable[[str], None] = lambda text: None,
) -> Hardware:
    """Hardware and swing searched together, along the slopes of what a swing costs at best.

    Args:
        task: with fixed times; its scenarios are solved for, none is added.
        rig: where the search begins; its fidelity is obeyed.
        ranges: lowest and highest of each parameter, by name [SI].
        tell: told what is being done.

    Returns:
        The best that was found; a local optimum, as any search along slopes finds.

    Raises:
        ValueError: where the rig as it is cannot swing, or a range does not hold its value.
    """
    names, factors = tuple(ranges), scenarios_of(task)
    start = {name: float(rig.parameters[name].value) for name in names}
    for name, (low, high) in ranges.items():
        if not 0.0 < low <= start[name] <= high:
            raise ValueError(
                f"hardware: {name}: expected a range around {start[name]:g}, found {low:g} to "
                f"{high:g}. Mend: widen it."
            )
    found, problem = settled(task, rig, None, factors, None)
    _check(problem, found, names)
    scale, state = found.cost, _Search(found, found.cost, 1)

    def at(x: np.ndarray) -> tuple[float, np.ndarray]:
        own = with_numbers(rig, dict(zip(names, np.exp(x).tolist(), strict=True)))
        last = state.last
        before = Begin(last.c, last.states, factors, last.looked)
        one, asked = settled(task, own, None, factors, before)
        state.swings += 1
        if not (one.settled and one.feasible):
            return 2.0 * state.worst / scale, np.zeros(len(names))
        state.last, state.worst = one, max(state.worst, one.cost)
        by = _slopes(asked, plant_of(asked, own), one, own, names)[0]
        tell(f"swing {state.swings}: cost {one.cost:.4g} of {scale:.4g}")
        return one.cost / scale, np.array([by[name] for name in names]) / scale

    bounds = [tuple(np.log(ranges[name])) for name in names]
    begin = np.log([start[name] for name in names])
    options = {"maxiter": TURNS, "ftol": ENOUGH}
    done = minimize(at, begin, jac=True, bounds=bounds, method="L-BFGS-B", options=options)
    numbers = dict(zip(names, np.exp(done.x).tolist(), strict=True))
    ends = tuple(
        name
        for name, x, pair in zip(names, done.x, bounds, strict=True)
        if min(abs(x - pair[0]), abs(x - pair[1])) < AT_END
    )
    return Hardware(numbers, float(done.fun) * scale, scale, ends, state.swings)


@dataclass
class _Search:
    """What a search keeps: the last swing that was found, the worst cost, how many were solved."""

    last: Found
    worst: float
    swings: int


def with_numbers(rig: Rig, numbers: Mapping[str, float]) -> Rig:
    """The same rig with other numbers of some of its parameters [SI]."""
    changed = {name: rig.parameters[name].at(value) for name, value in numbers.items()}
    return replace(rig, parameters={**rig.parameters, **changed})
