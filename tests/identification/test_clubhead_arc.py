"""The arc of a swing: exact where it is one, absent where there is none."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from supple.identification.clubhead_arc import STRAIGHT, arc_of

TIMES = np.linspace(-0.012, 0.0, 61)


def on_circle(seed, radius=1.7, rate=25.0, gain=300.0):
    rng = np.random.default_rng(seed)
    frame = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    angle = rate * TIMES + 0.5 * gain * TIMES**2
    flat = radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return flat @ frame.T + rng.normal(size=3), frame[:, 2] * (rate + gain * TIMES)[:, None]


@given(st.integers(0, 10_000), st.floats(0.5, 5.0))
def test_a_circle_is_its_own_arc(seed, radius):
    places, turning = on_circle(seed, radius)
    arc = arc_of(TIMES, places)
    found, turn, velocity, rates = arc.state(TIMES)
    assert found == pytest.approx(places, abs=1e-8)
    assert rates == pytest.approx(turning, abs=1e-5)
    assert velocity == pytest.approx(np.cross(rates, found - arc.center), abs=1e-9)
    assert turn @ (places[-1] - arc.center) == pytest.approx(places - arc.center, abs=1e-7)
    assert np.gradient(found, TIMES, axis=0)[5:-5] == pytest.approx(velocity[5:-5], abs=2e-2)


def test_no_arc_is_seen_in_a_line_a_knot_or_too_few_frames():
    line = np.outer(TIMES, [30.0, 1.0, 0.0])
    knot = 0.01 * np.column_stack([np.cos(400 * TIMES), np.sin(400 * TIMES), 0 * TIMES])
    few, _ = on_circle(1)
    for times, places in ((TIMES, line), (TIMES, knot), (TIMES, 0 * line), (TIMES[:5], few[:5])):
        assert arc_of(times, places) is STRAIGHT
    place, turn, velocity, rates = STRAIGHT.state(TIMES)
    assert not place.any() and not velocity.any() and not rates.any()
    assert np.array_equal(turn, np.broadcast_to(np.eye(3), turn.shape))
