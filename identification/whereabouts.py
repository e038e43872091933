"""Where what no law explains sits, asked without any law: a channel, the drive, or a place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..model.chain import DERIVATIVES
from .base import fit_base
from .beside import each_whole
from .evidence import excess
from .fit import CRAWL, Fit, settle, solve
from .missing import MissingForce, missing_force
from .prepare import Prepared
from .problem import Model, Problem, base_entries, rough_noise
from .standing import misfit_chance
from .swung import is_swung_place
from .tolerances import strained, strays

SMALL_EXCESS = 0.3
"""Misfit beyond noise that is let pass when no law explains it, in units of the noise [-]."""

CLEARED = 1e-4
"""Chance of the worst channel's misfit from which what is left fits by itself [-]."""

DRIVE = "drive"

EVALUATIONS = 40
"""Of a fit without a channel, from where the fit with it stands [-]."""

AS_WELL = 10.0
"""Score by which a force on a body must be better than one of a spring [-]: between the ground and
the only body that a spring holds they are the same."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Apart:
    """What is left of records when one thing is not believed.

    Attributes:
        what: the channel's name, or ``drive``.
        left: power of the others' misfit beyond their noise, in units of the noise [-].
        chance: of the worst channel's misfit among them under its noise [-].
        before: the same power of what is not believed, with it [-].
        fit: of the others alone.
    """

    what: str
    left: float
    chance: float
    before: float
    fit: Fit

    @property
    def fits(self) -> bool:
        """Whether the others are explained to within their noise."""
        return self.left <= SMALL_EXCESS and self.chance >= CLEARED


@dataclass(frozen=True)
class Whereabouts:
    """Where what is missing sits, and what speaks for it.

    Attributes:
        place: a channel's name, ``drive``, or a place of the mechanism.
        kind: ``channel``, ``drive`` or ``place``.
        apart: what is left when one thing is not believed, best first.
        forces: forces that are missing at places, the likeliest first; empty unless it is a place.
    """

    place: str
    kind: str
    apart: tuple[Apart, ...]
    forces: tuple[MissingForce, ...] = ()


def stray_place(fit: Fit) -> Whereabouts | None:
    """Where a number is not what was stated: a channel's, or one of the rig's; None where all are.

    Args:
        fit: one that leaves no misfit, see `strays` and `strained`.

    Source: tests/identification/test_whereabouts.py.
    """
    found = strays(fit)
    if found:
        return Whereabouts(found[0].channel, "channel", ())
    names = fit.problem.mechanism.law_places()
    for number, _ in strained(fit):
        for place in names:
            if number.startswith(f"{place}_") or place in number.split("."):
                return Whereabouts(place, "place", ())
    return None


def whereabouts(
    fit: Fit, progress: Progress = lambda text: None, asked: tuple[Apart, ...] | None = None
) -> Whereabouts | None:
    """Where what no law explains sits, by what the records themselves say.

    If all but one channel fit without it, it is that channel; if all but what a told motion drives
    do, it is the drive. Otherwise it is the place where a force, free in time, explains most of
    the record that is explained worst, by its evidence: one that may push in two rows has twice
    as many numbers.

    Args:
        fit: of the rig as it stands, no law in force.
        progress: told what is tried.
        asked: what `apart` found for this fit, where it was asked already.

    Returns:
        It; None where no place can be asked.

    Source: tests/identification/test_whereabouts.py.
    """
    found = apart(fit, progress) if asked is None else asked
    if found and found[0].fits:
        kind = "drive" if found[0].what == DRIVE else "channel"
        return Whereabouts(found[0].what, kind, found)
    progress("looking for the place of the missing force")
    places = [p for p in fit.problem.mechanism.law_places() if not is_swung_place(fit.problem, p)]
    pushed = each_whole(lambda place: missing_force(fit, place), places)
    links = fit.problem.mechanism.law_places()
    forces = sorted(
        (one for one in pushed if one is not None),
        key=lambda one: one.score + (0.0 if links[one.place] == "link" else AS_WELL),
    )
    return Whereabouts(forces[0].place, "place", found, tuple(forces)) if forces else None


def apart(fit: Fit, progress: Progress = lambda text: None) -> tuple[Apart, ...]:
    """Ask of each channel, and of the drive, whether all else fits without it.

    What an instrument does to its own reading leaves all others as they were. What a mechanism
    does shows in more than one channel, in free and in driven records alike.

    Args:
        fit: of the rig as it stands.
        progress: told what is tried.

    Returns:
        One for each that can be left out: first those without which all else fits, whose own misfit
        is largest, then those without which least is left. A fit goes on from where `fit` stands
        or, where none fits so, begins anew.

    Source: leave-one-out validation of sensors, as in analytical redundancy (Chow and Willsky 1984,
    doi:10.1109/TAC.1984.1103593); tests/identification/test_whereabouts.py.
    """
    parts = _parts(fit.problem)

    def on(part: tuple[str, Problem]) -> Apart:
        what, problem = part
        progress(f"fitting all but {what}")
        return _apart(fit, what, _from_there(fit, problem))

    def anew(part: tuple[str, Problem]) -> Apart:
        what, problem = part
        progress(f"fitting all but {what} anew")
        return _apart(fit, what, fit_base(problem))

    found = each_whole(on, parts)
    if not any(one.fits for one in found):
        again = each_whole(anew, parts)
        found = [min(pair, key=lambda one: one.left) for pair in zip(found, again, strict=True)]
    return tuple(sorted(found, key=lambda one: (0, -one.before) if one.fits else (1, one.left)))


def _parts(problem: Problem) -> list[tuple[str, Problem]]:
    """What can be left out, with the problem of all else."""
    names = dict.fromkeys(s.channel.name for p in problem.records for s in p.sensors)
    found = []
    for name in names:
        kept = [_without(p, name) for p in problem.records]
        found.append((name, tuple(p for p in kept if p.sensors)))
    found.append((DRIVE, tuple(p for p in problem.records if not _is_told(p))))
    return [
        (what, replace(problem, records=records, floor={}))
        for what, records in found
        if records and records != problem.records
    ]


def _is_told(prepared: Prepared) -> bool:
    """Whether a record is driven by a motion that is told, not by a force."""
    return any(port.quantity in DERIVATIVES for port in prepared.ports) and not prepared.free


def _without(prepared: Prepared, name: str) -> Prepared:
    kept = tuple(s for s in prepared.sensors if s.channel.name != name)
    return prepared if len(kept) == len(prepared.sensors) else replace(prepared, sensors=kept)


def _from_there(fit: Fit, problem: Problem) -> Fit:
    """The fit of a part of the records, from where the fit of all stands."""
    model = Model(problem, base_entries(problem), (), rough_noise(problem))
    start = values_at(model, fit)
    return settle(solve(model, start, EVALUATIONS, CRAWL), at_last=False)


def values_at(model: Model, fit: Fit) -> np.ndarray:
    """Scaled unknowns [-] of a model where another fit has them, or as they begin."""
    known = {e.label: fit.value(i) for i, e in enumerate(fit.model.entries)}
    return np.array([known.get(e.label, e.value) / e.scale for e in model.entries])


def _apart(fit: Fit, what: str, other: Fit) -> Apart:
    own = [
        (misfit.bins, misfit.ratio)
        for (record, channel), misfit in fit.misfits.items()
        if (record, channel) not in other.misfits
    ]
    bins = sum(count for count, _ in own)
    before = sum(count * max(ratio - 1.0, 0.0) for count, ratio in own) / max(bins, 1)
    return Apart(what, excess(other), misfit_chance(other), before, other)
