"""Feed-forward: the club follows within a tolerance, and exact following is impossible."""

from dataclasses import replace

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.feedforward import (
    CANNOT,
    FOLLOWS,
    RAN_AWAY,
    Tolerance,
    course_of,
    curve,
    follow,
    inverse_zeros,
    subtracted,
    untreated,
)
from supple.optimize.profile import AxisLimits, SwingProfile
from supple.optimize.shape import rise
from supple.optimize.swing_check import play
from supple.optimize.task import Impact
from tests.optimize.swing_tasks import RIG

TIMES = np.linspace(0.0, 2.0, 501)
HIT = 1.553


def golfer():
    """A smooth swing that passes the ball with about 30 m/s of a rigid club."""
    late, back = rise("minimum_jerk", TIMES - 1.1, 0.9), rise("minimum_jerk", TIMES, 1.1)
    arm, wrist = -2.6 * back + 5.2 * late, -1.5 * back + 3.0 * late
    return SwingProfile(TIMES, arm, wrist, np.zeros(501), HIT)


@pytest.fixture(scope="module")
def rigs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rigs")
    for fidelity in ("thesis", "planar"):
        (folder / f"{fidelity}.toml").write_text(RIG.format(fidelity=fidelity))
    return {name: read_rig(folder / f"{name}.toml") for name in ("thesis", "planar")}


@pytest.fixture(scope="module")
def courses(rigs):
    return {hold: course_of(golfer(), rigs["thesis"], hold) for hold in ("grip", "chord")}


@pytest.mark.parametrize("hold", ["grip", "chord"])
def test_the_club_follows_within_the_tolerance_and_the_drive_ends_at_rest(courses, hold):
    course, limit = courses[hold], Tolerance()
    plain, found = untreated(course), follow(course)
    assert plain.window_error > np.radians(4.0) and plain.status == CANNOT
    assert found.status == FOLLOWS
    assert abs(found.impact_error) <= limit.impact and found.window_error <= limit.before
    end = found.profile.at(TIMES[-1:])
    assert np.abs(end.velocities).max() < 1e-6 and np.abs(end.accelerations).max() < 0.1
    assert end.angles[0, 1] == pytest.approx(golfer().wrist_angle[-1], abs=1e-6)
    assert np.abs(found.profile.arm_angle - golfer().arm_angle).max() < 1e-12


@pytest.mark.parametrize("fidelity", ["thesis", pytest.param("planar", marks=pytest.mark.slow)])
def test_the_model_alone_says_the_same_of_the_drive(rigs, fidelity):
    course = course_of(golfer(), rigs[fidelity])
    found = follow(course)
    played = play(found.profile, rigs[fidelity], Impact(HIT, 0.0, 0.0, 30.0))
    angle = played.states[0, played.hit, 0] + played.states[0, played.hit, 2]
    wanted = golfer().at(np.array([HIT])).angles[0, :2].sum()
    assert found.status == FOLLOWS
    assert np.degrees(abs(angle - wanted)) <= 0.051


def test_a_tolerance_that_is_narrower_makes_the_drive_rougher(courses):
    found = curve(courses["grip"], shares=(0.2, 1.0, 5.0, 25.0))
    rough = [one.roughness for one in found]
    assert all(one.status == FOLLOWS for one in found)
    assert rough == sorted(rough, reverse=True) and rough[0] > 1.02 * rough[-1]


def test_subtracting_the_error_again_and_again_roughens_and_does_not_converge(courses):
    found = subtracted(courses["grip"], 4)
    assert len(found) == 5 or found[-1].status == RAN_AWAY
    assert min(one.window_error for one in found) > np.radians(1.0)
    assert found[-1].roughness > 20.0 * found[0].roughness
    assert follow(courses["grip"]).roughness < 3.0


def test_exact_following_has_unstable_poles_where_the_shaft_alone_swings(rigs):
    grip, chord = inverse_zeros(rigs["thesis"]), inverse_zeros(rigs["thesis"], "chord")
    assert grip[0].real == pytest.approx(0.54, abs=0.01)
    assert abs(grip[0].imag) == pytest.approx(27.28, abs=0.02)
    assert np.real(chord).max() < -19.0
    numbers = {name: one.value for name, one in rigs["thesis"].parameters.items()}
    alone = np.sqrt(numbers["shaft_stiffness"] / numbers["clubhead_mass"])
    assert abs(grip[0].imag) == pytest.approx(alone, rel=0.1)


def test_the_motors_limits_are_kept_or_it_is_said_that_the_club_cannot_follow(rigs):
    free = follow(course_of(golfer(), rigs["thesis"]))
    speed = np.abs(free.profile.at(TIMES).velocities[:, 1]).max()
    wide = course_of(golfer(), rigs["thesis"], limits=AxisLimits(velocity=1.001 * speed))
    narrow = course_of(golfer(), rigs["thesis"], limits=AxisLimits(velocity=0.5 * speed))
    assert follow(wide).status == FOLLOWS
    found = follow(narrow)
    assert found.status == CANNOT and "does not follow" in found.sentence


def test_a_pose_that_no_club_has_is_refused(rigs):
    with pytest.raises(ValueError, match="name what is to follow"):
        course_of(golfer(), rigs["thesis"], "drive")


@pytest.mark.slow
@pytest.mark.parametrize("hold", ["grip", "chord"])
def test_the_club_follows_in_the_plane_with_the_ball(rigs, hold):
    ball = Impact(HIT, 0.0, 0.0, 30.0, force=-1000.0)
    course = course_of(replace(golfer()), rigs["planar"], hold, ball)
    found = follow(course)
    assert found.status == FOLLOWS and abs(found.impact_error) <= Tolerance().impact
