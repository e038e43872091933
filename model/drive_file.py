"""A drive is what moves the rig in a simulation; here its file is read and checked."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from .door import fault, nearest, one_of, read_bytes, read_toml, shown, validated

MOST_SAMPLES = 20_000_000
"""Most samples that one drive may ask for [-]; beyond that a unit is wrong."""

LARGEST_PROFILE = 50_000_000
"""Largest profile that is read [byte]; a thousand rows are some fifty thousand."""

_KEYS = {
    "release": ("clubhead_deflection", "displacement"),
    "impact": ("force", "duration"),
    "torque": ("times", "values", "shape", "amplitude", "period", "duration"),
    "wrist": ("file", "shape", "amplitude", "period", "duration"),
    "swing": ("file", "impact"),
}
_COMMON = ("kind", "place", "start")
_DEFAULT_PLACES = {"release": "clubhead", "impact": "clubhead", "torque": "wrist"}


@dataclass(frozen=True)
class Impact:
    """The ball: a rectangular pulse of force on the clubhead.

    Attributes:
        force: its height [N].
        time: when it begins [s].
        duration: how long it lasts [s].
    """

    force: float
    time: float
    duration: float = 0.0005


@dataclass(frozen=True)
class DriveSpec:
    """What moves a rig, and over which times it is simulated.

    Attributes:
        path: the file.
        kind: ``release``, ``impact``, ``torque``, ``wrist`` or ``swing``.
        place: where it acts; ``arm`` for a swing.
        duration: length of the simulation [s].
        sample_rate: samples a second of the simulation [Hz].
        force: height of an impact [N, or N m on a rotating chain].
        start: when an impact, a torque or a shape begins [s].
        drive_duration: length of the pulse of an impact, or of a shape [s]; None: to the end.
        clubhead_deflection: of a release: the shaft bent at the clubhead [m].
        displacement: of a release elsewhere: the place moved by this [m or rad].
        times: where a torque changes [s], ascending.
        values: the torque from each of these times on [N m, or N].
        shape: ``square`` or ``sine`` instead of times and values.
        amplitude: of a shape; of a wrist's its angle [N m, N or rad].
        period: of a shape [s].
        file: table with ``time`` and angles [s, rad], resolved against the drive's folder.
        impact: of a swing: the ball.
        sha256: of the file's bytes.
    """

    path: Path
    kind: Literal["release", "impact", "torque", "wrist", "swing"]
    place: str
    duration: float
    sample_rate: float
    force: float = 0.0
    start: float = 0.0
    drive_duration: float | None = None
    clubhead_deflection: float | None = None
    displacement: float | None = None
    times: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    shape: str | None = None
    amplitude: float | None = None
    period: float | None = None
    file: Path | None = None
    impact: Impact | None = None
    sha256: str = ""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _Impact(_Table):
    force: float
    time: float = Field(ge=0.0)
    duration: float = Field(default=0.0005, gt=0.0)


class _Drive(_Table):
    kind: Literal["release", "impact", "torque", "wrist", "swing"]
    place: str | None = None
    force: float | None = None
    start: float = Field(default=0.0, ge=0.0)
    duration: float | None = Field(default=None, gt=0.0)
    clubhead_deflection: float | None = None
    displacement: float | None = None
    times: list[float] | None = None
    values: list[float] | None = None
    shape: Literal["square", "sine"] | None = None
    amplitude: float | None = None
    period: float | None = Field(default=None, gt=0.0)
    file: str | None = None
    impact: _Impact | None = None


class _Times(_Table):
    duration: float = Field(gt=0.0)
    sample_rate: float = Field(gt=0.0)


class _File(_Table):
    drive: _Drive
    times: _Times


def read_drive(path: Path | str) -> DriveSpec:
    """Reads a drive and checks that its numbers belong together.

    Args:
        path: a TOML file with ``[drive]`` and ``[times]``.

    Returns:
        The drive, in SI units; a profile that it names exists, but is not read here.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    document, sha256 = read_toml(path)
    if "drive" not in document:
        found = f"the tables {one_of(document)}" if document else "an empty file"
        mend = "name the file that has [drive]"
        raise fault(path, "[drive]", "a drive with a table [drive]", found, mend)
    file = validated(_File, document, path)
    drive, times = file.drive, file.times
    if times.duration * times.sample_rate > MOST_SAMPLES:
        found = f"{times.duration * times.sample_rate:.3g}"
        mend = "shorten 'duration' or lower 'sample_rate'; they are in s and Hz"
        raise fault(path, "[times]", f"at most {MOST_SAMPLES:g} samples", found, mend)
    _check_keys(drive, document["drive"], path)
    _check_kind(drive, path)
    return DriveSpec(
        path,
        drive.kind,
        drive.place or _DEFAULT_PLACES.get(drive.kind, "wrist" if drive.kind == "wrist" else "arm"),
        float(times.duration),
        float(times.sample_rate),
        force=float(drive.force or 0.0),
        start=float(drive.start),
        drive_duration=_number(drive.duration),
        clubhead_deflection=_number(drive.clubhead_deflection),
        displacement=_number(drive.displacement),
        times=tuple(map(float, drive.times or ())),
        values=tuple(map(float, drive.values or ())),
        shape=drive.shape,
        amplitude=_number(drive.amplitude),
        period=_number(drive.period),
        file=_profile(drive, path),
        impact=None if drive.impact is None else Impact(**drive.impact.model_dump()),
        sha256=sha256,
    )


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


def _check_keys(drive: _Drive, table: Mapping[str, Any], path: Path) -> None:
    """A key of another kind of drive would be passed over in silence: refuse it."""
    allowed = (*_COMMON, *_KEYS[drive.kind])
    for key in table:
        if key not in allowed:
            place = f"[drive] {key}"
            owner = next(kind for kind, keys in _KEYS.items() if key in keys)
            expected = f"a key of the kind '{drive.kind}': {one_of(allowed)}"
            mend = f"remove it, or write kind = '{owner}'"
            raise fault(path, place, expected, f"'{key}'", mend)


def _check_kind(drive: _Drive, path: Path) -> None:
    if drive.kind == "release":
        given = [key for key in _KEYS["release"] if getattr(drive, key) is not None]
        if len(given) != 1:
            expected = "one of 'clubhead_deflection' and 'displacement'"
            mend = "add clubhead_deflection = 0.15 [m], or keep one of the two"
            raise fault(path, "[drive]", expected, "both" if given else "neither", mend)
    elif drive.kind == "impact":
        _need(drive, ("force", "duration"), path)
    elif drive.kind == "torque" or (drive.kind == "wrist" and drive.file is None):
        _check_shape(drive, path)
    else:
        _need(drive, ("file",), path)
        if drive.shape is not None:
            mend = "remove one of them"
            raise fault(path, "[drive]", "either a 'file' or a 'shape'", "both", mend)


def _need(drive: _Drive, keys: tuple[str, ...], path: Path) -> None:
    for key in keys:
        if getattr(drive, key) is None:
            expected = f"the key '{key}' for a drive of kind '{drive.kind}'"
            raise fault(path, f"[drive] {key}", expected, "nothing", f"add '{key}'")


def _check_shape(drive: _Drive, path: Path) -> None:
    if drive.shape is not None:
        _need(drive, ("amplitude", "period"), path)
        if drive.times is not None or drive.values is not None:
            expected = "either a shape, or times and values"
            raise fault(path, "[drive]", expected, "both", "remove one of them")
        return
    if drive.kind == "wrist":
        mend = "add file = 'profile.csv', or shape = 'sine' with amplitude and period"
        raise fault(path, "[drive]", "a 'file' or a 'shape'", "neither", mend)
    _need(drive, ("times", "values"), path)
    times, values = drive.times or [], drive.values or []
    if not times or len(times) != len(values):
        expected = "as many 'times' as 'values', and at least one"
        found = f"{len(times)} and {len(values)}"
        raise fault(path, "[drive] values", expected, found, "give each time its value")
    for index, (before, after) in enumerate(itertools.pairwise(times)):
        if after <= before:
            place = f"[drive] times item {index + 1}"
            expected = f"a time after {before:g} s"
            raise fault(path, place, expected, shown(after), "sort the times")


def _profile(drive: _Drive, path: Path) -> Path | None:
    if drive.file is None:
        return None
    profile = path.parent / drive.file
    if not profile.is_file():
        found = "a directory" if profile.is_dir() else f"no file '{drive.file}'"
        mend = f"put it beside {path.name}, or correct the name"
        raise fault(path, "[drive] file", "an existing file", found, mend)
    return profile


def read_profile(path: Path, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Reads the angles of a profile.

    Args:
        path: a table with commas whose header names ``time`` [s] and angles [rad]; other columns
            are passed over.
        names: the angles wanted, such as ``arm_angle``.

    Returns:
        ``time`` and each of them, shape (rows,) [s, rad].

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    content = read_bytes(path, LARGEST_PROFILE, "name a profile of a few thousand rows")
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise fault(path, "", "text in UTF-8", "other bytes", "save it as CSV in UTF-8") from None
    rows = [(number, row) for number, row in enumerate(csv.reader(lines), 1) if any(row)]
    header = [cell.strip() for cell in rows[0][1]] if rows else []
    wanted = ("time", *names)
    for name in wanted:
        if name not in header:
            like = nearest(name, header)
            mend = f"rename '{like}'" if like else f"write the header {','.join(wanted)}"
            raise fault(path, "header", f"a column '{name}'", one_of(header), mend)
    if len(rows) < 3:
        mend = "give the angles over time"
        raise fault(path, "", "at least two rows of numbers", f"{max(len(rows) - 1, 0)}", mend)
    at = {name: header.index(name) for name in wanted}
    table = {name: np.array([_cell(path, *row, name, at[name]) for row in rows[1:]]) for name in at}
    late = np.flatnonzero(np.diff(table["time"]) <= 0)
    if len(late):
        number, (before, after) = rows[late[0] + 2][0], table["time"][late[0] : late[0] + 2]
        place = f"line {number}, column 'time'"
        raise fault(path, place, f"a time after {before:g} s", f"{after:g} s", "sort the rows")
    return table


def _cell(path: Path, line: int, row: list[str], name: str, at: int) -> float:
    text = row[at].strip() if at < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        mend = "write every number with a point, in s and rad"
        found = shown(text) if text else "nothing"
        raise fault(path, f"line {line}, column '{name}'", "a finite number", found, mend)
    return value
