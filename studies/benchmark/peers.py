"""What others need for the same motions: scipy's solve_ivp one by one, diffrax in a batch."""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

MOST_STEPS = 200_000
"""Steps after which diffrax gives up [-]."""

Slope = Callable[[Any, Any, Any], Any]


def has_diffrax() -> bool:
    """Whether diffrax, an extra that only this needs, is installed."""
    return importlib.util.find_spec("diffrax") is not None


def by_scipy(
    slope: Callable[[float, np.ndarray], np.ndarray],
    start: np.ndarray,
    times: np.ndarray,
    method: str,
    tolerances: tuple[float, float],
    jacobian: Callable[[float, np.ndarray], np.ndarray] | None = None,
) -> tuple[np.ndarray, float]:
    """One motion by solve_ivp.

    Args:
        slope: rates of a state, ``slope(t, y)`` [SI a second].
        start: state at the first time, shape (n,) [SI].
        times: shape (t,) [s].
        method: of solve_ivp.
        tolerances: relative [-] and absolute [SI].
        jacobian: of the rates, where it is known.

    Returns:
        States, shape (t, n) [SI], and processor time [s].
    """
    more: dict[str, Any] = {} if jacobian is None else {"jac": jacobian}
    began = time.process_time()
    run = solve_ivp(
        slope, (times[0], times[-1]), start, method=method, t_eval=times,
        rtol=tolerances[0], atol=tolerances[1], **more,
    )  # fmt: skip
    return run.y.T, time.process_time() - began


def by_diffrax(
    slope: Slope, starts: np.ndarray, times: np.ndarray, designs: Any, tolerances: Any
) -> Callable[[], jax.Array]:
    """Many motions by diffrax's Kvaerno5, its best for stiff rates, compiled over the designs.

    Args:
        slope: ``slope(t, y, design)`` [SI a second].
        starts: states at the first time, shape (designs, n) [SI].
        times: shape (t,) [s].
        designs: what differs, a tree of arrays whose first axis is the designs.
        tolerances: relative [-] and absolute [SI].

    Returns:
        What runs them all and returns states, shape (designs, t, n) [SI].
    """
    diffrax: Any = importlib.import_module("diffrax")
    control = diffrax.PIDController(rtol=tolerances[0], atol=tolerances[1])
    saved = diffrax.SaveAt(ts=jnp.asarray(times))

    def one(start: Any, design: Any) -> Any:
        return diffrax.diffeqsolve(
            diffrax.ODETerm(slope), diffrax.Kvaerno5(), times[0], times[-1], 1e-4, start,
            args=design, saveat=saved, stepsize_controller=control, max_steps=MOST_STEPS,
            throw=False,
        ).ys  # fmt: skip

    many = jax.jit(jax.vmap(one))
    given = jnp.asarray(starts), designs
    return lambda: jax.block_until_ready(many(*given))


def timed(call: Callable[[], Any], rounds: int) -> tuple[float, Any]:
    """Least processor time of some rounds after one that compiles [s], and the result."""
    found, best = call(), np.inf
    for _ in range(rounds):
        began = time.process_time()
        found = call()
        best = min(best, time.process_time() - began)
    return float(best), found
