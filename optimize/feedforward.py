"""The drive that makes a compliant club go where the golfer's went, as far as one can."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.linalg import eig

from ..model.linear import Port, state_space
from ..model.rig import Rig
from .profile import AxisLimits, Limits, SwingProfile
from .solve_grid import Grid, Maps, Motors, condensed, followed, make_grid, played
from .solve_linear import robot_of
from .solve_newton import closed
from .solve_problem import Plant, Problem
from .solve_program import HELD, impact_of, reach
from .solve_quadratic import Bounds, Reduced, nearest, reduce, relaxed
from .solve_scenarios import plant_of
from .swing_check import rig_numbers
from .task import Cost, Hold, Impact, Robust, ShaftLimits, SwingTask

SPLINES = 120
"""Cubic splines of the wrist's jerk [-]."""

LOOSE = np.radians(5.0)
"""Distance from the golfer's club, outside the stretch that matters, that weighs as much as the
golfer's own jerk [rad]."""

MOST_PROGRAMS, SETTLED = 25, 1e-7
"""Programs about each other's motions in the plane, and the change that ends them [rad or m]."""

SMALLEST_SHARE, TRUSTED = 0.02, 0.3
"""Share of a way that is gone at least, and by which a motion may miss the plant then [-]."""

KEPT = 1e-6
"""Share by which bounds may be widened that are kept [-]."""

LARGEST_ZERO = 1e4
"""Zeros beyond this are those at infinity [1/s]."""

FOLLOWS, CANNOT, RAN_AWAY = "follows", "cannot", "ran_away"

CURVE = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 25.0)
"""Shares of the tolerance at which roughness is looked at [-]."""


@dataclass(frozen=True)
class Tolerance:
    """How near the club must be to the golfer's.

    Attributes:
        impact: at impact [rad].
        before: over a stretch before it [rad].
        stretch: its length [s].
    """

    impact: float = float(np.radians(0.05))
    before: float = float(np.radians(0.2))
    stretch: float = 0.2


@dataclass(frozen=True)
class Following:
    """How well a drive makes the club follow.

    Attributes:
        profile: of the robot.
        times: of the marks, shape (m,) [s].
        errors: pose of the club less the golfer's, shape (m,) [rad].
        impact_error: at impact [rad].
        window_error: largest over the stretch before impact [rad].
        speed: of the clubhead at impact [m/s].
        roughness: rms jerk of the wrist over that of the golfer's [-].
        ring: clubhead from rest at the end of the swing [m].
        status: ``follows``, ``cannot`` or ``ran_away``.
    """

    profile: SwingProfile
    times: np.ndarray
    errors: np.ndarray
    impact_error: float
    window_error: float
    speed: float
    roughness: float
    ring: float
    status: str

    @property
    def sentence(self) -> str:
        """How well, in words."""
        if self.status == RAN_AWAY:
            return "The club's motion under this drive is not finite."
        first = "The club follows" if self.status == FOLLOWS else "The club does not follow"
        return (
            f"{first}: {np.degrees(abs(self.impact_error)):.3g}° off at impact, at most "
            f"{np.degrees(self.window_error):.3g}° before it, with {self.roughness:.3g} times the "
            "golfer's jerk."
        )


@dataclass(frozen=True)
class Course:
    """A golfer's motion and the robot that is to follow it, ready for many drives.

    Attributes:
        golfer: motion of arm and wrist whose rigid club is followed.
        hold: what follows it: grip or chord.
        problem: clock, motors and robot.
        rig: the robot.
        plant: what moves.
        numbers: of the robot [SI].
        target: angle of the golfer's club at the marks, shape (m,) [rad].
        jerk: rms of the golfer's wrist [rad/s^3].
        limits: of the wrist's motor.
    """

    golfer: SwingProfile
    hold: str
    problem: Problem
    rig: Rig
    plant: Plant
    numbers: Mapping[str, float]
    target: np.ndarray
    jerk: float
    limits: AxisLimits


def course_of(
    golfer: SwingProfile,
    rig: Rig,
    hold: Hold = "grip",
    ball: Impact | None = None,
    limits: AxisLimits | None = None,
    splines: int = SPLINES,
) -> Course:
    """What is followed, and by what.

    Args:
        golfer: at rest at both ends; its points are joined as a cubic spline.
        rig: a robot whose arm and wrist are driven; its fidelity is obeyed.
        hold: grip or chord, what is to be at ``arm + wrist``.
        ball: its force [N] and duration [s]; none by default.
        limits: of the wrist's motor [SI].
        splines: see `SPLINES` [-].

    Raises:
        ValueError: for another pose than grip or chord.
    """
    if hold not in ("grip", "chord"):
        raise ValueError(
            f"feed-forward, hold: expected 'grip' or 'chord', found '{hold}'. "
            "Mend: name what is to follow."
        )
    golfer = replace(golfer, interpolation="cubic", quantum=0.0)
    ball = Impact(golfer.impact_time, 0.0, 0.0, 1.0) if ball is None else ball
    begin = golfer.at(np.zeros(1)).angles[0]
    task = SwingTask(
        Path(), rig.path, None, (float(golfer.time[-1]), float(golfer.time[-1])), len(golfer.time),
        (float(begin[0]), float(begin[1])), replace(ball, time=golfer.impact_time), True, Limits(),
        ShaftLimits(), Cost(), golfer.quantum, "cubic", Robust(),
    )  # fmt: skip
    contact = ball.duration if ball.force else 0.0
    grid = make_grid(task.duration[0], task.points, golfer.impact_time, contact, splines)
    numbers = rig_numbers(rig)
    flat = rig.fidelity != "planar"
    problem = Problem(task, grid, _motors(grid, golfer), (numbers,), 0, flat=flat)
    motion = golfer.at(grid.marks)
    target = motion.angles[:, :2].sum(axis=1)
    middles = grid.points[:-1] + 0.5 * grid.step
    jerk = float(np.sqrt(np.mean(golfer.at(middles).jerks[:, 1] ** 2)))
    own = AxisLimits() if limits is None else limits
    return Course(golfer, hold, problem, rig, plant_of(problem, rig), numbers, target, jerk, own)


def _motors(grid: Grid, golfer: SwingProfile) -> Motors:
    """The arm as the golfer's; the wrist by splines of jerk, in units of its largest jerk."""
    motion = golfer.at(grid.marks)
    jerks = golfer.at(0.5 * (grid.marks[:-1] + grid.marks[1:])).jerks
    slope = np.zeros((len(grid.marks), 2, 4, grid.unknowns))
    level = np.zeros((len(grid.marks), 2, 4))
    for order, table in enumerate((motion.angles, motion.velocities, motion.accelerations)):
        level[:, 0, order] = table[:, 0]
    level[:, 0, 3] = np.append(jerks[:, 0], jerks[-1, 0])
    level[:, 1, 0] = motion.angles[0, 1]
    slope[:, 1] = np.abs(jerks[:, 1]).max() * grid.moves
    return Motors(slope, level)


def follow(course: Course, tolerance: Tolerance = Tolerance(), share: float = 1.0) -> Following:
    """The smoothest wrist drive whose club is as near to the golfer's as a tolerance asks.

    The arm moves as the golfer's. The drive begins and ends at rest where the golfer's does.

    Args:
        course: what is followed.
        tolerance: how near.
        share: of the tolerance that is used [-].

    Returns:
        The drive and how it follows; where limits forbid it, one that breaks them least.

    Source: a quadratic program over splines of jerk, about its own solution in the plane;
    tests/optimize/test_feedforward.py.
    """
    course = _fresh(course)
    drive, plant = course.problem.drive, course.plant
    c = _golfers(course)
    states, kept = _simulated(course, drive.at(c)), False
    for _ in range(MOST_PROGRAMS):
        asked = share if plant.constant else max(share, _halfway(course, c, states, tolerance))
        maps = condensed(plant.steps(states, drive.at(c)), drive, plant.start())
        program, bounds = _program(course, maps, c, tolerance, asked)
        answer = nearest(program, bounds)
        if not answer.solved and answer.widened <= 0.0:
            answer = relaxed(program, bounds)
        wanted = maps.at(answer.c)
        part, away = 1.0, float(np.abs(wanted - states).max())
        while not plant.constant and part > SMALLEST_SHARE:
            if _misses(course, c + part * (answer.c - c), states + part * (wanted - states)) <= (
                TRUSTED * part * away + SETTLED
            ):
                break
            part *= 0.5
        c, states = c + part * (answer.c - c), states + part * (wanted - states)
        kept = answer.widened <= KEPT and asked == share
        if not np.isfinite(away) or (part == 1.0 and away <= SETTLED and asked == share):
            break
        if not plant.constant:
            tried = closed(course.problem, plant, c, states)
            states = tried if np.isfinite(tried).all() else states
    if not plant.constant:
        states = closed(course.problem, plant, c, states)
    return _told(course, drive.at(c), states, tolerance, share, kept)


def _fresh(course: Course) -> Course:
    """The same with a plant that remembers no motion, not even one that ran away."""
    return replace(course, plant=plant_of(course.problem, course.rig))


def _halfway(course: Course, c: np.ndarray, states: np.ndarray, tolerance: Tolerance) -> float:
    """Half of what the club is off now, in shares of the tolerance [-]."""
    motion = course.problem.drive.at(c)
    errors = _pose(course, states[0], motion)[0] - course.target
    return 0.5 * float(np.abs(errors[_stretch(course, tolerance)]).max()) / tolerance.before


def _misses(course: Course, c: np.ndarray, states: np.ndarray) -> float:
    """By how much a motion is not what the plant makes of it [rad or m]."""
    motion = course.problem.drive.at(c)
    moved = followed(course.plant.steps(states, motion), motion, course.plant.start())
    left = float(np.abs(moved - states).max())
    return left if np.isfinite(left) else np.inf


def _golfers(course: Course) -> np.ndarray:
    """Unknowns that move the wrist as nearly as can be as the golfer does."""
    grid, drive = course.problem.grid, course.problem.drive
    motion = course.golfer.at(grid.marks)
    rows = drive.slope[:, 1, 0]
    aim = motion.angles[:, 1] - drive.level[:, 1, 0]
    return np.linalg.lstsq(rows, aim, rcond=1e-10)[0]


def _pose(course: Course, states: np.ndarray, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle of what follows at every mark (m,), and its slopes by coordinates (m, 4) [rad]."""
    given = np.tile(states.T[:, None].astype(complex), (1, 4, 1))
    given[:4] += 1e-30j * np.eye(4)[:, :, None]
    angles, rates = motion[:, :, 0].T, motion[:, :, 1].T
    name = HELD[course.hold][0]
    flat = course.problem.flat
    seen = impact_of(course.numbers, given, angles[:, None], rates[:, None], flat)[name]
    seen = np.broadcast_to(seen, (4, len(motion)))
    return np.real(seen[0]), (np.imag(seen) / 1e-30).T


def _program(
    course: Course, maps: Maps, about: np.ndarray, tolerance: Tolerance, share: float
) -> tuple[Reduced, Bounds]:
    """Cost, equations and bounds about a motion."""
    grid, drive = course.problem.grid, course.problem.drive
    states, motion = maps.at(about)[0], drive.at(about)
    pose, slopes = _pose(course, states, motion)
    rows = np.einsum("ki,kin->kn", slopes, maps.slope[0, :, :4])
    left = pose - course.target - rows @ about
    scale = np.sqrt(np.gradient(grid.marks) / grid.points[-1]) / LOOSE
    unit = np.abs(drive.slope[:, 1, 3]).max() / max(np.abs(grid.basis).max(), 1e-12) / course.jerk
    jerks = np.sqrt(grid.step / grid.points[-1]) * unit * grid.basis
    cost = np.concatenate([jerks, scale[:, None] * rows])
    aim = np.concatenate([np.zeros(len(jerks)), -scale * left])
    end = drive.slope[-1, 1, :3]
    goal = np.array([course.golfer.at(grid.marks[-1:]).angles[0, 1] - drive.level[-1, 1, 0], 0, 0])
    sizes = np.abs(end).max(axis=1)
    at = _stretch(course, tolerance)
    most = np.where(np.arange(len(grid.marks)) == grid.impact, tolerance.impact, tolerance.before)
    most = share * most[at] * (1.0 - 1e-3)
    parts = [(rows[at] / most[:, None], -1.0 - left[at] / most, 1.0 - left[at] / most)]
    for order, quantity in enumerate(("angle", "velocity", "acceleration", "jerk")):
        middle, half = course.limits.most(quantity)
        if np.isfinite(half):
            level = (drive.level[:, 1, order] - middle) / half
            parts.append((drive.slope[:, 1, order] / half, -1.0 - level, 1.0 - level))
    whole = Bounds(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    return reduce(cost, aim, end / sizes[:, None], goal / sizes), whole


def _stretch(course: Course, tolerance: Tolerance) -> np.ndarray:
    """Marks of the stretch that matters, impact the last of them, shape (k,) [-]."""
    grid = course.problem.grid
    marks = np.flatnonzero(grid.marks >= grid.marks[grid.impact] - tolerance.stretch)
    return marks[marks <= grid.impact]


def _told(
    course: Course,
    motion: np.ndarray,
    states: np.ndarray,
    tolerance: Tolerance,
    share: float,
    kept: bool,
) -> Following:
    """What a motion of motors and club is worth."""
    grid, x = course.problem.grid, states[0]
    if not (np.isfinite(x).all() and np.isfinite(motion).all()):
        none = np.full(len(grid.marks), np.nan)
        lost = np.nan
        return Following(course.golfer, grid.marks, none, lost, lost, lost, lost, lost, RAN_AWAY)
    errors = _pose(course, x, motion)[0] - course.target
    at, hit = _stretch(course, tolerance), grid.impact
    flat = course.problem.flat
    seen = impact_of(course.numbers, x[hit], motion[hit, :, 0], motion[hit, :, 1], flat)
    ring = reach(course.numbers) * (x[-1, 0] - motion[-1, :, 0].sum()) + x[-1, 3]
    points = grid.at_points
    profile = replace(course.golfer, wrist_angle=motion[points, 1, 0], phases={})
    inside = np.abs(errors[at]).max() <= 1.001 * share * tolerance.before
    status = FOLLOWS if kept and inside else CANNOT
    jerk = float(np.sqrt(np.mean(motion[points[:-1], 1, 3] ** 2)))
    return Following(
        profile, grid.marks, errors, float(errors[hit]), float(np.abs(errors[at]).max()),
        float(seen["speed"]), jerk / course.jerk, float(ring), status,
    )  # fmt: skip


def untreated(course: Course, tolerance: Tolerance = Tolerance()) -> Following:
    """What the club does where the wrist moves as the golfer's; arguments as those of `follow`."""
    return subtracted(course, 0, tolerance)[0]


def subtracted(
    course: Course,
    rounds: int,
    tolerance: Tolerance = Tolerance(),
) -> tuple[Following, ...]:
    """The thesis's way: the club's error taken off the drive at every point, again and again.

    Args:
        course: what is followed.
        rounds: how often [-].
        tolerance: says where errors are looked at.

    Returns:
        What the club does before the first subtraction, and after each; fewer where it runs away.

    Source: thesis, section 8, where one subtraction roughened the profile.
    """
    course = _fresh(course)
    golfer, problem = course.golfer, course.problem
    wrist, found = np.array(golfer.wrist_angle), []
    for _ in range(rounds + 1):
        drive = replace(golfer, wrist_angle=wrist, quantum=0.0)
        motion = played(problem.grid, drive)
        states = _simulated(course, motion)
        one = _told(course, motion, states, tolerance, 1.0, kept=True)
        found.append(one)
        if one.status == RAN_AWAY:
            break
        wrist = wrist - one.errors[problem.grid.at_points]
    return tuple(found)


def _simulated(course: Course, motion: np.ndarray) -> np.ndarray:
    """The club's motion under the motors', shape (1, marks, 8) [SI]."""
    grid, start = course.problem.grid, course.plant.start()
    fixed = Motors(np.zeros((len(motion), 2, 4, 1)), motion)
    states = np.zeros((1, len(motion), 8))
    states[0, :, 0], states[0, :, 4] = motion[:, :, 0].sum(axis=1), motion[:, :, 1].sum(axis=1)
    if course.plant.constant:
        return followed(course.plant.steps(states, motion), motion, start)
    return closed(
        replace(course.problem, grid=grid, drive=fixed), course.plant, np.zeros(1), states
    )


def curve(
    course: Course,
    tolerance: Tolerance = Tolerance(),
    shares: tuple[float, ...] = CURVE,
) -> tuple[Following, ...]:
    """Roughness against how nearly the golfer is followed, at shares of a tolerance [-]."""
    return tuple(follow(course, tolerance, share) for share in shares)


def inverse_zeros(rig: Rig, hold: Hold = "grip") -> np.ndarray:
    """Zeros from the wrist's drive to the club's angle, those of the linear robot.

    Whoever inverts the robot exactly has these as poles: one whose real part is above zero grows,
    and no drive that follows exactly can come to rest.

    Args:
        rig: the robot.
        hold: grip or chord.

    Returns:
        The finite ones, the least stable first, shape (k,) [1/s].

    Source: generalized eigenvalues of Rosenbrock's matrix; tests/optimize/test_feedforward.py.
    """
    numbers = rig_numbers(rig)
    space = state_space(robot_of(rig), numbers, (Port("wrist", "angular_acceleration"),))
    a, b = np.asarray(space.a), np.asarray(space.b)[:, :1]
    seen = np.zeros((1, len(a)))
    seen[0, 0] = 1.0
    place, weight = (2, 1.0) if hold == "grip" else (3, 1.0 / reach(numbers))
    seen[0, place] = weight
    whole = np.block([[a, b], [seen, np.zeros((1, 1))]])
    unit = np.zeros_like(whole)
    unit[: len(a), : len(a)] = np.eye(len(a))
    found = eig(whole, unit, right=False)
    found = found[np.isfinite(found)]
    found = found[np.abs(found) < LARGEST_ZERO]
    return found[np.argsort(-found.real)]
