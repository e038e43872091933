"""Other starts of a fit: two springs in a row give the same frequencies in two ways."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from .beside import each_whole
from .guess import bounded, constants_named, solve_linear
from .problem import Model

RATIOS = (1 / 6.0, 1 / 2.5, 2.5, 6.0)
"""Factors on one stiffness against all others that are tried [-]."""

TOGETHER = (0.5, 0.75, 1.0, 1.4, 2.0)
"""Factors on all stiffnesses that are tried with each of these [-]."""

MOST = 3
"""Starts that are followed to their end [-]."""

STRAINED = 3.0
"""Distance of a constant from what the rig says, over its tolerance, from which it strains [-]."""

PERIODS = 10.0
"""How much of each record a start is judged by, in periods [-]."""


def has_basins(model: Model) -> bool:
    """Whether the rig has two free stiffnesses or more, which may stand in for each other."""
    return len(constants_named(model, "stiffness")) > 1


def other_starts(model: Model, x: np.ndarray) -> list[np.ndarray]:
    """Starts from which a fit may find another minimum than the one at `x`.

    Each spring in turn is made stiffer or softer than all others, and all are scaled together;
    start states follow in closed form.

    Args:
        model: linear model (no laws) with rough noise.
        x: scaled unknowns of the minimum that was found.

    Returns:
        At most `MOST` scaled unknowns [-] inside their bounds, those that fit best first.

    Source: tests/identification/test_starts.py.
    """
    near = replace(model, horizon=PERIODS)
    springs = constants_named(model, "stiffness")
    told = np.array([entry.value / entry.scale for entry in model.entries])
    begun = []
    for index, center, ratio, together in product(springs, (x, told), RATIOS, TOGETHER):
        start = center.copy()
        start[springs] *= together
        start[index] *= ratio
        begun.append(bounded(model, start))
    found = each_whole(lambda start: solve_linear(near, start), begun)
    chosen: list[np.ndarray] = []
    for start, _ in sorted(found, key=lambda one: one[1]):
        if all(_apart(start[springs], other[springs]) for other in chosen):
            chosen.append(start)
    return [bounded(model, start) for start in chosen[:MOST]]


def told_start(model: Model, x: np.ndarray) -> np.ndarray:
    """The unknowns with every shared constant back at what the rig says.

    Without its cause a model may have been drawn far away; once the cause is there, the way back
    can be closed.

    Args:
        model: any.
        x: scaled unknowns; each record's own are kept.

    Returns:
        Scaled unknowns [-].

    Source: tests/identification/test_starts.py.
    """
    start = x.copy()
    for index, entry in enumerate(model.entries):
        if entry.slot == "numbers" and entry.record is None:
            start[index] = entry.value / entry.scale
    return bounded(model, start)


def eased_start(model: Model, x: np.ndarray) -> np.ndarray:
    """The unknowns with what strains its tolerance back at what the rig says; springs stay.

    A law that is still on its way leaves the constants strained that a model without it asked for,
    and then its frequency settles where these are right: a support at 25 Hz for one at 16 Hz.

    Args:
        model: any.
        x: scaled unknowns; each record's own are kept.

    Returns:
        Scaled unknowns [-]; as they are where nothing strains.

    Source: tests/identification/test_starts.py.
    """
    start = x.copy()
    for index, entry in enumerate(model.entries):
        if entry.slot == "numbers" and entry.record is None and np.isfinite(entry.prior):
            if abs(x[index] * entry.scale - entry.center) > STRAINED * entry.prior:
                start[index] = entry.center / entry.scale
    return start


def _apart(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two sets of stiffnesses differ by more than a common factor does."""
    ratio = np.log(first / second)
    return float(np.ptp(ratio)) > np.log(1.5)
