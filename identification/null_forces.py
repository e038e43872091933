"""What a law's force would be, by its strength, while it is still nothing and motions are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..model.law import Law, Place
from ..model.law_forces import begun
from ..model.linear import Array
from .prepare import Prepared
from .slopes import padded_lanes


@dataclass(frozen=True, eq=False)
class Spot:
    """A row of a place in one record, and how it moves.

    Attributes:
        row: where it stands among all rows [-].
        place: its numbers [SI].
        stretch: shape (t,) [m or rad].
        rate: shape (t,) [m/s or rad/s].
    """

    row: int
    place: Place
    stretch: np.ndarray
    rate: np.ndarray


def unit_forces(
    law: Law, shapes: Sequence[Sequence[float]], spots: Sequence[Spot], prepared: Prepared
) -> list[np.ndarray]:
    """Derivatives of a law's force by its strength at zero strength, wherever it may act.

    Args:
        law: that acts by a force.
        shapes: its further numbers at each spot [in their units].
        spots: where it acts, and how that moves.
        prepared: the record.

    Returns:
        One of shape (t,) for each spot [force/strength].

    Source: tests/identification/test_screen.py.
    """
    # filled up to the record's compiled length, and to few numbers of spots
    filled = [*range(len(spots))] + [0] * (padded_lanes(len(spots)) - len(spots))
    known = np.array(
        [
            [*shapes[i], p.stiffness, p.damping, p.stretch_width, p.rate_width]
            for i in filled
            for p in [spots[i].place]
        ],
        dtype=float,
    )
    longer = len(prepared.inputs) - len(spots[0].stretch)
    seen = [
        np.stack([np.pad(part, (0, longer), mode="edge") for part in parts])
        for parts in ([spots[i].stretch for i in filled], [spots[i].rate for i in filled])
    ]
    if law.memory is None:
        found = _slopes_at_null(law, known, *seen)
    else:
        found = _all_along(law, known, *seen, prepared.step, prepared.since)
    return [one[: len(spot.stretch)] for one, spot in zip(np.asarray(found), spots, strict=False)]


@partial(jax.jit, static_argnums=0)
def _slopes_at_null(law: Law, known: Array, stretch: Array, rate: Array) -> Array:
    place = Place(*(known[:, -4 + i, None] for i in range(4)))
    force = law.force
    assert force is not None

    def at(strength: Array) -> Array:
        return force(strength, stretch, rate, place)

    return jax.jvp(at, (jnp.zeros(()),), (jnp.ones(()),))[1] + jnp.zeros_like(stretch)


@partial(jax.jit, static_argnums=0)
def _all_along(
    law: Law, known: Array, stretch: Array, rate: Array, step: Array, since: Array
) -> Array:
    along = partial(_along, law)
    return jax.vmap(along, in_axes=(0, 0, 0, None, None))(known, stretch, rate, step, since)


def _along(law: Law, known: Array, stretch: Array, rate: Array, step: Array, since: Array) -> Array:
    memory = law.memory
    assert memory is not None
    shapes, place = [*known[:-4]], Place(known[-4], known[-3], 0.0, 0.0)
    points = stretch[:, None], rate[:, None]
    first = points[0][0], points[1][0]
    rest = points[0][1:], points[1][1:]

    def forces(strength: Array) -> Array:
        told = memory.shapes_at(shapes, strength, place)

        def advance(carry: tuple[Any, Any, Any], now: tuple[Any, Any]) -> tuple[Any, Any]:
            remembered, *before = carry
            remembered = memory.advance(told, remembered, before, now, step)
            return (remembered, *now), memory.force(strength, told, remembered, *now)[0]

        start = begun(memory, told, first, since)
        _, later = jax.lax.scan(advance, (start, *first), rest)
        return jnp.concatenate([memory.force(strength, told, start, *first), later])

    if not memory.placed:  # then the force is proportional to the strength
        return forces(jnp.ones(()))
    return jax.jvp(forces, (jnp.zeros(()),), (jnp.ones(()),))[1]
