"""The study of agreement: who stands out is found in the numbers, wherever he stands."""

import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from supple.studies import agreement
from supple.studies.cli import main
from supple.studies.study import Call, study_named


def named(result: Mapping[str, Any], part: str, name: str) -> dict[str, Any]:
    return next(one for one in result[part] if one["name"] == name)


def test_the_thesis_tables_are_those_that_are_printed():
    tables = agreement._tables()
    assert sum(tables["impact_point"]["averages"]) == pytest.approx(82.6)
    assert sum(tables["face_angle"]["averages"]) == pytest.approx(43.0)
    assert sum(tables["dynamic_loft"]["averages"]) == pytest.approx(37.6)
    assert {len(one["averages"]) for one in tables.values()} == {14}
    assert all(re.search(r"lines \d+-\d+", one["source"]) for one in tables.values())


def test_subject_13_is_found_in_table_2_and_nobody_in_table_3(tmp_path, capsys):
    study = study_named("agreement")
    result = study.run(Call(tmp_path))
    assert json.loads((tmp_path / "agreement.json").read_text(encoding="utf-8")) == result
    point = named(result, "published", "impact_point")
    assert [one["subject"] for one in point["outliers"]] == ["13"]
    assert point["outliers"][0]["size"] == pytest.approx(0.0155) and point["unit"] == "m"
    assert point["without"]["mean"]["value"] < 0.0055 < point["mean"]["high"]
    for name in ("face_angle", "dynamic_loft"):
        assert named(result, "published", name)["outliers"] == []
    study.show(result)
    said = " ".join(capsys.readouterr().out.split())
    assert "golfer 13 (15.5 mm against 5.04 of the others)" in said
    point_rows = [row for row in agreement._rows(result) if "impact point" in row[0]]
    assert [(row[1], row[4], row[5]) for row in point_rows] == [
        ("all 14 golfers", "within 10.7 mm by averages", "5.46 mm"),
        ("without golfer 13", "within 9.85 mm by averages", "5.04 mm"),
    ]
    assert re.search(r"5\.04 \[4\.\d+, 5\.\d+\] mm on average without golfer 13", said)
    assert "(with all 14: 5.46 mm)" in said
    assert (tmp_path / "agreement.svg").read_text(encoding="utf-8").startswith("<?xml")
    text = (tmp_path / "agreement.md").read_text(encoding="utf-8")
    assert "(agreement.svg)" in text and text.count("\n| ") == 6


@pytest.mark.parametrize("place", [0, 6, 13])
def test_the_study_is_not_told_who_stands_out(place, monkeypatch):
    tables = agreement._tables()
    averages = tables["impact_point"]["averages"]
    averages.insert(place, averages.pop(12))
    monkeypatch.setattr(agreement, "_tables", lambda: tables)
    point = named(agreement.run(Call()), "published", "impact_point")
    assert [one["subject"] for one in point["outliers"]] == [str(place + 1)]
    averages[place] = 5.0
    assert named(agreement.run(Call()), "published", "impact_point")["outliers"] == []


def readings(seed: int, odd: int) -> str:
    """Fourteen golfers; stickers are set by hand, and one golfer's markers were badly seen."""
    rng = np.random.default_rng(seed)
    lines = ["subject;swing;toe:sticker [mm];toe:markers [mm];face:radar [deg];face:markers [deg]"]
    for golfer in range(1, 15):
        for swing in range(10):
            toe, face = rng.normal(0.0, 12.0), rng.normal(1.0, 3.0)
            off = rng.normal(-12.0, 8.0) if golfer == odd else rng.normal(0.5, 2.0)
            cells = [toe + rng.normal(0, 0.5), toe + off, face + rng.normal(1.5, 2.0), face]
            text = [f"{value:.2f}".replace(".", ",") for value in cells]
            text[2] = "" if swing == 3 else text[2]
            lines.append(";".join([f"S{golfer}", str(swing), *text]))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("odd", [2, 11])
def test_a_lab_brings_its_own_readings(odd, tmp_path, capsys):
    (tmp_path / "clubs.csv").write_text(readings(odd, odd))
    code = main(["study", "run", "agreement", "--data", str(tmp_path), "--json"])
    result = json.loads(capsys.readouterr().out)
    assert code == 0 and len(result["measured"]) == 2
    toe, face = (named(result, "measured", name) for name in ("toe", "face"))
    assert [one["subject"] for one in toe["outliers"]] == [f"S{odd}"] and face["outliers"] == []
    assert toe["overall"]["count"] == 140 and len(toe["subjects"]) == 14
    own = next(one for one in toe["subjects"] if one["subject"] == f"S{odd}")
    assert own["bias"]["value"] > 0.005  # the points lie too low in it
    assert toe["without"]["spread"] == pytest.approx(2.06e-3, rel=0.15)
    assert face["left_out"] == 14 and face["unit"] == "rad"
    assert np.degrees(face["overall"]["bias"]["value"]) == pytest.approx(1.5, abs=0.5)
    assert np.degrees(face["overall"]["spread"]) == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize("golfers", [1, 5, 6])
def test_too_few_golfers_are_not_called_alike(golfers, tmp_path, capsys):
    """Five golfers, one of them far off: no test is made, so nobody is acquitted."""
    rng, lines = np.random.default_rng(3), ["subject,toe:sticker [mm],toe:markers [mm]"]
    for golfer in range(golfers):
        for _ in range(8):
            toe = rng.normal(0.0, 10.0)
            off = rng.normal(-10.0, 4.0) if golfer == 2 else rng.normal(1.0, 2.0)
            lines.append(f"G{golfer},{toe + off:.3f},{toe:.3f}")
    (tmp_path / "few.csv").write_text("\n".join(lines) + "\n")
    assert main(["study", "run", "agreement", "--data", str(tmp_path), "--json"]) == 0
    toe = named(json.loads(capsys.readouterr().out), "measured", "toe")
    assert toe["outliers_tested"] is (golfers == 6)
    verdicts = [row[6] for row in agreement._rows({"published": [], "measured": [toe]})]
    if golfers < 6:
        assert "too few to tell whether one stands out" in toe["sentence"]
        assert "no golfer stands out" not in toe["sentence"] and verdicts[0] == "too few to tell"
    else:
        assert "too few" not in toe["sentence"] and "too few to tell" not in verdicts


BAD = {
    "no subject": ("golfer,a:x [mm],a:y [mm]\n1,2,3\n", "columns 'subject'"),
    "one instrument": ("subject,a:x [mm]\n1,2\n1,3\n1,4\n", "two instruments"),
    "two units": ("subject,a:x [mm],a:y [m]\n1,2,3\n1,2,3\n", "expected 'mm', found 'm'"),
    "no unit": ("subject,a:x [N],a:y [N]\n1,2,3\n1,2,3\n", "found 'N'"),
    "a word": ("subject,a:x [mm],a:y [mm]\n1,2,3\n1,oops,3\n1,2,3\n", "found 'oops'"),
    "few": ("subject,a:x [mm],a:y [mm]\n1,2,3\n1,2,3\n", "at least 3 pairs"),
    "nobody": ("subject,a:x [mm],a:y [mm]\n1,2,3\n,2,3\n1,2,3\n", "an empty cell"),
}


@pytest.mark.parametrize(("text", "said"), BAD.values(), ids=BAD)
def test_bad_tables_are_one_line(text, said, tmp_path, capsys):
    (tmp_path / "bad.csv").write_text(text)
    assert main(["study", "run", "agreement", "--data", str(tmp_path)]) == 2
    told = capsys.readouterr().err
    assert said in told and "Mend: " in told and told.count("\n") == 1


def test_an_empty_folder_is_said(tmp_path, capsys):
    assert main(["study", "run", "agreement", "--data", str(tmp_path)]) == 2
    assert "no table in it" in capsys.readouterr().err
