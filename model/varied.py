"""How a march moves with what it is made of: derivatives along many directions at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .acting import ActingRows, LinearPart
from .kept import keepable, kept
from .law_forces import Laws, rate_jumps
from .linear import Array
from .march import (
    begin,
    interval_values,
    inverse,
    law_step,
    linear_pushes,
    march_linear,
    offset_mask,
)
from .plant import Plant, laws_of
from .swung import Told
from .swung_plant import TOLD, swings_of, told_within

BLOCK = 256
"""Steps whose matrices are found together [-]: they stay in the processor's cache."""


@keepable
class Point(NamedTuple):
    """What a motion is made of; also, with a first axis of directions, how that moves.

    Attributes:
        z: of the bare plant, its joints told by their accelerations [SI].
        strengths: of every law on every row, shape (numbers, rows) [SI].
        linear: the mechanism.
        inputs: samples, shape (t, inputs) [SI].
    """

    z: Any
    strengths: Any
    linear: LinearPart
    inputs: Any


def is_varied(bare: Plant) -> bool:
    """Whether `varied_motion` is meant for it: laws act, and no ground's rate jumps."""
    return bool(laws_of(bare)) and not rate_jumps(replace(bare, inputs=bare.marched))


@keepable
class StepMatrices(NamedTuple):
    """A motion, and how the end of each of its steps follows from its beginning.

    Sizes: u is of what a step is linear in, see `_Steps`; end of states, law forces and memory.

    Attributes:
        motion: states and law forces, shapes (t, states) and (t, rows) [SI].
        u: shape (steps, u) [SI].
        whole: of the end by the beginning, shape (steps, end, end) [SI].
        through: of the end by law forces in the middle and at the end, as far as they do not follow
            from what is seen, shape (steps, end, 2 rows) [SI].
        forces: of these by stretches and rates, shape (steps, 2 rows, 6 rows) [SI].
        memory: of memory at the end by the same, shape (steps, memory, 6 rows) [SI].
        told: of both by what is told, shape (steps, 2 rows + memory, inputs at start and end) [SI].
        numbers: of both by what the laws are made of, shape (steps, 2 rows + memory, numbers) [SI].
    """

    motion: tuple[Array, Array]
    u: Array
    whole: Array
    through: Array
    forces: Array
    memory: Array
    told: Array
    numbers: Array


@kept((0, 1))
def step_matrices(
    plant: Plant, substeps: int, at: Point, acting: ActingRows, step: Array
) -> StepMatrices:
    """March a motion, and find what all its derivatives share.

    It is a program of its own: what is found here is computed once, not for every direction.

    Args:
        plant: bare, its joints told by acceleration; `is_varied` (static).
        substeps: steps a sample (static).
        at: what the motion is made of.
        acting: law rows in force.
        step: sampling interval [s].

    Source: as `varied_motion`.
    """
    return _Steps(plant, substeps, acting, step).matrices(at)


@kept((0, 1))
def varied_motion(
    plant: Plant,
    substeps: int,
    at: Point,
    along: Point,
    acting: ActingRows,
    step: Array,
    known: StepMatrices,
) -> tuple[Array, Array]:
    """Derivatives of a motion along directions, exact.

    What a direction changes in a step is linear in what it has changed before, with one matrix for
    all directions. These matrices, and what each direction adds of its own, are found for many
    steps at once; only their sum is left to be marched.

    Args:
        plant: bare, its joints told by acceleration; `is_varied` (static).
        substeps: steps a sample (static).
        at: what the motion is made of.
        along: directions on a first axis, k of them.
        acting: law rows in force.
        step: sampling interval [s].
        known: `step_matrices` at this point.

    Returns:
        Of states and of law forces, shapes (k, t, states) and (k, t, rows) [SI].

    Source: the variational equation, Hairer, Norsett and Wanner 1993, Solving Ordinary Differential
    Equations I, section I.14, of the march's own steps; tests/model/test_varied.py.
    """
    steps = _Steps(plant, substeps, acting, step)

    def moved(function: Callable[[Point], Any]) -> Any:
        """How what a function makes of the point moves, directions on the last axis."""
        by = jax.vmap(lambda one: jax.jvp(function, (at,), (one,))[1], out_axes=-1)
        return by(along)

    n, m, lanes = steps.states, steps.rows, len(along.z)
    apart = 6 * m, steps.seen  # rows between are of what is told, and do not change themselves
    by_table = jnp.delete(moved(steps.table), np.arange(*apart), axis=0)
    told = steps.table(at)[:, steps.told :]
    beside = by_table.transpose(1, 0, 2).reshape(by_table.shape[1], len(by_table) * lanes)
    by_numbers = jax.tree.leaves(moved(lambda at: steps.laws(at).own))
    by_numbers = jnp.concatenate([by.reshape(by.size // lanes, lanes) for by in by_numbers])
    begin_by = [by.reshape(by.size // lanes, lanes) for by in moved(steps.begun)]
    delta, by_told = jnp.concatenate(begin_by), jnp.concatenate(moved(steps.intervals), axis=1)

    def block(delta: Array, part: tuple[StepMatrices, Array]) -> tuple[Array, Array]:
        known, by_told = part
        own = (known.u @ beside).reshape(len(known.u), len(by_table), lanes)
        push = own[:, 6 * m :] + _summed(told[None, steps.seen :], by_told)
        laws = jnp.einsum("tij,jk->tik", known.numbers, by_numbers)
        laws = laws + _summed(known.told, by_told)
        forces = known.forces @ own[:, : 6 * m] + laws[:, : 2 * m]
        push = jnp.concatenate([push, jnp.zeros((len(own), m, lanes)), laws[:, 2 * m :]], axis=1)
        push = push + _summed(known.through, forces)
        if known.memory.shape[1]:
            push = push.at[:, n + m :].add(known.memory @ own[:, : 6 * m])

        def advance(delta: Array, given: tuple[Array, Array]) -> tuple[Array, Array]:
            matrix, new = given
            for column in range(matrix.shape[1]):
                new = new + matrix[:, column, None] * delta[column]
            return new, new[: n + m]

        return jax.lax.scan(advance, delta, (known.whole, push))

    count = len(known.u)
    parts = known._replace(motion=()), by_told
    blocked = jax.tree.map(lambda part: _blocked(part, min(BLOCK, count)), parts)
    after = jax.lax.scan(block, delta, blocked)[1]
    after = after.reshape(after.shape[0] * after.shape[1], n + m, lanes)[:count][
        substeps - 1 :: substeps
    ]
    after = jnp.concatenate([delta[None, : n + m], after]).transpose(2, 0, 1)
    return after[..., :n], after[..., n:]


@kept((0,))
def varied_linear(
    plant: Plant, at: Point, along: Point, step: Array
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """A motion without laws, and its derivatives along directions, exact.

    What moves it step by step is found at once for all steps: only one matrix is left to be
    marched, for all directions together.

    Args:
        plant: bare, its joints told by acceleration, no law acts (static).
        at: what the motion is made of.
        along: directions on a first axis, k of them.
        step: sampling interval [s].

    Returns:
        States and (no) law forces, shapes (t, states) and (t, 0) [SI]; and of both how they move,
        shapes (k, t, states) and (k, t, 0).

    Source: as `varied_motion`; tests/model/test_varied.py.
    """

    def moved(function: Callable[[Point], Array]) -> Array:
        """How what a function makes of the point moves, directions on the last axis."""
        by = jax.vmap(lambda one: jax.jvp(function, (at,), (one,))[1], out_axes=-1)
        return by(along)

    def begun(at: Point) -> Array:
        return begin(plant, at.z[plant.slots["start"]], at.inputs)

    def pushes(at: Point) -> Array:
        drive = at.inputs + at.z[plant.slots["drive"]] * offset_mask(plant)
        return linear_pushes(at.linear.matrices, *interval_values(plant, drive, step))

    transition = at.linear.matrices.free[1]
    states = march_linear(transition, begun(at), pushes(at))
    turned = along.linear.matrices.free[1]  # direction, state, state
    lanes, n = turned.shape[:2]
    own = states[:-1] @ turned.transpose(2, 1, 0).reshape(n, n * lanes)
    push = moved(pushes) + own.reshape(len(states) - 1, n, lanes)
    by_states = march_linear(transition, moved(begun), push).transpose(2, 0, 1)
    none = jnp.zeros((len(states), 0))
    return (states, none), (by_states, jnp.zeros((lanes, *none.shape)))


def _summed(matrices: Array, own: Array) -> Array:
    """Products of small matrices (t, i, j) and (t, j, k): sums that fuse, no dot calls."""
    total = jnp.zeros((len(own), matrices.shape[1], own.shape[2]))
    for column in range(matrices.shape[2]):
        total = total + matrices[:, :, column, None] * own[:, None, column]
    return total


def _blocked(part: Array, block: int) -> Array:
    """An array with its first axis cut into blocks, the last of them filled up."""
    lacks = -len(part) % block
    whole = jnp.concatenate([part, jnp.broadcast_to(part[-1:], (lacks, *part.shape[1:]))])
    return whole.reshape(len(whole) // block, block, *part.shape[1:])


class _Steps:
    """The steps of a march.

    A step is linear but for the laws: with u the states, the law forces at its start, middle and
    end, and what is told at start and end, one table of numbers times u is what laws see at middle
    and end, what they saw at the start, and the next states.
    """

    def __init__(self, plant: Plant, substeps: int, acting: ActingRows, step: Array) -> None:
        self.plant, self.substeps, self.acting, self.step = plant, substeps, acting, step
        self.length = step / substeps
        self.states, self.rows = plant.n_states, acting.select.shape[0]
        self.told = self.states + 3 * self.rows  # first column of what is told
        self.swung = bool(swings_of(plant.mechanism))
        self.seen = 6 * self.rows + (2 * len(TOLD) if self.swung else 0)

    def laws(self, at: Point) -> Laws:
        acting = self.acting._replace(strengths=at.strengths)
        return Laws(self.plant, at.linear.space, acting, at.z)

    def intervals(self, at: Point) -> tuple[Array, Array]:
        """What is told at the start and at the end of every step, shapes (steps, inputs) [SI]."""
        drive = at.inputs + at.z[self.plant.slots["drive"]] * offset_mask(self.plant)
        first, last = interval_values(self.plant, drive, self.step)
        parts = jnp.arange(self.substeps + 1)[:, None] / self.substeps
        every = first[:, None] + (last - first)[:, None] * parts
        shape = len(first) * self.substeps, first.shape[1]
        return every[:, :-1].reshape(shape), every[:, 1:].reshape(shape)

    def begun(self, at: Point) -> tuple[Array, Array, Array]:
        """States, law forces and memory at the start."""
        x0 = begin(self.plant, at.z[self.plant.slots["start"]], at.inputs)
        return x0, *self.laws(at).begun_at(x0, self.intervals(at)[0][0])

    def table(self, at: Point) -> Array:
        """Rows: seen in the middle and at the end, seen before, next states; columns: as u."""
        space, matrices = at.linear
        n = space.rate_input.shape[1]
        look = jnp.concatenate([space.stretch, space.rate])
        still = jnp.zeros_like(space.rate_input)
        moved = jnp.concatenate([still, space.rate_input])
        steps, seen = [], []
        for k, share in enumerate((0.5, 1.0)):  # of the step's end in what is told there
            first, middle, last = (node[:, :n] for node in matrices.nodes[k])
            told = first + 0.5 * middle, last + 0.5 * middle
            parts = [matrices.free[k], *(node[:, n:] for node in matrices.nodes[k]), *told]
            steps.append(jnp.concatenate(parts, axis=1))
            carried = jnp.concatenate([(1.0 - share) * moved, share * moved], axis=1)
            seen.append((look @ steps[k]).at[:, self.told :].add(carried))
        none = jnp.zeros((2 * self.rows, 3 * self.rows))
        before = jnp.concatenate([look, none, moved, jnp.zeros_like(moved)], axis=1)
        return jnp.concatenate([*seen, before, self.swings(at, n), steps[1]])

    def swings(self, at: Point, inputs: int) -> Array:
        """Rows of what a told motion swings, in the middle and at the end: linear as well."""
        count = self.told + 2 * inputs
        if not self.swung:
            return jnp.zeros((0, count))
        numbers = self.plant.numbers(at.z)

        def told(u: Array) -> Array:
            w = u[self.told : self.told + inputs], u[self.told + inputs :]
            found = told_within(self.plant, numbers, u[: self.states], w, self.length)
            return jnp.stack([getattr(found, name)[..., 0] for name in TOLD], axis=1).reshape(-1)

        return jax.vmap(told, out_axes=1)(jnp.eye(count))

    def trace(self, at: Point, begun: Any, told: Any) -> tuple[tuple[Array, ...], Any]:
        """States, law forces (start; middle and end) and memory of every step; and the motion."""
        x0, f0, memory = begun
        one = law_step(self.laws(at), at.linear.matrices, self.length)

        def advance(carry: tuple[Array, ...], w: tuple[Array, Array]) -> tuple[Any, Any]:
            new, f, ahead, memory, _ = one(carry, w)
            return (new, f[self.rows :], ahead, memory), (carry[0], carry[1], f, carry[3])

        carry = x0, f0, jnp.concatenate([f0, f0]), memory
        (x, f, *_), trace = jax.lax.scan(advance, carry, told)
        ends = ((trace[0], x), (trace[1], f))
        sampled = [jnp.concatenate([part[:: self.substeps], last[None]]) for part, last in ends]
        return trace, (sampled[0], sampled[1])

    def matrices(self, at: Point) -> StepMatrices:
        """See `step_matrices`."""
        begun, told, table = self.begun(at), self.intervals(at), self.table(at)
        (*parts, memory), motion = self.trace(at, begun, told)
        u, m, n = jnp.concatenate([*parts, *told], axis=1), self.rows, self.states
        known, fresh = table[:, : n + m], table[:, n + m : self.told]
        see, size, laws = fresh[: 4 * m], memory.shape[1], self.laws(at)
        # what laws see and remember, of how the step begins
        sight = jax.scipy.linalg.block_diag(known[: self.seen], jnp.eye(size * m))
        ends = jnp.concatenate([fresh[self.seen :], jnp.eye(2 * m)[m:]])

        def single(seen: Array, memory: Array) -> tuple[Array, ...]:
            forces, later, numbers = self._slopes(laws, seen, memory)
            turned = inverse(jnp.eye(2 * m) - forces[:, : 4 * m] @ see)
            through = jnp.concatenate([ends, later[:, : 4 * m] @ see]) @ turned
            whole = through @ (forces @ sight)
            whole = whole.at[:n, : n + m].add(known[self.seen :])
            whole = whole.at[n + m :].add(later @ sight)
            both = (
                jnp.concatenate([forces, later])[:, : self.seen] @ table[: self.seen, self.told :]
            )
            return whole, through, forces[:, : 6 * m], later[:, : 6 * m], both, numbers

        return StepMatrices(motion, u, *jax.vmap(single)(u @ table[: self.seen].T, memory))

    def _slopes(self, laws: Laws, seen: Array, memory: Array) -> tuple[Array, Array, Array]:
        """Derivatives of law forces in the middle and at the end, and of memory at the end.

        Shapes (2 rows, seen + memory) and (memory, seen + memory), by what is seen and by memory;
        and (2 rows + memory, numbers), by what the laws are made of. Rows do not mix, nor do middle
        and end, so that one direction tells of all of them; each moves one law or a few.
        """
        m, size, eye = self.rows, memory.shape[0], jnp.eye(self.rows)
        middle, end, before = seen[: 6 * m].reshape(3, 2, m)
        parts = ()
        if self.swung:
            parts = tuple(seen[6 * m :].reshape(2, len(TOLD)).T[..., None])
        given = (
            jnp.stack([middle[0], end[0]]),
            jnp.stack([middle[1], end[1]]),
            *before,
            *parts,
            memory,
            *jax.tree.leaves(laws.own),
        )
        outline = jax.tree.structure(laws.own)
        first = 4 + len(parts)

        def forced(*given: Array) -> tuple[Array, Array]:
            own = jax.tree.unflatten(outline, given[first + 1 :])
            told = Told._make((*given[4:first], own.length, own.moment)) if parts else None
            seen, before = (given[0], given[1]), (given[2], given[3], told)
            force, later = laws.made_of(own).at_nodes(seen, given[first], before, self.length)
            return force, later[:, 1]

        def by(which: int, along: Array) -> tuple[Array, Array]:
            def single(value: Array) -> tuple[Array, Array]:
                return forced(*given[:which], value, *given[which + 1 :])

            return jax.jvp(single, (given[which],), (along,))[1]

        def along(which: Iterable[int]) -> list[tuple[Array, Array]]:
            return [by(one, jnp.ones_like(given[one])) for one in which]

        single = jnp.eye(size)[:, :, None] * jnp.ones(m)
        sights, remembered = along(range(first)), [by(first, one) for one in single]
        numbers = along(range(first + 1, len(given)))
        forces, later = _stacked(sights, (2, m), (size, m))
        own_forces, own_later = _stacked(remembered, (2, m), (size, m))
        nodes, end = jnp.eye(2), jnp.array([0.0, 1.0])
        of_forces = [
            jnp.einsum("kni,np,ij->nipkj", forces[:2], nodes, eye).reshape(2 * m, 4 * m),
            jnp.einsum("kni,ij->nikj", forces[2:4], eye).reshape(2 * m, 2 * m),
            jnp.einsum("kni,np->nipk", forces[4:], nodes).reshape(2 * m, 2 * len(parts)),
            jnp.einsum("kni,ij->nikj", own_forces, eye).reshape(2 * m, size * m),
        ]
        of_later = [
            jnp.einsum("kri,p,ij->ripkj", later[:2], end, eye).reshape(size * m, 4 * m),
            jnp.einsum("kri,ij->rikj", later[2:4], eye).reshape(size * m, 2 * m),
            jnp.zeros((size * m, 2 * len(parts))),
            jnp.einsum("kri,ij->rikj", own_later, eye).reshape(size * m, size * m),
        ]
        of_numbers = []
        for number, found in zip(given[first + 1 :], numbers, strict=True):
            column = jnp.concatenate(found)  # node or what is remembered, row
            if number.ndim:
                column = column[:, :, None] * eye
            of_numbers.append(column.reshape((2 + size) * m, max(number.size, 1)))
        return (
            jnp.concatenate(of_forces, axis=1),
            jnp.concatenate(of_later, axis=1),
            jnp.concatenate(of_numbers, axis=1),
        )


def _stacked(found: Sequence[tuple[Array, Array]], *shapes: tuple[int, int]) -> list[Array]:
    """Pairs of arrays, each first one over the other, and each second."""
    return [
        jnp.stack([pair[which] for pair in found]) if found else jnp.zeros((0, *shape))
        for which, shape in enumerate(shapes)
    ]
