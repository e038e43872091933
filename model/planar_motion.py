"""respond_planar(robot, numbers, drive, times) -> Motion: full kinematics under any drive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import extended, planar
from .drives import ON_SAMPLE, Drive
from .lagrange import Acting
from .linear import Port
from .motion import TOLERANCE, Motion, uniform
from .planar_march import Course, Legs, Plane, begin, legs
from .planar_release import released, rest
from .planar_sensors import planar_samples, track_of
from .quick import quickly
from .radau import NODES
from .robot import INCLINATION, Robot
from .shaft import LARGEST_BEND, LARGEST_TILT

LONGEST = 1e-3
"""Longest step that is tried [s]."""

POINTS_PER_WAVE = 20
"""Fewest steps in one wave of a drive [-]."""

FINE = 1e-8
"""Estimated error at which a motion is not refined further [-]; beyond `ENOUGH` steps a sample
that of `TOLERANCE` will do."""

ENOUGH, MOST_REFINEMENT, MOST_STEPS = 8, 64, 4_000_000
"""How often the first steps are halved at most, as a factor, and most steps of a motion [-]."""

THIRD_ORDER = 7.0
"""What halved steps change, over the error that they leave, in the sleeve's stiff modes [-]."""

UNSETTLED = 1e-8
"""Largest last change of an acceleration of a step that counts as settled [-]."""

_legs = quickly(legs, (0, 1))

CHUNK = 256
"""Steps that are marched at once, so that one compiled length serves every motion [-]."""

OWN = ("base_acceleration", "centrifugal_stiffening", "gravity")
"""Laws that mend what the thesis fidelity leaves out, and the planar one does not [-]."""

LEFT_SHAFT = (
    "The shaft bends by up to {bend:.2f} m: beyond {limit:.2f} m, {share:g} of its length, its "
    "force is no longer good. Slow the swing, stiffen the shaft, or take these numbers for a first "
    "look."
)
LEFT_SLEEVE = (
    "The grip tilts by up to {tilt:.2f} rad in the collet: beyond {limit:g} rad the place of the "
    "clubhead is no longer good. Stiffen the sleeve, or take these numbers for a first look."
)
RAN_AWAY = (
    "The motion grew beyond all numbers after {time:.6g} s, where the table ends. Look for a "
    "constant of the wrong sign or size, or a shaft or sleeve too weak for this swing."
)


@dataclass(frozen=True)
class Case:
    """One motion to be marched: the model, its numbers and its drive.

    Attributes:
        model: one of `lagrange.MODELS`.
        acting: laws in force.
        plane: the numbers [SI].
        drive: what moves it.
        times: uniform samples from 0 on, shape (t,) [s].
    """

    model: str
    acting: tuple[Acting, ...]
    plane: Plane
    drive: Drive
    times: np.ndarray

    @property
    def numbers(self) -> dict[str, float]:
        """Of the robot by name [SI]."""
        return {name: float(value) for name, value in self.plane.numbers.items()}


@dataclass(frozen=True)
class _Run:
    """A march: at the samples positions, velocities, accelerations, each (t, 4), and the rest."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    bend: float  # largest of the shaft at any step [m]
    tilt: float  # of the grip against the collet, likewise [rad]
    change: float  # largest last change of an unsettled step [-]


def respond_planar(
    robot: Robot,
    numbers: Mapping[str, float],
    drive: Drive,
    times: np.ndarray,
    sensors: tuple[Port, ...] = (),
    laws: Iterable[Mapping[str, Any]] = (),
) -> Motion:
    """One motion of a robot in the swing plane.

    A blow shorter than a step has its whole impulse: steps end where the drive jumps. Forces on
    clubhead and grip act across the collet's axis and turn with it. A robot without an arm that
    moves stands with its arm at 0, pointing at the ball.

    Args:
        robot: any of the six models.
        numbers: its numbers by name [SI]; `robot.INCLINATION`, where given, is the swing plane's
            against the horizontal, otherwise the plane is horizontal and nothing has weight.
        drive: what moves it, see `supple.model.drives`.
        times: uniform samples from 0 on, at least two [s].
        sensors: what to measure beside the coordinates, see `planar_samples`.
        laws: tables of an extended rig; laws of sensors are passed over.

    Returns:
        The motion. Its steps are halved until the error that this shows is small; its status says
        where that was not enough, where the shaft bends or the grip tilts too far for its law,
        and where the motion grew beyond all numbers, after which it ends.

    Raises:
        ValueError: for times that are not uniform, numbers that are missing, a law that does not
            fit, a leaping angle where laws act, or a release without a balance.

    Source: Lagrange's equations of `supple.model.planar`; tests/model/test_planar_motion.py.
    """
    times, listed = uniform(times), extended.acting_laws(laws, robot)
    check_laws(listed)
    if listed and any(joint.leaps for joint in drive.joints):
        raise ValueError(
            "drive: expected a prescribed angle without leaps where laws act, found one that "
            "leaps. Mend: give a profile, or a sine that ends with a half wave."
        )
    case = case_of(robot, numbers, drive, times)
    if listed:
        case = _with_laws(case, listed)
    run, error, refinement = _refined(case, start_of(case))
    return _motion(robot, case, run, sensors, error, refinement)


def check_laws(listed: Iterable[extended.Acting]) -> None:
    """Refuse laws that cannot act in the plane, or say what the planar robot says of itself.

    Args:
        listed: as `extended.acting_laws` gives them.

    Raises:
        ValueError: naming the law and its place.
    """
    for one in listed:
        found = f"'{one.law.name}' at '{one.place}'"
        if one.law.name in OWN:
            found += ", which fidelity 'planar' has of itself"
        elif one.law.kind == "link" and one.place in ("sleeve", "shaft", "wrist"):
            continue
        raise ValueError(
            "[[laws]]: expected laws of sleeve, shaft or wrist that a planar robot lacks, found "
            f"{found}. Mend: remove this law, or write fidelity = 'thesis'."
        )


def case_of(robot: Robot, numbers: Mapping[str, float], drive: Drive, times: np.ndarray) -> Case:
    """A motion without laws of numbers [SI] over sample times [s], at rest in the origin.

    A collet without a spring is one with a spring of no stiffness: one program for both.
    """
    missing = [name for name in robot.names if name not in numbers]
    if missing:
        raise ValueError(
            f"numbers: expected every number of the rig, found none for '{missing[0]}'. "
            "Mend: add it."
        )
    table = {name: float(numbers[name]) for name in robot.names}
    pull = planar.GRAVITY * np.sin(table.pop(INCLINATION, 0.0))
    if robot.model == "driven_collet":
        table |= {"wrist_stiffness": 0.0, "wrist_damping": 0.0}
    model = robot.model if robot.model == "fixed_collet" else "pinned_wrist"
    plane = Plane(table, pull, np.zeros(0), np.zeros((0, 2)), ())
    return Case(model, (), plane, drive, times)


def begun_signals(drive: Drive) -> np.ndarray:
    """Signals before the first sample, shape (8,) [SI]."""
    found = np.zeros(8)
    for joint in drive.joints:
        found[[0, 2] if joint.joint == "arm" else [1, 3]] = joint.begin
    return found


def start_of(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and their rates before the first sample, shape (4,) each [SI]."""
    arm, wrist, turn, flick = begun_signals(case.drive)[:4]
    if case.drive.hold is None:
        q = rest(case.model, case.acting, case.plane, arm, wrist)
    else:
        q = released(case.model, case.acting, case.plane, case.drive.hold)
    turning = case.model != "fixed_collet"
    return q, np.array([(turn + flick) * turning, 0.0, 0.0, 0.0])


def _with_laws(case: Case, listed: tuple[extended.Acting, ...]) -> Case:
    """The same with laws in force; the width of a corner is a share of the motion without them."""
    widths = np.full((len(listed), 2), np.nan)
    for index, one in enumerate(listed):
        stated = one.stretch_width, one.rate_width
        widths[index] = [np.nan if width is None else width for width in stated]
    if np.any(np.isnan(widths)):
        run = _march(case, start_of(case), 1)
        drive = sampled_signals(case.drive, case.times)[: len(run.q)]
        for index, one in enumerate(listed):
            moved = _stretches(case, one.place, run, drive)
            found = [extended.WIDTH * float(np.sqrt(np.mean(part**2))) for part in moved]
            chosen = np.where(np.isnan(widths[index]), found, widths[index])
            widths[index] = np.maximum(chosen, 1e-12)
    strengths = np.array([one.strength for one in listed])
    shapes = tuple(one.shapes for one in listed)
    plane = case.plane._replace(strengths=strengths, widths=widths, shapes=shapes)
    return replace(case, acting=tuple(Acting(o.place, o.law.name) for o in listed), plane=plane)


def _stretches(
    case: Case, place: str, run: _Run, drive: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Stretches of a place and their rates, shape (springs, t) [m or rad, and a second]."""
    found = planar.springs(case.numbers, run.q.T, run.v.T, drive.T[:2], drive.T[2:4], True)
    kept = [one for one in found if one.place == place]
    return np.stack([one.stretch for one in kept]), np.stack([one.rate for one in kept])


def _refined(case: Case, start: tuple[np.ndarray, np.ndarray]) -> tuple[_Run, float, int]:
    """A march, its estimated error, and into how many parts its first steps were cut."""
    refinement, error, run = 1, np.inf, _march(case, start, 1)
    count = len(steps_of(case.drive, case.times, 1)[0])
    most = max(2, min(MOST_REFINEMENT, MOST_STEPS // count))
    while error > (FINE if refinement < ENOUGH else TOLERANCE) and refinement < most:
        refinement *= 2
        finer = _march(case, start, refinement)
        both_end = len(run.q) < len(case.times) and len(finer.q) < len(case.times)
        error, run = _error(run, finer, case), finer
        if both_end and refinement >= ENOUGH:
            break
    return run, error, refinement


def _error(run: _Run, finer: _Run, case: Case) -> float:
    """Estimated error of the finer run, as a share of the largest value of each state."""
    if len(run.q) != len(finer.q) or not finer.change <= UNSETTLED:
        return np.inf
    at = planar.points_of(case.numbers)
    levers = np.array([at.head, 1.0, at.lever, 1.0])
    reach = max(float(np.max(np.abs(finer.q) * levers)), 1e-300)
    worst = 0.0
    for coarse, fine in ((run.q, finer.q), (run.v, finer.v)):
        # what hardly moves is measured by the motion as a whole, so that rounding is no error
        size = np.maximum(np.max(np.abs(fine), axis=0), 1e-4 * reach / levers)
        worst = max(worst, float(np.max(np.abs(fine - coarse) / size)))
    return worst / THIRD_ORDER


def steps_of(drive: Drive, times: np.ndarray, refinement: int) -> tuple[np.ndarray, np.ndarray]:
    """Starts of all steps, the last sample included, and which of them are samples [s]."""
    sampling = float(times[-1]) / (len(times) - 1)
    edges = np.array([*drive.edges, *(e for joint in drive.joints for e in joint.edges)])
    edges = np.unique(edges[(edges > 0) & (edges < times[-1])])
    near = np.abs(edges / sampling - np.round(edges / sampling)) <= ON_SAMPLE
    whole = np.unique(np.concatenate([times, edges[~near]]))
    fastest = max([drive.frequency, *(joint.frequency for joint in drive.joints)])
    longest = LONGEST if not fastest else min(LONGEST, 2 * np.pi / fastest / POINTS_PER_WAVE)
    parts = np.ceil(np.diff(whole) / longest * (1 - 1e-9)).astype(int) * refinement
    first = np.concatenate([[0], np.cumsum(parts)])
    inside = np.arange(first[-1]) - np.repeat(first[:-1], parts)
    cut = np.repeat(whole[:-1], parts) + inside * np.repeat(np.diff(whole) / parts, parts)
    return np.append(cut, whole[-1]), first[np.searchsorted(whole, times)]


def _march(case: Case, start: tuple[np.ndarray, np.ndarray], refinement: int) -> _Run:
    """March through all steps, chunk by chunk; a motion that runs away ends."""
    starts, samples = steps_of(case.drive, case.times, refinement)
    steps = np.append(np.diff(starts), 0.0)
    pushes = pushes_of(case.drive, starts)
    course: Course = begin(case.model, case.acting, case.plane, *start, begun_signals(case.drive))
    p, tables, bend, tilt, change = case.numbers, [], 0.0, 0.0, 0.0
    for low in range(0, len(starts), CHUNK):
        part = slice(low, min(low + CHUNK, len(starts)))
        ahead = legs_of(case.drive, starts[part], steps[part], pushes[part])
        course, found = _legs(case.model, case.acting, case.plane, course, ahead)
        q, v, a, changes = (np.asarray(each)[: part.stop - low] for each in found)
        bent = np.abs(planar.bend(p, q.T))
        finite = np.isfinite(bent + np.sum(v + a, axis=1))
        bend = max(bend, float(np.max(bent[finite], initial=0.0)))
        tilt = max(tilt, float(np.max(np.abs(q[finite, 2]), initial=0.0)))
        change = max(change, float(np.max(np.nan_to_num(changes, nan=np.inf))))
        tables.append(np.stack([q, v, a], axis=1))
        if not np.all(finite):
            break
    table = np.concatenate(tables)
    kept = samples[samples < len(table)]
    wild = ~np.all(np.isfinite(table[kept]), axis=(1, 2))
    last = int(np.argmax(wild)) if np.any(wild) else len(kept)
    q, v, a = np.moveaxis(table[kept[:last]], 1, 0)
    return _Run(q, v, a, bend, tilt, change)


def legs_of(drive: Drive, starts: np.ndarray, steps: np.ndarray, pushes: np.ndarray) -> Legs:
    """What drives a chunk of steps [s, SI], filled up with steps of no length."""
    inside = starts + 0.5 * steps
    at = starts[:, None] + steps[:, None] * np.append(0.0, NODES)
    signals = np.stack([_signals(drive, column, inside) for column in at.T], axis=2)
    missing = CHUNK - len(starts)
    return Legs(
        np.append(steps, np.zeros(missing)),
        np.concatenate([signals, np.repeat(signals[-1:], missing, axis=0)]),
        np.concatenate([pushes, np.zeros((missing, 2))]),
    )


def _signals(drive: Drive, times: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """`Legs.signals` at some times, of the pieces that rule `inside`, shape (t, 8) [SI]."""
    found = np.zeros((len(times), 8))
    for joint in drive.joints:
        angle, rate, bend = joint.at(times, inside).T
        column = 0 if joint.joint == "arm" else 1
        found[:, column], found[:, 2 + column] = angle, rate
        if column == 0:
            found[:, 4] = bend
    if drive.port is not None:
        force = drive.level(inside)
        if drive.frequency:
            force = force * np.sin(drive.frequency * (times - drive.edges[0]))
        found[:, {"clubhead": 6, "grip": 7}.get(drive.port.place, 5)] = force
    return found


def sampled_signals(drive: Drive, times: np.ndarray) -> np.ndarray:
    """`Legs.signals` of a drive at the samples [s], the new ones at a jump, shape (t, 8) [SI]."""
    return _signals(drive, times, times + ON_SAMPLE * times[1])


def pushes_of(drive: Drive, starts: np.ndarray) -> np.ndarray:
    """`Legs.pushes` at the start of each step, shape (steps, 2) [rad/s, rad]."""
    found = np.zeros((len(starts), 2))
    for joint in drive.joints:
        edges = np.asarray(joint.edges)
        after = np.clip(np.searchsorted(starts, edges), 1, len(starts) - 1)
        nearer = after - (edges - starts[after - 1] < starts[after] - edges)
        column, order = (0, 1) if joint.joint == "arm" else (1, 0)
        kept = edges <= starts[-1]
        np.add.at(found[:, column], nearer[kept], joint.jumps[kept, order])
    return found


def _motion(
    robot: Robot,
    case: Case,
    run: _Run,
    sensors: tuple[Port, ...],
    error: float,
    refinement: int,
) -> Motion:
    """What was marched, with what sensors see of it and what is to be doubted."""
    times, whole = case.times[: len(run.q)], len(run.q) == len(case.times)
    track = track_of(run.q, run.v, run.a, sampled_signals(case.drive, case.times))
    samples = [planar_samples(case.numbers, track, port) for port in sensors]
    doubt = ""
    if not whole:
        doubt = RAN_AWAY.format(time=times[-1])
    elif run.bend > planar.most_bend(case.numbers):
        limit = planar.most_bend(case.numbers)
        doubt = LEFT_SHAFT.format(bend=run.bend, limit=limit, share=LARGEST_BEND)
    elif run.tilt > LARGEST_TILT:
        doubt = LEFT_SLEEVE.format(tilt=run.tilt, limit=LARGEST_TILT)
    first = 4 - len(robot.coordinates)
    return Motion(
        times, robot.coordinates, run.q[:, first:], run.v[:, first:], run.a[:, first:], sensors,
        np.stack(samples, axis=1) if samples else np.zeros((len(times), 0)),
        error if whole else np.inf, refinement, doubt,
    )  # fmt: skip
