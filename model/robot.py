"""The golf robot: its numbers with unit, bounds and meaning, presets of the thesis, its rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from . import swung
from .energies import Rows
from .parameters import Parameter
from .shaft_form import NAMES as _FORM, NUMBERS as _FORMS, along, carried, gauged

MODELS = (
    "fixed_collet",
    "driven_collet",
    "pinned_wrist",
    "driven_wrist",
    "passive_wrist",
    "driven_arm",
)
"""The six models of the contract, in the order of the thesis."""

_DRIVEN = {
    "driven_wrist": ("wrist",),
    "passive_wrist": ("arm",),
    "driven_arm": ("arm", "wrist"),
}
"""The joints whose angle is prescribed, by model; none in the others."""

_CLUB = ("grip_displacement", "grip_angle", "clubhead_displacement")
_TRANSLATIONS = ("position", "velocity", "acceleration")
_OWN = {"clubhead": "position", "collet": "angle"}  # how a body of which laws are told moves

PLACES = ("clubhead", "grip", "collet", "wrist", "arm", "hand", "shaft", "sleeve", "base")


def _number(
    name: str, value: float, unit: str, meaning: str, low: float = 0.0, high: float = math.inf
) -> Parameter:
    return Parameter(name, value, unit, low, high, meaning=meaning, source="preset robo_v")


_ALL = (
    _number("clubhead_mass", 0.20277, "kg", "mass lumped at the clubhead", 1e-3, 10.0),
    _number("grip_mass", 0.100, "kg", "mass of the clamped part of the shaft", 1e-3, 10.0),
    _number("grip_inertia", 5.2083e-4, "kg m^2", "inertia of the grip about its centre", 1e-6, 1.0),
    _number("collet_inertia", 0.02809, "kg m^2", "inertia of the collet, wrist pivot", 1e-5, 10.0),
    _number("collet_mass", 1.5, "kg", "mass of the collet", 1e-3, 100.0),
    _number("collet_centre", 0.10, "m", "wrist pivot to the collet's mass centre", 0.0, 2.0),
    _number("club_length", 1.090, "m", "butt of the club to the clubhead", 0.1, 3.0),
    _number("grip_length", 0.250, "m", "length of the grip section", 0.01, 1.0),
    _number("sleeve_spacing", 0.0490, "m", "distance between the two sets of springs", 1e-3, 1.0),
    _number("sleeve_offset", 0.1005, "m", "wrist pivot to the upper set of springs", -1.0, 1.0),
    _number("arm_length", 0.65, "m", "shoulder to wrist", 0.05, 3.0),
    _number(
        "shaft_stiffness", 139.0, "N/m", "bending stiffness of the shaft at the head", 1.0, 1e5
    ),
    _number("shaft_damping", 0.0807, "N s/m", "damping of the shaft at the head", 0.0, 1e3),
    _number("sleeve_stiffness", 60e3, "N/m", "stiffness of one of four sleeve elements", 10.0, 1e8),
    _number("sleeve_damping", 1470.0, "N s/m", "damping of one of four sleeve elements", 0.0, 1e7),
    _number("sleeve_stiffness_upper", 60e3, "N/m", "stiffness of an upper element", 10.0, 1e8),
    _number("sleeve_stiffness_lower", 60e3, "N/m", "stiffness of a lower element", 10.0, 1e8),
    _number("sleeve_damping_upper", 1470.0, "N s/m", "damping of an upper element", 0.0, 1e7),
    _number("sleeve_damping_lower", 1470.0, "N s/m", "damping of a lower element", 0.0, 1e7),
    _number("wrist_stiffness", 300.0, "N m/rad", "stiffness of the wrist", 0.0, 1e7),
    _number("wrist_damping", 15.0, "N m s/rad", "damping of the wrist", 0.0, 1e6),
)

INCLINATION = "swing_plane_inclination"
"""The number that gives the planar robot its weight; no preset names it, and without it the swing
plane is horizontal [rad]."""

_PLANE = Parameter(
    INCLINATION,
    0.0,
    "rad",
    0.0,
    math.pi / 2,
    meaning="angle of the swing plane against the horizontal, for its weight",
    source="a horizontal plane",
)

PARAMETERS: dict[str, Parameter] = {number.name: number for number in (*_ALL, *_FORMS, _PLANE)}
"""Every number a robot's rig may name, with unit, default bounds and meaning."""

_ROBO_V = {
    name: parameter.value
    for name, parameter in PARAMETERS.items()
    if not name.endswith(("_upper", "_lower")) and name not in (INCLINATION, *_FORM)
}

PRESETS: dict[str, dict[str, float]] = {
    "robo_v": _ROBO_V,
    "robo_v_rigid": _ROBO_V | {"sleeve_stiffness": 500e3, "sleeve_damping": 0.0},
    "robo_v_sleeve_0": _ROBO_V | {"sleeve_stiffness": 172e3, "sleeve_damping": 950.0},
    "robo_v_sleeve_25": _ROBO_V | {"sleeve_stiffness": 120e3, "sleeve_damping": 3010.0},
    "robo_v_sleeve_50": _ROBO_V | {"sleeve_stiffness": 60e3, "sleeve_damping": 1470.0},
}
"""Named sets of values [SI] calibrated to the thesis (lumped equivalents of lines 1060-1176)."""

STRAIN_PER_BEND = 0.024
"""Strain of the shaft's gauge for one metre of bend [1/m]; thesis line 1833."""


@dataclass(frozen=True)
class Robot:
    """Club, grip, sleeve and collet, on a fixed collet, on a wrist, or on an arm that is moved.

    Coordinates: collet angle (all but the fixed collet) [rad], absolute also where an arm turns,
    as in the thesis's eq. 40 and 41; grip displacement and angle in the collet's frame [m, rad];
    clubhead displacement in the collet's frame [m]. Angles count from the line in which the arm
    and the collet are aligned.

    ============== ==================================================================== =========
    model          what holds the collet                                                equations
    ============== ==================================================================== =========
    fixed_collet   it cannot move                                                       8-11
    driven_collet  a torque turns it; no spring                                         22-25
    pinned_wrist   the wrist's spring, to a pin at rest                                 30-36
    driven_wrist   the wrist's spring, to a prescribed wrist angle                      37
    passive_wrist  the wrist's spring, to an arm whose angle is prescribed              40
    driven_arm     the wrist's spring, to the sum of prescribed arm and wrist angles    41
    ============== ==================================================================== =========

    Where `shaft_mass` or `grip_bending` are named, the shaft is a real one, see `shaft_form`.

    Where an arm turns, the wrist's pivot moves by ``arm_length`` times its angle, and every mass
    is carried along (the thesis's eq. 40 and 41 carry the collet's alone).

    Attributes:
        model: one of `MODELS`.
        names: names of the numbers that it is made of, a subset of `PARAMETERS`.

    Source: the thesis's equations in their symmetric form; tests/model/test_energies.py,
    tests/model/test_robot.py.
    """

    model: str = "fixed_collet"
    names: tuple[str, ...] = tuple(_ROBO_V)

    def turns(self, place: str) -> bool:
        """Whether `place` turns [rad] rather than moves [m]."""
        return place in ("wrist", "collet", "hand", "arm", "club")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the generalized coordinates [m, rad]."""
        return _CLUB if self.model == "fixed_collet" else ("collet_angle", *_CLUB)

    @property
    def grounds(self) -> tuple[str, ...]:
        """The joints whose angle is prescribed [rad], one a column after the coordinates."""
        return _DRIVEN.get(self.model, ())

    @property
    def carried(self) -> tuple[tuple[float, ...], ...]:
        """How far each coordinate starts moved along with each prescribed angle [1]."""
        return ((1.0, 0.0, 0.0, 0.0),) * len(self.grounds)

    @property
    def springs(self) -> tuple[str, ...]:
        """The place of each spring row."""
        club = ("sleeve", "sleeve", "shaft")
        return club if self.model == "fixed_collet" else (*club, "wrist")

    def law_places(self) -> dict[str, str]:
        """Where a law can act: sleeve, shaft, wrist and collet where there is one, and clubhead.

        Also the base on which the collet's pivot stands; where joints are told, the arm, if it is
        one of them, and what is swung.
        """
        swings = {
            place: kind
            for place, kind in swung.KINDS.items()
            if self.grounds and (place != "arm" or place in self.grounds)
        }
        bodies = {"clubhead": "head"}
        if self.model != "fixed_collet":
            bodies["collet"] = "body"
        return dict.fromkeys(self.springs, "link") | bodies | {"base": "support"} | swings

    def rows(self, p: Mapping[str, Any], xp: Any = None) -> Rows:
        """Rows of the energies; the last columns are the prescribed angles, see `grounds`.

        Args:
            p: the robot's numbers by contract name [SI].
            xp: array namespace, jax.numpy by default.

        Returns:
            Rows with a column for each coordinate and each prescribed angle; where none is
            prescribed the last column is empty. One spring row stands for the two elements of a
            set.
        """
        xp = xp or _jax_numpy()
        bodies, springs = self._bodies(p), self._springs(p)
        return Rows(
            xp.asarray([row for row, _ in bodies]),
            xp.asarray([m for _, m in bodies]),
            xp.asarray([row for _, row, _, _ in springs]),
            xp.asarray([k for _, _, k, _ in springs]),
            xp.asarray([c for _, _, _, c in springs]),
        )

    def place_rows(self, place: str, p: Mapping[str, Any], xp: Any = None) -> tuple[Any, Any, Any]:
        """Stretch rows of a place with the stiffness and damping that sit there.

        Args:
            place: sleeve (two rows, one a set of two elements), shaft, wrist, base (the mean of
                the sleeve's rows with all their stiffness: through them it carries the club), a
                body (its motion against the ground) or what is swung.
            p: the robot's numbers by contract name [SI].
            xp: array namespace.

        Returns:
            rows (m, columns), stiffness (m,) [N/m or N m/rad], damping (m,) [N s/m or N m s/rad];
            both zero at the wrist of a driven collet, at bodies, and where a told motion swings.
        """
        xp = xp or _jax_numpy()
        if place in swung.KINDS:
            rows = [self._row(r, p, told, told) for r, told in swung.stretches(place, p)]
            return xp.asarray(rows), xp.zeros(len(rows)), xp.zeros(len(rows))
        if place in ("clubhead", "collet"):
            row = self.sensor_row(place, _OWN[place], "absolute", p, xp)
            return row[None], xp.zeros(1), xp.zeros(1)
        own = "sleeve" if place == "base" else place
        here = [spring for spring in self._springs(p) if spring[0] == own]
        rows = xp.asarray([row for _, row, _, _ in here])
        stiffness = xp.asarray([k for _, _, k, _ in here])
        damping = xp.asarray([c for _, _, _, c in here])
        if place != "base":
            return rows, stiffness, damping
        mean = (stiffness / xp.sum(stiffness)) @ rows
        return mean[None], xp.sum(stiffness)[None], xp.sum(damping)[None]

    def push_rows(self, place: str, p: Mapping[str, Any], xp: Any = None) -> Any:
        """Generalized forces of unit forces in a place's rows, shape (m, coordinates) [1 or m].

        Those of its stretches, but where a told motion swings, see `swung.pushes`.
        """
        xp = xp or _jax_numpy()
        if place in swung.KINDS:
            return xp.asarray([self._row(row, p)[:4] for row in swung.pushes(place, p)])
        return self.place_rows(place, p, xp)[0][:, : len(self.coordinates)]

    def force_row(self, place: str, p: Mapping[str, Any], xp: Any = None) -> Any:
        """Generalized force of a unit force (clubhead, grip) or torque (collet, wrist) [1 or m]."""
        quantity = "angle" if self.turns(place) else "position"
        row = self.sensor_row(place, quantity, "absolute", p, xp)
        return row[: len(self.coordinates)]

    def sensor_row(self, place: str, quantity: str, frame: str, p: Any, xp: Any = None) -> Any:
        """Row that turns coordinates and prescribed angles into what a sensor at `place` sees.

        Args:
            place: clubhead, grip, shaft, collet, hand (the collet's angle), wrist (the collet's
                angle against the arm) or arm; on an arm, a position at collet, hand or wrist is
                that of the wrist's pivot.
            quantity: the contract's word; strain and deflection see the bend of the shaft.
            frame: ``absolute``, or ``collet`` for motion relative to the collet as it turns, which
                is what the thesis calls the relative motion.
            p: the robot's numbers by contract name [SI].
            xp: array namespace.

        Returns:
            The row, shape (columns,) [1, m or 1/m].

        Raises:
            ValueError: where that place has no such sensor in this model.
        """
        xp = xp or _jax_numpy()
        point = _points(p)
        moving = 1.0 if frame == "absolute" else 0.0
        on_arm, turned = "arm" in self.grounds, place in ("collet", "wrist", "hand")
        pivot = moving * p["arm_length"] if on_arm else 0.0
        if quantity in ("strain", "deflection") and place in ("shaft", "clubhead"):
            scale = (STRAIN_PER_BEND if quantity == "strain" else 1.0) * gauged(p)
            row = self._row([0.0, -scale, -scale * point.lever, scale], p)
        elif place == "clubhead":
            row = self._row([moving * point.head, 0.0, 0.0, 1.0], p, pivot)
        elif place == "grip" and quantity.startswith("ang"):
            row = self._row([moving, 0.0, 1.0, 0.0], p)
        elif place in ("grip", "shaft"):
            row = self._row([moving * point.grip, 1.0, 0.0, 0.0], p, pivot)
        elif turned and quantity in _TRANSLATIONS and on_arm:
            row = self._row([0.0] * 4, p, p["arm_length"])
        elif turned and quantity not in _TRANSLATIONS and self.model != "fixed_collet":
            row = self._row([1.0, 0.0, 0.0, 0.0], p, -1.0 if place == "wrist" else 0.0)
        elif place == "arm" and quantity not in _TRANSLATIONS and on_arm:
            row = self._row([0.0] * 4, p, 1.0)
        else:
            raise ValueError(
                f"sensor at {place!r}: expected a place that moves in model {self.model!r} "
                f"(clubhead, grip, shaft), found {place!r} with quantity {quantity!r}. "
                "Mend: name another place, or a model whose collet turns."
            )
        return xp.asarray(row)

    def _bodies(self, p: Mapping[str, Any]) -> list[tuple[list[Any], Any]]:
        """Velocity row of each inertia, and the inertia."""
        point, collet = _points(p), p["collet_inertia"]
        pivot = p["arm_length"] if "arm" in self.grounds else 0.0
        bodies = [
            (self._row([point.grip, 1.0, 0.0, 0.0], p, pivot), p["grip_mass"]),
            (self._row([1.0, 0.0, 1.0, 0.0], p), p["grip_inertia"]),
            (self._row([point.head, 0.0, 0.0, 1.0], p, pivot), p["clubhead_mass"] - carried(p)),
        ]
        for away, row, mass in along(p, point.lever):
            bodies.append((self._row([point.grip + away, *row], p, pivot), mass))
        if "arm" in self.grounds:
            mass, center = p["collet_mass"], p["collet_centre"]
            bodies.append((self._row([center, 0.0, 0.0, 0.0], p, pivot), mass))
            collet = collet - mass * center * center  # about its mass centre
        if self.model != "fixed_collet":
            bodies.append((self._row([1.0, 0.0, 0.0, 0.0], p), collet))
        return bodies

    def _springs(self, p: Mapping[str, Any]) -> list[tuple[str, list[Any], Any, Any]]:
        half = p["sleeve_spacing"] / 2
        lever = _points(p).lever
        springs = [
            ("sleeve", self._row([0.0, 1.0, -half, 0.0], p), *_pair(p, "upper")),
            ("sleeve", self._row([0.0, 1.0, half, 0.0], p), *_pair(p, "lower")),
            (
                "shaft",
                self._row([0.0, -1.0, -lever, 1.0], p),
                p["shaft_stiffness"],
                p["shaft_damping"],
            ),
        ]
        if self.model != "fixed_collet":
            none = 0.0 * p["club_length"]
            held = self.model != "driven_collet"
            k, c = (p["wrist_stiffness"], p["wrist_damping"]) if held else (none, none)
            springs.append(("wrist", self._row([1.0, 0.0, 0.0, 0.0], p, -1.0, -1.0), k, c))
        return springs

    def _row(
        self, row: list[Any], p: Mapping[str, Any], arm: Any = 0.0, wrist: Any = 0.0
    ) -> list[Any]:
        """A row over the coordinates that there are, then over the prescribed angles."""
        zero = 0.0 * p["club_length"]
        kept = row[1:] if self.model == "fixed_collet" else row
        moved = {"arm": arm, "wrist": wrist}
        last = [moved[joint] for joint in self.grounds] or [0.0]
        return [value + zero for value in [*kept, *last]]


@dataclass(frozen=True)
class _Points:
    lever: Any  # a: grip centre to clubhead
    grip: Any  # r: wrist pivot to grip centre
    head: Any  # R: wrist pivot to clubhead


def _points(p: Mapping[str, Any]) -> _Points:
    lever = p["club_length"] - p["grip_length"] / 2
    grip = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    return _Points(lever, grip, grip + lever)


def _pair(p: Mapping[str, Any], which: str) -> tuple[Any, Any]:
    """Stiffness and damping of one set, two elements side by side."""
    k = p.get(f"sleeve_stiffness_{which}", p.get("sleeve_stiffness"))
    c = p.get(f"sleeve_damping_{which}", p.get("sleeve_damping"))
    if k is None or c is None:
        raise ValueError(
            f"sleeve ({which} set): expected sleeve_stiffness and sleeve_damping, found neither "
            f"them nor their _{which} forms. Mend: name them in the rig or choose a preset."
        )
    return 2 * k, 2 * c


def _jax_numpy() -> Any:
    import jax.numpy as jnp

    return jnp
