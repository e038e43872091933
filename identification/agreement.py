"""A posterior in the contract's JSON, and whether least squares says the same, in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from .identifiable import identifiability
from .posterior import Posterior
from .unknowns import is_linear

MOST_SHIFT = 0.1
"""How far a posterior's mean may lie from the least-squares value, in its errors [-]."""

MOST_WIDENING = 0.1
"""By which share a posterior's width may differ from the least-squares error [-]."""

HONEST = 1e-3
"""p-value of the misfit below which least-squares errors were widened by it [-]."""


def posterior_json(posterior: Posterior) -> dict[str, Any]:
    """The ``posterior`` of the contract's ``fit.json``; numbers in the SI units beside them.

    Args:
        posterior: what was sampled.

    Returns:
        Tables and numbers that JSON can hold: ``status``, ``converged``, ``parameters`` and
        ``nuisances`` by label (``mean``, ``std``, ``low``, ``high``, ``unit``, ``r_hat``,
        ``ess_bulk``, ``ess_tail``, ``autocorrelation_time``, ``shift``, ``width``), ``laplace``
        with ``agrees`` and ``sentence``, what was ``integrated``, and how long it took [steps].
    """
    rows = {u.label: _row(posterior, i) for i, u in enumerate(posterior.unknowns)}
    constants = {u.label: rows[u.label] for u in posterior.unknowns if u.is_constant}
    others = {label: row for label, row in rows.items() if label not in constants}
    sentence = laplace_sentence(posterior)
    model = posterior.fit.model
    steps, ensembles, walkers, _ = posterior.draws.shape
    return {
        "status": posterior.status,
        "converged": posterior.converged,
        "parameters": constants,
        "laplace": {"agrees": not sentence, "sentence": sentence},
        "nuisances": others,
        "integrated": [e.label for e in model.entries if is_linear(model, e)],
        "ensembles": ensembles,
        "walkers": walkers,
        "steps": steps,
        "dropped_steps": posterior.dropped,
        "wanted_steps": posterior.convergence.wanted_steps,
        "acceptance": [float(share) for share in posterior.acceptance],
    }


def _row(posterior: Posterior, index: int) -> dict[str, Any]:
    unknown, told = posterior.unknowns[index], posterior.convergence
    draws = posterior.draws[..., index]
    low, high = np.quantile(draws, [0.025, 0.975])
    shift, width = departure(posterior, unknown.label)
    numbers = {
        "mean": float(np.mean(draws)),
        "std": float(np.std(draws)),
        "low": float(low),
        "high": float(high),
        "unit": unknown.unit,
        "r_hat": float(told.r_hat[index]),
        "ess_bulk": float(told.ess_bulk[index]),
        "ess_tail": float(told.ess_tail[index]),
        "autocorrelation_time": float(told.memory[index]),
        "shift": shift,
        "width": width,
    }
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v
            for k, v in numbers.items()}  # fmt: skip


def departure(posterior: Posterior, label: str) -> tuple[float, float]:
    """How far a posterior's mean lies from least squares, in the latter's errors, and its width.

    Args:
        posterior: what was sampled.
        label: of the unknown.

    Returns:
        Shift of the mean over the least-squares error, and width over that error [-].
    """
    unknown, draws = posterior.unknowns[posterior.index(label)], posterior.of(label)
    entries = [entry.label for entry in posterior.fit.model.entries]
    value, std = unknown.value, unknown.std
    if label in entries:
        value, std = (of(entries.index(label)) for of in (posterior.fit.value, posterior.fit.std))
    if not 0 < std < math.inf:
        return math.nan, math.nan
    return float((np.mean(draws) - value) / std), float(np.std(draws) / std)


def laplace_sentence(posterior: Posterior) -> str:
    """Where constants' posterior and least squares disagree, and whom to believe; else nothing.

    What chance makes of a finite number of draws is allowed for.
    """
    said: list[str] = []
    told = posterior.convergence
    for index, unknown in enumerate(posterior.unknowns):
        if not unknown.is_constant:
            continue
        shift, width = departure(posterior, unknown.label)
        chance = 2.0 / math.sqrt(max(float(np.nan_to_num(told.ess_bulk[index])), 1.0))
        words = []
        if abs(shift) > MOST_SHIFT + chance:
            words.append(f"its mean lies {abs(shift):.2g} standard errors off")
        if abs(width - 1.0) > MOST_WIDENING + chance:
            words.append(f"it is {width:.2g} times as wide")
        if words:
            said.append(f"{unknown.label}: {' and '.join(words)}")
    if not said:
        return ""
    return f"Posterior and least squares disagree on {'; '.join(said)}. {_believe(posterior)}"


def _believe(posterior: Posterior) -> str:
    misfits: Mapping[Any, Any] = posterior.fit.misfits
    if any(misfit.p_value < HONEST for misfit in misfits.values()):
        return (
            "The records hold misfit that is not noise: least-squares errors are widened by it, "
            "the posterior takes it for noise. Believe the wider of the two."
        )
    told = identifiability(posterior.fit)
    doubtful = [
        unknown.label
        for unknown in posterior.unknowns
        if unknown.is_constant and told[unknown.label]["identifiable"] in ("coupled", "flat")
    ]
    believe = "The posterior is not normal: believe its interval."
    if not doubtful:
        return believe
    return (
        f"{believe} The records do not tell {', '.join(doubtful)} one by one: where along their "
        "trade-off these lie, the bounds decide and that every value between them counts alike. "
        "Tighter bounds, or a record that tells one of them, will move these intervals."
    )
