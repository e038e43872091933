"""The torque of the arm's and the wrist's motor, from the momentum of what they carry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..model import planar
from ..model.door import fault
from ..model.extended import acting_laws
from ..model.rig import Rig
from ..model.robot import INCLINATION
from .solve_grid import Maps
from .solve_problem import Problem
from .solve_program import MOST_MARGIN, Family
from .task import ShaftLimits

MARGIN, CURVED = 0.001, 250.0
"""Shares of a torque's limit that are left to what happens between the marks: of any step [-], and
over the square of the step [1/s^2]; the ball's blow rings in the torque."""

_TINY = 1e-30


def momentum(numbers: Mapping[str, float], x: Any, angles: Any, rates: Any, flat: bool) -> Any:
    """Momentum of collet, grip and clubhead, towards the ball and across, each (...) [kg m/s].

    Args:
        numbers: of the robot [SI].
        x: states along the first axis, shape (8, ...) [SI].
        angles: of arm and wrist, shape (2, ...) [rad].
        rates: of these [rad/s].
        flat: whether the robot is the linear one, which never leaves the line across.

    Source: the velocities of `supple.model.planar.kinetic_energy`.
    """
    at, q, v = planar.points_of(numbers), x[:4], x[4:]
    speed, turn = numbers["arm_length"] * rates[0], v[0]
    masses = tuple(numbers[f"{name}_mass"] for name in ("collet", "grip", "clubhead"))
    if flat:
        across = (turn * numbers["collet_centre"], turn * at.grip + v[1], turn * at.head + v[3])
        total = sum(m * (speed + one) for m, one in zip(masses, across, strict=True))
        return 0.0 * total, total
    tilt = q[0] - angles[0]
    along, across = speed * np.sin(tilt), speed * np.cos(tilt)
    head = planar.clubhead_velocity(numbers, q, v, angles, rates, np)
    first = masses[0] * along + masses[1] * (along - q[1] * turn) + masses[2] * head[0]
    second = masses[0] * (across + numbers["collet_centre"] * turn)
    second = second + masses[1] * (across + at.grip * turn + v[1]) + masses[2] * head[1]
    lean, fall = np.sin(q[0]), np.cos(q[0])
    return first * fall - second * lean, first * lean + second * fall


def wrist_torque(numbers: Mapping[str, float], x: Any, angles: Any, rates: Any) -> Any:
    """Torque of the wrist's motor on the collet, by its spring and damper, shape (...) [N m].

    Arguments as those of `momentum`.
    """
    turned, turning = angles[0] + angles[1] - x[0], rates[0] + rates[1] - x[4]
    return numbers["wrist_stiffness"] * turned + numbers["wrist_damping"] * turning


def arm_torque(
    numbers: Mapping[str, float],
    before: Sequence[Any],
    after: Sequence[Any],
    step: Any,
    force: Any,
    flat: bool,
) -> Any:
    """Mean torque of the arm's motor on what it carries over steps; the arm itself has no mass.

    Args:
        numbers: of the robot [SI].
        before: states (8, ...), angles and rates of arm and wrist (2, ...) at the steps' starts
            [SI].
        after: the same at their ends [SI].
        step: their lengths, shape (...) [s].
        force: of the ball, its mean over each step, shape (...) [N].
        flat: see `momentum`.

    Returns:
        Shape (...) [N m].
    """
    one, other = (momentum(numbers, x[0], x[1], x[2], flat) for x in (before, after))
    turned = 0.5 * (before[0][0] + after[0][0])
    arm = 0.5 * (before[1][0] + after[1][0])
    down, side = (other[0] - one[0]) / step, (other[1] - one[1]) / step
    if flat:
        pulled = side - force
    else:
        names = ("collet_mass", "grip_mass", "clubhead_mass")
        weight = planar.GRAVITY * np.sin(numbers.get(INCLINATION, 0.0))
        down = down - weight * sum(numbers[name] for name in names) + force * np.sin(turned)
        side = side - force * np.cos(turned)
        pulled = side * np.cos(arm) - down * np.sin(arm)
    torque = 0.5 * sum(wrist_torque(numbers, x[0], x[1], x[2]) for x in (before, after))
    return numbers["arm_length"] * pulled + torque


def torque_families(
    problem: Problem, maps: Maps, states: np.ndarray, c: np.ndarray, flat: bool
) -> list[Family]:
    """Limits of what the motors give [N m], about a motion.

    Args:
        problem: what is asked.
        maps: states of every scenario.
        states: of the motion about which they are linearized, shape (scenarios, marks, 8) [SI].
        c: its unknowns, shape (unknowns,) [limits of jerk].
        flat: see `momentum`.

    Returns:
        One family a motor with a limit and scenario.
    """
    shaft, found = problem.task.shaft, []
    for index, numbers in enumerate(problem.scenarios):
        if np.isfinite(shaft.arm_torque):
            motion = problem.drive.at(c)
            found.append(_arm_family(problem, maps, index, (states[index], motion, c), flat))
        if np.isfinite(shaft.wrist_torque):
            tables = maps.slope[index], maps.level[index]
            found.append(_wrist_family(problem, numbers, tables, problem.drive))
    return found


def _family(
    axis: str, times: np.ndarray, slope: np.ndarray, level: np.ndarray, most: float
) -> Family:
    step = float(np.max(np.diff(times)))
    half = np.full(len(times), most * (1.0 - MARGIN - min(CURVED * step**2, MOST_MARGIN)))
    return Family(axis, "torque", "N m", times, slope / half[:, None], level / half, 0.0, half)


def _wrist_family(
    problem: Problem,
    numbers: Mapping[str, float],
    states: tuple[np.ndarray, np.ndarray],
    drive: Any,
) -> Family:
    slope, level = (
        wrist_torque(numbers, np.moveaxis(table, 1, 0), *np.moveaxis(motor, (2, 1), (0, 1))[:2])
        for table, motor in zip(states, (drive.slope, drive.level), strict=True)
    )
    return _family("wrist", problem.grid.marks, slope, level, problem.task.shaft.wrist_torque)


def _arm_family(
    problem: Problem,
    maps: Maps,
    index: int,
    about: tuple[np.ndarray, np.ndarray, np.ndarray],
    flat: bool,
) -> Family:
    """Rows of the mean torque over every step, by complex steps in what it depends on."""
    grid, drive, (states, motion, c) = problem.grid, problem.drive, about
    force = problem.task.impact.force * grid.struck
    ends = np.concatenate([states, motion[:, :, 0], motion[:, :, 1]], axis=1)  # (marks, 12)
    given = np.concatenate([ends[:-1], ends[1:]], axis=1).T  # (24, steps)
    tilted = given[:, None].astype(complex) + 1j * _TINY * np.eye(24)[:, :, None]
    parts = [
        (one[:8], one[8:10], one[10:12]) for one in (tilted[:12], tilted[12:])
    ]  # each (k, 24, steps)
    numbers = problem.scenarios[index]
    seen = arm_torque(numbers, parts[0], parts[1], grid.lengths, force, flat)
    slopes, value = np.imag(seen) / _TINY, np.real(seen[0])
    by_ends = np.concatenate([maps.slope[index], drive.slope[:, :, 0], drive.slope[:, :, 1]], 1)
    rows = np.einsum("ik,kin->kn", slopes[:12], by_ends[:-1])
    rows += np.einsum("ik,kin->kn", slopes[12:], by_ends[1:])
    times = 0.5 * (grid.marks[1:] + grid.marks[:-1])
    # where the states are not yet those of the maps, the rows lead from the maps' own
    levels = np.concatenate([maps.level[index], drive.level[:, :, 0], drive.level[:, :, 1]], 1)
    missed = by_ends @ c + levels - ends
    value = value + np.einsum("ik,ki->k", slopes[:12], missed[:-1])
    value = value + np.einsum("ik,ki->k", slopes[12:], missed[1:])
    return _family("arm", times, rows, value - rows @ c, problem.task.shaft.arm_torque)


def check_torque(limits: ShaftLimits, rig: Rig) -> None:
    """Refuse a limit of torque where a law adds to the wrist's torque [N m].

    Raises:
        ValueError: one line with what, expected, found and mend.
    """
    if not np.isfinite([limits.arm_torque, limits.wrist_torque]).any() or not rig.laws:
        return
    from .solve_linear import robot_of

    for one in acting_laws(rig.laws, robot_of(rig)):
        if one.place == "wrist":
            expected = "no law at the wrist where [limits] bound a torque"
            mend = "remove the limit of torque, or the law"
            raise fault(rig.path, "[[laws]]", expected, f"'{one.law.name}'", mend)
