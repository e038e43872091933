"""Four decays together: every constant of the bench is found, which no decay in a sleeve tells."""

import json

import pytest

from supple.studies.four_decays import FOLDER, MADE_WITH
from supple.studies.study import Call, study_named
from tests.lab.decays import make_decays


def test_the_decays_are_made_again(tmp_path):
    make_decays(tmp_path)
    for path in sorted(FOLDER.iterdir()):
        assert (tmp_path / path.name).read_text() == path.read_text(), path.name


@pytest.mark.slow
def test_together_they_tell_what_none_tells_alone(tmp_path, capsys):
    study = study_named("four_decays")
    result = study.run(Call(tmp_path))
    rows = {row["constant"]: row for row in result["rows"]}
    assert set(rows) == set(MADE_WITH)
    for label, truth in MADE_WITH.items():
        row = rows[label]
        assert row["identifiable"] == "yes"
        assert row["value"] == pytest.approx(truth, rel=0.01 if "stiffness" in label else 0.05)
        assert abs(row["value"] - truth) < 3 * row["std"]
    for name in ("sleeve_00", "sleeve_25", "sleeve_50"):
        doubted = [
            row["alone"][name]["identifiable"] for row in rows.values() if name in row["alone"]
        ]
        assert set(doubted) & {"coupled", "one_sided", "flat"}, "one alone is in doubt"
    assert min(result["misfit"].values()) > 1e-3
    study.show(result)
    assert "Together they tell 8 of 8" in " ".join(capsys.readouterr().out.split())
    written = json.loads((tmp_path / "four_decays.json").read_text())
    assert written["sentences"] == result["sentences"]
    assert (tmp_path / "four_decays.md").is_file()


def test_a_folder_without_a_rig_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"--data: expected .* Mend:"):
        study_named("four_decays").run(Call(None, tmp_path))
