"""A structure of the bench: matrices, the springs at its places, and what its sensors see."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import eigh

from .bodies import Machine, fixed_collet, levers, pinned_wrist


@dataclass(frozen=True)
class Springs:
    """Springs and dashpots side by side at one place, one row a station.

    A station's stretch is `rows @ q - follow * angle`, with the angle of the drive [rad].
    `count` equal ones sit at each station; stiffness and damping are of one.
    """

    rows: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    count: np.ndarray
    follow: np.ndarray

    def stretch(self, motion: np.ndarray, angle: np.ndarray | float = 0.0) -> np.ndarray:
        """Stretch (or rate) of every station from positions (or velocities), last axis them."""
        return motion @ self.rows.T - np.multiply.outer(angle, self.follow)


@dataclass(frozen=True)
class View:
    """What a perfect sensor sees: `row` over positions (order 0), velocities or accelerations."""

    row: np.ndarray
    order: int
    quantity: str
    place: str
    frame: str = "absolute"
    follow: float = 0.0  # times the drive's angle, taken away


@dataclass(frozen=True)
class Structure:
    """Matrices of a linear structure with its places; positions are absolute [m, rad]."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    places: Mapping[str, Springs]
    points: Mapping[str, np.ndarray]  # rows of positions where something may be attached
    views: Mapping[str, View] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Number of positions."""
        return len(self.mass)

    @property
    def drive_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces by a unit angle and by a unit rate of the drive."""
        by_angle, by_rate = np.zeros(self.size), np.zeros(self.size)
        for item in self.places.values():
            pull = item.count * item.follow
            by_angle += (pull * item.stiffness) @ item.rows
            by_rate += (pull * item.damping) @ item.rows
        return by_angle, by_rate

    def tones(self) -> np.ndarray:
        """Natural frequencies without damping [Hz], rising."""
        squares = eigh(self.stiffness, self.mass, eigvals_only=True)
        return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)

    def poles(self) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies [Hz] and damping ratios of the modes that oscillate, rising."""
        found = np.linalg.eigvals(self.state_matrix())
        found = found[found.imag > 1e-6 * np.abs(found)]
        found = found[np.argsort(np.abs(found))]
        return np.abs(found) / (2 * np.pi), -found.real / np.abs(found)

    def state_matrix(self) -> np.ndarray:
        """Rate of the state (positions, velocities)."""
        size = self.size
        matrix = np.zeros((2 * size, 2 * size))
        matrix[:size, size:] = np.eye(size)
        matrix[size:, :size] = -np.linalg.solve(self.mass, self.stiffness)
        matrix[size:, size:] = -np.linalg.solve(self.mass, self.damping)
        return matrix

    def energy(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Kinetic and elastic energy [J]; last axis the positions."""
        moving = np.einsum("...i,ij,...j", velocity, self.mass, velocity)
        bent = np.einsum("...i,ij,...j", position, self.stiffness, position)
        return 0.5 * (moving + bent)

    def held(self, point: str, deflection: float) -> np.ndarray:
        """Static positions while a hand holds `point` at `deflection`."""
        row = self.points[point]
        shape = np.linalg.solve(self.stiffness, row)
        return shape * deflection / (row @ shape)

    def without_damping(self) -> Structure:
        """The same without any damping."""
        places = {
            name: replace(item, damping=0 * item.damping) for name, item in self.places.items()
        }
        return replace(self, damping=0 * self.damping, places=places)

    def loaded(self, point: str, mass: float) -> Structure:
        """The same with a mass [kg, kg m^2] stuck to a point."""
        row = self.points[point]
        return replace(self, mass=self.mass + mass * np.outer(row, row))

    def tied(self, point: str, stiffness: float, damping: float) -> Structure:
        """The same with a spring and a dashpot from a point to the ground."""
        square = np.outer(self.points[point], self.points[point])
        return replace(
            self,
            stiffness=self.stiffness + stiffness * square,
            damping=self.damping + damping * square,
        )

    def with_rider(self, point: str, mass: float, hertz: float, ratio: float) -> Structure:
        """The same with a small oscillator that rides on a point."""
        beat = 2 * np.pi * hertz
        grown = self.grown(1)
        row = np.append(-self.points[point], 1.0)
        square = np.outer(row, row) * mass
        own = np.zeros((self.size + 1, self.size + 1))
        own[-1, -1] = mass
        return replace(
            grown,
            mass=grown.mass + own,
            stiffness=grown.stiffness + beat**2 * square,
            damping=grown.damping + 2 * ratio * beat * square,
        )

    def grown(self, more: int) -> Structure:
        """The same with further positions that nothing holds yet."""

        def wide(matrix: np.ndarray) -> np.ndarray:
            return np.pad(matrix, [(0, more)] * 2)

        def longer(row: np.ndarray) -> np.ndarray:
            return np.pad(row, [(0, 0)] * (row.ndim - 1) + [(0, more)])

        places = {k: replace(item, rows=longer(item.rows)) for k, item in self.places.items()}
        views = {k: replace(view, row=longer(view.row)) for k, view in self.views.items()}
        points = {k: longer(row) for k, row in self.points.items()}
        matrices = wide(self.mass), wide(self.damping), wide(self.stiffness)
        return Structure(*matrices, places, points, views)


def lumped(numbers: Mapping[str, float], model: str) -> Structure:
    """The thesis's club of four bodies, its forces summed body by body (bench A).

    Args:
        numbers: of the club, by the rig's names [SI].
        model: fixed_collet, pinned_wrist or driven_wrist.
    """
    fixed = model == "fixed_collet"
    machine = (fixed_collet if fixed else pinned_wrist)(dict(numbers))
    places = {
        name: _springs(machine, chosen, driven=name == "wrist" and model == "driven_wrist")
        for name, chosen in machine.places.items()
    }
    size, zero = len(machine.bodies), np.zeros(len(machine.bodies))
    stiffness = -np.array([machine.forces(unit, zero) for unit in np.eye(size)]).T
    damping = -np.array([machine.forces(zero, unit) for unit in np.eye(size)]).T
    near, reach, _ = levers(dict(numbers))
    rows = {name: np.eye(size)[machine.body(name)] for name in machine.bodies}
    collet = zero if fixed else rows["collet"]
    points = {"clubhead": rows["clubhead"], "collet": collet, "grip": rows["grip"]}
    bend = rows["clubhead"] - rows["grip"] - reach * rows["grip_turn"]
    views = club_views(points, (near + reach) * collet, bend)
    return Structure(np.diag(machine.inertia), damping, stiffness, places, points, views)


def _springs(machine: Machine, chosen: tuple[int, ...], driven: bool) -> Springs:
    items = [machine.elements[number] for number in chosen]
    return Springs(
        np.array([item.ends for item in items]),
        np.array([item.stiffness for item in items]),
        np.array([item.damping for item in items]),
        np.array([float(item.count) for item in items]),
        np.full(len(items), float(driven)),
    )


def club_views(
    points: Mapping[str, np.ndarray], carried: np.ndarray, bend: np.ndarray
) -> dict[str, View]:
    """The sensors that a club can have; `carried` is the head's motion with the collet alone."""
    head = points["clubhead"]
    views = {
        "head": View(head, 2, "acceleration", "clubhead"),
        "head_collet": View(head - carried, 2, "acceleration", "clubhead", "collet"),
        "shaft": View(bend, 0, "deflection", "shaft", "collet"),
    }
    if np.any(points["collet"]):
        views["collet"] = View(points["collet"], 0, "angle", "collet")
    return views
