"""`supple swing` from task to files: what it writes, its exit codes, and its words."""

import json

import pytest

from supple.optimize.profile import read_pod
from supple.studies.cli import main
from tests.optimize.swing_tasks import write_task


def test_a_swing_is_written_with_its_check_and_a_page(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["swing", str(write_task(tmp_path, points=201)), "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((out / "swing.json").read_text())
    assert told["status"] == "solved" and told["check"]["passed"]
    assert abs(told["impact"]["speed_error"]) < 0.01
    assert len(told["residual"]["factor"]) == len(told["residual"]["amplitude"]) == 41
    assert told["limits"]["largest_ratio"] <= 1.001
    assert read_pod(out / "profile.pod").time.shape == (201,)
    page = (out / "report.html").read_text()
    assert (
        "Swing found" in page and "<script" not in page and "http" not in page.split("</style>")[1]
    )


def test_what_limits_forbid_ends_in_3_and_leaves_no_profile(tmp_path):
    out = tmp_path / "out"
    path = write_task(tmp_path, points=201, speed=90.0)
    assert main(["swing", str(path), "--out", str(out), "--quiet"]) == 3
    told = json.loads((out / "swing.json").read_text())
    assert told["status"] == "infeasible" and told["fastest_feasible_speed"] < 90.0
    assert "limit of" in told["sentence"]
    assert not (out / "profile.pod").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("time = 1.6", "free = true", "[impact] free"),
        ("duration = 2.0", "duration = { min = 1.8, max = 2.2 }", "[swing] duration"),
    ],
)
def test_what_is_not_done_is_refused_in_one_line(tmp_path, capsys, old, new, words):
    path = write_task(tmp_path, points=201)
    path.write_text(path.read_text().replace(old, new, 1))
    assert main(["swing", str(path)]) == 2
    line = capsys.readouterr().err
    assert words in line and "Mend:" in line and line.count("\n") == 1
