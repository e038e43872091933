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


def other_file(folder, where, strains, rate, offset=None, start=0.0, more=""):
    """The same swing with its strains in a file of their own, on a clock of their own."""
    made_folder, made = folder
    for name in ("profile.pod", "rig.toml"):
        (where / name).write_bytes((made_folder / name).read_bytes())
    times = np.arange(len(made.toe) - CUT) / 5120.0
    table = np.stack([times, made.toe[CUT:], made.lead[CUT:]], axis=1)
    np.savetxt(where / "drive.csv", table, delimiter=",", header="time,toe,lead", comments="")
    clock = start + np.arange(len(strains[0])) / rate
    table = np.stack([clock, *strains], axis=1)
    header = "time,toe_strain,lead_strain"
    np.savetxt(where / "gauges.csv", table, delimiter=",", header=header, comments="", fmt="%.12g")
    own = 'file = "gauges.csv"\ntime = "time"\nnoise = 1e-5\n'
    own += "" if offset is None else f"clock_offset = {offset}\n"
    tables = [
        CHANNEL.format(name=name, unit="m/s^2", quantity="acceleration", place="clubhead",
                       more="noise = 0.3") for name in ("toe", "lead")
    ]  # fmt: skip
    for name in ("toe_strain", "lead_strain"):
        whole = own + more.replace("NAME", name)
        tables.append(
            CHANNEL.format(name=name, unit="1", quantity="strain", place="shaft", more=whole)
        )
    head = (
        '[record]\nrig = "rig.toml"\ntest = "swing"\n[channels.time]\ncolumn = "time"\nunit = "s"\n'
    )
    (where / "drive.toml").write_text(head + "\n".join(tables))
    return made


def read_back(where, out):
    code = main(["study", "run", "channels", "--data", str(where), "--out", str(out), "--quiet"])
    assert code == 0
    told = json.loads((out / "channels.json").read_text(encoding="utf-8"))["swings"][0]
    with (out / "drive.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return told, {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def bend_error(made, found):
    before = (found["time"] > 0.5) & (found["time"] < made.impact - 0.05)
    bent = np.interp(found["time"], made.times, made.deflection)
    return np.sqrt(np.mean((found["deflection"] - bent)[before] ** 2))


OWN_CLOCKS = {
    "slower": (4, 0, None, 0.0),
    "as many samples, begun later": (1, 512, None, 0.1),
    "slower and begun later": (4, 400, None, 400 / 5120),
    "a clock that shows noon": (4, 0, 43200.0, -43200.0),
}


@pytest.mark.parametrize(("every", "late", "start", "offset"), OWN_CLOCKS.values(), ids=OWN_CLOCKS)
def test_gauges_with_a_clock_of_their_own_are_read_by_it(
    folder, tmp_path, every, late, start, offset
):
    made = folder[1]
    strains = [one[CUT + late :: every] for one in (made.toe_strain, made.lead_strain)]
    made = other_file(folder, tmp_path, strains, 5120.0 / every, offset, start or 0.0)
    told, found = read_back(tmp_path, tmp_path / "out")
    assert bend_error(made, found) < 3e-4  # read as samples of the first clock it was 11 mm
    assert told["clocks"][3]["way"] == "told" and told["clocks"][1]["way"] == "own"
    assert told["clocks"][3]["rate"]["value"] == pytest.approx(5120.0 / every)
    assert told["clocks"][3]["start"]["value"] == pytest.approx(late / 5120, abs=1e-6)
    assert any("clock_offset" in text for text in told["read"])
    first = (CUT + late) / 5120.0
    assert np.isnan(found["deflection"][found["time"] < first - 1e-3]).all()
    assert np.isfinite(found["acceleration"][found["time"] > CUT / 5120.0 + 3e-3]).all()


def test_gauges_that_are_faster_are_read_by_their_own_rate(folder, tmp_path):
    """As many samples as the accelerometers, in half the time: the blow lies beyond them."""
    fast = instrumented.swing(3, slow=1.5, strain_noise=1e-5, wrist=(300.0, 15.0), rate=10240.0,
                              slope=1.5 / 0.91, end=1.9)  # fmt: skip
    count = len(folder[1].toe) - CUT
    strains = [one[2 * CUT : 2 * CUT + count] for one in (fast.toe_strain, fast.lead_strain)]
    made = other_file(folder, tmp_path, strains, 10240.0, 0.0)
    told, found = read_back(tmp_path, tmp_path / "out")
    inside = (found["time"] > 0.5) & (found["time"] < CUT / 5120.0 + count / 10240.0 - 0.1)
    bent = np.interp(found["time"], made.times, made.deflection)
    assert np.sqrt(np.mean((found["deflection"] - bent)[inside] ** 2)) < 3e-4
    last = CUT / 5120.0 + count / 10240.0
    assert np.isnan(found["deflection"][found["time"] > last + 1e-3]).all()
    assert any("points lie beyond the record" in text for text in told["warnings"])
    assert told["loading"]["name"] == "not_told"  # half a loading has no kind


@pytest.mark.parametrize(("every", "late", "start"), [(1, 300, 0.0), (4, 0, 7.0), (5, 800, -3.0)])
def test_a_clock_that_is_not_told_is_found_by_the_blow(folder, tmp_path, every, late, start):
    made = folder[1]
    strains = [one[CUT + late :: every] for one in (made.toe_strain, made.lead_strain)]
    made = other_file(folder, tmp_path, strains, 5120.0 / every, None, start)
    told, found = read_back(tmp_path, tmp_path / "out")
    clock = told["clocks"][3]
    assert clock["way"] == "found" and abs(clock["correlation"]) > 0.9
    off = clock["start"]["value"] - late / 5120
    assert abs(off) < 3 * clock["start"]["std"] < 3e-3
    assert bend_error(made, found) < 1e-3
    assert any("the clock is not told; the blow" in text for text in told["read"])
    stds = found["deflection_std"][(found["time"] > 1.0) & (found["time"] < made.impact - 0.05)]
    assert stds.max() > 5e-5  # what the clock leaves unknown is in the error


def test_gauges_of_another_swing_are_not_aligned(folder, tmp_path, capsys):
    noise = np.random.default_rng(0).standard_normal((2, 9000)) * 1e-3
    other_file(folder, tmp_path, list(noise), 5120.0)
    assert main(["study", "run", "channels", "--data", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "clock_offset" in said and "motions that are unlike" in said and said.count("\n") == 1


def test_gauges_that_never_meet_the_swing_are_refused(folder, tmp_path, capsys):
    made = folder[1]
    strains = [one[CUT:] for one in (made.toe_strain, made.lead_strain)]
    other_file(folder, tmp_path, strains, 5120.0, 20.0)
    assert main(["study", "run", "channels", "--data", str(tmp_path)]) == 2
    assert "points before impact that all gauges saw" in capsys.readouterr().err


READINGS = """
[channels.NAME.calibration]
deflection = [-100.0, -50.0, 0.0, 50.0, 100.0, 150.0]
deflection_unit = "mm"
reading = [{}]
"""


def test_a_calibration_in_the_sidecar_gives_gain_zero_and_their_errors(folder, tmp_path, capsys):
    """Gauges of 0.030 per metre that read 2e-4 while straight, calibrated by six readings."""
    made, rng = folder[1], np.random.default_rng(4)
    at = np.array([-0.10, -0.05, 0.0, 0.05, 0.10, 0.15])
    readings = 0.030 * at + 2e-4 + 5e-6 * rng.standard_normal(6)
    strains = [1.25 * one[CUT:] + 2e-4 for one in (made.toe_strain, made.lead_strain)]
    more = READINGS.format(", ".join(f"{one:.9f}" for one in readings))
    made = other_file(folder, tmp_path, strains, 5120.0, 0.0, more=more)
    told, found = read_back(tmp_path, tmp_path / "out")
    assert bend_error(made, found) < 8e-4
    for one in told["calibrations"]:
        assert one["readings"] == 6 and abs(one["gain"]["value"] - 0.030) < 4 * one["gain"]["std"]
        assert 0.0 < one["gain"]["std"] < 1e-4 and abs(one["zero"]["value"] - 2e-4) < 2e-5
    assert told["calibration_std"] > 5e-5
    other_file(folder, tmp_path, strains, 5120.0, 0.0)  # without them the thesis's number is taken
    plain, wrong = read_back(tmp_path, tmp_path / "out")
    assert plain["calibrations"][0]["gain"]["value"] == 0.024 and bend_error(made, wrong) > 5e-3
    bad = {
        "reading = [": ("reading = [1.0, ", "a reading for each deflection"),
        "deflection = [-100.0, -50.0, 0.0, 50.0, 100.0, 150.0]": (
            "deflection = [9.0, 9.0, 9.0, 9.0, 9.0, 9.0]", "expected several deflections"),
        'deflection_unit = "mm"': ('deflection_unit = "s"', "a unit of deflection"),
    }  # fmt: skip
    for old, (new, said) in bad.items():
        other_file(folder, tmp_path, strains, 5120.0, 0.0, more=more.replace(old, new))
        assert main(["study", "run", "channels", "--data", str(tmp_path)]) == 2
        error = capsys.readouterr().err
        assert said in error and "drive.toml" in error and error.count("\n") == 1


@pytest.mark.slow
def test_errors_of_profile_and_gauges_reach_the_result(folder, tmp_path):
    """Six swings misread within their stated errors lie within what the study says of them."""
    made = folder[1]
    strains = [one[CUT:] for one in (made.toe_strain, made.lead_strain)]
    tolerance = "[channels.NAME.tolerance]\ngain = 0.02\n"
    other_file(folder, tmp_path, strains, 5120.0, 0.0, more=tolerance)
    plain, without = read_back(tmp_path, tmp_path / "out")
    assert any("No error of the profile's" in text for text in plain["warnings"])
    sidecar = tmp_path / "drive.toml"
    sidecar.write_text(sidecar.read_text() + "[profile]\ngrip_std = 0.03\nimpact_std = 0.002\n")
    told, found = read_back(tmp_path, tmp_path / "out")
    assert told["profile_std"] == {"grip": 0.03, "impact": 0.002}
    assert not any("No error of the profile's" in text for text in told["warnings"])
    assert told["offset"]["std"] == pytest.approx(0.002, rel=0.01)
    before = (found["time"] > 0.5) & (found["time"] < made.impact - 0.05)
    for name in ("acceleration", "deflection", "relative"):
        assert np.mean(found[f"{name}_std"][before]) > 1.1 * np.mean(without[f"{name}_std"][before])
    assert told["relative"]["std_rms"] > plain["relative"]["std_rms"] > 0.0
    points = np.linspace(0.0, 2.8, 1000)
    rng, inside = np.random.default_rng(1), {"deflection": [], "relative": [], "acceleration": []}
    base = {name: np.array(found[name]) for name in found}
    text = sidecar.read_text()
    for _ in range(6):
        turn, late, gain = rng.normal(0.0, [0.03, 0.002, 0.02])
        angles = [np.interp(points, made.times, one) for one in (made.arm, made.wrist, made.grip)]
        wrong = SwingProfile(points, angles[0], angles[1], angles[2] + turn,
                             impact_time=made.impact + late)  # fmt: skip
        write(wrong, tmp_path, Limits())
        sidecar.write_text(text)
        table = np.stack(
            [np.arange(len(strains[0])) / 5120.0, *[one * (1 + gain) for one in strains]], axis=1
        )
        np.savetxt(tmp_path / "gauges.csv", table, delimiter=",", comments="", fmt="%.12g",
                   header="time,toe_strain,lead_strain")  # fmt: skip
        _, seen = read_back(tmp_path, tmp_path / "out")
        for name, held in inside.items():
            off = np.abs(seen[name] - base[name])[before] / found[f"{name}_std"][before]
            held.append(float(np.sqrt(np.mean(off**2))))
    for name, held in inside.items():
        assert 0.4 < np.sqrt(np.mean(np.square(held))) < 1.8, (name, held)


def test_the_grips_error_is_taken_from_the_profiles_own_answer(folder, tmp_path):
    made = folder[1]
    strains = [one[CUT:] for one in (made.toe_strain, made.lead_strain)]
    other_file(folder, tmp_path, strains, 5120.0, 0.0)
    near = {"arm": 0.001, "wrist": 0.002, "grip": 0.007, "unit": "rad"}
    (tmp_path / "profile.json").write_text(json.dumps({"impact": {"near": near}}))
    told, _ = read_back(tmp_path, tmp_path / "out")
    assert told["profile_std"] == {"grip": 0.007}
    assert any("instant of impact is stated" in text for text in told["warnings"])


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
