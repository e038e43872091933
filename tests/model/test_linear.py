"""The linear part: closed forms, published frequencies, and digits kept in stiff sleeves."""

from decimal import Decimal, getcontext

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.linalg import expm

from supple.model.chain import Chain
from supple.model.linear import Port, discretize, modes, state_space
from supple.model.robot import PRESETS, Robot

CART = Chain(("cart",), (("spring", "ground", "cart"),))
PAIR = Chain(("a", "b"), (("left", "ground", "a"), ("mid", "a", "b"), ("right", "b", "ground")))
TURN = 2 * np.pi


def cart(m: float, k: float, c: float) -> dict[str, float]:
    return {"masses.cart.mass": m, "links.spring.stiffness": k, "links.spring.damping": c}


@given(m=st.floats(0.01, 100.0), w=st.floats(0.1, 1e4), zeta=st.floats(0.0, 0.99, exclude_max=True))
def test_one_oscillator_has_its_textbook_mode(m, w, zeta):
    found = modes(CART, cart(m, m * w * w, 2 * zeta * m * w))
    assert found.frequencies == pytest.approx([w / TURN], rel=1e-9)
    assert found.damping_ratios == pytest.approx([zeta], rel=1e-7, abs=1e-9)
    damped = w * np.sqrt(1 - zeta**2) / TURN
    assert found.damped_frequencies == pytest.approx([damped], rel=1e-7)


def test_an_overdamped_oscillator_creeps_at_two_rates():
    found = modes(CART, cart(2.0, 18.0, 20.0))  # (s + 1)(s + 9)
    np.testing.assert_allclose(np.sort(-np.real(found.poles)), [1.0, 9.0], rtol=1e-12)
    np.testing.assert_array_equal(found.damped_frequencies, 0.0)
    np.testing.assert_allclose(found.damping_ratios, 1.0, rtol=1e-12)


def test_a_free_mass_drifts_without_a_frequency():
    found = modes(Chain(("cart",), ()), {"masses.cart.mass": 3.0})
    np.testing.assert_array_equal(found.frequencies, 0.0)
    np.testing.assert_array_equal(found.damping_ratios, 0.0)


def test_two_equal_masses_between_walls_swing_together_and_against_each_other():
    p = {"masses.a.mass": 2.0, "masses.b.mass": 2.0}
    for name, k in (("left", 50.0), ("mid", 30.0), ("right", 50.0)):
        p |= {f"links.{name}.stiffness": k, f"links.{name}.damping": 1e-3 * k}
    found = modes(PAIR, p)
    squares = np.array([50.0 / 2, (50.0 + 2 * 30.0) / 2])
    np.testing.assert_allclose((TURN * found.frequencies) ** 2, squares, rtol=1e-12)
    np.testing.assert_allclose(found.damping_ratios, 1e-3 * np.sqrt(squares) / 2, rtol=1e-9)
    np.testing.assert_allclose(found.shapes[1] / found.shapes[0], [1.0, -1.0], atol=1e-9)


@pytest.mark.parametrize(
    "stiffness, damping, frequency, ratio",
    [
        (500e3, 0.0, 3.959, 0.0065),  # rigid collet
        (290e3, 6000.0, 3.876, 0.040),  # 0 % sleeve of Table 4
        (130e3, 12000.0, 4.014, 0.081),  # 50 % sleeve of Table 4
    ],
)
def test_robo_v_swings_as_an_independent_implementation_found(stiffness, damping, frequency, ratio):
    p = PRESETS["robo_v"] | {"sleeve_stiffness": stiffness, "sleeve_damping": damping}
    found = modes(Robot("fixed_collet"), p)
    assert found.damped_frequencies[0] == pytest.approx(frequency, abs=6e-4)
    assert found.damping_ratios[0] == pytest.approx(ratio, abs=6e-4)


@pytest.mark.parametrize(
    "preset, frequency, ratio",  # measured on the three sleeves, thesis line 1060
    [("robo_v_sleeve_0", 3.64, 0.02), ("robo_v_sleeve_25", 3.55, 0.08), ("robo_v", 3.08, 0.11)],
)
def test_presets_swing_as_the_sleeves_were_measured(preset, frequency, ratio):
    found = modes(Robot("fixed_collet"), PRESETS[preset])
    assert found.damped_frequencies[0] == pytest.approx(frequency, abs=0.01)
    assert found.damping_ratios[0] == pytest.approx(ratio, abs=0.002)


def test_a_wrist_held_rigidly_is_the_fixed_collet():
    stiff = PRESETS["robo_v_rigid"] | {"wrist_stiffness": 1e5, "wrist_damping": 2.0}
    pinned = modes(Robot("pinned_wrist"), stiff)
    assert pinned.frequencies[0] == pytest.approx(3.956, abs=6e-4)  # thesis line 1469: "similar"
    stiffer = stiff | {"wrist_stiffness": 1e9}
    fixed = modes(Robot("fixed_collet"), stiff)
    limit = modes(Robot("pinned_wrist"), stiffer).frequencies[0]
    assert limit == pytest.approx(fixed.frequencies[0], rel=1e-6)


def exact(a: np.ndarray, b: np.ndarray, step: float) -> list[np.ndarray]:
    """Transition and its three integrals with ninety decimal digits."""
    getcontext().prec = 90
    n, m = b.shape
    block = np.zeros((n + 3 * m, n + 3 * m))
    block[:n, :n], block[:n, n : n + m] = a, b
    for j in (0, 1):
        low = n + j * m
        block[low : low + m, low + m : low + 2 * m] = np.eye(m)
    decimals = np.vectorize(lambda x: Decimal(float(x)), otypes=[object])
    squarings = max(0, int(np.ceil(np.log2(np.abs(block).sum(axis=1).max() * step)))) + 6
    small = decimals(block) * Decimal(step) / Decimal(2) ** squarings
    term = whole = decimals(np.eye(len(block)))
    for k in range(1, 28):
        term = term.dot(small) / k
        whole = whole + term
    for _ in range(squarings):
        whole = whole.dot(whole)
    found = whole.astype(float)
    return [found[:n, :n], *(found[:n, n + j * m : n + (j + 1) * m] for j in range(3))]


STIFF = {
    "50 % sleeve": PRESETS["robo_v"],
    "rigid, undamped": PRESETS["robo_v_rigid"] | {"shaft_damping": 0.0},
    "Table 4": PRESETS["robo_v"] | {"sleeve_stiffness": 130e3, "sleeve_damping": 12e3},
    "light grip": PRESETS["robo_v"] | {"sleeve_damping": 12e3, "grip_mass": 0.02},
}


@pytest.mark.parametrize("rate", [2000.0, 16000.0])
@pytest.mark.parametrize("name", STIFF)
def test_stiff_sleeves_keep_their_digits(name, rate):
    ports = (Port("clubhead", "force"),)
    space = state_space(Robot("fixed_collet"), STIFF[name], ports, (), ("sleeve",))
    a, b = np.asarray(space.a), np.asarray(space.b)
    if name == "light grip":
        assert np.linalg.eigvals(a).real.min() < -1e6, "the case is as stiff as it claims"
    transition, parts = discretize(space.a, space.b, 1 / rate)
    for found, wanted in zip([transition, *parts], exact(a, b, 1 / rate)):
        size = np.abs(wanted).max(axis=1, keepdims=True)
        assert np.max(np.abs(np.asarray(found) - wanted) / size) < 1e-12


@pytest.mark.parametrize("seed, orders", [(1, 3), (2, 3), (3, 3), (4, 1), (5, 4)])
def test_discretization_agrees_with_scipy_and_with_quadrature(seed, orders):
    rng = np.random.default_rng(seed)
    a, b, step = rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), 0.7
    transition, parts = discretize(jnp.asarray(a), jnp.asarray(b), step, orders)
    np.testing.assert_allclose(transition, expm(a * step), atol=1e-12)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    times, factorial = step * (nodes + 1) / 2, 1.0
    for j, part in enumerate(parts):
        factorial *= max(j, 1)
        values = [expm(a * (step - s)) @ b * s**j / factorial for s in times]
        wanted = np.tensordot(weights * step / 2, values, axes=1)
        np.testing.assert_allclose(part, wanted, atol=1e-12)


def test_derivatives_of_the_discretization_are_those_of_the_unscaled_one():
    space = state_space(Robot("fixed_collet"), PRESETS["robo_v"], (Port("grip", "force"),))

    def transition(factor):
        a = space.a.at[3:, 3:].multiply(factor)  # the dampings
        first, parts = discretize(a, space.b * factor, 1e-3)
        return jnp.concatenate([first.ravel(), *[part.ravel() for part in parts]])

    found = np.asarray(jax.jvp(transition, (1.0,), (1.0,))[1])
    differences = (np.asarray(transition(1 + 1e-4)) - np.asarray(transition(1 - 1e-4))) / 2e-4
    size = np.abs(np.asarray(transition(1.0)))
    np.testing.assert_allclose(found, differences, rtol=1e-5, atol=1e-6 * size.max())


def test_zero_inputs_and_zero_matrices_stay_finite():
    transition, parts = discretize(jnp.zeros((2, 2)), jnp.zeros((2, 1)), 0.5)
    np.testing.assert_array_equal(transition, np.eye(2))
    np.testing.assert_array_equal(parts, np.zeros((3, 2, 1)))
    transition, parts = discretize(jnp.zeros((1, 1)), jnp.ones((1, 1)), 0.5)
    np.testing.assert_allclose(np.ravel(parts), [0.5, 0.5**2 / 2, 0.5**3 / 6], rtol=1e-14)
    assert discretize(jnp.zeros((2, 2)), jnp.zeros((2, 0)), 0.5)[1][0].shape == (2, 0)
