"""Responses of the robot by this package and by scipy's solve_ivp, timed and checked."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from ...model.drives import impact
from ...model.linear import Port, state_space
from ...model.motion import respond, respond_batch
from ...model.robot import PRESETS, Robot

SAMPLES, RATE, BATCH, ROUNDS = 4096, 2048.0, 512, 5
GOAL = 100
"""How many times faster one linear response should be than solve_ivp's [-]."""

HELP_GOAL = 0.4
"""How long `supple --help` may take [s]."""

FORCE, LENGTH = -1600.0, 0.005
FRICTION, RATE_WIDTH = 2.0, 0.05
SENSOR = Port("clubhead", "acceleration", "collet")
ROBOT = Robot("pinned_wrist")


@dataclass(frozen=True)
class Row:
    """One way to a response.

    Attributes:
        name: what computed it.
        error: largest deviation from the reference as a share of its largest sample [-].
        seconds: time of one response [s].
        matches: whether it is the setting that compares.
    """

    name: str
    error: float
    seconds: float
    matches: bool = False


@dataclass(frozen=True)
class _Equations:
    """The robot as scipy sees it: ``x' = A x + b u - g tanh(rate / width)``."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: float
    push: np.ndarray  # of a unit torque of the wrist's friction
    pushed: float  # and how the sensor feels it
    rate: np.ndarray


def _equations(design: dict[str, float]) -> _Equations:
    ports = (Port("clubhead", "force", held=True),)
    space = state_space(ROBOT, design, ports, (SENSOR,), ("wrist",))
    a, b, c, d = (np.asarray(part) for part in (space.a, space.b, space.c, space.d))
    return _Equations(a, b[:, 0], c[0], d[0, 0], b[:, 1], d[0, 1], np.asarray(space.rate)[0])


def _designs() -> dict[str, Any]:
    return PRESETS["robo_v"] | {"wrist_stiffness": np.linspace(50.0, 800.0, BATCH)}


def _reference(eq: _Equations) -> np.ndarray:
    """Samples by scipy's expm, sample by sample and cut where the pulse ends."""

    def over(length: float) -> np.ndarray:
        block = np.zeros((9, 9))
        block[:8, :8], block[:8, 8] = eq.a, eq.b
        return expm(block * length)

    step, found = 1.0 / RATE, np.zeros(SAMPLES)
    whole, last = over(step), int(LENGTH * RATE)
    x = np.append(np.zeros(8), FORCE)
    for index in range(SAMPLES):
        found[index] = eq.c @ x[:8] + eq.d * x[8]
        if index == last:
            x = over(LENGTH - last * step) @ x
            x[8] = 0.0
            x = over((last + 1) * step - LENGTH) @ x
        else:
            x = whole @ x
    return found


def _scipy(eq: _Equations, friction: float, method: str, rtol: float, atol: float) -> np.ndarray:
    """Samples by solve_ivp, cut where the pulse ends, with the exact Jacobian."""
    times, found, x = np.arange(SAMPLES) / RATE, np.zeros(SAMPLES), np.zeros(8)
    for begin, end, force in ((0.0, LENGTH, FORCE), (LENGTH, times[-1], 0.0)):
        push = eq.b * force

        def slope(_: float, x: np.ndarray, push: np.ndarray = push) -> np.ndarray:
            return eq.a @ x + push + eq.push * friction * np.tanh(eq.rate @ x / RATE_WIDTH)

        def jacobian(_: float, x: np.ndarray) -> np.ndarray:
            bend = (1 - np.tanh(eq.rate @ x / RATE_WIDTH) ** 2) / RATE_WIDTH
            return eq.a + np.outer(eq.push * friction * bend, eq.rate)

        inside = (times >= begin) & (times < end) | (times == end)
        at = np.append(times[inside], end) if times[inside][-1] < end else times[inside]
        done = solve_ivp(
            slope, (begin, end), x, method=method, t_eval=at, rtol=rtol, atol=atol, jac=jacobian
        )
        states = done.y.T[: inside.sum()]
        pull = friction * np.tanh(states @ eq.rate / RATE_WIDTH)
        found[inside] = states @ eq.c + eq.d * force + eq.pushed * pull
        x = done.y[:, -1]
    return found


LADDER = ((1e-3, 1e-6), (1e-6, 1e-9), (1e-9, 1e-12), (1e-12, 1e-15))


def _scipy_rows(eq: _Equations, friction: float, reference: np.ndarray, ours: Row) -> list[Row]:
    rows = []
    for method in ("LSODA", "Radau", "BDF"):
        for rtol, atol in LADDER if method == "LSODA" else LADDER[1:3]:
            call = partial(_scipy, eq, friction, method, rtol, atol)
            seconds, samples = _timed(call, 2)
            name = f"solve_ivp {method}, {rtol:g} / {atol:g}"
            rows.append(Row(name, _gap(samples, reference), seconds))
    good = [row for row in rows if row.error <= ours.error]
    chosen = min(good, key=lambda r: r.seconds) if good else min(rows, key=lambda r: r.error)
    return [replace(row, matches=row is chosen) for row in rows]


def _timed(call: Callable[[], np.ndarray], rounds: int) -> tuple[float, np.ndarray]:
    best, found = np.inf, np.zeros(0)
    for _ in range(rounds):
        began = time.perf_counter()
        found = call()
        best = min(best, time.perf_counter() - began)
    return best, found


def _gap(samples: np.ndarray, reference: np.ndarray) -> float:
    return float(np.max(np.abs(samples - reference)) / np.max(np.abs(reference)))


def linear() -> list[Row]:
    """The linear response to an impact: ours first, then solve_ivp's settings [s]."""
    drive, times, designs = impact("clubhead", FORCE, 0.0, LENGTH), _times(), _designs()

    def call() -> np.ndarray:
        return respond_batch(ROBOT, designs, drive, times, (SENSOR,))

    call()  # compiles
    seconds, samples = _timed(call, ROUNDS)
    errors, middle = [], BATCH // 2
    for index in (0, middle, BATCH - 1):
        eq = _equations(designs | {"wrist_stiffness": designs["wrist_stiffness"][index]})
        errors.append(_gap(samples[index, :, 0], _reference(eq)))
    eq = _equations(designs | {"wrist_stiffness": designs["wrist_stiffness"][middle]})
    ours = Row("supple, batched, on all cores", max(errors), seconds / BATCH)
    return [ours, *_scipy_rows(eq, 0.0, _reference(eq), ours)]


def with_law() -> list[Row]:
    """One response with friction in the wrist: ours first, then solve_ivp's settings [s].

    The reference is solve_ivp's Radau at a tolerance of 1e-11.
    """
    drive, times, numbers = impact("clubhead", FORCE, 0.0, LENGTH), _times(), PRESETS["robo_v"]
    law = {
        "law": "coulomb_friction",
        "place": "wrist",
        "parameters": {"torque": FRICTION, "rate_width": RATE_WIDTH},
    }

    def call() -> np.ndarray:
        return respond(ROBOT, numbers, drive, times, (SENSOR,), [law]).samples[:, 0]

    call()  # compiles
    seconds, samples = _timed(call, ROUNDS)
    eq = _equations(numbers)
    reference = _scipy(eq, FRICTION, "Radau", 1e-11, 1e-14)
    ours = Row("supple, alone, refined until settled", _gap(samples, reference), seconds)
    return [ours, *_scipy_rows(eq, FRICTION, reference, ours)]


def _times() -> np.ndarray:
    return np.arange(SAMPLES) / RATE


def help_seconds(rounds: int = 5) -> float:
    """Wall time of ``supple --help`` in a process of its own, the best of `rounds` [s]."""
    code = "from supple.studies.cli import main; main(['--help'])"
    best = np.inf
    for _ in range(rounds):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
        best = min(best, time.perf_counter() - began)
    return float(best)
