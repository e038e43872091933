"""Planar motions that cannot be trusted are said, and what does not fit is refused."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from supple.model import planar_motion, shaft
from supple.model.drives import impact, release
from supple.model.extended import Acting
from supple.model.law import library
from supple.model.linear import Port
from supple.model.planar_motion import respond_planar
from tests.model.test_planar_motion import NUMBERS, SMALL, TILTED, TIMES, robot


def test_a_release_is_a_balance_of_the_hand():
    times = TIMES[:5]
    motion = respond_planar(
        robot("pinned_wrist", TILTED), TILTED, release("clubhead", 0.3), times,
        (Port("clubhead", "position"), Port("shaft", "deflection")),
    )  # fmt: skip
    assert motion.samples[0, 0] == pytest.approx(0.3, abs=1e-9)
    assert np.abs(motion.velocities[0]).max() == 0.0
    # the hand is gone: its force is what the head's acceleration is made of
    assert motion.accelerations[0, 3] < -1.0
    grip = respond_planar(robot("pinned_wrist"), NUMBERS, release("grip", 0.01, "collet"), times)
    assert grip.positions[0, 1] == pytest.approx(0.01, abs=1e-9)


def test_what_cannot_be_trusted_is_said():
    stiff = NUMBERS | {"sleeve_stiffness": 1e6}
    pulled = release("clubhead", 0.62, "collet")
    bent = respond_planar(robot("fixed_collet"), stiff, pulled, TIMES)
    assert bent.status == "left_model" and len(bent.times) == len(TIMES)
    assert "The shaft bends by up to 0.5" in bent.sentence or "to 0.6" in bent.sentence
    assert "beyond 0.58 m, 0.6 of its length" in bent.sentence
    fine = respond_planar(robot("pinned_wrist"), NUMBERS, release("clubhead", 0.3, "collet"), TIMES)
    assert (fine.status, fine.sentence) == ("converged", "The motion was simulated.")


def test_a_grip_that_tilts_too_far_is_said():
    """A sleeve of the 100 N/m for which the thesis seeks a critical damping, line 1333."""
    loose, able = NUMBERS | {"sleeve_stiffness": 100.0}, robot("pinned_wrist")
    for pull, tilts in ((0.45, False), (0.7, True)):
        motion = respond_planar(able, loose, release("clubhead", pull, "collet"), TIMES)
        tilt = np.abs(motion.positions[:, 2]).max()
        assert (tilt > shaft.LARGEST_TILT) == tilts == (motion.status == "left_model")
        assert (f"The grip tilts by up to {tilt:.2f} rad" in motion.sentence) == tilts


def test_a_motion_that_runs_away_ends():
    pushed = [{"law": "linear_damping", "place": "wrist", "parameters": {"damping": -2000.0}}]
    drive = impact("clubhead", -100.0, 0.0103, 0.0005)
    wild = respond_planar(robot("pinned_wrist"), NUMBERS, drive, TIMES, (), pushed)
    assert wild.status == "left_model" and "grew beyond all numbers" in wild.sentence
    assert 1 <= len(wild.times) < len(TIMES) and np.all(np.isfinite(wild.positions))
    assert f"{wild.times[-1]:.6g} s" in wild.sentence


def test_steps_that_are_too_long_are_said(monkeypatch):
    monkeypatch.setattr(planar_motion, "MOST_REFINEMENT", 2)
    monkeypatch.setattr(planar_motion, "LONGEST", 0.1)
    rough = respond_planar(
        robot("pinned_wrist"), NUMBERS, impact("clubhead", -100.0, 0.1, 0.0005), TIMES[::40]
    )
    assert rough.status == "not_converged" and rough.sentence.startswith("Not converged")


def test_laws_that_the_plane_has_of_itself_are_refused():
    for name, place in (("centrifugal_stiffening", "shaft"), ("coulomb_friction", "clubhead")):
        law = replace(library()["coulomb_friction"], name=name)
        with pytest.raises(ValueError, match=f"{name}' at '{place}'"):
            planar_motion.check_laws([Acting(place, law, 1.0)])
    planar_motion.check_laws([Acting("shaft", library()["cubic_stiffness"], 1.0)])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"numbers": {"arm_length": 0.65}}, "numbers: expected every number"),
        ({"times": np.array([0.0, 0.1, 0.3])}, "times: expected at least two uniform"),
        (
            {
                "drive": SMALL["a leaping wrist"](1.0),
                "model": "driven_wrist",
                "laws": [
                    {"law": "linear_damping", "place": "wrist", "parameters": {"damping": 1.0}}
                ],
            },
            "without leaps",
        ),
        (
            {"drive": release("clubhead", 0.1, "collet"), "model": "driven_collet"},
            "release at 'clubhead'",
        ),
        (
            {
                "laws": [{"law": "coulomb_friction", "place": "moon", "parameters": {}}],
            },
            "place: expected a place where",
        ),
    ],
)
def test_what_does_not_fit_is_refused(change, words):
    asked: dict[str, Any] = {"model": "pinned_wrist", "drive": release("clubhead", 0.05)}
    asked |= {"numbers": NUMBERS, "times": TIMES, "laws": []} | change
    with pytest.raises(ValueError, match=words) as refusal:
        respond_planar(
            robot(asked["model"]), asked["numbers"], asked["drive"], asked["times"], (),
            asked["laws"],
        )  # fmt: skip
    assert "Mend:" in str(refusal.value)
