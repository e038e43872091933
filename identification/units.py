"""Units of laboratories become SI units at the door, and must fit what was measured."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pint

SI_UNITS = {
    "position": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "angle": "rad",
    "angular_velocity": "rad/s",
    "angular_acceleration": "rad/s^2",
    "force": "N",
    "torque": "N m",
    "strain": "1",
    "deflection": "m",
    "voltage": "V",
    "time": "s",
}
"""The SI unit of each quantity of the contract [-]."""

STANDARD_GRAVITY = 9.80665
"""One g [m/s^2]; CODATA, exact by definition."""

ARBITRARY = "1"
"""The unit of data without one: allowed for every quantity, and kept as it is [-]."""

_ANGULAR = ("angle", "angular_velocity", "angular_acceleration")
_ANGLE_WORDS = re.compile(r"radian|degree|turn|revolution|arc|grade|gon")
_GRAVITIES = {"g": 1.0, "G": 1.0, "gn": 1.0, "g_n": 1.0, "g0": 1.0, "mg": 1e-3}
_WORDS = {
    "Nm": "N m", "Nmm": "N mm", "kNm": "kN m", "Ncm": "N cm", "mNm": "mN m", "lbf in": "lbf*inch",
    "lbf ft": "lbf*foot", "in": "inch", "inches": "inch", "sec": "s", "msec": "ms",
    "secs": "s", "°": "deg", "degrees": "deg", "ue": "microstrain",
    "µstrain": "microstrain", "uE": "microstrain", "µε": "microstrain", "με": "microstrain",
    "rev": "turn", "volts": "V", "volt": "V",
}  # fmt: skip
_RAW = ("V", "A", "C", "count")
"""Units of a signal before its calibration: `scale` turns them into what the quantity demands."""


class UnitError(Exception):
    """A unit that does not fit; carries what was expected and how to mend it."""

    def __init__(self, expected: str, mend: str) -> None:
        super().__init__(expected)
        self.expected = expected
        self.mend = mend


@dataclass(frozen=True)
class Conversion:
    """How the numbers of a file become SI numbers.

    Attributes:
        factor: multiplies a number of the file [SI unit per unit of the file].
        spread: multiplies a standard deviation that is stated in the file's `unit`.
        unit: what comes out, as text.
    """

    factor: float
    spread: float
    unit: str


def conversion(unit: str, quantity: str, scale: float | None = None) -> Conversion:
    """The way from a channel's unit to the SI unit of its quantity.

    Args:
        unit: as the sidecar states it, such as ``mm``, ``g``, ``deg/s`` or ``1``.
        quantity: the contract's word, or ``time``.
        scale: the sidecar's multiplier; None where it states none. Where `unit` is that of a raw
            signal (volts, say) and `quantity` demands another, the scaled number is in SI.

    Returns:
        The factor that includes the scale, and the unit that comes out.

    Raises:
        UnitError: for an unknown unit, or one that the quantity does not have.
    """
    si, times = SI_UNITS[quantity], 1.0 if scale is None else scale
    text = " ".join(unit.split())
    if text == ARBITRARY:
        return Conversion(times, 1.0, ARBITRARY)
    if text == si:
        return Conversion(times, 1.0, si)
    if quantity == "acceleration" and text in _GRAVITIES:
        factor = _GRAVITIES[text] * STANDARD_GRAVITY
        return Conversion(factor * times, factor, si)
    expected = f"a unit of {quantity.replace('_', ' ')} such as '{si}'"
    parsed = _parsed(text)
    if parsed is None:
        mend = "write it in the manner of 'm/s^2', 'mm', 'deg/s', 'N m' or '1'"
        raise UnitError(expected, mend)
    factor = _factor(parsed, quantity)
    if factor is not None:
        return Conversion(factor * times, factor, si)
    if scale is not None and any(_same_dimension(parsed, raw) for raw in _RAW):
        return Conversion(scale, abs(scale), si)
    raise UnitError(
        expected, f"write the unit of the column, or change 'quantity'; {_hint(parsed)}"
    )


def header_factor(name: str, quantity: str) -> tuple[str, float] | None:
    """The unit that a column's header states, with its factor to SI, where it fits the quantity.

    Args:
        name: the header, such as ``Position (mm) Run #1``.
        quantity: the contract's word, or ``time``.

    Returns:
        The unit's text and its factor [SI unit per unit]; None where none is stated.
    """
    for text in re.findall(r"[\[(]([^\])]{1,20})[\])]", name):
        try:
            found = conversion(text, quantity)
        except UnitError:
            continue
        if found.unit != ARBITRARY:
            return text, found.factor
    return None


def is_unit(text: str) -> bool:
    """Whether a cell under a header is a unit, with or without brackets [-]."""
    text = text.strip().strip("[]()").strip()
    return text in ("1", "-", *_GRAVITIES) or _parsed(text) is not None


def _hint(parsed: pint.Unit) -> str:
    if any(_same_dimension(parsed, raw) for raw in _RAW):
        return "a raw signal needs 'scale'"
    return "data without a unit say '1'"


def _same_dimension(parsed: pint.Unit, other: str) -> bool:
    unit = _registry().parse_units(other)
    if unit.dimensionless:  # counts are no angles
        return parsed.dimensionless and not _is_angular(parsed)
    return parsed.dimensionality == unit.dimensionality


def _factor(parsed: pint.Unit, quantity: str) -> float | None:
    """SI units in one of `parsed`, or None where it is not a unit of `quantity`."""
    registry = _registry()
    target = registry.parse_units("" if quantity == "strain" else SI_UNITS[quantity])
    if parsed.dimensionality != target.dimensionality:
        return None
    if quantity in (*_ANGULAR, "strain") and _is_angular(parsed) != (quantity in _ANGULAR):
        return None  # hertz or per cent for an angle, degrees for a strain
    return float(registry.Quantity(1.0, parsed).to(target).magnitude)


def _is_angular(parsed: pint.Unit) -> bool:
    return _ANGLE_WORDS.search(str(parsed)) is not None


@functools.cache
def _registry() -> pint.UnitRegistry:
    import pint

    return pint.UnitRegistry()


@functools.cache
def _parsed(text: str) -> pint.Unit | None:
    """The unit as pint understands it, after the spellings that it does not know."""
    import pint

    text = text.replace("²", "^2").replace("³", "^3").replace("·", "*").replace("⋅", "*")
    text = _WORDS.get(text, text)
    text = text.replace("°", "deg").replace("μ", "u").replace("µ", "u")
    text = "/".join(_WORDS.get(part.strip(), part.strip()) for part in text.split("/"))
    text = re.sub(r"(?<=[a-z])([23])\b", r"^\1", text)  # m/s2
    text = re.sub(r"\b(s|sec)/(s|sec)\b", r"s^2", text)  # m/s/s
    text = re.sub(r"\bs ?\^ ?-", "s^-", text)
    if not re.fullmatch(r"[A-Za-z_%][\w%^*/ .+-]*", text):
        return None
    try:
        return _registry().parse_units(text)
    except (pint.errors.PintError, ValueError, TypeError, AttributeError, KeyError, SyntaxError):
        return None
