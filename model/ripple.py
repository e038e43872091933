"""What a drive adds to a told motion: a ripple of one tone, from when it sets in."""

from __future__ import annotations

import jax.numpy as jnp

from .chain import DERIVATIVES
from .linear import Array
from .plant import Plant

RISE = 0.1
"""Time over which a ripple grows from nothing once it sets in [s]."""


def told_column(plant: Plant) -> int | None:
    """Which input is told by its place and may ripple, the last of several; None without one."""
    found = [i for i, port in enumerate(plant.inputs) if DERIVATIVES.get(port.quantity) == 0]
    return found[-1] if found else None


def rippled(plant: Plant, ripple: Array, inputs: Array, step: Array) -> Array:
    """Inputs with the ripple of what is told by its place.

    Args:
        plant: its inputs are meant.
        ripple: amplitude [m or rad], frequency [Hz], phase [rad] and onset [s], shape (4,).
        inputs: shape (t, inputs) [SI].
        step: sampling interval [s].

    Returns:
        ``told + A r(t) sin(2 pi f t + phase)``, r rising to 1 within `RISE` from the onset on;
        unchanged where nothing is told by its place.
    """
    column = told_column(plant)
    if column is None:
        return inputs
    amplitude, frequency, phase, onset = ripple
    times = step * jnp.arange(len(inputs))
    rise = jnp.clip((times - onset) / RISE, 0.0, 1.0)
    wave = jnp.sin(2 * jnp.pi * frequency * times + phase)
    return inputs.at[:, column].add(amplitude * rise * wave)
