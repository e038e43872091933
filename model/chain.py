"""A chain is a rig of masses, springs and dashpots that a user describes, seen like a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp

from .energies import Rows

GROUND = "ground"
DERIVATIVES = {
    "position": 0,
    "deflection": 0,
    "angle": 0,
    "strain": 0,
    "voltage": 0,
    "velocity": 1,
    "angular_velocity": 1,
    "acceleration": 2,
    "angular_acceleration": 2,
}
"""How many time derivatives of a displacement a measured quantity is [-]."""

FORCES = ("force", "torque")


@dataclass(frozen=True)
class Chain:
    """Masses joined by links, each link a spring beside a dashpot; translation or rotation.

    Attributes:
        masses: names of the bodies, in the order of the coordinates.
        links: name and the two ends of each link; an end is a mass or ``ground``.
        rotation: whether coordinates are angles [rad] instead of displacements [m].
    """

    masses: tuple[str, ...]
    links: tuple[tuple[str, str, str], ...]
    rotation: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers that the chain is made of (units: see the rig's parameters)."""
        inertia = "inertia" if self.rotation else "mass"
        bodies = [f"masses.{mass}.{inertia}" for mass in self.masses]
        joints = [f"links.{name}.{what}" for name, _, _ in self.links for what in _LINK]
        return tuple(bodies + joints)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the generalized coordinates [m or rad], one a mass."""
        return self.masses

    @property
    def grounds(self) -> tuple[str, ...]:
        """What can be moved from outside: the ground [m or rad], the last column of the rows."""
        return (GROUND,)

    @property
    def carried(self) -> tuple[tuple[float, ...], ...]:
        """How far each coordinate starts moved along with the ground: not at all [1]."""
        return ((0.0,) * len(self.masses),)

    @property
    def springs(self) -> tuple[str, ...]:
        """The place of each spring row: the link's name."""
        return tuple(name for name, _, _ in self.links)

    def turns(self, place: str) -> bool:
        """Whether `place` turns [rad] rather than moves [m]."""
        return self.rotation

    def law_places(self) -> dict[str, str]:
        """Where a law can act: every link (``link``) and every mass (``mass``)."""
        places = dict.fromkeys(self.masses, "mass")
        return places | dict.fromkeys(self.springs, "link")

    def rows(self, p: Mapping[str, Any], xp: Any = jnp) -> Rows:
        """Rows of the energies; the last column is the motion of the ground.

        Args:
            p: the chain's numbers by name [SI].
            xp: array namespace, jax.numpy by default.

        Returns:
            Rows with ``len(masses) + 1`` columns.
        """
        n = len(self.masses)
        inertia = "inertia" if self.rotation else "mass"
        bodies = xp.asarray([p[f"masses.{mass}.{inertia}"] for mass in self.masses])
        stiffness = xp.asarray([p[f"links.{name}.stiffness"] for name, _, _ in self.links])
        damping = xp.asarray([p[f"links.{name}.damping"] for name, _, _ in self.links])
        stretch = [self._stretch(a, b) for _, a, b in self.links]
        return Rows(
            xp.eye(n, n + 1),
            bodies,
            xp.asarray(stretch) if stretch else xp.zeros((0, n + 1)),
            stiffness,
            damping,
        )

    def place_rows(self, place: str, p: Mapping[str, Any], xp: Any = jnp) -> tuple[Any, Any, Any]:
        """Stretch rows of a place with the stiffness and damping that sit there.

        Args:
            place: a link or a mass.
            p: the chain's numbers by name [SI].
            xp: array namespace.

        Returns:
            rows of shape (1, coordinates + 1), stiffness (1,) [N/m or N m/rad], damping (1,)
            [N s/m or N m s/rad]; both zero at a mass.
        """
        for name, a, b in self.links:
            if name == place:
                k, c = p[f"links.{name}.stiffness"], p[f"links.{name}.damping"]
                return xp.asarray([self._stretch(a, b)]), xp.asarray([k]), xp.asarray([c])
        return xp.asarray([self._stretch(GROUND, place)]), xp.zeros(1), xp.zeros(1)

    def push_rows(self, place: str, p: Mapping[str, Any], xp: Any = jnp) -> Any:
        """Generalized forces of unit forces in a place's rows, shape (1, coordinates) [1]."""
        return self.place_rows(place, p, xp)[0][:, :-1]

    def force_row(self, place: str, p: Mapping[str, Any], xp: Any = jnp) -> Any:
        """Generalized force of a unit force or torque at `place`, shape (coordinates,) [1]."""
        for name, a, b in self.links:
            if name == place:
                return xp.asarray(self._stretch(a, b)[:-1])
        return xp.asarray(self._stretch(GROUND, place)[:-1])

    def sensor_row(self, place: str, quantity: str, frame: str, p: Any, xp: Any = jnp) -> Any:
        """Row that turns coordinates into what a sensor at `place` sees, shape (n + 1,) [1].

        A sensor on a link sees its stretch; on a mass its motion; on the ground the ground's.
        """
        for name, a, b in self.links:
            if name == place:
                return xp.asarray(self._stretch(a, b))
        if place in (GROUND, "base"):
            return xp.asarray([0.0] * len(self.masses) + [1.0])
        return xp.asarray(self._stretch(GROUND, place, moving=False))

    def _stretch(self, a: str, b: str, moving: bool = True) -> list[float]:
        row = [0.0] * (len(self.masses) + 1)
        for end, sign in ((a, -1.0), (b, 1.0)):
            if end in (GROUND, "base"):
                row[-1] += sign if moving else 0.0
            else:
                row[self.masses.index(end)] += sign
        return row


_LINK = ("stiffness", "damping")
