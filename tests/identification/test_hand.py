"""Hand against clubhead: a golfer's hold passes the motion on, a rigid grip's club swings on."""

import math

import numpy as np
import pytest

from supple.identification.hand import ABSENT, PRESENT, hold
from tests.lab.hands import HAND, HEAD, MOTIONS, moved

RATE = 2048.0


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_golfers_hold_does_not_oscillate(motion):
    for seed, ratio in ((1, 0.7), (2, 1.0), (3, 1.6)):
        found = hold(*moved(motion, seed, 4.17, ratio), RATE, 4.17)
        assert found.status == ABSENT and "does not oscillate" in found.sentence
        assert found.ratio_low < ratio < found.ratio_high
        assert found.gain == pytest.approx(-HEAD / HAND, abs=5 * found.gain_std + 0.02)
        assert found.cycles < 1.0 and found.explained > 0.5


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_rigid_grips_club_swings_on(motion):
    for seed, (frequency, ratio) in enumerate([(4.17, 0.0076), (3.64, 0.02), (3.08, 0.11)]):
        found = hold(*moved(motion, seed, frequency, ratio), RATE)
        assert found.status == PRESENT and "oscillates at" in found.sentence
        assert found.frequency == pytest.approx(frequency, rel=0.02)
        assert found.ratio_low <= ratio <= found.ratio_high
        assert found.cycles > 2.0 and found.noise < 0.5 * found.left


def test_the_interval_of_the_damping_holds_the_truth():
    held = []
    for seed in range(24):
        ratio = (0.01, 0.05, 0.2, 0.6)[seed % 4]
        motion = list(MOTIONS)[seed % 3]
        found = hold(*moved(motion, 100 + seed, 4.0, ratio, noise=0.8), RATE, 4.0)
        held.append(found.ratio_low <= ratio <= found.ratio_high)
    assert np.mean(held) >= 0.87


def test_an_ideal_hold_has_no_upper_bound():
    hand = moved("-90 to 90", 4, 4.0, 1.0, noise=0.0)[0]
    rng = np.random.default_rng(4)
    found = hold(hand, -2.7 * hand + 0.3 * rng.standard_normal(len(hand)), RATE, 4.0)
    assert found.status == ABSENT and math.isinf(found.ratio_high)
    assert found.gain == pytest.approx(-2.7, abs=0.03) and found.explained > 0.99


def test_a_short_or_still_record_is_refused():
    with pytest.raises(ValueError, match="half a second at least"):
        hold(np.zeros(100), np.zeros(100), RATE)
    with pytest.raises(ValueError, match="an acceleration that changes"):
        hold(np.zeros(4000), np.ones(4000), RATE)


@pytest.mark.parametrize(
    ("frequency", "ratio", "late"),
    [
        (4.0, 0.01, -0.0331),
        (3.08, 0.11, 0.0127),
        (4.17, 1.0, -0.02),
    ],
)
@pytest.mark.slow
def test_clocks_that_are_apart_are_brought_together_by_the_motion(frequency, ratio, late):
    """A shift looks like a hold's own lag; both are found, and the damping as if none were."""
    hand, head = moved("-90 to 90 to -90", 6, frequency, ratio)
    times = np.arange(len(hand)) / RATE
    moved_hand = np.interp(times + late, times, hand)  # its clock begins `late` too late
    told = hold(hand, head, RATE)
    found = hold(moved_hand, head, RATE, apart=0.04)
    assert found.status == told.status and told.late == 0.0
    assert found.late == pytest.approx(late, abs=2e-3)
    assert found.ratio == pytest.approx(told.ratio, rel=0.25)
    assert found.ratio_low <= ratio <= found.ratio_high


def test_gravity_is_said_where_a_record_shows_it():
    """The model has none: up and down it cannot tell a golfer's hold, or misses its damping."""
    for motion in ("-90 to 90", "-90 to 90 to -90"):
        for ratio in (0.01, 1.0):
            assert hold(*moved(motion, 2, 4.0, ratio), RATE).weight == ""
            steep = hold(*moved(motion, 2, 4.0, ratio, steep=1.0), RATE)
            assert "gravity, which this model has not" in steep.weight
            assert "level plane" in steep.weight
    steep = hold(*moved("-90 to 90", 2, 4.0, 1.0, steep=1.0), RATE)
    assert steep.status != ABSENT or not steep.ratio_low <= 1.0 <= steep.ratio_high
    hidden = hold(*moved("0 to -90 to 90 to 0", 2, 4.0, 1.0, steep=1.0), RATE)
    assert hidden.weight == ""  # it rests with the arm hanging: its sensors feel nothing then
    level, upright = moved("-90 to 90", 2, 4.0, 1.0), 9.81
    mean = hold(level[0] + upright, level[1], RATE).weight
    assert "9.8 m/s^2" in mean
