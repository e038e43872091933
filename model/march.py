"""The march of a motion: exact steps, and implicit exponential ones where laws act."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from .acting import ActingRows, LinearPart
from .chain import DERIVATIVES, FORCES
from .kept import keepable
from .law_forces import Laws, times
from .linear import Array, Step, moved_grounds
from .plant import Plant

NEWTON_STEPS = 3
"""Newton steps that every step of the march takes at least [-]."""

MOST_NEWTON_STEPS = 40
"""Most that it takes while the last one still moved the forces by more than `SETTLED` [-]: what
resists with a rate's square settles by halves from far, and left unsettled it drives the motion."""

SETTLED = 1e-3
"""Share of the largest force [-]; the next step's error is its square."""

MOST_UNROLLED = 16
"""Largest matrix of law forces whose inverse is unrolled [-]; larger ones take long to compile."""


@keepable
class March(NamedTuple):
    """A motion as it was marched.

    Attributes:
        states: shape (t, states) [SI].
        forces: of the laws, shape (t, rows) [N or N m].
        defect: what Newton's last step still changed of them, shape (t,) [N or N m].
        memory: what laws remember at the end, shape (numbers, rows) [SI].
    """

    states: Array
    forces: Array
    defect: Array
    memory: Array


def offset_mask(plant: Plant) -> Array:
    """0 for inputs whose offset changes only the start state, 1 for others, shape (inputs,) [-]."""
    return jnp.asarray([0.0 if DERIVATIVES.get(p.quantity) == 0 else 1.0 for p in plant.inputs])


def interval_values(plant: Plant, drive: Array, step: Array) -> tuple[Array, Array]:
    """What each input is at the start and at the end of every interval, in the state's terms.

    Args:
        plant: whose inputs they are.
        drive: at the samples, shape (t, inputs) [SI].
        step: sampling interval [s].

    Returns:
        Two of shape (t - 1, inputs) [SI].
    """
    start, end = [], []
    for index, port in enumerate(plant.inputs):
        now, then = drive[:-1, index], drive[1:, index]
        if port.quantity not in FORCES and DERIVATIVES[port.quantity] == 0:
            now = then = (then - now) / step
        elif port.held:
            then = now
        start.append(now)
        end.append(then)
    if not start:
        empty = jnp.zeros((drive.shape[0] - 1, 0))
        return empty, empty
    return jnp.stack(start, axis=1), jnp.stack(end, axis=1)


def begin(plant: Plant, x0: Array, inputs: Array) -> Array:
    """Start state [SI] with the grounds that are told by position where they begin."""
    n = len(plant.mechanism.coordinates)
    for ground in moved_grounds(plant.inputs):
        if ground.kind == "position":
            x0 = x0.at[2 * n + ground.state].add(inputs[0, ground.index])
    return x0


def march_rows(
    plant: Plant,
    substeps: int,
    z: Array,
    acting: ActingRows,
    inputs: Array,
    step: Array,
    linear: LinearPart,
    pushes: Array | None = None,
) -> March:
    """March a motion [SI].

    Args:
        plant: bare; which rows act is data (static).
        substeps: steps a sample (static).
        z: of the bare plant [SI].
        acting: law rows in force.
        inputs: sampled inputs, shape (t, inputs) [SI].
        step: sampling interval [s].
        linear: the mechanism at z.
        pushes: further forces that resist all law rows of the mechanism, linear between samples,
            shape (t, all rows) [N or N m]; `linear` must know of them.
    """
    space, matrices = linear
    drive = inputs + z[plant.slots["drive"]] * offset_mask(plant)
    first, last = interval_values(plant, drive, step)
    if pushes is not None:
        first = jnp.concatenate([first, pushes[:-1]], axis=1)
        last = jnp.concatenate([last, pushes[1:]], axis=1)
    x0 = begin(plant, z[plant.slots["start"]], inputs)
    law = Laws(plant, space, acting, z)
    if law.rows == 0:
        return _march_linear(matrices, x0, first, last, substeps)
    return _march_laws(law, matrices, x0, first, last, substeps, (step / substeps, acting.memory))


def driven(told: Array, matrix: Array) -> Array:
    """Rows times the transpose of a matrix with few columns: ``told @ matrix.T``.

    A sum that fuses with its neighbours; along many directions dot calls take three times as long.

    Args:
        told: shape (t, columns) [SI].
        matrix: shape (rows, columns) [SI].

    Returns:
        Shape (t, rows) [SI].
    """
    found = jnp.zeros((told.shape[0], matrix.shape[0]))
    for index in range(told.shape[1]):
        found = found + told[:, index, None] * matrix[None, :, index]
    return found


def linear_pushes(matrices: Step, first: Array, last: Array) -> Array:
    """What inputs add to the state in every interval.

    Args:
        matrices: of one step.
        first: inputs at the start of every interval, shape (t - 1, inputs), see `interval_values`.
        last: the same at its end.

    Returns:
        Shape (t - 1, states) [SI].
    """
    start, middle, end = matrices.nodes[1]
    return driven(first, start + 0.5 * middle) + driven(last, end + 0.5 * middle)


def march_linear(transition: Array, x0: Array, pushes: Array) -> Array:
    """States of a linear motion, or of many side by side, shape (t, states, ...) [SI].

    Args:
        transition: over one interval, shape (states, states) [SI].
        x0: start, shape (states, ...) [SI].
        pushes: what every interval adds, shape (t - 1, states, ...) [SI].
    """

    def advance(x: Array, push: Array) -> tuple[Array, Array]:
        if x.ndim == 1:
            new = times(transition, x) + push
        else:
            new = push
            for column in range(len(x)):  # a sum that fuses; dot calls would not
                new = new + transition[:, column, None] * x[column]
        return new, new

    _, states = jax.lax.scan(advance, x0, pushes, unroll=2)
    return jnp.concatenate([x0[None], states])


def _march_linear(matrices: Step, x0: Array, first: Array, last: Array, substeps: int) -> March:
    if substeps != 1:
        raise ValueError("a linear motion needs one step a sample; expected substeps = 1")
    states = march_linear(matrices.free[1], x0, linear_pushes(matrices, first, last))
    count = states.shape[0]
    return March(states, jnp.zeros((count, 0)), jnp.zeros(count), jnp.zeros((0, 0)))


def inverse(matrix: Array) -> Array:
    """Inverse of a small matrix [any] by unrolled elimination (law matrices are near 1)."""
    size = matrix.shape[0]
    if size > MOST_UNROLLED:
        return jnp.linalg.inv(matrix)
    if size == 2:
        (a, b), (c, d) = (matrix[0, 0], matrix[0, 1]), (matrix[1, 0], matrix[1, 1])
        return jnp.array([[d, -b], [-c, a]]) / (a * d - b * c)
    return _eliminated(matrix, jnp.eye(size))


def _solved(matrix: Array, right: Array) -> Array:
    """What a small matrix turns into `right`, shape (size,), as `inverse`."""
    if 2 < matrix.shape[0] <= MOST_UNROLLED:
        return _eliminated(matrix, right[:, None])[:, 0]
    return times(inverse(matrix), right)


def _eliminated(matrix: Array, right: Array) -> Array:
    """A matrix's inverse times `right`, shape (size, columns)."""
    size = matrix.shape[0]
    rows = jnp.concatenate([matrix, right], axis=1)
    for pivot in range(size):
        line = rows[pivot] / rows[pivot, pivot]
        factor = rows[:, pivot].at[pivot].set(0.0)
        rows = rows.at[pivot].set(line) - factor[:, None] * line[None, :]
    return rows[:, size:]


def law_step(law: Laws, matrices: Step, step: Array) -> Callable[..., tuple[Array, ...]]:
    """One step under laws.

    Args:
        law: what acts.
        matrices: of one step.
        step: its length [s].

    Returns:
        A function of the state (states, law forces, first guess of those at the nodes, memory) and
        of what is told at the step's start and end: states and law forces in the middle and at the
        end, the next guess, memory, and what Newton's last step still changed of the forces.
    """
    space, n, m = law.space, law.n_inputs, law.rows
    look = jnp.concatenate([space.stretch, space.rate])
    to_input = [[node[:, :n] for node in nodes] for nodes in matrices.nodes]
    to_force = [[node[:, n:] for node in nodes] for nodes in matrices.nodes]
    # unknown: law forces at middle and end; seen: stretches and rates there
    see_free = jnp.concatenate([look @ matrices.free[0], look @ matrices.free[1]])
    see_first = jnp.concatenate([look @ to_force[0][0], look @ to_force[1][0]])
    see = jnp.concatenate(
        [jnp.concatenate([look @ to_force[k][1], look @ to_force[k][2]], axis=1) for k in (0, 1)]
    )
    see_node = see.reshape(2, 2, m, 2 * m)  # node, stretch or rate, row, unknown

    def seen_forces(seen: Array, known: tuple[Array, Any]) -> tuple[Array, Array]:
        """Forces at the unknown nodes, and d(force)/d(seen) times `see`."""
        nodes = seen.reshape(2, 2, m)
        force, by = law.slopes(nodes, known[0], known[1], step)
        slope = jnp.sum(by[..., None] * see_node, axis=1)
        return force.reshape(2 * m), slope.reshape(2 * m, 2 * m)

    eye = jnp.eye(2 * m)
    hold = jax.lax.stop_gradient

    def solve(base: Array, guess: Array, known: Any) -> tuple[Array, Array]:
        f, fixed = hold(guess), hold(base)
        still, past = hold(see), hold(known)

        def newton(now: tuple[Array, Array, Any]) -> tuple[Array, Array, Any]:
            f, _, count = now
            force, slope = seen_forces(fixed + times(still, f), past)
            move = hold(_solved(eye - hold(slope), f - force))
            return f - move, move, count + 1

        def unsettled(now: tuple[Array, Array, Any]) -> Array:
            f, move, count = now
            far = jnp.max(jnp.abs(move)) > SETTLED * jnp.max(jnp.abs(f))
            return (count < NEWTON_STEPS - 1) | (far & (count < MOST_NEWTON_STEPS))

        # a loop, not three copies: compiling is what a user waits for
        f, *_ = jax.lax.while_loop(unsettled, newton, (f, f, 0))
        # the last step carries the derivatives: exact by the implicit function theorem
        force, slope = seen_forces(base + times(see, f), known)
        move = times(hold(inverse(eye - slope)), f - force)
        return f - move, jnp.max(jnp.abs(hold(move)))

    in_first = [start + 0.5 * middle for start, middle, _ in to_input]
    in_last = [end + 0.5 * middle for _, middle, end in to_input]

    def one(carry: tuple[Array, ...], w: tuple[Array, Array]) -> tuple[Array, ...]:
        x, f0, guess, memory = carry
        w0, w1 = w
        push = [times(in_first[k], w0) + times(in_last[k], w1) for k in (0, 1)]
        moved = jnp.concatenate([times(look, part) for part in push])
        carried = jnp.concatenate(
            [times(space.rate_input, 0.5 * (w0 + w1)), times(space.rate_input, w1)]
        )
        pad = jnp.zeros(m)
        moved = moved + jnp.concatenate([pad, carried[:m], pad, carried[m:]])
        base = times(see_free, x) + times(see_first, f0) + moved
        before = law.seen_at(x, w0)
        f, defect = solve(base, guess, (memory, (*before, law.told_within(x, w, step))))
        end = (base + times(see, f))[2 * m :].reshape(2, m)
        memory = law.advance(memory, before, (end[0], end[1]), step)
        new = times(matrices.free[1], x) + times(to_force[1][0], f0)
        new = new + times(to_force[1][1], f[:m]) + times(to_force[1][2], f[m:]) + push[1]
        ahead = jnp.concatenate([3 * f[m:] - 3 * f[:m] + f0, 6 * f[m:] - 8 * f[:m] + 3 * f0])
        return new, f, ahead, memory, defect

    return one


def _march_laws(
    law: Laws, matrices: Step, x0: Array, first: Array, last: Array, substeps: int, acting: Any
) -> March:
    step, given = acting  # length of one step [s], and what laws remember at the start
    m = law.rows
    one = law_step(law, matrices, step)

    def advance(carry: tuple[Array, ...], w: tuple[Array, Array]) -> tuple[Any, Any]:
        w0, w1 = w
        worst = jnp.zeros(())
        state = carry
        if law.jumps:
            memory = carry[3]
            fresh = law.whole_force(memory, *law.seen_at(carry[0], w0), law.told_at(carry[0], w0))
            state = (carry[0], fresh, jnp.concatenate([fresh, fresh]), memory)

        def part(k: int, now: tuple[Any, Array]) -> tuple[Any, Array]:
            state, worst = now
            low = w0 + (w1 - w0) * (k / substeps)
            high = w0 + (w1 - w0) * ((k + 1) / substeps)
            new, f, ahead, memory, defect = one(state, (low, high))
            return (new, f[m:], ahead, memory), jnp.maximum(worst, defect)

        if substeps == 1:
            state, worst = part(0, (state, worst))
        else:
            state, worst = jax.lax.fori_loop(0, substeps, part, (state, worst))
        return state, (state[0], state[1], worst)

    f0, memory = law.begun_at(x0, first[0], given)
    carry = (x0, f0, jnp.concatenate([f0, f0]), memory)
    carry, (states, forces, worst) = jax.lax.scan(advance, carry, (first, last))
    states = jnp.concatenate([x0[None], states])
    forces = jnp.concatenate([f0[None], forces])
    return March(states, forces, jnp.concatenate([jnp.zeros(1), worst]), carry[3])
