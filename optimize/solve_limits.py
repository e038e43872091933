"""Which limit stands in the way of a swing, and when, in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .solve_newton import Found

FELT = 1e-3
"""Share of the largest price at which a limit is said to bind [-]."""


@dataclass(frozen=True)
class Binding:
    """A limit that a swing would like to pass.

    Attributes:
        axis: arm, wrist or shaft.
        quantity: angle, velocity, acceleration, jerk, torque or deflection.
        time: instant at which it binds most [s].
        limit: its bound on that side, margins off [SI unit of the quantity].
        unit: of the bound.
        share: of all prices [-].
    """

    axis: str
    quantity: str
    time: float
    limit: float
    unit: str
    share: float

    @property
    def words(self) -> str:
        """Such as "arm angle limit of -3.5 rad"."""
        return f"{self.axis} {self.quantity} limit of {self.limit:.4g} {self.unit}"


def binding_limits(found: Found) -> tuple[Binding, ...]:
    """The limits that bind in a solution, the one with the largest price first.

    Args:
        found: a solution; its prices are the multipliers of its limits, each in units of itself.

    Returns:
        One entry a limit and side; none where no limit is reached.
    """
    prices, entries = found.answer.prices, {}
    low = 0
    for family, looked in zip(found.families, found.looked, strict=True):
        own = prices[low : low + len(looked)]
        low += len(looked)
        for sign in (-1.0, 1.0):
            felt = np.where(np.sign(own) == sign, np.abs(own), 0.0)
            total = float(felt.sum())
            if not total:
                continue
            at = int(np.argmax(felt))
            row = looked[at]
            bound = family.middle + sign * float(family.half[row])
            key = (family.axis, family.quantity, sign if family.quantity == "angle" else 0.0)
            size = (float(felt[at]), float(family.times[row]), bound, family.unit)
            known = entries.get(key, (0.0, size))
            best = size if size[0] > known[1][0] else known[1]
            entries[key] = (known[0] + total, best)
    whole = sum(total for total, _ in entries.values())
    listed = [
        Binding(axis, quantity, time, bound, unit, total / whole)
        for (axis, quantity, _), (total, (_, time, bound, unit)) in entries.items()
    ]
    kept = [one for one in listed if one.share >= FELT]
    return tuple(sorted(kept, key=lambda one: -one.share))
