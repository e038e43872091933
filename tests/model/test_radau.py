"""The Radau march: of order five, stable where a spring is very stiff."""

import jax.numpy as jnp
import numpy as np
import pytest

from supple.model.radau import NODES, iteration_matrix, march


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
