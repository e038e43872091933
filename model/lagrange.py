"""Lagrange's equations of the planar robot over the coordinates that its model has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from . import planar, shaft
from .law import Law, Place, library
from .radau import Numbers, iteration_matrix, march

Array = Any

WITH_SPRING = ("pinned_wrist", "driven_wrist", "passive_wrist", "driven_arm")
WITHOUT_SPRING = ("fixed_collet", "driven_collet")
MODELS = (*WITH_SPRING, *WITHOUT_SPRING)

REFRESH = 100
"""Steps for which one iteration matrix serves; the slopes of laws are put in anew at each [-]."""


@dataclass(frozen=True)
class Acting:
    """A law at a place of the planar robot: strength and rounding widths are data.

    Attributes:
        place: sleeve, shaft or wrist.
        name: the law's name.
    """

    place: str
    name: str

    @property
    def law(self) -> Law:
        """The law itself."""
        return library()[self.name]


class Past(NamedTuple):
    """What laws that remember know at the start of a step.

    Attributes:
        entries: of each, in the order of `PlanarPlant.remembered`: what it remembers, shape
            (numbers, designs), and stretch and rate there.
        gone: time since [s]; None at the start itself.
    """

    entries: tuple[tuple[Any, tuple[Any, Any]], ...]
    gone: Any


@partial(jax.jit, static_argnums=(0, 1, 2, 3, 12))
def trace(
    model: str,
    acting: tuple[Acting, ...],
    balanced: bool,
    iterations: int,
    table: Mapping[str, Array],
    values: Array,
    starts: Array,
    start: Array,
    step: Array,
    pull: Array,
    strengths: Array,
    widths: Array,
    refresh: int = REFRESH,
) -> tuple[Array, ...]:
    """The motion of many designs as jax sees it: differentiable in every number.

    Args:
        model: one of `MODELS` (static).
        acting: laws in force (static).
        balanced: whether each starts in balance with its drives, instead of at `start` (static).
        iterations: Newton steps of every step (static).
        table: numbers by contract name, each of shape (designs,) [SI].
        values: `Signals.values` with designs last, shape (steps, 8, 3, designs), or 1 for all.
        starts: `Signals.start` with designs last, shape (4, designs), or 1 for all.
        start: positions and velocities, shape (8,) [SI].
        step: h [s].
        pull: gravity in the plane [m/s^2].
        strengths: of the laws, in their order [SI].
        widths: rounding of their corners in stretch and rate [SI].
        refresh: steps for which one iteration matrix serves (static).

    Returns:
        positions, velocities, accelerations (designs, t, 4), bend, clubhead speed, energy
        (designs, t) and the last change in the stage equations (designs,) [SI].
    """
    plant = PlanarPlant(model, acting, table, pull, strengths, widths)
    found = plant.run(values, starts, None if balanced else start, step, iterations, refresh)
    return tuple(jnp.moveaxis(part, -1, 0) for part in found)


def _turned(known: tuple[Array, ...], angle: Array) -> tuple[Array, Array]:
    """Cosine and sine of an angle near a known one, by Taylor's series to the seventh order."""
    before, cosine, sine = known
    e = angle - before
    square = e * e
    even = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square / 720.0))
    odd = e * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square / 5040.0)))
    return cosine * even - sine * odd, sine * even + cosine * odd


@jax.custom_jvp
def bent_shaft(lever: Array, across: Array, tilt: Array) -> shaft.Head:
    """`shaft.head_at` of the bend that follows [SI], worked out once, with its slopes known."""
    bend = shaft.bend_of(lever, across, tilt, jax.lax.fori_loop)
    return shaft.head_at(lever, across, tilt, bend)


@bent_shaft.defjvp
def _bent_shaft_moved(
    given: tuple[Array, ...], moves: tuple[Array, Array, Array]
) -> tuple[shaft.Head, shaft.Head]:
    lever, _, tilt = given
    head = bent_shaft(*given)
    moved = shaft.head_moved(lever, head, tilt, moves)
    return head, jax.tree.map(lambda x, move: jnp.broadcast_to(move, x.shape), head, moved)


class PlanarPlant:
    """Lagrange's equations over the coordinates that a model has; designs along the last axis.

    Args:
        model: one of `MODELS`.
        acting: laws in force.
        p: numbers by contract name [SI].
        pull: gravity in the plane, towards the ball [m/s^2].
        strengths: of the laws, in their order [SI].
        widths: rounding of their corners in stretch and rate, one pair for all or for each [SI].
        shapes: further numbers of each law [SI].
    """

    def __init__(
        self, model: str, acting: tuple[Acting, ...], p: Mapping[str, Array], pull: Array,
        strengths: Array, widths: Array, shapes: tuple[tuple[Array, ...], ...] = (),
    ) -> None:  # fmt: skip
        self.model, self.p, self.pull, self.acting = model, p, pull, acting
        self.strengths, self.widths = strengths, jnp.broadcast_to(widths, (len(acting), 2))
        self.shapes = shapes
        self.wrist = model in WITH_SPRING
        self.fixed = model == "fixed_collet"
        self.places = planar.PLACES if self.wrist else planar.PLACES[:-1]
        self.remembered = tuple(
            (number, index)
            for number, one in enumerate(acting)
            for index, place in enumerate(self.places)
            if one.law.memory is not None and one.place == place
        )

    def whole(self, x: Numbers) -> Numbers:
        """All four coordinates [SI]; a fixed collet stays at zero."""
        return (jnp.zeros_like(x[0]), *x) if self.fixed else x

    def kept(self, x: Numbers) -> Numbers:
        """The coordinates that move [SI]."""
        return x[1:] if self.fixed else x

    def ready(self, x: Numbers) -> tuple[Array, Array, Array]:
        """Collet angle [rad] with its cosine and sine, from which those of near ones follow."""
        angle = self.whole(x)[0]
        return angle, jnp.cos(angle), jnp.sin(angle)

    def imbalance(
        self, x: Numbers, x_rate: Numbers, x_bend: Numbers, u: Numbers, known: tuple[Any, ...]
    ) -> Numbers:
        """Inertia, springs, dampers and laws less what pushes, n numbers [N or N m].

        Args:
            x: coordinates that move [SI].
            x_rate: their rates [SI].
            x_bend: the rates of these [SI].
            u: arm and wrist angle, their rates, acceleration of the pivot, torque on the collet
                and force on the clubhead, both across the collet's axis; then that on the grip,
                where something pushes it [SI].
            known: see `ready`; then, where laws remember, the past (see `Past`).
        """
        q, v, a = (self.whole(part) for part in (x, x_rate, x_bend))
        pivot = (u[4], u[5])
        bent, axes = self._head(q), _turned(known[:3], q[0])
        left = list(planar.inertia_forces(self.p, q, v, a, pivot, axes, bent))
        past = known[3] if len(known) > 3 else None
        for number, one in enumerate(self._springs(q, v, u, bent)):
            left = one.added(left, one.force + self._laws(number, one, past))
        at = planar.points_of(self.p)
        left[0] = left[0] - u[6] - (at.grip + bent.along) * u[7]
        left[3] = left[3] - u[7]
        if len(u) > 8:
            left[0], left[1] = left[0] - at.grip * u[8], left[1] - u[8]
        return self.kept(tuple(left))

    def _head(self, q: Numbers) -> shaft.Head:
        return bent_shaft(planar.points_of(self.p).lever, q[3] - q[1], q[2])

    def stretches(self, number: int, q: Numbers, v: Numbers, u: Numbers) -> tuple[Array, Array]:
        """Stretch of a spring [m or rad] and its rate, of all four coordinates."""
        one = self._springs(q, v, u)[number]
        return one.stretch, one.rate

    def _springs(
        self, q: Numbers, v: Numbers, u: Numbers, bent: shaft.Head | None = None
    ) -> list[planar.Spring]:
        bent = self._head(q) if bent is None else bent
        return planar.springs(self.p, q, v, (u[0], u[1]), (u[2], u[3]), self.wrist, bent)

    def _laws(self, number: int, spring: planar.Spring, past: Past | None) -> Array:
        place, stretch, speed, _, _, k, c = spring
        total = jnp.zeros(())
        for index, acting in enumerate(self.acting):
            if acting.place == place and acting.law.memory is not None:
                memory = self.remember((index, number), stretch, speed, past)
                force = acting.law.memory.force
                shapes = self.shapes[index]
                total = total + force(self.strengths[index], shapes, memory, stretch, speed)
            elif acting.place == place:
                here = Place(k, c, self.widths[index, 0], self.widths[index, 1])
                force = acting.law.force
                assert force is not None
                total = total + force(self.strengths[index], stretch, speed, here)
        return total

    def remember(
        self, which: tuple[int, int], stretch: Array, speed: Array, past: Past | None
    ) -> Array:
        """What a law (by number, and number of its row) remembers at a stretch and its rate [SI].

        Without a past it has been loaded slowly, and is held; without a time gone since, it is
        what the past says.
        """
        memory, shapes = self.acting[which[0]].law.memory, self.shapes[which[0]]
        assert memory is not None
        if past is None:
            return memory.begin(shapes, stretch, speed)
        known, before = past.entries[self.remembered.index(which)]
        known = known if stretch.ndim == before[0].ndim else known[:, None]
        if past.gone is None:
            return known
        return memory.advance(shapes, known, before, (stretch, speed), past.gone)

    def matrices(self, q: Numbers, v: Numbers, u: Numbers) -> tuple[Array, Array, Array]:
        """Mass, damping and stiffness about a state, each (n, n, designs) [SI]."""
        n, known = len(q), self.ready(q)

        def along(unit: Array) -> Array:
            moved = tuple(tuple(x + 0.0 * q[0] for x in part) for part in unit.reshape(3, n))
            still = tuple(jnp.zeros_like(x) for x in q)

            def left(q: Numbers, v: Numbers, a: Numbers) -> Array:
                return jnp.stack(self.imbalance(q, v, a, u, known))

            return jax.jvp(left, (q, v, still), moved)[1]

        slopes = jax.vmap(along)(jnp.eye(3 * n)).reshape(3, n, n, -1)
        k, c, m = jnp.moveaxis(slopes, 1, 2)
        return m, c, k

    def inverse(self, q: Numbers, v: Numbers, u: Numbers, step: Array) -> Array:
        """Of the stage equations about a state, shape (n, n, 3, 3, designs) [SI of 1/mass]."""
        return iteration_matrix(*self.matrices(q, v, u), step)

    def bent(
        self, about: tuple[Array, Array, Array], q: Numbers, v: Numbers, u: Numbers, step: Array
    ) -> Array:
        """`inverse` [SI of 1/mass] of matrices without laws, the laws' slopes put in."""
        m, c, k = about
        whole = self.whole(q), self.whole(v)
        for number, one in enumerate(self._springs(*whole, u)):
            if all(acting.place != one.place for acting in self.acting):
                continue
            at = one.stretch, one.rate
            ones = tuple(jnp.ones_like(x) for x in at)
            none = tuple(jnp.zeros_like(x) for x in at)

            def law(
                stretch: Array, speed: Array, number: int = number, one: planar.Spring = one
            ) -> Array:
                return self._laws(number, one._replace(stretch=stretch, rate=speed), None)

            stiff = jax.jvp(law, at, (ones[0], none[1]))[1]
            lossy = jax.jvp(law, at, (none[0], ones[1]))[1]
            kept = jnp.stack([0.0 * q[0] + x for x in self.kept(one.along)])
            both = kept[:, None] * kept[None]
            k, c = k + both * stiff, c + both * lossy
        return iteration_matrix(m, c, k, step)

    def held(self, first: Array) -> Numbers:
        """Signals of drives that are held where they start, eight of shape (designs,) [SI]."""
        zero = jnp.zeros_like(first[0])
        down, side = planar.pivot_acceleration(self.p, (first[0], zero, zero), self.pull, jnp)
        return first[0], first[1], zero, zero, down + zero, side + zero, zero, zero

    def balance(self, first: Array) -> Numbers:
        """Where the robot rests under its weight with the drives held [SI]."""
        zero = jnp.zeros_like(first[0])
        q = self.kept((first[0] + first[1], zero, zero, zero))
        u = self.held(first)
        if not self.wrist and not self.fixed:
            return q  # a free collet hangs nowhere in particular
        still = tuple(zero for _ in q)

        def improve(_: int, q: Numbers) -> Numbers:
            known = self.ready(q)

            def forces(q: Numbers) -> Array:
                return jnp.stack(self.imbalance(q, still, still, u, known))

            def along(unit: Array) -> Array:
                return jax.jvp(forces, (q,), (tuple(x + 0.0 * zero for x in unit),))[1]

            slope = jnp.moveaxis(jax.vmap(along)(jnp.eye(len(q))), (0, 2), (2, 0))
            move = jnp.linalg.solve(slope, forces(q).T[..., None])[..., 0]
            return tuple(x - move[:, i] for i, x in enumerate(q))

        return jax.lax.fori_loop(0, 8, improve, q)

    def run(
        self,
        u: Array,
        first: Array,
        start: Array | None,
        step: Array,
        iterations: int,
        refresh: int = REFRESH,
    ) -> tuple[Array, ...]:
        """Positions, velocities, accelerations, bend, speed, energy, and the last change [SI]."""
        zero = 0.0 * self.p["club_length"]  # one for each design
        first = first + zero
        if start is None:
            q = self.balance(first)
            v = self.kept((first[2] + first[3], zero, zero, zero))
        else:
            given = [zero + x for x in start]
            q, v = self.kept(tuple(given[:4])), self.kept(tuple(given[4:]))
        still = tuple(zero for _ in q)
        inverse, anew = partial(self.inverse, step=step), None
        if self.acting:
            inverse = PlanarPlant(
                self.model, (), self.p, self.pull, self.strengths[:0], jnp.zeros(2)
            ).matrices
            anew = partial(self.bent, step=step)
        down, side = planar.pivot_acceleration(self.p, (u[:, 0], u[:, 2], u[:, 4]), self.pull, jnp)
        w = (*(u[:, i] for i in range(4)), down, side, u[:, 6], u[:, 7])
        moved = march(self.imbalance, q, v, w, step, inverse, iterations, refresh, self.ready, anew)
        joined = [
            tuple(jnp.concatenate([x[None], xs]) for x, xs in zip(one, many, strict=True))
            for one, many in zip((q, v, still), moved[:3], strict=True)
        ]
        qs, vs, bends = (self.whole(part) for part in joined)
        ends = jnp.concatenate([first[None], u[:, :4, 2] + zero])
        seen = self._seen(qs, vs, tuple(jnp.moveaxis(ends, 1, 0)))
        tables = (jnp.stack(part, axis=1) for part in (qs, vs, bends))
        return *tables, *seen, jnp.max(moved[3], axis=0)

    def _seen(self, q: Numbers, v: Numbers, drive: Numbers) -> tuple[Array, Array, Array]:
        d, rate, bent = drive[:2], drive[2:], self._head(q)
        along, across = planar.clubhead_velocity(self.p, q, v, d, rate, jnp, bent)
        energy = (
            planar.kinetic_energy(self.p, q, v, d, rate, jnp, bent)
            + planar.spring_energy(self.p, q, d, self.wrist, bent)
            + planar.weight_energy(self.p, q, d, self.pull, jnp, bent)
        )
        return bent.bend, jnp.sqrt(along**2 + across**2), energy
