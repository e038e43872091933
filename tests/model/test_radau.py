"""The Radau march: of order five, stable where a spring is very stiff."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.radau import NODES, TWICE, WEIGHTS, iteration_matrix, march


def duffing(q, v, a, u, _):
    """x'' + 0.2 x' + x + x^3 = u."""
    return (a[0] + 0.2 * v[0] + q[0] + q[0] ** 3 - u[0],)


def run(steps: int, seconds: float = 4.0) -> float:
    step = seconds / steps
    times = step * (np.arange(steps)[:, None] + NODES[None, :])
    u = (np.cos(1.7 * times)[:, :, None],)
    one = jnp.ones((1, 1))
    inverse = iteration_matrix(one, 0.2 * one, one, step)[..., None]
    q, *_ = march(
        duffing, (jnp.array([0.5]),), (jnp.array([0.0]),), u, step, lambda *_: inverse, 40
    )
    return float(q[0][-1, 0])


def test_order_five():
    best = run(1600)
    errors = [abs(run(steps) - best) for steps in (40, 80, 160)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 4.7)


def test_a_very_stiff_spring_is_no_trouble():
    """The slow part of a system with rates of 1 and 1e10: the fast part just follows."""
    fast = 1e10

    def pull(q, v, a, u, _):
        return (a[0] + v[0] + fast * (q[0] - q[1]), a[1] + q[1] + fast * (q[1] - q[0]))

    mass, damping = np.eye(2), np.diag([1.0, 0.0])
    stiffness = np.array([[fast, -fast], [-fast, fast + 1.0]])
    steps, step = 400, 0.01
    inverse = iteration_matrix(
        jnp.asarray(mass), jnp.asarray(damping), jnp.asarray(stiffness), step
    )[..., None]
    start = jnp.array([1.0])
    zero = (jnp.zeros((steps, 3, 1)),)
    q, *_ = march(pull, (start, start), (0 * start, 0 * start), zero, step, lambda *_: inverse, 3)
    # both together: 2 x'' + x' + x = 0
    times = step * np.arange(1, steps + 1)
    rate, turn = 0.25, np.sqrt(0.5 - 0.0625)
    exact = np.exp(-rate * times) * (np.cos(turn * times) + rate / turn * np.sin(turn * times))
    assert np.max(np.abs(np.asarray(q[1])[:, 0] - exact)) < 1e-8
    assert np.asarray(q[0])[:, 0] == pytest.approx(np.asarray(q[1])[:, 0], abs=1e-8)


def test_the_iteration_matrix_is_the_inverse_of_the_whole():
    """Against the matrix of all stages at once, with springs of all sizes."""
    rng = np.random.default_rng(3)
    for spread in (0.0, 3.0, 6.0):
        parts = []
        for size in (1.0, 10.0, 1e3):
            root = rng.normal(size=(4, 4)) * 10 ** rng.uniform(-spread / 2, spread / 2, 4)
            parts.append(size * root @ root.T + 0.05 * size * rng.normal(size=(4, 4)))
        mass, damping, stiffness = parts
        mass = mass + np.eye(4)
        step = 0.003
        whole = np.kron(mass, np.eye(3)) + step * np.kron(damping, WEIGHTS)
        whole = whole + step**2 * np.kron(stiffness, TWICE)
        wanted = np.linalg.inv(whole).reshape(4, 3, 4, 3).transpose(0, 2, 1, 3)
        twice = jnp.array([1.0, 2.0])
        m, c, k = (part[..., None] * twice for part in (mass, damping, stiffness))
        found = np.asarray(iteration_matrix(m, c, k, step))
        assert found.shape == (4, 4, 3, 3, 2)
        for index, factor in enumerate((1.0, 2.0)):
            off = np.max(np.abs(found[..., index] * factor - wanted))
            assert off < 1e-10 * np.abs(wanted).max()
