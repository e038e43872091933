"""Something that rides on a mass: as two masses would move, passive, with exact slopes."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from supple.model.chain import Chain
from supple.model.drives import impact
from supple.model.law import library
from supple.model.linear import Port
from supple.model.motion import CONVERGED, respond
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import simulate, tangents

MASS, STIFFNESS, DAMPING, STEP = 0.17, 24.0, 0.05, 0.005
NUMBERS = {
    "masses.cart.mass": MASS,
    "links.spring.stiffness": STIFFNESS,
    "links.spring.damping": DAMPING,
}
CHAIN = Chain(("cart",), (("spring", "ground", "cart"),))
RIDER, FREQUENCY, RATIO = 0.012, 5.3, 0.03
LAW = library()["extra_mode"]
TABLE = {"mass": RIDER, "frequency": FREQUENCY, "ratio": RATIO}
PLANT = Plant(CHAIN, (Port("cart", "force"),), (Port("cart", "position"),), ("cart",))
CORNERS = jnp.full((1, 2), 1e-3)


def two_masses(times, start, push):
    """Cart and rider by their own equations: position of both and their rates."""
    w = 2 * np.pi * FREQUENCY
    k, c = RIDER * w**2, 2 * RATIO * w * RIDER

    def rates(t, state):
        x, v, y, u = state
        between = k * (x - y) + c * (v - u)
        return [v, (push(t) - STIFFNESS * x - DAMPING * v - between) / MASS, u, between / RIDER]

    run = solve_ivp(
        rates, (0, times[-1]), start, "DOP853", times, rtol=1e-10, atol=1e-13, max_step=0.01
    )
    return run.y


def vector(start=(0.1, -0.3)):
    z = numbers_vector(PLANT, NUMBERS)
    for slot, (_, law, symbol) in enumerate(PLANT.law_numbers):
        if law.name == "extra_mode":
            z[PLANT.slots["strengths"].start + slot] = TABLE[symbol or "mass"]
    z[PLANT.slots["start"]] = start
    return z


def test_a_rider_moves_as_a_second_mass_does():
    times = STEP * np.arange(400)
    inputs = 0.3 * np.sin(7.0 * times)
    wanted = two_masses(times, [0.1, -0.3, 0.1, -0.3], lambda t: 0.3 * np.sin(7.0 * t))[0]
    found = np.asarray(
        simulate(PLANT, 8, vector(), jnp.asarray(inputs[:, None]), jnp.asarray(STEP), CORNERS)
    )
    size = np.max(np.abs(wanted))
    bare = vector()
    bare[PLANT.slots["strengths"]] = 0.0
    plain = np.asarray(
        simulate(PLANT, 8, bare, jnp.asarray(inputs[:, None]), jnp.asarray(STEP), CORNERS)
    )
    assert np.max(np.abs(plain[:, 0] - wanted)) > 0.1 * size
    assert np.max(np.abs(found[:, 0] - wanted)) < 2e-4 * size
    assert np.max(found[:, 1]) < 1e-6


def test_its_slopes_are_those_of_differences():
    times = STEP * np.arange(150)
    inputs, z = jnp.asarray(0.3 * np.sin(7.0 * times)[:, None]), vector()
    varied = np.flatnonzero(z[PLANT.slots["strengths"]]) + PLANT.slots["strengths"].start
    assert len(varied) == 3
    directions = np.eye(PLANT.size)[varied]
    found = np.asarray(tangents(PLANT, 2, z, directions, inputs, jnp.asarray(STEP), CORNERS))
    for row, at in enumerate(varied):
        move = 1e-6 * z[at] * np.eye(PLANT.size)[at]
        up, down = (
            np.asarray(simulate(PLANT, 2, z + side * move, inputs, jnp.asarray(STEP), CORNERS))
            for side in (1, -1)
        )
        wanted = (up - down)[:, 0] / (2e-6 * z[at])
        np.testing.assert_allclose(found[row, :, 0], wanted, atol=1e-5 * np.max(np.abs(wanted)))


def test_what_a_rider_takes_it_cannot_give_back_twice():
    """Along any path that ends where it began, at rest, the host has not gained energy."""
    memory, rng, h = LAW.memory, np.random.default_rng(4), 1e-3
    assert memory is not None
    times = h * np.arange(3000)
    envelope = np.sin(np.pi * times / times[-1]) ** 2
    for _ in range(10):
        shapes = (rng.uniform(2.0, 30.0), rng.uniform(0.01, 0.1))
        path = 0.05 * envelope * np.sin(2 * np.pi * rng.uniform(0.5, 20.0) * times)
        rate = np.gradient(path, h)
        held = memory.begin(shapes, path[:1], rate[:1])
        work = 0.0
        for k in range(len(times) - 1):
            before, after = (
                (path[k : k + 1], rate[k : k + 1]),
                (path[k + 1 : k + 2], rate[k + 1 : k + 2]),
            )
            old = memory.force(1.0, shapes, held, *before)
            held = memory.advance(shapes, held, before, after, h)
            work += 0.5 * float(
                (old + memory.force(1.0, shapes, held, *after))[0] * (after[0] - before[0])[0]
            )
        assert work > 0


@pytest.mark.parametrize("place", ["cart"])
def test_from_the_door_it_acts_on_a_mass(place):
    times = STEP * np.arange(500)
    blow = impact("cart", 3.0, 0.235, 0.09)
    tables = ({"law": "extra_mode", "place": place, "parameters": TABLE},)
    found = respond(CHAIN, NUMBERS, blow, times, (Port("cart", "position"),), tables)
    assert found.status == CONVERGED
    wanted = two_masses(times, np.zeros(4), lambda t: 3.0 * (0.235 <= t < 0.325))[0]
    assert np.max(np.abs(found.samples[:, 0] - wanted)) < 2e-3 * np.max(np.abs(wanted))
