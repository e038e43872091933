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


def test_a_swing_names_the_models_that_work(tmp_path: Path):
    (tmp_path / "profile.csv").write_text("time,arm_angle,wrist_angle\n0,0,0\n")
    with pytest.raises(ValueError, match=r"fixed_collet and pinned_wrist, found 'swing'"):
        read('kind = "swing"\nfile = "profile.csv"\n', tmp_path)


def test_places():
    assert drive_places(FIXED) == ("clubhead", "grip")
    assert drive_places(PINNED) == ("clubhead", "grip", "collet", "wrist", "hand")
    assert drive_places(LINE) == ("a", "b", "s1", "s2")
