"""Which constants do these records ask for, and how sure? Fits the rig and reports."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
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
    posterior: bool = False,
    steps: int | None = None,
) -> tuple[dict[str, Any], bool]:
    """Fit the free constants of a rig to records.

    Args:
        paths: sidecars, of modal tables too; those with ``split = "held_out"`` are left out
            where others remain.
        rig: a rig that overrides the sidecars'.
        out: folder for fit.json, rig.toml and report.html, and for posterior.nc.
        seed: of the posterior's draws; nothing else here is drawn by chance.
        progress: told what is being done.
        posterior: whether to sample the posterior too.
        steps: the most that each of its ensembles may take; None for the usual number.

    Returns:
        The contract's ``fit.json`` and whether it is to be trusted.

    Raises:
        ValueError: in the words of the door, or of the pre-flight where no fit can work.
    """
    from ..identification.modal_table import is_modal
    from .modal import identify_tables

    tables = [path for path in paths if is_modal(path)]
    if tables and posterior:
        raise ValueError(
            f"{tables[0].name}: --posterior: expected records against time, found a modal table. "
            "Mend: leave --posterior out; errors of modal tables are normal."
        )
    if tables and len(tables) == len(paths):
        return identify_tables(tables, rig, out, seed)
    inputs = read_inputs([path for path in paths if path not in tables], rig)
    from ..identification.base import fit_base
    from ..identification.constants import fit_json
    from ..identification.preflight import preflight, remarks_json, require_ready
    from ..identification.problem import make_problem
    from ..identification.views import record_views
    from ..identification.weighing import with_laws
    from ..model.door import write_beside
    from ..model.rig import write_rig
    from .posterior import drop_checkpoint, posterior_section, sample_fit

    records = [r for r in inputs.records if r.split != "held_out"] or inputs.records
    problem = make_problem(records, inputs.rig)
    progress("looking at the records")
    remarks = preflight(problem)
    require_ready(remarks)
    progress("fitting")
    fit = with_laws(fit_base(problem))
    progress("")
    drawn = sample_fit(fit, out, seed, steps, progress) if posterior else None
    result: dict[str, Any] = fit_json(fit, inputs.provenance(seed))
    result |= {"preflight": remarks_json(remarks)}
    if tables:
        return identify_tables(tables, inputs.rig.path, out, seed, fit, result)
    if drawn is not None:
        from ..identification.agreement import posterior_json

        result["posterior"] = posterior_json(drawn)
    values = {e.keys[0]: fit.value(i) for i, e in enumerate(fit.model.entries) if not e.record}
    numbers = {
        name: number.at(values[name]) if name in values and number.varies else number
        for name, number in problem.rig.parameters.items()
    }
    fitted = replace(inputs.rig, parameters=numbers)

    def report(path: Path) -> None:
        from .report import write_fit_report

        places = list(fit.problem.mechanism.law_places())
        views = record_views(fit, fit, places[0], "train")
        section = None if drawn is None else posterior_section(drawn, result["posterior"])
        write_fit_report(result, views, path, section)

    def table(path: Path) -> None:
        write_beside(path, _text(result))

    writers: dict[str, Callable[[Path], Any]] = {
        "fit.json": table,
        "rig.toml": lambda path: write_rig(fitted, path),
        "report.html": report,
    }
    if drawn is not None:
        from ..identification.sample_file import write_posterior

        told = {"inputs": json.dumps(inputs.files), "seed": str(seed)}
        writers["posterior.nc"] = lambda path: write_posterior(drawn, path, told)
    write_together(out, writers)
    if drawn is not None and drawn.converged:
        drop_checkpoint(out)
    return result, fit.converged and (drawn is None or drawn.converged)


def _text(result: Mapping[str, Any]) -> str:
    return json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def show_fit(result: Mapping[str, Any]) -> None:
    """Print the constants as a table, and the verdict under it."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("constant", "value", "± std", "95 % interval", "unit", "identifiable"):
        side = "left" if heading in ("constant", "unit") else "right"
        table.add_column(heading, justify=side, overflow="fold")
    for name, one in result["parameters"].items():
        told = one["identifiable"]
        if one.get("partner"):
            told += f" with {one['partner']}"
        interval = f"{one['low']:.5g} to {one['high']:.5g}"
        table.add_row(name, f"{one['value']:.6g}", f"{one['std']:.2g}", interval, one["unit"], told)
    console.print(table)
    if "modes" in result:
        from .modal import show_modes

        show_modes(result["modes"])
    for remark in result.get("preflight", []):
        console.print(f"! {remark['text']}")
    if result.get("clamped"):
        from ..identification.clamped import clamped_words

        for said in clamped_words(result["clamped"]):
            console.print(said)
    console.print(result["sentence"])
    console.print(f"{result['status']} Noise: {result['noise']['law']}.")
    if "posterior" in result:
        from .posterior import show_posterior

        show_posterior(result["posterior"])
