"""Slopes: how modes and a critical damping move with each number of the mechanism, exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from .energies import damping_matrix, mass_matrix, stiffness_matrix
from .linear import Array, Mechanism, modes


@dataclass(frozen=True)
class ModeSlopes:
    """Derivatives of modes by the mechanism's numbers; the modes are those of `linear.modes`.

    Attributes:
        names: of the numbers.
        poles: shape (numbers, modes) [1/s a unit of the number].
        frequencies: shape (numbers, modes) [Hz a unit of the number].
        damping_ratios: shape (numbers, modes) [1 a unit of the number].
    """

    names: tuple[str, ...]
    poles: np.ndarray
    frequencies: np.ndarray
    damping_ratios: np.ndarray


def mode_slopes(mechanism: Mechanism, p: Mapping[str, float]) -> ModeSlopes:
    """How poles, frequencies and damping ratios move with each number.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI].

    Returns:
        The slopes; not finite at a pole that is double, which has none, and of a frequency that
        is nought.

    Source: ``v' (s^2 M + s C + K) v`` stays nought as M, C, K change, v being its own left vector
    by their symmetry; Lancaster 1964, doi:10.1007/BF01386088; tests/model/test_gradients.py.
    """
    found = modes(mechanism, p)
    matrices, slopes = _with_slopes(mechanism, p)
    s, v = found.poles, found.shapes
    mass, damping, _ = (np.einsum("nm,nk,km->m", v, matrix, v) for matrix in matrices)
    change = [np.einsum("nm,nkp,km->pm", v, slope, v) for slope in slopes]
    with np.errstate(divide="ignore", invalid="ignore"):
        move = -(s**2 * change[0] + s * change[1] + change[2]) / (2 * s * mass + damping)
        size = np.abs(s)
        grown = np.real(np.conj(s) * move) / size
        ratios = -np.real(move) / size + np.real(s) * grown / size**2
    return ModeSlopes(mechanism.names, move, grown / (2 * np.pi), ratios)


def critical_slopes(
    mechanism: Mechanism, p: Mapping[str, float], name: str, critical: float
) -> dict[str, float]:
    """How an end of an interval of critical damping moves with each other number.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI].
        name: the damping that was searched.
        critical: a finite end of one of its intervals, see `critical.critical_damping`, in its
            unit.

    Returns:
        By name of the number [unit of the damping a unit of that number].

    Source: where two real poles meet at s, ``det(s^2 M + s C + K)`` and its slope in s are nought:
    what the numbers change of it the damping undoes; tests/model/test_gradients.py.
    """
    (mass, damping, stiffness), slopes = _with_slopes(mechanism, dict(p) | {name: critical})
    n = len(mass)
    lower = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
    poles = np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))
    gaps = np.abs(poles[:, None] - poles[None]) / np.maximum(np.abs(poles), 1e-300)[:, None]
    one, other = np.unravel_index(np.argmin(gaps + 2.0 * np.eye(2 * n)), gaps.shape)
    s = float(np.real(poles[one] + poles[other])) / 2
    whole = s**2 * mass + s * damping + stiffness
    scale = 1.0 / np.sqrt(s**2 * np.diag(mass) + np.abs(np.diag(stiffness)))
    values, vectors = np.linalg.eigh(scale[:, None] * whole * scale)
    v = vectors[:, np.argmin(np.abs(values))] * scale
    change = np.einsum("n,nkp,k->p", v, s**2 * slopes[0] + s * slopes[1] + slopes[2], v)
    by = dict(zip(mechanism.names, change, strict=True))
    own = by.pop(name)
    return {other: float(-value / own) for other, value in by.items()}


def _with_slopes(
    mechanism: Mechanism, p: Mapping[str, float]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """M, C, K, each (n, n), and their derivatives by the numbers, each (n, n, numbers)."""
    at = jnp.asarray([float(p[name]) for name in mechanism.names])
    found = _matrices(mechanism, at), _matrix_slopes(mechanism, at)
    values, slopes = ([np.asarray(part) for part in parts] for parts in found)
    return values, slopes


def _matrices(mechanism: Mechanism, at: Array) -> tuple[Array, ...]:
    n = len(mechanism.coordinates)
    rows = mechanism.rows(dict(zip(mechanism.names, at, strict=True)))
    whole = (mass_matrix(rows), damping_matrix(rows), stiffness_matrix(rows))
    return tuple(matrix[:n, :n] for matrix in whole)


@partial(jax.jit, static_argnums=0)
def _matrix_slopes(mechanism: Mechanism, at: Array) -> tuple[Array, ...]:
    return jax.jacfwd(partial(_matrices, mechanism))(at)
