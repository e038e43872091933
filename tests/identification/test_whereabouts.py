"""What no law explains is placed by what the records say without it, and its shape comes out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.identification import diagnose as diagnosing
from supple.identification.base import fit_base
from supple.identification.diagnose import diagnose
from supple.identification.evidence import excess
from supple.identification.extend import extend, worst_ratio
from supple.identification.fit import DOMINATED
from supple.identification.misreading import misreading, misreading_json
from supple.identification.problem import make_problem
from supple.identification.records import Record, read_record
from supple.identification.screen import screen
from supple.identification.search import Search
from supple.identification.trial import Trial
from supple.identification.verdict import diagnosis_json
from supple.identification.whereabouts import whereabouts
from supple.model.rig import read_rig
from tests.identification.benches import RATE, REACH, STIFFNESS, make_bench
from tests.lab.plants import Sensor
from tests.lab.sealed import draw_sealed

FEELS = Sensor("feel_cart", "acceleration", "cart", "absolute", "m/s^2", 2, np.ones(1))
BURST = 0.15
"""What the channel adds in the middle of a record, in shares of its largest value [-]."""


def with_error(record: Record, channel: str, add: np.ndarray) -> Record:
    """The record with something added to one channel [unit]."""
    told = tuple(
        replace(one, values=one.values + add[: len(one.values)]) if one.name == channel else one
        for one in record.channels
    )
    return replace(record, channels=told)


def burst(record: Record) -> np.ndarray:
    """A chatter that comes and goes, which no law of a reading knows [m/s^2]."""
    values = next(one.values for one in record.channels if one.name == FEELS.name)
    time = np.arange(len(values)) / RATE
    wander = np.sin(2 * np.pi * 3.1 * time) * np.exp(-((time - 5.0) ** 2) / 4.0)
    return BURST * np.max(np.abs(values)) * wander


@pytest.fixture(scope="module")
def loose(tmp_path_factory: pytest.TempPathFactory):
    """Records of a cart whose accelerometer is loose, and what that adds."""
    bench = make_bench(tmp_path_factory.mktemp("loose"), snr_db=34.0, sensors=(FEELS,))
    added = {one.name: burst(one) for one in (*bench.records, *bench.held)}
    wrong = [with_error(one, FEELS.name, added[one.name]) for one in bench.records]
    held = [with_error(one, FEELS.name, added[one.name]) for one in bench.held]
    return bench.rig, wrong, held, added


def test_a_channel_that_errs_is_found_and_its_error_comes_out(loose):
    rig, records, _, added = loose
    fit = fit_base(make_problem(records, rig))
    found = whereabouts(fit)
    assert found is not None and (found.place, found.kind) == (FEELS.name, "channel")
    fits = {one.what: one.fits for one in found.apart}
    assert fits == {FEELS.name: True, "see_cart": False}
    error = misreading(fit, found.apart[0])
    time = next(curve for curve in error.curves if curve.against == "time")
    truth = added[error.record][-len(time.force) :]
    assert np.corrcoef(time.force, truth)[0, 1] > 0.95
    assert np.std(time.force - truth) < 0.3 * np.std(truth)
    told = misreading_json(error)
    assert told["unit_error"] == "m/s^2" and len(told["curves"]) == 3
    assert {one["unit_x"] for one in told["curves"]} == {"m/s^2", "m/s^2/s", "s"}


def test_a_verdict_that_knows_no_law_says_which_channel(loose):
    rig, records, held, _ = loose
    found = diagnose(records, rig, held, left_out=("mains_hum", "sensor_drift"))
    assert found.status == "unknown"
    told = diagnosis_json(found, {})
    assert told["where"]["place"] == FEELS.name and told["where"]["kind"] == "channel"
    assert told["missing_force"] is None and told["misreading"]["place"] == FEELS.name
    assert f"most likely at {FEELS.name}" in told["sentence"]
    assert "Without it all else fits" in told["sentence"]
    assert told["what_next"].startswith(f"Check {FEELS.name}")
    assert any(f"without {FEELS.name}" in line for line in told["why"])


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("spring/quadratic_damping", marks=pytest.mark.slow),
        "feel_cart/sensor_drift",
    ],
)
def test_a_law_that_leaves_the_error_of_the_only_channel_that_errs_is_a_stand_in(
    loose, monkeypatch, name
):
    rig, records, _, _ = loose
    base = fit_base(make_problem(records, rig))
    law = next(one for one in screen(base) if one.name == name)
    fit = extend(base, law)
    assert worst_ratio(fit) > DOMINATED
    search = Search(base, None, lambda text: None)
    search._accept([Trial(law, fit, 1000.0)], [])
    monkeypatch.setattr(diagnosing, "explained", lambda before, after: 0.9)
    monkeypatch.setattr(search, "believed", lambda share: True)
    found = diagnosing._verdict(search, "none")
    assert found.status == "unknown"
    assert found.where is not None and found.where.place == FEELS.name


def test_a_force_that_is_missing_is_no_channels_error(tmp_path: Path):
    hidden = ("cubic_stiffness", 0.5 * STIFFNESS / REACH**2)
    bench = make_bench(tmp_path, (hidden,), snr_db=40.0, sensors=(FEELS,))
    found = whereabouts(fit_base(make_problem(bench.records, bench.rig)))
    assert found is not None and (found.place, found.kind) == ("spring", "place")
    assert not any(one.fits for one in found.apart) and len(found.apart) == 2
    assert [one.place for one in found.forces][:1] == ["spring"]
    scores = [one.score for one in found.forces]
    assert scores == sorted(scores)


def test_where_one_channel_is_all_there_is_places_are_asked(tmp_path: Path):
    hidden = ("cubic_stiffness", 0.5 * STIFFNESS / REACH**2)
    bench = make_bench(tmp_path, (hidden,), snr_db=40.0)
    found = whereabouts(fit_base(make_problem(bench.records, bench.rig)))
    assert found is not None and found.apart == () and found.place == "spring"


def stated(record: Record, zero: float, tolerance: dict[str, float]) -> Record:
    """The record with a wrong zero of its accelerometer, and what is stated of it [m/s^2]."""
    moved = with_error(record, FEELS.name, np.full(len(record.channels[0].values), zero))
    told = tuple(
        replace(one, tolerance=tolerance) if one.name == FEELS.name else one
        for one in moved.channels
    )
    return replace(moved, channels=told)


@pytest.mark.parametrize(
    ("zero", "tolerance", "status"),
    [
        (0.05, {"offset": 0.02}, "adequate"),
        (0.5, {"offset": 0.02}, "unknown"),
        (0.05, {}, "adequate"),  # nothing was stated
    ],
)
def test_a_zero_far_from_what_is_stated_is_no_nuisance(tmp_path: Path, zero, tolerance, status):
    bench = make_bench(tmp_path, snr_db=34.0, sensors=(FEELS,))
    records = [stated(one, zero, tolerance) for one in bench.records]
    laws = ("sensor_offset", "sensor_drift", "sensor_rectified")
    told = diagnosis_json(diagnose(records, bench.rig, left_out=laws), {})
    assert told["status"] == status
    if status == "unknown":
        assert (told["where"]["place"], told["where"]["kind"]) == (FEELS.name, "channel")
        assert f"the zero of {FEELS.name}" in told["sentence"] and told["misreading"] is None
        assert told["what_next"].startswith(f"Check {FEELS.name}")


@pytest.mark.slow
def test_an_encoder_alone_lets_the_head_start_where_it_hangs(tmp_path: Path):
    draw_sealed(
        tmp_path, "A", 5, effects=0, model="pinned_wrist", noise="white", train=2, held_out=0,
        samples=1024,
    )  # fmt: skip
    paths = sorted((tmp_path / "records").glob("train*.toml"))
    rig = read_rig(tmp_path / "records" / "rig.toml")
    problem = make_problem([read_record(path) for path in paths], rig)
    alone = tuple(
        replace(p, sensors=tuple(s for s in p.sensors if s.port.quantity == "angle"))
        for p in problem.records
    )
    assert all(len(p.sensors) == 1 for p in alone)
    fit = fit_base(replace(problem, records=alone))
    assert excess(fit) < 0.1
    deflections = [
        abs(fit.value(index)) / entry.prior
        for index, entry in enumerate(fit.model.entries)
        if entry.name == "clubhead_displacement.start"
    ]
    assert max(deflections) < 3.0


@pytest.mark.slow
def test_a_told_motion_that_is_wrong_is_the_drives(tmp_path: Path):
    draw_sealed(
        tmp_path, "A", 5, effects=0, model="driven_wrist", noise="white", train=4, held_out=0,
        snr_db=30.0,
    )  # fmt: skip
    records = [read_record(path) for path in sorted((tmp_path / "records").glob("train*.toml"))]
    told = [one for one in records if one.test == "driven"]
    assert told and len(told) < len(records)
    wrong = []
    for record in records:
        for channel in record.channels:
            if channel.role == "input" and channel.quantity == "angle":
                bent = 0.2 * channel.values * np.tanh(channel.values / np.std(channel.values))
                record = with_error(record, channel.name, bent)
        wrong.append(record)
    found = whereabouts(fit_base(make_problem(wrong, read_rig(tmp_path / "records" / "rig.toml"))))
    assert found is not None and (found.place, found.kind) == ("drive", "drive")


@pytest.mark.parametrize(("std", "status"), [(0.004, "unknown"), (0.04, "adequate")])
def test_a_number_of_the_rig_far_beyond_its_tolerance_is_a_finding(tmp_path, std, status):
    """A cart that is driven by a known force weighs 0.6 kg, whatever else its rig states."""
    bench = make_bench(tmp_path, driven=True)
    number = bench.rig.parameters["masses.cart.mass"]
    told = replace(number, value=1.08 * number.value, std=std)
    rig = replace(bench.rig, parameters={**bench.rig.parameters, "masses.cart.mass": told})
    found = diagnose([*bench.records, *bench.held], rig)
    assert found.status == status and not found.accepted
    said = diagnosis_json(found, {})
    if status == "unknown":
        assert "masses.cart.mass" in said["sentence"] and "rig states" in said["sentence"]
        assert said["where"]["place"] == "cart"
        assert said["what_next"].startswith("Measure masses.cart.mass again")
    else:
        assert said["where"] is None and "rig states" not in said["sentence"]
