"""The peers of the benchmark of fits are given the problem that we solve."""

import numpy as np
import pytest

from supple.identification.problem import Model, base_entries, make_problem
from supple.identification.records import read_record
from supple.model.rig import read_rig
from supple.studies.benchmark import fits


def test_both_simulate_the_same_motion(tmp_path, monkeypatch):
    monkeypatch.setattr(fits, "RECORDS", 1)
    pushed, seen = fits.written(tmp_path)
    problem = make_problem(
        [read_record(tmp_path / "record_00.toml")], read_rig(tmp_path / "rig.toml")
    )
    entries = tuple(e for e in base_entries(problem) if e.slot == "numbers" and not e.nuisance)
    order = [fits._place(entry.label) for entry in entries]
    assert sorted(order) == list(range(8))
    model = Model(problem, entries, (), {})
    (ours,) = model.predict(fits.TRUTH[order] / model.scale).values()
    theirs = fits.by_solve_ivp(fits.TRUTH, pushed[0], (1e-9, 1e-12))
    size = np.max(np.abs(theirs))
    assert ours == pytest.approx(theirs, abs=1e-6 * size)
    ratio = np.std(seen[0] - theirs) / np.sqrt(np.mean(theirs**2))
    assert 20 * np.log10(1 / ratio) == pytest.approx(fits.LOUD, abs=0.5)
