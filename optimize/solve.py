"""solve(task, rig) -> Swing: the smoothest quiet swing that is at the ball with pose and speed."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..model.rig import Rig
from .profile import SwingProfile
from .solve_grid import SPLINES
from .solve_limits import Binding, binding_limits
from .solve_newton import STILL, Found, settle
from .solve_problem import Plant, Problem, faster, first_guess
from .solve_program import impact_of
from .solve_scenarios import between, between_scenarios, plant_of, scenarios_of, stated
from .solve_time import timed
from .task import SwingTask

SOFTER, HELD, ROUGHLY = ((1e-1, 12), (1e-2, 8), (1e-3, 8)), 0.1, 0.1
"""Weights of the ring on the way to it with the programs that each may take, what holds the first
of them, and the change at which it is left [-]."""

AGREES, SILENT = 1.1, 5e-5
"""A ring between scenarios this much larger than theirs [-], or below this [m], agrees."""

SOON = 0.02
"""Change of the unknowns that counts as none before scenarios are added [-]."""

MOST_ROUNDS = 3
"""How often a worst factor is added to the scenarios [-]."""

SLOWER = 0.98
"""Share of the fastest swing's speed that is promised to be feasible [-]."""

HALVINGS, ENOUGH = 9, 5
"""How often a feasible speed is looked for by halving, and how often at least [-]."""

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
        looked: rows of each limit that were looked at [-].
    """

    c: np.ndarray
    states: np.ndarray | None
    factors: tuple[float, ...]
    looked: tuple[np.ndarray, ...] = ()


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
        return Begin(self.found.c, self.found.states, self.factors, self.found.looked)

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
    task = timed(task, rig, golfer, tell)
    base = scenarios_of(task) if begin is None else begin.factors
    # which scenarios are missing is seen before the last digits are
    grows = begin is None and task.robust.parameter and rig.fidelity != "planar"
    still = SOON if grows else STILL
    found, problem = settled(task, rig, golfer, base, begin, tell, splines, still)
    dense, rings, rounds = np.array(base), np.zeros(len(base)), 0
    while True:
        fresh: tuple[float, ...] = ()
        if found.feasible:
            dense, rings = between_scenarios(problem, rig, found, base)
            if rounds < MOST_ROUNDS and task.robust.parameter:
                fresh = _worst_between(base, dense, rings)
        if not fresh and still == STILL:
            break
        rounds, still, more = rounds + bool(fresh), STILL, tuple(sorted({*base, *fresh}))
        if fresh:
            tell(f"worst ring {1e3 * rings.max():.3g} mm; factors added: {fresh}")
        states, looked = between(base, found.states, np.array(more)), found.looked
        base, before = more, Begin(found.c, states, more, () if fresh else looked)
        found, problem = settled(task, rig, golfer, base, before, tell, splines)
    status = SOLVED if found.settled else NOT_SETTLED
    profile = profile_of(problem, found, golfer)
    swing = Swing(
        task, rig.fidelity, profile, problem, found, base, dense, rings, status,
        binding_limits(found),
    )  # fmt: skip
    if found.feasible:
        return swing
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # trials may run away
        return _without(swing, rig, tell)


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
    best = settle(problem, plant_of(problem, rig), swing.found.c, None, tell)
    speed = SLOWER * _speed(problem, best) if best.feasible else 0.0
    told = replace(swing, status=INFEASIBLE, rings=np.zeros(len(swing.dense)))
    asked = swing.task.impact.clubhead_speed
    if best.feasible and 0.0 < speed < asked and _tried(swing, rig, speed, tell).settled:
        return replace(told, binding=binding_limits(best), fastest=speed)
    tell("looking for a feasible speed, lower and lower")
    low, high, binding = 0.0, min(asked, speed or asked), swing.binding
    for number in range(HALVINGS):
        middle = 0.5 * (low + high)
        found = _tried(swing, rig, middle, tell)
        if found.settled:
            low = middle
        else:
            high, binding = middle, binding_limits(found) or binding
        if low and number >= ENOUGH:
            break
    return replace(told, binding=binding, fastest=low or None)


def _tried(swing: Swing, rig: Rig, speed: float, tell: Tell) -> Found:
    """The same problem at another speed [m/s]; settled only where limits allow it."""
    task = replace(swing.task, impact=replace(swing.task.impact, clubhead_speed=speed))
    problem = replace(swing.problem, task=task)
    plant = plant_of(problem, rig)
    found = settle(problem, plant, first_guess(problem), None, tell, hold=_held(plant))
    return replace(found, settled=found.settled and found.feasible)


def _held(plant: Plant) -> float:
    return 0.0 if plant.constant else HELD


def _speed(problem: Problem, found: Found) -> float:
    """Lowest speed at impact over the scenarios in which it must be met [m/s]."""
    at = problem.grid.impact
    z = problem.drive.at(found.c)[at]
    return min(
        float(impact_of(problem.scenarios[index], x, z[:, 0], z[:, 1], problem.flat)["speed"])
        for index in problem.struck
        for x in (found.states[index, at],)
    )


def settled(
    task: SwingTask,
    rig: Rig,
    golfer: Mapping[str, np.ndarray] | None,
    factors: tuple[float, ...],
    begin: Begin | None = None,
    tell: Tell = lambda text: None,
    splines: int | None = SPLINES,
    still: float = STILL,
) -> tuple[Found, Problem]:
    """One problem with its scenarios, settled.

    Args:
        task: as read.
        rig: the robot.
        golfer: see `solve` [s, rad].
        factors: of the scenarios, 1 among them [-].
        begin: see `solve`.
        tell: told what is being done.
        splines: see `solve` [-].
        still: change that counts as none, where the plant's steps are constant [-].

    Returns:
        The solution, or the last try, and what was asked.
    """
    problem = stated(task, rig, golfer, factors, splines)
    plant = plant_of(problem, rig)
    c = first_guess(problem) if begin is None else begin.c
    if plant.constant:
        looked = () if begin is None else begin.looked
        return settle(problem, plant, c, None, tell, still=still, looked=looked), problem
    states = None if begin is None else begin.states
    if states is not None and states.shape[1] == len(problem.grid.marks):
        return settle(problem, plant, c, states, tell, hold=0.0), problem
    # a beginning from which the robot runs away is drawn towards one from which it does not
    usual, found = first_guess(problem), None
    for pull in (0.0, 0.5, 0.8, 0.95, 1.0) if begin is not None else (1.0,):
        found = _softly(problem, rig, (1.0 - pull) * c + pull * usual, tell)
        if found.settled or (found.finite and not found.feasible):
            break
    assert found is not None
    return found, problem


def _softly(problem: Problem, rig: Rig, c: np.ndarray, tell: Tell) -> Found:
    """A planar problem, with a weight of the ring that grows on the way."""
    plant, states = plant_of(problem, rig), None
    for ring, most in SOFTER:
        hold = HELD if states is None else 0.0
        tell(f"weight of the ring 1/{ring:g}")
        soft = settle(replace(problem, ring=ring), plant, c, states, tell, most, hold, ROUGHLY)
        if not soft.finite:
            return soft
        c, states = soft.c, soft.states
    return settle(problem, plant, c, states, tell)


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
