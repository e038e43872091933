"""What a record was allowed to leave open, told, and what of it went beyond its tolerance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .allowance import FEW, MANY, Used
from .fit import Fit

MEANINGS = {
    "drive": "errors of the told motion, a number every few milliseconds",
    "delay": "the told motion's clock",
    "lever": "where on the clubhead the sensor sits",
    "ringing": "the club's next mode, rung by a release or a blow",
    "ripple": "what a lumped club misses of a ripple's response",
}


def allowed_json(fit: Fit) -> list[dict[str, Any]]:
    """Every kind of numbers that each record left open, in units of their priors [-]."""
    return [
        {
            "record": one.record,
            "what": MEANINGS[one.kind],
            "kind": one.kind,
            "count": one.count,
            "rms": one.rms,
            "largest": one.largest,
            "beyond_tolerance": one.beyond,
        }
        for one in fit.used
    ]


FAR = 10.0
"""Size of a channel's zero, gain or delay, over the tolerance that its sidecar states [-], from
which it is no nuisance more: what a lumped club leaves of a real one moves them by a few."""

PULLED = 6.0
"""Pull from which a rig's numbers have made room for a cause that is missing [-]."""

STATED = {"offset": ("offset",), "gain": ("gain", "radius"), "delay": ("delay",)}
"""Keys of a sidecar's tolerance that bind each kind of number."""

CALLED = {"offset": "the zero", "gain": "the gain", "delay": "the delay"}


@dataclass(frozen=True)
class Stray:
    """A channel's number that is far from what its sidecar states.

    Attributes:
        channel: its name.
        record: the record's.
        kind: offset, gain or delay.
        ratio: its size over the tolerance [-].
    """

    channel: str
    record: str
    kind: str
    ratio: float


def strays(fit: Fit) -> tuple[Stray, ...]:
    """Numbers of channels that explain records only far beyond what was stated of them.

    Args:
        fit: any; where nothing was stated, nothing strays.

    Returns:
        The farthest first.

    Source: tests/identification/test_whereabouts.py.
    """
    found = []
    records = {prepared.name: prepared for prepared in fit.problem.records}
    for index, entry in enumerate(fit.model.entries):
        if entry.slot not in STATED or entry.record not in records or not entry.nuisance:
            continue
        channel = records[entry.record].sensors[int(entry.keys[0])].channel
        ratio = abs(fit.value(index) - entry.center) / entry.prior
        if any(channel.tolerance.get(key) for key in STATED[entry.slot]) and ratio > FAR:
            found.append(Stray(channel.name, entry.record, entry.slot, ratio))
    return tuple(sorted(found, key=lambda one: -one.ratio))


def strained(fit: Fit) -> tuple[tuple[str, float], ...]:
    """Numbers of the rig that explain records only far beyond what was stated of them.

    Args:
        fit: any; guesses that say nothing of how sure they are cannot strain.

    Returns:
        Name, and distance from what the rig says over its tolerance [-]; the farthest first.

    Source: tests/identification/test_whereabouts.py.
    """
    found = [(name, pull) for name, pull in _pulls(fit) if pull > PULLED]
    return tuple(sorted(found, key=lambda one: -one[1]))


def beyond_words(fit: Fit) -> str:
    """A sentence on what went beyond its tolerance [-]; empty where nothing did."""
    told = [_words(one) for one in fit.used if one.beyond]
    told += [f"{name}, {pull:.0f} times what the rig states" for name, pull in strained(fit)[:1]]
    told += [
        f"{CALLED[one.kind]} of {one.channel} in {one.record}, {one.ratio:.0f} times what its "
        "sidecar states"
        for one in strays(fit)[:1]
    ]
    return f"Beyond its tolerance: {'; '.join(told)}." if told else ""


def _words(one: Used) -> str:
    if one.count > 50:
        return (
            f"{MEANINGS[one.kind]} in {one.record}, {one.rms:.1f} times what its noise and "
            f"rounding allow (limit {MANY:g})"
        )
    return f"{MEANINGS[one.kind]} in {one.record}, {one.largest:.1f} times its (limit {FEW:g})"


def worst_pull(fit: Fit) -> float:
    """How far the worst of a rig's numbers is from what is stated of it, in its own deviation [-].

    Args:
        fit: any; guesses that say nothing of how sure they are count for nothing.

    Source: tests/identification/test_told.py.
    """
    return max((pull for _, pull in _pulls(fit)), default=0.0)


def _pulls(fit: Fit) -> list[tuple[str, float]]:
    """Name and pull [-] of each of a rig's numbers of which a tolerance is stated."""
    return [
        (entry.label, float(abs(fit.value(index) - entry.center) / entry.prior))
        for index, entry in enumerate(fit.model.entries)
        if entry.slot == "numbers" and entry.record is None and np.isfinite(entry.prior)
    ]
