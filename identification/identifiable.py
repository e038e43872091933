"""Which numbers these records can tell, in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from .evidence import on_bounds
from .fit import Fit

COUPLED = 0.98
"""Correlation beyond which two numbers are told only together [-]."""

FLAT = 0.5
"""Relative standard error beyond which a number is not told at all [-]."""


def identifiability(fit: Fit) -> dict[str, dict[str, Any]]:
    """Whether each constant is told by the records of a fit.

    Args:
        fit: with its covariance.

    Returns:
        By label: ``identifiable`` (yes, one_sided, flat or coupled), ``partner`` for coupled ones
        and ``note`` in words; correlations and relative errors are dimensionless [-].
    """
    deviation = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    correlation = fit.covariance / np.outer(deviation, deviation)
    bound = set(on_bounds(fit))
    found: dict[str, dict[str, Any]] = {}
    entries = fit.model.entries
    constants = [i for i, e in enumerate(entries) if e.slot in ("numbers", "strengths")]
    for i in constants:
        label = entries[i].label
        others = [j for j in constants if j != i]
        partner = max(others, key=lambda j: abs(correlation[i, j]), default=None)
        value, std = abs(fit.value(i)), fit.std(i)
        moved = abs(fit.value(i) - entries[i].value) > 1e-9 * abs(entries[i].scale)
        if label in bound:
            kind, note = "one_sided", "stands on its bound"
        elif std == 0 or not np.isfinite(std):
            kind, note = "flat", "never moved" if not moved else "has no error bar"
        elif partner is not None and abs(correlation[i, partner]) > COUPLED and std > 0.05 * value:
            kind = "coupled"
            note = f"trades off with {entries[partner].label}"
        elif std > FLAT * value:
            kind, note = "flat", "has an error as large as itself"
        else:
            kind, note = "yes", "never moved" if not moved else ""
        found[label] = {"identifiable": kind, "note": note}
        if kind == "coupled" and partner is not None:
            found[label]["partner"] = entries[partner].label
    return found
