"""The linear robot over the steps of a swing: exact, for every scenario, compiled once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..model.extended import Acting, acting_laws
from ..model.linear import Port, discretize, state_space
from ..model.rig import Rig
from ..model.robot import PARAMETERS, Robot
from .solve_grid import Grid, Steps
from .solve_problem import Problem

PORTS = (
    Port("clubhead", "force", held=True),
    Port("arm", "angular_acceleration"),
    Port("wrist", "angular_acceleration"),
)
"""What moves the robot: the ball, and the motors."""


def robot_of(rig: Rig) -> Robot:
    """The robot whose arm and wrist are both driven, of the rig's numbers."""
    return Robot("driven_arm", tuple(name for name in PARAMETERS if name in rig.parameters))


def linear_laws(rig: Rig) -> tuple[Acting, ...]:
    """The laws of a rig that a linear swing can obey.

    Args:
        rig: as read.

    Returns:
        Laws that add to a stiffness or a damping.

    Raises:
        ValueError: for a law that is not linear.
    """
    listed = acting_laws(rig.laws, robot_of(rig))
    for one in listed:
        if not one.law.replaces:
            raise ValueError(
                f"{rig.path}: [[laws]]: expected laws that are linear for a swing of fidelity "
                f"'thesis', found '{one.law.name}' at '{one.place}'. "
                "Mend: write fidelity = 'planar' under [rig]."
            )
    return listed


def linear_steps(
    robot: Robot,
    scenarios: Sequence[Mapping[str, float]],
    grid: Grid,
    force: float,
    laws: tuple[Acting, ...] = (),
) -> Steps:
    """Exact steps of every scenario.

    Args:
        robot: see `robot_of`.
        scenarios: its numbers by name, one table a scenario [SI].
        grid: the clock.
        force: of the ball while it pushes [N].
        laws: linear ones, see `linear_laws`.

    Returns:
        The steps.

    Source: Van Loan 1978, doi:10.1109/TAC.1978.1101743; tests/optimize/test_solve.py.
    """
    table = {name: np.array([one[name] for one in scenarios]) for name in robot.names}
    lengths, which = np.unique(np.round(grid.lengths, 15), return_inverse=True)
    places = tuple((one.place, one.law.replaces) for one in laws)
    strengths = np.array([one.strength for one in laws])
    # few sizes, so that few programs are compiled
    wide = np.append(lengths, np.full(4 - len(lengths) % 4, lengths[-1]))
    over, still, rising = (
        np.asarray(part)[:, which] for part in _transitions(robot, places, table, wide, strengths)
    )
    joints = np.stack([over[..., :8, 8:10], over[..., :8, 10:12]], axis=-2)
    bends = np.stack([still[..., :8, 1:], rising[..., :8, 1:]], axis=-1)
    pushes = still[..., :8, 0] * (force * grid.struck)[:, None]
    return Steps(over[..., :8, :8], np.concatenate([joints, bends], axis=-1), pushes)


@partial(jax.jit, static_argnums=(0, 1))
def _transitions(
    robot: Robot,
    places: tuple[tuple[str, str], ...],
    table: Mapping[str, Any],
    lengths: Any,
    strengths: Any,
) -> tuple[Any, ...]:
    """Transition, effect of constant and of rising inputs, each (scenarios, lengths, 12, ...)."""

    def one(p: Mapping[str, Any]) -> tuple[Any, ...]:
        acting = tuple(dict.fromkeys(place for place, _ in places))
        space = state_space(robot, p, PORTS, law_places=acting)
        a, b = space.a, space.b[:, : len(PORTS)]
        rows = [place for place in acting for _ in range(2 if place == "sleeve" else 1)]
        for (place, kind), strength in zip(places, strengths, strict=True):
            for index, at in enumerate(rows):
                if at == place:
                    felt = space.stretch if kind == "stiffness" else space.rate
                    a = a + jnp.outer(space.b[:, len(PORTS) + index], strength * felt[index])

        def over(step: Any) -> tuple[Any, ...]:
            transition, psi = discretize(a, b, step, 2)
            return transition, psi[0], psi[1]

        return jax.vmap(over)(lengths)

    return jax.vmap(one)({name: jnp.asarray(values) for name, values in table.items()})


class LinearPlant:
    """The linear robot of a problem: its steps are the same wherever it is.

    Args:
        problem: tells the scenarios, the clock and the ball.
        rig: tells the laws.
        laws: whether they act.
    """

    constant = True

    def __init__(self, problem: Problem, rig: Rig, laws: bool = True) -> None:
        self.problem, force = problem, problem.task.impact.force
        self.known = linear_steps(
            robot_of(rig), problem.scenarios, problem.grid, force, linear_laws(rig) if laws else ()
        )

    def steps(self, states: np.ndarray, drive: np.ndarray) -> Steps:
        """The steps, whatever states and drive [SI]."""
        return self.known

    def rest(self, arm: float, wrist: float) -> np.ndarray:
        """Coordinates of each scenario at rest behind drives that stand, (scenarios, 4) [SI]."""
        found = np.zeros((len(self.problem.scenarios), 4))
        found[:, 0] = arm + wrist
        return found

    def start(self) -> np.ndarray:
        """At rest behind the drives, shape (scenarios, 8) [SI]."""
        return np.pad(self.rest(*self.problem.task.start), ((0, 0), (0, 4)))

    def rings(self, drive: np.ndarray, reach: float) -> np.ndarray:
        """Largest distance of the clubhead from rest after the end.

        Args:
            drive: the motors' motion at the marks, shape (marks, 2, 4) [SI].
            reach: wrist pivot to clubhead [m].

        Returns:
            Of each scenario, shape (scenarios,) [m].
        """
        x, steps = self.start(), self.known
        pushed = np.einsum("skxaj,kaj->skx", steps.e, drive[:-1]) + steps.d
        for k in range(pushed.shape[1]):
            x = np.einsum("sij,sj->si", steps.a[:, k], x) + pushed[:, k]
        x[:, 0] -= drive[-1, :, 0].sum()
        return free_rings(steps.a[:, 0], x, reach, self.problem.grid.step)


def free_rings(a: np.ndarray, x: np.ndarray, reach: float, step: float) -> np.ndarray:
    """Largest distance from rest of clubheads that are left alone for a second.

    Args:
        a: transition of each scenario, shape (scenarios, 8, 8) [SI].
        x: states against rest, shape (scenarios, 8) [SI].
        reach: wrist pivot to clubhead [m].
        step: of the transition [s].

    Returns:
        Shape (scenarios,) [m].
    """
    worst = np.zeros(len(x))
    for _ in range(int(np.ceil(1.0 / step))):
        worst = np.maximum(worst, np.abs(reach * x[:, 0] + x[:, 3]))
        x = np.einsum("sij,sj->si", a, x)
    return worst
