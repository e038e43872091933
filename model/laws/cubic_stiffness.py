"""Cubic stiffness: a spring that hardens or softens with the square of its stretch."""

from __future__ import annotations

from typing import Any

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``k3 d^3`` [N or N m]."""
    return strength * stretch * stretch * stretch


LAW = Law(
    name="cubic_stiffness",
    kind="link",
    symbol="cubic_stiffness",
    dimension=(1, -3, 0),
    natural=lambda scales: scales.force / scales.stretch**3,
    force=force,
    formula="f = k3 d^3",
    sentence="The {place} does not follow Hooke: its stiffness changes with the square of the "
    "stretch, by a cubic term of {value}.",
    cure="Use a spring with a longer linear range, or keep the cubic term in the model.",
    source="Duffing 1918",
)
