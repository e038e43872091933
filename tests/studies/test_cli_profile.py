"""supple profile, from files to files: CSV and C3D, good, doubtful and refused."""

import json
import math

import numpy as np
import pytest

from supple.optimize.profile import ROBO_V, excess, read_pod
from supple.studies.cli import main
from tests.lab.golfer import c3d_bytes, lose, make_golfer, marker_table

GOLFER = lose(make_golfer(noise=3e-4, blow=4.0), "club_bottom", 1.40, 0.02)
LIMITS = """
[limits]
arm = { angle = [-3.5, 3.5], velocity = 25.0, acceleration = 600.0, jerk = 2.0e4 }
wrist = { angle = [-2.2, 2.2], velocity = 60.0, acceleration = 1200.0, jerk = 8.0e4 }
"""


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A folder with the files of one good run, and its result."""
    folder = tmp_path_factory.mktemp("profile")
    (folder / "subject.csv").write_text(marker_table(GOLFER))
    (folder / "subject.toml").write_text('[record]\nfile = "subject.csv"\n' + LIMITS)
    assert (
        main(["profile", str(folder / "subject.toml"), "--out", str(folder / "out"), "--quiet"])
        == 0
    )
    return folder, json.loads((folder / "out" / "profile.json").read_text())


def test_the_files_hold_the_profile_that_the_result_tells(played):
    folder, result = played
    names = {path.name for path in (folder / "out").iterdir()}
    assert names == {"profile.csv", "profile.pod", "profile.json", "report.html", "golfer.csv"}
    pod = read_pod(folder / "out" / "profile.pod")
    table = np.loadtxt(folder / "out" / "profile.csv", delimiter=",", skiprows=1)
    assert table.shape == (1000, 4)
    assert np.allclose(table[:, 1:], pod.read_angles, atol=1e-12)
    measured = np.loadtxt(folder / "out" / "golfer.csv", delimiter=",", skiprows=1)
    late = np.abs(measured[:, 0] - pod.impact_time) < 0.02
    played_then = pod.at(measured[late, 0]).angles
    assert np.max(np.abs(played_then - measured[late, 1:])[:, :2]) < math.radians(1.0)
    assert result["status"] == "good" and result["warnings"] == []
    impact = result["impact"]
    assert impact["time"]["value"] == pytest.approx(GOLFER.impact, abs=1e-4)
    assert impact["profile_time"]["value"] == pytest.approx(pod.impact_time)
    at = pod.at(np.array([pod.impact_time])).angles[0]
    true = [0.0, GOLFER.angles[np.argmin(np.abs(GOLFER.times - GOLFER.impact)), 1]]
    assert at[0] == pytest.approx(impact["angles"]["arm"]) == pytest.approx(true[0], abs=0.01)
    assert impact["angles"]["wrist"] == pytest.approx(true[1], abs=0.05)
    assert result["plane"]["inclination"]["value"] == pytest.approx(0.9, abs=0.01)
    assert math.degrees(result["plane"]["about_vertical"]["value"] + 0.07) == pytest.approx(
        0, abs=0.5
    )
    assert all(share < 0.1 for share in list(result["high_frequencies"]["left"].values())[:3])
    assert result["filled"][0]["marker"] == "club_bottom"
    told = {(one["axis"], one["quantity"]): one["ratio"] for one in result["limits"]}
    assert told == {
        (use.axis, use.quantity): pytest.approx(use.ratio)
        for use in excess(pod, ROBO_V)
        if math.isfinite(use.limit)
    }
    page = (folder / "out" / "report.html").read_text()
    assert page.count('<img src="data:image/svg+xml') == 2 and "arm velocity" in page


def test_a_c3d_file_gives_the_same_and_needs_no_sidecar(played, capsys, tmp_path):
    pytest.importorskip("ezc3d")
    (tmp_path / "subject.c3d").write_bytes(c3d_bytes(GOLFER))
    assert main(["profile", str(tmp_path / "subject.c3d"), "--json"]) == 0
    other = json.loads(capsys.readouterr().out)
    for name in ("time", "clubhead_speed"):
        assert other["impact"][name]["value"] == pytest.approx(
            played[1]["impact"][name]["value"], abs=1e-3
        )
    assert "assumed" in other["warnings"][0] and not other["limits_stated"]


def test_a_broken_limit_is_refused_with_place_and_factor_and_nothing_is_written(played, capsys):
    folder, _ = played
    tight = LIMITS.replace("velocity = 25.0", "velocity = 9.0")
    (folder / "tight.toml").write_text('[record]\nfile = "subject.csv"\n' + tight)
    assert main(["profile", str(folder / "tight.toml"), "--out", str(folder / "none")]) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line and "tight.toml" in line and "arm velocity" in line
    factor = float(line.split(" times the limit")[0].split()[-1])
    place = float(line.split(" s, ")[0].split()[-1])
    assert factor == pytest.approx(13.0 / 9.0, rel=0.05)
    assert place == pytest.approx(played[1]["impact"]["profile_time"]["value"], abs=0.05)
    assert not (folder / "none").exists()


def test_a_tee_of_another_day_is_computed_but_not_trusted(played, capsys, tmp_path):
    folder, _ = played
    tee = GOLFER.seen[0, GOLFER.names.index("tee")] + [0.0, 0.5, 0.0]
    text = f"[record]\nfile = 'subject.csv'\n[ball]\ntee = {list(map(float, tee))}\n{LIMITS}"
    (folder / "moved.toml").write_text(text)
    assert main(["profile", str(folder / "moved.toml"), "--out", str(tmp_path / "out")]) == 3
    out = " ".join(capsys.readouterr().out.split())
    assert "another day" in out
    assert json.loads((tmp_path / "out" / "profile.json").read_text())["status"] == "in_doubt"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[markers]\nclub_top = 'clubtop'", ["club_top", "Mend"]),
        ("[profile]\nmethod = 'old'", ["'thesis'"]),
        ("[profile]\ncutof = 3.0", ["cutoff"]),
        ("[limits]\narm = { velocity = -1.0 }", ["velocity"]),
        ("[record]\nfile = 'none.csv'", ["none.csv"]),
        ("[markers]\nlongest_gap = 0.01", ["club_bottom", "0.020 s"]),
        ("[markers]\nunit = 'm'", ["285 mm", "unit"]),
    ],
)
def test_a_fault_of_the_input_is_one_line(played, capsys, text, words):
    folder, _ = played
    record = "" if "[record]" in text else '[record]\nfile = "subject.csv"\n'
    (folder / "wrong.toml").write_text(record + text)
    assert main(["profile", str(folder / "wrong.toml")]) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line and "Mend" in line
    for word in words:
        assert word in line


def test_the_old_way_is_kept_too(played, tmp_path):
    folder, result = played
    text = '[record]\nfile = "subject.csv"\n[profile]\nmethod = "thesis"\n'
    text += "[limits]\narm = { velocity = 25.0 }\n"
    (folder / "old.toml").write_text(text)
    assert main(["profile", str(folder / "old.toml"), "--out", str(tmp_path), "--quiet"]) == 0
    old = json.loads((tmp_path / "profile.json").read_text())
    assert old["profile"]["method"] == "thesis" and "wrist" in old["impact"]["angles"]
    assert old["profile"]["kept"]["points"] < result["profile"]["kept"]["points"]
