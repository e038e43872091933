"""Studies of what a compliant club changes: beside a rigid one, with ripple, on other hardware."""

import json

import numpy as np
import pytest

from supple.optimize.profile import SwingProfile
from supple.studies import best_hardware, drive_ripple, six_swings
from supple.studies.golfers import GOLFERS
from supple.studies.study import Call, studies

NAMES = ("best_hardware", "drive_ripple", "six_swings")


def test_they_are_studies_of_the_house():
    known = studies()
    assert set(NAMES) <= set(known)
    assert all(known[name].question.endswith("?") for name in NAMES)


def test_a_compliant_club_comes_to_rest_where_a_rigid_one_rings():
    found = six_swings.told(six_swings.profile_of(GOLFERS[0]), six_swings.rig_of("thesis"))
    soft, stiff = found["compliant"], found["rigid"]
    assert soft["dies"] is not None and soft["dies"] < 1.0
    assert stiff["dies"] is None or stiff["dies"] > 2.0 * soft["dies"]
    assert soft["left"] < 0.2 * stiff["left"]
    assert abs(soft["speed"] - stiff["speed"]) > 0.1


def test_the_gain_of_a_ripple_is_that_of_a_long_simulation():
    times, hertz, size = np.linspace(0.0, 10.0, 5001), 6.0, 1e-3
    ripple = size * np.clip(times / 2.0, 0.0, 1.0) ** 2 * np.sin(2 * np.pi * hertz * times)
    none = np.zeros_like(times)
    profile = SwingProfile(times, none, ripple, none, 9.9, quantum=0.0)
    motions = six_swings.swung(profile, six_swings.rig_of("thesis"), six_swings.UNSTRUCK)
    gains = drive_ripple.gains(np.array([hertz]))
    for name, one in motions.items():
        late = (one.times > 8.5) & (one.times < 9.8)
        seen = np.ptp(one.away[late]) / 2 / size
        assert seen == pytest.approx(float(gains[name][0]), rel=0.05)


def test_feedback_takes_out_what_it_says():
    profile = six_swings.profile_of(GOLFERS[0])
    from supple.optimize.servo import correct_lag

    told, seen = profile, []
    for _ in range(3):
        seen.append(correct_lag(profile, told, drive_ripple.feedback_of(told)))
        told = seen[-1].profile
    assert np.degrees(seen[0].error) > 3.0 and seen[2].error < 0.1 * seen[0].error
    assert all(one.converges for one in seen)
    sizes = [np.sqrt(np.mean(one.errors**2)) for one in seen]
    assert sizes[1] <= 1.5 * seen[0].contraction * sizes[0]


@pytest.mark.slow
def test_the_studies_write_what_they_find(tmp_path):
    known = studies()
    for name, count in (("six_swings", 24), ("drive_ripple", 12)):
        found = known[name].run(Call(tmp_path / name))
        assert json.loads((tmp_path / name / f"{name}.json").read_text()) == found
        assert len(found["rows"]) == count and (tmp_path / name / f"{name}.svg").is_file()
    rows = json.loads((tmp_path / "six_swings" / "six_swings.json").read_text())["rows"]
    for fidelity in ("thesis", "planar"):
        own = [row for row in rows if row["fidelity"] == fidelity]
        soft, stiff = ([row for row in own if row["club"] == one] for one in ("compliant", "rigid"))
        for one, other in zip(soft, stiff, strict=True):
            assert one["left"] < 0.6 * other["left"]
    ripple = json.loads((tmp_path / "drive_ripple" / "drive_ripple.json").read_text())
    rounds = ripple["rounds"]
    assert rounds[-1]["largest"] < 0.1 * rounds[0]["largest"]


@pytest.mark.slow
def test_hardware_with_its_own_swing_is_best_of_the_three():
    found = best_hardware.find(Call(), cases=((30.0, -1000.0),), side=3)
    first, other, best = found.rows
    assert best["cost"] < first["cost"] and first["optimality_missed"] < 1e-3
    assert other["cost"] is None or best["cost"] <= 1.001 * other["cost"]
    assert abs(np.degrees(best["missed_pose"])) > 0.1
    assert best["unknown_ball"] > first["unknown_ball"] > 0.0
