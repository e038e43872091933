"""The study of channels: a swing comes back from its gauges, and what is missing is said."""

import csv
import json

import numpy as np
import pytest

from supple.identification.lowpass import zero_phase_lowpass
from supple.optimize.profile import Limits, SwingProfile, write
from supple.studies.cli import main
from tests.lab import instrumented

CHANNEL = """[channels.{name}]
column = "{name}"
unit = "{unit}"
role = "response"
quantity = "{quantity}"
place = "{place}"
{more}
"""
RIG = """[rig]
kind = "robot"
model = "driven_arm"
preset = "robo_v_sleeve_50"
[parameters]
arm_length = 0.62
club_length = 1.035
collet_inertia = 0.03292
collet_mass = 1.5
collet_centre = 0.15833
clubhead_mass = 0.203
wrist_stiffness = 300.0
wrist_damping = 15.0
"""
CUT = 600


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("swing")
    made = instrumented.swing(3, slow=1.5, noise=0.3, strain_noise=1e-5, wrist=(300.0, 15.0),
                              slope=1.5 / 0.91, end=1.9)  # fmt: skip
    points = np.linspace(0.0, 2.8, 1000)
    angles = [np.interp(points, made.times, one) for one in (made.arm, made.wrist, made.grip)]
    profile = SwingProfile(points, *angles, impact_time=made.impact)
    write(profile, where, Limits())
    names = ("toe", "lead", "toe_strain", "lead_strain")
    table = np.stack([getattr(made, name)[CUT:] for name in names], axis=1)
    np.savetxt(where / "drive.csv", table, delimiter=",", header=",".join(names), comments="")
    tables = [
        CHANNEL.format(name=name, unit="m/s^2", quantity="acceleration", place="clubhead",
                       more="noise = 0.3")
        if "strain" not in name
        else CHANNEL.format(name=name, unit="1", quantity="strain", place="shaft",
                            more="[channels." + name + ".tolerance]\ngain = 0.02")
        for name in names
    ]  # fmt: skip
    (where / "rig.toml").write_text(RIG)
    head = (
        '[record]\nrig = "rig.toml"\nfile = "drive.csv"\ntest = "swing"\nsample_rate = 5120.0\n\n'
    )
    (where / "drive.toml").write_text(head + "\n".join(tables))
    return where, made


def test_a_swing_comes_back_from_its_gauges(folder, tmp_path, capsys):
    where, made = folder
    assert main(["study", "run", "channels", "--data", str(where), "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "loading" in said and "FFT against zero phase, 15 Hz" in said
    told = json.loads((tmp_path / "channels.json").read_text(encoding="utf-8"))["swings"][0]
    assert told["offset"]["value"] == pytest.approx(CUT / 5120.0, abs=3e-4)
    assert [one["cutoff"] for one in told["filters"]] == [15.0, 30.0]
    assert told["points"]["all"] == 1000 and "largest load" in told["loading"]["sentence"]
    with (tmp_path / "drive.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 1000 and rows[0]["acceleration"] == ""
    found = {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}
    before = (found["time"] > 0.3) & (found["time"] < made.impact - 0.05)
    truth = np.interp(found["time"], made.times, made.felt)
    assert np.sqrt(np.mean((found["acceleration"] - truth)[before] ** 2)) < 1.0
    carried = np.interp(found["time"], made.times, made.relative)
    own, plain = (
        np.sqrt(np.mean(zero_phase_lowpass((found[name] - carried)[before], 357.0, 15.0) ** 2))
        for name in ("relative", "relative_by_drive")
    )
    assert own < 0.3 * plain
    assert np.isnan(found["relative"][found["time"] > made.impact]).all()
    bent = np.interp(found["time"], made.times, made.deflection)
    assert np.sqrt(np.mean((found["deflection"] - bent)[before] ** 2)) < 1e-3
    assert 0.012 < told["calibration_std"] / told["largest_deflection"] < 0.03
    drawn = (tmp_path / "channels.svg").read_text(encoding="utf-8")
    assert drawn.startswith("<?xml") and drawn.count('<g id="axes_') == 4


def test_what_is_missing_is_said(folder, tmp_path, capsys):
    where, _ = folder
    assert main(["study", "run", "channels"]) == 2
    assert "a folder with profile.pod" in capsys.readouterr().err
    (tmp_path / "profile.pod").write_bytes((where / "profile.pod").read_bytes())
    assert main(["study", "run", "channels", "--data", str(tmp_path)]) == 2
    assert "no sidecar" in capsys.readouterr().err
    (tmp_path / "drive.csv").write_bytes((where / "drive.csv").read_bytes())
    text = (where / "drive.toml").read_text().replace("[channels.toe]", "[channels.up]")
    (tmp_path / "drive.toml").write_text(text.replace('rig = "rig.toml"', ""))
    assert main(["study", "run", "channels", "--data", str(tmp_path)]) == 2
    assert "expected 'toe'" in capsys.readouterr().err
