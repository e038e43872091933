"""Laws tried from where the rig stands, on cases of the independent bench that hide them."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from supple.identification import base
from supple.identification.base import fit_base
from supple.identification.diagnose import diagnose
from supple.identification.evidence import explained, least_explained
from supple.identification.extend import thinned, worst_ratio
from supple.identification.finding import Diagnosis
from supple.identification.fit import CRAWL, DOMINATED, Fit, loudness, solve
from supple.identification.problem import make_problem
from supple.identification.records import Record, read_record, split_records
from supple.identification.screen import screen
from supple.identification.standing import gains_unseen, spares
from supple.identification.told import (
    begun_from_told,
    told_trials,
    unasked_trials,
    weighed_as,
)
from supple.identification.tolerances import PULLED, worst_pull
from supple.identification.trial import promising
from supple.model.rig import Rig, read_rig
from tests.identification.test_trial import candidate

ROOT = Path(__file__).parents[2]


def drawn(folder: Path, *wanted: str) -> tuple[list[Record], Rig]:
    command = [sys.executable, "-m", "tests.lab", "draw", *wanted, "--out", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    found = sorted((folder / "records").glob("*.toml"))
    records = [read_record(path) for path in found if path.name != "rig.toml"]
    return records, read_rig(folder / "records" / "rig.toml")


def lumped(law: str, place: str, seed: int) -> list[str]:
    return ["--bench", "A", "--seed", str(seed), "--law", law, "--place", place]


def diagnosed(folder: Path, *wanted: str) -> tuple[list[str], Diagnosis]:
    found = diagnose(*drawn(folder, *wanted))
    return [trial.candidate.name for trial in found.accepted], found


@pytest.fixture(scope="module")
def ridden(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """What becomes of the constants where a rider of 17 g rings on the head, and none is known."""
    records, rig = drawn(
        tmp_path_factory.mktemp("ridden"), *lumped("extra_mode", "clubhead", 91002)
    )
    train, _, _ = split_records(records, ())
    return fit_base(make_problem(train, rig))


@pytest.mark.slow
def test_what_constants_that_were_drawn_away_hide_shows_where_the_rig_stands(ridden):
    name = "clubhead/extra_mode"
    told, found = told_trials(ridden)
    assert found[0].name == name
    assert found[0].gain > 100 * next(c.gain for c in screen(ridden) if c.name == name)
    shared = [i for i, e in enumerate(told.model.entries) if e.slot == "numbers"]
    values = [told.value(i) for i in shared]
    np.testing.assert_allclose(values, [told.model.entries[i].value for i in shared], rtol=1e-12)
    assert not any("ringing" in a.kinds for a in told.model.allowances.values())


@pytest.mark.slow
def test_instruments_hide_nothing_there_and_are_let_go_at_last(ridden):
    """Far from a minimum priors hold nothing: gains of 2.5 had hidden that a wrist sticks."""
    told, found = told_trials(ridden)
    theirs = {"offset", "gain"}
    assert theirs < {e.slot for e in ridden.model.entries}
    assert not theirs & {e.slot for e in told.model.entries}
    start = solve(thinned(ridden.model), ridden.x, 2)
    begun = begun_from_told(told, found[0], start, 4)
    assert begun is not None and begun.candidate is found[0]
    refit = weighed_as(start, begun, 2)
    labels = [e.label for e in ridden.model.entries]
    assert [e.label for e in refit.model.entries][: len(labels)] == labels
    assert refit.model.causes == (found[0].cause,) and refit.cost < start.cost


def test_a_fit_at_the_noise_needs_no_other_point():
    misfits, model = {"a": SimpleNamespace(ratio=2.0)}, SimpleNamespace(entries=())
    calm = cast(Any, SimpleNamespace(misfits=misfits, model=model))
    assert told_trials(calm) == (calm, [])


@pytest.mark.slow
def test_before_a_recorded_blow_it_rests_where_its_springs_do(ridden):
    struck = [p.name for p in ridden.problem.records if not p.free]
    assert struck and all(p.at_rest for p in ridden.problem.records if not p.free)
    for entry in ridden.model.entries:
        if entry.slot == "start" and entry.record in struck:
            assert entry.prior <= 1.01e-4 * entry.scale


def fits(*gaps: dict[tuple[str, str], float]) -> list[Any]:
    """Fits of channels of unit noise that are so far off everywhere."""
    found = []
    for gap in gaps:
        floor = {key: SimpleNamespace(marginal_std=1.0) for key in gap}
        misfits = {key: SimpleNamespace(ratio=size**2) for key, size in gap.items()}
        found.append(
            SimpleNamespace(
                keys=tuple(gap),
                misfits=misfits,
                model=SimpleNamespace(problem=SimpleNamespace(floor=floor)),
                predicted={key: np.zeros(10) for key in gap},
                residual_of=lambda key, gap=gap: np.full(10, gap[key]),
            )
        )
    return found


def test_what_leaves_one_channel_as_wrong_as_it_was_is_told_apart():
    head, encoder = ("one", "head"), ("one", "encoder")
    before, after = fits({head: 100.0, encoder: 20.0}, {head: 2.0, encoder: 19.0})
    assert explained(before, after) > 0.9
    assert least_explained(before, after, 10.0) == pytest.approx(0.0977, abs=1e-3)
    assert explained(before, after, "head") == pytest.approx((1e4 - 4) / (1e4 - 1))
    calm = fits({head: 2.0, encoder: 2.0})[0]
    assert least_explained(before, calm, 10.0) == 1.0, "nothing is left that dominates"


@pytest.mark.slow
def test_where_no_misfit_shows_all_must_promise_what_they_must_gain(ridden):
    small, large = candidate("cubic_stiffness", 20.0), candidate("clearance", 400.0)
    assert promising(ridden, [small, large])[0] is small, "the first is always tried"
    assert promising(ridden, [small, large], 90.0) in ([large], [])
    assert promising(ridden, [small], 90.0) == []


def test_only_a_first_cause_may_gain_nothing_unseen():
    def told(nrmse: float) -> Any:
        return cast(Any, SimpleNamespace(nrmse=nrmse, noise_floor=0.027))

    assert gains_unseen(told(0.0289), told(0.0294), lenient=True)
    assert not gains_unseen(told(0.0289), told(0.0294), lenient=False)
    assert gains_unseen(told(0.0289), told(0.0280), lenient=False)
    for lenient in (True, False):  # far from the noise a twentieth of the way must be gained
        assert gains_unseen(told(0.1), told(0.05), lenient)
        assert not gains_unseen(told(0.1), told(0.0999), lenient)


def test_what_held_out_records_cannot_show_may_not_spoil_them():
    def told(nrmse: float) -> Any:
        return cast(Any, SimpleNamespace(nrmse=nrmse))

    assert spares(told(0.0532), told(0.0544)) and spares(told(0.0532), told(0.03))
    assert not spares(told(0.0532), told(0.06))


@pytest.mark.slow
@pytest.mark.parametrize(
    "law, place, seed, size",
    [
        ("extra_mode", "clubhead", 91002, None),  # its start after a blow is guessed
        ("quadratic_damping", "clubhead", 91001, 0.6587),
        ("sensor_tilt", "head_acc", 91002, 0.5908),
        ("drive_ripple", "drive", 91001, 4.989e-4),
        ("stiffness_drift", "shaft", 91010, 117.25),  # 78.17 N/m, settling within 0.667 s
    ],
)
def test_a_bench_that_hides_it_is_found_out(tmp_path, law, place, seed, size):
    names, found = diagnosed(tmp_path, *lumped(law, place, seed))
    assert (found.status, names) == ("named", [f"{place}/{law}"])
    assert found.held_after is not None and found.held_before is not None
    assert found.held_after.nrmse < found.held_before.nrmse
    if size is not None:
        index = found.final.index(f"{place}/{law}")
        error = max(3 * found.final.std(index), 0.02 * size)
        assert abs(abs(found.final.value(index)) - size) < error


@pytest.mark.slow
def test_a_wrist_that_sticks_is_found_behind_a_driven_arm(tmp_path):
    """No channel is near any motion of the rig without it: 13 million beside 33000 samples."""
    names, found = diagnosed(
        tmp_path, "--bench", "B", "--seed", "98422", "--snr-db", "30", "--noise", "white"
    )
    assert found.status == "named"
    # a slip whose spring is next to rigid is friction
    assert names in (["wrist/slip"], ["wrist/coulomb_friction"])
    torque = found.final.value(found.final.index(names[0]))
    assert torque == pytest.approx(6.652, rel=0.03)


@pytest.mark.slow
def test_a_spring_at_a_driven_head_is_no_scale_of_two_sensors(tmp_path):
    names, found = diagnosed(tmp_path, "--bench", "A", "--seed", "101006", "--snr-db", "30")
    assert (names, found.status) == (["clubhead/linear_stiffness"], "named")
    stiffness = found.final.value(found.final.index(names[0]))
    assert stiffness == pytest.approx(69.69, rel=0.03)


@pytest.mark.slow
def test_a_rig_that_has_made_room_for_a_rider_is_asked_from_where_it_stands(tmp_path):
    """Errors are below what dominates, and yet the shaft weighs twenty times what is stated."""
    names, found = diagnosed(tmp_path, "--bench", "B", "--seed", "105017", "--snr-db", "30")
    assert worst_pull(found.base) > PULLED and worst_ratio(found.base) < DOMINATED
    assert (names, found.status) == (["collet/extra_mode"], "named")
    assert found.held_after is not None and found.held_before is not None
    assert found.held_after.nrmse < 0.3 * found.held_before.nrmse


@pytest.mark.slow
def test_a_side_valley_of_the_misfits_own_weights_is_left(tmp_path, monkeypatch):
    """A hidden relaxation had drawn the club 42 deviations long; near the rig it fits better."""
    records, rig = drawn(tmp_path, "--bench", "A", "--seed", "105011", "--snr-db", "40")
    problem = make_problem(split_records(records, ())[0], rig)
    found = fit_base(problem, CRAWL)
    monkeypatch.setattr(base, "back_in_place", lambda fit, x, crawling: fit)
    before = fit_base(problem, CRAWL)
    assert worst_pull(before) > 3.0 * PULLED
    assert worst_pull(found) < 0.5 * worst_pull(before)
    assert loudness(found) < 0.9 * loudness(before)


@pytest.mark.slow
def test_the_worst_pull_is_the_largest_distance_from_what_is_stated(ridden):
    entries = ridden.model.entries
    own = next(i for i, e in enumerate(entries) if e.slot == "numbers" and e.prior < np.inf)
    x = ridden.x.copy()
    for index, entry in enumerate(entries):
        if entry.slot == "numbers" and entry.prior < np.inf:
            x[index] = entry.center / entry.scale
        elif entry.slot == "numbers":
            x[index] *= 3.0  # a guess that says nothing of how sure it is
    assert worst_pull(replace(ridden, x=x)) == pytest.approx(0.0, abs=1e-9)
    x[own] += 7.0 * entries[own].prior / entries[own].scale
    assert worst_pull(replace(ridden, x=x)) == pytest.approx(7.0)


def test_laws_that_promise_nearly_the_same_there_are_all_tried(monkeypatch):
    """Slip and hysteresis of a joint: two more where they are near the best, none where not."""
    from supple.identification import told as module

    gains = {"best": 100.0, "second": 97.0, "third": 95.0, "fourth": 91.0, "fifth": 90.5}
    found = [
        SimpleNamespace(
            name=name, gain=gain, law=SimpleNamespace(name=f"law of {name}", slot="", rings=False)
        )
        for name, gain in gains.items()
    ]
    monkeypatch.setattr(module, "worst_ratio", lambda fit: 10 * module.DOMINATED)
    monkeypatch.setattr(module, "told_fit", lambda fit: fit)
    monkeypatch.setattr(module, "without_general", list)
    monkeypatch.setattr(module, "screen", lambda fit: found)
    fit = cast(Fit, None)
    assert [one.name for one in told_trials(fit)[1]] == ["best", "second", "third", "fourth"]
    found[2].gain, found[3].gain = 89.0, 60.0
    assert [one.name for one in told_trials(fit)[1]] == ["best", "second"]
    for one in found[1:]:
        one.gain = 40.0
    assert [one.name for one in told_trials(fit)[1]] == ["best"]


def test_what_an_instrument_gains_hides_no_law_of_the_mechanism(monkeypatch):
    """A spring at the driven head: readings out of scale gained more, and two gains were named."""
    from supple.identification import told as module

    found = [
        candidate("sensor_gain", 41.0, "encoder"),
        candidate("sensor_saturation", 32.0, "encoder"),
        candidate("sensor_delay", 31.0, "encoder"),
        candidate("linear_stiffness", 28.0, "clubhead"),
        candidate("hysteresis", 25.0, "shaft"),
        candidate("relaxation", 24.0, "shaft"),
        candidate("linear_damping", 20.0, "clubhead"),
    ]
    monkeypatch.setattr(module, "worst_ratio", lambda fit: 10 * module.DOMINATED)
    monkeypatch.setattr(module, "told_fit", lambda fit: fit)
    monkeypatch.setattr(module, "screen", lambda fit: found)
    tried = told_trials(cast(Fit, None))[1]
    wanted = ["sensor_gain", "sensor_saturation", "linear_stiffness", "hysteresis"]
    assert [one.law.name for one in tried] == wanted
    found[:3] = []
    found.append(candidate("sensor_gain", 19.0, "encoder"))
    wanted = ["linear_stiffness", "hysteresis", "sensor_gain"]
    assert [one.law.name for one in told_trials(cast(Fit, None))[1]] == wanted
    found[:] = [candidate("sensor_gain", 900.0, "encoder"), *found[:-1]]  # far beyond them all
    wanted = ["sensor_gain", "linear_stiffness"]
    assert [one.law.name for one in told_trials(cast(Fit, None))[1]] == wanted


def test_the_best_law_is_tried_wherever_it_is_seen(monkeypatch):
    from supple.identification import told as module

    found = [
        candidate("quadratic_damping", 70.0, "wrist"),
        candidate("quadratic_damping", 57.0, "clubhead"),
        candidate("relaxation", 48.0, "shaft"),
        candidate("quadratic_damping", 43.0, "shaft"),
        candidate("quadratic_damping", 20.0, "sleeve"),
        candidate("quadratic_damping", 2.0, "base"),
    ]
    monkeypatch.setattr(module, "worst_ratio", lambda fit: 10 * module.DOMINATED)
    monkeypatch.setattr(module, "told_fit", lambda fit: fit)
    monkeypatch.setattr(module, "screen", lambda fit: found)
    tried = told_trials(cast(Fit, None))[1]
    assert [(one.place, one.law.name) for one in tried] == [
        ("wrist", "quadratic_damping"),
        ("clubhead", "quadratic_damping"),
        ("shaft", "quadratic_damping"),
        ("sleeve", "quadratic_damping"),
    ]


@pytest.mark.slow
def test_laws_of_a_contact_are_tried_where_no_small_step_shows_them(ridden):
    told, _ = told_trials(ridden)
    contacts = unasked_trials(told, {"sleeve/slip"})
    names = [one.name for one in contacts]
    assert {"sleeve/clearance", "sleeve/hysteresis", "shaft/clearance", "shaft/slip"} <= set(names)
    assert "sleeve/quadratic_damping" in names  # what is lost there is the damping's until then
    assert "sleeve/slip" not in names and not any("coulomb" in name for name in names)
    assert not any(one.law.signed or one.law.slot for one in contacts)
    assert [one.gain for one in contacts] == sorted((one.gain for one in contacts), reverse=True)


@pytest.mark.parametrize(
    ("step", "begun"),
    [
        (0.0, [0.0, 0.5]),
        (0.04, [0.04, 0.5]),
        (0.3, [0.3]),
    ],
)
@pytest.mark.slow
def test_a_law_that_no_step_asks_for_begins_strong_too(ridden, step, begun):
    """A sleeve's damping by the square: from next to none of it nothing led to where it belongs."""
    from supple.identification.told import _begun_with

    told, _ = told_trials(ridden)
    (damping,) = (c for c in unasked_trials(told, ()) if c.name == "sleeve/quadratic_damping")
    points = _begun_with(told, replace(damping, step=step))
    assert [point[-1] for point in points] == begun


@pytest.mark.slow
def test_a_law_that_does_nothing_beside_held_constants_is_not_refitted(ridden, monkeypatch):
    from supple.identification import told as module

    told, _ = told_trials(ridden)
    idle = replace(unasked_trials(told, ())[0], gain=0.0, step=0.0)
    start = solve(thinned(ridden.model), ridden.x, 2)
    monkeypatch.setattr(module, "constants_held", lambda model, x, evaluations: x)
    monkeypatch.setattr(module, "in_place_of_spring", lambda fit, candidate: [])
    assert begun_from_told(told, idle, start, 4) is None
