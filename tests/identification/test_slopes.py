"""Derivatives by records: the same products as of the whole matrix, whatever is summed out."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.identification.allowance import Allowance, marginal_of
from supple.identification.slopes import WILD, Block, Slopes


def drawn(seed: int) -> tuple[Slopes, np.ndarray]:
    """Slopes of three records, two with numbers summed out, and their matrix, made apart."""
    chance = np.random.default_rng(seed)
    count, blocks, matrix = 6, [], []
    for samples, own, many in ((40, 3, 25), (30, 4, 0), (50, 1, 7)):
        rows = chance.normal(size=(samples, own))
        which = chance.choice(count, own, replace=False)
        root, marginal = np.eye(samples), None
        if many:
            open_ = chance.normal(size=(samples, many)) * 10.0 ** chance.uniform(-1, 1, many)
            allowance = Allowance(("drive",) * many, (open_,), np.ones(many))
            marginal = marginal_of(allowance, open_)
            values, vectors = np.linalg.eigh(np.eye(samples) + open_ @ open_.T)
            root = vectors @ np.diag(values**-0.5) @ vectors.T
        blocks.append(Block(rows, which, marginal))
        wide = np.zeros((samples, count))
        wide[:, which] = root @ rows
        matrix.append(wide)
    priors = np.array([2, 5])
    blocks.append(Block(np.diag([3.0, 0.5]), priors))
    matrix.append(np.diag([3.0, 0.5]) @ np.eye(count)[priors])
    return Slopes(tuple(blocks), count), np.concatenate(matrix)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_products_are_those_of_the_whole_matrix(seed):
    slopes, matrix = drawn(seed)
    chance = np.random.default_rng(seed + 1)
    step, residual = chance.normal(size=6), chance.normal(size=len(matrix))
    assert slopes.matrix() == pytest.approx(matrix, abs=1e-9)
    assert slopes.gram == pytest.approx(matrix.T @ matrix, abs=1e-9)
    assert slopes.along(step) == pytest.approx(matrix @ step, abs=1e-9)
    assert slopes.pull(residual) == pytest.approx(matrix.T @ residual, abs=1e-9)


def test_what_is_no_number_has_no_slope():
    slopes = Slopes.of(np.array([[np.nan, 1.0], [np.inf, -np.inf]]))
    assert slopes.matrix().tolist() == [[0.0, 1.0], [WILD, -WILD]]
    assert np.all(np.isfinite(slopes.gram))
