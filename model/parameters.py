"""A parameter is one number with its unit, bounds, meaning and source."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Parameter:
    """One number of a robot, a chain or a law.

    Attributes:
        name: the contract's name, such as ``wrist_stiffness`` or ``links.spring.damping``.
        value: the number itself, in `unit`.
        unit: its SI unit as text, such as ``N m/rad`` [-].
        low: smallest value that a fit may try, in `unit`.
        high: largest value that a fit may try, in `unit`.
        free: whether a fit varies it.
        std: how well it is known beforehand, in `unit`; ``None`` where nothing is stated. A
            parameter with a `std` is a nuisance with that prior.
        per_record: whether each record has its own value.
        meaning: what it is, in words.
        source: where the value comes from.
    """

    name: str
    value: float
    unit: str
    low: float = -math.inf
    high: float = math.inf
    free: bool = False
    std: float | None = None
    per_record: bool = False
    meaning: str = ""
    source: str = ""

    @property
    def varies(self) -> bool:
        """Whether a fit moves it: free, or known only to a tolerance."""
        return self.free or self.std is not None

    def at(self, value: float) -> Parameter:
        """The same parameter with another `value` (in its `unit`)."""
        return replace(self, value=float(value))


def values_of(parameters: Mapping[str, Parameter]) -> dict[str, float]:
    """The bare numbers of a table of parameters, by name, each in its SI unit."""
    return {name: parameter.value for name, parameter in parameters.items()}
