"""Input shapers: conditions in closed form, published widths, and simulated vibrations."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.optimize.shape import rise
from supple.optimize.shaper import Shaper, combined, ei, two_hump_ei, zv, zvd
from tests.optimize.test_shape import left_over

ALL = (zv, zvd, ei, two_hump_ei)
MODE = 2.79, 0.16  # the club's slow mode on a flexible wrist, Hz and damping ratio


def vector(shaper, frequency, damping):
    """The residual by C and S, term by term."""
    w = 2 * math.pi * frequency
    wd = w * math.sqrt(1 - damping**2)
    grown = shaper.amplitudes * np.exp(damping * w * shaper.times)
    c = np.sum(grown * np.cos(wd * shaper.times))
    s = np.sum(grown * np.sin(wd * shaper.times))
    return math.exp(-damping * w * shaper.times[-1]) * math.hypot(c, s)


@pytest.mark.parametrize("make", ALL)
@pytest.mark.parametrize("damping", [0.0, 0.02, 0.16, 0.3])
def test_impulses_are_shares_in_order_that_add_up(make, damping):
    shaper = make(4.0, damping)
    assert shaper.times[0] == 0.0 and np.all(np.diff(shaper.times) > 0)
    assert np.all(shaper.amplitudes > 0) and shaper.amplitudes.sum() == pytest.approx(1.0)
    assert shaper.duration == shaper.times[-1]


@settings(max_examples=40, deadline=None)
@given(st.floats(0.5, 30.0), st.floats(0.0, 0.3), st.floats(0.3, 2.0), st.integers(0, 1))
def test_the_residual_is_c_and_s(frequency, damping, ratio, which):
    shaper = (zv, zvd)[which](frequency, damping)
    found = shaper.residual(np.array([ratio * frequency]), damping)[0]
    assert found == pytest.approx(vector(shaper, ratio * frequency, damping), rel=1e-9, abs=1e-12)


def test_undamped_shapers_are_the_textbook_ones():
    assert np.allclose(zv(4.0).amplitudes, [0.5, 0.5]) and zv(4.0).times[1] == 0.125
    assert np.allclose(zvd(4.0).amplitudes, [0.25, 0.5, 0.25])
    assert np.allclose(ei(4.0).amplitudes, [0.2625, 0.475, 0.2625])
    x = (0.05**2 * (math.sqrt(1 - 0.05**2) + 1)) ** (1 / 3)
    first = (3 * x**2 + 2 * x + 3 * 0.05**2) / (16 * x)
    assert np.allclose(two_hump_ei(4.0).amplitudes, [first, 0.5 - first, 0.5 - first, first])
    assert np.allclose(two_hump_ei(4.0).times, np.arange(4) / 8)


def test_widths_at_five_percent_are_the_published_ones():
    widths = [make(4.0).insensitivity(4.0) for make in ALL]
    assert np.allclose(widths, [0.0637, 0.2871, 0.3995, 0.7245], atol=2e-4)
    assert zv(4.0).insensitivity(5.0) == 0.0


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.16, 0.3])
def test_conditions_hold_at_the_frequency_and_beside_it(damping):
    def at(shaper, ratio):
        return vector(shaper, 4.0 * ratio, damping)

    assert at(zv(4.0, damping), 1.0) < 1e-12
    assert at(zvd(4.0, damping), 1.0) < 1e-12
    assert abs(at(zvd(4.0, damping), 1.0001)) < 1e-6  # no slope either
    ratios = np.linspace(0.5, 1.8, 9001)
    for make, level in ((ei, 0.05), (ei, 0.12), (two_hump_ei, 0.05)):
        shaper = make(4.0, damping, level)
        left = np.array([at(shaper, ratio) for ratio in ratios])
        zeros = ratios[1:-1][(left[1:-1] < left[:-2]) & (left[1:-1] < left[2:])]
        zeros = zeros[np.interp(zeros, ratios, left) < 1e-3]
        inside = left[(ratios > zeros[0]) & (ratios < zeros[-1])]
        assert inside.max() == pytest.approx(level, abs=1e-5)
        humps = np.sum((inside[1:-1] > inside[:-2]) & (inside[1:-1] >= inside[2:]))
        assert (humps, len(zeros)) == ((1, 2) if make is ei else (2, 3))
        nominal = at(shaper, 1.0)
        assert nominal == pytest.approx(level if make is ei else 0.0, abs=1e-9)


@pytest.mark.parametrize("make", ALL)
@pytest.mark.parametrize("off", [0.9, 1.0, 1.1])
def test_a_simulated_oscillator_keeps_the_share_that_the_formula_says(make, off):
    frequency, damping = MODE
    shaper, end = make(frequency, damping), 0.31
    w = 2 * math.pi * frequency * off

    def bend(t):
        return rise("minimum_jerk", np.atleast_1d(t), end, 2)

    plain = left_over(lambda t: bend(t)[0], end, w, damping)
    marks = sorted([*shaper.times, *(shaper.times + end)])
    shaped = left_over(
        lambda t: float(shaper.shaped(bend, np.array([t]))[0]), end + shaper.duration, w, damping,
        [mark for mark in marks if mark < end + shaper.duration],
    )  # fmt: skip
    share = shaper.residual(np.array([frequency * off]), damping)[0]
    assert shaped / plain == pytest.approx(share, rel=1e-5, abs=1e-8)


def test_a_shaped_motion_ends_where_the_motion_ends_later_by_the_shaper():
    shaper, times = zvd(*MODE), np.linspace(-0.2, 2.0, 300)
    shaped = shaper.shaped(lambda t: rise("minimum_jerk", t, 0.5), times)
    assert np.all(shaped[times >= 0.5 + shaper.duration] == pytest.approx(1.0))
    assert np.all(shaped[times <= 0] == 0.0) and np.all(np.diff(shaped) >= -1e-15)


def test_several_modes_are_silenced_by_the_convolution_of_their_shapers():
    modes = ((2.79, 0.16), (9.5, 0.03), (31.0, 0.01))
    parts = [make(*mode) for make, mode in zip((zvd, zv, zvd), modes)]
    whole = combined(parts)
    assert whole.amplitudes.sum() == pytest.approx(1.0)
    assert whole.duration == pytest.approx(sum(part.duration for part in parts))
    assert len(whole.times) == 3 * 2 * 3
    for frequency, damping in modes:
        assert vector(whole, frequency, damping) < 1e-10
        product = np.prod([vector(part, 6.0, 0.05) for part in parts])
        assert vector(whole, 6.0, 0.05) == pytest.approx(product, rel=1e-9)
    motion = lambda t: rise("half_sine", t, 0.7)  # noqa: E731
    times = np.linspace(0, 2, 50)
    twice = parts[1].shaped(lambda t: parts[0].shaped(motion, t), times)
    assert np.allclose(combined(parts[:2]).shaped(motion, times), twice)


def test_impulses_at_one_instant_are_one():
    whole = combined([zv(4.0), zv(4.0)])
    assert np.allclose(whole.times, zvd(4.0).times)
    assert np.allclose(whole.amplitudes, zvd(4.0).amplitudes)


def test_a_shaper_of_another_frequency_is_found_out():
    wrong = zv(5.0)
    assert vector(wrong, 4.0, 0.0) == pytest.approx(abs(math.cos(math.pi / 2 * 0.8)))
    assert Shaper(np.zeros(1), np.ones(1)).residual(np.array([4.0]))[0] == pytest.approx(1.0)


def test_numbers_out_of_range_are_refused_in_words():
    with pytest.raises(ValueError, match="frequency above 0 Hz"):
        zv(0.0)
    with pytest.raises(ValueError, match="damping ratio"):
        zvd(4.0, 1.0)
    with pytest.raises(ValueError, match="level between"):
        ei(4.0, 0.0, 0.7)
    with pytest.raises(ValueError, match="at most"):
        two_hump_ei(4.0, 0.6)
    with pytest.raises(ValueError, match="at least one"):
        combined([])
