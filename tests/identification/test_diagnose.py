"""The diagnosis: right names, silence on clean records, wrong laws refused, greed in order."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification import screen as screening, search as searching
from supple.identification.diagnose import diagnose
from supple.identification.evidence import (
    at_its_end,
    believable,
    delta_bic,
    effective_samples,
    excess,
    explained,
)
from supple.identification.extend import extend
from supple.identification.fit import solve
from supple.identification.records import split_records
from supple.identification.screen import screen
from supple.identification.trial import HOLDS_ZERO, LEAST_EVIDENCE, UNSHOWN, Trial
from supple.model.law import library
from tests.identification.benches import Bench, make_bench
from tests.identification.conftest import CUBIC


def run(bench: Bench):
    """The bench's records, diagnosed."""
    return diagnose(bench.records, bench.rig, bench.held)


def names(found) -> list[str]:
    """Accepted causes, in order."""
    return [trial.candidate.name for trial in found.accepted]


def strength(found, name: str) -> tuple[float, float]:
    """Value and standard error of a cause in the final fit."""
    index = found.final.index(name)
    return found.final.value(index), found.final.std(index)


def test_a_softening_spring_is_named_with_its_strength(softening_diagnosis):
    found = softening_diagnosis
    assert (found.status, names(found)) == ("named", ["spring/cubic_stiffness"])
    value, std = strength(found, "spring/cubic_stiffness")
    assert abs(value - CUBIC) < 4 * std and std < 0.01 * abs(CUBIC)
    assert excess(found.base) > 10 and excess(found.final) < 0.3
    assert explained(found.base, found.final) > 0.99
    assert found.whiteness[0] < 1e-6 < found.whiteness[1]


def test_dry_friction_is_named_with_its_strength(tmp_path):
    found = run(make_bench(tmp_path, [("coulomb_friction", 0.02)]))
    assert (found.status, names(found)) == ("named", ["spring/coulomb_friction"])
    value, std = strength(found, "spring/coulomb_friction")
    assert value == pytest.approx(0.02, rel=0.03) and std < 0.1 * value


def test_clean_decays_are_adequate(clean_diagnosis):
    found = clean_diagnosis
    assert (found.status, found.accepted, found.final) == ("adequate", (), found.base)
    assert found.held_after is found.held_before


@pytest.mark.parametrize("rho", [0.5, 0.9])
def test_clean_decays_under_coloured_noise_are_adequate(tmp_path, rho):
    found = run(make_bench(tmp_path, noise="ar1", noise_law={"rho": rho}, seed=3, snr_db=30.0))
    assert (found.status, names(found)) == ("adequate", [])


def test_clean_driven_records_are_adequate(tmp_path):
    found = run(make_bench(tmp_path, driven=True, snr_db=30.0))
    assert (found.status, names(found)) == ("adequate", [])


def test_two_causes_are_found_one_after_the_other(tmp_path):
    effects = [("cubic_stiffness", CUBIC), ("quadratic_damping", 1.0)]
    found = run(make_bench(tmp_path, effects))
    assert found.status == "named"
    assert sorted(names(found)) == ["spring/cubic_stiffness", "spring/quadratic_damping"]
    costs = [excess(stage) for stage in found.stages]
    assert costs == sorted(costs, reverse=True) and len(costs) == 3
    assert found.stages[0] is found.base and found.stages[-1] is found.final
    first = found.accepted[0]
    weight = explained(found.base, found.stages[1])
    assert weight > 0.5, "the law that explains most comes first"
    assert all(trial.delta_bic >= LEAST_EVIDENCE for trial in found.accepted)
    assert [law.name for _, law in first.fit.model.causes] == [first.candidate.law.name]


def test_where_the_library_lacks_the_law_nothing_wrong_is_named(tmp_path, monkeypatch):
    bench = make_bench(tmp_path, [("cubic_stiffness", CUBIC)])
    wrong = ["quadratic_damping", "coulomb_friction"]
    monkeypatch.setattr(
        screening, "possible_causes", lambda fit: [("spring", library()[n]) for n in wrong
        if n not in {law.name for _, law in fit.model.causes}],
    )  # fmt: skip
    found = run(bench)
    assert found.status == "unknown"
    assert excess(found.final) > 10


def test_a_law_that_does_not_foretell_is_refused(softening_diagnosis):
    found = softening_diagnosis
    for trial in found.trials:
        name = trial.candidate.name
        assert (trial.verdict == "accepted") == (name in names(found)), (name, trial.verdict)


def test_zero_is_refused_by_the_records_whatever_the_standard_deviation(
    softening_diagnosis, monkeypatch
):
    trial = softening_diagnosis.accepted[0]
    unsure = replace(trial.fit, covariance=1e6 * trial.fit.covariance)
    monkeypatch.setattr(searching, "settled", lambda fit, far: unsure)
    search = searching.Search(softening_diagnosis.base, None, lambda text: None)
    assert trial.delta_bic > UNSHOWN
    assert search._judge(trial, search.base).verdict == "accepted"
    weak = replace(trial, delta_bic=UNSHOWN - 1.0)
    assert search._judge(weak, search.base).verdict == "accepted", "all is worse without it"
    monkeypatch.setattr(searching.Search, "_without", lambda self, one: one.fit)
    assert search._judge(weak, search.base).verdict == HOLDS_ZERO


def test_where_no_law_is_accepted_the_rig_itself_is_fitted_to_the_end(
    softening_diagnosis, monkeypatch
):
    base = softening_diagnosis.base
    away = base.x * np.where([e.slot == "numbers" for e in base.model.entries], 1.001, 1.0)
    early = solve(base.model, away, 1)
    assert not early.converged and early.cost > base.cost
    search = searching.Search(early, None, lambda text: None)
    monkeypatch.setattr(searching.Search, "step", lambda self: False)
    search.grow()
    assert search.base is search.fit and search.stages == [search.base]
    assert search.fit.converged
    assert search.fit.cost == pytest.approx(base.cost, rel=1e-4)


def test_a_law_that_only_led_the_rig_to_better_constants_leaves_them_to_it(clean_diagnosis):
    base = clean_diagnosis.base
    moved = np.where([e.slot == "numbers" for e in base.model.entries], 1.02, 1.0) * base.x
    stuck = solve(base.model, moved, 0)
    assert stuck.cost > 3.0 * base.cost
    guide = next(c for c in screen(base) if c.law.name == "quadratic_damping")
    trial = Trial(guide, extend(base, guide, 40), 1000.0)
    search = searching.Search(stuck, None, lambda text: None)
    search.trials.append(trial)
    assert search._led(trial)
    assert (search.trials[-1].candidate, search.trials[-1].verdict) == (guide, searching.LED)
    assert search.fit is search.base and search.stages == [search.base]
    assert search.base.model.causes == ()
    assert search.base.cost == pytest.approx(base.cost, rel=0.01)
    again = searching.Search(search.base, None, lambda text: None)
    again.trials.append(trial)
    assert not again._led(trial), "from there it leads nowhere"


def test_a_law_that_is_needed_leaves_nothing_to_the_rig(softening_diagnosis):
    right, base = softening_diagnosis.accepted[0], softening_diagnosis.base
    search = searching.Search(base, None, lambda text: None)
    search.trials.append(right)
    assert not search._led(right)
    assert search.base is base and search.trials[-1] is right


def test_a_cause_that_a_later_one_made_idle_is_dropped(softening_diagnosis):
    right, base = softening_diagnosis.accepted[0], softening_diagnosis.base
    stand_in = next(c for c in screen(base) if c.law.name == "quadratic_damping")
    first = Trial(stand_in, extend(base, stand_in), 100.0)
    both = replace(right, fit=extend(first.fit, right.candidate, 40))
    search = searching.Search(base, None, lambda text: None)
    search._accept([first, both], [])
    assert [one.candidate.name for one in search.accepted] == ["spring/cubic_stiffness"]
    assert (search.trials[-1].candidate, search.trials[-1].verdict) == (stand_in, searching.IDLE)
    assert search.fit.cost == pytest.approx(softening_diagnosis.final.cost, abs=1.0)
    assert search.stages == [base, search.fit]


def test_a_cause_that_only_led_the_way_to_better_constants_is_dropped(softening_diagnosis):
    right, base = softening_diagnosis.accepted[0], softening_diagnosis.base
    guide = next(c for c in screen(base) if c.law.name == "quadratic_damping")
    stuck = replace(right, fit=replace(right.fit, cost=50.0 * right.fit.cost))
    both = Trial(guide, extend(right.fit, guide, 40), 100.0)
    search = searching.Search(base, None, lambda text: None)
    search._accept([stuck, both], [])
    assert [one.candidate.name for one in search.accepted] == ["spring/cubic_stiffness"]
    assert (search.trials[-1].candidate, search.trials[-1].verdict) == (guide, searching.IDLE)
    assert search.accepted[0].fit is search.fit and search.stages == [base, search.fit]
    assert search.fit.cost == pytest.approx(softening_diagnosis.final.cost, abs=1.0)
    search.step()
    assert guide.name not in {candidate.name for candidate in search.left}


def test_a_strength_at_the_end_of_what_can_be_is_refused(softening_diagnosis, monkeypatch):
    trial = softening_diagnosis.accepted[0]
    index = trial.fit.index(trial.candidate.entry.label)
    assert not at_its_end(trial.fit, index)
    entries, value = list(trial.fit.model.entries), trial.fit.value(index)
    for bound in ({"low": value}, {"high": value}):
        entries[index] = replace(trial.fit.model.entries[index], **bound)
        fit = replace(trial.fit, model=replace(trial.fit.model, entries=tuple(entries)))
        assert at_its_end(fit, index)
        monkeypatch.setattr(searching, "settled", lambda _, far, fit=fit: fit)
        search = searching.Search(softening_diagnosis.base, None, lambda text: None)
        assert search._judge(trial, search.base).verdict.startswith("refused: it would have to")


def test_evidence_is_earned(softening_diagnosis, clean_fit):
    base, final = softening_diagnosis.base, softening_diagnosis.final
    accepted = softening_diagnosis.accepted[0]
    assert accepted.delta_bic > 100
    assert delta_bic(base, base) == 0.0
    assert explained(base, base) == 0.0
    count = effective_samples(clean_fit)
    assert 0.5 * clean_fit.count < count <= clean_fit.count, "white residuals count in full"
    assert effective_samples(final) > 2 * effective_samples(base), "an error of few tones does not"


def test_stand_ins_that_leave_much_are_not_believed():
    assert believable(0.9, 1.0, 1.0)  # nearly all is explained
    assert believable(0.7, 0.15, 0.08)  # or what was never seen is foretold much better
    assert not believable(0.67, 0.40, 0.26)
    assert not believable(0.67, 1.0, 1.0)  # nothing was held out


def test_what_these_records_cannot_show_is_said(clean_diagnosis):
    found = clean_diagnosis
    tried = {candidate.name for candidate in found.candidates}
    assert set(found.cannot_tell) <= tried
    assert "see_cart/sensor_offset" in found.cannot_tell or "spring/cubic_stiffness" in tried
    for first, second, alike in found.confusable:
        assert {first, second} <= tried and 0.9 < alike <= 1.0 + 1e-9


def test_which_records_are_held_out(clean):
    one, two, three = clean.records[0], clean.records[1], clean.held[0]
    assert three.split == "held_out"
    rest, kept, _ = split_records([one, two, three], [])
    assert (rest, kept) == ([one, two], [three])
    auto = [replace(r, split="auto") for r in (one, two, three)]
    rest, kept, how = split_records(auto, [])
    middle = sorted(auto, key=lambda r: float(np.ptp(r.responses[0].values)))[1]
    assert kept == [middle] and len(rest) == 2 and "middle amplitude" in how
    rest, kept, how = split_records(auto[:2], [])
    assert len(rest) == 2 and not kept and "no record could be spared" in how
    rest, kept, _ = split_records(auto, [auto[0]])
    assert kept == [auto[0]] and rest == auto[1:]
    with pytest.raises(ValueError, match=r"at least one to fit, found only held-out ones.*Mend"):
        split_records([three], [])
