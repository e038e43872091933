"""The true strength of a hidden effect as the library's law counts it, and whether it was told."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Row = Mapping[str, Any]

RECORD_SECONDS = 2.0
"""Length of a record of the bench, over which its drifts are counted [s]."""

Meant = Callable[[float, float], float]


def _same(size: float, other: float) -> float:
    return size


MEANT: dict[str, tuple[str, Meant]] = {
    **{law: ("", _same) for law in ("cubic_stiffness", "asymmetric_stiffness", "clearance")},
    **{law: ("", _same) for law in ("quadratic_damping", "coulomb_friction", "relaxation")},
    **{law: ("", _same) for law in ("linear_stiffness", "linear_damping", "extra_mode", "slip")},
    "hysteresis": ("", lambda size, other: size * other),  # force of the loop, from its stiffness
    **{law: ("", _same) for law in ("servo_lag", "drive_ripple", "sensor_offset", "sensor_gain")},
    **{law: ("", _same) for law in ("sensor_delay", "sensor_lowpass", "sensor_mass")},
    **{law: ("", _same) for law in ("sensor_tilt", "mains_hum")},
    "sensor_drift": ("", lambda size, other: size / RECORD_SECONDS),
    "sensor_highpass": ("", lambda size, other: 1.0 / size),  # the corner, from its time constant
    "sensor_saturation": ("limit", _same),
    "sensor_rectified": ("", lambda size, other: size / (1.0 + abs(size))),
}
"""Of each law the number that is compared (its strength where nothing is said), and what the
bench's size and other number make of it. Laws that are missing here have another form there."""

ADDED = ("sensor_offset", "sensor_drift", "mains_hum", "sensor_saturation")
"""Faults that are a reading of their own: the bench multiplies them by the channel's gain, which is
a little off, and the library's laws act on what is read."""

SIGNLESS = ("drive_ripple", "mains_hum", "sensor_tilt")
"""A phase, or which way an axis leans, takes the sign [-]."""


def compared(row: Row) -> tuple[float, float, float, float] | None:
    """A single cause's number and what was told of it.

    Args:
        row: a case, answered.

    Returns:
        True value, told value, low and high end of its 95 % interval [the law's unit]; None where
        the cause was not named, or the bench means another number: a sleeve of many springs, the
        bent shaft of finite elements, a form that the law does not have.
    """
    if len(row["truth"]) != 1:
        return None
    truth = row["truth"][0]
    if truth["law"] not in MEANT or truth.get("size") is None or truth["place"] == "sleeve":
        return None
    if row["bench"] == "B" and truth["place"] == "shaft":
        return None
    for cause in row["causes"]:
        if cause["law"] == truth["law"] and cause["place"] in truth["places"]:
            symbol, meant = MEANT[truth["law"]]
            numbers = cause.get("parameters") or {}
            told = numbers.get(symbol) if symbol else next(iter(numbers.values()), None)
            if told is None:
                return None
            value = meant(truth["size"], truth.get("other") or 0.0)
            if truth["law"] in ADDED:
                value *= 1.0 + (truth.get("gain") or 0.0)
            ends = told["value"], told["low"], told["high"]
            if truth["law"] in SIGNLESS:
                value, sign = abs(value), -1.0 if told["value"] < 0 else 1.0
                ends = sign * told["value"], *sorted((sign * told["low"], sign * told["high"]))
            return value, *ends
    return None


def holds(row: Row) -> bool:
    """Whether the interval of a compared number holds its true value."""
    found = compared(row)
    return found is not None and found[2] <= found[0] <= found[3]


def error_of(row: Row) -> float | None:
    """Relative error of a compared number [-]; None where there is none to compare."""
    found = compared(row)
    return None if found is None else abs(found[1] / found[0] - 1.0)


MOST_GAIN = 0.8
"""Share of the largest gain on held-out records that an extension is asked for [-]."""


def gains_beyond_noise(row: Row) -> bool:
    """Whether the extension takes away most of the error beyond the noise on unseen records.

    That bounds from above what the true law could gain there, and is rarely in reach: of a record
    that was never fitted, how it begins is told by its opening alone.
    """
    before, after, floor = (row[key] for key in ("nrmse_before", "nrmse_after", "noise_floor"))
    return before - after >= MOST_GAIN * (before - floor)


def gains_most(row: Row) -> bool:
    """Whether the extension takes away most of what its true law does on records never fitted.

    Where it does not reach most of what lies beyond the noise, what the true law itself leaves
    there (``true_after``) is what counts, unless that gains nothing: then it was not fitted well,
    and excuses nothing.
    """
    before, after, true = row["nrmse_before"], row["nrmse_after"], row.get("true_after")
    if true is None or true >= before:
        return gains_beyond_noise(row)
    return gains_beyond_noise(row) or before - after >= MOST_GAIN * (before - true)
