"""The planar robot: full kinematics of arm, wrist, collet, grip and clubhead in the swing plane."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from . import shaft

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s^2]."""

COORDINATES = ("collet_angle", "grip_displacement", "grip_angle", "clubhead_displacement")
"""Collet angle in the plane, zero where the arm's is and both point at the ball [rad]; the others
in the collet's frame [m, rad, m]."""

DRIVES = ("arm_angle", "wrist_angle")
"""What may be prescribed: the arm's angle, and the wrist drive's angle against the arm [rad]."""


@dataclass(frozen=True)
class Points:
    """Lengths along the club [m].

    Attributes:
        lever: grip centre to clubhead (a).
        grip: wrist pivot to grip centre (r).
        head: wrist pivot to clubhead (R).
    """

    lever: Any
    grip: Any
    head: Any


def points_of(p: Mapping[str, Any]) -> Points:
    """Lengths along the club [m] from the robot's numbers by contract name [SI]."""
    lever = p["club_length"] - p["grip_length"] / 2
    grip = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    return Points(lever, grip, grip + lever)


def most_bend(p: Mapping[str, Any]) -> Any:
    """Bend up to which the shaft is good, see `shaft.LARGEST_BEND` [m]."""
    return shaft.LARGEST_BEND * points_of(p).lever


def head_of(p: Mapping[str, Any], q: Any) -> shaft.Head:
    """Where the bent shaft holds the clubhead, from the grip's centre in the collet's axes [SI]."""
    lever, across = points_of(p).lever, q[3] - q[1]
    return shaft.head_at(lever, across, q[2], shaft.bend_of(lever, across, q[2]))


def head_rates(head: shaft.Head, v: Any) -> tuple[Any, Any]:
    """Rates of the shaft's bend and of `shaft.Head.along` [m/s] at velocities `v`."""
    return shaft.rates(head, v[3] - v[1], v[2])


def bend(p: Mapping[str, Any], q: Any) -> Any:
    """Bend of the shaft at the head, across the grip's own axis [m].

    For small angles of the grip it is ``x_cl - x_G - a th_G``.
    """
    return head_of(p, q).bend


def foreshortening(p: Mapping[str, Any], q: Any) -> Any:
    """How much nearer the bent shaft's head is to the grip, along the collet's axis [m].

    To second order ``a/2 (th_G^2 + 2 th_G s/a + 6/5 (s/a)^2)`` with the bend s and the length a.
    Without it the head is unstable from ``sqrt(k/m)`` on, 26 rad/s for `robo_v`.

    Source: `shaft.bend_of`; Kane, Ryan and Banerjee 1987, doi:10.2514/3.20195;
    tests/model/test_planar.py.
    """
    return points_of(p).lever - head_of(p, q).along


def kinetic_energy(
    p: Mapping[str, Any],
    q: Any,
    v: Any,
    drive: Any,
    drive_rate: Any,
    xp: Any,
    bent: shaft.Head | None = None,
) -> Any:
    """Kinetic energy of collet, grip and clubhead [J], every mass moved by arm and wrist.

    Args:
        p: the robot's numbers by contract name [SI].
        q: `COORDINATES`, 4 of them [rad, m, rad, m].
        v: their rates [rad/s, m/s, rad/s, m/s].
        drive: `DRIVES` [rad].
        drive_rate: their rates [rad/s].
        xp: what knows ``sin`` and ``cos`` of such numbers: jax.numpy, numpy or casadi.
        bent: `head_of` the coordinates, where it is known.

    Source: velocities of three points in the collet's axes; erratum A6 and A8 of the thesis's
    eq. 40 and 41; tests/model/test_planar.py.
    """
    at = points_of(p)
    turn, tilt = v[0], q[0] - drive[0]
    speed = p["arm_length"] * drive_rate[0]
    along, across = speed * xp.sin(tilt), speed * xp.cos(tilt)  # of the wrist pivot
    collet = 0.5 * p["collet_inertia"] * turn * turn + p["collet_mass"] * (
        0.5 * speed * speed + across * p["collet_centre"] * turn
    )
    grip = _speed_squared(along, across, at.grip, 0.0, q[1], v[1], turn)
    bent = head_of(p, q) if bent is None else bent
    near, near_rate = at.grip + bent.along, head_rates(bent, v)[1]
    head = _speed_squared(along, across, near, near_rate, q[3], v[3], turn)
    spin = turn + v[2]
    return (
        collet
        + 0.5 * p["grip_mass"] * grip
        + 0.5 * p["grip_inertia"] * spin * spin
        + 0.5 * p["clubhead_mass"] * head
    )


def _speed_squared(
    along: Any, across: Any, reach: Any, reach_rate: Any, x: Any, x_rate: Any, turn: Any
) -> Any:
    """Squared speed of a point at (reach, x) in the axes of a collet that turns and moves."""
    first = along + reach_rate - x * turn
    second = across + reach * turn + x_rate
    return first * first + second * second


def pivot_acceleration(p: Mapping[str, Any], u: Any, pull: Any, xp: Any) -> tuple[Any, Any]:
    """Acceleration of the wrist pivot less that of free fall, towards the ball and across [m/s^2].

    Args:
        p: the robot's numbers by contract name [SI].
        u: arm angle, its rate and the rate of that [rad, rad/s, rad/s^2].
        pull: gravity in the plane [m/s^2].
        xp: what knows ``sin`` and ``cos``.
    """
    lean, fall = xp.sin(u[0]), xp.cos(u[0])
    square = u[1] * u[1]
    down = p["arm_length"] * (-u[2] * lean - square * fall) - pull
    return down, p["arm_length"] * (u[2] * fall - square * lean)


def inertia_forces(
    p: Mapping[str, Any],
    q: Any,
    v: Any,
    a: Any,
    pivot: Any,
    axes: Any,
    bent: shaft.Head | None = None,
) -> tuple[Any, Any, Any, Any]:
    """What inertia and weight ask of each coordinate [N m, N, N m, N].

    Lagrange's equations of `kinetic_energy` and `weight_energy`, worked out: a hundred operations
    where differentiating takes three thousand.

    Args:
        p: the robot's numbers by contract name [SI].
        q: `COORDINATES`.
        v: their rates.
        a: the rates of these.
        pivot: see `pivot_acceleration` [m/s^2].
        axes: cosine and sine of the collet's angle [-].
        bent: `head_of` the coordinates, where it is known.

    Source: acceleration of a point in turning axes, Kane's projection on each coordinate;
    tests/model/test_planar.py derives the same from the energies.
    """
    at, turn, spin = points_of(p), v[0], a[0]
    square = turn * turn
    along = pivot[0] * axes[0] + pivot[1] * axes[1]
    across = pivot[1] * axes[0] - pivot[0] * axes[1]
    grip_along = along - square * at.grip - 2.0 * turn * v[1] - spin * q[1]
    grip_across = across + a[1] + spin * at.grip - square * q[1]
    bent = head_of(p, q) if bent is None else bent
    bend_rate, reach_rate = head_rates(bent, v)
    reach_bend = shaft.acceleration(bent, bend_rate, v[2], a[3] - a[1], a[2])
    reach, (drop, sink) = at.grip + bent.along, bent.along_by
    m = p["clubhead_mass"]
    head_along = m * (along + reach_bend - square * reach - 2.0 * turn * v[3] - spin * q[3])
    head_across = m * (across + a[3] + spin * reach + 2.0 * turn * reach_rate - square * q[3])
    twist = p["grip_inertia"] * (spin + a[2])
    of_collet = (
        p["collet_inertia"] * spin
        + p["collet_mass"] * p["collet_centre"] * across
        + p["grip_mass"] * (at.grip * grip_across - q[1] * grip_along)
        + twist
        + reach * head_across
        - q[3] * head_along
    )
    of_grip = p["grip_mass"] * grip_across - drop * head_along
    return of_collet, of_grip, twist + sink * head_along, head_across + drop * head_along


class Spring(NamedTuple):
    """One spring with its damper.

    Attributes:
        place: sleeve, shaft or wrist.
        stretch: [m or rad].
        rate: of the stretch [m/s or rad/s].
        along: slopes of the stretch by each of `COORDINATES`; of what it does not touch 0.0.
        pull: elastic force at the stretch [N or N m].
        stiffness: for small stretches [N/m or N m/rad].
        damping: [N s/m or N m s/rad].
    """

    place: str
    stretch: Any
    rate: Any
    along: tuple[Any, Any, Any, Any]
    pull: Any
    stiffness: Any
    damping: Any

    @property
    def force(self) -> Any:
        """Of spring and damper [N or N m]."""
        return self.pull + self.damping * self.rate

    def added(self, left: Any, force: Any) -> list[Any]:
        """Forces on the coordinates with this spring's at `force` added [N or N m]."""
        pairs = zip(left, self.along, strict=True)
        return [one if is_zero(slope) else one + slope * force for one, slope in pairs]


PLACES = ("sleeve", "sleeve", "shaft", "wrist")
"""Of the springs that `springs` gives, the wrist's where there is one."""


def springs(
    p: Mapping[str, Any],
    q: Any,
    v: Any,
    drive: Any,
    drive_rate: Any,
    wrist: bool,
    bent: shaft.Head | None = None,
) -> list[Spring]:
    """Both ends of the sleeve, the shaft and, where there is one, the wrist, as in `PLACES`.

    Args:
        p: the robot's numbers by contract name [SI].
        q: `COORDINATES`.
        v: their rates.
        drive: `DRIVES`.
        drive_rate: their rates.
        wrist: whether a spring holds the wrist.
        bent: `head_of` the coordinates, where it is known.

    Returns:
        The springs as they are stretched; the shaft's as `supple.model.shaft` has it.
    """
    half, lever = p["sleeve_spacing"] / 2, points_of(p).lever
    found = [
        _linear("sleeve", (0.0, 1.0, side, 0.0), *_pair(p, which), part, part_rate)
        for side, which, part, part_rate in (
            (-half, "upper", q[1] - half * q[2], v[1] - half * v[2]),
            (half, "lower", q[1] + half * q[2], v[1] + half * v[2]),
        )
    ]
    bent = head_of(p, q) if bent is None else bent
    by_across, by_tilt = bent.bend_by
    k = p["shaft_stiffness"]
    found.append(
        Spring(
            "shaft", bent.bend, head_rates(bent, v)[0], (0.0, -by_across, by_tilt, by_across),
            shaft.force(lever, k, bent.bend), k, p["shaft_damping"],
        )
    )  # fmt: skip
    if wrist:
        turned, turning = q[0] - drive[0] - drive[1], v[0] - drive_rate[0] - drive_rate[1]
        k, c = p["wrist_stiffness"], p["wrist_damping"]
        found.append(_linear("wrist", (1.0, 0.0, 0.0, 0.0), k, c, turned, turning))
    return found


def _linear(place: str, along: Any, k: Any, c: Any, stretch: Any, rate: Any) -> Spring:
    return Spring(place, stretch, rate, along, k * stretch, k, c)


def _pair(p: Mapping[str, Any], which: str) -> tuple[Any, Any]:
    """Stiffness and damping of one set of two elements."""
    k = p.get(f"sleeve_stiffness_{which}", p.get("sleeve_stiffness"))
    c = p.get(f"sleeve_damping_{which}", p.get("sleeve_damping"))
    assert k is not None and c is not None, "checked at the door of the rig"
    return 2 * k, 2 * c


def is_zero(entry: Any) -> bool:
    """Whether a slope is one of those that are 0.0 by themselves, which no compiler may drop."""
    return isinstance(entry, float) and entry == 0.0


def spring_energy(
    p: Mapping[str, Any], q: Any, drive: Any, wrist: bool, bent: shaft.Head | None = None
) -> Any:
    """Energy of sleeve, shaft and, where there is one, wrist [J]; arguments as above."""
    total = 0.0
    for one in springs(p, q, (0.0,) * 4, drive, (0.0, 0.0), wrist, bent):
        if one.place == "shaft":
            total = total + shaft.energy(points_of(p).lever, one.stiffness, one.stretch)
        else:
            total = total + 0.5 * one.stiffness * one.stretch * one.stretch
    return total


def dissipation(p: Mapping[str, Any], q: Any, v: Any, drive_rate: Any, wrist: bool) -> Any:
    """Rayleigh's dissipation of sleeve, shaft and wrist [W]; arguments as above."""
    found = springs(p, q, v, (0.0, 0.0), drive_rate, wrist)
    return sum(0.5 * one.damping * one.rate * one.rate for one in found)


def weight_energy(
    p: Mapping[str, Any],
    q: Any,
    drive: Any,
    pull: Any,
    xp: Any,
    bent: shaft.Head | None = None,
) -> Any:
    """Potential energy of collet, grip and clubhead in the swing plane [J].

    Args:
        p: the robot's numbers by contract name [SI].
        q: `COORDINATES`.
        drive: `DRIVES`.
        pull: gravity in the plane, ``g sin(inclination)``, towards the ball [m/s^2].
        xp: what knows ``sin`` and ``cos``.
        bent: `head_of` the coordinates, where it is known.
    """
    at = points_of(p)
    near = at.grip + (head_of(p, q) if bent is None else bent).along
    wrist = p["arm_length"] * xp.cos(drive[0])
    down, side = xp.cos(q[0]), xp.sin(q[0])
    depth = (
        p["collet_mass"] * (wrist + p["collet_centre"] * down)
        + p["grip_mass"] * (wrist + at.grip * down - q[1] * side)
        + p["clubhead_mass"] * (wrist + near * down - q[3] * side)
    )
    return -pull * depth


def clubhead_velocity(
    p: Mapping[str, Any],
    q: Any,
    v: Any,
    drive: Any,
    drive_rate: Any,
    xp: Any,
    bent: shaft.Head | None = None,
) -> tuple[Any, Any]:
    """Velocity of the clubhead along and across the collet's axis, shortening included [m/s].

    Arguments as for `kinetic_energy`.
    """
    at = points_of(p)
    speed = p["arm_length"] * drive_rate[0]
    tilt = q[0] - drive[0]
    bent = head_of(p, q) if bent is None else bent
    along = speed * xp.sin(tilt) + head_rates(bent, v)[1] - q[3] * v[0]
    across = speed * xp.cos(tilt) + (at.grip + bent.along) * v[0] + v[3]
    return along, across
