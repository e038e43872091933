"""An accelerometer that leans: against differences of its own place along a circle."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.linear import Port
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import simulate, tangents
from supple.model.robot import PRESETS, Robot
from supple.model.tilt import leans

P = PRESETS["robo_v_sleeve_50"]
STEP, COUNT, TILT = 5e-4, 400, 0.2
HEAD = Port("clubhead", "acceleration")
SENSORS = (HEAD, Port("clubhead", "velocity"), Port("shaft", "strain"))
REACH = P["sleeve_offset"] + P["sleeve_spacing"] / 2 + P["club_length"] - P["grip_length"] / 2
WIDTHS = np.zeros((0, 2))


def readings(tilt: float, model: str = "pinned_wrist", inputs=None) -> np.ndarray:
    ports = () if inputs is None else (Port("wrist", "angle"),)
    plant = Plant(Robot(model), ports, SENSORS)
    z = numbers_vector(plant, P)
    z[plant.slots["start"].start : plant.slots["start"].start + 2] = (0.1, 0.002)
    z[plant.slots["tilt"].start] = tilt
    drive = jnp.zeros((COUNT, 0)) if inputs is None else jnp.asarray(inputs)
    return np.asarray(simulate(plant, 1, z, drive, jnp.asarray(STEP), WIDTHS))


def test_only_an_accelerometer_on_the_head_against_the_ground_leans():
    assert leans(HEAD) and not any(leans(port) for port in SENSORS[1:])
    assert not leans(Port("clubhead", "acceleration", "collet"))


@pytest.mark.parametrize("model", ["pinned_wrist", "fixed_collet", "driven_wrist"])
def test_a_tilt_mixes_in_the_pull_towards_the_pivot(model):
    driven = model == "driven_wrist"
    turn = 0.3 * np.sin(20.0 * STEP * np.arange(COUNT))[:, None] if driven else None
    plain, leaning = readings(0.0, model, turn), readings(TILT, model, turn)
    across, speed = plain[:, 0], plain[:, 1]
    wanted = np.cos(TILT) * across - np.sin(TILT) * speed**2 / REACH
    np.testing.assert_allclose(leaning[:, 0], wanted, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(leaning[:, 1:3], plain[:, 1:3])
    assert np.max(np.abs(leaning[:, 0] - across)) > 0.01 * np.max(np.abs(across))


def test_a_point_on_a_circle_is_pulled_as_the_formula_says():
    """The head of a stiff club about its pin: second differences of its place, along the club."""
    angle = 0.4 * np.sin(9.0 * 1e-4 * np.arange(4000))
    place = REACH * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    bend = np.diff(place, 2, axis=0) / 1e-8
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)[1:-1]
    rate = np.gradient(angle, 1e-4)[1:-1]
    felt = np.sum(bend * out, axis=1)
    np.testing.assert_allclose(felt, -((REACH * rate) ** 2) / REACH, atol=1e-4 * np.max(-felt))


def test_the_derivative_by_a_tilt_is_that_of_differences():
    plant = Plant(Robot("pinned_wrist"), (), SENSORS)
    z = numbers_vector(plant, P)
    z[plant.slots["start"].start] = 0.1
    at = plant.slots["tilt"].start
    none = jnp.zeros((COUNT, 0)), jnp.asarray(STEP), WIDTHS
    for tilt in (0.0, 0.3):
        z[at] = tilt
        direction = np.zeros((1, plant.size))
        direction[0, at] = 1.0
        found = np.asarray(tangents(plant, 1, z, direction, *none))[0, :, 0]
        ends = []
        for move in (1e-6, -1e-6):
            z[at] = tilt + move
            ends.append(np.asarray(simulate(plant, 1, z, *none))[:, 0])
        np.testing.assert_allclose(found, (ends[0] - ends[1]) / 2e-6, atol=1e-7, rtol=1e-6)


def test_nothing_leans_on_a_chain():
    chain = Chain(("clubhead",), (("spring", "ground", "clubhead"),))
    plant = Plant(chain, (), (HEAD,))
    z = np.zeros(plant.size)
    z[plant.slots["numbers"]] = 1.0
    z[plant.slots["start"].start] = 0.1
    none = jnp.zeros((COUNT, 0)), jnp.asarray(STEP), WIDTHS
    plain = np.asarray(simulate(plant, 1, z, *none))
    z[plant.slots["tilt"].start] = 0.2
    np.testing.assert_array_equal(np.asarray(simulate(plant, 1, z, *none)), plain)
