"""The noise law: chosen rightly, honest on pure noise, and not fooled by errors of a model."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.signal import lfilter
from scipy.stats import kstest

from supple.identification import noise as noises
from supple.identification.noise import (
    Noise,
    choose_noise,
    colour_of,
    known_noise,
    ljung_box,
    periodogram,
    trust_of,
)

COUNT = 2000
TIMES = np.arange(COUNT)
PREDICTED = 20.0 * np.exp(-TIMES / 800) * np.cos(2 * np.pi * 0.031 * TIMES)
LAWS = {"white": (), "ar1": (0.8,), "ar2": (0.9, -0.4)}


def draw(phi: tuple[float, ...], seed: int, count: int = COUNT) -> np.ndarray:
    """Autoregressive noise of unit innovations, long under way."""
    white = np.random.default_rng(seed).standard_normal(count + 500)
    return np.asarray(lfilter([1.0], [1.0, *(-p for p in phi)], white))[500:]


@cache
def chosen(law: str, seed: int):
    return choose_noise(draw(LAWS[law], seed), PREDICTED)


@pytest.mark.parametrize("law", LAWS)
def test_the_right_order_is_chosen(law):
    found = [chosen(law, seed)[0].law for seed in range(20)]
    assert found.count(law) >= 18, found


@pytest.mark.parametrize("law", ["ar1", "ar2"])
def test_memory_and_size_are_recovered(law):
    right = [n for n, _ in (chosen(law, seed) for seed in range(20)) if n.law == law]
    table = np.array([[*n.coefficients, n.std] for n in right])
    truth = np.array([*LAWS[law], 1.0])
    assert np.mean(table, axis=0) == pytest.approx(truth, abs=0.02)
    few = np.sqrt(1.0 / COUNT)
    assert np.all(np.std(table, axis=0) < 2.5 * few)


@pytest.mark.parametrize("rho", [0.3, 0.6, 0.9])
def test_a_long_residual_is_pooled_without_loss(rho):
    values = draw((rho,), 3, 20000)
    found = colour_of(values)
    lag = float(values[1:] @ values[:-1] / (values @ values))
    error = np.sqrt((1 - rho**2) / len(values))
    assert found.coefficients[0] == pytest.approx(lag, abs=error)
    assert found.coefficients[0] == pytest.approx(rho, abs=4 * error)
    assert found.std == pytest.approx(1.0, abs=0.03)


def test_pooling_keeps_sums_and_leaves_short_ones_alone():
    frequency, power = periodogram(draw((0.5,), 1, 6000))
    pooled, mean, sizes = noises._pooled(frequency, power)
    assert len(mean) == noises.GROUPS and sizes.sum() == len(power)
    assert sizes @ mean == pytest.approx(power.sum())
    assert np.all(np.diff(pooled) > 0)
    same = noises._pooled(frequency[:300], power[:300])
    assert np.array_equal(same[1], power[:300]) and np.all(same[2] == 1)


def test_p_values_of_pure_noise_are_about_uniform():
    p_values = np.array([chosen(law, seed)[1].p_value for law in LAWS for seed in range(20)])
    assert kstest(p_values, "uniform").pvalue > 1e-3
    assert np.mean(p_values < 0.01) <= 0.05
    assert p_values.min() > 1e-4


@pytest.mark.parametrize("law", LAWS)
def test_a_large_error_where_the_model_moves_is_caught(law):
    residual = draw(LAWS[law], 5) + 0.4 * PREDICTED
    noise, misfit = choose_noise(residual, PREDICTED)
    assert misfit.p_value < 1e-12 and misfit.ratio > 3 and misfit.bins > 5
    truth = Noise(LAWS[law], 1.0).marginal_std
    assert noise.marginal_std == pytest.approx(truth, rel=0.25), "the error is not called noise"


@pytest.mark.parametrize("law", LAWS)
def test_whitened_noise_is_white_and_of_unit_size(law):
    values = draw(LAWS[law], 8)
    noise = Noise(LAWS[law], 1.0)
    white = noise.whiten(values)
    assert np.std(white) == pytest.approx(1.0, abs=0.06)
    assert ljung_box(white) > 1e-3
    assert law == "white" or ljung_box(values) < 1e-12
    assert noise.marginal_std == pytest.approx(np.std(values), rel=0.15)
    columns = noise.whiten(np.column_stack([values, 2 * values]))
    assert columns == pytest.approx(np.column_stack([white, 2 * white]))


@given(st.lists(st.floats(-4, 4), max_size=2))
def test_every_law_is_stationary_and_its_spectrum_holds_its_power(free):
    phi = noises.coefficients_of(noises._limited(np.array(free)))
    assert np.all(np.abs(np.roots([1.0, *(-p for p in phi)])) < 1)
    noise = Noise(phi, 0.7)
    circle = np.arange(20000) / 20000
    assert np.mean(noise.spectrum(circle)) == pytest.approx(noise.marginal_std**2, rel=1e-6)


@given(st.lists(st.floats(-0.97, 0.97), max_size=2))
def test_the_inverse_density_is_a_sum_of_waves_with_right_slopes(partial):
    frequency = np.linspace(0.01, 0.49, 25)
    turn = 2 * np.pi * frequency
    waves = np.array([np.ones_like(turn), np.cos(turn), np.cos(2 * turn)])
    partial = np.array(partial)
    parts, slopes = noises._inverse_parts(partial)
    law = Noise(noises.coefficients_of(partial), 1.0)
    assert parts @ waves == pytest.approx(1 / law.spectrum(frequency), rel=1e-9, abs=1e-12)
    for index in range(len(partial)):
        step = np.eye(len(partial))[index] * 1e-6
        ends = [noises._inverse_parts(partial + sign * step)[0] for sign in (1, -1)]
        assert slopes[:, index] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-7)


def test_the_law_is_the_most_likely_one():
    frequency, power = periodogram(draw((0.9, -0.4), 7) + 0.2 * PREDICTED)
    cost, law = noises._whittle(frequency, power, 2)
    grid = np.linspace(-0.9, 0.9, 37)
    others = [Noise(noises.coefficients_of((p, 0.5 * q)), 1.0) for p in grid for q in grid]
    pooled, mean, sizes = noises._pooled(frequency, power)
    densities = [other.spectrum(pooled) for other in (law, *others)]
    levels = [np.log(sizes @ (mean / one) / sizes.sum()) for one in densities]
    told = [
        sizes.sum() * level + sizes @ np.log(one)
        for level, one in zip(levels, densities, strict=True)
    ]
    assert told[0] == pytest.approx(cost)
    assert told[0] <= min(told) + 1e-6


def test_the_periodogram_of_white_noise_has_mean_one():
    frequency, power = periodogram(draw((), 2, 8000))
    assert np.mean(power) == pytest.approx(1.0, abs=0.05)
    assert 0 < frequency[0] < frequency[-1] < 0.5


def test_a_stated_noise_is_taken_at_its_word():
    residual = draw((0.8,), 4)
    truth = float(np.std(residual))
    noise, misfit = known_noise(residual, truth)
    assert noise.marginal_std == pytest.approx(truth, rel=0.05)
    assert misfit.ratio == pytest.approx(1.0, rel=0.05) and misfit.p_value > 1e-3
    loud, caught = known_noise(residual, truth / 2)
    assert loud.marginal_std == pytest.approx(truth / 2, rel=0.05)
    assert caught.ratio == pytest.approx(4.0, rel=0.1) and caught.p_value < 1e-12
    quiet, easy = known_noise(residual, 2 * truth)
    assert quiet.marginal_std == pytest.approx(truth, rel=0.05)
    assert easy.p_value > 0.999


def test_trust_falls_with_how_far_things_have_moved():
    values = PREDICTED[0] - PREDICTED + 0.01 * draw((), 6)
    trust = trust_of(values, len(values))
    assert np.all(np.diff(trust.std) >= 0)
    assert 0.008 < trust.std[0] < 0.02
    assert trust.std[-1] > 100 * trust.std[0]
    assert trust.whiten(values) == pytest.approx(values / trust.std)


def test_what_has_moved_before_its_first_sample_is_trusted_no_more_there():
    """A head that a told blow had thrown was taken for still, and its ringing for a start."""
    values = 3.0 + np.cos(0.2 * np.arange(400)) + 0.01 * draw((), 6, 400)
    still, moving = (trust_of(values, 100, moving).std for moving in (False, True))
    assert still[0] < 0.02 and moving[0] == pytest.approx(0.1, rel=0.2)
    assert moving[-1] == pytest.approx(0.1, rel=0.2)


def test_ljung_box_is_honest_and_awake():
    p_values = [ljung_box(draw((), seed, 500)) for seed in range(200)]
    assert kstest(p_values, "uniform").pvalue > 1e-3
    assert ljung_box(draw((0.4,), 1, 500)) < 1e-6
    assert ljung_box(np.zeros(50)) == 1.0


@pytest.mark.parametrize("count", [4, 8, 13, 17, 30])
def test_a_few_samples_are_enough_to_say_something(count):
    noise, misfit = choose_noise(draw((), 3, count), 5.0 * np.cos(np.arange(count)))
    assert 0.0 < noise.std < 10.0
    assert np.isfinite(misfit.ratio)
    assert 0.0 <= misfit.p_value <= 1.0
