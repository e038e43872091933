"""`supple lag` from a robot's feedback to what to play next; the robot is the bench's own."""

import json

import numpy as np
import pytest

from supple.optimize.profile import ROBO_V, SwingProfile, read_pod, write
from supple.optimize.shape import rise
from supple.studies.cli import main
from tests.lab.servo import play

SIDECAR = """\
[record]
test = "swing"
[channels.time]
column = "t"
unit = "s"
[channels.arm]
column = "arm"
unit = "deg"
role = "response"
quantity = "angle"
place = "arm"
[channels.wrist]
column = "wrist"
unit = "deg"
role = "response"
quantity = "angle"
place = "wrist"
"""
DEGREE = np.pi / 180
LIMITS = "[limits]\narm = {{ velocity = {} }}\nwrist = {{ velocity = 60.0 }}\n"


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    """A folder with a smooth swing that the robot should follow."""
    folder = tmp_path_factory.mktemp("lag")
    times = np.linspace(0.0, 2.2, 1000)
    back, late = rise("minimum_jerk", times, 1.0), rise("minimum_jerk", times - 1.0, 0.8)
    arm, wrist = -1.8 * back + 3.6 * late, -1.2 * back + 2.4 * late
    write(SwingProfile(times, arm, wrist, np.zeros(1000), 1.45), folder / "wanted", ROBO_V)
    return folder


def feedback_of(folder, name, told, mirrored=False):
    """The bench's robot plays a profile; its feedback in degrees, with a sidecar."""
    profile = read_pod(told)
    begun = {"arm": profile.arm_angle, "wrist": profile.wrist_angle}
    times, did = play(profile.time, begun)
    sign = -1.0 if mirrored else 1.0
    rows = [f"{t:.6g},{np.degrees(sign * a):.6g},{np.degrees(sign * w):.6g}"
            for t, a, w in zip(times, did["arm"], did["wrist"], strict=True)]  # fmt: skip
    (folder / f"{name}.csv").write_text("\n".join(["t,arm,wrist", *rows]) + "\n")
    (folder / f"{name}.toml").write_text(SIDECAR)
    return folder / f"{name}.toml"


def test_rounds_bring_the_robot_to_what_is_wanted_as_fast_as_was_stated(swing):
    wanted = swing / "wanted" / "profile.pod"
    told, seen = wanted, []
    for number in range(3):
        out = swing / f"round_{number}"
        heard = feedback_of(swing, f"feedback_{number}", told)
        words = ["lag", str(wanted), str(heard), "--told", str(told), "--out", str(out), "--quiet"]
        assert main(words) == 0
        seen.append(json.loads((out / "lag.json").read_text()))
        told = out / "profile.pod"
    off = [one["error"]["largest"]["value"] for one in seen]
    assert np.degrees(off[0]) > 5.0 and off[1] < 0.2 * off[0] and off[2] < 0.5 * off[1]
    assert np.degrees(seen[2]["error"]["at_impact"]["value"]) < 0.3
    assert seen[0]["contraction"] < 0.1 and seen[0]["worst_factor"] < 0.5
    late = {
        one["axis"]: one["delay"]["value"] + one["constant"]["value"] for one in seen[0]["lags"]
    }
    expected = 2 * 0.8 / (2 * np.pi * 9.0)  # of the bench's position loop
    assert late["arm"] == pytest.approx(expected, abs=3e-3)
    assert late["wrist"] == pytest.approx(expected, abs=3e-3)
    assert set(seen[0]["provenance"]["inputs"]) >= {str(wanted), str(swing / "feedback_0.csv")}
    page = (swing / "round_0" / "report.html").read_text()
    assert "Converges" in page and page.count("data:image/svg+xml") == 2


def test_a_plain_table_in_si_says_the_same_as_a_record(swing, capsys):
    wanted = swing / "wanted" / "profile.pod"
    record = feedback_of(swing, "again", wanted)
    table = np.loadtxt(swing / "again.csv", delimiter=",", skiprows=1)
    rows = [f"{t!r},{a!r},{w!r}" for t, a, w in (table * [1.0, DEGREE, DEGREE]).tolist()]
    plain = swing / "plain.csv"
    plain.write_text("\n".join(["time,arm_angle,wrist_angle", *rows]) + "\n")
    told = []
    for path in (record, plain):
        assert main(["lag", str(wanted), str(path), "--json"]) == 0
        told.append(json.loads(capsys.readouterr().out))
    assert told[0]["error"]["largest"] == pytest.approx(told[1]["error"]["largest"])


def test_feedback_of_the_wrong_sign_ends_in_3_and_leaves_no_profile(swing):
    wanted, out = swing / "wanted" / "profile.pod", swing / "mirrored"
    heard = feedback_of(swing, "mirror", wanted, mirrored=True)
    assert main(["lag", str(wanted), str(heard), "--out", str(out), "--quiet"]) == 3
    told = json.loads((out / "lag.json").read_text())
    assert told["status"] == "need_not_converge" and told["worst_factor"] > 1.0
    assert "has its sign" in told["sentence"] and not (out / "profile.pod").exists()


def test_a_limit_that_the_next_profile_would_break_is_named(swing):
    wanted, out = swing / "wanted" / "profile.pod", swing / "narrow"
    heard = feedback_of(swing, "usual", wanted)
    (swing / "limits.toml").write_text(LIMITS.format(5.0))
    words = ["lag", str(wanted), str(heard), "--limits", str(swing / "limits.toml")]
    assert main([*words, "--out", str(out), "--quiet"]) == 3
    told = json.loads((out / "lag.json").read_text())
    assert told["status"] == "over_limits" and "arm velocity" in told["sentence"]
    assert not (out / "profile.pod").exists()
    (swing / "limits.toml").write_text(LIMITS.format(25.0))
    assert main([*words, "--quiet"]) == 0


@pytest.mark.parametrize("axis", ["arm", "wrist"])
def test_feedback_without_an_axis_is_refused_in_one_line(swing, capsys, axis):
    wanted = swing / "wanted" / "profile.pod"
    path = feedback_of(swing, "partial", wanted)
    path.write_text(SIDECAR.replace(f'place = "{axis}"', 'place = "grip"'))
    assert main(["lag", str(wanted), str(path)]) == 2
    line = capsys.readouterr().err
    assert f"the angle of the {axis}" in line and "Mend:" in line and line.count("\n") == 1


def test_what_was_played_must_be_of_the_same_swing(swing, capsys):
    wanted = swing / "wanted" / "profile.pod"
    other = read_pod(wanted)
    write(SwingProfile(other.time * 1.1, other.arm_angle, other.wrist_angle, other.grip_angle, 1.6),
          swing / "other", ROBO_V)  # fmt: skip
    heard = feedback_of(swing, "same", wanted)
    assert main(["lag", str(wanted), str(heard), "--told", str(swing / "other" / "profile.pod")])
    assert "--told" in capsys.readouterr().err
