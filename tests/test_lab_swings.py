"""The bench's golfers: links against finite elements, power against energy, a ball, a servo."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.linalg import eigh

from tests.lab import instrumented
from tests.lab.__main__ import main
from tests.lab.finite import CLUB, clamped
from tests.lab.full_swings import GOLFERS, deflection, gauges, hold_of, swung_by
from tests.lab.links import (
    BALL,
    HAND,
    LENGTH,
    TIP_STIFFNESS,
    Club,
    Hold,
    energies,
    make_club,
    power,
    start_of,
    swing,
)
from tests.lab.servo import FEEDBACK, play

STYLE = GOLFERS["golfer_1"]


@pytest.fixture(scope="module")
def swung():
    return swung_by(STYLE)


def still(club: Club) -> Club:
    return replace(club, loss=0.0)


def held(angle: float) -> tuple[float, float, float]:
    return angle, 0.0, 0.0


def test_links_are_the_finite_elements_clamped_club():
    stiffness, mass, _ = clamped(CLUB)
    theirs = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    for links, within in ((8, 0.08), (32, 0.05)):
        club = make_club(links)
        own, _, row = club.clamped()
        assert club.tones()[0] == pytest.approx(theirs[0], rel=1e-3)
        assert club.tones()[1] == pytest.approx(theirs[1], rel=within)
        assert 1 / (row @ np.linalg.solve(own, row)) == pytest.approx(TIP_STIFFNESS)
    assert np.sum(make_club().length) == pytest.approx(LENGTH - HAND)


def test_a_free_club_keeps_its_energy():
    club = still(make_club(2))
    hold = Hold(lambda t: held(0.0), lambda t: held(0.0), 0.62, (0.0, 0.0), 7.0)
    start = np.concatenate([np.linspace(1.2, 1.3, len(club.length)), np.full(len(club.length), 3)])
    moved = swing(club, hold, None, 0.5, rate=1000.0, start=start, exact=1e-10)
    energy = energies(club, hold, moved)
    bent = 0.5 * np.diff(moved.angle, axis=1) ** 2 @ club.hinge
    assert np.ptp(moved.angle[:, 0]) > 0.4 and bent.max() > 0.05
    assert np.ptp(energy) < 1e-6 * bent.max()


def test_work_of_hands_and_arm_is_what_the_club_gains(swung):
    club, hold = make_club(), hold_of(STYLE)
    energy, put_in = energies(club, hold, swung), power(club, hold, swung)
    before = swung.times < swung.impact - 1e-3
    after = swung.times > swung.impact + 3e-3
    for part in (before, after):
        work = cumulative_simpson(put_in[part], x=swung.times[part], initial=0)
        gained = energy[part] - energy[part][0]
        assert np.ptp(gained) > 100.0
        assert np.abs(gained - work).max() < 1e-6 * np.ptp(gained)


def test_a_ball_takes_momentum_and_leaves_as_fast_as_balls_do(swung):
    before = swung.times < swung.impact
    speed = np.gradient(swung.head[before], swung.times[before], axis=0)[-2]
    assert 1.3 < swung.ball_speed / speed[0] < 1.6
    pushed = -np.trapezoid(swung.force, swung.times)
    assert pushed == pytest.approx(BALL * swung.ball_speed, rel=0.3)  # three samples of the blow
    assert 2 <= np.sum(swung.force < 0) <= 4  # half a millisecond


def test_bending_by_links_is_that_of_a_rod_that_shortens():
    """Against the bench's other golfer: one mass on a curved path, in polar coordinates."""
    other = instrumented.swing(0, slow=1.5, blow=False, end=1.7)
    times = other.times[::16]
    joints = [make_interp_spline(times, one[::16], k=5) for one in (other.arm, other.wrist)]

    def joint(k: int):
        curve, first, second = joints[k], joints[k].derivative(1), joints[k].derivative(2)
        return lambda t: (float(curve(t)), float(first(t)), float(second(t)))

    club = make_club(4)
    stiff = Hold(joint(0), joint(1), instrumented.ARM, (2e4, 100.0))
    moved = swing(club, stiff, None, float(times[-1]), rate=1000.0, exact=1e-6)
    bent = deflection(club, moved)
    theirs = np.interp(moved.times, other.times, other.deflection)
    part = (moved.times > 0.3) & (moved.times < other.impact)
    # the shaft's own mass, its second mode and where the gauge sits are in the links alone
    assert np.sqrt(np.mean((bent - theirs)[part] ** 2)) < 0.15 * np.sqrt(np.mean(theirs[part] ** 2))


def test_turning_stiffens_the_club():
    """A frequency at steady rotation, by small motions of the nonlinear links."""
    club, rate = make_club(4), 30.0

    def tone(speed: float) -> float:
        hold = Hold(lambda t: (speed * t, speed, 0.0), lambda t: held(0.0), 1e-9, (2e5, 100.0))
        start = start_of(club, hold)
        start[1 : len(club.length)] += 0.02 * np.linspace(0.1, 1.0, len(club.length) - 1)
        moved = swing(club, hold, None, 1.5, rate=1000.0, start=start, exact=1e-7)
        bend = deflection(club, moved)[200:]  # the higher modes have rung out
        crossed = np.flatnonzero(np.diff(np.sign(bend - bend.mean())) > 0)
        return (len(crossed) - 1) * 1000.0 / (crossed[-1] - crossed[0])

    slow = tone(0.0)
    assert slow == pytest.approx(4.167, rel=0.02)
    # finite elements with full centrifugal terms give 5.5 Hz at 30 rad/s
    assert 1.2 < tone(rate) / slow < 1.45


def test_gauges_turn_with_the_grip(swung):
    club, rng = make_club(), np.random.default_rng(0)
    shown = gauges(STYLE, club, swung, rng)
    at = int(np.searchsorted(swung.times, swung.impact)) - 5  # the face is square there
    bent = deflection(club, swung)
    assert shown["lead_strain"][at] / 0.024 == pytest.approx(bent[at], abs=4e-3)
    assert all(np.abs(one).max() <= 5000.0 for one in shown.values())
    late = int(0.45 * len(swung.times))
    strains = np.hypot(shown["toe_strain"], shown["lead_strain"]) / 0.024
    assert strains[late] == pytest.approx(abs(bent[late]), abs=8e-3)


def test_a_servo_comes_late_and_cogs():
    times = np.linspace(0.0, 2.0, 1000)
    angle = 2.0 * (times / 2.0) ** 3 * (10 - 15 * times / 2 + 6 * (times / 2.0) ** 2)
    clock, played = play(times, {"arm": angle})
    assert np.diff(clock) == pytest.approx(1 / FEEDBACK)
    want = np.interp(clock, times, angle)
    lags = np.arange(0.0, 0.06, 1e-3)
    errors = [np.std(played["arm"] - np.interp(clock - lag, times, angle)) for lag in lags]
    assert 0.02 < lags[int(np.argmin(errors))] < 0.04
    assert played["arm"][-1] == pytest.approx(want[-1], abs=2e-3)
    assert 3e-4 < min(errors) < 5e-3
    # against an integration of the same loop
    omega, ratio = 2 * np.pi * 9.0, 0.8

    def rates(t, state):
        tug = 5.0 * np.sin(18.0 * state[0]) * np.tanh(abs(state[1]) / 0.05)
        goal = np.interp(t, times, angle)
        return [state[1], omega**2 * (goal - state[0]) - 2 * ratio * omega * state[1] + tug]

    found = solve_ivp(rates, (0.0, 2.0), [0.0, 0.0], "LSODA", clock[clock <= 2.0], max_step=1e-3)
    assert np.abs(found.y[0] - played["arm"][: found.y.shape[1]]).max() < 5e-4


def test_the_commands_write_swings_and_feedback(tmp_path, capsys):
    assert main(["swings", "--out", str(tmp_path / "a"), "--seed", "3", "--count", "1"]) == 0
    own = tmp_path / "a" / "golfer_1"
    assert {one.name for one in own.iterdir()} == {"gauges", "markers.csv", "markers.toml"}
    truth = json.loads((tmp_path / "a" / "golfer_1.truth.json").read_text())
    assert 30.0 < truth["clubhead_speed"] < 45.0 < truth["ball_speed"]
    profile = tmp_path / "profile.csv"
    rows = "\n".join(f"{0.01 * k},{0.001 * k},{-0.001 * k},0" for k in range(50))
    profile.write_text("time,arm_angle,wrist_angle,grip_angle\n" + rows)
    assert main(["feedback", "--profile", str(profile), "--out", str(tmp_path / "f.csv")]) == 0
    table = np.loadtxt(tmp_path / "f.csv", delimiter=",", skiprows=1)
    assert table.shape[1] == 3 and table[1, 0] == 0.004
    capsys.readouterr()
    assert main(["feedback", "--profile", str(tmp_path / "no"), "--out", str(tmp_path / "f")]) == 2
