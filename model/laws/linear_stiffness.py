"""Linear stiffness: a spring that the rig holds at another value or leaves out."""

from __future__ import annotations

from typing import Any

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``k d`` of a further spring [N or N m]."""
    return strength * stretch


LAW = Law(
    name="linear_stiffness",
    kind="link",
    also=("head",),
    symbol="stiffness",
    dimension=(1, -1, 0),
    natural=lambda scales: scales.force / scales.stretch,
    force=force,
    replaces="stiffness",
    formula="f = k d",
    sentence="The {place} is stiffer than the rig says by {value}.",
    cure="Free the stiffness in the rig, or measure it statically.",
    source="Hooke's law",
)
