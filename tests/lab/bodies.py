"""Machines of the bench: rigid bodies in absolute coordinates, their forces summed body by body."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np


@dataclass(frozen=True)
class Element:
    """A spring and a dashpot side by side; `ends` gives its stretch as a row over the bodies."""

    name: str
    ends: np.ndarray
    stiffness: float
    damping: float
    count: int = 1  # so many equal elements side by side; stiffness and damping are of one

    def stretch(self, motion: np.ndarray) -> np.ndarray:
        """Stretch (or its rate) from absolute positions (or velocities), last axis the bodies."""
        return motion @ self.ends


@dataclass(frozen=True)
class Machine:
    """Bodies with an inertia each [kg or kg m^2] and the elements that join them."""

    bodies: tuple[str, ...]
    inertia: np.ndarray
    elements: tuple[Element, ...]
    places: dict[str, tuple[int, ...]] = field(default_factory=dict)  # place -> its elements

    def element(self, name: str) -> Element:
        """The element of that name."""
        return next(item for item in self.elements if item.name == name)

    def body(self, name: str) -> int:
        """The number of the body of that name."""
        return self.bodies.index(name)

    def forces(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Net force on each body: every element pulls its ends, one after the other [N, N m]."""
        total = np.zeros(len(self.bodies))
        for item in self.elements:
            pull = item.stiffness * item.stretch(position) + item.damping * item.stretch(velocity)
            total -= item.count * pull * item.ends
        return total

    def state_matrix(self) -> np.ndarray:
        """Rate of the state (positions, velocities), column by column from unit states."""
        size = len(self.bodies)
        matrix = np.zeros((2 * size, 2 * size))
        matrix[:size, size:] = np.eye(size)
        zero = np.zeros(size)
        for column, unit in enumerate(np.eye(size)):
            matrix[size:, column] = self.forces(unit, zero) / self.inertia
            matrix[size:, size + column] = self.forces(zero, unit) / self.inertia
        return matrix

    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Natural frequencies [Hz] and damping ratios [1] of the oscillating modes, rising."""
        poles = np.linalg.eigvals(self.state_matrix())
        poles = poles[poles.imag > 1e-9 * np.abs(poles)]
        poles = poles[np.argsort(np.abs(poles))]
        return np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)

    def energy(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Kinetic and elastic energy of the linear machine [J]; last axis the bodies."""
        total = 0.5 * (velocity**2) @ self.inertia
        for item in self.elements:
            total = total + 0.5 * item.count * item.stiffness * item.stretch(position) ** 2
        return total

    def hang(self, body: int, deflection: float) -> np.ndarray:
        """Static positions while a hand holds `body` at `deflection` (linear springs)."""
        size = len(self.bodies)
        zero = np.zeros(size)
        stiffness = -np.array([self.forces(unit, zero) for unit in np.eye(size)]).T
        shape = np.linalg.solve(stiffness, np.eye(size)[body])
        return shape * deflection / shape[body]

    def with_element(self, index: int, **changes: float) -> Machine:
        """The same machine with one element changed."""
        items = list(self.elements)
        items[index] = replace(items[index], **changes)
        return replace(self, elements=tuple(items))


def chain(parameters: dict[str, float], layout: dict) -> Machine:
    """A straight line of masses; `layout` holds masses, links (name -> ends) and the motion."""
    names = tuple(layout["masses"])
    unit = "inertia" if layout["motion"] == "rotation" else "mass"
    inertia = np.array([parameters[f"masses.{name}.{unit}"] for name in names])
    elements = []
    for link, (near, far) in layout["links"].items():
        ends = np.zeros(len(names))
        ends[names.index(far)] = 1.0
        if near != "ground":
            ends[names.index(near)] = -1.0
        stiffness = parameters[f"links.{link}.stiffness"]
        elements.append(Element(link, ends, stiffness, parameters[f"links.{link}.damping"]))
    places = {item.name: (index,) for index, item in enumerate(elements)}
    return Machine(names, inertia, tuple(elements), places)


ROBO_V = {
    "clubhead_mass": 0.20277,
    "grip_mass": 0.100,
    "grip_inertia": 0.100 * 0.250**2 / 12,
    "collet_inertia": 0.02809,
    "club_length": 1.090,
    "grip_length": 0.250,
    "sleeve_spacing": 0.0490,
    "sleeve_offset": 0.1005,
    "shaft_stiffness": 139.0,
    "shaft_damping": 0.0807,
    "sleeve_stiffness": 60.0e3,
    "sleeve_damping": 1470.0,
    "wrist_stiffness": 300.0,
    "wrist_damping": 15.0,
}
SLEEVES = {"0 %": (172e3, 950.0), "25 %": (120e3, 3010.0), "50 %": (60e3, 1470.0)}


def levers(parameters: dict[str, float]) -> tuple[float, float, float]:
    """Lever arms [m]: pivot to grip, grip to clubhead, half the spacing of the sleeve's sets."""
    half = parameters["sleeve_spacing"] / 2
    reach = parameters["club_length"] - parameters["grip_length"] / 2
    return parameters["sleeve_offset"] + half, reach, half


def fixed_collet(parameters: dict[str, float]) -> Machine:
    """Grip (moves and turns) in two sets of sleeve elements, the shaft, the clubhead."""
    _, reach, half = levers(parameters)
    sleeve = (parameters["sleeve_stiffness"], parameters["sleeve_damping"], 2)
    shaft = (parameters["shaft_stiffness"], parameters["shaft_damping"])
    elements = (
        Element("sleeve_upper", np.array([1.0, -half, 0.0]), *sleeve),
        Element("sleeve_lower", np.array([1.0, half, 0.0]), *sleeve),
        Element("shaft", np.array([-1.0, -reach, 1.0]), *shaft),
        Element("air", np.array([0.0, 0.0, 1.0]), 0.0, 0.0),
    )
    inertia = np.array([parameters[k] for k in ("grip_mass", "grip_inertia", "clubhead_mass")])
    places = {"sleeve": (0, 1), "shaft": (2,), "clubhead": (3,)}
    return Machine(("grip", "grip_turn", "clubhead"), inertia, elements, places)


def pinned_wrist(parameters: dict[str, float]) -> Machine:
    """The same club in a collet that turns about a sprung and damped wrist; absolute positions."""
    near, reach, half = levers(parameters)
    sleeve = (parameters["sleeve_stiffness"], parameters["sleeve_damping"], 2)
    shaft = (parameters["shaft_stiffness"], parameters["shaft_damping"])
    wrist = (parameters["wrist_stiffness"], parameters["wrist_damping"])
    elements = (
        Element("sleeve_upper", np.array([-(near - half), 1.0, -half, 0.0]), *sleeve),
        Element("sleeve_lower", np.array([-(near + half), 1.0, half, 0.0]), *sleeve),
        Element("shaft", np.array([0.0, -1.0, -reach, 1.0]), *shaft),
        Element("air", np.array([0.0, 0.0, 0.0, 1.0]), 0.0, 0.0),
        Element("wrist", np.array([1.0, 0.0, 0.0, 0.0]), *wrist),
    )
    names = ("collet_inertia", "grip_mass", "grip_inertia", "clubhead_mass")
    inertia = np.array([parameters[name] for name in names])
    places = {"sleeve": (0, 1), "shaft": (2,), "clubhead": (3,), "wrist": (4,)}
    return Machine(("collet", "grip", "grip_turn", "clubhead"), inertia, elements, places)
