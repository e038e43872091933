"""A club on a bench: its collet held, as bodies show it; its grip clamped, as elements show it."""

import numpy as np
import pytest

from supple.identification.clamped import clamped_words, grip_bending, held, in_a_vice
from supple.model.robot import PRESETS
from tests.lab.bodies import fixed_collet, levers
from tests.lab.finite import CLUB, finite_club

P = PRESETS["robo_v"]


def test_a_held_club_rings_and_gives_way_as_bodies_do():
    machine = fixed_collet(dict(P))
    frequency, ratio, stiffness = held(P)
    tones, ratios = machine.modes()
    assert frequency == pytest.approx(tones[0], rel=1e-9)
    assert ratio == pytest.approx(ratios[0], rel=1e-9)
    pulled = machine.hang(machine.body("clubhead"), 1.0)
    force = -machine.forces(pulled, np.zeros(len(pulled)))[machine.body("clubhead")]
    assert stiffness == pytest.approx(force, rel=1e-9)


@pytest.mark.parametrize("tip", [15.0, 21.0, 62.0])
@pytest.mark.parametrize("stiffness", [2e3, 80e3, 600e3])
def test_a_shaft_bends_in_its_sleeve_as_much_more_as_elements_do(tip, stiffness):
    """Beyond the sleeve's share, which is by how much it matters that the sleeve is softer."""
    numbers = CLUB | {"bending_tip": tip, "head_offset": 1e-6}

    def soft(factor: float) -> float:
        own = numbers | {"sleeve_stiffness": stiffness * factor}
        club = finite_club(own, "fixed_collet")
        row = club.points["clubhead"]
        return float(row @ np.linalg.solve(club.stiffness, row))

    step = 1e-4
    sleeve = (soft(1.0 - step) - soft(1.0 + step)) / (2.0 * step)
    rest = soft(1.0) - sleeve
    lengths, taper = (numbers["club_length"], numbers["grip_length"]), tip / numbers["bending_butt"]
    told = grip_bending(*lengths, taper, sleeve / rest)
    assert 1 + told == pytest.approx(rest * numbers["shaft_stiffness"], rel=0.01)


def test_a_vice_makes_the_shaft_stiffer_and_its_tone_higher():
    tone, ratio, stiffness = in_a_vice(P, 0.0)
    assert tone == pytest.approx(np.sqrt(P["shaft_stiffness"] / P["clubhead_mass"]) / (2 * np.pi))
    assert stiffness == P["shaft_stiffness"]
    higher, _, stiffer = in_a_vice(P, 0.21)
    assert (higher / tone, stiffer / stiffness) == pytest.approx((1.1, 1.21))
    assert ratio == pytest.approx(
        P["shaft_damping"] / (2 * P["clubhead_mass"]) / (tone * 2 * np.pi)
    )
    assert levers(dict(P))[1] == P["club_length"] - P["grip_length"] / 2


def test_words_tell_the_benches_apart():
    one = {"value": 3.0, "std": 0.01, "unit": "Hz"}
    table = dict.fromkeys(("frequency", "damping_ratio", "stiffness"), one)
    first, second = clamped_words({"collet_held": table, "grip_clamped": table})
    assert "collet held" in first and "vice" in second and clamped_words({}) == []
