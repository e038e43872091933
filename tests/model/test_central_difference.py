"""The thesis's central difference: of second order, and useless beyond its critical step."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.linalg import expm

from supple.model.central_difference import critical_step, respond_central
from supple.model.energies import damping_matrix, mass_matrix, stiffness_matrix
from supple.model.robot import PRESETS, Robot

MASS = np.array([[2.0, 0.3], [0.3, 1.0]])
DAMPING = np.array([[0.5, -0.2], [-0.2, 0.4]])
STIFFNESS = np.array([[90.0, -40.0], [-40.0, 60.0]])
PUSH = np.array([3.0, -1.0])
START = np.array([0.1, -0.2]), np.array([1.0, 0.5])


def exact(times: np.ndarray) -> np.ndarray:
    """Positions and velocities under a constant push, by the exponential of the state matrix."""
    inner = np.linalg.solve(MASS, np.hstack([-STIFFNESS, -DAMPING]))
    a = np.vstack([np.eye(2, 4, k=2), inner])
    rest = np.append(np.linalg.solve(STIFFNESS, PUSH), np.zeros(2))
    return np.stack([rest + expm(a * t) @ (np.concatenate(START) - rest) for t in times])


def error(step: float) -> tuple[float, float]:
    count = round(2.0 / step) + 1
    found = respond_central(MASS, DAMPING, STIFFNESS, np.tile(PUSH, (count, 1)), step, START)
    truth = exact(found.times)
    rates = np.abs(found.velocities - truth[:, 2:])[:-1]
    return float(np.abs(found.positions - truth[:, :2]).max()), float(rates.max())


def test_halving_the_step_quarters_the_error():
    errors = np.array([error(step) for step in (0.02, 0.01, 0.005)])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.1)
    assert errors[-1, 0] > 1e-6  # and that is all it gets to


def test_accelerations_are_those_of_the_equation():
    forces = np.tile(PUSH, (300, 1))
    found = respond_central(MASS, DAMPING, STIFFNESS, forces, 0.005, START)
    left = found.accelerations @ MASS + found.velocities @ DAMPING + found.positions @ STIFFNESS
    assert left[:-1] == pytest.approx(forces[:-1], abs=1e-8)
    assert found.positions[0] == pytest.approx(START[0])
    assert found.velocities[0] == pytest.approx(START[1], abs=1e-12)
    assert np.all(np.isnan(found.velocities[-1]))


@settings(max_examples=20, deadline=None)
@given(st.floats(0.1, 10.0), st.floats(1.0, 1e4), st.floats(0.0, 0.5))
def test_beyond_the_critical_step_it_blows_up_and_below_it_does_not(m, k, ratio):
    mass, stiffness = np.array([[m]]), np.array([[k]])
    damping = 2 * ratio * np.sqrt(mass * stiffness)
    critical = critical_step(mass, stiffness)
    assert critical == pytest.approx(2 * np.sqrt(m / k))
    start = np.ones(1), np.zeros(1)
    below, beyond = (
        respond_central(mass, damping, stiffness, np.zeros((4000, 1)), share * critical, start)
        for share in (0.98, 1.02)
    )
    assert below.is_stable and "is below" in below.sentence
    assert np.abs(below.positions).max() < 10.0
    assert not beyond.is_stable and "grows without bound" in beyond.sentence
    assert not np.abs(beyond.positions[-1]).max() < 1e6


def test_the_sleeve_of_the_club_asks_for_tiny_steps():
    p = PRESETS["robo_v_rigid"]
    rows = Robot("fixed_collet", tuple(p)).rows(p, np)
    parts = (matrix(rows)[:3, :3] for matrix in (mass_matrix, damping_matrix, stiffness_matrix))
    mass, damping, stiffness = parts
    critical = critical_step(mass, stiffness)
    # two sets of two springs across the grip's mass, or turning it about its centre
    slide = np.sqrt(4 * p["sleeve_stiffness"] / p["grip_mass"])
    turn = np.sqrt(p["sleeve_stiffness"] * p["sleeve_spacing"] ** 2 / p["grip_inertia"])
    assert critical == pytest.approx(2 / max(slide, turn), rel=0.01)
    forces = np.zeros((3000, 3))
    forces[0, 2] = 1.0
    bounded = respond_central(mass, damping, stiffness, forces, 0.99 * critical)
    wild = respond_central(mass, damping, stiffness, forces, 1.05 * critical)
    assert np.abs(bounded.positions).max() < 1.0
    assert not np.abs(wild.positions).max() < 1e6


def test_nothing_stiff_has_no_critical_step():
    assert critical_step(np.eye(2), np.zeros((2, 2))) == np.inf


def test_what_does_not_fit_is_refused():
    forces = np.zeros((5, 2))
    with pytest.raises(ValueError, match="square ones of one size"):
        critical_step(MASS, STIFFNESS[:1])
    with pytest.raises(ValueError, match="symmetric, positive mass"):
        critical_step(-MASS, STIFFNESS)
    with pytest.raises(ValueError, match="symmetric stiffness"):
        critical_step(MASS, STIFFNESS + np.eye(2, k=1))
    with pytest.raises(ValueError, match="above 0 s"):
        respond_central(MASS, DAMPING, STIFFNESS, forces, 0.0)
    with pytest.raises(ValueError, match="a row for every instant"):
        respond_central(MASS, DAMPING, STIFFNESS, forces[:, :1], 0.01)
