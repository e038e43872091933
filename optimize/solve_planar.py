"""The planar robot over the steps of a swing: all steps of all scenarios linearized at once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..model import planar
from ..model.extended import WIDTH, acting_laws
from ..model.lagrange import Acting, PlanarPlant
from ..model.planar_march import Plane
from ..model.planar_motion import check_laws
from ..model.planar_release import rest
from ..model.radau import NODES, TWICE, WEIGHTS
from ..model.rig import Rig
from ..model.robot import INCLINATION
from .solve_grid import Steps
from .solve_linear import robot_of
from .solve_problem import Problem

REPEATS = 4
"""Simplified Newton steps of the stages about each linearization [-]."""

WILD = 1e6
"""Acceleration at a stage from which no other motion is begun [rad/s^2 or m/s^2]."""


class PlanarSteps:
    """The planar robot of a problem; its steps are linear about where it is.

    Each step is one of Radau IIA, whose stages are solved for all steps and scenarios together,
    so that a motion need not be possible before it is found: no step waits for the one before.

    Args:
        problem: tells the scenarios, the clock and the ball.
        rig: tells laws and weight.
        guess: motion from which the rounding of corners is taken, shape (scenarios, marks, 8)
            [SI]; needed where laws act.

    Raises:
        ValueError: for a law that cannot act in the plane, or one that remembers.
    """

    constant = False

    def __init__(self, problem: Problem, rig: Rig, guess: np.ndarray | None = None) -> None:
        self.problem = problem
        listed = acting_laws(rig.laws, robot_of(rig))
        check_laws(listed)
        for one in listed:
            if one.law.memory is not None:
                raise ValueError(
                    f"{rig.path}: [[laws]]: expected laws without memory for an optimal swing, "
                    f"found '{one.law.name}' at '{one.place}'. Mend: remove it; `supple simulate` "
                    "shows what it does to the swing."
                )
        self.acting = tuple(Acting(one.place, one.law.name) for one in listed)
        self.strengths = np.array([one.strength for one in listed])
        self.shapes = tuple(one.shapes for one in listed)
        names = [name for name in problem.scenarios[0] if name != INCLINATION]
        self.table = {
            name: np.array([one[name] for one in problem.scenarios])[:, None, None]
            for name in names
        }
        self.pull = planar.GRAVITY * np.sin(problem.scenarios[0].get(INCLINATION, 0.0))
        self.widths = self._widths(listed, guess)
        count = len(problem.scenarios), len(problem.grid.lengths)
        self.bends = np.zeros((*count, 4, 3))

    def _widths(self, listed: tuple[Any, ...], guess: np.ndarray | None) -> np.ndarray:
        """Rounding of corners: as stated, or a share of the motion at the law's place."""
        found = np.full((len(listed), 2), 1e-12)
        for index, one in enumerate(listed):
            stated = one.stretch_width, one.rate_width
            for order, width in enumerate(stated):
                if width is None:
                    assert guess is not None
                    found[index, order] = max(1e-12, WIDTH * self._size(one.place, guess, order))
                else:
                    found[index, order] = width
        return found

    def _size(self, place: str, guess: np.ndarray, order: int) -> float:
        """Root mean square of a place's stretch, or of its rate, in the first scenario [SI]."""
        numbers = self.problem.scenarios[0]
        q, v = guess[0, :, :4].T, guess[0, :, 4:].T
        still = np.zeros((2, q.shape[1]))
        found = planar.springs(numbers, q, v, still, still, True)
        moved = [(one.stretch, one.rate)[order] for one in found if one.place == place]
        return float(np.sqrt(np.mean(np.square(moved))))

    def steps(self, states: np.ndarray, drive: np.ndarray) -> Steps:
        """Steps about states (scenarios, marks, 8) and motors (marks, 2, 4) [SI]."""
        grid, force = self.problem.grid, self.problem.task.impact.force
        data = (self.strengths, self.widths, self.shapes)
        a, e, d, bends = _linearized(
            self.acting, self.table, self.pull, data, grid.lengths, force * grid.struck,
            states[:, :-1], drive[:-1], self.bends,
        )  # fmt: skip
        # a motion that runs away leaves nothing behind from which the next one would begin
        self.bends = np.where(np.abs(bends) < WILD, bends, 0.0)
        return Steps(np.asarray(a), np.asarray(e), np.asarray(d))

    def start(self) -> np.ndarray:
        """At rest behind the drives, under its weight, shape (scenarios, 8) [SI]."""
        arm, wrist = self.problem.task.start
        return np.pad(self.rest(arm, wrist), ((0, 0), (0, 4)))

    def rest(self, arm: float, wrist: float) -> np.ndarray:
        """Coordinates of each scenario at rest behind drives that stand, (scenarios, 4) [SI]."""
        count = len(self.problem.scenarios)
        found = np.zeros((count, 4))
        found[:, 0] = arm + wrist
        if self.pull:
            for index, numbers in enumerate(self.problem.scenarios):
                own = {name: value for name, value in numbers.items() if name != INCLINATION}
                plane = Plane(own, self.pull, self.strengths, self.widths, self.shapes)
                found[index] = rest("pinned_wrist", self.acting, plane, arm, wrist)
        return found


class _Stages:
    """The stages of all steps of all scenarios, as functions of accelerations and motors.

    Arrays over stages have shape (..., scenarios, steps, 3).
    """

    def __init__(
        self, acting: tuple[Acting, ...], table: Mapping[str, Any], pull: Any,
        data: tuple[Any, ...], lengths: Any, force: Any, x: Any, z: Any,
    ) -> None:  # fmt: skip
        self.plant = PlanarPlant("pinned_wrist", acting, table, pull, *data)
        self.pull, self.lengths, self.counts = pull, lengths, x.shape[:2]
        self.h = lengths[:, None]
        tau = self.tau = self.h * jnp.asarray(NODES)
        one, none = jnp.ones_like(tau), jnp.zeros_like(tau)
        # from the motors' motion at the start of a step to that at its stages, (k, 3, 3, 4)
        ahead = [
            (one, tau, tau**2 / 2, tau**3 / 6), (none, one, tau, tau**2 / 2), (none, none, one, tau)
        ]  # fmt: skip
        self.ahead = jnp.stack([jnp.stack(row, axis=-1) for row in ahead], axis=-2)
        moved = jnp.einsum("kioj,kaj->aoki", self.ahead, z)[:, :, None]
        self.motors = jnp.broadcast_to(moved, (2, 3, *self.counts, 3)).reshape(6, *self.counts, 3)
        self.pushed = jnp.broadcast_to(force[:, None], tau.shape)
        self.q, self.v = jnp.moveaxis(x[..., :4], -1, 0), jnp.moveaxis(x[..., 4:], -1, 0)

    def left(self, q: Any, v: Any, a: Any, m: Any) -> Any:
        """Imbalance, 4 forces, of positions, rates, accelerations and motors."""
        pivot = planar.pivot_acceleration(self.plant.p, (m[0], m[1], m[2]), self.pull, jnp)
        zero = jnp.zeros_like(self.pushed)
        u = (m[0], m[3], m[1], m[4], *pivot, zero, self.pushed)
        known = self.plant.ready(tuple(q))
        found = self.plant.imbalance(tuple(q), tuple(v), tuple(a), u, known)
        return jnp.stack(jnp.broadcast_arrays(*found))

    def at(self, a: Any) -> tuple[Any, ...]:
        """What `left` takes at every stage, of accelerations there, (4, s, k, 3)."""
        tau, h = self.tau, self.h
        places = self.q[..., None] + self.v[..., None] * tau + h**2 * (a @ jnp.asarray(TWICE.T))
        rates = self.v[..., None] + h * (a @ jnp.asarray(WEIGHTS.T))
        return places, rates, a, self.motors

    def slopes(self, a: Any) -> Any:
        """Of the imbalance by the 18 numbers that it depends on, (18, 4, s, k, 3)."""
        parts, found = list(self.at(a)), []
        for number, part in enumerate(parts):  # what one of them leaves alone is not worked out

            def of(part: Any, number: int = number) -> Any:
                given = [*parts[:number], part, *parts[number + 1 :]]
                return self.left(*given)

            def along(unit: Any, of: Any = of, part: Any = part) -> Any:
                return jax.jvp(of, (part,), (jnp.broadcast_to(unit, part.shape),))[1]

            found.append(jax.vmap(along)(jnp.eye(len(part))[:, :, None, None, None]))
        return jnp.concatenate(found)

    def inverse(self, slopes: Any) -> Any:
        """Of the stage equations' matrix, (s, k, 12, 12); rows and columns coordinate by stage."""
        hs = self.lengths[:, None, None]
        whole = jnp.einsum("cfski,kij->skficj", slopes[:4], hs**2 * jnp.asarray(TWICE))
        whole = whole + jnp.einsum("cfski,kij->skficj", slopes[4:8], hs * jnp.asarray(WEIGHTS))
        whole = whole + jnp.einsum("cfski,ij->skficj", slopes[8:12], jnp.eye(3))
        return jnp.linalg.inv(whole.reshape(*self.counts, 12, 12))

    def bent(self, slopes: Any, inverse: Any) -> Any:
        """Accelerations at the stages by state and motors at the start, (s, k, 4, 3, 16)."""
        of_q = jnp.einsum("cfski->skfic", slopes[:4])
        of_v = jnp.einsum("cfski,ki->skfic", slopes[:4], self.tau)
        of_v = of_v + jnp.einsum("cfski->skfic", slopes[4:8])
        by_m = slopes[12:].reshape(2, 3, *slopes.shape[1:])
        of_z = jnp.einsum("aofski,kioj->skfiaj", by_m, self.ahead)
        felt = jnp.concatenate([of_q, of_v, of_z.reshape(*of_z.shape[:4], 8)], axis=-1)
        return (-inverse @ felt.reshape(*self.counts, 12, 16)).reshape(*self.counts, 4, 3, 16)


@partial(jax.jit, static_argnums=(0,))
def _linearized(acting: tuple[Acting, ...], *given: Any) -> tuple[Any, ...]:
    """``a``, ``e`` and ``d`` of `Steps`, and the accelerations at the stages, (s, k, 4, 3)."""
    table, pull, data, lengths, force, x, z, bends = given
    on = _Stages(acting, table, pull, data, lengths, force, x, z)
    a = jnp.moveaxis(bends, -2, 0)  # (4, s, k, 3)
    slopes = on.slopes(a)
    inverse = on.inverse(slopes)

    def improve(_: int, a: Any) -> Any:
        flat = jnp.moveaxis(on.left(*on.at(a)), 0, 2).reshape(*on.counts, 12)
        move = jnp.einsum("skij,skj->ski", inverse, flat).reshape(*on.counts, 4, 3)
        return a - jnp.moveaxis(move, 2, 0)

    a = jax.lax.fori_loop(0, REPEATS, improve, a)
    bent, h = on.bent(slopes, inverse), on.lengths
    once, twice = jnp.asarray(WEIGHTS[2]), jnp.asarray(TWICE[2])
    moved = jnp.einsum("k,j,skfjc->skfc", h**2, twice, bent)
    turned = jnp.einsum("k,j,skfjc->skfc", h, once, bent)
    matrix = jnp.concatenate([moved, turned], axis=2)  # (s, k, 8, 16)
    matrix = matrix.at[..., :8].add(jnp.eye(8) + jnp.einsum("k,ij->kij", h, jnp.eye(8, k=4)))
    end_q, end_v = on.q + h * on.v + h**2 * (a @ twice), on.v + h * (a @ once)
    end = jnp.moveaxis(jnp.concatenate([end_q, end_v]), 0, -1)
    motors = jnp.broadcast_to(z.reshape(1, -1, 8), (*on.counts, 8))
    d = end - jnp.einsum("skij,skj->ski", matrix, jnp.concatenate([x, motors], axis=-1))
    effect = matrix[..., 8:].reshape(*on.counts, 8, 2, 4)
    return matrix[..., :8], effect, d, jnp.moveaxis(a, 0, -2)
