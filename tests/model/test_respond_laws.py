"""Responses under laws: against a tight integrator, closed forms, and with nothing at zero."""

import numpy as np
import pytest

from supple.model.chain import Chain
from supple.model.linear import Port
from supple.model.plant import Plant
from supple.model.robot import PRESETS
from tests.model.test_respond import (
    CART,
    CART_NUMBERS,
    COUNT,
    FORCED,
    ROBOT,
    STEP,
    STRENGTHS,
    WIDTHS,
    close,
    integrate,
    robot_matrices,
    run,
    vector,
    wave,
)

# --- laws --------------------------------------------------------------------------------------


def law_force(name: str, strength: float, d: float, v: float) -> float:
    """What resists, written again by hand, with the same rounding of corners."""
    width, slow = WIDTHS[0]
    k = CART_NUMBERS["links.spring.stiffness"]
    return {
        "asymmetric_stiffness": lambda: strength * d * np.tanh(d / width),
        "clearance": lambda: (
            -k / 2 * (np.hypot(d + strength, width) - np.hypot(d - strength, width))
        ),
        "coulomb_friction": lambda: strength * np.tanh(v / slow),
        "cubic_stiffness": lambda: strength * d**3,
        "linear_damping": lambda: strength * v,
        "linear_stiffness": lambda: strength * d,
        "quadratic_damping": lambda: strength * v * abs(v),
    }[name]()


def cart_rates(forces: dict[str, float], x, force: float) -> list[float]:
    p = CART_NUMBERS
    total = force - p["links.spring.stiffness"] * x[0] - p["links.spring.damping"] * x[1]
    total -= sum(law_force(name, s, x[0], x[1]) for name, s in forces.items())
    return [x[1], total / p["masses.cart.mass"]]


def exact_cart(forces: dict[str, float], start, inputs, step=STEP) -> np.ndarray:
    states = integrate(lambda x, w, slope: cart_rates(forces, x, w[0]), start, inputs, step=step)
    acceleration = [cart_rates(forces, x, w[0])[1] for x, w in zip(states, inputs)]
    return np.column_stack([states, acceleration])


def test_every_law_of_a_link_has_a_strength_here():
    assert {law.name for _, law in FORCED.laws if law.memory is None} == set(STRENGTHS)


@pytest.mark.parametrize("name", STRENGTHS)
def test_each_law_follows_a_tight_integrator(name):
    forces, start = {name: STRENGTHS[name]}, [0.1, -0.2]
    step = STEP / 10
    z = vector(FORCED, CART_NUMBERS, start=start, **forces)
    found = run(FORCED, z, wave(), 4, step)
    wanted = exact_cart(forces, start, wave(), step)
    plain = run(FORCED, vector(FORCED, CART_NUMBERS, start=start), wave(), 4, step)
    assert np.max(np.abs(plain[:, 0] - wanted[:, 0])) > 1e-3 * np.max(np.abs(wanted[:, 0]))
    close(found[:, :-1], wanted, 1e-6 if name in CORNERS else 1e-9)
    assert np.max(found[:, -1]) < 1e-6, "Newton has settled"


CORNERS = ("asymmetric_stiffness", "clearance", "coulomb_friction", "quadratic_damping")


def test_laws_add_up():
    forces = {"cubic_stiffness": 300.0, "quadratic_damping": 0.4, "linear_damping": 0.3}
    z = vector(FORCED, CART_NUMBERS, start=[0.1, 0.0], **forces)
    found = run(FORCED, z, wave(), 4, STEP / 10)
    close(found[:, :-1], exact_cart(forces, [0.1, 0.0], wave(), STEP / 10), 1e-6)


@pytest.mark.parametrize("damping", [100.0, 1e4, 1e5])
def test_a_damper_too_strong_for_the_step_does_not_drive_the_cart(damping):
    """Newton's steps halve a square's error from far: left unsettled, its force drove the cart."""
    z = vector(FORCED, CART_NUMBERS, start=[0.0, 5.0], quadratic_damping=damping)
    found = run(FORCED, z, np.zeros((COUNT, 1)), 1)
    speed = np.abs(found[:, 1])
    assert np.max(found[:, -1]) < 1e-3 * damping * np.max(speed) ** 2, "Newton has settled"
    assert np.max(speed) < 20.0 and np.max(speed[1:]) == speed[1] and speed[-1] < speed[1]


def test_the_error_of_a_cubic_spring_falls_with_the_fourth_power_of_the_step():
    forces, start = {"cubic_stiffness": 900.0}, [0.3, 0.0]
    wanted = exact_cart(forces, start, wave())
    z = vector(FORCED, CART_NUMBERS, start=start, **forces)
    errors = [
        np.max(np.abs(run(FORCED, z, wave(), substeps)[:, 0] - wanted[:, 0])) for substeps in (2, 4)
    ]
    order = np.log2(errors[0] / errors[1])
    assert order > 3.8, (errors, order)
    assert errors[-1] < 2e-4


def test_friction_on_a_ground_that_jerks_converges_too():
    """The rate that friction feels jumps at every sample; no digit may be lost by it."""
    plant = Plant(CART, (Port("ground", "position"),), (Port("cart", "position"),), ("spring",))
    motion = 0.05 * wave(41, seed=3)
    forces = {"cubic_stiffness": 900.0, "linear_damping": 2.0}

    def rates(x, w, slope):
        p, d, v = CART_NUMBERS, x[0] - w[0], x[1] - slope[0]
        total = p["links.spring.stiffness"] * d + p["links.spring.damping"] * v
        total += sum(law_force(name, s, d, v) for name, s in forces.items())
        return [x[1], -total / p["masses.cart.mass"]]

    wanted = integrate(rates, [0.1, 0.0], motion)
    z = vector(plant, CART_NUMBERS, start=[0.1, 0.0, 0.0], **forces)
    errors = [
        np.max(np.abs(run(plant, z, motion, substeps)[:, 0] - wanted[:, 0])) for substeps in (1, 4)
    ]
    assert errors[1] < errors[0] / 4**3.5, errors
    assert errors[1] < 1e-7, errors


def test_undamped_duffing_keeps_its_energy():
    p = CART_NUMBERS | {"links.spring.damping": 0.0}
    z = vector(FORCED, p, start=[0.3, 0.0], cubic_stiffness=400.0)
    found = run(FORCED, z, np.zeros((COUNT, 1)), 4, STEP / 4)
    d, v = found[:, 0], found[:, 1]
    energy = 2.0 * v**2 / 2 + 50.0 * d**2 / 2 + 400.0 * d**4 / 4
    assert np.ptp(energy) < 1e-8 * energy[0]


def test_duffing_turns_as_fast_as_its_closed_form():
    """Period of x'' + w2 x + e x^3 = 0 by the arithmetic-geometric mean."""
    amplitude, w2, e = 0.3, 25.0, 200.0
    high, low = 1.0, np.sqrt((w2 + e * amplitude**2 / 2) / (w2 + e * amplitude**2))
    for _ in range(6):
        high, low = (high + low) / 2, np.sqrt(high * low)
    period = 2 * np.pi / np.sqrt(w2 + e * amplitude**2) / high
    p = CART_NUMBERS | {"links.spring.damping": 0.0}
    z = vector(FORCED, p, start=[amplitude, 0.0], cubic_stiffness=400.0)
    found = run(FORCED, z, np.zeros((COUNT, 1)), 4, period / 20)
    close(found[20::20, 0], np.full(4, amplitude), 1e-7)


def test_null_laws_change_nothing():
    bare = Plant(CART, FORCED.inputs, FORCED.sensors)
    start = [0.1, -0.2]
    linear = run(bare, vector(bare, CART_NUMBERS, start=start), wave(), widths=np.zeros((0, 2)))
    null = run(FORCED, vector(FORCED, CART_NUMBERS, start=start), wave())
    close(null[:, :-1], linear[:, :-1], 1e-13)
    np.testing.assert_array_equal(null[:, -1], 0.0)


def test_robot_with_laws_at_sleeve_and_shaft_follows_radau():
    """Two rows of the sleeve and one of the shaft: three forces at once, and a stiff sleeve."""
    places = ("shaft", "sleeve")
    sensors = (Port("clubhead", "position", "collet"), Port("grip", "position"))
    plant = Plant(ROBOT.mechanism, (), sensors, places)
    mass, damping, stiffness = robot_matrices("robo_v")
    inverse, a, half = np.linalg.inv(mass), 1.09 - 0.125, 0.049 / 2
    rows = np.array([[-1, 1, -a], [1, 0, -half], [1, 0, half]])  # over x_G, x_cl, theta_G
    names = [(place, law.name + part) for place, law, part in plant.law_numbers]
    z = vector(plant, PRESETS["robo_v"], start=[0, 0, 0.15, 0, 0, 0])
    low = plant.slots["strengths"].start
    z[low + names.index(("shaft", "cubic_stiffness"))] = 2e3
    z[low + names.index(("sleeve", "coulomb_friction"))] = 5.0
    widths = np.array([[1e-3, 0.05], [1e-5, 5e-3]])

    def rates(x, w, slope):
        d, v = rows @ x[:3], rows @ x[3:]
        laws = np.array([2e3 * d[0] ** 3, *(5.0 * np.tanh(v[1:] / 5e-3))])
        force = -rows.T @ laws - stiffness @ x[:3] - damping @ x[3:]
        return np.concatenate([x[3:], inverse @ force])

    force, step = np.zeros((30, 0)), 1 / 8192
    start = [0, 0.15, 0, 0, 0, 0]
    wanted = integrate(rates, start, force, step=step, method="Radau", tight=1e-10)
    found = run(plant, z, force, 2, step, widths)
    close(found[:, 0], wanted[:, 1], 1e-7)
    close(found[:, 1], wanted[:, 0], 1e-4)
    z[plant.slots["strengths"]] = 0.0
    linear = np.abs(run(plant, z, force, 2, step, widths) - found)
    assert linear[:, 0].max() > 1e-3 * 0.15 and linear[:, 1].max() > 1e-2 * found[:, 1].max()


def test_gravity_on_a_pendulum_conserves_energy_far_over_the_top():
    chain = Chain(("bob",), (("pivot", "ground", "bob"),), rotation=True)
    plant = Plant(chain, (), (Port("bob", "angle"), Port("bob", "angular_velocity")), ("bob",))
    p = {"masses.bob.inertia": 0.5, "links.pivot.stiffness": 0.0, "links.pivot.damping": 0.0}
    z = vector(plant, p, start=[0.1, 6.0], gravity=4.0)
    found = run(plant, z, np.zeros((401, 0)), 4, 0.01)
    energy = 0.5 * 0.5 * found[:, 1] ** 2 - 4.0 * np.cos(found[:, 0])
    assert np.ptp(energy) < 1e-6 * np.abs(energy).max()
    assert found[-1, 0] > 2 * np.pi
