"""Grounds that are moved from outside: how their motion enters the states and the inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .chain import DERIVATIVES, FORCES

KINDS = ("position", "velocity", "acceleration")


@dataclass(frozen=True)
class Driven:
    """A ground that an input moves.

    Attributes:
        index: which input.
        kind: what the input tells: position, velocity or acceleration.
        state: where its position lies among the states that follow those of the coordinates; its
            velocity comes next where it is told by its acceleration.
    """

    index: int
    kind: str
    state: int

    @property
    def n_states(self) -> int:
        """States that it needs [-]."""
        return 2 if self.kind == "acceleration" else 1


def driven_grounds(quantities: Sequence[str]) -> tuple[Driven, ...]:
    """The grounds that inputs of these quantities move, in the order of the inputs."""
    found: list[Driven] = []
    for index, quantity in enumerate(quantities):
        if quantity not in FORCES:
            state = found[-1].state + found[-1].n_states if found else 0
            found.append(Driven(index, KINDS[DERIVATIVES[quantity]], state))
    return tuple(found)


@dataclass(frozen=True)
class GroundRows:
    """The motion of every ground, as rows over the states x and the inputs w, side by side.

    Attributes:
        change: ``d/dt`` of the ground's own states, shape (ground states, states + w) [SI].
        position: shape (grounds, states + w) [m or rad].
        velocity: shape (grounds, states + w) [m/s or rad/s].
        acceleration: shape (grounds, states + w), empty where not told [m/s^2 or rad/s^2].
    """

    change: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def ground_rows(
    driven: Sequence[Driven], columns: Sequence[int], grounds: int, shape: tuple[int, int]
) -> GroundRows:
    """The motion of every ground in the terms of a state space.

    A position is a state that its rate moves; the rate, not the position, is the input w.

    Args:
        driven: the grounds that are moved.
        columns: which ground each of them is.
        grounds: how many there are.
        shape: states of the coordinates, and w in all [-].

    Returns:
        The rows; zero for a ground at rest.
    """
    first, width = shape
    extra = sum(ground.n_states for ground in driven)
    whole = first + extra + width
    change = np.zeros((extra, whole))
    position, velocity, acceleration = (np.zeros((grounds, whole)) for _ in range(3))
    for ground, column in zip(driven, columns, strict=True):
        at, w = first + ground.state, first + extra + ground.index
        position[column, at] = 1.0
        if ground.kind == "acceleration":
            change[ground.state, at + 1] = change[ground.state + 1, w] = 1.0
            velocity[column, at + 1] = acceleration[column, w] = 1.0
        else:
            change[ground.state, w] = velocity[column, w] = 1.0
    return GroundRows(change, position, velocity, acceleration)
