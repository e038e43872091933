"""The classic motions: closed forms, limits, and what they leave of a vibration."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp

from supple.optimize.shape import SHAPES, rise, s_curve


def left_over(bend, end, w, damping, breaks=()):
    """Amplitude that a clamped oscillator shows after its base has moved, by integration [m]."""

    def field(t, state):
        x, v = state
        return [v, -2 * damping * w * v - w * w * x - bend(t)]

    state, marks = [0.0, 0.0], sorted({0.0, *breaks, end})
    for start, stop in pairwise(marks):
        inside = lambda t, y, a=start, b=stop: field(min(max(t, a + 1e-12), b - 1e-12), y)  # noqa: E731
        state = solve_ivp(inside, (start, stop), state, "DOP853", rtol=1e-10, atol=1e-13).y[:, -1]
    x, v = state
    return math.hypot(x, (v + damping * w * x) / (w * math.sqrt(1 - damping**2)))


def curve(shape: Any, end, order):
    """A derivative of a motion at one instant."""
    return lambda t: rise(shape, np.array([t]), end, order)[0]


@pytest.mark.parametrize("shape", SHAPES)
def test_every_motion_goes_from_rest_at_0_to_rest_at_1(shape):
    times = np.array([-1.0, 0.0, 2.0, 5.0])
    assert np.allclose(rise(shape, times, 2.0), [0, 0, 1, 1], atol=1e-12)
    middle = rise(shape, np.array([1.0]), 2.0)
    assert middle == pytest.approx(0.5)
    early = rise(shape, np.array([0.3, 0.7]), 2.0)
    assert np.allclose(early, 1 - rise(shape, np.array([1.7, 1.3]), 2.0))
    if shape != "instantaneous":
        ends = rise(shape, np.array([0.0, 2.0]), 2.0, 1)
        assert np.allclose(ends, 0, atol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_those_of_finite_differences(shape, order):
    times, h = np.array([0.11, 0.4, 0.66, 1.02, 1.39]), 1e-5
    steps = [rise(shape, times + k * h, 1.5, order - 1) for k in (-1, 1)]
    assert np.allclose(rise(shape, times, 1.5, order), (steps[1] - steps[0]) / (2 * h), rtol=1e-7,
                       atol=1e-6)  # fmt: skip


def test_torques_start_as_they_are_told():
    start = np.array([0.0])
    assert rise("square", start, 1.0, 2)[0] == 4.0
    assert rise("half_sine", start, 1.0, 2)[0] == pytest.approx(math.pi**2 / 2)
    for gentle in ("suppressed_half_sine", "minimum_jerk", "s_curve"):
        assert rise(gentle, start, 1.0, 2)[0] == pytest.approx(0.0, abs=1e-12)


def test_no_motion_has_less_jerk_than_minimum_jerk_where_acceleration_starts_at_rest():
    times = (np.arange(20000) + 0.5) / 20000
    costs = {
        shape: np.mean(rise(shape, times, 1.0, 3) ** 2)
        for shape in SHAPES
        if shape in ("suppressed_half_sine", "minimum_jerk", "s_curve")
    }
    assert costs["minimum_jerk"] == pytest.approx(720.0, rel=1e-6)
    assert min(costs, key=lambda shape: costs[shape]) == "minimum_jerk"


# What is left of an undamped vibration: |integral of a exp(i w t)| / w, by hand.
FORMS = {
    "square": lambda w, T: 16 / (T * w) ** 2 * math.sin(w * T / 4) ** 2,
    "half_sine": lambda w, T: abs(
        math.pi**2 / T**2 * math.cos(w * T / 2) / (w**2 - (math.pi / T) ** 2)
    ),
    "suppressed_half_sine": lambda w, T: abs(
        8 * math.pi**2 / T**3 * math.sin(w * T / 2) / (w * (w**2 - (2 * math.pi / T) ** 2))
    ),
    "s_curve": lambda w, T: 256 / (T * w) ** 3 * abs(
        math.sin(w * T / 8) ** 2 * math.sin(w * T / 4)
    ),
}  # fmt: skip


@pytest.mark.parametrize("shape", FORMS)
@pytest.mark.parametrize("duration", [0.21, 0.4, 0.77])
def test_what_is_left_of_a_vibration_is_its_closed_form(shape, duration):
    w = 2 * math.pi * 4.0
    found = left_over(
        curve(shape, duration, 2), duration, w, 0.0,
        [duration * k / 4 for k in (1, 2, 3)],
    )  # fmt: skip
    assert found == pytest.approx(FORMS[shape](w, duration), rel=1e-6)


def test_whole_periods_leave_nothing_and_the_spectrum_says_which():
    w = 2 * math.pi * 4.0
    for shape, periods in (("square", 2), ("half_sine", 1.5), ("suppressed_half_sine", 2),
                           ("s_curve", 2)):  # fmt: skip
        end = periods / 4.0
        quiet = left_over(
            curve(shape, end, 2), end, w, 0.0,
            [end * k / 4 for k in (1, 2, 3)],
        )  # fmt: skip
        assert quiet < 1e-8, shape


@settings(max_examples=80, deadline=None)
@given(
    st.floats(0.01, 10.0), st.floats(0.1, 50.0), st.floats(0.5, 1000.0), st.floats(5.0, 1e5),
    st.booleans(),
)  # fmt: skip
def test_the_s_curve_keeps_its_limits_and_always_uses_one(
    distance, velocity, acceleration, jerk, back
):
    curve = s_curve(-distance if back else distance, velocity, acceleration, jerk)
    end = curve.x[-1]
    assert curve(end) == pytest.approx(-distance if back else distance, rel=1e-9)
    scale = {1: velocity, 2: acceleration, 3: jerk}
    middles = (curve.x[1:] + curve.x[:-1]) / 2
    dense = np.sort(np.concatenate([curve.x[:-1] + 1e-12 * end, middles]))
    for order, most in scale.items():
        assert np.max(np.abs(curve(dense, order))) <= most * (1 + 1e-6)
    assert abs(curve(end, 1)) < 1e-6 * velocity and abs(curve(end, 2)) < 1e-5 * acceleration
    full = [np.abs(curve(middles, order)) > most * (1 - 1e-6) for order, most in scale.items()]
    assert np.all(np.logical_or.reduce(full))  # which makes it the quickest
    if len(middles) == 7:
        assert end == pytest.approx(
            distance / velocity + velocity / acceleration + acceleration / jerk, rel=1e-9
        )


def test_numbers_out_of_range_are_refused_in_words():
    with pytest.raises(ValueError, match="one of instantaneous"):
        rise("saw", np.zeros(1), 1.0)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="more than 0 s"):
        rise("square", np.zeros(1), 0.0)
    for wrong in ((0.0, 1.0, 1.0, 1.0), (1.0, 0.0, 1.0, 1.0), (1.0, 1.0, 1.0, math.inf)):
        with pytest.raises(ValueError, match="S-curve"):
            s_curve(*wrong)
