"""The study of holds: robots' grips swing on as they were measured, a golfer's hands do not."""

import json
from pathlib import Path

import numpy as np
import pytest

from supple.studies import hand
from supple.studies.cli import main
from supple.studies.study import Call, study_named
from tests.lab.hands import MOTIONS, moved, write_hands

SIDECAR = """[record]
file = "{name}.csv"
test = "swing"
sample_rate = 2048.0
description = "-90 to 90"

[channels.hand]
column = "hand"
unit = "m/s^2"
role = "response"
quantity = "acceleration"
place = "hand"

[channels.head]
column = "head"
unit = "m/s^2"
role = "response"
quantity = "acceleration"
place = "clubhead"
"""


@pytest.mark.slow
def test_grips_of_robots_swing_on_as_they_were_measured(tmp_path, capsys):
    study = study_named("hand")
    result = study.run(Call(tmp_path))
    assert json.loads((tmp_path / "hand.json").read_text(encoding="utf-8")) == result
    robots = [row for row in result["rows"] if row["hold"] != "golfer's hands"]
    assert len(robots) == 9 and {row["status"] for row in robots} == {"oscillates"}
    known = {"0 % sleeve": (3.64, 0.02), "50 % sleeve": (3.08, 0.11)}  # thesis line 1060
    for row in robots:
        frequency, ratio = known.get(row["hold"], (3.96, 0.0065))
        assert row["frequency"] == pytest.approx(frequency, rel=0.03)
        assert row["damping_ratio"]["value"] == pytest.approx(ratio, rel=0.35)
    golfers = [row for row in result["rows"] if row["hold"] == "golfer's hands"]
    assert [row["motion"] for row in golfers] == list(MOTIONS)
    for row, ratio in zip(golfers, (0.7, 1.0, 1.6)):
        assert row["status"] == "no_oscillation" and row["explained_by_hand"] > 0.95
        told = row["damping_ratio"]
        assert told["low"] <= ratio <= told["high"] and row["cycles"] < 1.0
    assert len(result["provenance"]["inputs"]) == 6
    study.show(result)
    said = " ".join(capsys.readouterr().out.split())
    assert "50 % sleeve" in said and "no gravity" in said


def test_the_golfers_of_the_study_are_those_of_the_bench(tmp_path):
    write_hands(tmp_path)
    shipped = Path(hand.__file__).parent / "data" / "hand"
    assert {one.name for one in tmp_path.iterdir()} == {
        one.name for one in shipped.iterdir() if one.name != "RECIPE.md"
    }
    for one in tmp_path.glob("*.csv"):
        made, kept = (np.loadtxt(x, delimiter=",", skiprows=1) for x in (one, shipped / one.name))
        assert np.allclose(made, kept, atol=5e-3)
    for one in tmp_path.glob("*.toml"):
        assert one.read_text() == (shipped / one.name).read_text()


OTHER = 'file = "{name}_hand.csv"\ntime = "time"\n'


def apart(folder, name, ratio, rate, start, offset=None, steep=0.0, motion="-90 to 90"):
    """A record whose hand has a file, a rate and a clock of its own."""
    felt, head = moved(motion, 5, 4.0, ratio, steep=steep)
    felt = felt[round(0.1 * 2048) :: round(2048.0 / rate)]  # it begins a tenth of a second later
    table = np.stack([start + np.arange(len(felt)) / rate, felt], axis=1)
    np.savetxt(folder / f"{name}_hand.csv", table, delimiter=",", header="time,hand", comments="",
               fmt="%.9g")  # fmt: skip
    np.savetxt(folder / f"{name}.csv", head, header="head", comments="")
    more = OTHER.format(name=name) + ("" if offset is None else f"clock_offset = {offset}\n")
    text = SIDECAR.format(name=name).replace('place = "hand"\n', f'place = "hand"\n{more}')
    (folder / f"{name}.toml").write_text(text)


@pytest.mark.parametrize("is_told", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_hand_and_head_with_clocks_of_their_own_are_brought_to_one(is_told, tmp_path, capsys):
    for name, ratio in (("golfer", 1.0), ("robot", 0.01)):
        apart(tmp_path, name, ratio, 512.0, 7.0, 0.1 - 7.0 if is_told else None)
    code = main(["study", "run", "hand", "--data", str(tmp_path), "--json"])
    rows = {row["hold"]: row for row in json.loads(capsys.readouterr().out)["rows"]}
    assert code == 0 and rows["golfer"]["status"] == "no_oscillation"
    assert rows["robot"]["status"] == "oscillates"
    assert rows["robot"]["frequency"] == pytest.approx(4.0, rel=0.02)
    for row in rows.values():
        told = " ".join(row["read"])
        assert "were brought to 512 Hz" in told and "cubic spline" in told
        assert ("the clock is not told" in told) is not is_told
        assert row["damping_ratio"]["low"] <= {"golfer": 1.0, "robot": 0.01}[row["hold"]]


def test_a_hand_that_never_meets_the_head_is_refused(tmp_path, capsys):
    apart(tmp_path, "golfer", 1.0, 512.0, 7.0, 90.0)
    assert main(["study", "run", "hand", "--data", str(tmp_path)]) == 2
    assert "half a second that all channels saw" in capsys.readouterr().err


def test_gravity_in_a_record_is_a_warning(tmp_path, capsys):
    apart(tmp_path, "golfer", 1.0, 2048.0, 0.0, 0.1, steep=1.0)
    assert main(["study", "run", "hand", "--data", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "! golfer, -90 to 90: The hand's accelerometer feels" in said


def test_a_golfers_record_is_told_from_a_robots(tmp_path, capsys):
    for name, ratio in (("golfer", 1.0), ("robot", 0.01)):
        table = np.stack(moved("-90 to 90", 5, 4.0, ratio), axis=1)
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header="hand,head", comments="")
        (tmp_path / f"{name}.toml").write_text(SIDECAR.format(name=name))
    code = main(["study", "run", "hand", "--data", str(tmp_path), "--json"])
    rows = {row["hold"]: row for row in json.loads(capsys.readouterr().out)["rows"]}
    assert code == 0 and rows["golfer"]["status"] == "no_oscillation"
    assert rows["robot"]["status"] == "oscillates" and rows["robot"]["motion"] == "-90 to 90"


def test_a_record_without_a_hand_is_said(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("hand,head\n" + "0.1,0.2\n0.3,0.1\n" * 20)
    (tmp_path / "a.toml").write_text(SIDECAR.format(name="a").replace('"hand"\n\n', '"grip"\n\n'))
    assert main(["study", "run", "hand", "--data", str(tmp_path)]) == 2
    assert "one acceleration at place 'hand'" in capsys.readouterr().err
    assert main(["study", "run", "hand", "--data", str(tmp_path / "none")]) == 2
    assert "no folder of that name" in capsys.readouterr().err
