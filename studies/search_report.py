"""The page of a search: the best designs, how they were found, and what they depend on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from .figures import _STYLE, AFTER, BEFORE, OTHER, _new, data_uri
from .report import write_page
from .words import number_words, unit_words

if TYPE_CHECKING:
    from ..optimize.search import Search

MOST_ROWS = 25
"""Designs of a Pareto front that the page lists [-]; ``search.json`` holds all."""

MOST_PARAMETERS = 6
"""Parameters against which the first objective is drawn [-]."""

MOST_DOTS = 4000
"""Designs that a figure draws [-]; more are thinned out."""


def write_search_report(result: Mapping[str, Any], found: Search, path: Path) -> Path:
    """Write the page of a search.

    Args:
        result: what ``search.json`` holds.
        found: every design that was looked at.
        path: file to write; its folder exists.

    Returns:
        The path.
    """
    done = result["status"] == "searched"
    figures = [_figure("History", history_figure(result, found), _HISTORY)]
    if len(found.task.objectives) > 1:
        drawn = _figure("Pareto front", front_figure(result, found), _FRONT)
        figures.append({**drawn, "narrow": len(found.task.objectives) == 2})
    drawn = importance_figure(result)
    if drawn is not None:
        figures.append(_figure("What matters", drawn, _IMPORTANCE))
    figures.append(_figure("Where the good ones lie", slice_figure(result, found), _SLICES))
    sections = [
        {
            "title": "The best designs" if len(result["front"]) > 1 else "The best design",
            "words": _limits(result),
            "figures": [],
            "head": ["design", *(_label(result, name) for name in result["scores"])],
            "rows": [_row(result, one) for one in _thinned(result["front"], MOST_ROWS)],
            "left": 1,
        },
        {"title": "How they were found", "words": [], "figures": figures, "rows": []},
    ]
    return write_page(
        {
            "title": "Which design is best",
            "status": "adequate" if done else "ambiguous",
            "chip": "Searched" if done else "No usable design",
            "sentence": _sentence(result),
            "sections": sections,
            "version": (result.get("provenance") or {}).get("version", ""),
        },
        path,
    )


_HISTORY = "Each dot is one design, in the order drawn; the line is the best usable one so far."
_FRONT = "No design is better in both objectives than one of the connected dots. Light: the others."
_IMPORTANCE = "Share of each parameter in whether a design is among the best tenth (PED-ANOVA)."
_SLICES = "The first objective of every design against each parameter; the ring marks the best."


def _figure(title: str, figure: Figure, caption: str) -> dict[str, Any]:
    return {
        "title": title,
        "image": data_uri(figure),
        "alt": f"{title}. {caption}",
        "caption": caption,
        "narrow": False,
    }


def _label(result: Mapping[str, Any], name: str) -> str:
    return f"{name.replace('_', ' ')} [{unit_words(result['scores'][name]['unit'])}]"


def _thinned(items: list[Any], most: int) -> list[Any]:
    """At most so many of the items, spread over them."""
    if len(items) <= most:
        return items
    return [items[int(at)] for at in np.linspace(0, len(items) - 1, most).round()]


def _row(result: Mapping[str, Any], one: Mapping[str, Any]) -> list[str]:
    return [_design_words(result, one), *(number_words(v, 5) for v in one["scores"].values())]


def _design_words(result: Mapping[str, Any], one: Mapping[str, Any]) -> str:
    units = {name: axis["unit"] for name, axis in result["axes"].items()}
    for choice in result["choices"].values():
        units |= choice["units"]
    told = [part for name, part in one["parts"].items() if name not in one["design"]]
    for name, value in one["design"].items():
        told.append(f"{name.replace('_', ' ')} {number_words(value, 5)} {unit_words(units[name])}")
    return ", ".join(told)


def _limits(result: Mapping[str, Any]) -> list[str]:
    words = []
    for name, one in result["constraints"].items():
        bounds = [
            f"at {'least' if k == 'min' else 'most'} {number_words(v)}" for k, v in one.items()
        ]
        unit = unit_words(result["scores"][name]["unit"])
        words.append(f"Limit: {name.replace('_', ' ')} {' and '.join(bounds)} {unit}.")
    return words


def _sentence(result: Mapping[str, Any]) -> str:
    trials, front = result["trials"], result["front"]
    if not front:
        return f"None of {trials['done']} designs keeps all limits."
    if result["best"] is None:
        names = " and ".join(name.replace("_", " ") for name in result["objectives"])
        return f"{len(front)} of {trials['done']} designs are not beaten in both {names}."
    name = next(iter(result["objectives"]))
    value = number_words(result["best"]["scores"][name], 5)
    unit = unit_words(result["scores"][name]["unit"])
    return (
        f"Of {trials['done']} designs the best is {_design_words(result, result['best'])}: "
        f"{name.replace('_', ' ')} {value} {unit}."
    )


def _shown(count: int) -> np.ndarray:
    return np.unique(np.linspace(0, count - 1, min(count, MOST_DOTS)).round().astype(int))


def history_figure(result: Mapping[str, Any], found: Search) -> Figure:
    """Every objective in the order in which designs were drawn; one panel an objective."""
    names = list(dict(found.task.objectives))
    usable, at = found.usable, _shown(len(found.draws))
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 0.6 + 2.6 * len(names))
        for k, name in enumerate(names):
            axes = figure.add_subplot(len(names), 1, k + 1)
            values = found.scores[name]
            good, bad = at[usable[at]], at[~usable[at]]
            axes.plot(good, values[good], ".", color=OTHER, markersize=3, label="usable")
            if len(bad):
                axes.plot(bad, values[bad], "x", color=BEFORE, markersize=4, label="beyond a limit")
            loss = np.where(usable, found.losses[:, k], np.inf)
            best = np.minimum.accumulate(loss) * (
                1 if found.task.directions[k] == "minimize" else -1
            )
            told = np.isfinite(best)
            axes.step(
                np.flatnonzero(told), best[told], color=AFTER, where="post", label="best so far"
            )
            axes.set(xlabel="design", ylabel=_label(result, name))
            _zoom(axes, values[good])
            axes.legend(loc="upper right", ncols=3, markerscale=3)
    return figure


def _zoom(axes: Any, values: np.ndarray) -> None:
    """Do not let a few bad designs hide the good ones."""
    values = values[np.isfinite(values)]
    if len(values) > 10:
        low, high = np.percentile(values, [0, 97])
        margin = 0.06 * max(high - low, 1e-300)
        axes.set_ylim(low - margin, high + 3 * margin)


def front_figure(result: Mapping[str, Any], found: Search) -> Figure:
    """The first objective against each of the others, with the Pareto front."""
    names = list(dict(found.task.objectives))
    at, front = _shown(len(found.draws)), found.front
    with mpl.rc_context(_STYLE):
        figure = _new(5.8 * min(len(names) - 1, 2), 4.2 * -(-(len(names) - 1) // 2))
        for k, name in enumerate(names[1:]):
            axes = figure.add_subplot(-(-(len(names) - 1) // 2), min(len(names) - 1, 2), k + 1)
            first, other = found.scores[names[0]], found.scores[name]
            axes.plot(first[at], other[at], ".", color=OTHER, markersize=3)
            look = "o-" if len(names) == 2 else "o"
            axes.plot(first[front], other[front], look, color=AFTER, markersize=4)
            axes.set(xlabel=_label(result, names[0]), ylabel=_label(result, name))
            if front:
                _zoom(axes, other[found.usable])
    return figure


def importance_figure(result: Mapping[str, Any]) -> Figure | None:
    """Bars of each parameter's share, one group an objective; None where it is not known."""
    shares = result["importances"]
    if not shares:
        return None
    names = list(next(iter(shares.values())))
    height = 0.8 / len(shares)
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 1.1 + 0.42 * len(names) * max(1.0, 0.6 * len(shares)))
        axes = figure.subplots()
        for k, (name, own) in enumerate(shares.items()):
            places = np.arange(len(names)) + k * height
            bars = [100.0 * own[one] for one in names]
            color = (AFTER, BEFORE, OTHER)[k % 3]
            axes.barh(places, bars, height=0.9 * height, color=color, label=name.replace("_", " "))
        axes.set_yticks(
            np.arange(len(names)) + 0.4 - height / 2, [n.replace("_", " ") for n in names]
        )
        axes.invert_yaxis()
        axes.set_xlabel("share of what makes a design good [%]")
        axes.grid(visible=False, axis="y")
        figure.legend(loc="outside upper right", ncols=len(shares))
    return figure


def slice_figure(result: Mapping[str, Any], found: Search) -> Figure:
    """The first objective against each parameter, one panel a parameter."""
    name = found.task.objectives[0][0]
    numbers = list(found.numbers)[:MOST_PARAMETERS]
    columns = min(3, len(numbers))
    units = {one.name: one.unit for one in found.task.ranges}
    logs = {one.name for one in found.task.ranges if one.is_log}
    for one in found.task.choices:
        units |= one.units
    at = _shown(len(found.draws))
    good, best = at[found.usable[at]], found.front[:1]
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 3.2 * -(-len(numbers) // columns))
        for k, own in enumerate(numbers):
            axes = figure.add_subplot(-(-len(numbers) // columns), columns, k + 1)
            values = found.numbers[own]
            scores = found.scores[name]
            dots = axes.scatter(values[good], scores[good], c=good, s=7, cmap="cividis")
            axes.plot(
                values[best], scores[best], "o", color=BEFORE, fillstyle="none", markersize=11
            )
            label = f"{own.replace('_', ' ')} [{unit_words(units[own])}]"
            axes.set(xlabel=label, ylabel=_label(result, name))
            if own in logs:
                axes.set_xscale("log")
            _zoom(axes, scores[good])
            if k == len(numbers) - 1:
                figure.colorbar(dots, ax=axes, label="design")
    return figure
