"""Pairs of readings: a table with a column of subjects and two columns a quantity."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..model.door import fault, one_of
from .marker_file import numbers_of, open_text
from .tables import TextTable
from .units import UnitError, conversion

_HEADER = re.compile(r"^(?P<quantity>[^:\[]+):(?P<instrument>[^\[]+?)\s*(\[(?P<unit>[^\]]*)\])?$")
_SUBJECT = "subject"


@dataclass(frozen=True, eq=False)
class Pairs:
    """One quantity by two instruments, swing by swing.

    Attributes:
        path: the file.
        quantity: such as ``face_angle``.
        instruments: the two, in the order of their columns.
        subjects: who swung, n names.
        first: by the first instrument, shape (n,) [see `unit`].
        second: by the second one, shape (n,) [see `unit`].
        unit: SI unit as text; ``1`` for numbers without one.
        written: the unit in the file, as text.
        factor: SI units in one of the file's [`unit` per `written`].
        left_out: swings that one instrument missed [-].
    """

    path: Path
    quantity: str
    instruments: tuple[str, str]
    subjects: tuple[str, ...]
    first: np.ndarray = field(repr=False)
    second: np.ndarray = field(repr=False)
    unit: str
    written: str
    factor: float
    left_out: int


def read_pairs(path: Path, files: dict[str, str]) -> tuple[Pairs, ...]:
    """Reads a table with columns ``subject`` and ``QUANTITY:INSTRUMENT [unit]``.

    Args:
        path: a text file; an empty cell is a reading that was missed.
        files: takes up the SHA-256 of its bytes.

    Returns:
        A pair for each quantity, in SI units.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    table = open_text(path, 0, files)
    names = [name.strip() for name in table.layout.names]
    who = [i for i, name in enumerate(names) if name.casefold() == _SUBJECT]
    columns: dict[str, list[tuple[str, str, int]]] = {}
    for i, name in enumerate(names):
        if match := _HEADER.match(name):
            one = match["instrument"].strip(), (match["unit"] or "1").strip(), i
            columns.setdefault(match["quantity"].strip(), []).append(one)
    if len(who) != 1 or not columns:
        expected = (
            "columns 'subject' and, say, 'face_angle:radar [deg]', 'face_angle:markers [deg]'"
        )
        found = one_of(names) if any(names) else "columns without names"
        raise fault(path, "header", expected, found, "name the columns so")
    subjects = _subjects(table, who[0])
    return tuple(_pair(table, quantity, pair, subjects) for quantity, pair in columns.items())


def _subjects(table: TextTable, column: int) -> tuple[str, ...]:
    found = []
    for number, line in enumerate(table.lines[table.layout.first :]):
        cells = table.layout.cells(line)
        name = cells[column].strip() if column < len(cells) else ""
        if not name:
            place = f"line {table.layout.first + number + 1}, column '{_SUBJECT}'"
            raise fault(table.path, place, "a name or number", "an empty cell", "fill it")
        found.append(name)
    return tuple(found)


def _pair(
    table: TextTable, quantity: str, pair: list[tuple[str, str, int]], subjects: tuple[str, ...]
) -> Pairs:
    path, instruments = table.path, [name for name, _, _ in pair]
    if len(pair) != 2 or len(set(instruments)) != 2:
        mend = "give each quantity two columns, one an instrument"
        raise fault(path, f"columns '{quantity}:...'", "two instruments", one_of(instruments), mend)
    (first, unit, a), (second, other, b) = pair
    if unit != other:
        mend = "write both in one unit"
        raise fault(path, f"column '{quantity}:{second}'", f"'{unit}'", f"'{other}'", mend)
    factor, si = _factor(path, f"{quantity}:{first}", unit)
    numbers = numbers_of(table, [a, b]) * factor
    both = np.isfinite(numbers).all(axis=1)
    return Pairs(
        path,
        quantity,
        (first, second),
        tuple(np.array(subjects, dtype=object)[both].tolist()),
        numbers[both, 0],
        numbers[both, 1],
        si,
        unit,
        factor,
        int(np.sum(~both)),
    )


def _factor(path: Path, column: str, unit: str) -> tuple[float, str]:
    for quantity in ("position", "angle", "velocity", "acceleration", "strain"):
        try:
            found = conversion(unit, quantity)
        except UnitError:
            continue
        return found.factor, found.unit
    expected = "a unit of a length, an angle, a speed, an acceleration or a strain"
    raise fault(
        path, f"column '{column}'", expected, f"'{unit}'", "write 'mm', 'deg', 'm/s' or '1'"
    )
