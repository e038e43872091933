"""Least squares along bent valleys: steps that curve, in coordinates in which springs add up.

Constants of springs in a row trade off: what records tell is a sum of compliances and of losses.
In stiffness and damping that sum is a bent valley, along which straight steps are short and may
end in a side valley.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import lsq_linear

from .slopes import Slopes

Pair = tuple[int, int | None]

BEND = 1.0
"""Largest length of a step's correction for its bend, as a share of half the step [-]: beyond it
the series of which it is the second term says nothing. Transtrum and Sethna 2012."""

KEPT = 0.75
"""Share of what a step promises that it must keep, or its bend is looked at [-]."""

SHORTER = 0.25
"""Share of a step's length that is tried after it led upwards, and share of what it promises
below which the next one is shorter [-]."""

LEAST_INFORMATION = 1e-12
"""Information on a direction, relative to the best told one, that is not gone below [-]."""

SOFT = 0.1
"""Share of its natural size below which a spring is told by its stiffness again [-]."""

STALLED = 1e-9
"""Length of a step beside that of the unknowns at which a descent ends [-]."""


STRIDE = 12
"""Steps over which a descent is asked whether it crawls [-]: along the kinks that a law's corners
make, each step is short and gains next to nothing, without an end."""


@dataclass(frozen=True)
class Descent:
    """Where a descent ended.

    Attributes:
        x: the unknowns, shape (d,) [-].
        converged: whether nothing was left to gain; else patience ended.
        evaluations: steps that were tried [-].
    """

    x: np.ndarray
    converged: bool
    evaluations: int


def spring_pairs(labels: Sequence[str], positive: Sequence[bool]) -> tuple[Pair, ...]:
    """Every positive stiffness among `labels`, with its damping where that is there and positive.

    Args:
        labels: names of the unknowns.
        positive: whether each is a constant that cannot be negative.

    Returns:
        Indices (stiffness, damping or None).
    """
    found = []
    for index, label in enumerate(labels):
        if "stiffness" not in label or not positive[index]:
            continue
        partner = label.replace("stiffness", "damping")
        other = labels.index(partner) if partner in labels else None
        found.append((index, other if other is not None and positive[other] else None))
    return tuple(found)


def descend(
    residual: Callable[[np.ndarray], np.ndarray],
    jacobian: Callable[[np.ndarray], np.ndarray | Slopes],
    start: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
    pairs: Sequence[Pair] = (),
    evaluations: int = 40,
    tolerance: float = 1e-7,
    crawling: float = 0.0,
) -> Descent:
    """Minimise a sum of squares within bounds from one start.

    Args:
        residual: of unknowns, shape (d,) -> (n,) [-].
        jacobian: its derivative, shape (d,) -> (n, d) [-], or the `Slopes` of that.
        start: first unknowns, within the bounds, shape (d,) [-].
        bounds: lower and upper ones, shapes (d,) [-].
        pairs: springs, as of `spring_pairs`; they are walked in compliance and loss.
        evaluations: the most steps that are tried.
        tolerance: share of the sum of squares that is not worth a step [-].
        crawling: share of it that `STRIDE` steps must gain together, or patience ends [-].

    Returns:
        The descent; `converged` is false where `evaluations` ended it.

    Source: geodesic acceleration in a trust region, Transtrum and Sethna 2012, arXiv:1201.5885;
    tests/identification/test_descent.py.
    """
    low, high = bounds
    x = np.clip(start, low, high)
    here = residual(x)
    cost, tried = float(here @ here), 1
    near, radius = None, np.inf
    passed = [cost]
    while tried < evaluations:
        if tried >= STRIDE and passed[-STRIDE] - cost < crawling * cost:
            return Descent(x, False, tried)
        passed.append(cost)
        if near is None:
            slopes = jacobian(x)
            slopes = slopes if isinstance(slopes, Slopes) else Slopes.of(slopes)
            near = _Near(x, here, slopes, low, high, tuple(pairs))
            radius = near.reach if np.isinf(radius) else radius
        near, step = near.step(radius)
        if step.promise <= 1e-3 * tolerance * cost or step.length <= STALLED * near.reach:
            return Descent(x, True, tried)
        moved = near.at(step.along)
        there = residual(moved)
        tried += 1
        reached = float(there @ there)
        if not cost - reached > KEPT * step.promise:
            turn = near.turn(step, there)
            if 2.0 * near.length(turn) <= BEND * step.length:
                bent = near.at(step.along + 0.5 * turn)
                seen = residual(bent)
                if float(seen @ seen) < reached:
                    moved, there, reached = bent, seen, float(seen @ seen)
        if not reached < cost:
            if step.promise <= tolerance * cost and step.whole:
                return Descent(x, True, tried)
            radius = SHORTER * step.length
            continue
        gain, x, here, cost, near = cost - reached, moved, there, reached, None
        if gain <= tolerance * cost and step.whole:
            return Descent(x, True, tried)
        kept = gain / step.promise
        if kept > KEPT:
            radius = max(radius, 3.0 * step.length)
        elif kept < SHORTER:
            radius = 0.5 * step.length
    return Descent(x, False, tried)


@dataclass(frozen=True, eq=False)
class _Step:
    """A step in local coordinates.

    `along` (d,), `length` in units of what is seen, `promise` the fall of the sum of squares if
    nothing bent, `damping` of the system, and whether it is `whole`: no radius shortened it.
    """

    along: np.ndarray
    length: float
    promise: float
    damping: float
    whole: bool
    open_: np.ndarray


@dataclass(frozen=True, eq=False)
class _Near:
    """A sum of squares near one point, in coordinates of that point."""

    x: np.ndarray
    here: np.ndarray
    rates: Slopes
    low: np.ndarray
    high: np.ndarray
    pairs: tuple[Pair, ...]

    @cached_property
    def springs(self) -> tuple[Pair, ...]:
        """Pairs that are told by compliance and loss here; a damping on its bound stays itself.

        Only a bound of no damping is one of the loss too.
        """
        found = []
        for k, c in self.pairs:
            if c is not None and not (self.x[c] < self.high[c] and self.low[c] == 0.0):
                c = None
            if self.x[k] > SOFT:
                found.append((k, c))
        return tuple(found)

    def at(self, along: np.ndarray) -> np.ndarray:
        """Unknowns a step away, kept inside their bounds, shape (d,) [-]."""
        x = self.x + along
        for k, c in self.springs:
            softer = max(1.0 + along[k] * self.x[k], 1e-3)  # compliance beside that of here
            x[k] = self.x[k] / softer
            if c is not None:
                loss = self.x[c] / self.x[k] ** 2 + along[c]
                x[c] = loss * np.clip(x[k], self.low[k], self.high[k]) ** 2
        return np.clip(x, self.low, self.high)

    @cached_property
    def turned(self) -> np.ndarray:
        """How the unknowns move with the local coordinates, shape (d, d) [-]."""
        found = np.eye(len(self.x))
        for k, c in self.springs:
            square = self.x[k] ** 2
            found[k, k] = -square
            if c is not None:
                found[c, k], found[c, c] = -2.0 * self.x[c] * self.x[k], square
        return found

    @cached_property
    def size(self) -> np.ndarray:
        """How much of what is seen a unit of each coordinate moves, shape (d,) [-]."""
        found = np.sqrt(np.maximum(np.diag(self.curvature), 0.0))
        return np.where(found > 0, found, 1.0)

    @cached_property
    def reach(self) -> float:
        """Length of the unknowns themselves [-]; of a first step, if they are all zero, one."""
        place = self.x.copy()
        for k, c in self.springs:
            place[k] = 1.0 / self.x[k]
            if c is not None:
                place[c] = self.x[c] / self.x[k] ** 2
        return self.length(place) or 1.0

    def length(self, along: np.ndarray) -> float:
        """Length of a step in units of what is seen [-]."""
        return float(np.linalg.norm(self.size * along))

    @cached_property
    def gradient(self) -> np.ndarray:
        """Half the derivative of the sum of squares, shape (d,) [-]."""
        return self.turned.T @ self.rates.pull(self.here)

    @cached_property
    def curvature(self) -> np.ndarray:
        """Half its second derivative if nothing bent, shape (d, d) [-]."""
        return self.turned.T @ self.rates.gram @ self.turned

    @cached_property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """How far each coordinate may go down and up, shapes (d,) [-]."""
        down, up = self.low - self.x, self.high - self.x
        for k, c in self.springs:
            with np.errstate(divide="ignore"):
                down[k] = 1.0 / self.high[k] - 1.0 / self.x[k]
                up[k] = (1.0 / self.low[k] if self.low[k] > 0 else np.inf) - 1.0 / self.x[k]
            if c is not None:
                down[c], up[c] = down[c] / self.x[k] ** 2, up[c] / self.x[k] ** 2
        return down, up

    def step(self, radius: float) -> tuple[_Near, _Step]:
        """The best step no longer than a radius; what would leave its bounds stops at them.

        Returns:
            The coordinates and the step in them: a damping that stops is told by itself, since
            what stops is not its loss.
        """
        down, up = self.ends
        pushed = np.where(self.gradient > 0, down >= 0, up <= 0)
        open_ = np.flatnonzero(~pushed)
        along = np.zeros_like(self.x)
        damping, whole = self._damping(open_, radius)
        along[open_] = self._solve(open_, damping, -self.gradient)
        out = (along < down) | (along > up)
        if out.any():
            along[open_] = self._bounded(open_, damping, down[open_], up[open_])
            at_end = (along <= down) | (along >= up)
            held = [c for _, c in self.springs if c is not None and at_end[c]]
            held = [c for c in held if along[c] > 0 or self.low[c] > 0]
            if held:
                pairs = tuple((k, None if c in held else c) for k, c in self.pairs)
                return replace(self, pairs=pairs).step(radius)
            open_ = np.flatnonzero(~(pushed | at_end))
        promise = -float(2.0 * self.gradient @ along + along @ self.curvature @ along)
        return self, _Step(along, self.length(along), promise, damping, whole, open_)

    def _bounded(
        self, open_: np.ndarray, damping: float, down: np.ndarray, up: np.ndarray
    ) -> np.ndarray:
        """The step of some coordinates at that damping between their ends, shape (open,)."""
        values, vectors = self._parts(open_)
        size, root = self.size[open_], np.sqrt(values + damping)
        target = -(vectors.T @ (self.gradient[open_] / size)) / root
        ends = size * down, np.maximum(size * up, size * down + 1e-300)
        found = lsq_linear(root[:, None] * vectors.T, target, ends, method="bvls", tol=1e-12)
        return np.clip(found.x / size, down, up)

    def turn(self, step: _Step, seen: np.ndarray) -> np.ndarray:
        """Second derivative of the path that a step begins, from the residual at its end.

        Over the whole step, as dry friction is rough on small scales.
        """
        bent = 2.0 * (seen - self.here - self.rates.along(self.turned @ step.along))
        pull = self.turned.T @ self.rates.pull(bent)
        found = np.zeros_like(step.along)
        found[step.open_] = self._solve(step.open_, step.damping, -pull)
        return found

    def _parts(self, open_: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues and eigenvectors of the curvature of some coordinates, scaled [-]."""
        key = open_.tobytes()
        if key not in self._known:
            size = self.size[open_]
            values, vectors = np.linalg.eigh(
                self.curvature[np.ix_(open_, open_)] / np.outer(size, size)
            )
            least = LEAST_INFORMATION * max(float(values[-1]) if len(values) else 1.0, 1e-300)
            self._known[key] = np.maximum(values, least), vectors
        return self._known[key]

    @cached_property
    def _known(self) -> dict[bytes, tuple[np.ndarray, np.ndarray]]:
        return {}

    def _solve(self, open_: np.ndarray, damping: float, pull: np.ndarray) -> np.ndarray:
        values, vectors = self._parts(open_)
        size = self.size[open_]
        return vectors @ ((vectors.T @ (pull[open_] / size)) / (values + damping)) / size

    def _damping(self, open_: np.ndarray, radius: float) -> tuple[float, bool]:
        """Damping that makes a step as long as the radius, and whether none is needed."""
        if not len(open_):
            return 0.0, True
        values, vectors = self._parts(open_)
        parts = vectors.T @ (self.gradient[open_] / self.size[open_])
        if np.linalg.norm(parts / values) <= radius:
            return 0.0, True
        least, most = np.log(1e-3 * values[0]), np.log(np.linalg.norm(parts) / radius)
        for _ in range(60):
            middle = 0.5 * (least + most)
            long = np.linalg.norm(parts / (values + np.exp(middle))) > radius
            least, most = (middle, most) if long else (least, middle)
        return float(np.exp(most)), False
