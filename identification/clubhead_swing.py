"""A swing's markers and those of the club, matched by name; what cannot be is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from .clubhead_face import Face
from .clubhead_pose import FEWEST
from .clubhead_rigid import rigid_fit

SPAN = (0.01, 0.8)
"""Radius of gyration of a club's markers that passes for one in metres [m]."""

UNITS_APART = {1e3: "mm read as m", 1e-3: "m read as mm", 25.4: "inches read as mm",
               1 / 25.4: "mm read as inches", 10.0: "mm read as cm", 0.1: "cm read as mm",
               100.0: "cm read as m", 0.01: "m read as cm", 39.37: "inches read as m",
               0.0254: "m read as inches"}  # fmt: skip
"""Ratios of the markers' distances to the cloud's, and what makes them [-]."""

RIGHT = (0.8, 1.25)
"""Ratios of those distances that pass for noise, or a cloud badly measured [-]."""

LEAST_MISFIT = 1e-3
"""Misfit of a rigid cloud from which a mirror image is looked for [m]."""

MIRRORED = 0.1
"""Share of the markers' misfit that is left when they are mirrored, from which they are [-]."""


@dataclass(frozen=True, eq=False)
class Club:
    """Markers on a club, measured once at rest.

    Attributes:
        names: of the markers.
        cloud: their places, shape (m, 3) [m].
        face: in the cloud's coordinates.
        points: further points whose speed is wanted, by name, shape (3,) each, in the cloud's
            coordinates [m].
    """

    names: tuple[str, ...]
    cloud: np.ndarray
    face: Face = field(default_factory=Face)
    points: Mapping[str, np.ndarray] = field(default_factory=dict)

    def own_points(self) -> dict[str, np.ndarray]:
        """The further points in the face's axes from its middle, shape (3,) each [m]."""
        center, axes = np.array(self.face.center), self.face.axes
        return {name: (np.asarray(point) - center) @ axes for name, point in self.points.items()}


@dataclass(frozen=True, eq=False)
class Swing:
    """Markers in the room, frame by frame.

    Attributes:
        name: of the swing.
        path: its file.
        rate: frames a second [Hz].
        names: of the markers.
        places: shape (n, m, 3) [m], x to the target and z up; nan where a marker was lost.
        files: every file read, with its SHA-256.
    """

    name: str
    path: Path
    rate: float
    names: tuple[str, ...]
    places: np.ndarray
    files: dict[str, str] = field(default_factory=dict)


def wrong(swing: Swing, expected: str, found: str, mend: str) -> ValueError:
    """The refusal of a swing, in the words of the door: what, expected, found, mend."""
    return ValueError(f"{swing.path}: expected {expected}, found {found}. Mend: {mend}.")


def matched(swing: Swing, club: Club) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """The markers that cloud and swing share.

    Args:
        swing: its markers.
        club: its cloud.

    Returns:
        Names, their places in the cloud, shape (m, 3) [m], and in the room, shape (n, m, 3) [m].

    Raises:
        ValueError: where a name is there twice, fewer than three are shared, or they make a line.
    """
    for label, names in (("cloud", club.names), ("swing", swing.names)):
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise wrong(swing, f"one {label} marker '{twice}'", "it twice", "rename one")
    shared = tuple(name for name in club.names if name in swing.names)
    if len(shared) < FEWEST:
        expected = f"at least {FEWEST} markers named as in the cloud"
        listed = ", ".join(shared) or "none"
        raise wrong(swing, expected, listed, "name the columns as the cloud names its markers")
    cloud = club.cloud[[club.names.index(name) for name in shared]]
    size = np.linalg.svd(cloud - cloud.mean(axis=0), compute_uv=False)
    if not size[1] > 0.01 * size[0]:
        found = "a line, about which the club could turn unseen"
        raise wrong(swing, "a cloud spread over a plane at least", found, "add a marker beside it")
    return shared, cloud, swing.places[:, [swing.names.index(name) for name in shared]]


def check_size(
    swing: Swing, names: tuple[str, ...], cloud: np.ndarray, places: np.ndarray
) -> list[str]:
    """Refuses what can only be a wrong unit or a mirror image, and tells a scale slightly off.

    Args:
        swing: for the words.
        names: of the markers that cloud and swing share.
        cloud: their places on the club, shape (m, 3) [m].
        places: in the room, shape (n, m, 3) [m]; nan where lost.

    Returns:
        What is to be told, in sentences.

    Raises:
        ValueError: for a wrong unit, no frame with three markers, or mirrored markers.
    """
    gyration = float(np.sqrt(np.mean(np.sum((cloud - cloud.mean(axis=0)) ** 2, axis=1))))
    there = np.asarray(np.isfinite(places).all(axis=2))
    full = np.flatnonzero(there.sum(axis=1) >= FEWEST)
    if not len(full):
        raise wrong(swing, f"frames with {FEWEST} markers", "none", "check the columns")
    rows = full[:: max(1, len(full) // 400)]
    seen, there = np.where(there[rows][..., None], places[rows], 0.0), there[rows]
    ratios = _ratios(seen, there, cloud)
    ratio = float(np.median(ratios))
    if not RIGHT[0] < ratio < RIGHT[1]:
        for k, name in enumerate(names):
            others = there & (np.arange(len(names)) != k)
            enough = others.sum(axis=1) >= FEWEST
            left = (
                float(np.median(_ratios(seen[enough], others[enough], cloud)))
                if enough.any()
                else 0
            )
            if RIGHT[0] < left < RIGHT[1]:
                found = f"marker '{name}' far from the others"
                raise wrong(swing, "markers as far apart as in the cloud", found,
                            "correct its unit, or cut its columns")  # fmt: skip
        likely = [text for value, text in UNITS_APART.items() if 0.9 < ratio / value < 1.1]
        hint = f" ({likely[0]}?)" if likely else ""
        found = f"them {ratio:.4g} times as far apart{hint}"
        raise wrong(swing, "markers as far apart as in the cloud", found, "correct the unit")
    if not SPAN[0] < gyration < SPAN[1]:
        found = f"markers some {gyration:.3g} m from their middle"
        raise wrong(swing, "a club", found, "correct the unit of cloud and swing: mm or m")
    plain, turned = (_misfit(each, seen, there) for each in (cloud, cloud * [1.0, 1.0, -1.0]))
    if plain > LEAST_MISFIT and turned < MIRRORED * plain:
        found = f"their mirror image (misfit {1e3 * turned:.2g} mm against {1e3 * plain:.2g})"
        mend = "turn one axis of the swing or of the cloud round: both must be right-handed"
        raise wrong(swing, "markers as in the cloud", found, mend)
    error = np.std(ratios) / np.sqrt(len(ratios)) + 1e-9
    if abs(ratio - 1) > max(0.005, 6 * error):
        return [f"The markers are {100 * (ratio - 1):+.2g} % further apart than in the cloud."]
    return []


def _misfit(cloud: np.ndarray, seen: np.ndarray, there: np.ndarray) -> float:
    """Median distance of the markers from a rigid cloud [m]."""
    rotation, position = rigid_fit(cloud, seen, there)
    rest = seen - cloud @ np.swapaxes(rotation, 1, 2) - position[:, None]
    return float(np.median(np.linalg.norm(rest, axis=2)[there]))


def _ratios(seen: np.ndarray, there: np.ndarray, cloud: np.ndarray) -> np.ndarray:
    """How much further apart the markers are than in the cloud, shape (n,) [-]."""
    weight = there / there.sum(axis=1, keepdims=True)
    return np.sqrt(_spread(seen, weight) / _spread(cloud[None] + 0 * seen, weight))


def _spread(places: np.ndarray, weight: np.ndarray) -> np.ndarray:
    middle = np.einsum("nm,nmi->ni", weight, places)
    return np.einsum("nm,nmi->n", weight, (places - middle[:, None]) ** 2)


def with_face(club: Club, three: np.ndarray) -> Club:
    """A club whose face is the plane through three of its markers.

    Args:
        club: whose face tells which way the normal points, and what is up.
        three: places in the cloud's coordinates, shape (3, 3) [m].

    Returns:
        The club with that face; its middle is the middle of the three.

    Raises:
        ValueError: where the three lie in a line.

    Source: thesis, section 3.4.5.
    """
    normal = np.cross(three[1] - three[0], three[2] - three[0])
    size = np.linalg.norm(normal)
    if size < 1e-8:
        raise ValueError("face: expected three markers in a triangle, found a line. Mend: others.")
    normal = normal / size * np.sign(normal @ np.array(club.face.normal) or 1.0)
    center = three.mean(axis=0)
    face = replace(club.face, center=tuple(center.tolist()), normal=tuple(normal.tolist()))
    return replace(club, face=face)
