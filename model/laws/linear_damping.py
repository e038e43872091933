"""Linear damping: a dashpot that the rig leaves out or holds at another value."""

from __future__ import annotations

from typing import Any

from ..law import Law, Place


def force(strength: Any, stretch: Any, rate: Any, place: Place) -> Any:
    """Force ``c v`` of a further dashpot [N or N m]."""
    return strength * rate


LAW = Law(
    name="linear_damping",
    kind="link",
    also=("head",),
    symbol="damping",
    dimension=(1, -1, 1),
    natural=lambda scales: scales.force / scales.rate,
    force=force,
    signed=False,
    dissipative=True,
    replaces="damping",
    formula="f = c v",
    sentence="The {place} has viscous damping of {value} that the model lacks.",
    cure="Free the damping in the rig; a dashpot of that size is at work.",
    source="Rayleigh, Theory of Sound, 1877, section 81",
)
