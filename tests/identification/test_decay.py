"""First looks at ring-downs: frequency, damping, rest, and when the hand let go."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from supple.identification.decay import free_from, glance

RATE = 200.0
TIMES = np.arange(3000) / RATE


def ring_down(frequency: float, ratio: float, rest: float = 0.0) -> np.ndarray:
    omega = 2 * np.pi * frequency
    damped = omega * np.sqrt(1 - ratio**2)
    return rest + np.exp(-ratio * omega * TIMES) * np.cos(damped * TIMES)


@pytest.mark.parametrize("frequency", [1.0, 3.3, 11.7])
@pytest.mark.parametrize("ratio", [0.003, 0.01, 0.03])
def test_frequency_and_damping_of_a_ring_down(frequency, ratio):
    seen = glance(ring_down(frequency, ratio, rest=0.4), RATE)
    assert seen.frequency == pytest.approx(frequency, rel=0.01)
    assert seen.damping_ratio == pytest.approx(ratio, rel=0.15)
    assert seen.rest == pytest.approx(0.4, abs=0.05)
    assert seen.amplitude == pytest.approx(1.0, abs=0.06)


@given(size=st.floats(1e-6, 1e6), level=st.floats(-10, 10))
def test_size_and_level_change_neither_frequency_nor_damping(size, level):
    values = ring_down(2.2, 0.01)
    seen = glance(size * (values + level), RATE)
    plain = glance(values, RATE)
    assert seen.frequency == pytest.approx(plain.frequency, rel=1e-6)
    assert seen.damping_ratio == pytest.approx(plain.damping_ratio, rel=1e-4)
    assert seen.amplitude == pytest.approx(size * plain.amplitude, rel=1e-6)


def test_noise_hardly_moves_the_look():
    rng = np.random.default_rng(1)
    values = ring_down(2.2, 0.01) + 0.05 * rng.standard_normal(len(TIMES))
    seen = glance(values, RATE)
    assert seen.frequency == pytest.approx(2.2, rel=0.01)
    assert 0.005 < seen.damping_ratio < 0.03


def test_nothing_that_swings_is_said_to_be_nothing():
    flat = np.full(500, 3.0)
    seen = glance(flat, RATE)
    assert (seen.frequency, seen.damping_ratio, seen.amplitude) == (0.0, 0.0, 0.0)
    assert free_from(flat, RATE) == 0


def test_a_hand_that_holds_and_lets_go_is_cut_off():
    hold = 300
    held = np.concatenate([np.full(hold, 1.0), ring_down(2.0, 0.005)])
    quarter = RATE / 2.0 / 4.0
    assert free_from(held, RATE) == pytest.approx(hold + quarter, abs=3)


def test_a_swing_seen_from_its_first_crossing_starts_there():
    sine = np.sin(2 * np.pi * 2.0 * (TIMES + 1e-3)) * np.exp(-0.05 * TIMES)
    start = free_from(sine, RATE)
    assert start == pytest.approx(RATE / 2.0 / 2.0, abs=3), "first crossing after the first peak"
    assert abs(sine[start]) < 0.1
