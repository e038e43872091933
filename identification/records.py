"""A record is what was measured in one test: checked once at the door, in SI units, read-only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..model.door import fault, nearest, one_of
from ..model.rig import Rig
from ..model.robot import PARAMETERS
from .sidecar import CalibrationTable, ChannelTable, Sidecar, read_sidecar
from .signals import Clipping, clipping
from .sources import (
    Notes,
    Source,
    channel_source,
    compare_header,
    own_source,
    require_enough,
    si_conversion,
)
from .tables import Table
from .units import Conversion

if TYPE_CHECKING:
    from .strain import Calibration

MOST_CLIPPED = 0.01
"""Largest share of clipped samples that passes with a warning [-]; beyond it `clipped = true`
in the channel's table says that they are meant to be used."""

LARGEST_NUMBER = 1e30
"""Largest number that can have been measured [the file's unit]."""

ROTATION = ("angle", "angular_velocity", "angular_acceleration", "torque")
TRANSLATION = ("position", "velocity", "acceleration", "force", "deflection")


@dataclass(frozen=True, eq=False)
class Channel:
    """One column of a record, in SI units.

    Attributes:
        name: the sidecar's name for it.
        role: ``response`` or ``input``.
        quantity: the contract's word.
        place: where it was measured or acts.
        frame: ``absolute``, or ``collet`` for relative to the collet.
        unit: SI unit as text; ``1`` for data without a unit.
        values: shape (n,), float64, read-only, finite [unit].
        noise: standard deviation of its noise [unit]; None where nothing is stated.
        tolerance: standard deviations of ``gain`` [1], ``delay`` [s], ``offset`` [unit] and
            ``radius`` [m]; only those stated.
        held: whether an input keeps its value until the next sample; otherwise it is a straight
            line between samples.
        sample_rate: samples a second [Hz].
        start_time: its first sample on the record's clock [s].
        clock_offset: what was added to another file's own clock [s]; None where the channel has
            the record's clock, or where the offset is unknown.
        clock_unknown: whether it comes from another file whose offset is unknown; `start_time`
            then supposes none.
        clipped: flat tops that were found; None where there are none.
        file: the data file that it was read from.
        calibration: of a strain gauge by its own readings at known deflections [1/m, 1]; None where
            the sidecar has none.
    """

    name: str
    role: Literal["response", "input"]
    quantity: str
    place: str
    frame: str
    unit: str
    values: np.ndarray
    noise: float | None
    tolerance: dict[str, float]
    held: bool
    sample_rate: float
    start_time: float
    clock_offset: float | None = None
    clock_unknown: bool = False
    clipped: Clipping | None = None
    file: Path | None = None
    calibration: Calibration | None = None


@dataclass(frozen=True, eq=False)
class Record:
    """One measured test.

    Attributes:
        name: the sidecar's stem.
        path: the sidecar.
        test: decay, impact, driven, swing, coupon or modal.
        description: the sidecar's own.
        sample_rate: samples a second [Hz].
        times: shape (n,), from 0, even, read-only [s].
        channels: responses and inputs.
        parameters: what differed from the rig on that day [SI], by the rig's names.
        start: what is known of the state at the first sample [SI]; ``at`` is on `times` [s].
        split: train, held_out or auto.
        rig_path: its rig; None where none is named.
        files: every file read, with its SHA-256.
        warnings: what the door saw and let pass, in sentences.
        profile_std: standard deviations of the profile beside a swing's record: ``grip`` [rad] and
            ``impact`` [s]; only those stated.
    """

    name: str
    path: Path
    test: str
    description: str
    sample_rate: float
    times: np.ndarray
    channels: tuple[Channel, ...]
    parameters: dict[str, float]
    start: dict[str, float]
    split: str
    rig_path: Path | None
    files: dict[str, str]
    warnings: tuple[str, ...] = ()
    profile_std: Mapping[str, float] = field(default_factory=dict)

    @property
    def responses(self) -> tuple[Channel, ...]:
        """The channels that a model has to explain."""
        return tuple(channel for channel in self.channels if channel.role == "response")

    @property
    def inputs(self) -> tuple[Channel, ...]:
        """The channels that drive a model."""
        return tuple(channel for channel in self.channels if channel.role == "input")

    def channel(self, name: str) -> Channel:
        """The channel of that name.

        Args:
            name: the sidecar's name for it.

        Returns:
            The channel.

        Raises:
            ValueError: naming the channels that there are.
        """
        for channel in self.channels:
            if channel.name == name:
                return channel
        names = [channel.name for channel in self.channels]
        like = nearest(name, names) or names[0]
        raise fault(self.path, "[channels]", one_of(names), f"'{name}'", f"name '{like}'")


def read_record(path: Path | str, rig: Path | str | None = None) -> Record:
    """Reads a record: its sidecar and the columns that it maps, converted to SI units.

    Args:
        path: the sidecar ``NAME.toml``, or the data file beside it.
        rig: a rig that overrides the sidecar's.

    Returns:
        The record; nothing of it is missing, NaN, uneven in time or in foreign units.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = _sidecar_path(Path(path))
    sidecar, time, sha256 = read_sidecar(path)
    if sidecar.record.test == "modal":
        mend = "this reader takes samples against time; remove test = 'modal'"
        raise fault(path, "[record] test", "a test with samples in time", "'modal'", mend)
    if all(channel.role == "input" for channel in sidecar.channels.values()):
        mend = "say role = 'response' for what was measured in answer"
        raise fault(path, "[channels]", "at least one response", "inputs only", mend)
    notes = Notes()
    source = own_source(path, sidecar.record, time, notes)
    read = [_channel(name, table, source, notes) for name, table in sidecar.channels.items()]
    channels = _same_length(read, source, sidecar)
    length = next((len(c.values) for c in channels if not _is_foreign(c)), len(channels[0].values))
    times = np.arange(length) / source.clock.rate
    times.flags.writeable = False
    files = {str(path): sha256} | {str(file): table.sha256 for file, table in notes.tables.items()}
    return Record(
        name=path.stem,
        path=path,
        test=sidecar.record.test or _likely_test(channels),
        description=sidecar.record.description,
        sample_rate=source.clock.rate,
        times=times,
        channels=channels,
        parameters=dict(sidecar.parameters),
        start=_start(sidecar.start, source, times, time is not None),
        split=sidecar.record.split,
        rig_path=_rig_path(path, sidecar.record.rig, rig),
        files=files,
        warnings=tuple(notes.warnings),
        profile_std={
            key.removesuffix("_std"): float(value)
            for key, value in sidecar.profile.model_dump(exclude_none=True).items()
        },
    )


def _sidecar_path(path: Path) -> Path:
    if path.suffix.lower() == ".toml" or path.is_dir():
        return path
    beside = path.with_suffix(".toml")
    if beside.is_file():
        return beside
    found = "none beside it" if path.is_file() else "neither it nor the file itself"
    mend = f"write {beside.name} that maps the columns, and name that"
    raise fault(path, "", f"a sidecar {beside.name}", found, mend)


def _likely_test(channels: tuple[Channel, ...]) -> str:
    return "driven" if any(channel.role == "input" for channel in channels) else "decay"


def _rig_path(path: Path, named: str | None, override: Path | str | None) -> Path | None:
    if override is not None:
        return Path(override)
    if named is None:
        return None
    rig = path.parent / named
    if not rig.is_file():
        found = "a directory" if rig.is_dir() else "none of that name"
        expected = f"the rig '{named}', relative to this file"
        raise fault(path, "[record] rig", expected, found, "correct the name, or give --rig")
    return rig


def _channel(name: str, table: ChannelTable, own: Source, notes: Notes) -> Channel:
    path, place = own.sidecar, f"[channels.{name}]"
    source = channel_source(own, name, table, notes)
    converted = si_conversion(path, place, table.unit, table.quantity, table.scale)
    raw = source.table.column(table.column, source.rows, f"{place} column")
    require_enough(len(raw), source.table, f"column '{table.column}'")
    compare_header(
        source.table, table.column, table.quantity, table.unit, converted, name, notes, table.scale
    )
    _check_values(raw, source.table, table.column)
    values = raw * converted.factor
    values.flags.writeable = False
    start = source.clock.start + (table.clock_offset or 0.0) - own.clock.start
    return Channel(
        name=name,
        role=table.role,
        quantity=table.quantity,
        place=table.place,
        frame=table.frame,
        unit=converted.unit,
        values=values,
        noise=None if table.noise is None else table.noise * converted.spread,
        tolerance=_tolerance(table, converted),
        held=table.held,
        sample_rate=source.clock.rate,
        start_time=start if source is not own else 0.0,
        clock_offset=table.clock_offset,
        clock_unknown=table.file is not None and table.clock_offset is None,
        clipped=_checked_clipping(values, table, source.table, converted),
        file=source.table.path,
        calibration=_calibration(path, f"{place} calibration", table.calibration, converted),
    )


def _calibration(
    path: Path, place: str, table: CalibrationTable | None, converted: Conversion
) -> Calibration | None:
    if table is None:
        return None
    from .strain import calibrate

    bent = si_conversion(path, place, table.deflection_unit, "deflection", None).factor
    deflections, readings = bent * np.array(table.deflection), np.array(table.reading)
    try:
        return calibrate(deflections, converted.factor * readings)
    except ValueError as error:
        raise ValueError(f"{path}: {place}: {error}") from None


def _check_values(raw: np.ndarray, table: Table, column: str | int) -> None:
    place = f"column '{column}'"
    if np.ptp(raw) == 0.0:
        mend = "leave that channel out, or name the column that was measured"
        found = f"{len(raw)} samples that are all the same"
        raise fault(table.path, place, "a channel that changes", found, mend)
    worst = int(np.argmax(np.abs(raw)))
    if abs(raw[worst]) > LARGEST_NUMBER:
        mend = "mend that number; machines write such ones for a channel that is not connected"
        expected = f"numbers of at most {LARGEST_NUMBER:g}"
        raise fault(table.path, f"{place}, sample {worst}", expected, f"{raw[worst]:g}", mend)


def _checked_clipping(
    values: np.ndarray, table: ChannelTable, source: Table, converted: Conversion
) -> Clipping | None:
    found = clipping(values)
    allowed = table.clipped or table.role == "input"  # what is commanded may well be flat
    if found is not None and found.share > MOST_CLIPPED and not allowed:
        levels = [level for level in (found.low, found.high) if level is not None]
        at = " and ".join(f"{level / converted.factor:.6g}" for level in levels)
        mend = (
            "repeat with a larger range, cut the flat part off with 'samples', or write "
            "clipped = true in the channel to use it as it is"
        )
        text = f"{100 * found.share:.1f} % of its samples clipped at {at} in {found.runs} flat tops"
        raise fault(
            source.path, f"column '{table.column}'", "a channel within its range", text, mend
        )
    return found


def _tolerance(table: ChannelTable, converted: Conversion) -> dict[str, float]:
    stated = table.tolerance.model_dump(exclude_none=True)
    if "offset" in stated:
        stated["offset"] *= converted.spread
    return {key: float(value) for key, value in stated.items()}


def _is_foreign(channel: Channel) -> bool:
    return channel.clock_unknown or channel.clock_offset is not None


def _same_length(channels: list[Channel], own: Source, sidecar: Sidecar) -> tuple[Channel, ...]:
    """Channels on the record's clock must be equally long, and not outlast its times."""
    shared = [channel for channel in channels if sidecar.channels[channel.name].file is None]
    lengths = {channel.name: len(channel.values) for channel in shared}
    if len(set(lengths.values())) > 1:
        shortest = min(lengths.values())
        found = ", ".join(f"{count} of '{name}'" for name, count in lengths.items())
        mend = f"write samples = [0, {shortest}] in [record]"
        raise fault(own.table.path, "columns", "equally many samples", found, mend)
    if lengths and own.length is not None and max(lengths.values()) > own.length:
        found = f"{max(lengths.values())} samples for {own.length} times"
        mend = f"write samples = [0, {own.length}] in [record]"
        raise fault(own.table.path, f"column '{own.column}'", "a time for each", found, mend)
    return tuple(channels)


def _start(
    stated: Mapping[str, float], source: Source, times: np.ndarray, has_times: bool
) -> dict[str, float]:
    """The stated start; `at` is moved from the file's clock to that of the record."""
    start = {key: float(value) for key, value in stated.items()}
    if "at" in start:
        start["at"] -= source.clock.start if has_times else 0.0
        if start["at"] > times[-1]:
            expected = f"a time before the end of the record, {times[-1]:.6g} s"
            found = f"{start['at']:.6g} s after its first sample"
            mend = "correct 'at'; it is in s on the record's clock"
            raise fault(source.sidecar, "[start] at", expected, found, mend)
    return start


def check_record_against_rig(record: Record, rig: Rig) -> None:
    """Checks that a record's places, quantities and parameters exist in a rig.

    Args:
        record: the record.
        rig: the rig that it was measured on.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    for channel in record.channels:
        place = f"[channels.{channel.name}]"
        if channel.place not in rig.places:
            expected = f"a place of {rig.path.name}: {one_of(rig.places)}"
            mend = f"write '{nearest(channel.place, rig.places) or rig.places[0]}'"
            raise fault(record.path, f"{place} place", expected, f"'{channel.place}'", mend)
        if rig.kind == "robot":
            continue
        if channel.frame != "absolute":
            mend = "remove 'frame', or name a robot's rig"
            expected = "'absolute': a chain has no collet"
            raise fault(record.path, f"{place} frame", expected, f"'{channel.frame}'", mend)
        strange = TRANSLATION if rig.motion == "rotation" else ROTATION
        if channel.quantity in strange:
            fitting = ROTATION if rig.motion == "rotation" else TRANSLATION
            other = "translation" if rig.motion == "rotation" else "rotation"
            expected = f"a quantity of a {rig.motion}: {one_of(fitting)}"
            mend = f"write that quantity, or motion = '{other}' under [rig] of {rig.path.name}"
            raise fault(record.path, f"{place} quantity", expected, f"'{channel.quantity}'", mend)
    _check_parameters(record, rig)


def _check_parameters(record: Record, rig: Rig) -> None:
    known = PARAMETERS if rig.kind == "robot" else rig.parameters
    for name, value in record.parameters.items():
        place = f"[parameters] {name}"
        if name not in known:
            expected = f"a parameter of {rig.path.name}: {one_of(known, 24)}"
            like = nearest(name, known)
            mend = f"write '{like}'" if like else "write one of these names"
            raise fault(record.path, place, expected, f"'{name}'", mend)
        unit, low = known[name].unit, known[name].low
        if (unit in ("kg", "kg m^2") and value <= 0.0) or (low >= 0.0 > value):
            above = "above" if unit in ("kg", "kg m^2") else "of at least"
            mend = f"write what it was on that day, in {unit}"
            raise fault(record.path, place, f"a value {above} 0 {unit}", f"{value:g}", mend)


def split_records(
    records: Sequence[Record], held: Sequence[Record]
) -> tuple[list[Record], list[Record], str]:
    """Which records are fitted and which are kept back, and how that was decided."""
    named = [r for r in records if r.split == "held_out"]
    rest = [r for r in records if r.split != "held_out"]
    kept = [*named, *[r for r in held if r.path not in {n.path for n in named}]]
    rest = [r for r in rest if r.path not in {k.path for k in kept}]
    if not rest:
        raise ValueError(
            "records: expected at least one to fit, found only held-out ones. "
            "Mend: give one without split = 'held_out'."
        )
    if kept:
        return rest, kept, "held out as the command or the sidecars say"
    free = [r for r in rest if r.split == "auto"]
    if len(rest) < 3 or not free:
        return rest, [], "no record could be spared to be held out"
    order = sorted(free, key=lambda r: float(np.ptp(r.responses[0].values)))
    chosen = order[len(order) // 2]
    rest = [r for r in rest if r is not chosen]
    return rest, [chosen], "the suite held out the record of middle amplitude"
