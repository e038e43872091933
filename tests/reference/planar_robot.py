"""The planar robot a second time: Cartesian positions of its masses, d'Alembert, scipy's Radau.

Of the package it takes the shaft's energy and shortening along its own root alone, two functions
of one number that tests/model/test_shaft.py holds against the elastica. How they turn with the
grip, all forces and the motion are its own: jax only differentiates positions and energies, and
scipy integrates from jump to jump.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from supple.model.shaft import energy, shortening

Told = Callable[[float], tuple[Sequence[float], Sequence[float], Sequence[float]]]
"""Angles of arm and wrist drive at a time, their rates, the rates of these."""

Load = Callable[[float], tuple[float, float, float]]
"""Torque on the collet, force on clubhead and on grip, across the collet, at a time."""


def bend_of(p: dict[str, float], q: Any) -> Any:
    """Bend of the shaft in the grip's own axes, of the head's place in the collet's."""
    reach = p["club_length"] - p["grip_length"] / 2

    def nearer(bend: Any, q: Any) -> Any:
        """One step of Newton's."""
        short, lean, _ = shortening(reach, bend)
        sine, cosine = jnp.sin(q[2]), jnp.cos(q[2])
        left = (reach - short) * sine + bend * cosine - (q[3] - q[1])
        return bend - left / (cosine - lean * sine)

    still = jax.lax.stop_gradient(q)
    bend = still[3] - still[1] - reach * still[2]
    bend = jax.lax.fori_loop(0, 8, lambda _, bend: nearer(bend, still), bend)
    # from where it is found, two more steps have its first three derivatives
    return nearer(nearer(jax.lax.stop_gradient(bend), q), q)


def places(p: dict[str, float], q: Any, d: Any) -> Any:
    """Where collet, grip and clubhead are in the plane, x towards the ball, shape (3, 2)."""
    reach = p["club_length"] - p["grip_length"] / 2
    grip = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    bend = bend_of(p, q)
    tip = reach - shortening(reach, bend)[0]  # along the grip's own axis
    from_grip = tip * jnp.cos(q[2]) - bend * jnp.sin(q[2])
    wrist = p["arm_length"] * jnp.stack([jnp.cos(d[0]), jnp.sin(d[0])])
    along = jnp.stack([jnp.cos(q[0]), jnp.sin(q[0])])
    across = jnp.stack([-jnp.sin(q[0]), jnp.cos(q[0])])
    head = (grip + from_grip) * along + q[3] * across
    return wrist + jnp.stack([p["collet_centre"] * along, grip * along + q[1] * across, head])


def accelerations(p: dict[str, float], q: Any, v: Any, a: Any, told: Any) -> Any:
    """Accelerations of collet, grip and clubhead in the plane, shape (3, 2)."""

    def velocity(q: Any, v: Any, d: Any, rate: Any) -> Any:
        return jax.jvp(lambda q, d: places(p, q, d), (q, d), (v, rate))[1]

    d, rate, bend = told
    return jax.jvp(velocity, (q, v, d, rate), (v, a, rate, bend))[1]


def left_over(
    p: dict[str, float], q: Any, v: Any, a: Any, told: Any, load: Any, pull: float, law: Any
) -> Any:
    """What is left of all forces on each coordinate, shape (4,); zero along a motion."""
    d, rate, _ = told
    masses = jnp.array([p["collet_mass"], p["grip_mass"], p["clubhead_mass"]])
    moved = jax.jacfwd(lambda q: places(p, q, d))(q)
    weight = jnp.array([pull, 0.0])
    inertia = masses[:, None] * (accelerations(p, q, v, a, told) - weight)
    across = jnp.stack([-jnp.sin(q[0]), jnp.cos(q[0])])
    pushed = jnp.stack([0.0 * across, load[2] * across, load[1] * across])
    total = jnp.einsum("mxq,mx->q", moved, inertia - pushed)
    # about their own centres; the collet's inertia is about the pivot
    spin = (p["collet_inertia"] - p["collet_mass"] * p["collet_centre"] ** 2) * a[0]
    twist = p["grip_inertia"] * (a[0] + a[2])
    total = total + jnp.stack([spin + twist - load[0], 0.0, twist, 0.0])

    def held(row: list[float], k: float, c: float, extra: Any = 0.0) -> Any:
        line, drive = jnp.array(row[:4]), jnp.array(row[4:])
        stretch, speed = line @ q + drive @ d, line @ v + drive @ rate
        force = k * stretch + c * speed + (extra(stretch, speed) if callable(extra) else extra)
        return line * force

    reach, half = p["club_length"] - p["grip_length"] / 2, p["sleeve_spacing"] / 2
    k, c = 2 * p["sleeve_stiffness"], 2 * p["sleeve_damping"]
    total = total + held([0, 1, -half, 0, 0, 0], k, c) + held([0, 1, half, 0, 0, 0], k, c)
    by_bend = jax.grad(lambda q: bend_of(p, q))(q)
    pulled = jax.grad(lambda bend: energy(reach, p["shaft_stiffness"], bend))(bend_of(p, q))
    total = total + by_bend * (pulled + p["shaft_damping"] * (by_bend @ v))
    return total + held([1, 0, 0, 0, -1, -1], p["wrist_stiffness"], p["wrist_damping"], law)


def kicked(p: dict[str, float], q: Any, told: Any, jump: Any) -> Any:
    """By how much the velocities jump where the drives' rates do, shape (4,)."""
    d = jnp.asarray(told[0])
    masses = jnp.array([p["collet_mass"], p["grip_mass"], p["clubhead_mass"]])
    by_q, by_d = jax.jacfwd(lambda q, d: places(p, q, d), (0, 1))(jnp.asarray(q), d)
    spins = jnp.array([[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0]])
    own = p["collet_inertia"] - p["collet_mass"] * p["collet_centre"] ** 2
    mass = jnp.einsum("mxi,m,mxj->ij", by_q, masses, by_q)
    mass = mass + spins.T @ (jnp.array([[own], [p["grip_inertia"]]]) * spins)
    return -jnp.linalg.solve(mass, jnp.einsum("mxi,m,mxj,j->i", by_q, masses, by_d, jump))


def moved(
    p: dict[str, float],
    times: np.ndarray,
    told: Told,
    load: Load,
    jumps: Sequence[float] = (),
    start: np.ndarray | None = None,
    pull: float = 0.0,
    law: Callable[[Any, Any], Any] | None = None,
    fixed: bool = False,
) -> np.ndarray:
    """Positions, velocities and accelerations at some times, shape (t, 3, 4).

    `told` and `load` are asked inside pieces between the `jumps` alone.
    """
    extra = law if law is not None else 0.0
    free = slice(1, 4) if fixed else slice(0, 4)

    @jax.jit
    def bend(y: Any, told: Any, load: Any) -> Any:
        q, v = y[:4], y[4:]

        def left(a: Any) -> Any:
            whole = jnp.zeros(4).at[free].set(a)
            return left_over(p, q, v, whole, told, load, pull, extra)[free]

        none = jnp.zeros(3 if fixed else 4)
        return jnp.zeros(4).at[free].set(jnp.linalg.solve(jax.jacfwd(left)(none), -left(none)))

    slope = jax.jit(jax.jacfwd(bend))

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[4:], bend(y, _arrays(told(t)), load(t))])

    def jacobian(t: float, y: np.ndarray) -> np.ndarray:
        upper = np.concatenate([np.zeros((4, 4)), np.eye(4)], axis=1)
        return np.concatenate([upper, slope(y, _arrays(told(t)), load(t))])

    y = np.zeros(8) if start is None else np.asarray(start, float)
    found = np.full((len(times), 3, 4), np.nan)
    last = float(times[-1])
    for low, high in pairwise([0.0, *(t for t in jumps if 0 < t < last), last]):
        inside = (low + 1e-13 * last, high - 1e-13 * last)
        here = np.flatnonzero((times >= low) & ((times < high) | (times == last)))
        run = solve_ivp(
            rates, inside, y, "Radau", dense_output=True, rtol=1e-9, atol=1e-12, jac=jacobian
        )
        assert run.success
        for index in here:
            at = min(max(float(times[index]), inside[0]), inside[1])
            state = run.sol(at)
            found[index] = state[:4], state[4:], bend(state, _arrays(told(at)), load(at))
        y = run.y[:, -1]
        before, after = told(inside[1]), told(high + 1e-13 * last)
        jump = np.asarray(after[1]) - np.asarray(before[1])
        if np.any(jump) and not fixed:
            y = y + np.append(np.zeros(4), kicked(p, y[:4], before, jump))
    return found


def _arrays(told: Any) -> tuple[np.ndarray, ...]:
    return tuple(np.asarray(part, float) for part in told)
