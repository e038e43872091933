"""The screen: what one linear step promises is what a refit keeps, for weak effects."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.causes import hidden_masses, leaving_out, possible_causes
from supple.identification.extend import extend
from supple.identification.fit import Fit
from supple.identification.problem import make_problem
from supple.identification.screen import (
    Candidate,
    _columns,
    _force_columns,
    _held,
    alikeness,
    screen,
    trials_of,
)
from supple.model.ringing import TRIALS
from tests.identification.benches import make_bench


@pytest.fixture(scope="module")
def weak(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """Decays of a cart whose spring softens by a tenth of a percent."""
    bench = make_bench(tmp_path_factory.mktemp("weak"), [("cubic_stiffness", -200.0)], held=())
    return fit_base(make_problem(bench.records, bench.rig))


@pytest.fixture(scope="module")
def seen(weak: Fit) -> dict[str, Candidate]:
    """All candidates of the weak effect by name."""
    return {candidate.name: candidate for candidate in screen(weak)}


def test_the_promised_gain_is_what_the_refit_keeps(weak, seen):
    candidate = seen["spring/cubic_stiffness"]
    assert candidate.gain > 20
    full = extend(weak, candidate, 25)
    kept = weak.cost - full.cost
    assert candidate.gain == pytest.approx(kept, rel=0.1)
    strength = full.value(full.index("spring/cubic_stiffness"))
    std = candidate.entry.scale / candidate.visible
    assert abs(strength + 200.0) < 4 * std
    assert candidate.step * candidate.entry.scale == pytest.approx(strength, abs=0.3 * std)


def test_candidates_come_with_the_largest_gain_first(seen):
    gains = [candidate.gain for candidate in seen.values()]
    assert gains == sorted(gains, reverse=True)
    for candidate in seen.values():
        assert 0.0 <= candidate.p_value <= 1.0
        # the best of several shapes gains something by chance alone
        assert candidate.p_value < 0.05 or candidate.gain < 5.0 or candidate.shapes


def test_columns_are_projected_off_everything_that_is_fitted(weak, seen):
    jacobian = weak.model.jacobian(weak.x)
    basis = np.linalg.qr(jacobian)[0]
    for candidate in seen.values():
        if candidate.visible < 1e-6:
            continue
        assert np.linalg.norm(candidate.column) == pytest.approx(1.0)
        assert np.abs(basis.T @ candidate.column).max() < 1e-6, candidate.name


def test_what_stands_on_its_bound_takes_nothing_up(tmp_path):
    bench = make_bench(tmp_path, held=())
    numbers = dict(bench.rig.parameters)
    name = "links.spring.damping"
    numbers[name] = replace(numbers[name], value=0.11, low=0.05, high=0.12)
    problem = make_problem(bench.records, replace(bench.rig, parameters=numbers))
    fit = fit_base(problem)
    assert fit.value(fit.index(name)) == pytest.approx(0.12, rel=1e-3)
    seen = {one.name: one for one in screen(fit)}
    drag = seen["spring/quadratic_damping"]
    kept = fit.cost - extend(fit, drag, 25).cost
    assert kept > 50.0, "drag makes up for a part of what is missing"
    assert drag.gain == pytest.approx(kept, rel=0.2)


def test_one_sided_laws_promise_nothing_on_their_wrong_side(clean_fit, weak):
    wrong = 0
    for fit in (clean_fit, weak):
        residual = fit.model.residual(fit.x)
        for candidate in screen(fit):
            if candidate.law.signed:
                assert candidate.gain == pytest.approx((candidate.column @ residual) ** 2)
                continue
            low = candidate.entry.low / candidate.entry.scale
            assert candidate.step >= low
            if candidate.visible > 1e-6 and -candidate.column @ residual < low * candidate.visible:
                assert (candidate.gain, candidate.step) == (0.0, low)
                wrong += 1
    assert wrong >= 1, "no law was pulled to its wrong side: the test saw nothing"


def test_forces_of_laws_give_the_same_columns_as_the_laws_themselves(clean_fit):
    causes = [cause for cause in possible_causes(clean_fit) if cause[1].acts]
    trials = [trial for cause in causes for trial in trials_of(clean_fit, cause)]
    assert len(trials) > len(causes), "a law with a shape is tried with several"
    quick = _force_columns(clean_fit, trials)
    slow = np.zeros_like(quick)
    for which, block in _wide(clean_fit, trials):
        slow[:, which] = block
    for index, trial in enumerate(trials):
        place, law = trial.cause
        size = np.linalg.norm(slow[:, index])
        gap = np.linalg.norm(quick[:, index] - slow[:, index])
        smooth = law.name in ("cubic_stiffness", "quadratic_damping")
        # 25 samples a period: corners fall between them
        assert gap < (1e-2 if smooth else 5e-2) * size, f"{place}/{law.name}: {gap / size:.1e}"


def _wide(fit, trials):
    """Columns by the nonlinear integrator at the laws' null, one place after the other."""
    for index, trial in enumerate(trials):
        held = _held(fit) + tuple((shape, shape.value) for shape in trial.shapes)
        model = replace(fit.model, entries=(trial.entry,), causes=(trial.cause,), fixed=held)
        yield [index], model.jacobian(np.zeros(1))[: fit.count]


def test_a_law_in_force_changes_how_columns_are_made(softening_diagnosis):
    grown = softening_diagnosis.final
    causes = possible_causes(grown)
    assert ("spring", "cubic_stiffness") not in {(place, law.name) for place, law in causes}
    trials = [trial for cause in causes for trial in trials_of(grown, cause)]
    covered = sorted(i for which, _ in _columns(grown, trials) for i in which)
    assert covered == list(range(len(trials)))


def test_a_second_cause_that_rings_is_sought_at_all_its_frequencies(softening_diagnosis):
    """Beside a wrist's damping a yielding support was asked at one frequency, and not seen."""
    grown = softening_diagnosis.final
    tried = {cause: trials_of(grown, cause) for cause in possible_causes(grown)}
    rings = {law.name: ones for (_, law), ones in tried.items() if law.rings}
    assert "extra_mode" in rings
    assert all(len({one.shapes[0].value for one in ones}) == TRIALS for ones in rings.values())
    assert all(len(ones) == 1 for (_, law), ones in tried.items() if law.acts and not law.rings)


@pytest.mark.slow
def test_beside_a_law_in_force_forces_give_the_same_columns_as_the_laws_themselves(
    softening_diagnosis,
):
    """About a nonlinear motion, through the law that acts already."""
    grown = softening_diagnosis.final
    tried = {c: trials_of(grown, c) for c in possible_causes(grown) if c[1].acts}
    trials = [one[len(one) // 2] for one in tried.values()]
    quick = _force_columns(grown, trials)
    for index, trial in enumerate(trials):
        place, law = trial.cause
        held = _held(grown) + tuple((shape, shape.value) for shape in trial.shapes)
        causes = (*grown.model.causes, trial.cause)
        model = replace(grown.model, entries=(trial.entry,), causes=causes, fixed=held)
        slow = model.jacobian(np.zeros(1))[: grown.count, 0]
        gap = np.linalg.norm(quick[:, index] - slow) / np.linalg.norm(slow)
        # what asymmetry adds nearly cancels over a period: between samples its corners weigh more
        most = 0.1 if law.name == "asymmetric_stiffness" else 2e-2
        assert gap < most, f"{place}/{law.name}: {gap:.1e}"


def test_only_laws_that_make_sense_are_tried(clean_fit, tmp_path):
    straight = {(place, law.name) for place, law in possible_causes(clean_fit)}
    assert ("spring", "coulomb_friction") in straight
    assert not any(name == "gravity" for _, name in straight), "no gravity on a straight chain"
    assert ("spring", "linear_damping") not in straight, "the rig varies that already"
    assert ("spring", "linear_stiffness") not in straight
    bench = make_bench(tmp_path, motion="rotation", held=())
    turning = fit_base(make_problem(bench.records, bench.rig))
    assert any(law.name == "gravity" for _, law in possible_causes(turning))


def test_a_channel_of_a_free_decay_can_lag_only_behind_another_one(clean_fit):
    def lags(copies: int) -> set[str]:
        records = tuple(replace(one, sensors=one.sensors * copies) for one in problem.records)
        model = replace(clean_fit.model, problem=replace(problem, records=records))
        causes = possible_causes(replace(clean_fit, model=model))
        return {place for place, law in causes if law.name == "sensor_lowpass"}

    problem = clean_fit.problem
    assert all(one.free and len(one.sensors) == 1 for one in problem.records)
    assert lags(1) == set(), "its start says the same"
    assert lags(2) == {problem.records[0].sensors[0].channel.name}


def test_laws_that_are_left_out_are_not_tried(clean_fit):
    every = {(place, law.name) for place, law in possible_causes(clean_fit)}
    problem = leaving_out(clean_fit.problem, ["coulomb_friction", "sensor_saturation"])
    fit = replace(clean_fit, model=replace(clean_fit.model, problem=problem))
    left = {(place, law.name) for place, law in possible_causes(fit)}
    gone = {name for _, name in every - left}
    assert gone == {"coulomb_friction", "sensor_saturation"} and left < every
    with pytest.raises(ValueError, match=r"left_out: expected.*'dry_friction'.*Mend"):
        leaving_out(clean_fit.problem, ["dry_friction"])


def test_alikeness_is_a_cosine(seen):
    first, *rest = [c for c in seen.values() if c.visible > 1e-6]
    assert alikeness(first, first) == pytest.approx(1.0)
    assert all(0.0 <= alikeness(first, other) <= 1.0 + 1e-12 for other in rest)


@pytest.mark.parametrize(
    ("quantity", "driven", "free", "hidden"),
    [
        ("acceleration", False, False, ("cart/sensor_mass",)),
        ("acceleration", True, False, ()),
        ("acceleration", True, True, ("cart/sensor_mass",)),
        ("position", False, False, ()),
    ],
)
def test_an_added_mass_is_hidden_where_all_scales_with_it(
    quantity: str, driven: bool, free: bool, hidden: tuple[str, ...], tmp_path: Path
) -> None:
    names = ("links.spring.stiffness", "links.spring.damping", "masses.cart.mass")
    bench = make_bench(tmp_path, (), (1.0,), (), driven=driven, free=names if free else names[:2])
    problem = make_problem(bench.records, bench.rig)
    sensors = [
        replace(s, port=replace(s.port, quantity=quantity)) for s in problem.records[0].sensors
    ]
    records = (replace(problem.records[0], sensors=tuple(sensors)),)
    assert hidden_masses(replace(problem, records=records)) == hidden
