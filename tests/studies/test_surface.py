"""Surfaces: slices of the map as they are, units on every axis, pages that open and stay small."""

import base64
import gzip
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from supple.studies import cli
from supple.studies.surface import image, line_figure, planes_of, surface_figure
from supple.studies.surface_page import STEPS, turning_page, write_surfaces

RIG = '[rig]\nkind = "robot"\nmodel = "pinned_wrist"\npreset = "robo_v_sleeve_50"\n'
DRIVE = (
    '[drive]\nkind = "impact"\nforce = -1600.0\nduration = 0.005\n'
    "[times]\nduration = 2.0\nsample_rate = 1000.0\n"
)
SPEC = (
    '[sweep]\nrig = "rig.toml"\ndrive = "impact.toml"\nscores = ["rms"]\n'
    'of = "clubhead:acceleration:collet"\nwindow = [0.005, 2.0]\n[axes]\n'
    "wrist_stiffness = { start = 20.0, step = 20.0, count = 12 }\n"
    "wrist_damping = { low = 1.0, high = 30.0, count = 9, scale = 'log' }\n"
)
SOBOL = (
    "[sensitivity]\nsamples = 256\n"
    "parameters = { sleeve_damping = { low = 500.0, high = 2000.0 } }\n"
)
NAMES = ("wrist_stiffness", "wrist_damping", "collet_inertia")
UNITS: dict[str, str] = dict(zip(NAMES, ("N m/rad", "N m s/rad", "kg m^2")))


def made(shape: tuple[int, ...], scores: tuple[str, ...] = ("rms",)) -> tuple[Any, dict[str, Any]]:
    """A map of made-up scores, as far as figures look at it, and what is said of it."""
    axes = tuple(
        SimpleNamespace(name=n, unit=UNITS[n], values=np.linspace(1.0, 2.0, size)[::-1])
        for n, size in zip(NAMES, shape)
    )
    grids = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
    bowl = np.full(grids[0].shape, 3.0)
    for k, grid in enumerate(grids):
        bowl += (k + 1.0) * (grid - 1.3) ** 2
    found = SimpleNamespace(
        task=SimpleNamespace(axes=axes),
        scores={name: (k + 1) * bowl for k, name in enumerate(scores)},
        regions={
            "overdamped": (bowl > 3.4).astype(np.int8),
            "mode_changes": (np.abs(bowl - 3.4) < 0.05).astype(np.int8),
            "grip_beyond": (bowl > 3.6).astype(np.int8),
        },
    )
    design = {axis.name: 1.3 for axis in axes}
    best = {
        "status": "certified", "which": "lowest", "value": 3.0, "design": design,
        "one_percent": {name: [1.2, None] for name in design}, "sentence": "The lowest. Flat.",
        "shape": dict.fromkeys(design, "flat"), "elasticity": dict.fromkeys(design, 0.0),
    }  # fmt: skip
    told = {"unit": "m/s^2", "meaning": "a bowl", "not_finite": 0}
    result = {
        "status": "swept", "designs": bowl.size, "rig": "rig.toml",
        "axes": {axis.name: {"unit": axis.unit} for axis in axes},
        "scores": dict.fromkeys(scores, told),
        "optima": dict.fromkeys(scores, best),
        "regions": {"overdamped": 1, "mode_changes": 1, "grip_beyond": 1},
        "grip_limit": 0.002,
    }  # fmt: skip
    return found, result


def test_slices_go_through_the_optimum_with_ascending_axes():
    found, result = made((7, 6, 5))
    planes = planes_of(found, "rms", {**result["optima"]["rms"]["design"], "wrist_damping": 1.22})
    assert [(one.first, one.second) for one in planes] == [
        (NAMES[0], NAMES[1]), (NAMES[0], NAMES[2]), (NAMES[1], NAMES[2]),
    ]  # fmt: skip
    plane = planes[1]
    assert (np.diff(plane.x) > 0).all() and (np.diff(plane.y) > 0).all()
    assert plane.cut == {"wrist_damping": pytest.approx(1.2)}
    x, y = np.meshgrid(plane.x, plane.y, indexing="ij")
    expected = 3.0 + (x - 1.3) ** 2 + 2 * (1.2 - 1.3) ** 2 + 3 * (y - 1.3) ** 2
    np.testing.assert_allclose(plane.values, expected)
    np.testing.assert_array_equal(plane.marks["overdamped"], expected > 3.4)


@pytest.mark.parametrize("shape", [(9, 8), (6, 5, 4)])
def test_every_axis_carries_its_unit_and_the_best_is_marked(shape):
    found, result = made(shape)
    best = result["optima"]["rms"]
    planes = planes_of(found, "rms", best["design"])
    figure = surface_figure(planes, "rms [m/s²]", UNITS, best)
    solid, *contours = [one for one in figure.axes if one.get_xlabel()]
    assert solid.get_zlabel() == "rms [m/s²]"  # pyright: ignore[reportAttributeAccessIssue]
    assert len(contours) == len(planes)
    for axes in (solid, *contours):
        assert "[N m" in axes.get_xlabel() and "[" in axes.get_ylabel()
    stars = [line for line in contours[0].lines if line.get_marker() == "*"]
    assert np.asarray(stars[0].get_data()).ravel().tolist() == [1.3, 1.3]
    words = [text.get_text() for text in contours[0].get_legend().get_texts()]  # pyright: ignore
    assert words[:3] == ["overdamped", "mode changes", "grip beyond its limit"]
    assert {hatch for one in contours[0].collections for hatch in getattr(one, "hatches", [])} == {
        "//", "..", "x", None,
    }  # fmt: skip
    bars = [one for one in figure.axes if one.get_label() == "<colorbar>"]
    assert {one.get_ylabel() for one in bars} == {"rms [m/s²]"}


def test_files_for_print_are_the_same_every_time():
    found, result = made((9, 8))
    best = result["optima"]["rms"]
    drawn = [
        image(surface_figure(planes_of(found, "rms", {}), "rms", UNITS, best), kind)
        for kind in ("svg", "svg", "png")
    ]
    assert drawn[0] == drawn[1] and drawn[0].startswith(b"<?xml")
    assert drawn[2].startswith(b"\x89PNG")
    width = int.from_bytes(drawn[2][16:20], "big")
    assert width >= 2000  # 200 dots an inch, eleven inches


def test_one_axis_makes_a_line():
    found, result = made((9,))
    assert planes_of(found, "rms", {}) == []
    axes = line_figure(found, "rms", "rms [m/s²]", UNITS, result["optima"]["rms"]).axes[0]
    assert axes.get_xlabel() == "wrist stiffness [N m/rad]"
    assert (np.diff(np.asarray(axes.lines[0].get_xdata())) > 0).all()


def unpacked(page: str) -> dict[str, Any]:
    text = re.findall(r'<script type="application/json" id="told">(.*?)</script>', page)[0]
    told = json.loads(text)
    for one in told["scores"].values():
        content = np.frombuffer(gzip.decompress(base64.b64decode(one.pop("data"))), np.uint8)
        low, high = content.reshape(2, -1).astype(np.int64)
        codes = np.cumsum(low + 256 * high) & 0xFFFF
        values = one["low"] + (one["high"] - one["low"]) * codes / STEPS
        one["values"] = np.where(codes == 65535, np.nan, values)
    return told


def test_the_page_to_turn_holds_every_design_and_stays_below_8_mb():
    found, result = made((75, 75, 75), ("rms", "log_decrement", "peak"))
    noise = np.random.default_rng(1).normal(size=(75, 75, 75))
    found.scores["peak"] = found.scores["peak"] + 1e-3 * noise
    found.scores["rms"][3, 4, 5] = np.nan
    page = turning_page(result, found)
    assert len(page.encode()) < 8_000_000
    assert not re.findall(r'(?:src|href)="(?!data:)', page.split("</style>")[0])
    told = unpacked(page)
    assert set(told["scores"]) == {"rms", "log_decrement", "peak"}
    for name, one in told["scores"].items():
        expected = found.scores[name][::-1, ::-1, ::-1].ravel()
        span = np.nanmax(expected) - np.nanmin(expected)
        np.testing.assert_allclose(one["values"], expected, atol=0.51 * span / STEPS)
    assert [axis["unit"] for axis in told["axes"]] == ["N m/rad", "N m s/rad", "kg m²"]


def test_noise_that_does_not_pack_is_left_out_and_said():
    found, result = made((75, 75, 75), ("rms", "peak", "settling", "log_decrement"))
    generator = np.random.default_rng(1)
    for name in found.scores:
        found.scores[name] = generator.uniform(size=(75, 75, 75))
    page = turning_page(result, found)
    assert len(page.encode()) < 8_000_000
    assert "Left out, to keep this page small: settling, log decrement" in page


def test_a_page_of_a_map_without_a_best_design_is_written(tmp_path):
    found, result = made((5, 4))
    found.scores["rms"] = np.full((5, 4), np.nan)
    result["optima"] = {"rms": None}
    found.scores["peak"] = np.ones((5, 4))
    result["scores"]["peak"], result["optima"]["peak"] = result["scores"]["rms"], None
    files = write_surfaces(result, found, tmp_path)
    assert files == ["report.html", "surface.html", "surface_peak.png", "surface_peak.svg"]
    assert "No design has a finite score." in (tmp_path / "report.html").read_text()


@pytest.fixture(scope="module")
def swept(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("swept")
    for name, text in (("rig", RIG), ("impact", DRIVE), ("spec", SPEC + SOBOL)):
        (folder / f"{name}.toml").write_text(text)
    assert cli.main(["sweep", str(folder / "spec.toml"), "--out", str(folder), "--quiet"]) == 0
    return folder


def test_a_sweep_tells_its_certified_optimum_and_what_matters(swept):
    result = json.loads((swept / "map.json").read_text())
    best = result["optima"]["rms"]
    assert best["status"] == "certified" and best["how"] == "gradient"
    assert best["value"] == pytest.approx(115.973, rel=1e-5) and best["value"] <= best["on_grid"]
    assert best["shape"] == {"wrist_stiffness": "flat", "wrist_damping": "even"}
    assert "flat along wrist stiffness" in best["sentence"]
    assert len(best["curvature"]) == 2 and best["bounds"] == {}
    told = result["sensitivity"]
    assert told["designs"] == 256 * 5
    assert set(told["scores"]["rms"]) == {"wrist_stiffness", "wrist_damping", "sleeve_damping"}
    for one in told["scores"]["rms"].values():
        assert one["first_interval"][0] <= one["first"] <= one["first_interval"][1]
    page = (swept / "report.html").read_text()
    assert "The lowest rms is 116 m/s² at wrist stiffness 61.41 N m/rad" in page
    assert "What the scores depend on" in page and "<script" not in page


@pytest.mark.parametrize("file", ["surface.html", "report.html"])
def test_pages_open_without_the_network_and_without_an_error(file, swept, browser):
    page = browser.new_page(viewport={"width": 1200, "height": 800})
    faults, asked = [], []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((swept / file).as_uri())
    if file == "surface.html":
        page.wait_for_function("document.body.dataset.drawn !== undefined", timeout=20_000)
        page.select_option("#kind", "contour")
        page.wait_for_function("document.body.dataset.drawn === 'rms contour'")
        text = page.text_content("#plot") or ""
        assert "wrist stiffness [N m/rad]" in text and "wrist damping [N m s/rad]" in text
        page.select_option("#right", "1")
        assert page.eval_on_selector("#back", "one => one.value") == "0"
    page.close()
    assert faults == []
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[sensitivity]\nsamples = 100\n", "a power of two"),
        ("[sensitivity]\nparameters = { shaft_damping = { low = 1.0 } }\n", "'low' and 'high'"),
        ("[sensitivity]\nparameters = { shaft = { low = 1.0, high = 2.0 } }\n", "'shaft'"),
        ("[sensitivity]\nsample = 64\n", "samples"),
    ],
)
def test_a_bad_sensitivity_is_refused_before_anything_is_simulated(table, words, swept, capsys):
    (swept / "bad.toml").write_text(SPEC + table)
    assert cli.main(["sweep", str(swept / "bad.toml"), "--out", str(swept / "bad")]) == 2
    said = capsys.readouterr().err
    assert words in said and "Mend:" in said and len(said.splitlines()) == 1
    assert not (swept / "bad").exists()
