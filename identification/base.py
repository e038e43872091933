"""fit_base(problem) -> Fit: the rig as it stands, with nuisances, before any cause is asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .beside import each_whole
from .fit import Fit, dominated, settle, solve
from .guess import first_guess
from .losses import swapped_losses
from .prepare import coarser
from .problem import Model, Problem, base_entries, rough_noise
from .starts import has_basins, other_starts

HORIZONS = (3.0, 10.0, 40.0, np.inf)
"""Parts of each record that are fitted one after the other, in periods [-]."""

ENTRY = 15
"""Evaluations on the whole records before their noise is learned [-]; the fit goes on after it."""

BASIN = 0.5
"""Another minimum is taken where its cost is below this share of the first one's [-]: it is
reached by moving constants far, so it must be better beyond doubt."""


def fit_base(problem: Problem, crawling: float = 0.0) -> Fit:
    """Fit the rig as it stands, with nuisances, from its own start values or better ones.

    Where errors of the model dominate what is found, other starts are followed too.

    Args:
        problem: records and rig.
        crawling: share of the cost below which steps are given up where errors of the model
            dominate [-]; `polished` goes on.

    Returns:
        The fit with its noise law chosen and errors known; its problem carries scales.

    Source: tests/identification/test_fit.py and the real records.
    """
    entries = base_entries(problem)
    model = Model(problem, entries, (), rough_noise(problem))
    coarse = replace(problem, records=tuple(coarser(p) for p in problem.records))
    near = replace(model, problem=coarse, noises=rough_noise(coarse))
    best = _grown(near, first_guess(near))
    if has_basins(model) and dominated(best):
        for fit in each_whole(lambda start: _grown(near, start), other_starts(near, best.x)):
            best = fit if fit.cost < BASIN * best.cost else best
    return _other_end(settle(solve(model, best.x, ENTRY), crawling=crawling))


def _other_end(fit: Fit) -> Fit:
    """The fit, or a better one from where shaft and sleeve have swapped what they lose."""
    if dominated(fit):
        return fit
    start = swapped_losses(fit.model, fit.x, np.array([fit.std(i) for i in range(len(fit.x))]))
    if start is None:
        return fit
    other = solve(fit.model, start, 60)
    return settle(other) if other.cost < fit.cost else fit


def _grown(model: Model, x: np.ndarray) -> Fit:
    """The fit from one start, first to a few periods of each record, then to more and more."""
    for horizon in HORIZONS[:-1]:
        if not _whole(model.problem, horizon):
            x = solve(replace(model, horizon=horizon), x, 15).x
    return solve(model, x, 60)


def _whole(problem: Problem, horizon: float) -> bool:
    return all(p.frequency * p.count * p.step <= horizon for p in problem.records)
