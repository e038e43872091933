"""A real shaft's mass lies along it, and a gauge on it does not see what bends inside the grip."""

from pathlib import Path

import numpy as np
import pytest

from supple.model.energies import mass_matrix
from supple.model.mechanism import mechanism_of
from supple.model.rig import read_rig
from supple.model.robot import PRESETS, Robot
from supple.model.shaft_form import CARRIED

P = PRESETS["robo_v"]


def mass_of(model: str, p: dict[str, float]) -> np.ndarray:
    return np.asarray(mass_matrix(Robot(model, tuple(p)).rows(p, np)))


def test_the_shaft_adds_to_a_turning_club_what_integrals_along_it_say():
    mass, length, grip = 0.05, P["club_length"], P["grip_length"]
    pivot = P["sleeve_offset"] + P["sleeve_spacing"] / 2 - grip / 2  # to the butt
    along = np.linspace(0.0, 1.0, 20001)
    shape = (3 - along) * along**2 / 2
    radius = pivot + grip + along * (length - grip)
    turn = np.trapezoid(radius**2, along) - (pivot + length) ** 2 * 33 / 140
    both = np.trapezoid(radius * shape, along) - (pivot + length) * 33 / 140
    more = mass_of("pinned_wrist", P | {"shaft_mass": mass}) - mass_of("pinned_wrist", P)
    assert more[0, 0] == pytest.approx(mass * turn, rel=1e-6)
    assert more[0, 3] == pytest.approx(mass * both, rel=1e-6)
    assert more[3, 3] == pytest.approx(0.0, abs=1e-12), "the head's own mass has its share"
    assert pytest.approx(33 / 140, rel=1e-12) == CARRIED
    assert 0.014 < both * mass / (P["clubhead_mass"] * (pivot + length)) < 0.017


def test_a_clamped_club_moves_as_without_the_mass_and_none_is_none():
    grown, bare = (mass_of("fixed_collet", p) for p in (P | {"shaft_mass": 0.05}, P))
    assert grown[2, 2] == pytest.approx(bare[2, 2], rel=1e-12)
    none = mass_of("driven_arm", P | {"shaft_mass": 0.0})
    assert np.allclose(none, mass_of("driven_arm", P), rtol=1e-12, atol=0.0)


def test_a_gauge_reads_less_of_the_bend_by_what_bends_inside_the_grip():
    robot = Robot("pinned_wrist", (*P, "grip_bending"))
    asked = "shaft", "deflection", "collet"
    bent, bare = (
        robot.sensor_row(*asked, P | {"grip_bending": 0.25}, np),
        robot.sensor_row(*asked, P),
    )
    assert np.allclose(1.25 * bent, np.asarray(bare))


@pytest.mark.parametrize("name", ["shaft_mass", "grip_bending"])
def test_the_planar_robot_refuses_what_it_does_not_know(tmp_path: Path, name: str):
    path = tmp_path / "rig.toml"
    head = '[rig]\nkind = "robot"\nmodel = "pinned_wrist"\nfidelity = "planar"\n'
    path.write_text(f"{head}[parameters]\n{name} = 0.05\n", encoding="utf-8")
    with pytest.raises(ValueError, match=f"{name}.*found 'planar'.*[Mm]end"):
        mechanism_of(read_rig(path), planar=True)
