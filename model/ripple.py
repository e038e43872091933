"""What a drive adds to a told motion: a ripple of one tone, from when it first moves on."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from .chain import DERIVATIVES
from .linear import Array
from .plant import Plant

RISE = 0.1
"""Time over which a ripple grows from nothing once the drive moves [s]."""

MOVES = 0.02
"""Share of its largest move beyond which a told motion has surely begun [-]."""


def told_column(plant: Plant) -> int | None:
    """Which input is told by its place and may ripple, the last of several; None without one."""
    found = [i for i, port in enumerate(plant.inputs) if DERIVATIVES.get(port.quantity) == 0]
    return found[-1] if found else None


def rippled(plant: Plant, ripple: Array, inputs: Array, step: Array) -> Array:
    """Inputs with the ripple of what is told by its place.

    Args:
        plant: its inputs are meant.
        ripple: amplitude [m or rad], frequency [Hz], phase [rad] and lead [s], shape (4,).
        inputs: shape (t, inputs) [SI].
        step: sampling interval [s].

    Returns:
        ``told + A r(t) sin(2 pi f t + phase)``, r rising to 1 within `RISE` from a lead before the
        told motion has gone `MOVES` of its way: when it first stirred, its noise hides. Unchanged
        where nothing is told by its place.
    """
    column = told_column(plant)
    if column is None:
        return inputs
    amplitude, frequency, phase, lead = ripple
    told = jax.lax.stop_gradient(inputs[:, column])
    gone = jnp.abs(told - told[0])
    moves = gone > MOVES * jnp.max(gone)
    times = step * jnp.arange(len(told))
    begun = jnp.where(jnp.any(moves), times[jnp.argmax(moves)], jnp.inf)
    rise = jnp.clip((times - begun + lead) / RISE, 0.0, 1.0)
    wave = jnp.sin(2 * jnp.pi * frequency * times + phase)
    return inputs.at[:, column].add(amplitude * rise * wave)
