"""The exact linear response of many designs at once: powers of the transition, taken in blocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .drives import ON_SAMPLE, Drive, Hold, check_balance, equilibrium, hold_rows
from .linear import Array, Mechanism, Port, StateSpace, discretize, state_space

BLOCK = 64
"""Samples that one power of the transition matrix jumps over [-]; a power of two."""

DENSE, SMALL = 16, 16
"""Samples a jump of the drive below which jumps are dense, and samples of a block then [-]: every
jump is followed to the end of its block."""


@dataclass(frozen=True)
class Plan:
    """What is compiled for: everything about a linear response that is not a number.

    Attributes:
        mechanism: chain or robot.
        inputs: the port of the drive's force, if any, then its prescribed joints.
        sensors: what is measured.
        hold: what a release lets go of; its displacement is no part of what is compiled.
        states: of the force: 0 none, 1 constant between jumps, 2 sine and cosine.
        whole: whether all states and the coordinates' accelerations come before the sensors.
    """

    mechanism: Mechanism
    inputs: tuple[Port, ...]
    sensors: tuple[Port, ...]
    hold: Hold | None
    states: int
    whole: bool


def plan_of(
    mechanism: Mechanism, drive: Drive, sensors: tuple[Port, ...], whole: bool = False
) -> Plan:
    """The plan of a linear response to a drive; see `Plan`."""
    states = 0 if drive.port is None else (2 if drive.frequency else 1)
    return Plan(mechanism, drive.ports, sensors, drive.hold, states, whole)


@dataclass(frozen=True)
class _Jumps:
    """Where a drive jumps: the sample on which it lands, the time left until then, and by what."""

    samples: np.ndarray  # (jumps,)
    parts: np.ndarray  # distinct times from a jump to its sample (parts,) [s]
    part: np.ndarray  # which of these, (jumps,)
    changes: np.ndarray  # of the force's states, then of four numbers a joint, (jumps, changes)


def _jumps(drive: Drive, step: float, count: int) -> _Jumps:
    """The jumps up to the last sample."""
    parts = [_force_changes(drive)] if drive.port is not None else []
    parts += [(np.asarray(joint.edges), joint.jumps) for joint in drive.joints]
    width = sum(changes.shape[1] for _, changes in parts)
    edges, changes, column = np.zeros(0), np.zeros((0, width)), 0
    for own, change in parts:
        wide = np.zeros((len(own), width))
        wide[:, column : column + change.shape[1]] = change
        edges, changes = np.concatenate([edges, own]), np.concatenate([changes, wide])
        column += change.shape[1]
    position = edges / step
    landing = np.ceil(position - ON_SAMPLE)
    left = np.maximum(landing - position, 0.0)
    left[left <= ON_SAMPLE] = 0.0
    kept = landing < count
    distinct, part = np.unique(np.round(left[kept], 12) * step, return_inverse=True)
    return _Jumps(landing[kept].astype(int), distinct, part.reshape(-1), changes[kept])


def _force_changes(drive: Drive) -> tuple[np.ndarray, np.ndarray]:
    edges = np.asarray(drive.edges)
    change = np.diff(np.asarray(drive.levels), prepend=0.0)
    if not drive.frequency:
        return edges, change[:, None]
    phase = drive.frequency * (edges - edges[0])
    return edges, np.stack([change * np.sin(phase), change * np.cos(phase)], axis=1)


def exact_outputs(
    plan: Plan, table: Mapping[str, np.ndarray], drive: Drive, times: np.ndarray
) -> np.ndarray:
    """Outputs of several designs at every sample.

    Args:
        plan: what is simulated.
        table: numbers of the mechanism by name, each of shape (designs,) [SI].
        drive: what moves every design.
        times: uniform samples from 0 on [s].

    Returns:
        Shape (designs, t, outputs) [SI].

    Raises:
        ValueError: for a release without a balance.

    Source: ``x' = A x`` with the drive's force and the joints' accelerations as states of their
    own, which jump; Van Loan 1978, doi:10.1109/TAC.1978.1101743.
    """
    outputs, start, seen = traced_outputs(plan, table, drive, times)
    if plan.hold is not None:
        check_balance(np.asarray(start), np.asarray(seen), plan.hold)
    return np.asarray(outputs)


def traced_outputs(
    plan: Plan, table: Mapping[str, Any], drive: Drive, times: np.ndarray
) -> tuple[Array, Array, Array]:
    """Outputs as `exact_outputs` has them, with derivatives, and what a release begins with.

    Derivatives are taken forwards (``jax.jacfwd``, ``jax.jvp``), see `linear.discretize`.

    Args:
        plan: what is simulated.
        table: numbers of the mechanism by name, each of shape (designs,) [SI].
        drive: what moves every design.
        times: uniform samples from 0 on [s].

    Returns:
        Outputs, shape (designs, t, outputs); coordinates at the start, shape (designs, n); what
        the hand sees of them, shape (designs,) [SI].
    """
    step, count = float(times[-1]) / (len(times) - 1), len(times)
    held = 0.0 if plan.hold is None else plan.hold.displacement
    jumps = _jumps(drive, step, count)
    block = SMALL if DENSE * len(jumps.samples) > count else BLOCK
    sizes = -(-count // block), block
    marks = (jumps.samples, jumps.parts, jumps.part, jumps.changes)
    joints = np.array([(*joint.begin, joint.frequency) for joint in drive.joints]).reshape(-1, 3)
    static = plan if plan.hold is None else replace(plan, hold=replace(plan.hold, displacement=1.0))
    outputs, start, seen = _designs(
        static, sizes, table, step, drive.frequency, joints, held, *marks
    )
    return outputs[:, :count], start, seen


@partial(jax.jit, static_argnums=(0, 1))
def _designs(
    plan: Plan, sizes: tuple[int, int], table: Mapping[str, Array], *numbers: Any
) -> tuple[Array, Array, Array]:
    def one(p: Mapping[str, Array]) -> tuple[Array, Array, Array]:
        return _linear(plan, sizes, p, *numbers)

    return jax.vmap(one)(table)


def _linear(
    plan: Plan,
    sizes: tuple[int, int],
    p: Mapping[str, Array],
    step: Array,
    frequency: Array,
    joints: Array,
    held: Array,
    samples: Array,
    parts: Array,
    part: Array,
    changes: Array,
) -> tuple[Array, Array, Array]:
    """Outputs (blocks of their size, outputs), start coordinates, displacement held."""
    blocks, block = sizes
    space = state_space(plan.mechanism, p, plan.inputs, plan.sensors)
    n = len(plan.mechanism.coordinates)
    start, seen = jnp.zeros(n), jnp.zeros(())
    if plan.hold is not None:
        unit, _ = equilibrium(plan.mechanism, p, plan.hold)
        start = held * unit
        seen = hold_rows(plan.mechanism, p, plan.hold)[1] @ start
    a, c, size = _with_drive(plan, space, step, frequency, joints[:, 2])
    lengths = jnp.concatenate([jnp.asarray(step)[None], parts])
    over = jax.vmap(lambda length: _transition(a, length))(lengths)
    powers = [over[0]]
    for _ in range(block.bit_length() - 1):
        powers.append(powers[-1] @ powers[-1])
    look = c[None]  # c A^k, by doubling
    for power in powers[:-1]:
        look = jnp.concatenate([look, look @ power])
    first = jnp.zeros(a.shape[0]).at[:n].set(start)
    carried = jnp.asarray([_carried(plan, place) for place in _joint_names(plan)]).reshape(-1, n)
    for k in (0, 1):  # angles, velocities
        first = first.at[k * n : (k + 1) * n].add(joints[:, k] @ carried)
        first = first.at[2 * n + k : 2 * n + 2 * len(carried) : 2].set(joints[:, k])
    if len(parts):
        landed = changes @ _leaps(plan, space, a.shape[0], size).T
        jumps = jnp.einsum("jzx,jx->jz", over[1 + part], landed)
        kicks, own = _landed(jumps, samples, powers, look, blocks)
    else:
        kicks, own = jnp.zeros((blocks, len(first))), jnp.zeros(())
    _, starts = jax.lax.scan(
        lambda x, kick: (jnp.sum(powers[-1] * x[None], axis=1) + kick, x), first, kicks
    )
    outputs = jnp.einsum("bz,krz->bkr", starts, look) + own
    return outputs.reshape(blocks * block, -1), start, seen


def _transition(a: Array, step: Array) -> Array:
    return discretize(a, jnp.zeros((a.shape[0], 0)), step, 1)[0]


def _joint_names(plan: Plan) -> list[str]:
    return [port.place for port in plan.inputs[min(plan.states, 1) :]]


def _carried(plan: Plan, joint: str) -> tuple[float, ...]:
    return plan.mechanism.carried[plan.mechanism.grounds.index(joint)]


def _with_drive(
    plan: Plan, space: StateSpace, step: Array, frequency: Array, turns: Array
) -> tuple[Array, Array, Array]:
    """State matrix and outputs with the drive as states of its own, and the unit of the force [N].

    The states: those of the mechanism with angle and velocity of each joint, those of the force,
    then acceleration of each joint and its rate.
    """
    n, n2 = len(plan.mechanism.coordinates), space.a.shape[0]
    pushes, total = min(plan.states, 1), n2 + plan.states + 2 * len(_joint_names(plan))
    a = jnp.zeros((total, total)).at[:n2, :n2].set(space.a)
    c, d = space.c, space.d
    if plan.whole:
        c = jnp.concatenate([jnp.eye(n2), space.a[n : 2 * n], c])
        d = jnp.concatenate([jnp.zeros((n2, d.shape[1])), space.b[n : 2 * n], d])
    c = jnp.concatenate([c, jnp.zeros((c.shape[0], total - n2))], axis=1)
    size = jnp.ones(())
    if plan.states:
        largest = jnp.max(jnp.abs(space.b[:, :1])) * step
        size = 1.0 / jnp.where(largest > 0, largest, 1.0)
        a = a.at[:n2, n2].set(space.b[:, 0] * size)
        c = c.at[:, n2].set(d[:, 0] * size)
    if plan.states == 2:  # (sine, cosine) turn into each other
        a = a.at[n2, n2 + 1].set(frequency).at[n2 + 1, n2].set(-frequency)
    for k in range(len(_joint_names(plan))):
        at = n2 + plan.states + 2 * k
        a = a.at[:n2, at].set(space.b[:, pushes + k])
        c = c.at[:, at].set(d[:, pushes + k])
        a = a.at[at, at + 1].set(1.0).at[at + 1, at].set(-(turns[k] ** 2))
    return a, c, size


def _leaps(plan: Plan, space: StateSpace, total: int, size: Array) -> Array:
    """What a unit jump of the drive does to the states, shape (total, changes).

    Where the angle of a joint leaps, its dashpot gives the mechanism an impulse; where the
    velocity does, the masses that the joint carries.
    """
    n, n2 = len(plan.mechanism.coordinates), space.a.shape[0]
    pushes, joints = min(plan.states, 1), len(_joint_names(plan))
    leaps = jnp.zeros((total, plan.states + 4 * joints))
    force = jnp.arange(plan.states)
    leaps = leaps.at[n2 + force, force].set(1.0 / size)
    for k in range(joints):
        angle, change = 2 * n + 2 * k, plan.states + 4 * k
        bend = n2 + plan.states + 2 * k
        leaps = leaps.at[n : 2 * n, change].set(space.a[n : 2 * n, angle + 1])
        leaps = leaps.at[n : 2 * n, change + 1].set(space.b[n : 2 * n, pushes + k])
        for state, column in zip((angle, angle + 1, bend, bend + 1), range(4), strict=True):
            leaps = leaps.at[state, change + column].set(1.0)
    return leaps


def _landed(
    jumps: Array, samples: Array, powers: list[Array], look: Array, blocks: int
) -> tuple[Array, Array]:
    """What jumps do: to the state at the end of their block, and to outputs inside it."""
    size = len(look)
    block, inside = samples // size, samples % size
    carried = jumps
    for bit, power in enumerate(powers):  # by the power size - inside
        wanted = ((size - inside) >> bit) & 1
        carried = jnp.where(wanted[:, None] == 1, carried @ power.T, carried)
    kicks = jnp.zeros((blocks, jumps.shape[1])).at[block].add(carried)
    after = jnp.einsum("jz,krz->jkr", jumps, look)
    behind = jnp.arange(size)[None] - inside[:, None]
    shifted = jnp.take_along_axis(after, jnp.maximum(behind, 0)[:, :, None], axis=1)
    shifted = jnp.where(behind[:, :, None] >= 0, shifted, 0.0)
    own = jnp.zeros((blocks, *look.shape[:2])).at[block].add(shifted)
    return kicks, own
