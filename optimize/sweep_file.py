"""A map as a netCDF file that is valid at every instant and is filled in tile by tile."""

from __future__ import annotations

import mmap
import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.door import fault
from .sweep import GRIP_MARK, MODE_FIELDS, SHAPE, Sheet, SweepTask

TYPES = {"S1": 2, "i1": 1, "f4": 5, "f8": 6}
"""Number of each kind of value in the classic netCDF format [-]."""

LARGEST_VARIABLE = 2**32 - 4
"""Largest variable of the format [byte]."""

FILL = 2**20
"""Values that are written at once when the file is made [-]."""

LONG_NAMES = {
    "rms": "root mean square of the samples in the window",
    "peak": "largest magnitude of the samples in the window",
    "log_decrement": "logarithmic decrement, from the maxima of whole periods",
    "log_decrement_local": "logarithmic decrement, from the successive maxima",
    "log_decrement_modal": "logarithmic decrement of the oscillating mode with most energy",
    "settling": "time until the magnitude stays below 5 % of the peak",
    "grip_displacement_peak": "largest displacement of the grip in the window",
    "dominant_frequency": "damped frequency of the mode with most energy; 0 where overdamped",
    "dominant_damping_ratio": "damping ratio of the mode with most energy",
    "overdamped": "1 where the mode with most energy does not oscillate",
    "mode_changes": "1 where the mode with most energy is another one in a neighboring design",
    GRIP_MARK: "1 where the grip moves more than the limit",
    SHAPE: "mass-weighted displacement part of the mode with most energy, to unit length",
    "tile_done": "1 for each tile of designs that is complete",
}
"""What each variable is, in words."""

_UNITS = {
    "log_decrement": "1",
    "log_decrement_local": "1",
    "log_decrement_modal": "1",
    "settling": "s",
    "grip_displacement_peak": "m",
    "dominant_frequency": "Hz",
    "dominant_damping_ratio": "1",
}


def unit_of(name: str, sensor_unit: str) -> str:
    """Unit of a score or field; those read off the sensor have the sensor's [-]."""
    return _UNITS.get(name, sensor_unit)


@dataclass(frozen=True)
class _Variable:
    name: str
    dims: tuple[str, ...]
    kind: str
    told: Mapping[str, str]


def open_sheet(
    path: Path, task: SweepTask, sensor_unit: str, told: Mapping[str, str]
) -> tuple[Sheet, Path]:
    """The sheet of an unfinished map beside `path`: the one that is there, or a new one.

    A sheet is taken up only where everything that it says of itself, the sums of its inputs
    included, is what this task would say.

    Args:
        path: where the finished map will be.
        task: the grid.
        sensor_unit: unit of the sensor, as text [-].
        told: global attributes: title, provenance.

    Returns:
        The sheet, whose arrays are the file, with units as in `Sheet`, and the file's path.

    Raises:
        ValueError: where the file cannot be made, or the grid is too large for the format.

    Source: the classic netCDF format with 64-bit offsets, NetCDF users' guide, appendix B;
    tests/optimize/test_sweep_file.py reads it with another program.
    """
    unfinished = path.with_name(path.stem + ".unfinished" + path.suffix)
    sizes = {axis.name: len(axis.values) for axis in task.axes}
    sizes |= {"coordinate": len(task.mechanism.coordinates), "part": 2, "tile": task.tiles}
    variables = _variables(task, sensor_unit)
    for one in variables:
        size = int(np.prod([sizes[dim] for dim in one.dims])) * np.dtype(one.kind).itemsize
        if size > LARGEST_VARIABLE:
            expected, found = "a map of at most 4 GiB a variable", f"{size / 2**30:.1f} GiB"
            raise fault(path, one.name, expected, found, "take fewer designs")
    header, places = _header(variables, sizes, told)
    try:
        if not _is_same(unfinished, header, places):
            path.parent.mkdir(parents=True, exist_ok=True)
            _create(unfinished, header, variables, places, sizes, task)
        arrays = {
            one.name: _mapped(unfinished, one, places[one.name][0], sizes) for one in variables
        }
    except OSError as error:
        reason = error.strerror or "an error of the system"
        mend = "name another folder, or free this one"
        raise fault(unfinished, "", "a place to write to", f"'{reason}'", mend) from None
    flat = {name: array.reshape(-1) for name, array in arrays.items()}
    shape = arrays[SHAPE].reshape(task.count, -1, 2)
    fields = {name: flat[name] for name in task.fields}
    marks = {name: flat[name] for name in task.marks}
    return Sheet(fields, shape, marks, flat["tile_done"]), unfinished


def publish(unfinished: Path, path: Path) -> None:
    """Gives a finished map its name, once everything of it lies on the disk.

    Args:
        unfinished: the complete sheet's file.
        path: the map's name.
    """
    with unfinished.open("rb+") as file:
        os.fsync(file.fileno())
    os.replace(unfinished, path)


def _variables(task: SweepTask, sensor_unit: str) -> list[_Variable]:
    axes = tuple(axis.name for axis in task.axes)
    found = [
        _Variable(axis.name, (axis.name,), "f8", {"units": axis.unit, "long_name": axis.name})
        for axis in task.axes
    ]
    for name in (*task.scores, *MODE_FIELDS):
        told = {"units": unit_of(name, sensor_unit), "long_name": LONG_NAMES[name]}
        found.append(_Variable(name, axes, "f8", told))
    for name in task.marks:
        told = {"units": "1", "long_name": LONG_NAMES[name]}
        if name == GRIP_MARK:
            told["limit"] = f"{task.grip_limit!r} m"
        found.append(_Variable(name, axes, "i1", told))
    names = ", ".join(task.mechanism.coordinates)
    told = {"units": "1", "long_name": LONG_NAMES[SHAPE], "coordinate_names": names}
    found.append(
        _Variable(SHAPE, (*axes, "coordinate", "part"), "f4", told | {"parts": "real, imaginary"})
    )
    told = {"units": "1", "long_name": LONG_NAMES["tile_done"]}
    return [*found, _Variable("tile_done", ("tile",), "i1", told)]


def _header(
    variables: list[_Variable], sizes: Mapping[str, int], told: Mapping[str, str]
) -> tuple[bytes, dict[str, tuple[int, int]]]:
    """The file's head, and where each variable begins and how many values it has."""
    dims = list(sizes)

    def built(begins: Mapping[str, int]) -> bytes:
        parts = [b"CDF\x02", struct.pack(">i", 0), struct.pack(">ii", 10, len(dims))]
        parts += [_text(dim) + struct.pack(">i", sizes[dim]) for dim in dims]
        parts += [_attributes(told), struct.pack(">ii", 11, len(variables))]
        for one in variables:
            ids = [dims.index(dim) for dim in one.dims]
            parts += [_text(one.name), struct.pack(f">i{len(ids)}i", len(ids), *ids)]
            parts += [_attributes(one.told)]
            size = _padded(one, sizes)
            parts += [struct.pack(">iIq", TYPES[one.kind], size, begins[one.name])]
        return b"".join(parts)

    at = len(built({one.name: 0 for one in variables}))
    at += -at % mmap.PAGESIZE
    places = {}
    for one in variables:
        count = int(np.prod([sizes[dim] for dim in one.dims]))
        places[one.name] = (at, count)
        at += _padded(one, sizes)
    return built({name: begin for name, (begin, _) in places.items()}), places


def _padded(one: _Variable, sizes: Mapping[str, int]) -> int:
    size = int(np.prod([sizes[dim] for dim in one.dims])) * np.dtype(one.kind).itemsize
    return size + -size % 4


def _text(text: str) -> bytes:
    content = text.encode()
    return struct.pack(">i", len(content)) + content + bytes(-len(content) % 4)


def _attributes(told: Mapping[str, str]) -> bytes:
    parts = [struct.pack(">ii", 12, len(told))] if told else [bytes(8)]
    for name, value in told.items():
        parts += [_text(name), struct.pack(">i", TYPES["S1"]), _text(value)]
    return b"".join(parts)


def _end(places: Mapping[str, tuple[int, int]]) -> int:
    """Size of a complete file [byte]: its last variable holds one byte a value, padded."""
    begin, count = list(places.values())[-1]
    return begin + count + -count % 4


def _is_same(path: Path, header: bytes, places: Mapping[str, tuple[int, int]]) -> bool:
    if not path.is_file() or path.stat().st_size != _end(places):
        return False
    with path.open("rb") as file:
        return file.read(len(header)) == header


def _create(
    path: Path,
    header: bytes,
    variables: list[_Variable],
    places: Mapping[str, tuple[int, int]],
    sizes: Mapping[str, int],
    task: SweepTask,
) -> None:
    """An empty sheet: NaN for what is a number, 0 for marks; its last byte makes it whole."""
    own = {axis.name: axis.values for axis in task.axes}
    path.unlink(missing_ok=True)
    with path.open("wb") as file:
        file.write(header)
        for one in variables:
            begin, count = places[one.name]
            file.write(bytes(begin - file.tell()))
            if one.name in own:
                file.write(own[one.name].astype(">f8").tobytes())
                continue
            empty = np.nan if one.kind.startswith("f") else 0
            for low in range(0, count, FILL):
                kind = np.dtype(one.kind).newbyteorder(">")
                file.write(np.full(min(FILL, count - low), empty, kind).tobytes())
        file.write(bytes(_end(places) - file.tell()))


def _mapped(path: Path, one: _Variable, begin: int, sizes: Mapping[str, int]) -> np.ndarray:
    kind = np.dtype(one.kind).newbyteorder(">")
    shape = tuple(sizes[dim] for dim in one.dims)
    return np.memmap(path, kind, "r+", begin, shape)
