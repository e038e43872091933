"""A rig is what stands on the bench: a robot or a chain, its numbers, bounds and laws, as TOML."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from .door import fault, nearest, one_of, read_toml, rule, shown, toml_text, validated, write_beside
from .parameters import Parameter
from .robot import MODELS, PARAMETERS, PLACES, PRESETS
from .shaft_form import NAMES as SHAFT_FORM

DEFAULT_PRESET = "robo_v"
CHAIN_PLACES = ("ground", "base")
_RESERVED = (*CHAIN_PLACES, "drive")

UNITS = {
    "translation": {"mass": "kg", "stiffness": "N/m", "damping": "N s/m"},
    "rotation": {"inertia": "kg m^2", "stiffness": "N m/rad", "damping": "N m s/rad"},
}
"""Units of a chain's numbers, by its motion [-]."""

_MEANINGS = {
    "mass": "mass of {}",
    "inertia": "moment of inertia of {}",
    "stiffness": "stiffness of {}",
    "damping": "damping of {}",
}


@dataclass(frozen=True)
class Rig:
    """A robot or a chain of masses as its file describes it.

    Attributes:
        path: the file.
        kind: ``robot`` or ``chain``.
        motion: ``translation`` or ``rotation``; a robot says ``translation``.
        model: which of the robot's models; empty for a chain.
        fidelity: ``thesis`` or ``planar``.
        preset: where a robot's unnamed values come from; empty for a chain.
        masses: names of a chain's masses, in the order of the file.
        links: the two ends of each link of a chain; ``ground`` is the fixed end.
        parameters: every number with unit [SI], bounds and freedom, by the contract's name.
        sha256: of the file's bytes.
        laws: what a diagnosis added: tables of ``law``, ``place`` and ``parameters``.
    """

    path: Path
    kind: Literal["robot", "chain"]
    motion: Literal["translation", "rotation"]
    model: str
    fidelity: str
    preset: str
    masses: tuple[str, ...]
    links: dict[str, tuple[str, str]]
    parameters: dict[str, Parameter]
    sha256: str
    laws: tuple[dict[str, Any], ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Where a channel, a drive or a law can be: names that the rig knows [-]."""
        if self.kind == "robot":
            return PLACES
        return (*self.masses, *self.links, *CHAIN_PLACES)


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class _Entry(_Table):
    """A number of a rig: bare, or a table of value, bounds and freedom."""

    value: float = Field(allow_inf_nan=False)
    min: float | None = None
    max: float | None = None
    free: bool = False
    std: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    per: Literal["record"] | None = None

    @model_validator(mode="before")
    @classmethod
    def _bare_number(cls, value: Any) -> Any:
        if isinstance(value, Mapping):
            return value
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise rule("a number or a table with 'value'", "write a number in SI units")
        return {"value": value}


class _Head(_Table):
    kind: Literal["robot", "chain"]
    motion: Literal["translation", "rotation"] = "translation"
    model: (
        Literal[
            "fixed_collet",
            "driven_collet",
            "pinned_wrist",
            "driven_wrist",
            "passive_wrist",
            "driven_arm",
        ]
        | None
    ) = None
    fidelity: Literal["thesis", "planar"] = "thesis"
    preset: str | None = None


class _Mass(_Table):
    mass: _Entry | None = None
    inertia: _Entry | None = None


def _two_ends(ends: list[str]) -> list[str]:
    if len(ends) != 2:
        mend = "write between = ['ground', 'cart']"
        raise rule("the names of two bodies", mend, f"{len(ends)} of them")
    return ends


class _Link(_Table):
    between: Annotated[list[str], AfterValidator(_two_ends)]
    stiffness: _Entry | None = None
    damping: _Entry | None = None


class _Law(_Table):
    law: str
    place: str
    parameters: dict[str, _Entry] = Field(default_factory=dict)


class _File(_Table):
    rig: _Head
    parameters: dict[str, _Entry] = Field(default_factory=dict)
    masses: dict[str, _Mass] = Field(default_factory=dict)
    links: dict[str, _Link] = Field(default_factory=dict)
    laws: list[_Law] = Field(default_factory=list)


def read_rig(path: Path | str) -> Rig:
    """Reads a rig and checks it: names, numbers, bounds, and that a chain is one.

    Args:
        path: a TOML file with ``[rig]``.

    Returns:
        The rig, its numbers in SI units.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    path = Path(path)
    document, sha256 = read_toml(path)
    if "rig" not in document:
        mend = "name the file that has [rig]"
        raise fault(path, "[rig]", "a rig with a table [rig]", _sections(document), mend)
    file = validated(_File, document, path)
    rig = _robot(file, path, sha256) if file.rig.kind == "robot" else _chain(file, path, sha256)
    return replace(rig, laws=tuple(dict(law) for law in document.get("laws", [])))


def _sections(document: Mapping[str, Any]) -> str:
    return f"the tables {one_of(document)}" if document else "an empty file"


def _robot(file: _File, path: Path, sha256: str) -> Rig:
    _refuse({"masses": file.masses, "links": file.links}, path, "robot", "chain")
    if file.rig.model is None:
        raise fault(path, "[rig] model", one_of(MODELS), "nothing", "add the model of the robot")
    preset = file.rig.preset or DEFAULT_PRESET
    if preset not in PRESETS:
        like = nearest(preset, PRESETS) or DEFAULT_PRESET
        place = "[rig] preset"
        raise fault(path, place, one_of(PRESETS), f"'{preset}'", f"write '{like}'")
    if file.rig.motion != "translation":
        mend = "leave 'motion' out; it belongs to a chain"
        raise fault(path, "[rig] motion", "no 'motion' for a robot", "'rotation'", mend)
    parameters = {
        name: replace(PARAMETERS[name], value=value, source=f"preset {preset}")
        for name, value in PRESETS[preset].items()
    }
    for name, entry in file.parameters.items():
        if name not in PARAMETERS:
            like = nearest(name, PARAMETERS)
            mend = f"write '{like}'" if like else f"write one of {one_of(PARAMETERS, 40)}"
            expected = "the name of a robot's parameter"
            raise fault(path, f"[parameters] {name}", expected, f"'{name}'", mend)
        parameters[name] = _parameter(f"[parameters] {name}", entry, PARAMETERS[name], path)
    head = file.rig
    return Rig(
        path, "robot", "translation", str(head.model), head.fidelity, preset, (), {},
        parameters, sha256,
    )  # fmt: skip


def _chain(file: _File, path: Path, sha256: str) -> Rig:
    _refuse({"parameters": file.parameters}, path, "chain", "robot")
    for key in ("model", "preset"):
        if getattr(file.rig, key) is not None:
            found = shown(getattr(file.rig, key))
            raise fault(path, f"[rig] {key}", f"no '{key}' for a chain", found, "remove it")
    if not file.masses:
        mend = "add a table such as [masses.cart] with mass = 0.17"
        raise fault(path, "[masses]", "at least one mass", "none", mend)
    _check_names(file, path)
    links = {name: (link.between[0], link.between[1]) for name, link in file.links.items()}
    _check_links(links, tuple(file.masses), path)
    motion = file.rig.motion
    return Rig(
        path, "chain", motion, "", file.rig.fidelity, "", tuple(file.masses), links,
        _chain_parameters(file, motion, path), sha256,
    )  # fmt: skip


def _refuse(strange: Mapping[str, Any], path: Path, kind: str, other: str) -> None:
    for key, table in strange.items():
        if table:
            mend = f"remove it, or write kind = '{other}' under [rig]"
            raise fault(path, f"[{key}]", f"no [{key}] in a {kind}", "one", mend)


def _check_names(file: _File, path: Path) -> None:
    for section, names in (("masses", file.masses), ("links", file.links)):
        for name in names:
            place = f"[{section}.{name}]"
            if not re.fullmatch(r"[^\W\d][\w-]*", name):
                mend = "use letters, digits, '_' and '-', beginning with a letter"
                raise fault(path, place, "a plain name", f"'{name}'", mend)
            if name in _RESERVED:
                expected = f"a name other than {one_of(_RESERVED)}"
                raise fault(path, place, expected, f"'{name}'", "choose another name")
    for name in file.links:
        if name in file.masses:
            mend = "rename one: a place must be one thing"
            raise fault(path, f"[links.{name}]", "a name that no mass has", f"'{name}'", mend)


def _check_links(links: Mapping[str, tuple[str, str]], masses: tuple[str, ...], path: Path) -> None:
    """Every link joins two different known bodies, and no way leads back to its start."""
    leader = {body: body for body in (*masses, "ground")}

    def first(body: str) -> str:
        while leader[body] != body:
            body = leader[body]
        return body

    for name, ends in links.items():
        place = f"[links.{name}] between"
        for end in ends:
            if end not in leader:
                like = nearest(end, leader) or masses[0]
                expected = f"one of {one_of(leader)}"
                raise fault(path, place, expected, f"'{end}'", f"write '{like}', or add that mass")
        a, b = first(ends[0]), first(ends[1])
        if a == b:
            found = f"a loop closed by '{ends[0]}' and '{ends[1]}'"
            mend = "remove a link; put springs side by side into one link as their sum"
            raise fault(path, place, "a chain without a loop", found, mend)
        leader[a] = b


def _chain_parameters(file: _File, motion: str, path: Path) -> dict[str, Parameter]:
    units = UNITS[motion]
    inertia = "inertia" if motion == "rotation" else "mass"
    other = "mass" if motion == "rotation" else "inertia"
    parameters: dict[str, Parameter] = {}
    for name, mass in file.masses.items():
        if getattr(mass, other) is not None:
            mend = f"write '{inertia}', or change 'motion' under [rig]"
            place = f"[masses.{name}] {other}"
            raise fault(path, place, f"'{inertia}' where motion is {motion}", f"'{other}'", mend)
        entry = getattr(mass, inertia)
        if entry is None:
            mend = f"add {inertia} = ... [{units[inertia]}]"
            raise fault(path, f"[masses.{name}] {inertia}", "a number", "nothing", mend)
        _add(parameters, "masses", name, inertia, entry, units, path)
    for name, link in file.links.items():
        if link.stiffness is None and link.damping is None:
            mend = "add one, even if it is 0.0"
            raise fault(path, f"[links.{name}]", "a stiffness or a damping", "neither", mend)
        for what in ("stiffness", "damping"):
            entry = getattr(link, what) or _Entry(value=0.0)
            _add(parameters, "links", name, what, entry, units, path)
    return parameters


def _add(
    parameters: dict[str, Parameter],
    section: str,
    name: str,
    what: str,
    entry: _Entry,
    units: Mapping[str, str],
    path: Path,
) -> None:
    default = _chain_default(section, name, what, units)
    parameter = _parameter(f"[{section}.{name}] {what}", entry, default, path)
    parameters[parameter.name] = parameter


def _chain_default(section: str, name: str, what: str, units: Mapping[str, str]) -> Parameter:
    meaning = _MEANINGS[what].format(name)
    return Parameter(f"{section}.{name}.{what}", 0.0, units[what], low=0.0, meaning=meaning)


def _parameter(place: str, entry: _Entry, default: Parameter, path: Path) -> Parameter:
    """A parameter of the file over its defaults, with its bounds checked."""
    unit = default.unit
    positive = unit in ("kg", "kg m^2") and default.name not in SHAFT_FORM  # of which none will do
    low, high = _bounds(place, entry, default, path)
    if positive and entry.value <= 0:
        mend = f"write a number above zero in {unit}"
        raise fault(path, place, f"a value above 0 {unit}", f"{entry.value:g}", mend)
    if not low <= entry.value <= high:
        mend = "change the value, or widen 'min' and 'max'"
        span = f"of at least {low:g}" if math.isinf(high) else f"from {low:g} to {high:g}"
        expected = f"a value {span} {unit}"
        raise fault(path, place, expected, f"{entry.value:g}", mend)
    return replace(
        default,
        value=float(entry.value),
        low=low,
        high=high,
        free=entry.free,
        std=None if entry.std is None else float(entry.std),
        per_record=entry.per == "record",
        source=path.name,
    )


def _bounds(place: str, entry: _Entry, default: Parameter, path: Path) -> tuple[float, float]:
    low = default.low if entry.min is None else float(entry.min)
    high = default.high if entry.max is None else float(entry.max)
    if math.isnan(low) or math.isnan(high) or low >= high:
        found = f"min {low:g} and max {high:g}"
        raise fault(path, place, "'min' below 'max'", found, "exchange or widen them")
    if default.low >= 0.0 > low:
        expected = f"'min' of at least 0 {default.unit}"
        raise fault(path, place, expected, f"{low:g}", "write min = 0.0")
    if not entry.free and entry.min is None and entry.max is None:
        # Bounds of a held number bind no fit: the value itself may lie outside the usual ones.
        low, high = min(low, _lowest(entry, default)), max(high, entry.value)
    return low, high


def _lowest(entry: _Entry, default: Parameter) -> float:
    return max(entry.value, 0.0) if default.low >= 0.0 else entry.value


def write_rig(rig: Rig, path: Path | str, laws: Iterable[Mapping[str, Any]] = ()) -> None:
    """Writes a rig as TOML that `read_rig` reads back: whole, or not at all.

    Args:
        rig: the rig; its own laws are written too.
        path: the file.
        laws: further tables of ``law``, ``place`` and ``parameters`` [SI].

    Raises:
        ValueError: where the file cannot be written.
    """
    head: dict[str, Any] = {"kind": rig.kind, "fidelity": rig.fidelity}
    document: dict[str, Any] = {"rig": head}
    if rig.kind == "robot":
        head |= {"model": rig.model, "preset": rig.preset}
        document["parameters"] = {
            name: _entry_table(parameter, PARAMETERS[name])
            for name, parameter in rig.parameters.items()
        }
    else:
        head["motion"] = rig.motion
        document |= _chain_tables(rig)
    listed = [dict(law) for law in (*rig.laws, *laws)]
    if listed:
        document["laws"] = listed
    write_beside(Path(path), toml_text(document))


def _chain_tables(rig: Rig) -> dict[str, Any]:
    units = UNITS[rig.motion]
    tables: dict[str, Any] = {"masses": {name: {} for name in rig.masses}}
    tables["links"] = {name: {"between": list(ends)} for name, ends in rig.links.items()}
    for name, parameter in rig.parameters.items():
        section, body, what = name.split(".")
        default = _chain_default(section, body, what, units)
        tables[section][body][what] = _entry_table(parameter, default)
    return {section: table for section, table in tables.items() if table}


def _entry_table(parameter: Parameter, default: Parameter) -> dict[str, Any]:
    table: dict[str, Any] = {"value": float(parameter.value)}
    if parameter.low != default.low:
        table["min"] = float(parameter.low)
    if parameter.high != default.high:
        table["max"] = float(parameter.high)
    if parameter.free:
        table["free"] = True
    if parameter.std is not None:
        table["std"] = float(parameter.std)
    if parameter.per_record:
        table["per"] = "record"
    return table
