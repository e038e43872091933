"""A plant: a mechanism with its inputs, sensors and laws, and the vector of all that varies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from .chain import DERIVATIVES
from .law import Law, force_laws
from .linear import Array, Mechanism, Port, moved_grounds


@dataclass(frozen=True)
class Plant:
    """A mechanism with its inputs, its sensors and the places where laws may act.

    A plant is static: everything that varies is in the vector `z`, laid out as numbers of the
    mechanism, strengths of the laws, start state, offsets of inputs, offsets, errors of
    gain, delays and tilts of sensors, amplitude, frequency, phase and onset of a drive's ripple,
    and since when it has moved; each in SI units.

    Attributes:
        mechanism: chain or robot.
        inputs: ports of the sampled inputs.
        sensors: ports of the sensors.
        law_places: places with laws; every law that fits a place has a slot there, null at 0.
        acting: names of the laws that may be other than null; None for all that fit its places.
            Others are not compiled in: a program of all takes three times as long as one's own.
    """

    mechanism: Mechanism
    inputs: tuple[Port, ...]
    sensors: tuple[Port, ...]
    law_places: tuple[str, ...] = ()
    acting: tuple[str, ...] | None = None

    @cached_property
    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Each (place, law) that has numbers in `z`, in order."""
        kinds = self.mechanism.law_places()
        return tuple(
            (place, law)
            for place in self.law_places
            for law in force_laws(kinds[place], self.mechanism.turns(place))
        )

    @cached_property
    def law_numbers(self) -> tuple[tuple[str, Law, str], ...]:
        """Each (place, law, symbol of a shape, or nothing for the strength) in `z`, in order."""
        return tuple(
            (place, law, symbol)
            for place, law in self.laws
            for symbol in ("", *(shape.symbol for shape in law.shapes))
        )

    @cached_property
    def slots(self) -> dict[str, slice]:
        """Where each part of `z` lies.

        The last, ``since``, is one number: how long before its start state the mechanism left its
        rest by a blow [s]; 0 where it was loaded slowly.
        """
        sizes = {
            "numbers": len(self.mechanism.names),
            "strengths": len(self.law_numbers),
            "start": self.n_states,
            "drive": len(self.inputs),
            "offset": len(self.sensors),
            "gain": len(self.sensors),
            "delay": len(self.sensors),
            "tilt": len(self.sensors),
            "ripple": 4,
            "since": 1,
        }
        ends = np.cumsum(list(sizes.values()))
        return {
            name: slice(int(end) - size, int(end))
            for (name, size), end in zip(sizes.items(), ends, strict=True)
        }

    @cached_property
    def marched(self) -> tuple[Port, ...]:
        """The inputs as the march takes them: a joint that carries masses by its acceleration."""
        joints = [
            place
            for place, along in zip(self.mechanism.grounds, self.mechanism.carried, strict=True)
            if any(along)
        ]
        bend = "angular_acceleration"
        return tuple(
            replace(port, quantity=bend)
            if port.place in joints and port.quantity in DERIVATIVES
            else port
            for port in self.inputs
        )

    @property
    def n_states(self) -> int:
        """Positions, velocities and the motion of the grounds [-]."""
        extra = sum(ground.n_states for ground in moved_grounds(self.marched))
        return 2 * len(self.mechanism.coordinates) + extra

    @property
    def size(self) -> int:
        """Length of `z` [-]."""
        return self.slots["since"].stop

    def numbers(self, z: Array) -> dict[str, Array]:
        """The mechanism's numbers by name [SI] out of `z`."""
        names = self.mechanism.names
        return dict(zip(names, z[self.slots["numbers"]], strict=True))

    @cached_property
    def bare(self) -> Plant:
        """The same plant without law places, with those laws acting that are compiled in."""
        return replace(self, law_places=(), acting=self.program)

    @cached_property
    def lawless(self) -> Plant:
        """The bare plant without any law: what its linear part is compiled for."""
        return replace(self, law_places=(), acting=())

    @cached_property
    def program(self) -> tuple[str, ...]:
        """Names of the laws that are compiled in, in the order of the mechanism's.

        Laws without a memory are quick and share one program, and so do those of a told motion;
        of others each one's own is compiled in only where it acts, unless many of them do.
        """
        every = mechanism_laws(self.mechanism)
        if self.acting is not None:
            named = [law for law in every if law.name in self.acting]
        else:
            fitting = {law.name for _, law in self.laws}
            named = [law for law in every if law.name in fitting]
        shared = [law for law in every if law.swing is not None] if named else []
        plain = [law for law in every if law.swing is None and law.memory is None]
        if any(law in plain for law in named):
            shared += plain
        if sum(law.memory is not None for law in named) > MOST_MEMORIES:
            shared += [law for law in every if law.memory is None or not law.memory.placed]
        names = {law.name for law in (*named, *shared)}
        return tuple(law.name for law in every if law.name in names)

    @cached_property
    def rows(self) -> int:
        """Number of law rows in force [-]; a place may have several."""
        return sum(_row_count(self.mechanism, place) for place in self.law_places)

    @cached_property
    def wiring(self) -> Wiring:
        """The law places as data."""
        return _wire(self)


@dataclass(frozen=True, eq=False)
class Wiring:
    """Which law rows of a mechanism are in force, as data instead of as program.

    Wherever they act, the same laws on as many rows share their compiled code; rows are
    filled up with rows on which nothing acts where they are many.

    Attributes:
        select: one row for each law row in force, over all law rows of the mechanism,
            shape (rows, all rows) [-].
        spread: from the plant's strengths and shapes to those of every law of the library on
            every row, shape (numbers of all laws, rows, strengths and shapes) [-].
        owner: from the plant's law places to rows, shape (rows, places) [-].
    """

    select: np.ndarray
    spread: np.ndarray
    owner: np.ndarray

    @property
    def unused(self) -> np.ndarray:
        """1 for rows on which nothing acts, shape (rows,) [-]."""
        return 1.0 - self.select.sum(axis=1)


def laws_of(plant: Plant) -> tuple[Law, ...]:
    """Every law that is compiled into a plant's program, each once."""
    program = plant.program
    return tuple(law for law in mechanism_laws(plant.mechanism) if law.name in program)


@cache
def mechanism_laws(mechanism: Mechanism) -> tuple[Law, ...]:
    """Every law that fits any place of a mechanism by a force, each once."""
    found: dict[str, Law] = {}
    for place, kind in mechanism.law_places().items():
        found |= {law.name: law for law in force_laws(kind, mechanism.turns(place))}
    return tuple(found.values())


MOST_MEMORIES = 2
"""Laws with a memory up to which each set of them has its own program [-]; more share one with all
but those of the support, for which the others would wait."""

MOST_ROWS = 4
"""Law rows up to which each count has its own program [-]; more are filled up to a power of two."""


@cache
def _row_count(mechanism: Mechanism, place: str) -> int:
    ones = dict.fromkeys(mechanism.names, 1.0)
    return len(mechanism.place_rows(place, ones, np)[1])


def _wire(plant: Plant) -> Wiring:
    mechanism = plant.mechanism
    names = [
        (law.name, symbol)
        for law in laws_of(plant)
        for symbol in ("", *(shape.symbol for shape in law.shapes))
    ]
    everywhere = list(mechanism.law_places())
    low = np.cumsum([0, *(_row_count(mechanism, place) for place in everywhere)])
    rows = plant.rows if plant.rows <= MOST_ROWS else 2 ** int(np.ceil(np.log2(plant.rows)))
    select = np.zeros((rows, low[-1]))
    spread = np.zeros((len(names), rows, len(plant.law_numbers)))
    owner = np.zeros((rows, len(plant.law_places)))
    row = 0
    for index, place in enumerate(plant.law_places):
        first, count = low[everywhere.index(place)], _row_count(mechanism, place)
        mine = slice(row, row + count)
        select[mine, first : first + count] = np.eye(count)
        owner[mine, index] = 1.0
        for slot, (where, law, symbol) in enumerate(plant.law_numbers):
            if where == place and (law.name, symbol) in names:
                spread[names.index((law.name, symbol)), mine, slot] = 1.0
        row += count
    return Wiring(select, spread, owner)


def numbers_vector(plant: Plant, numbers: Mapping[str, float]) -> np.ndarray:
    """A `z` [SI] with the mechanism's numbers set and everything else at its null."""
    z = np.zeros(plant.size)
    z[plant.slots["numbers"]] = [numbers[name] for name in plant.mechanism.names]
    return z
