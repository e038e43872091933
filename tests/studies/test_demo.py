"""The demonstration, end to end: the hidden cause is named, the gain is real, the page opens."""

import json

import pytest

from supple.model.rig import read_rig
from supple.studies.cli import main

FRICTION = 0.22  # N m, as tests/lab/demo.py hides it in the records
TRUE = {
    "shaft_stiffness": 146.3,
    "sleeve_stiffness": 55_400.0,
    "sleeve_damping": 1610.0,
    "wrist_stiffness": 281.0,
    "wrist_damping": 4.6,
}  # SI, as RECIPE.md beside the records lists them


@pytest.fixture(scope="session")
def demo(tmp_path_factory):
    """The folder that one run of the demo writes."""
    folder = tmp_path_factory.mktemp("demo") / "report"
    assert main(["demo", "--out", str(folder), "--quiet"]) == 0
    return folder


@pytest.fixture(scope="session")
def told(demo):
    return json.loads((demo / "diagnosis.json").read_text(encoding="utf-8"))


def test_the_demo_names_the_hidden_friction_and_its_place(told):
    assert told["status"] == "named"
    assert [(c["law"], c["place"]) for c in told["causes"]] == [("coulomb_friction", "wrist")]
    torque = told["causes"][0]["parameters"]["torque"]
    assert torque["value"] == pytest.approx(FRICTION, abs=3 * torque["std"])
    assert torque["unit"] == "N m" and torque["std"] < 0.02 * FRICTION
    assert "wrist" in told["sentence"] and "friction" in told["sentence"]


def test_the_demos_constants_are_the_true_ones_within_their_errors(told):
    for name, true in TRUE.items():
        found = told["parameters"][name]
        assert found["after"] == pytest.approx(true, abs=3 * found["std"]), name
        assert found["std"] < 0.12 * true, name


def test_the_demo_gains_on_records_that_it_never_fitted(told):
    gain = told["gain"]
    assert sorted(gain["records"]) == ["held_out_blow", "held_out_release_090mm"]
    assert gain["nrmse_after"] < 0.3 * gain["nrmse_before"]
    assert gain["nrmse_after"] < 1.3 * gain["noise_floor"]
    assert told["misfit"]["after"]["reduced_chi2"] < 1.2 < told["misfit"]["before"]["reduced_chi2"]


def test_the_demo_says_what_the_cause_changes(told):
    decision = told["decision"]
    for key in ("best_before", "best_after"):
        assert set(decision[key]) == {"wrist_stiffness", "wrist_damping", "rms"}
        assert all(value > 0 for value in decision[key].values())
    assert 0.0 <= decision["loss_if_ignored"]["rms"] < 1.0
    how = decision["how"]
    assert how["is_minimum"] and how["step_error"] < 0.01
    assert how["grid"]["wrist_stiffness"]["count"] == 13 and how["drive"]["kind"] == "impact"


def test_the_demo_writes_its_three_files_and_the_rig_holds_the_law(demo):
    assert sorted(path.name for path in demo.iterdir()) == [
        "diagnosis.json",
        "report.html",
        "rig.toml",
    ]
    laws = read_rig(demo / "rig.toml").laws
    assert [(law["law"], law["place"]) for law in laws] == [("coulomb_friction", "wrist")]


def test_the_demo_never_reads_its_recipe(told):
    assert not any("RECIPE" in path for path in told["provenance"]["inputs"])


def test_the_page_opens_with_the_sentence_and_every_figure(browser, demo, told):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    complaints = []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto((demo / "report.html").as_uri())
    assert complaints == []
    assert page.locator("#sentence").inner_text() == told["sentence"]
    box = page.locator("#next").bounding_box()
    assert box["y"] + box["height"] <= 800
    figures = page.locator("figure img").all()
    assert len(figures) >= 12  # ten channels, structure, backbone, evidence, held out
    assert all(image.evaluate("i => i.complete && i.naturalWidth") > 400 for image in figures)
    text = page.locator("main").inner_text()
    for words in ("What it changes", "Backbone", "Records held out", "Provenance"):
        assert words in text
    page.close()
