"""Sensors of a linear chain under forces, in blocks of samples: for many designs at once."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from .acting import space_of
from .chain import FORCES, Chain
from .linear import Array, make_step
from .march import interval_values, offset_mask
from .plant import Plant

BLOCK = 32
"""Samples that are one product of matrices [-]; a power of two."""


def is_pushed(plant: Plant) -> bool:
    """Whether nothing but forces drives a chain without laws."""
    forces = all(port.quantity in FORCES for port in plant.inputs)
    return isinstance(plant.mechanism, Chain) and forces and not plant.law_places


def pushed(plant: Plant, z: Array, inputs: Array, step: Array) -> Array:
    """What perfect sensors read of a chain under forces, exact.

    As `simulate`, whose every sample is a step of a loop: here one of `BLOCK` samples is, and what
    forces do within a block is a product of matrices.

    Args:
        plant: one of which `is_pushed` is true (static).
        z: all that varies, see `Plant` [SI]; errors of sensors are left out.
        inputs: sampled inputs, shape (t, inputs) [N or N m].
        step: sampling interval [s].

    Returns:
        Shape (sensors, t) [SI].

    Source: tests/model/test_pushed.py (against `simulate`).
    """
    space, count = space_of(plant, z), inputs.shape[0]
    matrices = make_step(space, step)
    start, middle, end = matrices.nodes[1]
    drive = inputs + z[plant.slots["drive"]] * offset_mask(plant)
    ends = interval_values(plant, drive, step)
    told = jnp.concatenate(ends, axis=1)  # (t - 1, from start and end)
    spread = jnp.concatenate([start + 0.5 * middle, end + 0.5 * middle], axis=1)
    powers = _powers(matrices.free[1], BLOCK)

    blocks = -(-count // BLOCK)
    told = jnp.pad(told, ((0, blocks * BLOCK - count + 1), (0, 0))).reshape(blocks, -1)
    pulls = (powers[::-1] @ spread).transpose(0, 2, 1).reshape(told.shape[1], -1)
    pulled = told @ pulls  # (blocks, states): what a block's forces leave at its end

    def follow(x: Array, pull: Array) -> tuple[Array, Array]:
        return jnp.sum(over * x[None, :], axis=1) + pull, x

    over = powers[-1] @ matrices.free[1]
    _, begun = jax.lax.scan(follow, z[plant.slots["start"]], pulled)
    outputs = space.c @ powers  # (block, sensors, states)
    ago = np.arange(BLOCK)[None, :] - 1 - np.arange(BLOCK)[:, None]
    felt = jnp.where((ago >= 0)[..., None, None], (outputs @ spread)[np.maximum(ago, 0)], 0.0)
    seen = told @ felt.transpose(0, 3, 1, 2).reshape(told.shape[1], -1)
    seen = seen + begun @ outputs.transpose(2, 0, 1).reshape(begun.shape[1], -1)
    seen = seen.reshape(blocks * BLOCK, -1)[:count] + drive @ space.d.T
    return seen.T


def _powers(matrix: Array, count: int) -> Array:
    """The first so many powers of a matrix, from none on; a power of two of them."""
    found, last = jnp.eye(matrix.shape[0])[None], matrix
    while len(found) < count:
        found = jnp.concatenate([found, found @ last])
        last = last @ last
    return found
