"""The price list: every swing hits, quieter costs more, and no listed swing is beaten."""

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.front import front
from supple.optimize.task import read_task
from tests.optimize.swing_tasks import write_task


@pytest.fixture(scope="module")
def prices(tmp_path_factory):
    task = read_task(write_task(tmp_path_factory.mktemp("front"), points=201, scenarios=3))
    return front(task, read_rig(task.rig), weights=(1e-6, 1e-4, 1e-2), stretches=(1.0, 1.3))


def test_less_vibration_costs_jerk(prices):
    for duration in {one.duration for one in prices}:
        own = sorted((one for one in prices if one.duration == duration), key=lambda p: p.weight)
        assert all(one.feasible for one in own)
        jerks = [np.hypot(one.rms_jerk[0] / 2e4, one.rms_jerk[1] / 8e4) for one in own]
        assert jerks == sorted(jerks) and own[-1].ring < own[0].ring


def test_more_time_to_stop_is_cheaper(prices):
    short, long = sorted({one.duration for one in prices})
    for weight in {one.weight for one in prices}:
        pair = {one.duration: one for one in prices if one.weight == weight}
        assert pair[long].rms_jerk[1] < pair[short].rms_jerk[1]


def test_an_efficient_swing_is_beaten_by_none(prices):
    def numbers(one):
        return np.array([*one.rms_jerk, *one.peak_acceleration, *one.peak_torque,
                         one.duration, one.ring])  # fmt: skip

    assert any(one.efficient for one in prices)
    for one in (one for one in prices if one.efficient):
        for other in prices:
            assert not np.all(numbers(other) < 0.98 * numbers(one))
