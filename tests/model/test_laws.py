"""Every law of the library keeps the contract of laws, those of tomorrow too."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, strategies as st

from supple.model.law import Law, Place, Scales, force_laws, library

LAWS = library()
FORCES = {name: law for name, law in LAWS.items() if law.force is not None}
BY_NAME = pytest.mark.parametrize("name", LAWS)
BY_FORCE = pytest.mark.parametrize("name", FORCES)
NAMED = {
    "linear_stiffness",
    "linear_damping",
    "cubic_stiffness",
    "asymmetric_stiffness",
    "coulomb_friction",
    "quadratic_damping",
    "clearance",
    "drive_ripple",
    "gravity",
    "base_acceleration",
    "centrifugal_stiffening",
    "extra_mode",
    "hysteresis",
    "relaxation",
    "slip",
    "stiffness_drift",
    "support_flexibility",
    "sensor_offset",
    "sensor_delay",
    "sensor_saturation",
    "sensor_mass",
    "sensor_tilt",
}
PLACE = Place(np.array([40.0, 60.0]), np.array([0.3, 0.5]), 1e-3, 0.02)
SCALES = Scales(stretch=0.05, rate=0.6, force=2.0, stiffness=40.0, time=0.08)
MOTIONS = st.floats(-0.5, 0.5).map(lambda x: round(x, 6))


def natural(law: Law) -> float:
    return float(law.natural(SCALES))


def force(law: Law, strength: Any, stretch: Any, rate: Any, place: Place = PLACE) -> Any:
    assert law.force is not None
    return law.force(strength, stretch, rate, place)


def states(count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Stretches and rates of the two rows of a place, shape (count, 2)."""
    rng = np.random.default_rng(5)
    return rng.normal(0, 0.05, size=(count, 2)), rng.normal(0, 0.6, size=(count, 2))


def test_the_laws_of_the_contract_are_there():
    assert set(LAWS) >= NAMED
    for kind in ("link", "mass", "swung", "head", "body"):
        for rotation in (False, True):
            for law in force_laws(kind, rotation):
                assert kind in (law.kind, *law.also) and law.rotation in (None, rotation)
    assert "gravity" in {law.name for law in force_laws("mass", True)}
    assert "gravity" not in {law.name for law in force_laws("mass", False)}


@BY_NAME
def test_a_law_says_what_it_is(name):
    law = LAWS[name]
    assert law.name == name
    assert law.kind in (
        *("link", "mass", "arm", "spun", "body", "support"),
        *("reading", "response", "channel", "axis", "load", "drive"),
    )
    assert law.acts != bool(law.slot), "a force, or a number of a sensor"
    assert law.slot in ("", "offset", "delay", "gain", "fault", "axis", "load", "ripple")
    assert (law.slot in ("axis", "load")) == (law.kind in ("axis", "load"))
    assert (law.slot == "fault") == (law.fault is not None)
    assert law.replaces in ("", "stiffness", "damping", "mass")
    for text in (law.formula, law.cure, law.source, law.symbol):
        assert text.strip() == text and text
    told = law.sentence.format(place="wrist", value="0.42 N m")
    assert "wrist" in told and "0.42 N m" in told and told.endswith(".")
    assert "{" not in told and law.cure.endswith(".")


@BY_NAME
def test_a_strength_that_matters_is_finite_and_positive(name):
    assert np.isfinite(natural(LAWS[name])) and natural(LAWS[name]) > 0


@pytest.mark.parametrize(
    "name, moving, turning",
    [
        ("linear_stiffness", "N/m", "N m/rad"),
        ("linear_damping", "N s/m", "N m s/rad"),
        ("cubic_stiffness", "N/m^3", "N m/rad^3"),
        ("asymmetric_stiffness", "N/m", "N m/rad"),
        ("coulomb_friction", "N", "N m"),
        ("quadratic_damping", "N s^2/m^2", "N m s^2/rad^2"),
        ("clearance", "m", "rad"),
        ("gravity", "N", "N m"),
        ("base_acceleration", "1", "1"),
        ("centrifugal_stiffening", "1", "1"),
        ("sensor_delay", "s", "s"),
        ("sensor_mass", "kg", "kg m^2"),
    ],
)
def test_units_are_written_as_the_contract_writes_them(name, moving, turning):
    assert LAWS[name].unit(rotation=False) == moving
    assert LAWS[name].unit(rotation=True) == turning


def test_an_offset_has_the_unit_of_its_channel_and_friction_a_torque_where_it_turns():
    assert LAWS["sensor_offset"].unit(False, "m/s^2") == "m/s^2"
    assert LAWS["sensor_drift"].unit(False, "m/s^2") == "m/s^2/s"
    assert LAWS["sensor_saturation"].shapes[0].unit(False, "m/s^2") == "m/s^2"
    assert LAWS["coulomb_friction"].symbol_at(rotation=True) == "torque"
    assert LAWS["coulomb_friction"].symbol_at(rotation=False) == "force"
    assert LAWS["clearance"].symbol_at(rotation=True) == "gap"


@pytest.mark.parametrize("name", sorted(FORCES.keys() - {"gravity"}))  # a sine has no scale
def test_the_unit_is_that_of_the_formula(name):
    """Lengths twice as small, times ten times as small: the force in new units is the same."""
    law = FORCES[name]
    force_power, length, time = law.dimension
    assert force_power in (0, 1)
    d, v = np.array([0.04, -0.03]), np.array([0.5, 0.2])
    a, b = 2.0, 10.0  # numbers of lengths and of times grow by these
    scaled = Place(PLACE.stiffness / a, PLACE.damping * b / a, a * 1e-3, a / b * 0.02)
    plain = force(law, natural(law), d, v)
    moved = force(law, natural(law) * a**length * b**time, a * d, a / b * v, scaled)
    np.testing.assert_allclose(plain, moved, rtol=1e-12)


@BY_FORCE
def test_null_is_exact(name):
    d, v = states()
    np.testing.assert_array_equal(np.asarray(force(FORCES[name], 0.0, d, v)), np.zeros_like(d))
    for at in (0.0, 1e3):
        zero = force(FORCES[name], 0.0, np.full(2, at), np.full(2, -at))
        np.testing.assert_array_equal(np.asarray(zero), 0.0)


@BY_FORCE
def test_nothing_acts_where_nothing_is_stretched_or_moves(name):
    rest = np.asarray(force(FORCES[name], natural(FORCES[name]), np.zeros(2), np.zeros(2)))
    np.testing.assert_allclose(rest, 0.0, atol=1e-12)


@BY_FORCE
def test_a_strength_that_matters_gives_a_force_of_that_size(name):
    law = FORCES[name]
    found = np.abs(np.asarray(force(law, natural(law), np.full(2, 0.05), np.full(2, 0.6)))).max()
    assert 0.1 * SCALES.force < found < 10 * SCALES.force


@BY_FORCE
def test_slopes_are_those_of_differences(name):
    law, strength = FORCES[name], natural(FORCES[name])
    d, v = states()
    at = (strength, d[0], v[0])
    for index in range(3):
        slope = jax.jacfwd(lambda *x: force(law, *x), argnums=index)(*map(jnp.asarray, at))
        found = np.asarray(slope) if index == 0 else np.diagonal(np.asarray(slope))
        move = 1e-6 * np.max(np.abs(at[index]))
        up, down = (
            np.asarray(force(law, *(x + sign * move * (i == index) for i, x in enumerate(at))))
            for sign in (1, -1)
        )
        wanted = (up - down) / (2 * move)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
        if index:
            full = np.asarray(slope)
            assert full[0, 1] == full[1, 0] == 0, "rows do not mix"


@BY_FORCE
def test_slopes_are_finite_at_rest_and_at_the_null(name):
    law = FORCES[name]
    for strength in (0.0, natural(law)):
        at = [jnp.asarray(x) for x in (strength, np.zeros(2), np.zeros(2))]
        for index in range(3):
            slope = jax.jacfwd(lambda *x: force(law, *x), argnums=index)(*at)
            assert np.all(np.isfinite(slope))


@BY_FORCE
def test_compiled_and_batched_are_the_same_as_one_by_one(name):
    law, (d, v) = FORCES[name], states(12)
    strengths = natural(law) * np.linspace(0.1, 2.0, 12)
    one = np.array([force(law, s, x, y) for s, x, y in zip(strengths, d, v)])
    batch = jax.vmap(lambda s, x, y: force(law, s, x, y))
    np.testing.assert_allclose(batch(strengths, d, v), one, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(jax.jit(batch)(strengths, d, v), one, rtol=1e-12, atol=1e-14)
    whole = force(law, natural(law), d, v)
    rows = np.array([force(law, natural(law), x, y) for x, y in zip(d, v)])
    np.testing.assert_allclose(whole, rows, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("name", [n for n, law in FORCES.items() if law.dissipative])
@given(stretch=MOTIONS, rate=MOTIONS, share=st.floats(0.0, 10.0))
def test_a_dissipative_law_never_feeds_energy(name, stretch, rate, share):
    law = FORCES[name]
    push = np.asarray(force(law, share * natural(law), np.full(2, stretch), np.full(2, rate)))
    assert np.all(push * rate >= 0)


@pytest.mark.parametrize("name", ["coulomb_friction", "linear_damping", "quadratic_damping"])
def test_friction_and_drag_are_declared_dissipative_and_one_signed(name):
    assert FORCES[name].dissipative and not FORCES[name].signed


@pytest.mark.parametrize(
    "name", ["cubic_stiffness", "asymmetric_stiffness", "clearance", "gravity", "linear_stiffness"]
)
def test_a_conservative_law_asks_nothing_of_the_rate(name):
    d, v = states()
    law = FORCES[name]
    still = force(law, natural(law), d, np.zeros_like(v))
    np.testing.assert_array_equal(np.asarray(force(law, natural(law), d, v)), np.asarray(still))


@given(gap=st.floats(1e-3, 0.2), stretch=st.floats(1.0, 50.0))
def test_clearance_leaves_no_spring_inside_and_all_but_the_gap_far_outside(gap, stretch):
    law = FORCES["clearance"]
    for sign in (-1.0, 1.0):
        whole = PLACE.stiffness * sign * stretch
        left = whole + np.asarray(force(law, gap, np.full(2, sign * stretch), np.zeros(2)))
        wanted = PLACE.stiffness * sign * (stretch - gap)
        np.testing.assert_allclose(left, wanted, rtol=1e-6)
    inside = 0.2 * gap
    width = 1e-4 * gap
    place = Place(PLACE.stiffness, PLACE.damping, width, 0.02)
    left = PLACE.stiffness * inside
    left = left + np.asarray(force(law, gap, np.full(2, inside), np.zeros(2), place))
    np.testing.assert_allclose(left, 0.0, atol=1e-3 * PLACE.stiffness.max() * gap)


def test_friction_saturates_and_turns_with_the_motion():
    law = FORCES["coulomb_friction"]
    for rate in (1.0, 1e3):
        found = np.asarray(force(law, 3.0, np.zeros(2), np.array([rate, -rate])))
        np.testing.assert_allclose(found, [3.0, -3.0], rtol=1e-12)
    half = np.asarray(force(law, 3.0, np.zeros(2), np.full(2, 0.02 * np.arctanh(0.5))))
    np.testing.assert_allclose(half, 1.5, rtol=1e-12)


def test_gravity_is_the_sine_and_a_spring_for_small_angles():
    law = FORCES["gravity"]
    found = np.asarray(force(law, 4.0, np.array([np.pi / 2, np.pi + 0.1]), np.zeros(2)))
    np.testing.assert_allclose(found, [4.0, -4.0 * np.sin(0.1)], rtol=1e-12)
    small = np.asarray(force(law, 4.0, np.full(2, 1e-6), np.zeros(2)))
    np.testing.assert_allclose(small, 4e-6, rtol=1e-9)


def test_an_asymmetric_spring_is_stiffer_one_way():
    law = FORCES["asymmetric_stiffness"]
    found = np.asarray(force(law, 5.0, np.array([10.0, -10.0]), np.zeros(2)))
    np.testing.assert_allclose(found, [50.0, 50.0], rtol=1e-3)


def test_the_rounded_corner_of_an_asymmetric_spring_leaves_the_rest_alone():
    law, place = FORCES["asymmetric_stiffness"], Place(100.0, 1.0, 0.01, 0.01)
    stretch = np.linspace(-1.0, 1.0, 4001)
    found = np.asarray(force(law, 5.0, stretch, 0 * stretch, place))
    missing = 5.0 * np.abs(stretch) - found
    assert found[2000] == 0.0 and np.all(missing >= 0.0)
    assert np.max(missing[np.abs(stretch) > 0.05]) < 1e-3 * 5.0 * 0.01  # no steady force is left
    assert np.max(missing) < 0.3 * 5.0 * 0.01
