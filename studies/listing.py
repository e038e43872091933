"""A study's table, as Markdown and on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown; cells are text with their units [-]."""
    whole = [headings, ("---",) * len(headings), *rows]
    return ["| " + " | ".join(row) + " |" for row in whole]


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
