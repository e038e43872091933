"""The backbone against decays whose frequency and damping are known in closed form."""

import numpy as np
import pytest

from supple.identification.backbone import backbone, counted_change


def decay(frequency, ratio, *, offset=0.0, noise=0.0, seconds=20.0, rate=500.0):
    times = np.arange(0.0, seconds, 1.0 / rate)
    angular = 2.0 * np.pi * frequency
    values = np.exp(-ratio * angular * times) * np.cos(angular * np.sqrt(1 - ratio**2) * times)
    return times, values + offset + noise * np.random.default_rng(1).normal(size=len(times))


@pytest.mark.parametrize(("frequency", "ratio"), [(1.3, 0.01), (4.0, 0.003), (12.0, 0.02)])
def test_a_linear_decay_has_a_straight_backbone(frequency, ratio):
    found = backbone(*decay(frequency, ratio, offset=0.7))
    assert len(found.amplitude) >= 4
    assert np.all(np.diff(found.amplitude) < 0)
    np.testing.assert_allclose(found.frequency, frequency, rtol=2e-3)
    np.testing.assert_allclose(found.damping_ratio[1:], ratio, rtol=0.05)


def test_noise_moves_the_backbone_little_and_ends_it():
    noise = 0.01
    found = backbone(*decay(3.0, 0.01, noise=noise), noise=noise)
    assert found.amplitude.min() > 3.0 * noise
    np.testing.assert_allclose(found.frequency, 3.0, rtol=0.02)
    np.testing.assert_allclose(np.median(found.damping_ratio), 0.01, rtol=0.15)


def test_dry_friction_damps_small_swings_more():
    times = np.arange(0.0, 8.0, 0.002)
    envelope = np.clip(1.0 - times / 9.0, 0.0, None)
    found = backbone(times, envelope * np.cos(2.0 * np.pi * 2.0 * times))
    small, large = found.damping_ratio[-1], found.damping_ratio[0]
    assert small > 2.0 * large
    expected = (1.0 / 9.0) / (found.amplitude * 2.0 * np.pi * 2.0)
    np.testing.assert_allclose(found.damping_ratio[1:-1], expected[1:-1], rtol=0.1)


@pytest.mark.parametrize("values", [np.zeros(400), np.ones(8), np.linspace(0.0, 1.0, 400)])
def test_what_does_not_oscillate_has_no_backbone(values):
    assert len(backbone(np.arange(len(values)) * 0.01, values).amplitude) == 0


def test_counted_cycles_of_a_softening_spring_slow_down_in_large_swings():
    rate, times = 100.0, np.arange(6000) / 100.0
    reach = np.exp(-0.05 * times)
    change = -0.02
    phase = 2 * np.pi * np.cumsum(1.5 * (1 + change * reach**2)) / rate
    found, std = counted_change(reach * np.cos(phase), rate)
    # the largest point of the curve is a mean over several swings, so it sees a little less
    assert 0.7 * change > found > 1.05 * change and 0 < std < 0.1 * abs(change)
    straight, _ = counted_change(reach * np.cos(2 * np.pi * 1.5 * times), rate)
    assert abs(straight) < 1e-3
    assert counted_change(np.ones(100), rate) == (0.0, 0.0)
