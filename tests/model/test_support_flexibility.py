"""A support that gives way is a mass on a spring between ground and collet: law against that."""

from typing import cast

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from supple.identification.null_forces import Spot, unit_forces
from supple.identification.prepare import Prepared
from supple.model.drives import impact, release
from supple.model.law import Place, library
from supple.model.linear import Port
from supple.model.motion import CONVERGED, respond
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import simulate, tangents
from supple.model.robot import PRESETS, Robot
from tests.model.struck import STEP, struck

HERTZ, RATIO = 15.0, 0.03
NUMBERS = PRESETS["robo_v_sleeve_50"]
LAW = library()["support_flexibility"]


def compliance(share: float = 0.05) -> float:
    """Share of what the shaft gives way by [m/N]."""
    return share / float(NUMBERS["shaft_stiffness"])


def table(share: float = 0.05) -> tuple[dict, ...]:
    given = {"compliance": compliance(share), "frequency": HERTZ, "damping_ratio": RATIO}
    return ({"law": "support_flexibility", "place": "base", "parameters": given},)


def with_support(robot: Robot, share: float) -> np.ndarray:
    """Mass, stiffness and damping, (3, n + 1, n + 1): the sleeve's lower end is the last one."""
    rows, n = robot.rows(NUMBERS), len(robot.coordinates)
    velocity = np.asarray(rows.inertia_rows)[:, :n]
    stretch = np.column_stack([np.asarray(rows.spring_rows)[:, :n], np.zeros(len(robot.springs))])
    stretch[[place == "sleeve" for place in robot.springs], n] = -1.0
    whole = np.zeros((3, n + 1, n + 1))
    whole[0, :n, :n] = velocity.T @ (np.asarray(rows.inertias)[:, None] * velocity)
    whole[1] = stretch.T @ (np.asarray(rows.stiffnesses)[:, None] * stretch)
    whole[2] = stretch.T @ (np.asarray(rows.dampings)[:, None] * stretch)
    turn, spring = 2 * np.pi * HERTZ, 1 / compliance(share)
    whole[0, n, n] = spring / turn**2
    whole[1, n, n] += spring
    whole[2, n, n] += 2 * RATIO * spring / turn
    return whole


def read(robot: Robot, motion: np.ndarray, port: Port) -> np.ndarray:
    n = len(robot.coordinates)
    row = np.asarray(robot.sensor_row(port.place, port.quantity, "absolute", NUMBERS))[:n]
    return motion[:, :n] @ row


@pytest.mark.parametrize(
    ("model", "share"),
    [pytest.param("fixed_collet", 0.1, marks=pytest.mark.slow), ("pinned_wrist", 0.01)],
)
def test_a_blow_is_felt_as_by_a_robot_on_a_sprung_foot(model, share):
    robot, times = Robot(model), np.arange(600) * STEP
    ports = (Port("clubhead", "position"), Port("grip", "position"))
    push = np.append(np.asarray(robot.force_row("clubhead", NUMBERS)), 0.0)
    blow = impact("clubhead", 40.0, 0.02, 0.004)
    found = respond(robot, NUMBERS, blow, times, ports, table(share))
    rigid = respond(robot, NUMBERS, blow, times, ports)
    assert found.status == CONVERGED
    start = np.zeros(len(push))
    wanted = struck(with_support(robot, share), push, start, len(times))
    for column, port in enumerate(ports):
        seen = read(robot, wanted, port)
        size = np.max(np.abs(seen))
        assert np.max(np.abs(rigid.samples[:, column] - seen)) > 0.3 * share * size, "it matters"
        assert np.max(np.abs(found.samples[:, column] - seen)) < 2e-6 * size


@pytest.mark.slow
def test_it_is_let_go_from_the_way_that_support_and_club_share():
    robot, times, share = Robot("pinned_wrist"), np.arange(600) * STEP, 0.1
    port = Port("clubhead", "position")
    drive = release("clubhead", 0.02)
    found = respond(robot, NUMBERS, drive, times, (port,), table(share))
    whole = with_support(robot, share)
    push = np.append(np.asarray(robot.force_row("clubhead", NUMBERS)), 0.0)
    start = np.linalg.solve(whole[1], push)
    start *= 0.02 / (start[:-1] @ push[:-1])
    wanted = read(robot, struck(whole, 0.0 * push, start, len(times)), port)
    assert found.status == CONVERGED
    assert np.max(np.abs(found.samples[:, 0] - wanted)) < 2e-6 * 0.02


def vector(plant: Plant, numbers: tuple[float, ...]) -> np.ndarray:
    z = numbers_vector(plant, NUMBERS)
    symbols = ["", *(shape.symbol for shape in LAW.shapes)]
    for slot, (_, law, symbol) in enumerate(plant.law_numbers):
        if law is LAW:
            z[plant.slots["strengths"].start + slot] = numbers[symbols.index(symbol)]
    return z


@pytest.mark.slow
def test_derivatives_are_those_of_differences_and_finite_at_the_null():
    robot = Robot("pinned_wrist")
    ports = (Port("clubhead", "force"),), (Port("clubhead", "acceleration"),)
    plant = Plant(robot, *ports, ("base",))
    push = jnp.asarray(3.0 * np.sin(20.0 * np.arange(300) * STEP)[:, None])
    corners = jnp.full((1, 2), 1e-4)
    for size in (compliance(), 0.0):
        z = vector(plant, (size, HERTZ, RATIO))
        first = plant.slots["strengths"].start
        varied = [first, first + 1, first + 2][: 3 if size else 1]
        directions = np.zeros((len(varied), plant.size))
        directions[np.arange(len(varied)), varied] = 1.0
        step = jnp.asarray(STEP)
        found = np.asarray(tangents(plant, 2, z, directions, push, step, corners))
        for row, at in enumerate(varied):
            move = 1e-5 * (abs(z[at]) or compliance())
            up, down = z.copy(), z.copy()
            up[at], down[at] = z[at] + move, z[at] - move * bool(size)
            pair = [
                np.asarray(simulate(plant, 2, one, push, step, corners))[:, 0] for one in (up, down)
            ]
            wanted = (pair[0] - pair[1]) / (up[at] - down[at])
            near = (2e-5 if size else 1e-3) * np.max(np.abs(wanted))
            np.testing.assert_allclose(found[row, :, 0], wanted, atol=near)


def test_nothing_gives_way_at_the_null():
    robot, times = Robot("pinned_wrist"), np.arange(200) * STEP
    plant = Plant(
        robot, (Port("clubhead", "force"),), (Port("clubhead", "acceleration"),), ("base",)
    )
    push, step = jnp.asarray(np.sin(30.0 * times)[:, None]), jnp.asarray(STEP)
    one, other = (
        simulate(plant, 2, vector(plant, (0.0, f, 0.03)), push, step, jnp.full((1, 2), 1e-4))
        for f in (5.0, 15.0)
    )
    np.testing.assert_array_equal(np.asarray(one), np.asarray(other))


def test_a_support_that_is_shaken_steadily_only_takes_energy():
    law, here = LAW.memory, Place(2.4e5, 5.9e3, 0.0, 0.0)
    assert law is not None and law.placed
    for hertz in (2.0, 14.0, 15.0, 16.0, 60.0):
        times = np.arange(12001) * STEP
        x, v = np.sin(2 * np.pi * hertz * times), np.cos(2 * np.pi * hertz * times)
        v = 2 * np.pi * hertz * v
        shapes = law.shapes_at([HERTZ, RATIO], compliance(), here)

        def on(memory, ends, shapes=shapes):
            new = law.advance(shapes, memory, ends[:2], ends[2:], STEP)
            return new, law.force(compliance(), shapes, new, *ends[2:])[0]

        ends = tuple(part[:, None] for part in (x[:-1], v[:-1], x[1:], v[1:]))
        _, force = jax.lax.scan(on, jnp.zeros((2, 1)), ends)
        # with the sleeve's own share: what sleeve and support together take
        whole = here.stiffness * x[1:] + here.damping * v[1:] + np.asarray(force)
        last = slice(9000, 12000)  # 3 s, a whole number of turns, after it has settled
        assert np.sum(whole[last] * v[1:][last]) * STEP > 0.0


def test_its_slope_at_the_null_is_what_the_place_carries_felt_by_the_support():
    times = np.arange(800) * STEP
    stretch, rate = 1e-4 * np.sin(30.0 * times), 3e-3 * np.cos(30.0 * times)
    here = Place(2.4e5, 900.0, 0.0, 0.0)

    class Told:
        inputs, step, since = np.zeros((len(times), 0)), STEP, 0.0

    told, shapes = cast(Prepared, Told()), [[HERTZ, RATIO]]
    (found,) = unit_forces(LAW, shapes, [Spot(0, here, stretch, rate)], told)
    turn = 2 * np.pi * HERTZ
    bend = turn**2 / (turn**2 - 900.0 + 2j * RATIO * turn * 30.0)
    carried = (here.stiffness + 30j * here.damping) * -1e-4j
    wanted = np.real(-(here.stiffness + 30j * here.damping) * bend * carried * np.exp(30j * times))
    late = slice(600, None)  # the start has faded by then
    assert np.max(np.abs(found - wanted)[late]) < 0.12 * np.max(np.abs(wanted))
    slow = Place(2.4e5, 0.0, 0.0, 0.0)
    (still,) = unit_forces(LAW, shapes, [Spot(0, slow, 0 * times + 1e-4, 0 * times)], told)
    np.testing.assert_allclose(still, -(2.4e5**2) * 1e-4, rtol=1e-9)
