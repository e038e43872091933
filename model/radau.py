"""Three-stage Radau IIA for stiff second-order systems, batched, differentiable, one program."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

Array = Any

_ROOT = np.sqrt(6.0)
NODES = np.array([(4 - _ROOT) / 10, (4 + _ROOT) / 10, 1.0])
"""Where in a step the stages lie [-]."""

WEIGHTS = np.array(
    [
        [(88 - 7 * _ROOT) / 360, (296 - 169 * _ROOT) / 1800, (-2 + 3 * _ROOT) / 225],
        [(296 + 169 * _ROOT) / 1800, (88 + 7 * _ROOT) / 360, (-2 - 3 * _ROOT) / 225],
        [(16 - _ROOT) / 36, (16 + _ROOT) / 36, 1 / 9],
    ]
)
"""Butcher's table of Radau IIA, order 5; Hairer and Wanner 1996, table IV.5.6 [-]."""

TWICE = WEIGHTS @ WEIGHTS


def _extrapolation() -> np.ndarray:
    """From the stages of one step to a guess of those of the next, by their parabola."""
    powers = np.vander(NODES, 3, increasing=True)
    return np.vander(NODES + 1.0, 3, increasing=True) @ np.linalg.inv(powers)


AHEAD = _extrapolation()


def iteration_matrix(mass: Array, damping: Array, stiffness: Array, step: Array) -> Array:
    """Inverse of the linearized stage equations, shape (n, n, 3, 3) [SI of 1/mass].

    Args:
        mass: shape (n, n) [kg, kg m or kg m^2].
        damping: shape (n, n) [SI].
        stiffness: shape (n, n) [SI].
        step: h [s].

    Returns:
        Row and column of coordinates, then row and column of stages.
    """
    n = mass.shape[0]
    whole = jnp.kron(mass, jnp.eye(3)) + step * jnp.kron(damping, jnp.asarray(WEIGHTS))
    whole = whole + step**2 * jnp.kron(stiffness, jnp.asarray(TWICE))
    return jnp.linalg.inv(whole).reshape(n, 3, n, 3).transpose(0, 2, 1, 3)


Numbers = tuple[Array, ...]
"""One array a coordinate, designs along the last axis: such arrays fuse and fill the registers."""

Imbalance = Callable[[Numbers, Numbers, Numbers, Numbers, Any], Numbers]


def march(
    imbalance: Imbalance,
    q: Numbers,
    v: Numbers,
    signals: Numbers,
    step: Array,
    inverse: Callable[[Numbers, Numbers, Numbers], Array],
    iterations: int,
    refresh: int = 50,
    ready: Callable[[Numbers], Any] = lambda q: None,
) -> tuple[Numbers, Numbers, Numbers, Array]:
    """March ``imbalance(q, v, a, u, known) = 0`` of many designs over uniform steps.

    Args:
        imbalance: inertia, springs and dampers less what pushes, element by element: n arrays
            for q, v and a of n arrays each and u of the signals [N or N m].
        q: start positions, n arrays of shape (designs,) [SI].
        v: start velocities, n arrays of shape (designs,) [SI].
        signals: what is prescribed at the stages, arrays of shape (steps, 3, designs) each, or
            (steps, 3, 1) where it is the same for all [SI].
        step: h [s].
        inverse: gives the inverse of the stage equations' matrix about (q, v, u), shape
            (n, n, 3, 3, designs), see `iteration_matrix`.
        iterations: simplified Newton steps; what the last one changed is returned.
        refresh: steps after which that matrix is made anew.
        ready: what is known of the guessed positions, worked out once a step: costly functions
            whose value near the guess follows by a series.

    Returns:
        positions, velocities and accelerations at the ends of the steps, n of shape
        (steps, designs) each [SI], and the largest last change of an acceleration relative to the
        largest of its stages, (steps, designs) [-].

    Source: Hairer and Wanner 1996, section IV.8; tests/model/test_radau.py shows order 5.
    """
    once, twice = (
        (step * jnp.asarray(WEIGHTS))[..., None],
        (step**2 * jnp.asarray(TWICE))[..., None],
    )
    nodes, ahead = (step * jnp.asarray(NODES))[:, None], jnp.asarray(AHEAD)[..., None]

    def advance(
        matrix: Array, carry: tuple[Numbers, Numbers, Numbers], u: Array
    ) -> tuple[Any, Any]:
        q, v, guess = carry
        base_q = tuple(x + nodes * rate for x, rate in zip(q, v, strict=True))

        guessed = tuple(x + _times(twice, bend) for x, bend in zip(base_q, guess, strict=True))
        known = ready(guessed)

        def improve(_: int, state: tuple[Numbers, Numbers]) -> tuple[Numbers, Numbers]:
            a = state[0]
            at = tuple(x + _times(twice, bend) for x, bend in zip(base_q, a, strict=True))
            rate = tuple(x + _times(once, bend) for x, bend in zip(v, a, strict=True))
            left = _apart(step, lambda: imbalance(at, rate, a, u, known))
            move = tuple(
                sum(_times(matrix[i, j], left[j]) for j in range(len(q))) for i in range(len(q))
            )
            return tuple(x - change for x, change in zip(a, move, strict=True)), move

        start = guess, tuple(jnp.zeros_like(x) for x in guess)
        a, move = jax.lax.fori_loop(0, iterations, improve, start)
        new_q = tuple(x[2] + _times(twice, bend)[2] for x, bend in zip(base_q, a, strict=True))
        new_v = tuple(x + _times(once, bend)[2] for x, bend in zip(v, a, strict=True))
        sizes = [
            jnp.max(jnp.abs(m), axis=0) / (jnp.max(jnp.abs(x), axis=0) + 1e-300)
            for m, x in zip(move, a, strict=True)
        ]
        ends = tuple(x[2] for x in a)
        found = (new_q, new_v, ends, jnp.max(jnp.stack(sizes), axis=0))
        return (new_q, new_v, tuple(_times(ahead, x) for x in a)), found

    def block(carry: tuple[Numbers, Numbers, Numbers], u: Numbers) -> tuple[Any, Any]:
        matrix = inverse(carry[0], carry[1], tuple(column[0, 0] for column in u))
        return jax.lax.scan(partial(advance, matrix), carry, u)

    steps = signals[0].shape[0]
    blocks = -(-steps // refresh)

    def in_blocks(column: Array) -> Array:
        filling = jnp.repeat(column[-1:], blocks * refresh - steps, axis=0)
        return jnp.concatenate([column, filling]).reshape(blocks, refresh, *column.shape[1:])

    parts = tuple(in_blocks(column) for column in signals)
    carry = (q, v, tuple(jnp.zeros((3, *x.shape)) for x in q))
    found = jax.lax.scan(block, carry, parts)[1]
    return jax.tree.map(lambda x: x.reshape(blocks * refresh, *x.shape[2:])[:steps], found)


SETTLED = 1e-10
"""Last change of an acceleration, as a share of the largest, at which one step is done [-]."""

MOST_ITERATIONS = 25
"""Newton steps after which one step is given up [-]."""


def one_step(
    imbalance: Callable[[Array, Array, Array], Array],
    q: Array,
    v: Array,
    guess: Array,
    step: Array,
    inverse: Array,
    scale: Array,
) -> tuple[Array, Array, Array, Array]:
    """One step of any length of one design, iterated until it is settled.

    Args:
        imbalance: of positions, velocities and accelerations at the stages, shape (n, 3) each,
            as for `march`, shape (n, 3) [N or N m].
        q: positions, shape (n,) [SI].
        v: velocities, shape (n,) [SI].
        guess: accelerations at the stages to begin with, shape (n, 3) [SI].
        step: h; nothing moves where it is 0 [s].
        inverse: see `iteration_matrix`, shape (n, n, 3, 3).
        scale: accelerations against which a change is small, shape (n,) [SI].

    Returns:
        positions and velocities at the end, accelerations at the stages [SI], and the last change
        of an acceleration as a share of its scale, shape () [-].
    """
    size = 3 * len(q)
    whole = inverse.transpose(0, 2, 1, 3).reshape(size, size)

    def improve(state: tuple[Any, ...]) -> tuple[Any, ...]:
        a, done, _ = state
        left = jax.lax.cond(
            step > 0, lambda: imbalance(*at_stages(q, v, a, step), a), lambda: jnp.zeros_like(a)
        )
        move = (whole @ left.reshape(size)).reshape(a.shape)
        return a - move, done + 1, jnp.max(jnp.abs(move) / scale[:, None])

    def goes_on(state: tuple[Any, ...]) -> Array:
        _, done, change = state
        return (done < 2) | ((change > SETTLED) & (done < MOST_ITERATIONS))

    a, _, change = jax.lax.while_loop(goes_on, improve, (guess, 0, jnp.asarray(jnp.inf)))
    at, rate = at_stages(q, v, a, step)
    return at[:, 2], rate[:, 2], a, change


def at_stages(q: Array, v: Array, a: Array, step: Array) -> tuple[Array, Array]:
    """Positions and velocities at the stages of a step, shape (n, 3) each [SI].

    Args:
        q: positions at its start, shape (n,) [SI].
        v: velocities there, shape (n,) [SI].
        a: accelerations at the stages, shape (n, 3) [SI].
        step: h [s].
    """
    along = v[:, None] * (step * jnp.asarray(NODES))
    rate = v[:, None] + step * (a @ jnp.asarray(WEIGHTS.T))
    return q[:, None] + along + step**2 * (a @ jnp.asarray(TWICE.T)), rate


def continued(stages: Array, ratio: Array) -> Array:
    """A guess of the accelerations at the stages of a step `ratio` times as long as the last [SI].

    Args:
        stages: those of the last step, shape (n, 3) [SI].
        ratio: up to 1; at 0 they stay as they ended [-].
    """
    powers = jnp.asarray(np.linalg.inv(np.vander(NODES, 3, increasing=True)))
    reach = 1.0 + ratio * jnp.asarray(NODES)
    ahead = jnp.stack([jnp.ones(3), reach, reach * reach], axis=1) @ powers
    return stages @ ahead.T


def _apart(step: Array, work: Callable[[], Numbers]) -> Numbers:
    """The result of `work`, kept from being worked out anew wherever it is used.

    The compiler fuses what it can into every consumer, here twelve times; it fuses nothing across
    a branch, and cannot know that a step is never negative.
    """
    shapes = jax.eval_shape(work)
    return jax.lax.cond(
        step > 0, work, lambda: jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    )


def _times(table: Array, stages: Array) -> Array:
    """A table (3, 3, 1 or designs) times stages (3, designs), as sums that fuse."""
    return table[:, 0] * stages[0] + table[:, 1] * stages[1] + table[:, 2] * stages[2]
