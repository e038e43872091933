"""What is named is weighed by the noise that its channels bear out, and keeps its name."""

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.diagnose import diagnose
from supple.identification.extend import extend
from supple.identification.fit import settle
from supple.identification.problem import make_problem
from supple.identification.screen import screen
from supple.identification.uneven import Uneven
from supple.identification.weighing import with_laws
from supple.model.law import library
from tests.identification.benches import Bench, make_bench
from tests.identification.conftest import CUBIC

NAME = "spring/cubic_stiffness"


def softening(folder, seed: int) -> Bench:
    """A softening spring where noise grows with the motion, at 24 dB."""
    law = {"growth": 5.0}
    return make_bench(
        folder / str(seed), [("cubic_stiffness", CUBIC)],
        noise="heteroscedastic", noise_law=law, snr_db=24.0, seed=seed,
    )  # fmt: skip


@pytest.mark.slow
def test_a_named_cause_is_weighed_by_noise_that_grows(tmp_path):
    bench = softening(tmp_path, 1)
    found = diagnose(bench.records, bench.rig, bench.held)
    (trial,) = found.accepted
    assert (found.status, trial.candidate.name) == ("named", NAME)
    assert {type(noise) for noise in found.final.model.noises.values()} == {Uneven}
    assert found.stages[-1] is found.final is trial.fit and found.held_after is trial.held
    even = settle(extend(found.base, trial.candidate, 25))
    index = found.final.index(NAME)
    assert found.final.std(index) < 0.95 * even.std(index)
    assert abs(found.final.value(index) - CUBIC) < 4 * found.final.std(index)


@pytest.mark.slow
def test_weights_make_a_cause_sharper_and_its_errors_stay_true(tmp_path):
    law, table = library()["cubic_stiffness"], []
    for seed in range(24):
        bench = softening(tmp_path, seed)
        base = fit_base(make_problem(bench.records, bench.rig))
        even = settle(extend(base, screen(base, [("spring", law)])[0], 25))
        weighed, index = with_laws(even), even.index(NAME)
        both = (even, weighed)
        table.append([n for one in both for n in (one.value(index) - CUBIC, one.std(index))])
    by_even, even_std, by_weight, std = np.array(table).T
    assert np.sqrt(np.mean(by_weight**2)) < 0.85 * np.sqrt(np.mean(by_even**2))
    assert np.median(std) < 0.95 * np.median(even_std)
    for errors, told in ((by_even, even_std), (by_weight, std)):
        assert 0.6 < np.sqrt(np.mean((errors / told) ** 2)) < 1.4  # of 24: 0.99 of chances
