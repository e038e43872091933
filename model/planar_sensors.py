"""What sensors see of the planar robot: a camera at rest, a rider on the bent club, a gauge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from . import planar, shaft
from .chain import DERIVATIVES
from .linear import Port
from .robot import STRAIN_PER_BEND

TRANSLATIONS = ("position", "velocity", "acceleration")


@dataclass(frozen=True)
class Track:
    """How the planar robot moved, and what moved it.

    Attributes:
        q: `planar.COORDINATES`, shape (t, 4) [rad, m, rad, m].
        v: their rates [SI].
        a: the rates of these [SI].
        drive: `planar.DRIVES`, shape (t, 2) [rad].
        drive_rate: their rates, shape (t, 2) [rad/s].
        drive_bend: the rates of these, shape (t, 2) [rad/s^2].
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    drive: np.ndarray
    drive_rate: np.ndarray
    drive_bend: np.ndarray


def track_of(q: np.ndarray, v: np.ndarray, a: np.ndarray, signals: np.ndarray) -> Track:
    """The track of a motion under signals as `planar_march.Legs` has them, shape (t or more, 8).

    Args:
        q: coordinates, shape (t, 4), or (t, 3) where the collet cannot turn [SI].
        v: their rates.
        a: the rates of these.
        signals: at the samples, and perhaps beyond [SI].
    """
    held = ((0, 0), (4 - q.shape[1], 0))
    drive = signals[: len(q)]
    bends = np.stack([drive[:, 4], 0.0 * drive[:, 4]], axis=1)  # no sensor sees the wrist's drive
    q, v, a = np.pad(q, held), np.pad(v, held), np.pad(a, held)
    return Track(q, v, a, drive[:, :2], drive[:, 2:4], bends)


def planar_samples(p: Mapping[str, float], track: Track, port: Port) -> np.ndarray:
    """What one sensor sees, shape (t,) [SI unit of its quantity].

    ============ ============ ======================================================================
    quantity     frame        what is seen of clubhead, grip or, on an arm, the wrist's pivot
    ============ ============ ======================================================================
    position     absolute     by a camera: how far it is across the line from shoulder to ball
    velocity     absolute     the rate of that
    acceleration absolute     by an accelerometer that rides on it: the whole acceleration, along
                              the sensor's axis, which lies across the shaft where it is fixed and
                              so turns and tilts with the collet, the grip and the shaft's bend
    position     collet       displacement in the collet's axes
    velocity     collet       its rate
    acceleration collet       the accelerometer's less that of a rigid club on the same collet,
                              ``A + R th_col''`` with the pivot's own acceleration A across it
    ============ ============ ======================================================================

    Angles are those of the thesis fidelity; the wrist's is against the arm. Weight is not in an
    acceleration: a piezo sensor passes no constant. For small motions all become the rows of
    `supple.model.robot`; the frame's terms (``-w^2 x``, ``2 w x'``, the shaft's shortening, the
    tilt) are of higher order.

    Args:
        p: the robot's numbers by contract name [SI].
        track: the motion.
        port: place, quantity and frame; checked before, see `Robot.sensor_row`.

    Source: thesis lines 1291 and 1871 (what is subtracted); tests/model/test_planar_motion.py.
    """
    order, relative = DERIVATIVES[port.quantity], port.frame == "collet"
    own = (track.q, track.v, track.a)[order].T
    drive = (track.drive, track.drive_rate, track.drive_bend)[order].T
    if port.quantity in ("strain", "deflection"):
        scale = STRAIN_PER_BEND if port.quantity == "strain" else 1.0
        return scale * planar.bend(p, own)
    if port.quantity not in TRANSLATIONS:
        turned = {"arm": drive[0], "wrist": own[0] - drive[0]}
        if port.place == "grip":
            return own[2] + (0.0 if relative else own[0])
        return turned.get(port.place, own[0])
    if port.quantity == "acceleration":
        return _felt(p, track, port.place, relative)
    if relative:
        column = {"clubhead": 3, "grip": 1, "shaft": 1}.get(port.place)
        return np.zeros(len(track.q)) if column is None else own[column]
    return _filmed(p, track, port.place, order)


def _filmed(p: Mapping[str, float], track: Track, place: str, order: int) -> np.ndarray:
    """Place across the line from shoulder to ball, or its rate [m or m/s]."""
    q, v, arm, turn = track.q.T, track.v.T, track.drive[:, 0], track.drive_rate[:, 0]
    reach, reach_rate, x, x_rate = _place(p, track, place)[:4]
    sine, cosine, swung = np.sin(q[0]), np.cos(q[0]), p["arm_length"]
    if order == 0:
        return swung * np.sin(arm) + reach * sine + x * cosine
    along, across = reach_rate - x * v[0], x_rate + reach * v[0]
    return swung * turn * np.cos(arm) + along * sine + across * cosine


def _felt(p: Mapping[str, float], track: Track, place: str, relative: bool) -> np.ndarray:
    """Acceleration along the axis of a sensor that rides on the club [m/s^2]."""
    felt = felt_accelerations(p, track, place)[0]
    pivot = _accelerations(p, track, "wrist", 0.0)[1]
    at = planar.points_of(p)
    lever = {"clubhead": at.head, "grip": at.grip, "shaft": at.grip}.get(place, 0.0)
    return felt - (pivot + track.a[:, 0] * lever) if relative else felt


def felt_accelerations(
    p: Mapping[str, float], track: Track, place: str, pull: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration across the shaft where a sensor is fixed, and outwards along it.

    Args:
        p: the robot's numbers by contract name [SI].
        track: the motion.
        place: clubhead, grip or shaft; of others the wrist's pivot is meant.
        pull: gravity in the plane, which an accelerometer that passes constants feels [m/s^2].

    Returns:
        Both, shape (t,) each [m/s^2].
    """
    along, across = _accelerations(p, track, place, pull)
    tilt = _place(p, track, place)[6]
    sine, cosine = np.sin(tilt), np.cos(tilt)
    return across * cosine - along * sine, along * cosine + across * sine


def _accelerations(
    p: Mapping[str, float], track: Track, place: str, pull: float
) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration of a place less gravity, outwards along the collet and across it [m/s^2]."""
    q, v, a = track.q.T, track.v.T, track.a.T
    reach, reach_rate, x, x_rate, reach_bend, x_bend, _ = _place(p, track, place)
    arm = track.drive[:, 0], track.drive_rate[:, 0], track.drive_bend[:, 0]
    down, side = planar.pivot_acceleration(p, arm, pull, np)
    sine, cosine = np.sin(q[0]), np.cos(q[0])
    along = down * cosine + side * sine
    along = along + reach_bend - v[0] ** 2 * reach - 2 * v[0] * x_rate - a[0] * x
    across = side * cosine - down * sine
    return along, across + x_bend + a[0] * reach + 2 * v[0] * reach_rate - v[0] ** 2 * x


def _place(p: Mapping[str, float], track: Track, place: str) -> tuple[np.ndarray, ...]:
    """Where a place is in the collet's axes, how it moves there, and how its sensor is tilted.

    Returns:
        along and across the axis: positions and rates in turn, then both accelerations; the tilt
        [m, m/s, m/s^2, rad].
    """
    q, v, a, none = track.q.T, track.v.T, track.a.T, np.zeros(len(track.q))
    at = planar.points_of(p)
    if place in ("grip", "shaft"):
        return at.grip + none, none, q[1], v[1], none, a[1], q[2]
    if place != "clubhead":
        return none, none, none, none, none, none, none
    bent = planar.head_of(p, q)
    tilt = q[2] + shaft.slope_at_head(at.lever, bent.bend)
    bend_rate, rate = planar.head_rates(bent, v)
    bend = shaft.acceleration(bent, bend_rate, v[2], a[3] - a[1], a[2])
    return at.grip + bent.along, rate, q[3], v[3], bend, a[3], tilt
