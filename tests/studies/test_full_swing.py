"""The study of what full swings lack: its numbers from a verdict, its words, and all of it."""

import json

import numpy as np
import pytest

from supple.identification.views import RecordView
from supple.studies import full_swing
from supple.studies.study import Call, study_named
from supple.studies.thesis.measured_swings import ask_bench, read_measured
from supple.studies.thesis.swing_diagnosis import Verdict

HISTORY = [
    {"law": "", "place": "", "reduced_chi2": 101.0},
    {"law": "base_acceleration", "place": "arm", "reduced_chi2": 26.0},
    {"law": "centrifugal_stiffening", "place": "swung_clubhead", "reduced_chi2": 5.0},
]


@pytest.fixture(scope="module")
def swings(tmp_path_factory):
    where = tmp_path_factory.mktemp("swings")
    ask_bench(["swings", "--out", str(where), "--seed", "5", "--count", "1"])
    return [read_measured(where / "golfer_1")]


def view(swing, channel, values, share):
    time = swing.points[swing.before] - swing.points[swing.before][0]
    seen = values[swing.before]
    none = np.zeros_like(seen)
    return RecordView(
        swing.name, "held_out", channel, "", "", time, seen, none + seen.mean(),
        seen + share * (seen - seen.mean()), none, none, "m", "m/s", 1.0, False,
    )  # fmt: skip


def told(law, value, std, unit="1"):
    return {"law": law, "parameters": {"share": {"value": value, "std": std, "unit": unit}}}


def verdict(swings):
    one = swings[0]
    causes = [told("base_acceleration", 0.9, 0.1), told("centrifugal_stiffening", 1.3, 0.2)]
    candidates = [{"law": "gravity", "refitted": True, "verdict": "refused: too small"}]
    result = {
        "status": "named", "sentence": "S.", "why": [], "causes": causes, "best_guess": [],
        "candidates": candidates, "history": HISTORY, "gain": {},
        "misfit": {"before": {"reduced_chi2": 101.0}, "after": {"reduced_chi2": 5.0}},
    }  # fmt: skip
    views = (view(one, "head", one.acceleration, 0.1), view(one, "shaft", one.deflection, 0.2))
    return Verdict(result, "", (), (one.name,), {}, views)


def test_shares_add_up_and_sizes_are_those_of_the_planar_model():
    rows = full_swing.steps(HISTORY, {"base_acceleration": (0.9, 0.1)})
    assert [row["cause"] for row in rows] == [
        "none", "arm/base_acceleration", "swung_clubhead/centrifugal_stiffening",
    ]  # fmt: skip
    assert [row["explains"] for row in rows] == [None, 0.75, 0.21]
    assert rows[2]["misfit"] == pytest.approx(np.sqrt(5.0))
    assert (rows[1]["size"], rows[2]["size"]) == (0.9, None)


@pytest.mark.slow
def test_the_laws_at_full_size_come_near_the_planar_model(swings):
    (one,) = swings
    laws = full_swing.full_size_laws(one)
    lacks, has = (full_swing._linear_samples(one, part)["head"] for part in ([], laws))
    plane = full_swing._planar_samples(one)[1]["head"]
    assert np.std(has - plane) < 0.1 * np.std(lacks - plane)


@pytest.fixture
def unswept(monkeypatch):
    whole = [{"with": "none", "head": 0.5, "shaft": 0.25}]
    monkeypatch.setattr(full_swing, "at_full_size", lambda _: whole)


def test_the_answer_sets_held_out_errors_against_the_planar_models(swings, unswept):
    found = full_swing.answer(swings, verdict(swings))
    error = found.more["held_out"]["nrmse"]
    assert error["before"] == pytest.approx(1.0) and error["planar"] < 0.35
    assert error["after"] == pytest.approx(np.sqrt((0.1**2 + 0.2**2) / 2))
    assert found.cells[1] == ("arm/base_acceleration", "75", "5.1", "0.90 ± 0.10")
    assert "base acceleration and centrifugal stiffening, in this order" in found.sentences[0]
    assert found.sentences[-2] == "Gravity is not named: refused: too small."
    assert found.sentences[-1].endswith("is 0.50 (0.25) without any law.")
    assert "1.60 times" in found.notes[-2] and len(found.panels) == 2
    json.dumps([found.rows, found.more])


def test_weight_is_sized_by_the_swing_planes_slope(swings):
    moment = full_swing.weight_moment(swings)
    assert moment == pytest.approx(0.372 * 9.80665 * np.sin(swings[0].inclination), rel=0.02)
    law, sized = full_swing._size(told("gravity", moment, 0.1 * moment, "N m"), swings)
    assert sized is not None
    assert (law, *sized) == ("gravity", pytest.approx(1.0), pytest.approx(0.1))
    assert full_swing._size(told("slip", 1.0, 0.1), swings) == ("slip", None)


def test_a_verdict_without_a_cause_says_so(swings, unswept):
    none = verdict(swings)
    bare = {**none.result, "causes": [], "history": HISTORY[:1], "sentence": "Nothing."}
    found = full_swing.answer(swings, Verdict(bare, "", (), none.held, {}, none.views))
    assert found.sentences[0] == "The diagnosis finds no cause: Nothing."


@pytest.mark.slow
def test_at_the_planar_models_size_the_laws_come_to_its_level(swings):
    whole = {one["with"]: one for one in full_swing.at_full_size(swings)}
    order = ["none", "base_acceleration", "centrifugal_stiffening", "gravity", "planar"]
    assert list(whole) == order
    assert whole["none"]["head"] > 1.0 > 0.4 > whole["base_acceleration"]["head"]
    for channel in ("head", "shaft"):
        assert whole["gravity"][channel] < 1.3 * whole["planar"][channel] < 0.3
    assert whole["gravity"]["shaft"] < whole["centrifugal_stiffening"]["shaft"]


@pytest.mark.slow
def test_six_swings_are_diagnosed_to_the_planar_models_level(tmp_path):
    study = study_named("full_swing")
    result = study.run(Call(tmp_path))
    named = [row["law"] for row in result["rows"][1:]]
    assert set(named[:2]) == {"base_acceleration", "centrifugal_stiffening"}
    assert sum(row["explains"] for row in result["rows"][1:]) > 0.85
    error = result["held_out"]["nrmse"]
    assert error["after"] < 1.2 * error["planar"] and error["after"] < 0.4 * error["before"]
    assert (tmp_path / "full_swing.svg").is_file() and (tmp_path / "full_swing.md").is_file()
