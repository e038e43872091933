"""The study of holds: robots' grips swing on as they were measured, a golfer's hands do not."""

import json

import numpy as np
import pytest

from supple.studies.cli import main
from supple.studies.study import Call, study_named
from tests.lab.hands import moved

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


def test_grips_of_robots_swing_on_as_they_were_measured(tmp_path, capsys):
    study = study_named("hand")
    result = study.run(Call(tmp_path))
    assert json.loads((tmp_path / "hand.json").read_text(encoding="utf-8")) == result
    assert len(result["rows"]) == 9 and {row["status"] for row in result["rows"]} == {"oscillates"}
    known = {"0 % sleeve": (3.64, 0.02), "50 % sleeve": (3.08, 0.11)}  # thesis line 1060
    for row in result["rows"]:
        frequency, ratio = known.get(row["hold"], (3.96, 0.0065))
        assert row["frequency"] == pytest.approx(frequency, rel=0.03)
        assert row["damping_ratio"]["value"] == pytest.approx(ratio, rel=0.35)
    study.show(result)
    assert "50 % sleeve" in capsys.readouterr().out


def test_a_golfers_record_is_told_from_a_robots(tmp_path, capsys):
    for name, ratio in (("golfer", 1.0), ("robot", 0.01)):
        hand, head = moved("-90 to 90", 5, 4.0, ratio)
        table = np.stack([hand, head], axis=1)
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
