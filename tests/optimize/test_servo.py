"""The robot's lag: found from its feedback, and taken out as fast as was stated."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.signal import cont2discrete, lfilter

from supple.optimize.profile import ROBO_V, SwingProfile, excess
from supple.optimize.servo import Feedback, correct_lag, lag_of
from supple.optimize.shape import rise

TIMES = np.linspace(0.0, 2.0, 1000)


def profile(rests=0.05):
    """A swing that rests first: what moves at once cannot be told earlier."""
    late = rise("minimum_jerk", TIMES - 0.9, 0.9)
    back = rise("minimum_jerk", TIMES - rests, 0.9 - rests)
    arm, wrist = -1.5 * back + 3.5 * late, -1.0 * back + 2.4 * late
    return SwingProfile(TIMES, arm, wrist, np.zeros(1000), 1.45)


def servo(told, delay=0.004, frequency=12.0, damping=0.75, noise=0.0, rate=250.0):
    """A servo of second order with a delay, sampled and rounded as a controller's feedback."""
    fine = np.arange(0.0, 2.4, 1e-4)
    w = 2 * np.pi * frequency
    made: Any = cont2discrete(([w * w], [1.0, 2 * damping * w, w * w]), 1e-4, "bilinear")
    moved = told.at(np.maximum(fine - delay, 0.0)).angles
    begin = moved[0]
    did = lfilter(np.ravel(made[0]), np.ravel(made[1]), moved - begin, axis=0) + begin
    times = np.arange(0.0, 2.3, 1.0 / rate)
    random = np.random.default_rng(5)
    seen = np.stack([np.interp(times, fine, did[:, axis]) for axis in range(3)], axis=1)
    return Feedback(times, seen + noise * random.standard_normal(seen.shape))


@settings(max_examples=10)
@given(st.floats(0.001, 0.02), st.floats(0.001, 0.02))
def test_a_lag_is_found_again(delay, constant):
    wanted = profile()
    fine = np.arange(-0.5, 2.5, 5e-4)
    dense = np.arange(-0.5, 2.5, 5e-5)
    told = wanted.at(dense - delay).angles[:, 1]
    share = 5e-5 / (constant + 5e-5)
    did = lfilter([share], [1.0, share - 1.0], told - told[0]) + told[0]
    found = lag_of("wrist", fine, wanted.at(fine).angles[:, 1], np.interp(fine, dense, did))
    assert found.delay + found.constant == pytest.approx(delay + constant, abs=1e-4)
    assert found.delay == pytest.approx(delay, abs=1e-3)


@pytest.mark.parametrize(("frequency", "damping"), [(12.0, 0.75), (6.0, 0.5)])
def test_rounds_shrink_the_error_at_least_as_was_stated(frequency, damping):
    wanted = profile()
    told, seen = wanted, []
    for _ in range(4):
        heard = servo(told, frequency=frequency, damping=damping)
        seen.append(correct_lag(wanted, told, heard))
        told = seen[-1].profile
    assert seen[0].error > np.radians(9.0) and seen[0].contraction < 0.03
    assert seen[1].error < 0.05 * seen[0].error and seen[2].error < 0.5 * seen[1].error
    assert seen[3].error < np.radians(0.05)
    sizes = [np.sqrt(np.mean(one.errors**2)) for one in seen]
    for one, before, after in zip(seen, sizes, sizes[1:]):
        assert one.converges and "converges" in one.sentence
        assert after <= 1.05 * one.contraction * before


def test_a_command_begins_and_ends_at_rest_where_the_swing_begins_at_once():
    wanted = profile(rests=0.0)
    done = correct_lag(wanted, wanted, servo(wanted))
    assert done.error > np.radians(9.0)
    ends = done.profile.at(np.array([0.0, wanted.time[-1]]))
    assert np.abs(done.profile.angles[[0, -1]] - wanted.angles[[0, -1]]).max() < 1e-6
    assert np.abs(ends.accelerations).max() < 20.0
    most = max(one.ratio for one in excess(done.profile, ROBO_V) if np.isfinite(one.limit))
    assert most < 1.0
    again = correct_lag(wanted, done.profile, servo(done.profile))
    assert again.error < 0.02 * done.error


def test_noise_of_the_feedback_does_not_grow_from_round_to_round():
    wanted = profile()
    told = wanted
    for _ in range(5):
        told = correct_lag(wanted, told, servo(told, noise=1e-5)).profile
    did = servo(told).angles
    at = servo(told).times
    assert np.abs(did - wanted.at(at).angles)[at < 2.0].max() < np.radians(0.2)


def test_a_servo_that_leads_is_said_not_to_converge():
    wanted = profile()
    heard = servo(wanted)
    turned = Feedback(heard.times, 2.0 * wanted.angles[0] - heard.angles)
    done = correct_lag(wanted, wanted, turned)
    assert done.worst > 1.0 and "need not converge" in done.sentence


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: Feedback(f.times[:200], f.angles[:200]), "the whole swing"),
        (lambda f: Feedback(f.times, f.angles[:, :2]), "shape"),
        (lambda f: Feedback(f.times[::-1], f.angles), "ascending"),
    ],
)
def test_a_fault_of_the_feedback_is_named(change, words):
    wanted = profile()
    with pytest.raises(ValueError, match=words):
        correct_lag(wanted, wanted, change(servo(wanted)))


def test_a_corner_above_what_the_feedback_shows_is_refused():
    wanted = profile()
    with pytest.raises(ValueError, match="lower it"):
        correct_lag(replace(wanted), wanted, servo(wanted), corner=120.0)
