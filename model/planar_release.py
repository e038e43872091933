"""Where a planar motion begins: at rest under its weight, or held displaced by a hand."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from . import planar
from .drives import Hold, check_balance
from .lagrange import Acting, Array, PlanarPlant
from .planar_march import Plane, plant_of
from .quick import quickly

RAMPS = 8
"""Steps in which a hand displaces the club [-]."""

NEWTON_STEPS = 12
"""Newton steps in each of them [-]."""

BALANCED = 1e-9
"""Force left over in a balance, as a share of the forces in it [-]."""


def rest(
    model: str, acting: tuple[Acting, ...], plane: Plane, arm: float, wrist: float
) -> np.ndarray:
    """Coordinates in which the robot rests with its drives held, shape (4,) [rad, m, rad, m].

    Args:
        model: one of `lagrange.MODELS`.
        acting: laws in force.
        plane: the numbers.
        arm: angle of the arm [rad].
        wrist: angle of the wrist drive against the arm [rad].

    Raises:
        ValueError: where nothing holds it against its weight.
    """
    straight = np.array([arm + wrist, 0.0, 0.0, 0.0])
    if not plane.pull or not np.any(straight):
        return straight  # without weight, or hanging straight down
    found = np.asarray(_quick_rest(model, acting, plane, np.array([arm, wrist])))
    if not np.all(np.isfinite(found)):
        raise ValueError(
            "start: expected springs that hold the club against its weight, found none that do. "
            "Mend: give wrist and sleeve a stiffness, or the swing plane an inclination of 0."
        )
    return found


def _rest(model: str, acting: tuple[Acting, ...], plane: Plane, held: Array) -> Array:
    plant = plant_of(model, acting, plane)
    q = plant.balance(jnp.append(held, jnp.zeros(2))[:, None])
    return jnp.concatenate(plant.whole(q))


_quick_rest = quickly(_rest, (0, 1))


def released(model: str, acting: tuple[Acting, ...], plane: Plane, hold: Hold) -> np.ndarray:
    """Balance under a hand that holds one place displaced, the arm at 0, shape (4,) [SI].

    The hand pushes across the line from shoulder to ball, and its displacement is measured along
    that push, or in the collet's frame. Laws that remember have been loaded slowly.

    Args:
        model: one of `lagrange.MODELS`.
        acting: laws in force.
        plane: the numbers.
        hold: the place, the frame and the displacement.

    Raises:
        ValueError: where no such balance was found.

    Source: Newton's method, the displacement raised in steps; tests/model/test_planar_motion.py.
    """
    known = Hold(hold.place, hold.frame, 1.0)
    q, seen, left = _quick_released(model, acting, plane, known, hold.displacement)
    found = np.asarray(q) if float(left) <= BALANCED else np.full(4, np.nan)
    check_balance(found, np.asarray(seen), hold)
    return found


def _displaced(plant: PlanarPlant, x: Array, place: str, frame: str) -> Array:
    """What a displacement is measured by, of coordinates that move, shape (n,) [m or rad]."""
    q, at = plant.whole(tuple(x)), planar.points_of(plant.p)
    if place not in ("clubhead", "grip"):
        return q[0]
    aside = q[3] if place == "clubhead" else q[1]
    if frame == "collet":
        return aside
    reach = at.grip + planar.head_of(plant.p, q).along if place == "clubhead" else at.grip
    return reach * jnp.sin(q[0]) + aside * jnp.cos(q[0])


def _released(
    model: str, acting: tuple[Acting, ...], plane: Plane, hold: Hold, displacement: Any
) -> tuple[Array, Array, Array]:
    plant = plant_of(model, acting, plane)
    n = 3 if plant.fixed else 4
    u, still = plant.held(jnp.zeros(4)), (jnp.zeros(()),) * n

    def forces(x: Array) -> Array:
        q = tuple(x)
        return jnp.stack(plant.imbalance(q, still, still, u, plant.ready(q)))

    def push(x: Array) -> Array:
        return jax.grad(lambda x: _displaced(plant, x, hold.place, "absolute"))(x)

    def left(unknown: Array, wanted: Array) -> Array:
        x, force = unknown[:n], unknown[n]
        seen = _displaced(plant, x, hold.place, hold.frame)
        return jnp.append(forces(x) - push(x) * force, seen - wanted)

    def improve(step: Array, unknown: Array) -> Array:
        wanted = displacement * (step // NEWTON_STEPS + 1) / RAMPS
        slope = jax.jacfwd(left)(unknown, wanted)
        return unknown - jnp.linalg.solve(slope, left(unknown, wanted))

    unknown = jax.lax.fori_loop(0, RAMPS * NEWTON_STEPS, improve, jnp.zeros(n + 1))
    x, slope = unknown[:n], jax.jacfwd(forces)(unknown[:n])
    size = jnp.max(jnp.abs(slope) @ jnp.abs(x)) + jnp.abs(unknown[n]) + 1e-300
    over = jnp.max(jnp.abs(left(unknown, displacement)[:n])) / size
    q = jnp.stack(plant.whole(tuple(x)))
    return q, _displaced(plant, x, hold.place, hold.frame), over


_quick_released = quickly(_released, (0, 1, 3))
