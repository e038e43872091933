"""`supple simulate` through the command line: the table that it writes, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest

from supple.model import planar
from supple.model.rig import read_rig, write_rig
from supple.model.robot import PRESETS
from supple.studies import cli

CHAIN = """\
[rig]
kind = "chain"
[masses.cart]
mass = 2.0
[links.spring]
between = ["ground", "cart"]
stiffness = 50.0
damping = 0.4
"""
ROBOT = '[rig]\nkind = "robot"\nmodel = "pinned_wrist"\n'
TIMES = "[times]\nduration = 2.0\nsample_rate = 100.0\n"
RELEASE = f'[drive]\nkind = "release"\nplace = "cart"\ndisplacement = 0.1\n{TIMES}'
PULSE = f'[drive]\nkind = "impact"\nforce = -1600.0\nduration = 0.0051\n{TIMES}'
FRICTION = {"law": "coulomb_friction", "place": "spring", "parameters": {"force": 0.2}}
OFFSET = {"law": "sensor_offset", "place": "head", "parameters": {"offset": 0.2}}


def write(folder: Path, rig: str, drive: str) -> list[str]:
    (folder / "rig.toml").write_text(rig)
    (folder / "drive.toml").write_text(drive)
    paths = str(folder / "rig.toml"), str(folder / "drive.toml")
    return ["simulate", "--rig", paths[0], "--drive", paths[1]]


def table(path: Path) -> dict[str, np.ndarray]:
    names = path.read_text().splitlines()[0].split(",")
    return dict(zip(names, np.loadtxt(path, delimiter=",", skiprows=1).T, strict=True))


def test_a_release_of_a_chain(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "deep" / "out"
    asked = ["--sensor", "spring:deflection:absolute", "--out", str(out), "--json"]
    assert cli.main([*write(tmp_path, CHAIN, RELEASE), *asked]) == 0
    assert [file.name for file in out.iterdir()] == ["motion.csv"]
    moved = table(out / "motion.csv")
    names = ["time", "cart", "cart_velocity", "cart_acceleration", "spring:deflection:absolute"]
    assert list(moved) == names
    t = np.arange(200) / 100.0
    np.testing.assert_array_equal(moved["time"], t)
    decay, turn = 0.1, np.sqrt(25.0 - 0.01)
    wanted = 0.1 * np.exp(-decay * t) * (np.cos(turn * t) + decay / turn * np.sin(turn * t))
    np.testing.assert_allclose(moved["cart"], wanted, atol=1e-13)
    np.testing.assert_array_equal(moved["cart"], moved["spring:deflection:absolute"])
    balance = 2.0 * moved["cart_acceleration"] + 0.4 * moved["cart_velocity"] + 50 * moved["cart"]
    np.testing.assert_allclose(balance, 0.0, atol=1e-12)
    said = capsys.readouterr()
    assert said.err == ""
    result = json.loads(said.out)
    assert (result["status"], result["samples"], result["error"]) == ("converged", 200, 0.0)
    assert result["columns"]["cart"]["highest"] == pytest.approx(0.1)
    assert result["columns"]["cart_velocity"]["unit"] == "m/s"
    assert sorted(Path(name).name for name in result["provenance"]["inputs"]) == [
        "drive.toml",
        "rig.toml",
    ]


def test_an_impact_on_the_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sensors = ["clubhead:acceleration:collet", "wrist:angle:absolute", "shaft:strain:collet"]
    asked = [word for sensor in sensors for word in ("--sensor", sensor)]
    called = write(tmp_path, ROBOT, PULSE)
    assert cli.main([*called, *asked, "--out", str(tmp_path), "--seed", "3"]) == 0
    said = capsys.readouterr().out
    assert "wrist:angle:absolute" in said and max(map(len, said.splitlines())) <= 80
    moved = table(tmp_path / "motion.csv")
    coordinates = ["collet_angle", "grip_displacement", "grip_angle", "clubhead_displacement"]
    endings = ("", "_velocity", "_acceleration")
    wanted = ["time", *(name + ending for ending in endings for name in coordinates)]
    assert list(moved) == [*wanted, *sensors]
    np.testing.assert_array_equal(moved["collet_angle"], moved["wrist:angle:absolute"])
    acceleration = moved["clubhead_displacement_acceleration"]
    np.testing.assert_array_equal(acceleration, moved["clubhead:acceleration:collet"])
    np.testing.assert_allclose(acceleration[0], -1600.0 / 0.20277, rtol=1e-9)


SINE = '[drive]\nkind = "wrist"\nshape = "sine"\namplitude = 1.0\nperiod = 1.0\n' + TIMES
TORQUE = (
    '[drive]\nkind = "torque"\nshape = "square"\namplitude = 3.41\nperiod = 1.0\nduration = 1.0\n'
    + TIMES
)
SWUNG = (
    '[drive]\nkind = "swing"\nfile = "profile.csv"\n'
    "impact = { force = -1000.0, time = 0.8, duration = 0.0005 }\n" + TIMES
)
SIX = {
    "fixed_collet": PULSE,
    "driven_collet": TORQUE,
    "pinned_wrist": PULSE,
    "driven_wrist": SINE,
    "passive_wrist": SWUNG,
    "driven_arm": SWUNG,
}


@pytest.mark.parametrize("model", SIX)
def test_each_of_the_six_models_moves_under_its_drive(
    model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = np.linspace(0.0, 1.0, 101)
    lift = part - np.sin(2 * np.pi * part) / (2 * np.pi)
    rows = np.stack([1.2 * part, np.pi * lift - np.pi, 1.6 * lift - 1.6], axis=1)
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    (tmp_path / "profile.csv").write_text("\n".join(["time,arm_angle,wrist_angle", *lines]))
    called = write(tmp_path, ROBOT.replace("pinned_wrist", model), SIX[model])
    sensors = ["clubhead:acceleration:collet"]
    if "arm" in model or model == "passive_wrist":
        sensors += ["arm:angle:absolute", "wrist:angle:absolute", "hand:acceleration:absolute"]
    asked = [word for sensor in sensors for word in ("--sensor", sensor)]
    assert cli.main([*called, *asked, "--out", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["status"], result["model"]) == ("converged", model)
    named = [Path(name).name for name in result["provenance"]["inputs"]]
    assert ("profile.csv" in named) == (SIX[model] is SWUNG)
    moved = table(tmp_path / "motion.csv")
    assert np.ptp(moved["clubhead_displacement"]) > 1e-3
    assert ("collet_angle" in moved) == (model != "fixed_collet")
    if "arm:angle:absolute" in moved:
        arm = np.interp(moved["time"], rows[:, 0], rows[:, 1])
        np.testing.assert_allclose(moved["arm:angle:absolute"], arm, atol=1e-3)
        turned = moved["collet_angle"] - moved["arm:angle:absolute"]
        np.testing.assert_allclose(moved["wrist:angle:absolute"], turned, atol=1e-12)
        held = rows[0, 2] if model == "driven_arm" else 0.0
        assert moved["wrist:angle:absolute"][0] == pytest.approx(held)
        assert result["columns"]["hand:acceleration:absolute"]["unit"] == "m/s^2"
    if model == "driven_collet":
        assert np.degrees(moved["collet_angle"][-1]) == pytest.approx(180.0, abs=2.0)


PLANAR = {
    "fixed_collet": PULSE.replace("0.0051", "0.00005"),
    "driven_collet": TORQUE.replace("3.41", "1.5"),
    "pinned_wrist": f'[drive]\nkind = "release"\nclubhead_deflection = 0.05\n{TIMES}',
    "driven_wrist": SINE.replace("amplitude = 1.0", "amplitude = 0.3"),
    "passive_wrist": SWUNG,
    "driven_arm": SWUNG,
}


@pytest.mark.parametrize("model", PLANAR)
def test_each_of_the_six_models_moves_in_the_plane(
    model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = np.linspace(0.0, 1.0, 101)
    lift = part - np.sin(2 * np.pi * part) / (2 * np.pi)
    rows = np.stack([1.5 * part, 2.0 * lift - 2.0, lift - 1.0], axis=1)
    lines = [",".join(map(repr, row)) for row in rows.tolist()]
    (tmp_path / "profile.csv").write_text("\n".join(["time,arm_angle,wrist_angle", *lines]))
    rig = ROBOT.replace("pinned_wrist", model) + 'fidelity = "planar"\n'
    rig += "[parameters]\nswing_plane_inclination = 0.9\n"
    called = write(tmp_path, rig, PLANAR[model].replace("-1000.0", "-300.0"))
    sensors = ["clubhead:acceleration:absolute", "clubhead:acceleration:collet"]
    sensors += ["shaft:strain:collet", "clubhead:velocity:absolute", "grip:angle:absolute"]
    asked = [word for sensor in sensors for word in ("--sensor", sensor)]
    assert cli.main([*called, *asked, "--out", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["status"], result["model"]) == ("converged", model)
    assert result["fidelity"] == "planar" and 0 < result["error"] < 1e-6
    moved = table(tmp_path / "motion.csv")
    coordinates = [] if model == "fixed_collet" else ["collet_angle"]
    coordinates += ["grip_displacement", "grip_angle", "clubhead_displacement"]
    endings = ("", "_velocity", "_acceleration")
    wanted = ["time", *(name + ending for ending in endings for name in coordinates)]
    assert list(moved) == [*wanted, *sensors]
    assert np.ptp(moved["clubhead_displacement"]) > 1e-3
    at = PRESETS["robo_v"]["club_length"] - PRESETS["robo_v"]["grip_length"] / 2
    bend = moved["clubhead_displacement"] - moved["grip_displacement"]
    bend = bend - at * moved["grip_angle"]
    # across the grip's own axis, which is tilted a little
    np.testing.assert_allclose(moved["shaft:strain:collet"], 0.024 * bend, atol=2e-3 * 0.024)
    club = ("grip_displacement", "grip_angle", "clubhead_displacement")
    q = np.stack([0.0 * moved["time"], *(moved[name] for name in club)])
    exact = planar.bend(PRESETS["robo_v"], q)
    np.testing.assert_allclose(moved["shaft:strain:collet"], 0.024 * exact, atol=1e-15)
    if model == "pinned_wrist":
        assert moved["clubhead_displacement"][0] == pytest.approx(0.05)
    if model == "driven_arm":
        aim = np.interp(moved["time"], rows[:, 0], rows[:, 1] + rows[:, 2])
        assert np.abs(moved["collet_angle"] - aim).max() < 0.2


def test_a_shaft_that_bends_too_far_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    called = write(tmp_path, ROBOT + 'fidelity = "planar"\n', PULSE)
    assert cli.main([*called, "--out", str(tmp_path), "--json"]) == 3
    result = json.loads(capsys.readouterr().out)
    assert result["status"] == "left_model" and "The shaft bends by up to" in result["sentence"]
    assert len(table(tmp_path / "motion.csv")["time"]) == 200
    assert cli.main(called) == 3
    assert "! The shaft bends by up to" in capsys.readouterr().out


def test_the_laws_of_an_extended_rig_are_in_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    called = write(tmp_path, CHAIN, RELEASE)
    assert cli.main([*called, "--json"]) == 0
    without = json.loads(capsys.readouterr().out)
    write_rig(read_rig(tmp_path / "rig.toml"), tmp_path / "rig.toml", [FRICTION, OFFSET])
    assert cli.main([*called, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["laws"] == [{"law": "coulomb_friction", "place": "spring", "strength": 0.2}]
    assert result["laws_passed_over"] == [{"law": "sensor_offset", "place": "head"}]
    assert result["columns"]["cart"]["rms"] < 0.9 * without["columns"]["cart"]["rms"]
    assert cli.main(called) == 0
    said = capsys.readouterr().out
    assert "In force: coulomb_friction" in said and "Passed over: sensor_offset" in said


def test_what_does_not_settle_is_not_trusted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    called = write(tmp_path, CHAIN, RELEASE)
    write_rig(read_rig(tmp_path / "rig.toml"), tmp_path / "rig.toml", [FRICTION])
    monkeypatch.setattr("supple.model.motion.MOST_REFINEMENT", 2)
    monkeypatch.setattr("supple.model.motion.TOLERANCE", 1e-13)
    assert cli.main([*called, "--out", str(tmp_path)]) == 3
    assert "Not converged" in capsys.readouterr().out
    assert len(table(tmp_path / "motion.csv")["time"]) == 200


LATE = PULSE.replace("force", "start = 5.0\nforce")
BAD = {
    "no rig": (None, PULSE, "rig.toml"),
    "a drive of another model": (ROBOT, SINE, "drive.toml: [drive] kind"),
    "a planar chain": (
        CHAIN.replace("[masses", 'fidelity = "planar"\n[masses'),
        RELEASE,
        "rig.toml: [rig] fidelity",
    ),
    "a weight without a plane": (
        ROBOT + "[parameters]\nswing_plane_inclination = 0.9\n",
        PULSE,
        "rig.toml: [parameters] swing_plane_inclination",
    ),
    "a planar law at a strange place": (
        ROBOT + 'fidelity = "planar"\n[[laws]]\nlaw = "coulomb_friction"\nplace = "arm"\n',
        PULSE,
        "rig.toml: [[laws]] item 0 place",
    ),
    "an impact on nothing": (CHAIN, PULSE, "drive.toml: [drive] place"),
    "an impact after the end": (ROBOT, LATE, "drive.toml: [drive] start"),
    "an impact without force": (
        ROBOT,
        PULSE.replace("force = -1600.0\n", ""),
        "drive.toml: [drive] force",
    ),
    "text for a number": (
        ROBOT,
        PULSE.replace("-1600.0", "'strong'"),
        "drive.toml: [drive] force",
    ),
    "no [times]": (ROBOT, PULSE.replace(TIMES, ""), "drive.toml: [times]"),
    "a single sample": (
        ROBOT,
        PULSE.replace("duration = 2.0", "duration = 0.01"),
        "drive.toml: times",
    ),
    "a spring that holds nothing": (
        CHAIN.replace("50.0", "0.0") + "[masses.b]\nmass = 1.0\n",
        RELEASE,
        "drive.toml: release at 'cart'",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_ends_in_one_line(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig, drive, at = BAD[name]
    called = write(tmp_path, rig or "", drive)
    if rig is None:
        (tmp_path / "rig.toml").unlink()
    assert cli.main([*called, "--out", str(tmp_path / "out")]) == 2
    one_line(capsys, at)
    assert not (tmp_path / "out").exists()


def one_line(capsys: pytest.CaptureFixture[str], at: str) -> None:
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert at in said.err and "expected" in said.err and " found " in said.err
    assert "Mend: " in said.err


@pytest.mark.parametrize(
    "sensor",
    [
        "clubhead",
        "clubhead:acceleration",
        "cubhead:acceleration:collet",
        "clubhead:angle:collet",
        "clubhead:force:absolute",
        "wrist:position:absolute",
        "clubhead:acceleration:arm",
    ],
)
def test_a_sensor_that_the_robot_has_not(
    sensor: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*write(tmp_path, ROBOT, PULSE), "--sensor", sensor]) == 2
    one_line(capsys, f"--sensor '{sensor}'")


def test_a_chain_has_no_collet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    called = write(tmp_path, CHAIN, RELEASE)
    assert cli.main([*called, "--sensor", "cart:position:collet"]) == 2
    one_line(capsys, "a chain has no collet")


def test_a_law_that_does_not_fit_names_the_rig(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    called = write(tmp_path, CHAIN, RELEASE)
    strange = FRICTION | {"place": "wrist"}
    write_rig(read_rig(tmp_path / "rig.toml"), tmp_path / "rig.toml", [strange])
    assert cli.main(called) == 2
    one_line(capsys, "rig.toml: [[laws]] item 0 place")


@pytest.mark.parametrize("missing", ["--rig", "--drive"])
def test_rig_and_drive_are_needed(
    missing: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    called = write(tmp_path, CHAIN, RELEASE)
    at = called.index(missing)
    assert cli.main(called[:at] + called[at + 2 :]) == 2
    assert missing in capsys.readouterr().err


SENSORS = """\
[sensors.head]
kind = "accelerometer"
place = "clubhead"
frame = "collet"
mass = 0.006
gain = 0.02
saturation = 40.0
[sensors.joint]
kind = "encoder"
place = "wrist"
quantum = 1e-3
"""


@pytest.mark.parametrize("fidelity", ["thesis", "planar"])
def test_sensors_of_a_file_and_laws_of_a_named_one_are_in_force(
    fidelity: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    blow = PULSE.replace("-1600.0", "-160.0")
    called = write(tmp_path, f'{ROBOT}fidelity = "{fidelity}"\n', blow)
    (tmp_path / "sensors.toml").write_text(SENSORS)
    lost = {"law": "sensor_gain", "place": "other", "parameters": {"gain_error": 0.5}}
    wrist = {"law": "sensor_offset", "place": "turn", "parameters": {"offset": 0.25}}
    write_rig(read_rig(tmp_path / "rig.toml"), tmp_path / "rig.toml", [lost, wrist])
    asked = ["--sensors", str(tmp_path / "sensors.toml")]
    asked += ["--sensor", "turn=wrist:angle:absolute", "--sensor", "wrist:angle:absolute"]
    assert cli.main([*called, *asked, "--out", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["laws"] == [{"law": "sensor_offset", "place": "turn", "strength": 0.25}]
    assert result["laws_passed_over"] == [{"law": "sensor_gain", "place": "other"}]
    assert [s["name"] for s in result["sensors"]] == [
        *("head", "joint", "turn", "wrist:angle:absolute")
    ]
    units = [result["columns"][name]["unit"] for name in ("head", "joint", "turn")]
    assert units == ["m/s^2", "rad", "rad"]
    assert str(tmp_path / "sensors.toml") in result["provenance"]["inputs"]
    moved = table(tmp_path / "motion.csv")
    np.testing.assert_allclose(moved["turn"], moved["wrist:angle:absolute"] + 0.25, rtol=1e-14)
    assert np.max(np.abs(moved["joint"] - moved["wrist:angle:absolute"])) < 0.05
    assert moved["head"].min() == -40.0
    heavy = ROBOT + f'fidelity = "{fidelity}"\n[parameters]\nclubhead_mass = {0.20277 + 0.006!r}\n'
    called = write(tmp_path, heavy, blow)
    asked = ["--sensor", "clubhead:acceleration:collet", "--out", str(tmp_path / "heavy")]
    assert cli.main([*called, *asked, "--quiet"]) == 0
    truth = table(tmp_path / "heavy" / "motion.csv")["clubhead:acceleration:collet"]
    np.testing.assert_allclose(moved["head"], np.clip(1.02 * truth, -40, 40), rtol=1e-9)


@pytest.mark.parametrize(
    "text, at",
    [
        (SENSORS.replace('"wrist"', '"elbow"'), "sensors.toml: [sensors.joint]: expected"),
        (SENSORS.replace('"encoder"', '"camera"'), "sensors.toml: [sensors.joint] kind"),
        (SENSORS.replace("mass = 0.006", "mass = -1.0"), "sensors.toml: [sensors.head] mass"),
        (SENSORS.replace(".head]", ".collet_angle]"), "sensor 'collet_angle'"),
    ],
)
def test_a_faulty_file_of_sensors_ends_in_one_line(
    text: str, at: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    called = write(tmp_path, ROBOT, PULSE)
    (tmp_path / "sensors.toml").write_text(text)
    assert cli.main([*called, "--sensors", str(tmp_path / "sensors.toml")]) == 2
    one_line(capsys, at)


def test_a_sensor_asked_for_twice_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["--sensor", "clubhead:position:absolute"] * 2
    assert cli.main([*write(tmp_path, ROBOT, PULSE), *asked]) == 2
    one_line(capsys, "--sensor 'clubhead:position:absolute'")
