"""From a task to the unknowns of its swing: one program after another until impact is met."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .solve_grid import Maps, Steps, condensed, followed
from .solve_problem import Plant, Problem
from .solve_program import (
    Family,
    broken,
    golfer_cost,
    jerk_cost,
    looked_at,
    motor_families,
    reading,
    rest_equations,
    row_numbers,
    shaft_families,
    vibration_cost,
)
from .solve_quadratic import Answer, Bounds, Reduced, nearest, reduce, triangle_of
from .solve_torque import torque_families

MOST_PROGRAMS = 40
"""Programs after which a swing is given up [-]."""

MET = 1e-6
"""Error at impact, or distance of a motion from the plant, that counts as none [m/s, rad, m]."""

STILL = 2e-4
"""Change of the unknowns, as a share of their size, that counts as none [-]."""

ALLOWED = 1e-7
"""Share by which a row that was not looked at may be broken [-]."""

LOOKS = 12
"""How often broken rows are added to one program [-]."""

CLOSED, CLOSINGS = 1e-8, 12
"""Distance of a motion from what the plant makes of it that counts as none [rad or m],
and in how many Newton steps a motion may be closed."""

NEAR = 0.05
"""Distance from what the plant makes of them at which costs of motions compare [rad or m]."""

WORSE = 1.5
"""Factor by which the cost may rise before the next program is held back [-]."""

TRUSTED, LEAST = 0.3, 0.02
"""Share of a way by which a motion may miss the plant, and the least share that is gone [-]."""

HELD_BACK, STEPPED, LET_GO, MOST_HELD = 0.03, 2.0, 1e-3, 1.0
"""First weight that holds a program near the last one, its factor, what is none, and most [-]."""

SWAYS, SWAYED = 4, 0.3
"""From which program on, and from what change of the unknowns on, a sway is held back [-]."""

SAME = 0.02
"""Change of what limits would have to be widened by that is none, as a share of it [-]."""

ALIKE, PATIENT = 1e-4, 8
"""Change of the cost that is none where limits leave hardly any room and unknowns wander [-], and
after how many programs three such changes settle a swing [-]."""

FASTER, LIGHT = 3.0, 1e-4
"""How far beyond the speed asked for the fastest swing is looked for, and how little its cost
weighs against that [-]."""


@dataclass(frozen=True)
class Found:
    """Unknowns that settle a problem, or the last ones.

    Attributes:
        c: shape (unknowns,) [limits of jerk].
        states: at every mark, shape (scenarios, marks, 8) [SI].
        answer: of the last program.
        families: its limits.
        looked: which rows of each it looked at [-].
        error: largest error at impact [m/s or rad].
        defect: largest step that the states do not follow [SI].
        cost: of the task [-].
        parts: jerk, vibration and golfer's share of the cost [-].
        programs: how many were solved [-].
        settled: whether nothing changes any more and impact is met.
    """

    c: np.ndarray
    states: np.ndarray
    answer: Answer
    families: tuple[Family, ...]
    looked: tuple[np.ndarray, ...]
    error: float
    defect: float
    cost: float
    parts: Mapping[str, float]
    programs: int
    settled: bool

    @property
    def feasible(self) -> bool:
        """Whether all limits hold."""
        return self.answer.widened <= 1e-8

    @property
    def finite(self) -> bool:
        """Whether motion and cost are numbers."""
        return bool(np.isfinite(self.cost) and np.isfinite(self.states).all())


def settle(
    problem: Problem,
    plant: Plant,
    c: np.ndarray,
    states: np.ndarray | None = None,
    tell: Callable[[str], None] = lambda text: None,
    most: int = MOST_PROGRAMS,
    hold: float = 0.0,
    still: float = STILL,
    looked: Sequence[np.ndarray] = (),
) -> Found:
    """Program after program about the last motion, until nothing changes.

    Args:
        problem: what is asked.
        plant: what moves.
        c: unknowns to begin with, shape (unknowns,) [limits of jerk].
        states: motion to begin with, shape (scenarios, marks, 8) [SI]; what the plant's steps
            about its start make of `c` by default.
        tell: told what is being done.
        most: programs after which it is given up [-].
        hold: weight that keeps a program near the last one [-].
        still: change of the unknowns, as a share of their size, that counts as none [-].
        looked: rows of each limit to be looked at from the beginning [-].

    Returns:
        What was found; for a plant of constant steps the states follow it exactly.
    """
    extra, found, least, wide, alike = None, None, 0.0, 0.0, 0
    here = _about(problem, plant, c, _rigid(problem, c) if states is None else states)
    for number in range(1, most + 1):
        extra = _rows_of(here.families, looked) if extra is None else extra
        answer = _keeping(_program(problem, here, hold), here, extra)
        there, share = _reached(problem, plant, answer.c, here)
        is_worse = there.cost > WORSE * here.cost and max(there.left, here.left) < NEAR
        change = float(np.abs(answer.c - here.c).max() / max(np.abs(answer.c).max(), 1e-12))
        settled = share == 1.0 and change <= still
        alike = alike + 1 if abs(there.cost - here.cost) <= ALIKE * there.cost else 0
        settled = settled or (share == 1.0 and number >= PATIENT and alike >= 3)
        if still == STILL:
            settled = settled and there.left <= MET and there.error <= MET
        rows = tuple(row_numbers(f, more) for f, more in zip(here.families, extra, strict=True))
        found = Found(
            there.c, there.states, answer, here.families, rows, there.error, there.left,
            there.cost, _told(there.costs, there.c)[1], number, settled,
        )  # fmt: skip
        tell(
            f"program {number}: cost {there.cost:.6g}, error at impact {there.error:.1e}, "
            f"change {change:.1e}, share {share:g}, left {there.left:.1e} hold {hold:.3g}"
        )
        here = there
        if is_worse and not plant.constant:
            hold = min(max(HELD_BACK, STEPPED * hold), MOST_HELD)
            least = hold / STEPPED
        elif share < 1.0:
            hold = min(max(HELD_BACK, STEPPED * hold), MOST_HELD)
        elif problem.most_speed and number >= SWAYS and change > SWAYED:
            hold = least = min(max(HELD_BACK, STEPPED * hold), MOST_HELD)
        else:
            hold = max(least, hold / STEPPED) if hold > LET_GO else 0.0
        wide, before = answer.widened, wide
        if wide > ALLOWED and abs(wide - before) <= SAME * wide and share == 1.0:
            break  # the limits stand in the way, by as much as before
        if found.settled or not found.finite:
            break
    assert found is not None
    return found


def _rows_of(families: Sequence[Family], looked: Sequence[np.ndarray]) -> list[set[int]]:
    """Rows that were looked at before, where the limits are the same ones."""
    if len(looked) != len(families):
        return [set() for _ in families]
    return [
        {int(row) for row in rows if row < len(family.times)}
        for family, rows in zip(families, looked, strict=True)
    ]


def _reached(problem: Problem, plant: Plant, c: np.ndarray, here: _About) -> tuple[_About, float]:
    """The problem about new unknowns, as far along the way as the plant is nearly linear."""
    moved = here.maps.at(c)
    if plant.constant:
        return _about(problem, plant, c, moved, here.steps, here), 1.0
    way, share = _distance(moved, here.states), 1.0
    while True:
        part = here.c + share * (c - here.c)
        states = here.states + share * (moved - here.states)
        motion = problem.drive.at(part)
        steps = plant.steps(states, motion)
        left = _distance(followed(steps, motion, plant.start()), states)
        if left <= (1.0 - share) * here.left + TRUSTED * share * way or left <= CLOSED:
            break
        if share < LEAST:
            break
        share *= 0.5
    return _about(problem, plant, part, states, steps), share


def closed(problem: Problem, plant: Plant, c: np.ndarray, states: np.ndarray) -> np.ndarray:
    """The motion that some unknowns make, by Newton's method on all steps at once.

    Args:
        problem: what is asked.
        plant: what moves.
        c: unknowns, shape (unknowns,) [limits of jerk].
        states: a guess of the motion, shape (scenarios, marks, 8) [SI].

    Returns:
        The motion, shape (scenarios, marks, 8) [SI]; not finite where the method runs away.
    """
    motion = problem.drive.at(c)
    for _ in range(CLOSINGS):
        moved = followed(plant.steps(states, motion), motion, plant.start())
        left, states = _distance(moved, states), moved
        if left <= CLOSED:
            return states
        if not np.isfinite(left):
            break
    return np.full_like(states, np.nan)


def _rigid(problem: Problem, c: np.ndarray) -> np.ndarray:
    """A motion in which every club follows the motors, (scenarios, marks, 8) [SI]."""
    motion = problem.drive.at(c)
    found = np.zeros((len(problem.scenarios), len(motion), 8))
    found[..., 0] = motion[:, :, 0].sum(axis=1)
    found[..., 4] = motion[:, :, 1].sum(axis=1)
    return found


@dataclass(frozen=True)
class _About:
    """A problem about one motion: states as functions of the unknowns, cost, limits, and misses."""

    c: np.ndarray
    states: np.ndarray
    left: float
    steps: Steps
    maps: Maps
    costs: _Costs
    families: tuple[Family, ...]
    cost: float
    error: float
    missed: float


def _about(
    problem: Problem,
    plant: Plant,
    c: np.ndarray,
    states: np.ndarray,
    steps: Steps | None = None,
    known: _About | None = None,
) -> _About:
    drive = problem.drive
    steps = plant.steps(states, drive.at(c)) if steps is None else steps
    maps = condensed(steps, drive, plant.start()) if known is None else known.maps
    if plant.constant:  # then states that come with their maps were read from them
        states, left = states if known is not None else maps.at(c), 0.0
    else:
        left = _distance(maps.at(c), states)
    families = motor_families(problem.task, problem.grid, drive)
    families += shaft_families(
        problem.task, problem.scenarios, problem.grid, maps, states, problem.flat
    )
    families += torque_families(problem, maps, states, c, plant.constant)
    costs = _costs(problem, maps) if known is None else known.costs
    error, total = _errors(problem, states, c)
    over = [float(np.max(np.abs(f.slope @ c + f.level))) - 1.0 for f in families]
    missed = total + max(0.0, max(over, default=0.0) - ALLOWED)
    return _About(
        c, states, left, steps, maps, costs, tuple(families), _told(costs, c)[0], error, missed
    )


def _distance(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance of two motions, a rate counting a tenth [rad or m]."""
    away = np.abs(one - other)
    return float(max(away[..., :4].max(), 0.1 * away[..., 4:].max()))


@dataclass(frozen=True)
class _Costs:
    """Triangles of the parts of the cost: name, rows, aim, and what is left at best."""

    parts: tuple[tuple[str, np.ndarray, np.ndarray], ...]
    rows: np.ndarray
    aim: np.ndarray


def _costs(problem: Problem, maps: Maps) -> _Costs:
    task, grid, drive = problem.task, problem.grid, problem.drive
    jerk = jerk_cost(task, grid)
    parts = [("jerk", jerk, np.zeros(len(jerk)))]
    if task.cost.vibration:
        rows = vibration_cost(task, problem.scenarios, grid, maps, drive, problem.ring)
        parts.append(("vibration", *_triangle(*rows)))
    if problem.golfer is not None and task.cost.golfer:
        rows = golfer_cost(task, grid, drive, problem.golfer)
        parts.append(("golfer", *_triangle(*rows)))
    whole = np.concatenate([rows for _, rows, _ in parts])
    return _Costs(tuple(parts), *_triangle(whole, np.concatenate([aim for _, _, aim in parts])))


def _triangle(rows: np.ndarray, aim: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As many rows as unknowns, and one more, with the same squares."""
    whole = np.column_stack([rows, aim])
    if len(whole) <= whole.shape[1]:
        return rows, aim
    upper = triangle_of(whole)
    return upper[:, :-1], upper[:, -1]


def _told(costs: _Costs, c: np.ndarray) -> tuple[float, dict[str, float]]:
    parts = {name: float(np.sum((rows @ c - aim) ** 2)) for name, rows, aim in costs.parts}
    return sum(parts.values()), parts


def _program(problem: Problem, here: _About, hold: float) -> Reduced:
    """Cost and equations about a motion, of the step that leads on from it."""
    equations, sides = rest_equations(problem.task, problem.drive)
    rows, left = [equations], [sides - equations @ here.c]
    cost, aim = here.costs.rows, here.costs.aim - here.costs.rows @ here.c
    for name, slope, value in _conditions(problem, here):
        if name == "speed" and problem.most_speed:
            goal = (FASTER - 1.0) * problem.task.impact.clubhead_speed
            cost = np.concatenate([LIGHT * cost, slope[None] / goal])
            aim = np.append(LIGHT * aim, (goal - value) / goal)
            continue
        size = np.abs(slope).max()
        rows.append(slope[None] / size)
        left.append(np.array([-value / size]))
    if hold:
        cost = np.concatenate([cost, hold * np.eye(len(here.c))])
        aim = np.concatenate([aim, np.zeros(len(here.c))])
    return reduce(cost, aim, np.concatenate(rows), np.concatenate(left))


def _conditions(problem: Problem, here: _About) -> list[tuple[str, np.ndarray, float]]:
    """Name, slope over the unknowns and error of all that must hold at impact."""
    found = []
    for index in problem.struck:
        for one in zip(*_impact_rows(problem, here, index), strict=True):
            # the motors' own angle is the same in every scenario
            if index == problem.struck[0] or one[0] not in ("arm", "wrist"):
                found.append(one)
    return found


def _impact_rows(
    problem: Problem, here: _About, index: int
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Names, slopes over the unknowns, and what is read beyond what must hold."""
    at, drive = problem.grid.impact, problem.drive
    z = drive.at(here.c)[at]
    seen = reading(problem.task, problem.scenarios[index], here.states[index, at], z, problem.flat)
    slope = seen.by_state @ here.maps.slope[index, at]
    slope = slope + np.einsum("kaj,ajn->kn", seen.by_motor, drive.slope[at, :, :2])
    return seen.names, slope, seen.values


def _keeping(program: Reduced, here: _About, extra: list[set[int]]) -> Answer:
    """The program's answer with every limit kept; `extra` grows by the rows that were broken."""
    answer, families = None, here.families
    for _ in range(LOOKS):
        bounds = looked_at(families, extra)
        moved = bounds.rows @ here.c
        step = nearest(program, Bounds(bounds.rows, bounds.low - moved, bounds.high - moved))
        answer = replace(step, c=here.c + step.c)
        fresh = 0
        allowed = ALLOWED + answer.widened
        for more, rows in zip(extra, broken(families, answer.c, allowed), strict=True):
            fresh += len(rows - more)
            more |= rows
        if not fresh:
            break
    assert answer is not None
    return answer


def _errors(problem: Problem, states: np.ndarray, c: np.ndarray) -> tuple[float, float]:
    """Largest error at impact where it must be met, and the sum; the speed's unless it is free."""
    at, found = problem.grid.impact, [0.0]
    z = problem.drive.at(c)[at]
    for index in problem.struck:
        numbers = problem.scenarios[index]
        seen = reading(problem.task, numbers, states[index, at], z, problem.flat)
        for name, value in zip(seen.names, seen.values, strict=True):
            if not (problem.most_speed and name == "speed"):
                found.append(abs(float(value)))
    return max(found), sum(found)
