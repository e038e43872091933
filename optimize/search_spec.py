"""A spec says what to search for: sampler, objectives, limits, and hardware that can be bought."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..model.door import fault, nearest, one_of, read_bytes, sha256_of, validated
from ..model.rig import Rig
from .sweep import Axis
from .sweep_scores import SCORES
from .sweep_spec import SweepSpec, axes_of, check_values, parameter_of, read_spec

SAMPLERS = ("tpe", "cmaes", "nsga2", "gp")
"""Every sampler that a search knows."""

STORAGE = "sqlite:///search.db"
"""Where trials are kept if the spec does not say."""

LARGEST_CATALOGUE = 2**24
"""Largest catalogue that is read [byte]."""

NAMES = ("part", "name")
"""Columns of a catalogue that name its rows."""


@dataclass(frozen=True)
class Range:
    """A parameter that may take any value between two.

    Attributes:
        name: the rig's name of the parameter.
        low: lowest value [SI].
        high: highest value [SI].
        is_log: whether it is looked at by its logarithm.
        unit: of the values, as text.
    """

    name: str
    low: float
    high: float
    is_log: bool
    unit: str


@dataclass(frozen=True)
class Choice:
    """Rows of which a design takes one: parts of a catalogue, or listed values.

    Attributes:
        name: what is chosen.
        parts: name of each row.
        numbers: what each row says of the rig's parameters, each of shape (rows,) [SI].
        units: of these, as text.
    """

    name: str
    parts: tuple[str, ...]
    numbers: Mapping[str, np.ndarray]
    units: Mapping[str, str]


@dataclass(frozen=True)
class Limit:
    """What a score may be in a design that can be used.

    Attributes:
        score: its name.
        low: lowest value allowed; None for any [SI unit of the score].
        high: highest value allowed; None for any [SI unit of the score].
    """

    score: str
    low: float | None
    high: float | None


@dataclass(frozen=True)
class SearchSpec:
    """What is to be searched for, as the file says.

    Attributes:
        sweep: rig, drive, sensor and window.
        sampler: one of `SAMPLERS`.
        trials: designs in all [-].
        batch: designs that are drawn and simulated together [-].
        ahead: batches that may be under way at the same time, on several machines [-].
        storage: where trials are kept: ``sqlite:///FILE``, ``journal:FILE``, ``postgresql://...``.
        study: name of the search in its storage.
        objectives: each score with ``minimize`` or ``maximize``.
        limits: what other scores may be.
        catalogues: CSV files, resolved against the spec's folder.
    """

    sweep: SweepSpec
    sampler: str
    trials: int
    batch: int
    ahead: int
    storage: str
    study: str
    objectives: dict[str, str]
    limits: tuple[Limit, ...]
    catalogues: tuple[Path, ...]

    @property
    def scores(self) -> tuple[str, ...]:
        """Every score that is needed: objectives, then what is limited."""
        return tuple(dict.fromkeys([*self.objectives, *(one.score for one in self.limits)]))


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _Limit(_Table):
    min: float | None = None
    max: float | None = None


class _Search(_Table):
    sampler: Literal["tpe", "cmaes", "nsga2", "gp"] = "tpe"
    trials: int = Field(default=1000, ge=1, le=10_000_000)
    batch: int = Field(default=64, ge=1, le=4096)
    ahead: int = Field(default=1, ge=1, le=1024)
    storage: str = STORAGE
    study: str | None = None
    objectives: dict[str, Literal["minimize", "maximize"]] = Field(
        default_factory=lambda: {"rms": "minimize"}
    )
    constraints: dict[str, _Limit] = Field(default_factory=dict)
    catalogue: str | list[str] = Field(default_factory=list)


class _File(_Table):
    search: _Search


def read_search(path: Path | str) -> SearchSpec:
    """Reads a spec and checks what can be checked without its rig.

    Args:
        path: a TOML file with ``[sweep]``, ``[axes]`` or a catalogue, and ``[search]``.

    Returns:
        The spec.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    sweep = read_spec(path, needs_axes=False)
    if not sweep.search:
        mend = "add [search] with sampler, trials and objectives"
        raise fault(sweep.path, "[search]", "a spec with a table [search]", "none", mend)
    own = validated(_File, {"search": dict(sweep.search)}, sweep.path).search
    if not own.objectives:
        mend = 'write objectives = { rms = "minimize" }'
        raise fault(sweep.path, "[search] objectives", "one or more", "none", mend)
    for place, names in (("objectives", own.objectives), ("constraints", own.constraints)):
        for name in names:
            if name not in SCORES:
                mend = f"write '{nearest(name, SCORES) or SCORES[0]}'"
                expected = one_of(SCORES)
                raise fault(sweep.path, f"[search] {place}", expected, f"'{name}'", mend)
    limits = tuple(Limit(name, one.min, one.max) for name, one in own.constraints.items())
    for one in limits:
        if (one.low is None and one.high is None) or (
            one.low is not None and one.high is not None and one.low > one.high
        ):
            expected = "'max', 'min', or both with 'min' below 'max'"
            mend = f"write {one.score} = {{ max = 0.002 }}"
            place = f"[search.constraints] {one.score}"
            raise fault(sweep.path, place, expected, f"{one.low} and {one.high}", mend)
    named = [own.catalogue] if isinstance(own.catalogue, str) else own.catalogue
    files = tuple(sweep.path.parent / name for name in named)
    if not sweep.axes and not files:
        mend = "add such as wrist_stiffness = { low = 50.0, high = 500.0 }, or a catalogue"
        raise fault(sweep.path, "[axes]", "at least one axis", "none", mend)
    _check_sampler(sweep.path, own)
    study = own.study or sweep.path.stem
    taken = (own.sampler, own.trials, own.batch, own.ahead, own.storage, study)
    return SearchSpec(sweep, *taken, dict(own.objectives), limits, files)


def _check_sampler(path: Path, own: _Search) -> None:
    """What a sampler cannot do is refused before anything is simulated."""
    place = "[search] sampler"
    if own.sampler == "cmaes":
        if len(own.objectives) > 1:
            found = f"'cmaes' with {len(own.objectives)} objectives"
            raise fault(path, place, "one objective for CMA-ES", found, "write 'nsga2' or 'tpe'")
        if own.batch < 4:
            found = f"a batch of {own.batch}"
            raise fault(path, place, "a batch of 4 or more for CMA-ES", found, "raise 'batch'")
    if own.sampler == "nsga2" and own.batch < 2:
        raise fault(path, place, "a batch of 2 or more for NSGA-II", "1", "raise 'batch'")
    if own.sampler == "gp" and own.trials > 500:
        found = f"{own.trials} trials"
        mend = "lower 'trials', or write 'tpe'"
        raise fault(path, place, "at most 500 trials for a Gaussian process", found, mend)


def dimensions_of(spec: SearchSpec, rig: Rig) -> tuple[tuple[Range, ...], tuple[Choice, ...]]:
    """What a search may vary, checked against the rig's parameters.

    An axis with ``low`` and ``high``, or with ``start``, ``step`` and ``count``, is searched from
    end to end; one with ``values`` takes one of these.

    Args:
        spec: as read.
        rig: tells the parameters with their units and what they may be.

    Returns:
        The ranges and the choices.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = spec.sweep.path
    ranges, choices = [], []
    for name, table in spec.sweep.axes.items():
        known = {"count": 2, **table} if "low" in table else table
        one = SweepSpec(**{**vars(spec.sweep), "axes": {name: known}})
        axis = axes_of(one, rig)[0]
        low, high = float(axis.values.min()), float(axis.values.max())
        if "values" in table or low == high:
            parts = tuple(f"{value:g}" for value in axis.values)
            choices.append(Choice(name, parts, {name: axis.values}, {name: axis.unit}))
        else:
            is_log = table.get("scale") == "log"
            ranges.append(Range(name, low, high, is_log, axis.unit))
    choices += [_catalogue(file, rig) for file in spec.catalogues]
    varied = [one.name for one in ranges] + [name for one in choices for name in one.numbers]
    for name in varied:
        if varied.count(name) > 1:
            mend = "leave it out of one of them"
            found = f"'{name}' twice"
            raise fault(path, "[axes]", "each parameter in one axis or catalogue", found, mend)
    if spec.sampler == "cmaes" and any(len(one.parts) > 1 for one in choices):
        mend = "write sampler = 'tpe', or give 'low' and 'high'"
        expected = "axes from low to high for CMA-ES"
        raise fault(path, "[search] sampler", expected, "something to be chosen from a list", mend)
    if not ranges and all(len(one.parts) == 1 for one in choices):
        mend = "widen an axis"
        raise fault(path, "[axes]", "something that can vary", "a single design", mend)
    return tuple(ranges), tuple(choices)


def axes_for(ranges: tuple[Range, ...], choices: tuple[Choice, ...]) -> tuple[Axis, ...]:
    """Axes that hold every parameter that is varied, each with its unit [SI]."""
    found = [Axis(one.name, np.array([one.low, one.high]), one.unit) for one in ranges]
    for one in choices:
        found += [Axis(name, values, one.units[name]) for name, values in one.numbers.items()]
    return tuple(found)


def _catalogue(path: Path, rig: Rig) -> Choice:
    """Parts of a CSV file: one a row, one column a parameter in SI, perhaps one with names."""
    content = read_bytes(path, LARGEST_CATALOGUE, "name a CSV file of parts")
    text = content.decode("utf-8-sig", errors="replace")
    try:
        rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise fault(path, "", "a CSV file", f"'{error}'", "save it as plain CSV") from None
    if len(rows) < 2:
        expected = "a header and at least one part"
        raise fault(path, "", expected, f"{len(rows)} rows", "add a part a row")
    header = [cell.strip() for cell in rows[0]]
    named = next((k for k, cell in enumerate(header) if cell in NAMES), None)
    numbers, units = {}, {}
    for k, name in enumerate(header):
        if k == named:
            continue
        known = parameter_of(rig, name, path, "header")
        cells = [row[k] if k < len(row) else "" for row in rows[1:]]
        numbers[name] = np.array([_number(path, at + 2, name, c) for at, c in enumerate(cells)])
        units[name] = known.unit
        check_values(path, name, numbers[name], known)
    if not numbers or len(numbers) + (named is not None) < len(header):
        expected = "columns with the names of parameters, each once"
        mend = "write such as: part, wrist_stiffness, wrist_damping"
        raise fault(path, "header", expected, ", ".join(header) or "none", mend)
    parts = [f"row {at + 2}" for at in range(len(rows) - 1)]
    if named is not None:
        own = [row[named].strip() if named < len(row) else "" for row in rows[1:]]
        parts = [name or parts[at] for at, name in enumerate(own)]
    if len(set(parts)) < len(parts):
        twice = next(part for part in parts if parts.count(part) > 1)
        raise fault(path, "", "parts of different names", f"'{twice}' twice", "rename one")
    return Choice(path.stem, tuple(parts), numbers, units)


def _number(path: Path, line: int, name: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        mend = "write it in SI with a decimal point"
        raise fault(path, f"line {line}, {name}", "a number", f"'{cell.strip()}'", mend)
    return value


def sums_of(spec: SearchSpec) -> dict[str, str]:
    """SHA-256 of every catalogue, by its path."""
    return {str(path): sha256_of(path.read_bytes()) for path in spec.catalogues}
