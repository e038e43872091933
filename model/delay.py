"""Delays: what a channel tells late, between samples too, and with exact derivatives."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from .linear import Array


def shift(outputs: Array, samples: Array) -> Array:
    """Delay each column by a number of samples, between samples by a sixth-order polynomial.

    Args:
        outputs: shape (t, columns) [any].
        samples: delay of each column in samples, shape (columns,), or of all, shape () [1].

    Returns:
        Shape (t, columns) in the unit of `outputs`; before the first sample its value is held.

    Source: Lagrange interpolation; tests/model/test_respond.py.
    """
    if samples.ndim == 0:
        return _late(outputs, samples)
    columns = [_late(outputs[:, [at]], samples[at]) for at in range(outputs.shape[1])]
    return jnp.concatenate(columns, axis=1) if columns else outputs


def _late(outputs: Array, samples: Array) -> Array:
    """Columns with one delay for all: slices, since to gather sample by sample takes far longer."""
    count = outputs.shape[0]
    whole = jax.lax.stop_gradient(jnp.floor(samples))
    part = samples - whole  # 0 <= part < 1
    far = count + REACH
    lag = jnp.clip(whole, -far, far).astype(int)
    ends = [jnp.broadcast_to(outputs[at], (far + REACH, outputs.shape[1])) for at in (0, -1)]
    held = jnp.concatenate([ends[0], outputs, ends[1]])
    seen = jax.lax.dynamic_slice_in_dim(held, far - lag, count + 2 * REACH)
    total = jnp.zeros_like(outputs)
    for j in range(1 - REACH, REACH + 1):  # value wanted at at - part
        weight = jnp.ones(())
        for i in range(1 - REACH, REACH + 1):
            if i != j:
                weight = weight * (part - i) / (j - i)
        total = total + weight * seen[REACH - j : REACH - j + count]
    return total


REACH = 3
"""Samples on either side that a value between two is told by [-]."""
