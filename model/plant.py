"""A plant: a mechanism with its inputs, sensors and laws, and the vector of all that varies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .law import Law, force_laws
from .linear import Array, Mechanism, Port, ground_quantity


@dataclass(frozen=True)
class Plant:
    """A mechanism with its inputs, its sensors and the places where laws may act.

    A plant is static: everything that varies is in the vector `z`, laid out as numbers of the
    mechanism, strengths of the laws, start state, offsets of inputs, offsets, errors of
    gain and delays of sensors; each in SI units.

    Attributes:
        mechanism: chain or robot.
        inputs: ports of the sampled inputs.
        sensors: ports of the sensors.
        law_places: places with laws; every law that fits a place has a slot there, null at 0.
    """

    mechanism: Mechanism
    inputs: tuple[Port, ...]
    sensors: tuple[Port, ...]
    law_places: tuple[str, ...] = ()

    @cached_property
    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Each (place, law) that has a strength in `z`, in order."""
        kinds = self.mechanism.law_places()
        return tuple(
            (place, law)
            for place in self.law_places
            for law in force_laws(kinds[place], self.mechanism.turns(place))
        )

    @cached_property
    def slots(self) -> dict[str, slice]:
        """Where each part of `z` lies: numbers, strengths, start, drive, offset, gain, delay."""
        sizes = {
            "numbers": len(self.mechanism.names),
            "strengths": len(self.laws),
            "start": self.n_states,
            "drive": len(self.inputs),
            "offset": len(self.sensors),
            "gain": len(self.sensors),
            "delay": len(self.sensors),
        }
        ends = np.cumsum(list(sizes.values()))
        return {
            name: slice(int(end) - size, int(end))
            for (name, size), end in zip(sizes.items(), ends, strict=True)
        }

    @property
    def n_states(self) -> int:
        """Positions, velocities and the motion of the ground [-]."""
        extra = {"": 0, "position": 1, "velocity": 1, "acceleration": 2}
        return 2 * len(self.mechanism.coordinates) + extra[ground_quantity(self.inputs)]

    @property
    def size(self) -> int:
        """Length of `z` [-]."""
        return self.slots["delay"].stop

    def numbers(self, z: Array) -> dict[str, Array]:
        """The mechanism's numbers by name [SI] out of `z`."""
        names = self.mechanism.names
        return dict(zip(names, z[self.slots["numbers"]], strict=True))


def numbers_vector(plant: Plant, numbers: Mapping[str, float]) -> np.ndarray:
    """A `z` [SI] with the mechanism's numbers set and everything else at its null."""
    z = np.zeros(plant.size)
    z[plant.slots["numbers"]] = [numbers[name] for name in plant.mechanism.names]
    return z
