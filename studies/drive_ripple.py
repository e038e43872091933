"""What do lag and ripple of a drive do to a club? With gains, six swings and rounds of feedback."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import Answer, finding, show
from .golfers import GOLFERS, Golfer
from .six_swings import COMPLIANT, RIGID, UNSTRUCK, Swung, clubs, profile_of, rig_of, rms, swung
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..optimize.profile import SwingProfile
    from ..optimize.servo import Feedback

NAME = "drive_ripple"
QUESTION = "What do lag and ripple of the drive do to a club, and what does feedback take out?"
HEADINGS = ("swing", "club", "by the ripple, moving [mm]", "by the ripple, at rest [mm]",
            "of the rigid club's, moving", "at rest")  # fmt: skip

RIPPLES = ((6.0, 2e-3), (11.0, 1e-3))
"""Frequencies [Hz] and sizes [rad] of a drive that shakes while it moves."""

FADE = 0.1
"""How long the ripple takes to come and to go [s]."""

LOOP, DELAY = (9.0, 0.8), 0.004
"""Position loop of an axis: frequency [Hz] and damping ratio; and a delay before it [s]."""

COGS = {"arm": (18.0, 1e-3), "wrist": (14.0, 1e-3)}
"""Ripple that an axis's own angle makes: waves a radian, and size [rad]."""

FINE, FEEDBACK, DIGIT = 5000.0, 250.0, 1e-3
"""Steps of the loop and samples of its feedback [Hz], and the feedback's last digit [degrees]."""

ROUNDS = 4
"""Rounds of feedback [-]."""

BAND = (0.5, 30.0)
"""Frequencies of the curve of gains [Hz]."""


def rippled(profile: SwingProfile) -> SwingProfile:
    """The same swing by a drive that shakes while it moves."""
    times = profile.time
    moves = np.abs(profile.at(times).velocities[:, :2]).max(axis=1) > 1e-3
    begin, end = times[moves][0], times[moves][-1]
    share = np.clip(np.minimum(times - begin, end - times) / FADE, 0.0, 1.0)
    shake = sum(size * np.sin(2 * np.pi * hertz * times) for hertz, size in RIPPLES)
    shake = share**2 * (3 - 2 * share) * shake
    return replace(
        profile, arm_angle=profile.arm_angle + shake, wrist_angle=profile.wrist_angle + shake
    )


def gains(frequencies: np.ndarray) -> dict[str, np.ndarray]:
    """How far a club leaves a rigid one on the same drives, for a ripple of the wrist's drive.

    Args:
        frequencies: shape (f,) [Hz].

    Returns:
        By club, shape (f,) [m/rad]; of the linear robot.
    """
    from ..model.linear import Port, state_space
    from ..model.robot import Robot
    from ..optimize.solve_program import reach

    found = {}
    for name, numbers in clubs().items():
        robot = Robot("driven_arm", tuple(numbers))
        space = state_space(robot, numbers, (Port("wrist", "angular_acceleration"),))
        a, b = np.asarray(space.a)[:8], np.asarray(space.b)[:8, 0]
        own, drive = a[:, :8], a[:, 8:]  # the drive's angle and rate are states behind
        turn = 2j * np.pi * frequencies
        held = np.zeros((len(turn), drive.shape[1]), complex)
        held[:, 0], held[:, 1] = 1.0, turn
        push = held @ drive.T + np.outer(turn**2, b)
        systems = turn[:, None, None] * np.eye(8) - own
        x = np.linalg.solve(systems, push[..., None])[..., 0]
        found[name] = np.abs(reach(numbers) * (x[:, 0] - 1.0) + x[:, 3])
    return found


def feedback_of(told: SwingProfile) -> Feedback:
    """What a robot says of its axes: loops that come late, and motors that cog."""
    from scipy.signal import cont2discrete, lfilter

    from ..optimize.servo import Feedback

    clock = np.arange(0.0, told.time[-1] + 0.3, 1.0 / FINE)
    w = 2 * np.pi * LOOP[0]
    made: Any = cont2discrete(([w * w], [1.0, 2 * LOOP[1] * w, w * w]), 1.0 / FINE, "bilinear")
    wanted = told.at(np.maximum(clock - DELAY, 0.0)).angles
    did = lfilter(np.ravel(made[0]), np.ravel(made[1]), wanted - wanted[0], axis=0) + wanted[0]
    for column, (waves, size) in enumerate(COGS.values()):
        did[:, column] += size * (np.sin(waves * did[:, column]) - np.sin(waves * did[0, column]))
    times = np.arange(0.0, clock[-1], 1.0 / FEEDBACK)
    seen = np.stack([np.interp(times, clock, did[:, axis]) for axis in range(3)], axis=1)
    return Feedback(times, np.radians(np.rint(np.degrees(seen) / DIGIT) * DIGIT))


def played(profile: SwingProfile, feedback: Feedback) -> SwingProfile:
    """The swing that the robot made of a profile, on the profile's points."""
    from scipy.interpolate import make_interp_spline

    curve = make_interp_spline(feedback.times, feedback.angles, k=3)
    end = float(feedback.times[-1])
    points = np.linspace(0.0, end, len(profile.time))
    arm, wrist, grip = curve(points).T
    return replace(
        profile, time=points, arm_angle=arm, wrist_angle=wrist, grip_angle=grip, quantum=0.0,
        phases={},
    )  # fmt: skip


def rounds_of(profile: SwingProfile) -> list[dict[str, Any]]:
    """Rounds of feedback, with what both clubs do of the robot's motion in the plane.

    Args:
        profile: what the axes should do.

    Returns:
        By round: errors of the axes [rad], contraction as stated and as it then was [-], and by
        club the vibration at rest [m] and its pose at the ball [rad].
    """
    from ..optimize.servo import correct_lag

    rig, told, found = rig_of("planar"), profile, []
    for number in range(ROUNDS):
        heard = feedback_of(told)
        one = correct_lag(profile, told, heard)
        at_ball = swung(played(profile, heard), rig, UNSTRUCK)
        error = float(np.sqrt(np.mean(one.errors**2)))
        if found:
            found[-1]["became"] = error / found[-1]["rms"]
        found.append({
            "round": number, "rms": error, "largest": one.error, "at_impact": one.impact_error,
            "stated": one.contraction, "became": None, "worst": one.worst,
            "left": {name: _left(each, float(profile.time[-1])) for name, each in at_ball.items()},
            "pose": {name: each.pose for name, each in at_ball.items()},
        })  # fmt: skip
        told = one.profile
    return found


def _left(one: Swung, end: float) -> float:
    """Vibration in the half second that begins two tenths after the drive should rest [m]."""
    return rms(one.away[(one.times > end + 0.2) & (one.times < end + 0.7)])


def find(call: Call, golfers: Sequence[Golfer] = GOLFERS) -> Answer:
    """Six swings by a drive that ripples, gains over frequency, and rounds of feedback.

    Args:
        call: who asks.
        golfers: the swings.

    Returns:
        The answer [SI].
    """
    rig, rows = rig_of("planar"), []
    for golfer in golfers:
        call.progress(f"the {golfer.name} swing with ripple")
        profile = profile_of(golfer)
        rows += _shaken(golfer.name, profile, rig)
    call.progress("rounds of feedback")
    rounds = rounds_of(profile_of(golfers[0]))
    frequencies = np.geomspace(*BAND, 241)
    curves = gains(frequencies)
    sentences = _sentences(rows, rounds, frequencies, curves)
    size = " and ".join(f"{1e3 * size:g} mrad at {hertz:g} Hz" for hertz, size in RIPPLES)
    notes = (
        f"Arm and wrist shake by {size} while they move; full kinematics, no ball; what the ripple "
        "alone moves the clubhead against a rigid club on the same drives, root mean square, while "
        "the drive moves and for half a second from a tenth after it rests.",
        f"Feedback: loops of {LOOP[0]:g} Hz and damping {LOOP[1]:g} behind {1e3 * DELAY:g} ms, "
        "motors that cog with their angle, read at 250 Hz and a thousandth of a degree; each round "
        "is `supple lag`. All of it is made up: the robot's own feedback is not public.",
    )
    more = {"rounds": rounds, "gains": {"frequency": frequencies.tolist(),
            **{name: values.tolist() for name, values in curves.items()}}}  # fmt: skip
    return Answer(
        HEADINGS, [_cells(row) for row in rows], rows, sentences, notes,
        _panels(rounds, frequencies, curves), more,
    )  # fmt: skip


def _shaken(name: str, profile: SwingProfile, rig: Any) -> list[dict[str, Any]]:
    """Rows of one swing."""
    smooth, shaken = swung(profile, rig, UNSTRUCK), swung(rippled(profile), rig, UNSTRUCK)
    end, found = float(profile.time[-1]), {}
    for club, one in shaken.items():
        off = one.away - smooth[club].away
        moves, rests = one.times < end, (one.times > end + 0.1) & (one.times < end + 0.6)
        found[club] = {"moving": rms(off[moves]), "at_rest": rms(off[rests])}
    rigid = found[RIGID]
    return [
        {
            "swing": name, "club": club, **one,
            "moving_share": one["moving"] / rigid["moving"],
            "at_rest_share": one["at_rest"] / rigid["at_rest"],
        }
        for club, one in found.items()
    ]  # fmt: skip


def _sentences(
    rows: Sequence[Mapping[str, Any]],
    rounds: Sequence[Mapping[str, Any]],
    frequencies: np.ndarray,
    curves: Mapping[str, np.ndarray],
) -> tuple[str, ...]:
    soft = [row for row in rows if row["club"] == COMPLIANT]
    moving, rest = ([row[key] for row in soft] for key in ("moving_share", "at_rest_share"))
    peaks = {name: int(np.argmax(values)) for name, values in curves.items()}
    peak = {
        name: f"{number_words(curves[name][at], 3)} m/rad at {frequencies[at]:.1f} Hz"
        for name, at in peaks.items()
    }
    worse = frequencies[curves[COMPLIANT] > curves[RIGID]]
    where = f"from {worse[0]:.1f} to {worse[-1]:.1f} Hz" if len(worse) else "nowhere"
    first, last = rounds[0], rounds[-1]
    return (
        f"Of a ripple's vibration the compliant club has {_span(moving)} times the rigid club's "
        f"while the drive moves and {_span(rest)} times once it rests.",
        f"A ripple of the wrist's drive moves the rigid club by up to {peak[RIGID]}, the compliant "
        f"one by up to {peak[COMPLIANT]}; the compliant one is moved more {where}.",
        f"Feedback takes the axes' error from {_degrees(first['largest'])} to "
        f"{_degrees(last['largest'])} in {len(rounds) - 1} rounds, at the ball from "
        f"{_degrees(first['at_impact'])} to {_degrees(last['at_impact'])}; the first round was "
        f"to leave at most {100 * first['stated']:.2g} % and left {100 * first['became']:.2g} %.",
    )


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.2g}°"


def _span(values: Sequence[float]) -> str:
    low, high = (number_words(one, 2) for one in (min(values), max(values)))
    return f"{low} to {high}"


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    sizes = (number_words(1e3 * row[key], 3) for key in ("moving", "at_rest"))
    shares = (number_words(row[key], 2) for key in ("moving_share", "at_rest_share"))
    return row["swing"], row["club"], *sizes, *shares


def _panels(
    rounds: Sequence[Mapping[str, Any]], frequencies: np.ndarray, curves: Mapping[str, np.ndarray]
) -> list[Any]:
    from .thesis.draw import Curve, Panel

    number = np.array([one["round"] for one in rounds], float)
    errors = {
        "largest": [one["largest"] for one in rounds],
        "at the ball": [one["at_impact"] for one in rounds],
    }
    lines = tuple(
        Curve(number, np.log10(np.degrees(values)), name) for name, values in errors.items()
    )
    moved = tuple(Curve(frequencies, np.log10(values), name) for name, values in curves.items())
    return [
        Panel("Ripple of the wrist's drive", "frequency [Hz]", "log10 of m/rad", moved, None, True),
        Panel("Rounds of feedback", "round", "log10 of the axes' error in degrees", lines),
    ]


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
