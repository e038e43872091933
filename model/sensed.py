"""What sensors tell of a motion that was marched."""

from __future__ import annotations

import jax.numpy as jnp

from .acting import ActingRows
from .chain import DERIVATIVES, FORCES
from .delay import shift
from .linear import Array
from .march import driven, offset_mask
from .plant import Plant, laws_of
from .swung_plant import swings_of, swung_readings, swung_rows
from .tilt import tilted
from .varied import Point


def read_out(
    bare: Plant,
    acting: ActingRows,
    step: Array,
    at: Point,
    motion: tuple[Array, Array],
    pushes: Array | None = None,
) -> Array:
    """What the sensors tell of states and law forces, shape (t, sensors) [SI]."""
    z, (states, forces), space = at.z, motion, at.linear.space
    drive = at.inputs + z[bare.slots["drive"]] * offset_mask(bare)
    parts = [_felt(bare, drive, step), forces]
    felt = jnp.concatenate(parts if pushes is None else [parts[0], pushes, parts[1]], axis=1)
    outputs = driven(states, space.c) + driven(felt, space.d)
    if forces.shape[1] and swings_of(bare.mechanism):
        now = acting._replace(strengths=at.strengths)
        outputs = outputs + _swung(bare, z, now, states, drive)
    numbers, tilt = bare.numbers(z), z[bare.slots["tilt"]]
    outputs = outputs + tilted(bare, numbers, tilt, states, outputs)
    outputs = shift(outputs, z[bare.slots["delay"]] / step) * (1.0 + z[bare.slots["gain"]])
    return outputs + z[bare.slots["offset"]]


def _swung(bare: Plant, z: Array, acting: ActingRows, states: Array, drive: Array) -> Array:
    """What the laws of a told motion add to the sensors, shape (t, sensors) [SI]."""
    numbers, at, found = bare.numbers(z), 0, {}
    first = acting.select @ swung_rows(bare.mechanism, numbers).first
    for law in laws_of(bare):
        if law in swings_of(bare.mechanism):
            found[law.name] = acting.strengths[at] @ first
        at += 1 + len(law.shapes)
    return swung_readings(bare, numbers, found, states, drive)


def _felt(plant: Plant, drive: Array, step: Array) -> Array:
    """Inputs at the samples in the state's terms: of a position its rate, mean of both sides."""
    columns = list(drive.T)
    for index, port in enumerate(plant.inputs):
        if port.quantity not in FORCES and DERIVATIVES[port.quantity] == 0:
            slope = jnp.diff(drive[:, index]) / step
            before = jnp.concatenate([slope[:1], slope])
            columns[index] = 0.5 * (before + jnp.concatenate([slope, slope[-1:]]))
    return jnp.stack(columns, axis=1) if columns else drive
