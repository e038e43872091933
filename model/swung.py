"""What a told motion swings: a club in axes that turn and whose origin is pulled, to first order.

The thesis's equations are those of small motions in the collet's axes. These axes turn, and their
origin, the wrist's pivot, is pulled round by the arm. Beside what the equations carry, a motion
that is told says at every instant a force on each coordinate and a stiffness between them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

SLOPE_AT_HEAD = 1.5
"""Slope of a cantilever at its loaded end, over its bend by its length [-]."""

SWUNG_HEAD = "swung_clubhead"
"""Where a club that turns is pulled outwards; ``clubhead`` itself is the head as a body [-]."""

KINDS = {"arm": "arm", "club": "swung", SWUNG_HEAD: "spun"}
"""Of what kind for laws each place of a swung club is [-]."""


class Told(NamedTuple):
    """What a drive tells of a swing at an instant; arrays with a last axis of one, for the rows.

    Attributes:
        wrist: told angle of the collet against the arm [rad].
        rate: of the arm's angle [rad/s].
        bend: the rate of that [rad/s^2].
        lean: told angle of the collet, from where it points at the ball [rad].
        spin: its rate [rad/s].
        length: of the arm [m].
        moment: first moment of collet, grip and clubhead about the wrist's pivot [kg m].
    """

    wrist: Any
    rate: Any
    bend: Any
    lean: Any
    spin: Any
    length: Any
    moment: Any


class SwungRows(NamedTuple):
    """What the rows of swung places are; shape (rows,) each, zero elsewhere.

    Attributes:
        first: 1 on a place's first row [-].
        weight: what each row's stretch is worth, see `weights` [kg, kg/m or 1].
    """

    first: Any
    weight: Any


class Felt(NamedTuple):
    """How an accelerometer rides on a swung club, at every instant.

    Attributes:
        moved: 1 where it feels the pivot's acceleration, 0 in the collet's frame [-].
        turn: of the collet beyond what is told [rad].
        tilt: of the sensor's axis against the collet [rad].
        spun: how far it is from where a turn would have its axis point at the pivot [m].
    """

    moved: Any
    turn: Any
    tilt: Any
    spun: Any


def first_moment(p: Mapping[str, Any]) -> Any:
    """First moment of collet, grip and clubhead about the wrist's pivot [kg m]."""
    _, grip, head = _lengths(p)
    collet = p.get("collet_mass", 0.0) * p.get("collet_centre", 0.0)
    return collet + p["grip_mass"] * grip + p["clubhead_mass"] * head


def stretches(place: str, p: Mapping[str, Any]) -> list[tuple[list[Any], float]]:
    """Rows of a swung place over the four coordinates, and how told angles count in each.

    At ``arm`` and ``club``: the collet's turn beyond what is told, the first moment of what is
    displaced, the club's chord and the shaft's bend; at `SWUNG_HEAD`: the last two and the
    displacements of clubhead and grip. Rows over collet angle, grip displacement and angle,
    clubhead displacement [1, m or kg].
    """
    lever = _lengths(p)[0]
    chord, bend = [0.0, -1.0, 0.0, 1.0], [0.0, -1.0, -lever, 1.0]
    if place == SWUNG_HEAD:
        rows = [chord, bend, [0.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.0]]
        return [(row, 0.0) for row in rows]
    moved = [0.0, p["grip_mass"], 0.0, p["clubhead_mass"]]
    return [([1.0, 0.0, 0.0, 0.0], -1.0), (moved, 0.0), (chord, 0.0), (bend, 0.0)]


def pushes(place: str, p: Mapping[str, Any]) -> list[list[Any]]:
    """Where a unit force of each of these rows pushes: generalized forces as `stretches`."""
    rows = [row for row, _ in stretches(place, p)]
    if place == SWUNG_HEAD:
        return rows
    masses = [first_moment(p), p["grip_mass"], 0.0, p["clubhead_mass"]]
    return [masses, [1.0, 0.0, 0.0, 0.0], *rows[2:]]


def weights(place: str, p: Mapping[str, Any]) -> list[Any]:
    """What each row's stretch is worth to an outward pull or to a turn [kg, kg/m or 1].

    An acceleration of the pivot of 1 m/s^2 along the club draws a moment from what is displaced
    and, as the head's tension, straightens chord and bend; a turn of 1 rad/s draws the head along
    its reach, and clubhead and grip away.

    Source: `planar.inertia_forces` to first order; tests/model/test_swung.py.
    """
    lever, _, head = _lengths(p)
    tension = p["clubhead_mass"] / lever
    if place == SWUNG_HEAD:
        tension = tension * head
        return [tension, 0.2 * tension, -p["clubhead_mass"], -p["grip_mass"]]
    return [0.0, 1.0, tension, 0.2 * tension]


def felt_rows(place: str, frame: str, p: Mapping[str, Any]) -> tuple[float, list[Any], list[Any]]:
    """Whether an accelerometer feels the pivot, and its tilt and its distance as `Felt` has them.

    Rows over the four coordinates [rad, m]; nothing for places that do not swing.
    """
    lever, grip, head = _lengths(p)
    moved, rest = float(frame == "absolute"), [0.0] * 4
    if place == "clubhead":
        slope = SLOPE_AT_HEAD / lever
        tilt = [0.0, -slope, 1.0 - SLOPE_AT_HEAD, slope]
        return moved, tilt, [head * x - own for x, own in zip(tilt, (0, 0, 0, 1.0), strict=True)]
    if place in ("grip", "shaft"):
        return moved, [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, grip, 0.0]
    return moved * (place in ("collet", "wrist", "hand")), rest, rest


def told_from(
    joints: Sequence[tuple[str, Any, Any, Any]], length: Any, moment: Any, none: Any
) -> Told:
    """What joints tell: name, angle, rate and its rate of each; `none` is zero in their shape."""
    known = {name: values for name, *values in joints}
    angle, rate, bend = known.get("arm", (none, none, none))
    flex, flick, _ = known.get("wrist", (none, none, none))
    parts = (flex, rate, bend, angle + flex, rate + flick)
    wrist, rate, bend, lean, spin = (part[..., None] for part in parts)
    return Told(wrist, rate, bend, lean, spin, length, moment)


def _lengths(p: Mapping[str, Any]) -> tuple[Any, Any, Any]:
    """Grip centre to clubhead, and the pivot to each of these [m]."""
    lever = p["club_length"] - p["grip_length"] / 2
    grip = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    return lever, grip, grip + lever
