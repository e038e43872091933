"""Hardware: slopes of the least cost against new swings, and a search that ends at an optimum."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.hardware import NAMES, best_hardware, held, slopes, with_numbers
from supple.optimize.solve import settled
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task

STEP = 0.01


def asked_of(folder, fidelity="thesis", **changed):
    task = read_task(write_task(folder, fidelity, points=201, **changed))
    return task, read_rig(task.rig)


def solved(task, rig, share=None):
    """The best swing, or that of a rig of which one number was changed."""
    own = rig
    if share is not None:
        name, factor = share
        own = with_numbers(rig, {name: rig.parameters[name].value * factor})
    return settled(task, own, None, (1.0,))


def differences(task, rig, name):
    """Change of least cost and of its vibration with the logarithm of a parameter, solved anew."""
    ends = [solved(task, rig, (name, np.exp(step)))[0] for step in (-STEP, STEP)]
    assert all(one.settled and one.feasible for one in ends)
    cost = (ends[1].cost - ends[0].cost) / (2 * STEP)
    return cost, (ends[1].parts["vibration"] - ends[0].parts["vibration"]) / (2 * STEP)


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    task, rig = asked_of(tmp_path_factory.mktemp("hardware"))
    return task, rig, *solved(task, rig)


def test_slopes_are_those_of_swings_that_are_solved_anew(swing):
    task, rig, found, problem = swing
    by = slopes(problem, found, rig)
    assert by.left < 1e-4
    for name in NAMES:
        cost, vibration = differences(task, rig, name)
        size = max(abs(cost), 1e-3 * found.cost)
        assert by.cost[name] == pytest.approx(cost, abs=0.01 * size)
        assert by.vibration[name] == pytest.approx(vibration, abs=0.05 * abs(vibration))


def test_limits_of_shaft_and_torque_are_in_the_slopes(tmp_path):
    task, rig = asked_of(tmp_path, speed=38.0)
    shaft = replace(task.shaft, deflection_before=0.15, deflection_after=0.30, wrist_torque=50.0)
    task = replace(task, shaft=shaft)
    found, problem = solved(task, rig)
    bound = {one.quantity for one, own in zip(found.families, _prices(found)) if own > 1e-9}
    assert found.settled and found.feasible and {"deflection", "torque"} <= bound
    by = slopes(problem, found, rig)
    for name in NAMES[:2]:
        assert by.cost[name] == pytest.approx(differences(task, rig, name)[0], rel=0.02)


def _prices(found):
    """Sum of the multipliers of each limit."""
    low, sums = 0, []
    for rows in found.looked:
        sums.append(float(np.abs(found.answer.prices[low : low + len(rows)]).sum()))
        low += len(rows)
    return sums


def test_a_swing_that_is_held_costs_at_least_as_much_as_one_that_adapts(swing):
    task, rig, found, problem = swing
    jerk = found.cost - found.parts["vibration"]
    vibration, errors = held(problem, found, rig, {})
    assert vibration == pytest.approx(found.parts["vibration"], rel=1e-6)
    assert max(map(abs, errors.values())) < 1e-5
    other = {"wrist_stiffness": 450.0}
    vibration, errors = held(problem, found, rig, other)
    adapted = settled(task, with_numbers(rig, other), None, (1.0,))[0]
    assert abs(np.degrees(errors["chord"])) > 0.5 and jerk + vibration > 0.0
    assert adapted.settled and adapted.error < 1e-6


def test_the_search_ends_where_no_neighbor_costs_less(swing):
    task, rig, found, _ = swing
    ranges = {"wrist_stiffness": (100.0, 1000.0), "wrist_damping": (5.0, 40.0)}
    best = best_hardware(task, rig, ranges)
    assert best.cost < found.cost and best.begun == pytest.approx(found.cost, rel=1e-3)
    there = with_numbers(rig, best.numbers)
    for name, (low, high) in ranges.items():
        assert low * (1 - 1e-9) <= best.numbers[name] <= high * (1 + 1e-9)
        for factor in (0.93, 1.07):
            value = float(np.clip(best.numbers[name] * factor, low, high))
            other = settled(task, with_numbers(there, {name: value}), None, (1.0,))[0]
            assert other.cost >= best.cost * (1 - 1e-3)


@pytest.mark.parametrize(
    ("ranges", "words"),
    [({"wrist_stiffness": (400.0, 900.0)}, "a range around 300"),
     ({"wrist_stiffness": (100.0, 900.0)}, "settled within its limits")],
)  # fmt: skip
def test_what_cannot_be_searched_is_said(swing, ranges, words):
    task, rig = swing[:2]
    fast = replace(task, impact=replace(task.impact, clubhead_speed=200.0))
    with pytest.raises(ValueError, match=words):
        best_hardware(fast, rig, ranges)


def test_a_parameter_that_the_robot_does_not_have_is_refused(swing):
    _, rig, found, problem = swing
    with pytest.raises(ValueError, match=r"wrist_width.*Mend:"):
        slopes(problem, found, rig, ("wrist_width",))


@pytest.mark.slow
def test_slopes_in_the_plane_are_those_of_swings_that_are_solved_anew(tmp_path):
    task, rig = asked_of(tmp_path, "planar")
    found, problem = solved(task, rig)
    by = slopes(problem, found, rig)
    for name in NAMES[:2]:
        cost, _ = differences(task, rig, name)
        assert by.cost[name] == pytest.approx(cost, abs=0.03 * max(abs(cost), 1e-2 * found.cost))
