"""When to hit and when to stop: at least as good as any instant that is tried by hand."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.solve import SOLVED, solve
from supple.optimize.solve_time import timed
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    task = read_task(write_task(tmp_path_factory.mktemp("time"), points=201))
    return task, read_rig(task.rig)


def cost(task, rig, instant, end):
    hit = replace(task.impact, time=instant)
    swing = solve(replace(task, impact=hit, duration=(end, end), robust=type(task.robust)()), rig)
    return swing.found.cost if swing.status == SOLVED else np.inf


def test_a_task_with_fixed_times_stays_as_it_is(asked):
    assert timed(*asked) is asked[0]


def test_the_instant_of_impact_is_the_cheapest_one(asked):
    task, rig = asked
    found = timed(replace(task, impact=replace(task.impact, time=None)), rig)
    best = found.impact.time
    assert best is not None
    assert found.duration == (2.0, 2.0) and 0.8 < best < 1.8
    here = cost(task, rig, best, 2.0)
    assert all(here <= 1.03 * cost(task, rig, one, 2.0) for one in (best - 0.2, best + 0.2, 1.6))
    assert here < 0.9 * cost(task, rig, 1.7, 2.0)


def test_the_duration_is_searched_within_its_range_and_the_swing_solved_there(asked):
    task, rig = asked
    swing = solve(replace(task, duration=(1.75, 2.3)), rig)
    end = swing.task.duration[0]
    assert swing.status == SOLVED and 1.75 <= end <= 2.3
    assert swing.profile.time[-1] == pytest.approx(end)
    assert cost(task, rig, 1.6, end) <= 1.02 * min(cost(task, rig, 1.6, x) for x in (1.8, 2.0, 2.2))


def test_both_are_found_together(asked):
    task, rig = asked
    free = replace(task, duration=(1.8, 2.2), impact=replace(task.impact, time=None))
    found = timed(free, rig)
    at, end = found.impact.time, found.duration[0]
    assert at is not None
    assert cost(task, rig, at, end) <= 1.02 * cost(task, rig, 1.6, 2.0)
    assert at + task.impact.duration < end <= 2.2
