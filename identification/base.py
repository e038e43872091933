"""fit_base(problem) -> Fit: the rig as it stands, with nuisances, before any cause is asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .beside import each_whole
from .fit import CRAWL, Fit, constants_held, dominated, settle, solve
from .guess import first_guess
from .losses import swapped_losses
from .prepare import coarser
from .problem import Model, Problem, base_entries, rough_noise
from .starts import eased_start, has_basins, other_starts, told_start
from .tolerances import PULLED, worst_pull

HORIZONS = (3.0, 10.0, 40.0, np.inf)
"""Parts of each record that are fitted one after the other, in periods [-]."""

ENTRY = 15
"""Evaluations on the whole records before their noise is learned [-]; the fit goes on after it."""

DEEPER = 0.99
"""Another minimum by the same weights is taken where its cost is below this share [-]."""

BASIN = 0.5
"""Another minimum is taken where its cost is below this share of the first one's [-]: it is
reached by moving constants far, so it must be better beyond doubt."""


def fit_base(problem: Problem, crawling: float = 0.0) -> Fit:
    """Fit the rig as it stands, with nuisances, from its own start values or better ones.

    Where errors of the model dominate what is found, other starts are followed too, and where they
    have drawn its constants away, it begins again from what is stated of these.

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
    fit = _other_end(settle(solve(model, best.x, ENTRY), crawling=crawling))
    return back_in_place(fit, best.x, crawling)


def _other_end(fit: Fit) -> Fit:
    """The fit, or a better one from where shaft and sleeve have swapped what they lose."""
    if dominated(fit):
        return fit
    start = swapped_losses(fit.model, fit.x, np.array([fit.std(i) for i in range(len(fit.x))]))
    if start is None:
        return fit
    other = solve(fit.model, start, 60)
    return settle(other) if other.cost < fit.cost else fit


def back_in_place(fit: Fit, x: np.ndarray, crawling: float) -> Fit:
    """The fit, or a better one from nearer to what is stated, where its constants were drawn away.

    Weights by the misfit's own spectrum can lead into a side valley where constants make room for
    what the model lacks; by the same weights there may be a deeper one near what the rig says, or
    with what strains there and the springs as they are.

    Args:
        fit: settled.
        x: scaled unknowns before it was weighed so [-].
        crawling: as of `fit_base`.

    Returns:
        It, settled again; the fit itself where no constant strains, where nothing fits better, or
        where what does strains more.

    Source: tests/identification/test_starts.py.
    """
    if worst_pull(fit) <= PULLED:
        return fit

    def begun(start: np.ndarray) -> Fit:
        return solve(fit.model, constants_held(fit.model, start, 20), 60, CRAWL)

    best = min(each_whole(begun, [told_start(fit.model, fit.x), x]), key=lambda one: one.cost)
    fit = settle(best, crawling=crawling) if best.cost < DEEPER * fit.cost else fit
    if worst_pull(fit) <= PULLED:
        return fit
    eased = solve(fit.model, eased_start(fit.model, fit.x), 60, CRAWL)
    better = eased.cost < fit.cost and worst_pull(eased) < worst_pull(fit)
    return settle(eased, crawling=crawling) if better else fit


def _grown(model: Model, x: np.ndarray) -> Fit:
    """The fit from one start, first to a few periods of each record, then to more and more."""
    for horizon in HORIZONS[:-1]:
        if not _whole(model.problem, horizon):
            x = solve(replace(model, horizon=horizon), x, 15).x
    return solve(model, x, 60)


def _whole(problem: Problem, horizon: float) -> bool:
    return all(p.frequency * p.count * p.step <= horizon for p in problem.records)
