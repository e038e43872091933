"""A hammer's zero is what it reads before and after the blow."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.extend import held_out
from supple.identification.free import DRIVE_TOLERANCE, Entry, drive_entries
from supple.identification.problem import make_problem
from supple.identification.records import split_records
from tests.identification.test_told import drawn

RNG = np.random.default_rng(11)
BLOW = 200.0 * np.sin(np.linspace(0.0, np.pi, 9))


def entry(values: np.ndarray, test: str = "impact", **tolerance: float) -> Entry:
    channel = SimpleNamespace(
        name="hammer", quantity="force", unit="N", values=values, tolerance=tolerance
    )
    record = SimpleNamespace(test=test, inputs=[channel])
    (found,) = drive_entries([cast(Any, SimpleNamespace(record=record))])
    return found


def struck(count: int = 4000, blow: np.ndarray = BLOW) -> np.ndarray:
    values = 0.7 + 0.3 * RNG.normal(size=count)
    values[100 : 100 + len(blow)] += blow
    return values


def test_its_zero_is_told_by_its_calm_samples():
    found = entry(struck())
    assert found.center == found.value == pytest.approx(-0.7, abs=0.02)
    assert found.prior == found.scale == pytest.approx(6.0 * 0.3 / np.sqrt(4000), rel=0.1)
    assert entry(struck(), offset=1e-3).prior == 1e-3, "what is told is not widened"
    exact = entry(np.round(struck(), -1))
    assert 0.0 < exact.prior < 1e-4 * 200.0


@pytest.mark.parametrize(
    ("values", "test"),
    [(struck(), "decay"), (struck(500, 150.0 * np.sin(np.linspace(0.0, np.pi, 300))), "impact")],
)
def test_a_force_that_is_hardly_ever_off_tells_no_zero(values, test):
    found = entry(values, test)
    assert found.center == found.value == 0.0
    assert found.prior == pytest.approx(DRIVE_TOLERANCE * np.max(np.abs(values)))


@pytest.mark.slow
def test_a_held_out_blow_on_a_real_club_is_foretold(tmp_path):
    """Its ringing had been taken for a push of the hammer and gains of 0.3: 33 % were missed."""
    records, rig = drawn(
        tmp_path, "--bench", "B", "--seed", "98430", "--law", "drive_ripple", "--place", "drive"
    )
    train, held, _ = split_records(records, ())
    found = held_out(fit_base(make_problem(train, rig)), make_problem(held, rig))
    assert found.nrmse < 0.05
    for index, one in enumerate(found.fit.model.entries):
        if one.slot == "gain":
            assert abs(found.fit.value(index) - one.center) < 3.0 * one.prior
