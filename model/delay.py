"""Delays: what a channel tells late, between samples too, and with exact derivatives."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from .linear import Array


def shift(outputs: Array, samples: Array) -> Array:
    """Delay each column by a number of samples, between samples by a sixth-order polynomial.

    Args:
        outputs: shape (t, columns) [any].
        samples: delay of each column in samples, shape (columns,) [1].

    Returns:
        Shape (t, columns) in the unit of `outputs`; before the first sample its value is held.

    Source: Lagrange interpolation; tests/model/test_respond.py.
    """
    count = outputs.shape[0]
    whole = jax.lax.stop_gradient(jnp.floor(samples))
    part = samples - whole  # 0 <= part < 1
    at = jnp.arange(count)[:, None] - whole[None, :].astype(int)
    total = jnp.zeros_like(outputs)
    nodes = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0)  # value wanted at at - part
    for j in nodes:
        weight = jnp.ones_like(part)
        for i in nodes:
            if i != j:
                weight = weight * (part - i) / (j - i)
        index = jnp.clip(at - int(j), 0, count - 1)
        total = total + weight * jnp.take_along_axis(outputs, index, axis=0)
    return total
