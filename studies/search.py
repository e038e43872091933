"""Which designs are best, where a grid would be too large? Drawn by optuna, simulated exactly."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import start_engine, write_together

if TYPE_CHECKING:
    from ..optimize.search import Search, SearchTask
    from ..optimize.search_spec import SearchSpec
    from .sweep import Asked

MOST_SHOWN = 12
"""Designs of a Pareto front that are printed [-]; the file holds all."""


def search_spec(
    path: Path,
    out: Path | None = None,
    seed: int = 0,
    storage: str | None = None,
    trials: int | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> tuple[dict[str, Any], bool]:
    """Searches for the best designs and writes ``search.json`` and ``report.html``.

    The same command goes on where an earlier one stopped, and several may share a storage.

    Args:
        path: the spec.
        out: folder for the results; a storage's relative file lies there, or where the command
            runs if None.
        seed: of everything that is drawn by chance.
        storage: instead of the spec's.
        trials: instead of the spec's.
        tell: hears how many designs of how many are done.

    Returns:
        A summary that JSON can hold, and whether a design was found that keeps all limits.

    Raises:
        ValueError: for the first fault of the spec, the rig, the drive, a catalogue or the storage.
    """
    began = time.perf_counter()
    start_engine()
    from dataclasses import replace

    from ..model.door import fault
    from ..model.rig import read_rig
    from ..optimize.search_spec import axes_for, dimensions_of, read_search, sums_of
    from .sweep import asked_of

    spec = read_search(path)
    if storage is not None:
        spec = replace(spec, storage=storage)
    if trials is not None:
        if trials < 1:
            raise fault(path, "--trials", "at least 1", str(trials), "raise it")
        spec = replace(spec, trials=trials)
    rig = read_rig(spec.sweep.rig)
    ranges, choices = dimensions_of(spec, rig)
    asked = asked_of(spec.sweep, rig, axes_for(ranges, choices), spec.scores)
    from ..optimize.search import SearchTask, search

    task = SearchTask(
        asked.task, ranges, choices, tuple(spec.objectives.items()), spec.limits,
        spec.sampler, spec.trials, spec.batch, spec.ahead, seed,
    )  # fmt: skip
    sums = {**asked.inputs(), **sums_of(spec)}
    told = {name: one for name, one in sums.items() if name != str(path)}
    try:
        found = search(task, _resolved(spec.storage, out), spec.study, told, tell)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    result = _result(spec, asked, found)
    provenance = asked.provenance(seed) | {"inputs": sums}
    seconds = round(time.perf_counter() - began, 3)
    result["provenance"] = {**provenance, "resumed": found.resumed, "seconds": seconds}
    if out is not None:
        _write(out, result, task, found)
    return result, result["status"] == "searched"


def _resolved(storage: str, out: Path | None) -> str:
    """A storage whose relative file lies in the folder for the results."""
    if out is None:
        return storage
    for begin in ("sqlite:///", "journal:"):
        file = storage.removeprefix(begin)
        if storage.startswith(begin) and file not in ("", ":memory:"):
            return f"{begin}{out / file}"
    return storage


def _result(spec: SearchSpec, asked: Asked, found: Search) -> dict[str, Any]:
    """The search in words and numbers that JSON can hold."""
    import numpy as np

    from ..optimize.sweep_file import LONG_NAMES, unit_of

    task = found.task
    front = [_design(found, at) for at in found.front]
    n_told = int(np.isfinite(found.losses).all(axis=1).sum())
    scores = {
        name: {"unit": unit_of(name, asked.unit), "meaning": LONG_NAMES[name]}
        for name in task.sweep.scores
    }
    ranges: dict[str, Any] = {
        one.name: {"unit": one.unit, "low": one.low, "high": one.high, "log": one.is_log}
        for one in task.ranges
    }
    choices = {
        one.name: {"parts": list(one.parts), "units": dict(one.units)} for one in task.choices
    }
    return {
        "status": "searched" if front else "infeasible",
        "rig": asked.rig.path.name,
        "drive": {"kind": asked.drive.kind, "place": asked.drive.place},
        "of": asked.spec.of,
        "window": list(task.sweep.window),
        "sampler": task.sampler,
        "batch": task.batch,
        "study": spec.study,
        "axes": ranges,
        "choices": choices,
        "scores": scores,
        "objectives": dict(task.objectives),
        "constraints": {
            one.score: {k: v for k, v in (("min", one.low), ("max", one.high)) if v is not None}
            for one in task.limits
        },
        "trials": {
            "done": len(found.draws),
            "usable": int(found.usable.sum()),
            "beyond_limits": int(np.sum(found.excess > 0)),
            "without_score": len(found.draws) - n_told,
        },
        "best": front[0] if len(task.objectives) == 1 and front else None,
        "front": front,
        "importances": found.importances,
    }


def _design(found: Search, at: int) -> dict[str, Any]:
    """One design: the rig's numbers, the parts that they come from, and its scores."""
    import numpy as np

    parts = {one.name: str(found.draws[at][one.name]) for one in found.task.choices}
    values = {name: float(values[at]) for name, values in found.scores.items()}
    return {
        "trial": at,
        "design": {name: float(values[at]) for name, values in found.numbers.items()},
        "parts": parts,
        "scores": {name: v if np.isfinite(v) else None for name, v in values.items()},
    }


def _write(out: Path, result: Mapping[str, Any], task: SearchTask, found: Search) -> None:
    from .search_report import write_search_report

    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_together(
        out,
        {
            "search.json": lambda path: path.write_text(text, encoding="utf-8"),
            "report.html": lambda path: write_search_report(result, found, path),
        },
    )


def show_search(result: Mapping[str, Any]) -> None:
    """Prints the best design, or the Pareto front, as a table.

    Args:
        result: of `search_spec`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    trials, resumed = result["trials"], result["provenance"]["resumed"]
    console.print(
        f"{trials['done']} designs of {result['rig']} by '{result['sampler']}', scored by "
        f"{result['of']}; {trials['usable']} can be used."
    )
    if resumed:
        console.print(f"Taken up: {resumed} designs.")
    front = result["front"]
    if not front:
        console.print("! No design keeps all limits: widen an axis, or loosen a limit.")
        return
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in front[0]["scores"]:
        table.add_column(f"{name} [{result['scores'][name]['unit']}]", justify="right")
    table.add_column("design")
    for one in front[:: max(1, -(-len(front) // MOST_SHOWN))]:
        values = ["–" if v is None else f"{v:.5g}" for v in one["scores"].values()]
        design = [f"{name} {value:.5g}" for name, value in one["design"].items()]
        own = [part for name, part in one["parts"].items() if name not in one["design"]]
        table.add_row(*values, ", ".join([*own, *design]))
    console.print(table)
    for name, shares in result["importances"].items():
        told = ", ".join(f"{one} {100 * share:.0f} %" for one, share in shares.items())
        console.print(f"What changes {name} most: {told}.")
