"""Derivatives of a march by its variational equation, beside those through all its operations."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import respond
from supple.model.linear import Port
from supple.model.plant import Plant, numbers_vector
from supple.model.robot import PRESETS, Robot
from supple.model.varied import BLOCK, is_varied
from tests.model.test_respond import CART

STEP, COUNT = 5e-4, BLOCK + 75  # one block and some
SENSORS = (Port("clubhead", "acceleration"), Port("collet", "angle"))
TURN = 0.4 * np.sin(9.0 * STEP * np.arange(COUNT)) ** 2
ACTING = {
    "a spring": {("shaft", "cubic_stiffness"): 4e3},
    "two at a sleeve and a wrist": {
        ("sleeve", "clearance"): 2e-4,
        ("wrist", "coulomb_friction"): 0.3,
    },
    "one that remembers": {("sleeve", "relaxation"): 0.2, ("shaft", "quadratic_damping"): 0.4},
    "what is swung": {("arm", "base_acceleration"): 1.0, ("club", "gravity"): 2.0},
}


def plant_of(names: dict[tuple[str, str], float], joints: tuple[str, ...]) -> Plant:
    places = tuple(dict.fromkeys(place for place, _ in names))
    laws = tuple(dict.fromkeys(law for _, law in names))
    robot = Robot("driven_arm" if "arm" in joints else "driven_wrist")
    ports = tuple(Port(joint, "angle") for joint in joints)
    return Plant(robot, ports, SENSORS, places, laws)


def both(plant: Plant, z: np.ndarray, substeps: int, told: np.ndarray, monkeypatch):
    """Derivatives along every number, by both ways."""
    directions = np.diag(np.where(np.abs(z) > 0, np.abs(z), 0.1))
    widths = jnp.tile(jnp.array([1e-4, 0.02]), (len(plant.law_places), 1))
    rest = jnp.asarray(told), jnp.asarray(STEP), widths
    found = np.asarray(respond.tangents(plant, substeps, z, directions, *rest))
    monkeypatch.setattr(respond, "is_varied", lambda bare: False)
    return found, np.asarray(respond.tangents(plant, substeps, z, directions, *rest))


WRIST, BOTH = ("wrist",), ("arm", "wrist")
MORE = [("a spring", BOTH), ("a spring", WRIST), ("one that remembers", BOTH)]
MORE += [("two at a sleeve and a wrist", joints) for joints in (BOTH, WRIST)]
MORE += [("what is swung", BOTH)]
CASES = [("one that remembers", WRIST)]
CASES += [pytest.param(*case, marks=pytest.mark.slow) for case in MORE]


@pytest.mark.parametrize(("acting", "joints"), CASES)
def test_derivatives_are_those_through_all_operations(acting, joints, monkeypatch):
    plant = plant_of(ACTING[acting], joints)
    assert is_varied(plant.bare)
    z = numbers_vector(plant, PRESETS["robo_v_sleeve_50"])
    for at, (place, law, part) in enumerate(plant.law_numbers, plant.slots["strengths"].start):
        z[at] = 0.03 if part else ACTING[acting].get((place, law.name), 0.0)
    z[plant.slots["ripple"]] = (0.002, 14.0, 0.5, 0.03)
    z[plant.slots["delay"]] = 0.3 * STEP
    start = plant.slots["start"]
    z[start.start : start.start + 4] = (0.01, 1e-3, -2e-3, 0.02)
    told = np.stack([(1.0 + k) * TURN for k in range(len(joints))], axis=1)
    found, wanted = both(plant, z, 2, told, monkeypatch)
    size = np.max(np.abs(wanted), axis=(1, 2), keepdims=True)
    assert np.all(np.isfinite(wanted))
    assert np.count_nonzero(size) > 30
    np.testing.assert_allclose(found / (size + 1e-30), wanted / (size + 1e-30), atol=2e-7)


@pytest.mark.parametrize(
    "joints", [BOTH, *(pytest.param(one, marks=pytest.mark.slow) for one in (WRIST, ()))]
)
def test_without_laws_they_are_the_same_too(joints):
    robot = Robot("driven_arm" if joints == BOTH else "driven_wrist" if joints else "fixed_collet")
    sensors = SENSORS if joints else (SENSORS[0], Port("clubhead", "velocity"))
    inputs = tuple(Port(joint, "angle") for joint in joints) or (Port("clubhead", "force"),)
    plant = Plant(robot, inputs, sensors, ())
    z = numbers_vector(plant, PRESETS["robo_v_sleeve_50"])
    z[plant.slots["ripple"]] = (0.002, 14.0, 0.5, 0.03) if joints else 0.0
    for slot, value in (("delay", 0.3 * STEP), ("gain", 0.02), ("offset", 0.1), ("start", 1e-3)):
        z[plant.slots[slot]] = value
    directions = np.diag(np.where(np.abs(z) > 0, np.abs(z), 0.1))
    told = jnp.asarray(TURN[:, None] * np.ones(len(inputs))), jnp.asarray(STEP)
    none = np.zeros((0, 2))
    found = np.asarray(respond.tangents(plant, 1, z, directions, *told, none))
    bare, strengths = respond._split(plant, z)
    acting = respond._acting(plant, strengths, none)
    rows = acting.select, acting.unused
    by = respond._split(plant, directions)
    linear, by_linear = respond._linear_along(plant.lawless, 1, bare, by[0], *rows, told[1])
    through = plant.bare, 1, bare, (*by, by_linear), acting, *told, linear
    wanted = np.asarray(respond._tangents(*through))
    assert np.max(np.abs(wanted)) > 0
    size = np.max(np.abs(wanted), axis=1, keepdims=True)
    assert np.all(np.abs(found - wanted) <= 1e-8 * size + 1e-12)


def test_where_a_ground_s_rate_jumps_the_way_through_all_operations_is_taken():
    port = (Port("ground", "position"),)
    laws = ("spring",), ("cubic_stiffness",)
    assert not is_varied(Plant(CART, port, (), *laws).bare)
    assert not is_varied(Plant(CART, port, ()).bare), "no law acts"
    assert is_varied(Plant(CART, (Port("cart", "force"),), (), *laws).bare)
