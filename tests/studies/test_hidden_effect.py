"""The hidden-effect study: its scoring, its road from seed to table, and that it goes on."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from supple.studies import hidden_effect
from supple.studies.hidden_cases import ROOT, decibels, draw_case, require_bench
from supple.studies.hidden_effect import (
    answer,
    answers,
    as_text,
    done,
    draw,
)
from supple.studies.hidden_page import lines, write_hidden_page
from supple.studies.hidden_score import (
    answered,
    asked,
    calibration,
    intervals,
    named,
    outcome,
    power_curve,
    tables,
)
from supple.studies.study import Call, study_named


def row(status="named", said=(), truth=(), bench="A", norm=200.0, known=True, **more):
    """One case; `said` and `truth` are (law, place) pairs."""
    causes = [{"law": law, "place": place, "probability": 0.95} for law, place in said]
    hidden = [
        {"law": law, "place": place, "places": [place, f"{place}_too"], "strength": 0.1}
        for law, place in truth
    ]
    power = {"projected_norm": norm, "detectable": norm > 100, "strong": norm > 300}
    hidden = [cause | {"power": power} for cause in hidden]
    power = power if truth else None
    base = {"bench": bench, "seed": 1, "noise": "white", "model": "pinned_wrist"}
    base |= {"nrmse_before": 0.2, "nrmse_after": 0.03, "noise_floor": 0.02, "seconds": 4.0}
    base |= {"baseline": {"law": "", "place": "", "delta_bic": 0.0}, "known": known}
    base |= {"without": None, "where": None, "next": None, "decibels": 30.0}
    return base | {"status": status, "causes": causes, "truth": hidden, "power": power} | more


FRICTION, CUBIC = ("coulomb_friction", "wrist"), ("cubic_stiffness", "shaft")


@pytest.mark.parametrize(
    ("case", "expected"),
    [
        (row("adequate"), "adequate"),
        (row("unknown"), "flagged"),
        (row("named", [FRICTION]), "invented"),
        (row("named", [FRICTION], [FRICTION]), "right"),
        (row("named", [("coulomb_friction", "wrist_too")], [FRICTION]), "right"),
        (row("named", [("coulomb_friction", "sleeve")], [FRICTION]), "right law"),
        (row("named", [CUBIC], [FRICTION]), "wrong"),
        (row("ambiguous", [CUBIC, FRICTION], [FRICTION]), "right pair"),
        (row("named", [CUBIC, FRICTION], [FRICTION]), "some"),
        (row("named", [FRICTION], [FRICTION, CUBIC]), "some"),
        (row("named", [CUBIC, FRICTION], [FRICTION, CUBIC]), "right"),
        (row("unknown", [], [FRICTION]), "unknown"),
        (row("adequate", [], [FRICTION]), "missed"),
        (row("failed", [], [FRICTION]), "failed"),
    ],
)
def test_outcomes(case, expected):
    assert outcome(case) == expected


def test_the_second_mode_of_a_finite_element_club_is_no_invention():
    mode = ("extra_mode", "shaft")
    assert outcome(row("named", [mode], bench="B")) == "adequate"
    assert outcome(row("named", [mode], bench="A")) == "invented"
    assert outcome(row("named", [mode, FRICTION], [FRICTION], bench="B")) == "right"
    hidden = row("named", [mode], [("extra_mode", "clubhead")], bench="B")
    assert named(hidden) == [mode] and outcome(hidden) == "right law"


def test_intervals_are_those_of_clopper_and_pearson():
    assert intervals(0, 9)["high"] == pytest.approx(1 - 0.025 ** (1 / 9))
    assert intervals(0, 9)["low"] == 0.0 and intervals(9, 9)["high"] == 1.0
    half = intervals(5, 10)
    assert (half["low"], half["high"]) == pytest.approx((0.187086, 0.812914), abs=1e-6)
    assert intervals(0, 0)["share"] is None
    rng = np.random.default_rng(1)
    held = 0
    for hits in rng.binomial(40, 0.3, 400):
        one = intervals(int(hits), 40)
        held += one["low"] <= 0.3 <= one["high"]
    assert held / 400 >= 0.94


def test_tables_count_what_is_there():
    rows = [
        row("adequate"),
        row("named", [FRICTION], noise="ar1"),
        row("named", [FRICTION], [FRICTION], norm=400.0),
        row("named", [CUBIC], [FRICTION], baseline={"law": "coulomb_friction", "place": "wrist"}),
        row("unknown", [], [("slip", "sleeve")], known=False),
        row("adequate", [], [FRICTION], norm=5.0),
    ]
    found = tables(rows)
    assert found["false_alarms"]["all"]["share"] == 0.5
    assert found["false_alarms"]["ar1"]["share"] == 1.0
    assert found["law_right"]["hits"] == 1 and found["law_right"]["count"] == 2
    assert found["strong_law_right"]["hits"] == found["strong_law_right"]["count"] == 1
    assert found["right_where_named"]["share"] == 0.5
    assert found["law_absent_named_wrongly"]["hits"] == 0
    assert found["law_absent_named_wrongly"]["count"] == 1
    assert found["confusion"]["wrist/coulomb_friction"] == {
        "wrist/coulomb_friction": 1, "shaft/cubic_stiffness": 1, "adequate": 1,
    }  # fmt: skip
    assert found["baselines"]["white_bic"]["right"]["share"] == 0.5
    assert found["baselines"]["no_extension"]["held_out"]["before"] == pytest.approx(10.0)
    assert sum(found["outcomes"].values()) == found["cases"] == 6
    weak = power_curve([rows[5], rows[2]])
    assert [one["right"]["count"] for one in weak] == [1, 0, 0, 0, 1, 0, 0]
    two = [
        row("named", [FRICTION], [FRICTION, CUBIC]),
        row("named", [CUBIC, FRICTION], [FRICTION, CUBIC]),
    ]
    unseen = row("named", [FRICTION], [FRICTION, CUBIC])
    unseen["truth"][1]["power"] = unseen["power"] | {"detectable": False}
    both = tables([*two, unseen, row("named", [("slip", "sleeve"), CUBIC], [FRICTION, CUBIC])])
    assert (both["several_all_right"]["hits"], both["several_none_wrong"]["hits"]) == (1, 3)
    assert both["several_all_right"]["count"] == 3
    sure = calibration(rows)[-1]
    assert (sure["hits"], sure["count"]) == (1, 3)
    assert (sure["from"], sure["to"]) == (0.9, 1.0)
    assert (sure["low"], sure["high"]) == (intervals(1, 3)["low"], intervals(1, 3)["high"])
    assert asked(rows[0]) == "adequate" and answered(rows[4]) == "unknown"
    assert answered(row("ambiguous", [CUBIC, FRICTION])).startswith("ambiguous: ")


def test_a_law_taken_out_is_counted_apart():
    unknown = {"status": "unknown", "causes": [], "where": "wrist_too"}
    elsewhere = {**unknown, "where": "sleeve"}
    wrong = {"status": "named", "causes": row("named", [CUBIC])["causes"], "where": None}
    cases = [
        row("named", [FRICTION], [FRICTION], without=one) for one in (unknown, elsewhere, wrong)
    ]
    cases.append(row("named", [FRICTION], [FRICTION], without=None))
    found = tables(cases)
    assert found["law_right"]["share"] == 1.0
    without = {name: (one["hits"], one["count"]) for name, one in found["without"].items()}
    assert without == {
        "named_wrongly": (1, 3), "unknown": (2, 3), "unknown_and_placed": (1, 3),
    }  # fmt: skip


def test_only_what_could_be_found_is_asked_without_its_law(monkeypatch):
    asked_for = []

    def verdict(sidecars, left_out=()):
        asked_for.append(tuple(left_out))
        return {"status": "adequate", "causes": [], "where": None}, None, None

    def drawn(bench, seed, folder):
        power = {"detectable": seed != 9}
        hidden = {"law": "clearance", "place": "wrist", "places": ["wrist"], "strength": 0.1}
        truth = {
            "model": "pinned_wrist",
            "noise": {"kind": "white", "snr_db": 30.0},
            "power": power,
        }
        truth["causes"] = [hidden] * (seed != 13)
        (folder / "truth.json").write_text(json.dumps(truth))
        return []

    monkeypatch.setattr(hidden_effect, "_verdict", verdict)
    monkeypatch.setattr(hidden_effect, "draw_case", drawn)
    for name in ("white_bic", "sparse_regression"):
        monkeypatch.setattr(hidden_effect, name, lambda base: None)
    rows = [answer(("A", seed)) for seed in (4, 5, 9, 13)]
    assert asked_for == [(), (), ("clearance",), (), ()]
    assert [one["without"] is None for one in rows] == [True, False, True, True]


def test_the_true_law_is_asked_only_where_what_is_named_leaves_much(monkeypatch):
    def fitted(sidecars, base, cause):
        asked_for.append(cause["law"])
        if base == no_fit:
            raise RuntimeError("it does not close")
        return 0.2

    asked_for: list[str] = []
    fit: Any = "fit"
    no_fit: Any = "no fit"
    monkeypatch.setattr(hidden_effect, "foretold_by_the_true_law", fitted)
    errors = {"nrmse_before": 0.5, "noise_floor": 0.1}
    found = row("named", [FRICTION], [FRICTION]) | errors
    after = hidden_effect._true_after
    assert after(found | {"nrmse_after": 0.15}, [], fit) is None and not asked_for
    assert after(found | {"nrmse_after": 0.3}, [], None) is None and not asked_for
    assert after(found | {"nrmse_after": 0.3}, [], fit) == 0.2
    assert after(found | {"nrmse_after": 0.3}, [], no_fit) is None
    assert asked_for == [FRICTION[0]] * 2
    nothing = row("adequate", []) | errors | {"nrmse_after": 0.3}
    assert after(nothing, [], fit) is None and len(asked_for) == 2


def test_other_noise_is_counted_apart():
    right, wrong = (row("named", [said], [FRICTION], seed=1) for said in (FRICTION, CUBIC))
    rows = [right, wrong, {**right, "decibels": 40.0}, {**wrong, "decibels": 20.0}]
    rows.append({**row("named", [CUBIC]), "decibels": 20.0})
    found = tables(rows)
    assert (found["law_right"]["hits"], found["law_right"]["count"]) == (1, 2)
    shares = {name: (one["hits"], one["count"]) for name, one in found["by_noise"].items()}
    assert shares == {"40": (1, 1), "20": (0, 1)}
    assert found["false_alarms"]["all"]["hits"] == 1
    assert [decibels(seed) for seed in (16, 19, 27, 7)] == [30.0, 40.0, 20.0, 30.0]


def test_what_is_alike_is_asked_again_after_the_test_that_parts_it(monkeypatch):
    drawn, said = [], [row("ambiguous", [CUBIC, FRICTION]), row("named", [FRICTION])]
    said = [{key: one[key] for key in ("status", "causes", "where")} for one in said]
    hidden = {"law": FRICTION[0], "place": "wrist", "places": ["wrist"], "strength": 0.1}
    truth = {"model": "pinned_wrist", "noise": {"kind": "white", "snr_db": 30.0}}
    truth |= {"causes": [hidden], "power": {"detectable": True, "projected_norm": 200.0}}

    def draw_one(bench, seed, folder, again=None):
        drawn.append(again)
        (folder / "truth.json").write_text(json.dumps(truth)) if again is None else None
        return []

    def proposed(path):
        assert json.loads(path.read_text()) == {"answer": 1}
        one = {"like": "train_02_impact", "test": "Strike", "expected_evidence": 50.0}
        return {"tests": [one | {"amplitude_factor": 1.0}, one | {"amplitude_factor": 2.0}]}

    monkeypatch.setattr(hidden_effect, "draw_case", draw_one)
    monkeypatch.setattr(hidden_effect, "propose_experiment", proposed)
    monkeypatch.setattr(
        hidden_effect, "_verdict", lambda *_: (dict(said[len(drawn) - 1]), None, {"answer": 1})
    )
    for name in ("white_bic", "sparse_regression"):
        monkeypatch.setattr(hidden_effect, name, lambda base: None)
    found = answer(("A", 4))
    assert drawn == [None, "train_02_impact:2"]
    assert outcome(found) == "right pair" and found["next"]["test"] == "Strike"
    errors = dict.fromkeys(("nrmse_before", "nrmse_after", "noise_floor"))
    counted = tables([found | errors, found | errors | {"next": None}])["after_next_test"]
    assert (counted["hits"], counted["count"]) == (1, 1)


def test_two_effects_are_counted_where_a_third_is_named():
    two = [FRICTION, CUBIC]
    rows = [row("named", two, two), row("named", [*two, ("slip", "sleeve")], two)]
    found = tables(rows)["several_no_more"]
    assert (found["hits"], found["count"]) == (1, 2)


def test_the_page_tells_every_case_that_was_not_answered_rightly(tmp_path):
    cases = [
        row("named", [FRICTION], [FRICTION]),
        row("adequate", [], [CUBIC], norm=40.0, seed=17),
        row("failed", [], [CUBIC], bench="B", seed=18, fault="it <broke>"),
        row("named", [CUBIC], seed=19),
    ]
    benches = {b: tables([one for one in cases if one["bench"] == b]) for b in "AB"}
    result = {"benches": benches, "cases": cases, "protocol": ["A case is a seed."]}
    result |= {"provenance": {"version": "0"}, "undrawn": []}
    page = write_hidden_page(result, tmp_path / "page.html").read_text()
    assert "Not answered rightly, bench A: 2" in page and "bench B: 1" in page
    assert "A 17" in page and "40, too weak" in page and "it &lt;broke&gt;" in page
    assert "dry (Coulomb) friction (wrist)" in page and "A 1<" not in page
    assert page.count("<svg") == 0 and page.count("data:image/svg+xml") == 1
    assert "Not drawn" not in page


def test_without_the_bench_the_study_says_so(tmp_path):
    with pytest.raises(ValueError, match=r"expected the bench.*source checkout"):
        require_bench(tmp_path)
    require_bench()


def test_what_the_bench_refuses_is_said(tmp_path):
    with pytest.raises(ValueError, match=r"expected a case.*Mend"):
        draw_case("C", 1, tmp_path)


@pytest.fixture
def quick(monkeypatch):
    """The study with a bench and a diagnosis that answer at once; counts what it was asked."""
    seen = []

    def rows(cases):
        for bench, seed in cases:
            seen.append((bench, seed))
            truth = [FRICTION] if seed % 2 else []
            one = row("named" if truth else "adequate", truth, truth, bench)
            yield one | {"seed": seed, "code": hidden_effect.code()}

    monkeypatch.setattr(hidden_effect, "answers", rows)
    return seen


def test_a_run_that_was_stopped_goes_on(quick, tmp_path):
    study = study_named("hidden_effect")
    first = study.run(Call(tmp_path, seed=3, cases=2))
    assert quick == [(b, s) for s in (3000, 3001) for b in "AB"]
    path = tmp_path / hidden_effect.CASES
    path.write_text(path.read_text()[:-20])  # the last line was cut off
    assert len(done(path)) == 3
    quick.clear()
    again = study.run(Call(tmp_path, seed=3, cases=3))
    assert quick == [("B", 3001), ("A", 3002), ("B", 3002)]
    assert len(again["cases"]) == 6 and again["cases"][:3] == first["cases"][:3]
    names = {file.name for file in tmp_path.iterdir()}
    assert names == {
        hidden_effect.CASES,
        *(f"hidden_effect.{end}" for end in ("json", "md", "svg", "html")),
    }
    assert json.loads((tmp_path / "hidden_effect.json").read_text()) == again
    text = (tmp_path / "hidden_effect.md").read_text()
    assert all(line in text for line in again["protocol"])
    assert "wrist/coulomb_friction: 1 wrist/coulomb_friction" in text


def test_a_case_that_the_bench_cannot_draw_stops_no_run(monkeypatch, tmp_path, capsys):
    row = answer(("C", 3000))
    assert "expected a case" in row["undrawn"]
    monkeypatch.setattr(hidden_effect, "answers", lambda cases: iter([row | {"bench": "B"}]))
    study = study_named("hidden_effect")
    result = study.run(Call(tmp_path, seed=3, cases=1))
    assert result["cases"] == [] and result["undrawn"][0]["bench"] == "B"
    assert done(tmp_path / hidden_effect.CASES) == {}
    assert "## Not drawn" in (tmp_path / "hidden_effect.md").read_text()
    assert "Not drawn" in (tmp_path / "hidden_effect.html").read_text()
    study.show(result)
    assert "expected a case" in capsys.readouterr().out.replace("\n", " ")


def test_rows_of_other_code_are_answered_anew(quick, tmp_path):
    study = study_named("hidden_effect")
    study.run(Call(tmp_path, seed=3, cases=1))
    path = tmp_path / hidden_effect.CASES
    assert len(done(path)) == 2 and len(hidden_effect.code()) == 12
    path.write_text(path.read_text().replace(hidden_effect.code(), "0" * 12))
    assert done(path) == {}


def test_the_figure_and_the_summary_are_made_of_the_tables(quick, tmp_path, capsys):
    study = study_named("hidden_effect")
    result = study.run(Call(cases=4))
    assert not list(tmp_path.iterdir())
    draw(result, tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").read_text().count("<path") > 10
    told = dict((words, cells) for words, *cells in lines(result))
    assert told["invented cause on clean records"][0].startswith("0 % (0 to ")
    study.show(result)
    assert "right place as well" in capsys.readouterr().out
    assert as_text(result).startswith("# How often")


def test_the_bench_writes_truth_where_nobody_looks(tmp_path):
    sidecars = draw_case("A", 6, tmp_path)
    assert len(sidecars) == 6
    assert (tmp_path / "truth.json").is_file()
    assert all(path.parent == tmp_path / "records" for path in sidecars)


@pytest.mark.slow
def test_one_case_of_each_bench_goes_all_the_way():
    for bench in "AB":
        found = answer((bench, 7))
        assert found["status"] in ("adequate", "named", "ambiguous", "unknown")
        assert found["seconds"] > 0 and found["noise"]
        assert (found["power"] is None) == (found["truth"] == [])
        assert outcome(found) in tables([found])["outcomes"]
    assert Path(ROOT, "tests", "lab").is_dir()


def dying(case: tuple[str, int]) -> dict[str, object]:
    """As a library that crashes: one case always, one the first time."""
    bench, seed = case
    once = Path(os.environ["SUPPLE_TEST_ONCE"])
    if seed == 7 or (seed == 2 and not once.exists()):
        once.touch()
        os._exit(11)
    return {"bench": bench, "seed": seed, "status": "adequate"}


@pytest.mark.slow
def test_a_process_that_dies_takes_no_other_case_with_it(tmp_path, monkeypatch):
    monkeypatch.setenv("SUPPLE_TEST_ONCE", str(tmp_path / "once"))
    rows = {row["seed"]: row for row in answers([("A", seed) for seed in (1, 2, 7)], dying)}
    assert sorted(rows) == [1, 2, 7]
    assert [rows[seed]["status"] for seed in (1, 2, 7)] == ["adequate", "adequate", "failed"]
    lost = rows[7]
    assert lost["fault"] == "the process died twice" and "truth" in lost
    assert tables([lost])["seconds"]["longest"] == 0.0
