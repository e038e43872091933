"""Which numbers these records can tell, in words."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from .errors import BLIND, SHOWN, covariance_at
from .evidence import on_bounds
from .fit import Fit
from .profile_likelihood import RISE, held_at

COUPLED = 0.98
"""Correlation beyond which two numbers are told only together [-]."""

FLAT = 0.5
"""Relative standard error beyond which a number is not told at all [-]."""

FAINT = 0.1
"""Relative error with all other numbers known, beyond which a number that is not told is hardly
visible in itself; below it others take its place [-]."""

LINKED = 0.9
"""Share of the largest correlation from which on another number is a partner too [-]."""


def identifiability(fit: Fit) -> dict[str, dict[str, Any]]:
    """Whether each constant is told by the records of a fit.

    Args:
        fit: with its covariance.

    Returns:
        By label: ``identifiable`` (yes, one_sided, flat or coupled), ``partner`` and all
        ``partners`` for coupled ones, closest first, and ``note`` in words;
        correlations and relative errors are dimensionless [-].
    """
    entries = fit.model.entries
    which = [i for i, e in enumerate(entries) if e.slot in ("numbers", "strengths")]
    scale = fit.model.scale[which]
    return words_of(
        [entries[i].label for i in which],
        np.array([fit.value(i) for i in which]),
        np.array([entries[i].value for i in which]),
        fit.covariance[np.ix_(which, which)] * np.outer(scale, scale),
        set(on_bounds(fit)),
        1.0 / np.maximum(np.linalg.norm(information_root(fit, which), axis=0), 1e-300),
        _idle(fit),
    )


def _idle(fit: Fit) -> set[str]:
    """Labels of constants on a bound whose start values do as well, all others fitted again.

    Where misfit is left that says nothing: what pushes on the bound may be the misfit.
    """
    found = set()
    if any(misfit.p_value < SHOWN for misfit in fit.misfits.values()):
        return found
    for label in on_bounds(fit):
        index = fit.index(label)
        start = fit.model.entries[index].value
        if start != fit.value(index):
            _, rise = held_at(fit, index, start, np.delete(fit.x, index))
            found |= {label} if rise < RISE else set()
    return found


def information_root(fit: Fit, which: Sequence[int]) -> np.ndarray:
    """What the records say of some of a fit's numbers when all its others are solved for.

    Args:
        fit: any fit with errors.
        which: indices of the numbers.

    Returns:
        Root of the information, shape (rows, numbers): times a change of the numbers it is that
        change in standard deviations [1/SI]. It shrinks as the fit's own errors grow where misfit
        is left; directions that the records do not tell are in no row.
    """
    jacobian, which = fit.model.jacobian(fit.x), list(which)
    others = [i for i in range(len(fit.x)) if i not in which]
    basis = np.linalg.qr(jacobian[:, others])[0]
    own = jacobian[:, which]
    root = np.linalg.qr(own - basis @ (basis.T @ own))[1]
    hessian = jacobian.T @ jacobian
    hessian += BLIND * np.diag(np.diag(hessian))  # as in the fit's own errors
    plain = np.linalg.pinv(hessian, rcond=1e-15, hermitian=True)
    here = covariance_at(fit.model, fit.x, fit.misfits)
    ratio = np.diag(here)[which] / np.maximum(np.diag(plain)[which], 1e-300)
    grow = max(float(np.median(ratio)), 1.0) if which else 1.0
    return root / fit.model.scale[which] / np.sqrt(grow)


def words_of(
    labels: Sequence[str],
    values: np.ndarray,
    starts: np.ndarray,
    covariance: np.ndarray,
    bound: Collection[str],
    alone: np.ndarray | None = None,
    idle: Collection[str] = (),
) -> dict[str, dict[str, Any]]:
    """Whether each of some fitted numbers is told, from values and covariance.

    Args:
        labels: of the numbers.
        values: best, shape (n,) [SI].
        starts: start values, shape (n,) [SI].
        covariance: shape (n, n) [SI].
        bound: labels of those that stand on a bound.
        alone: standard errors with all others known, shape (n,) [SI]; None where not known.
        idle: labels of those on a bound whose start values the records do not object to.

    Returns:
        As `identifiability`; correlations and relative errors are dimensionless [-].
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    size = np.where(deviation > 0, deviation, 1.0)
    correlation = covariance / np.outer(size, size)
    found: dict[str, dict[str, Any]] = {}
    for i, label in enumerate(labels):
        others = sorted(
            (j for j in range(len(labels)) if j != i), key=lambda j: -abs(correlation[i, j])
        )
        closest = abs(float(correlation[i, others[0]])) if others else 0.0
        least = COUPLED if closest > COUPLED else LINKED * closest
        partners = [labels[j] for j in others if abs(correlation[i, j]) >= least]
        value, std = abs(float(values[i])), float(deviation[i])
        start = abs(float(starts[i]))
        size_of = max(value, start) if label in bound else value
        nought = label in bound and size_of == 0.0  # it has no size of its own to be told by
        lost = std > FLAT * size_of and not nought
        faint = alone is not None and alone[i] > FAINT * size_of
        moved = abs(float(values[i] - starts[i])) > 1e-9 * (start or 1.0)
        one: dict[str, Any]
        if lost and faint:
            error = float(alone[i]) / size_of if alone is not None and size_of else np.inf
            much = f"of {100 * error:.0f} %" if error < 1 else "beyond itself"
            one = _one("flat", f"is hardly visible: an error {much} even with all others known")
        elif label in idle:
            one = _one("flat", "is hardly visible: its bound will do as well as its first value")
        elif label in bound:
            one = _one("one_sided", "stands on its bound")
        elif std == 0 or not np.isfinite(std):
            one = _one("flat", "has no error bar" if moved else "never moved")
        elif partners and (
            (closest > COUPLED and std > 0.05 * value)
            or (lost and alone is not None and closest > 0.5)
        ):
            one = _one("coupled", f"trades off with {' and '.join(partners[:3])}")
            one |= {"partner": partners[0], "partners": partners}
        elif lost:
            one = _one("flat", "has an error as large as itself")
        else:
            one = _one("yes", "" if moved else "never moved")
        found[label] = one
    return found


def _one(kind: str, note: str) -> dict[str, Any]:
    return {"identifiable": kind, "note": note}
