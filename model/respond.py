"""The response of a mechanism: exact for its linear part, implicit exponential where laws act."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .chain import DERIVATIVES, FORCES
from .delay import shift
from .law import Law, Place, force_laws
from .linear import (
    Array,
    StateSpace,
    Step,
    ground_quantity,
    make_step,
    state_space,
)
from .plant import Plant, numbers_vector as numbers_vector  # old callers ask here for both

NEWTON_STEPS = 3


@partial(jax.jit, static_argnums=(0, 1))
def _simulate(
    plant: Plant, substeps: int, z: Array, inputs: Array, step: Array, widths: Array
) -> tuple[Array, Array, Array]:
    states, forces, defect = _march(plant, substeps, z, inputs, step, widths)
    space = _space(plant, z)
    drive = inputs + z[plant.slots["drive"]] * _offset_mask(plant)
    felt = jnp.concatenate([_felt(plant, drive, step), forces], axis=1)
    outputs = states @ space.c.T + felt @ space.d.T
    outputs = shift(outputs, z[plant.slots["delay"]] / step) * (1.0 + z[plant.slots["gain"]])
    outputs = outputs + z[plant.slots["offset"]]
    return jnp.concatenate([outputs, defect[:, None]], axis=1), states, forces


def simulate(
    plant: Plant,
    substeps: int,
    z: Array,
    inputs: Array,
    step: Array,
    widths: Array,
) -> Array:
    """Samples of every sensor.

    Args:
        plant: what is simulated (static).
        substeps: steps of the integrator a sample; 1 is exact where no law acts (static).
        z: all that varies, see `Plant` [SI].
        inputs: sampled inputs, shape (t, inputs) [N, N m, m, ...].
        step: sampling interval [s].
        widths: rounding of corners in (stretch, rate) at each law place, shape (places, 2).

    Returns:
        Shape (t, sensors + 1) [SI]; the last column is what the last Newton step still changed of
        the law forces [N or N m], a measure of the integrator's success. Where the ground is
        driven by its position, a sensor that feels the ground's rate reads the mean of the slopes
        before and after the sample.
    """
    return _simulate(plant, substeps, z, inputs, step, widths)[0]


@partial(jax.jit, static_argnums=(0, 1))
def tangents(
    plant: Plant,
    substeps: int,
    z: Array,
    directions: Array,
    inputs: Array,
    step: Array,
    widths: Array,
) -> Array:
    """Derivatives of `simulate` along `directions`, exact, forward mode.

    Args:
        plant: what is simulated (static).
        substeps: steps a sample (static).
        z: point [SI].
        directions: shape (k, size of z).
        inputs: as for `simulate`.
        step: sampling interval [s].
        widths: as for `simulate`.

    Returns:
        Shape (k, t, sensors) [SI per unit of direction].
    """

    def along(direction: Array) -> Array:
        call = partial(_simulate, plant, substeps)
        moved = jax.jvp(lambda x: call(x, inputs, step, widths)[0], (z,), (direction,))[1]
        return moved[:, :-1]

    return jax.vmap(along)(directions)


def state_history(
    plant: Plant, substeps: int, z: Array, inputs: Array, step: Any, widths: Array
) -> tuple[np.ndarray, np.ndarray]:
    """States (t, states) and law forces (t, law rows) of a motion [SI]; see `simulate`."""
    _, states, forces = _simulate(plant, substeps, z, inputs, jnp.asarray(step), widths)
    return np.asarray(states), np.asarray(forces)


@partial(jax.jit, static_argnums=0)
def law_geometry(plant: Plant, z: Array) -> tuple[Array, Array, Array]:
    """Rows that turn states and inputs into stretches and rates of the law places.

    Args:
        plant: its law places are meant (static).
        z: see `Plant` [SI].

    Returns:
        stretch (law rows, states) [1 or m], rate (law rows, states) [1 or m], and what a moving
        ground adds to the rate (law rows, inputs) [1].
    """
    space = _space(plant, z)
    return space.stretch, space.rate, space.rate_input


@partial(jax.jit, static_argnums=0)
def force_responses(plant: Plant, z: Array, forces: Array, step: Array) -> Array:
    """Linear response of the sensors to forces at the law places, from rest.

    Args:
        plant: its law places say where the forces act, its laws are not in force (static).
        z: point of linearization, see `Plant` [SI].
        forces: resisting forces, linear between samples, shape (k, t, law rows) [N or N m].
        step: sampling interval [s].

    Returns:
        Shape (k, t, sensors) [SI].
    """
    space = _space(plant, z)
    matrices = make_step(space, step)
    start, middle, end = (node[:, len(plant.inputs) :] for node in matrices.nodes[1])
    pushes = forces[:, :-1] @ (start + 0.5 * middle).T + forces[:, 1:] @ (end + 0.5 * middle).T

    def advance(x: Array, push: Array) -> tuple[Array, Array]:
        new = x @ matrices.free[1].T + push
        return new, new

    rest = jnp.zeros((forces.shape[0], plant.n_states))
    _, states = jax.lax.scan(advance, rest, jnp.swapaxes(pushes, 0, 1))
    states = jnp.swapaxes(jnp.concatenate([rest[None], states]), 0, 1)
    return states @ space.c.T + forces @ space.d[:, len(plant.inputs) :].T


def _space(plant: Plant, z: Array) -> StateSpace:
    numbers = plant.numbers(z)
    return state_space(plant.mechanism, numbers, plant.inputs, plant.sensors, plant.law_places)


def _offset_mask(plant: Plant) -> Array:
    """An offset of a moving ground's position changes nothing but the start state."""
    return jnp.asarray([0.0 if DERIVATIVES.get(p.quantity) == 0 else 1.0 for p in plant.inputs])


def _interval_values(plant: Plant, drive: Array, step: Array) -> tuple[Array, Array]:
    """What each input is at the start and at the end of every interval, in the state's terms."""
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


def _felt(plant: Plant, drive: Array, step: Array) -> Array:
    """Inputs at the samples in the state's terms: of a position its rate, mean of both sides."""
    columns = list(drive.T)
    for index, port in enumerate(plant.inputs):
        if port.quantity not in FORCES and DERIVATIVES[port.quantity] == 0:
            slope = jnp.diff(drive[:, index]) / step
            before = jnp.concatenate([slope[:1], slope])
            columns[index] = 0.5 * (before + jnp.concatenate([slope, slope[-1:]]))
    return jnp.stack(columns, axis=1) if columns else drive


def _rate_jumps(plant: Plant) -> bool:
    """Whether the ground's rate, which laws feel, jumps from interval to interval."""
    ground = ground_quantity(plant.inputs)
    held = any(port.held for port in plant.inputs if port.quantity not in FORCES)
    return ground == "position" or (ground == "velocity" and held)


def _march(
    plant: Plant, substeps: int, z: Array, inputs: Array, step: Array, widths: Array
) -> tuple[Array, Array, Array]:
    space = _space(plant, z)
    drive = inputs + z[plant.slots["drive"]] * _offset_mask(plant)
    first, last = _interval_values(plant, drive, step)
    matrices = make_step(space, step / substeps)
    x0 = z[plant.slots["start"]]
    if ground_quantity(plant.inputs) == "position":
        index = next(i for i, port in enumerate(plant.inputs) if port.quantity not in FORCES)
        x0 = x0.at[-1].add(inputs[0, index])
    law = _Laws(plant, space, z, widths)
    if law.rows == 0:
        return _march_linear(matrices, x0, first, last, substeps)
    return _march_laws(law, matrices, x0, first, last, substeps)


def _times(matrix: Array, vector: Array) -> Array:
    """Matrix times vector as a sum that fuses with its neighbours; dot calls would not."""
    return jnp.sum(matrix * vector[None, :], axis=1)


def _march_linear(
    matrices: Step, x0: Array, first: Array, last: Array, substeps: int
) -> tuple[Array, Array, Array]:
    transition = matrices.free[1]
    if substeps != 1:
        raise ValueError("a linear motion needs one step a sample; expected substeps = 1")
    start, middle, end = matrices.nodes[1]
    forcing = first @ (start + 0.5 * middle).T + last @ (end + 0.5 * middle).T

    def advance(x: Array, push: Array) -> tuple[Array, Array]:
        new = _times(transition, x) + push
        return new, new

    _, states = jax.lax.scan(advance, x0, forcing, unroll=2)
    states = jnp.concatenate([x0[None], states])
    count = states.shape[0]
    return states, jnp.zeros((count, 0)), jnp.zeros(count)


class _Laws:
    """Forces of all laws of a plant at one instant, and their slopes."""

    def __init__(self, plant: Plant, space: StateSpace, z: Array, widths: Array) -> None:
        kinds = plant.mechanism.law_places()
        strengths = list(z[plant.slots["strengths"]])
        self.space, self.n_inputs = space, len(plant.inputs)
        self.jumps = _rate_jumps(plant)
        self.parts: list[tuple[slice, Law, Array, Place]] = []
        low = 0
        rows_of = plant.numbers(z)
        position = 0
        for index, place in enumerate(plant.law_places):
            count = len(plant.mechanism.place_rows(place, rows_of)[1])
            span = slice(low, low + count)
            here = Place(
                space.stiffness[span], space.damping[span], widths[index, 0], widths[index, 1]
            )
            for law in force_laws(kinds[place], plant.mechanism.turns(place)):
                self.parts.append((span, law, strengths[position], here))
                position += 1
            low += count
        self.rows = low

    def force(self, stretch: Array, rate: Array) -> Array:
        """Force of all laws on each law row [N or N m]; rows are the last axis."""
        total = jnp.zeros_like(stretch)
        for span, law, strength, place in self.parts:
            assert law.force is not None
            value = law.force(strength, stretch[..., span], rate[..., span], place)
            if span.stop - span.start == self.rows:
                total = total + value
            else:
                total = total.at[..., span].add(value)
        return total

    def slopes(self, stretch: Array, rate: Array) -> tuple[Array, Array, Array]:
        """Force with its derivatives by stretch and by rate; rows do not mix."""
        one, zero = jnp.ones_like(stretch), jnp.zeros_like(stretch)
        force, by_stretch = jax.jvp(self.force, (stretch, rate), (one, zero))
        by_rate = jax.jvp(self.force, (stretch, rate), (zero, one))[1]
        return force, by_stretch, by_rate


def _inverse(matrix: Array) -> Array:
    """Inverse of a small matrix by unrolled elimination (law matrices are near the identity)."""
    size = matrix.shape[0]
    if size == 2:
        (a, b), (c, d) = (matrix[0, 0], matrix[0, 1]), (matrix[1, 0], matrix[1, 1])
        return jnp.array([[d, -b], [-c, a]]) / (a * d - b * c)
    rows = jnp.concatenate([matrix, jnp.eye(size)], axis=1)
    for pivot in range(size):
        line = rows[pivot] / rows[pivot, pivot]
        factor = rows[:, pivot].at[pivot].set(0.0)
        rows = rows.at[pivot].set(line) - factor[:, None] * line[None, :]
    return rows[:, size:]


def _march_laws(
    law: _Laws, matrices: Step, x0: Array, first: Array, last: Array, substeps: int
) -> tuple[Array, Array, Array]:
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

    see_stretch = jnp.stack([see[:m], see[2 * m : 3 * m]])
    see_rate = jnp.stack([see[m : 2 * m], see[3 * m :]])

    def seen_forces(seen: Array) -> tuple[Array, Array]:
        """Forces at the unknown nodes, and d(force)/d(seen) times `see`."""
        nodes = seen.reshape(2, 2, m)
        force, by_stretch, by_rate = law.slopes(nodes[:, 0], nodes[:, 1])
        slope = by_stretch[:, :, None] * see_stretch + by_rate[:, :, None] * see_rate
        return force.reshape(2 * m), slope.reshape(2 * m, 2 * m)

    def seen_at(x: Array, w: Array) -> tuple[Array, Array]:
        rate = _times(space.rate, x)
        return _times(space.stretch, x), rate + _times(space.rate_input, w) if n else rate

    eye = jnp.eye(2 * m)

    def solve(base: Array, guess: Array) -> tuple[Array, Array]:
        hold = jax.lax.stop_gradient
        f, fixed = hold(guess), hold(base)
        still = hold(see)

        def newton(_: int, f: Array) -> Array:
            force, slope = seen_forces(fixed + _times(still, f))
            return hold(f - _times(_inverse(eye - hold(slope)), f - force))

        # a loop, not three copies: compiling is what a user waits for
        f = jax.lax.fori_loop(0, NEWTON_STEPS - 1, newton, f)
        # the last step carries the derivatives: exact by the implicit function theorem
        force, slope = seen_forces(base + _times(see, f))
        move = _times(hold(_inverse(eye - slope)), f - force)
        return f - move, jnp.max(jnp.abs(hold(move)))

    in_first = [start + 0.5 * middle for start, middle, _ in to_input]
    in_last = [end + 0.5 * middle for _, middle, end in to_input]

    def one(carry: tuple[Array, ...], w: tuple[Array, Array]) -> tuple[Array, ...]:
        x, f0, guess = carry
        w0, w1 = w
        push = [_times(in_first[k], w0) + _times(in_last[k], w1) for k in (0, 1)]
        moved = jnp.concatenate([_times(look, part) for part in push])
        carried = jnp.concatenate(
            [_times(space.rate_input, 0.5 * (w0 + w1)), _times(space.rate_input, w1)]
        )
        pad = jnp.zeros(m)
        moved = moved + jnp.concatenate([pad, carried[:m], pad, carried[m:]])
        base = _times(see_free, x) + _times(see_first, f0) + moved
        f, defect = solve(base, guess)
        new = _times(matrices.free[1], x) + _times(to_force[1][0], f0)
        new = new + _times(to_force[1][1], f[:m]) + _times(to_force[1][2], f[m:]) + push[1]
        ahead = jnp.concatenate([3 * f[m:] - 3 * f[:m] + f0, 6 * f[m:] - 8 * f[:m] + 3 * f0])
        return new, f[m:], ahead, defect

    def advance(carry: tuple[Array, ...], w: tuple[Array, Array]) -> tuple[Any, Any]:
        w0, w1 = w
        worst = jnp.zeros(())
        state = carry
        if law.jumps:
            fresh = law.force(*seen_at(carry[0], w0))
            state = (carry[0], fresh, jnp.concatenate([fresh, fresh]))

        def part(k: int, now: tuple[Any, Array]) -> tuple[Any, Array]:
            state, worst = now
            low = w0 + (w1 - w0) * (k / substeps)
            high = w0 + (w1 - w0) * ((k + 1) / substeps)
            *moved, defect = one(state, (low, high))
            return tuple(moved), jnp.maximum(worst, defect)

        if substeps == 1:
            state, worst = part(0, (state, worst))
        else:
            state, worst = jax.lax.fori_loop(0, substeps, part, (state, worst))
        return state, (state[0], state[1], worst)

    f0 = law.force(*seen_at(x0, first[0]))
    carry = (x0, f0, jnp.concatenate([f0, f0]))
    _, (states, forces, worst) = jax.lax.scan(advance, carry, (first, last))
    states = jnp.concatenate([x0[None], states])
    forces = jnp.concatenate([f0[None], forces])
    return states, forces, jnp.concatenate([jnp.zeros(1), worst])
