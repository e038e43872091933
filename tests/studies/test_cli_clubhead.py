"""`supple clubhead`: made-up swings as files, to angles, speed and point of impact; exit codes."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.studies import cli
from tests.lab.markers import MadeUp, ball_markers, make_swing

SIDECAR = """\
[record]
test = "swing"
sample_rate = 5000.0
[markers]
unit = "mm"
[club]
file = "cloud.csv"
unit = "mm"
[ball]
file = "ball.csv"
unit = "mm"
"""


def write_swing(folder: Path, made: MadeUp, name: str = "drive", sidecar: str = SIDECAR) -> Path:
    """Files in the manner of a camera system: millimetres, empty cells for lost markers."""
    count = len(made.cloud)
    header = ",".join(f"M{i}_{axis}" for i in range(count) for axis in "xyz")
    rows = 1e3 * made.seen.reshape(len(made.seen), -1)
    lines = [",".join("" if np.isnan(x) else f"{x:.6f}" for x in row) for row in rows]
    (folder / f"{name}.csv").write_text("\n".join([header, *lines]) + "\n")
    cloud = [f"M{i},{x:.6f},{y:.6f},{z:.6f}" for i, (x, y, z) in enumerate(1e3 * made.cloud)]
    (folder / "cloud.csv").write_text("\n".join(["marker,x,y,z", *cloud]) + "\n")
    ball = 1e3 * ball_markers(made.ball, 6, 5e-5, 0)
    places = [f"B{i},{x:.6f},{y:.6f},{z:.6f}" for i, (x, y, z) in enumerate(ball)]
    (folder / "ball.csv").write_text("\n".join(["marker,x,y,z", *places]) + "\n")
    path = folder / f"{name}.toml"
    path.write_text(sidecar)
    return path


def test_a_swing_becomes_a_table_and_an_impact(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_swing(1, markers=14, lost=0.5, touch=(0.01, 0.004))
    path, out = write_swing(tmp_path, made), tmp_path / "out"
    assert cli.main(["clubhead", str(path), "--out", str(out), "--json"]) == 0
    said = capsys.readouterr()
    result = json.loads(said.out)
    assert said.err == "" and json.loads((out / "clubhead.json").read_text()) == result
    swing, truth = result["swings"][0], made.truth
    impact = swing["impact"]
    for key, value in (
        ("speed", truth.speed),
        ("face_angle", truth.face),
        ("dynamic_loft", truth.loft),
        ("lie_angle", truth.lie),
        ("attack_angle", truth.attack),
        ("path_angle", truth.path),
        ("impact_toe", 0.01),
        ("impact_up", 0.004),
    ):
        assert abs(impact[key]["value"] - value) < 4 * impact[key]["std"], key
        assert impact[key]["low"] < impact[key]["value"] < impact[key]["high"]
    assert swing["noise"] == pytest.approx(5e-5, rel=0.1)
    assert swing["smoothing"]["bandwidth"] > 50.0
    assert swing["speed_loss"]["toe"]["value"] > swing["speed_loss"]["heel"]["value"]
    assert len(result["provenance"]["inputs"]) == 4
    rows = list(csv.DictReader((out / "clubhead.csv").read_text().splitlines()))
    assert len(rows) == len(made.seen) and rows[5]["swing"] == "drive"
    assert [float(row["time"]) for row in rows[:2]] == pytest.approx([0.0, 2e-4])
    place = [float(rows[50][f"center_{axis}"]) for axis in "xyz"]
    assert place == pytest.approx(made.position[50], abs=3e-4)
    assert float(rows[50]["raw_speed_std"]) > 5 * float(rows[50]["speed_std"])
    assert rows[0]["raw_speed"] == "" and "nan" not in (out / "clubhead.csv").read_text()


def test_several_swings_share_a_table_and_a_reader_gets_sentences(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_swing(2, markers=8)
    first = write_swing(tmp_path, made)
    second = write_swing(tmp_path, made, "again")
    out = tmp_path / "out"
    table = second.with_suffix(".csv")  # beside its sidecar
    assert cli.main(["clubhead", str(first), str(table), "--out", str(out)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "m/s at impact" in text and "the ball touched" in text
    rows = list(csv.DictReader((out / "clubhead.csv").read_text().splitlines()))
    assert {row["swing"] for row in rows} == {"drive", "again"}


def test_a_clock_a_decimal_comma_and_units_in_the_header_are_understood(tmp_path: Path) -> None:
    made = make_swing(3, markers=6)
    path = write_swing(tmp_path, made, sidecar='[club]\nfile = "cloud.csv"\nunit = "mm"\n')
    lines = (tmp_path / "drive.csv").read_text().splitlines()
    names = lines[0].split(",")
    lines[0] = ",".join(["time [ms]", *(f"{name} [mm]" for name in names)])
    lines[1:] = [f"{0.2 * i:.1f},{line}" for i, line in enumerate(lines[1:])]
    text = "\n".join(line.replace(",", ";").replace(".", ",") for line in lines)
    (tmp_path / "drive.csv").write_text(text + "\n")
    out = tmp_path / "out"
    assert cli.main(["clubhead", str(path), "--out", str(out), "--quiet"]) == 0
    swing = json.loads((out / "clubhead.json").read_text())["swings"][0]
    assert swing["sample_rate"] == pytest.approx(5000.0)
    assert swing["impact"]["by"] == "notch" and swing["ball"] is None
    assert swing["impact"]["speed"]["value"] == pytest.approx(made.truth.speed, abs=0.5)


def test_a_ball_out_of_place_is_written_and_not_trusted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_swing(4, markers=8)
    x, y, z = made.ball - [0.15, 0.0, 0.0]
    ball = f"[ball]\ncenter = [{x:.6f}, {y:.6f}, {z:.6f}]\n"
    path = write_swing(tmp_path, made, sidecar=SIDECAR.split("[ball]")[0] + ball)
    out = tmp_path / "out"
    assert cli.main(["clubhead", str(path), "--out", str(out)]) == 3
    assert "not where it is said" in " ".join(capsys.readouterr().out.split())
    assert json.loads((out / "clubhead.json").read_text())["status"] == "in_doubt"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit = "mm"\n[club]', 'unit = "m"\n[club]', "mm read as m"),
        ('unit = "mm"\n[club]', 'unit = "kg"\n[club]', "a unit of position"),
        ("sample_rate = 5000.0", "sample_rat = 5000.0", "sample_rate"),
        ("sample_rate = 5000.0", "", "sample_rate"),
        ('"cloud.csv"', '"clouds.csv"', "did you mean 'cloud.csv'"),
        ('"cloud.csv"', '"cloud.csv"\nface_markers = ["M0", "M1", "F9"]', "face_markers"),
        ('file = "ball.csv"', 'file = "ball.csv"\nradius = 0.0002', "ball"),
        ('file = "ball.csv"', "", "one of 'file' and 'center'"),
    ],
)
def test_a_bad_sidecar_is_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, words: str
) -> None:
    assert old in SIDECAR
    path = write_swing(tmp_path, make_swing(5, markers=6), sidecar=SIDECAR.replace(old, new, 1))
    assert cli.main(["clubhead", str(path), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and len(said.err.splitlines()) == 1
    assert words in said.err and "Mend: " in said.err
    assert not (tmp_path / "out").exists()


def test_a_bad_cell_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_swing(tmp_path, make_swing(6, markers=6))
    lines = (tmp_path / "drive.csv").read_text().splitlines()
    lines[7] = "lost" + lines[7][lines[7].index(",") :]
    (tmp_path / "drive.csv").write_text("\n".join(lines) + "\n")
    assert cli.main(["clubhead", str(path)]) == 2
    said = capsys.readouterr().err
    assert "line 8" in said and "'lost'" in said and "M0_x" in said


def test_a_table_without_a_sidecar_says_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_swing(tmp_path, make_swing(7, markers=6))
    path.unlink()
    assert cli.main(["clubhead", str(tmp_path / "drive.csv")]) == 2
    assert "write drive.toml" in capsys.readouterr().err


def test_further_points_have_columns_and_a_slipped_frame_keeps_the_files_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_swing(2, markers=10)
    seen = np.delete(made.seen, 40, axis=0)
    points = '[club.points]\ngrip = [-0.02, 0.05, 0.6]\nthird = "M2"\n'
    whole = SIDECAR.replace("[ball]", points + "[ball]")
    path, out = write_swing(tmp_path, replace(made, seen=seen), sidecar=whole), tmp_path / "out"
    assert cli.main(["clubhead", str(path), "--out", str(out), "--json"]) == 0
    swing = json.loads(capsys.readouterr().out)["swings"][0]
    assert swing["frames"] == len(seen) and swing["impact"]["frame"] == int(made.frame) - 1
    assert swing["impact"]["grip_speed"]["value"] < 0.8 * swing["impact"]["speed"]["value"]
    assert swing["noise_std"] == pytest.approx(
        swing["noise"] / np.sqrt(2 * 24 * len(seen)), rel=0.1
    )
    with (out / "clubhead.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["frame"]) for row in rows] == list(range(len(seen)))
    times = np.array([float(row["time"]) for row in rows])
    assert np.diff(times)[39] == pytest.approx(2 / made.rate) and np.diff(times).min() > 0.9 / 5000
    for name in ("grip_speed", "third_speed_std", "path_angle_std", "attack_angle_std"):
        assert float(rows[30][name]) > 0
    smooth = swing["smoothing"]
    for row, key in ((30, "bandwidth"), (-5, "bandwidth_after")):
        assert float(rows[row]["bandwidth"]) == pytest.approx(smooth[key])


@pytest.mark.parametrize(
    ("point", "words"),
    [('toe = "M1"', "other than toe"), ('a = "M99"', "M9"), ("a = [0.0, 0.0, 600.0]", "unit")],
)
def test_a_point_that_cannot_be_is_refused(tmp_path, capsys, point, words) -> None:
    whole = SIDECAR.replace("[ball]", f"[club.points]\n{point}\n[ball]")
    path = write_swing(tmp_path, make_swing(2, markers=10), sidecar=whole)
    assert cli.main(["clubhead", str(path)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "[club.points]" in said and words in said and "Mend" in said


def test_the_sidecar_of_the_readme_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (Path(cli.__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    sidecar = text.split("## Markers on a club")[1].split("```toml\n")[1].split("```")[0]
    path = write_swing(tmp_path, make_swing(1, markers=14), sidecar=sidecar)
    assert cli.main(["clubhead", str(path), "--json"]) == 0
    impact = json.loads(capsys.readouterr().out)["swings"][0]["impact"]
    assert impact["by"] == "ball" and impact["grip_speed"]["value"] > 0
