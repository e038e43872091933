"""A frequency-dependent silicone: a Zener or Prony law fitted to a sweep, no richer than needed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import least_squares, nnls

MOST_BRANCHES = 3
"""Most relaxing branches that are tried [-]."""

FLOOR = 0.002
"""Smallest error that a measured modulus is believed to have, as a share of it [-]."""

FEWEST_FREQUENCIES = 3
"""Fewest different frequencies to which a law is fitted [-]."""

REACH = 30.0
"""How far beyond the frequencies measured a relaxation may lie, as a factor [-]."""

MISFIT = 4.0
"""Reduced chi-square above which the best law is said to miss [-]."""

_NAMES = {0: "elastic", 1: "zener"}


@dataclass(frozen=True, eq=False)
class Law:
    """``E*(omega) = E_0 + sum E_i i omega tau_i / (1 + i omega tau_i)``.

    Attributes:
        rest: E_0, what is left for ever [Pa, or N/m where the sample's size is unknown].
        branches: pairs of E_i [unit of `rest`] and tau_i [s], slowest first.
        std: standard deviations in the order rest, E_1, tau_1, E_2 ... [their units].
        chi2: reduced chi-square [-].
        bic: Bayesian information criterion by number of branches tried [-].
        low: lowest frequency measured [Hz].
        high: highest frequency measured [Hz].
        covariance: of the logarithms of the constants, in the order of `std` [-].
    """

    rest: float
    branches: tuple[tuple[float, float], ...]
    std: np.ndarray
    chi2: float
    bic: dict[int, float]
    low: float
    high: float
    covariance: np.ndarray = field(repr=False)

    @property
    def name(self) -> str:
        """``elastic``, ``zener`` or ``prony``."""
        return _NAMES.get(len(self.branches), "prony")

    def modulus(self, frequency: float | np.ndarray) -> np.ndarray:
        """Complex modulus at frequencies [Hz], in the unit of `rest`."""
        return _modulus(_logs(self.rest, self.branches), np.atleast_1d(frequency))

    def modulus_std(self, frequency: float) -> tuple[float, float]:
        """Standard deviations of storage and loss at a frequency [Hz], in the unit of `rest`."""
        at, logs = np.atleast_1d(float(frequency)), _logs(self.rest, self.branches)
        moved = np.eye(len(logs)) * 1e-5
        rows = [(_modulus(logs + d, at) - _modulus(logs - d, at))[0] / 2e-5 for d in moved]
        sides = np.stack([np.real(rows), np.imag(rows)])
        spread = np.sqrt(np.maximum(np.einsum("pi,ij,pj->p", sides, self.covariance, sides), 0.0))
        return float(spread[0]), float(spread[1])


def fit_law(
    frequencies: np.ndarray, moduli: np.ndarray, std: np.ndarray, most: int = MOST_BRANCHES
) -> Law:
    """Fits laws of 0 to `most` branches and keeps the one with the smallest BIC.

    Args:
        frequencies: shape (n,) [Hz].
        moduli: complex, shape (n,) [Pa or N/m].
        std: of storage and loss, shape (n, 2) [unit of the moduli]; at least `FLOOR` is taken.
        most: most branches to try [-].

    Returns:
        The law.

    Raises:
        ValueError: for fewer than `FEWEST_FREQUENCIES` different frequencies.

    Source: generalized Maxwell model; Schwarz's criterion with known errors; tests of recovery in
    tests/identification/test_coupon.py.
    """
    if len(np.unique(np.round(frequencies, 3))) < FEWEST_FREQUENCIES:
        raise ValueError(
            f"frequencies: expected at least {FEWEST_FREQUENCIES} different ones, found "
            f"{len(np.unique(np.round(frequencies, 3)))}. Mend: test at more of them."
        )
    data = _parts(moduli)
    errors = np.maximum(np.concatenate([std[:, 0], std[:, 1]]), FLOOR * np.tile(abs(moduli), 2))
    found, bic = {}, {}
    for count in range(most + 1):
        n_free = 1 + 2 * count
        if n_free >= len(data):
            break
        found[count] = _fit(count, frequencies, data, errors)
        bic[count] = 2 * found[count].cost + n_free * np.log(len(data))
    best = min(bic, key=lambda count: bic[count])
    logs, jacobian = found[best].x, found[best].jac
    covariance = np.linalg.pinv(jacobian.T @ jacobian)
    chi2 = 2 * found[best].cost / (len(data) - len(logs))
    covariance = covariance * max(chi2, 1.0)
    values = np.exp(logs)
    order = np.argsort(-values[2::2])
    branches = tuple((float(values[1 + 2 * i]), float(values[2 + 2 * i])) for i in order)
    places = [0, *(place for i in order for place in (1 + 2 * i, 2 + 2 * i))]
    covariance = covariance[np.ix_(places, places)]
    spread = values[places] * np.sqrt(np.diag(covariance))
    low, high = float(frequencies.min()), float(frequencies.max())
    return Law(float(values[0]), branches, spread, float(chi2), bic, low, high, covariance)


def _parts(values: np.ndarray) -> np.ndarray:
    """Real parts over imaginary ones."""
    return np.concatenate([np.real(values), np.imag(values)])


def _logs(rest: float, branches: tuple[tuple[float, float], ...]) -> np.ndarray:
    return np.log(np.array([rest, *(value for branch in branches for value in branch)]))


def _modulus(logs: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    values = np.exp(logs)
    turns = 2j * np.pi * frequencies[:, None] * values[None, 2::2]
    return values[0] + np.sum(values[None, 1::2] * turns / (1 + turns), axis=1)


def _fit(count: int, frequencies: np.ndarray, data: np.ndarray, errors: np.ndarray) -> Any:
    """The best of several starts: relaxation times spread out, moduli by least squares."""
    slow = REACH / (2 * np.pi * frequencies.min())
    quick = 1 / (2 * np.pi * frequencies.max() * REACH)
    size = float(np.max(np.abs(data)))

    def rest(logs: np.ndarray) -> np.ndarray:
        told = _modulus(logs, frequencies)
        return (_parts(told) - data) / errors

    low = np.log([1e-6 * size, *([1e-6 * size, quick] * count)])
    high = np.log([10 * size, *([1e3 * size, slow] * count)])
    best = None
    for spread in (1.0, 0.6, 0.3) if count else (1.0,):
        middle, half = np.log(slow * quick) / 2, spread * np.log(slow / quick) / 2
        times = np.exp(middle + half * (2 * np.arange(1, count + 1) / (count + 1) - 1))
        turns = 2j * np.pi * frequencies[:, None] * times[None]
        columns = np.concatenate([np.ones((len(frequencies), 1)), turns / (1 + turns)], axis=1)
        stacked = _parts(columns) / errors[:, None]
        moduli = np.maximum(nnls(stacked, data / errors)[0], 1e-3 * size)
        pairs = [value for pair in zip(moduli[1:], times, strict=True) for value in pair]
        start = np.clip(np.log([moduli[0], *pairs]), low + 1e-6, high - 1e-6)
        found = least_squares(rest, start, bounds=(low, high), xtol=1e-12, ftol=1e-12)
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    return best
