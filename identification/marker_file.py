"""Files of markers in the room, frame by frame: a table of any dialect, or C3D."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..model.door import fault, one_of, read_bytes, sha256_of
from .c3d import open_c3d
from .clock import agreed_rate, check_stated_rate, clock_of
from .dialect import is_number
from .tables import LARGEST_FILE, TextTable, read_table
from .units import UnitError, conversion, header_factor
from .vectors import TIMES

_AXIS = re.compile(r"^(?P<name>.+?)[ _.:]?(?P<axis>[xyzXYZ])\s*(?P<unit>[\[(].*)?$")
_LOST = ("", "nan", "NaN", "NAN", "NA", "-", "--", "null")

FEWEST = 10
"""Fewest frames of a swing [-]."""

Span = tuple[int, int] | None


@dataclass(frozen=True, eq=False)
class MarkerFile:
    """Markers in the room, as a file holds them.

    Attributes:
        path: the file.
        rate: frames a second [Hz].
        names: of the markers.
        places: shape (n, m, 3) [m]; nan where a marker was lost.
        unit: of the places in the file, as text.
    """

    path: Path
    rate: float
    names: tuple[str, ...]
    places: np.ndarray = field(repr=False)
    unit: str = "m"


class MarkerTable(BaseModel):
    """A table of the sidecar of a swing's markers: its keys are checked, and it stays as it is."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class MarkerRecord(MarkerTable):
    """The table ``[record]`` of such a sidecar.

    Attributes:
        file: the markers, relative to the sidecar.
        test: always a swing.
        description: in words.
        sample_rate: frames a second, where the file does not tell [Hz].
        samples: frames to use, the first and one past the last.
        header_rows: lines to pass over.
    """

    file: str | None = None
    test: Literal["swing"] = "swing"
    description: str = ""
    sample_rate: float | None = Field(default=None, gt=0.0)
    samples: tuple[int, int] | None = None
    header_rows: int = Field(default=0, ge=0)

    def markers(self, path: Path, files: dict[str, str], unit: str | None) -> MarkerFile:
        """Reads the markers as this table says; arguments and faults as of `read_markers`."""
        return read_markers(path, files, unit, self.sample_rate, self.samples, self.header_rows)


def read_markers(
    path: Path,
    files: dict[str, str],
    unit: str | None = None,
    rate: float | None = None,
    samples: Span = None,
    header_rows: int = 0,
) -> MarkerFile:
    """Reads markers from a table with columns ``NAME_x``, ``NAME_y``, ``NAME_z``, or from C3D.

    Args:
        path: the file; ``.c3d`` is read as C3D, everything else as text.
        files: takes up the SHA-256 of the file's bytes.
        unit: of the places; the file's own word where None.
        rate: frames a second, which a file with a clock must agree with [Hz]; from the file where
            None.
        samples: frames to use, the first and one past the last; None for all.
        header_rows: lines of a text file to pass over.

    Returns:
        The markers in metres, and frames a second.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    is_c3d = path.suffix.lower() == ".c3d"
    found = (
        _read_c3d(path, files, unit, rate)
        if is_c3d
        else _read_table(path, files, unit, rate, samples, header_rows)
    )
    start, stop = samples or (0, None)
    places = found.places[start:stop]
    if len(places) < FEWEST:
        raise _too_few(path, len(places))
    return MarkerFile(path, found.rate, found.names, places, found.unit)


def _too_few(path: Path, count: int) -> ValueError:
    return fault(path, "", f"at least {FEWEST} frames", f"{count}", "name the right file")


def _read_table(
    path: Path,
    files: dict[str, str],
    unit: str | None,
    rate: float | None,
    samples: Span,
    header_rows: int,
) -> MarkerFile:
    table = open_text(path, header_rows, files)
    found: dict[str, dict[str, int]] = {}
    clock = None
    for i, header in enumerate(table.layout.names):
        plain = header.split("[")[0].split("(")[0].strip()
        if plain.casefold() in TIMES:
            clock = i
        elif match := _AXIS.match(header.strip()):
            found.setdefault(match["name"].strip(), {})[match["axis"].lower()] = i
    names = tuple(name for name, axes in found.items() if set(axes) == set("xyz"))
    if not names:
        listed = one_of(table.layout.names) if any(table.layout.names) else "columns without names"
        mend = "name the columns by marker and axis"
        raise fault(path, "header", "columns 'M1_x', 'M1_y', 'M1_z'", listed, mend)
    columns = [found[name][axis] for name in names for axis in "xyz"]
    factor = unit_factor(path, table.layout.names[columns[0]], unit, "[markers] unit")
    values = numbers_of(table, columns) * factor
    if rate is None:
        rate = _rate_of(table, clock, samples or (0, None))
    elif clock is not None:
        header = table.layout.names[clock]
        stated = header_factor(header, "time")
        times = numbers_of(table, [clock])[slice(*(samples or (0, None))), 0]
        check_stated_rate(path, rate, times * (stated[1] if stated else 1.0), header)
    return MarkerFile(path, rate, names, values.reshape(len(values), len(names), 3))


def _rate_of(table: TextTable, clock: int | None, samples: tuple[int, int | None]) -> float:
    path = table.path
    if clock is None:
        mend = "add a time column in s, or sample_rate"
        raise fault(path, "header", "a column 'time', or [record] sample_rate", "neither", mend)
    times = numbers_of(table, [clock])[slice(*samples), 0]
    if len(times) < FEWEST:
        raise _too_few(path, len(times))
    if not np.isfinite(times).all():
        raise fault(path, "time", "a number in each row", "empty cells", "fill them")
    stated = header_factor(table.layout.names[clock], "time")
    return clock_of(times * (stated[1] if stated else 1.0), path, "time", samples[0]).rate


def _read_c3d(
    path: Path, files: dict[str, str], unit: str | None, rate: float | None
) -> MarkerFile:
    """The points of a C3D file; a point whose residual is negative was lost."""
    mend = "cut the recording to one swing"
    files[str(path)] = sha256_of(read_bytes(path, LARGEST_FILE, mend))
    content = open_c3d(path)
    names, places = content.names, content.places
    if not names or len(names) != places.shape[1]:
        found = f"{places.shape[1]} points and {len(names)} labels"
        raise fault(path, "POINT:LABELS", "a name for each point", found, "name them in the lab")
    factor = unit_factor(path, f"points [{content.unit}]", unit, "[markers] unit")
    rate = agreed_rate(path, rate, content.rate, "its points")
    return MarkerFile(path, rate, names, places * factor, unit or content.unit)


def numbers_of(table: TextTable, columns: list[int]) -> np.ndarray:
    """Columns of a text table, nan where a cell is empty, shape (n, k) [unit of the file]."""
    import pandas as pd

    lines = table.lines[table.layout.first :]
    frame = pd.read_csv(
        io.StringIO("\n".join(lines)),
        sep=r"\s+" if table.layout.delimiter == " " else table.layout.delimiter,
        header=None,
        usecols=columns,
        names=range(max(len(table.layout.names), max(columns) + 1)),
        decimal="," if table.layout.comma else ".",
        na_values=list(_LOST),
        skip_blank_lines=False,
        skipinitialspace=True,
    )
    cells = [np.array(frame[column], copy=True) for column in columns]
    for column, values in zip(columns, cells, strict=True):
        if values.dtype.kind not in "fiu":
            raise _no_number(table, column, values)
    numbers = np.stack(cells, axis=1).astype(float)
    numbers[~np.isfinite(numbers)] = np.nan
    return numbers


def _no_number(table: TextTable, column: int, values: np.ndarray) -> ValueError:
    """Names the first cell of a column that is no number."""
    texts = [str(value) for value in values.tolist()]
    plain = [text.replace(",", ".") if table.layout.comma else text for text in texts]
    row = next((i for i, text in enumerate(plain) if not is_number(text)), 0)
    place = f"line {table.layout.first + row + 1}, column '{table.name(column)}'"
    mend = "correct that cell, or empty it where the marker was lost"
    return fault(table.path, place, "a number or nothing", f"'{texts[row][:40]}'", mend)


def open_text(path: Path, header_rows: int, files: dict[str, str]) -> TextTable:
    """Opens a table of text and notes the SHA-256 of its bytes in `files`."""
    table = read_table(path, header_rows)
    if not isinstance(table, TextTable):
        raise fault(path, "", "a text file", f"{path.suffix}", "export the markers as CSV")
    files[str(path)] = table.sha256
    return table


def unit_factor(path: Path, header: str, unit: str | None, place: str) -> float:
    """Metres in one unit: the sidecar's where it states one, else the header's [m]."""
    if unit is not None:
        try:
            return conversion(unit, "position").factor
        except UnitError as error:
            raise fault(path, place, str(error), f"'{unit}'", error.mend) from None
    stated = header_factor(header, "position")
    if stated is None:
        expected = f"the unit of '{header}'"
        raise fault(path, place, expected, "none", f"write {place} = 'mm', or '{header} [mm]'")
    return stated[1]
