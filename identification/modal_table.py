"""A modal table is what a lab often keeps alone: frequencies, damping ratios and their errors."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from ..model.door import fault, nearest, one_of, read_bytes, read_toml, sha256_of, validated
from ..model.rig import Rig
from .dialect import decoded
from .sidecar import RecordTable
from .tables import LARGEST_FILE

COLUMNS = ("condition", "frequency", "frequency_std", "damping_ratio", "damping_ratio_std")
"""Columns of a modal table, in Hz and without unit [-]."""


@dataclass(frozen=True)
class MeasuredMode:
    """One mode as a lab measured it.

    Attributes:
        condition: what the rig was like.
        order: which of the condition's modes it is, slowest first, from 0 [-].
        frequency: damped [Hz].
        frequency_std: its standard deviation [Hz].
        damping_ratio: [-].
        damping_ratio_std: its standard deviation [-].
    """

    condition: str
    order: int
    frequency: float
    frequency_std: float
    damping_ratio: float
    damping_ratio_std: float


@dataclass(frozen=True)
class ModalTable:
    """A table of modes.

    Attributes:
        name: the sidecar's stem.
        path: the sidecar.
        description: the sidecar's own.
        modes: its rows.
        numbers: what differed from the rig under each condition [SI], by the rig's names.
        split: train, held_out or auto.
        rig_path: its rig; None where none is named.
        files: every file read, with its SHA-256.
    """

    name: str
    path: Path
    description: str
    modes: tuple[MeasuredMode, ...]
    numbers: Mapping[str, Mapping[str, float]]
    split: str
    rig_path: Path | None
    files: dict[str, str]


class _ModalFile(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    record: RecordTable
    parameters: dict[str, float] = Field(default_factory=dict)
    conditions: dict[str, dict[str, float]] = Field(default_factory=dict)


def is_modal(path: Path | str) -> bool:
    """Whether a sidecar says ``test = "modal"``; False for whatever cannot be read."""
    path = Path(path)
    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        head = read_toml(path)[0].get("record")
    except ValueError:
        return False
    return isinstance(head, Mapping) and head.get("test") == "modal"


def read_modal(path: Path | str, rig: Path | str | None = None) -> ModalTable:
    """Reads a modal table: its sidecar and the CSV file that it names.

    The sidecar has ``[record]`` with ``test = "modal"``; ``[parameters]`` says what differed from
    the rig on that day, and ``[conditions.NAME]`` what differed under one condition alone.

    Args:
        path: the sidecar ``NAME.toml``.
        rig: a rig that overrides the sidecar's.

    Returns:
        The table, its frequencies in Hz.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    document, sha256 = read_toml(path)
    told = validated(_ModalFile, document, path)
    data = path.parent / (told.record.file or f"{path.stem}.csv")
    content = read_bytes(data, LARGEST_FILE, "name the table of modes")
    modes = _modes(decoded(content, data), data)
    names = list(dict.fromkeys(mode.condition for mode in modes))
    for name in told.conditions:
        if name not in names:
            mend = f"write '{nearest(name, names) or names[0]}'"
            expected = f"a condition of {data.name}: {one_of(names)}"
            raise fault(path, f"[conditions.{name}]", expected, f"'{name}'", mend)
    numbers = {name: told.parameters | told.conditions.get(name, {}) for name in names}
    rig_path = Path(rig) if rig is not None else None
    if rig_path is None and told.record.rig is not None:
        rig_path = path.parent / told.record.rig
    return ModalTable(
        path.stem, path, told.record.description, modes, numbers, told.record.split, rig_path,
        {str(path): sha256, str(data): sha256_of(content)},
    )  # fmt: skip


def _modes(text: str, path: Path) -> tuple[MeasuredMode, ...]:
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) < 2:
        raise fault(path, "", "a header and at least one mode", f"{len(lines)} lines", "add them")
    separator = max((",", ";", "\t"), key=lines[0].count)
    head, *body = csv.reader(lines, delimiter=separator)
    names = [name.split("[")[0].strip().lower() for name in head]
    for column in COLUMNS:
        if column not in names:
            expected = f"the columns {one_of(COLUMNS)}"
            raise fault(path, "header", expected, one_of(names), f"add '{column}'")
    rows = []
    for number, cells in enumerate(body, 2):
        if len(cells) != len(head):
            found = f"{len(cells)} cells"
            raise fault(path, f"line {number}", f"{len(head)} cells", found, "fill that line")
        row: dict[str, Any] = dict(zip(names, (cell.strip() for cell in cells), strict=True))
        values = {c: _number(row[c], c, number, path, separator) for c in COLUMNS[1:]}
        rows.append((row["condition"], values))
    ranked = sorted(rows, key=lambda one: one[1]["frequency"])
    return tuple(
        MeasuredMode(name, [v for n, v in ranked if n == name].index(values), **values)
        for name, values in rows
    )


def _number(text: str, column: str, line: int, path: Path, separator: str) -> float:
    try:
        value = float(text if separator == "," else text.replace(",", "."))
    except ValueError:
        value = math.nan
    zero = column == "damping_ratio"
    most = 1.0 if zero else math.inf
    if not (0.0 <= value < most if zero else 0.0 < value < most):
        expected = "a number from 0 to 1" if zero else "a number above 0"
        mend = "a ratio of 1 % is 0.01" if zero else "write what was measured, with its error"
        raise fault(path, f"line {line}, column '{column}'", expected, f"'{text}'", mend)
    return value


def check_table_against_rig(table: ModalTable, rig: Rig) -> None:
    """Checks that a table's numbers exist in a rig.

    Args:
        table: the table.
        rig: what it was measured on.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    for condition, numbers in table.numbers.items():
        for name in numbers:
            if name not in rig.parameters:
                expected = f"a parameter of {rig.path.name}"
                mend = f"write '{nearest(name, rig.parameters) or 'one of its names'}'"
                place = f"[conditions.{condition}] {name}"
                raise fault(table.path, place, expected, f"'{name}'", mend)
