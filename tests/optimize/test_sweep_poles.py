"""Modes by minors and by all roots at once: against determinants, known roots and LAPACK."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.model.chain import Chain
from supple.model.drives import Hold
from supple.model.energies import damping_matrix, mass_matrix, stiffness_matrix
from supple.model.linear import Mechanism, Port
from supple.model.robot import PRESETS, Robot
from supple.optimize.sweep_poles import characteristic, has_minors, modes_of, squared_minors
from supple.optimize.sweep_roots import roots_of
from supple.optimize.sweep_tile import _eigenvectors

NUMBERS = PRESETS["robo_v_sleeve_50"]
WRIST = {
    "wrist_stiffness": np.array([50.0, 275.0, 800.0, 5600.0]),
    "wrist_damping": np.array([2.0, 6.0, 22.0, 150.0]),
    "collet_inertia": np.array([0.002, 0.0102, 0.02809, 0.076]),
}
SENSORS = (
    Port("clubhead", "acceleration", "collet"),
    Port("clubhead", "velocity"),
    Port("grip", "position", "collet"),
)
PAIR = Chain(("a", "b"), (("low", "ground", "a"), ("high", "a", "b")))
PAIR_NUMBERS = {
    "masses.a.mass": 5.0, "masses.b.mass": 0.2,
    "links.low.stiffness": 500.0, "links.low.damping": 0.5,
    "links.high.stiffness": 3000.0, "links.high.damping": 0.1,
}  # fmt: skip


def fixed(numbers, varied):
    return {name: value for name, value in numbers.items() if name not in varied}


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=12, max_size=12), st.sampled_from([0, 1]))
def test_the_polynomial_is_the_determinant(powers, which):
    """At points on a circle, where the determinant does not cancel."""
    mechanism: Mechanism = (Robot("pinned_wrist", tuple(NUMBERS)), PAIR)[which]
    base = (NUMBERS, PAIR_NUMBERS)[which]
    lengths = ("length", "spacing", "offset", "centre")
    free = [name for name in base if not name.endswith(lengths)][:12]
    numbers = dict(base) | {name: base[name] * 2.0**x for name, x in zip(free, powers)}
    rows, n = mechanism.rows(numbers, np), len(mechanism.coordinates)
    elements = (rows.inertias[:, None], rows.stiffnesses[:, None], rows.dampings[:, None])
    minors = squared_minors(mechanism, tuple(sorted(numbers.items())))
    found = characteristic(minors, elements, n)[:, 0]
    assert np.all(found >= 0)
    m, c, k = (part(rows)[:n, :n] for part in (mass_matrix, damping_matrix, stiffness_matrix))
    for s in 30.0 * np.exp(2j * np.pi * np.arange(5) / 11):
        expected = np.linalg.det(m * s**2 + c * s + k)
        assert np.polyval(found[::-1], s) == pytest.approx(expected, rel=1e-9)


def test_roots_are_found_whatever_they_are():
    """Pairs and real ones over seven decades; the polynomials are made of them."""
    rng = np.random.default_rng(8)
    kinds, wanted = rng.integers(0, 5, 300), []
    for pairs in kinds:
        sizes = 10.0 ** rng.uniform(-1, 6, 8 - pairs)
        turned = sizes[:pairs] * np.exp(1j * rng.uniform(np.pi / 2, np.pi, pairs))
        wanted.append(np.concatenate([turned, turned.conj(), -sizes[pairs : 8 - pairs]]))
    roots = np.array(wanted)
    made = np.array([np.real(np.poly(one))[::-1] for one in roots]).T
    found, slopes, sound = roots_of(made)
    assert sound.mean() > 0.99
    for k in np.flatnonzero(sound):
        gaps = np.abs(found[:, k, None] - roots[k]) / np.abs(roots[k])
        room = np.abs(roots[k][:, None] - roots[k]) + 10 * np.eye(8) * np.abs(roots[k])
        crowded = (np.abs(roots[k]) / room.min(axis=0)).max()
        assert gaps.min(axis=0).max() < 1e-12 * crowded**2
        assert sorted(np.argmin(gaps, axis=1)) == list(range(8))
        others = np.prod([found[0, k] - found[j, k] for j in range(1, 8)])
        assert slopes[0, k] == pytest.approx(made[-1, k] * others, rel=1e-9)


def test_a_root_at_rest_is_not_believed_and_a_double_one_only_where_it_is_near():
    double, standing = np.poly([-3.0, -3.0, -50.0, -70.0]), np.poly([0.0, -1.0, -2.0, -5.0])
    found, _, sound = roots_of(np.stack([double, standing]).T[::-1])
    assert not sound[1]
    near = np.sort(np.abs(found[:, 0] + 3.0))[:2]
    assert not sound[0] or np.all(near < 1e-6)


@pytest.mark.parametrize("hold", [None, Hold("clubhead", "collet", 0.15)], ids=["blow", "release"])
@pytest.mark.parametrize("model", ["pinned_wrist", "driven_arm", "fixed_collet"])
def test_responses_are_those_of_eigenvectors(model, hold):
    robot = Robot(model, tuple(NUMBERS))
    varied = WRIST if model != "fixed_collet" else {"sleeve_damping": np.geomspace(10, 2e4, 4)}
    inputs = () if hold else (Port("clubhead", "force"),)
    told = robot, inputs, SENSORS, hold, varied, fixed(NUMBERS, varied)
    assert has_minors(robot, tuple(varied))
    found, expected = modes_of(*told), _eigenvectors(*told)
    assert found.sound.all()
    np.testing.assert_allclose(found.rest, expected.rest, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(found.start, expected.start, rtol=1e-12)
    for time in (1e-3, 0.01, 0.1, 0.7):
        both = []
        for one in (found, expected):
            grown = np.exp(one.poles * time) * (one.state if hold else one.push)
            both.append(np.einsum("dsm,dm->ds", one.seen, grown).real)
        scale = np.abs(both[1]).max(axis=0)
        assert np.all(np.abs(both[0] - both[1]) < 1e-9 * scale)


def test_a_design_does_not_feel_its_neighbors():
    robot, names = Robot("pinned_wrist", tuple(NUMBERS)), tuple(WRIST)
    inputs = (Port("clubhead", "force"),)
    many = {name: np.tile(WRIST[name], 100) for name in names}
    whole = modes_of(robot, inputs, SENSORS, None, many, fixed(NUMBERS, names))
    own = modes_of(robot, inputs, SENSORS, None, WRIST, fixed(NUMBERS, names))
    # what other processors round otherwise, two poles that nearly meet carry on hundredfold
    np.testing.assert_allclose(whole.poles[:4], own.poles, rtol=1e-12)
    np.testing.assert_allclose(whole.poles[396:], own.poles, rtol=1e-12)


def test_what_changes_rows_or_is_large_is_left_to_eigenvectors():
    robot = Robot("pinned_wrist", tuple(NUMBERS))
    assert has_minors(robot, ("sleeve_stiffness", "clubhead_mass", "shaft_damping"))
    assert not has_minors(robot, ("wrist_stiffness", "club_length"))
    names = tuple("abcde")
    links = tuple((f"l{k}", a, b) for k, (a, b) in enumerate(zip(("ground", *names), names)))
    assert not has_minors(Chain(names, links), ("links.l0.damping",))


def test_designs_that_are_not_sound_are_completed_from_others():
    varied = {"links.high.damping": np.array([0.1, 0.2])}
    inputs = (Port("b", "force"),)
    told = PAIR, inputs, (Port("b", "position"),), None, varied, fixed(PAIR_NUMBERS, varied)
    found, others = modes_of(*told), _eigenvectors(*told)
    found.sound[1] = False
    both = found.completed(others)
    np.testing.assert_array_equal(both.poles[0], found.poles[0])
    np.testing.assert_array_equal(both.seen[1], others.seen[1])
