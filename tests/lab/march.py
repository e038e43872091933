"""Motion of a structure: generalized-alpha steps with Newton; exact where it is linear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from .carries import REST, Carry, blank
from .structure import Structure

SPECTRAL_RADIUS = 0.9
"""What is left of the fastest motions after a step: 1 is the average acceleration of Newmark."""

MOST_ITERATIONS = 60
CLOSE = 1e-11


@dataclass(frozen=True)
class Loads:
    """What acts from outside at each fine step: force on the head [N], angle of the drive [rad]."""

    force: np.ndarray
    angle: np.ndarray
    rate: np.ndarray

    @classmethod
    def none(cls, count: int) -> Loads:
        """Nothing, at `count` times."""
        return cls(np.zeros(count), np.zeros(count), np.zeros(count))

    def every(self, substeps: int) -> Loads:
        """The loads at every so many times."""
        return Loads(self.force[::substeps], self.angle[::substeps], self.rate[::substeps])


@dataclass(frozen=True)
class Start:
    """A state with the memories of its laws."""

    position: np.ndarray
    velocity: np.ndarray
    memories: tuple[np.ndarray, ...] = ()


@dataclass(frozen=True)
class Moved:
    """Positions, velocities and accelerations, one row a sample, and the drive's angle there."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    angle: np.ndarray
    rate: np.ndarray

    def orders(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The three of them by order of derivative."""
        return self.position, self.velocity, self.acceleration


@dataclass
class _Stations:
    """All stations with laws, stacked."""

    structure: Structure
    laws: Sequence[Carry]
    slices: list[slice] = field(default_factory=list)

    def __post_init__(self) -> None:
        places = [self.structure.places[law.place] for law in self.laws]
        size = self.structure.size
        self.rows = np.vstack([np.zeros((0, size)), *(item.rows for item in places)])
        self.count = np.concatenate([np.zeros(0), *(item.count for item in places)])
        self.follow = np.concatenate([np.zeros(0), *(item.follow for item in places)])
        ends = np.cumsum([0, *(len(item.rows) for item in places)])
        self.slices = [slice(a, b) for a, b in pairwise(ends)]

    def reply(self, d, v, memories, time: float, step: float):
        parts = [
            law.reply(d[mine], v[mine], memory, time, step)
            for law, mine, memory in zip(self.laws, self.slices, memories, strict=True)
        ]
        if len(parts) == 1:
            force, by_d, by_v, memory = parts[0]
            return force, by_d, by_v, (memory,)
        force, by_d, by_v = (np.concatenate([part[i] for part in parts]) for i in range(3))
        return force, by_d, by_v, tuple(part[3] for part in parts)


def held_start(structure: Structure, laws: Sequence[Carry], point: str, at: float) -> Start:
    """At rest while a hand holds `point` at `at`, moved there in steps from where nothing pulls."""
    own = _Stations(structure, laws)
    memories = tuple(blank(law) for law in laws)
    shape = structure.held(point, 1.0)
    if not laws:
        return Start(shape * at, 0 * shape, ())
    row = structure.points[point]
    soft = np.linalg.solve(structure.stiffness, (own.rows * own.count[:, None]).T)
    lean = soft - np.outer(shape, row @ soft)  # by forces at the stations, the point held
    force = np.zeros(len(own.rows))
    zero = 0 * force
    for share in np.linspace(0.05, 1.0, 20):
        base = own.rows @ shape * (at * share)
        force, found = _newton(own, base, zero, own.rows @ lean, 0.0, force, memories, 0.0, REST)
        memories = found
    return Start(shape * at - lean @ force, 0 * shape, memories)


def _newton(own, base_d, base_v, by_d, by_v, force, memories, time, step):
    """Forces g with g = law(base_d - by_d g, base_v - by_v g); by_d, by_v per unit force."""
    eye, worst, start = np.eye(len(force)), np.inf, force
    told, after, size = force, memories, np.inf
    for turn in range(MOST_ITERATIONS):
        d = base_d - by_d @ force
        v = base_v if step == REST else base_v - by_v @ force
        told, slope_d, slope_v, after = own.reply(d, v, memories, time, step)
        gap = told - force
        size = float(np.abs(gap).max())
        if size <= CLOSE * (1.0 + float(np.abs(force).max())):
            return told, after
        if size > 0.9 * worst and turn > 8:
            gap = gap * 0.5  # corners can make Newton jump to and fro
        worst = size
        matrix = eye + slope_d[:, None] * by_d
        if step != REST:
            matrix = matrix + slope_v[:, None] * by_v
        force = force + (gap / matrix[0, 0] if len(force) == 1 else np.linalg.solve(matrix, gap))
    if size <= 1e-6 * (1.0 + float(np.abs(force).max())):
        return told, after
    found = _damped(own, base_d, base_v, by_d, by_v, start, memories, time, step)
    if found is not None:
        return found
    raise RuntimeError(f"Newton did not close: {size:g} left of {np.abs(force).max():g}")


def _damped(own, base_d, base_v, by_d, by_v, force, memories, time, step):
    """As `_newton`, each step as short as it takes to come nearer; None where none does.

    Slower; where many stations stand at their laws' corners whole steps go round in circles.
    """
    still = step == REST

    def ask(force):
        v = base_v if still else base_v - by_v @ force
        told, *slopes, after = own.reply(base_d - by_d @ force, v, memories, time, step)
        return told, slopes, after

    told, slopes, after = ask(force)
    for _ in range(10 * MOST_ITERATIONS):
        gap = told - force
        if float(np.abs(gap).max()) <= 1e-6 * (1.0 + float(np.abs(force).max())):
            return told, after
        matrix = np.eye(len(force)) + slopes[0][:, None] * by_d
        if not still:
            matrix = matrix + slopes[1][:, None] * by_v
        way, length = np.linalg.solve(matrix, gap), 1.0
        while length > 1e-6:
            found = ask(force + length * way)
            if np.linalg.norm(found[0] - force - length * way) < np.linalg.norm(gap):
                break
            length *= 0.5
        else:
            return None
        force, (told, slopes, after) = force + length * way, found
    return None


def march(
    structure: Structure,
    laws: Sequence[Carry],
    start: Start,
    loads: Loads,
    rate: float,
    substeps: int = 4,
    radius: float = SPECTRAL_RADIUS,
) -> Moved:
    """Motion at every `substeps`-th of the fine times, by generalized-alpha (Chung and Hulbert).

    Args:
        structure: linear part.
        laws: what its springs carry beside.
        start: state at the first time.
        loads: at the fine times, (samples - 1) * substeps + 1 of them.
        rate: samples a second [Hz].
        substeps: fine steps a sample.
        radius: of the fastest motions after a step [1]; 1 keeps all energy.
    """
    own, size, h = _Stations(structure, laws), structure.size, 1 / (rate * substeps)
    am, af = (2 * radius - 1) / (radius + 1), radius / (radius + 1)
    gamma, beta = 0.5 - am + af, 0.25 * (1 - am + af) ** 2
    m, c, k = structure.mass, structure.damping, structure.stiffness
    solve = np.linalg.inv((1 - am) * m + (1 - af) * (gamma * h * c + beta * h * h * k))
    by_angle, by_rate = structure.drive_rows
    outside = np.stack([structure.points["clubhead"], by_angle, by_rate], axis=1)
    one, none = np.eye(size), np.zeros((size, size))
    ahead_q = np.hstack([one, h * one, h * h * (0.5 - beta) * one])
    ahead_v = np.hstack([none, one, h * (1 - gamma) * one])
    past_q, past_v, past_a = np.vsplit(np.eye(3 * size), 3)
    own_pull = own.rows.T * own.count
    accel = -solve @ (
        am * m @ past_a
        + c @ ((1 - af) * ahead_v + af * past_v)
        + k @ ((1 - af) * ahead_q + af * past_q)
    )
    whole = np.hstack([accel, solve @ outside, -af * solve @ own_pull])
    push = (1 - af) * solve @ own_pull
    by_d, by_v = beta * h * h * own.rows @ push, gamma * h * own.rows @ push
    told = np.stack([loads.force, loads.angle, loads.rate], axis=1)
    mixed = (1 - af) * told[1:] + af * told[:-1]
    ease = np.linalg.inv(m)
    force, memories = _first_force(own, start, loads, h)
    z = np.concatenate([start.position, start.velocity, np.zeros(size + 3), force])
    q, v, a, f, g = np.split(z, np.cumsum([size, size, size, 3]))  # views of z
    a[:] = ease @ (outside @ told[0] - own_pull @ force - c @ v - k @ q)
    samples = (len(told) - 1) // substeps + 1
    states, forces = np.empty((samples, 2 * size)), np.zeros((samples, len(g)))
    states[0], forces[0] = z[: 2 * size], g
    for index in range(1, len(told)):
        f[:] = mixed[index - 1]
        new = whole @ z
        q += h * v + (h * h * (0.5 - beta)) * a + (h * h * beta) * new
        v += (h * (1 - gamma)) * a + (h * gamma) * new
        if len(g):
            base_d = own.rows @ q - own.follow * told[index, 1]
            base_v = own.rows @ v - own.follow * told[index, 2]
            force, memories = _newton(own, base_d, base_v, by_d, by_v, g, memories, index * h, h)
            g[:] = force
            kick = push @ force
            q -= (beta * h * h) * kick
            v -= (gamma * h) * kick
            new -= kick
        a[:] = new
        if index % substeps == 0:
            states[index // substeps], forces[index // substeps] = z[: 2 * size], g
    return _moved(states, forces, own_pull, outside, told[::substeps], structure, ease)


def _first_force(own: _Stations, start: Start, loads: Loads, h: float):
    memories = start.memories or tuple(blank(law) for law in own.laws)
    if not own.laws:
        return np.zeros(0), ()
    d = own.rows @ start.position - own.follow * loads.angle[0]
    v = own.rows @ start.velocity - own.follow * loads.rate[0]
    force, _, _, memories = own.reply(d, v, memories, 0.0, 1e-9 * h)
    return force, memories


def _moved(states, forces, own_pull, outside, told, structure: Structure, ease) -> Moved:
    """Accelerations from the equation of motion: the scheme's own belong to shifted times."""
    size = structure.size
    q, v = states[:, :size], states[:, size : 2 * size]
    pull = told @ outside.T - forces @ own_pull.T
    a = (pull - v @ structure.damping - q @ structure.stiffness) @ ease
    return Moved(q, v, a, told[:, 1], told[:, 2])


def exact(
    structure: Structure, start: Start, loads: Loads, rate: float, substeps: int = 1
) -> Moved:
    """Motion of the linear structure without error of time, at every so many times of the loads.

    They are straight between their times: a blow may last less than a sample, so that seen at
    samples alone it would have another momentum.

    Args:
        structure: the linear structure.
        start: its state at the first time.
        loads: at `substeps` times a sample, the last of them at a sample.
        rate: of the samples [Hz].
        substeps: times of the loads from sample to sample.

    Returns:
        The motion at the samples.
    """
    size, samples = structure.size, (len(loads.force) - 1) // substeps + 1
    by_angle, by_rate = structure.drive_rows
    outside = np.stack([structure.points["clubhead"], by_angle, by_rate], axis=1)
    matrix = structure.state_matrix()
    state = np.concatenate([start.position, start.velocity])
    told = np.stack([loads.force, loads.angle, loads.rate], axis=1)
    if np.any(told):
        fine = rate * substeps
        wide = np.zeros((2 * size + 6, 2 * size + 6))
        wide[: 2 * size, : 2 * size] = matrix / fine
        wide[size : 2 * size, 2 * size : 2 * size + 3] = np.linalg.solve(
            structure.mass, outside / fine
        )
        wide[2 * size : 2 * size + 3, 2 * size + 3 :] = np.eye(3)
        whole = expm(wide)[: 2 * size]
        free = np.ascontiguousarray(whole[:, : 2 * size])
        pushes = told[:-1] @ whole[:, 2 * size : 2 * size + 3].T
        pushes = pushes + np.diff(told, axis=0) @ whole[:, 2 * size + 3 :].T
        push, power = np.zeros((samples - 1, 2 * size)), np.eye(2 * size)
        for step in reversed(range(substeps)):  # what comes last is carried on the least
            push = push + pushes[step::substeps] @ power.T
            power = power @ free
        states = np.empty((samples, 2 * size))
        states[0] = state
        for index in range(samples - 1):
            states[index + 1] = state = power @ state + push[index]
    else:
        states, power, done = state[None], expm(matrix / rate), 1
        while done < samples:  # twice as many with every turn
            states = np.vstack([states, states @ power.T])
            power, done = power @ power, 2 * done
        states = states[:samples]
    zeros = np.zeros((samples, 0))
    ease = np.linalg.inv(structure.mass)
    seen = told[::substeps]
    return _moved(states, zeros, np.zeros((size, 0)), outside, seen, structure, ease)
