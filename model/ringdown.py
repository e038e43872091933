"""What a sensor sees of a linear mechanism left to itself: exact samples, energy, no sampling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .chain import FORCES
from .drives import Hold, equilibrium
from .linear import Array, Mechanism, Port, state_space

DOUBLINGS = 60
"""How often the shortest interval is doubled [-]; enough where |A| duration stays below 2^59."""

TAYLOR_TERMS = 14
"""Terms of the series over the shortest interval [-]."""

FORGOTTEN = 40.0
"""Time constants of the slowest mode after which nothing is left of a response [-]."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class FreeResponse:
    """What a sensor sees of a linear mechanism that is left to itself: ``row exp(A t) start``.

    Attributes:
        a: shape (states, states) [SI unit of the state a second and a unit of the state].
        start: shape (states,) [SI unit of the state].
        row: shape (states,) [SI unit of the sensor a unit of the state].
    """

    a: Array
    start: Array
    row: Array


def after_impulse(
    mechanism: Mechanism, p: Mapping[str, Any], at: Port, impulse: Any, sensor: Port
) -> FreeResponse:
    """The response to an impulse on a mechanism at rest; t = 0 is the end of the impulse.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI]; may be traced.
        at: a force or torque.
        impulse: its integral over time [N s or N m s].
        sensor: what is seen.

    Returns:
        The free response.

    Raises:
        ValueError: where `at` is a motion, or the mechanism has no such sensor.
    """
    if at.quantity not in FORCES:
        raise ValueError(
            f"impulse: expected a force or a torque, found quantity = {at.quantity!r}. "
            "Mend: name quantity = 'force' or 'torque'."
        )
    space = state_space(mechanism, p, (at,), (sensor,))
    return FreeResponse(space.a, space.b[:, 0] * impulse, space.c[0])


def after_release(
    mechanism: Mechanism, p: Mapping[str, Any], hold: Hold, sensor: Port
) -> FreeResponse:
    """The response after a displacement is let go, from rest.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI]; may be traced.
        hold: what is held, and how far.
        sensor: what is seen.

    Returns:
        The free response; its start is not finite where no balance exists.
    """
    space = state_space(mechanism, p, (), (sensor,))
    coordinates, _ = equilibrium(mechanism, p, hold)
    start = jnp.concatenate([coordinates, jnp.zeros(len(coordinates))])
    return FreeResponse(space.a, start, space.c[0])


def free_samples(response: FreeResponse, step: float, count: int) -> Array:
    """Exact samples of a free response.

    Args:
        response: the free response; may be traced.
        step: sampling interval [s].
        count: samples, the first at t = 0 [-].

    Returns:
        Shape (count,) [unit of the sensor].
    """
    power = transition(response.a, step)
    look = response.row[None]  # row A^k, by doubling
    while len(look) < count:
        look, power = jnp.concatenate([look, look @ power]), power @ power
    return look[:count] @ response.start


def energy(response: FreeResponse, duration: float = float("inf")) -> Array:
    """Integral of the squared response from 0 to `duration`, without sampling.

    Args:
        response: the free response; may be traced.
        duration: [s]; infinite by default.

    Returns:
        The integral [squared unit of the sensor, times s]; infinite where it never decays.

    Source: ``P(2 h) = P(h) + E(h) P(h) E(h)'``, which for ever solves the equation of Lyapunov
    ``A P + P A' + x x' = 0``: Smith 1968, doi:10.1137/0116017; tests/model/test_score.py.
    """
    if np.isfinite(duration):
        _, whole = _doubled(response.a, response.start, duration)
        return response.row @ whole @ response.row
    bare = jax.lax.stop_gradient(response.a)
    slowest = -jnp.max(jnp.real(jnp.linalg.eigvals(bare)))
    norm = jnp.max(jnp.sum(jnp.abs(bare), axis=0))
    decays = slowest * 2.0 ** (DOUBLINGS - 1) > FORGOTTEN * norm
    long = FORGOTTEN / jnp.where(decays, slowest, FORGOTTEN)
    a = jnp.where(decays, response.a, -jnp.eye(len(bare)))
    _, whole = _doubled(a, response.start, long)
    return jnp.where(decays, response.row @ whole @ response.row, jnp.inf)


def transition(a: Array, duration: Any) -> Array:
    """``exp(A T)`` for a duration T [s]; both ways differentiable.

    Args:
        a: shape (states, states) [SI unit of the state a second and a unit of the state].
        duration: [s].

    Returns:
        Shape (states, states) [SI units of the states' ratios].
    """
    return _doubled(a, jnp.zeros(a.shape[0]), duration)[0]


@jax.jit
def _doubled(a: Array, start: Array, duration: Any) -> tuple[Array, Array]:
    """``exp(A T)``, and the integral of ``x x'`` from 0 to T over the free motion x.

    A series over T / 2^60, then doublings of ``exp - 1``, which loses no digits of slow modes
    beside stiff ones; differentiable both ways, unlike a number of doublings that the matrix tells.
    """
    n, first = a.shape[0], duration / 2.0**DOUBLINGS
    eye, term, grown = jnp.eye(n), jnp.eye(n), jnp.zeros((n, n))
    moments = [start]
    for k in range(1, TAYLOR_TERMS + 1):
        term = term @ a * (first / k)
        grown = grown + term
        moments.append(a @ moments[-1] * (first / k))
    nodes, weights = np.polynomial.legendre.leggauss(TAYLOR_TERMS // 2)
    at = 0.5 * (nodes + 1.0)
    states = sum(
        (x * at[:, None] ** k for k, x in enumerate(moments)), jnp.zeros((len(at), n))
    )  # (nodes, states)
    whole = jnp.einsum("q,qi,qj->ij", 0.5 * weights, states, states) * first

    def double(_: int, both: tuple[Array, Array]) -> tuple[Array, Array]:
        less_one, so_far = both
        transition = eye + less_one
        so_far = so_far + transition @ so_far @ transition.T
        return 2 * less_one + less_one @ less_one, so_far

    less_one, whole = jax.lax.fori_loop(0, DOUBLINGS, double, (grown, whole))
    return eye + less_one, whole
