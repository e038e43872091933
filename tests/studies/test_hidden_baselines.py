"""What simpler tools would say of the records: the yardsticks of the hidden-effect study."""

import sys

import numpy as np
import pytest

from supple.identification.fit import fit_base
from supple.identification.problem import make_problem
from supple.studies.engine import read_inputs
from supple.studies.hidden_baselines import _regressions, sparse_regression, white_bic
from tests.identification.benches import make_bench
from tests.identification.conftest import CUBIC


@pytest.fixture(scope="module")
def softening(tmp_path_factory):
    return make_bench(tmp_path_factory.mktemp("softening"), [("cubic_stiffness", CUBIC)])


def test_pick_by_bic_finds_an_easy_effect(softening):
    found = white_bic(softening.paths)
    assert found is not None
    assert (found["law"], found["place"]) == ("cubic_stiffness", "spring")
    assert found["delta_bic"] > 100


def test_sparse_regression_picks_a_term_of_what_is_left(softening):
    found = sparse_regression(softening.paths)
    assert found is not None
    assert found["place"] in ("spring", "see_cart") and found["law"]
    assert found["share"] > 0.1


def test_terms_and_residual_have_the_size_of_one(softening):
    inputs = read_inputs(softening.paths, None)
    base = fit_base(make_problem(inputs.records, inputs.rig))
    [(names, terms, residual)] = _regressions(base)
    assert terms.shape == (len(residual), len(names)) and len(names) == len(set(names))
    assert {place for place, _ in names} == {"cart", "spring", "see_cart"}
    assert np.sqrt(np.mean(terms**2, axis=0)) == pytest.approx(np.ones(len(names)))
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(1.0)


def test_without_its_library_the_regression_says_nothing(softening, monkeypatch):
    monkeypatch.setitem(sys.modules, "pysindy", None)
    assert sparse_regression(softening.paths) is None


def test_records_that_cannot_be_read_have_no_baseline(tmp_path):
    missing = [tmp_path / "none.toml"]
    assert white_bic(missing) is None and sparse_regression(missing) is None
