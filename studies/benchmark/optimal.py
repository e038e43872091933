"""How long an optimal swing takes, from nothing and after an edit, and its price list."""

from __future__ import annotations

import time
from dataclasses import replace

from ...model.rig import Rig
from ...optimize.front import front
from ...optimize.solve import SOLVED, solve
from ...optimize.task import SwingTask
from ..usual_swing import usual

SPEED, POINTS = 45.0, 1000
"""Of the clubhead at impact [m/s], and points of an axis [-]."""

GOALS = {
    "linear, cold": 1.0, "linear, edited": 0.5, "linear, 25 prices": 10.0,
    "planar, cold": 12.0, "planar, edited": 3.0, "planar, 25 prices": 90.0,
}  # fmt: skip
"""Wall time, without compiling [s]."""

FEASIBLE = 20
"""Swings of a price list that must be feasible for its time to count [-]."""

EDIT = 0.995
"""Share of the speed that an edited task asks for [-]."""


def asked(fidelity: str) -> tuple[SwingTask, Rig]:
    """Task and rig: a ball of 1 kN, a bounded shaft, three shaft frequencies."""
    return usual(fidelity, SPEED, -1000.0, points=POINTS, shaft_bounded=True, scenarios=3)


def optimal_seconds() -> dict[str, float]:
    """Wall time of each, compiled before, the better of two [s]; infinite where none is found."""
    found: dict[str, float] = {}
    for fidelity, words in (("thesis", "linear"), ("planar", "planar")):
        task, rig = asked(fidelity)
        first = solve(task, rig)
        hit = replace(task.impact, clubhead_speed=EDIT * SPEED)
        edited = replace(task, impact=hit)
        solve(edited, rig, begin=first.begin)
        tries, edits = [], []
        for _ in range(2):
            began = time.perf_counter()
            again = solve(task, rig)
            between = time.perf_counter()
            after = solve(edited, rig, begin=again.begin)
            ended = time.perf_counter()
            good = again.status == SOLVED, after.status == SOLVED
            tries.append(between - began if good[0] else float("inf"))
            edits.append(ended - between if good[1] else float("inf"))
        found |= {f"{words}, cold": min(tries), f"{words}, edited": min(edits)}
        began = time.perf_counter()
        listed = front(task, rig)
        spent = time.perf_counter() - began
        good = sum(one.feasible for one in listed) >= FEASIBLE
        found[f"{words}, 25 prices"] = spent if good else float("inf")
    return found
