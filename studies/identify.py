"""Which constants do these records ask for, and how sure? Fits the rig and reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .engine import Progress, read_inputs, write_together


def identify_records(
    paths: Sequence[Path],
    rig: Path | None = None,
    out: Path | None = None,
    seed: int = 0,
    progress: Progress = lambda text: None,
) -> tuple[dict[str, Any], bool]:
    """Fit the free constants of a rig to records.

    Args:
        paths: sidecars; those with ``split = "held_out"`` are left out where others remain.
        rig: a rig that overrides the sidecars'.
        out: folder for fit.json, rig.toml and report.html.
        seed: kept in the provenance; nothing here is drawn by chance.
        progress: told what is being done.

    Returns:
        The contract's ``fit.json`` and whether it is to be trusted.

    Raises:
        ValueError: in the words of the door.
    """
    inputs = read_inputs(paths, rig)
    from ..identification.constants import fit_json
    from ..identification.fit import fit_base
    from ..identification.problem import make_problem
    from ..identification.views import record_views
    from ..model.door import write_beside
    from ..model.rig import write_rig

    records = [r for r in inputs.records if r.split != "held_out"] or inputs.records
    progress("fitting")
    fit = fit_base(make_problem(records, inputs.rig))
    progress("")
    result = fit_json(fit, inputs.provenance(seed))
    values = {e.keys[0]: fit.value(i) for i, e in enumerate(fit.model.entries) if not e.record}
    numbers = {
        name: number.at(values[name]) if name in values and number.varies else number
        for name, number in inputs.rig.parameters.items()
    }
    fitted = replace(inputs.rig, parameters=numbers)

    def report(path: Path) -> None:
        from .report import write_fit_report

        places = list(fit.problem.mechanism.law_places())
        write_fit_report(result, record_views(fit, fit, places[0], "train"), path)

    def table(path: Path) -> None:
        write_beside(path, _text(result))

    write_together(
        out,
        {
            "fit.json": table,
            "rig.toml": lambda path: write_rig(fitted, path),
            "report.html": report,
        },
    )
    return result, fit.converged


def _text(result: Mapping[str, Any]) -> str:
    import json

    return json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def show_fit(result: Mapping[str, Any]) -> None:
    """Print the constants as a table, and the verdict under it."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("constant", "value", "± std", "95 % interval", "unit", "identifiable"):
        table.add_column(heading, justify="left" if heading in ("constant", "unit") else "right")
    for name, one in result["parameters"].items():
        told = one["identifiable"]
        if one.get("partner"):
            told += f" with {one['partner']}"
        interval = f"{one['low']:.5g} to {one['high']:.5g}"
        table.add_row(name, f"{one['value']:.6g}", f"{one['std']:.2g}", interval, one["unit"], told)
    console.print(table)
    console.print(result["sentence"])
    console.print(f"{result['status']} Noise: {result['noise']['law']}.")
