"""Fits and diagnoses that several files of tests look at, made once in a session."""

import pytest

from supple.identification.base import fit_base
from supple.identification.diagnose import diagnose
from supple.identification.finding import Diagnosis
from supple.identification.fit import Fit
from supple.identification.problem import Problem, make_problem
from tests.identification.benches import Bench, make_bench
from tests.identification.replicates import small

CUBIC = -5e4  # N/m^3: at 20 mm it takes a quarter of the stiffness away


@pytest.fixture(scope="session")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Decays of a linear cart."""
    return make_bench(tmp_path_factory.mktemp("clean"))


@pytest.fixture(scope="session")
def softening(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """Decays of a cart whose spring softens."""
    return make_bench(tmp_path_factory.mktemp("softening"), [("cubic_stiffness", CUBIC)])


@pytest.fixture(scope="session")
def clean_fit(clean: Bench) -> Fit:
    """The clean cart, fitted."""
    return fit_base(make_problem(clean.records, clean.rig))


@pytest.fixture(scope="session")
def softening_fit(softening: Bench) -> Fit:
    """The softening cart, fitted by the linear model."""
    return fit_base(make_problem(softening.records, softening.rig))


@pytest.fixture(scope="session")
def small_problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """A short decay that is sampled often, for replicates drawn from our own model."""
    fine = make_bench(tmp_path_factory.mktemp("often"), finer=4)
    return small(fine.paths[0], fine.rig.path)


@pytest.fixture(scope="session")
def clean_diagnosis(clean: Bench) -> Diagnosis:
    """Of the clean cart."""
    return diagnose(clean.records, clean.rig, clean.held)


@pytest.fixture(scope="session")
def softening_diagnosis(softening: Bench) -> Diagnosis:
    """Of the softening cart."""
    return diagnose(softening.records, softening.rig, softening.held)
