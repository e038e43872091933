"""Files of a swing's markers: a sidecar names the swing, the cloud on the club, and the ball."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from ..model.door import fault, nearest, one_of, read_toml, rule, validated
from .clubhead import Club, Swing, with_face
from .clubhead_ball import MARKER_NOISE, RADIUS, Ball, fit_ball
from .clubhead_face import Face
from .marker_file import MarkerRecord, MarkerTable, numbers_of, open_text, unit_factor

FARTHEST = 2.0
"""Distance from the markers within which a point of a club lies [m]."""

Triple = tuple[float, float, float]


class _Markers(MarkerTable):
    unit: str | None = None


class _Club(MarkerTable):
    file: str
    unit: str | None = None
    face_markers: tuple[str, str, str] | None = None
    face_center: Triple | None = None
    normal: Triple = (1.0, 0.0, 0.0)
    up: Triple = (0.0, 0.0, 1.0)
    bulge: float | None = Field(default=None, gt=0.02)
    roll: float | None = Field(default=None, gt=0.02)
    hand: Literal["right", "left"] = "right"
    points: dict[str, Triple | str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _square(self) -> _Club:
        if np.linalg.norm(np.cross(self.normal, self.up)) < 0.1:
            raise rule("'normal' and 'up' of different directions", "correct one of them", "one")
        return self


class _Ball(MarkerTable):
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


class _Sidecar(MarkerTable):
    record: MarkerRecord = MarkerRecord()
    markers: _Markers = _Markers()
    club: _Club
    ball: _Ball | None = None


def read_swing(path: Path | str) -> tuple[Swing, Club, Ball | None]:
    """Reads a swing of markers by its sidecar.

    The swing's table has a column ``NAME_x``, ``NAME_y``, ``NAME_z`` for each marker, empty where
    it was lost, or it is a C3D file; the cloud's and the ball's have the columns marker, x, y and
    z. Axes: x to the target, z up. Further points whose speed is wanted stand in ``[club.points]``,
    each by the name of a marker or by three numbers in the cloud's axes [m].

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
    seen = asked.record.markers(data, files, asked.markers.unit)
    swing = Swing(data.stem, data, seen.rate, seen.names, seen.places)
    club = _read_club(sidecar, asked.club, files)
    ball = None if asked.ball is None else _read_ball(sidecar, asked.ball, files)
    return replace(swing, name=sidecar.stem, files=files), club, ball


def _read_cloud(
    path: Path, unit: str | None, place: str, files: dict[str, str]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and places of markers listed one a row."""
    table = open_text(path, 0, files)
    plain = [n.split("[")[0].split("(")[0].strip().casefold() for n in table.layout.names]
    wanted = ("marker", "x", "y", "z")
    if any(plain.count(word) != 1 for word in wanted):
        listed = one_of(table.layout.names) if any(plain) else "columns without names"
        raise fault(path, "header", "columns marker, x, y, z", listed, "name them so")
    index = [plain.index(word) for word in wanted]
    lines = table.lines[table.layout.first :]
    names = tuple(table.layout.cells(line)[index[0]].strip() for line in lines)
    values = numbers_of(table, index[1:])
    if not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
        line = f"line {table.layout.first + row + 1}"
        raise fault(path, line, "three numbers", "an empty cell", "fill it, or cut the line")
    return names, values * unit_factor(path, table.layout.names[index[1]], unit, place)


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
    club = Club(names, cloud, face, _points(sidecar, asked, names, cloud))
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


def _points(
    sidecar: Path, asked: _Club, names: tuple[str, ...], cloud: np.ndarray
) -> dict[str, np.ndarray]:
    """Further points of the club: places [m], or the names of markers."""
    found = {}
    for name, point in asked.points.items():
        place = f"[club.points] {name}"
        if name in ("toe", "heel") or not name.isidentifier():
            expected = "a name of letters, digits and '_', other than toe and heel"
            raise fault(sidecar, place, expected, f"'{name}'", "rename it")
        if isinstance(point, str):
            if point not in names:
                mend = f"write '{nearest(point, names) or names[0]}', or three numbers"
                raise fault(sidecar, place, one_of(names), f"'{point}'", mend)
            found[name] = cloud[names.index(point)]
        else:
            found[name] = np.array(point)
        reach = float(np.linalg.norm(found[name] - cloud.mean(axis=0)))
        if reach > FARTHEST:
            expected = f"a point within {FARTHEST:g} m of the markers, in metres"
            raise fault(sidecar, place, expected, f"one {reach:.3g} m away", "correct its unit")
    return found


def _read_ball(sidecar: Path, asked: _Ball, files: dict[str, str]) -> Ball:
    if asked.center is not None:
        return Ball(np.array(asked.center), asked.std**2 * np.eye(3), asked.radius)
    path = sidecar.parent / (asked.file or "")
    _, places = _read_cloud(path, asked.unit, "[ball] unit", files)
    try:
        return fit_ball(places, asked.radius, asked.std)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
