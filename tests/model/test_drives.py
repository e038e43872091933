"""Drives: values at jumps, balances before a release, and what a drive's file may ask for."""

from pathlib import Path

import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.drive_file import read_drive
from supple.model.drives import (
    Drive,
    Hold,
    drive_of,
    drive_places,
    equilibrium,
    impact,
    release,
    torque,
    wave,
)
from supple.model.energies import stiffness_matrix
from supple.model.linear import Mechanism
from supple.model.robot import PRESETS, Robot

NUMBERS = PRESETS["robo_v"]
PINNED, FIXED = Robot("pinned_wrist"), Robot("fixed_collet")
LINE = Chain(("a", "b"), (("s1", "ground", "a"), ("s2", "a", "b")))
LINE_NUMBERS = {
    "masses.a.mass": 1.0,
    "masses.b.mass": 0.5,
    "links.s1.stiffness": 400.0,
    "links.s1.damping": 1.0,
    "links.s2.stiffness": 300.0,
    "links.s2.damping": 0.5,
}
TIMES = "[times]\nduration = 1.0\nsample_rate = 100.0\n"


def read(text: str, folder: Path, mechanism: Mechanism = PINNED) -> Drive:
    path = folder / "drive.toml"
    path.write_text("[drive]\n" + text + TIMES)
    return drive_of(read_drive(path), mechanism)


def test_the_new_level_holds_from_its_jump_on():
    drive = impact("clubhead", -3.0, 0.1, 0.2)
    at = np.array([0.0, 0.1, 0.2, 0.1 + 0.2, 1.0])
    np.testing.assert_array_equal(drive.force(at), [0.0, -3.0, -3.0, 0.0, 0.0])


def test_samples_are_held_and_forgive_rounding():
    drive = torque("wrist", (-2.0, -1.0, 0.3, 0.7), (9.0, 1.0, 2.0, 3.0))
    assert (drive.edges, drive.levels) == ((0.0, 0.3, 0.7), (1.0, 2.0, 3.0))
    times = np.arange(10) / 10.0  # 0.3 is 3 * 0.1 = 0.30000000000000004 to other roundings
    np.testing.assert_array_equal(drive.sampled(times)[:, 0], [1] * 3 + [2] * 4 + [3] * 3)
    assert [port.held for port in drive.ports] == [True]
    assert release("wrist", 0.1).sampled(times).shape == (10, 0)


def test_a_torque_is_zero_before_its_first_time():
    drive = torque("wrist", (0.5,), (4.0,))
    np.testing.assert_array_equal(drive.force(np.array([0.0, 0.49, 0.5])), [0.0, 0.0, 4.0])


def test_waves():
    square = wave("wrist", "square", 2.0, 0.4, 0.1, 0.9)
    at = np.array([0.0, 0.15, 0.35, 0.55, 0.75, 0.95])
    np.testing.assert_array_equal(square.force(at), [0.0, 2.0, -2.0, 2.0, -2.0, 0.0])
    sine = wave("wrist", "sine", 2.0, 0.4, 0.1, 0.9)
    np.testing.assert_allclose(sine.force(np.array([0.05, 0.2, 0.4, 0.95])), [0, 2, -2, 0])


def test_on_a_fixed_collet_the_balance_is_the_clubs_own():
    q, force = equilibrium(FIXED, NUMBERS, Hold("clubhead", "collet", 0.15))
    stiffness = np.asarray(stiffness_matrix(FIXED.rows(NUMBERS)))[:3, :3]
    np.testing.assert_allclose(stiffness @ q, [0.0, 0.0, float(force)], atol=1e-6 * float(force))
    assert q[2] == pytest.approx(0.15)


def test_a_pinned_collet_turns_along():
    """The force is that of the fixed collet; the wrist carries its moment about the pivot."""
    fixed, force = equilibrium(FIXED, NUMBERS, Hold("clubhead", "collet", 0.15))
    q, same = equilibrium(PINNED, NUMBERS, Hold("clubhead", "collet", 0.15))
    assert float(same) == pytest.approx(float(force))
    np.testing.assert_allclose(q[1:], fixed, rtol=1e-9)
    radius = (
        NUMBERS["sleeve_offset"]
        + NUMBERS["sleeve_spacing"] / 2
        + NUMBERS["club_length"]
        - NUMBERS["grip_length"] / 2
    )
    assert q[0] == pytest.approx(float(force) * radius / NUMBERS["wrist_stiffness"])


def test_chains_are_held_at_a_mass_or_by_a_link():
    q, force = equilibrium(LINE, LINE_NUMBERS, Hold("b", "absolute", 0.1))
    np.testing.assert_allclose(q, [0.3 / 7, 0.1])
    assert float(force) == pytest.approx(0.1 / (1 / 400 + 1 / 300))
    q, _ = equilibrium(LINE, LINE_NUMBERS, Hold("s1", "absolute", 0.1))
    np.testing.assert_allclose(q, [0.1, 0.1])
    q, _ = equilibrium(Chain(("cart",), ()), {"masses.cart.mass": 1.0}, Hold("cart", "", 0.2))
    np.testing.assert_allclose(q, [0.2])


def test_files(tmp_path: Path):
    hold = read('kind = "release"\nclubhead_deflection = 0.15\n', tmp_path).hold
    assert hold == Hold("clubhead", "collet", 0.15)
    hold = read('kind = "release"\nplace = "b"\ndisplacement = 0.1\n', tmp_path, LINE).hold
    assert hold == Hold("b", "absolute", 0.1)
    pulse = read('kind = "impact"\nforce = -1600.0\nstart = 0.2\nduration = 0.005\n', tmp_path)
    assert pulse == impact("clubhead", -1600.0, 0.2, 0.005)
    steps = read('kind = "torque"\ntimes = [0.0, 0.5, 2.0]\nvalues = [1.0, 2.0, 3.0]\n', tmp_path)
    assert (steps.edges, steps.levels) == ((0.0, 0.5), (1.0, 2.0))
    steps = read('kind = "torque"\ntimes = [0.1]\nvalues = [1.0]\nduration = 0.2\n', tmp_path)
    assert (steps.edges, steps.levels) == ((0.1, 0.2), (1.0, 0.0))
    square = 'kind = "torque"\nshape = "square"\namplitude = 0.6\nperiod = 0.5\n'
    assert read(square, tmp_path).edges == (0.0, 0.25, 0.5, 0.75, 1.0)


BAD = {
    "a driven wrist": ('kind = "wrist"\nshape = "sine"\namplitude = 1.0\nperiod = 1.0\n', "kind"),
    "no such place": ('kind = "impact"\nplace = "arm"\nforce = 1.0\nduration = 0.1\n', "place"),
    "too late": ('kind = "impact"\nforce = 1.0\nstart = 1.0\nduration = 0.1\n', "start"),
    "all too late": ('kind = "torque"\ntimes = [3.0]\nvalues = [1.0]\n', "times"),
    "a late release": ('kind = "release"\nstart = 0.1\ndisplacement = 0.1\n', "start"),
    "the wrong place": (
        'kind = "release"\nplace = "wrist"\nclubhead_deflection = 0.1\n',
        "clubhead_deflection",
    ),
    "too many": (
        'kind = "torque"\nshape = "square"\namplitude = 1.0\nperiod = 1e-6\n',
        "period",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_simulated_is_refused(name: str, tmp_path: Path):
    text, key = BAD[name]
    with pytest.raises(ValueError) as raised:
        read(text, tmp_path)
    said = str(raised.value)
    assert f"drive.toml: [drive] {key}: expected " in said
    assert ", found " in said and " Mend: " in said and "\n" not in said


ARMED, DRIVEN = Robot("driven_arm"), Robot("driven_wrist")
SWING = 'kind = "swing"\nfile = "profile.csv"\n'
SINE = 'kind = "wrist"\nshape = "sine"\namplitude = 0.3\nperiod = 0.4\n'


def profile(folder: Path, start: float = 0.0, end: float = 0.8, rows: int = 33) -> np.ndarray:
    """A swing from rest to rest, with a column that no model knows."""
    times = np.linspace(start, end, rows)
    part = (times - start) / (end - start)
    lift = part - np.sin(2 * np.pi * part) / (2 * np.pi)
    table = np.stack([times, np.pi * lift - 3.0, 1.6 * lift - 1.6, 0.0 * lift], axis=1)
    names = "time,arm_angle,wrist_angle,grip_angle"
    text = "\n".join([names, *(",".join(map(repr, row)) for row in table.tolist())])
    (folder / "profile.csv").write_text(text + "\n", encoding="utf-8")
    return table


def test_a_swing_passes_through_its_profile_and_rests_behind_it(tmp_path: Path):
    table = profile(tmp_path)
    drive = read(SWING + "impact = { force = -1000.0, time = 0.6 }\n", tmp_path, ARMED)
    assert [joint.joint for joint in drive.joints] == ["arm", "wrist"]
    for column, joint in enumerate(drive.joints, 1):
        np.testing.assert_allclose(joint.at(table[:, 0])[:, 0], table[:, column], atol=1e-12)
        np.testing.assert_allclose(joint.at(np.array([0.95]))[0], [table[-1, column], 0, 0])
    assert (drive.edges, drive.levels) == (pytest.approx((0.6, 0.6005)), (-1000.0, 0.0))
    ports = [(port.place, port.quantity) for port in drive.ports]
    bend = "angular_acceleration"
    assert ports == [("clubhead", "force"), ("arm", bend), ("wrist", bend)]
    assert drive.sampled(np.arange(10) / 10).shape == (10, 3)
    passive = read(SWING, tmp_path, Robot("passive_wrist"))
    assert passive.joints == drive.joints[:1] and passive.port is None
    later = read(SWING + "start = 0.1\n", tmp_path, ARMED)
    np.testing.assert_allclose(
        later.joints[0].at(np.array([0.05, 0.5]))[:, 0],
        drive.joints[0].at(np.array([-0.0, 0.4]))[:, 0],
    )
    wrist = read('kind = "wrist"\nfile = "profile.csv"\n', tmp_path, DRIVEN)
    assert wrist.joints == drive.joints[1:]


def test_a_wrist_follows_a_shape(tmp_path: Path):
    at = np.array([0.0, 0.05, 0.2, 0.4, 0.75, 0.85])
    sine = read(SINE + "start = 0.1\nduration = 0.6\n", tmp_path, DRIVEN).joints[0]
    inside = (at >= 0.1) & (at < 0.7)
    wanted = np.where(inside, 0.3 * np.sin(5 * np.pi * (at - 0.1)), 0.0)
    np.testing.assert_allclose(sine.at(at)[:, 0], wanted, atol=1e-12)
    wanted = np.where(inside, -0.3 * (5 * np.pi) ** 2 * np.sin(5 * np.pi * (at - 0.1)), 0.0)
    np.testing.assert_allclose(sine.at(at)[:, 2], wanted, atol=1e-9)
    square = read(SINE.replace("sine", "square"), tmp_path, DRIVEN).joints[0]
    np.testing.assert_array_equal(square.at(at)[:, 0], [0.3, 0.3, -0.3, 0.3, -0.3, 0.3])
    assert square.leaps and not sine.leaps


@pytest.mark.parametrize(("start", "end"), [(-0.5, 0.5), (0.2, 2.0), (-0.5, 2.0), (0.0, 1.0)])
def test_a_profile_that_begins_early_or_ends_late_is_cut(start, end, tmp_path: Path):
    table = profile(tmp_path, start, end)
    for joint, column in zip(read(SWING, tmp_path, ARMED).joints, (1, 2)):
        inside = table[(table[:, 0] >= 0) & (table[:, 0] < 1.0)]
        np.testing.assert_allclose(joint.at(inside[:, 0])[:, 0], inside[:, column], atol=1e-12)
        assert all(0.0 <= edge < 1.0 for edge in joint.edges)
        times = np.linspace(max(start, 0.0) + 0.01, min(end, 1.0) - 0.02, 7)
        slopes = (joint.at(times + 1e-5)[:, :2] - joint.at(times - 1e-5)[:, :2]) / 2e-5
        np.testing.assert_allclose(slopes, joint.at(times)[:, 1:], rtol=1e-5, atol=1e-5)


BAD_JOINTS = {
    "a wrist that is not driven": (SINE, PINNED, "drive.toml: [drive] kind"),
    "an arm that is not there": (SWING, DRIVEN, "drive.toml: [drive] kind"),
    "a chain": (SINE, LINE, "drive.toml: [drive] kind"),
    "another place": (SINE + 'place = "arm"\n', ARMED, "drive.toml: [drive] place"),
    "too late": (SINE + "start = 2.0\n", DRIVEN, "drive.toml: [drive] start"),
    "too fast": (SINE.replace("0.4", "1e-6"), DRIVEN, "drive.toml: [drive] period"),
    "a ball after the end": (
        SWING + "impact = { force = 1.0, time = 1.0 }\n", ARMED, "drive.toml: [drive] impact time",
    ),
    "a profile after the end": (SWING + "start = 0.99\n", ARMED, ""),
    "both": (SINE + 'file = "profile.csv"\n', DRIVEN, "drive.toml: [drive]"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_JOINTS)
def test_a_joint_that_cannot_be_driven_is_refused(name: str, tmp_path: Path):
    text, mechanism, at = BAD_JOINTS[name]
    profile(tmp_path, 0.02)
    with pytest.raises(ValueError) as raised:
        read(text, tmp_path, mechanism)
    said = str(raised.value)
    assert f"{at}: expected " in said if at else "profile.csv" in said
    assert ", found " in said and " Mend: " in said and "\n" not in said


PROFILES = {
    "no header": ("0.0,0.0\n1.0,1.0\n", "header"),
    "another column": ("time,arm_angle\n0,0\n1,0\n", "header"),
    "one row": ("time,wrist_angle\n0,0\n", "at least two rows"),
    "empty": ("", "header"),
    "text": ("time,wrist_angle\n0,0\n1,fast\n", "line 3, column 'wrist_angle'"),
    "a gap": ("time,wrist_angle\n0,0\n1,\n", "line 3, column 'wrist_angle'"),
    "a short row": ("time,wrist_angle\n0,0\n1\n", "line 3, column 'wrist_angle'"),
    "infinity": ("time,wrist_angle\n0,0\n1,inf\n", "line 3, column 'wrist_angle'"),
    "time that stands still": ("time,wrist_angle\n0,0\n\n1,0\n1,0\n", "line 5, column 'time'"),
    "cut off while it moves": ("time,wrist_angle\n0,0\n0.2,0.5\n0.5,1.5\n", "rests where it ends"),
    "begun in motion": ("time,wrist_angle\n0.1,0\n0.2,0.5\n2.0,1.5\n", "rests where it begins"),
}


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile_at_fault_is_refused(name: str, tmp_path: Path):
    text, words = PROFILES[name]
    (tmp_path / "profile.csv").write_text(text)
    with pytest.raises(ValueError) as raised:
        read('kind = "wrist"\nfile = "profile.csv"\n', tmp_path, DRIVEN)
    said = str(raised.value)
    assert "profile.csv: " in said and words in said
    assert "expected " in said and ", found " in said and " Mend: " in said and "\n" not in said


def test_places():
    assert drive_places(FIXED) == ("clubhead", "grip")
    assert drive_places(PINNED) == ("clubhead", "grip", "collet", "wrist", "hand")
    for model in ("driven_collet", "driven_wrist", "passive_wrist", "driven_arm"):
        assert drive_places(Robot(model)) == drive_places(PINNED)
    assert drive_places(LINE) == ("a", "b", "s1", "s2")
