"""A sidecar is the TOML file that says what the columns of a record mean."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from ..model.door import fault, one_of, read_toml, rule, validated

CLOCK = "time"
"""The name of the channel that is the clock [-]."""

Quantity = Literal[
    "position",
    "velocity",
    "acceleration",
    "angle",
    "angular_velocity",
    "angular_acceleration",
    "force",
    "torque",
    "strain",
    "deflection",
    "voltage",
]
Test = Literal["decay", "impact", "driven", "swing", "coupon", "modal"]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _column(value: Any) -> str | int:
    expected, mend = "a column's name or its number from 0", "write column = 'name' or column = 0"
    if isinstance(value, bool) or not isinstance(value, str | int):
        raise rule(expected, mend)
    if (isinstance(value, int) and value < 0) or value == "":
        raise rule(expected, mend, f"'{value}'")
    return value


def _rows(value: list[int]) -> list[int]:
    if len(value) != 2 or not 0 <= value[0] < value[1]:
        raise rule("two numbers of rows, [first, one past the last]", "write samples = [0, 8192]")
    return value


def _scale(value: float) -> float:
    if value == 0.0:
        raise rule("a number other than 0", "write the units of the quantity per unit of the file")
    return value


Column = Annotated[Any, AfterValidator(_column)]


class ToleranceTable(_Table):
    """How well a channel's chain is known: standard deviations.

    Attributes:
        gain: of its sensitivity [1].
        delay: of its delay [s].
        offset: of its zero, in the channel's unit.
        radius: of the sensor's place along the club [m].
    """

    gain: float | None = Field(default=None, ge=0.0)
    delay: float | None = Field(default=None, ge=0.0)
    offset: float | None = Field(default=None, ge=0.0)
    radius: float | None = Field(default=None, ge=0.0)


class CalibrationTable(_Table):
    """How a strain gauge read while the grip was clamped and the head was held aside.

    Attributes:
        deflection: of the head [`deflection_unit`].
        reading: of the channel, before its `scale`, as its file would hold it [the channel's unit].
        deflection_unit: such as m or mm.
    """

    deflection: list[float]
    reading: list[float]
    deflection_unit: str = "m"

    @model_validator(mode="after")
    def _paired(self) -> CalibrationTable:
        if len(self.deflection) != len(self.reading):
            found = f"{len(self.deflection)} and {len(self.reading)}"
            raise rule("a reading for each deflection", "give them in pairs", found)
        return self


class ProfileTable(_Table):
    """How well the profile that a swing's record lies beside is known: standard deviations.

    Attributes:
        grip_std: of the grip's angle, one error for the whole swing [rad].
        impact_std: of the instant of impact [s].
    """

    grip_std: float | None = Field(default=None, ge=0.0)
    impact_std: float | None = Field(default=None, ge=0.0)


class TimeTable(_Table):
    """The clock's column.

    Attributes:
        column: name or number from 0.
        unit: of its numbers, such as s.
    """

    column: Column
    unit: str = "s"


class ChannelTable(_Table):
    """One channel of a record.

    Attributes:
        column: name or number from 0.
        unit: of its numbers.
        role: response or input.
        quantity: what was measured.
        place: where.
        frame: absolute, or relative to the collet.
        noise: standard deviation, in `unit`.
        file: another data file than the record's.
        time: that file's column of times [s].
        clock_offset: added to that file's times [s].
        scale: multiplies the numbers [unit of the quantity per unit of the file].
        held: whether an input keeps its value until the next sample.
        clipped: whether flat tops are known and accepted.
        tolerance: how well the chain is known.
        calibration: readings of a strain gauge at known deflections.
    """

    column: Column
    unit: str
    role: Literal["response", "input"]
    quantity: Quantity
    place: str
    frame: Literal["absolute", "collet"] = "absolute"
    noise: float | None = Field(default=None, gt=0.0)
    file: str | None = None
    time: Annotated[Any, AfterValidator(_column)] = None
    clock_offset: float | None = None
    scale: Annotated[float, AfterValidator(_scale)] | None = None
    held: bool = False
    clipped: bool = False
    tolerance: ToleranceTable = Field(default_factory=ToleranceTable)
    calibration: CalibrationTable | None = None

    @model_validator(mode="after")
    def _belongs(self) -> ChannelTable:
        if self.held and self.role == "response":
            raise rule("'held' at an input only", "remove 'held'", "it at a response")
        if self.file is not None and self.time is None:
            mend = "add time = the name of that file's time column"
            raise rule("'time' beside 'file'", mend, "'file' alone")
        if self.clock_offset is not None and self.file is None:
            mend = "remove it, or name the channel's own 'file'"
            raise rule("'clock_offset' beside 'file'", mend, "'clock_offset' alone")
        if self.calibration is not None and self.quantity != "strain":
            mend = "remove it, or write quantity = 'strain'"
            raise rule("'calibration' at a strain only", mend, f"it at '{self.quantity}'")
        return self


class RecordTable(_Table):
    """What the record is.

    Attributes:
        file: its data file, relative to the sidecar.
        test: kind of test.
        rig: its rig, relative to the sidecar.
        description: in words.
        sample_rate: samples a second [Hz].
        samples: first row, and one past the last.
        header_rows: lines to pass over.
        split: train, held_out or auto.
    """

    file: str | None = None
    test: Test | None = None
    rig: str | None = None
    description: str = ""
    sample_rate: float | None = Field(default=None, gt=0.0)
    samples: Annotated[list[int], AfterValidator(_rows)] | None = None
    header_rows: int = Field(default=0, ge=0)
    split: Literal["train", "held_out", "auto"] = "auto"


class _Clock(_Table):
    time: TimeTable


class _ClockFile(_Table):
    channels: _Clock


class Sidecar(_Table):
    """A whole sidecar.

    Attributes:
        record: what the record is.
        channels: the channels by name, without the clock.
        parameters: what differed from the rig on that day [SI], by the rig's names.
        start: what is known of the state at the first sample [SI].
        profile: how well the profile beside a swing's record is known.
    """

    record: RecordTable = Field(default_factory=RecordTable)
    channels: dict[str, ChannelTable]
    parameters: dict[str, float] = Field(default_factory=dict)
    start: dict[str, float] = Field(default_factory=dict)
    profile: ProfileTable = Field(default_factory=ProfileTable)


def read_sidecar(path: Path) -> tuple[Sidecar, TimeTable | None, str]:
    """Reads a sidecar and checks its keys and values.

    Args:
        path: the TOML file.

    Returns:
        The sidecar, its clock (None where the record has a rate only) and the SHA-256 of its bytes.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    document, sha256 = read_toml(path)
    for stranger, what in (("rig", "a rig"), ("drive", "a drive"), ("swing", "a swing")):
        if stranger in document and "channels" not in document:
            mend = "name the record's TOML; a rig is named in it, or by --rig"
            raise fault(path, f"[{stranger}]", "a record", what, mend)
    channels = document.get("channels")
    if not isinstance(channels, Mapping) or not set(channels) - {CLOCK}:
        found = f"the tables {one_of(document)}" if document else "an empty file"
        found = "[channels.time] only" if channels else found
        mend = "add [channels.NAME] with column, unit, role, quantity and place"
        raise fault(path, "[channels]", "at least one channel", found, mend)
    clock = None
    if CLOCK in channels:
        clock = validated(_ClockFile, {"channels": {CLOCK: channels[CLOCK]}}, path).channels.time
    others = {name: table for name, table in channels.items() if name != CLOCK}
    tables = {**document, "channels": others}
    if "parameters" in document:
        tables["parameters"] = _flat(document["parameters"])
    return validated(Sidecar, tables, path), clock, sha256


def _flat(table: Any) -> Any:
    """Names such as ``masses.cart.mass`` written without quotes are nested tables: join them."""
    if not isinstance(table, Mapping):
        return table
    flat: dict[str, Any] = {}
    for key, value in table.items():
        inner = _flat(value)
        if isinstance(value, Mapping):
            flat |= {f"{key}.{name}": number for name, number in inner.items()}
        else:
            flat[key] = inner
    return flat
