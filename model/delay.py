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
    far = count + REACH
    lag = jnp.clip(whole, -far, far).astype(int)
    ends = [jnp.broadcast_to(outputs[at], (far + REACH, outputs.shape[1])) for at in (0, -1)]
    held = jnp.concatenate([ends[0], outputs, ends[1]])
    columns = []
    for column in range(outputs.shape[1]):  # slices: to gather sample by sample takes far longer
        low = (far - lag[column],)
        seen = jax.lax.dynamic_slice(held[:, column], low, (count + 2 * REACH,))
        total = jnp.zeros(count)
        for j in range(1 - REACH, REACH + 1):  # value wanted at at - part
            weight = jnp.ones(())
            for i in range(1 - REACH, REACH + 1):
                if i != j:
                    weight = weight * (part[column] - i) / (j - i)
            total = total + weight * seen[REACH - j : REACH - j + count]
        columns.append(total)
    return jnp.stack(columns, axis=1) if columns else outputs


REACH = 3
"""Samples on either side that a value between two is told by [-]."""
