"""The map of wrists against one motion at a time, and what it must refuse."""

import dataclasses

import numpy as np
import pytest

from supple.model.drives import impact
from supple.model.linear import Port
from supple.model.motion import respond
from supple.model.robot import PRESETS, Robot
from supple.optimize.wrist import WristMap, WristTask, decide, map_wrists

TIMES = np.arange(1000) / 2000.0
TASK = WristTask(
    impact("clubhead", -20.0, 0.0, 0.005),
    TIMES,
    (0.005, 0.5),
    Port("clubhead", "acceleration", "collet"),
    np.array([60.0, 300.0]),
    np.array([2.0, 8.0, 20.0]),
)
FRICTION = {
    "law": "coulomb_friction",
    "place": "wrist",
    "parameters": {"torque": 0.2, "stretch_width": 1e-4, "rate_width": 1e-3},
}


@pytest.fixture(scope="module")
def robot():
    numbers = PRESETS["robo_v"]
    return Robot("pinned_wrist", tuple(numbers)), dict(numbers)


@pytest.mark.parametrize("laws", [(), pytest.param((FRICTION,), marks=pytest.mark.slow)])
def test_every_design_scores_as_its_own_motion_does(robot, laws):
    mechanism, numbers = robot
    found = map_wrists(mechanism, numbers, TASK, laws)
    inside = (TIMES >= 0.005) & (TIMES <= 0.5)
    for row, column in ((0, 0), (1, 2)):
        own = {
            "wrist_stiffness": TASK.stiffness[row],
            "wrist_damping": TASK.damping[column],
        }
        moved = respond(mechanism, numbers | own, TASK.drive, TIMES, (TASK.sensor,), laws)
        expected = np.sqrt(np.mean(moved.samples[inside, 0] ** 2))
        assert found.rms[row, column] == pytest.approx(expected, rel=1e-3 if laws else 1e-9)
    assert found.error < 1e-2 and (found.error > 0) == bool(laws)


def test_a_decision_compares_both_choices_by_the_second_map():
    before = WristMap(TASK, np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), 0.0)
    after = WristMap(TASK, np.array([[3.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), 0.0)
    told = decide(before, after)
    assert told["best_before"] == {"wrist_stiffness": 60.0, "wrist_damping": 2.0, "rms": 1.0}
    assert told["best_after"]["wrist_damping"] == 8.0
    assert told["loss_if_ignored"]["rms"] == pytest.approx(0.5)
    assert not before.is_inside


def test_a_rig_without_a_wrist_is_refused(robot):
    mechanism, numbers = robot
    fixed = dataclasses.replace(mechanism, model="fixed_collet")
    with pytest.raises(ValueError, match="flexible wrist"):
        map_wrists(fixed, numbers, TASK)


def test_a_pulse_that_ends_between_samples_is_refused(robot):
    mechanism, numbers = robot
    drive = impact("clubhead", -20.0, 0.0, 0.0051)
    with pytest.raises(ValueError, match="jumps on samples"):
        map_wrists(mechanism, numbers, dataclasses.replace(TASK, drive=drive))
