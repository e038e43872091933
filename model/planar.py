"""The planar robot: full kinematics of arm, wrist, collet, grip and clubhead in the swing plane."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

GRAVITY = 9.80665
"""Standard acceleration of free fall [m/s^2]."""

LARGEST_BEND = 0.1
"""Bend of the shaft up to which its foreshortening of second order is good [m]."""

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


def bend(p: Mapping[str, Any], q: Any) -> Any:
    """Bend of the shaft at the head, ``x_cl - x_G - a th_G`` [m]."""
    return q[3] - q[1] - points_of(p).lever * q[2]


def foreshortening(p: Mapping[str, Any], q: Any) -> Any:
    """How much nearer the bent shaft's head is to the grip, to second order [m].

    The shaft bends as a cantilever under a load at its head: half the integral of its slope
    squared, ``a/2 (th_G^2 + 2 th_G s/a + 6/5 (s/a)^2)`` with the bend s and the length a.
    Without it the head is unstable from ``sqrt(k/m)`` on, 26 rad/s for `robo_v`.

    Source: Kane, Ryan and Banerjee 1987, doi:10.2514/3.20195; tests/model/test_planar.py.
    """
    lever = points_of(p).lever
    slope = bend(p, q) / lever
    return 0.5 * lever * (q[2] * q[2] + 2.0 * q[2] * slope + 1.2 * slope * slope)


def foreshortening_rate(p: Mapping[str, Any], q: Any, v: Any) -> Any:
    """Rate of the foreshortening [m/s] at velocities `v`."""
    lever = points_of(p).lever
    slope, rate = bend(p, q) / lever, bend(p, v) / lever
    return lever * (q[2] * v[2] + v[2] * slope + q[2] * rate + 1.2 * slope * rate)


def kinetic_energy(p: Mapping[str, Any], q: Any, v: Any, drive: Any, drive_rate: Any, xp: Any):
    """Kinetic energy of collet, grip and clubhead [J], every mass moved by arm and wrist.

    Args:
        p: the robot's numbers by contract name [SI].
        q: `COORDINATES`, 4 of them [rad, m, rad, m].
        v: their rates [rad/s, m/s, rad/s, m/s].
        drive: `DRIVES` [rad].
        drive_rate: their rates [rad/s].
        xp: what knows ``sin`` and ``cos`` of such numbers: jax.numpy, numpy or casadi.

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
    near = at.head - foreshortening(p, q)
    head = _speed_squared(along, across, near, -foreshortening_rate(p, q, v), q[3], v[3], turn)
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
    p: Mapping[str, Any], q: Any, v: Any, a: Any, pivot: Any, axes: Any
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

    Source: acceleration of a point in turning axes, Kane's projection on each coordinate;
    tests/model/test_planar.py derives the same from the energies.
    """
    at, turn, spin = points_of(p), v[0], a[0]
    square = turn * turn
    along = pivot[0] * axes[0] + pivot[1] * axes[1]
    across = pivot[1] * axes[0] - pivot[0] * axes[1]
    grip_along = along - square * at.grip - 2.0 * turn * v[1] - spin * q[1]
    grip_across = across + a[1] + spin * at.grip - square * q[1]
    s, s_rate = bend(p, q), bend(p, v)
    slope, slope_rate = q[2] + 1.2 * s / at.lever, v[2] + 1.2 * s_rate / at.lever
    open_rate = v[3] - v[1]
    short_rate = slope * open_rate - 0.2 * s * v[2]
    short_bend = (
        slope * (a[3] - a[1]) - 0.2 * s * a[2] + slope_rate * open_rate - 0.2 * s_rate * v[2]
    )
    reach = at.head - foreshortening(p, q)
    m = p["clubhead_mass"]
    head_along = m * (along - short_bend - square * reach - 2.0 * turn * v[3] - spin * q[3])
    head_across = m * (across + a[3] + spin * reach - 2.0 * turn * short_rate - square * q[3])
    twist = p["grip_inertia"] * (spin + a[2])
    of_collet = (
        p["collet_inertia"] * spin
        + p["collet_mass"] * p["collet_centre"] * across
        + p["grip_mass"] * (at.grip * grip_across - q[1] * grip_along)
        + twist
        + reach * head_across
        - q[3] * head_along
    )
    of_grip = p["grip_mass"] * grip_across + slope * head_along
    return of_collet, of_grip, twist + 0.2 * s * head_along, head_across - slope * head_along


def spring_rows(p: Mapping[str, Any], wrist: bool) -> list[tuple[str, list[Any], Any, Any]]:
    """Place, row over (coordinates, drives), stiffness and damping of each spring [SI]."""
    half, lever = p["sleeve_spacing"] / 2, points_of(p).lever
    rows = [
        ("sleeve", [0.0, 1.0, -half, 0.0, 0.0, 0.0], *_pair(p, "upper")),
        ("sleeve", [0.0, 1.0, half, 0.0, 0.0, 0.0], *_pair(p, "lower")),
        ("shaft", [0.0, -1.0, -lever, 1.0, 0.0, 0.0], p["shaft_stiffness"], p["shaft_damping"]),
    ]
    if wrist:
        joint = [1.0, 0.0, 0.0, 0.0, -1.0, -1.0]
        rows.append(("wrist", joint, p["wrist_stiffness"], p["wrist_damping"]))
    return rows


def _pair(p: Mapping[str, Any], which: str) -> tuple[Any, Any]:
    """Stiffness and damping of one set of two elements."""
    k = p.get(f"sleeve_stiffness_{which}", p.get("sleeve_stiffness"))
    c = p.get(f"sleeve_damping_{which}", p.get("sleeve_damping"))
    assert k is not None and c is not None, "checked at the door of the rig"
    return 2 * k, 2 * c


def stretch(row: list[Any], q: Any, drive: Any) -> Any:
    """Stretch of a spring [m or rad]: its row times coordinates and drives; or its rate."""
    seen = (q[0], q[1], q[2], q[3], drive[0], drive[1])
    # most entries are zeros, which no compiler may drop for itself
    terms = [k * x for k, x in zip(row, seen, strict=True) if not _is_zero(k)]
    return sum(terms[1:], terms[0])


def _is_zero(entry: Any) -> bool:
    return isinstance(entry, float) and entry == 0.0


def spring_energy(p: Mapping[str, Any], q: Any, drive: Any, wrist: bool) -> Any:
    """Energy of sleeve, shaft and, where there is one, wrist [J]; arguments as above."""
    return sum(0.5 * k * stretch(row, q, drive) ** 2 for _, row, k, _ in spring_rows(p, wrist))


def dissipation(p: Mapping[str, Any], v: Any, drive_rate: Any, wrist: bool) -> Any:
    """Rayleigh's dissipation of sleeve, shaft and wrist [W]; arguments as above."""
    return sum(0.5 * c * stretch(row, v, drive_rate) ** 2 for _, row, _, c in spring_rows(p, wrist))


def weight_energy(p: Mapping[str, Any], q: Any, drive: Any, pull: Any, xp: Any) -> Any:
    """Potential energy of collet, grip and clubhead in the swing plane [J].

    Args:
        p: the robot's numbers by contract name [SI].
        q: `COORDINATES`.
        drive: `DRIVES`.
        pull: gravity in the plane, ``g sin(inclination)``, towards the ball [m/s^2].
        xp: what knows ``sin`` and ``cos``.
    """
    at = points_of(p)
    near = at.head - foreshortening(p, q)
    wrist = p["arm_length"] * xp.cos(drive[0])
    down, side = xp.cos(q[0]), xp.sin(q[0])
    depth = (
        p["collet_mass"] * (wrist + p["collet_centre"] * down)
        + p["grip_mass"] * (wrist + at.grip * down - q[1] * side)
        + p["clubhead_mass"] * (wrist + near * down - q[3] * side)
    )
    return -pull * depth


def clubhead_velocity(
    p: Mapping[str, Any], q: Any, v: Any, drive: Any, drive_rate: Any, xp: Any
) -> tuple[Any, Any]:
    """Velocity of the clubhead along and across the collet's axis, shortening included [m/s]."""
    at = points_of(p)
    speed = p["arm_length"] * drive_rate[0]
    tilt = q[0] - drive[0]
    along = speed * xp.sin(tilt) - foreshortening_rate(p, q, v) - q[3] * v[0]
    across = speed * xp.cos(tilt) + (at.head - foreshortening(p, q)) * v[0] + v[3]
    return along, across
