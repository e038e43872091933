"""What simpler tools would say of a hidden effect: pick-by-BIC and regression on the residual."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..identification.fit import Fit

THRESHOLD = 0.1
"""Least share of a residual's size that a term of the regression must carry [-]; pysindy's own."""

FORCES = {
    "cubic_stiffness": lambda s, v, t: s**3,
    "asymmetric_stiffness": lambda s, v, t: np.abs(s),
    "quadratic_damping": lambda s, v, t: v * np.abs(v),
    "coulomb_friction": lambda s, v, t: np.sign(v),
    "stiffness_drift": lambda s, v, t: s * t,
}
"""Terms at each place by stretch, rate and the share of the record gone by."""

READINGS = {
    "sensor_gain": lambda y, t: y,
    "sensor_offset": lambda y, t: np.ones_like(y),
    "sensor_drift": lambda y, t: t,
    "sensor_rectified": lambda y, t: np.abs(y),
    "sensor_delay": lambda y, t: np.gradient(y),
}
"""Terms at each sensor by what it ought to read and the share of the record gone by."""


def white_bic(base: Fit | None) -> dict[str, Any] | None:
    """What picking by BIC says, where the noise is taken for white and nothing else is asked.

    Args:
        base: fit of the rig as it stands; None where there is none.

    Returns:
        ``law`` and ``place``, empty where none lowers BIC, and the fall of BIC [-]; None where it
        could not be computed.
    """
    from ..identification.extend import extend
    from ..identification.fit import solve
    from ..identification.noise import Noise
    from ..identification.screen import screen

    if base is None:
        return None
    try:
        white = {key: Noise((), float(np.std(base.residual_of(key)))) for key in base.keys}
        base = solve(replace(base.model, noises=white), base.x, 8)
        best = {"law": "", "place": "", "delta_bic": 0.0}
        for candidate in screen(base)[:3]:
            gain = base.cost - extend(base, candidate, 8).cost - float(np.log(base.count))
            if gain > best["delta_bic"]:
                name = {"law": candidate.law.name, "place": candidate.place}
                best = {**name, "delta_bic": float(gain)}
    except (ArithmeticError, AssertionError, LookupError, RuntimeError, ValueError):
        return None
    return best


def sparse_regression(base: Fit | None) -> dict[str, Any] | None:
    """What sparse regression on the residual of the rig's fit says, at each sensor by itself.

    As SINDy does it: sequentially thresholded least squares (Brunton, Proctor and Kutz 2016,
    doi:10.1073/pnas.1517384113) on candidate terms along the fitted motion.

    Args:
        base: fit of the rig as it stands; None where there is none.

    Returns:
        ``law`` and ``place`` of the largest term, empty where none is left, and its share of the
        residual's size [-]; None where it could not be computed, or pysindy is not installed.
    """
    if base is None:
        return None
    try:
        from pysindy import STLSQ

        best = {"law": "", "place": "", "share": 0.0}
        for names, terms, residual in _regressions(base):
            optimizer = STLSQ(threshold=THRESHOLD, alpha=1e-6)
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "Sparsity parameter")  # no term is an answer
                optimizer.fit(terms, residual[:, None])
            shares = np.abs(optimizer.coef_[0])
            largest = int(np.argmax(shares))
            if shares[largest] > best["share"]:
                place, law = names[largest]
                best = {"law": law, "place": place, "share": float(shares[largest])}
    except (ImportError, ArithmeticError, AssertionError, LookupError, RuntimeError, ValueError):
        return None
    return best


def _regressions(base: Fit) -> list[tuple[list[tuple[str, str]], np.ndarray, np.ndarray]]:
    """Of each channel: names of the terms, terms (n, m) and residual (n,), all of size one [-]."""
    from ..identification.motions import motions

    places = list(base.problem.mechanism.law_places())
    moved = motions(base.model, base.x, places)
    found: dict[str, list[tuple[dict[tuple[str, str], np.ndarray], np.ndarray]]] = {}
    for index, prepared in enumerate(base.problem.records):
        grid = prepared.step * np.arange(prepared.count)
        for sensor in prepared.sensors:
            name = sensor.channel.name
            residual = base.residual_of((prepared.name, name))
            t = sensor.times / grid[-1]
            terms = {
                (name, law): term(sensor.values - residual, t) for law, term in READINGS.items()
            }
            for place in places:
                count = len(moved[place]) // len(base.problem.records)
                s, v = (
                    np.mean([row[part] for row in moved[place][index * count :][:count]], axis=0)
                    for part in (0, 1)
                )
                s, v = (np.interp(sensor.times, grid, one) for one in (s, v))
                terms |= {(place, law): force(s, v, t) for law, force in FORCES.items()}
            found.setdefault(name, []).append((terms, residual))
    stacked = []
    for parts in found.values():
        columns = {
            name: np.concatenate([terms[name] for terms, _ in parts]) for name in parts[0][0]
        }
        sizes = {name: float(np.sqrt(np.mean(column**2))) for name, column in columns.items()}
        kept = [name for name, size in sizes.items() if size > 0.0]
        residual = np.concatenate([one for _, one in parts])
        terms = np.column_stack([columns[name] / sizes[name] for name in kept])
        stacked.append((kept, terms, residual / float(np.sqrt(np.mean(residual**2)))))
    return stacked
