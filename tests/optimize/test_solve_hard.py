"""Swings from random beginnings, and tasks that cannot be: all end as they should."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.solve import INFEASIBLE, SOLVED, Begin, solve
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task

NOISE = 0.3
"""Of the unknowns, as a share of the largest [-]."""


def starts_that_end_well(task, rig, count):
    """How many random beginnings end within a hundredth of the best cost."""
    base, random = solve(task, rig), np.random.default_rng(1)
    costs = [base.found.cost]
    for _ in range(count):
        size = NOISE * np.abs(base.found.c).max()
        c = size * random.standard_normal(base.found.c.shape)
        swing = solve(task, rig, begin=Begin(c, None, (1.0,)))
        costs.append(swing.found.cost if swing.status == SOLVED else np.inf)
    return int(np.sum(np.array(costs[1:]) <= 1.01 * min(costs)))


@pytest.mark.slow
def test_fifty_random_beginnings_end_at_one_swing(tmp_path):
    task = read_task(write_task(tmp_path, points=201))
    assert starts_that_end_well(task, read_rig(task.rig), 50) == 50


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*encountered.*:RuntimeWarning")
def test_random_beginnings_end_at_one_swing_in_the_plane(tmp_path):
    task = read_task(write_task(tmp_path, "planar", points=201))
    assert starts_that_end_well(task, read_rig(task.rig), 50) >= 48


def impossible():
    """Thirty tasks with what makes each impossible, and the axis and quantity it is about."""
    listed = []
    for speed in (70.0, 80.0, 90.0, 100.0, 120.0, 150.0):
        listed.append({"speed": speed})
    for share in (0.02, 0.04, 0.06, 0.08):
        listed.append({"deflection": share})
    for limit in (4.0, 6.0, 8.0, 9.0):
        listed.append({"arm_velocity": limit, "wrist_velocity": limit})
    for limit in (12.0, 15.0, 20.0, 25.0):
        listed.append({"arm_acceleration": limit, "wrist_acceleration": limit})
    for limit in (50.0, 100.0, 150.0, 200.0):
        listed.append({"arm_jerk": limit, "wrist_jerk": limit})
    for limit in (2.0, 3.0, 4.0, 4.5):
        listed.append({"wrist_torque": limit})
    for limit in (15.0, 20.0, 25.0, 30.0):
        listed.append({"speed": 90.0, "arm_torque": limit})
    return listed


def narrowed(task, told):
    """The task with the limits of one entry."""
    limits, shaft, hit = task.limits, task.shaft, task.impact
    for key, value in told.items():
        axis, _, quantity = key.partition("_")
        if key == "speed":
            hit = replace(hit, clubhead_speed=value)
        elif key == "deflection":
            shaft = replace(shaft, deflection_before=value, deflection_after=value)
        elif quantity == "torque":
            shaft = replace(shaft, **{key: value})
        else:
            limits = replace(limits, **{axis: replace(getattr(limits, axis), **{quantity: value})})
    return replace(task, limits=limits, shaft=shaft, impact=hit)


@pytest.mark.slow
@pytest.mark.parametrize("told", impossible(), ids=str)
def test_a_task_that_cannot_be_names_limit_instant_and_a_speed_that_can(tmp_path, told):
    first = read_task(write_task(tmp_path, points=201, speed=38.0, force=0.0))
    task, rig = narrowed(first, told), read_rig(first.rig)
    swing = solve(task, rig)
    assert swing.status == INFEASIBLE
    assert swing.binding and "binds at" in swing.sentence and "limit of" in swing.sentence
    assert swing.fastest is not None and swing.fastest < task.impact.clubhead_speed
    slower = replace(task, impact=replace(task.impact, clubhead_speed=swing.fastest))
    assert solve(slower, rig).status == SOLVED


def test_the_tasks_that_cannot_be_are_thirty():
    assert len(impossible()) == len({str(one) for one in impossible()}) == 30
