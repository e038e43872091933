"""Planar swings in a batch, beside scipy's solve_ivp one by one and diffrax in the same batch."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ...model import planar
from ...model.lagrange import bent_shaft
from ...model.radau import inverted
from ...model.robot import PRESETS
from ...model.swing import Signals, signals_of, swings
from .peers import by_diffrax, by_scipy, has_diffrax, timed
from .responses import Row

BATCH, RATE, SECONDS = 64, 1000.0, 1.2
GOALS = {"solve_ivp": 35.0, "diffrax": 5.0}
"""How many times less processor time than theirs at rtol 1e-6 a swing is to need [-]."""

SETTINGS = (("LSODA", (1e-6, 1e-9)), ("LSODA", (1e-9, 1e-12)), ("Radau", (1e-6, 1e-9)))
ROUNDS = 5
FRICTION, WIDTHS = 1.0, (1e-5, 0.05)
NUMBERS = PRESETS["robo_v_sleeve_50"]
STIFFNESSES = np.linspace(200.0, 400.0, BATCH)
"""Of the wrist, each swing of a batch its own [N m/rad]."""


def half_turn() -> Signals:
    """An arm that turns by half a turn in a second, its acceleration one sine."""
    times = np.arange(int(SECONDS * RATE) + 1) / RATE
    share = np.clip(times, 0.0, 1.0)
    return signals_of(times, arm=np.pi * (share - np.sin(2 * np.pi * share) / (2 * np.pi)))


def _slope(t: Any, y: Any, design: Any) -> Any:
    """The same equations for others; a design is its wrist's stiffness and friction."""
    numbers = NUMBERS | {"wrist_stiffness": design[0]}
    s, inside, turn = jnp.clip(t, 0.0, 1.0), t < 1.0, 2 * jnp.pi
    u = jnp.stack([
        jnp.pi * (s - jnp.sin(turn * s) / turn),
        jnp.where(inside, jnp.pi * (1 - jnp.cos(turn * s)), 0.0),
        jnp.where(inside, jnp.pi * turn * jnp.sin(turn * s), 0.0),
    ])  # fmt: skip
    drive, rate = jnp.stack([u[0], 0.0 * u[0]]), jnp.stack([u[1], 0.0 * u[1]])
    q, v, zero = y[:4], y[4:], jnp.zeros(4)
    lever = planar.points_of(numbers).lever
    bent = bent_shaft(lever, q[3] - q[1], q[2])

    def force(a: Any) -> Any:
        pivot = planar.pivot_acceleration(numbers, u, 0.0, jnp)
        axes = jnp.cos(q[0]), jnp.sin(q[0])
        left = list(planar.inertia_forces(numbers, q, v, a, pivot, axes, bent))
        for one in planar.springs(numbers, q, v, drive, rate, True, bent):
            friction = design[1] * jnp.tanh(one.rate / WIDTHS[1]) if one.place == "wrist" else 0.0
            left = one.added(left, one.force + friction)
        return jnp.stack(left)

    # in plain arithmetic, which a batch compiles to more quickly than calls of LAPACK
    mass = inverted(jax.jacfwd(force)(zero))
    return jnp.concatenate([v, -mass @ force(zero)])


def planar_rows(friction: float) -> list[Row]:
    """Processor time of one swing, ours first, with the largest error of the clubhead.

    Args:
        friction: of the wrist; 0 for a swing without a law [N m].
    """
    signals = half_turn()
    table = {name: np.full(BATCH, value) for name, value in NUMBERS.items()}
    table["wrist_stiffness"] = STIFFNESSES
    laws = {("wrist", "coulomb_friction"): friction} if friction else None
    seconds, ours = timed(
        lambda: swings("passive_wrist", table, [signals], gravity=0.0, laws=laws, widths=WIDTHS),
        ROUNDS,
    )
    middle = np.array([STIFFNESSES[BATCH // 2], friction])
    compiled = jax.jit(_slope)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.asarray(compiled(t, y, middle))

    def alone(method: str, setting: tuple[float, float]) -> tuple[np.ndarray, float]:
        return by_scipy(rates, np.zeros(8), signals.times, method, setting)

    rates(0.0, np.zeros(8))
    truth = alone("Radau", (1e-10, 1e-13))[0][:, 3]

    def off(found: np.ndarray) -> float:
        return float(np.max(np.abs(found - truth)) / np.max(np.abs(truth)))

    rows = [Row(f"supple, {BATCH} at once", off(ours[BATCH // 2].positions[:, 3]), seconds / BATCH)]
    for index, (method, setting) in enumerate(SETTINGS):
        runs = [alone(method, setting) for _ in range(2)]
        name = f"solve_ivp {method} {setting[0]:g} / {setting[1]:g}"
        spent = min(spent for _, spent in runs)
        rows.append(Row(name, off(runs[0][0][:, 3]), spent, index == 0))
    if has_diffrax():
        designs = jnp.stack([STIFFNESSES, np.full(BATCH, friction)], axis=1)
        setting = SETTINGS[0][1]
        run = by_diffrax(_slope, np.zeros((BATCH, 8)), signals.times, designs, setting)
        spent, found = timed(run, 2)
        name = f"diffrax Kvaerno5 {setting[0]:g} / {setting[1]:g}, {BATCH} at once"
        rows.append(Row(name, off(np.asarray(found)[BATCH // 2, :, 3]), spent / BATCH, True))
    return rows
