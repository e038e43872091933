"""Modes of the planar robot's club in a steady rotation, and how they change with its speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import linear_sum_assignment

from . import planar
from .robot import INCLINATION, Robot
from .shaft import LARGEST_BEND

STRIDE = 1.0
"""Longest change of speed over which a mode is followed at once [rad/s]."""

RAMPS, NEWTON_STEPS = 8, 12
"""Steps in which the centrifugal load is raised, and Newton steps in each [-]."""

BALANCED = 1e-9
"""Force left over in a balance, as a share of the forces in it [-]; one in which the shaft bends
by more than its length is none."""

LOST = 0.5
"""Likeness of shapes below which a mode was lost on the way [-]."""

GROWING = 1e-9
"""Growth that counts as such, as a share of the fastest pole's size; less is rounding [-]."""


@dataclass(frozen=True)
class RotatingModes:
    """Modes of small motion about a steady rotation.

    Attributes:
        speed: of the arm and all it carries [rad/s].
        poles: complex poles, one of each pair, slowest oscillation first [1/s].
        frequencies: ``|pole| / (2 pi)`` [Hz].
        damped_frequencies: ``imag(pole) / (2 pi)``; 0 for overdamped modes [Hz].
        damping_ratios: ``-real(pole) / |pole|``; negative where a motion grows [-].
        shapes: displacement part of each mode's vector in the turning axes, shape (coordinates,
            modes) [m or rad, to a common factor].
        equilibrium: steady `planar.COORDINATES` about which it moves, with the arm at 0, shape
            (4,) [rad, m, rad, m].
        mass: shape (n, n) [kg, kg m or kg m^2].
        damping: dampers and what rotation adds, shape (n, n) [N s/m, N s or N m s].
        stiffness: springs, tension and what rotation adds, shape (n, n) [N/m, N or N m].
        is_balanced: whether the steady bent club was found; otherwise the modes are about the
            straight club, whose steady load is left out.
    """

    speed: float
    poles: np.ndarray
    frequencies: np.ndarray
    damped_frequencies: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray
    equilibrium: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    is_balanced: bool

    @property
    def is_stable(self) -> bool:
        """Whether no mode grows."""
        return not np.any(_grows(self.poles))


@dataclass(frozen=True)
class Campbell:
    """Each mode's frequency and damping against the speed of rotation.

    A mode is followed by its pole. Of an oscillation that parts into two overdamped motions the
    less stable one is told; two such motions that join to one share its frequency.

    Attributes:
        speeds: shape (s,) [rad/s].
        poles: shape (s, modes), slowest oscillation at the first speed first [1/s].
        frequencies: shape (s, modes) [Hz].
        damped_frequencies: without sign, shape (s, modes) [Hz].
        damping_ratios: shape (s, modes) [-].
        shapes: in the turning axes, each of unit length, shape (s, coordinates, modes) [m or rad,
            to a common factor].
        likeness: least assurance criterion (MAC) of a mode's shape with its next on the way to
            each speed, shape (s, modes); 1 at the first [-].
        is_balanced: whether the steady bent club was found, shape (s,) [-].
        bend: largest bend of the shaft in the steady rotation [m].
        most_bend: up to which the shaft is good [m].
    """

    speeds: np.ndarray
    poles: np.ndarray
    frequencies: np.ndarray
    damped_frequencies: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray
    likeness: np.ndarray
    is_balanced: np.ndarray
    bend: float
    most_bend: float

    @property
    def unstable_from(self) -> tuple[float | None, ...]:
        """Lowest of the speeds at which each mode grows [rad/s]; None for one that never does."""
        grows = np.stack([_grows(poles) for poles in self.poles])
        order = np.argsort(self.speeds, kind="stable")
        first = [order[column[order]] for column in grows.T]
        return tuple(float(self.speeds[at[0]]) if len(at) else None for at in first)

    @property
    def status(self) -> str:
        """``stable`` or ``unstable``."""
        return "stable" if all(at is None for at in self.unstable_from) else "unstable"

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        low, high = float(np.min(self.speeds)), float(np.max(self.speeds))
        told = [
            f"Mode {number} is unstable from {at:.6g} rad/s on, of the speeds looked at."
            for number, at in enumerate(self.unstable_from, 1)
            if at is not None
        ] or [f"Every mode is stable at all speeds from {low:.6g} to {high:.6g} rad/s."]
        if not np.all(self.is_balanced):
            at = float(np.min(self.speeds[~self.is_balanced]))
            told.append(
                f"From {at:.6g} rad/s on no steady bent club was found: modes of the straight one."
            )
        lost = [str(number) for number, m in enumerate(self.likeness.min(axis=0), 1) if m < LOST]
        if lost:
            told.append(f"Lost from sight on the way: mode {', '.join(lost)}.")
        if self.bend > self.most_bend:
            told.append(
                f"The steady shaft bends by {self.bend:.2f} m: beyond {self.most_bend:.2f} m, "
                f"{LARGEST_BEND:g} of its length, its force is no longer good."
            )
        return " ".join(told)


def modes_at(
    robot: Robot, numbers: Mapping[str, float], speed: float, wrist_angle: float = 0.0
) -> RotatingModes:
    """Modes of the club while the arm turns at a constant speed in its plane.

    The arm carries the wrist's pivot round the shoulder whatever the model; the model says what
    holds the collet: the arm itself (``fixed_collet``), nothing, or the wrist's spring. The
    equations are linearised about the steady bent club, where load and springs balance; with
    `wrist_angle` 0 this is the straight one. Where no such balance is found, they are linearised
    about the straight club at `wrist_angle`, and `RotatingModes.is_balanced` says so. Weight is
    left out, because under it no rotation is steady; the arm's own angle then does not matter.

    Args:
        robot: any of the six models.
        numbers: its numbers by name [SI].
        speed: of the arm [rad/s].
        wrist_angle: of the wrist's drive, or of a fixed collet, against the arm [rad].

    Returns:
        Modes, and the matrices that they are of.

    Raises:
        ValueError: for numbers that are missing or not finite, or a wrist angle that nothing
            holds.

    Source: jax derivatives of `planar.inertia_forces` and the springs, in axes that turn with the
    arm; centrifugal stiffening comes of the shaft's shortening, Kane, Ryan and Banerjee 1987,
    doi:10.2514/3.20195; tests/model/test_campbell.py.
    """
    return _modes(robot, _table(robot, numbers, wrist_angle), speed, wrist_angle)[0]


def campbell(
    robot: Robot,
    numbers: Mapping[str, float],
    speeds: Sequence[float] | np.ndarray,
    wrist_angle: float = 0.0,
) -> Campbell:
    """Frequency and damping of every mode against the speed of rotation.

    Args:
        robot: any of the six models.
        numbers: its numbers by name [SI].
        speeds: of the arm, in the order in which the modes are followed, from the first on, in
            strides of at most `STRIDE` [rad/s].
        wrist_angle: as in `modes_at` [rad].

    Returns:
        The diagram; its sentence says where a mode becomes unstable.

    Raises:
        ValueError: for no speeds; otherwise as `modes_at`.

    Source: modal assurance criterion with the mass as weight, Allemang 2003, times the likeness
    of the poles; tests/model/test_campbell.py.
    """
    told = np.array(speeds, dtype=float)
    if told.ndim != 1 or not len(told):
        raise ValueError(
            f"speeds: expected at least one in a row, found shape {told.shape}. "
            "Mend: list the speeds in rad/s."
        )
    p = _table(robot, numbers, wrist_angle)
    found, poles, vectors = _modes(robot, p, float(told[0]), wrist_angle)
    count = len(found.poles)
    kept, likeness = [(found, poles, vectors)], [np.ones(len(poles))]
    for before, after in pairwise(told):
        least = np.ones(len(poles))
        parts = max(1, int(np.ceil(abs(after - before) / STRIDE)))
        for speed in np.linspace(before, after, parts + 1)[1:]:
            found, new, moved = _modes(robot, p, float(speed), wrist_angle)
            order, alike = _followed(found.mass, (poles, vectors), (new, moved))
            poles, vectors, least = new[order], moved[:, order], np.minimum(least, alike)
        kept.append((found, poles, vectors))
        likeness.append(least)
    partner = _partners(kept[0][1], count)
    chosen = [np.where(_worse(all_[partner], all_[:count]), partner, np.arange(count))
              for _, all_, _ in kept]  # fmt: skip
    path = np.stack([each[1][at] for each, at in zip(kept, chosen, strict=True)])
    least = np.stack(likeness)
    size, ratio = _size_and_ratio(path)
    bend = [abs(float(planar.bend(p, each[0].equilibrium))) for each in kept]
    return Campbell(
        told, path, size / (2 * np.pi), np.abs(np.imag(path)) / (2 * np.pi), ratio,
        np.stack([each[2][:, at] for each, at in zip(kept, chosen, strict=True)]),
        np.minimum(least[:, :count], least[:, partner]),
        np.array([each[0].is_balanced for each in kept]),
        max(bend), planar.most_bend(p),
    )  # fmt: skip


def _partners(poles: np.ndarray, count: int) -> np.ndarray:
    """Of each of the first poles the other of its pair, or itself."""
    return np.argmin(np.abs(poles[:count, None].conj() - poles), axis=1)


def _worse(poles: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Which poles are less stable than others, by more than rounding."""
    return np.real(poles) > np.real(others) + GROWING * np.maximum(np.abs(poles), np.abs(others))


def _table(robot: Robot, numbers: Mapping[str, float], wrist_angle: float) -> dict[str, float]:
    """The robot's numbers, with a spring of no stiffness at a wrist that has none."""
    missing = [name for name in robot.names if name not in numbers]
    if missing:
        raise ValueError(
            f"numbers: expected every number of the robot, found none for '{missing[0]}'. "
            "Mend: add it."
        )
    table = {name: float(numbers[name]) for name in robot.names if name != INCLINATION}
    wild = [name for name, value in table.items() if not np.isfinite(value)]
    if wild:
        raise ValueError(
            f"numbers: expected finite ones, found {wild[0]} = {table[wild[0]]}. Mend: correct it."
        )
    if robot.model == "driven_collet":
        if wrist_angle:
            raise ValueError(
                "wrist_angle: expected 0 for a collet that no spring holds, found "
                f"{wrist_angle:g}. Mend: write 0, or a model with a wrist."
            )
        table |= {"wrist_stiffness": 0.0, "wrist_damping": 0.0}
    return table


def _modes(
    robot: Robot, p: dict[str, float], speed: float, wrist_angle: float
) -> tuple[RotatingModes, np.ndarray, np.ndarray]:
    """Modes, then all poles, those of `RotatingModes.poles` first, with unit shapes."""
    if not np.isfinite([speed, wrist_angle]).all():
        raise ValueError(
            f"speed, wrist_angle: expected finite ones, found {speed} and {wrist_angle}. "
            "Mend: give them in rad/s and rad."
        )
    fixed = robot.model == "fixed_collet"
    solved = _linearised(fixed, p, float(speed), float(wrist_angle))
    q, mass, damping, stiffness, balanced = (np.asarray(part) for part in solved)
    n = len(mass)
    bend = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
    poles, vectors = np.linalg.eig(np.vstack([np.eye(n, 2 * n, k=n), bend]))
    order = np.lexsort((np.abs(poles), np.imag(poles) == 0, np.imag(poles) < 0))
    poles, vectors = poles[order].astype(complex), vectors[:n, order]
    vectors = vectors / np.linalg.norm(vectors, axis=0)
    count = int(np.count_nonzero(np.imag(poles) >= 0))
    own = poles[:count]
    size, ratio = _size_and_ratio(own)
    found = RotatingModes(
        float(speed), own, size / (2 * np.pi), np.imag(own) / (2 * np.pi), ratio,
        vectors[:, :count], q, mass, damping, stiffness, bool(balanced),
    )  # fmt: skip
    return found, poles, vectors


@partial(jax.jit, static_argnums=0)
def _linearised(
    fixed: bool, p: dict[str, Any], speed: Any, wrist_angle: Any
) -> tuple[jax.Array, ...]:
    """Steady coordinates, mass, damping, stiffness, and whether the coordinates balance."""
    straight = jnp.zeros(4).at[0].set(wrist_angle)
    n = 3 if fixed else 4

    def forces(x: Any, v: Any, a: Any, turn: Any) -> Any:
        front, none = straight[:1], jnp.zeros(1)
        q = jnp.concatenate([front, x]) if fixed else x
        v = jnp.concatenate([none, v]) if fixed else v
        a = jnp.concatenate([none, a]) if fixed else a
        return _forces(p, q, v.at[0].add(turn), a, turn, (not fixed, wrist_angle))[4 - n :]

    def pull(x: Any, turn: Any) -> Any:
        return forces(x, jnp.zeros(n), jnp.zeros(n), turn)

    def improve(step: Any, x: Any) -> Any:
        turn = speed * jnp.sqrt((step // NEWTON_STEPS + 1) / RAMPS)
        left = pull(x, turn)
        move = jnp.linalg.solve(jax.jacfwd(pull)(x, turn), left)
        return x - jnp.where(jnp.any(left != 0.0), move, 0.0)

    start = straight[4 - n :]
    x = jax.lax.fori_loop(0, RAMPS * NEWTON_STEPS, improve, start)
    # the force that springs and load would have, each alone, for a measure of what is left over
    springs = jax.jacfwd(pull)(start, 0.0)
    size = jnp.abs(springs) @ jnp.abs(x - start) + jnp.abs(pull(start, speed))
    left = jnp.max(jnp.abs(pull(x, speed)))
    lever = planar.points_of(p).lever
    bend = jnp.abs(planar.bend(p, jnp.concatenate([straight[:1], x]) if fixed else x))
    balanced = (left <= BALANCED * jnp.max(size) + 1e-12) & (bend < lever)
    x = jnp.where(balanced, x, start)
    still = jnp.zeros(n)
    matrices = jax.jacfwd(forces, (0, 1, 2))(x, still, still, speed)
    q = jnp.concatenate([straight[:1], x]) if fixed else x
    return q, matrices[2], matrices[1], matrices[0], balanced


def _forces(
    p: Mapping[str, Any], q: Any, v: Any, a: Any, turn: Any, wrist: tuple[bool, Any]
) -> Any:
    """Inertia, springs and dampers, the arm at 0 and turning at a constant speed, shape (4,).

    `wrist` tells whether it has a spring, and its angle.
    """
    pivot = planar.pivot_acceleration(p, (0.0, turn, 0.0), 0.0, jnp)
    axes = jnp.cos(q[0]), jnp.sin(q[0])
    bent = planar.head_of(p, q)
    total = list(planar.inertia_forces(p, q, v, a, pivot, axes, bent))
    for one in planar.springs(p, q, v, (0.0, wrist[1]), (turn, 0.0), wrist[0], bent):
        total = one.added(total, one.force)
    return jnp.stack(total)


def _followed(
    mass: np.ndarray, old: tuple[np.ndarray, np.ndarray], new: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Which new pole continues each old one, and the likeness (MAC) of their shapes."""
    weight = np.linalg.cholesky(mass).T
    was, now = (
        (part / np.linalg.norm(part, axis=0)) for part in (weight @ old[1], weight @ new[1])
    )
    alike = np.minimum(np.abs(was.conj().T @ now) ** 2, 1.0)
    apart = np.abs(old[0][:, None] - new[0])
    total = np.abs(old[0])[:, None] + np.abs(new[0])
    far = apart / np.where(total > 0, total, 1.0)
    _, order = linear_sum_assignment(2.0 - alike + far)
    return order, alike[np.arange(len(order)), order]


def _size_and_ratio(poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    size = np.abs(poles)
    return size, np.where(size > 0, -np.real(poles) / np.where(size > 0, size, 1.0), 0.0)


def _grows(poles: np.ndarray) -> np.ndarray:
    return np.real(poles) > GROWING * np.max(np.abs(poles))
