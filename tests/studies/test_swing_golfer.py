"""From a golfer's markers by `supple profile` to the swing that follows it by `supple swing`."""

import json

import numpy as np
import pytest

from supple.optimize.profile import read_pod
from supple.studies.cli import main
from tests.lab.golfer import make_golfer, marker_table
from tests.optimize.swing_tasks import RIG

TASK = """\
[swing]
rig = "rig.toml"
{golfer}
duration = {duration}
points = 201
[start]
arm_angle = {arm}
wrist_angle = {wrist}
[impact]
time = {time}
arm_angle = {hit_arm}
wrist_angle = {hit_wrist}
clubhead_speed = 33.0
hold = "chord"
[limits]
arm   = {{ angle = [-3.5, 3.5], velocity = 25.0, acceleration = 600.0, jerk = 2.0e4 }}
wrist = {{ angle = [-2.2, 2.2], velocity = 60.0, acceleration = 1200.0, jerk = 8.0e4 }}
[cost]
golfer = 10.0
"""


@pytest.fixture(scope="module")
def swings(tmp_path_factory):
    """The golfer's profile, and the swing's with and without following it."""
    folder = tmp_path_factory.mktemp("golfer")
    (folder / "markers.csv").write_text(marker_table(make_golfer(noise=3e-4)))
    (folder / "rig.toml").write_text(RIG.format(fidelity="thesis"))
    assert main(["profile", str(folder / "markers.csv"), "--out", str(folder), "--quiet"]) == 0
    told = json.loads((folder / "profile.json").read_text())
    golfer = read_pod(folder / "profile.pod")
    found = {}
    for name, line in (("follows", 'golfer = "profile.csv"'), ("alone", "")):
        path = folder / f"{name}.toml"
        path.write_text(TASK.format(
            golfer=line, duration=golfer.time[-1], arm=golfer.arm_angle[0],
            wrist=golfer.wrist_angle[0], time=golfer.impact_time,
            hit_arm=told["impact"]["angles"]["arm"], hit_wrist=told["impact"]["angles"]["wrist"],
        ))  # fmt: skip
        assert main(["swing", str(path), "--out", str(folder / name), "--quiet"]) == 0
        result = json.loads((folder / name / "swing.json").read_text())
        found[name] = read_pod(folder / name / "profile.pod"), result
    return golfer, found


def away(golfer, profile, before, after):
    """Largest distance of arm and wrist from the golfer's in a stretch about impact [degrees]."""
    times = np.linspace(golfer.impact_time - before, golfer.impact_time + after, 201)
    off = profile.at(times).angles - golfer.at(times).angles
    return np.degrees(np.abs(off[:, :2]).max())


def test_a_swing_follows_the_golfer_where_it_matters_and_hits_as_asked(swings):
    golfer, found = swings
    profile, result = found["follows"]
    assert result["status"] == "solved" and result["check"]["passed"]
    assert abs(result["impact"]["speed_error"]) < 0.01
    assert away(golfer, profile, 0.05, 0.05) < 0.2 * away(golfer, found["alone"][0], 0.05, 0.05)
    assert away(golfer, profile, 0.05, 0.05) < away(golfer, profile, 0.5, 0.4)
    assert result["price"]["cost"]["golfer"] > 0.0
    assert "golfer" not in found["alone"][1]["price"]["cost"]


def test_the_grip_turns_as_the_golfers_does(swings):
    golfer, found = swings
    profile = found["follows"][0]
    at = profile.time[1:-1]
    off = profile.at(at).angles[:, 2] - golfer.at(at).angles[:, 2]
    assert np.degrees(np.abs(off).max()) < 0.05
    assert np.abs(found["alone"][0].grip_angle).max() == 0.0
    assert any(name.endswith("profile.csv") for name in found["follows"][1]["provenance"]["inputs"])
