"""Foretelling records never fitted: nothing shared is learned of them; thinning keeps answers."""

from dataclasses import replace

import numpy as np
import pytest

import supple.identification.extend as extend_module
from supple.identification.base import fit_base
from supple.identification.extend import (
    RUNS_AWAY,
    calmed,
    extended_model,
    held_out,
    shown_by,
    thinned,
    without,
)
from supple.identification.fit import solve
from supple.identification.problem import (
    Model,
    Problem,
    base_entries,
    make_problem,
    rough_noise,
)
from supple.identification.screen import screen
from supple.model.law import library
from supple.model.rig import read_rig
from tests.identification.benches import make_bench


@pytest.fixture(scope="module")
def unseen(softening) -> Problem:
    """The softening cart's held-out record."""
    return make_problem(softening.held, softening.rig)


def spoiled(problem: Problem) -> Problem:
    """The same record with nonsense after its opening."""
    records = []
    for prepared in problem.records:
        late = [s.times > 1.05 * prepared.opening for s in prepared.sensors]
        sensors = tuple(
            replace(s, values=np.where(where, 3.0 * np.sin(7.0 * s.times), s.values))
            for s, where in zip(prepared.sensors, late, strict=True)
        )
        records.append(replace(prepared, sensors=sensors))
    return replace(problem, records=tuple(records))


def test_what_comes_after_the_opening_changes_no_forecast(softening_fit, unseen):
    plain = held_out(softening_fit, unseen)
    other = held_out(softening_fit, spoiled(unseen))
    for key in plain.errors:
        size = np.max(np.abs(plain.fit.predicted[key]))
        gap = np.max(np.abs(plain.fit.predicted[key] - other.fit.predicted[key]))
        assert gap < 0.03 * size, "only the zero's prior width knows the record's largest value"
        assert other.errors[key] > 10 * plain.sizes[key]


def test_a_forecast_that_ends_elsewhere_begins_again_without_the_law(
    softening_diagnosis, unseen, monkeypatch
):
    fit = softening_diagnosis.final
    right = held_out(fit, unseen)

    def astray(model, x, evaluations, *rest):
        """Descends rightly only where no law acts, or from near the minimum."""
        acts = any(e.slot == "strengths" and value != 0.0 for e, value in model.fixed)
        begun = np.array([e.value / e.scale for e in model.entries])
        stuck = acts and np.allclose(x, begun)
        return solve(model, begun, 0) if stuck else solve(model, x, evaluations, *rest)

    monkeypatch.setattr(extend_module, "solve", astray)
    found = held_out(fit, unseen)
    assert found.nrmse == pytest.approx(right.nrmse, rel=0.02)


def test_shared_constants_are_held(softening_fit, unseen):
    found = held_out(softening_fit, unseen)
    free = {entry.slot for entry in found.fit.model.entries}
    assert free <= {"start", "offset"}
    held = {entry.name: value for entry, value in found.fit.model.fixed}
    for i, entry in enumerate(softening_fit.model.entries):
        if entry.record is None:
            assert held[entry.name] == softening_fit.value(i)
    prepared = found.fit.problem.records[0]
    numbers = found.fit.model.numbers(prepared, found.fit.x)
    index = softening_fit.index("links.spring.stiffness")
    assert numbers["links.spring.stiffness"] == softening_fit.value(index)


def test_a_right_law_foretells_to_the_noise_and_a_lacking_one_does_not(softening_diagnosis):
    before, after = softening_diagnosis.held_before, softening_diagnosis.held_after
    assert before is not None and after is not None
    assert before.nrmse > 5 * before.noise_floor or before.nrmse > 0.1
    assert after.nrmse < 1.3 * after.noise_floor
    assert after.nrmse < 0.1 * before.nrmse
    for key, share in after.mean_errors.items():
        assert 0 < share < after.errors[key] / after.sizes[key]


def test_held_out_records_show_a_law_that_moves_them_and_no_other(softening_diagnosis):
    held = softening_diagnosis.held_after
    law = library()["cubic_stiffness"]
    assert held is not None and shown_by(held, "spring", law)
    fixed = tuple(
        (entry, 1e-9 * value if entry.name == "spring/cubic_stiffness" else value)
        for entry, value in held.fit.model.fixed
    )
    faint = replace(held, fit=replace(held.fit, model=replace(held.fit.model, fixed=fixed)))
    assert not shown_by(faint, "spring", law)
    assert shown_by(held, "cart", law), "of what is not among its numbers nothing is known"


def test_clean_records_are_foretold_to_the_noise(clean_fit, clean):
    found = held_out(clean_fit, make_problem(clean.held, clean.rig))
    assert found.nrmse == pytest.approx(0.01, rel=0.3), "40 dB"
    assert found.nrmse < 1.2 * found.noise_floor


def test_numbers_of_each_record_start_from_the_typical_one(clean_fit, tmp_path):
    bench = make_bench(tmp_path)
    text = bench.rig.path.read_text()
    at = text.index("damping")
    bench.rig.path.write_text(
        text[:at] + text[at:].replace("free = true", 'free = true, per = "record"', 1)
    )
    rig = read_rig(bench.rig.path)
    fit = fit_base(make_problem(bench.records, rig))
    found = held_out(fit, make_problem(bench.held, rig))
    entry = next(e for e in found.fit.model.entries if e.slot == "numbers")
    own = [fit.value(i) for i, e in enumerate(fit.model.entries) if e.name == entry.name]
    assert entry.value == pytest.approx(np.median(own))
    assert found.nrmse < 1.3 * found.noise_floor


def test_thinned_records_keep_the_answers(tmp_path):
    bench = make_bench(tmp_path, held=(), finer=8, snr_db=90.0)
    dense = make_problem(bench.records, bench.rig)
    model = Model(dense, base_entries(dense), (), rough_noise(dense))
    thin = thinned(model).problem
    for before, after in zip(dense.records, thin.records, strict=True):
        assert after.count < 0.6 * before.count
        assert after.step * after.count == pytest.approx(before.step * before.count, rel=0.02)
        assert after.sensors[0].times[1] == pytest.approx(after.step)
    whole, part = fit_base(dense), fit_base(thin)
    for name in ("links.spring.stiffness", "links.spring.damping"):
        i, j = whole.index(name), part.index(name)
        assert part.value(j) == pytest.approx(whole.value(i), abs=3 * part.std(j))
        assert part.std(j) > whole.std(i)


def test_short_records_are_not_thinned(softening_fit):
    thin = thinned(softening_fit.model)
    assert [p.count for p in thin.problem.records] == [
        p.count for p in softening_fit.problem.records
    ]


def test_an_extended_model_at_zero_strength_is_the_old_one(softening_fit):
    for candidate in screen(softening_fit)[:3]:
        model = extended_model(softening_fit, candidate)
        shapes = [shape.value / shape.scale for shape in candidate.shapes]
        x = np.append(softening_fit.x, [0.0, *shapes])
        null = solve(model, x, 0)
        assert null.cost == pytest.approx(softening_fit.cost, rel=1e-3), candidate.name


def test_every_law_that_is_taken_out_takes_all_its_numbers_along(softening_fit):
    slots = set()
    for candidate in screen(softening_fit):
        model = extended_model(softening_fit, candidate)
        more = [entry.value / entry.scale for entry in model.entries[len(softening_fit.x) :]]
        size = len(softening_fit.x) + len(more)
        x = np.append(softening_fit.x, more)
        grown = replace(softening_fit, model=model, x=x, covariance=np.zeros((size, size)))
        bare = without(grown, *candidate.cause)
        assert bare.model.entries == softening_fit.model.entries, candidate.name
        assert bare.model.causes == () and bare.x.shape == bare.covariance[0].shape
        slots.add(candidate.law.slot)
    assert {"", "offset", "fault"} <= slots


def test_a_law_that_would_run_away_is_tried_with_less_of_it(softening_fit):
    bare = softening_fit
    candidate = next(c for c in screen(bare) if c.law.name == "cubic_stiffness")
    model = extended_model(bare, candidate)
    for size in (1e-3, -100.0):  # the softer, the further it goes
        start = np.append(bare.x, [size])
        found = calmed(model, start, bare)
        cost = float(np.sum(model.residual(found) ** 2))
        assert cost < RUNS_AWAY * bare.cost
        assert np.array_equal(found[:-1], bare.x)
        assert (found[-1] == size) == (abs(size) < 1.0)
        assert np.sign(found[-1]) == np.sign(size)
    assert np.sum(model.residual(start) ** 2) > RUNS_AWAY * bare.cost
