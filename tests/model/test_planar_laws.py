"""Planar motions under laws: against the other robot, and as the thesis's robot feels them."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.drives import Drive, impact
from supple.model.motion import respond
from supple.model.planar_motion import respond_planar
from tests.model.test_planar_motion import (
    KNOTS,
    NUMBERS,
    TIMES,
    off,
    profile,
    robot,
    start_of,
    told,
)
from tests.reference.planar_robot import moved


@pytest.mark.slow
def test_friction_in_the_wrist_against_the_other_robot():
    law = {"law": "coulomb_friction", "place": "wrist"}
    numbers = {"torque": 2.0, "rate_width": 0.05}
    drive = Drive(joints=(profile("arm", 0.15), profile("wrist", 0.1)))
    able = robot("driven_arm")
    motion = respond_planar(able, NUMBERS, drive, TIMES, (), [law | {"parameters": numbers}])

    def friction(stretch: Any, rate: Any) -> Any:
        return 2.0 * jnp.tanh(rate / 0.05)

    truth = moved(
        NUMBERS, TIMES, told((0.15, 0.1)), lambda t: (0.0, 0.0, 0.0), (KNOTS[-1],),
        start_of(motion), law=friction,
    )  # fmt: skip
    assert motion.status == "converged"
    assert off(motion.positions, truth[:, 0]) < 1e-6
    assert off(motion.velocities, truth[:, 1]) < 1e-5
    without = respond_planar(able, NUMBERS, drive, TIMES)
    assert np.abs(motion.positions - without.positions)[:, 0].max() > 1e-3


@pytest.mark.slow
def test_friction_in_the_wrist_of_a_free_collet():
    law = {"law": "coulomb_friction", "place": "wrist"}
    tables = [law | {"parameters": {"torque": 1.0, "rate_width": 0.05}}]
    drive = impact("clubhead", -300.0, 0.0503, 0.0005)
    motion = respond_planar(robot("driven_collet"), NUMBERS, drive, TIMES, (), tables)

    def load(t: float) -> tuple[float, float, float]:
        return 0.0, -300.0 if 0.0503 < t < 0.0508 else 0.0, 0.0

    loose = NUMBERS | {"wrist_stiffness": 0.0, "wrist_damping": 0.0}
    truth = moved(
        loose, TIMES, told((0.0, 0.0)), load, (0.0503, 0.0508),
        law=lambda stretch, rate: jnp.tanh(rate / 0.05),
    )  # fmt: skip
    assert motion.status == "converged"
    assert off(motion.positions, truth[:, 0]) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "place", "numbers"),
    [
        ("relaxation", "wrist", {"stiffness": 200.0, "time": 0.05}),
        ("hysteresis", "wrist", {"torque": 0.02, "knee": 1e-4}),
        ("clearance", "shaft", {"gap": 1e-4, "stretch_width": 1e-5}),
    ],
)
def test_laws_act_as_in_the_thesis_s_robot(law, place, numbers):
    """Motions so small that the two fidelities differ by 1e-5 at most."""
    able, drive = robot("pinned_wrist"), impact("clubhead", -2.0, 0.0503, 0.0005)
    tables = [{"law": law, "place": place, "parameters": numbers}]
    ours = respond_planar(able, NUMBERS, drive, TIMES, (), tables)
    linear = respond(able, NUMBERS, drive, TIMES, (), tables)
    bare = respond(able, NUMBERS, drive, TIMES)
    assert off(ours.positions, linear.positions) < 2e-5
    assert off(bare.positions, linear.positions) > 1e-2
