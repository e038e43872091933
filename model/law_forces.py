"""Forces of all laws of a plant at an instant, and what they are made of."""

from __future__ import annotations

from copy import copy
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from .acting import ActingRows
from .law import Law, Memory, Place
from .linear import Array, StateSpace, moved_grounds
from .plant import Plant, laws_of
from .swung import SwungRows, Told, first_moment
from .swung_plant import swings_of, swung_rows, told_at, told_within


def rate_jumps(plant: Plant) -> bool:
    """Whether a ground's rate, which laws feel, jumps from interval to interval."""
    return any(
        ground.kind == "position" or (ground.kind == "velocity" and plant.inputs[ground.index].held)
        for ground in moved_grounds(plant.inputs)
    )


def times(matrix: Array, vector: Array) -> Array:
    """Matrix times vector [any] as a sum that fuses with its neighbours; dot calls would not."""
    return jnp.sum(matrix * vector[None, :], axis=1)


def begun(memory: Memory, shapes: Any, now: tuple[Array, Array], since: Array) -> Array:
    """What a law remembers at a start state, shape (numbers, rows).

    Args:
        memory: of the law.
        shapes: its further numbers [SI].
        now: stretch and rate at the start [SI].
        since: time since a blow threw the mechanism out of its rest, over which the stretch is
            taken to have grown evenly unless the law says better [s]; 0 where it was loaded slowly.
    """
    slow = memory.begin(shapes, *now)
    if memory.struck is not None:
        return jnp.where(since > 0, memory.struck(shapes, *now), slow)
    rest = jnp.zeros_like(now[0]), jnp.zeros_like(now[1])
    spent = jnp.where(since > 0, since, 1.0)
    thrown = memory.advance(shapes, memory.begin(shapes, *rest), rest, now, spent)
    return jnp.where(since > 0, thrown, slow)


class LawNumbers(NamedTuple):
    """What the laws of a plant are made of, so taken apart that each row has numbers of its own.

    Attributes:
        strengths: strength and shapes of every law, shape (rows,) each [SI].
        stiffness: of each row's place, shape (rows,) [N/m or N m/rad].
        damping: of each row's place, shape (rows,) [N s/m or N m s/rad].
        weight: see `SwungRows`, shape (rows,) [kg, kg/m or 1].
        length: of the arm, shape () [m].
        moment: see `Told`, shape () [kg m].
    """

    strengths: tuple[Array, ...]
    stiffness: Array
    damping: Array
    weight: Array
    length: Array
    moment: Array


class Laws:
    """Forces of all laws of a plant, and their slopes."""

    def __init__(self, plant: Plant, space: StateSpace, acting: ActingRows, z: Array) -> None:
        self.space, self.n_inputs, self.plant = space, space.rate_input.shape[1], plant
        self.numbers = plant.numbers(z)
        self.swings = swings_of(plant.mechanism)
        self.jumps = rate_jumps(plant)
        self.since = z[plant.slots["since"]][0]
        self.rows = space.stretch.shape[0]
        self.widths = acting.widths[:, 0], acting.widths[:, 1]
        weight, length, moment = jnp.zeros(self.rows), jnp.zeros(()), jnp.zeros(())
        if self.swings:
            first, weight = (acting.select @ x for x in swung_rows(plant.mechanism, self.numbers))
            self.first = first
            length = jnp.asarray(self.numbers.get("arm_length", 0.0))
            moment = jnp.asarray(first_moment(self.numbers))
        strengths = tuple(acting.strengths)
        self.own = LawNumbers(strengths, space.stiffness, space.damping, weight, length, moment)
        self._take(self.own)

    def made_of(self, own: LawNumbers) -> Laws:
        """The same laws with other numbers [SI]."""
        found = copy(self)
        found._take(own)
        return found

    def _take(self, own: LawNumbers) -> None:
        self.own = own
        if self.swings:
            self.swung = SwungRows(self.first, own.weight)
        self.place = Place(own.stiffness, own.damping, *self.widths)
        self.plain: list[tuple[Law, Array]] = []
        self.told: list[tuple[Law, Array]] = []
        self.lasting: list[tuple[Law, Memory, Array, list[Array]]] = []
        at = 0
        for law in laws_of(self.plant):
            strength, at = own.strengths[at], at + 1
            given, at = own.strengths[at : at + len(law.shapes)], at + len(law.shapes)
            if law in self.swings:
                self.told.append((law, strength))
            elif law.memory is None:
                self.plain.append((law, strength))
            else:
                shapes = [jnp.where(shape > 0, shape, 1.0) for shape in given]
                shapes = [*law.memory.shapes_at(shapes, strength, self.place)]
                self.lasting.append((law, law.memory, strength, shapes))

    def force(self, stretch: Array, rate: Array) -> Array:
        """Force of the laws without a memory on each row [N or N m]; rows are the last axis."""
        total = jnp.zeros_like(stretch)
        for law, strength in self.plain:
            assert law.force is not None
            total = total + law.force(strength, stretch, rate, self.place)
        return total

    def begin(self, stretch: Array, rate: Array) -> Array:
        """What laws remember of how the motion began, shape (numbers, rows) [SI]."""
        empty = jnp.zeros((0, self.rows))
        parts = [begun(m, shapes, (stretch, rate), self.since) for _, m, _, shapes in self.lasting]
        return jnp.concatenate([empty, *parts])

    def seen_at(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Stretch and rate of every row at a state under inputs [SI]."""
        space, rate = self.space, times(self.space.rate, x)
        moved = rate + times(space.rate_input, w) if self.n_inputs else rate
        return times(space.stretch, x), moved

    def begun_at(self, x: Array, w: Array, given: Array | None = None) -> tuple[Array, Array]:
        """Forces [N or N m] at a start state, and what laws remember there or were given."""
        seen = self.seen_at(x, w)
        memory = self.begin(*seen) if given is None else given
        return self.whole_force(memory, *seen, self.told_at(x, w)), memory

    def advance(self, memory: Array, before: Any, after: Any, step: Array) -> Array:
        """What laws remember a step [s] later [SI]."""
        parts, at = [], 0
        for _, law, _, shapes in self.lasting:
            own, at = memory[at : at + law.size], at + law.size
            parts.append(law.advance(shapes, own, before, after, step))
        return jnp.concatenate(parts) if parts else memory

    def whole_force(self, memory: Array, stretch: Array, rate: Array, told: Told | None) -> Array:
        """Force of all laws on each row at one instant, shape (rows,) [N or N m]."""
        total, at = self.force(stretch, rate), 0
        for law, strength in self.told:
            assert law.swing is not None and told is not None
            total = total + law.swing(strength, stretch, told, self.swung)
        for _, law, strength, shapes in self.lasting:
            own, at = memory[at : at + law.size], at + law.size
            total = total + law.force(strength, shapes, own, stretch, rate)
        return total

    def told_at(self, x: Array, w: Array) -> Told | None:
        """What the drive tells at a state under inputs [SI]; None where nothing is swung."""
        return told_at(self.plant, self.numbers, x, w) if self.swings else None

    def told_within(self, x: Array, w: tuple[Array, Array], step: Array) -> Told | None:
        """The same in the middle and at the end of a step from a state on [SI]."""
        return told_within(self.plant, self.numbers, x, w, step) if self.swings else None

    def at_nodes(
        self, seen: tuple[Array, Array], memory: Array, before: Any, step: Array
    ) -> tuple[Array, Array]:
        """Forces in the middle and at the end of a step, and what laws remember there.

        Args:
            seen: stretches and rates in the middle and at the end, shape (2, rows) each.
            memory: what laws remember at the start of the step, shape (numbers, rows).
            before: stretch and rate at the start, and what is told at the nodes.
            step: length of the step [s].

        Returns:
            Shapes (2, rows) [N or N m] and (numbers, 2, rows).
        """
        *began, told = before
        spent = step * jnp.array([[0.5], [1.0]])
        later = self.advance(memory[:, None], began, seen, spent)
        return self.whole_force(later, *seen, told), later

    def slopes(self, nodes: Array, memory: Array, before: Any, step: Array) -> tuple[Array, Array]:
        """Forces as `at_nodes`, and their derivatives by stretch and rate, shape (2, 2, rows) [SI].

        Rows and nodes do not mix; `nodes`: shape (2 nodes, 2, rows).
        """

        def forces(stretch: Array, rate: Array) -> Array:
            return self.at_nodes((stretch, rate), memory, before, step)[0]

        seen = nodes[:, 0], nodes[:, 1]
        one, zero = jnp.ones_like(seen[0]), jnp.zeros_like(seen[0])
        force, by_stretch = jax.jvp(forces, seen, (one, zero))
        by_rate = jax.jvp(forces, seen, (zero, one))[1]
        return force, jnp.stack([by_stretch, by_rate], axis=1)
