"""Sets that are made of two laws say how surely the records speak for one of them."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import kstest

from supple.identification.bootstrap import contest
from supple.identification.fit import Fit

SAMPLES = 640
TIMES = np.arange(SAMPLES) / SAMPLES
SHARED = np.stack([np.ones(SAMPLES), np.sin(2 * np.pi * TIMES)], axis=1)


def law(curve: np.ndarray) -> np.ndarray:
    """What two constants and a law of its own strength can make of the samples."""
    return np.column_stack([SHARED, curve / np.linalg.norm(curve)])


ONE = law(np.cos(9.0 * TIMES))
TWO = law(np.cos(9.0 * TIMES) + 0.5 * np.cos(14.0 * TIMES))


def fitted(columns: np.ndarray, values: np.ndarray, keys: object = ("a",)) -> Fit:
    """The least squares of a linear law, looked at as a fit is."""
    x = np.linalg.lstsq(columns, values, rcond=None)[0]
    model = SimpleNamespace(residual=lambda x: values - columns @ x, jacobian=lambda x: -columns)
    stub: Any = SimpleNamespace(
        model=model, x=x, keys=keys, residual_of=lambda key: values, problem=object()
    )
    return cast(Fit, stub)


def drawn(columns: np.ndarray, strength: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return columns @ [1.0, 2.0, strength] + rng.standard_normal(SAMPLES)


@pytest.mark.parametrize("true", [0, 1])
def test_chances_of_the_true_law_are_uniform(true):
    told = []
    for seed in range(120):
        values = drawn((ONE, TWO)[true], 6.0, seed)
        found = contest(fitted(ONE, values), fitted(TWO, values), sets=200, seed=seed)
        told.append((found.first, found.second)[true])
    assert kstest(told, "uniform").pvalue > 0.01


def test_a_law_far_away_is_refuted_and_the_true_one_is_not():
    found = []
    for seed in range(40):
        values = drawn(ONE, 12.0, seed)
        found.append(contest(fitted(ONE, values), fitted(TWO, values), sets=200))
    assert sum(one.second < 0.01 <= one.first for one in found) >= 36
    assert np.median([one.share for one in found]) > 0.9 and found[0].sets == 200


def test_two_that_foretell_alike_stay_rivals():
    values = drawn(ONE, 6.0, 1)
    found = contest(fitted(ONE, values), fitted(ONE * [1.0, 1.0, 2.0], values))
    assert found.gap == pytest.approx(0.0, abs=1e-9)
    assert found.first > 0.1 and found.second > 0.1


def test_fits_of_different_records_do_not_compete():
    values = drawn(ONE, 6.0, 1)
    with pytest.raises(ValueError, match="two fits of the same records"):
        contest(fitted(ONE, values), fitted(TWO, values, ("b",)))
