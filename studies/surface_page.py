"""What a sweep leaves to look at: figures for print, a surface to turn, and a page with both."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .engine import write_together
from .optimum_words import plain, region_words
from .report import write_page
from .surface import COLORS, _span, image, is_geometric, line_figure, planes_of, surface_figure
from .words import number_words, unit_words

if TYPE_CHECKING:
    from ..optimize.sweep import Map

STEPS = 2**16 - 2
"""Steps from the lowest to the highest value that the page to turn tells apart [-]."""

MOST_BYTES = 2_900_000
"""Data of the page to turn, packed [byte]: with its program below 8 MB."""


def write_surfaces(result: Mapping[str, Any], found: Map, out: Path) -> list[str]:
    """Writes a sweep's figures and pages.

    Args:
        result: what ``map.json`` holds: ``axes``, ``scores``, ``optima``, ``regions``, and
            ``sensitivity`` if there is any.
        found: the map.
        out: folder for them.

    Returns:
        Names of the files: ``surface_SCORE.png`` and ``.svg`` for each score, ``surface.html``
        for a map of two axes or more, ``report.html``.
    """
    writers: dict[str, Callable[[Path], Any]] = {}
    pictures = {}
    units = {name: axis["unit"] for name, axis in result["axes"].items()}
    for name in found.scores:
        if not np.isfinite(np.asarray(found.scores[name])).any():
            continue
        label, best = _label(result, name), result["optima"][name]
        planes = planes_of(found, name, {} if best is None else best["design"])
        cloud = result.get("spread", {"scores": {}})["scores"].get(name)
        figure = (
            surface_figure(planes, label, units, best, cloud)
            if planes
            else line_figure(found, name, label, units, best, cloud)
        )
        for kind in ("png", "svg"):
            drawn = image(figure, kind)
            writers[f"surface_{name}.{kind}"] = _writer(drawn)
            if kind == "png":
                pictures[name] = drawn
    if sum(len(axis.values) > 1 for axis in found.task.axes) >= 2:
        page = turning_page(result, found)
        writers["surface.html"] = _writer(page.encode())
    writers["report.html"] = lambda path: _report(result, found, pictures, path)
    write_together(out, writers)
    return sorted(writers)


def _writer(content: bytes) -> Callable[[Path], Any]:
    return lambda path: path.write_bytes(content)


def _label(result: Mapping[str, Any], name: str) -> str:
    return f"{plain(name)} [{unit_words(result['scores'][name]['unit'])}]"


def turning_page(result: Mapping[str, Any], found: Map) -> str:
    """A page with surfaces to turn and slice in a browser, without the network; below 8 MB.

    Args:
        result: what ``map.json`` holds.
        found: the map.

    Returns:
        The page's text.
    """
    from jinja2 import Environment, StrictUndefined
    from plotly.offline import get_plotlyjs

    kept = [np.arange(len(axis.values)) for axis in found.task.axes]
    order = [
        np.argsort(a.values[k], kind="stable") for a, k in zip(found.task.axes, kept, strict=True)
    ]
    scores = _packed(found, order, result)
    thinned = "" if scores else "Every second design along each axis is shown."
    while not scores:
        order = [one[::2] for one in order]
        scores = _packed(found, order, result)
    left = [name for name in found.scores if name not in scores]
    if left:
        thinned += f" Left out, to keep this page small: {', '.join(map(plain, left))}."
    first = result["optima"].get(next(iter(scores))) or {"design": {}}
    axes = []
    for axis, own in zip(found.task.axes, order, strict=True):
        values = axis.values[own]
        start = int(np.argmin(np.abs(values - first["design"].get(axis.name, values[0]))))
        axes.append(
            {
                "name": plain(axis.name),
                "unit": unit_words(axis.unit),
                "values": values.tolist(),
                "log": is_geometric(values),
                "start": start,
            }
        )
    told = {"axes": axes, "scores": scores, "steps": STEPS, "colors": COLORS.capitalize()}
    text = files("supple.studies").joinpath("surface.html").read_text(encoding="utf-8")
    template = Environment(undefined=StrictUndefined, autoescape=False).from_string(text)
    from .. import __version__

    return template.render(
        title="Scores of every design of a grid",
        plotly=get_plotlyjs(),
        told=json.dumps(told, ensure_ascii=False).replace("<", "\\u003c"),
        steps=STEPS,
        thinned=thinned,
        version=__version__,
    )


def _packed(
    found: Map, order: list[np.ndarray], result: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """Scores as small numbers, as many as there is room for."""
    scores: dict[str, dict[str, Any]] = {}
    room = MOST_BYTES
    for name, values in found.scores.items():
        table = np.asarray(values, float)[np.ix_(*order)].ravel()
        finite = np.isfinite(table)
        if not finite.any():
            continue
        low, high = float(table[finite].min()), float(table[finite].max())
        span = high - low or 1.0
        codes = np.full(table.size, 2**16 - 1, np.int64)
        codes[finite] = np.round((table[finite] - low) / span * STEPS).astype(np.int64)
        steps = np.diff(codes, prepend=0) & 0xFFFF
        content = np.concatenate([steps & 0xFF, steps >> 8]).astype(np.uint8).tobytes()
        data = base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()
        if len(data) > room:
            continue
        room -= len(data)
        shown = _span(table)[1]
        scores[name] = {"label": _label(result, name), "low": low, "high": low + span, "data": data}
        scores[name]["shown"] = max(shown, low + 1e-3 * span)
    return scores


def _report(
    result: Mapping[str, Any], found: Map, pictures: Mapping[str, bytes], path: Path
) -> Path:
    """The page of a sweep."""
    sections = []
    for name in pictures:
        best = result["optima"][name]
        words = [] if best is None else [best["sentence"]]
        told = result["scores"][name]
        cloud = result.get("spread", {"scores": {}})["scores"].get(name)
        if cloud is not None:
            words.append(cloud["sentence"])
        if told["not_finite"]:
            words.append(f"{told['not_finite']} designs have no finite value.")
        uri = "data:image/png;base64," + base64.b64encode(pictures[name]).decode()
        caption = (
            "Hatched: the mode with most energy is overdamped. Dotted: it is another one than in a "
            "neighboring design. Star: the best design; around it, in white, what is 1 % worse."
        )
        if cloud is not None:
            caption += " Dots: the best of each draw; diamond: the best for all."
        if "grip_beyond" in result["regions"]:
            caption += " Crossed: the grip moves more than its limit."
        figure = {"title": plain(name).capitalize(), "image": uri, "alt": caption}
        sections.append(
            {
                "title": f"{plain(name).capitalize()}: {told['meaning']}",
                "words": words,
                "figures": [{**figure, "caption": caption, "narrow": False}],
                "rows": _rows(result, best),
                "head": ["parameter", "best", "1 % worse from", "to", "shape", "elasticity"],
                "left": 1,
            }
        )
    if result.get("sensitivity"):
        sections.append(_sobol(result))
    trusted = result["status"] == "swept"
    facts = region_words(result)
    sections.append({"title": "The map", "words": facts, "figures": [], "rows": []})
    first = next((one for one in result["optima"].values() if one is not None), None)
    sentence = first["sentence"].split(". ")[0] + "." if first else "No design has a finite score."
    from .. import __version__

    return write_page(
        {
            "title": f"{result['designs']} designs of {result['rig']}",
            "status": "adequate" if trusted else "ambiguous",
            "chip": "Swept" if trusted else "Not finite",
            "sentence": sentence.replace("..", "."),
            "sections": sections,
            "version": __version__,
        },
        path,
    )


def _rows(result: Mapping[str, Any], best: Mapping[str, Any] | None) -> list[list[str]]:
    rows = []
    for name, value in (best or {"design": {}})["design"].items():
        unit = unit_words(result["axes"][name]["unit"])
        ends = [number_words(end) for end in best["one_percent"][name]] if best else []
        told = [f"{number_words(value, 5)} {unit}", *ends, best["shape"][name] if best else ""]
        share = best["elasticity"].get(name) if best else None
        flat = isinstance(share, float) and abs(share) < 1e-4
        rows.append([plain(name), *told, "0" if flat else number_words(share, 2)])
    return rows


def _sobol(result: Mapping[str, Any]) -> dict[str, Any]:
    """What each score depends on, as a table."""
    told, rows = result["sensitivity"], []
    for name, own in told["scores"].items():
        for key, one in sorted(own.items(), key=lambda item: -item[1]["total"]):
            half = [0.5 * (one[f"{k}_interval"][1] - one[f"{k}_interval"][0]) for k in _KINDS]
            shares = [
                f"{100 * one[k]:.1f} ± {100 * h:.1f}".replace("-", "−")
                for k, h in zip(_KINDS, half, strict=True)
            ]
            rows.append([plain(name), plain(key), *shares])
    return {
        "title": "What the scores depend on",
        "words": [
            f"Sobol's shares of the variance over the ranges, from {told['designs']} designs: "
            "of each parameter alone, and with all its company, with intervals of 95 %."
        ],
        "figures": [],
        "head": ["score", "parameter", "alone [%]", "in all [%]"],
        "rows": rows,
        "left": 2,
    }


_KINDS = ("first", "total")
