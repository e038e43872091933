"""The thesis's old way and the smooth one: what is kept, how the ends begin, and what is heard."""

import math

import numpy as np
import pytest

from supple.optimize.profile import ROBO_V, excess
from supple.optimize.smooth import Smoothing, Track, make_profile, spectrum
from tests.lab.golfer import motion

IMPACT = 1.4873


def track(rate=400.0, noise=0.0, blow=0.0, seed=0) -> Track:
    times = np.arange(int(2.3 * rate)) / rate
    rough = noise * np.random.default_rng(seed).normal(size=(len(times), 3))
    return Track(times, motion(times, IMPACT, blow) + rough, IMPACT, 1.1)


def truth(times):
    return motion(np.atleast_1d(times), IMPACT)


@pytest.mark.parametrize(("method", "most"), [("smooth", 0.02), ("thesis", 0.3)])
def test_the_pose_at_impact_is_the_golfers(method, most):
    made = make_profile(track(), Smoothing(method))
    profile = made.profile
    assert len(profile.time) == 1000 and profile.time[0] == 0.0
    assert profile.impact_time == pytest.approx(IMPACT - made.start)
    off = profile.at(np.array([profile.impact_time])).angles[0] - truth(IMPACT)[0]
    assert np.max(np.abs(np.degrees(off))) < most
    assert np.allclose(off, made.at_impact[0], atol=2e-5)
    speed = (truth(IMPACT + 1e-5) - truth(IMPACT - 1e-5))[0] / 2e-5
    assert np.allclose(made.at_impact[1] + speed, profile.at(np.array([profile.impact_time]))
                       .velocities[0], atol=0.02)  # fmt: skip


@pytest.mark.parametrize("method", ["smooth", "thesis"])
def test_it_starts_and_ends_at_rest(method):
    made = make_profile(track(), Smoothing(method), quantum=0.0)
    profile = made.profile
    fastest = np.max(np.abs(profile.at(profile.time).velocities), axis=0)
    step = profile.time[1]
    for few in (profile.read_angles[:2], profile.read_angles[-2:]):
        assert np.all(np.abs(np.diff(few, axis=0)) / step < 0.02 * fastest)


def test_the_thesis_cuts_45_and_90_degrees_and_ramps_the_velocity_linearly():
    made = make_profile(track(), Smoothing("thesis"), quantum=0.0)
    begin, end = made.kept
    arm = truth(made.track.times)[:, 0]
    assert abs(truth(begin)[0, 0] - arm[0]) == pytest.approx(math.pi / 4, abs=0.03)
    assert abs(truth(end)[0, 0] - arm[-1]) == pytest.approx(math.pi / 2, abs=0.04)
    assert made.points == len(range(round(400 * begin), round(400 * end) + 1, 8)) + (
        (round(400 * end) - round(400 * begin)) % 8 >= 4
    )
    # the arm turns by 45 degrees while it speeds up evenly
    profile = made.profile
    first = profile.phases["measured"]
    early = profile.at(np.array([0.25, 0.5, 0.75]) * first)
    speed = profile.at(np.array([first])).velocities[0]
    assert np.allclose(early.velocities, np.outer([0.25, 0.5, 0.75], speed), rtol=2e-3, atol=1e-3)
    whole = profile.at(np.array([0.0, first])).angles[:, 0]
    assert abs(whole[1] - whole[0]) == pytest.approx(math.pi / 4, rel=1e-3)
    last = profile.phases["crop"]
    rest = profile.at(np.array([last, profile.time[-1]])).angles[:, 0]
    assert abs(rest[1] - rest[0]) == pytest.approx(math.pi / 2, rel=1e-3)


def test_exponential_ends_meet_the_velocity_that_was_measured():
    made = make_profile(track(), Smoothing(cutoff=200.0), quantum=0.0)
    first, speed = made.profile.phases["measured"], 0.0
    measured = (truth(made.kept[0] + 1e-5) - truth(made.kept[0] - 1e-5))[0] / 2e-5
    speed = made.profile.at(np.array([first])).velocities[0]
    assert np.allclose(speed, measured, rtol=0.01, atol=0.01)
    share = np.array([0.3, 0.6, 0.9])
    grown = np.exp(5 * share) - 1 - 5 * share
    early = made.profile.at(share * first).velocities
    wanted = np.outer(grown / (math.exp(5) - 6), measured)
    assert np.allclose(early, wanted, rtol=0.02, atol=0.01)


def test_points_are_dense_near_impact_alone():
    how = Smoothing(begin=0.8, end=0.4, dense=0.05, every=8)
    made = make_profile(track(), how)
    assert made.kept[0] == pytest.approx(IMPACT - 0.8, abs=0.0026)
    assert made.kept[1] == pytest.approx(IMPACT + 0.4, abs=0.0026)
    all_points = 1.2 * 400
    assert made.points == pytest.approx(all_points / 8 + 0.1 * 400 * 7 / 8, abs=4)
    sparse = make_profile(track(blow=12.0), Smoothing(dense=0.0, cutoff=150.0))
    dense = make_profile(track(blow=12.0), Smoothing(dense=0.05, cutoff=150.0))
    assert dense.near[1] < 0.7 * sparse.near[1]


def test_the_filter_takes_what_lies_above_its_edge_and_leaves_what_lies_below():
    quiet, rough = track(), track(noise=1e-3)
    made = make_profile(rough, Smoothing(cutoff=15.0), quantum=0.0)
    heard = spectrum(made)
    assert np.all(heard.above(25.0) < 0.02)
    low = (heard.frequencies > 0) & (heard.frequencies < 6.0)
    clean = spectrum(make_profile(quiet, Smoothing(cutoff=15.0), quantum=0.0))
    assert np.allclose(heard.after[low][:, :2], clean.before[low][:, :2], rtol=0.25, atol=0.6)
    old = make_profile(rough, Smoothing("thesis"), quantum=0.0)
    late = (spectrum(old).frequencies > 20.0) & (spectrum(old).frequencies < 60.0)
    assert np.all(np.sum(heard.after[late], 0) < 0.2 * np.sum(spectrum(old).after[late], 0))


def test_a_tone_is_heard_at_its_frequency_with_its_amplitude():
    clear = track()
    tone = 2e-3 * np.sin(2 * np.pi * 60.0 * clear.times)[:, None] * [1.0, 0.5, 0.0]
    heard = spectrum(make_profile(Track(clear.times, clear.angles + tone, IMPACT)))
    at = np.argmin(np.abs(heard.frequencies - 60.0))
    size = 2e-3 * (2 * 400 * math.sin(math.pi * 60 / 400)) ** 2
    assert heard.before[at, 0] == pytest.approx(size, rel=0.2)
    assert heard.before[at, 1] == pytest.approx(size / 2, rel=0.2)
    assert heard.after[at, 0] < 0.01 * size


def test_rest_stays_where_it_is_under_the_filter():
    made = make_profile(track(), Smoothing(), quantum=0.0)
    wide = make_profile(track(), Smoothing(cutoff=200.0), quantum=0.0)
    ends = made.profile.read_angles[[0, -1]] - wide.profile.read_angles[[0, -1]]
    assert np.max(np.abs(np.degrees(ends))) < 0.02


def test_a_swing_time_stretches_everything():
    made = make_profile(track(), quantum=0.0)
    slow = make_profile(track(), quantum=0.0, swing_time=2 * made.profile.time[-1])
    assert np.allclose(slow.profile.read_angles, made.profile.read_angles)
    assert slow.profile.impact_time == pytest.approx(2 * made.profile.impact_time)
    assert slow.profile.phases["top"] == pytest.approx(2 * made.profile.phases["top"])
    assert np.allclose(slow.at_impact[0], made.at_impact[0], atol=1e-9)
    velocities = [
        one.profile.at(np.array([one.profile.impact_time])).velocities for one in (made, slow)
    ]
    assert np.allclose(velocities[0], 2 * velocities[1], rtol=1e-9)
    assert np.allclose(spectrum(slow).after, spectrum(made).after, atol=1e-6)


def test_the_smooth_way_asks_less_of_the_motors_than_the_old():
    rough = track(noise=1e-3, blow=4.0)
    jerk = {
        method: [use.ratio for use in excess(make_profile(rough, Smoothing(method)).profile, ROBO_V)
                 if use.quantity == "jerk"][:2]
        for method in ("smooth", "thesis")
    }  # fmt: skip
    assert np.all(np.array(jerk["smooth"]) < 0.6 * np.array(jerk["thesis"]))


@pytest.mark.parametrize(
    ("how", "word"),
    [
        (Smoothing(begin=-0.2, end=0.5), "impact within"),
        (Smoothing(begin=0.02, end=0.02), "frames to keep"),
        (Smoothing(cutoff=400.0), "Hz"),
        (Smoothing("thesis", begin=1.4), "degrees/s"),
    ],
)
def test_what_cannot_be_made_is_said_in_words(how, word):
    with pytest.raises(ValueError, match=word):
        make_profile(track(), how)
