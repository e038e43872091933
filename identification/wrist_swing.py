"""A club on a passive wrist behind an arm that is moved: large angles, a shaft that bends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline

from ..model import shaft

LONGEST_STEP = 2.5e-3
"""Longest step of the integrator [s]; the fastest motion of a club on a wrist is some 20 Hz."""


@dataclass(frozen=True)
class Club:
    """Club and hand as the wrist feels them.

    Attributes:
        inertia: of hand and grip about the wrist [kg m^2].
        moment: their mass times its distance from the wrist [kg m].
        head: mass lumped at the clubhead [kg].
        reach: wrist to clubhead [m].
        lever: grip's centre to clubhead [m].
        stiffness: of the shaft at the head [N/m].
        damping: of the shaft at the head [N s/m].
        arm: shoulder to wrist [m].
    """

    inertia: float
    moment: float
    head: float
    reach: float
    lever: float
    stiffness: float
    damping: float
    arm: float

    @staticmethod
    def of(p: Mapping[str, float]) -> Club:
        """The club of a robot's numbers by the contract's names [SI], its grip held rigidly."""
        lever = p["club_length"] - p["grip_length"] / 2
        grip = p["sleeve_offset"] + p["sleeve_spacing"] / 2
        return Club(
            p["collet_inertia"] + p["grip_inertia"] + p["grip_mass"] * grip**2,
            p["collet_mass"] * p["collet_centre"] + p["grip_mass"] * grip,
            p["clubhead_mass"], grip + lever, lever, p["shaft_stiffness"], p["shaft_damping"],
            p["arm_length"],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Arm:
    """A prescribed arm.

    Attributes:
        angle: a smooth curve of its angle against time [rad].
        length: shoulder to wrist [m].
        pull: weight in the swing plane, towards angle 0 [m/s^2].
        doubt: curves by which the angle may be off, each as likely as one standard deviation,
            shape (knots, curves) of coefficients [rad].
    """

    angle: BSpline
    length: float
    pull: float
    doubt: np.ndarray

    def at(self, times: np.ndarray, off: np.ndarray | None = None) -> np.ndarray:
        """Angle, its rate and the rate of that, shape (times, 3, ...) [rad, rad/s, rad/s^2].

        Args:
            times: shape (times,) [s].
            off: how far the angle is off along each curve of `doubt`, shape (curves, ...) [-].
        """
        knots, sizes, degree = self.angle.tck
        shift = 0.0 if off is None else self.doubt @ off
        whole = sizes if off is None else sizes.reshape(-1, *[1] * (off.ndim - 1)) + shift
        curve = BSpline(knots, whole, degree)
        return np.stack([curve(times, nu=order) for order in range(3)], axis=1)

    def shifted(self, off: np.ndarray) -> Arm:
        """This arm, off by so much along each curve of its doubt, shape (curves,) [-]."""
        knots, sizes, degree = self.angle.tck
        return replace(self, angle=BSpline(knots, sizes + self.doubt @ off, degree))


def swing(
    club: Club,
    arm: Arm,
    times: np.ndarray,
    instants: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
    rest: np.ndarray,
    start: np.ndarray,
    off: np.ndarray | None = None,
) -> np.ndarray:
    """Angle of the grip of many wrists behind one arm, by the classical method of Runge and Kutta.

    Args:
        club: what the wrist holds.
        arm: how it moves.
        times: even, shape (t,) [s].
        instants: at which stiffnesses are told, straight lines between, shape (k,) [s].
        stiffness: shape (k, wrists) [N m/rad].
        damping: shape (wrists,) [N m s/rad].
        rest: angle of the grip against the arm at which a wrist is at ease, shape (wrists,) [rad].
        start: angle [rad], its rate [rad/s], bend of the shaft [m], its rate [m/s], shape
            (4, wrists).
        off: how far each wrist's arm is off along its curves of doubt, shape (curves, wrists) [-].

    Returns:
        Absolute angles, shape (t, wrists) [rad].

    Source: Lagrange's equations of the two coordinates, the shaft as `model.shaft` has it and its
    root held by the hand; tests/identification/test_wrist_joint.py against chains of links.
    """
    interval = float(times[1] - times[0])
    parts = max(1, int(np.ceil(interval / LONGEST_STEP)))
    h = interval / parts
    fine = times[0] + 0.5 * h * np.arange(2 * parts * (len(times) - 1) + 1)
    moved = arm.at(fine, off)
    k = np.stack([np.interp(fine, instants, column) for column in stiffness.T], axis=1)

    def rate(at: int, state: np.ndarray) -> np.ndarray:
        return _rate(club, arm, moved[at], k[at], damping, rest, state)

    state = start.astype(float)
    found = [state[0]]
    with np.errstate(over="ignore", invalid="ignore"):  # a wrist that runs away is no wrist
        for step in range(parts * (len(times) - 1)):
            at = 2 * step
            one = rate(at, state)
            two = rate(at + 1, state + 0.5 * h * one)
            three = rate(at + 1, state + 0.5 * h * two)
            four = rate(at + 2, state + h * three)
            state = state + h / 6 * (one + 2 * two + 2 * three + four)
            if (step + 1) % parts == 0:
                found.append(state[0])
    return np.array(found)


def _rate(
    club: Club,
    arm: Arm,
    moved: np.ndarray,
    k: np.ndarray,
    damping: np.ndarray,
    rest: np.ndarray,
    state: np.ndarray,
) -> np.ndarray:
    """Rates of angle, its rate, bend and its rate, shape (4, wrists)."""
    angle, turn, bend, slide = state
    lift, spin, gain = moved
    tilt = angle - lift
    # acceleration of the wrist less that of free fall, along the club and across it
    along = arm.length * (gain * np.sin(tilt) - spin**2 * np.cos(tilt)) - arm.pull * np.cos(angle)
    across = arm.length * (gain * np.cos(tilt) + spin**2 * np.sin(tilt)) + arm.pull * np.sin(angle)
    short, dip, curve = shaft.shortening(club.lever, bend)
    reach = club.reach - short
    radial = along - reach * turn**2 - 2 * slide * turn - curve * slide**2
    tangential = across - bend * turn**2 - 2 * dip * slide * turn
    torque = -k * (tilt - rest) - damping * (turn - spin)
    pull = -shaft.force(club.lever, club.stiffness, bend) - club.damping * slide
    # the head's acceleration is (radial - bend gain', tangential + reach gain' + bend'')
    m = club.head
    a11 = club.inertia + m * (reach**2 + bend**2)
    a12 = m * reach + m * bend * dip
    a22 = m * (1 + dip**2)
    b1 = torque - club.moment * across - m * (reach * tangential - bend * radial)
    b2 = pull - m * (tangential - dip * radial)
    root = a11 * a22 - a12**2
    return np.stack([turn, (a22 * b1 - a12 * b2) / root, slide, (a11 * b2 - a12 * b1) / root])
