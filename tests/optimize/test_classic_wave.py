"""Torque waves: each passes the ball with pose and speed, or there is none."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.classic_wave import wave
from supple.optimize.swing_check import examine
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    task = read_task(write_task(tmp_path_factory.mktemp("wave"), points=401))
    return task, read_rig(task.rig)


@pytest.mark.parametrize("shape", ["square", "half_sine", "suppressed_half_sine", "s_curve"])
def test_a_wave_meets_speed_and_pose_when_its_file_is_played(asked, shape):
    task, rig = asked
    found = wave(task, rig, shape)
    assert found is not None and found.met
    verdict = examine(found.profile, task, rig, np.array([1.0]))
    assert abs(verdict.errors["speed"]) < 0.01
    assert np.degrees(max(abs(verdict.errors[k]) for k in ("arm", "chord"))) < 0.005
    assert found.worst == pytest.approx(max(use.ratio for use in verdict.uses))
    assert found.profile.angles[-1, 0] > 0.0 and min(found.begins) >= 0.0


def test_a_jump_of_speed_breaks_the_limit_of_jerk_by_far(asked):
    found = wave(asked[0], asked[1], "instantaneous")
    assert found is None or found.worst > 20.0


def test_a_speed_that_no_wave_reaches_is_said(asked):
    task, rig = asked
    fast = replace(task, impact=replace(task.impact, clubhead_speed=3e5))
    assert wave(fast, rig, "suppressed_half_sine") is None


@pytest.mark.slow
def test_a_wave_meets_speed_and_pose_in_the_plane(tmp_path):
    task = read_task(write_task(tmp_path, "planar", points=401))
    rig = read_rig(task.rig)
    found = wave(task, rig, "suppressed_half_sine")
    assert found is not None and found.met
    errors = examine(found.profile, task, rig, np.array([1.0])).errors
    assert abs(errors["speed"]) < 0.01 and np.degrees(abs(errors["chord"])) < 0.005
