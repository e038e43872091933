"""What a swing must keep and what it should keep small, as rows over the unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cholesky

from ..model import planar, shaft
from ..model.energies import mass_matrix, stiffness_matrix
from ..model.robot import Robot
from .profile import QUANTITIES, UNITS
from .solve_grid import Grid, Maps, Motors
from .solve_quadratic import Bounds
from .task import SwingTask

RING = 1e-7
"""Energy left at the end that weighs as much as the jerk limit, as a share of the clubhead's at
impact [-]."""

FOLLOWED = np.radians(1.0)
"""Distance from the golfer that weighs as much as the jerk limit [rad]."""

NEAR_IMPACT, ELSEWHERE = 0.1, 0.02
"""How long around impact the golfer counts in full [s], and how much elsewhere [-]."""

EVERY = 2
"""Of so many marks one is summed over for the vibration [-]."""

FIRST = 20
"""Of so many rows of a limit one is looked at from the beginning; others when they are broken."""

MOST_MARGIN = 0.25
"""Largest share of a limit that is left to rounding [-]."""


@dataclass(frozen=True)
class Family:
    """One limit at many instants, in units of itself: ``-1 <= slope c + level <= 1``.

    Attributes:
        axis: arm, wrist or shaft.
        quantity: angle, velocity, acceleration, jerk, torque or deflection.
        unit: of the limit.
        times: of the rows, shape (m,) [s].
        slope: shape (m, unknowns) [1].
        level: shape (m,) [1].
        middle: of what is allowed [unit].
        half: half width of what is allowed, margins off, shape (m,) [unit].
    """

    axis: str
    quantity: str
    unit: str
    times: np.ndarray
    slope: np.ndarray
    level: np.ndarray
    middle: float
    half: np.ndarray


def reach(numbers: Mapping[str, float]) -> float:
    """Wrist pivot to clubhead [m]."""
    return float(planar.points_of(numbers).head)


def swing_rows(numbers: Mapping[str, float], x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Clubhead against that of a rigid club on the drives [m], or its rate.

    Args:
        numbers: of the robot [SI].
        x: coordinates or their rates along the last axis but one where a last one holds
            derivatives, shape (4, ...) [SI].
        z: arm and wrist, shape (2, ...) [rad].
    """
    return reach(numbers) * (x[0] - z[0] - z[1]) + x[3]


def bend_rows(numbers: Mapping[str, float], x: np.ndarray, flat: bool) -> np.ndarray:
    """Bend of the shaft at the head [m] of coordinates of shape (4, ...), or of the linear robot's.

    Args:
        numbers: of the robot [SI].
        x: coordinates [SI].
        flat: whether the robot is the linear one, whose grip hardly tilts.
    """
    return _bent(numbers, x, flat).bend


def jerk_cost(task: SwingTask, grid: Grid) -> np.ndarray:
    """Rows whose squares sum to the mean squared jerk of both axes, in shares of its limit [-]."""
    gram = grid.basis.T @ grid.basis * (grid.step / grid.points[-1])
    half = np.sqrt(task.cost.jerk) * cholesky(gram)
    none = np.zeros_like(half)
    return np.block([[half, none], [none, half]])


def vibration_cost(
    task: SwingTask,
    scenarios: Sequence[Mapping[str, float]],
    grid: Grid,
    maps: Maps,
    drive: Motors,
    ring: float = RING,
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and aim: the clubhead's mean squared velocity against a rigid club's, and the ring.

    Velocity counts in shares of the clubhead's speed at impact; the energy left at the end in
    shares of `ring` times the clubhead's kinetic energy then.

    Args:
        task: tells the weight.
        scenarios: numbers of the robots [SI].
        grid: the clock.
        maps: states of every scenario.
        drive: the motors' motion.
        ring: see `RING` [-].

    Returns:
        Rows, shape (r, unknowns), and aim, shape (r,) [sqrt cost].
    """
    kept = slice(0, len(grid.marks), EVERY)
    marks = grid.marks[kept]
    share = np.gradient(marks) / grid.points[-1]
    speed, weight = task.impact.clubhead_speed, task.cost.vibration / len(scenarios)
    rows, aims = [], []
    for index, numbers in enumerate(scenarios):
        scale = np.sqrt(weight * share) / speed
        slope, level = maps.slope[index], maps.level[index]
        turned = np.moveaxis(drive.slope[kept, :, 1], 1, 0)
        moved = swing_rows(numbers, np.moveaxis(slope[kept, 4:], 1, 0), turned)
        begun = swing_rows(numbers, level[kept, 4:].T, drive.level[kept, :, 1].T)
        rows.append(scale[:, None] * moved)
        aims.append(-scale * begun)
        factor = ring_factor(numbers) * np.sqrt(
            weight / (ring * 0.5 * numbers["clubhead_mass"] * speed**2)
        )
        end, first = slope[-1].copy(), level[-1].copy()
        end[0] -= drive.slope[-1, :, 0].sum(axis=0)
        first[0] -= drive.level[-1, :, 0].sum()
        rows.append(factor @ end)
        aims.append(-factor @ first)
    return np.concatenate(rows), np.concatenate(aims)


def ring_factor(numbers: Mapping[str, float]) -> np.ndarray:
    """Matrix whose product with (displacements from rest, rates) has the energy as square [J]."""
    robot = Robot("pinned_wrist", tuple(numbers))
    rows = robot.rows(numbers, np)
    found = np.zeros((8, 8))
    found[:4, :4] = cholesky(0.5 * stiffness_matrix(rows)[:4, :4])
    found[4:, 4:] = cholesky(0.5 * mass_matrix(rows)[:4, :4])
    return found


def golfer_cost(
    task: SwingTask, grid: Grid, drive: Motors, golfer: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and aim: the motors' distance from the golfer's motion, most near impact.

    Args:
        task: tells the weight.
        grid: the clock.
        drive: the motors' motion.
        golfer: arm and wrist angle at the marks, shape (marks, 2) [rad].

    Returns:
        Rows and aim [sqrt cost].
    """
    after = (grid.marks - grid.marks[grid.impact]) / NEAR_IMPACT
    weight = task.cost.golfer * (ELSEWHERE + (1 - ELSEWHERE) * np.exp(-0.5 * after**2))
    scale = np.sqrt(weight * np.gradient(grid.marks) / grid.points[-1]) / FOLLOWED
    rows = [scale[:, None] * drive.slope[:, axis, 0] for axis in (0, 1)]
    aims = [scale * (golfer[:, axis] - drive.level[:, axis, 0]) for axis in (0, 1)]
    return np.concatenate(rows), np.concatenate(aims)


def rest_equations(task: SwingTask, drive: Motors) -> tuple[np.ndarray, np.ndarray]:
    """Rows and sides, in shares of the limits [-]: the motors stand still at the end."""
    if not task.at_rest:
        return np.zeros((0, drive.slope.shape[-1])), np.zeros(0)
    rows, sides = [], []
    for axis, name in ((0, "arm"), (1, "wrist")):
        for order in (1, 2):
            scale = getattr(task.limits, name).jerk
            rows.append(drive.slope[-1, axis, order] / scale)
            sides.append(-drive.level[-1, axis, order] / scale)
    return np.stack(rows), np.array(sides)


@dataclass(frozen=True)
class Reading:
    """What is seen at impact less what must hold, and its slopes.

    Attributes:
        names: speed, chord, grip, arm or wrist.
        values: shape (k,) [m/s or rad].
        by_state: shape (k, 8) [SI].
        by_motor: by angle and velocity of arm and wrist, shape (k, 2, 2) [SI].
    """

    names: tuple[str, ...]
    values: np.ndarray
    by_state: np.ndarray
    by_motor: np.ndarray


def impact_of(
    numbers: Mapping[str, float], x: Any, angles: Any, rates: Any, flat: bool, xp: Any = np
) -> dict[str, Any]:
    """Speed of the clubhead, angles of chord and grip in the plane, and the motors' angles.

    Args:
        numbers: of the robot [SI].
        x: state, 8 numbers [SI].
        angles: of arm and wrist [rad].
        rates: of these [rad/s].
        flat: whether the robot is the linear one, whose shaft shortens to second order.
        xp: what knows ``sin``, ``cos``, ``sqrt`` and ``arctan``.

    Returns:
        ``speed`` [m/s]; ``chord``, ``grip``, ``arm`` and ``wrist`` [rad].

    Source: the kinematics of `supple.model.planar.kinetic_energy`.
    """
    q, v, bent = x[:4], x[4:], _bent(numbers, x, flat)
    along, across = planar.clubhead_velocity(numbers, q, v, angles, rates, xp, bent)
    near = planar.points_of(numbers).grip + bent.along
    return {
        "speed": xp.sqrt(along * along + across * across),
        "chord": q[0] + xp.arctan(q[3] / near),
        "grip": q[0] + q[2],
        "arm": angles[0],
        "wrist": angles[1],
    }


def _bent(numbers: Mapping[str, float], q: Any, flat: bool) -> shaft.Head:
    if not flat:
        return planar.head_of(numbers, q)
    return shaft.near_head(planar.points_of(numbers).lever, q[3] - q[1], q[2])


HELD = {"chord": ("chord",), "grip": ("grip",), "both": ("chord", "grip"), "drive": ("wrist",)}
"""What is at ``arm_angle + wrist_angle``, by `Impact.hold`; of the wrist: at ``wrist_angle``."""


def wanted(task: SwingTask) -> dict[str, float]:
    """What must be read at impact, by the names of `impact_of` [m/s or rad]."""
    at = task.impact
    found = {"arm": at.arm_angle, "speed": at.clubhead_speed}
    for name in HELD[at.hold]:
        found[name] = at.wrist_angle if name == "wrist" else at.arm_angle + at.wrist_angle
    return found


def reading(
    task: SwingTask, numbers: Mapping[str, float], x: np.ndarray, z: np.ndarray, flat: bool
) -> Reading:
    """What is seen at impact, with slopes by complex steps, exact to the last digit.

    Args:
        task: tells what must hold.
        numbers: of the robot [SI].
        x: state at impact, shape (8,) [SI].
        z: the motors' motion there, shape (2, 4) [SI].
        flat: as for `impact_of`.
    """
    given = np.concatenate([x, z[:, 0], z[:, 1]])
    columns = np.tile(given.astype(complex)[:, None], (1, 12)) + 1e-30j * np.eye(12)
    seen = impact_of(numbers, columns[:8], columns[8:10], columns[10:12], flat)
    goal = wanted(task)
    bent = _bent(numbers, x, flat)
    across = planar.clubhead_velocity(numbers, x[:4], x[4:], z[:, 0], z[:, 1], np, bent)[1]
    seen["speed"] = seen["speed"] if across >= 0 else -seen["speed"]  # away from the ball
    values = np.stack([seen[name] for name in goal])
    slopes = np.imag(values) / 1e-30
    left = np.real(values)[:, 0] - np.array(list(goal.values()))
    by_motor = np.stack([slopes[:, 8:10], slopes[:, 10:12]], axis=-1)
    return Reading(tuple(goal), left, slopes[:, :8], by_motor)


def motor_families(task: SwingTask, grid: Grid, drive: Motors) -> list[Family]:
    """Limits of angle, velocity, acceleration and jerk [SI], less margins for rounding.

    Between points an angle leaves its chord by less than ``a h^2 / 8``, a velocity by less than
    ``j h^2 / 8``. A rounding of q/2 moves a spline's derivatives by at most 3, 12 and 24 times
    that over h, its square and its cube.
    """
    found = []
    step, half_quantum = grid.step, 0.5 * np.radians(task.quantum)
    rounding = [half_quantum * k / step**n for n, k in enumerate((2.0, 3.0, 12.0, 24.0))]
    for axis, name in ((0, "arm"), (1, "wrist")):
        limits = getattr(task.limits, name)
        for order, quantity in enumerate(QUANTITIES):
            middle, half = limits.most(quantity)
            if not np.isfinite(half):
                continue
            between = 0.0
            if order < 2 and np.isfinite(getattr(limits, QUANTITIES[order + 2])):
                between = getattr(limits, QUANTITIES[order + 2]) * step**2 / 8
            margin = min(between + rounding[order], MOST_MARGIN * half)
            at = grid.at_points[:-1] if order == 3 else grid.at_points
            inner = np.full(len(at), half - margin)
            slope = drive.slope[at, axis, order]
            level = drive.level[at, axis, order] - middle
            times = grid.marks[at] + (0.5 * step if order == 3 else 0.0)
            found.append(
                Family(
                    name, quantity, UNITS[order], times, slope / inner[:, None], level / inner,
                    middle, inner,
                )
            )  # fmt: skip
    return found


def shaft_families(
    task: SwingTask,
    scenarios: Sequence[Mapping[str, float]],
    grid: Grid,
    maps: Maps,
    states: np.ndarray,
    flat: bool,
) -> list[Family]:
    """Limits of the shaft's bend before and after impact [m], about a motion.

    Args:
        task: tells the limits.
        scenarios: numbers of the robots [SI].
        grid: the clock.
        maps: states of every scenario.
        states: of the motion about which the bend is linear, shape (scenarios, marks, 8) [SI].
        flat: see `bend_rows`.
    """
    before, after = task.shaft.deflection_before, task.shaft.deflection_after
    half = np.where(np.arange(len(grid.marks)) <= grid.impact, before, after)
    kept, found = np.flatnonzero(np.isfinite(half)), []
    for index, numbers in enumerate(scenarios):
        slope, level = maps.slope[index][kept, :4], maps.level[index][kept, :4]
        if len(kept):
            own, at = half[kept], states[index, kept, :4]
            tilted = at.T[:, None] + 1e-30j * np.eye(4)[:, :, None]
            bent = bend_rows(numbers, tilted, flat)  # by complex steps, one coordinate each
            by = np.imag(bent) / 1e-30
            # where the states are not yet those of the maps, the rows lead from the maps' own
            start = np.einsum("ik,ki->k", by, level)
            if not flat:
                start = start + np.real(bent[0]) - np.einsum("ik,ki->k", by, at)
            found.append(
                Family(
                    "shaft", "deflection", "m", grid.marks[kept],
                    np.einsum("ik,kin->kn", by, slope) / own[:, None], start / own, 0.0, own,
                )
            )  # fmt: skip
    return found


def looked_at(families: Sequence[Family], extra: Sequence[set[int]]) -> Bounds:
    """The rows of all limits that are looked at.

    Args:
        families: the limits.
        extra: rows of each beside every `FIRST`.

    Returns:
        Their bounds [1].
    """
    rows, low, high = [], [], []
    for family, more in zip(families, extra, strict=True):
        at = row_numbers(family, more)
        rows.append(family.slope[at])
        low.append(-1.0 - family.level[at])
        high.append(1.0 - family.level[at])
    return Bounds(np.concatenate(rows), np.concatenate(low), np.concatenate(high))


def row_numbers(family: Family, more: set[int]) -> np.ndarray:
    """Which rows of a limit are looked at, shape (k,) [-]."""
    return np.array(sorted({*range(0, len(family.times), FIRST), len(family.times) - 1, *more}))


def broken(families: Sequence[Family], c: np.ndarray, allowed: float) -> list[set[int]]:
    """Rows of each limit that some unknowns break by more than `allowed` [-]."""
    found = []
    for family in families:
        used = np.abs(family.slope @ c + family.level)
        found.append(set(np.flatnonzero(used > 1.0 + allowed).tolist()))
    return found
