"""A map of wrists with three scores, beside solve_ivp and diffrax on the same designs."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from ...model.drives import impact
from ...model.linear import Port, state_space
from ...model.robot import PRESETS, Robot
from ...optimize.sweep import Axis, SweepTask, sweep
from ...optimize.sweep_scores import largest_bins, log_decrement, peak, rms
from .peers import by_diffrax, by_scipy, has_diffrax, timed
from .responses import Row

GOALS = {"solve_ivp": 800.0, "diffrax": 100.0}
"""How many times less processor time than theirs a design is to need [-]."""

RATE, SECONDS, BLOW = 2048.0, 2.0, 0.005
FORCE = -1600.0
SIDE, ASIDE, BESIDE = 75, 8, 256
"""Designs along each axis; how many of them solve_ivp is given, and diffrax [-]."""

SCORES = ("rms", "log_decrement", "peak")
SETTINGS = ((1e-6, 1e-9), (1e-9, 1e-12))
SENSOR = Port("clubhead", "acceleration", "collet")
NUMBERS = PRESETS["robo_v_sleeve_50"]
ROBOT = Robot("pinned_wrist", tuple(NUMBERS))


def map_task() -> SweepTask:
    """The thesis's grid: 75 stiffnesses of the wrist by 75 dampings, after a blow to the head."""
    axes = (
        Axis("wrist_stiffness", 50.0 + 75.0 * np.arange(SIDE), "N m/rad"),
        Axis("wrist_damping", 2.0 + 2.0 * np.arange(SIDE), "N m s/rad"),
    )
    times, drive = np.arange(int(SECONDS * RATE)) / RATE, impact("clubhead", FORCE, 0.0, BLOW)
    return SweepTask(ROBOT, NUMBERS, drive, times, (BLOW, SECONDS), SENSOR, SCORES, axes)


@dataclass(frozen=True)
class _Free:
    """The free motions of some designs after the blow, as others see them."""

    a: np.ndarray  # (designs, 8, 8)
    row: np.ndarray  # (designs, 8)
    start: np.ndarray  # (designs, 8), at the first sample of the window
    times: np.ndarray  # of the window (t,) [s]


def map_rows() -> list[Row]:
    """Processor time of one design, ours first, and the largest error of a score [-]."""
    task = map_task()
    seconds, found = timed(lambda: sweep(task), 3)
    table = np.stack([found.scores[name].ravel() for name in SCORES], axis=1)
    few = np.linspace(0, task.count - 1, ASIDE).astype(int)
    best = _scipy(_free(task, few), (1e-11, 1e-14), "Radau")[0]
    rows = [Row("supple", _off(table[few], best), seconds / task.count)]
    for setting in SETTINGS:
        scores, each = _scipy(_free(task, few), setting, "LSODA")
        name = f"solve_ivp LSODA {setting[0]:g} / {setting[1]:g}"
        rows.append(Row(name, _off(scores, best), each, setting == SETTINGS[0]))
    if has_diffrax():
        many = np.linspace(0, task.count - 1, BESIDE).astype(int)
        for setting in SETTINGS:
            scores, each = _diffrax(_free(task, many), setting)
            name = f"diffrax Kvaerno5 {setting[0]:g} / {setting[1]:g}"
            rows.append(Row(name, _off(scores, table[many]), each, setting == SETTINGS[1]))
    return rows


def _free(task: SweepTask, designs: np.ndarray) -> _Free:
    """State matrices, and states where the window begins: exactly, as a gift to the others."""
    grid, parts = task.grid(), []
    times = task.times[grid.low : grid.high]
    for number in designs:
        own = {name: float(v[0]) for name, v in task.numbers_of(np.array([number])).items()}
        space = state_space(ROBOT, NUMBERS | own, (Port("clubhead", "force"),), (SENSOR,))
        a, b, c = (np.asarray(part) for part in (space.a, space.b[:, 0], space.c[0]))
        values, vectors = np.linalg.eig(a)
        push = np.linalg.solve(vectors, FORCE * b.astype(complex))
        state = push * np.expm1(values * BLOW) / values
        start = np.real(vectors @ (np.exp(values * (times[0] - BLOW)) * state))
        parts.append((a, c, start))
    a, row, start = (np.stack(part) for part in zip(*parts, strict=True))
    return _Free(a, row, start, times)


def _scored(samples: np.ndarray) -> np.ndarray:
    return np.stack([rms(samples), log_decrement(samples, largest_bins(samples)), peak(samples)], 1)


def _scipy(free: _Free, setting: tuple[float, float], method: str) -> tuple[np.ndarray, float]:
    scores, seconds = [], 0.0
    for a, row, start in zip(free.a, free.row, free.start, strict=True):
        states, spent = by_scipy(
            lambda t, y, a=a: a @ y, start, free.times, method, setting, lambda t, y, a=a: a
        )
        scores.append(_scored((states @ row)[None])[0])
        seconds += spent
    return np.array(scores), seconds / len(scores)


def _diffrax(free: _Free, setting: tuple[float, float]) -> tuple[np.ndarray, float]:
    """Solved without scores, which are ours: what is compared is the motion."""
    run = by_diffrax(lambda t, y, a: a @ y, free.start, free.times, jnp.asarray(free.a), setting)
    seconds, states = timed(run, 1)
    samples = np.einsum("dtn,dn->dt", np.asarray(states), free.row)
    order = np.argsort(largest_bins(samples), kind="stable")
    scores = np.empty((len(samples), 3))
    scores[order] = _scored(samples[order])
    return scores, seconds / len(samples)


def _off(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.nanmax(np.abs(found / truth - 1)))
