"""Kinds of loading are told from records of golfers, and a rigid robot's is none of them."""

import numpy as np
import pytest

from supple.identification.shaft_type import shaft_type
from tests.lab import instrumented
from tests.lab.loads import KINDS, load


@pytest.mark.parametrize("kind", KINDS)
def test_the_kind_of_a_golfer_is_told(kind):
    told = [shaft_type(*load(kind, seed)) for seed in range(60)]
    right = [one.name == kind for one in told]
    assert np.mean(right) >= 0.95
    sure = [one.name == kind for one in told if one.status == "told"]
    assert np.mean(sure) >= 0.95 and len(sure) > 40


def test_size_and_rate_change_no_kind():
    for kind in KINDS:
        times, lag, impact = load(kind, 3)
        one = shaft_type(times, lag, impact)
        assert shaft_type(times, 3.0 * lag, impact).name == one.name
        assert shaft_type(times[::8], lag[::8], impact).name == one.name
        assert one.largest == pytest.approx(lag[times < impact].max(), rel=0.1)


def test_a_double_peak_tells_both():
    found = shaft_type(*load("double_peak", 8))
    first, second = found.peaks
    assert found.start < first < second and min(found.heights) > 0.5 * max(found.heights)
    assert "loaded twice" in found.sentence


def test_a_rigid_robot_is_none_of_them():
    """A club that rings at 4 Hz on a rigid wrist, as the thesis sees robots do; line 152."""
    for slow, jolt in ((1.0, 1.4), (1.0, -1.4), (1.6, 0.8), (2.0, 0.5), (2.5, 0.5)):
        made = instrumented.swing(slow=slow, end=1.6, jolt=jolt)
        found = shaft_type(made.times, -made.deflection, made.impact)
        assert found.name == "none" and "back and forth" in found.sentence, found
        held = instrumented.swing(slow=slow, end=1.6)  # the same motion, begun gently
        assert (
            "back and forth" not in shaft_type(held.times, -held.deflection, held.impact).sentence
        )


def test_a_club_at_rest_is_none_of_them():
    times = np.arange(2000) / 1000.0
    quiet = 1e-4 * np.random.default_rng(0).standard_normal(2000)
    assert "hardly loaded" in shaft_type(times, quiet, 1.5).sentence
    with pytest.raises(ValueError, match="tenth of a second before impact"):
        shaft_type(times, quiet, 0.05)
