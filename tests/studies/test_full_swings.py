"""Measured full swings against simulated ones: the numbers, the road from bench to table, words."""

import json
from pathlib import Path

import numpy as np
import pytest

from supple.identification.records import check_record_against_rig, read_record
from supple.model.linear import Port
from supple.model.motion import respond
from supple.model.rig import read_rig
from supple.model.robot import Robot
from supple.studies import hidden_cases
from supple.studies.study import Call, study_named
from supple.studies.thesis import full_swings
from supple.studies.thesis.measured_swings import ask_bench, read_measured, record_files
from supple.studies.thesis.runs import head
from supple.studies.thesis.swing_compare import RESTS, compare, left, oscillation
from supple.studies.thesis.swing_diagnosis import LACKING, Verdict, rig_text
from supple.studies.thesis.swing_runs import (
    COMPLIANT,
    PLANAR,
    RIGID,
    TURNED,
    linear_samples,
    turned_pull,
)
from supple.studies.thesis.table import IN_PART, NOT, as_text

TIMES = np.arange(2000) / 500.0
IMPACT = 2.0
BEFORE = (TIMES > 0.2) & (TIMES < IMPACT - 0.01)


def bump(at: float, size: float = 1.0) -> np.ndarray:
    return size * np.exp(-(((TIMES - at) / 0.2) ** 2)) - 0.4 * np.exp(-(((TIMES - 0.9) / 0.1) ** 2))


@pytest.mark.parametrize(("late", "size"), [(0.0, 1.0), (0.03, 2.5), (-0.02, 0.7)])
def test_lag_peak_and_error_are_those_that_were_put_in(late, size):
    measured = bump(1.5)
    simulated = size * np.interp(TIMES - late, TIMES, measured)
    found = compare(TIMES, measured, simulated, simulated, BEFORE, (2.6, 2.6))
    assert found.lag == pytest.approx(late, abs=5e-4)
    assert found.peak_ratio == pytest.approx(size, rel=1e-3)
    assert found.aligned == pytest.approx(1.0, abs=1e-4)
    rest = np.sqrt(np.mean((simulated - measured)[BEFORE] ** 2) / np.mean(measured[BEFORE] ** 2))
    assert found.error == pytest.approx(rest)
    assert (found.error < 1e-12) == (late == 0.0 and size == 1.0)


def test_a_blow_does_not_tell_the_lag():
    measured = bump(1.5)
    struck = measured + 50.0 * (np.abs(TIMES - IMPACT) < 0.004)
    found = compare(TIMES, struck, struck, measured, BEFORE, (2.6, 2.6))
    assert abs(found.lag) < 1e-12 and found.error == 0.0


def test_what_is_left_is_an_oscillation_at_rest():
    ring = 0.1 * np.sin(2 * np.pi * 4.0 * TIMES)
    values = bump(1.5) + np.where(TIMES > 2.2, ring, 0.0)
    largest = np.max(np.abs(values[BEFORE]))
    assert left(TIMES, values, BEFORE, 2.6) == pytest.approx(0.1 / np.sqrt(2) / largest, rel=0.1)
    assert left(TIMES, bump(1.5) + 3.0 * (TIMES > 2.2), BEFORE, 2.6) < 1e-3  # an offset is none
    inner = slice(300, -300)
    assert oscillation(TIMES, ring)[inner] == pytest.approx(ring[inner], abs=8e-3)
    slow = np.sin(2 * np.pi * 0.5 * TIMES)
    assert np.abs(oscillation(TIMES, slow)[inner]).max() < 0.02


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    where = tmp_path_factory.mktemp("swings")
    ask_bench(["swings", "--out", str(where), "--seed", "5", "--count", "1"])
    return where


@pytest.fixture(scope="module")
def swing(folder):
    return read_measured(folder / "golfer_1")


def test_a_swing_comes_from_markers_and_gauges_as_it_was(folder, swing):
    truth = json.loads((folder / "golfer_1.truth.json").read_text())
    assert swing.arm_length == pytest.approx(0.62, abs=5e-3)
    assert swing.speed == pytest.approx(truth["clubhead_speed"], rel=0.05)
    known = np.isfinite(swing.deflection)
    assert np.max(np.abs(swing.deflection[swing.before])) == pytest.approx(0.122, rel=0.04)
    assert known[swing.before].all() and not known.all()
    assert swing.points[-1] > swing.impact + RESTS + 0.5
    assert 200 < swing.before.sum() < 1000


def test_the_record_for_the_diagnosis_is_one_of_the_house(swing, tmp_path):
    for name, text in record_files(swing).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "rig.toml").write_text(rig_text(swing), encoding="utf-8")
    record, rig = read_record(tmp_path / "golfer_1.toml"), read_rig(tmp_path / "rig.toml")
    check_record_against_rig(record, rig)
    assert rig.fidelity == "thesis" and rig.model == "driven_arm"
    assert [one.name for one in record.inputs] == ["arm", "wrist"]
    assert record.test == "swing" and record.channel("head").noise is not None
    part = swing.before.nonzero()[0][::2]
    assert np.allclose(record.channel("shaft").values, swing.deflection[part], rtol=1e-8)
    assert np.allclose(record.channel("arm").values, swing.profile.read_angles[part, 0])
    assert record.times[-1] == pytest.approx(swing.points[part[-1]] - swing.points[part[0]])


def test_the_linear_rows_are_the_models_where_nothing_is_mended(swing):
    ports = (head(frame="absolute"), Port("shaft", "deflection", "collet"))
    motion = respond(Robot("driven_arm"), swing.numbers(), swing.drive(False), swing.points, ports)
    ours = linear_samples(swing, turned_pull(swing, False))
    for mine, theirs in zip(ours.T, np.asarray(motion.samples).T):
        assert np.abs(mine - theirs).max() < 0.02 * np.abs(theirs).max()
    turned = linear_samples(swing, turned_pull(swing))
    assert np.abs(turned - ours).max() > 0.1 * np.abs(ours).max()  # but mending changes a lot


def unasked(swings, call):
    return Verdict({}, "not asked here", tuple(one.name for one in swings), (), {"a.csv": "t\n"})


@pytest.mark.slow
def test_the_study_compares_a_swing_and_keeps_its_answer(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(full_swings, "asked", unasked)
    study = study_named("thesis/full_swings")
    result = study.run(Call(tmp_path, seed=2, cases=1))
    rows = {row["key"]: row for row in result["rows"]}
    assert rows["wrist"]["verdict"] == NOT and rows["measured_cause"]["verdict"] == NOT
    assert rows["larger"]["verdict"] == rows["measured_larger"]["verdict"] == IN_PART
    assert rows["diagnosis"]["verdict"] == NOT and "not asked here" in rows["diagnosis"]["found"]
    (one,) = result["swings"]
    compared = one["compared"]
    assert set(compared) == {COMPLIANT, RIGID, TURNED, PLANAR}
    for channel in ("acceleration", "deflection"):
        linear, planar = compared[COMPLIANT][channel], compared[PLANAR][channel]
        assert linear["peak_ratio"] > 2.0 > 1.2 > planar["peak_ratio"] > 0.8
        assert planar["error"] < 0.3 < 0.7 < linear["error"]
        rigid = compared[RIGID][channel]["left_simulated"]
        assert linear["left_simulated"] < 0.1 < 0.3 < rigid
    assert one["settled"]["compliant"] < 0.6 < 1.5 < one["settled"]["rigid"]
    shaken = one["feedback"]
    assert shaken["compliant"]["whole"] < 0.5 * shaken["rigid"]["whole"]
    assert json.loads((tmp_path / "full_swings.json").read_text()) == json.loads(json.dumps(result))
    assert (tmp_path / "full_swings.md").read_text() == as_text(result)
    for name, panels in (("measured", 2), ("compliant", 1), ("feedback", 1)):
        drawn = (tmp_path / f"full_swings_{name}.svg").read_text()
        assert drawn.count('<g id="axes_') == panels
    assert (tmp_path / "a.csv").read_text() == "t\n"
    study.show(result)
    assert "Measured against simulated" in capsys.readouterr().out


def test_without_the_bench_the_study_says_so_and_answers(monkeypatch, tmp_path):
    def absent() -> None:
        raise ValueError("hidden_effect: expected the bench at X, found none. Mend: a checkout.")

    monkeypatch.setattr(hidden_cases, "require_bench", absent)
    result = study_named("thesis/full_swings").run(Call(tmp_path))
    said = "The six measured swings are left out: expected the bench at X, found none."
    assert any(note.startswith(said) for note in result["notes"])
    assert "Planar model: The motion was simulated." in result["notes"], "at the swing's own speed"
    assert [row["key"] for row in result["rows"]] == ["larger", "wrist", "grip", "stiffens"]
    turning = result["rows"][-1]
    assert turning["verdict"] == NOT and 5.5 < turning["ours"] < 6.5
    assert "swings" not in result


def test_what_the_bench_refuses_is_said():
    with pytest.raises(ValueError, match=r"bench: expected 'swings'.*Mend"):
        ask_bench(["swings", "--count", "many"])


def verdict(*named: str, after: float = 2.0) -> Verdict:
    misfit = {"before": {"reduced_chi2": 101.0}, "after": {"reduced_chi2": after}}
    history = [{"law": None, "reduced_chi2": 101.0}]
    history += [{"law": law, "place": "wrist", "reduced_chi2": after} for law in named[:1]]
    causes = [{"law": law} for law in named]
    told = {"status": "named", "sentence": "S.", "why": ["W."], "causes": causes, "gain": {}}
    return Verdict({**told, "misfit": misfit, "history": history}, "", ("a",), (), {})


def test_a_stand_in_is_not_the_cause_and_a_share_is_told():
    assert verdict("stiffness_drift").row().verdict == NOT
    assert verdict(LACKING[0]).row().holds and not verdict(LACKING[0], after=50.0).row().holds
    assert not verdict(LACKING[0], "stiffness_drift").row().holds
    assert verdict("x").explained == pytest.approx(0.99)
    (table,) = verdict("stiffness_drift").tables()
    assert table.rows == (("none", "101", "–"), ("wrist/stiffness_drift", "2", "99 %"))
    assert table.words == ("S.", "W.")
    refused = Verdict({}, "no", ("a",), (), {})
    assert refused.explained == 0.0 and "refused: no" in refused.row().found
    assert refused.told()["refused"] == "no"


@pytest.mark.slow
def test_the_whole_study_asks_the_diagnosis(tmp_path):
    result = study_named("thesis/full_swings").run(Call(tmp_path))
    told = result["diagnosis"]
    assert len(result["swings"]) == 6 and len(told["records"]["held_out"]) == 2
    assert told["status"] in ("named", "ambiguous", "unknown") and told["sentence"]
    rows = {row["key"]: row for row in result["rows"]}
    assert rows["measured_cause"]["verdict"] == NOT
    assert (tmp_path / "rig.toml").is_file() and (tmp_path / "golfer_6.toml").is_file()
