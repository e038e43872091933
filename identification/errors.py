"""Error bars of a fit: misfit that is left widens them, and so does a valley that bends."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .fit import Fit
    from .problem import Model

BLIND = 1e-13
"""Information on a direction, relative to that on its single numbers, that counts as none [-]."""


MOST_LOOKS = 5
"""Places within a standard deviation of each other at which errors are looked at [-]."""

WIDER = 2.0
"""Factor by which errors elsewhere must be larger than those of the best place [-]."""

TOLD = 0.02
"""Relative error of a constant below which its valley is too short to bend [-]."""

STEPS = (1.0, 0.3, 0.1)
"""Steps to such a place, in standard deviations [-]: the longest that stays in the valley."""

WITHIN = 4.0
"""Rise of the sum of squares that is still within two standard deviations [-]."""


def with_errors(fit: Fit) -> Fit:
    """The fit with its covariance; where misfit is left, errors grow by its own spectrum.

    Where two constants trade off along a bent valley, one place may look sharp although the
    records do not object to its neighbours: errors are those of the widest place that is reached
    within a standard deviation at a time.

    Source: sandwich covariance, White 1982, doi:10.2307/1912526, with the smoothed spectrum of
    the whitened residual; tests/identification/test_fit.py, test_identifiable.py.
    """
    if len(fit.x) == 0:
        return fit
    covariance, x = _errors_at(fit, fit.x), fit.x
    unit = max([1.0, *(m.ratio for m in fit.misfits.values() if m.p_value < 1e-3)])
    for _ in range(MOST_LOOKS):
        found = _wider(fit, x, covariance, unit)
        if found is None:
            break
        x, covariance = found
    return replace(fit, covariance=covariance)


def _wider(
    fit: Fit, x: np.ndarray, covariance: np.ndarray, unit: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """A place a standard deviation away along the least known constant with far larger errors."""
    entries = fit.model.entries
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    kind = [entry.slot == "numbers" and not entry.nuisance for entry in entries]
    shares = np.where(kind, std / np.maximum(np.abs(x), 1e-300), 0.0)
    shares[shares > 1.0] = 0.0  # hardly known as it is
    index = int(np.argmax(shares))
    if shares[index] < TOLD:
        return None
    low = np.array([entry.low / entry.scale for entry in entries])
    high = np.array([entry.high / entry.scale for entry in entries])
    best = None
    for sign in (-1.0, 1.0):
        for share in STEPS:
            there = np.clip(x + sign * share * covariance[:, index] / std[index], low, high)
            if float(np.sum(fit.model.residual(there) ** 2)) - fit.cost > WITHIN * unit:
                continue  # so far a bent valley is left
            wide = _errors_at(fit, there)
            grown = float(np.sqrt(wide[index, index])) / std[index]
            if grown > (WIDER if best is None else best[0]):
                best = grown, there, wide
            break
    return best[1:] if best else None


def _errors_at(fit: Fit, x: np.ndarray) -> np.ndarray:
    """Covariance of the scaled unknowns if the fit lay at `x`, shape (d, d) [-]."""
    model = fit.model
    jacobian = model.jacobian(x)
    hessian = jacobian.T @ jacobian
    # a direction that no record tells gets a huge variance; a bare pseudo-inverse would say zero
    ridge = BLIND * np.diag(np.diag(hessian))
    inverse = np.linalg.pinv(hessian + ridge, rcond=1e-15, hermitian=True)
    residual = model.residual(x)
    middle, low = ridge.copy(), 0
    for prepared in model.problem.records:
        for sensor in prepared.sensors:
            high = low + len(sensor.values)
            part = jacobian[low:high]
            ratio = fit.misfits[prepared.name, sensor.channel.name]
            honest = ratio.p_value > 1e-3
            middle += part.T @ part if honest else _coloured(part, residual[low:high])
            low = high
    middle += jacobian[low:].T @ jacobian[low:]
    covariance = inverse @ middle @ inverse
    honest = all(misfit.p_value > 1e-3 for misfit in fit.misfits.values())
    if not honest and len(model.problem.records) > 2:
        covariance = _scattered(model, covariance, inverse, jacobian, residual)
    return covariance


def _scattered(
    model: Model,
    covariance: np.ndarray,
    inverse: np.ndarray,
    jacobian: np.ndarray,
    residual: np.ndarray,
) -> np.ndarray:
    """Errors of shared numbers grow to the scatter from record to record, where that is larger.

    Source: cluster-robust covariance, Liang and Zeger 1986, doi:10.1093/biomet/73.1.13.
    """
    scores, low = [], 0
    for prepared in model.problem.records:
        high = low + sum(len(sensor.values) for sensor in prepared.sensors)
        scores.append(jacobian[low:high].T @ residual[low:high])
        low = high
    count = len(scores)
    table = np.array(scores)
    spread = inverse @ (table.T @ table) @ inverse * count / (count - 1)
    shared = np.array([entry.record is None for entry in model.entries])
    ratio = np.diag(spread) / np.maximum(np.diag(covariance), 1e-300)
    grow = np.sqrt(np.where(shared, np.maximum(ratio, 1.0), 1.0))
    return covariance * grow[:, None] * grow[None, :]


def _coloured(jacobian: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Variance of the score when the whitened residual keeps a spectrum of its own."""
    count = len(white)
    power = np.abs(np.fft.rfft(white)) ** 2 / count
    width = max(3, int(np.sqrt(count) / 4)) | 1
    power = np.maximum(1.0, np.convolve(power, np.ones(width) / width, mode="same"))
    columns = np.fft.rfft(jacobian, axis=0)
    twice = np.full(len(power), 2.0)
    twice[0] = 1.0
    if count % 2 == 0:
        twice[-1] = 1.0
    weighted = columns * (power * twice)[:, None]
    return np.real(columns.conj().T @ weighted) / count
