"""Error bars of a fit: misfit that is left widens them, and so does a valley that bends."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .noise import Misfit
from .problem import Key, Model
from .uneven import Uneven

BLIND = 1e-13
"""Information on a direction, relative to that on its single numbers, that counts as none [-]."""


MOST_LOOKS = 5
"""Places within a standard deviation of each other at which errors are looked at [-]."""

WIDER = 1.3
"""Factor by which errors elsewhere must be larger than those of the best place [-]."""

TOLD = 0.02
"""Relative error of a constant below which its valley is too short to bend [-]."""

SHOWN = 1e-3
"""Chance of a channel's misfit under its noise below which it widens errors [-]."""

STEPS = (1.0, 0.3, 0.1)
"""Steps to such a place, in standard deviations [-]: the longest that stays in the valley."""

WITHIN = 4.0
"""Rise of the sum of squares that is still within two standard deviations [-]."""


def covariance_of(
    model: Model, best: np.ndarray, cost: float, misfits: Mapping[Key, Misfit]
) -> np.ndarray:
    """Covariance of a fit's unknowns; where misfit is left, errors grow by its own spectrum.

    Noise that is louder where the motion is larger, and where it tells most, makes errors larger
    than its mean size does: they grow to what the squared residuals themselves say.

    Where two constants trade off along a bent valley, one place may look sharp although the
    records do not object to its neighbours: errors are those of the widest place that is reached
    within a standard deviation at a time.

    What an instrument's tolerance leaves open is the same in all its records, and does not average
    out over them.

    Args:
        model: what was fitted.
        best: scaled unknowns, shape (d,) [-].
        cost: sum of squares there [-].
        misfits: of each (record, channel).

    Returns:
        Shape (d, d) [-].

    Source: sandwich covariance, White 1982, doi:10.2307/1912526, with the smoothed spectrum of
    the whitened residual; for uneven noise White 1980, doi:10.2307/1912934;
    tests/identification/test_fit.py, test_identifiable.py, test_errors.py.
    """
    x, covariance = best, covariance_at(model, best, misfits)
    unit = max([1.0, *(m.ratio for m in misfits.values() if m.p_value < SHOWN)])
    for _ in range(MOST_LOOKS):
        found = _wider(model, x, covariance, cost + WITHIN * unit, misfits)
        if found is None:
            break
        x, covariance = found
    return covariance


def _wider(
    model: Model,
    x: np.ndarray,
    covariance: np.ndarray,
    most: float,
    misfits: Mapping[Key, Misfit],
) -> tuple[np.ndarray, np.ndarray] | None:
    """A place a standard deviation away along the least known constant with far larger errors."""
    entries = model.entries
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
            if not float(np.sum(model.residual(there) ** 2)) <= most:
                continue  # so far a bent valley is left
            wide = covariance_at(model, there, misfits)
            grown = float(np.sqrt(wide[index, index])) / std[index]
            if grown > (WIDER if best is None else best[0]):
                best = grown, there, wide
            break
    return best[1:] if best else None


def covariance_at(model: Model, x: np.ndarray, misfits: Mapping[Key, Misfit]) -> np.ndarray:
    """Covariance of the scaled unknowns if the fit lay at `x`, shape (d, d) [-]."""
    jacobian = model.jacobian(x)
    hessian = jacobian.T @ jacobian
    # a direction that no record tells gets a huge variance; a bare pseudo-inverse would say zero
    ridge = BLIND * np.diag(np.diag(hessian))
    inverse = np.linalg.pinv(hessian + ridge, rcond=1e-15, hermitian=True)
    residual = model.residual(x)
    middle, uneven, low = ridge.copy(), np.zeros_like(ridge), 0
    for prepared in model.problem.records:
        for sensor in prepared.sensors:
            high = low + len(sensor.values)
            part, key = jacobian[low:high], (prepared.name, sensor.channel.name)
            if misfits[key].p_value > SHOWN:
                middle += part.T @ part
                if not isinstance(model.noises[key], Uneven):  # such a law knows where it is loud
                    uneven += part.T @ (part * (residual[low:high, None] ** 2 - 1.0))
            else:
                middle += _coloured(part, residual[low:high])
            low = high
    priors = jacobian[low:]
    middle += priors.T @ priors
    covariance = inverse @ middle @ inverse
    covariance = _grown(covariance, np.diag(inverse @ uneven @ inverse))
    more = inverse @ priors.T @ _shared_errors(model) @ priors @ inverse
    covariance = _grown(covariance, np.diag(more))
    honest = all(misfit.p_value > SHOWN for misfit in misfits.values())
    if not honest and len(model.problem.records) > 2:
        covariance = _scattered(model, covariance, inverse, jacobian, residual)
    return covariance


KEPT = ("gain", "delay", "offset")
"""Errors that an instrument keeps from record to record."""


def _shared_errors(model: Model) -> np.ndarray:
    """Covariance of what pulls two priors off their centres, less the identity, in their units [-].

    Every record has its own gain, delay and zero of a channel, each with a prior. One instrument
    errs alike in all of them: its error does not average out over records, and the prior of each
    record alone would say that it does.
    """
    entries = [entry for entry in model.entries if np.isfinite(entry.prior)]
    names = [entry.name if entry.slot in KEPT and entry.record else "" for entry in entries]
    alike = np.array([[a == b != "" for b in names] for a in names], dtype=float)
    np.fill_diagonal(alike, 0.0)
    return alike.reshape(len(entries), len(entries))


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
    more = np.where(shared, np.diag(spread) - np.diag(covariance), 0.0)
    return _grown(covariance, more)


def _grown(covariance: np.ndarray, more: np.ndarray) -> np.ndarray:
    """A covariance whose variances are larger by `more`, shape (d,), where that is positive."""
    known = np.maximum(np.diag(covariance), 1e-300)
    grow = np.sqrt(1.0 + np.maximum(more, 0.0) / known)
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
