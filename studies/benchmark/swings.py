"""Planar swings in a batch, beside scipy's solve_ivp one by one."""

from __future__ import annotations

import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from ...model import planar
from ...model.robot import PRESETS
from ...model.swing import Signals, signals_of, swings
from .responses import Row

BATCH, RATE, SECONDS = 64, 1000.0, 1.2
GOAL = 35
"""How many times faster than solve_ivp at rtol 1e-6 a swing in a batch is to be [-]."""

SETTINGS = (("LSODA", 1e-6, 1e-9), ("LSODA", 1e-9, 1e-12), ("Radau", 1e-6, 1e-9))
ROUNDS = 3


def _signals() -> Signals:
    """An arm that turns by half a turn in a second, its acceleration one sine."""
    times = np.arange(int(SECONDS * RATE) + 1) / RATE
    share = np.clip(times, 0.0, 1.0)
    return signals_of(times, arm=np.pi * (share - np.sin(2 * np.pi * share) / (2 * np.pi)))


def _rates(numbers: dict[str, float]) -> Callable[[float, np.ndarray], np.ndarray]:
    """The same equations for scipy, compiled: an evaluation costs some microseconds."""

    def force(q: jax.Array, v: jax.Array, a: jax.Array, u: jax.Array) -> jax.Array:
        pivot = planar.pivot_acceleration(numbers, u, 0.0, jnp)
        axes = jnp.cos(q[0]), jnp.sin(q[0])
        left = jnp.stack(planar.inertia_forces(numbers, q, v, a, pivot, axes))
        drive, rate = jnp.stack([u[0], 0.0 * u[0]]), jnp.stack([u[1], 0.0 * u[1]])
        for _, row, k, c in planar.spring_rows(numbers, True):
            pull = k * planar.stretch(row, q, drive) + c * planar.stretch(row, v, rate)
            left = left + jnp.asarray(row[:4]) * pull
        return left

    @jax.jit
    def rates(t: jax.Array, y: jax.Array) -> jax.Array:
        s, inside = jnp.clip(t, 0.0, 1.0), t < 1.0
        turn = 2 * jnp.pi
        u = jnp.stack([
            jnp.pi * (s - jnp.sin(turn * s) / turn),
            jnp.where(inside, jnp.pi * (1 - jnp.cos(turn * s)), 0.0),
            jnp.where(inside, jnp.pi * turn * jnp.sin(turn * s), 0.0),
        ])  # fmt: skip
        q, v, zero = y[:4], y[4:], jnp.zeros(4)
        mass = jax.jacfwd(lambda a: force(q, v, a, u))(zero)
        return jnp.concatenate([v, jnp.linalg.solve(mass, -force(q, v, zero, u))])

    return lambda t, y: np.asarray(rates(t, y))


def planar_rows() -> list[Row]:
    """Seconds of one swing in a batch and of solve_ivp's, with the largest error of the head."""
    numbers = PRESETS["robo_v_sleeve_50"]
    signals, rates = _signals(), _rates(numbers)
    table = {name: np.full(BATCH, value) for name, value in numbers.items()}
    truth = solve_ivp(
        rates, (0, SECONDS), np.zeros(8), "Radau", t_eval=signals.times, rtol=1e-10, atol=1e-13
    ).y[3]
    size = np.max(np.abs(truth))
    ours = swings("passive_wrist", table, [signals], gravity=0.0)
    times, error = [], float(np.max(np.abs(ours[0].positions[:, 3] - truth)) / size)
    rows: list[list[float]] = [[] for _ in SETTINGS]
    errors = [0.0] * len(SETTINGS)
    for _ in range(ROUNDS):
        began = time.process_time()
        swings("passive_wrist", table, [signals], gravity=0.0)
        times.append((time.process_time() - began) / BATCH)
        for index, (method, rtol, atol) in enumerate(SETTINGS):
            began = time.process_time()
            run = solve_ivp(
                rates, (0, SECONDS), np.zeros(8), method, t_eval=signals.times, rtol=rtol, atol=atol
            )
            rows[index].append(time.process_time() - began)
            errors[index] = float(np.max(np.abs(run.y[3] - truth)) / size)
    found = [Row(f"supple, {BATCH} at once", error, float(np.median(times)))]
    for (method, rtol, atol), seconds, off in zip(SETTINGS, rows, errors, strict=True):
        name = f"solve_ivp {method} rtol {rtol:g} atol {atol:g}"
        found.append(Row(name, off, float(np.median(seconds)), rtol == 1e-6 and method == "LSODA"))
    return found
