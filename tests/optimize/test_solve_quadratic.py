"""The quadratic program of a swing: closed forms, optimality, and bounds that cannot be kept."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from supple.optimize.solve_quadratic import Bounds, nearest, reduce


def drawn(seed: int, n: int = 12, m: int = 30) -> tuple[np.ndarray, ...]:
    random = np.random.default_rng(seed)
    return (
        random.normal(size=(2 * n, n)) * 10.0 ** random.uniform(-3, 3, size=(2 * n, 1)),
        random.normal(size=2 * n), random.normal(size=(3, n)), random.normal(size=3),
        random.normal(size=(m, n)),
    )  # fmt: skip


def test_in_a_box_the_nearest_point_is_cut_off_at_its_walls():
    aim = np.array([3.0, -0.2, -5.0, 0.9])
    reduced = reduce(np.eye(4), aim, np.zeros((0, 4)), np.zeros(0))
    answer = nearest(reduced, Bounds(np.eye(4), -np.ones(4), np.ones(4)))
    assert answer.solved
    assert answer.c == pytest.approx(np.clip(aim, -1, 1), abs=1e-8)
    assert answer.prices == pytest.approx(aim - np.clip(aim, -1, 1), abs=1e-7)


@given(st.integers(0, 10_000))
def test_an_answer_keeps_everything_and_nothing_pulls_at_it(seed):
    cost, aim, equations, sides, rows = drawn(seed)
    reduced = reduce(cost, aim, equations, sides)
    inside = reduced.foot + 0.1 * reduced.back @ np.ones(len(reduced.target))
    middle = rows @ inside
    answer = nearest(reduced, Bounds(rows, middle - 0.5, middle + 0.5))
    assert answer.solved
    assert np.abs(equations @ answer.c - sides).max() < 1e-7
    assert np.abs(rows @ answer.c - middle).max() < 0.5 + 1e-6
    pull = cost.T @ (cost @ answer.c - aim) + rows.T @ answer.prices
    left = pull - equations.T @ np.linalg.lstsq(equations.T, pull, rcond=None)[0]
    assert np.abs(left).max() < 1e-4 * np.abs(cost.T @ cost).max()


def test_bounds_that_exclude_each_other_are_widened_by_as_little_as_will_do():
    reduced = reduce(np.eye(2), np.zeros(2), np.zeros((0, 2)), np.zeros(0))
    rows = np.array([[1.0, 0.0], [1.0, 0.0]])
    bounds = Bounds(rows, np.array([1.0, -np.inf]), np.array([np.inf, -1.0]))
    answer = nearest(reduced, bounds)
    assert not answer.solved
    assert answer.widened == pytest.approx(1.0, rel=1e-4)
    assert answer.c[0] == pytest.approx(0.0, abs=1e-4)
