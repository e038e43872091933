"""Laws of what a told motion swings: to first order they are the planar robot's own terms."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import planar, swung
from supple.model.drives import Drive
from supple.model.energies import damping_matrix, mass_matrix, stiffness_matrix
from supple.model.law import library
from supple.model.linear import Port
from supple.model.motion import respond
from supple.model.planar_sensors import planar_samples, track_of
from supple.model.plant import Plant
from supple.model.prescribed import through
from supple.model.robot import PRESETS, Robot
from supple.model.swung import SWUNG_HEAD, Felt, SwungRows, first_moment, told_from
from supple.model.swung_plant import (
    force_at_rest,
    swings_of,
    swung_readings,
    swung_rows,
    told_at,
    told_within,
)

P = PRESETS["robo_v_sleeve_50"]
PULL = 7.3
ARM, WRIST = (-0.7, 8.0, 90.0), (-1.1, 14.0, -60.0)
"""Angle, rate and its rate of each joint [rad, rad/s, rad/s^2]."""
SWINGS = {"base_acceleration": "arm", "centrifugal_stiffening": SWUNG_HEAD, "gravity": "club"}
STRENGTH = {"base_acceleration": 1.0, "centrifugal_stiffening": 1.0,
            "gravity": PULL * first_moment(P)}  # fmt: skip
ROBOT = Robot("driven_arm")
WHOLE = (ARM[0] + WRIST[0], ARM[1] + WRIST[1], ARM[2] + WRIST[2])


def swing_of(name: str) -> Callable[..., Any]:
    swing = library()[name].swing
    assert swing is not None
    return swing


def joint(name: str, now: Any) -> tuple[str, Any, Any, Any]:
    angle, rate, bend = (jnp.asarray(x) for x in now)
    return name, angle, rate, bend


def told():
    joints = (joint("arm", ARM), joint("wrist", WRIST))
    return told_from(joints, P["arm_length"], first_moment(P), jnp.zeros(()))


def pulled(displaced, strength=STRENGTH):
    """Generalized forces of the laws at coordinates beyond what is told, shape (4,) [SI]."""
    total = jnp.zeros(4)
    for name, place in SWINGS.items():
        weights = jnp.asarray(swung.weights(place, P))
        rows = SwungRows(jnp.eye(len(weights))[0], weights)
        look = jnp.asarray([row for row, _ in swung.stretches(place, P)])
        force = swing_of(name)(strength[name], look @ displaced, told(), rows)
        total = total + jnp.asarray(swung.pushes(place, P)).T @ force
    return total


def planar_forces(displaced, rates, gains):
    """What inertia and weight ask of each coordinate, by the planar robot."""
    q = jnp.asarray([WHOLE[0], 0.0, 0.0, 0.0]) + displaced
    v, a = (jnp.asarray([x, 0.0, 0.0, 0.0]) for x in WHOLE[1:])
    pivot = planar.pivot_acceleration(P, ARM, PULL, jnp)
    axes = jnp.cos(q[0]), jnp.sin(q[0])
    return jnp.asarray(planar.inertia_forces(P, q, v + rates, a + gains, pivot, axes))


def test_at_their_own_strengths_the_laws_are_the_planar_terms_to_first_order():
    mass = np.asarray(mass_matrix(ROBOT.rows(P)))
    rest = jnp.zeros(4)
    carried = mass[:4, 0] * WHOLE[2] + mass[:4, 4] * ARM[2]
    whole = planar_forces(rest, rest, rest)
    np.testing.assert_allclose(carried + pulled(rest), whole, rtol=1e-9, atol=1e-9)
    assert np.abs(pulled(rest)).max() > 0.5 * np.abs(carried).max()
    slope = jax.jacfwd(planar_forces, argnums=(0, 1, 2))(rest, rest, rest)
    stiff = np.asarray(jax.jacfwd(pulled)(rest))
    np.testing.assert_allclose(stiff, slope[0], atol=1e-9 * np.abs(stiff).max())
    np.testing.assert_allclose(slope[1], 0.0, atol=1e-9 * np.abs(stiff).max())
    np.testing.assert_allclose(slope[2], mass[:4, :4], atol=1e-9)
    assert stiff[3, 3] > 0.3 * P["shaft_stiffness"]


@pytest.mark.parametrize(
    ("place", "frame"),
    [(place, frame) for place in ("clubhead", "grip") for frame in ("absolute", "collet")]
    + [("collet", "absolute")],
)
def test_a_rider_on_the_club_reads_what_the_planar_sensor_reads(place, frame):
    port = Port(place, "acceleration", frame)
    plant = Plant(ROBOT, (Port("arm", "angular_acceleration"),
                          Port("wrist", "angular_acceleration")), (port,))  # fmt: skip
    rng = np.random.default_rng(3)
    row = np.asarray(ROBOT.sensor_row(place, "acceleration", frame, P))
    off = []
    for small in (1e-3, 1e-4):
        d, gains = small * rng.normal(size=4) * [1, 0.01, 1, 1], rng.normal(size=4)
        q, v, a = (np.array([x, 0, 0, 0.0]) for x in WHOLE)
        x = jnp.asarray([*(q + d), *v, ARM[0], ARM[1], WRIST[0], WRIST[1]])[None]
        w = jnp.asarray([[ARM[2], WRIST[2]]])
        signals = np.array([[ARM[0], WRIST[0], ARM[1], WRIST[1], ARM[2], 0, 0, 0]])
        full = planar_samples(P, track_of((q + d)[None], v[None], (a + gains)[None], signals), port)
        linear = row @ [*(a + gains), ARM[2], WRIST[2]]
        more = float(swung_readings(plant, P, STRENGTH, x, w)[0, 0])
        off.append(abs(full[0] - linear - more) / small)
        assert place == "collet" or abs(more) > 10 * abs(full[0] - linear - more)
        none = swung_readings(plant, P, {}, x, w)
        np.testing.assert_array_equal(none, 0.0)
    assert off[1] < 0.2 * off[0] + 1e-6  # what is left goes with the square


def test_what_is_told_inside_a_step_is_what_is_told_at_its_nodes():
    plant = Plant(ROBOT, (Port("wrist", "angular_acceleration"),
                          Port("arm", "angular_acceleration")), ())  # fmt: skip
    step, x = 0.01, jnp.asarray([0.0] * 8 + [WRIST[0], WRIST[1], ARM[0], ARM[1]])
    w = jnp.asarray([WRIST[2], ARM[2]]), jnp.asarray([10.0, 30.0])
    here = told_at(plant, P, x, w[0])
    for part, wanted in zip(here, told(), strict=True):
        np.testing.assert_allclose(np.ravel(part), np.ravel(wanted), rtol=1e-12)
    inside = told_within(plant, P, x, w, jnp.asarray(step))
    fine = np.linspace(0, step, 20001)
    for at, row in ((0.5, 0), (1.0, 1)):
        bend = ARM[2] + (30.0 - ARM[2]) * fine / step
        kept = fine <= at * step + 1e-12
        rate = ARM[1] + np.trapezoid(bend[kept], fine[kept])
        np.testing.assert_allclose(inside.rate[row, 0], rate, rtol=1e-8)
        np.testing.assert_allclose(inside.bend[row, 0], bend[kept][-1], rtol=1e-8)
    spun = np.asarray(inside.spin[1, 0] - here.spin[0])
    gained = step * (ARM[2] + 30.0 + WRIST[2] + 10.0) / 2
    np.testing.assert_allclose(spun, gained, rtol=1e-9)


def swung_drive() -> Drive:
    times = np.linspace(0.0, 0.6, 61)
    arm = -1.5 + 1.2 * (1 - np.cos(np.pi * times / 0.6))
    wrist = -1.2 + 0.8 * times / 0.6 * arm**2
    at, along = times.tolist(), {"arm": arm.tolist(), "wrist": wrist.tolist()}
    return Drive(joints=tuple(through(name, at, told, 0.6) for name, told in along.items()))


TIMES = np.linspace(0.0, 0.6, 301)
SEEN = (Port("clubhead", "acceleration"), Port("shaft", "deflection", "collet"))


def tables(**strength):
    symbols = {"gravity": "moment"}
    return [{"law": law, "place": SWINGS[law], "parameters": {symbols.get(law, "share"): value}}
            for law, value in strength.items()]  # fmt: skip


@pytest.fixture(scope="module")
def linear():
    return respond(ROBOT, P, swung_drive(), TIMES, SEEN)


def test_at_their_null_the_motion_is_the_linear_one(linear):
    null = respond(ROBOT, P, swung_drive(), TIMES, SEEN, tables(**dict.fromkeys(SWINGS, 0.0)))
    for mine, theirs in ((null.positions, linear.positions), (null.samples, linear.samples)):
        np.testing.assert_allclose(mine, theirs, atol=2e-6 * np.abs(theirs).max())


def test_a_swung_motion_keeps_its_equations(linear):
    """Accelerations of the coordinates by the laws' own generalized forces, at every sample."""
    moved = respond(ROBOT, P, swung_drive(), TIMES, SEEN, tables(**STRENGTH))
    assert moved.status == "converged"
    assert np.abs(moved.samples - linear.samples).max() > 0.2 * np.abs(linear.samples).max()
    rows = ROBOT.rows(P)
    mass, c, k = (np.asarray(f(rows)) for f in (mass_matrix, damping_matrix, stiffness_matrix))
    arm, wrist = (each.at(TIMES) for each in swung_drive().joints)
    worst = 0.0
    for i in range(5, 300, 37):
        joints = [joint("arm", arm[i]), joint("wrist", wrist[i])]
        known = told_from(joints, P["arm_length"], first_moment(P), jnp.zeros(()))
        q = np.append(moved.positions[i], [arm[i, 0], wrist[i, 0]])
        v = np.append(moved.velocities[i], [arm[i, 1], wrist[i, 1]])
        a = np.append(moved.accelerations[i], [arm[i, 2], wrist[i, 2]])
        asked = (mass @ a + c @ v + k @ q)[:4]
        beyond = q[:4] - [arm[i, 0] + wrist[i, 0], 0, 0, 0]
        for name, place in SWINGS.items():
            own = SwungRows(jnp.eye(4)[0], jnp.asarray(swung.weights(place, P)))
            look = jnp.asarray([row for row, _ in swung.stretches(place, P)])
            force = swing_of(name)(STRENGTH[name], look @ beyond, known, own)
            asked = asked + np.asarray(jnp.asarray(swung.pushes(place, P)).T @ force)
        worst = max(worst, np.abs(asked).max() / np.abs(mass[:4, :4] @ a[:4]).max())
    assert worst < 1e-6


@pytest.mark.parametrize("name", SWINGS)
def test_a_law_of_a_swing_keeps_the_contract(name):
    law, place = library()[name], SWINGS[name]
    swing = swing_of(name)
    rows = SwungRows(jnp.eye(4)[0], jnp.asarray(swung.weights(place, P)))
    stretch = jnp.asarray([0.1, 0.02, 0.05, -0.03])
    none = swing(0.0, stretch, told(), rows)
    np.testing.assert_array_equal(np.asarray(none), 0.0)
    once, twice = (swing(s, stretch, told(), rows) for s in (1.0, 2.0))
    np.testing.assert_allclose(2.0 * once, twice, rtol=1e-14)
    np.testing.assert_allclose(jax.jit(swing)(1.0, stretch, told(), rows), once, rtol=1e-12)
    slope = np.asarray(jax.jacfwd(lambda s: swing(1.0, s, told(), rows))(stretch))
    assert np.all(slope[~np.eye(4, dtype=bool)] == 0.0), "rows do not mix"
    still = told_from([], P["arm_length"], first_moment(P), jnp.zeros(()))
    rest = swing(1.0, jnp.zeros(4), still, rows)
    np.testing.assert_allclose(rest, 0.0, atol=1e-15)
    if law.felt is not None:
        felt = Felt(1.0, *(jnp.asarray([x]) for x in (0.1, 0.2, 0.3)))
        np.testing.assert_array_equal(np.asarray(law.felt(0.0, told(), felt)), 0.0)


def test_only_what_is_told_is_swung():
    assert {law.name for law in swings_of(ROBOT)} == set(SWINGS)
    assert {law.name for law in swings_of(Robot("driven_wrist"))} == set(SWINGS) - {
        "base_acceleration"
    }
    assert swings_of(Robot("pinned_wrist")) == () == swings_of(Robot("fixed_collet"))
    assert set(Robot("pinned_wrist").law_places()) == {
        "sleeve", "shaft", "wrist", "collet", "clubhead", "base"
    }  # fmt: skip
    rows = swung_rows(ROBOT, P)
    assert rows.first.shape == rows.weight.shape and float(rows.first.sum()) == 3.0


def test_at_rest_weight_alone_pulls_and_back_to_where_the_club_hangs():
    law, stretch = library()["gravity"], jnp.asarray([0.2, 0.0, 0.0, 0.0])
    force = force_at_rest(P, law, "club", STRENGTH["gravity"], stretch)
    np.testing.assert_allclose(force, [PULL * np.sin(0.2), 0, 0, 0], rtol=1e-12)
    none = force_at_rest(P, library()["centrifugal_stiffening"], SWUNG_HEAD, 1.0, stretch)
    np.testing.assert_array_equal(none, 0.0)
