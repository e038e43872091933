"""Another start for a club: its shaft and its sleeve, or what they lose, told for each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..model.robot import Robot
from .problem import Model

SPRINGS = ("shaft_stiffness", "sleeve_stiffness")
DAMPERS = ("shaft_damping", "sleeve_damping")

ENDS = ("shaft", "sleeve")
"""Places of the two springs in a row."""

NEARER = 3.0
"""How much likelier a rig must make the other way round, its logarithm [-]."""

LOST = 0.01
"""Share of what a rig says below which a constant is no farther from it [-]."""

NOUGHT = 2.0
"""Standard deviations from nought within which a part seems to lose nothing [-]."""

IDLE = 0.2
"""Share of a club's losses below which its sleeve seems to lose nothing [-]: rubber does, so that
shaft and sleeve are told apart by errors of the lumped form, not by the records."""

KEPT = 0.1
"""Share of the losses that the other part is left with [-]."""


def sleeve_share(p: Mapping[str, float]) -> float:
    """How far a sleeve lets the head go under a pull, over how far the shaft does [-].

    Args:
        p: the robot's numbers by name [SI].
    """
    return p["shaft_stiffness"] * _lever(p) / p["sleeve_stiffness"]


def _lever(p: Mapping[str, float]) -> float:
    """A sleeve's stiffness, or damping, over that of the shaft that gives way as much [-]."""
    return (1.0 + _arm(p) ** 2) / 4.0


def _arm(p: Mapping[str, float]) -> float:
    """Lever of the head about the sleeve's centre, over that of each of its two sets [-]."""
    return (p["club_length"] - p["grip_length"] / 2.0) / (p["sleeve_spacing"] / 2.0)


def sleeve_loss(p: Mapping[str, float]) -> float:
    """Share of what a club loses, as it rings with its collet held, that its sleeve does [-].

    Args:
        p: the robot's numbers by name [SI].
    """
    own, others = _lost(p)
    return others / max(own + others, 1e-300)


def _lost(p: Mapping[str, float]) -> tuple[float, float]:
    """What shaft and sleeve lose, as dampers beside the shaft would [N s/m]."""
    return p["shaft_damping"], p["sleeve_damping"] / _lever(p) * sleeve_share(p) ** 2


def swapped_losses(model: Model, x: np.ndarray, stds: np.ndarray) -> np.ndarray | None:
    """Start values from which the other part loses what one of them seems to lose alone.

    A fit of a club has two ends: most of what the head gives way is the shaft's, or it is the
    sleeve's, and what is lost with it. Where one part loses nothing at all, the way to the other
    end may lead over a ridge; no curvature tells of it, and errors are far too small.

    Args:
        model: of any mechanism.
        x: where its fit stands, in natural sizes [-].
        stds: standard error of each entry [SI].

    Returns:
        As `x`; nothing where both parts lose, or where one constant of the two is not free in all
        records.

    Source: tests/identification/test_losses.py; a head on two springs in a row.
    """
    at = _free(model)
    if at is None:
        return None
    value = {name: float(x[i] * model.entries[i].scale) for name, i in at.items()}
    shaft, sleeve = (value[name] < NOUGHT * stds[at[name]] for name in DAMPERS)
    if shaft == sleeve:
        return None
    p = model.problem.numbers | value
    share, lever = sleeve_share(p), _lever(p)
    lost, kept = sum(_lost(p)), KEPT if sleeve else 1.0 - KEPT
    start = x.copy()
    sizes = kept * lost, (1.0 - kept) * lost * lever / share**2
    for name, size in zip(DAMPERS, sizes, strict=True):
        entry = model.entries[at[name]]
        start[at[name]] = np.clip(size, entry.low, entry.high) / entry.scale
    return start


def farness(model: Model, x: np.ndarray) -> float:
    """How unlikely a rig's guesses make constants of shaft and sleeve, a negative logarithm [-].

    A guess, with bounds far apart, is taken to be right within a factor of e or so: that says next
    to nothing of a fit, but much of two that explain the records alike.

    Args:
        model: of a club; a guess of 0 says nothing.
        x: scaled unknowns [-].

    Returns:
        It; nought where one constant of the four is not free in all records.

    Source: tests/identification/test_losses.py.
    """
    at = _free(model) or {}
    away = [
        np.log(max(x[at[name]] * model.entries[at[name]].scale / told, LOST))
        for name in at
        if name in (*SPRINGS, *DAMPERS) and (told := model.entries[at[name]].value) > 0.0
    ]
    return 0.5 * float(np.sum(np.square(away)))


def swapped_ends(model: Model, x: np.ndarray) -> np.ndarray | None:
    """Start values with all constants of shaft and sleeve told for each other.

    Between them is a grip that weighs little: springs in a row may change places, and the head
    moves as before. What a rig says of them tells the two ends apart.

    Args:
        model: of any mechanism.
        x: where its fit stands, scaled [-].

    Returns:
        As `x`; nothing where the rig's guesses are no nearer there by `NEARER`, or where one
        constant of the four is not free in all records.

    Source: tests/identification/test_losses.py; a head on two springs in a row.
    """
    at = _free(model)
    if at is None:
        return None
    lever = _lever(_values(model, x))
    start = x.copy()
    for shaft, sleeve in (SPRINGS, DAMPERS):
        first, second = model.entries[at[shaft]], model.entries[at[sleeve]]
        sizes = x[at[sleeve]] * second.scale / lever, x[at[shaft]] * first.scale * lever
        for name, entry, size in zip((shaft, sleeve), (first, second), sizes, strict=True):
            start[at[name]] = np.clip(size, entry.low, entry.high) / entry.scale
    return start if farness(model, start) < farness(model, x) - NEARER else None


def at_other_end(
    model: Model, x: np.ndarray, place: str, numbers: Sequence[tuple[float, tuple[int, int, int]]]
) -> list[float]:
    """What numbers of a law are where shaft and sleeve are told for each other.

    Args:
        model: of a robot.
        x: scaled unknowns [-].
        place: one of the `ENDS`, where the law is now.
        numbers: each with the exponents of force, length and time in its unit [SI].

    Returns:
        The same numbers at the other end [SI].

    Source: tests/identification/test_losses.py.
    """
    arm = _arm(_values(model, x))
    forces, lengths = (arm / 2.0, 1.0 / arm) if place == ENDS[0] else (2.0 / arm, arm)
    return [value * forces**force * lengths**length for value, (force, length, _) in numbers]


def _free(model: Model) -> dict[str, int] | None:
    """Where the constants are that all records share, by name.

    None where it is no robot, or one of the four of shaft and sleeve is not among them.
    """
    at = {e.name: i for i, e in enumerate(model.entries) if e.record is None and not e.nuisance}
    club = isinstance(model.problem.mechanism, Robot) and {*SPRINGS, *DAMPERS} <= set(at)
    return at if club else None


def _values(model: Model, x: np.ndarray) -> dict[str, float]:
    """A robot's numbers by name [SI]."""
    entries = enumerate(model.entries)
    own = {e.name: float(x[i] * e.scale) for i, e in entries if e.slot == "numbers"}
    return {**model.problem.numbers, **own}
