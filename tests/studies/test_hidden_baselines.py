"""What simpler tools would say of the records: the yardsticks of the hidden-effect study."""

import sys

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.problem import make_problem
from supple.studies.hidden_baselines import _regressions, sparse_regression, white_bic
from tests.identification.benches import make_bench
from tests.identification.conftest import CUBIC


@pytest.fixture(scope="module")
def softening(tmp_path_factory):
    bench = make_bench(tmp_path_factory.mktemp("softening"), [("cubic_stiffness", CUBIC)])
    return fit_base(make_problem(bench.records, bench.rig))


@pytest.mark.slow
def test_pick_by_bic_finds_an_easy_effect(softening):
    found = white_bic(softening)
    assert found is not None
    assert (found["law"], found["place"]) == ("cubic_stiffness", "spring")
    assert found["delta_bic"] > 100


def test_sparse_regression_picks_a_term_of_what_is_left(softening):
    found = sparse_regression(softening)
    assert found is not None
    assert found["place"] in ("spring", "see_cart") and found["law"]
    assert found["share"] > 0.1


def test_terms_and_residual_have_the_size_of_one(softening):
    [(names, terms, residual)] = _regressions(softening)
    assert terms.shape == (len(residual), len(names)) and len(names) == len(set(names))
    assert {place for place, _ in names} == {"cart", "spring", "see_cart"}
    assert np.sqrt(np.mean(terms**2, axis=0)) == pytest.approx(np.ones(len(names)))
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(1.0)


def test_without_its_library_the_regression_says_nothing(softening, monkeypatch):
    monkeypatch.setitem(sys.modules, "pysindy", None)
    assert sparse_regression(softening) is None


def test_without_a_fit_there_is_no_baseline():
    assert white_bic(None) is None and sparse_regression(None) is None
