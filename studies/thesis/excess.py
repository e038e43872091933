"""One full swing by eq. 41 as printed, mended and in the plane: why simulations are too large."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from .draw import Curve, Panel
from .printed import base_on_collet_only, lever, newton_euler
from .rigid_compliant import CLUBS
from .runs import RIGID_GRIP, club, head, instants, move
from .swings import IMPACT, full_swing
from .table import Found, Row, claim, number

SWING = "thesis/full_swings"
"""Study of this swing."""

MADE_UP = "The golfers' profiles are not printed; our swing is made up."
PRINTED, MENDED, PLANAR = "eq. 41 as printed", "every mass carried", "planar"
WAYS = (PRINTED, MENDED, PLANAR)


def why_larger() -> Found:
    """One swing up to impact by eq. 41 as printed, mended, and in the plane."""
    times, reach, told = reaches()
    peaks = largest()
    excess = {name: one[MENDED] / one[PLANAR] for name, one in peaks.items()}
    soft = peaks["compliant"]
    rows = (
        claim("larger", "simulated motions of the clubhead are larger than real ones",
              f"largest displacement {soft[PRINTED]:.3f} m as printed, {soft[MENDED]:.3f} m with "
              f"A6 mended, {soft[PLANAR]:.3f} m in the plane", soft[PRINTED] > soft[PLANAR],
              "line 1875", limit=MADE_UP,
              definition="final wrist, up to impact; the plane's full kinematics stand for the "
              "real swing"),
        claim("wrist", "the wrist's flexibility is the reason",
              f"the linear model exceeds the plane {excess['compliant']:.2f} times with the final "
              f"wrist and {excess['rigid']:.2f} times with none",
              excess["compliant"] > 1.2 * excess["rigid"], "lines 1875, 1949", limit=MADE_UP,
              definition="the excess is a fifth larger than without any flexibility",
              why="The rigid robot exceeds it as much: what is missing are terms of fast and "
              "large rotations."),
        _grip_share(),
        _stiffened(),
    )  # fmt: skip
    panels = tuple(
        Panel(name, "time [s]", "clubhead displacement [m]",
              tuple(Curve(times, one[way], way) for way in WAYS))
        for name, one in reach.items()
    )  # fmt: skip
    notes = (
        "The made-up full swing without its ball; horizontal plane.",
        "Linear equations neither turn the arm's pull with the wrist's angle (A8) nor stiffen the "
        "club by its rotation.",
        f"Planar model: {told}",
    )
    return Found(rows, panels, "A full swing up to impact, relative to the collet.", notes)


def _grip_share() -> Row:
    """How much of the clubhead's displacement the grip's rotation accounts for."""
    from ...model.robot import PRESETS

    names = ("sleeve_stiffness", "sleeve_damping")
    fitted = {name: PRESETS["robo_v_sleeve_50"][name] for name in names}
    shares = []
    for change in ({}, fitted):
        p = CLUBS["compliant"] | change
        tilt = move("driven_arm", p, full_swing(3.0), instants(3.0)).positions[:, 2]
        shares.append(lever(p) * float(np.max(np.abs(tilt))))
    return claim(
        "grip", "the grip's rotation accounts for 0.07 to 0.2 m of the clubhead's displacement",
        f"{shares[0]:.3f} m with Table 4's 50 % sleeve, {shares[1]:.3f} m with one that rings as "
        "measured", 0.07 <= shares[0] <= 0.2, "line 1895", limit=MADE_UP,
        definition="largest grip angle times L_cl - l/2 in the full swing with its ball; 0.07 to "
        "0.2 m passes with Table 4",
    )  # fmt: skip


def _stiffened() -> Row:
    """How much turning stiffens a club of the frequency that the thesis quotes."""
    from scipy.optimize import brentq

    from ...model.campbell import modes_at
    from ...model.robot import Robot

    at_rest, turning = 4.26, 10.01  # Hz, line 1951
    rigid = club(RIGID_GRIP)

    def frequency(speed: float, **others: float) -> float:
        p = rigid | others
        return float(modes_at(Robot("fixed_collet", tuple(p)), p, speed).frequencies[0])

    def found(off: Callable[[float], float], low: float, high: float) -> float:
        return float(brentq(off, low, high))  # type: ignore[arg-type]

    stiff = found(lambda k: frequency(0.0, shaft_stiffness=k) - at_rest, 100.0, 250.0)
    rates = sum(joint.at(instants(IMPACT, 1000.0))[:, 1] for joint in full_swing(3.0).joints)
    fastest = float(np.max(np.abs(rates)))
    needed = found(lambda w: frequency(w, shaft_stiffness=stiff) - turning, fastest, 90.0)
    alone = frequency(needed, shaft_stiffness=stiff, arm_length=1e-6)
    return number(
        "stiffens", "frequency to which turning stiffens a club of 4.26 Hz", "Hz", turning,
        frequency(fastest, shaft_stiffness=stiff), "line 1951", limit=MADE_UP,
        definition=f"slowest mode in line with the arm, rigid collet and grip, at {fastest:.0f} "
        "rad/s, the fastest of the swing up to impact",
        why=f"The speed is not told: it takes {needed:.0f} rad/s, and about the wrist alone "
        f"that gives {alone:.1f} Hz.",
    )  # fmt: skip


def slip_a6() -> Row:
    """Whether the slip A6 can be why simulations are too large, for the study of the slips."""
    soft, stiff = (largest()[name] for name in ("compliant", "rigid"))
    return claim(
        "a6_cause", "it is a reason why simulated full swings are too large",
        f"largest displacement {stiff[PRINTED]:.3f} m with it, {stiff[MENDED]:.3f} m without, "
        f"rigid; {soft[PRINTED]:.3f} and {soft[MENDED]:.3f} m compliant",
        soft[PRINTED] > soft[MENDED] and stiff[PRINTED] > stiff[MENDED], "A6, lines 1629, 1949",
        definition=f"the swing of {SWING}, up to impact",
        why="We disagree: it leaves forces out, so it hides part of the excess over the planar "
        f"{stiff[PLANAR]:.3f} and {soft[PLANAR]:.3f} m, which A8 and the club's stiffening by "
        "rotation explain.",
    )  # fmt: skip


def largest() -> dict[str, dict[str, float]]:
    """Largest clubhead displacement [m] of each club by each of `WAYS`."""
    return {name: {way: float(np.max(np.abs(y))) for way, y in one.items()}
            for name, one in reaches()[1].items()}  # fmt: skip


@cache
def reaches() -> tuple[np.ndarray, dict[str, dict[str, np.ndarray]], str]:
    """Both clubs' motions by each of `WAYS`, up to impact.

    Returns:
        Times [s], clubhead displacements [m], and what the planar motions say of themselves.
    """
    times = instants(IMPACT, 1000.0)
    found = {name: _reaches(p, times) for name, p in CLUBS.items()}
    told = " ".join(sorted({sentence for _, sentence in found.values()}))
    return times, {name: curves for name, (curves, _) in found.items()}, told


def _reaches(p: dict[str, float], times: np.ndarray) -> tuple[dict[str, np.ndarray], str]:
    """Clubhead displacement [m] by each of `WAYS`, and the planar motion's status in words."""
    from ...model.planar_motion import respond_planar
    from ...model.robot import Robot

    drive = full_swing(3.0, is_struck=False)
    arm, wrist = (joint.at(times) for joint in drive.joints)
    signals = np.stack([arm[:, 2], arm[:, 1] + wrist[:, 1], arm[:, 0] + wrist[:, 0]], axis=1)
    right = newton_euler("driven_arm", p)
    reach = (each.moved(signals, times)[1] for each in (base_on_collet_only(right), right))
    motion = respond_planar(Robot("driven_arm"), p, drive, times, (head(),))
    curves: dict[str, np.ndarray] = dict(zip(WAYS, (*reach, motion.positions[:, 3]), strict=True))
    return curves, motion.sentence
