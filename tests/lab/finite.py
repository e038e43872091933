"""A club of finite elements: tapered shaft, rigid head, grip in a distributed sleeve, collet."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

from .structure import Springs, Structure, View, club_views

GRIP_ELEMENTS = 10
FREE_ELEMENTS = 12
STATIONS = GRIP_ELEMENTS + 1
"""The sleeve has a spring and a dashpot at every node of the grip."""

CLUB = {
    "bending_butt": 62.0,  # EI at the butt [N m^2], before it is scaled to the static stiffness
    "bending_tip": 21.0,  # and at the tip
    "line_mass_butt": 0.066,  # rho A [kg/m]
    "line_mass_tip": 0.046,
    "rotary": 2.0e-5,  # rho I of the section [kg m]
    "rubber": 0.080,  # mass of the rubber grip and the clamp plates that go with it [kg]
    "head_inertia": 3.2e-4,  # about its centre, normal to the plane of the swing [kg m^2]
    "head_offset": 0.022,  # from the tip of the shaft to its centre [m]
    "clamped_hertz": 4.167,  # first frequency of the shaft with the grip clamped
    "shaft_stiffness": 139.0,  # at the head's centre, grip clamped [N/m]
    "shaft_ratio": 0.0062,  # damping ratio of the first clamped mode
    "second_ratio": 0.009,  # and of all others
    "club_length": 1.090,  # butt to the head's centre [m]
    "grip_length": 0.250,
    "sleeve_stiffness": 60.0e3,  # of one of four elements that turn the grip as this sleeve does
    "sleeve_damping": 1470.0,
    "sleeve_spacing": 0.0490,
    "sleeve_tilt": 0.0,  # how much stiffer the sleeve is at its lower than at its upper end [1]
    "butt": 0.0,  # from the wrist's pivot to the butt [m]
    "collet_inertia": 0.02809,
    "wrist_stiffness": 300.0,
    "wrist_damping": 15.0,
}


def beam(bending: float, line_mass: float, rotary: float, length: float):
    """Stiffness and consistent mass of an element: (deflection, slope) at each end.

    Euler and Bernoulli's beam with Rayleigh's rotary inertia; the section is even.
    """
    h = length
    stiffness = (bending / h**3) * np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h * h, -6 * h, 2 * h * h],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h * h, -6 * h, 4 * h * h],
        ]
    )
    moving = (line_mass * h / 420) * np.array(
        [
            [156, 22 * h, 54, -13 * h],
            [22 * h, 4 * h * h, 13 * h, -3 * h * h],
            [54, 13 * h, 156, -22 * h],
            [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
        ]
    )
    turning = (rotary / (30 * h)) * np.array(
        [
            [36, 3 * h, -36, 3 * h],
            [3 * h, 4 * h * h, -3 * h, -h * h],
            [-36, -3 * h, 36, -3 * h],
            [3 * h, -h * h, -3 * h, 4 * h * h],
        ]
    )
    return stiffness, moving + turning


def line(edges: np.ndarray, bending, line_mass, rotary: float):
    """Stiffness and mass of elements in a line between `edges`; properties at their middles."""
    size = 2 * len(edges)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for index, (low, high) in enumerate(pairwise(edges)):
        middle = (low + high) / 2
        k, m = beam(bending(middle), line_mass(middle), rotary, high - low)
        mine = slice(2 * index, 2 * index + 4)
        stiffness[mine, mine] += k
        mass[mine, mine] += m
    return stiffness, mass


def shaft_edges(numbers: Mapping[str, float]) -> np.ndarray:
    """Nodes of the shaft from the butt [m]."""
    tip = numbers["club_length"] - numbers["head_offset"]
    grip = np.linspace(0.0, numbers["grip_length"], GRIP_ELEMENTS + 1)
    return np.append(grip, np.linspace(grip[-1], tip, FREE_ELEMENTS + 1)[1:])


def _bare_shaft(numbers: Mapping[str, float], edges: np.ndarray):
    """Matrices of the shaft alone, its head's mass still missing; and that mass [kg].

    The bending is scaled to the static stiffness at the head's centre, and the head's mass chosen
    for the first frequency, both with the grip clamped.
    """
    tip = edges[-1]

    def between(butt: float, end: float, place: float) -> float:
        return butt + (end - butt) * place / tip

    def bending(place: float) -> float:
        return between(numbers["bending_butt"], numbers["bending_tip"], place)

    def line_mass(place: float) -> float:
        rubber = numbers["rubber"] / numbers["grip_length"] * (place < numbers["grip_length"])
        return between(numbers["line_mass_butt"], numbers["line_mass_tip"], place) + rubber

    stiffness, mass = line(edges, bending, line_mass, numbers["rotary"])
    free = slice(2 * GRIP_ELEMENTS + 2, None)
    head = np.zeros(len(mass))
    head[-2:] = 1.0, numbers["head_offset"]
    compliance = head[free] @ np.linalg.solve(stiffness[free, free], head[free])
    stiffness = stiffness * (numbers["shaft_stiffness"] * compliance)
    mass[-1, -1] += numbers["head_inertia"]

    # K - w^2 (M + m h h') is singular at the wanted frequency w for this one mass m
    square = (2 * np.pi * numbers["clamped_hertz"]) ** 2
    rest = stiffness[free, free] - square * mass[free, free]
    kilograms = 1 / (square * (head[free] @ np.linalg.solve(rest, head[free])))
    return stiffness, mass, head, float(kilograms)


def head_mass(numbers: Mapping[str, float]) -> float:
    """Mass of the head that gives the clamped shaft its first frequency [kg]."""
    return _bare_shaft(numbers, shaft_edges(numbers))[3]


def clamped(numbers: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness, mass and the head's row of the shaft beyond a clamped grip."""
    stiffness, mass, head, kilograms = _bare_shaft(numbers, shaft_edges(numbers))
    free = slice(2 * GRIP_ELEMENTS + 2, None)
    mass = mass + kilograms * np.outer(head, head)
    return stiffness[free, free], mass[free, free], head[free]


def _modal_damping(numbers: Mapping[str, float], edges: np.ndarray) -> np.ndarray:
    """Damping by the clamped modes, on what the shaft bends beyond the grip's end alone."""
    stiffness, mass, _ = clamped(numbers)
    squares, shapes = eigh(stiffness, mass)
    ratios = np.full(len(squares), numbers["second_ratio"])
    ratios[0] = numbers["shaft_ratio"]
    weighed = mass @ shapes
    own = weighed @ np.diag(2 * ratios * np.sqrt(squares)) @ weighed.T
    last, size = 2 * GRIP_ELEMENTS, 2 * len(edges)
    bent = np.zeros((size - last - 2, size))
    bent[:, last + 2 :] = np.eye(size - last - 2)
    bent[::2, last] = bent[1::2, last + 1] = -1.0
    bent[::2, last + 1] = -(edges[GRIP_ELEMENTS + 1 :] - edges[GRIP_ELEMENTS])
    return bent.T @ own @ bent


def sleeve_shares(numbers: Mapping[str, float], scatter: np.ndarray) -> np.ndarray:
    """Each station's share of one lumped element's stiffness; together they turn the grip alike."""
    places = np.linspace(0.0, numbers["grip_length"], STATIONS)
    shares = (1 + scatter) * (1 + numbers["sleeve_tilt"] * (places / places[-1] - 0.5))
    shares[[0, -1]] *= 0.5
    turning = shares @ (places - places.mean()) ** 2
    return shares * numbers["sleeve_spacing"] ** 2 / turning


def finite_club(
    numbers: Mapping[str, float], model: str, scatter: np.ndarray | None = None
) -> Structure:
    """The club of elements in its collet (bench B).

    Args:
        numbers: as in `CLUB` [SI].
        model: fixed_collet, pinned_wrist or driven_wrist.
        scatter: of the sleeve from station to station, shape (STATIONS,) [1].
    """
    edges = shaft_edges(numbers)
    stiffness, mass, head, kilograms = _bare_shaft(numbers, edges)
    mass = mass + kilograms * np.outer(head, head)
    damping = _modal_damping(numbers, edges) + 2e-5 * stiffness
    size = len(mass) + 1  # the collet's angle comes first

    def wide(matrix: np.ndarray) -> np.ndarray:
        return np.pad(matrix, [(1, 0), (1, 0)])

    mass, damping, stiffness = wide(mass), wide(damping), wide(stiffness)
    mass[0, 0] = numbers["collet_inertia"]
    reach = numbers["butt"] + edges[:STATIONS]
    rows = np.zeros((STATIONS, size))
    rows[np.arange(STATIONS), 1 + 2 * np.arange(STATIONS)] = 1.0
    rows[:, 0] = -reach
    shares = sleeve_shares(numbers, np.zeros(STATIONS) if scatter is None else scatter)
    ones = np.ones(STATIONS)
    collet, point = np.eye(size)[0], np.append(0.0, head)
    last = np.eye(size)[1 + 2 * GRIP_ELEMENTS], np.eye(size)[2 + 2 * GRIP_ELEMENTS]
    bend = point - last[0] - (numbers["club_length"] - numbers["grip_length"]) * last[1]
    one, none = np.ones(1), np.zeros(1)
    turned = np.full(1, float(model == "driven_wrist"))
    wrist = numbers["wrist_stiffness"], numbers["wrist_damping"]
    places = {
        "sleeve": Springs(
            rows,
            shares * numbers["sleeve_stiffness"],
            shares * numbers["sleeve_damping"],
            ones,
            0 * ones,
        ),
        "shaft": Springs(bend[None], numbers["shaft_stiffness"] * one, none, one, none),
        "clubhead": Springs(point[None], none, none, one, none),
        "wrist": Springs(collet[None], wrist[0] * one, wrist[1] * one, one, turned),
    }
    for name in ("sleeve", "wrist"):
        item = places[name]
        stiffness = stiffness + item.rows.T @ np.diag(item.stiffness) @ item.rows
        damping = damping + item.rows.T @ np.diag(item.damping) @ item.rows
    points = {"clubhead": point, "collet": collet, "grip": rows[STATIONS // 2] * (collet == 0)}
    whole = (numbers["butt"] + numbers["club_length"]) * collet
    views = club_views(points, whole, _gauge(bend, edges, numbers))
    club = Structure(mass, damping, stiffness, places, points, views)
    return _without_collet(club) if model == "fixed_collet" else club


def _gauge(bend: np.ndarray, edges: np.ndarray, numbers: Mapping[str, float]) -> np.ndarray:
    """Strain of the shaft just beyond the grip, calibrated by pulling at the head [m]."""
    index = GRIP_ELEMENTS + 1
    h = edges[index + 1] - edges[index]
    row = np.zeros(len(bend))
    row[1 + 2 * index : 5 + 2 * index] = np.array([-6, -4 * h, 6, -2 * h]) / h**2
    stiffness, _, head = clamped(numbers)
    pulled = np.zeros(len(bend))
    pulled[1 + 2 * GRIP_ELEMENTS + 2 :] = np.linalg.solve(stiffness, head)
    return row * (bend @ pulled) / (row @ pulled)


def _without_collet(club: Structure) -> Structure:
    """The club in a collet that cannot move."""
    places = {
        name: Springs(item.rows[:, 1:], item.stiffness, item.damping, item.count, item.follow)
        for name, item in club.places.items()
        if name != "wrist"
    }
    views = {
        name: View(view.row[1:], view.order, view.quantity, view.place, view.frame)
        for name, view in club.views.items()
        if name != "collet"
    }
    points = {name: row[1:] for name, row in club.points.items()}
    mass, damping, stiffness = (m[1:, 1:] for m in (club.mass, club.damping, club.stiffness))
    return Structure(mass, damping, stiffness, places, points, views)
