"""What is in these records? Reads, checks and describes them, and fits nothing."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..identification.modal_table import ModalTable
    from ..identification.records import Record
    from ..model.rig import Rig


def check_records(paths: Sequence[Path], rig: Path | None = None, seed: int = 0) -> dict[str, Any]:
    """Reads records and their rigs, and describes each.

    Args:
        paths: sidecars.
        rig: a rig that overrides the sidecars'.
        seed: kept in the provenance; nothing here is drawn by chance.

    Returns:
        ``records``, as `describe` gives them, ``preflight`` with what speaks against a fit of
        those that share a rig with free numbers, ``provenance``, and ``tables`` of modes if any.

    Raises:
        ValueError: for the first fault of any record or rig.
    """
    from .. import __version__
    from ..identification.describe import describe
    from ..identification.modal_table import is_modal, read_modal
    from ..identification.records import check_record_against_rig, read_record
    from ..model.rig import read_rig

    began = time.perf_counter()
    rigs: dict[Path, Rig] = {}
    together: dict[Path, list[Record]] = {}
    described, tables, inputs = [], [], {}
    for path in paths:
        if is_modal(path):
            table = read_modal(path, rig)
            tables.append(_table(table))
            inputs |= table.files
            continue
        record = read_record(path, rig)
        if record.rig_path is not None:
            if record.rig_path not in rigs:
                rigs[record.rig_path] = read_rig(record.rig_path)
            check_record_against_rig(record, rigs[record.rig_path])
            together.setdefault(record.rig_path, []).append(record)
            inputs[str(record.rig_path)] = rigs[record.rig_path].sha256
        inputs |= record.files
        described.append(describe(record))
    remarks = [r for path, records in together.items() for r in _remarks(records, rigs[path])]
    seconds = round(time.perf_counter() - began, 3)
    provenance = {"version": __version__, "inputs": inputs, "seed": seed, "seconds": seconds}
    result = {"records": described, "preflight": remarks, "provenance": provenance}
    return result | ({"tables": tables} if tables else {})


def _table(table: ModalTable) -> dict[str, Any]:
    modes = [asdict(mode) for mode in table.modes]
    return {"name": table.name, "description": table.description, "modes": modes}


def _remarks(records: Sequence[Record], rig: Rig) -> list[dict[str, Any]]:
    """What the pre-flight of a fit says; what stops it earlier is a refusal too."""
    from ..identification.preflight import preflight, remarks_json
    from ..identification.problem import make_problem
    from .engine import start_engine

    if not any(number.free for number in rig.parameters.values()):
        return []
    start_engine()
    try:
        return remarks_json(preflight(make_problem(records, rig)))
    except ValueError as error:
        return [{"check": "rig", "refuses": True, "text": str(error)}]


def show_check(result: Mapping[str, Any]) -> None:
    """Prints the descriptions as a table, and the warnings under it.

    Args:
        result: of `check_records`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    for record in result["records"]:
        console.print(_facts(record))
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
        table.add_column("channel", no_wrap=True)
        table.add_column("what")
        for column in ("span", "main", "noise", "step"):
            table.add_column(column, justify="right", no_wrap=True)
        for name, seen in record["channels"].items():
            table.add_row(*_row(name, seen))
        console.print(table)
        for warning in record["warnings"]:
            console.print(f"! {warning}")
        console.print("" if record["warnings"] else "Nothing deserves a second look.\n")
    for table in result.get("tables", []):
        console.print(
            f"{table['name']} (modal): {len(table['modes'])} modes. {table['description']}"
        )
        for mode in table["modes"]:
            console.print(
                f"  {mode['condition']}: {mode['frequency']:.4g} ± {mode['frequency_std']:.2g} Hz, "
                f"damping ratio {mode['damping_ratio']:.3g} ± {mode['damping_ratio_std']:.2g}"
            )
    for remark in result["preflight"]:
        console.print(
            f"{'A fit would be refused: ' if remark['refuses'] else '! '}{remark['text']}"
        )


def _row(name: str, seen: Mapping[str, Any]) -> tuple[str, ...]:
    role = " (input)" if seen["role"] == "input" else ""
    return (
        name,
        f"{seen['quantity'].replace('_', ' ')} of {seen['place']}{role}",
        _number(seen["span"], seen["unit"]),
        _number(seen["dominant_frequency"], "Hz"),
        _number(seen["noise_estimate"], seen["unit"]),
        _number(seen["quantization_step"], seen["unit"]),
    )


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if unit == "1" else f"{value:.3g} {unit}"


def _facts(record: Mapping[str, Any]) -> str:
    rig = "no rig" if record["rig"] is None else f"rig {Path(record['rig']).name}"
    samples = f"{record['n_samples']} samples at {record['sample_rate']:.6g} Hz"
    facts = [f"{samples}, {record['duration']:.4g} s", rig]
    facts += [f"{name} = {value:g}" for name, value in record["parameters"].items()]
    facts += [f"start {name} = {value:g}" for name, value in record["start"].items()]
    return f"{record['name']} ({record['test']}, {record['split']}): {', '.join(facts)}"
