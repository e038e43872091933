"""Modes of many designs without eigenvectors: minors of their rows, roots, cofactors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import combinations
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..model.chain import DERIVATIVES
from ..model.drives import Hold, equilibrium, hold_rows
from ..model.energies import damping_matrix, mass_matrix, stiffness_matrix
from ..model.linear import Mechanism, Port
from .sweep_roots import roots_of

MOST_COORDINATES, MOST_ELEMENTS = 4, 7
"""Coordinates, and bodies or springs, up to which all minors are taken [-]."""

STILL = 1e-12
"""A pole smaller than this share of the largest is one at rest [-]."""


@dataclass(frozen=True)
class Modes:
    """Poles of some designs with what starts them and what is seen of them, designs leading.

    Attributes:
        poles: shape (designs, modes) [1/s].
        vectors: displacement rows of each mode, shape (designs, coordinates, modes) [m or rad].
        seen: each mode at each sensor, shape (designs, sensors, modes) [SI unit of the sensor].
        state: modal state of what is held, shape (designs, modes) [1].
        push: modal state after a unit impulse of the force, shape (designs, modes) [1].
        rest: each sensor under a constant unit force, shape (designs, sensors) [SI].
        start: coordinates of what is held, shape (designs, coordinates) [m or rad].
        held: what the hand sees of them, shape (designs,) [m or rad].
        sound: whether all roots of a design are found, shape (designs,), truth values [-].
    """

    poles: np.ndarray
    vectors: np.ndarray
    seen: np.ndarray
    state: np.ndarray
    push: np.ndarray
    rest: np.ndarray
    start: np.ndarray
    held: np.ndarray
    sound: np.ndarray

    @property
    def gain(self) -> np.ndarray:
        """Less the modal state that a constant unit force holds, shape (designs, modes) [1]."""
        return gain_of(self.poles, self.push)

    def completed(self, others: Modes) -> Modes:
        """These where they are sound, and otherwise others of the same designs."""

        def either(mine: np.ndarray, other: np.ndarray) -> np.ndarray:
            return np.where(self.sound.reshape(-1, *[1] * (mine.ndim - 1)), mine, other)

        both = zip(vars(self).values(), vars(others).values(), strict=True)
        return Modes(*(either(mine, other) for mine, other in both))


def gain_of(poles: np.ndarray, push: np.ndarray) -> np.ndarray:
    """See `Modes.gain`; no number where a pole that is pushed is at rest [1]."""
    size = np.abs(poles)
    moving = size > STILL * size.max(axis=1, keepdims=True)
    none = np.where(push == 0, 0.0, np.nan)
    return np.where(moving, push / np.where(moving, poles, 1.0), none)


@cache
def has_minors(mechanism: Mechanism, varied: tuple[str, ...]) -> bool:
    """Whether a mechanism is small, and keeps its rows where some of its numbers are varied.

    Args:
        mechanism: chain or robot.
        varied: names of the numbers; lengths change the rows, masses and springs do not.

    Returns:
        Whether `modes_of` can be asked.
    """
    p = {name: 1.0 + 0.1 * k for k, name in enumerate((*mechanism.names, *varied))}
    first = mechanism.rows(p, np)
    small = max(len(first.inertias), len(first.stiffnesses)) <= MOST_ELEMENTS
    if not small or len(mechanism.coordinates) > MOST_COORDINATES:
        return False
    for name in varied:
        other = mechanism.rows(p | {name: 0.77 * p[name]}, np)
        same = np.array_equal(first.inertia_rows, other.inertia_rows)
        if not (same and np.array_equal(first.spring_rows, other.spring_rows)):
            return False
    return True


@lru_cache(64)
def squared_minors(mechanism: Mechanism, numbers: tuple[tuple[str, float], ...]) -> np.ndarray:
    """Squares of all largest minors of a mechanism's rows.

    Args:
        mechanism: chain or robot.
        numbers: name and value of each number [SI].

    Returns:
        Shape (2^springs, 2^bodies): bit k of an index says whether body or spring k is taken.
    """
    rows = mechanism.rows(dict(numbers), np)
    n, bodies, springs = len(mechanism.coordinates), len(rows.inertias), len(rows.stiffnesses)
    whole = np.concatenate([rows.inertia_rows[:, :n], rows.spring_rows[:, :n]])
    taken = np.array(list(combinations(range(bodies + springs), n)))
    bits = np.sum(1 << taken, axis=1)
    found = np.zeros((2**springs, 2**bodies))
    found[bits >> bodies, bits & (2**bodies - 1)] = np.linalg.det(whole[taken]) ** 2
    return found


def characteristic(
    minors: np.ndarray, elements: tuple[np.ndarray, np.ndarray, np.ndarray], coordinates: int
) -> np.ndarray:
    """Coefficients of ``det(M s^2 + C s + K)``, the constant first; all their terms are positive.

    Args:
        minors: those of `squared_minors`.
        elements: masses, shape (bodies, designs) [kg or kg m^2]; stiffnesses [N/m or N m/rad] and
            dampings [N s/m or N m s/rad], shape (springs, designs).
        coordinates: how many [-].

    Returns:
        Shape (2 coordinates + 1, designs) [SI], each to a few units of its last digit.

    Source: the formula of Cauchy and Binet for ``R' diag(z) R``, z = m s^2 or k + c s.
    """
    masses, stiffnesses, dampings = elements
    designs = masses.shape[1]
    weights = np.ones((1, designs))
    for mass in masses:
        weights = np.concatenate([weights, weights * mass])
    weights = minors @ weights
    found = np.zeros((2 * coordinates + 1, designs))
    factors = [np.ones((1, designs))]
    for k, c in zip(stiffnesses, dampings, strict=True):
        more = []
        for factor in factors:
            one = np.zeros((len(factor) + 1, designs))
            np.multiply(factor, k, out=one[:-1])
            one[1:] += factor * c
            more.append(one)
        factors += more
    for weight, factor, minor in zip(weights, factors, minors, strict=True):
        if minor.any():
            low = 2 * (coordinates + 1 - len(factor))
            found[low : low + len(factor)] += weight * factor
    return found


def _answers(
    z: np.ndarray, parts: tuple[np.ndarray, np.ndarray, np.ndarray], force: np.ndarray
) -> np.ndarray:
    """The adjugate of ``M z^2 + C z + K`` times a force, shape (n, modes, designs) [SI]."""
    mass, damping, stiffness = (part.astype(complex) for part in parts)
    n = len(mass)
    whole: dict[tuple[int, int], np.ndarray] = {}
    for i in range(n):
        for j in range(i, n):
            one = mass[i, j] * z
            one += damping[i, j]
            one *= z
            one += stiffness[i, j]
            whole[i, j] = whole[j, i] = one
    minors: dict[tuple[tuple[int, ...], tuple[int, ...]], np.ndarray] = {}

    def minor(rows: tuple[int, ...], columns: tuple[int, ...]) -> np.ndarray:
        rows, columns = min(rows, columns), max(rows, columns)  # it is symmetric
        if len(rows) == 1:
            return whole[rows[0], columns[0]]
        if (rows, columns) not in minors:
            total = whole[rows[0], columns[0]] * minor(rows[1:], columns[1:])
            for at in range(1, len(columns)):
                rest = columns[:at] + columns[at + 1 :]
                part = whole[rows[0], columns[at]] * minor(rows[1:], rest)
                (np.subtract if at % 2 else np.add)(total, part, out=total)
            minors[rows, columns] = total
        return minors[rows, columns]

    found = np.zeros((n, *z.shape), complex)
    for j in np.flatnonzero(force.any(axis=1)):
        for i in range(n):
            rows, columns = (tuple(k for k in range(n) if k != at) for at in (i, j))
            own = force[j] * (-1.0) ** (i + j)
            found[i] += own.astype(complex) * minor(rows, columns) if n > 1 else own
    return found


def modes_of(
    mechanism: Mechanism,
    inputs: tuple[Port, ...],
    sensors: tuple[Port, ...],
    hold: Hold | None,
    varied: Mapping[str, Any],
    fixed: Mapping[str, float],
) -> Modes:
    """Modes of designs whose rows are the same, see `has_minors`.

    Args:
        mechanism: chain or robot.
        inputs: a force or torque, or nothing.
        sensors: what is seen.
        hold: what a release lets go of, or nothing.
        varied: numbers that differ, each of shape (designs,) [SI].
        fixed: the others [SI].

    Returns:
        The modes; those of designs that are not sound are to be found otherwise.

    Source: Cramer's rule. ``adj(Z) F / det(Z)'`` is what an impulse F starts of a pole, and
    ``-adj(Z) K q / (s det(Z)')`` what is in a start q at rest, with ``Z = M s^2 + C s + K``;
    tests/optimize/test_sweep_poles.py.
    """
    whole = {**dict.fromkeys(varied, 1.0), **fixed}
    minors = squared_minors(mechanism, tuple(sorted(whole.items())))
    numbers = np.array(list(fixed.values())), np.stack(list(varied.values()))
    made = _parts(mechanism, inputs, sensors, hold, (tuple(fixed), tuple(varied)), *numbers)
    elements, parts, start, held, force, looks = jax.tree.map(np.asarray, made)
    z, slope, sound = roots_of(characteristic(minors, elements, len(mechanism.coordinates)))
    with np.errstate(all="ignore"):  # those that are not sound
        vectors = _answers(z, parts, force)
        vectors *= 1.0 / (slope if hold is None else -slope * z)
        seen = np.einsum("imd,sid->smd", vectors, looks)
        for row, sensor in zip(seen, sensors, strict=True):
            for _ in range(DERIVATIVES[sensor.quantity]):
                row *= z
    z, vectors, seen, start = (np.moveaxis(part, -1, 0) for part in (z, vectors, seen, start))
    state, push = np.full(z.shape, float(hold is not None)), np.full(z.shape, float(hold is None))
    rest = np.zeros(seen.shape[:2])
    for k, sensor in enumerate(sensors):
        if DERIVATIVES[sensor.quantity] == 0 and hold is None:
            with np.errstate(all="ignore"):
                rest[:, k] = -np.real(seen[:, k] / z).sum(axis=1)
    return Modes(z, vectors, seen, state, push, rest, start, held, sound)


@partial(jax.jit, static_argnums=(0, 1, 2, 3, 4))
def _parts(
    mechanism: Mechanism,
    inputs: tuple[Port, ...],
    sensors: tuple[Port, ...],
    hold: Hold | None,
    names: tuple[tuple[str, ...], tuple[str, ...]],
    fixed: Any,
    varied: Any,
) -> tuple[Any, ...]:
    """Elements, M, C and K, start and what the hand sees of it, force or pull there, looks."""
    n = len(mechanism.coordinates)

    def one(own: Any) -> tuple[Any, ...]:
        p = dict(zip((*names[0], *names[1]), (*fixed, *own), strict=True))
        rows = mechanism.rows(p)
        parts = [part(rows)[:n, :n] for part in (mass_matrix, damping_matrix, stiffness_matrix)]
        start, held, force = jnp.zeros(n), jnp.zeros(()), jnp.zeros(n)
        if hold is not None:
            start, _ = equilibrium(mechanism, p, hold)
            held = hold_rows(mechanism, p, hold)[1] @ start
            force = parts[2] @ start
        elif inputs:
            force = mechanism.force_row(inputs[0].place, p)
        looks = [mechanism.sensor_row(s.place, s.quantity, s.frame, p)[:n] for s in sensors]
        elements = rows.inertias, rows.stiffnesses, rows.dampings
        return elements, tuple(parts), start, held, force, jnp.stack(looks)

    return jax.vmap(one, in_axes=-1, out_axes=-1)(varied)
