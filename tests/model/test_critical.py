"""Critical damping: three roads to one verdict, the textbook's value, and the thesis's claim."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.model.chain import Chain
from supple.model.critical import check_aperiodic, critical_damping, damping_intervals
from supple.model.linear import modes
from supple.model.robot import PRESETS, Robot
from tests.reference.thesis_models import Club, equation_11, equations_8_to_10

NUMBERS = PRESETS["robo_v"]
ROBOT = Robot("fixed_collet", tuple(NUMBERS))


SOFT = Club(
    m_G=0.1, I_G=5.2083e-4, m_cl=0.20277, I_col=0.028, L_cl=1.09, l=0.25, d=0.049, l1=0.1005,
    k1=100.0, k2=100.0, c1=0.0, c2=0.0, k_sh=139.0, c_sh=0.0807, k_w=0.0, c_w=0.0,
    m_col=1.5, l_col=0.1, l_arm=0.65,
)  # fmt: skip


def eigenvalues(mass, damping, stiffness):
    n, inverse = len(mass), np.linalg.inv(mass)
    return np.linalg.eigvals(
        np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
    )


def printed_intervals(equation, club):
    mass, damping, stiffness = equation(club)[:3]
    with_one = equation(replace(club, c1=1.0, c2=1.0))[1]
    return damping_intervals(mass, damping, stiffness, with_one - damping)


def gram(rows, weights):
    return rows.T @ (weights[:, None] * rows)


def test_one_mass_is_critical_at_the_textbooks_value():
    chain = Chain(("cart",), (("spring", "ground", "cart"),))
    p = {"masses.cart.mass": 2.0, "links.spring.stiffness": 8.0, "links.spring.damping": 0.0}
    found = critical_damping(chain, p, "links.spring.damping")
    ((low, high),) = found.intervals
    assert low == pytest.approx(2 * math.sqrt(8.0 * 2.0), rel=1e-8)
    assert high == math.inf
    assert found.unit == "N s/m" and "8 to inf" in found.sentence


def test_equal_masses_whose_eigenvalues_always_coincide_are_found_too():
    links = (("a", "ground", "left"), ("b", "ground", "right"))
    chain = Chain(("left", "right"), links)
    names = {f"links.{x}.{y}": v for x in "ab" for y, v in (("stiffness", 4.0), ("damping", 6.0))}
    p = names | {"masses.left.mass": 1.0, "masses.right.mass": 1.0}
    ((low, high),) = critical_damping(chain, p, "links.a.damping").intervals
    assert (low, high) == (pytest.approx(4.0, rel=1e-8), math.inf)
    both = damping_intervals(np.eye(2), np.zeros((2, 2)), 4.0 * np.eye(2), np.eye(2))
    assert both == ((pytest.approx(4.0, rel=1e-8), math.inf),)


def test_at_the_critical_value_itself_the_roots_are_real_but_not_distinct():
    one = np.ones((1, 1))
    at = check_aperiodic(one, 2 * one, one)
    assert at.is_aperiodic and not at.satisfies_bulatovic
    assert at.minors == (Fraction(2), Fraction(0))
    below = check_aperiodic(one, (2 - 2**-50) * one, one)
    assert not below.is_aperiodic


@given(st.integers(0, 10**6), st.integers(1, 4), st.floats(-1.0, 3.0))
@settings(max_examples=60)
def test_minors_sturm_and_eigenvalues_agree(seed, n, size):
    rng = np.random.default_rng(seed)
    mass = gram(rng.normal(size=(n + 1, n)), rng.uniform(0.5, 2.0, n + 1))
    stiffness = gram(rng.normal(size=(n + 1, n)), rng.uniform(0.5, 2.0, n + 1))
    damping = 10.0**size * gram(rng.normal(size=(n + 1, n)), rng.uniform(0.5, 2.0, n + 1))
    told = check_aperiodic(mass, damping, stiffness)
    found = eigenvalues(mass, damping, stiffness)
    swing = np.abs(found.imag) > 1e-6 * np.abs(found)
    assert told.n_distinct == 2 * n
    assert told.n_negative == np.sum(~swing)
    assert told.is_aperiodic == told.satisfies_bulatovic == (not np.any(swing))


@given(st.integers(0, 10**6))
@settings(max_examples=15)
def test_intervals_are_those_of_a_fine_grid_of_eigenvalues(seed):
    rng = np.random.default_rng(seed)
    mass, stiffness = np.diag(rng.uniform(0.5, 2.0, 2)), gram(rng.normal(size=(3, 2)), np.ones(3))
    fixed = gram(rng.normal(size=(2, 2)), rng.uniform(0.0, 3.0, 2))
    unit = gram(rng.normal(size=(1, 2)), np.ones(1))
    intervals = damping_intervals(mass, fixed, stiffness, unit)
    for c in np.geomspace(1e-3, 1e4, 200):
        if any(abs(c / end - 1.0) < 1e-4 for pair in intervals for end in pair if end > 0):
            continue
        found = eigenvalues(mass, fixed + c * unit, stiffness)
        real = bool(np.all(np.abs(found.imag) < 1e-7 * np.abs(found)))
        assert real == any(low < c < high for low, high in intervals), c


def test_line_1355_a_critical_grip_damping_exists_for_a_soft_grip():
    """Erratum B17: 185 to 1030 N s/m at k_G = 100 N/m."""
    soft = dict(NUMBERS) | {"sleeve_stiffness": 100.0}
    ((low, high),) = critical_damping(ROBOT, soft, "sleeve_damping").intervals
    assert low == pytest.approx(185.05, abs=0.01)
    assert high == pytest.approx(1031.9, abs=0.05)
    for c, real in (
        (low * 0.999, False),
        (low * 1.001, True),
        (high * 0.999, True),
        (high * 1.001, False),
    ):
        own = modes(ROBOT, soft | {"sleeve_damping": c})
        assert bool(np.all(own.damped_frequencies == 0)) == real
    mass, damping, stiffness = equations_8_to_10(replace(SOFT, c1=500.0, c2=500.0))
    told = check_aperiodic(mass, damping, stiffness)
    assert told.satisfies_bulatovic and len(told.minors) == 6


def test_line_1355_none_exists_with_the_slip_of_equation_11():
    assert printed_intervals(equation_11, SOFT) == ()
    ((low, high),) = printed_intervals(equations_8_to_10, SOFT)
    assert (low, high) == (pytest.approx(185.05, abs=0.01), pytest.approx(1031.9, abs=0.05))


@pytest.mark.parametrize("stiffness", [6.8e3, 10e3, 60e3, 130e3, 290e3])
def test_no_realistic_sleeve_can_be_critically_damped(stiffness):
    numbers = dict(NUMBERS) | {"sleeve_stiffness": stiffness}
    found = critical_damping(ROBOT, numbers, "sleeve_damping")
    assert found.intervals == () and found.status == "none"
    assert "No sleeve_damping" in found.sentence


def test_the_last_stiffness_with_a_critical_damping():
    """Erratum B17 puts it at 6.3 kN/m; exact arithmetic finds a last, narrow interval at 6.70."""
    for stiffness, exists in ((6.3e3, True), (6.70e3, True), (6.71e3, False)):
        numbers = dict(NUMBERS) | {"sleeve_stiffness": stiffness}
        intervals = critical_damping(ROBOT, numbers, "sleeve_damping").intervals
        assert bool(intervals) == exists
        for low, high in intervals:
            assert high / low < 1.01
            own = modes(ROBOT, numbers | {"sleeve_damping": math.sqrt(low * high)})
            assert np.all(own.damped_frequencies == 0)


def test_shaft_and_wrist_can_be_searched_too():
    stiff = dict(NUMBERS) | {"sleeve_damping": 1e5}
    ((low, high),) = critical_damping(ROBOT, stiff, "shaft_damping").intervals
    assert high == math.inf
    assert np.all(modes(ROBOT, stiff | {"shaft_damping": 1.01 * low}).damped_frequencies == 0)
    wrist = critical_damping(Robot("pinned_wrist", tuple(NUMBERS)), NUMBERS, "wrist_damping")
    assert wrist.intervals == () and wrist.unit == "N m s/rad"


def test_what_cannot_be_searched_is_refused():
    with pytest.raises(ValueError, match="expected one of shaft_damping"):
        critical_damping(ROBOT, NUMBERS, "shaft_stiffness")
    with pytest.raises(ValueError, match="singular"):
        check_aperiodic(np.zeros((2, 2)), np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match="square ones"):
        check_aperiodic(np.eye(2), np.eye(3), np.eye(2))
    for wild in (np.nan, np.inf):
        with pytest.raises(ValueError, match=r"finite numbers, found .* Mend: "):
            critical_damping(ROBOT, NUMBERS | {"shaft_stiffness": wild}, "sleeve_damping")
    less = {name: value for name, value in NUMBERS.items() if name != "clubhead_mass"}
    with pytest.raises(ValueError, match=r"found none for 'clubhead_mass'. Mend: "):
        critical_damping(ROBOT, less, "sleeve_damping")
