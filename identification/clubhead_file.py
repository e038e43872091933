"""Files of a swing's markers: a sidecar names the swing, the cloud on the club, and the ball."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from ..model.door import fault, nearest, one_of, read_toml, rule, validated
from .clock import clock_of
from .clubhead import Club, Swing, with_face
from .clubhead_ball import MARKER_NOISE, RADIUS, Ball, fit_ball
from .clubhead_face import Face
from .dialect import is_number
from .tables import TextTable, read_table
from .units import UnitError, conversion, header_factor

_AXIS = re.compile(r"^(?P<name>.+?)[ _.:]?(?P<axis>[xyzXYZ])\s*(?P<unit>[\[(].*)?$")
_TIMES = ("time", "t", "zeit")
_LOST = ("", "nan", "NaN", "NAN", "NA", "-", "--", "null")

Triple = tuple[float, float, float]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _Record(_Table):
    file: str | None = None
    test: Literal["swing"] = "swing"
    description: str = ""
    sample_rate: float | None = Field(default=None, gt=0.0)
    samples: tuple[int, int] | None = None
    header_rows: int = Field(default=0, ge=0)


class _Markers(_Table):
    unit: str | None = None


class _Club(_Table):
    file: str
    unit: str | None = None
    face_markers: tuple[str, str, str] | None = None
    face_center: Triple | None = None
    normal: Triple = (1.0, 0.0, 0.0)
    up: Triple = (0.0, 0.0, 1.0)
    bulge: float | None = Field(default=None, gt=0.02)
    roll: float | None = Field(default=None, gt=0.02)
    hand: Literal["right", "left"] = "right"

    @model_validator(mode="after")
    def _square(self) -> _Club:
        if np.linalg.norm(np.cross(self.normal, self.up)) < 0.1:
            raise rule("'normal' and 'up' of different directions", "correct one of them", "one")
        return self


class _Ball(_Table):
    file: str | None = None
    unit: str | None = None
    center: Triple | None = None
    std: float = Field(default=MARKER_NOISE, gt=0.0)
    radius: float = Field(default=RADIUS, gt=0.0)

    @model_validator(mode="after")
    def _one(self) -> _Ball:
        if (self.file is None) == (self.center is None):
            found = "both" if self.file else "neither"
            raise rule("one of 'file' and 'center'", "state the ball once", found)
        return self


class _Sidecar(_Table):
    record: _Record = _Record()
    markers: _Markers = _Markers()
    club: _Club
    ball: _Ball | None = None


def read_swing(path: Path | str) -> tuple[Swing, Club, Ball | None]:
    """Reads a swing of markers by its sidecar.

    The swing's table has a column ``NAME_x``, ``NAME_y``, ``NAME_z`` for each marker, empty where
    it was lost; the cloud's and the ball's have the columns marker, x, y and z. Axes: x to the
    target, z up. C3D files are not read: export them as CSV.

    Args:
        path: ``NAME.toml``, or a table beside one.

    Returns:
        Swing, club and ball in metres; None without a ball.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    sidecar = path if path.suffix.lower() == ".toml" else path.with_suffix(".toml")
    if sidecar != path and path.is_file() and not sidecar.is_file():
        mend = f"write {sidecar.name} with [club] file = 'cloud.csv'"
        raise fault(path, "", "a sidecar that names the club's cloud", "none beside it", mend)
    document, sha256 = read_toml(sidecar)
    asked = validated(_Sidecar, document, sidecar)
    files = {str(sidecar): sha256}
    data = sidecar.parent / (asked.record.file or (path.name if path != sidecar else ""))
    data = data if data != sidecar.parent else sidecar.with_suffix(".csv")
    swing = _read_places(data, asked, files)
    club = _read_club(sidecar, asked.club, files)
    ball = None if asked.ball is None else _read_ball(sidecar, asked.ball, files)
    return replace(swing, name=sidecar.stem, files=files), club, ball


def _numbers(table: TextTable, columns: list[int]) -> np.ndarray:
    """Columns of a text table, nan where a cell is empty, shape (n, k)."""
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


def _open(path: Path, header_rows: int, files: dict[str, str]) -> TextTable:
    table = read_table(path, header_rows)
    if not isinstance(table, TextTable):
        raise fault(path, "", "a text file", f"{path.suffix}", "export the markers as CSV")
    files[str(path)] = table.sha256
    return table


def _factor(path: Path, header: str, unit: str | None, place: str) -> float:
    """Metres in one unit: the sidecar's where it states one, else the header's."""
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


def _read_places(path: Path, asked: _Sidecar, files: dict[str, str]) -> Swing:
    table = _open(path, asked.record.header_rows, files)
    found: dict[str, dict[str, int]] = {}
    clock = None
    for i, header in enumerate(table.layout.names):
        plain = header.split("[")[0].split("(")[0].strip()
        if plain.casefold() in _TIMES:
            clock = i
        elif match := _AXIS.match(header.strip()):
            found.setdefault(match["name"].strip(), {})[match["axis"].lower()] = i
    names = tuple(name for name, axes in found.items() if set(axes) == set("xyz"))
    if not names:
        listed = one_of(table.layout.names) if any(table.layout.names) else "columns without names"
        mend = "name the columns by marker and axis"
        raise fault(path, "header", "columns 'M1_x', 'M1_y', 'M1_z'", listed, mend)
    columns = [found[name][axis] for name in names for axis in "xyz"]
    factor = _factor(path, table.layout.names[columns[0]], asked.markers.unit, "[markers] unit")
    start, stop = asked.record.samples or (0, None)
    values = _numbers(table, columns)[start:stop] * factor
    if len(values) < 10:
        raise fault(path, "", "at least 10 frames", f"{len(values)}", "name the right file")
    rate = asked.record.sample_rate
    if rate is None:
        if clock is None:
            mend = "add a time column in s, or sample_rate"
            raise fault(path, "header", "a column 'time', or [record] sample_rate", "neither", mend)
        times = _numbers(table, [clock])[start:stop, 0]
        if not np.isfinite(times).all():
            raise fault(path, "time", "a number in each row", "empty cells", "fill them")
        stated = header_factor(table.layout.names[clock], "time")
        rate = clock_of(times * (stated[1] if stated else 1.0), path, "time", start).rate
    return Swing(path.stem, path, rate, names, values.reshape(len(values), len(names), 3))


def _read_cloud(
    path: Path, unit: str | None, place: str, files: dict[str, str]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and places of markers listed one a row."""
    table = _open(path, 0, files)
    plain = [n.split("[")[0].split("(")[0].strip().casefold() for n in table.layout.names]
    wanted = ("marker", "x", "y", "z")
    if any(plain.count(word) != 1 for word in wanted):
        listed = one_of(table.layout.names) if any(plain) else "columns without names"
        raise fault(path, "header", "columns marker, x, y, z", listed, "name them so")
    index = [plain.index(word) for word in wanted]
    lines = table.lines[table.layout.first :]
    names = tuple(table.layout.cells(line)[index[0]].strip() for line in lines)
    values = _numbers(table, index[1:])
    if not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        line = f"line {table.layout.first + row + 1}"
        raise fault(path, line, "three numbers", "an empty cell", "fill it, or cut the line")
    return names, values * _factor(path, table.layout.names[index[1]], unit, place)


def _read_club(sidecar: Path, asked: _Club, files: dict[str, str]) -> Club:
    names, cloud = _read_cloud(sidecar.parent / asked.file, asked.unit, "[club] unit", files)
    face = Face(
        asked.face_center or (0.0, 0.0, 0.0),
        asked.normal,
        asked.up,
        asked.bulge or float("inf"),
        asked.roll or float("inf"),
        asked.hand,
    )
    club = Club(names, cloud, face)
    if asked.face_markers is None:
        return club
    for name in asked.face_markers:
        if name not in names:
            mend = f"write '{nearest(name, names) or names[0]}'"
            raise fault(sidecar, "[club] face_markers", one_of(names), f"'{name}'", mend)
    club = with_face(club, cloud[[names.index(name) for name in asked.face_markers]])
    if asked.face_center is not None:
        club = replace(club, face=replace(club.face, center=asked.face_center))
    return club


def _read_ball(sidecar: Path, asked: _Ball, files: dict[str, str]) -> Ball:
    if asked.center is not None:
        return Ball(np.array(asked.center), asked.std**2 * np.eye(3), asked.radius)
    path = sidecar.parent / (asked.file or "")
    _, places = _read_cloud(path, asked.unit, "[ball] unit", files)
    try:
        return fit_ball(places, asked.radius, asked.std)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
