"""How far a constant can go before the records object: profile likelihood, step by step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .fit import Fit, solve

RISE = 3.841459
"""Rise of the sum of squares at the ends of a 95 % interval of one number [-]."""

FARTHEST = 30.0
"""Factor from the best value beyond which a constant counts as open on that side [-]."""

MOST_STEPS = 14
"""Refits a side [-]."""


@dataclass(frozen=True, eq=False)
class Profile:
    """Best sums of squares with one constant held.

    Attributes:
        label: of the constant.
        values: held, rising, shape (steps,) [SI].
        rises: of the sum of squares over its least, in units of the misfit, shape (steps,) [-].
        low: lower end of the 95 % interval [SI]; -inf where the records set none.
        high: upper end [SI]; inf where the records set none.
    """

    label: str
    values: np.ndarray
    rises: np.ndarray
    low: float
    high: float

    @property
    def shape(self) -> str:
        """``yes`` where both ends are set, ``one_sided`` where one is, ``flat`` where none."""
        ends = int(np.isfinite(self.low)) + int(np.isfinite(self.high))
        return ("flat", "one_sided", "yes")[ends]


def profile_likelihood(fit: Fit, label: str) -> Profile:
    """Hold one constant ever farther from its best value and fit all others again.

    Steps grow where the records hardly object and shrink where they do; a side ends where the
    95 % limit is passed, at a bound, or `FARTHEST` from the best value.

    Args:
        fit: converged, with errors.
        label: of one of its constants.

    Returns:
        The profile [SI].

    Raises:
        ValueError: for a label that the fit does not vary.

    Source: Raue et al. 2009, doi:10.1093/bioinformatics/btp358;
    tests/identification/test_profile_likelihood.py.
    """
    labels = [entry.label for entry in fit.model.entries]
    if label not in labels:
        raise ValueError(
            f"profile: expected one of {', '.join(labels)}, found '{label}'. Mend: name one."
        )
    index = labels.index(label)
    best = fit.value(index)
    down, up = (_side(fit, index, sign) for sign in (-1.0, 1.0))
    steps = sorted([*down, (best, 0.0), *up])
    values, rises = (np.array(column) for column in zip(*steps, strict=True))
    return Profile(label, values, rises, _end([(best, 0.0), *down]), _end([(best, 0.0), *up], 1.0))


def _side(fit: Fit, index: int, sign: float) -> list[tuple[float, float]]:
    """Values and rises on one side, outwards."""
    entry, best = fit.model.entries[index], fit.value(index)
    size = abs(best) or entry.scale
    step = min(max(fit.std(index), 1e-6 * size), 0.5 * size)
    end = entry.high if sign > 0 else entry.low
    reach = FARTHEST * size if sign > 0 else max(-FARTHEST * size, -np.inf)
    x, value, found = np.delete(fit.x, index), best, []
    for _ in range(MOST_STEPS):
        ahead = value + sign * step
        bounded = sign * ahead >= sign * end
        ahead = end if bounded else ahead
        again, rise = held_at(fit, index, ahead, x)
        found.append((ahead, rise))
        if rise > RISE or bounded or sign * ahead >= abs(reach):
            break
        grown = rise - (found[-2][1] if len(found) > 1 else 0.0)
        step *= 3.0 if grown < 0.1 * RISE else 1.5 if grown < 0.5 * RISE else 0.7
        x, value = again.x, ahead
    return found


def held_at(fit: Fit, index: int, value: float, x: np.ndarray) -> tuple[Fit, float]:
    """One constant held at a value [SI], all others fitted again from `x` [-].

    Returns:
        That fit, and the rise of the sum of squares in units of the misfit, at least 0 [-].
    """
    model, entry = fit.model, fit.model.entries[index]
    entries = tuple(e for i, e in enumerate(model.entries) if i != index)
    worse = [m.ratio for m in fit.misfits.values() if m.p_value < 1e-3]
    again = solve(replace(model, entries=entries, fixed=(*model.fixed, (entry, value))), x, 12)
    # the prior of a number that is held still pulls
    pull = ((value - entry.center) / entry.prior) ** 2 if np.isfinite(entry.prior) else 0.0
    return again, max(0.0, (again.cost + pull - fit.cost) / max([1.0, *worse]))


def _end(steps: list[tuple[float, float]], sign: float = -1.0) -> float:
    """Where the rise passes the limit, on a parabola's root between the last two steps."""
    (near, low), (far, high) = steps[-2:] if len(steps) > 1 else (steps[0], steps[0])
    if high <= RISE:
        return sign * np.inf
    share = (np.sqrt(RISE) - np.sqrt(low)) / (np.sqrt(high) - np.sqrt(low))
    return float(near + share * (far - near))
