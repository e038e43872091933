"""The missing force comes out as it is, against what it goes with."""

from pathlib import Path

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.missing import missing_force
from supple.identification.problem import make_problem
from tests.identification.benches import REACH, STIFFNESS, make_bench

CUBIC = 0.3 * STIFFNESS / REACH**2
CASES = {
    "displacement": (("cubic_stiffness", CUBIC), lambda x: CUBIC * x**3),
    "velocity": (("quadratic_damping", 1.2), lambda v: 1.2 * v * np.abs(v)),
}


@pytest.mark.parametrize("against", CASES)
def test_the_force_that_is_missing_comes_out_as_it_is(against: str, tmp_path: Path) -> None:
    effect, law = CASES[against]
    bench = make_bench(tmp_path, (effect,), (1.0,), (), snr_db=40.0)
    fit = fit_base(make_problem(bench.records, bench.rig))
    found = missing_force(fit, "spring")
    assert found is not None and found.explained > 0.8 and found.record == "train_01"
    curve = found.curves[0]
    assert curve.against == against and curve.share > 0.4 > 2 * found.curves[1].share
    # the force is against the constants as fitted: a straight line through the origin is theirs
    wanted = law(curve.x)
    line = curve.x / np.linalg.norm(curve.x)
    bent, told = (v - line * (line @ v) for v in (wanted, curve.force))
    assert np.linalg.norm(told - bent) < 0.35 * np.linalg.norm(bent)


def test_a_clean_record_misses_no_force(tmp_path: Path) -> None:
    bench = make_bench(tmp_path, (), (1.0,), (), snr_db=40.0)
    fit = fit_base(make_problem(bench.records, bench.rig))
    found = missing_force(fit, "spring")
    assert found is not None
    largest = max(float(np.max(np.abs(curve.force))) for curve in found.curves[:2])
    assert largest < 0.01 * STIFFNESS * REACH
    assert missing_force(fit, "nowhere") is None
