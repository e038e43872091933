"""A law that slides is tried in place of a part of the spring beside it, not on top of it."""

import numpy as np
import pytest

from supple.identification.causes import numbers_at
from supple.identification.screen import screen
from supple.identification.sliding import SLIDES, in_place_of_spring


@pytest.mark.parametrize("law", ["hysteresis", "slip"])
def test_small_motions_meet_the_spring_that_they_met_before(softening_fit, law):
    found = next(c for c in screen(softening_fit) if c.law.name == law)
    (name,) = numbers_at(softening_fit, found.place, "stiffness")
    at = softening_fit.index(name)
    before = softening_fit.value(at)
    points = in_place_of_spring(softening_fit, found)
    knees = found.law.shapes[0].trials(softening_fit.problem.scales[found.place])
    assert len(points) == len(knees) > 1
    for x, knee in zip(points, knees, strict=True):
        *old, strength, width = x
        assert width * found.shapes[0].scale == pytest.approx(knee)
        spring = old[at] * softening_fit.model.scale[at]
        assert spring == pytest.approx((1 - SLIDES) * before)
        assert spring + strength * found.entry.scale / knee == pytest.approx(before)
        others = np.delete(np.array(old), at)
        np.testing.assert_array_equal(others, np.delete(softening_fit.x, at))


def test_what_does_not_stick_takes_over_no_spring(softening_fit):
    found = [c for c in screen(softening_fit) if not c.law.sticks]
    assert {"cubic_stiffness", "linear_damping"} & {c.law.name for c in found}
    assert all(in_place_of_spring(softening_fit, candidate) == [] for candidate in found)
