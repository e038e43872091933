"""What a real shaft has and a lumped one has not: mass along it, an end that bends in the grip."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .parameters import Parameter

SHAFT_MASS = "shaft_mass"
GRIP_BENDING = "grip_bending"

NUMBERS = (
    Parameter(
        SHAFT_MASS,
        0.0,
        "kg",
        0.0,
        1.0,
        meaning="mass of the shaft beyond the grip, of which the head's own has a share",
        source="a shaft whose mass is in the head",
    ),
    Parameter(
        GRIP_BENDING,
        0.0,
        "1",
        0.0,
        2.0,
        meaning="how much more the shaft bends in its sleeve than with its grip clamped",
        source="a grip that does not bend",
    ),
)
"""Numbers that no preset names. Without them all of the shaft's mass is in the head and the grip is
rigid, as the thesis has it."""

NAMES = tuple(number.name for number in NUMBERS)

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact for the square of the shape
PLACES = tuple(float(place) for place in (1.0 + _NODES) / 2.0)
"""Where along the shaft beyond the grip its mass is put, from the grip on [of its length]."""

SHARES = tuple(float(weight) for weight in _WEIGHTS / 2.0)
"""How much of it is put there [-]."""


def shape_at(place: float) -> float:
    """How far an even cantilever is bent at a place along it, of its end's bend [-]."""
    return (3.0 - place) * place * place / 2.0


CARRIED = sum(share * shape_at(place) ** 2 for share, place in zip(SHARES, PLACES, strict=True))
"""Share of the shaft's mass that the head's includes: 33/140 of an even one [-]."""


def carried(p: Mapping[str, Any]) -> Any:
    """What the head's mass includes of the shaft's [kg]."""
    return CARRIED * p.get(SHAFT_MASS, 0.0)


def along(p: Mapping[str, Any], lever: Any) -> list[tuple[Any, list[Any], Any]]:
    """The shaft's mass at a few places that have the same energy as all of it.

    A clamped club moves as without it, since the head's mass is what such a club shows. Where grip
    or collet turn, the shaft's mass turns with them, which a mass at the head does not tell.

    Args:
        p: the robot's numbers by name [SI].
        lever: grip centre to clubhead [m].

    Returns:
        Of each place its distance from the grip's centre [m], its velocity over those of the
        grip's centre, the grip's angle and the head, all in the collet's frame [1, m, 1], and its
        mass [kg]; nothing where the shaft's mass is not named.

    Source: Rayleigh's shape, Rao 2017, Mechanical Vibrations, example 2.8 (33/140);
    tests/model/test_shaft_form.py.
    """
    if SHAFT_MASS not in p:
        return []
    found = []
    for place, share in zip(PLACES, SHARES, strict=True):
        away = p["grip_length"] / 2.0 + place * (p["club_length"] - p["grip_length"])
        bent = shape_at(place)
        row = [1.0 - bent, away - bent * lever, bent]
        found.append((away, row, share * p[SHAFT_MASS]))
    return found


def gauged(p: Mapping[str, Any]) -> Any:
    """Share of the shaft's bend that a gauge on it shows, which was calibrated in a vice [-].

    With its grip clamped the shaft bends as little beyond the grip as it does in its sleeve under
    the same load; the rest of the bend at the head comes from inside the grip.

    Args:
        p: the robot's numbers by name [SI].

    Source: tests/model/test_shaft_form.py.
    """
    return 1.0 / (1.0 + p.get(GRIP_BENDING, 0.0))
