"""A rider on a mass is a second mass in a spring: the law against equations that have one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from supple.model.chain import Chain
from supple.model.drives import impact
from supple.model.law import Scales, library
from supple.model.linear import Port
from supple.model.motion import CONVERGED, respond
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import simulate, tangents
from supple.model.robot import PRESETS, Robot
from tests.model.struck import STEP, struck

MASS, STIFFNESS, DAMPING = 0.17, 24.0, 0.05
NUMBERS = {
    "masses.cart.mass": MASS,
    "links.spring.stiffness": STIFFNESS,
    "links.spring.damping": DAMPING,
}
CHAIN = Chain(("cart",), (("spring", "ground", "cart"),))
RIDER, HERTZ, RATIO = 0.01, 7.0, 0.02
CORNERS = jnp.full((1, 2), 1e-3)
SCALES = Scales(stretch=0.05, rate=0.6, force=2.0, stiffness=40.0, time=0.08)


def plant(place: str = "cart") -> Plant:
    return Plant(CHAIN, (Port("cart", "force"),), (Port("cart", "position"),), (place,))


def vector(numbers: tuple[float, ...], start: tuple[float, float]) -> np.ndarray:
    z = numbers_vector(plant(), NUMBERS)
    symbols = ["", "frequency", "damping_ratio"]
    for slot, (_, law, symbol) in enumerate(plant().law_numbers):
        if law.name == "extra_mode":
            z[plant().slots["strengths"].start + slot] = numbers[symbols.index(symbol)]
    z[plant().slots["start"]] = start
    return z


def two_masses(
    mass: float, start: tuple[float, float], count: int, left_behind: bool = False
) -> np.ndarray:
    """The cart's place under 0.3 N, the rider a mass of its own, without a drive's steps.

    It begins with the cart, or at rest where it is left behind.
    """
    turn = 2 * np.pi * HERTZ
    k, c = mass * turn**2, 2 * RATIO * turn * mass
    inertia = np.diag([MASS, mass])
    stiffness = np.array([[STIFFNESS + k, -k], [-k, k]])
    damping = np.array([[DAMPING + c, -c], [-c, c]])
    a = np.zeros((5, 5))
    a[:2, 2:4] = np.eye(2)
    a[2:4, :2], a[2:4, 2:4] = (-np.linalg.solve(inertia, m) for m in (stiffness, damping))
    a[2:4, 4] = np.linalg.solve(inertia, [0.3, 0.0])
    x0, v0 = np.zeros(2) if left_behind else start
    step, x = expm(a * STEP), np.array([start[0], x0, start[1], v0, 1.0])
    found = []
    for _ in range(count):
        found.append(x[0])
        x = step @ x
    return np.array(found)


@pytest.mark.parametrize("start", [(0.1, 0.0), (0.0, 0.4)])
def test_a_rider_is_a_second_mass(start):
    count = 1500
    inputs = jnp.full((count, 1), 0.3)
    wanted = two_masses(RIDER, start, count)
    z = vector((RIDER, HERTZ, RATIO), start)
    found = np.asarray(simulate(plant(), 4, z, inputs, jnp.asarray(STEP), CORNERS))[:, 0]
    plain = np.asarray(
        simulate(plant(), 4, vector((0.0,) * 3, start), inputs, jnp.asarray(STEP), CORNERS)
    )
    size = np.max(np.abs(wanted))
    assert np.max(np.abs(plain[:, 0] - wanted)) > 0.1 * size, "the rider matters here"
    assert np.max(np.abs(found - wanted)) < 2e-6 * size


def test_a_blow_leaves_the_rider_behind():
    start, count = (0.002, 0.6), 1500
    z = vector((RIDER, HERTZ, RATIO), start)
    z[plant().slots["since"]] = STEP
    inputs = jnp.full((count, 1), 0.3)
    found = np.asarray(simulate(plant(), 4, z, inputs, jnp.asarray(STEP), CORNERS))[:, 0]
    wanted, along = (two_masses(RIDER, start, count, left) for left in (True, False))
    size = np.max(np.abs(wanted))
    assert np.max(np.abs(along - wanted)) > 0.02 * size, "how it began matters here"
    assert np.max(np.abs(found - wanted)) < 2e-6 * size


def test_a_rider_damped_beyond_the_critical_follows_too():
    law = library()["extra_mode"].memory
    assert law is not None
    for ratio in (0.3, 1.0, 1.7):
        shapes, turn, h = [np.float64(3.0), np.float64(ratio)], 6 * np.pi, 0.02
        # x = a t^2 / 2 + j t^3 / 6 from rest
        a, j = 2.0, -30.0
        matrix = np.array(
            [[0, 1, 0, 0], [-(turn**2), -2 * ratio * turn, -1, 0], [0, 0, 0, 1], [0, 0, 0, 0]]
        )
        wanted = (expm(matrix * h) @ [0.01, -0.2, a, j])[:2]
        after = np.array([a * h**2 / 2 + j * h**3 / 6]), np.array([a * h + j * h**2 / 2])
        begun = np.array([[0.01], [-0.2]])
        found = law.advance(shapes, begun, (np.zeros(1), np.zeros(1)), after, h)
        np.testing.assert_allclose(np.asarray(found)[:, 0], wanted, rtol=1e-9)


def test_derivatives_by_mass_frequency_and_ratio_are_those_of_differences():
    start, count = (0.1, 0.2), 400
    z, inputs = vector((RIDER, HERTZ, RATIO), start), jnp.full((count, 1), 0.3)
    varied = np.flatnonzero(z[plant().slots["strengths"]]) + plant().slots["strengths"].start
    directions = np.zeros((len(varied), plant().size))
    directions[np.arange(len(varied)), varied] = 1.0
    found = np.asarray(tangents(plant(), 2, z, directions, inputs, jnp.asarray(STEP), CORNERS))
    for row, at in enumerate(varied):
        up, down = z.copy(), z.copy()
        up[at], down[at] = z[at] * (1 + 1e-6), z[at] * (1 - 1e-6)
        pair = [
            np.asarray(simulate(plant(), 2, one, inputs, jnp.asarray(STEP), CORNERS))
            for one in (up, down)
        ]
        wanted = (pair[0] - pair[1])[:, 0] / (2e-6 * z[at])
        np.testing.assert_allclose(found[row, :, 0], wanted, atol=2e-6 * np.max(np.abs(wanted)))


def test_a_rider_that_is_shaken_steadily_only_takes_energy():
    law = library()["extra_mode"].memory
    assert law is not None
    shapes = [jnp.asarray(HERTZ), jnp.asarray(RATIO)]

    @jax.jit
    def forces(x, v):
        def step(memory, ends):
            memory = law.advance(shapes, memory, *ends, STEP)
            return memory, law.force(1.0, shapes, memory, *ends[1])[0]

        ends = ((x[:-1, None], v[:-1, None]), (x[1:, None], v[1:, None]))
        return jax.lax.scan(step, jnp.zeros((2, 1)), ends)[1]

    for hertz in (2.0, 6.9, 7.0, 7.1, 20.0):
        times = np.arange(20001) * STEP
        x, v = np.sin(2 * np.pi * hertz * times), np.cos(2 * np.pi * hertz * times)
        force = np.append(0.0, forces(x, 2 * np.pi * hertz * v))
        late = slice(15000, None)  # 5 s, a whole number of turns, after it has settled
        work = np.sum(0.5 * (force[:-1] + force[1:])[late] * np.diff(x)[late])
        assert work > 0.0


def test_frequencies_that_are_tried_lie_a_resonance_apart_and_above_the_main_one():
    shape = library()["extra_mode"].shapes[0]
    tried = np.array(shape.trials(SCALES)) * 2 * np.pi * SCALES.time
    assert tried[0] == pytest.approx(1.3) and 10 < tried[-1] < 15
    assert np.all(np.diff(np.log(tried)) < 0.08)


@pytest.mark.slow
def test_a_rider_on_a_robots_head_rings_in_what_its_sensors_read():
    """At the clubhead and at the collet, from the door, against a robot of one mass more."""
    robot, numbers = Robot("pinned_wrist"), PRESETS["robo_v_sleeve_50"]
    times = np.arange(600) * STEP
    ports = (Port("clubhead", "position"), Port("collet", "angle"))
    blow = impact("clubhead", 40.0, 0.02, 0.004)
    rows = robot.rows(numbers)
    inertias = np.asarray(rows.inertias)
    n = len(robot.coordinates)
    for place, mass in (("clubhead", 0.01), ("collet", 0.004)):
        port = ports[0 if place == "clubhead" else 1]
        row = np.asarray(robot.sensor_row(place, port.quantity, "absolute", numbers))[:n]
        given = {"mass": mass, "frequency": 12.0, "damping_ratio": RATIO}
        tables = ({"law": "extra_mode", "place": place, "parameters": given},)
        found = respond(robot, numbers, blow, times, ports, tables)
        assert found.status == CONVERGED
        whole = np.zeros((3, n + 1, n + 1))
        velocity = np.asarray(rows.inertia_rows)[:, :n]
        stretch = np.asarray(rows.spring_rows)[:, :n]
        whole[0, :n, :n] = velocity.T @ (inertias[:, None] * velocity)
        whole[1, :n, :n] = stretch.T @ (np.asarray(rows.stiffnesses)[:, None] * stretch)
        whole[2, :n, :n] = stretch.T @ (np.asarray(rows.dampings)[:, None] * stretch)
        apart = np.append(row, -1.0)
        turn = 2 * np.pi * 12.0
        whole[0, n, n] = mass
        whole[1] += mass * turn**2 * np.outer(apart, apart)
        whole[2] += 2 * RATIO * turn * mass * np.outer(apart, apart)
        push = np.append(np.asarray(robot.force_row("clubhead", numbers)), 0.0)
        wanted = struck(whole, push, 0.0 * push, len(times))
        for column, one in enumerate(ports):
            seen = np.asarray(robot.sensor_row(one.place, one.quantity, "absolute", numbers))[:n]
            read = wanted[:, :n] @ seen
            gap = np.max(np.abs(found.samples[:, column] - read))
            assert gap < 3e-5 * np.max(np.abs(read))
