"""The study of modes against speed: its table is the model's, and its files hold together."""

import json
import re

import pytest

from supple.model.campbell import modes_at
from supple.model.robot import PRESETS, Robot
from supple.studies import campbell
from supple.studies.study import Call, study_named


def test_the_study_writes_a_table_a_figure_and_what_it_means(tmp_path, capsys):
    study = study_named("campbell")
    result = study.run(Call(tmp_path))
    assert json.loads((tmp_path / "campbell.json").read_text(encoding="utf-8")) == result
    assert set(result["status"].values()) == {"stable"}
    numbers = PRESETS[campbell.PRESET]
    for model in campbell.MODELS:
        rows = [row for row in result["rows"] if row["collet"] == model]
        assert sorted({row["speed"] for row in rows}) == [0.0, 10.0, 20.0, 30.0, 40.0]
        own = modes_at(Robot(model, tuple(numbers)), numbers, 0.0)
        found = [row["frequency"] for row in rows if row["speed"] == 0.0]
        assert found == pytest.approx(own.frequencies, rel=1e-9)
        first = [row["frequency"] for row in rows if row["mode"] == 1]
        assert first == sorted(first) and first[-1] > 2 * first[0]
    text = (tmp_path / "campbell.md").read_text(encoding="utf-8")
    assert text.count("\n| ") == len(result["rows"]) + 2 and "(campbell.svg)" in text
    drawn = (tmp_path / "campbell.svg").read_text(encoding="utf-8")
    assert drawn.startswith("<?xml") and len(re.findall(r'<g id="axes_\d+"', drawn)) == 4
    assert any("from 26.2 rad/s on at the latest" in note for note in result["notes"])
    study.show(result)
    assert "Every mode is stable" in capsys.readouterr().out
