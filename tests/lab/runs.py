"""Draws and runs the tests of a club: decays, blows and a driven wrist, with what may be hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .causes import Hidden
from .clubs import REACH, Club
from .gauges import shown
from .march import Loads, Moved, Start, exact, held_start, march
from .structure import Structure

SUBSTEPS = 4
QUIET = {"decay": 0.010, "impact": 0.020, "driven": 0.0}
"""What passes after a release or a blow before a test counts for the detectability [s]."""


@dataclass(frozen=True)
class Run:
    """One test of a club; `loads` at fine steps from sample `first` on, before that it is held."""

    name: str
    kind: str  # decay | impact | driven
    split: str
    amplitude: float
    loads: Loads
    first: int = 0
    hold: float = 0.0  # a hand holds the head here [m]
    told_force: bool = False
    told_at: bool = False
    phase: float = 0.0  # of the mains


def carry_out(
    club: Club,
    test: Run,
    hidden: Sequence[Hidden] = (),
    changes: dict[str, float] | None = None,
) -> tuple[Structure, Moved]:
    """The structure as it is with what is hidden, and its motion at all samples."""
    structure, loads = club.structure(changes), test.loads
    for cause in hidden:
        if cause.reshape is not None:
            structure = cause.reshape(structure)
    for cause in hidden:
        if cause.drive is not None:
            loads = cause.drive(loads, club.rate * SUBSTEPS)
    laws = tuple(carry for cause in hidden for carry in cause.carries)
    start = _start(structure, test, laws)
    moved = march(structure, laws, start, loads, club.rate, SUBSTEPS)
    return structure, _with_hold(moved, test.first)


def run_linear(club: Club, test: Run, structure: Structure, late: float = 0.0) -> Moved:
    """The same without anything hidden, exact at the samples; the drive `late` [s] if asked."""
    loads = test.loads
    if late:
        times = np.arange(len(loads.angle)) / (club.rate * SUBSTEPS)
        angle, rate = (np.interp(times - late, times, x) for x in (loads.angle, loads.rate))
        loads = replace(loads, angle=angle, rate=rate)
    moved = exact(structure, _start(structure, test, ()), loads, club.rate, SUBSTEPS)
    return _with_hold(moved, test.first)


def _start(structure: Structure, test: Run, laws) -> Start:
    if test.hold:
        return held_start(structure, laws, "clubhead", test.hold)
    rest = np.zeros(structure.size)
    return Start(rest, rest)


def _with_hold(moved: Moved, first: int) -> Moved:
    if not first:
        return moved

    def before(rows: np.ndarray, still: bool) -> np.ndarray:
        return np.concatenate([np.repeat(rows[:1] * still, first, axis=0), rows])

    return Moved(
        before(moved.position, True),
        before(moved.velocity, False),
        before(moved.acceleration, False),
        before(moved.angle, True),
        before(moved.rate, False),
    )


def channels(
    club: Club, test: Run, structure: Structure, moved: Moved, hidden: Sequence[Hidden] = ()
) -> dict[str, np.ndarray]:
    """Every channel without noise [SI], each on its own clock."""
    faults = tuple(fault for cause in hidden for fault in cause.faults)
    commanded = test.loads.every(SUBSTEPS).angle
    told = replace(moved, angle=np.concatenate([np.zeros(test.first), commanded]))
    found = {}
    for gauge in club.gauges:
        if gauge.role == "input" and test.kind != "driven":
            continue
        read = told if gauge.role == "input" else moved
        found[gauge.name] = shown(gauge, structure, read, club.rate, faults, test.phase)
    return found


def draw_runs(club: Club, rng: np.random.Generator, train: int, held_out: int) -> list[Run]:
    """Tests of different amplitude and kind; those held out are of another amplitude or kind."""
    driven = club.model == "driven_wrist"  # its first record always is one
    kinds = ["driven", "decay", "impact"] if driven else ["decay", "impact"]
    turn = 0 if driven else int(rng.integers(2))
    sizes = [1.0, 0.4, 0.7, 0.55, 0.85, 0.47]
    tests = []
    for index in range(train + held_out):
        split = "train" if index < train else "held_out"
        kind = kinds[(turn + index) % len(kinds)] if index < train else str(rng.choice(kinds))
        share = sizes[index % 6] if index < train else float(rng.uniform(0.5, 0.9))
        number = index + 1 if index < train else index + 1 - train
        share *= float(rng.uniform(0.92, 1.0))
        drawn = draw_run(club, kind, share, rng)
        tests.append(replace(drawn, name=f"{split}_{number:02d}_{kind}", split=split))
    return tests


def made_again(tests: Sequence[Run], words: str, rng: np.random.Generator) -> Run:
    """One more test to learn from, NAME:FACTOR: like one of them, so many times as far or hard.

    Raises:
        ValueError: for words of another form, a test that there is not, or no positive factor.
    """
    name, _, number = words.partition(":")
    like = next((test for test in tests if test.name == name), None)
    try:
        factor = float(number)
    except ValueError:
        factor = 0.0
    if like is None or not 0.0 < factor < np.inf:
        known = ", ".join(test.name for test in tests)
        raise ValueError(f"again {words!r}: expected NAME:FACTOR, NAME one of {known}")
    loads = Loads(factor * like.loads.force, factor * like.loads.angle, factor * like.loads.rate)
    count = sum(test.split == "train" for test in tests) + 1
    return replace(
        like,
        name=f"train_{count:02d}_{like.kind}",
        split="train",
        amplitude=factor * like.amplitude,
        hold=factor * like.hold,
        loads=loads,
        phase=float(rng.uniform(0, 2 * np.pi)),
    )


def draw_run(club: Club, kind: str, share: float, rng: np.random.Generator) -> Run:
    """A test whose largest motion is `share` of the usual."""
    phase = float(rng.uniform(0, 2 * np.pi))
    if kind == "decay":
        first = int(rng.uniform(0.03, 0.08) * club.count)
        loads = Loads.none((club.count - first - 1) * SUBSTEPS + 1)
        hold = share * REACH
        return Run("", kind, "train", hold, loads, first, hold, told_at=True, phase=phase)
    fine = (club.count - 1) * SUBSTEPS + 1
    if kind == "impact":
        return _blow(club, share, fine, phase, rng)
    reach = 0.10 * share
    angle, rate = _turns(fine, club.rate * SUBSTEPS, rng)
    loads = Loads(np.zeros(fine), reach * angle, reach * rate)
    return Run("", kind, "train", reach, loads, phase=phase)


def _blow(club: Club, share: float, fine: int, phase: float, rng: np.random.Generator) -> Run:
    """A half sine on the head; recorded and soft, or unrecorded and over in a millisecond."""
    told = bool(rng.random() < 0.5)
    first = int(rng.uniform(0.03, 0.06) * club.count)
    width = SUBSTEPS * (12 if told else 2)
    force = np.zeros(fine)
    at = first * SUBSTEPS
    force[at : at + width + 1] = -np.sin(np.pi * np.arange(width + 1) / width)
    structure = club.structure()
    still = Start(np.zeros(structure.size), np.zeros(structure.size))
    loads = Loads(force, np.zeros(fine), np.zeros(fine))
    swung = march(structure, (), still, loads, club.rate, SUBSTEPS)
    reach = float(np.abs(swung.position @ structure.points["clubhead"]).max())
    size = 0.7 * REACH * share
    loads = replace(loads, force=force * size / reach)
    return Run("", "impact", "train", size, loads, told_force=told, told_at=not told, phase=phase)


def _turns(fine: int, rate: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """An angle of unit size with its rate: tones of 0.4 to 6 Hz, or a sweep, after a still lead."""
    times = np.arange(fine) / rate
    lead, end = 0.1, times[-1]
    inside = np.clip((times - lead) / 0.4, 0, 1) * np.clip((end - times) / 0.2, 0, 1)
    window = 0.5 - 0.5 * np.cos(np.pi * inside)
    if rng.random() < 0.6:
        tones, phases = rng.uniform(0.4, 6.0, 8), rng.uniform(0, 2 * np.pi, 8)
        wave = np.sin(2 * np.pi * np.outer(times, tones) + phases) @ (1 / np.sqrt(tones))
    else:
        low, high = rng.uniform(0.4, 1.0), rng.uniform(4.0, 7.0)
        wave = np.sin(2 * np.pi * (low * times + (high - low) * times**2 / (2 * end)))
    angle = window * wave
    angle = angle / np.abs(angle).max()
    return angle, np.gradient(angle, 1 / rate)


def counts_from(test: Run, rate: float) -> float:
    """Time from which a test counts [s]: after the hand, the blow, and a moment more."""
    begun = test.first / rate
    if test.kind == "impact":
        begun = (int(np.flatnonzero(test.loads.force)[-1]) // SUBSTEPS + 1) / rate
    return begun + QUIET[test.kind]
