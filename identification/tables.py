"""Tables of laboratories: columns of numbers from text, MAT, universal, TDMS or C3D files."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from ..model.door import fault, nearest, one_of, read_bytes, sha256_of
from .dialect import Layout, decoded, is_number, layout_of
from .vectors import Rows, find_name

LARGEST_FILE = 100_000_000
"""Largest data file that is read [byte]; its size is looked at before anything is read."""

_STRANGERS = {
    ".xls": "an Excel", ".xlsx": "an Excel", ".parquet": "a Parquet", ".h5": "an HDF5",
    ".hdf5": "an HDF5", ".npy": "a NumPy", ".npz": "a NumPy", ".pkl": "a pickle",
    ".wav": "a WAV", ".zip": "a ZIP",
}  # fmt: skip

UNIVERSAL = (".uff", ".unv", ".uf", ".bunv")
"""How universal files are called [-]."""


class Table(Protocol):
    """What records need of a data file: its columns, by name or number."""

    @property
    def path(self) -> Path:
        """The file."""
        ...

    @property
    def sha256(self) -> str:
        """Of the file's bytes."""
        ...

    def column(self, key: str | int, rows: Rows, place: str) -> np.ndarray:
        """Numbers of one column, float64, shape (n,) in the file's unit.

        Args:
            key: name or 0-based number.
            rows: the first and one past the last; None for all that are filled.
            place: the key of the sidecar that asks, for messages.
        """
        ...

    def name(self, key: str | int) -> str:
        """The full name of a column that exists; empty where it has none [-]."""
        ...

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Every column of real numbers, by the name or number that `column` takes [-]."""
        ...

    def times_of(self, key: str | int, place: str) -> np.ndarray | None:
        """Times of a column's samples, where the file itself keeps a clock, shape (n,) [s]."""
        ...

    @property
    def own_rate(self) -> float | None:
        """Samples a second, where the file itself keeps a clock [Hz]; else None."""
        ...

    def rate_of(self, key: str | int, place: str) -> float | None:
        """Samples a second of a column, where the file says [Hz]; else None."""
        ...


def read_table(path: Path, header_rows: int = 0) -> Table:
    """Opens a data file: text in any dialect of the contract, MAT, UFF58, TDMS or C3D.

    Args:
        path: the file; ``.mat`` is read as MAT, ``.uff`` and ``.unv`` as UFF58, ``.tdms`` as TDMS,
            ``.c3d`` as C3D, everything else as text.
        header_rows: lines of a text file to pass over before the header or the data.

    Returns:
        Its columns, read when they are asked for.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    suffix = path.suffix.lower()
    if suffix in _STRANGERS and path.is_file():
        mend = "export it as CSV, as MAT of version 7 or older, as UFF58 or as TDMS"
        expected = "a text, MAT, UFF58, TDMS or C3D file"
        raise fault(path, "", expected, f"{_STRANGERS[suffix]} file", mend)
    mend = "cut the recording or lower its sample rate; this is no record of one test"
    content = read_bytes(path, LARGEST_FILE, mend)
    if suffix == ".mat":
        from .mat import MatTable

        return MatTable(path, sha256_of(content), content)
    if suffix in UNIVERSAL:
        from .uff import UffTable

        return UffTable(path, sha256_of(content))
    if suffix == ".tdms":
        from .tdms import TdmsTable

        return TdmsTable(path, sha256_of(content), content)
    if suffix == ".c3d":
        from .c3d import C3dTable, open_c3d

        return C3dTable(path, sha256_of(content), open_c3d(path))
    lines = decoded(content, path).split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise fault(path, "", "a table of numbers", "an empty file", "export the record again")
    return TextTable(path, sha256_of(content), layout_of(lines, header_rows, path), tuple(lines))


@dataclass(frozen=True)
class TextTable:
    """A text file whose layout is known; cells become numbers when a column is asked for.

    Attributes:
        path: the file.
        sha256: of its bytes.
        layout: header, separator and decimal sign.
        lines: all of its lines.
    """

    path: Path
    sha256: str
    layout: Layout
    lines: tuple[str, ...] = field(repr=False)

    @property
    def own_rate(self) -> None:
        """None: text keeps its clock in a column, if at all."""

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Every column, by its name where that is its alone, else by its number [-]."""
        names = [*self.layout.names, *([""] * (self._width - len(self.layout.names)))]
        return tuple(name if name and names.count(name) == 1 else i for i, name in enumerate(names))

    def times_of(self, key: str | int, place: str) -> None:
        """None: text keeps its clock in a column, if at all."""

    def rate_of(self, key: str | int, place: str) -> None:
        """None: text states no rate."""

    def name(self, key: str | int) -> str:
        """The header of a column that exists; empty where it has none [-]."""
        index = key if isinstance(key, int) else find_name(key, self.layout.names)[0]
        return self.layout.names[index] if index < len(self.layout.names) else ""

    def column(self, key: str | int, rows: Rows, place: str) -> np.ndarray:
        """Numbers of one column.

        Args:
            key: name or 0-based number.
            rows: the first and one past the last; None for all, up to the last filled cell.
            place: the key of the sidecar that asks, for messages.

        Returns:
            float64, shape (n,), in the file's unit, finite.

        Raises:
            ValueError: naming line and column of the first cell that is no number.
        """
        index = self._index(key, place)
        lines = self.lines[self.layout.first :]
        start, stop = rows or (0, len(lines))
        if stop > len(lines):
            mend = "correct 'samples', which counts rows of data from 0"
            expected, found = f"at least {stop} rows of data", f"{len(lines)}"
            raise fault(self.path, "", expected, found, mend)
        values = self._quick(lines[start:stop], index)
        if values is None:
            values = self._careful(lines[start:stop], index, start, rows is None)
        strange = np.flatnonzero(~np.isfinite(values))
        if strange.size:
            row = start + int(strange[0])
            found = f"{values[strange[0]]} ({strange.size} of {len(values)} cells)"
            raise self._bad_cell(row, index, "a finite number", found)
        return values

    @property
    def _width(self) -> int:
        lines = self.lines[self.layout.first :]
        beginning = [len(self.layout.cells(line)) for line in lines[:5]]
        return max([len(self.layout.names), *beginning])

    def _index(self, key: str | int, place: str) -> int:
        names, width = self.layout.names, self._width
        if isinstance(key, int):
            if key >= width:
                listed = f": {one_of(names)}" if names else ""
                found = f"{width} columns{listed}"
                mend = "columns are counted from 0"
                raise fault(self.path, place, f"a column number {key}", found, mend)
            return key
        found = find_name(key, names)
        if len(found) == 1:
            return found[0]
        if found:
            text = f"it {len(found)} times, in columns {', '.join(map(str, found))}"
            mend = f"write column = {found[0]}, its number from 0"
            raise fault(self.path, place, f"one column '{key}'", text, mend)
        if not any(names):
            text = f"{width} columns without names"
            mend = "write its number from 0 without quotes, or correct 'header_rows'"
        else:
            like = nearest(key, names)
            text = f"the columns {one_of(names)}"
            mend = f"write column = '{like}'" if like else "write one of these names"
        raise fault(self.path, place, f"a column '{key}'", text, mend)

    def _quick(self, lines: Sequence[str], index: int) -> np.ndarray | None:
        """All cells at once where every line is plain; None where the careful way is needed."""
        delimiter = self.layout.delimiter
        if not lines or '"' in "".join(lines[:20]):
            return None
        if delimiter == " ":
            widths = {len(line.split()) for line in lines}
        else:
            widths = {line.count(delimiter) + 1 for line in lines}
        if len(widths) != 1 or max(widths) > self._width or index >= max(widths):
            return None
        text = "\n".join(lines)
        if self.layout.comma:
            if "." in text:
                return None
            text = text.replace(",", ".")
        separator = None if delimiter == " " else delimiter
        try:
            values = np.loadtxt(
                io.StringIO(text), delimiter=separator, usecols=index, comments=None, ndmin=1
            )
        except ValueError:
            return None
        return values if len(values) == len(lines) else None

    def _careful(self, lines: Sequence[str], index: int, start: int, may_end: bool) -> np.ndarray:
        """Cell by cell, so that the first one at fault can be named."""
        cells = self._cells(lines, index, start)
        while may_end and cells and not cells[-1]:
            cells.pop()
        comma = self.layout.comma or any("," in cell for cell in cells)
        mixed = comma and any("." in cell for cell in cells)
        values = np.empty(len(cells))
        for i, cell in enumerate(cells):
            if not cell:
                raise self._bad_cell(start + i, index, "a number", "an empty cell")
            if not is_number(cell) or (mixed and "," in cell):
                raise self._bad_cell(start + i, index, "a number", f"'{cell[:40]}'")
            plain = cell.replace(",", ".") if comma else cell
            values[i] = float(plain.lower().replace("d", "e") if "n" not in cell.lower() else plain)
        return values

    def _cells(self, lines: Sequence[str], index: int, start: int) -> list[str]:
        layout, width, cells = self.layout, self._width, []
        rows = (
            csv.reader(lines, delimiter=layout.delimiter, skipinitialspace=True)
            if layout.delimiter != " "
            else (line.split() for line in lines)
        )
        for i, row in enumerate(rows):
            if len(row) > width and any(cell.strip() for cell in row[width:]):
                line = f"line {layout.first + start + i + 1}"
                mend = "correct that line; with decimal commas separate the columns by ';'"
                raise fault(self.path, line, f"{width} cells", f"{len(row)}", mend)
            cells.append(row[index].strip() if index < len(row) else "")
        return cells

    def _bad_cell(self, row: int, index: int, expected: str, found: str) -> ValueError:
        name = self.name(index)
        called = f"column '{name}'" if name else f"column {index}"
        place = f"row {row} (line {self.layout.first + row + 1}), {called}"
        mend = "mend that cell, or leave its row out with 'samples' in [record]"
        return fault(self.path, place, expected, found, mend)
