"""The thesis's slips, each shown by what it would do to the six models."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from supple.model.drives import Drive
from supple.model.linear import modes
from supple.model.motion import respond
from supple.model.prescribed import Prescribed, through
from supple.model.robot import Robot
from tests.model.test_robot import (
    HEAD,
    RIGID,
    ROBO_V,
    TABLE_4,
    TURNING,
    poles,
    printed_club,
    slowest,
)
from tests.reference.thesis_models import (
    equation_11,
    equation_36,
    equation_40,
    equations_8_to_10,
    equations_22_to_25,
    equations_32_to_35,
)


@pytest.mark.parametrize(
    "p, right, printed, ratio, wrong_ratio",
    [(RIGID, 3.96, 4.14, 0.0065, 0.0075), (TABLE_4, 4.03, 4.15, 0.081, 0.016)],
)
def test_slip_a1_stiffens_the_club_and_hides_its_damping(p, right, printed, ratio, wrong_ratio):
    t = printed_club(p)
    found = slowest(poles(*equations_8_to_10(t)))
    assert found == (pytest.approx(right, abs=5e-3), pytest.approx(ratio, abs=5e-4))
    found = slowest(poles(*equation_11(t)[:3]))
    assert found == (pytest.approx(printed, abs=5e-3), pytest.approx(wrong_ratio, abs=5e-4))


def test_slip_a1_would_make_the_published_frequencies_impossible():
    """Line 1259 has 3.76 and 3.12 Hz; the printed clubhead never swings below 3.89 Hz."""
    t = printed_club(RIGID)
    floor = np.sqrt(t.k_sh / t.m_cl * (1 - t.l / (2 * t.a))) / (2 * np.pi)
    assert floor == pytest.approx(3.89, abs=5e-3)
    for k in np.logspace(2, 8, 13):
        sleeve = replace(t, k1=k, k2=k)
        assert slowest(poles(*equation_11(sleeve)[:3]))[0] > 0.999 * floor
        right = slowest(poles(*equations_8_to_10(sleeve)))[0]
        assert (right < 3.12) == (k < 1e5)


def test_slip_a2_turns_the_force_into_a_moment_on_the_grip():
    t = printed_club(TABLE_4)
    stiffness, push = equations_8_to_10(t)[2], equation_11(t)[3]
    right = np.linalg.solve(stiffness, [0.0, 1.0, 0.0])[1]
    assert right == pytest.approx(1.02e-2, abs=5e-5)
    assert np.linalg.solve(stiffness, push)[1] == pytest.approx(3.1e-3, abs=5e-5)


def test_slip_a3_makes_the_driven_collet_unstable():
    t = printed_club(TABLE_4)
    assert np.real(poles(*equations_22_to_25(t)[:3])).max() == pytest.approx(27.6, abs=0.05)
    found = modes(Robot("driven_collet"), TABLE_4)
    assert np.all(np.real(found.poles)[found.frequencies > 1e-3] < 0)


def test_slip_a4_changes_the_slowest_decay():
    t = printed_club(TABLE_4)  # wrist 300 N m/rad, 15 N m s/rad
    ours = modes(Robot("pinned_wrist"), TABLE_4)
    assert np.real(ours.poles).max() == pytest.approx(-4.40, abs=5e-3)
    assert np.real(poles(*equation_36(t)[:3])).max() == pytest.approx(-4.40, abs=5e-3)
    assert np.real(poles(*equations_32_to_35(t)[:3])).max() == pytest.approx(-4.19, abs=5e-3)


def test_slip_a10_needs_the_butt_of_the_club_at_the_pivot():
    moved = TABLE_4 | {"sleeve_offset": 0.0}
    t = printed_club(moved)
    printed = slowest(poles(*equation_36(t)[:3]))
    assert printed == (pytest.approx(3.553, abs=5e-4), pytest.approx(0.191, abs=5e-4))
    ours = modes(Robot("pinned_wrist"), moved)
    found = ours.frequencies[0], ours.damping_ratios[0]
    assert found == (pytest.approx(3.599, abs=5e-4), pytest.approx(0.183, abs=5e-4))


def arm_swing(count: int = 401) -> tuple[np.ndarray, np.ndarray]:
    """0 to 180 degrees in 1 s with a sine of acceleration, and 1 s of rest."""
    times = np.linspace(0.0, 1.0, count)
    return times, np.pi * (times - np.sin(2 * np.pi * times) / (2 * np.pi))


def printed_swing(p: dict[str, float], times: np.ndarray, drive: Prescribed) -> tuple[float, float]:
    """Peak relative acceleration and displacement of the clubhead by eq. 36 and 40 as printed."""
    t = printed_club(p)
    mass, damping, stiffness, _ = equation_36(t)
    lower = np.hstack([-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)])
    a = np.vstack([np.hstack([np.zeros((4, 4)), np.eye(4)]), lower])
    b = np.vstack([np.zeros((4, 3)), np.linalg.solve(mass, equation_40(t))])
    look, feed = np.stack([a[7], np.eye(8)[3]]), np.stack([b[7], np.zeros(3)])
    seen = lsim((a, b, look, feed), drive.at(times)[:, ::-1], times)[1]
    return tuple(np.max(np.abs(seen), axis=0))


def test_slip_a6_hides_a_third_of_an_arm_swing():
    """THESIS 3, A6: 9.4 m/s^2 and 84 mm against 6.1 m/s^2 and 53 mm; wrist of line 1615."""
    p = TABLE_4 | {"wrist_stiffness": 500.0, "wrist_damping": 5.0}
    times = np.arange(20000) / 1e4
    knots, angles = arm_swing()
    drive = through("arm", knots.tolist(), angles.tolist(), 2.0)
    motion = respond(Robot("passive_wrist"), p, Drive(joints=(drive,)), times, (HEAD,))
    assert np.max(np.abs(motion.samples)) == pytest.approx(9.4, abs=0.05)
    assert np.max(np.abs(motion.positions[:, 3])) == pytest.approx(0.084, abs=5e-4)
    bend, reach = printed_swing(p, times, drive)
    assert bend == pytest.approx(6.1, abs=0.05)
    assert reach == pytest.approx(0.053, abs=5e-4)


def test_shaft_head_and_rigid_grip_have_the_frequencies_of_the_thesis():
    natural = 4.167  # line 1157
    mass = ROBO_V["shaft_stiffness"] / (2 * np.pi * natural) ** 2  # eq. 16
    assert mass == pytest.approx(ROBO_V["clubhead_mass"], rel=1e-4)
    spacing = 0.0590  # alternative set P_rigid
    p_rigid = RIGID | {"sleeve_spacing": spacing, "sleeve_offset": (0.250 - spacing) / 2}
    for p, frequency, ratio in ((RIGID, 3.959, 0.0065), (p_rigid, 4.020, 0.0068)):
        found = modes(Robot("fixed_collet"), p)
        assert found.damped_frequencies[0] == pytest.approx(frequency, abs=5e-4)
        assert found.damping_ratios[0] == pytest.approx(ratio, abs=5e-5)
        shaft = p["shaft_damping"] / (2 * p["clubhead_mass"] * 2 * np.pi * natural)
        law = shaft * (found.frequencies[0] / natural) ** 3
        assert found.damping_ratios[0] == pytest.approx(law, rel=0.01)
    assert 3.959 / 4.02 - 1 == pytest.approx(-0.015, abs=5e-4)  # published 4.02 Hz, line 1174


@pytest.mark.parametrize("model", TURNING[1:])
def test_a_rigid_wrist_is_the_fixed_collet_in_every_model(model):
    p = RIGID | {"wrist_stiffness": 1e5, "wrist_damping": 2.0}  # lines 1469 and 1643
    assert modes(Robot(model), p).damped_frequencies[0] == pytest.approx(3.956, abs=5e-4)
