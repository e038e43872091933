"""Responses: against scipy's integrators, of the order promised, with exact derivatives."""

from functools import partial
from itertools import pairwise

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from supple.model.chain import Chain
from supple.model.linear import Port
from supple.model.plant import Plant, numbers_vector
from supple.model.respond import simulate, state_history, still_tangents, tangents
from supple.model.robot import PRESETS, Robot
from tests.model.test_energies import club
from tests.reference.thesis_models import equations_8_to_10

CART = Chain(("cart",), (("spring", "ground", "cart"),))
PAIR = Chain(("a", "b"), (("left", "ground", "a"), ("mid", "a", "b")))
CART_NUMBERS = {
    "masses.cart.mass": 2.0,
    "links.spring.stiffness": 50.0,
    "links.spring.damping": 0.4,
}
PAIR_NUMBERS = {
    "masses.a.mass": 1.5,
    "masses.b.mass": 0.5,
    "links.left.stiffness": 80.0,
    "links.left.damping": 0.3,
    "links.mid.stiffness": 30.0,
    "links.mid.damping": 0.2,
}
WIDTHS = np.array([[1e-3, 0.05]])
STEP, COUNT = 0.05, 81
FORCED = Plant(
    CART,
    (Port("cart", "force"),),
    (Port("cart", "position"), Port("cart", "velocity"), Port("cart", "acceleration")),
    ("spring",),
)
"""One plant for all laws of a link: each test only moves other entries of z, and compiles once."""
STRENGTHS = {
    "asymmetric_stiffness": 12.0,
    "clearance": 0.03,
    "coulomb_friction": 0.8,
    "cubic_stiffness": 900.0,
    "linear_damping": 0.7,
    "linear_stiffness": 15.0,
    "quadratic_damping": 1.5,
}


def wave(count: int = COUNT, seed: int = 0) -> np.ndarray:
    """A smooth, lively input, shape (count, 1)."""
    rng = np.random.default_rng(seed)
    t = np.arange(count) * STEP
    parts = [a * np.sin(w * t + f) for a, w, f in rng.uniform(1, 5, size=(3, 3))]
    return np.sum(parts, axis=0)[:, None]


def vector(plant: Plant, numbers: dict[str, float], **parts) -> np.ndarray:
    """z with some of its slots filled; a strength is given by its law's name."""
    z = numbers_vector(plant, numbers)
    for name, value in parts.items():
        if name in plant.slots:
            z[plant.slots[name]] = value
        else:
            at = [(law.name, part) for _, law, part in plant.law_numbers].index((name, ""))
            z[plant.slots["strengths"].start + at] = value
    return z


def run(plant, z, inputs, substeps=0, step=STEP, widths=WIDTHS) -> np.ndarray:
    substeps = substeps or (2 if plant.law_places else 1)
    # one type of number for all, or the same plant would be compiled again
    numbers = [jnp.asarray(np.asarray(x, dtype=float)) for x in (z, inputs, step, widths)]
    return np.asarray(simulate(plant, substeps, *numbers))


def integrate(rhs, x0, inputs, held=False, step=STEP, method="DOP853", tight=1e-12) -> np.ndarray:
    """States at the samples: scipy from sample to sample, the input linear or held between."""
    states = [np.asarray(x0, dtype=float)]
    for now, then in pairwise(inputs):
        slope = 0.0 * now if held else (then - now) / step

        def along(t, x, now=now, slope=slope):
            return rhs(x, now + slope * t, slope)

        part = solve_ivp(along, (0, step), states[-1], method, rtol=tight, atol=1e-13)
        states.append(part.y[:, -1])
    return np.array(states)


def close(found, wanted, digits: float = 1e-9) -> None:
    """Every sample within `digits` of the column's largest."""
    found, wanted = np.asarray(found), np.asarray(wanted)
    size = np.abs(wanted).max(axis=0, keepdims=True)
    worst = np.max(np.abs(found - wanted) / size)
    assert worst < digits, f"{worst:.2e} of the largest value"


# --- the linear part ---------------------------------------------------------------------------


def pair_rates(x, force, ground, ground_rate):
    """Newton's second law for the two masses, written by hand."""
    p = PAIR_NUMBERS
    left = p["links.left.stiffness"] * (x[0] - ground)
    left += p["links.left.damping"] * (x[2] - ground_rate)
    mid = p["links.mid.stiffness"] * (x[1] - x[0]) + p["links.mid.damping"] * (x[3] - x[2])
    return (mid - left) / p["masses.a.mass"], (force - mid) / p["masses.b.mass"]


PAIR_SENSORS = (
    Port("b", "position"),
    Port("a", "velocity"),
    Port("b", "acceleration"),
    Port("mid", "position"),
    Port("a", "acceleration"),
)


def pair_readings(states, forces, grounds, ground_rates) -> np.ndarray:
    seen = [pair_rates(*now) for now in zip(states, forces, grounds, ground_rates)]
    a, b = np.array(seen).T
    return np.column_stack([states[:, 1], states[:, 2], b, states[:, 1] - states[:, 0], a])


@pytest.mark.parametrize("held", [False, True])
def test_forces_linear_or_held_between_samples(held):
    plant = Plant(PAIR, (Port("b", "force", held=held),), PAIR_SENSORS)
    start = [0.1, -0.05, 0.2, 0.3]
    force = wave()

    def rates(x, f, slope):
        return [x[2], x[3], *pair_rates(x, f[0], 0.0, 0.0)]

    states = integrate(rates, start, force, held)
    zero = np.zeros(COUNT)
    found = run(plant, vector(plant, PAIR_NUMBERS, start=start), force, widths=np.zeros((0, 2)))
    close(found[:, :-1], pair_readings(states, force[:, 0], zero, zero))
    np.testing.assert_array_equal(found[:, -1], 0.0)


def test_force_between_two_masses_acts_on_both():
    plant = Plant(PAIR, (Port("mid", "force"),), PAIR_SENSORS)
    force = wave(21)

    def rates(x, f, slope):
        a, b = pair_rates(x, f[0], 0.0, 0.0)
        return [x[2], x[3], a - f[0] / PAIR_NUMBERS["masses.a.mass"], b]

    states = integrate(rates, np.zeros(4), force)
    found = run(plant, vector(plant, PAIR_NUMBERS), force, widths=np.zeros((0, 2)))
    close(found[:, :2], states[:, 1:3])


@pytest.mark.parametrize(
    "quantity, held",
    [("position", True), ("velocity", False), ("velocity", True), ("acceleration", False)],
)
def test_ground_moved_by_position_velocity_or_acceleration(quantity, held):
    port = Port("ground", quantity, held=held)
    plant = Plant(PAIR, (port,), (*PAIR_SENSORS, Port("ground", "position")))
    motion = 0.05 * wave(seed=1)
    own = {"position": [0.0], "velocity": [0.02], "acceleration": [0.02, -0.1]}[quantity]
    start = [0.1, -0.05, 0.2, 0.3, *own]
    first = list(start)
    if quantity == "position":
        first[4] += motion[0, 0]  # its state begins where the record does

    def rates(x, w, slope):
        if quantity == "position":
            ground, rate, more = x[4], slope[0], [slope[0]]
        elif quantity == "velocity":
            ground, rate, more = x[4], w[0], [w[0]]
        else:
            ground, rate, more = x[4], x[5], [x[5], w[0]]
        return [x[2], x[3], *pair_rates(x, 0.0, ground, rate), *more]

    between = held and quantity != "position"  # a position is joined by lines, come what may
    states = integrate(rates, first, motion, between)
    z = vector(plant, PAIR_NUMBERS, start=start)
    found = run(plant, z, motion, widths=np.zeros((0, 2)))
    slope = np.diff(motion[:, 0]) / STEP
    mean = (np.concatenate([slope[:1], slope]) + np.concatenate([slope, slope[-1:]])) / 2
    rate = {"position": mean, "velocity": motion[:, 0], "acceleration": states[:, -1]}[quantity]
    wanted = pair_readings(states, np.zeros(COUNT), states[:, 4], rate)
    close(found[:, :-1], np.column_stack([wanted, states[:, 4]]))


def test_offsets_of_inputs_act_unless_they_only_move_the_start():
    shifted = wave() + 0.3
    z = vector(FORCED, CART_NUMBERS, drive=0.3)
    wanted = run(FORCED, vector(FORCED, CART_NUMBERS), shifted)
    close(run(FORCED, z, wave())[:, :-1], wanted[:, :-1], 1e-12)
    plant = Plant(CART, (Port("ground", "position"),), (Port("cart", "position"),))
    bare, none = numbers_vector(plant, CART_NUMBERS), np.zeros((0, 2))
    moved = vector(plant, CART_NUMBERS, drive=0.3)
    np.testing.assert_array_equal(
        run(plant, moved, wave(), widths=none), run(plant, bare, wave(), widths=none)
    )


def test_the_last_reading_of_each_sensor_is_scaled_and_set_off():
    z = vector(FORCED, CART_NUMBERS, start=[0.1, 0.0])
    plain = run(FORCED, z, wave())[:, :-1]
    z = vector(
        FORCED, CART_NUMBERS, start=[0.1, 0.0], gain=[0.1, 0.0, -0.2], offset=[0.0, 3.0, 1.0]
    )
    faulty = run(FORCED, z, wave())[:, :-1]
    close(faulty, plain * [1.1, 1.0, 0.8] + [0.0, 3.0, 1.0], 1e-13)


ROBOT = Plant(
    Robot("fixed_collet"),
    (Port("clubhead", "force"),),
    (Port("clubhead", "acceleration", "collet"), Port("clubhead", "position", "collet")),
)


def robot_matrices(preset: str):
    p = PRESETS[preset]
    both = {
        f"sleeve_{what}_{which}": p[f"sleeve_{what}"]
        for what in ("stiffness", "damping")
        for which in ("upper", "lower")
    }
    return equations_8_to_10(club(p | both))


def test_robot_on_a_stiff_sleeve_follows_radau():
    mass, damping, stiffness = robot_matrices("robo_v_sleeve_25")
    inverse = np.linalg.inv(mass)
    step, force = 0.0005, 20.0 * wave(25)
    whole = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ damping]])
    assert np.linalg.eigvals(whole).real.min() < -1e5, "stiff"

    def rates(x, w, slope):
        return whole @ x + np.array([0, 0, 0, 0, inverse[1, 1] * w[0], 0])

    start = np.array([0.0, 0.15, 0.0, 0.0, 0.0, 0.0])  # x_G, x_cl, theta_G and rates
    wanted = integrate(rates, start, force, step=step, method="Radau", tight=1e-11)
    acceleration = [rates(x, w, 0)[4] for x, w in zip(wanted, force)]
    z = vector(ROBOT, PRESETS["robo_v_sleeve_25"], start=[0, 0, 0.15, 0, 0, 0])
    found = run(ROBOT, z, force, step=step, widths=np.zeros((0, 2)))
    close(found[:, 1], wanted[:, 1], 1e-9)
    close(found[:, 0], acceleration, 1e-8)  # Radau's own error in the jump of the grip


@pytest.mark.parametrize("preset", ["robo_v", "robo_v_rigid", "robo_v_sleeve_25"])
def test_eight_seconds_of_decay_are_the_sum_of_modes(preset):
    mass, damping, stiffness = robot_matrices(preset)
    inverse = np.linalg.inv(mass)
    whole = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ damping]])
    poles, shapes = np.linalg.eig(whole)
    start = np.array([0.0, 0.15, 0.0, 0.0, 0.0, 0.0])
    share = np.linalg.solve(shapes, start)
    rate, count = 2048.0, 16384
    times = np.arange(count) / rate
    wanted = ((shapes[1] * share) * np.exp(np.outer(times, poles))).sum(axis=1).real
    z = vector(ROBOT, PRESETS[preset], start=[0, 0, 0.15, 0, 0, 0])
    found = run(ROBOT, z, np.zeros((count, 1)), step=1 / rate, widths=np.zeros((0, 2)))
    close(found[:, 1], wanted, 1e-9)


def test_wrist_that_is_pinned_keeps_to_lagrange():
    """Sensors in both frames, a torque at the wrist, eq. 36 turned into a first-order system."""
    plant = Plant(
        Robot("pinned_wrist"),
        (Port("wrist", "torque"),),
        (Port("clubhead", "position", "absolute"), Port("clubhead", "position", "collet")),
    )
    p = PRESETS["robo_v"]
    rows = plant.mechanism.rows(p, np)
    j, g = rows.inertia_rows[:, :4], rows.spring_rows[:, :4]
    mass, stiffness = j.T @ np.diag(rows.inertias) @ j, g.T @ np.diag(rows.stiffnesses) @ g
    inverse = np.linalg.inv(mass)
    whole = np.block(
        [
            [np.zeros((4, 4)), np.eye(4)],
            [-inverse @ stiffness, -inverse @ g.T @ np.diag(rows.dampings) @ g],
        ]
    )
    torque, step = 0.5 * wave(40), 0.002
    push = np.concatenate([np.zeros(4), inverse[:, 0]])
    wanted = integrate(
        lambda x, w, slope: whole @ x + push * w[0],
        np.zeros(8),
        torque,
        step=step,
        method="Radau",
        tight=1e-11,
    )
    found = run(plant, vector(plant, p), torque, step=step, widths=np.zeros((0, 2)))
    head = p["sleeve_offset"] + p["sleeve_spacing"] / 2 + p["club_length"] - p["grip_length"] / 2
    close(found[:, 1], wanted[:, 3], 1e-8)
    close(found[:, 0], wanted[:, 3] + head * wanted[:, 0], 1e-8)


def test_longer_records_begin_like_shorter_ones():
    force = wave()
    padded = np.concatenate([force, np.repeat(force[-1:], 47, axis=0)])
    for forces in ({}, {"cubic_stiffness": 900.0, "coulomb_friction": 0.8}):
        z = vector(FORCED, CART_NUMBERS, start=[0.1, -0.2], **forces)
        np.testing.assert_allclose(
            run(FORCED, z, padded, 2)[:COUNT], run(FORCED, z, force, 2), rtol=1e-12, atol=1e-13
        )


def test_history_holds_states_and_forces_of_the_laws():
    z = vector(FORCED, CART_NUMBERS, start=[0.1, -0.2], cubic_stiffness=900.0)
    arguments = jnp.asarray(wave()), STEP, jnp.asarray(WIDTHS)
    states, forces, _ = state_history(FORCED, 2, jnp.asarray(z), *arguments)
    assert states.shape == (COUNT, 2) and forces.shape == (COUNT, 1)
    close(states, run(FORCED, z, wave(), 2)[:, :2], 1e-12)
    close(forces[:, 0], 900.0 * states[:, 0] ** 3, 1e-3)


# --- derivatives -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "strengths",
    [
        {},
        {"cubic_stiffness": 900.0, "coulomb_friction": 0.8, "clearance": 0.02},
        STRENGTHS,
    ],
    ids=["null", "three laws", "all laws"],
)
def test_tangents_are_the_central_differences_of_every_slot(strengths):
    parts = {"start": [0.1, -0.2], "drive": 0.1, "offset": [0.1, 0.2, 0.3]}
    parts |= {"gain": [0.01, -0.02, 0.03], "delay": [0.3 * STEP, -0.6 * STEP, 1.4 * STEP]}
    z = vector(FORCED, CART_NUMBERS, **parts, **strengths)
    sizes = np.where(np.abs(z) > 0, np.abs(z), 0.1)
    low = FORCED.slots["strengths"].start
    for at, (_, law, part) in enumerate(FORCED.law_numbers):
        sizes[low + at] = 0.1 if part else STRENGTHS.get(law.name, 1.0)
    sizes[FORCED.slots["delay"]] = STEP
    move = partial(run, FORCED, inputs=wave(), substeps=2)
    directions = jnp.asarray(np.diag(sizes))
    found = np.asarray(
        tangents(
            FORCED,
            2,
            jnp.asarray(z),
            directions,
            jnp.asarray(wave()),
            jnp.asarray(STEP),
            jnp.asarray(WIDTHS),
        )
    )
    assert found.shape == (FORCED.size, COUNT, 3)
    tiny = 1e-4
    for at, size in enumerate(sizes):
        step = np.zeros(len(z))
        step[at] = size
        # fourth order, so that the difference itself is good to what is asked
        near = move(z + tiny * step) - move(z - tiny * step)
        far = move(z + 2 * tiny * step) - move(z - 2 * tiny * step)
        wanted = ((8 * near - far) / (12 * tiny))[:, :-1]
        worst = np.max(np.abs(found[at] - wanted)) / max(np.max(np.abs(wanted)), 1e-12)
        assert worst < 1e-6, f"entry {at} of z: {worst:.1e}"


@pytest.mark.slow
def test_tangents_of_a_ground_that_is_moved():
    plant = Plant(
        CART,
        (Port("ground", "velocity"),),
        (Port("spring", "velocity"), Port("cart", "acceleration")),
        ("spring",),
    )
    z = vector(plant, CART_NUMBERS, start=[0.1, 0.0, 0.05], quadratic_damping=1.0, drive=0.05)
    arguments = jnp.asarray(wave(31)), jnp.asarray(STEP), jnp.asarray(WIDTHS)
    sizes = np.where(np.abs(z) > 0, np.abs(z), 0.1)
    found = np.asarray(tangents(plant, 1, jnp.asarray(z), np.diag(sizes), *arguments))
    for at in range(plant.slots["offset"].start):
        step = np.zeros(len(z))
        step[at] = 1e-5 * sizes[at]
        up, down = (run(plant, z + sign * step, wave(31), 1) for sign in (1, -1))
        wanted = (up - down)[:, :-1] / 2e-5
        worst = np.max(np.abs(found[at] - wanted)) / max(np.max(np.abs(wanted)), 1e-12)
        assert worst < 1e-6, f"entry {at} of z: {worst:.1e}"


@pytest.mark.parametrize("held", [False, True], ids=["position", "held velocity"])
def test_still_tangents_are_those_with_the_numbers_held(held):
    port = Port("ground", "velocity", held=True) if held else Port("ground", "position")
    sensors = (Port("spring", "velocity"), Port("cart", "acceleration"))
    plant = Plant(CART, (port,), sensors)
    parts = {"offset": [0.1, -0.2], "gain": [0.01, -0.02], "delay": [0.3 * STEP, -0.6 * STEP]}
    z = vector(plant, CART_NUMBERS, start=[0.1, 0.0, 0.05], drive=0.05, **parts)
    directions = np.eye(plant.size)
    told = jnp.asarray(wave(31)), jnp.asarray(STEP)
    found = np.asarray(still_tangents(plant, z, directions, *told))
    directions[:, plant.slots["numbers"]] = 0.0
    wanted = np.asarray(tangents(plant, 1, z, directions, *told, np.zeros((0, 2))))
    numbers = plant.slots["numbers"].stop
    assert np.all(found[:numbers] == 0.0)
    seen = np.max(np.abs(wanted[numbers : plant.slots["delay"].stop]), axis=(1, 2)) > 0.0
    seen[plant.slots["drive"].start - numbers] |= not held  # where a position is zero moves nothing
    assert np.all(seen)
    np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12)


# --- delays ------------------------------------------------------------------------------------


def test_a_delayed_sensor_tells_late():
    late = vector(FORCED, CART_NUMBERS, start=[0.1, 0.0], delay=[2 * STEP, 0.0, 0.0])
    plain = vector(FORCED, CART_NUMBERS, start=[0.1, 0.0])
    found, on_time = run(FORCED, late, wave()), run(FORCED, plain, wave())
    np.testing.assert_allclose(found[2:, 0], on_time[:-2, 0], rtol=1e-12)
    np.testing.assert_array_equal(found[:, 1:], on_time[:, 1:])


def test_linear_motions_refuse_substeps_that_would_be_wasted():
    plant = Plant(CART, (), (Port("cart", "position"),))
    with pytest.raises(ValueError, match="expected substeps = 1"):
        run(plant, vector(plant, CART_NUMBERS), np.zeros((20, 0)), 2, widths=np.zeros((0, 2)))


def test_slots_cover_the_vector_without_gap():
    ends = [(part.start, part.stop) for part in FORCED.slots.values()]
    assert ends[0][0] == 0 and ends[-1][1] == FORCED.size
    assert all(a[1] == b[0] for a, b in pairwise(ends))
    assert FORCED.numbers(jnp.arange(FORCED.size))["links.spring.damping"] == 2
