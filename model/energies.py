"""Energies of a mechanism, written once: rows of velocities and stretches with their constants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Array = Any  # numpy, jax or casadi: the formulas below are the same for all three


@dataclass(frozen=True)
class Rows:
    """The rows from which a mechanism's energies are made.

    Attributes:
        inertia_rows: J, shape (inertias, coordinates): velocity of each inertia is ``J v``
            [1 or m].
        inertias: m, shape (inertias,) [kg or kg m^2].
        spring_rows: G, shape (springs, coordinates): stretch of each spring is ``G q`` [1 or m].
        stiffnesses: k, shape (springs,) [N/m or N m/rad].
        dampings: c, shape (springs,) [N s/m or N m s/rad].
    """

    inertia_rows: Array
    inertias: Array
    spring_rows: Array
    stiffnesses: Array
    dampings: Array


def kinetic_energy(rows: Rows, velocity: Array) -> Array:
    """Kinetic energy ``1/2 sum m (J v)^2`` [J] at generalized velocities `velocity`.

    Source: the symmetric energy form; equals the thesis's eq. 8-10 for the fixed collet, see
    tests/model/test_energies.py.
    """
    speed = rows.inertia_rows @ velocity
    return 0.5 * (rows.inertias * speed * speed).sum()


def potential_energy(rows: Rows, position: Array) -> Array:
    """Potential energy ``1/2 sum k (G q)^2`` [J] at generalized positions `position`."""
    stretch = rows.spring_rows @ position
    return 0.5 * (rows.stiffnesses * stretch * stretch).sum()


def dissipation(rows: Rows, velocity: Array) -> Array:
    """Rayleigh's dissipation ``1/2 sum c (G v)^2`` [W] at generalized velocities `velocity`."""
    rate = rows.spring_rows @ velocity
    return 0.5 * (rows.dampings * rate * rate).sum()


def mass_matrix(rows: Rows) -> Array:
    """Hessian of the kinetic energy, ``J' diag(m) J``, shape (n, n) [kg or kg m^2]."""
    return rows.inertia_rows.T @ (rows.inertias[:, None] * rows.inertia_rows)


def stiffness_matrix(rows: Rows) -> Array:
    """Hessian of the potential energy, ``G' diag(k) G``, shape (n, n) [N/m or N m/rad]."""
    return rows.spring_rows.T @ (rows.stiffnesses[:, None] * rows.spring_rows)


def damping_matrix(rows: Rows) -> Array:
    """Hessian of the dissipation, ``G' diag(c) G``, shape (n, n) [N s/m or N m s/rad]."""
    return rows.spring_rows.T @ (rows.dampings[:, None] * rows.spring_rows)
