"""Where a mechanism with laws balances while one place is held."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .drives import Hold, check_balance, equilibrium, hold_rows
from .energies import stiffness_matrix
from .extended import Acting
from .law import Place
from .linear import Mechanism
from .swung_plant import force_at_rest, swings_of

NEWTON_STEPS = 40
RAMPS = 8


def held_force(acting: Acting, stretch: Any, here: Place) -> Any:
    """Force of a law [N or N m] on a place that has been loaded slowly and is held."""
    law, rest = acting.law, 0.0 * stretch
    if law.memory is None:
        assert law.force is not None
        return law.force(acting.strength, stretch, rest, here)
    shapes = law.memory.shapes_at(acting.shapes, acting.strength, here)
    memory = law.memory.begin(shapes, stretch, rest)
    return law.memory.force(acting.strength, shapes, memory, stretch, rest)


def law_equilibrium(
    mechanism: Mechanism,
    numbers: Mapping[str, float],
    hold: Hold,
    laws: Iterable[Acting],
    rounding: Mapping[str, tuple[float, float]],
) -> np.ndarray:
    """Balance under the force that holds one place displaced, with laws in force.

    Args:
        mechanism: chain or robot.
        numbers: its numbers by name [SI].
        hold: the place and its displacement.
        laws: what acts.
        rounding: widths in (stretch, rate) of each place [SI].

    Returns:
        Coordinates, shape (n,) [m or rad].

    Raises:
        ValueError: where none was found.

    Source: Newton's method from the linear balance, the laws' strengths raised in steps.
    """
    n = len(mechanism.coordinates)
    stiffness = stiffness_matrix(mechanism.rows(numbers))[:n, :n]
    push, seen = hold_rows(mechanism, numbers, hold)
    placed = [
        (
            acting,
            *mechanism.place_rows(acting.place, numbers),
            mechanism.push_rows(acting.place, numbers),
            rounding[acting.place],
        )
        for acting in laws
    ]

    def imbalance(unknown: jax.Array, share: float) -> jax.Array:
        q = unknown[:n]
        force = stiffness @ q - push * unknown[n]
        for acting, rows, k, c, pushes, (wide, fast) in placed:
            stretch = rows[:, :n] @ q
            if acting.law in swings_of(mechanism):
                pull = force_at_rest(numbers, acting.law, acting.place, acting.strength, stretch)
            else:
                pull = held_force(acting, stretch, Place(k, c, wide, fast))
            force = force + share * pushes.T @ pull
        return jnp.append(force, seen @ q - hold.displacement)

    start, force = equilibrium(mechanism, numbers, hold)
    unknown = jnp.append(start, force)
    check_balance(np.asarray(start), np.asarray(seen @ start), hold)
    slope = jax.jit(jax.jacfwd(imbalance))
    for share in np.linspace(0.0, 1.0, RAMPS + 1)[1:]:
        for _ in range(NEWTON_STEPS):
            move = jnp.linalg.solve(slope(unknown, share), imbalance(unknown, share))
            unknown = unknown - move
            if not np.max(np.abs(move)) > 1e-12 * np.max(np.abs(unknown)):
                break
    left = np.abs(np.asarray(imbalance(unknown, 1.0))[:n])
    size = np.max(np.abs(stiffness) @ np.abs(unknown[:n])) + abs(float(unknown[n]))
    settled = np.all(left <= 1e-6 * size)
    found = np.asarray(unknown[:n]) if settled else np.full(n, np.nan)
    check_balance(found, np.asarray(seen @ found), hold)
    return found
