"""The page of the hidden-effect study: what was found, and every case that was not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .hidden_score import ADEQUATE, BENCHES, answered, asked, outcome
from .report import write_page
from .sections import _drawn, _section
from .words import law_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADINGS = ("", *(f"bench {bench}" for bench in BENCHES))
LINES = {
    "invented cause on clean records": ("false_alarms", "all"),
    "right law, single detectable": ("law_right",),
    "right place as well": ("place_right_too",),
    "right law, single detectable, 40 dB": ("by_noise", "40"),
    "right law, single detectable, 20 dB": ("by_noise", "20"),
    "right law, single strong": ("strong_law_right",),
    "right place as well, strong": ("strong_place_right_too",),
    "right among those named": ("right_where_named",),
    "interval holds the effect's strength": ("strength", "interval_holds"),
    "takes away 80 % of the held-out error that the true law does": ("gains_most",),
    "takes away 80 % of the held-out error beyond the noise": ("gains_beyond_noise",),
    "named although the library lacks the law": ("law_absent_named_wrongly",),
    "law taken out of the library: wrongly named": ("without", "named_wrongly"),
    "law taken out: unknown": ("without", "unknown"),
    "law taken out: unknown, and at its place": ("without", "unknown_and_placed"),
    "two effects, each detectable: both named": ("several_all_right",),
    "two effects: nothing wrong named": ("several_none_wrong",),
    "two effects: no third one named": ("several_no_more",),
    "told to be alike: right after the proposed test": ("after_next_test",),
    "pick-by-BIC, white: invented": ("baselines", "white_bic", "false_alarms"),
    "pick-by-BIC, white: right": ("baselines", "white_bic", "right"),
    "sparse regression: invented": ("baselines", "sparse", "false_alarms"),
    "sparse regression: right": ("baselines", "sparse", "right"),
}
COLORS = ("#0072b2", "#d55e00")
GOOD = (ADEQUATE, "right", "right pair")


def _percent(share: Mapping[str, Any]) -> str:
    if not share["count"]:
        return "none drawn"
    low, high = 100 * share["low"], 100 * share["high"]
    shown = f"{100 * share['share']:.0f} % ({low:.0f} to {high:.0f})"
    return f"{shown}, {share['hits']} of {share['count']}"


def lines(result: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """The summary's rows, words for shares [-] and times [s]."""
    found = []
    for words, keys in LINES.items():
        cells = []
        for bench in BENCHES:
            value: Any = result["benches"][bench]
            for key in keys:
                value = value[key]
            cells.append(_percent(value))
        found.append((words, *cells))
    errors = [result["benches"][bench]["strength"]["median_error"] for bench in BENCHES]
    told = ("none told" if one is None else f"{100 * one:.1f} %" for one in errors)
    times = [result["benches"][bench]["seconds"] for bench in BENCHES]
    spent = (f"{one['median']:g} s, 90 % within {one['most']:g} s" for one in times)
    return [
        *found,
        ("median error of the effect's strength", *told),
        ("time of a diagnosis", *spent),
    ]


def write_hidden_page(result: Mapping[str, Any], path: Path) -> Path:
    """Write the page.

    Args:
        result: what ``hidden_effect.json`` holds.
        path: file to write; its folder exists.

    Returns:
        The path.
    """
    page = {
        "title": "Hidden effects",
        "status": ADEQUATE,
        "chip": "Benchmark",
        "sentence": _sentence(result),
        "sections": [
            _section("In figures", head=HEADINGS, rows=lines(result)),
            _curves(result),
            *(_failures(result["cases"], bench) for bench in BENCHES),
            *(_said(result["benches"][bench]["confusion"], bench) for bench in BENCHES),
            *_undrawn(result["undrawn"]),
            _section("How it was made", *result["protocol"]),
        ],
        "version": result["provenance"]["version"],
    }
    return write_page(page, path)


def _undrawn(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """What the bench could not draw, in its words; no section where it drew all."""
    return [_section("Not drawn", *(row["undrawn"] for row in rows))] if rows else []


def _sentence(result: Mapping[str, Any]) -> str:
    parts = []
    for bench in BENCHES:
        table = result["benches"][bench]
        parts.append(
            f"Bench {bench}, {table['cases']} cases: of the single effects that could be found "
            f"{_counted(table['place_right_too'])} named and placed rightly; on clean records "
            f"{_counted(table['false_alarms']['all'])} invented."
        )
    return " ".join(parts)


def _counted(share: Mapping[str, Any]) -> str:
    return f"{share['hits']} of {share['count']}"


def power_figure(result: Mapping[str, Any]) -> Figure:
    """Power against detectability, and calibration of the stated probabilities."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for bench, color in zip(BENCHES, COLORS, strict=True):
        table = result["benches"][bench]
        curve = [one for one in table["power"] if one["right"]["count"]]
        _shares(left, [max(one["low"], 3.0) for one in curve], [o["right"] for o in curve], color)
        told = [one for one in table["calibration"] if one["count"]]
        _shares(right, [(one["from"] + one["to"]) / 2 for one in told], told, color)
        left.plot([], [], "o-", color=color, label=f"bench {bench}")
    left.set(xscale="log", ylim=(0, 1), xlabel="projected change [noise units], class from")
    left.set_ylabel("named and placed rightly [share]")
    left.legend(frameon=False)
    right.plot([0, 1], [0, 1], color="#9aa2ab", lw=1)
    right.set(xlim=(0, 1), ylim=(0, 1), xlabel="stated probability", ylabel="right [share]")
    return figure


def _shares(axes: Any, places: Sequence[float], shares: Sequence[Mapping], color: str) -> None:
    values = [one["share"] for one in shares]
    below = [one["share"] - one["low"] for one in shares]
    above = [one["high"] - one["share"] for one in shares]
    axes.errorbar(places, values, yerr=[below, above], fmt="o-", color=color, capsize=3)


def _curves(result: Mapping[str, Any]) -> dict[str, Any]:
    caption = (
        "Left: single effects by what they change beyond free constants and nuisances; all should "
        "rise to one. Right: named causes by the probability stated; they should lie on the line. "
        "Bars are intervals of 95 %."
    )
    drawn = _drawn(power_figure(result), "Power and calibration", caption)
    return _section("How strong an effect must be, and how sure a verdict is", drawn=[drawn])


FAILURE_HEAD = ("Case", "Hidden", "Said", "What became of it", "Change [noise units]", "Noise")


def _failures(rows: Sequence[Mapping[str, Any]], bench: str) -> dict[str, Any]:
    """Every case that was not answered rightly, those that nobody could have told among them."""
    found = []
    for row in rows:
        if row["bench"] != bench or outcome(row) in GOOD:
            continue
        power = row["power"] or {}
        norm = power.get("projected_norm")
        size = "" if norm is None else f"{norm:.0f}" + ("" if power["detectable"] else ", too weak")
        why = row.get("fault") or outcome(row)
        names = [_in_words(one) for one in (asked(row), answered(row))]
        found.append((f"{bench} {row['seed']}", *names, why, size, row["noise"]))
    words = (
        "Too weak: beyond what constants and nuisances that are free anyway take in, the effect "
        "changes less than 10 noise units, or less than 2 % of the records' norm."
    )
    if not found:
        return _section(f"Not answered rightly, bench {bench}", "None.")
    title = f"Not answered rightly, bench {bench}: {len(found)}"
    return _section(title, words, head=FAILURE_HEAD, rows=found, left=4)


def _said(confusion: Mapping[str, Mapping[str, int]], bench: str) -> dict[str, Any]:
    rows = []
    for truth, said in confusion.items():
        ordered = sorted(said.items(), key=lambda pair: -pair[1])
        words = "; ".join(f"{count} {_in_words(name)}" for name, count in ordered)
        rows.append((_in_words(truth), words))
    head = ("Hidden", "Said, with how often")
    return _section(
        f"What was hidden and what was said, bench {bench}", head=head, rows=rows, left=2
    )


def _in_words(pairs: str) -> str:
    """`place/law` pairs, joined by a plus, as a reader would say them."""
    mark, _, rest = pairs.rpartition(": ")
    parts = [part.split("/") for part in rest.split(" + ")]
    words = [f"{law_words(p[1])} ({p[0]})" if len(p) == 2 else p[0] for p in parts]
    return (f"{mark}: " if mark else "") + " + ".join(words)
