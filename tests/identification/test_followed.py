"""Constants are read along the motion that was, not along a noisy reading of it."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.drive_error import drive_allowances, followed_motions
from supple.identification.fit import Fit, solve
from supple.identification.problem import make_problem
from supple.identification.records import read_record
from supple.model.rig import read_rig
from tests.lab.sealed import draw_sealed


@pytest.fixture(scope="module")
def driven(tmp_path_factory) -> tuple[Fit, dict[str, float]]:
    """A clean lumped club, mostly driven by its wrist, fitted; and its true constants."""
    folder = tmp_path_factory.mktemp("followed")
    truth = draw_sealed(
        folder, "A", 98501, effects=0, model="driven_wrist", noise="white", held_out=0,
        samples=2048,
    )  # fmt: skip
    records = [read_record(path) for path in sorted((folder / "records").glob("train*.toml"))]
    assert any(record.test == "driven" for record in records)
    return fit_base(make_problem(records, read_rig(folder / "records" / "rig.toml"))), truth


@pytest.mark.slow
def test_where_it_was_estimated_it_foretells_what_the_told_motion_does(driven):
    fit, _ = driven
    assert fit.model.followed
    model = replace(
        fit.model, allowances={k: v[0] for k, v in drive_allowances(fit.model, fit.x).items()}
    )
    bare = replace(model, followed={})
    told = bare.predict(fit.x)
    estimates = bare.estimates(told)
    along = replace(bare, followed=followed_motions(bare, estimates))
    seen = along.predict(fit.x)
    for key, values in told.items():
        noise = fit.judged[key][0].marginal_std
        gap = np.abs(seen[key] - values) / noise
        assert np.max(gap) < 0.05 and np.sum(gap > 2e-3) <= 3, key  # at first the spline's own end
    for prepared in model.problem.records:
        if prepared.name in estimates:
            inputs, *_ = along.arguments(prepared)
            moved = np.std(inputs - prepared.inputs, axis=0)
            drive = next(name for name in prepared.drives if name)
            channel = prepared.record.channel(drive)
            assert 0.0 < np.max(moved) < 1e-2 * np.std(channel.values)


@pytest.mark.slow
def test_errors_of_the_told_motion_draw_no_constant_away(driven):
    """Read along the told motion a club was shorter by nearly four standard deviations."""
    fit, truth = driven
    worst = {}
    for along in (fit, solve(replace(fit.model, followed={}), fit.x, 60)):
        gaps = []
        for index, entry in enumerate(along.model.entries):
            true = truth["constants"].get(entry.label)
            if entry.slot == "numbers" and entry.record is None and true is not None:
                gaps.append(abs(along.value(index) - true) / fit.std(index))
        assert len(gaps) >= 9
        worst[along is fit] = max(gaps)
    assert worst[True] < 2.5 < worst[False]


@pytest.mark.slow
def test_a_record_that_was_thinned_is_read_along_what_was_told(driven):
    fit, _ = driven
    prepared = next(p for p in fit.problem.records if p.name in fit.model.followed)
    assert fit.model.arguments(prepared)[0] is fit.model.followed[prepared.name].inputs
    other = replace(prepared, inputs=prepared.inputs[::2])
    assert fit.model.arguments(other)[0] is other.inputs


@pytest.mark.slow
def test_what_no_noise_explains_is_no_motion_that_was(driven):
    fit, _ = driven
    estimates = fit.model.estimates(fit.model.predict(fit.x))
    assert set(followed_motions(fit.model, estimates)) == set(fit.model.followed)
    far = {name: 5.0 * values for name, values in estimates.items()}
    assert followed_motions(fit.model, far) == {}
