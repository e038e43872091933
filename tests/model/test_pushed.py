"""A chain under forces by blocks of samples reads as it does step by step."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.linear import Port
from supple.model.plant import Plant, numbers_vector
from supple.model.pushed import BLOCK, is_pushed, pushed
from supple.model.respond import simulate
from supple.model.robot import Robot

CHAIN = Chain(("cart", "tip"), (("spring", "ground", "cart"), ("wire", "cart", "tip")), False)
NUMBERS = {
    "masses.cart.mass": 0.8, "masses.tip.mass": 0.3, "links.spring.stiffness": 300.0,
    "links.spring.damping": 0.9, "links.wire.stiffness": 120.0, "links.wire.damping": 0.2,
}  # fmt: skip
FORCES = Port("tip", "force"), Port("cart", "force", held=True)
SENSORS = Port("tip", "position"), Port("cart", "velocity"), Port("tip", "acceleration")


@pytest.mark.parametrize("count", [2, BLOCK - 1, BLOCK, BLOCK + 1, 700])
def test_readings_are_those_of_a_march(count):
    plant = Plant(CHAIN, FORCES, SENSORS)
    assert is_pushed(plant)
    chance = np.random.default_rng(3)
    z = numbers_vector(plant, NUMBERS)
    z[plant.slots["start"]] = [0.01, -0.02, 0.3, 0.1]
    z[plant.slots["drive"]] = [0.5, -0.2]
    inputs, step = jnp.asarray(chance.standard_normal((count, 2))), jnp.asarray(0.004)
    wanted = np.asarray(simulate(plant, 1, z, inputs, step, np.zeros((0, 2))))[:, :-1]
    found = np.asarray(pushed(plant, jnp.asarray(z), inputs, step)).T
    np.testing.assert_allclose(found, wanted, atol=1e-11 * np.abs(wanted).max())


def test_a_robot_a_law_and_a_told_motion_are_marched():
    assert not is_pushed(Plant(Robot("pinned_wrist"), (Port("clubhead", "force"),), ()))
    assert not is_pushed(Plant(CHAIN, FORCES, SENSORS, ("wire",)))
    assert not is_pushed(Plant(CHAIN, (Port("base", "acceleration"),), SENSORS))
