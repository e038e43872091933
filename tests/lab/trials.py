"""Draws and runs the tests of a plant: decays, blows and driven records, and what sensors show."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .bodies import Machine
from .drives import SHAPES, blow, draw_drive
from .motion import Law, Motion, hold_and_release, simulate
from .plants import Plant

REFINED = 16  # a delayed sensor is read on a clock so many times finer


@dataclass(frozen=True)
class Trial:
    """One test: `loads` on the bodies, or a start; at rest or held until sample `first`."""

    name: str
    test: str  # decay | impact | driven
    amplitude: float
    loads: np.ndarray
    start: np.ndarray  # positions and velocities at `first`; unused where a hand holds
    first: int = 0
    release: bool = False  # a hand holds the head at `amplitude` until `first`
    told_force: bool = False  # the load on the head is a channel of the record
    told_at: bool = False
    split: str = "train"


def run_trial(
    plant: Plant,
    trial: Trial,
    machine: Machine,
    laws: tuple[Law, ...] = (),
    delay: int = 0,
) -> Motion:
    """The motion at all samples; `delay` in 16ths of a sample makes it late (from rest only)."""
    start = trial.start
    if trial.release:
        start = hold_and_release(machine, laws, machine.body(plant.head), trial.amplitude)
    loads = trial.loads[trial.first :]
    if delay:
        loads = _refine(loads)
        moved = simulate(machine, laws, start, loads, plant.rate * REFINED)
        return _late(moved, delay)
    moved = simulate(machine, laws, start, loads, plant.rate)
    if not trial.first:
        return moved
    size = len(machine.bodies)
    before = np.tile(start[:size], (trial.first, 1))
    rest = np.zeros_like(before)
    return Motion(
        np.vstack([before, moved.position]),
        np.vstack([rest, moved.velocity]),
        np.vstack([rest, moved.acceleration]),
    )


def _refine(loads: np.ndarray) -> np.ndarray:
    coarse = np.arange(len(loads))
    fine = np.arange(REFINED * (len(loads) - 1) + 1) / REFINED
    return np.column_stack([np.interp(fine, coarse, column) for column in loads.T])


def _late(motion: Motion, delay: int) -> Motion:
    def shift(rows: np.ndarray) -> np.ndarray:
        late = np.vstack([np.tile(rows[0], (delay, 1)), rows])[: len(rows)]
        return late[::REFINED]

    return Motion(shift(motion.position), shift(motion.velocity), shift(motion.acceleration))


def draw_trials(
    plant: Plant, rng: np.random.Generator, train: int, held_out: int, from_rest: bool = False
) -> list[Trial]:
    """Tests of different amplitude and kind; `from_rest` allows only recorded forces."""
    kinds = ["decay", "impact"] if plant.kind == "robot" else ["decay", "driven", "impact"]
    if from_rest:
        kinds = [kind for kind in kinds if kind != "decay"]
    turn = int(rng.integers(len(kinds)))
    sizes = [1.0, 0.35, 0.65, 0.5, 0.8, 0.42]
    trials = []
    for index in range(train + held_out):
        split = "train" if index < train else "held_out"
        name = f"{split}_{index + 1 if split == 'train' else index + 1 - train:02d}"
        kind = kinds[(turn + index) % len(kinds)] if index < train else str(rng.choice(kinds))
        share = sizes[index % 6] if index < train else rng.uniform(0.55, 0.95)
        amplitude = plant.amplitude * share * rng.uniform(0.9, 1.0)
        drawn = _draw_trial(plant, kind, float(amplitude), rng, recorded=from_rest)
        trials.append(replace(drawn, name=name, split=split))
    return trials


def _draw_trial(
    plant: Plant, kind: str, amplitude: float, rng: np.random.Generator, recorded: bool
) -> Trial:
    if kind == "decay":
        release = plant.kind == "robot" or rng.random() < 0.6
        first = int(rng.uniform(0.03, 0.1) * plant.count) if rng.random() < 0.4 else 0
        return decay(plant, amplitude, release, first if release else 0)
    if kind == "impact":
        first = int(rng.uniform(0.02, 0.08) * plant.count)
        told = recorded or plant.kind == "chain" or rng.random() < 0.6
        return impact(plant, amplitude, first, told)
    tones, _ = plant.machine().modes()
    band = (0.4 * tones[0], 1.3 * tones[-1])
    force = draw_drive(str(rng.choice(SHAPES)), plant.count, plant.rate, band, rng)
    return _scaled(plant, "driven", amplitude, force, 0, True)


def decay(plant: Plant, amplitude: float, release: bool = True, first: int = 0) -> Trial:
    """Released from a hand at `amplitude`, or thrown so as to reach about that far."""
    machine = plant.machine()
    size, head = len(machine.bodies), machine.body(plant.head)
    start = np.zeros(2 * size)
    if release:
        start[:size] = machine.hang(head, amplitude)
    else:
        start[size + head] = amplitude * 2 * np.pi * machine.modes()[0][0]
    loads = np.zeros((plant.count, size))
    return Trial("", "decay", amplitude, loads, start, first, release=release, told_at=first > 0)


def impact(plant: Plant, amplitude: float, first: int, told_force: bool) -> Trial:
    """A blow on the head: recorded and soft, or unrecorded and over after two samples."""
    tones, _ = plant.machine().modes()
    top = min(tones[-1], 30.0) if plant.kind == "robot" else tones[-1]
    width = max(4, round(0.25 * plant.rate / top)) if told_force else 2
    width = min(width, 12) if plant.kind == "robot" else width
    force = -blow(plant.count, first, width)
    return _scaled(plant, "impact", amplitude, force, first, told_force)


def _scaled(
    plant: Plant, test: str, amplitude: float, force: np.ndarray, first: int, told: bool
) -> Trial:
    """The test whose force moves the head by `amplitude` at most, were the plant linear."""
    machine = plant.machine()
    size, head = len(machine.bodies), machine.body(plant.head)
    loads = np.zeros((plant.count, size))
    loads[:, head] = force
    start = np.zeros(2 * size)
    reach = np.abs(simulate(machine, (), start, loads, plant.rate).position[:, head]).max()
    told_at = test == "impact" and not told
    return Trial(
        "",
        test,
        amplitude,
        loads * amplitude / reach,
        start,
        0 if told else first,
        told_force=told,
        told_at=told_at,
    )
