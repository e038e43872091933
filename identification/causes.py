"""Every law at every place where it makes sense, and what no records could ever show of it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from ..model.chain import FORCES
from ..model.door import nearest, one_of
from ..model.law import Law, library
from ..model.robot import Robot
from ..model.sensors import carrier
from ..model.tilt import leans
from .faults import DRIVE, told_motion
from .fit import Fit
from .problem import Cause, Problem
from .swung import is_swung, swings


def possible_causes(fit: Fit) -> list[Cause]:
    """Every law at every place where it makes sense and is not yet in force."""
    problem = fit.problem
    mechanism, had = problem.mechanism, {(p, law.name) for p, law in fit.model.causes}
    found: list[Cause] = []
    laws = [law for name, law in library().items() if name not in problem.left_out]
    for place, kind in mechanism.law_places().items():
        for law in laws:
            fits = law.fits(kind, mechanism.turns(place))
            fits = fits and (not is_swung(problem, (place, law)) or swings(problem, law))
            if fits and (place, law.name) not in had and not _said_already(fit, place, law):
                found.append((place, law))
    if any(told_motion(prepared) for prepared in problem.records):
        drives = [(DRIVE, law) for law in laws if law.kind == DRIVE]
        found += [(place, law) for place, law in drives if (place, law.name) not in had]
    leaning = _leaning(problem)
    for channel, is_input, checked in _channels(fit):
        for law in laws:
            if not law.slot or (channel, law.name) in had:
                continue
            fits = law.kind == "channel" or (not is_input and law.kind == "reading")
            fits = fits or (law.kind == "axis" and channel in leaning)
            if fits or (law.kind == "response" and not is_input and checked):
                found.append((channel, law))
    return found


def leaving_out(problem: Problem, names: Collection[str]) -> Problem:
    """The problem in which laws of these names are not tried.

    Raises:
        ValueError: for a name that no law has.
    """
    for name in names:
        if name not in library():
            mend = f"write '{nearest(name, library()) or 'coulomb_friction'}'"
            raise ValueError(
                f"left_out: expected {one_of(library())}, found '{name}'. Mend: {mend}."
            )
    return replace(problem, left_out=frozenset(names))


def _leaning(problem: Problem) -> set[str]:
    """Names of channels whose axis may lean: accelerometers on a robot's clubhead."""
    return {
        sensor.channel.name
        for prepared in problem.records
        for sensor in prepared.sensors
        if isinstance(problem.mechanism, Robot) and leans(sensor.port)
    }


def _channels(fit: Fit) -> list[tuple[str, bool, bool]]:
    """Name, whether an input, whether what drives a record or another channel says what it reads.

    Gain and lag of the only channel of a free decay are its start's: no such record can tell them.
    """
    found: dict[str, tuple[str, bool, bool]] = {}
    for prepared in fit.problem.records:
        checked = not prepared.free or len(prepared.sensors) > 1
        for channel in prepared.record.channels:
            is_input = channel.role == "input"
            if is_input and channel.quantity not in ("force", "torque"):
                continue
            before = found.get(channel.name, (channel.name, is_input, False))
            found[channel.name] = (channel.name, is_input, before[2] or checked)
    return list(found.values())


def numbers_at(fit: Fit, place: str, word: str) -> list[str]:
    """The rig's numbers of a kind (stiffness, damping) at a place, by name."""
    rig = fit.problem.rig
    if rig.kind == "chain":
        name = f"links.{place}.{word}"
        return [name] if name in rig.parameters else []
    return [n for n in rig.parameters if n.startswith(f"{place}_{word}")]


def hidden_masses(problem: Problem) -> tuple[str, ...]:
    """Names of added masses that no fit of these records could show.

    What an accelerometer weighs rides with its place. Where the fit varies that mass anyway, or
    no known force drives any record so that all constants scale together, nothing tells it.

    Args:
        problem: records and rig.

    Returns:
        ``place/sensor_mass`` of each place with an accelerometer for which that holds.

    Source: tests/identification/test_screen.py.
    """
    forced = any(
        port.quantity in FORCES and np.ptp(column) > 0
        for prepared in problem.records
        for port, column in zip(prepared.ports, prepared.inputs.T, strict=True)
    )
    places = dict.fromkeys(
        sensor.port.place
        for prepared in problem.records
        for sensor in prepared.sensors
        if sensor.port.quantity == "acceleration"
    )
    found = []
    for place in places:
        name = carrier(problem.mechanism, place)
        if name and (problem.rig.parameters[name].free or not forced):
            found.append(f"{place}/sensor_mass")
    return tuple(found)


def _said_already(fit: Fit, place: str, law: Law) -> bool:
    if not law.replaces:
        return False
    parameters = fit.problem.rig.parameters
    return any(parameters[name].free for name in numbers_at(fit, place, law.replaces))
