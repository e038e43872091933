"""Centrifugal stiffening: a club that turns is pulled straight, and out of line."""

from __future__ import annotations

from typing import Any

from ..law import Law
from ..swung import Felt, SwungRows, Told


def _swing(strength: Any, stretch: Any, told: Told, rows: SwungRows) -> Any:
    """The head's tension against chord and bend, less what draws masses away from the line."""
    return strength * rows.weight * told.spin * told.spin * stretch


def _felt(strength: Any, told: Told, felt: Felt) -> Any:
    """What a rider on the club reads more, whose axis leans to the pull [m/s^2]."""
    return strength * told.spin * told.spin * felt.spun


LAW = Law(
    name="centrifugal_stiffening",
    kind="spun",
    symbol="share",
    dimension=(0, 0, 0),
    natural=lambda scales: 1.0,
    swing=_swing,
    felt=_felt,
    formula="f = share spin^2 m (R (chord + s/5)/a - x), s the shaft's bend, x off the line",
    sentence="Turning, the {place} pulls the shaft straight, which the model leaves out: {value} "
    "times what full kinematics have of it, 1 being all.",
    cure="Simulate swings with fidelity = 'planar', or keep the stiffness that grows with speed.",
    source="tension times the shortening of a bent cantilever; Kane, Ryan and Banerjee 1987, "
    "doi:10.2514/3.20195; thesis line 1949",
)
