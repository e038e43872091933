"""Limits of the motors as a TOML table states them."""

from __future__ import annotations

import math
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from ..model.door import fault, shown
from .profile import AxisLimits


class AxisTable(BaseModel):
    """Limits of one axis in a file; what is left out is not limited.

    Attributes:
        angle: lowest and highest [rad].
        velocity: largest magnitude [rad/s].
        acceleration: largest magnitude [rad/s^2].
        jerk: largest magnitude [rad/s^3].
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    angle: list[float] | None = None
    velocity: float = Field(default=math.inf, gt=0.0, allow_inf_nan=True)
    acceleration: float = Field(default=math.inf, gt=0.0, allow_inf_nan=True)
    jerk: float = Field(default=math.inf, gt=0.0, allow_inf_nan=True)


def axis_limits(table: AxisTable, name: str, path: Path) -> AxisLimits:
    """From a table of a file to the limits of one axis.

    Args:
        table: as validated.
        name: of the axis, for messages.
        path: the file, for messages.

    Returns:
        The limits [SI units].

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    place = f"[limits.{name}] angle"
    if table.angle is None:
        angle = (-math.inf, math.inf)
    elif len(table.angle) != 2 or not table.angle[0] < table.angle[1]:
        mend = "write angle = [-3.5, 3.5]"
        raise fault(path, place, "[lowest, highest] in rad", shown(table.angle), mend)
    else:
        angle = (table.angle[0], table.angle[1])
    return AxisLimits(angle, table.velocity, table.acceleration, table.jerk)
