"""A spec says what to sweep: rig, drive, scores, window and axes; here its file is checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..model.door import fault, nearest, one_of, read_toml, shown, validated
from ..model.parameters import Parameter
from ..model.rig import Rig
from ..model.robot import PARAMETERS
from .sweep import GRIP_PEAK, Axis
from .sweep_scores import SCORES

MOST_DESIGNS = 500_000_000
"""Most designs of one grid [-]; beyond that a count is wrong."""

_FORMS = {
    "start": ("start", "step", "count"),
    "low": ("low", "high", "count", "scale"),
    "values": ("values",),
}


@dataclass(frozen=True)
class SweepSpec:
    """What is to be swept, as the file says.

    Attributes:
        path: the file.
        rig: the rig's file, resolved against the spec's folder.
        drive: the drive's file, resolved likewise.
        scores: names of scores.
        of: the sensor as ``PLACE:QUANTITY:FRAME``.
        window: first and last time that count [s]; None for all.
        axes: the table ``[axes]``, one table a parameter.
        sha256: of the file's bytes.
        search: the table ``[search]``, as it stands.
        sensitivity: the table ``[sensitivity]``, as it stands; None where there is none.
        grip_limit: motion of the grip beyond which designs are marked; None for no mark [m].
    """

    path: Path
    rig: Path
    drive: Path
    scores: tuple[str, ...]
    of: str
    window: tuple[float, float] | None
    axes: dict[str, dict[str, Any]]
    sha256: str
    search: Mapping[str, Any] = field(default_factory=dict)
    sensitivity: Mapping[str, Any] | None = None
    grip_limit: float | None = None


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _Sweep(_Table):
    rig: str
    drive: str
    scores: list[str] = Field(default_factory=lambda: ["rms", "log_decrement", "peak"])
    of: str = "clubhead:acceleration:collet"
    window: list[float] | None = None
    grip_limit: float | None = Field(default=None, gt=0)


class _Axis(_Table):
    start: float | None = None
    step: float | None = None
    count: int | None = Field(default=None, ge=1, le=MOST_DESIGNS)
    low: float | None = None
    high: float | None = None
    scale: Literal["linear", "log"] = "linear"
    values: list[float] | None = None


class _Sensitivity(_Table):
    samples: int = Field(default=4096, ge=2, le=2**20)
    parameters: dict[str, _Axis] = Field(default_factory=dict)


class _File(_Table):
    sweep: _Sweep
    axes: dict[str, _Axis]
    search: dict[str, Any] = Field(default_factory=dict)
    sensitivity: _Sensitivity | None = None


def read_spec(path: Path | str, needs_axes: bool = True) -> SweepSpec:
    """Reads a spec and checks what can be checked without its rig.

    Args:
        path: a TOML file with ``[sweep]`` and ``[axes]``; ``[search]`` and ``[sensitivity]`` are
            kept as they stand.
        needs_axes: whether a file without ``[axes]`` is refused.

    Returns:
        The spec, its times in s.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    document, sha256 = read_toml(path)
    if "sweep" not in document:
        found = f"the tables {one_of(document)}" if document else "an empty file"
        mend = "name the file that has [sweep]"
        raise fault(path, "[sweep]", "a spec with a table [sweep]", found, mend)
    axes = document.get("axes", {})
    if not isinstance(axes, Mapping) or (needs_axes and not axes):
        mend = "add such as wrist_stiffness = { start = 50.0, step = 75.0, count = 75 }"
        raise fault(path, "[axes]", "at least one axis", "none", mend)
    flat = _flat(axes)
    whole = validated(_File, {**document, "axes": flat}, path)
    own = whole.sweep
    if not own.scores or len(set(own.scores)) < len(own.scores):
        found = "the same twice" if own.scores else "none"
        raise fault(path, "[sweep] scores", "scores, each once", found, "name some of them")
    for name in own.scores:
        if name not in SCORES:
            mend = f"write '{nearest(name, SCORES) or SCORES[0]}'"
            raise fault(path, "[sweep] scores", one_of(SCORES), f"'{name}'", mend)
    window = None if own.window is None else tuple(map(float, own.window))
    if window is not None and (len(window) != 2 or not 0.0 <= window[0] < window[1]):
        mend = "write window = [0.005, 2.0]"
        expected = "[beginning, end] in s, 0 <= beginning < end"
        raise fault(path, "[sweep] window", expected, shown(own.window), mend)
    pair = None if window is None else (window[0], window[1])
    rig, drive = path.parent / own.rig, path.parent / own.drive
    further = (whole.search, document.get("sensitivity"), own.grip_limit)
    scores = tuple(own.scores)
    if own.grip_limit is not None and GRIP_PEAK not in scores:
        scores = (*scores, GRIP_PEAK)  # what is compared with the limit
    return SweepSpec(path, rig, drive, scores, own.of, pair, flat, sha256, *further)


def _flat(axes: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Tables of axes by whole names: a chain's ``links.spring.stiffness`` nests in TOML."""
    found: dict[str, Any] = {}
    for key, value in axes.items():
        nested = isinstance(value, Mapping) and value
        if nested and all(isinstance(inner, Mapping) for inner in value.values()):
            found |= _flat(value, f"{prefix}{key}.")
        else:
            found[f"{prefix}{key}"] = value
    return found


def axes_of(spec: SweepSpec, rig: Rig) -> tuple[Axis, ...]:
    """The axes of a spec, checked against the rig's parameters.

    Args:
        spec: as read.
        rig: tells the parameters with their units and what they may be.

    Returns:
        One axis a parameter, in the order of the file [SI].

    Raises:
        ValueError: one line with file, place, expected, found and mend: for an unknown parameter,
            a form that is not one, values that cannot be, or a grid beyond all measure.
    """
    found = []
    for name, table in spec.axes.items():
        place = f"[axes] {name}"
        known = parameter_of(rig, name, spec.path, place)
        values = _values(spec.path, place, table)
        check_values(spec.path, place, values, known)
        found.append(Axis(name, values, known.unit))
    count = math.prod(len(axis.values) for axis in found)
    if count > MOST_DESIGNS:
        expected = f"at most {MOST_DESIGNS:g} designs"
        raise fault(spec.path, "[axes]", expected, f"{count:.3g}", "lower a 'count'")
    return tuple(found)


def parameter_of(rig: Rig, name: str, path: Path, place: str) -> Parameter:
    """A rig's parameter, with its unit and what it may be.

    Args:
        rig: the rig.
        name: of the parameter.
        path: of the file that names it.
        place: where in that file.

    Returns:
        The parameter.

    Raises:
        ValueError: where the rig has none of that name.
    """
    known: Mapping[str, Parameter] = rig.parameters
    if rig.kind == "robot":
        known = {**PARAMETERS, **rig.parameters}
    if name not in known:
        like = nearest(name, known)
        mend = f"write '{like}'" if like else "name one of these"
        expected = f"a parameter of {rig.path.name}: {one_of(known, 40)}"
        raise fault(path, place, expected, f"'{name}'", mend)
    return known[name]


def _values(path: Path, place: str, table: Mapping[str, Any]) -> np.ndarray:
    """The values of one axis, from whichever of the three forms it has."""
    form = next((keys for first, keys in _FORMS.items() if first in table), None)
    needed = () if form is None else tuple(key for key in form if key != "scale")
    wrong = [key for key in table if form is None or key not in form]
    missing = [key for key in needed if key not in table]
    if form is None or wrong or missing:
        found = f"the keys {one_of(table)}" if table else "an empty table"
        expected = "{ start, step, count }, { low, high, count, scale } or { values }"
        raise fault(path, place, expected, found, "write one of these forms whole")
    if form[0] == "values":
        values = np.array(table["values"], float)
        if not len(values):
            raise fault(path, place, "at least one value", "an empty list", "add values")
        return values
    count = table["count"]
    if form[0] == "start":
        if table["step"] == 0 and count > 1:
            raise fault(path, place, "a 'step' other than 0", "0", "change it, or write count = 1")
        return table["start"] + table["step"] * np.arange(count, dtype=float)
    low, high, is_log = float(table["low"]), float(table["high"]), table.get("scale") == "log"
    if low >= high or (is_log and low <= 0):
        expected = "'low' below 'high'" + (", both above 0 for scale = 'log'" if is_log else "")
        raise fault(path, place, expected, f"{low:g} and {high:g}", "change them")
    if count < 2:
        raise fault(path, place, "a 'count' of 2 or more", f"{count}", "write values = [...]")
    return np.geomspace(low, high, count) if is_log else np.linspace(low, high, count)


def check_values(path: Path, place: str, values: np.ndarray, parameter: Parameter) -> None:
    """Refuses values with which no design can be built.

    Masses and inertias are above zero; what a rig may not have below zero is not below.

    Args:
        path: of the file that holds them.
        place: where in that file.
        values: shape (n,) [SI].
        parameter: what they are values of.

    Raises:
        ValueError: for the first value that cannot be.
    """
    unit = parameter.unit
    positive = unit in ("kg", "kg m^2")
    bad = ~np.isfinite(values)
    bad |= values <= 0 if positive else (values < 0) & (parameter.low >= 0)
    if bad.any():
        expected = f"values {'above 0' if positive else 'of at least 0'} {unit}"
        mend = "change the axis so that every design can be built"
        raise fault(path, place, expected, f"{values[bad][0]:g}", mend)
