"""Laws of a told motion: tried where it is large, found on a bench's swing, not where none is."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.causes import possible_causes
from supple.identification.diagnose import diagnose
from supple.identification.problem import make_problem
from supple.identification.records import read_record
from supple.identification.screen import screen
from supple.identification.swung import SMALL, is_swung, is_swung_place, swings
from supple.model.law import library
from supple.model.rig import read_rig
from supple.studies.thesis.measured_swings import ask_bench, read_measured, record_files
from supple.studies.thesis.swing_diagnosis import LACKING, rig_text
from supple.studies.thesis.swing_runs import linear_samples, turned_pull


def swung(folder, count):
    ask_bench(["swings", "--out", str(folder), "--seed", "5", "--count", str(count)])
    return [read_measured(folder / f"golfer_{k + 1}") for k in range(count)]


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    return swung(tmp_path_factory.mktemp("swings"), 2)


def read(swings_, folder):
    (folder / "rig.toml").write_text(rig_text(swings_[0]), encoding="utf-8")
    for one in swings_:
        for name, text in record_files(one).items():
            (folder / name).write_text(text, encoding="utf-8")
    paths = [folder / f"{one.name}.toml" for one in swings_]
    return [read_record(path) for path in paths], read_rig(folder / "rig.toml")


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    records, rig = read(swung(folder, 1), folder)
    return make_problem(records, rig)


def shrunk(problem, share):
    (prepared,) = problem.records
    return replace(problem, records=(replace(prepared, inputs=share * prepared.inputs),))


def test_only_large_told_angles_are_worth_a_trial(problem):
    laws = [library()[name] for name in LACKING]
    assert all(swings(problem, law) for law in laws)
    turn = np.ptp(problem.records[0].inputs[: problem.records[0].count], axis=0)
    small = shrunk(problem, 0.99 * SMALL / turn.max())
    assert not any(swings(small, law) for law in laws)
    (prepared,) = problem.records
    rates = tuple(replace(port, quantity="angular_velocity") for port in prepared.ports)
    unknown = replace(problem, records=(replace(prepared, ports=rates),))
    assert not any(swings(unknown, law) for law in laws)  # where the club points is not told
    still = prepared.inputs * [0.0, 1.0]
    flicked = replace(problem, records=(replace(prepared, inputs=still),))
    assert [swings(flicked, law) for law in laws] == [False, True, True]


def test_what_is_swung_has_no_spring_of_its_own(problem):
    own = ("shaft", "sleeve", "wrist", "collet", "clubhead")
    assert [is_swung_place(problem, at) for at in own] == [False] * 5
    assert [is_swung_place(problem, at) for at in ("arm", "club", "swung_clubhead")] == [True] * 3
    assert is_swung(problem, ("club", library()["gravity"]))
    assert not is_swung(problem, ("wrist", library()["coulomb_friction"]))


@pytest.mark.slow
def test_a_benchs_swing_asks_first_for_the_arms_pull_and_then_for_the_stiffening(problem):
    fit = fit_base(problem)
    names = {law.name for _, law in possible_causes(fit)}
    assert names >= set(LACKING)
    ranked = screen(fit)
    assert [one.name for one in ranked[:2]] == [
        "arm/base_acceleration", "swung_clubhead/centrifugal_stiffening",
    ]  # fmt: skip
    gravity = next(one for one in ranked if one.law.name == "gravity")
    assert all(one.entry.scale == 1.0 for one in (*ranked[:2], gravity))
    assert (ranked[0].entry.unit, gravity.entry.unit) == ("1", "N m")
    assert all(one.p_value < 1e-6 and one.step > 0 for one in ranked[:2])


@pytest.mark.slow
def test_two_swings_of_a_bench_name_both(measured, tmp_path):
    records, rig = read(measured, tmp_path)
    found = diagnose(records, rig)
    named = [trial.candidate.name for trial in found.accepted]
    assert set(named[:2]) == {"arm/base_acceleration", "swung_clubhead/centrifugal_stiffening"}
    for trial in found.accepted[:2]:
        index = found.final.index(trial.candidate.entry.label)
        assert 0.5 < found.final.value(index) < 2.0


@pytest.mark.slow
def test_a_swing_that_lacks_nothing_is_given_nothing(measured, tmp_path):
    """What the thesis's printed rows make of the same swings is explained without any law."""
    rng = np.random.default_rng(2)
    plain = []
    for one in measured:
        clean = linear_samples(one, turned_pull(one, False))
        noise = rng.standard_normal(clean.shape) * [one.acceleration_std, one.deflection_std]
        noisy = clean + noise
        plain.append(replace(one, acceleration=noisy[:, 0], deflection=noisy[:, 1]))
    records, rig = read(plain, tmp_path)
    found = diagnose(records, rig)
    assert found.status == "adequate"
    assert not found.accepted
    assert all(misfit.ratio < 1.3 for misfit in found.final.misfits.values())
