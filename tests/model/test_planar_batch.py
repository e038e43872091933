"""Planar motions side by side are those one by one, and what cannot be trusted is no number."""

import numpy as np
import pytest

from supple.model import planar
from supple.model.drives import impact, release
from supple.model.linear import Port
from supple.model.planar_batch import respond_planar_batch
from supple.model.planar_motion import respond_planar
from supple.model.robot import INCLINATION, PRESETS, Robot
from supple.model.shaft import LARGEST_TILT

NUMBERS = PRESETS["robo_v_sleeve_50"] | {INCLINATION: 0.6}
ROBOT = Robot("pinned_wrist", tuple(NUMBERS))
SENSORS = (Port("clubhead", "acceleration", "collet"), Port("wrist", "angle"))
TIMES = np.arange(201) / 500.0


@pytest.mark.parametrize(
    "drive",
    [
        pytest.param(impact("clubhead", -80.0, 0.011, 0.005), marks=pytest.mark.slow),
        release("clubhead", 0.05),
    ],
)
def test_many_designs_are_each_their_own(drive):
    stiffnesses = np.array([150.0, 300.0, 900.0])
    table = NUMBERS | {"wrist_stiffness": stiffnesses}
    found = respond_planar_batch(ROBOT, table, drive, TIMES, SENSORS)
    assert found.trusted.all() and np.all(found.errors <= 1e-6)
    for index, stiffness in enumerate(stiffnesses):
        alone = respond_planar(
            ROBOT, NUMBERS | {"wrist_stiffness": stiffness}, drive, TIMES, SENSORS
        )
        size = np.max(np.abs(alone.samples), axis=0)
        off = np.max(np.abs(found.samples[index] - alone.samples) / size)
        assert off < 1e-5


def test_a_shaft_that_bends_too_far_is_no_number():
    table = NUMBERS | {"clubhead_mass": np.array([0.05, 0.2])}
    found = respond_planar_batch(
        ROBOT, table, impact("clubhead", -600.0, 0.0, 0.005), TIMES, SENSORS
    )
    most = 0.6 * planar.points_of(NUMBERS).lever
    assert found.most_bends == pytest.approx([most, most])
    assert found.trusted.tolist() == [bool(b <= most) for b in found.bends]
    assert not found.trusted[0] and found.trusted[1]
    assert np.all(np.isnan(found.samples[0])) and np.all(np.isfinite(found.samples[1]))


def test_a_grip_that_tilts_too_far_is_no_number():
    table = NUMBERS | {"sleeve_stiffness": np.array([100.0, 60e3])}
    found = respond_planar_batch(ROBOT, table, release("clubhead", 0.6), TIMES, SENSORS)
    assert found.tilts[0] > LARGEST_TILT > found.tilts[1] and found.bends[0] < 0.01
    assert found.trusted.tolist() == [False, True]
    assert np.all(np.isnan(found.samples[0])) and np.all(np.isfinite(found.samples[1]))
