"""Is the swing what it claims? The robot's file, read back and simulated anew by the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..model.drives import Drive, impact
from ..model.extended import acting_laws
from ..model.linear import Port
from ..model.motion import respond, respond_batch
from ..model.planar_motion import respond_planar
from ..model.prescribed import Prescribed
from ..model.rig import Rig
from ..model.robot import INCLINATION, Robot
from ..model.swing import Signals, swings
from .profile import Limits, SwingProfile, Use, excess
from .solve_program import HELD, bend_rows, impact_of, reach, wanted
from .solve_torque import arm_torque, wrist_torque
from .task import POSTERIOR, SHAFT_FREQUENCY, Impact, ShaftLimits, SwingTask

SPEED, POSE = 0.01, np.radians(0.005)
"""Largest errors at impact, in the nominal robot, that pass [m/s, rad]."""

POSE_ROBUST = np.radians(0.1)
"""Largest error of the pose in any scenario, where impact is to be robust [rad]."""

EXCESS = 1e-3
"""Share by which a limit may be passed [-]."""

FACTORS = 41
"""Factors at which the curve of the residual is looked at [-]."""

AFTER = 1.0
"""How long after its end the ring of a swing is looked at [s]."""

RATE = 2000.0
"""Samples a second of the simulations, at least [Hz]."""

TENFOLD = 10
"""Instants between two points at which limits are looked at once more [-]."""

_SEEN = (
    Port("collet", "angle"),
    Port("grip", "position", "collet"),
    Port("grip", "angle", "collet"),
    Port("clubhead", "position", "collet"),
    Port("collet", "angular_velocity"),
    Port("grip", "velocity", "collet"),
    Port("grip", "angular_velocity", "collet"),
    Port("clubhead", "velocity", "collet"),
)


@dataclass(frozen=True)
class Played:
    """What the clubs of some robots do under a profile.

    Attributes:
        times: uniform samples; impact is one of them, shape (t,) [s].
        hit: the sample of impact.
        states: coordinates and rates, shape (robots, t, 8) [SI].
        numbers: of each robot [SI].
        doubt: what the simulation says against itself.
        flat: whether the robot is the linear one.
    """

    times: np.ndarray
    hit: int
    states: np.ndarray
    numbers: tuple[Mapping[str, float], ...]
    doubt: str = ""
    flat: bool = True


def drive_of_profile(profile: SwingProfile, ball: Impact) -> Drive:
    """What a profile and the ball do to the robot; the motors move as the controller joins points.

    Args:
        profile: as read from the robot's file.
        ball: force and duration; it hits at the profile's instant of impact.
    """
    knots, c = profile.curve.x, profile.curve.c
    joints = []
    for column, name in enumerate(("arm", "wrist")):
        pieces = np.stack(
            [c[3, :, column], c[2, :, column], 2 * c[1, :, column], 6 * c[0, :, column]]
        )
        end = float(profile.curve(knots[-1])[column])
        listed = [*map(tuple, pieces.T.tolist()), (end, 0.0, 0.0, 0.0)]
        begin = (float(c[3, 0, column]), float(c[2, 0, column]))
        joints.append(Prescribed(name, begin, tuple(knots.tolist()), tuple(listed)))
    if not ball.force:
        return Drive(joints=tuple(joints))
    pulse = impact("clubhead", ball.force, profile.impact_time, ball.duration)
    return Drive(pulse.port, pulse.edges, pulse.levels, joints=tuple(joints))


def play(
    profile: SwingProfile,
    rig: Rig,
    ball: Impact,
    factors: Sequence[float] = (1.0,),
    parameter: str = SHAFT_FREQUENCY,
    after: float = AFTER,
    robots: Sequence[Mapping[str, float]] | None = None,
) -> Played:
    """Simulate a profile with the model, for the robot and for others near it.

    Args:
        profile: as read from the robot's file.
        rig: the robot.
        ball: force and duration.
        factors: of the parameter, one robot each [-].
        parameter: what they scale; see `scaled`.
        after: how long after the end [s].
        robots: numbers of the robots instead, however they came about [SI].

    Returns:
        What happens.
    """
    robot = Robot("driven_arm", tuple(rig_numbers(rig)))
    if robots is None:
        robots = [scaled(rig_numbers(rig), parameter, factor) for factor in factors]
    robots = [dict(one) for one in robots]
    parts = max(1, int(np.ceil(profile.impact_time * RATE)))
    step = profile.impact_time / parts
    count = int(np.ceil((profile.time[-1] + after) / step)) + 1
    times = step * np.arange(count)
    drive = drive_of_profile(profile, ball)
    if rig.fidelity == "planar" and len(robots) > 1:
        return _played_plane(profile, rig, ball, robots, after)
    doubt, numbers = "", robots[0]
    if rig.fidelity == "planar":
        motion = respond_planar(robot, numbers, drive, times, (), rig.laws)
        doubt = "" if motion.status == "converged" else motion.sentence
        states = np.full((1, count, 8), np.nan)
        states[0, : len(motion.times)] = np.hstack([motion.positions, motion.velocities])
    elif rig.laws:
        found = [respond(robot, p, drive, times, (), rig.laws) for p in robots]
        states = np.stack([np.hstack([one.positions, one.velocities]) for one in found])
    else:
        table = {name: np.array([p[name] for p in robots]) for name in robot.names}
        states = respond_batch(robot, table, drive, times, _SEEN)
    return Played(times, parts, states, tuple(robots), doubt, rig.fidelity != "planar")


def _played_plane(
    profile: SwingProfile,
    rig: Rig,
    ball: Impact,
    robots: Sequence[dict[str, float]],
    after: float,
) -> Played:
    """Many robots in the plane at once, on a clock on which impact and the ball's end are ticks."""
    contact = ball.duration if ball.force else profile.time[1]
    step = contact / np.ceil(contact * RATE)
    before = int(np.ceil(profile.impact_time / step))
    ticks = before + int(np.ceil((profile.time[-1] + after - profile.impact_time) / step))
    times = profile.impact_time + step * (np.arange(ticks + 1) - before)
    from ..model.radau import NODES

    nodes = times[:-1, None] + step * NODES
    course = profile.at(nodes.reshape(-1))
    columns = [
        np.asarray(part)[:, axis].reshape(nodes.shape) for part in course[:3] for axis in (0, 1)
    ]
    middle = times[:-1] + 0.5 * step
    force = np.where(
        (middle > profile.impact_time) & (middle < profile.impact_time + contact), ball.force, 0.0
    )
    none = np.zeros_like(nodes)
    values = np.stack([*columns, none, np.repeat(force[:, None], 3, axis=1)], axis=1)
    begin = np.append(profile.at(times[:1]).angles[0, :2], [0.0, 0.0])
    tables = [{k: v for k, v in p.items() if k != INCLINATION} for p in robots]
    table = {name: np.array([p[name] for p in tables]) for name in tables[0]}
    acting = acting_laws(rig.laws, Robot("driven_arm", tuple(tables[0])))
    laws = {(one.place, one.law.name): one.strength for one in acting}
    tilt = robots[0].get(INCLINATION, 0.0)
    found = swings("driven_arm", table, [Signals(times, values, begin)], tilt, laws=laws or None)
    states = np.stack([np.hstack([one.positions, one.velocities]) for one in found])
    return Played(times, before, states, tuple(robots), flat=False)


def rig_numbers(rig: Rig) -> dict[str, float]:
    """The bare numbers of a rig by name [SI]."""
    return {name: float(parameter.value) for name, parameter in rig.parameters.items()}


def scaled(numbers: Mapping[str, float], parameter: str, factor: float) -> dict[str, float]:
    """Numbers [SI] with one of them scaled; the shaft's frequency by its stiffness."""
    if parameter == SHAFT_FREQUENCY:
        return {**numbers, "shaft_stiffness": numbers["shaft_stiffness"] * factor**2}
    return {**numbers, parameter: numbers[parameter] * factor}


def robots_at(
    task: SwingTask, rig: Rig, factors: Sequence[float] | np.ndarray
) -> tuple[dict[str, float], ...]:
    """Numbers of the robots at some factors of a task's parameter [SI].

    Args:
        task: tells the parameter, and for ``posterior`` the draws.
        rig: the robot.
        factors: shares of the parameter; of draws their numbers, 0 for the robot itself [-].
    """
    numbers, robust = rig_numbers(rig), task.robust
    if robust.parameter == POSTERIOR:
        drawn = ({}, *robust.draws)
        return tuple({**numbers, **drawn[round(float(one))]} for one in factors)
    parameter = robust.parameter or SHAFT_FREQUENCY
    return tuple(scaled(numbers, parameter, float(one)) for one in factors)


@dataclass(frozen=True)
class Verdict:
    """What a simulation of the robot's file says.

    Attributes:
        task: what was asked.
        profile: as read from the file.
        nominal: the robot itself.
        spread: robots near it.
        factors: of these, shape (f,) [-].
        uses: of the motors' limits, exact between points.
    """

    task: SwingTask
    profile: SwingProfile
    nominal: Played
    spread: Played
    factors: np.ndarray
    uses: tuple[Use, ...]

    @cached_property
    def errors(self) -> dict[str, float]:
        """At impact, read less wanted, by the names of `impact_of` [m/s or rad]."""
        return self._read(self.nominal, 0)

    @cached_property
    def spreads(self) -> dict[str, tuple[float, float]]:
        """Lowest and highest of these errors over the robots near it [m/s or rad]."""
        found = [self._read(self.spread, index) for index in range(len(self.factors))]
        return {
            name: (min(one[name] for one in found), max(one[name] for one in found))
            for name in self.errors
        }

    def _read(self, played: Played, index: int) -> dict[str, float]:
        course = self.profile.at(np.array([self.profile.impact_time]))
        angles, rates = course.angles[0, :2], course.velocities[0, :2]
        state = played.states[index, played.hit]
        seen = impact_of(played.numbers[index], state, angles, rates, played.flat)
        return {name: float(seen[name] - goal) for name, goal in wanted(self.task).items()}

    @cached_property
    def residual(self) -> np.ndarray:
        """Largest distance of each robot's clubhead from rest after the end, shape (f,) [m]."""
        return np.array([self._ring(self.spread, index) for index in range(len(self.factors))])

    def _ring(self, played: Played, index: int) -> float:
        """Distance from a rigid club's place, or from where it comes to rest under weight [m]."""
        kept = played.times >= self.profile.time[-1]
        x, angles = played.states[index, kept], self.profile.read_angles[-1, :2]
        away = reach(played.numbers[index]) * (x[:, 0] - angles.sum()) + x[:, 3]
        if played.numbers[index].get(INCLINATION, 0.0):
            away = away - away[-1]
        return float(np.max(np.abs(away)))

    def bends(self, played: Played) -> tuple[float, float]:
        """Largest bend of the shaft before and after impact [m]."""
        found = np.zeros(2)
        for index, numbers in enumerate(played.numbers):
            bent = np.abs(bend_rows(numbers, played.states[index, :, :4].T, played.flat))
            first = bent[: played.hit + 1].max()
            found = np.maximum(found, [first, bent[played.hit :].max()])
        return float(found[0]), float(found[1])

    def vibration(self) -> tuple[float, float]:
        """RMS of the clubhead's velocity against a rigid club's, before and after impact [m/s]."""
        played = self.nominal
        rates = self.profile.at(played.times).velocities[:, :2].sum(axis=1)
        x = played.states[0]
        moved = reach(played.numbers[0]) * (x[:, 4] - rates) + x[:, 7]
        parts = moved[: played.hit + 1], moved[played.hit :]
        return tuple(float(np.sqrt(np.mean(part**2))) for part in parts)  # type: ignore[return-value]

    def shaft_uses(self) -> list[tuple[str, float, float]]:
        """Name, bend and limit of the shaft before and after impact, nominal [m]."""
        limits: ShaftLimits = self.task.shaft
        before, after = self.bends(self.nominal)
        return [
            ("deflection before impact", before, limits.deflection_before),
            ("deflection after impact", after, limits.deflection_after),
        ]

    @cached_property
    def torques(self) -> tuple[Use, ...]:
        """Largest torque of the arm's and the wrist's motor in the nominal robot [N m]."""
        shaft, found = self.task.shaft, []
        most = {"arm": shaft.arm_torque, "wrist": shaft.wrist_torque}
        for axis, (times, values) in motor_torques(self).items():
            at = int(np.nanargmax(np.abs(values)))
            value, bound = float(values[at]), most[axis]
            when = float(times[at])
            found.append(Use(axis, "torque", abs(value) / bound, when, value, bound, "N m"))
        return tuple(found)

    @cached_property
    def failures(self) -> tuple[str, ...]:
        """Everything that does not pass, in words."""
        return tuple(_failures(self))

    @property
    def passed(self) -> bool:
        """Whether the file does what the task asks."""
        return not self.failures


def motor_torques(verdict: Verdict) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Times [s] and torques [N m] of arm and wrist motor in the nominal robot, from the file."""
    played, ball = verdict.nominal, verdict.task.impact
    numbers, times = played.numbers[0], played.times
    course, x = verdict.profile.at(times), played.states[0].T
    angles, rates = course.angles[:, :2].T, course.velocities[:, :2].T
    whole = [(part[:, :-1], part[:, 1:]) for part in (x, angles, rates)]
    hit = verdict.profile.impact_time
    shared = np.clip(times[1:], hit, hit + ball.duration)
    shared = shared - np.clip(times[:-1], hit, hit + ball.duration)
    step = np.diff(times)
    before, after = ([part[side] for part in whole] for side in (0, 1))
    arm = arm_torque(numbers, before, after, step, ball.force * shared / step, played.flat)
    return {
        "arm": (0.5 * (times[1:] + times[:-1]), arm),
        "wrist": (times, wrist_torque(numbers, x, angles, rates)),
    }


def _failures(verdict: Verdict) -> list[str]:
    found = [verdict.nominal.doubt] if _matters(verdict) else []
    for name, error in verdict.errors.items():
        unit, most = ("m/s", SPEED) if name == "speed" else ("degrees", POSE)
        if not abs(error) <= most:
            shown, limit = (error, most) if name == "speed" else np.degrees([error, most])
            found.append(f"{name} at impact is off by {shown:.3g} {unit}, more than {limit:.3g}")
    for use in (*verdict.uses, *verdict.torques):
        if not use.ratio <= 1.0 + EXCESS:
            found.append(
                f"{use.axis} {use.quantity} is {use.ratio:.4g} times its limit at {use.time:.4g} s"
            )
    for name, bent, most in verdict.shaft_uses():
        if not bent <= most * (1.0 + EXCESS):
            found.append(f"{name} is {bent:.4g} m, limit {most:.4g} m")
    if verdict.task.robust.impact:
        for name, (low, high) in verdict.spreads.items():
            most = SPEED if name == "speed" else POSE_ROBUST
            if name != "speed" and not max(-low, high) <= most:
                worst = np.degrees(max(-low, high))
                found.append(f"{name} at impact is off by up to {worst:.3g} degrees in a scenario")
    return found


def _matters(verdict: Verdict) -> bool:
    """A shaft that the task lets bend beyond its law is said elsewhere; a bad simulation here."""
    doubt = verdict.nominal.doubt
    return bool(doubt) and not doubt.startswith("The shaft bends")


def examine(
    profile: SwingProfile, task: SwingTask, rig: Rig, factors: np.ndarray | None = None
) -> Verdict:
    """Simulate a profile anew and compare it with its task.

    Args:
        profile: as read back from the robot's file, see `supple.optimize.profile.read_pod`.
        task: what was asked.
        rig: the robot.
        factors: of the task's parameter at which the residual is looked at; by default `FACTORS`
            of them over the task's range, or within a tenth where it names none [-].

    Returns:
        The verdict.
    """
    given = _usual(task) if factors is None else np.asarray(factors, float)
    nominal = play(profile, rig, task.impact)
    robots = robots_at(task, rig, given)
    spread = play(profile, rig, task.impact, given.tolist(), robots=robots)
    return Verdict(task, profile, nominal, spread, given, _uses(profile, task.limits))


def _usual(task: SwingTask) -> np.ndarray:
    """Where the residual is looked at [-]: all draws, or factors between the lowest and highest."""
    if task.robust.parameter == POSTERIOR:
        return np.arange(1.0, len(task.robust.draws) + 1)
    low, high = task.robust.factors if task.robust.parameter else (0.9, 1.1)
    return np.linspace(*((low, high) if high > low else (0.9, 1.1)), FACTORS)


def _uses(profile: SwingProfile, limits: Limits) -> tuple[Use, ...]:
    """Uses of the limits, in closed form; a grid ten times finer may not find more."""
    uses = excess(profile, limits)
    fine = np.linspace(0.0, profile.time[-1], TENFOLD * (len(profile.time) - 1) + 1)
    course: Any = profile.at(fine)
    for use, table in zip(
        uses, [part[:, axis] for axis in range(3) for part in course], strict=True
    ):
        middle, half = getattr(limits, use.axis).most(use.quantity)
        sampled = float(np.max(np.abs(table - middle))) / half if np.isfinite(half) else 0.0
        assert sampled <= use.ratio * (1 + 1e-9) + 1e-12, "closed form and samples disagree"
    return uses


def held_names(task: SwingTask) -> tuple[str, ...]:
    """What the task holds at impact: chord, grip, or wrist for the motors alone."""
    return HELD[task.impact.hold]
