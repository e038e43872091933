"""One physics, two back ends: jax and casadi on a thousand random states, with Jacobians."""

from typing import Any

import casadi
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import energies, planar
from supple.model.robot import MODELS, PRESETS, Robot

STATES = 1000
NUMBERS = PRESETS["robo_v_sleeve_50"]
SPREAD = np.array([3.0, 0.002, 0.02, 0.1])
PULL = 6.5


def listed(x: Any) -> list[Any]:
    return [x[i] for i in range(x.shape[0])]


def compared(ours: Any, theirs: Any, states: np.ndarray) -> None:
    """Values to 1e-12 and Jacobians to 1e-10 of the largest of each over all states."""
    count = states.shape[1]
    x = casadi.SX.sym("x", count)
    out = casadi.vertcat(*theirs(listed(x)))
    graph = casadi.Function("both", [x], [out, casadi.jacobian(out, x)])
    value, slope = graph.map(len(states))(states.T)
    wanted = np.asarray(value).T
    slopes = np.asarray(slope).reshape(wanted.shape[1], len(states), count).transpose(1, 0, 2)
    given = jnp.asarray(states)
    found = np.asarray(jax.jit(jax.vmap(ours))(given))
    by_state = np.asarray(jax.jit(jax.vmap(jax.jacfwd(ours)))(given))
    size = np.abs(wanted).max(axis=0)
    steep = np.abs(slopes).max(axis=0)
    assert np.all(size > 0)
    assert np.max(np.abs(found - wanted) / size) < 1e-12
    off = np.abs(by_state - slopes).max(axis=0)
    assert np.max(off / np.maximum(steep, 1e-300)) < 1e-10


def planar_states() -> np.ndarray:
    """Rows of q, v, a, then arm and wrist, their rates, the arm's acceleration."""
    rng = np.random.default_rng(17)
    parts = [rng.standard_normal((STATES, 4)) * SPREAD * k for k in (1.0, 10.0, 300.0)]
    parts += [rng.standard_normal((STATES, 2)) * k for k in (1.0, 10.0)]
    return np.concatenate([*parts, 200.0 * rng.standard_normal((STATES, 1))], axis=1)


def energies_in_the_plane(x: Any, xp: Any) -> list[Any]:
    q, v, d, rate = x[:4], x[4:8], x[12:14], x[14:16]
    return [
        planar.kinetic_energy(NUMBERS, q, v, d, rate, xp),
        planar.weight_energy(NUMBERS, q, d, PULL, xp),
        planar.spring_energy(NUMBERS, q, d, True),
        planar.dissipation(NUMBERS, q, v, rate, True),
        *planar.clubhead_velocity(NUMBERS, q, v, d, rate, xp),
    ]


def forces_in_the_plane(x: Any, xp: Any) -> list[Any]:
    """Equations of motion: inertia and weight, springs and dampers."""
    q, v, a, d, rate = x[:4], x[4:8], x[8:12], x[12:14], x[14:16]
    pivot = planar.pivot_acceleration(NUMBERS, (d[0], rate[0], x[16]), PULL, xp)
    axes = xp.cos(q[0]), xp.sin(q[0])
    left = list(planar.inertia_forces(NUMBERS, q, v, a, pivot, axes))
    for one in planar.springs(NUMBERS, q, v, d, rate, True):
        left = one.added(left, one.force)
    return left


@pytest.mark.parametrize("seen", [energies_in_the_plane, forces_in_the_plane])
def test_the_planar_robot_is_one_physics(seen):
    compared(lambda x: jnp.stack(seen(x, jnp)), lambda x: seen(x, casadi), planar_states())


@pytest.mark.parametrize("model", MODELS)
def test_the_robot_of_the_thesis_is_one_physics(model):
    """Energies of random motions of random robots: numbers and states are both drawn."""
    robot, rng = Robot(model, tuple(NUMBERS)), np.random.default_rng(23)
    columns = robot.rows(NUMBERS, np).inertia_rows.shape[1]
    drawn = np.array(list(NUMBERS.values())) * 3.0 ** rng.uniform(-1, 1, (STATES, len(NUMBERS)))
    motions = rng.standard_normal((STATES, 2 * columns))
    each = energies.kinetic_energy, energies.potential_energy, energies.dissipation

    def ours(x: Any) -> Any:
        rows = robot.rows(dict(zip(NUMBERS, x)))
        q, v = x[len(NUMBERS) :][:columns], x[len(NUMBERS) + columns :]
        return jnp.stack([energy(rows, at) for energy, at in zip(each, (v, q, v), strict=True)])

    def theirs(x: list[Any]) -> list[Any]:
        rows = robot.rows(dict(zip(NUMBERS, x)), np)
        q, v = (np.array(part, dtype=object) for part in (
            x[len(NUMBERS) :][:columns], x[len(NUMBERS) + columns :]
        ))  # fmt: skip
        return [energy(rows, at) for energy, at in zip(each, (v, q, v), strict=True)]

    compared(ours, theirs, np.concatenate([drawn, motions], axis=1))
