"""The reports, opened in a browser: the verdict on the first screen, every figure drawn."""

import dataclasses
import re

import numpy as np
import pytest

from supple.studies.report import write_fit_report, write_report
from supple.studies.sketch import sketch
from supple.studies.views import envelope
from tests.studies.synthetic import CAUSE, decay_view, diagnosis, long_view

SCREEN = {"width": 1280, "height": 800}
FIT = {
    "parameters": {
        "links.spring.stiffness": {
            "value": 400.2,
            "std": 0.3,
            "low": 399.6,
            "high": 400.8,
            "unit": "N/m",
            "identifiable": "yes",
        },
        "masses.cart.mass": {
            "value": 1.0,
            "std": 0.2,
            "low": 0.6,
            "high": 1.4,
            "unit": "kg",
            "identifiable": "coupled",
            "partner": "links.spring.stiffness",
        },
        "links.spring.damping": {
            "value": 0.0,
            "std": None,
            "low": None,
            "high": 1.4,
            "unit": "N s/m",
            "identifiable": "one_sided",
        },
    },
    "noise": {"law": "white", "parameters": {"std": 4e-4}},
    "misfit": {"reduced_chi2": 1.1, "whiteness_p": 0.2},
    "status": "converged",
}


@pytest.fixture(scope="module")
def views():
    return [
        decay_view(),
        decay_view("decay_2", start=0.06, seed=2),
        decay_view("decay_3", "held_out", 0.14, 5),
    ]


def opened(browser, path):
    """The page, its console's complaints, and every address that it asked for."""
    page = browser.new_page(viewport=SCREEN)
    complaints, asked = [], []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(path.as_uri())
    outside = [url for url in asked if url != path.as_uri() and not url.startswith("data:")]
    return page, complaints, outside


def is_on_first_screen(page, selector):
    box = page.locator(selector).bounding_box()
    return box["y"] >= 0 and box["y"] + box["height"] <= SCREEN["height"]


def n_figures_drawn(page):
    """Number of figures with a size on the page and a picture in them; none may lack either."""
    found = page.locator("figure img").all()
    for image in found:
        box = image.bounding_box()
        assert box["width"] > 400 and box["height"] > 100
        assert image.evaluate("i => i.complete && i.naturalWidth") > 400
        assert len(image.get_attribute("alt")) > 20
    return len(found)


def test_a_named_cause_stands_on_the_first_screen_with_its_figures_below(browser, views, tmp_path):
    page, complaints, outside = opened(
        browser, write_report(diagnosis(), views, tmp_path / "report.html")
    )
    assert complaints == [] and outside == []
    assert page.locator("#sentence").inner_text() == diagnosis()["sentence"]
    for selector in ("#sentence", "#where", "#why", "#sure", "#gain", "#next"):
        assert is_on_first_screen(page, selector), selector
    assert "31 %" in page.locator("#gain").inner_text()
    assert "over 99" not in page.locator("#sure").inner_text()
    assert page.locator("svg.sketch circle").count() == 1
    assert n_figures_drawn(page) == 7  # two records, structure, backbone, evidence, two held out
    text = page.locator("main").inner_text()
    for words in ("400.20 ± 0.30", "N/m³", "sha256", "AR(1)", "decay_1.head.offset", "alikeness"):
        assert words in text
    assert page.evaluate("document.documentElement.scrollWidth") <= SCREEN["width"]


@pytest.mark.parametrize("status", ["adequate", "ambiguous", "unknown", "refused"])
def test_every_verdict_has_its_own_page(browser, views, tmp_path, status):
    shown = views[:1] if status != "refused" else []
    path = write_report(diagnosis(status), shown, tmp_path / "report.html")
    page, complaints, outside = opened(browser, path)
    assert complaints == [] and outside == []
    assert page.locator(f"body.{status} #sentence").inner_text() == diagnosis(status)["sentence"]
    for selector in ("#sentence", "#where", "#why", "#sure", "#gain", "#next"):
        assert is_on_first_screen(page, selector), selector
    n_expected = {"adequate": 4, "ambiguous": 4, "unknown": 5, "refused": 0}
    assert n_figures_drawn(page) == n_expected[status]


def test_a_long_sentence_and_four_causes_still_fit_the_first_screen(browser, tmp_path):
    places = ["spring", "cart", "ground", "cart"]
    told = diagnosis(
        sentence="The spring has Coulomb friction of 0.249 ± 0.004 N, " * 5,
        causes=[CAUSE | {"place": place} for place in places],
        why=["A line of evidence that is as long as lines of evidence will ever be, or so. " * 2]
        * 5,
    )
    page, _, _ = opened(browser, write_report(told, [], tmp_path / "report.html"))
    assert is_on_first_screen(page, "#next")


def test_the_page_of_a_fit_says_what_the_records_tell(browser, views, tmp_path):
    shown = [dataclasses.replace(view, after=view.before) for view in views[:1]]
    page, complaints, outside = opened(
        browser, write_fit_report(FIT, shown, tmp_path / "report.html")
    )
    assert complaints == [] and outside == []
    assert page.locator("#sentence").inner_text() == "These records tell 1 of 3 constants."
    text = page.locator("main").inner_text()
    assert "only together with links.spring.stiffness" in text
    assert "only bounded from one side" in text
    assert n_figures_drawn(page) == 3


def test_what_users_write_never_becomes_markup(tmp_path):
    evil = "<script>alert(1)</script>"
    rig = {"kind": "chain", "masses": [evil], "links": {evil: ["ground", evil]}}
    told = diagnosis(
        sentence=evil, title=evil, why=[evil], rig=rig, causes=[CAUSE | {"place": evil}]
    )
    view = dataclasses.replace(decay_view(n_samples=300), record=evil, channel=evil)
    page = write_report(told, [view], tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;" in page


def test_a_long_record_makes_a_page_of_less_than_three_megabytes(tmp_path):
    views = [dataclasses.replace(long_view(), record=f"driven_{i}") for i in range(2)]
    path = write_report(diagnosis(), views, tmp_path / "report.html")
    assert path.stat().st_size < 3_000_000
    addresses = re.findall(r'(?:src|href|url)\s*[=(]\s*["\']?([^"\')> ]{1,30})', path.read_text())
    assert addresses and all(address.startswith("data:") for address in addresses)


def test_the_same_diagnosis_makes_the_same_page_and_leaves_nothing_beside_it(tmp_path):
    views = [decay_view(n_samples=300)]
    first = write_report(diagnosis(), views, tmp_path / "report.html").read_bytes()
    assert write_report(diagnosis(), views, tmp_path / "report.html").read_bytes() == first
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_a_bare_diagnosis_is_enough(tmp_path):
    told = {"status": "adequate", "sentence": "All is well.", "causes": [], "gain": None}
    page = write_report(told, [], tmp_path / "report.html").read_text(encoding="utf-8")
    assert "All is well." in page and "No record was held out" in page


def test_thinning_keeps_every_spike():
    times = np.arange(100_000) / 1000.0
    values = np.sin(times)
    values[54_321] = 9.0
    thin_times, thin_values = envelope(times, values)
    assert len(thin_times) <= 1000
    assert thin_values.max() == 9.0 and np.all(np.diff(thin_times) > 0)


@pytest.mark.parametrize("motion", ["translation", "rotation"])
def test_every_place_of_a_chain_is_on_its_sketch(motion):
    links = {"a": ["ground", "m"], "b": ["ground", "m"], "c": ["m", "n"], "d": ["n", "ground"]}
    rig = {"kind": "chain", "motion": motion, "masses": ["m", "n"], "links": links}
    rig["channels"] = {"encoder": "n"}
    drawn = sketch(rig, [*links, "m", "n", "ground", "base", "encoder"])
    assert "not on this drawing" not in drawn
    assert "not on this drawing: moon" in sketch(rig, ["moon"])


@pytest.mark.parametrize(
    "change",
    [
        {"noise_std": 0.0},
        {"noise_std": float("nan")},
        {"before": np.full(300, np.nan)},
        {"measured": np.zeros(300)},
        {"displacement": np.zeros(300), "velocity": np.full(300, np.nan)},
        {"before": np.full(300, 1e30)},
    ],
)
def test_a_record_that_went_wrong_is_still_drawn(tmp_path, change):
    view = dataclasses.replace(decay_view(n_samples=300), **change)
    held_out = dataclasses.replace(view, split="held_out", record="other")
    page = write_report(diagnosis(), [view, held_out], tmp_path / "report.html").read_text()
    assert page.count("<figure") >= 4


@pytest.mark.parametrize("n_samples", [2, 9, 40])
def test_a_short_record_is_still_drawn(tmp_path, n_samples):
    view = decay_view(n_samples=n_samples)
    page = write_report(diagnosis(), [view], tmp_path / "report.html").read_text()
    assert page.count("<figure") >= 2


def test_a_channels_error_is_drawn_against_reading_rate_and_time(tmp_path):
    x = np.linspace(-1.0, 1.0, 30)
    curves = [
        {"against": against, "x": list(x), "error": list(0.1 * x**2), "std": list(0.0 * x),
         "unit_x": unit, "unit_error": "m/s^2", "share": 0.5}
        for against, unit in (("reading", "m/s^2"), ("rate", "m/s^2/s"), ("time", "s"))
    ]  # fmt: skip
    error = {"place": "feel_cart", "record": "decay_1", **curves[0], "curves": curves}
    where = {"place": "feel_cart", "kind": "channel", "without": [], "forces": []}
    told = diagnosis("unknown") | {"where": where, "missing_force": None, "misreading": error}
    path = tmp_path / "report.html"
    write_report(told, [], path)
    page = path.read_text()
    assert "What the channel adds" in page and "The missing force" not in page
    assert "The error of feel_cart is drawn below, against what it should read." in page
    for against in ("reading", "rate", "time"):
        assert f"Error of feel_cart against {against}" in page
