"""The planar robot's energies: one physics for jax and casadi, and their small-motion limit."""

from typing import Any

import casadi
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from supple.model import planar
from supple.model.energies import mass_matrix, stiffness_matrix
from supple.model.robot import PRESETS, Robot

NUMBERS = PRESETS["robo_v_sleeve_50"]
STATES = 1000
SPREAD = np.array([3.0, 0.002, 0.02, 0.1])


def draw(count: int = STATES, seed: int = 7) -> tuple[np.ndarray, ...]:
    """Random positions, velocities, accelerations, drives with their rates and accelerations."""
    rng = np.random.default_rng(seed)
    q, v, a = (rng.standard_normal((count, 4)) * SPREAD * k for k in (1.0, 10.0, 300.0))
    d, rate, bend = (rng.standard_normal((count, 2)) * k for k in (1.0, 10.0, 200.0))
    return q, v, a, d, rate, bend


def lagrange(q: Any, v: Any, a: Any, d: Any, rate: Any, bend: Any, pull: float) -> jax.Array:
    """d/dt dT/dv - dT/dq + dV/dq, by differentiating the energies."""

    def momentum(q: Any, v: Any, d: Any, rate: Any) -> Any:
        return jax.grad(planar.kinetic_energy, 2)(NUMBERS, q, v, d, rate, jnp)

    change = jax.jvp(momentum, (q, v, d, rate), (v, a, rate, bend))[1]
    moving = jax.grad(planar.kinetic_energy, 1)(NUMBERS, q, v, d, rate, jnp)
    return change - moving + jax.grad(planar.weight_energy, 1)(NUMBERS, q, d, pull, jnp)


def worked_out(q: Any, v: Any, a: Any, d: Any, rate: Any, bend: Any, pull: float) -> jax.Array:
    pivot = planar.pivot_acceleration(NUMBERS, (d[0], rate[0], bend[0]), pull, jnp)
    axes = jnp.cos(q[0]), jnp.sin(q[0])
    return jnp.stack(planar.inertia_forces(NUMBERS, q, v, a, pivot, axes))


def test_the_equations_worked_out_are_those_of_the_energies():
    states = draw()
    pull = 7.3
    given = tuple(jnp.asarray(state) for state in states)

    def both(state: Any) -> Any:
        q, v, a, d, rate, bend = state
        return worked_out(q, v, a, d, rate, bend, pull), lagrange(q, v, a, d, rate, bend, pull)

    ours, truth = jax.vmap(both)(given)
    size = np.abs(truth).max(axis=0)
    assert np.max(np.abs(ours - truth) / size) < 1e-12


def test_casadi_and_jax_see_one_physics():
    q, v, _, d, rate, _ = (casadi.SX.sym(n, k) for n, k in zip("qvadrb", (4, 4, 4, 2, 2, 2)))
    energy = planar.kinetic_energy(NUMBERS, _list(q), _list(v), _list(d), _list(rate), casadi)
    weight = planar.weight_energy(NUMBERS, _list(q), _list(d), 5.0, casadi)
    elastic = planar.spring_energy(NUMBERS, _list(q), _list(d), True)
    total = casadi.vertcat(energy, weight, elastic)
    slopes = casadi.jacobian(total, casadi.vertcat(q, v))
    theirs = casadi.Function("energies", [q, v, d, rate], [total, slopes])

    def ours(q: Any, v: Any, d: Any, rate: Any) -> Any:
        return jnp.stack([
            planar.kinetic_energy(NUMBERS, q, v, d, rate, jnp),
            planar.weight_energy(NUMBERS, q, d, 5.0, jnp),
            planar.spring_energy(NUMBERS, q, d, True),
        ])  # fmt: skip

    states = draw()
    chosen = [states[i] for i in (0, 1, 3, 4)]
    values = np.asarray(jax.vmap(ours)(*map(jnp.asarray, chosen)))
    by_q, by_v = jax.vmap(jax.jacfwd(ours, (0, 1)))(*map(jnp.asarray, chosen))
    jacobians = np.concatenate([by_q, by_v], axis=2)
    mapped = theirs.map(STATES)(*(x.T for x in chosen))
    other = np.asarray(mapped[0]).T
    others = np.asarray(mapped[1]).reshape(3, STATES, 8).transpose(1, 0, 2)
    assert np.max(np.abs(values - other) / np.abs(other).max(axis=0)) < 1e-12
    assert np.max(np.abs(jacobians - others) / np.abs(others).max(axis=0).clip(1e-9)) < 1e-10


def _list(x: Any) -> list[Any]:
    return [x[i] for i in range(x.shape[0])]


def test_at_rest_it_is_the_linear_robot():
    rows = Robot("pinned_wrist", tuple(NUMBERS)).rows(NUMBERS, np)
    still, none = jnp.zeros(4), jnp.zeros(2)
    mass = jax.hessian(planar.kinetic_energy, 2)(NUMBERS, still, still, none, none, jnp)
    springs = jax.hessian(planar.spring_energy, 1)(NUMBERS, still, none, True)
    losses = jax.hessian(planar.dissipation, 2)(NUMBERS, still, still, none, True)
    linear = mass_matrix(rows)[:4, :4], stiffness_matrix(rows)[:4, :4]
    assert np.max(np.abs(mass - linear[0])) < 1e-12 * np.abs(linear[0]).max()
    assert np.max(np.abs(springs - linear[1])) < 1e-12 * np.abs(linear[1]).max()
    damping = rows.spring_rows.T @ (rows.dampings[:, None] * rows.spring_rows)
    assert np.max(np.abs(losses - damping[:4, :4])) < 1e-12 * damping.max()


def test_the_arm_pushes_every_mass():
    """An arm that starts to turn pushes collet, grip and clubhead: the correction of eq. 40."""
    p, still, none = NUMBERS, jnp.zeros(4), jnp.zeros(2)
    push = worked_out(still, still, still, none, none, jnp.array([1.0, 0.0]), 0.0)
    at = planar.points_of(p)
    whole = (
        p["collet_mass"] * p["collet_centre"]
        + p["grip_mass"] * at.grip
        + p["clubhead_mass"] * at.head
    )
    expected = p["arm_length"] * np.array([whole, p["grip_mass"], 0.0, p["clubhead_mass"]])
    assert push == pytest.approx(expected, rel=1e-12, abs=1e-15)


def stiffness_in_rotation(speed: float) -> np.ndarray:
    """Stiffness of grip and head in a steady rotation, bent as that bends them."""
    v = jnp.array([speed, 0.0, 0.0, 0.0])

    def pull(club: Any) -> Any:
        q = jnp.concatenate([jnp.zeros(1), club])
        inertia = worked_out(q, v, jnp.zeros(4), jnp.zeros(2), jnp.zeros(2), jnp.zeros(2), 0.0)
        springs = jax.grad(planar.spring_energy, 1)(NUMBERS, q, jnp.zeros(2), False)
        return (inertia + springs)[1:]

    return np.asarray(jax.jacfwd(pull)(jnp.zeros(3)))


def test_shortening_keeps_a_fast_club_stable():
    limit = np.sqrt(NUMBERS["shaft_stiffness"] / NUMBERS["clubhead_mass"])
    assert limit == pytest.approx(26.2, abs=0.05)
    for speed in (10.0, 30.0, 60.0):
        matrix = stiffness_in_rotation(speed)
        assert np.max(np.abs(matrix - matrix.T)) < 1e-9 * np.abs(matrix).max()
        assert np.linalg.eigvalsh(matrix).min() > 0

    def bare(speed: float) -> float:
        """The same without the shaft's shortening: springs less the head's centrifugal force."""
        springs = jax.hessian(planar.spring_energy, 1)(NUMBERS, jnp.zeros(4), jnp.zeros(2), False)
        matrix = np.asarray(springs)[1:, 1:]
        away = np.diag([NUMBERS["grip_mass"], 0.0, NUMBERS["clubhead_mass"]]) * speed**2
        return float(np.linalg.eigvalsh(matrix - away).min())

    # the sleeve gives way too, so this head leaves before a rigidly clamped one would
    assert bare(15.0) > 0 > bare(limit)


def test_shortening_is_that_of_a_cantilever():
    """To second order the arc length of the bent shaft, summed along it; the next is the fourth."""
    lever = planar.points_of(NUMBERS).lever
    along = np.linspace(0, 1, 20001)
    off = []
    for size in (1.0, 0.5):
        x_g, turn, bend = 0.001 * size, 0.01 * size, 0.05 * size
        q = np.array([0.0, x_g, turn, x_g + lever * turn + bend])
        slope = turn + bend / lever * (3 * along - 1.5 * along**2)
        arc = 0.5 * lever * np.trapezoid(slope**2, along)
        off.append(planar.foreshortening(NUMBERS, q) / arc - 1)
    assert abs(off[0]) < 2e-3 and off[0] / off[1] == pytest.approx(4.0, rel=1e-2)


def test_the_shortening_s_rate_is_that_of_differences():
    q = np.array([0.0, 0.001, 0.2, 0.001 + 0.4])
    v = np.array([0.0, 0.3, -0.2, 0.9])
    step = 1e-6
    change = planar.foreshortening(NUMBERS, q + step * v) - planar.foreshortening(
        NUMBERS, q - step * v
    )
    rate = planar.head_rates(planar.head_of(NUMBERS, q), v)[1]
    assert -rate == pytest.approx(change / 2 / step, rel=1e-7)


def test_a_bent_club_on_a_tilted_grip_is_as_long_as_it_is_to_the_grip_itself():
    """A rotation of the grip leaves the shaft's line alone: what it feels is turned with it."""
    lever, bend, tilt = planar.points_of(NUMBERS).lever, 0.3, 0.25
    straight = planar.head_of(NUMBERS, np.array([0.0, 0.0, 0.0, bend]))
    across = straight.along * np.sin(tilt) + bend * np.cos(tilt)
    q = np.array([0.0, 0.002, tilt, 0.002 + across])
    assert planar.bend(NUMBERS, q) == pytest.approx(bend, rel=1e-12)
    near = straight.along * np.cos(tilt) - bend * np.sin(tilt)
    assert planar.foreshortening(NUMBERS, q) == pytest.approx(lever - near, rel=1e-12)
    energies = [
        planar.spring_energy(NUMBERS | {"sleeve_stiffness": 0.0}, at, np.zeros(2), False)
        for at in (q, np.array([0.0, 0.0, 0.0, bend]))
    ]
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)
