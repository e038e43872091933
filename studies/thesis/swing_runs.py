"""The simulations of one measured swing: rigid and compliant, in the plane, and by feedback."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .measured_swings import MeasuredSwing, driven_by
from .printed import GRIP, REACH, TILT, TURN, bent_by, lever, newton_euler
from .runs import head, instants, move, rms
from .swing_compare import RESTS, Comparison, compare, oscillation

CHANNELS = {"acceleration": "m/s²", "deflection": "m"}
"""What was measured of the head, with units as they are drawn."""

COMPLIANT, RIGID, TURNED, PLANAR = "compliant", "rigid", "pull turned", "in the plane"
"""The thesis's model with sleeve and wrist and without them; with them and the arm's pull turned by
the wrist's angle (A8), without the ball; and full kinematics with them."""

SMOOTH = 4.0
"""Low-pass below which a robot's feedback is the swing, and above which it shakes [Hz]."""

FEEDBACK = 250.0
"""Samples a second of the robot's feedback [Hz]; line 1682."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """One measured swing with its simulations, by model: `COMPLIANT`, `RIGID` ... `PLANAR`.

    Attributes:
        swing: as measured.
        samples: clubhead acceleration and shaft deflection, each (n, 2) [m/s^2, m].
        reach: clubhead displacement relative to the collet, of the first two, each (n,) [m].
        unstruck: the same without the ball, each (n,) [m].
        compared: by model and channel.
        planar_words: what the planar motion says of itself.
        times: of the motion by feedback, shape (t,) [s].
        played: clubhead displacement by feedback, each (t,) [m].
        shaken: what of it vibrates, each (t,) [m].
    """

    swing: MeasuredSwing
    samples: dict[str, np.ndarray]
    reach: dict[str, np.ndarray]
    unstruck: dict[str, np.ndarray]
    compared: dict[str, dict[str, Comparison]]
    planar_words: str
    times: np.ndarray
    played: dict[str, np.ndarray]
    shaken: dict[str, np.ndarray]

    @property
    def measured(self) -> dict[str, np.ndarray]:
        """By channel, nan where unknown, each (n,) [m/s^2, m]."""
        return dict(zip(CHANNELS, (self.swing.acceleration, self.swing.deflection), strict=True))

    @property
    def settled(self) -> dict[str, float]:
        """Time from impact after which what the ball alone moves stays below a tenth [s]."""
        after = self.swing.points >= self.swing.impact
        step = float(self.swing.points[1] - self.swing.points[0])
        found = {}
        for way, reach in self.reach.items():
            ball = np.abs(reach - self.unstruck[way])[after]
            found[way] = float((np.flatnonzero(ball > 0.1 * ball.max())[-1] + 1) * step)
        return found

    @property
    def before(self) -> dict[str, float]:
        """Clubhead displacement above the swing's own pace up to impact, RMS [m]."""
        part = self.swing.before
        return {
            way: rms(oscillation(self.swing.points, reach)[part])
            for way, reach in self.unstruck.items()
        }

    @property
    def vibration(self) -> dict[str, dict[str, float]]:
        """By feedback: RMS of what vibrates, the whole time and once the robot rests [m]."""
        rest = self.times > self.swing.profile.time[-1] + 0.2
        return {way: {"whole": rms(y), "at_rest": rms(y[rest])} for way, y in self.shaken.items()}

    def told(self) -> dict[str, Any]:
        """As JSON holds it."""
        return {
            "name": self.swing.name,
            "clubhead_speed": self.swing.speed,
            "impact": self.swing.impact,
            "planar": self.planar_words,
            "compared": {
                way: {name: one.told() for name, one in each.items()}
                for way, each in self.compared.items()
            },
            "settled": self.settled,
            "oscillation_before": self.before,
            "feedback": self.vibration,
        }


def simulate(swing: MeasuredSwing, times: np.ndarray, angles: np.ndarray) -> Simulated:
    """Simulates a measured swing by its profile, and by a robot's feedback of it.

    Args:
        swing: as measured.
        times: of the feedback, shape (n,) [s].
        angles: of arm and wrist, shape (n, 2) [rad].

    Returns:
        The simulations, compared with what was measured.
    """
    struck, bare = _three(swing, True), _three(swing, False)
    rests = swing.impact + RESTS, float(swing.profile.time[-1])
    measured = dict(zip(CHANNELS, (swing.acceleration, swing.deflection), strict=True))
    samples, unhit = (
        {way: np.asarray(motion.samples) for way, motion in each.items()} for each in (struck, bare)
    )
    samples[TURNED] = unhit[TURNED] = linear_samples(swing, turned_pull(swing))
    compared = {
        way: {
            name: compare(swing.points, measured[name], values[:, k], unhit[way][:, k],
                          swing.before, rests)
            for k, name in enumerate(CHANNELS)
        }
        for way, values in samples.items()
    }  # fmt: skip
    reach, unstruck = (
        {way: each[way].positions[:, 3] for way in (COMPLIANT, RIGID)} for each in (struck, bare)
    )
    return Simulated(
        swing,
        samples,
        reach,
        unstruck,
        compared,
        struck[PLANAR].sentence,
        *_by_feedback(swing, times, angles),
    )


def turned_pull(swing: MeasuredSwing, is_turned: bool = True) -> np.ndarray:
    """What moves the thesis's driven arm, with erratum A8 mended.

    Args:
        swing: as measured.
        is_turned: whether the arm's pull turns with the wrist's angle; as printed otherwise.

    Returns:
        The pivot's acceleration across the club over the arm's length, the angular velocity and
        angle of the wrist's drive, shape (n, 3) [rad/s^2, rad/s, rad].
    """
    arm, wrist = (joint.at(swing.points) for joint in swing.drive(False).joints)
    pull = arm[:, 2]
    if is_turned:
        pull = arm[:, 2] * np.cos(wrist[:, 0]) + arm[:, 1] ** 2 * np.sin(wrist[:, 0])
    angle = arm[:, 0] + wrist[:, 0]
    return np.stack([pull, arm[:, 1] + wrist[:, 1], angle - angle[0]], axis=1)


def linear_samples(swing: MeasuredSwing, signals: np.ndarray) -> np.ndarray:
    """Clubhead acceleration and deflection by the thesis's linear equations, without a ball.

    Args:
        swing: as measured.
        signals: as of `turned_pull`, shape (n, 3) [rad/s^2, rad/s, rad].

    Returns:
        Shape (n, 2) [m/s^2, m].
    """
    from scipy.signal import lsim

    p = swing.numbers()
    (a, b), reach = newton_euler("driven_arm", p).space, lever(p)
    states = np.asarray(lsim((a, b, np.eye(8), np.zeros((8, 3))), signals, swing.points)[1])
    gains = states @ a[4:].T + signals @ b[4:].T
    whole = p["sleeve_offset"] + p["sleeve_spacing"] / 2 + reach
    felt = p["arm_length"] * signals[:, 0] + whole * gains[:, TURN] + gains[:, REACH]
    return np.stack([felt, states[:, REACH] - states[:, GRIP] - reach * states[:, TILT]], axis=1)


def _three(swing: MeasuredSwing, is_struck: bool) -> dict[str, Any]:
    """Motions of the thesis's model, compliant and rigid, and of the planar one."""
    from ...model.linear import Port
    from ...model.motion import respond
    from ...model.planar_motion import respond_planar
    from ...model.robot import INCLINATION, Robot

    robot, drive = Robot("driven_arm"), swing.drive(is_struck)
    ports = (head(frame="absolute"), Port("shaft", "deflection", "collet"))
    found: dict[str, Any] = {
        way: respond(robot, swing.numbers(way == COMPLIANT), drive, swing.points, ports)
        for way in (COMPLIANT, RIGID)
    }
    sloping = swing.numbers() | {INCLINATION: swing.inclination}
    found[PLANAR] = respond_planar(robot, sloping, drive, swing.points, ports)
    return found


def _by_feedback(
    swing: MeasuredSwing, times: np.ndarray, angles: np.ndarray
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Clubhead displacement driven by the robot's feedback, and what of it vibrates [s, m]."""
    from ...identification.lowpass import zero_phase_lowpass

    clock = instants(float(times[-1]))
    drive = driven_by(times, angles, float(clock[-1]), None)
    slow = np.stack([zero_phase_lowpass(one, FEEDBACK, SMOOTH) for one in angles.T], axis=1)
    arm, wrist = (
        joint.at(clock)[:, 2] for joint in driven_by(times, slow, float(clock[-1]), None).joints
    )
    reach, shaken = {}, {}
    for way in (RIGID, COMPLIANT):
        p = swing.numbers(way == COMPLIANT)
        reach[way] = move("driven_arm", p, drive, clock).positions[:, 3]
        shaken[way] = reach[way] - bent_by(p, arm, wrist, float(clock[1]))
    return clock, reach, shaken
