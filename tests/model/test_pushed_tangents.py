"""Forces beside a law in force: what one more law would change while it is still nothing."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.linear import Port
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import pushed_tangents, simulate, state_history
from tests.model.test_respond import COUNT, PAIR, PAIR_NUMBERS, STEP, close, wave


@pytest.mark.parametrize("driven", [False, True])
def test_forces_beside_a_law_in_force_do_what_one_more_law_would(driven):
    """A cubic spring acts on the left; what one in the middle would change, by differences."""
    inputs = (Port("base", "position"),) if driven else (Port("b", "force"),)
    sensors = (Port("a", "position"), Port("b", "velocity" if driven else "acceleration"))
    plant = Plant(PAIR, inputs, sensors, ("left", "mid"), ("cubic_stiffness",))
    z = numbers_vector(plant, PAIR_NUMBERS)
    z[plant.slots["start"]] = [0.1, -0.2, 0.0, 0.3, *([0.0] * driven)]
    names = [(place, law.name) for place, law, _ in plant.law_numbers]
    first, step, fine = plant.slots["strengths"].start, STEP / 4, 4 * COUNT
    left, mid = (first + names.index((place, "cubic_stiffness")) for place in ("left", "mid"))
    z[left] = 900.0
    told = 0.05 * wave(fine) if driven else wave(fine)
    rest = jnp.asarray(told), jnp.asarray(step), jnp.tile(jnp.array([1e-3, 0.05]), (2, 1))
    ends = []
    for strength in (0.01, -0.01):
        z[mid] = strength
        ends.append(np.asarray(simulate(plant, 2, z, *rest))[:, :-1])
    z[mid] = 0.0
    states = state_history(plant, 2, jnp.asarray(z), *rest)[0]
    everywhere = list(PAIR.law_places())
    forces = np.zeros((3, fine, len(everywhere)))
    forces[1, :, everywhere.index("mid")] = (states[:, 1] - states[:, 0]) ** 3
    found = np.asarray(pushed_tangents(plant, 2, z, jnp.asarray(forces), *rest))
    assert found.shape == (3, fine, 2)
    assert np.all(found[[0, 2]] == 0.0)
    close(found[1], (ends[0] - ends[1]) / 0.02, 5e-3)  # forces are straight between samples
    twice = np.asarray(pushed_tangents(plant, 2, z, jnp.asarray(2 * forces), *rest))
    close(twice[1], 2 * found[1], 1e-12)
