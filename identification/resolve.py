"""Gauges that turn with the grip, in the swing plane, and the collet's motion taken off them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lsim

from .lowpass import zero_phase_lowpass

STRAIN_SIGN = -1.0
"""Sign of the toe gauge's strain against the toe accelerometer's axis [-]; thesis line 1840."""


@dataclass(frozen=True, eq=False)
class Resolved:
    """Two channels that turn with the grip, in the axes of the swing plane.

    Attributes:
        in_plane: in the direction of the swing, shape (n,) [channels' unit].
        std: its standard deviation, of noise and of the grip's angle, shape (n,) [same unit].
        out_of_plane: across it, upwards from the toe's side at a square face, shape (n,) [same
            unit]; the thesis leaves it.
    """

    in_plane: np.ndarray
    std: np.ndarray
    out_of_plane: np.ndarray


def resolve_accelerations(
    toe: np.ndarray,
    lead: np.ndarray,
    grip: np.ndarray,
    noise: tuple[float, float] = (0.0, 0.0),
    grip_std: float = 0.0,
) -> Resolved:
    """Two accelerations at the head in the direction of the swing.

    Args:
        toe: in the plane of the face, shape (n,) [m/s^2].
        lead: perpendicular to the face, shape (n,) [m/s^2].
        grip: rotation of the grip, 0 at a square face, clockwise from above, shape (n,) [rad].
        noise: standard deviations of both [m/s^2].
        grip_std: standard deviation of the grip's angle [rad].

    Returns:
        toe sin(grip) + lead cos(grip), and what lies across.

    Source: thesis eq. 42, line 1815.
    """
    return _resolved(np.asarray(toe), np.asarray(lead), np.asarray(grip), noise, grip_std)


def resolve_strains(
    toe: np.ndarray,
    lead: np.ndarray,
    grip: np.ndarray,
    noise: tuple[float, float] = (0.0, 0.0),
    grip_std: float = 0.0,
) -> Resolved:
    """Two strains, or deflections, of the shaft in the direction of the swing.

    Args:
        toe: in the plane of the face, shape (n,) [1 or m].
        lead: perpendicular to the face, shape (n,) [1 or m].
        grip: rotation of the grip, 0 at a square face, clockwise from above, shape (n,) [rad].
        noise: standard deviations of both [1 or m].
        grip_std: standard deviation of the grip's angle [rad].

    Returns:
        lead cos(grip) - toe sin(grip), and what lies across: the toe gauge reads the other way.

    Source: thesis eq. 43, line 1842.
    """
    return _resolved(
        STRAIN_SIGN * np.asarray(toe), np.asarray(lead), np.asarray(grip), noise, grip_std
    )


def _resolved(
    a: np.ndarray, b: np.ndarray, grip: np.ndarray, noise: tuple[float, float], grip_std: float
) -> Resolved:
    sine, cosine = np.sin(grip), np.cos(grip)
    across = a * cosine - b * sine
    variance = (noise[0] * sine) ** 2 + (noise[1] * cosine) ** 2 + (across * grip_std) ** 2
    return Resolved(a * sine + b * cosine, np.sqrt(variance), across)


@dataclass(frozen=True)
class Carrier:
    """What carries the head: the numbers that the subtraction of its motion needs.

    Attributes:
        reach: wrist to head along the straight club [m].
        arm_length: hub to wrist [m].
        inertia: of collet and grip about the wrist, without the head [kg m^2].
        first_moment: mass times distance from the wrist of collet and grip [kg m].
        clubhead_mass: [kg].
        wrist_stiffness: [N m/rad]; None for a wrist that follows its drive exactly.
        wrist_damping: [N m s/rad].
        slope: turn of the head for a metre of its deflection [rad/m]; 0 leaves the sensor straight.
    """

    reach: float
    arm_length: float
    inertia: float = 0.0
    first_moment: float = 0.0
    clubhead_mass: float = 0.0
    wrist_stiffness: float | None = None
    wrist_damping: float = 0.0
    slope: float = 0.0


@dataclass(frozen=True, eq=False)
class Relative:
    """The head's acceleration relative to the collet.

    Attributes:
        values: with the wrist's yielding, shape (n,) [m/s^2].
        by_drive: as the thesis has it, less the motion of the drive alone, shape (n,) [m/s^2].
        twist: of the collet against its drive, shape (n,) [rad].
        carried: what was taken off, shape (n,) [m/s^2].
        std: standard deviation of `values`, shape (n,), empty where it was not asked for [m/s^2].
    """

    values: np.ndarray
    by_drive: np.ndarray
    twist: np.ndarray
    carried: np.ndarray
    std: np.ndarray = field(default_factory=lambda: np.zeros(0))


def relative_acceleration(
    times: np.ndarray,
    felt: np.ndarray,
    arm: np.ndarray,
    wrist: np.ndarray,
    carrier: Carrier,
    deflection: np.ndarray | None = None,
    cutoff: float | None = None,
) -> Relative:
    """Takes the rigid motion of the collet off what an accelerometer at the head feels.

    A wrist that yields lags behind its drive, so that the drive's motion is not the collet's. What
    the head feels tells the torque on the wrist, and that the twist: one linear equation, driven
    by the record itself. It holds up to the blow: what the ball passes on does not come through
    the wrist, so the record must end before it.

    Args:
        times: even, up to the impact, shape (n,) [s].
        felt: in the swing plane, across the club, shape (n,) [m/s^2].
        arm: angle of the arm, shape (n,) [rad].
        wrist: angle of the wrist's drive against the arm, shape (n,) [rad].
        carrier: lengths, masses and the wrist's constants.
        deflection: of the head in the swing plane, for the centripetal and the tilted part, shape
            (n,) [m]; none of them where None.
        cutoff: of a zero-phase low-pass on what is felt, for the twist alone [Hz]; None for none.
            Above its own resonance the wrist makes noise larger, by the head's moment of inertia
            over the collet's.

    Returns:
        Relative acceleration with and without the wrist's correction.

    Source: errata, section C, on line 1291; the wrist's equation is the collet's row of eq. 36.
    """
    drive, bent = arm + wrist, np.zeros(len(times)) if deflection is None else deflection
    base = _second(times, arm)
    plain = replace(carrier, wrist_stiffness=None)
    by_drive, _, _ = _taken_off(times, felt, drive, arm, base, plain, bent)
    twist, heard = np.zeros(len(times)), felt
    if cutoff is not None:
        heard = zero_phase_lowpass(felt, 1.0 / (times[1] - times[0]), cutoff)
    if carrier.wrist_stiffness is not None:
        for _ in range(4):  # the twist turns the axes a little, which changes the twist a little
            twist = _twist(times, heard, drive, twist, arm, base, carrier, bent)
    values, carried, _ = _taken_off(times, felt, drive + twist, arm, base, carrier, bent)
    return Relative(values, by_drive, twist, carried)


def _second(times: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative of a smooth angle [rad/s, rad/s^2]."""
    curve = CubicSpline(times, angle)
    first = CubicSpline(times, curve(times, 1))  # a spline of the slope: smoother second ones
    return curve(times, 1), first(times, 1)


def _taken_off(
    times: np.ndarray,
    felt: np.ndarray,
    club: np.ndarray,
    arm: np.ndarray,
    base: tuple[np.ndarray, np.ndarray],
    carrier: Carrier,
    bent: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Relative acceleration, what was carried, and the head's own acceleration in two axes."""
    speed, turn = _second(times, club)
    across, along = _pivot(club - arm, base, carrier.arm_length)
    inward = along - carrier.reach * speed**2
    true = felt + carrier.slope * bent * inward  # the sensor's axis leans with the head
    carried = across + carrier.reach * turn - bent * speed**2
    return true - carried, carried, (true, inward)


def _pivot(
    angle: np.ndarray, base: tuple[np.ndarray, np.ndarray], length: float
) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration of the wrist across the club and along it, outwards [m/s^2]; erratum A8."""
    speed, turn = base
    sine, cosine = np.sin(angle), np.cos(angle)
    return (
        length * (turn * cosine + speed**2 * sine),
        length * (turn * sine - speed**2 * cosine),
    )


def _twist(
    times: np.ndarray,
    felt: np.ndarray,
    drive: np.ndarray,
    twist: np.ndarray,
    arm: np.ndarray,
    base: tuple[np.ndarray, np.ndarray],
    carrier: Carrier,
    bent: np.ndarray,
) -> np.ndarray:
    """The wrist's yielding under the torque of everything that it carries [rad]."""
    assert carrier.wrist_stiffness is not None
    _, _, (across, inward) = _taken_off(times, felt, drive + twist, arm, base, carrier, bent)
    pivot, _ = _pivot(drive + twist - arm, base, carrier.arm_length)
    torque = (
        carrier.clubhead_mass * (carrier.reach * across - bent * inward)
        + carrier.first_moment * pivot
        + carrier.inertia * _second(times, drive)[1]
    )
    k, c, j = carrier.wrist_stiffness, carrier.wrist_damping, carrier.inertia
    system = ([-1.0], [j, c, k] if j > 0 else [c, k])
    start = np.zeros(2 if j > 0 else 1)
    return np.asarray(lsim(system, torque, times - times[0], X0=start)[1])
