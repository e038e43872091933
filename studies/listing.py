"""A study's table, as Markdown and on the terminal."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .engine import write_together


def markdown(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown; cells are text with their units [-]."""
    whole = [headings, ("---",) * len(headings), *rows]
    return ["| " + " | ".join(row) + " |" for row in whole]


def written(
    name: str,
    found: Mapping[str, Any],
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    below: Iterable[str],
    out: Path | None,
) -> None:
    """Write what a study found as ``name.json`` and its table as ``name.md``, or nothing.

    Raises:
        ValueError: where the folder cannot be written to.
    """
    texts = {
        f"{name}.md": "\n".join([*markdown(headings, rows), "", *below, ""]),
        f"{name}.json": json.dumps(found, indent=2, allow_nan=False) + "\n",
    }
    write_together(
        out,
        {file: lambda path: path.write_text(texts[path.name], encoding="utf-8") for file in texts},
    )


def printed(
    title: str, headings: Sequence[str], rows: Iterable[Sequence[str]], below: Iterable[str] = ()
) -> None:
    """Print a table under its title, and lines below it; cells are text with units [-]."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    console.print(title)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in headings:
        table.add_column(heading)
    for row in rows:
        table.add_row(*row)
    console.print(table)
    for line in below:
        console.print(line)
