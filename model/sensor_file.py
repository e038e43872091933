"""A bench's sensors as their file describes them, read and checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from .door import fault, one_of, read_toml, validated
from .linear import Port
from .robot import STRAIN_PER_BEND
from .sensors import FEEDBACK_RATE, Sensor, accelerometer, encoder, strain_gauge

_WHERE = ("kind", "place", "quantity", "frame")
_KEYS = {
    "accelerometer": (
        *("mass", "tilt", "delay", "gain", "highpass", "lowpass", "offset", "saturation"),
    ),
    "strain_gauge": ("calibration", "offset", "drift"),
    "encoder": ("rate", "quantum", "offset", "delay"),
}
_SEES = {
    "accelerometer": ("acceleration",),
    "strain_gauge": ("strain", "deflection"),
    "encoder": ("angle",),
}
_PLACES = {"strain_gauge": "shaft"}
_MAKE: dict[str, Callable[..., Sensor]] = {
    "accelerometer": accelerometer,
    "strain_gauge": strain_gauge,
    "encoder": encoder,
}


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _Sensor(_Table):
    kind: Literal["accelerometer", "strain_gauge", "encoder"]
    place: str | None = None
    quantity: str | None = None
    frame: Literal["absolute", "collet"] = "absolute"
    mass: float = Field(default=0.0, ge=0.0)
    tilt: float = Field(default=0.0, ge=-1.57, le=1.57)
    delay: float = Field(default=0.0, ge=0.0)
    gain: float = Field(default=0.0, gt=-1.0)
    highpass: float = Field(default=0.0, ge=0.0)
    lowpass: float | None = Field(default=None, gt=0.0)
    offset: float = 0.0
    saturation: float | None = Field(default=None, gt=0.0)
    calibration: float = Field(default=STRAIN_PER_BEND, gt=0.0)
    drift: float = 0.0
    rate: float = Field(default=FEEDBACK_RATE, gt=0.0)
    quantum: float = Field(default=0.0, ge=0.0)


class _File(_Table):
    sensors: dict[str, _Sensor]


def read_sensors(path: Path | str) -> tuple[tuple[Sensor, ...], str]:
    """Reads a table of sensors.

    Args:
        path: a TOML file with ``[sensors.NAME]`` tables: ``kind``, ``place``, ``quantity``,
            ``frame``, and the arguments of `accelerometer`, `strain_gauge` or `encoder` [SI].

    Returns:
        The sensors in the order of the file, and the SHA-256 of its bytes.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    document, sha256 = read_toml(path)
    if "sensors" not in document:
        found = f"the tables {one_of(document)}" if document else "an empty file"
        mend = "add one such as [sensors.head] with kind = 'accelerometer'"
        raise fault(path, "[sensors]", "tables [sensors.NAME]", found, mend)
    file = validated(_File, document, path)
    return tuple(
        _sensor(name, table, document["sensors"][name], path)
        for name, table in file.sensors.items()
    ), sha256


def _sensor(name: str, table: _Sensor, given: Mapping[str, Any], path: Path) -> Sensor:
    at, keys = f"[sensors.{name}]", _KEYS[table.kind]
    if name == "time":
        raise fault(path, at, "a name that no other column has", "'time'", "rename the sensor")
    for key in given:
        if key not in (*_WHERE, *keys):
            expected = f"a key of the kind '{table.kind}': {one_of((*_WHERE, *keys), 20)}"
            raise fault(path, f"{at} {key}", expected, f"'{key}'", "remove it, or change 'kind'")
    sees, place = _SEES[table.kind], table.place or _PLACES.get(table.kind)
    if place is None:
        mend = "add place = 'clubhead'" if table.kind == "accelerometer" else "add place = 'wrist'"
        raise fault(path, f"{at} place", "where the sensor sits", "nothing", mend)
    quantity = table.quantity or sees[0]
    if quantity not in sees:
        mend = f"write '{sees[0]}', or leave it out"
        raise fault(path, f"{at} quantity", one_of(sees), f"'{quantity}'", mend)
    own = {key: getattr(table, key) for key in keys}
    return _MAKE[table.kind](Port(place, quantity, table.frame), name, **own)
