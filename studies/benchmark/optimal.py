"""How long an optimal swing takes, from nothing and after an edit, and its price list."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

from ...model.rig import read_rig
from ...optimize.front import front
from ...optimize.solve import SOLVED, solve
from ...optimize.task import read_task

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

RIG = '[rig]\nkind = "robot"\nmodel = "driven_arm"\nfidelity = "{}"\npreset = "robo_v"\n'
"""The robot, but for its fidelity [-]."""

TASK = f"""\
[swing]
rig = "rig.toml"
duration = 2.0
points = {POINTS}
[start]
arm_angle = -3.0
wrist_angle = -1.6
[impact]
time = 1.6
clubhead_speed = {SPEED}
force = -1000.0
[limits]
arm   = {{ angle = [-3.5, 3.5], velocity = 25.0, acceleration = 600.0, jerk = 2.0e4 }}
wrist = {{ angle = [-2.2, 2.2], velocity = 60.0, acceleration = 1200.0, jerk = 8.0e4 }}
shaft = {{ deflection_before = 0.30, deflection_after = 0.45 }}
[robust]
parameter = "shaft_frequency"
factors = [0.9, 1.1]
scenarios = 3
"""
"""What is asked [SI]."""


def optimal_seconds() -> dict[str, float]:
    """Wall time of each, compiled before, the better of two [s]; infinite where none is found."""
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "task.toml").write_text(TASK)
        for fidelity, words in (("thesis", "linear"), ("planar", "planar")):
            (folder / "rig.toml").write_text(RIG.format(fidelity))
            task, rig = read_task(folder / "task.toml"), read_rig(folder / "rig.toml")
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
