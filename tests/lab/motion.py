"""Motion of a machine: switching between linear regimes at located events, or LSODA where curved.

Friction, play and two-slope springs are piecewise linear: between two switches the machine is
linear, is stepped without error, and each switch is located to 1e-7 of a sample. Friction is set
valued: while it sticks, the stretch does not move at all. Smooth laws go to LSODA.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import odeint
from scipy.linalg import expm
from scipy.optimize import fsolve

from .bodies import Element, Machine

LEVELS = 24  # a sample interval is cut into 2**LEVELS at the finest
COARSE = 1 << (LEVELS - 1)  # ordinary step: half a sample
SMOOTH = ("cubic_stiffness", "quadratic_damping", "gravity")
SWITCHING = ("coulomb_friction", "clearance", "asymmetric_stiffness")


@dataclass(frozen=True)
class Law:
    """What an element carries beside its spring and dashpot; `size` is of one element.

    cubic_stiffness: size * d^3. quadratic_damping: size * |v| v. gravity: size * (sin d - d).
    asymmetric_stiffness: size * |d|. coulomb_friction: at most size, against the motion.
    clearance: the spring carries k * (|d| - size) beyond the play `size`, nothing inside.
    """

    kind: str
    element: int
    size: float


@dataclass(frozen=True)
class Motion:
    """Absolute positions, velocities and accelerations of the bodies, one row a sample."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def simulate(
    machine: Machine,
    laws: tuple[Law, ...],
    start: np.ndarray,
    loads: np.ndarray,
    rate: float,
) -> Motion:
    """Motion from `start` (positions, velocities) under `loads` (samples x bodies), linear between.

    Raises:
        ValueError: if smooth and switching laws are mixed.
    """
    if not laws:
        return _linear(machine, start, loads, rate)
    if all(law.kind in SMOOTH for law in laws):
        return _curved(machine, laws, start, loads, rate)
    if all(law.kind in SWITCHING for law in laws):
        return _switched(machine, laws, start, loads, rate)
    raise ValueError(f"cannot mix smooth and switching laws: {[law.kind for law in laws]}")


def hold_and_release(machine: Machine, laws: tuple[Law, ...], body: int, at: float) -> np.ndarray:
    """State in which a hand holds `body` at the deflection `at` and all else has come to rest."""
    guess = machine.hang(body, at)
    others = [index for index in range(len(guess)) if index != body]
    elastic = [law for law in laws if law.kind not in ("coulomb_friction", "quadratic_damping")]
    scale = np.abs(guess[others])

    def unbalance(scaled: np.ndarray) -> np.ndarray:
        position = guess.copy()
        position[others] = scaled * scale
        force = machine.forces(position, 0 * position)
        for law in elastic:
            item = machine.elements[law.element]
            force -= (
                item.count * _carried(law, item, float(item.stretch(position)), 0.0) * item.ends
            )
        return force[others] * scale

    position = guess.copy()
    if others and elastic:
        found, _, status, _ = fsolve(unbalance, guess[others] / scale, full_output=True)
        if status == 1:
            position[others] = found * scale
    return np.concatenate([position, 0 * position])


def _carried(law: Law, item: Element, stretch: float, rate: float) -> float:
    """What a law adds to the force of one of its elements; friction is not asked here."""
    if law.kind == "cubic_stiffness":
        return law.size * stretch**3
    if law.kind == "quadratic_damping":
        return law.size * abs(rate) * rate
    if law.kind == "gravity":
        return law.size * (np.sin(stretch) - stretch)
    if law.kind == "asymmetric_stiffness":
        return law.size * abs(stretch)
    return -item.stiffness * min(max(stretch, -law.size), law.size)


def _linear(machine: Machine, start: np.ndarray, loads: np.ndarray, rate: float) -> Motion:
    size = len(machine.bodies)
    full = np.zeros((4 * size, 4 * size))  # state, load, slope of the load over one step
    full[: 2 * size, : 2 * size] = machine.state_matrix() / rate
    full[size : 2 * size, 2 * size : 3 * size] = np.diag(1 / machine.inertia) / rate
    full[2 * size : 3 * size, 3 * size :] = np.eye(size)
    step = expm(full)[: 2 * size]
    free = np.ascontiguousarray(step[:, : 2 * size])
    push = (
        loads[:-1] @ step[:, 2 * size : 3 * size].T + np.diff(loads, axis=0) @ step[:, 3 * size :].T
    )
    states = np.empty((len(loads), 2 * size))
    states[0] = state = np.asarray(start, float)
    quiet = not np.any(push)
    for index in range(len(loads) - 1):
        state = free @ state if quiet else free @ state + push[index]
        states[index + 1] = state
    rates = states @ machine.state_matrix()[size:].T + loads / machine.inertia
    return Motion(states[:, :size], states[:, size:], rates)


def _curved(
    machine: Machine, laws: tuple[Law, ...], start: np.ndarray, loads: np.ndarray, rate: float
) -> Motion:
    size = len(machine.bodies)
    matrix = machine.state_matrix()
    reference = _linear(machine, start, loads, rate)
    scale = np.concatenate(
        [np.abs(reference.position).max(axis=0), np.abs(reference.velocity).max(axis=0)]
    )
    pulls = []
    for law in laws:
        item = machine.elements[law.element]
        share = np.concatenate([np.zeros(size), item.count * item.ends / machine.inertia])
        pulls.append((law, item, share))
    last = len(loads) - 2
    pushes = loads / machine.inertia
    slopes = np.diff(pushes, axis=0)
    driven = bool(np.any(loads))

    def rates(state: np.ndarray, time: float) -> np.ndarray:
        change = matrix @ state
        for law, item, share in pulls:
            stretch, speed = item.ends @ state[:size], item.ends @ state[size:]
            change -= share * _carried(law, item, float(stretch), float(speed))
        if driven:
            place = time * rate
            index = min(int(place), last)
            change[size:] += pushes[index] + (place - index) * slopes[index]
        return change

    times = np.arange(len(loads)) / rate
    tolerance = 1e-9 * np.maximum(scale, 1e-6 * scale.max())
    longest = 1 / rate if driven else 0.0  # a blow must not be stepped over
    states, told = odeint(
        rates,
        start,
        times,
        rtol=1e-9,
        atol=tolerance,
        hmax=longest,
        mxstep=100000,
        full_output=True,
    )
    if told["message"] != "Integration successful.":
        raise RuntimeError(f"LSODA gave up: {told['message']}")
    acceleration = np.array(
        [rates(state, time)[size:] for state, time in zip(states, times, strict=True)]
    )
    return Motion(states[:, :size], states[:, size:], acceleration)


class _Regime:
    """The machine while every switching law stays in one mode; z = (state, load, slope, 1)."""

    def __init__(
        self, machine: Machine, laws: tuple[Law, ...], modes: tuple[int, ...], rate: float
    ) -> None:
        size = len(machine.bodies)
        self.size, self.rate, width = size, rate, 4 * size + 1
        accel = np.zeros((size, width))
        accel[:, : 2 * size] = machine.state_matrix()[size:]
        accel[:, 2 * size : 3 * size] = np.diag(1 / machine.inertia)
        held, rows = [], {}
        for number, (law, mode) in enumerate(zip(laws, modes, strict=True)):
            item = machine.elements[law.element]
            stretch = np.concatenate([item.ends, np.zeros(width - size)])
            share = (item.count * item.ends / machine.inertia)[:, None]
            one = np.eye(width)[-1]
            if law.kind == "coulomb_friction":
                if mode == 0:
                    held.append((number, item))
                else:
                    accel -= share * (mode * law.size * one)
                    rows[number, 0] = mode * np.roll(stretch, size)
            elif law.kind == "clearance":
                if mode == 0:
                    accel += share * (item.stiffness * stretch)
                    rows[number, 1] = law.size * one - stretch
                    rows[number, -1] = law.size * one + stretch
                else:
                    accel += share * (mode * item.stiffness * law.size * one)
                    rows[number, 0] = mode * stretch - law.size * one
            else:
                accel -= share * (mode * law.size * stretch)
                rows[number, -mode] = mode * stretch
        self.grip = {}
        if held:
            ends = np.array([item.ends for _, item in held])
            mobility = ends @ np.diag(1 / machine.inertia) @ ends.T
            needed = np.linalg.solve(mobility, ends @ accel)
            accel = accel - (ends / machine.inertia).T @ needed
            self.hold = (ends / machine.inertia).T @ np.linalg.solve(mobility, ends)
            one = np.eye(width)[-1]
            for (number, item), row in zip(held, needed, strict=True):
                self.grip[number] = row / item.count
                rows[number, 1] = laws[number].size * one - row / item.count
                rows[number, -1] = laws[number].size * one + row / item.count
        self.accel = accel
        self.moves = list(rows)
        self.guards = np.array([rows[move] for move in self.moves])
        self.full = np.zeros((width, width))
        self.full[:size, size : 2 * size] = np.eye(size)
        self.full[size : 2 * size] = accel
        self.full[2 * size : 3 * size, 3 * size : 4 * size] = np.eye(size)
        self.steps: dict[int, np.ndarray] = {}

    def step(self, ticks: int) -> np.ndarray:
        """Exact propagator over `ticks` of the finest time."""
        if ticks not in self.steps:
            self.steps[ticks] = expm(self.full * (ticks / (1 << LEVELS) / self.rate))
        return self.steps[ticks]

    def broken(self, z: np.ndarray) -> list[tuple[int, int]]:
        """The guards that `z` violates beyond rounding, as (law, mode to go to)."""
        values = self.guards @ z
        if values.min() >= 0:
            return []
        limits = -1e-13 * (np.abs(self.guards) @ np.abs(z))
        return [self.moves[index] for index in np.flatnonzero(values < limits)]

    def settle(self, z: np.ndarray) -> None:
        """Takes out of the velocities what is left along the stretches that stick."""
        if self.grip:
            velocity = z[self.size : 2 * self.size]
            velocity -= self.hold @ velocity


def _switched(
    machine: Machine, laws: tuple[Law, ...], start: np.ndarray, loads: np.ndarray, rate: float
) -> Motion:
    size, samples = len(machine.bodies), len(loads)
    regimes: dict[tuple[int, ...], _Regime] = {}

    def regime(modes: tuple[int, ...]) -> _Regime:
        if modes not in regimes:
            regimes[modes] = _Regime(machine, laws, modes, rate)
        return regimes[modes]

    slopes = np.diff(loads, axis=0, append=loads[-1:]) * rate
    z = np.concatenate([start, loads[0], slopes[0], [1.0]]).astype(float)
    modes = _first_modes(machine, laws, z, regime)
    states = np.empty((samples, 2 * size))
    rates = np.empty((samples, size))
    switches = 0
    for index in range(samples):
        z[2 * size : 3 * size], z[3 * size : 4 * size] = loads[index], slopes[index]
        now = regime(modes)
        states[index], rates[index] = z[: 2 * size], now.accel @ z
        if index == samples - 1:
            break
        left, cap = 1 << LEVELS, COARSE
        while left:
            ticks = min(cap, 1 << (left.bit_length() - 1))
            ahead = now.step(ticks) @ z
            broken = now.broken(ahead)
            if broken and ticks > 1:
                cap = ticks // 2
                continue
            z, left = ahead, left - ticks
            if broken:
                switches += 1
                if switches > 100 * samples:
                    raise RuntimeError("the laws switch without end")
                modes = _switch(laws, modes, broken, z, regime)
                now, cap = regime(modes), COARSE
                now.settle(z)
    return Motion(states[:, :size], states[:, size:], rates)


def _switch(laws, modes, broken, z, regime) -> tuple[int, ...]:
    """Modes after the broken guards; a friction that came to rest sticks if it can hold."""
    for number, target in broken:
        kept = list(modes)
        kept[number] = target
        modes = tuple(kept)
        if laws[number].kind == "coulomb_friction" and target == 0:
            trial = regime(modes)
            trial.settle(z)
            needed = trial.grip[number] @ z
            if abs(needed) > laws[number].size:
                kept[number] = 1 if needed > 0 else -1
                modes = tuple(kept)
    return modes


def _first_modes(machine: Machine, laws, z, regime) -> tuple[int, ...]:
    size, modes = len(machine.bodies), []
    for law in laws:
        item = machine.elements[law.element]
        stretch, speed = item.ends @ z[:size], item.ends @ z[size : 2 * size]
        if law.kind == "coulomb_friction":
            modes.append(int(np.sign(speed)))
        elif law.kind == "clearance":
            modes.append(int(np.sign(stretch)) if abs(stretch) > law.size else 0)
        else:
            modes.append(1 if stretch >= 0 else -1)
    for _ in laws:  # the most overloaded stick lets go first
        trial = regime(tuple(modes))
        excess = {n: abs(row @ z) - laws[n].size for n, row in trial.grip.items()}
        worst = max(excess, key=lambda number: excess[number], default=None)
        if worst is None or excess[worst] <= 0:
            break
        modes[worst] = 1 if trial.grip[worst] @ z > 0 else -1
    return tuple(modes)
