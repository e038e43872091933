"""Which constants do modal tables ask for, alone or joined with records? Fits and reports."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import start_engine, write_together

if TYPE_CHECKING:
    from ..identification.fit import Fit
    from ..identification.modal import ModalFit
    from ..identification.modal_table import ModalTable
    from ..model.rig import Rig


def identify_tables(
    paths: Sequence[Path],
    rig: Path | None = None,
    out: Path | None = None,
    seed: int = 0,
    fit: Fit | None = None,
    told: Mapping[str, Any] | None = None,
) -> tuple[dict[str, Any], bool]:
    """Fit the free constants of a rig to modal tables, and write what `identify_records` writes.

    Args:
        paths: sidecars with ``test = "modal"``.
        rig: a rig that overrides the sidecars'.
        out: folder for fit.json, rig.toml and report.html.
        seed: kept in the provenance; nothing here is drawn by chance.
        fit: of records against time that share the rig; its constants join as normal.
        told: that fit's ``fit.json``.

    Returns:
        The contract's ``fit.json``, with ``modes`` measured and fitted, and whether to trust it.

    Raises:
        ValueError: in the words of the door.
    """
    from .. import __version__
    from ..identification.modal import fit_modal, known_from, modal_json

    began = time.perf_counter()
    start_engine()
    tables, known_rig = read_tables(paths, rig)
    if fit is not None and known_rig.sha256 != fit.problem.rig.sha256:
        raise ValueError(
            f"{paths[0].name}: [record] rig: expected the rig of the other records, "
            f"{fit.problem.rig.path.name}, found {known_rig.path.name}. Mend: name one with --rig."
        )
    found = fit_modal(tables, known_rig, None if fit is None else known_from(fit))
    files = {str(known_rig.path): known_rig.sha256}
    for table in tables:
        files |= table.files
    seconds = round(time.perf_counter() - began, 3)
    provenance = {"version": __version__, "inputs": files, "seed": seed, "seconds": seconds}
    result = modal_json(found, provenance)
    if told is not None:
        result = _joined(told, result)
    trusted = found.converged and (fit is None or fit.converged)
    _write(result, found, out)
    return result, trusted


def read_tables(paths: Sequence[Path], rig: Path | None) -> tuple[list[ModalTable], Rig]:
    """Modal tables with the one rig that they share.

    Args:
        paths: sidecars.
        rig: a rig that overrides theirs.

    Returns:
        Tables and rig.

    Raises:
        ValueError: in the words of the door; also where tables name different rigs or none.
    """
    from ..identification.modal_table import check_table_against_rig, read_modal
    from ..model.rig import read_rig

    tables = [read_modal(path, rig) for path in paths]
    kept = [table for table in tables if table.split != "held_out"] or tables
    rigs = {table.rig_path for table in tables}
    path = rigs.pop() if len(rigs) == 1 else None
    if path is None:
        raise ValueError(
            f"{paths[0].name}: [record] rig: expected one rig for all tables, found "
            f"{len(rigs) or 'none'}. Mend: name it in the sidecars or with --rig."
        )
    known = read_rig(path)
    for table in tables:
        check_table_against_rig(table, known)
    return kept, known


def _joined(told: Mapping[str, Any], modal: Mapping[str, Any]) -> dict[str, Any]:
    """The records' result with the constants that tables and records ask for together."""
    inputs = told["provenance"]["inputs"] | modal["provenance"]["inputs"]
    return {
        **told,
        "sentence": modal["sentence"],
        "parameters": told["parameters"] | modal["parameters"],
        "modes": modal["modes"],
        "modal_misfit": modal["misfit"],
        "provenance": told["provenance"] | {"inputs": inputs},
    }


def _write(result: Mapping[str, Any], found: ModalFit, out: Path | None) -> None:
    from ..model.door import write_beside
    from ..model.rig import write_rig
    from .report import write_fit_report

    shared = {
        e.name: v for e, v in zip(found.entries, found.values, strict=True) if not e.condition
    }
    numbers = {
        name: number.at(float(shared[name])) if name in shared else number
        for name, number in found.rig.parameters.items()
    }
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_together(
        out,
        {
            "fit.json": lambda path: write_beside(path, text),
            "rig.toml": lambda path: write_rig(replace(found.rig, parameters=numbers), path),
            "report.html": lambda path: write_fit_report(result, [], path),
        },
    )


def show_modes(modes: Sequence[Mapping[str, Any]]) -> None:
    """Print each mode as measured and as fitted, in Hz and without unit [-]."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("condition", "measured [Hz]", "fitted", "damping ratio", "fitted"):
        table.add_column(heading, justify="left" if heading == "condition" else "right")
    for mode in modes:
        cells = []
        for name, form in (("frequency", ".4g"), ("damping_ratio", ".3g")):
            one = mode[name]
            cells += [f"{one['measured']:{form}} ± {one['std']:.2g}", f"{one['fitted']:{form}}"]
        table.add_row(mode["condition"], *cells)
    Console(highlight=False, markup=False).print(table)
