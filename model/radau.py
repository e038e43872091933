"""Three-stage Radau IIA for stiff second-order systems, batched, differentiable, one program."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from itertools import product
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


def _spectrum() -> tuple[tuple[Any, np.ndarray], ...]:
    """Eigenvalues of Butcher's table, of two conjugates one, each with its part in (row, column).

    A matrix that is a polynomial in the table falls apart into as many smaller ones.
    """
    values, vectors = (np.asarray(part, dtype=complex) for part in np.linalg.eig(WEIGHTS))
    parts = np.einsum("sk,kt->kst", vectors, np.linalg.inv(vectors))
    turns = np.imag(values)
    real, turning = int(np.argmin(np.abs(turns))), int(np.argmax(turns))
    alone = np.real(values[real]), np.real(parts[real])
    return alone, (values[turning], 2 * parts[turning])


SPECTRUM = _spectrum()


def iteration_matrix(mass: Array, damping: Array, stiffness: Array, step: Array) -> Array:
    """Inverse of the linearized stage equations, shape (n, n, 3, 3, ...) [SI of 1/mass].

    Args:
        mass: shape (n, n, ...), designs last [kg, kg m or kg m^2].
        damping: shape (n, n, ...) [SI].
        stiffness: shape (n, n, ...) [SI].
        step: h [s].

    Returns:
        Row and column of coordinates, then row and column of stages.

    Source: Hairer and Wanner 1996, section IV.8: one real and one complex matrix of n rows
    instead of one of 3 n; tests/model/test_radau.py.
    """
    found = jnp.zeros(())
    for value, part in SPECTRUM:
        h = step * value
        small = inverted(mass + h * damping + h**2 * stiffness)
        weight = part.reshape(3, 3, *(1,) * (mass.ndim - 2))
        found = found + jnp.real(small[:, :, None, None] * weight)
    return found


def inverted(a: Array) -> Array:
    """Inverse of matrices [any unit], shape (n, n, ...), designs last, by Gauss and Jordan.

    Without a search for pivots: sums of masses, dampers and springs with weights that turn by
    less than half a circle, such as here, need none; Higham 2002, section 10.4.
    """
    for k in range(a.shape[0]):
        pivot = 1.0 / a[k, k]
        row, column = a[k] * pivot, a[:, k]
        a = a - column[:, None] * row[None]
        a = a.at[k].set(row).at[:, k].set(-column * pivot).at[k, k].set(pivot)
    return a


Numbers = tuple[Array, ...]
"""One array a coordinate, designs along the last axis: such arrays fuse and fill the registers."""

Imbalance = Callable[[Numbers, Numbers, Numbers, Numbers, Any], Numbers]


def march(
    imbalance: Imbalance,
    q: Numbers,
    v: Numbers,
    signals: Numbers,
    step: Array,
    inverse: Callable[[Numbers, Numbers, Numbers], Any],
    iterations: int,
    refresh: int = 50,
    ready: Callable[[Numbers], Any] = lambda q: None,
    anew: Callable[[Any, Numbers, Numbers, Numbers], Array] | None = None,
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
            (n, n, 3, 3, designs), see `iteration_matrix`; or what `anew` makes it of.
        iterations: simplified Newton steps; what the last one changed is returned.
        refresh: steps after which that is made anew.
        ready: what is known of the positions guessed for the middle stage, worked out once a
            step: costly functions whose value near that follows by a series.
        anew: makes the matrix of every single step out of what `inverse` gave, and (q, v, u).

    Returns:
        positions, velocities and accelerations at the ends of the steps, n of shape
        (steps, designs) each [SI], and the largest last change of an acceleration relative to the
        largest of its stages, (steps, designs) [-].

    Source: Hairer and Wanner 1996, section IV.8; tests/model/test_radau.py shows order 5.
    """
    n = len(q)
    once, twice = step * jnp.asarray(WEIGHTS), step**2 * jnp.asarray(TWICE)
    nodes = (step * jnp.asarray(NODES))[:, None]

    def advance(about: Any, carry: tuple[Array, Array, Array], u: Array) -> tuple[Any, Array]:
        q, v, guess = carry  # (n, designs) each, and (n, 3, designs)
        matrix = about if anew is None else anew(about, tuple(q), tuple(v), tuple(u[:, 0]))
        base_q = q[:, None] + nodes * v[:, None]
        known = ready(tuple((base_q + _staged(twice, guess))[:, 1]))

        def improve(_: int, state: tuple[Array, Array]) -> tuple[Array, Array]:
            a = state[0]
            at, rate = base_q + _staged(twice, a), v[:, None] + _staged(once, a)
            left = _apart(
                step,
                lambda: jnp.stack(imbalance(tuple(at), tuple(rate), tuple(a), tuple(u), known)),
            )
            pairs = product(range(n), range(3))
            move = sum(matrix[:, j, :, t] * left[j, t] for j, t in pairs)
            return a - move, move

        a, move = jax.lax.fori_loop(0, iterations, improve, (guess, jnp.zeros_like(guess)))
        new_q = base_q[:, 2] + _staged(twice, a)[:, 2]
        new_v = v + _staged(once, a)[:, 2]
        sizes = _largest(move) / (_largest(a) + 1e-300)
        # one array, because each that leaves a step costs as much as some hundred operations
        found = jnp.concatenate([new_q, new_v, a[:, 2], reduce(jnp.maximum, sizes)[None]])
        return (new_q, new_v, _staged(jnp.asarray(AHEAD), a)), found

    def block(carry: tuple[Array, Array, Array], u: Array) -> tuple[Any, Array]:
        about = inverse(tuple(carry[0]), tuple(carry[1]), tuple(u[0, :, 0]))
        return jax.lax.scan(partial(advance, about), carry, u)

    given = jnp.stack(jnp.broadcast_arrays(*signals), axis=1)
    steps = given.shape[0]
    blocks = -(-steps // refresh)
    filling = jnp.repeat(given[-1:], blocks * refresh - steps, axis=0)
    parts = jnp.concatenate([given, filling]).reshape(blocks, refresh, *given.shape[1:])
    first = jnp.stack(q), jnp.stack(v)
    carry = (*first, jnp.zeros((n, 3, *first[0].shape[1:])))
    found = jax.lax.scan(block, carry, parts)[1]
    found = jnp.moveaxis(found.reshape(blocks * refresh, *found.shape[2:])[:steps], 1, 0)
    return tuple(found[:n]), tuple(found[n : 2 * n]), tuple(found[2 * n : -1]), found[-1]


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


def _apart(step: Array, work: Callable[[], Array]) -> Array:
    """The result of `work`, kept from being worked out anew wherever it is used.

    The compiler fuses what it can into every consumer, here twelve times; it fuses nothing across
    a branch, and cannot know that a step is never negative.
    """
    shapes = jax.eval_shape(work)
    return jax.lax.cond(
        step > 0, work, lambda: jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), shapes)
    )


def _largest(stages: Array) -> Array:
    """Largest magnitude of three stages (n, 3, designs), shape (n, designs), as what fuses."""
    sizes = jnp.abs(stages)
    return jnp.maximum(jnp.maximum(sizes[:, 0], sizes[:, 1]), sizes[:, 2])


def _staged(table: Array, stages: Array) -> Array:
    """A table (3, 3) times stages (n, 3, designs), as sums that fuse."""
    parts = (table[:, k, None] * stages[:, k, None] for k in range(3))
    return reduce(jnp.add, parts)
