"""What of the thesis can be reproduced, what in part, what not, and why, on one page."""

from __future__ import annotations

import base64
import json
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..engine import write_together
from ..study import Call, Study, studies
from .table import (
    HEADINGS,
    IN_PART,
    NOT,
    REPRODUCED,
    RULE,
    VERDICTS,
    cells,
    counted,
    definitions,
    short,
)

NAME = "thesis/verdicts"
QUESTION = "What of the thesis can be reproduced, what in part, what not, and why?"
FOLDER, ERRATA = "thesis/", "thesis/errata"
TITLES = {REPRODUCED: "Reproduced", IN_PART: "Reproduced in part", NOT: "Not reproduced"}


def parts() -> dict[str, Study]:
    """The studies that are gathered here, by name."""
    return {n: one for n, one in studies().items() if n.startswith(FOLDER) and n != NAME}


def run(call: Call) -> dict[str, Any]:
    """Run every study of the thesis and gather the verdicts.

    Args:
        call: folder for the results, and progress.

    Returns:
        Verdicts by study, and how many of each in all; slips of the thesis are counted apart.
        ``verdicts.html`` shows them with every figure, ``verdicts.json`` holds the same.
    """
    from ... import __version__

    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as nowhere:
        found, pictures = {}, {}
        for name, study in parts().items():
            folder = Path(nowhere) if call.out is None else call.out / short(name)
            found[name] = study.run(replace(call, out=folder))
            pictures[name] = (folder / found[name]["figure"]["file"]).read_bytes()
    numbers = [row for name, one in found.items() if name != ERRATA for row in one["rows"]]
    slips = found[ERRATA]["rows"] if ERRATA in found else []
    result = {
        "question": QUESTION,
        "rule": RULE,
        "verdicts": counted([row["verdict"] for row in numbers]),
        "slips": counted([row["verdict"] for row in slips]),
        "studies": found,
        "provenance": {
            "version": __version__,
            "seed": call.seed,
            "seconds": round(time.perf_counter() - began, 1),
        },
    }
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_together(
        call.out,
        {
            "verdicts.json": lambda path: path.write_text(text, encoding="utf-8"),
            "verdicts.html": lambda path: _page(result, pictures, path),
        },
    )
    return result


def sentence(result: Mapping[str, Any]) -> str:
    """How many numbers and claims of the thesis have which verdict."""
    verdicts, slips = result["verdicts"], result["slips"]
    told = ", ".join(f"{verdicts[word]} {word}" for word in VERDICTS)
    checked = f"{slips[REPRODUCED]} confirmed, {slips[IN_PART]} in part, {slips[NOT]} not"
    return (
        f"Of {sum(verdicts.values())} numbers and claims of the thesis: {told}. "
        f"Of {sum(slips.values())} statements on its slips: {checked}."
    )


def _page(result: Mapping[str, Any], pictures: Mapping[str, bytes], path: Path) -> None:
    from ..report import write_page

    rows = [
        [short(name), *(str(one["verdicts"][word]) for word in VERDICTS)]
        for name, one in result["studies"].items()
    ]
    sections = [
        _section("How many", [RULE], ["study", *VERDICTS], rows, 1),
        *(_by_verdict(result, word) for word in (NOT, IN_PART, REPRODUCED)),
        *(_study(one, pictures[name]) for name, one in result["studies"].items()),
    ]
    page = {
        "title": "The thesis, reproduced",
        "status": "ambiguous" if result["verdicts"][NOT] else "adequate",
        "chip": f"{result['verdicts'][REPRODUCED]} of {sum(result['verdicts'].values())}",
        "sentence": sentence(result),
        "sections": sections,
        "version": result["provenance"]["version"],
    }
    write_page(page, path)


def _by_verdict(result: Mapping[str, Any], verdict: str) -> dict[str, Any]:
    """One section with all rows of a verdict, those on slips left out."""
    rows = [
        [short(name), *cells(row)]
        for name, one in result["studies"].items()
        if name != ERRATA
        for row in one["rows"]
        if row["verdict"] == verdict
    ]
    head = ["study", *HEADINGS]
    return _section(f"{TITLES[verdict]}: {len(rows)}", [], head, rows, len(head))


def _study(one: Mapping[str, Any], picture: bytes) -> dict[str, Any]:
    """One section with a study's whole table, figure and definitions."""
    image = "data:image/svg+xml;base64," + base64.b64encode(picture).decode("ascii")
    caption = one["figure"]["caption"]
    figure = {"image": image, "alt": caption, "title": short(one["study"]), "caption": caption}
    words = [one["question"], *definitions(one["rows"]), *one["notes"]]
    rows = [list(cells(row)) for row in one["rows"]]
    section = _section(one["study"], words, list(HEADINGS), rows, len(HEADINGS))
    return section | {"figures": [figure | {"narrow": False}]}


def _section(
    title: str, words: list[str], head: list[str], rows: list[list[str]], left: int
) -> dict[str, Any]:
    told = {"title": title, "words": words, "figures": [], "head": head, "rows": rows}
    return told | {"left": left}


def show(result: Mapping[str, Any]) -> None:
    """Print how many verdicts there are, and every row that is not reproduced."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    console.print(sentence(result))
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("study", *HEADINGS):
        table.add_column(heading)
    for name, one in result["studies"].items():
        for row in one["rows"]:
            if row["verdict"] == NOT:
                table.add_row(short(name), *cells(row))
    console.print(table)
    console.print(RULE)


STUDY = Study(NAME, QUESTION, run, show)
