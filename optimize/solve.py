"""solve(task, rig) -> Swing: the smoothest quiet swing that is at the ball with pose and speed."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..model.door import fault
from ..model.rig import Rig
from .profile import SwingProfile
from .solve_grid import SPLINES, Grid, make_grid
from .solve_limits import Binding, binding_limits
from .solve_linear import LinearPlant, free_rings
from .solve_newton import Found, closed, settle
from .solve_problem import Plant, Problem, faster, first_guess, problem_of
from .solve_program import RING, impact_of, reach
from .swing_check import rig_numbers, scaled
from .task import POSTERIOR, SHAFT_FREQUENCY, SwingTask

DENSE, DENSE_PLANAR = 41, 11
"""Factors at which the ring after the end is looked at between the scenarios, by fidelity [-]."""

RING_PLANAR = 1e-4
"""`RING` of a planar swing [-]: below it the clubhead's path bends within what a program sees."""

SOFTER, HELD, ROUGHLY = ((1e-1, 12), (1e-2, 8), (1e-3, 8)), 0.1, 0.1
"""Weights of the ring on the way to it with the programs that each may take, what holds the first
of them, and the change at which it is left [-]."""

AGREES, SILENT = 1.1, 5e-5
"""A ring between scenarios this much larger than theirs [-], or below this [m], agrees."""

MOST_ROUNDS = 3
"""How often a worst factor is added to the scenarios [-]."""

SLOWER = 0.98
"""Share of the fastest swing's speed that is promised to be feasible [-]."""

SOLVED = "solved"
NOT_SETTLED = "not_settled"
INFEASIBLE = "infeasible"

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Begin:
    """Where to begin from.

    Attributes:
        c: unknowns, shape (unknowns,) [limits of jerk].
        states: motion of every scenario, shape (scenarios, marks, 8) [SI]; None where unknown.
        factors: of the scenarios, ascending [-].
    """

    c: np.ndarray
    states: np.ndarray | None
    factors: tuple[float, ...]


@dataclass(frozen=True)
class Swing:
    """A swing, or the reason why there is none.

    Attributes:
        task: what was asked; its times are those that were used.
        fidelity: ``thesis`` or ``planar``.
        profile: points for the robot.
        problem: the last problem, with all scenarios.
        found: its unknowns and what they cost.
        factors: of each scenario [-].
        dense: factors at which the ring was looked at, shape (f,) [-].
        rings: largest distance of the clubhead from rest after the end there, shape (f,) [m].
        status: ``solved``, ``not_settled`` or ``infeasible``.
        binding: the limits that bind most, worst first.
        fastest: speed that the same task can reach, where this one cannot [m/s].
    """

    task: SwingTask
    fidelity: str
    profile: SwingProfile
    problem: Problem
    found: Found
    factors: tuple[float, ...]
    dense: np.ndarray
    rings: np.ndarray
    status: str
    binding: tuple[Binding, ...] = ()
    fastest: float | None = None

    @property
    def sentence(self) -> str:
        """The status in words."""
        if self.status == SOLVED:
            at = self.task.impact
            return (
                f"The clubhead is at the ball at {self.profile.impact_time:.6g} s with "
                f"{at.clubhead_speed:g} m/s, and rings by at most "
                f"{1e3 * float(self.rings.max()):.2g} mm after the end."
            )
        if self.status == INFEASIBLE:
            return infeasible_words(self)
        return (
            f"The swing has not settled after {self.found.programs} programs: impact is missed by "
            f"{self.found.error:.2g}. Relax a limit, or begin from fidelity = 'thesis'."
        )

    @property
    def begin(self) -> Begin:
        """Where an edited task may begin from."""
        return Begin(self.found.c, self.found.states, self.factors)

    @cached_property
    def motion(self) -> np.ndarray:
        """Angle, velocity, acceleration, jerk of arm and wrist at the marks, (marks, 2, 4) [SI]."""
        return self.problem.drive.at(self.found.c)


def infeasible_words(swing: Swing) -> str:
    """Which limit stands in the way, when, and what could be done."""
    speed = swing.task.impact.clubhead_speed
    first = swing.binding[0] if swing.binding else None
    where = "" if first is None else f": the {first.words} binds at {first.time:.4g} s"
    text = f"No swing reaches {speed:g} m/s within the limits{where}."
    if swing.fastest is None:
        share = 100 * swing.found.answer.widened
        return (
            f"{text} No speed is feasible: every limit would have to be {share:.3g} % wider. "
            "Change the pose, the start or the duration, or widen that limit."
        )
    return f"{text} The fastest feasible swing has {swing.fastest:.4g} m/s."


def solve(
    task: SwingTask,
    rig: Rig,
    golfer: Mapping[str, np.ndarray] | None = None,
    tell: Tell = lambda text: None,
    splines: int | None = SPLINES,
    begin: Begin | None = None,
) -> Swing:
    """Find the swing of a task.

    Args:
        task: as read.
        rig: the robot; its fidelity is obeyed.
        golfer: ``time`` and angles as measured, each of shape (n,) [s, rad].
        tell: told what is being done.
        splines: cubic splines of jerk an axis; None for a jerk of its own in every interval [-].
        begin: an earlier swing to go on from, see `Swing.begin`; the task was edited since.

    Returns:
        The swing; where limits forbid it, one that breaks them least, with the binding limit and
        the fastest feasible speed.

    Raises:
        ValueError: for laws that the fidelity cannot obey, or samples that cannot be read.

    Source: condensed least squares over splines of jerk, solved again about each solution;
    tests/optimize/test_solve.py.
    """
    _check_known(task)
    base = _scenarios(task) if begin is None else begin.factors
    found, problem = _solved(task, rig, golfer, base, tell, splines, begin)
    dense, rings = np.array(base), np.zeros(len(base))
    for number in range(MOST_ROUNDS + 1):
        if not found.feasible:
            break
        dense, rings = between_scenarios(problem, rig, found, base)
        fresh = _worst_between(base, dense, rings)
        if number == MOST_ROUNDS or not fresh or not task.robust.parameter:
            break
        tell(f"worst ring {1e3 * rings.max():.3g} mm; factors added: {fresh}")
        more = tuple(sorted({*base, *fresh}))
        states = between(base, found.states, np.array(more))
        base, before = more, Begin(found.c, states, more)
        found, problem = _solved(task, rig, golfer, base, tell, splines, before)
    status = SOLVED if found.settled else NOT_SETTLED
    profile = profile_of(problem, found, golfer)
    swing = Swing(
        task, rig.fidelity, profile, problem, found, base, dense, rings, status,
        binding_limits(found),
    )  # fmt: skip
    return swing if found.feasible else _without(swing, rig, tell)


def _check_known(task: SwingTask) -> None:
    """Refuse what a task may ask for and this solver does not do."""
    refused = {
        "[impact] free": (task.impact.time is None, "an instant of impact", "add time = 1.6"),
        "[swing] duration": (
            task.duration[0] != task.duration[1], "one duration", "write duration = 2.0"
        ),
        "[robust] parameter": (
            task.robust.parameter == POSTERIOR, "a parameter of the rig", "write 'shaft_frequency'"
        ),
    }  # fmt: skip
    for place, (is_refused, expected, mend) in refused.items():
        if is_refused:
            found = "one that is free" if place != "[robust] parameter" else "'posterior'"
            raise fault(task.path, place, expected, found, mend)


def _worst_between(
    base: tuple[float, ...], dense: np.ndarray, rings: np.ndarray
) -> tuple[float, ...]:
    """Factors at which the ring is largest between scenarios and much larger than at them [-]."""
    most = max(AGREES * float(np.interp(base, dense, rings).max()), SILENT)
    found = []
    for low, high in itertools.pairwise(base):
        inside = np.flatnonzero((dense > low + 1e-9) & (dense < high - 1e-9) & (rings > most))
        if len(inside):
            found.append(round(float(dense[inside[np.argmax(rings[inside])]]), 12))
    return tuple(found)


def _without(swing: Swing, rig: Rig, tell: Tell) -> Swing:
    """What to say where limits forbid the swing: the fastest one, and what holds that up."""
    tell("infeasible: looking for the fastest swing")
    problem = faster(swing.problem)
    plant = plant_of(problem, rig)
    best = settle(problem, plant, swing.found.c, None, tell)
    if not best.feasible:
        return replace(swing, status=INFEASIBLE, rings=np.zeros(len(swing.dense)))
    speed = SLOWER * _speed(problem, best)
    return replace(
        swing, status=INFEASIBLE, rings=np.zeros(len(swing.dense)),
        binding=binding_limits(best), fastest=speed,
    )  # fmt: skip


def _speed(problem: Problem, found: Found) -> float:
    """Lowest speed at impact over the scenarios in which it must be met [m/s]."""
    at, z = problem.grid.impact, problem.drive.at(found.c)
    return min(
        float(
            impact_of(problem.scenarios[index], found.states[index, at], z[at, :, 0], z[at, :, 1])[
                "speed"
            ]
        )
        for index in problem.struck
    )


def _scenarios(task: SwingTask) -> tuple[float, ...]:
    """Factors of the scenarios, the robot itself among them [-]."""
    robust = task.robust
    if not robust.parameter or robust.parameter == POSTERIOR:
        return (1.0,)
    found = np.linspace(*robust.factors, robust.scenarios) if robust.scenarios > 1 else [1.0]
    listed = sorted({*(round(float(one), 12) for one in found), 1.0})
    return tuple(listed)


def _parameter(task: SwingTask) -> str:
    known = task.robust.parameter
    return known if known and known != POSTERIOR else SHAFT_FREQUENCY


def _solved(
    task: SwingTask,
    rig: Rig,
    golfer: Mapping[str, np.ndarray] | None,
    factors: tuple[float, ...],
    tell: Tell,
    splines: int | None,
    begin: Begin | None = None,
) -> tuple[Found, Problem]:
    """One problem with its scenarios, settled."""
    problem = stated(task, rig, golfer, factors, splines)
    plant = plant_of(problem, rig)
    c = first_guess(problem) if begin is None else begin.c
    if plant.constant:
        return settle(problem, plant, c, None, tell), problem
    states = None if begin is None else begin.states
    if states is not None and states.shape[1] == len(problem.grid.marks):
        return settle(problem, plant, c, states, tell, hold=0.0), problem
    states = None
    for ring, most in SOFTER:
        hold = HELD if states is None else 0.0
        tell(f"weight of the ring 1/{ring:g}")
        soft = settle(replace(problem, ring=ring), plant, c, states, tell, most, hold, ROUGHLY)
        c, states = soft.c, soft.states
    return settle(problem, plant, c, states, tell), problem


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
    robots = [scaled(rig_numbers(rig), _parameter(task), factor) for factor in factors]
    problem = problem_of(task, grid, robots, factors.index(1.0), followed(golfer, grid))
    return replace(problem, ring=RING_PLANAR if rig.fidelity == "planar" else RING)


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
    task, motion = problem.task, problem.drive.at(found.c)
    low, high = task.robust.factors if task.robust.parameter else (0.9, 1.1)
    low, high = (low, high) if high > low else (0.9, 1.1)
    planar = rig.fidelity == "planar"
    dense = np.linspace(low, high, DENSE_PLANAR if planar else DENSE)
    robots = tuple(scaled(rig_numbers(rig), _parameter(task), factor) for factor in dense)
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


def profile_of(
    problem: Problem, found: Found, golfer: Mapping[str, np.ndarray] | None = None
) -> SwingProfile:
    """The points of a solution, with the golfer's grip angle where it is known.

    Args:
        problem: what was solved.
        found: its unknowns.
        golfer: see `solve` [s, rad].

    Returns:
        The profile; the robot reads it rounded and joined as the task states.
    """
    grid, task = problem.grid, problem.task
    angles = problem.drive.at(found.c)[grid.at_points, :, 0]
    grip: Any = np.zeros(len(grid.points))
    if golfer is not None and "grip_angle" in golfer:
        grip = np.interp(grid.points, golfer["time"], golfer["grip_angle"])
    hit = float(grid.marks[grid.impact])
    before = grid.points <= hit
    top = float(grid.points[before][np.argmin(angles[before, 0])])
    phases = {"start": 0.0, "top": top, "impact": hit, "end": float(grid.points[-1])}
    return SwingProfile(
        grid.points, angles[:, 0], angles[:, 1], grip, hit, task.quantum, task.interpolation, phases
    )
