"""Do two instruments agree? The thesis's averages a golfer, and pairs of readings of a lab."""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .engine import start_engine, write_together
from .listing import markdown, printed
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..identification.instrument_file import Pairs
    from ..identification.instruments import Agreement, Averages, Limits, Outlier
    from .thesis.draw import Panel

NAME = "agreement"
QUESTION = "Do two instruments agree: sticker, radar and markers?"
HEADINGS = ("what", "whose", "pairs", "bias", "95 % of differences", "typical size", "verdict")
NOTES = (
    "Limits of agreement after Bland and Altman: 95 % of the differences of single swings lie "
    "within them. Brackets are intervals of 95 % confidence.",
    "The thesis prints one average a golfer, without signs: neither bias nor limits of single "
    "swings follow from it. Its rows tell how far golfers' averages scatter, and within which "
    "single swings would lie without a bias and with normal errors.",
    "A golfer is unlike the others where the logarithm of his typical difference stands out by "
    "Rosner's test on the upper side; chance accuses one study in twenty.",
)
TOO_FEW = "too few to tell"
_SHOWN = {"m": ("mm", 1e3), "rad": ("deg", 180.0 / np.pi)}


def run(call: Call) -> dict[str, Any]:
    """Compare the thesis's instruments, and those of each table in a folder.

    Args:
        call: who asks; ``data`` is a folder of tables with the columns ``subject`` and
            ``QUANTITY:INSTRUMENT [unit]``, two instruments a quantity. Nothing is drawn by chance.

    Returns:
        Published averages and measured pairs, each with bias, limits, outliers and a sentence.

    Raises:
        ValueError: in the words of the door.
    """
    from .. import __version__

    start_engine()
    began, inputs = time.perf_counter(), dict[str, str]()
    published, panels = [], []
    for name, table in _tables().items():
        told, panel = _published(name, table)
        published.append(told)
        panels.append(panel)
    measured = []
    for pairs in _measured(call.data, inputs):
        call.progress(f"{pairs.path.name}: {pairs.quantity}")
        told, panel = _compared(pairs)
        measured.append(told)
        panels.append(panel)
    call.progress("")
    result = {
        "study": NAME,
        "question": QUESTION,
        "published": published,
        "measured": measured,
        "sentences": [one["sentence"] for one in (*published, *measured)],
        "notes": list(NOTES),
        "figure": f"{NAME}.svg",
        "provenance": {
            "version": __version__,
            "inputs": inputs,
            "seed": call.seed,
            "seconds": round(time.perf_counter() - began, 1),
        },
    }
    _write(result, panels, call.out)
    return result


def _tables() -> dict[str, Any]:
    data = files("supple.studies") / "data" / "agreement" / "thesis.toml"
    return tomllib.loads(data.read_text(encoding="utf-8"))


def _measured(folder: Path | None, inputs: dict[str, str]) -> list[Pairs]:
    from ..identification.instrument_file import read_pairs
    from ..model.door import fault

    if folder is None:
        return []
    found = sorted(path for path in folder.glob("*") if path.suffix.lower() in (".csv", ".txt"))
    if not found:
        what = "no table in it" if folder.is_dir() else "no folder of that name"
        raise fault(folder, "--data", "a folder with tables of readings", what, "name another")
    return [pairs for path in found for pairs in read_pairs(path, inputs)]


def _published(name: str, table: Mapping[str, Any]) -> tuple[dict[str, Any], Panel]:
    from ..identification.instruments import averages
    from ..identification.units import conversion
    from .thesis.draw import Curve, Panel

    quantity = "position" if table["unit"] == "mm" else "angle"
    unit = conversion(table["unit"], quantity)
    sizes = {str(k + 1): unit.factor * each for k, each in enumerate(table["averages"])}
    found = averages(sizes, table["kind"] == "distance")
    word, scale = _SHOWN[unit.unit]
    golfers, ends = np.arange(1, len(sizes) + 1), np.array([1.0, len(sizes)])
    kept = found.without or found
    names = ", ".join(f"golfer {one.subject}" for one in found.outliers)
    lines = [(kept.mean.value, "mean"), (kept.upper, "limits of golfers"), (kept.lower, "")]
    curves = (
        Curve(golfers, scale * np.array([*sizes.values()]), "average of a golfer", is_marks=True),
        *(Curve(ends, scale * np.full(2, level), label) for level, label in lines),
    )
    title = table["title"] + (f"; without {names}" if names else "")
    panel = Panel(title, "golfer [-]", f"average difference [{word}]", curves)
    return {
        "name": name,
        "title": table["title"],
        "source": table["source"],
        "unit": unit.unit,
        **_averages(found),
        "sentence": f"{table['title']}: {_averages_words(found, word, scale)}",
    }, panel


def _averages(found: Averages) -> dict[str, Any]:
    return {
        "mean": vars(found.mean),
        "limits_of_golfers": [found.lower, found.upper],
        "single_swings_within": found.single,
        "outliers": [vars(one) for one in found.outliers],
        "outliers_tested": found.is_tested,
        "count": found.count,
        "without": None if found.without is None else _averages(found.without),
    }


def _averages_words(found: Averages, word: str, scale: float) -> str:
    kept = found.without or found
    whose = _left_out(found.outliers)
    text = (
        f"{_span(kept.mean, scale)} {word} on average{whose}; golfers' averages lie between "
        f"{number_words(scale * kept.lower, 2)} and "
        f"{number_words(scale * kept.upper, 2)} {word}"
    )
    if found.without:
        text += f" (with all {found.count}: {number_words(scale * found.mean.value, 3)} {word})"
    return text + _strange(found, found.count, word, scale) + "."


def _left_out(found: tuple[Outlier, ...]) -> str:
    """What numbers without those who stand out are called."""
    return f" without {_named(found)}" if found else ""


def _named(found: tuple[Outlier, ...]) -> str:
    names = " and ".join(one.subject for one in found)
    return f"golfer{'s' if len(found) > 1 else ''} {names}"


def _strange(all_told: Averages | Agreement, count: int, word: str, scale: float) -> str:
    """Who stands out; that nobody does is said only where it could have been seen."""
    from ..identification.instruments import FEWEST_ALIKE

    found = all_told.outliers
    if not all_told.is_tested:
        golfers = "golfer is" if count == 1 else "golfers are"
        least = f"{FEWEST_ALIKE} at least"
        return f"; {count} {golfers} too few to tell whether one stands out ({least})"
    if not found:
        return "; no golfer stands out"
    told = [
        f"golfer {one.subject} ({number_words(scale * one.size, 3)} {word} against "
        f"{number_words(scale * one.others, 3)} of the others)"
        for one in found
    ]
    return f", but for {' and '.join(told)}, who {'stands' if len(told) == 1 else 'stand'} out"


def _compared(pairs: Pairs) -> tuple[dict[str, Any], Panel]:
    from ..identification.instruments import agreement
    from .thesis.draw import Curve, Panel

    try:
        found = agreement(pairs.subjects, pairs.first, pairs.second)
    except ValueError as error:
        raise ValueError(f"{pairs.path}: column '{pairs.quantity}': {error}") from None
    word, scale = _SHOWN.get(pairs.unit, (pairs.unit, 1.0))
    title = f"{pairs.quantity}: {pairs.instruments[0]} less {pairs.instruments[1]}"
    mean, difference = (pairs.first + pairs.second) / 2, pairs.first - pairs.second
    names = {one.subject for one in found.outliers}
    odd = np.array([one in names for one in pairs.subjects])
    kept, ends = found.without or found.overall, np.array([mean.min(), mean.max()])
    levels = [(kept.bias, "bias"), (kept.upper, "limits"), (kept.lower, "")]
    marks = [(~odd, "swings"), (odd, "of golfers who stand out")]
    curves = (
        *(Curve(scale * mean[m], scale * difference[m], label, is_marks=True)
          for m, label in marks if m.any()),
        *(Curve(scale * ends, scale * np.full(2, one.value), label) for one, label in levels),
    )  # fmt: skip
    return {
        "name": pairs.quantity,
        "title": title,
        "source": pairs.path.name,
        "unit": pairs.unit,
        "left_out": pairs.left_out,
        **_agreement(found),
        "sentence": f"{title}: {_agreement_words(found, word, scale)}",
    }, Panel(title, f"mean of both [{word}]", f"difference [{word}]", curves)


def _agreement(found: Agreement) -> dict[str, Any]:
    return {
        "overall": _limits(found.overall),
        "subjects": [_limits(one) for one in found.subjects],
        "sizes": found.sizes,
        "outliers": [vars(one) for one in found.outliers],
        "outliers_tested": found.is_tested,
        "without": None if found.without is None else _limits(found.without),
        "slope": None if np.isnan(found.slope) else found.slope,
        "slope_p_value": None if np.isnan(found.slope_p) else found.slope_p,
    }


def _limits(one: Limits) -> dict[str, Any]:
    told = {name: vars(getattr(one, name)) for name in ("bias", "lower", "upper")}
    return vars(one) | told


def _agreement_words(found: Agreement, word: str, scale: float) -> str:
    kept = found.without or found.overall
    whose = _left_out(found.outliers)
    text = (
        f"bias {_span(kept.bias, scale)} {word}{whose}; 95 % of the differences lie between "
        f"{_span(kept.lower, scale)} and {_span(kept.upper, scale)} {word}"
    )
    return text + _strange(found, len(found.sizes), word, scale) + "."


def _span(told: Any, scale: float) -> str:
    value, low, high = (number_words(scale * x, 3) for x in (told.value, told.low, told.high))
    return f"{value} [{low}, {high}]"


def _rows(result: Mapping[str, Any]) -> list[tuple[str, ...]]:
    rows = []
    for one in result["published"]:
        word, scale = _SHOWN[one["unit"]]
        names = ", ".join(each["subject"] for each in one["outliers"])
        verdict = f"golfer {names} stands out" if names else "all alike"
        parts = [(f"all {one['count']} golfers", one, verdict if _told(one) else TOO_FEW)]
        parts += [(f"without golfer {names}", one["without"], "")] if names else []
        for whose, each, word_of in parts:
            inside = f"within {number_words(scale * each['single_swings_within'], 3)} {word}"
            size = f"{number_words(scale * each['mean']['value'], 3)} {word}"
            what = f"{one['title']} ({one['source']})"
            rows.append((what, whose, "–", "–", f"{inside} by averages", size, word_of))
    for one in result["measured"]:
        word, scale = _SHOWN.get(one["unit"], (one["unit"], 1.0))
        names = {each["subject"] for each in one["outliers"]}
        parts = [("all", one["overall"])]
        parts += [("without those who stand out", one["without"])] if one["without"] else []
        parts += [(each["subject"], each) for each in one["subjects"]]
        for whose, each in parts:
            bias, lower, upper = (number_words(scale * each[name]["value"], 3)
                                  for name in ("bias", "lower", "upper"))  # fmt: skip
            size = one["sizes"].get(whose)
            verdict = "stands out" if whose in names else ""
            rows.append((
                one["title"], whose, str(each["count"]), f"{bias} {word}",
                f"{lower} to {upper} {word}",
                "–" if size is None else f"{number_words(scale * size, 3)} {word}",
                TOO_FEW if whose == "all" and not _told(one) else verdict,
            ))  # fmt: skip
    return rows


def _told(one: Mapping[str, Any]) -> bool:
    return one["outliers_tested"]


def _write(result: Mapping[str, Any], panels: list[Panel], out: Path | None) -> None:
    from .thesis.draw import drawn

    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    writers = {
        f"{NAME}.json": lambda path: path.write_text(text, encoding="utf-8"),
        f"{NAME}.md": lambda path: path.write_text(as_text(result), encoding="utf-8"),
        f"{NAME}.svg": lambda path: path.write_bytes(drawn(panels)),
    }
    write_together(out, writers)


def as_text(result: Mapping[str, Any]) -> str:
    """The table, the sentences and the notes as Markdown."""
    table = markdown(HEADINGS, _rows(result))
    below = [f"![{result['question']}]({result['figure']})", ""]
    below += [f"- {line}" for line in (*result["sentences"], *result["notes"])]
    return "\n".join([f"# {result['question']}", "", *table, "", *below]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the table, the sentences and the notes."""
    lines = [*result["sentences"], *(f"  - {note}" for note in result["notes"])]
    printed(result["question"], HEADINGS, _rows(result), lines)


STUDY = Study(NAME, QUESTION, run, show)
