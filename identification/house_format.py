"""A laboratory's own file in the house format: tables of text and the sidecar that maps them."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..model.door import fault, one_of, read_toml, toml_text
from .c3d import C3dTable, open_c3d
from .clock import agreed_rate, clock_of
from .marker_file import read_markers
from .sidecar import CLOCK, read_sidecar
from .sources import SUFFIXES
from .tables import Table, read_table
from .units import SI_UNITS, UnitError, conversion
from .vectors import TIMES

GUESSES = ("acceleration", "velocity", "position", "force", "torque", "angle", "angular_velocity",
           "angular_acceleration", "strain", "voltage")  # fmt: skip
"""Quantities that a unit may tell, in the order in which they are tried [-]."""

FILES = ("rig", "file")
"""Keys of a sidecar that name another file [-]."""

DRIVING = ("force", "torque")
"""Quantities of inputs [-]."""

UNTOLD = "No file says where a channel was measured: write 'place', and 'test' and 'rig', by hand."
"""What a sidecar that was made of a file alone still needs [-]."""

_INDEX = re.compile(r"\S\[\d+\]$")
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*)[\])]\s*$")


@dataclass(frozen=True)
class HouseFormat:
    """A file in the house format.

    Attributes:
        name: of the record.
        texts: its files by name, the sidecar among them.
        channels: what became of each column: ``channel``, ``file``, ``column``, ``unit``,
            ``quantity`` and ``samples``.
        doubts: what the file does not say and the sidecar must, in sentences.
        files: every file read, with its SHA-256.
    """

    name: str
    texts: Mapping[str, str]
    channels: tuple[Mapping[str, Any], ...]
    doubts: tuple[str, ...]
    files: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class _Column:
    """One channel on its way: values and times as the file has them."""

    name: str
    header: str
    table: dict[str, Any]
    values: np.ndarray
    times: np.ndarray | None


@dataclass
class _Named:
    """Names that are taken, and what was doubtful."""

    slugs: set[str] = field(default_factory=set)
    headers: set[str] = field(default_factory=set)
    doubts: list[str] = field(default_factory=list)


def house_format(path: Path | str, sample_rate: float | None = None) -> HouseFormat:
    """A universal, TDMS, MAT, C3D or text file as tables of text with a sidecar.

    Numbers stay as the file has them, with their units, to the last digit. Where a sidecar maps
    the file, it is kept; otherwise one is written, with what the file says of itself.

    Args:
        path: the laboratory's file, or the sidecar that maps it.
        sample_rate: where the file does not tell [Hz].

    Returns:
        The files' texts; nothing is written.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    beside = path.with_suffix(".toml")
    if path.suffix.lower() == ".c3d" and not _maps_channels(beside):
        if not beside.is_file() and not open_c3d(path).places.size:
            return _told(path, sample_rate)
        return _markers(path, beside if beside.is_file() else None, sample_rate)
    if path.suffix.lower() == ".toml":
        document = read_toml(path)[0]
        named = str(document.get("record", {}).get("file", ""))
        if named.lower().endswith(".c3d") and "channels" not in document:
            return _markers(path.parent / named, path, sample_rate)
        return _mapped(path)
    return _mapped(beside) if beside.is_file() else _told(path, sample_rate)


def _maps_channels(sidecar: Path) -> bool:
    return sidecar.is_file() and "channels" in read_toml(sidecar)[0]


def _told(path: Path, sample_rate: float | None) -> HouseFormat:
    """A file without a sidecar: every column of numbers, by what the file says of it."""
    table, named = read_table(path), _Named()
    columns, clock = [], None
    for key in table.columns:
        header = table.name(key)
        label, unit = _split(header or f"column_{key}")
        if table.own_rate is None and label.casefold() in TIMES:
            clock = _seconds(table.column(key, None, "column"), unit, path, label)
            continue
        columns.append(_column(table, key, label, unit, named))
    if not columns:
        raise fault(path, "", "columns of numbers", "none", "name the right file")
    times = [one.times if one.times is not None else clock for one in columns]
    rate = sample_rate
    if rate is not None and clock is not None:
        agreed_rate(path, rate, clock_of(clock, path, "time").rate, "the time column")
    if rate is None and any(each is None for each in times):
        mend = "say --sample-rate, in Hz"
        raise fault(path, "", "a clock: a column 'time', or a rate", "neither", mend)
    if all(one.table["role"] == "input" for one in columns):
        columns[0].table["role"] = "response"
    record: dict[str, Any] = {"description": f"converted from {path.name}"}
    if any(each is None for each in times):
        record["sample_rate"] = float(rate or 0.0)
    columns = [
        _Column(one.name, one.header, one.table, one.values, each)
        for one, each in zip(columns, times, strict=True)
    ]
    files = {str(path): table.sha256}
    return _written(path.stem, {"record": record}, columns, (*named.doubts, UNTOLD), files)


def _column(table: Table, key: str | int, label: str, unit: str, named: _Named) -> _Column:
    values = table.column(key, None, "column")
    name = _slug(label.rpartition("/")[2], named.slugs)
    quantity = _quantity(unit)
    if quantity is None:
        said = f"its unit '{unit}' is not understood" if unit else "the file states no unit of it"
        named.doubts.append(f"{name}: {said}; 'unit' and 'quantity' must be corrected by hand.")
    header = _unique(label, named.headers)
    told = {
        "column": header,
        "unit": unit if quantity else "1",
        "role": "input" if quantity in DRIVING else "response",
        "quantity": quantity or "voltage",
        "place": name,
    }
    return _Column(
        name, f"{header} [{unit}]" if unit else header, told, values, table.times_of(key, "column")
    )


def _mapped(path: Path) -> HouseFormat:
    """A record that a sidecar maps: its tables stay, and the columns they name become text."""
    sidecar, clock, sha256 = read_sidecar(path)
    document, named, files = read_toml(path)[0], _Named(), {str(path): sha256}
    record = dict(document.get("record", {}))
    own = _opened(path, record.get("file"), int(record.pop("header_rows", 0)), files)
    shared = None
    if clock is not None:
        values = own.column(clock.column, None, f"[channels.{CLOCK}] column")
        shared = values * conversion(clock.unit, CLOCK).factor
    columns = []
    for name, channel in sidecar.channels.items():
        told = {k: v for k, v in document["channels"][name].items() if k not in ("file", "time")}
        place = f"[channels.{name}] column"
        source = own if channel.file is None else _opened(path, channel.file, 0, files)
        times = shared
        if channel.time is not None:
            label, unit = _split(source.name(channel.time))
            times = _seconds(source.column(channel.time, None, place), unit, path, label)
        elif shared is None:
            times = source.times_of(channel.column, place)
        header = _unique(name, named.headers)
        values = source.column(channel.column, None, place)
        told["column"] = header
        columns.append(_Column(name, f"{header} [{channel.unit}]", told, values, times))
    if "rig" in record:
        record["rig"] = str((path.parent / record["rig"]).resolve())
    kept = {k: v for k, v in document.items() if k not in ("record", "channels")}
    return _written(path.stem, {"record": record, **kept}, columns, (), files)


def _opened(path: Path, named: Any, header_rows: int, files: dict[str, str]) -> Table:
    candidates = [path.parent / str(named)] if named else [path.with_suffix(s) for s in SUFFIXES]
    data = next((one for one in candidates if one.is_file()), None)
    if data is None:
        listed = one_of(one.name for one in candidates)
        raise fault(path, "[record] file", f"the data file {listed}", "none", "correct the name")
    table = read_table(data, header_rows)
    files[str(data)] = table.sha256
    return table


def _written(
    name: str,
    document: dict[str, Any],
    columns: list[_Column],
    doubts: tuple[str, ...],
    files: Mapping[str, str],
) -> HouseFormat:
    """Texts: a table for each clock, the first one's that of the record, and the sidecar."""
    groups: list[list[_Column]] = []
    for one in columns:
        same = (group for group in groups if _share_clock(group[0], one))
        group = next(same, None)
        if group is None:
            groups.append([one])
        else:
            group.append(one)
    texts, channels, told = {}, {}, []
    for number, group in enumerate(groups, 1):
        file = f"{name}.csv" if number == 1 else f"{name}_{number}.csv"
        texts[file] = _csv(group)
        for one in group:
            channels[one.name] = dict(one.table)
            if number > 1:
                offset = one.table.get("clock_offset", 0.0)
                channels[one.name] |= {"file": file, "time": CLOCK, "clock_offset": offset}
            kept = ("column", "unit", "quantity")
            told.append({"channel": one.name, "file": file, "samples": len(one.values),
                         **{key: one.table[key] for key in kept}})  # fmt: skip
    if groups[0][0].times is not None:
        channels = {CLOCK: {"column": CLOCK, "unit": "s"}, **channels}
    record = {**document["record"], "file": f"{name}.csv"}
    text = toml_text({**document, "record": record, "channels": channels})
    return HouseFormat(name, {**texts, f"{name}.toml": text}, tuple(told), doubts, files)


def _share_clock(one: _Column, other: _Column) -> bool:
    if len(one.values) != len(other.values):
        return False
    if one.times is None or other.times is None:
        return one.times is other.times
    return bool(np.array_equal(one.times, other.times))


def _csv(group: list[_Column]) -> str:
    """Every number reads back to the same one."""
    clock = group[0].times
    headers = [one.header for one in group]
    cells = [one.values.tolist() for one in group]
    if clock is not None:
        headers, cells = [f"{CLOCK} [s]", *headers], [clock.tolist(), *cells]
    rows = [",".join(map(repr, row)) for row in zip(*cells, strict=True)]
    return "\n".join([",".join(headers), *rows]) + "\n"


def _markers(path: Path, sidecar: Path | None, sample_rate: float | None) -> HouseFormat:
    """Markers of a C3D file: a column an axis, empty where one was lost."""
    files: dict[str, str] = {}
    seen = read_markers(path, files, None, sample_rate)
    factor = conversion(seen.unit, "position").factor
    places = seen.places / factor
    headers = [f"{name}_{axis} [{seen.unit}]" for name in seen.names for axis in "xyz"]
    if any("," in header or '"' in header for header in headers):
        raise fault(path, "POINT:LABELS", "names without commas", one_of(seen.names), "rename them")
    rows = [
        ",".join("" if cell != cell else repr(cell) for cell in row)
        for row in places.reshape(len(places), -1).tolist()
    ]
    document: dict[str, Any] = {}
    if sidecar is not None:
        document, files[str(sidecar)] = read_toml(sidecar)
    stem = path.stem if sidecar is None else sidecar.stem
    record = {"test": "swing", **document.get("record", {}), "file": f"{stem}.csv"}
    markers = {**document.get("markers", {}), "unit": seen.unit}
    kept = {k: v for k, v in document.items() if k not in ("record", "markers")}
    kept = _in_full(kept, path.parent if sidecar is None else sidecar.parent)
    whole = {"record": {**record, "sample_rate": seen.rate}, "markers": markers, **kept}
    told = tuple(
        {"channel": name, "file": f"{stem}.csv", "samples": len(places),
         "column": f"{name}_x, {name}_y, {name}_z", "unit": seen.unit, "quantity": "position"}
        for name in seen.names
    )  # fmt: skip
    texts = {f"{stem}.csv": "\n".join([",".join(headers), *rows]) + "\n",
             f"{stem}.toml": toml_text(whole)}  # fmt: skip
    analog = _analog(path, f"{stem}_analog", files)
    return HouseFormat(
        stem, {**texts, **analog.texts}, (*told, *analog.channels), analog.doubts, files
    )


def _analog(path: Path, name: str, files: dict[str, str]) -> HouseFormat:
    """The analog channels of a C3D file, at their own rate, with a sidecar of their own."""
    table, named = read_table(path), _Named()
    assert isinstance(table, C3dTable)
    columns = []
    for key in table.analog_columns:
        label, unit = _split(table.name(key))
        if np.ptp(table.column(key, None, "column")) == 0.0:
            named.doubts.append(f"{label}: it never changes; it was left out.")
        else:
            columns.append(replace(_column(table, key, label, unit, named), times=None))
    if not columns:
        return HouseFormat(name, {}, (), tuple(named.doubts), files)
    record = {
        "description": f"analog channels of {path.name}",
        "sample_rate": float(table.content.analog_rate),
    }
    return _written(name, {"record": record}, columns, (*named.doubts, UNTOLD), files)


def _in_full(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Tables whose files are named in full, so that they are found from elsewhere."""
    found: dict[str, Any] = {}
    for key, value in document.items():
        if isinstance(value, Mapping):
            found[key] = _in_full(value, folder)
        elif key in FILES and isinstance(value, str):
            found[key] = str((folder / value).resolve())
        else:
            found[key] = value
    return found


def _split(header: str) -> tuple[str, str]:
    """A header's name and its unit; the unit is empty where none is stated."""
    match = None if _INDEX.search(header) else _BRACKETS.match(header.strip())
    name, unit = (match["name"], match["unit"]) if match else (header.strip(), "")
    return name or header.strip(), unit.strip()


def _quantity(unit: str) -> str | None:
    """The first quantity that has such a unit; None where the unit tells none."""
    if not unit or unit == "1":
        return None
    for quantity in GUESSES:
        try:
            if conversion(unit, quantity).unit == SI_UNITS[quantity]:
                return quantity
        except UnitError:
            continue
    return None


def _seconds(values: np.ndarray, unit: str, path: Path, label: str) -> np.ndarray:
    try:
        return values * conversion(unit or "s", CLOCK).factor
    except UnitError as error:
        raise fault(path, f"column '{label}'", error.expected, f"'{unit}'", error.mend) from None


def _slug(text: str, taken: set[str]) -> str:
    plain = re.sub(r"\W+", "_", text).strip("_").lower() or "channel"
    plain = f"channel_{plain}" if plain[0].isdigit() or plain == CLOCK else plain
    return _unique(plain, taken)


def _unique(text: str, taken: set[str]) -> str:
    """A name that stands once, and can be a header: without commas, quotes and brackets."""
    plain = " ".join(re.sub(r"[,;\"'\[\]()\t]", " ", text).split()) or "channel"
    name, number = plain, 2
    while name.casefold() in taken or name.casefold() in TIMES:
        name, number = f"{plain}_{number}", number + 1
    taken.add(name.casefold())
    return name


def relative_files(text: str, folder: Path) -> str:
    """A sidecar's text whose files, named in full, are named from a folder.

    Args:
        text: of the sidecar.
        folder: where it will lie.

    Returns:
        The text, with the paths under the keys of `FILES` relative to it [-].
    """
    return re.sub(
        rf'(?<![\w"-])(?P<key>{"|".join(FILES)}) = "(?P<path>/[^"]+)"',
        lambda match: f'{match["key"]} = "{os.path.relpath(match["path"], folder.resolve())}"',
        text,
    )
