"""Joints told by sampled angles or rates, turned into the accelerations that a march needs."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp

from .chain import DERIVATIVES
from .linear import Array, moved_grounds
from .plant import Plant


def accelerated(plant: Plant, z: Array, inputs: Array, step: Array) -> tuple[Plant, Array, Array]:
    """The plant, its z and its inputs with every joint told by its acceleration.

    The angle is the smoothest curve through its samples, a cubic spline; of a rate it is the
    integral of its spline's slope, from 0 on. The collet starts along with its joints: the start
    state in `z` is meant relative to them. Chains pass through unchanged.

    Args:
        plant: its joints may be told by angle, rate or acceleration.
        z: see `Plant` [SI].
        inputs: samples, shape (t, inputs) [SI].
        step: sampling interval [s].

    Returns:
        The plant that is marched, its z and its inputs [SI].

    Source: de Boor 1978, A Practical Guide to Splines, chapter IV;
    tests/model/test_robot_motion.py.
    """
    if plant.marched == plant.inputs:
        return plant, z, inputs
    n, mechanism = len(plant.mechanism.coordinates), plant.mechanism
    drive, start = plant.slots["drive"].start, plant.slots["start"].start
    for ground in moved_grounds(plant.marched):
        port, at = plant.inputs[ground.index], ground.index
        if port == plant.marched[at]:
            continue
        told = inputs[:, at]
        curve = second_derivatives(told, step)
        slopes = jnp.diff(told) / step - step * (2 * curve[:-1] + curve[1:]) / 6
        if DERIVATIVES[port.quantity] == 0:
            begin, bend = (told[0], slopes[0]), curve
        else:
            last = (told[-1] - told[-2]) / step + step * (curve[-2] + 2 * curve[-1]) / 6
            begin, bend = (0.0, told[0] + z[drive + at]), jnp.append(slopes, last)
        along = jnp.asarray(mechanism.carried[mechanism.grounds.index(port.place)])
        for order, value in enumerate(begin):  # angle, velocity
            low = start + order * n
            z = z.at[low : low + n].add(value * along)
            z = z.at[start + 2 * n + ground.state + order].add(value)
        z = z.at[drive + at].set(0.0)
        inputs = inputs.at[:, at].set(bend)
    return replace(plant, inputs=plant.marched), z, inputs


def second_derivatives(values: Array, step: Array) -> Array:
    """Second derivatives at the samples of the cubic spline through them, not-a-knot at its ends.

    Args:
        values: at least four, shape (t,) [any].
        step: sampling interval [s].

    Returns:
        Shape (t,), in the unit of the values a squared second.
    """
    right = 6 * jnp.diff(values, 2) / step**2
    ones = jnp.ones_like(right)
    # at the first and the last inner sample m[k-1] + 4 m[k] + m[k+1] is 6 m[k], by not-a-knot
    middle = jnp.concatenate([jnp.array([6.0]), 4.0 * ones[2:], jnp.array([6.0])])
    lower = jnp.concatenate([jnp.zeros(1), ones[2:], jnp.zeros(1)])
    upper = lower
    inner = jax.lax.linalg.tridiagonal_solve(lower, middle, upper, right[:, None])[:, 0]
    first, last = 2 * inner[0] - inner[1], 2 * inner[-1] - inner[-2]
    return jnp.concatenate([first[None], inner, last[None]])
