"""How a fit stands: what of its misfit is chance, what it foretells, what its records can show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .extend import HeldOut
from .fit import Fit
from .noise import ljung_box
from .screen import Candidate, alikeness

MISFIT_SHOWN = 0.01
"""Chance of the worst channel's misfit under the noise, below which there is one [-]."""


def misfit_chance(fit: Fit) -> float:
    """Chance of the worst channel's absolute misfit under the noise, for so many channels [-]."""
    worst = min((misfit.p_value for misfit in fit.misfits.values()), default=1.0)
    return min(worst * len(fit.misfits), 1.0)


def gains_unseen(before: HeldOut, after: HeldOut, lenient: bool) -> bool:
    """Whether held-out records are foretold better, or as well where they were at the noise.

    Only a first cause may be named that gains nothing unseen: once one is named, a small misfit
    that is left may be of its form, which many laws mend a little.

    Args:
        before: without the cause.
        after: with it.
        lenient: whether 2 % more error is let pass where the noise is reached already.
    """
    if before.nrmse < 1.15 * before.noise_floor:
        return after.nrmse < (1.02 if lenient else 1.0) * before.nrmse
    reach = before.nrmse**2 - min(before.noise_floor, after.noise_floor) ** 2
    return before.nrmse**2 - after.nrmse**2 > 0.05 * reach


SPOILED = 1.1
"""Factor on the error of foretelling up to which constants may move for the worse beside a law that
held-out records cannot show [-]."""


def spares(before: HeldOut, after: HeldOut) -> bool:
    """Whether held-out records that cannot show a law are foretold about as well with it.

    Args:
        before: without the law.
        after: with it.

    Source: tests/identification/test_told.py.
    """
    return after.nrmse < SPOILED * before.nrmse


def floor_visibility(fit: Fit, candidate: Candidate) -> float:
    """What a law of natural strength moves beyond all that is fitted, in noise units [-]."""
    floor, noises = fit.problem.floor, fit.model.noises
    ratios = [noises[key].marginal_std / floor[key].marginal_std for key in floor]
    return candidate.visible * float(np.median(ratios))


def alike_pairs(candidates: Sequence[Candidate]) -> tuple[tuple[str, str, float], ...]:
    """Pairs of candidates that look alike in these records: names and alikeness [-]."""
    pairs = []
    for i, first in enumerate(candidates):
        for second in candidates[i + 1 :]:
            alike = alikeness(first, second)
            if alike > 0.9:
                pairs.append((first.name, second.name, alike))
    return tuple(sorted(pairs, key=lambda pair: -pair[2])[:20])


def whiteness(fit: Fit) -> float:
    """Smallest Ljung-Box p-value of the channels' residuals under their noise floor [-]."""
    values = []
    for key in fit.keys:
        values.append(ljung_box(fit.problem.floor[key].whiten(fit.residual_of(key))))
    return float(min(min(values) * len(values), 1.0)) if values else 1.0
