"""Where channels come from: opened data files, their rows and their clocks."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..model.door import fault, nearest, one_of
from .clock import RATE_AGREEMENT, Clock, agreed_rate, check_stated_rate, clock_of
from .sidecar import CLOCK, ChannelTable, RecordTable, TimeTable
from .tables import UNIVERSAL, Table, read_table
from .units import ARBITRARY, Conversion, UnitError, conversion, header_factor
from .vectors import TIMES, Rows

FEWEST_SAMPLES = 8
"""Fewest samples that make a record [-]."""

SUFFIXES = (".csv", ".txt", ".mat", ".tdms", *UNIVERSAL, ".c3d")
"""How data files are called, in the order in which they are looked for beside a sidecar [-]."""


@dataclass(frozen=True)
class Source:
    """Where channels are read from: one opened table, its rows and its clock.

    Attributes:
        sidecar: the file that asks.
        table: the opened data file.
        rows: the first and one past the last; None for all.
        clock: rate [Hz] and first time [s].
        column: the clock's column; empty without one.
        length: samples of the clock's column; None without one.
    """

    sidecar: Path
    table: Table
    rows: Rows
    clock: Clock
    column: str
    length: int | None


@dataclass
class Notes:
    """What reading one record gathers on the way.

    Attributes:
        tables: the opened data files.
        warnings: what was seen and let pass, in sentences.
    """

    tables: dict[Path, Table] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


def _data_path(path: Path, named: str | None) -> Path:
    candidates = [path.with_suffix(suffix) for suffix in SUFFIXES]
    if named is not None:
        candidates = [path.parent / named]
    data = next((each for each in candidates if each.exists()), None)
    if data is None:
        listed = one_of(each.name for each in candidates)
        expected = f"the data file {listed}" if named else f"a data file, one of {listed}"
        beside = [e.name for e in sorted(path.parent.glob("*"))[:500] if e.suffix != ".toml"]
        like = nearest(candidates[0].name, beside)
        mend = f"write file = '{like}'" if like else "correct 'file', relative to this file"
        raise fault(path, "[record] file", expected, "none of that name", mend)
    return data


def _opened(data: Path, header_rows: int, notes: Notes) -> Table:
    if data not in notes.tables:
        notes.tables[data] = read_table(data, header_rows)
    return notes.tables[data]


def own_source(path: Path, record: RecordTable, time: TimeTable | None, notes: Notes) -> Source:
    """The record's own file with its clock, from a column of times or from a stated rate.

    Args:
        path: the sidecar.
        record: its table [record].
        time: its table [channels.time]; None where there is none.
        notes: takes the opened file and warnings.

    Returns:
        The source of the channels that have no file of their own.

    Raises:
        ValueError: where the file or a clock is missing, or times are uneven.
    """
    table = _opened(_data_path(path, record.file), record.header_rows, notes)
    rows = None if record.samples is None else (record.samples[0], record.samples[1])
    if time is None:
        rate = table.own_rate if record.sample_rate is None else record.sample_rate
        if rate is None:
            mend = "add sample_rate = ... [Hz], or [channels.time] with column and unit"
            raise fault(path, "[record] sample_rate", "a clock", "neither rate nor times", mend)
        if record.sample_rate is not None and table.own_rate is None:
            _check_unmapped_times(path, table, rows, rate)
        return Source(path, table, rows, Clock(rate, 0.0), "", None)
    place = f"[channels.{CLOCK}]"
    values = table.column(time.column, rows, f"{place} column")
    converted = si_conversion(path, place, time.unit, CLOCK, None)
    if converted.unit == ARBITRARY:
        mend = "write the unit of the column, or remove it and give 'sample_rate'"
        raise fault(path, f"{place} unit", "a unit of time such as 's'", "'1'", mend)
    compare_header(table, time.column, "time", time.unit, converted, CLOCK, notes)
    require_enough(len(values), table, f"column '{time.column}'")
    start = 0 if rows is None else rows[0]
    clock = clock_of(values * converted.factor, table.path, str(time.column), start)
    if record.sample_rate is not None:
        clock = Clock(
            agreed_rate(path, record.sample_rate, clock.rate, "the time column"), clock.start
        )
    return Source(path, table, rows, clock, str(time.column), len(values))


def _check_unmapped_times(path: Path, table: Table, rows: Rows, stated: float) -> None:
    """A column of times that the sidecar leaves out must not run otherwise than its rate."""
    for key in table.columns:
        header = table.name(key)
        if header.split("[")[0].split("(")[0].strip().casefold() not in TIMES:
            continue
        told = header_factor(header, CLOCK)
        try:
            times = table.column(key, rows, CLOCK) * (told[1] if told else 1.0)
        except ValueError:
            continue  # a column that nobody asks for may hold anything
        check_stated_rate(path, stated, times, header)


def channel_source(own: Source, name: str, table: ChannelTable, notes: Notes) -> Source:
    """Where one channel is read from: its own file and clock where it names them.

    Args:
        own: the record's own source.
        name: the channel.
        table: its table in the sidecar.
        notes: takes the opened file and warnings.

    Returns:
        `own`, or a source with another clock.

    Raises:
        ValueError: where the file is missing, or its times are uneven.
    """
    path, place = own.sidecar, f"[channels.{name}]"
    if table.file is not None:
        data = path.parent / table.file
        if not data.exists():
            expected = f"the data file '{table.file}', relative to this file"
            raise fault(path, f"{place} file", expected, "none of that name", "correct the name")
        source = _with_clock(path, place, _opened(data, 0, notes), None, table.time)
    elif table.time is not None:
        source = _with_clock(path, place, own.table, own.rows, table.time)
    else:
        source = own
    _check_rate(source, f"{place} column", table.column)
    return source


def _check_rate(source: Source, place: str, column: str | int) -> None:
    """A file that keeps a rate for each channel must keep the clock's for this one."""
    rate = source.table.rate_of(column, place)
    if rate is not None and abs(rate / source.clock.rate - 1.0) > RATE_AGREEMENT:
        mend = f"name the file as this channel's own, with time = 'time:{column}'"
        expected = f"{source.clock.rate:.6g} Hz, as its clock"
        raise fault(source.sidecar, place, expected, f"{rate:.6g} Hz in the file", mend)


def _with_clock(path: Path, place: str, opened: Table, rows: Rows, column: str | int) -> Source:
    values = opened.column(column, rows, f"{place} time")
    stated = header_factor(opened.name(column), CLOCK)
    factor = stated[1] if stated else 1.0
    require_enough(len(values), opened, f"column '{column}'")
    clock = clock_of(values * factor, opened.path, str(column), rows[0] if rows else 0)
    return Source(path, opened, rows, clock, str(column), len(values))


def si_conversion(
    path: Path, place: str, unit: str, quantity: str, scale: float | None
) -> Conversion:
    """As `conversion`, with the sidecar's file and place in the message.

    Args:
        path: the sidecar.
        place: the table that states the unit.
        unit: the unit.
        quantity: the contract's word, or ``time``.
        scale: the sidecar's multiplier, if any.

    Returns:
        The factor to SI [SI unit per unit of the file], and the unit.

    Raises:
        ValueError: where the unit does not fit the quantity.
    """
    try:
        return conversion(unit, quantity, scale)
    except UnitError as error:
        raise fault(path, f"{place} unit", error.expected, f"'{unit}'", error.mend) from None


def compare_header(
    table: Table,
    column: str | int,
    quantity: str,
    unit: str,
    converted: Conversion,
    name: str,
    notes: Notes,
    scale: float | None = None,
) -> None:
    """Notes a warning where a header states another unit than the sidecar.

    Args:
        table: the data file.
        column: the column in question.
        quantity: the contract's word, or ``time``.
        unit: what the sidecar says.
        converted: what it was understood as.
        name: the channel, for the sentence.
        notes: takes the warning.
        scale: the sidecar's multiplier; with one, units may well differ.
    """
    if unit == ARBITRARY or scale is not None:
        return
    header = table.name(column)
    if f"({unit})" in header or f"[{unit}]" in header:
        return
    stated = header_factor(header, quantity)
    if stated is not None and not np.isclose(stated[1], converted.factor, rtol=1e-6):
        notes.warnings.append(
            f"{name}: the header '{header}' states '{stated[0]}', the sidecar '{unit}'; "
            "the sidecar was believed."
        )


def require_enough(count: int, table: Table, place: str) -> None:
    """Refuses a column too short to be a record.

    Args:
        count: its samples [-].
        table: the data file.
        place: the column, for the message.

    Raises:
        ValueError: with fewer than `FEWEST_SAMPLES`.
    """
    if count < FEWEST_SAMPLES:
        found = f"{count} row{'' if count == 1 else 's'}"
        mend = "name the right file, or widen 'samples'"
        raise fault(table.path, place, f"at least {FEWEST_SAMPLES} rows of data", found, mend)
