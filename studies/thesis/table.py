"""Published beside ours: one row a number or claim, the verdict computed, and the study around."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..engine import start_engine, write_together
from ..listing import markdown, printed
from ..study import Call
from ..words import number_words
from .draw import Panel, drawn

REPRODUCED, IN_PART, NOT = "reproduced", "in part", "not"
VERDICTS = (REPRODUCED, IN_PART, NOT)

CLOSE, NEAR = 0.05, 0.20
"""Largest deviation that passes for reproduced, and for reproduced in part [-]."""

RULE = (
    f"A number within {100 * CLOSE:g} % is reproduced, within {100 * NEAR:g} % in part, beyond "
    "not. A claim is reproduced where the stated test of it holds. Where our input is fitted to "
    "the number itself, or made up, agreement counts in part at most."
)
HEADINGS = ("what", "published", "ours", "difference", "verdict")


@dataclass(frozen=True)
class Row:
    """One published number or claim with what the house's models make of it.

    Attributes:
        key: short name, unique in its study.
        what: the number or claim, in words.
        source: line or figure of the thesis.
        published: the number [see `unit`]; None for a claim.
        ours: our number [see `unit`]; None for a claim.
        unit: of both, as text.
        said: a claim in the thesis's sense.
        found: what we find instead of a number.
        holds: whether a claim's test holds; None for a number.
        definition: what exactly was computed, where the thesis leaves it open.
        why: the reason of a deviation.
        limit: why even agreement would count in part only.
        stated: deviation that an independent calculation found, where there is one [-].
    """

    key: str
    what: str
    source: str
    published: float | None = None
    ours: float | None = None
    unit: str = "1"
    said: str = ""
    found: str = ""
    holds: bool | None = None
    definition: str = ""
    why: str = ""
    limit: str = ""
    stated: float | None = None

    @property
    def deviation(self) -> float | None:
        """Ours over the published, less one [-]; None for a claim."""
        if self.published is None or self.ours is None:
            return None
        return self.ours / self.published - 1.0

    @property
    def verdict(self) -> str:
        """One of `VERDICTS`, from the deviation or the claim's test alone."""
        if self.deviation is None:
            plain = REPRODUCED if self.holds else NOT
        else:
            off = abs(self.deviation)
            plain = REPRODUCED if off <= CLOSE else IN_PART if off <= NEAR else NOT
        return IN_PART if self.limit and plain == REPRODUCED else plain

    def told(self) -> dict[str, Any]:
        """The row as JSON holds it."""
        kept = {name: value for name, value in vars(self).items() if value not in (None, "")}
        if self.deviation is not None:
            kept["deviation"] = self.deviation
        return kept | {"verdict": self.verdict}


def number(
    key: str, what: str, unit: str, published: float, ours: float, source: str, **more: Any
) -> Row:
    """A row of two numbers [unit as given]; `more` as for `Row`."""
    return Row(key, what, source, float(published), float(ours), unit, **more)


def claim(key: str, said: str, found: str, holds: Any, source: str, **more: Any) -> Row:
    """A row of a claim in words with the outcome of its test; `more` as for `Row`."""
    return Row(key, said, source, said=said, found=found, holds=bool(holds), **more)


@dataclass(frozen=True)
class Listed:
    """A further table of a study.

    Attributes:
        title: of the table.
        headings: of its columns.
        rows: cells as text with their units.
        words: below it, in sentences.
    """

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """What a study of the thesis found.

    Attributes:
        rows: the table.
        panels: the figure's.
        caption: of the figure.
        notes: what was assumed, in sentences.
        more: further entries of the result, as JSON can hold them.
        tables: further tables.
        figures: further figures, by what follows the study's name in theirs.
        files: further files of text, by name.
    """

    rows: tuple[Row, ...]
    panels: tuple[Panel, ...]
    caption: str
    notes: tuple[str, ...] = ()
    more: Mapping[str, Any] = field(default_factory=dict)
    tables: tuple[Listed, ...] = ()
    figures: Mapping[str, tuple[Panel, ...]] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


def answering(
    name: str, question: str, find: Callable[[], Found]
) -> Callable[[Call], dict[str, Any]]:
    """What runs a study: finds, judges, and writes its table, its JSON and its figure.

    Args:
        name: the study's, such as ``thesis/maps``.
        question: in one sentence.
        find: computes rows and panels.

    Returns:
        A function of a `Call`; its result holds ``rows``, ``verdicts`` and the figure's caption.
    """

    def run(call: Call) -> dict[str, Any]:
        from ... import __version__

        start_engine()
        call.progress(name)
        began = time.perf_counter()
        found = find()
        result = {
            "study": name,
            "question": question,
            "rule": RULE,
            "notes": list(found.notes),
            "rows": [row.told() for row in found.rows],
            "verdicts": counted([row.verdict for row in found.rows]),
            "figure": {"file": f"{short(name)}.svg", "caption": found.caption},
            **({"tables": [asdict(one) for one in found.tables]} if found.tables else {}),
            **found.more,
            "provenance": {
                "version": __version__,
                "seed": call.seed,
                "seconds": round(time.perf_counter() - began, 1),
            },
        }
        call.progress("")
        write_together(call.out, _writers(result, found))
        return result

    return run


def _writers(result: Mapping[str, Any], found: Found) -> dict[str, Callable[[Path], Any]]:
    base = short(result["study"])
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    texts = {f"{base}.json": text, f"{base}.md": as_text(result), **found.files}
    figures = {f"{base}.svg": found.panels}
    figures |= {f"{base}_{name}.svg": panels for name, panels in found.figures.items()}
    writers: dict[str, Callable[[Path], Any]] = {
        file: lambda path: path.write_text(texts[path.name], encoding="utf-8") for file in texts
    }
    for file in figures:
        writers[file] = lambda path: path.write_bytes(drawn(figures[path.name]))
    return writers


def short(name: str) -> str:
    """A study's name without its folder, as its files are called."""
    return name.rpartition("/")[2]


def counted(verdicts: Sequence[str]) -> dict[str, int]:
    """How many rows have each verdict [-]."""
    return {word: verdicts.count(word) for word in VERDICTS}


def cells(row: Mapping[str, Any]) -> tuple[str, str, str, str, str]:
    """A row's cells under `HEADINGS`, with source and reason."""
    what = f"{row['what']} ({row['source']})"
    why = " ".join(row[key] for key in ("why", "limit") if row.get(key))
    verdict = row["verdict"] + (f": {why}" if why and row["verdict"] != REPRODUCED else "")
    if "deviation" not in row:
        return what, "claimed", row["found"], "–", verdict
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    published, ours = (f"{number_words(row[key])}{unit}" for key in ("published", "ours"))
    return what, published, ours, f"{100 * row['deviation']:+.1f} %", verdict


def definitions(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What was computed where the thesis leaves it open, one sentence a row."""
    return [f"{row['what']}: {row['definition']}" for row in rows if row.get("definition")]


def as_text(result: Mapping[str, Any]) -> str:
    """A study's table, definitions and notes as Markdown."""
    table = markdown(HEADINGS, [cells(row) for row in result["rows"]])
    figure = result["figure"]
    below = [f"![{figure['caption']}]({figure['file']})", "", figure["caption"], ""]
    below += ["## Definitions", *(f"- {line}" for line in definitions(result["rows"]))]
    below += [f"- {line}" for line in (*result["notes"], result["rule"])]
    for one in result.get("tables", ()):
        below += ["", f"## {one['title']}", "", *markdown(one["headings"], one["rows"]), ""]
        below += [f"- {line}" for line in one["words"]]
    return "\n".join([f"# {result['question']}", "", *table, "", *below]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print a study's table, definitions and notes."""
    rows = [cells(row) for row in result["rows"]]
    below = (*definitions(result["rows"]), *result["notes"], result["rule"])
    printed(result["question"], HEADINGS, rows, [f"  - {line}" for line in below])
    for one in result.get("tables", ()):
        words = [f"  - {line}" for line in one["words"]]
        printed(one["title"], one["headings"], one["rows"], words)
