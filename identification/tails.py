"""Innovations with heavy tails, as a quadratic form about the best linear numbers."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax.scipy.special import gammaln

from ..model.linear import Array

ROUNDS = 4
"""Rounds of weights and weighed least squares towards the best numbers [-]; each takes all but a
third of the way or less, and the form is right about wherever they end."""


def expanded(white: Array, mask: Array, tail: Array, rate: Array, center: Array) -> Array:
    """Products of whitened columns that stand for the log density of Student's innovations.

    About the best linear numbers the log density is a parabola, whose value and slope there are
    exact and whose curvature is Student's Fisher information, weighed as the innovations are.

    Args:
        white: whitened columns of linear numbers and behind them the gap, shape
            (sensors, numbers + 1, n) [-].
        mask: which samples count, shape (sensors, n).
        tail: inverse of the degrees of freedom, 0 for normal innovations, shape (sensors,) [-].
        rate: of the numbers' priors, inverse standard deviations, shape (numbers,).
        center: their means, shape (numbers,).

    Returns:
        Shape (numbers + 1, numbers + 1), as the products of normal innovations would be [-]; its
        last element carries the density's value.

    Source: Tierney and Kadane 1986, doi:10.1080/01621459.1986.10478240 (Laplace's method); Lange,
    Little and Taylor 1989, doi:10.1080/01621459.1989.10478852; tests/identification/test_uneven.py.
    """
    columns, gap, tail = white[:, :-1], white[:, -1], tail[:, None]
    prior = rate**2

    def weights(best: Array) -> tuple[Array, Array]:
        e = gap - jnp.einsum("smn,m->sn", columns, best)
        return e, mask * (1.0 + tail) / (1.0 + tail * e**2)

    best = jnp.zeros(len(rate))
    for _ in range(ROUNDS):
        _, weight = weights(best)
        weighed = columns * weight[:, None]
        information = jnp.einsum("smn,skn->mk", weighed, columns) + jnp.diag(prior)
        push = jnp.einsum("smn,sn->m", weighed, gap) + prior * center
        root = jax.scipy.linalg.cho_factor(information, lower=True)
        best = jax.scipy.linalg.cho_solve(root, push)
    e, weight = weights(best)
    slope = jnp.einsum("smn,sn->m", columns * weight[:, None], e)
    fisher = (1.0 + tail) / (1.0 + 3.0 * tail)
    information = jnp.einsum("smn,skn->mk", columns * (fisher * weight)[:, None], columns)
    push = slope + information @ best
    value = jnp.sum(mask * _log_density(e, tail)) - slope @ best
    value = value - 0.5 * best @ information @ best
    return jnp.block([[information, push[:, None]], [push[None], -2.0 * value]])


def _log_density(e: Array, tail: Array) -> Array:
    """Log density of Student's law over that of the normal law at 0."""
    heavy = tail > 0
    safe = jnp.where(heavy, tail, 1.0)
    level = gammaln(0.5 / safe + 0.5) - gammaln(0.5 / safe) + 0.5 * jnp.log(2.0 * safe)
    student = level - 0.5 * (1.0 + 1.0 / safe) * jnp.log1p(safe * e**2)
    return jnp.where(heavy, student, -0.5 * e**2)
