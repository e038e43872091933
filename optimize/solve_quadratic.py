"""The quadratic program of a swing: least squares under equations and two-sided bounds, dense."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

MOST_ITERATIONS = 60
"""Steps after which an interior-point solution is given up [-]."""

SETTLED = 1e-9
"""Complementarity and residuals, relative to the size of the problem, that count as zero [-]."""


LEAST = 1e-18
"""Distance from a bound, and price, that are never gone below [1]."""


@dataclass(frozen=True)
class Bounds:
    """``low <= rows @ c <= high``, each row in units of its own limit.

    Attributes:
        rows: shape (m, n) [1].
        low: shape (m,), minus infinity where there is none [1].
        high: shape (m,), infinity where there is none [1].
    """

    rows: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class Answer:
    """What a quadratic program gave.

    Attributes:
        c: the unknowns, shape (n,) [1].
        prices: multiplier of each row, positive on its upper bound, shape (m,) [cost].
        widened: by how much of themselves the bounds had to be widened [-]; 0 where they hold.
        gap: largest residual of the optimality conditions, relative [-].
        steps: interior-point steps [-].
    """

    c: np.ndarray
    prices: np.ndarray
    widened: float
    gap: float
    steps: int

    @property
    def solved(self) -> bool:
        """Whether the optimality conditions hold and no bound was widened."""
        return self.gap <= 1e3 * SETTLED and self.widened <= 0.0


@dataclass(frozen=True)
class Reduced:
    """A least-squares cost under equations, in coordinates where it is a plain distance.

    With the QR factors of the cost's rows the Hessian is the identity, whatever the weights; the
    equations are met by construction. Normal equations fail where weights span ten decades.

    Attributes:
        back: from the coordinates to the unknowns, shape (n, k) [1].
        foot: the unknowns at the coordinates' origin, shape (n,) [1].
        target: coordinates of the least cost, shape (k,) [sqrt cost].
    """

    back: np.ndarray
    foot: np.ndarray
    target: np.ndarray


def reduce(cost: np.ndarray, aim: np.ndarray, equations: np.ndarray, sides: np.ndarray) -> Reduced:
    """Bring ``min |cost c - aim|^2 / 2`` under ``equations c = sides`` to a plain distance.

    Args:
        cost: shape (rows, n), of full column rank [sqrt cost].
        aim: shape (rows,) [sqrt cost].
        equations: shape (e, n), independent [1].
        sides: shape (e,) [1].

    Returns:
        The coordinates; see `Reduced`.

    Source: Lawson and Hanson 1974, chapter 20.
    """
    whole = np.column_stack([cost, aim])
    upper = triangle_of(whole)
    n = cost.shape[1]
    triangle, target = upper[:n, :n], upper[:n, n]
    turned = solve_triangular(triangle, equations.T, trans=1, check_finite=False)
    basis, small = np.linalg.qr(turned, mode="complete")
    e = len(sides)
    along = solve_triangular(small[:e], sides, trans=1, check_finite=False)
    foot = basis[:, :e] @ along
    free = basis[:, e:]
    both = solve_triangular(triangle, np.column_stack([free, foot]), check_finite=False)
    return Reduced(both[:, :-1], both[:, -1], free.T @ target)


def triangle_of(rows: np.ndarray) -> np.ndarray:
    """Rows of upper triangular form with the same squares, shape (min(r, n), n) [any unit]."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def nearest(reduced: Reduced, bounds: Bounds) -> Answer:
    """The point nearest to the least cost that keeps the bounds.

    Args:
        reduced: cost and equations.
        bounds: what has to be kept.

    Returns:
        The answer; where no point keeps the bounds, that of `relaxed`.
    """
    rows = bounds.rows @ reduced.back
    shift = bounds.rows @ reduced.foot
    ones = np.ones(len(reduced.target))
    found = _interior(ones, reduced.target, rows, bounds.low - shift, bounds.high - shift)
    w, prices, gap, steps = found
    if gap > 1e3 * SETTLED:
        other = relaxed(reduced, bounds)
        if other.widened > 1e3 * SETTLED or not np.isfinite(w).all():
            return other
    return Answer(reduced.foot + reduced.back @ w, prices, 0.0, gap, steps)


def relaxed(reduced: Reduced, bounds: Bounds, cost_share: float = 1e-7) -> Answer:
    """The point for which all bounds together have to be widened least.

    Args:
        reduced: cost and equations.
        bounds: what cannot be kept as it stands.
        cost_share: weight of the cost against the widening [-].

    Returns:
        The answer; its prices tell which bounds bind.
    """
    rows = bounds.rows @ reduced.back
    shift = bounds.rows @ reduced.foot
    m, k = rows.shape
    size = max(1.0, float(np.abs(reduced.target).max(initial=0.0)))
    weights = np.append(np.full(k, cost_share / size**2), 1.0)
    aim = np.append(reduced.target, -1.0)
    low, high = bounds.low - shift, bounds.high - shift
    last = np.zeros(k + 1)
    last[-1] = 1.0
    upper = np.column_stack([rows, -np.ones(m)])
    lower = np.column_stack([rows, np.ones(m)])
    none = np.full(m, np.inf)
    whole = np.concatenate([upper, lower, last[None]])
    least = np.concatenate([-none, low, [0.0]])
    most = np.concatenate([high, none, [np.inf]])
    w, prices, gap, steps = _interior(weights, aim, whole, least, most)
    widened = float(w[-1])
    c = reduced.foot + reduced.back @ w[:-1]
    return Answer(c, prices[:m] + prices[m : 2 * m], max(widened, 0.0), gap, steps)


def _interior(
    weights: np.ndarray, target: np.ndarray, rows: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, int]:
    """``min sum weights (w - target)^2 / 2`` with ``low <= rows w <= high``.

    Source: Mehrotra's predictor and corrector, Nocedal and Wright 2006, algorithm 16.4.
    """
    below, above = np.flatnonzero(np.isfinite(low)), np.flatnonzero(np.isfinite(high))
    count = len(below) + len(above)
    if not count:
        return target.copy(), np.zeros(len(rows)), 0.0, 0
    bound = np.concatenate([-low[below], high[above]])

    def seen(w: np.ndarray) -> np.ndarray:
        """What the one-sided rows ``signed w <= bound`` see."""
        values = rows @ w
        return np.concatenate([-values[below], values[above]])

    def spread(z: np.ndarray) -> np.ndarray:
        """Multipliers of one-sided rows, gathered on the rows."""
        total = np.zeros(len(rows))
        total[above] += z[len(below) :]
        total[below] -= z[: len(below)]
        return total

    def curved(d: np.ndarray) -> np.ndarray:
        total = np.zeros(len(rows))
        total[above] += d[len(below) :]
        total[below] += d[: len(below)]
        scaled = rows * np.sqrt(total)[:, None]
        hessian = scaled.T @ scaled  # of one buffer: numpy then forms half of it only
        hessian[np.diag_indices_from(hessian)] += weights
        return hessian

    def newton(
        goal: np.ndarray, factor: tuple[np.ndarray, bool], at: tuple[np.ndarray, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Step towards ``s z = goal`` from residuals, slacks and prices."""
        dual, primal, s, z = at
        pull = (goal - s * z + z * primal) / s
        dw = cho_solve(factor, -dual - rows.T @ spread(pull), check_finite=False)
        ds = -primal - seen(dw)
        return dw, ds, (goal - s * z - z * ds) / s

    w = target.copy()
    scale = 1.0 + float(np.abs(bound).max())
    dual_scale = 1.0 + float(np.abs(weights * target).max())
    s = np.maximum(bound - seen(w), 0.1 * scale)
    z = np.full(count, min(1.0, dual_scale) * 0.1)
    gap, step, best = np.inf, 0, (np.inf, w, z)
    for step in range(1, MOST_ITERATIONS + 1):  # noqa: B007
        dual = weights * (w - target) + rows.T @ spread(z)
        primal = seen(w) + s - bound
        mu = float(s @ z) / count
        gap = max(
            float(np.abs(dual).max()) / dual_scale, float(np.abs(primal).max()) / scale,
            mu * count / (dual_scale + 0.5 * float(weights @ (w - target) ** 2)),
        )  # fmt: skip
        if gap < best[0]:
            best = (gap, w.copy(), z.copy())
        if gap <= SETTLED or not np.isfinite(gap) or s.min() <= LEAST:
            break
        try:
            factor = cho_factor(curved(z / s), check_finite=False)
        except np.linalg.LinAlgError:
            break

        _, ds, dz = newton(np.zeros(count), factor, (dual, primal, s, z))
        a, b = _reach(s, ds), _reach(z, dz)
        after = float((s + a * ds) @ (z + b * dz)) / count
        center = (after / mu) ** 3 * mu
        dw, ds, dz = newton(center - ds * dz, factor, (dual, primal, s, z))
        shrink = max(0.9, 1.0 - mu) if mu < 0.1 else 0.9
        a, b = shrink * _reach(s, ds), shrink * _reach(z, dz)
        a = b = min(a, b)
        w, s = w + a * dw, np.maximum(s + a * ds, LEAST)
        z = np.maximum(z + b * dz, LEAST)
    gap, w, z = best
    return w, spread(z), gap, step


def _reach(x: np.ndarray, dx: np.ndarray) -> float:
    """How far along dx all of x stays above zero, at most 1."""
    falling = dx < 0
    return float(min(1.0, np.min(-x[falling] / dx[falling], initial=np.inf)))
