"""What a study is, and where the studies of the house are found."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .engine import Progress

MARK = "\nSTUDY = Study("
"""A file under ``studies/`` that holds this line defines a study."""


@dataclass(frozen=True)
class Call:
    """What whoever runs a study says.

    Attributes:
        out: folder for what the study writes; None where nothing is to be written.
        data: folder of measured records, for studies that need one; None for the usual place.
        seed: seed of everything that is drawn by chance.
        progress: told what is being done.
        cases: how many cases a study draws that draws any; None for its own choice.
    """

    out: Path | None = None
    data: Path | None = None
    seed: int = 0
    progress: Progress = lambda text: None
    cases: int | None = None


@dataclass(frozen=True)
class Study:
    """One question and how it is answered.

    Attributes:
        name: what it is called on the command line.
        question: the question, in one sentence.
        run: answers it, writes its files, and returns tables and numbers that JSON can hold.
        show: prints such an answer for a reader.
    """

    name: str
    question: str
    run: Callable[[Call], Mapping[str, Any]]
    show: Callable[[Mapping[str, Any]], None]


def studies() -> dict[str, Study]:
    """Every study of the house by name; a new one is one new file under ``studies/``."""
    here = Path(__file__).resolve()
    package = __name__.rpartition(".")[0]
    found: dict[str, Study] = {}
    for path in sorted(here.parent.rglob("*.py")):
        if path == here or MARK not in path.read_text(encoding="utf-8"):
            continue
        name = ".".join((package, *path.relative_to(here.parent).with_suffix("").parts))
        study = importlib.import_module(name).STUDY
        found[study.name] = study
    return dict(sorted(found.items()))


def study_named(name: str) -> Study:
    """The study of that name.

    Args:
        name: as ``supple study list`` prints it.

    Returns:
        The study.

    Raises:
        ValueError: where there is none of that name.
    """
    known = studies()
    if name not in known:
        raise ValueError(
            f"study: expected one of {', '.join(known)}, found '{name}'. "
            "Mend: see `supple study list`."
        )
    return known[name]


def show_studies(listed: Mapping[str, Any]) -> None:
    """Print the names of all studies, each with its question."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("study", no_wrap=True)
    table.add_column("question")
    for one in listed["studies"]:
        table.add_row(one["name"], one["question"])
    Console(highlight=False, markup=False).print(table)
