"""Energies: their Hessians are M, C, K; numpy and jax agree; the thesis's printed rows follow."""

import jax
import numpy as np
import pytest
from hypothesis import given, strategies as st

from supple.model.chain import Chain
from supple.model.energies import (
    damping_matrix,
    dissipation,
    kinetic_energy,
    mass_matrix,
    potential_energy,
    stiffness_matrix,
)
from supple.model.linear import Port, state_space
from supple.model.robot import PARAMETERS, PRESETS, Robot
from supple.model.shaft_form import NAMES as SHAFT_FORM
from tests.reference.thesis_models import (
    Club,
    equation_11,
    equation_36,
    equations_8_to_10,
)

SPLIT = ("sleeve_stiffness", "sleeve_damping")
NAMES = tuple(name for name in PARAMETERS if name not in (*SPLIT, *SHAFT_FORM))
FIXED, PINNED = Robot("fixed_collet", NAMES), Robot("pinned_wrist", NAMES)
LINE = Chain(
    ("a", "b", "c"),
    (("s1", "ground", "a"), ("s2", "a", "b"), ("s3", "c", "b"), ("s4", "c", "ground")),
)
MECHANISMS = {
    "fixed": FIXED,
    "pinned": PINNED,
    "line": LINE,
    "torsion": Chain(("disc", "hub"), (("rod", "ground", "disc"), ("key", "disc", "hub")), True),
    "loose": Chain(("cart",), ()),
}
BY_NAME = pytest.mark.parametrize("name", MECHANISMS)
MATRICES = (
    (mass_matrix, kinetic_energy),
    (damping_matrix, dissipation),
    (stiffness_matrix, potential_energy),
)


def draw(mechanism, seed: int) -> dict[str, float]:
    """Random positive numbers, each within a factor of three of something sensible."""
    rng = np.random.default_rng(seed)
    return {
        name: (PARAMETERS[name].value if name in PARAMETERS else 2.0) * 3.0 ** rng.uniform(-1, 1)
        for name in mechanism.names
    }


def closed(p: dict[str, float]) -> dict[str, float]:
    """The same numbers with the butt of the club at the pivot, as the thesis assumes unsaid."""
    return p | {"sleeve_offset": (p["grip_length"] - p["sleeve_spacing"]) / 2}


def club(p: dict[str, float]) -> Club:
    return Club(
        m_G=p["grip_mass"],
        I_G=p["grip_inertia"],
        m_cl=p["clubhead_mass"],
        I_col=p["collet_inertia"],
        L_cl=p["club_length"],
        l=p["grip_length"],
        d=p["sleeve_spacing"],
        l1=p["sleeve_offset"],
        k1=p["sleeve_stiffness_upper"],
        k2=p["sleeve_stiffness_lower"],
        c1=p["sleeve_damping_upper"],
        c2=p["sleeve_damping_lower"],
        k_sh=p["shaft_stiffness"],
        c_sh=p["shaft_damping"],
        k_w=p["wrist_stiffness"],
        c_w=p["wrist_damping"],
        m_col=p["collet_mass"],
        l_col=p["collet_centre"],
        l_arm=p["arm_length"],
    )


def of(mechanism, p, xp=np) -> list[np.ndarray]:
    """M, C, K without the column and the row of the ground."""
    n = len(mechanism.coordinates)
    rows = mechanism.rows(p, xp)
    return [np.asarray(matrix(rows))[:n, :n] for matrix, _ in MATRICES]


def near(found, wanted, digits: float = 1e-12) -> None:
    """Every entry within `digits` of the largest that it is made of."""
    np.testing.assert_allclose(found, wanted, rtol=digits, atol=digits * np.max(np.abs(wanted)))


@BY_NAME
@given(seed=st.integers(0, 10**6))
def test_matrices_are_symmetric_and_positive(name, seed):
    mechanism = MECHANISMS[name]
    p = draw(mechanism, seed)
    n = len(mechanism.coordinates)
    for matrix, _ in MATRICES:
        whole = matrix(mechanism.rows(p, np))
        assert whole.shape == (n + 1, n + 1)
        near(whole, whole.T, 1e-14)
        values = np.linalg.eigvalsh(whole)
        assert values.min() >= -1e-12 * max(values.max(), 1e-300)
    assert np.linalg.eigvalsh(of(mechanism, p)[0]).min() > 0, "mass matrix"
    if name in ("fixed", "pinned", "torsion", "line"):
        assert np.linalg.eigvalsh(of(mechanism, p)[2]).min() > 0, "held everywhere"


@BY_NAME
def test_matrices_are_the_hessians_of_the_energies(name):
    mechanism = MECHANISMS[name]
    rows = mechanism.rows(draw(mechanism, 1))
    at = np.random.default_rng(2).normal(size=len(mechanism.coordinates) + 1)
    for matrix, energy in MATRICES:
        hessian = jax.hessian(lambda q, energy=energy: energy(rows, q))(at)
        near(hessian, matrix(rows))


@BY_NAME
def test_numpy_and_jax_agree(name):
    mechanism = MECHANISMS[name]
    rng = np.random.default_rng(3)
    for seed in range(5):
        p = draw(mechanism, seed)
        state = rng.normal(size=len(mechanism.coordinates) + 1)
        for matrix, energy in MATRICES:
            near(matrix(mechanism.rows(p)), matrix(mechanism.rows(p, np)))
            ours = float(energy(mechanism.rows(p), state))
            assert ours == pytest.approx(float(energy(mechanism.rows(p, np), state)), rel=1e-12)


def test_energy_is_written_out_for_a_line_of_masses():
    p = draw(LINE, 4)
    q = np.array([0.3, -0.2, 0.5, 0.1])  # a, b, c, ground
    stretches = {"s1": 0.3 - 0.1, "s2": -0.2 - 0.3, "s3": -0.2 - 0.5, "s4": 0.1 - 0.5}
    stored = sum(p[f"links.{s}.stiffness"] * x**2 for s, x in stretches.items()) / 2
    lost = sum(p[f"links.{s}.damping"] * x**2 for s, x in stretches.items()) / 2
    moving = sum(p[f"masses.{m}.mass"] * x**2 for m, x in zip("abc", q)) / 2
    rows = LINE.rows(p, np)
    assert potential_energy(rows, q) == pytest.approx(stored, rel=1e-13)
    assert dissipation(rows, q) == pytest.approx(lost, rel=1e-13)
    assert kinetic_energy(rows, q) == pytest.approx(moving, rel=1e-13)


@given(seed=st.integers(0, 10**6))
def test_fixed_collet_equals_the_thesis_coefficient_by_coefficient(seed):
    p = draw(FIXED, seed)
    order = np.ix_([0, 2, 1], [0, 2, 1])  # ours: x_G, theta_G, x_cl; printed: x_G, x_cl, theta_G
    for ours, printed in zip(of(FIXED, p), equations_8_to_10(club(p))):
        near(ours[order], printed)


def test_one_number_for_both_sets_is_the_same_as_two_equal_ones():
    one = Robot("fixed_collet", tuple(PRESETS["robo_v"]))
    p = PRESETS["robo_v"]
    both = {f"{name}_{which}": p[name] for name in SPLIT for which in ("upper", "lower")}
    for ours, split in zip(of(one, p), of(FIXED, p | both)):
        np.testing.assert_array_equal(ours, split)


def test_printed_equation_11_slips_in_entry_3_2_and_in_its_force():
    p = {name: PARAMETERS[name].value for name in NAMES}
    printed = equation_11(club(p))
    order = np.ix_([0, 2, 1], [0, 2, 1])
    a, half = club(p).a, club(p).l / 2
    for ours, wrong, shaft in zip(of(FIXED, p)[1:], printed[1:3], ("damping", "stiffness")):
        gap = wrong - ours[order]
        value = p[f"shaft_{shaft}"] * (a - half)
        expected = np.zeros((3, 3))
        expected[2, 1] = value
        np.testing.assert_allclose(gap, expected, atol=1e-9 * np.abs(wrong).max())
        assert value > 0.1 * p[f"shaft_{shaft}"], "the slip is no rounding"
    ours = np.asarray(FIXED.force_row("clubhead", p, np))[[0, 2, 1]]
    np.testing.assert_array_equal(ours, [0, 1, 0])  # eq. 9, line 1113
    np.testing.assert_array_equal(printed[3], [0, 0, 1])  # row 3 is the grip's rotation


def test_printed_equation_11_would_raise_the_frequency_of_the_rigid_grip():
    p = dict(PRESETS["robo_v_rigid"])
    both = {f"{name}_{which}": p[name] for name in SPLIT for which in ("upper", "lower")}
    found = {}
    for name, matrices in (
        ("right", equations_8_to_10(club(p | both))),
        ("printed", equation_11(club(p | both))[:3]),
    ):
        squares = np.linalg.eigvals(np.linalg.solve(matrices[0], matrices[2]))
        found[name] = np.sqrt(squares.real.min()) / (2 * np.pi)
    assert found["right"] == pytest.approx(3.959, abs=5e-4)
    assert found["printed"] == pytest.approx(4.14, abs=5e-3)


@given(seed=st.integers(0, 10**6))
def test_row_operations_turn_the_pinned_wrist_into_the_printed_form(seed):
    p = closed(draw(PINNED, seed))
    t = club(p)
    r = t.l1 + t.d / 2
    w = np.array([[1, -r, -1, -(r + t.a)], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    printed = equation_36(t)
    for ours, thesis in zip(of(PINNED, p), printed):
        size = np.abs(w) @ np.abs(ours)  # what cancels in the collet's row
        np.testing.assert_allclose(w @ ours, thesis, rtol=1e-12, atol=1e-12 * size.max())
    force = np.asarray(PINNED.force_row("clubhead", p, np))
    np.testing.assert_allclose(w @ force, printed[3], atol=1e-12)
    torque = np.asarray(PINNED.force_row("wrist", p, np))
    np.testing.assert_allclose(w @ torque, [1, 0, 0, 0], atol=1e-12)


def test_without_the_closure_the_printed_form_is_another_system():
    p = closed(draw(PINNED, 1))
    p["sleeve_offset"] += 0.02
    t = club(p)
    r = t.l1 + t.d / 2
    w = np.array([[1, -r, -1, -(r + t.a)], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    gap = w @ of(PINNED, p)[0] - equation_36(t)[0]
    assert gap[3, 0] == pytest.approx(0.02 * t.m_cl, rel=1e-9)


def test_a_pinned_wrist_without_spring_turns_freely_about_its_pivot():
    p = closed(draw(PINNED, 5)) | {"wrist_stiffness": 0.0, "wrist_damping": 0.0}
    _, damping, stiffness = of(PINNED, p)
    turn = np.array([1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(stiffness @ turn, 0.0, atol=1e-9)
    np.testing.assert_allclose(damping @ turn, 0.0, atol=1e-9)
    mass = of(PINNED, p)[0]
    r = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    head = r + p["club_length"] - p["grip_length"] / 2
    whole = p["collet_inertia"] + p["grip_inertia"]
    whole += p["grip_mass"] * r**2 + p["clubhead_mass"] * head**2
    assert mass[0, 0] == pytest.approx(whole, rel=1e-12)


def test_numbers_that_a_fixed_collet_does_not_have_do_not_move_it():
    p = draw(FIXED, 6)
    other = p | {"collet_inertia": 9.0, "wrist_stiffness": 1.0, "sleeve_offset": 0.7}
    for ours, moved in zip(of(FIXED, p), of(FIXED, other)):
        np.testing.assert_array_equal(ours, moved)


def test_sensors_of_the_robot_see_what_the_geometry_says():
    p = draw(PINNED, 9)
    turn, grip, tilt, head = q = np.array([0.3, 0.01, -0.2, 0.15])
    lever = p["club_length"] - p["grip_length"] / 2
    r = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    bend = head - grip - lever * tilt
    wanted = {
        ("clubhead", "position", "absolute"): (r + lever) * turn + head,
        ("clubhead", "acceleration", "collet"): head,
        ("grip", "velocity", "absolute"): r * turn + grip,
        ("grip", "position", "collet"): grip,
        ("grip", "angle", "absolute"): turn + tilt,
        ("grip", "angular_velocity", "collet"): tilt,
        ("shaft", "deflection", "absolute"): bend,
        ("clubhead", "deflection", "collet"): bend,
        ("shaft", "strain", "absolute"): 0.024 * bend,  # thesis line 1833
        ("wrist", "angle", "absolute"): turn,
        ("collet", "angular_acceleration", "absolute"): turn,
    }
    for (place, quantity, frame), value in wanted.items():
        row = np.asarray(PINNED.sensor_row(place, quantity, frame, p, np))
        assert row[:-1] @ q == pytest.approx(value, rel=1e-12), (place, quantity, frame)
        if place not in ("wrist", "collet") and frame == "collet":
            fixed = np.asarray(FIXED.sensor_row(place, quantity, frame, p, np))
            np.testing.assert_array_equal(fixed, row[1:])
    k = p["shaft_stiffness"]
    rows, stiffness, damping = PINNED.place_rows("shaft", p, np)
    assert (rows[:, :-1] @ q, stiffness, damping) == (
        [pytest.approx(bend)],
        [k],
        p["shaft_damping"],
    )
    rows, stiffness, _ = PINNED.place_rows("sleeve", p, np)
    half = p["sleeve_spacing"] / 2
    np.testing.assert_allclose(rows[:, :-1] @ q, [grip - half * tilt, grip + half * tilt])
    sets = [2 * p["sleeve_stiffness_upper"], 2 * p["sleeve_stiffness_lower"]]
    np.testing.assert_allclose(stiffness, sets)


def test_sensors_of_a_chain_see_masses_stretches_and_the_ground():
    p, q = draw(LINE, 10), np.array([0.3, -0.2, 0.5, 0.1])  # a, b, c, ground
    wanted = {"a": 0.3, "s1": 0.2, "s3": -0.7, "s4": -0.4, "ground": 0.1, "base": 0.1}
    for place, value in wanted.items():
        assert LINE.sensor_row(place, "position", "absolute", p, np) @ q == pytest.approx(value)
    np.testing.assert_array_equal(LINE.force_row("s2", p, np), [-1, 1, 0])
    np.testing.assert_array_equal(LINE.force_row("c", p, np), [0, 0, 1])


@pytest.mark.parametrize(
    "mechanism, inputs, sensors, words",
    [
        (FIXED, (Port("base", "acceleration"),), (), "a motion of a chain's ground"),
        (LINE, (Port("a", "position"),), (), "place = 'a'"),
        (LINE, (Port("ground", "position"), Port("ground", "velocity")), (), "found 2"),
        (LINE, (Port("ground", "position"),), (Port("ground", "acceleration"),), "tells"),
        (LINE, (Port("ground", "velocity"),), (Port("s1", "acceleration"),), "tells"),
        (FIXED, (), (Port("wrist", "angle"),), "a place that moves"),
    ],
)
def test_ports_that_the_equations_would_not_see_are_refused(mechanism, inputs, sensors, words):
    with pytest.raises(ValueError, match=words) as refused:
        state_space(mechanism, draw(mechanism, 8), inputs, sensors)
    assert all(word in str(refused.value) for word in ("expected", "found", "Mend:"))
