"""A coupon is a small sample in a testing machine: its load and displacement, read at the door."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.door import fault, nearest, one_of
from .clock import clock_of
from .records import Channel, read_record
from .signals import clipping, quantization_step
from .tables import TextTable, read_table
from .units import header_factor

SIZES = ("sample_height", "sample_area", "sample_diameter")
"""What [parameters] of a coupon's sidecar may state [m, m^2, m]."""

_WORDS = {
    "time": ("time", "t", "zeit", "elapsed time"),
    "load": ("load", "force", "kraft", "f", "axial force", "axial load"),
    "displacement": (
        "displacement", "extension", "position", "stroke", "disp", "compression", "x",
        "crosshead", "axial displacement", "weg",
    ),
}  # fmt: skip
_QUANTITIES = {"time": "time", "load": "force", "displacement": "position"}
_EXAMPLES = {"time": "Time (s)", "load": "Load (N)", "displacement": "Displacement (mm)"}


@dataclass(frozen=True)
class Sample:
    """Size of a coupon.

    Attributes:
        height: along the load [m].
        area: across the load [m^2].
    """

    height: float
    area: float

    @property
    def geometry_factor(self) -> float:
        """Height over area, thesis eq. 6 (line 1039) [1/m]."""
        return self.height / self.area


@dataclass(frozen=True, eq=False)
class Coupon:
    """One run of a testing machine.

    Attributes:
        name: the file's stem.
        path: the file that was named.
        rate: samples a second [Hz].
        load: shape (n,) [N].
        displacement: shape (n,) [m].
        steps: steps of the converter of load [N] and displacement [m], or what the sidecar states
            as their noise where that is more; 0 where neither shows.
        delay: how well the delay between the two channels is known [s].
        clipped: which of the two stand on flat tops, in words.
        sample: size of the coupon; None where it is not stated.
        files: every file read, with its SHA-256.
        warnings: what the door saw and let pass, in sentences.
    """

    name: str
    path: Path
    rate: float
    load: np.ndarray
    displacement: np.ndarray
    steps: tuple[float, float] = (0.0, 0.0)
    delay: float = 0.0
    clipped: tuple[str, ...] = ()
    sample: Sample | None = None
    files: Mapping[str, str] | None = None
    warnings: tuple[str, ...] = ()


def read_coupon(path: Path | str) -> Coupon:
    """Reads a run: a record's sidecar, a data file beside one, or a text file that explains itself.

    Without a sidecar the header must name time, load and displacement, each with its unit.

    Args:
        path: ``NAME.toml``, or the machine's own file.

    Returns:
        The run in SI units.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    if path.is_dir() or path.suffix.lower() == ".toml" or path.with_suffix(".toml").is_file():
        return _from_record(path)
    return _from_table(path)


def _from_record(path: Path) -> Coupon:
    record = read_record(path)
    if record.test not in ("coupon", "driven", "decay"):
        expected = "test = 'coupon'"
        raise fault(record.path, "[record] test", expected, f"'{record.test}'", f"write {expected}")
    load = _one_channel(record.channels, ("force",), "force", record.path)
    moved = _one_channel(record.channels, ("position", "deflection"), "position", record.path)
    if len(load.values) != len(moved.values) or load.clock_unknown or moved.clock_unknown:
        expected = "load and displacement on one clock"
        mend = "write both into one file: a phase needs them together"
        raise fault(record.path, "[channels]", expected, "two clocks", mend)
    for channel, unit in ((load, "N"), (moved, "m")):
        if channel.unit != unit:
            place = f"[channels.{channel.name}] unit"
            raise fault(record.path, place, f"a unit such as '{unit}'", "'1'", "write the unit")
    pair = (load, moved)
    return Coupon(
        record.name,
        record.path,
        record.sample_rate,
        load.values,
        moved.values,
        (_step(load.values, load.noise), _step(moved.values, moved.noise)),
        float(np.hypot(load.tolerance.get("delay", 0.0), moved.tolerance.get("delay", 0.0))),
        tuple(channel.name for channel in pair if clipping(channel.values) is not None),
        _sample_of(record.parameters, record.path),
        record.files,
        record.warnings,
    )


def _one_channel(
    channels: tuple[Channel, ...], quantities: tuple[str, ...], word: str, path: Path
) -> Channel:
    found = [channel for channel in channels if channel.quantity in quantities]
    if len(found) != 1:
        listed = f"{len(found)} of them" if found else "none"
        mend = f"map one column with quantity = '{word}', and leave others out"
        raise fault(path, "[channels]", f"one channel of quantity '{word}'", listed, mend)
    return found[0]


def _sample_of(stated: Mapping[str, float], path: Path) -> Sample | None:
    for name, value in stated.items():
        if name not in SIZES:
            mend = f"write '{nearest(name, SIZES) or SIZES[0]}', or remove it"
            raise fault(path, f"[parameters] {name}", one_of(SIZES), f"'{name}'", mend)
        if not value > 0:
            mend = "write it in m (area in m^2)"
            raise fault(path, f"[parameters] {name}", "a size above 0", f"{value:g}", mend)
    across = [name for name in SIZES[1:] if name in stated]
    if not stated:
        return None
    if "sample_height" not in stated or len(across) != 1:
        expected = "'sample_height' with one of 'sample_area' and 'sample_diameter'"
        mend = "state height and cross section, or neither"
        raise fault(path, "[parameters]", expected, one_of(stated), mend)
    area = stated.get("sample_area", np.pi / 4 * stated.get("sample_diameter", 0.0) ** 2)
    return Sample(stated["sample_height"], float(area))


def _from_table(path: Path) -> Coupon:
    table = read_table(path)
    if not isinstance(table, TextTable):
        mend = f"write {path.with_suffix('.toml').name} that maps the columns"
        raise fault(path, "", "a text file, or a sidecar beside it", f"{path.suffix}", mend)
    columns = {word: _column(table, word) for word in _WORDS}
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        mend = "cut the columns to one length"
        raise fault(path, "columns", "equally many rows", f"{sorted(lengths)}", mend)
    if min(lengths) < 8:
        mend = "name the right file, or sample faster"
        raise fault(path, "", "at least 8 rows of data", f"{min(lengths)}", mend)
    for word in ("load", "displacement"):
        if np.ptp(columns[word]) == 0.0:
            found = f"{len(columns[word])} samples that are all the same"
            raise fault(path, word, "a column that changes", found, "name the column measured")
    clock = clock_of(columns["time"], path, "time")
    load, moved = columns["load"], columns["displacement"]
    return Coupon(
        path.stem,
        path,
        clock.rate,
        load,
        moved,
        (_step(load, None), _step(moved, None)),
        clipped=tuple(w for w in ("load", "displacement") if clipping(columns[w]) is not None),
        files={str(path): table.sha256},
    )


def _column(table: TextTable, word: str) -> np.ndarray:
    """One column in SI units, found by its header."""
    names = table.layout.names
    plain = [name.split("[")[0].split("(")[0].strip().casefold() for name in names]
    found = [i for i, name in enumerate(plain) if name in _WORDS[word]]
    example = _EXAMPLES[word]
    sidecar = table.path.with_suffix(".toml").name
    if len(found) != 1:
        listed = one_of(names) if any(names) else "columns without names"
        mend = f"name one column '{example}', or write {sidecar} that maps the columns"
        raise fault(table.path, "header", f"one column of {word}", listed, mend)
    stated = header_factor(names[found[0]], _QUANTITIES[word])
    if stated is None:
        expected = f"the unit of {word} beside its name"
        mend = f"write '{example}', or {sidecar} that states the units"
        raise fault(table.path, "header", expected, f"'{names[found[0]]}'", mend)
    return table.column(found[0], None, word) * stated[1]


def _step(values: np.ndarray, stated: float | None) -> float:
    """The smallest difference that a channel can tell: its converter's step or stated noise."""
    return max(quantization_step(values) or 0.0, stated or 0.0)
