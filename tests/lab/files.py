"""Writes what a lab would hand over: CSV, sidecar and rig; the truth goes to a sealed folder."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_text(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_text(item) for item in value) + "]"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, int):
        return str(value)
    text = f"{float(str(value)):.9g}"
    return text if any(mark in text for mark in ".en") else text + ".0"


def toml_table(name: str, entries: dict[str, object]) -> str:
    """One TOML table with its entries, one a line."""
    return "\n".join([f"[{name}]", *(f"{key} = {_text(item)}" for key, item in entries.items())])


def write_rig(path: Path, tables: dict[str, dict[str, object]]) -> Path:
    """Writes rig.toml from its tables."""
    text = "\n\n".join(toml_table(name, entries) for name, entries in tables.items())
    path.write_text(text + "\n", encoding="utf-8")
    return path


def write_record(
    folder: Path,
    name: str,
    rate: float,
    columns: dict[str, np.ndarray],
    tables: dict[str, dict[str, object]],
    digits: int = 8,
) -> Path:
    """Writes NAME.csv (time first) and NAME.toml; returns the sidecar's path."""
    count = len(next(iter(columns.values())))
    table = np.column_stack([np.arange(count) / rate, *columns.values()])
    layout = ["%.10g"] + [f"%.{digits}g"] * len(columns)
    header = ",".join(["time", *columns])
    np.savetxt(folder / f"{name}.csv", table, fmt=layout, delimiter=",", header=header, comments="")
    text = "\n\n".join(toml_table(key, entries) for key, entries in tables.items())
    path = folder / f"{name}.toml"
    path.write_text(text + "\n", encoding="utf-8")
    return path


def seal(folder: Path, truth: dict) -> Path:
    """Writes the truth where nothing that is tested may look."""
    (folder / "sealed").mkdir(exist_ok=True)
    path = folder / "sealed" / "truth.json"
    path.write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    return path
