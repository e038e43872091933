"""Least squares along bent valleys: the same minima as a plain method, in far fewer steps."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import least_squares, lsq_linear

from supple.identification.descent import STRIDE, _Near, descend, spring_pairs
from supple.identification.slopes import Slopes

WIDE = (np.full(2, -np.inf), np.full(2, np.inf))
TRUTH = np.array([1.0, 4.0, 0.6, 2.0])
FIRM = (np.zeros(4), np.full(4, 50.0))
PAIRS = ((0, 2), (1, 3))


def row_of_springs(x):
    """What two springs with dashpots in a row show: mostly the sums of compliances and losses."""
    k, c = x[:2], x[2:]
    soft, lost = 1.0 / k, c / k**2
    weak = np.array([1e-3, -0.7e-3, 0.5e-3, 1.1e-3])
    whole = np.array([soft.sum(), lost.sum(), soft[0] * lost[1], 0.0])
    return 1e5 * (whole + weak * (x - TRUTH))


def rate_of(residual, x):
    steps = np.eye(len(x)) * 1e-6
    return np.column_stack([(residual(x + s) - residual(x - s)) / 2e-6 for s in steps])


def seen(x):
    return row_of_springs(x) - row_of_springs(TRUTH)


def test_a_row_of_springs_is_found_in_few_steps():
    start = np.array([0.75, 9.0, 0.4, 7.0])
    found = descend(seen, lambda x: rate_of(seen, x), start, FIRM, PAIRS, 60)
    assert found.converged and found.evaluations < 40
    assert found.x == pytest.approx(TRUTH, rel=1e-4)
    plain = least_squares(seen, start, bounds=FIRM, x_scale="jac", ftol=1e-7, max_nfev=60)
    assert 3 * found.evaluations < plain.nfev


def test_without_pairs_a_bent_valley_is_followed_too():
    def rosenbrock(x):
        return np.array([100.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])

    def rate(x):
        return np.array([[-200.0 * x[0], 100.0], [-1.0, 0.0]])

    found = descend(rosenbrock, rate, np.array([-1.9, 2.0]), WIDE, evaluations=60)
    assert found.converged and found.x == pytest.approx([1.0, 1.0], rel=1e-6)


def test_a_damping_that_its_bound_holds_back_lets_the_rest_settle():
    bounds = FIRM[0], np.array([50.0, 50.0, 0.4, 50.0])
    ends = []
    for start in ([0.9, 4.5, 0.39, 2.5], [1.1, 3.6, 0.4, 1.7], [0.95, 4.0, 0.2, 2.2]):
        found = descend(seen, lambda x: rate_of(seen, x), np.array(start), bounds, PAIRS, 200)
        assert found.converged and found.x[2] == 0.4
        ends.append(found.x)
        free = np.array([0, 1, 3])
        slope = rate_of(seen, found.x).T @ seen(found.x)
        size = np.linalg.norm(rate_of(seen, found.x), axis=0) * np.linalg.norm(seen(found.x))
        assert np.all(np.abs(slope[free]) < 1e-3 * size[free]) and slope[2] < 0
    assert np.ptp(ends, axis=0) == pytest.approx(np.zeros(4), abs=1e-2)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 6))
def test_linear_problems_within_bounds_end_where_they_should(seed, size):
    chance = np.random.default_rng(seed)
    matrix = chance.standard_normal((12, size)) * np.logspace(0, 4, size)
    target = chance.standard_normal(12)
    low, high = -chance.uniform(0.0, 0.3, size), chance.uniform(0.0, 0.3, size) + 1e-3
    start = chance.uniform(low, high)
    found = descend(
        lambda x: matrix @ x - target, lambda x: matrix, start, (low, high), (), 100, 1e-12
    )
    known = lsq_linear(matrix, target, bounds=(low, high), method="bvls", tol=1e-14)
    assert found.converged and np.all((found.x >= low) & (found.x <= high))
    cost = np.sum((matrix @ found.x - target) ** 2)
    assert cost <= 2.0 * known.cost * (1 + 1e-8) + 1e-12


def test_what_no_record_tells_stays_where_it_was():
    found = descend(
        lambda x: np.array([x[0] - 3.0]),
        lambda x: np.array([[1.0, 0.0]]),
        np.array([0.0, 0.7]),
        WIDE,
    )
    assert found.converged and found.x == pytest.approx([3.0, 0.7])


def test_patience_ends_a_descent_and_is_said():
    start = np.array([0.75, 9.0, 0.4, 7.0])
    found = descend(seen, lambda x: rate_of(seen, x), start, FIRM, PAIRS, 3)
    assert not found.converged and found.evaluations == 3


def test_a_descent_that_crawls_is_given_up():
    def slow(x):  # a valley so flat that the cost falls, but by next to nothing
        return np.array([1e3, np.exp(-0.1 * x[0]), 1e2 * (x[1] - np.sin(x[0]))])

    start = np.array([0.0, 0.0])
    whole = descend(slow, lambda x: rate_of(slow, x), start, WIDE, (), 400, 1e-16)
    short = descend(slow, lambda x: rate_of(slow, x), start, WIDE, (), 400, 1e-16, crawling=1e-6)
    assert short.evaluations < whole.evaluations and not short.converged
    assert short.evaluations >= STRIDE


def test_a_residual_that_runs_away_is_stepped_back_from():
    def steep(x):
        return np.array([np.where(x[0] > 2.0, 1e6, (x[0] - 1.9) * 10.0), 0.01 * x[1]])

    found = descend(
        steep, lambda x: np.diag([10.0 - 9.99 * (x[0] < 0.5), 0.01]), np.array([0.0, 1.0]), WIDE
    )
    assert steep(found.x) @ steep(found.x) < 1e-6


@pytest.mark.parametrize("place", [TRUTH, [0.05, 4.0, 0.6, 2.0], [1.0, 4.0, 0.0, 50.0]])
def test_local_coordinates_have_the_slope_that_they_claim(place):
    x = np.array(place, dtype=float)
    near = _Near(x, seen(x), Slopes.of(rate_of(seen, x)), *FIRM, PAIRS)
    slope = rate_of(seen, x) @ near.turned
    for i in range(4):
        along = np.zeros(4)
        along[i] = 1e-6 if x[i] < 50.0 else -1e-6
        moved = (seen(near.at(along)) - seen(x)) / along[i]
        assert moved == pytest.approx(slope[:, i], rel=1e-3, abs=1e-4 * np.abs(moved).max())


def test_springs_pair_with_their_dampings():
    labels = ["mass", "shaft_stiffness", "sleeve_damping", "sleeve_stiffness", "spring_stiffness"]
    positive = [True, True, True, True, False]
    assert spring_pairs(labels, positive) == ((1, None), (3, 2))
