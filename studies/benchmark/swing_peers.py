"""The linear optimal swing beside what users of rockit and dymos would write, in one process."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from ...model.rig import Rig
from ...optimize.solve import settled
from ...optimize.solve_problem import Problem
from ...optimize.solve_scenarios import scenarios_of
from ...optimize.task import Robust, SwingTask
from .optimal import asked
from .swing_dymos import by_dymos, has_dymos
from .swing_rockit import Solved, by_rockit, has_rockit

GOAL = 20.0
"""How many times longer a peer is to need for the same cost [-]."""

ALIKE = 0.01
"""Share of a peer's cost by which ours may be higher and count as equal [-]."""

FAR = 2.0
"""Times our cost beyond which a peer's swing is another one [-]."""

SPEED = 30.0
"""Of the clubhead, at which limits leave room and peers settle within minutes [m/s]."""

SPLINES = (80, 120, 200, 320)
"""Splines of jerk an axis, tried until the cost is the peer's or less [-]."""


@dataclass(frozen=True)
class Beside:
    """One peer beside us on the same swing.

    Attributes:
        peer: its name and what it does.
        theirs: what it made of the swing.
        seconds: our wall time from reading nothing to the solution, compiled before [s].
        cost: ours [-].
        splines: of jerk an axis with which our cost is not above theirs [-].
    """

    peer: str
    theirs: Solved
    seconds: float
    cost: float
    splines: int

    @property
    def ratio(self) -> float:
        """Their time over ours [-]."""
        return self.theirs.seconds / self.seconds

    @property
    def is_equal(self) -> bool:
        """Whether our cost is not above theirs by more than `ALIKE`."""
        return self.cost <= (1.0 + ALIKE) * self.theirs.cost

    @property
    def is_unusable(self) -> bool:
        """Whether what the peer found costs so much that no time can be held against ours."""
        return self.theirs.cost > FAR * self.cost


def beside() -> list[Beside]:
    """Each peer that is installed, with us at its cost, one after the other in this process.

    Returns:
        Rockit on three scenarios with the ball; dymos, whose SLSQP takes no more, on one without.
    """
    task, rig = _asked()
    plain = replace(task, robust=Robust(), impact=replace(task.impact, force=0.0))
    found = []
    if has_rockit():
        words = "rockit, multiple shooting, IPOPT; 3 scenarios, ball"
        found.append(_one(words, by_rockit, task, rig))
    if has_dymos():
        words = "dymos, Radau, SLSQP; 1 scenario, no ball"
        found.append(_one(words, by_dymos, plain, rig))
    return found


def _asked() -> tuple[SwingTask, Rig]:
    task, rig = asked("thesis")
    return replace(task, impact=replace(task.impact, clubhead_speed=SPEED)), rig


def _one(words: str, solve: Callable[[Problem, Rig], Solved], task: SwingTask, rig: Rig) -> Beside:
    theirs = solve(_solved(task, rig, SPLINES[0])[2], rig)
    seconds, cost, splines = float("inf"), float("inf"), SPLINES[0]
    for splines in SPLINES:
        _solved(task, rig, splines)  # compiles
        seconds, cost, _ = min((_solved(task, rig, splines) for _ in range(2)), key=lambda s: s[0])
        if not cost > (1.0 + ALIKE) * theirs.cost:
            break
    return Beside(words, theirs, seconds, cost, splines)


def _solved(task: SwingTask, rig: Rig, splines: int) -> tuple[float, float, Problem]:
    """Wall time [s], cost and problem of our own."""
    began = time.perf_counter()
    found, problem = settled(task, rig, None, scenarios_of(task), splines=splines)
    assert found.settled and found.feasible
    return time.perf_counter() - began, found.cost, problem
