"""The noise law of a channel, chosen by the data before anything is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import chi2 as chi2_distribution

LAWS = ("white", "ar1", "ar2")
MEMORY_LIMITS = (0.98, 0.5)
"""Largest partial autocorrelations that still count as noise of a sensor [-]; a sharper resonance
or a smoother drift is an error of the model."""


@dataclass(frozen=True)
class Noise:
    """Autoregressive noise: ``e_t = (r_t - sum phi_i r_(t-i)) / std`` is white.

    Attributes:
        coefficients: phi, of length 0 (white), 1 or 2 [-].
        std: standard deviation of the innovations [channel's unit].
    """

    coefficients: tuple[float, ...]
    std: float

    @property
    def law(self) -> str:
        """white, ar1 or ar2."""
        return LAWS[len(self.coefficients)]

    @property
    def marginal_std(self) -> float:
        """Standard deviation of the noise itself, memory included [channel's unit]."""
        phi = self.coefficients
        if not phi:
            return self.std
        if len(phi) == 1:
            return self.std / np.sqrt(1 - phi[0] ** 2)
        a, b = phi
        return self.std * np.sqrt((1 - b) / ((1 + b) * ((1 - b) ** 2 - a**2)))

    def whiten(self, residual: np.ndarray) -> np.ndarray:
        """Innovations along the first axis, in units of their standard deviation [-].

        The first samples, whose past is unknown, are divided by the marginal deviation.
        """
        white = residual.copy()
        for lag, phi in enumerate(self.coefficients, 1):
            white[lag:] -= phi * residual[:-lag]
        white /= self.std
        order = len(self.coefficients)
        if order:
            white[:order] = residual[:order] / self.marginal_std
        return white

    def spectrum(self, frequency: np.ndarray) -> np.ndarray:
        """Density per bin at `frequency` in cycles a sample, relative to white of unit std."""
        turn = np.exp(-2j * np.pi * frequency)
        response = np.ones_like(turn)
        for lag, phi in enumerate(self.coefficients, 1):
            response -= phi * turn**lag
        return self.std**2 / np.abs(response) ** 2


@dataclass(frozen=True, eq=False)
class Trust:
    """Weights for finding a start state: the sensor's noise, plus a share of the motion so far.

    A wrong model is wrong in proportion to how far things have moved; the first samples tell the
    start state whatever the model.

    Attributes:
        std: shape (t,) [channel's unit].
    """

    std: np.ndarray

    @property
    def marginal_std(self) -> float:
        """Median of the weights' deviations [channel's unit]."""
        return float(np.median(self.std))

    def whiten(self, residual: np.ndarray) -> np.ndarray:
        """Residual along the first axis in units of `std` [-]."""
        return residual / self.std.reshape((-1,) + (1,) * (residual.ndim - 1))


SHARE = 0.1


def trust_of(values: np.ndarray, count: int, moving: bool = False) -> Trust:
    """Weights of a channel, shape (t,), out of its first `count` samples [channel's unit].

    Args:
        values: its samples, shape (t,).
        count: how many of them tell a start state [-].
        moving: whether it has moved before the first of them, as behind a blow that is told.

    Source: tests/identification/test_noise.py.
    """
    known = values[: max(count, 8)]
    steps = np.diff(np.unique(values))
    # a coarse instrument that has not yet moved shows no noise at all
    coarse = float(np.min(steps)) / np.sqrt(12.0) if len(steps) else 0.0
    noise = max(float(np.std(np.diff(known, 3)) / np.sqrt(20.0)), coarse)
    rest = np.median(values) if moving else values[0]
    moved = np.maximum.accumulate(np.abs(values - rest))
    return Trust(noise + SHARE * moved + 1e-12 * np.max(np.abs(known)) + 1e-300)


@dataclass(frozen=True)
class Misfit:
    """How far a residual is from its noise, absolutely.

    Attributes:
        ratio: power of the residual over that of the noise, where the model moves and where a
            tone stands out of the noise [-].
        p_value: chance of such a ratio under the noise law alone [-].
        bins: number of frequencies that it rests on [-].
    """

    ratio: float
    p_value: float
    bins: int


def periodogram(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tapered periodogram, normalized so that unit white noise has mean 1.

    Args:
        values: shape (t,).

    Returns:
        frequency [cycles a sample] and power, without DC and Nyquist.
    """
    count = len(values)
    taper = np.hanning(count + 2)[1:-1]
    power = np.abs(np.fft.rfft(values * taper)) ** 2 / np.sum(taper**2)
    frequency = np.fft.rfftfreq(count)
    return frequency[2:-1], power[2:-1]


LOST = 0.1
"""A residual with more than this share of the measured variance is no noise [-]."""


def known_noise(residual: np.ndarray, std: float) -> tuple[Noise, Misfit]:
    """Noise of a stated size, whatever its color, and the misfit against it.

    Args:
        residual: measured minus simulated, shape (t,) [channel's unit].
        std: what the sidecar says of the channel's noise [channel's unit].

    Returns:
        The law with the residual's own color but at most the stated size, and the misfit.
    """
    ratio = float(np.mean(residual**2)) / std**2
    color = colour_of(residual)
    size = std * min(1.0, float(np.sqrt(ratio)))
    noise = Noise(color.coefficients, color.std / color.marginal_std * size)
    bins = len(residual) // 2
    p_value = float(chi2_distribution.sf(len(residual) * ratio, len(residual)))
    return noise, Misfit(ratio, p_value, bins)


def choose_noise(residual: np.ndarray, predicted: np.ndarray) -> tuple[Noise, Misfit]:
    """Noise law from where the model does not move, tested where it does.

    A wrong model leaves its errors where it moves. There the residual is not asked what the
    noise is, unless the noise found elsewhere explains it.

    Args:
        residual: measured minus simulated, shape (t,) [channel's unit].
        predicted: simulated, shape (t,) [channel's unit].

    Returns:
        The law with the smallest BIC among white, AR(1) and AR(2), and the absolute misfit.

    Source: Whittle 1953; tests/identification/test_noise.py.
    """
    frequency, power = periodogram(residual)
    if not len(power):  # too few to have a spectrum
        return Noise((), float(np.sqrt(np.mean(residual**2) + 1e-300))), Misfit(1.0, 1.0, 0)
    signal = _smooth(periodogram(predicted - np.mean(predicted))[1])
    moves = signal > 3.0 * _smooth(power)
    moves = _around(moves, 5) > 0.5
    measured = float(np.var(predicted + residual))
    if not moves.any() and float(np.var(residual)) > LOST * measured:
        # the simulation is lost: noise is what the quieter half of the frequencies shows
        moves = _smooth(power) > np.median(_smooth(power))
    quiet = ~moves
    if quiet.sum() < max(24, 0.15 * len(power)):
        noise = _best(frequency, power, np.ones_like(quiet))
        return noise, _misfit(power / noise.spectrum(frequency), np.ones_like(quiet))
    noise = _best(frequency, power, quiet)
    misfit = _misfit(power / noise.spectrum(frequency), moves)
    whole = _best(frequency, power, np.ones_like(quiet))
    everywhere = _misfit(power / whole.spectrum(frequency), moves)
    explained = everywhere.p_value > 1e-3 and _one_law(frequency, power, quiet, noise, whole)
    if misfit.bins and (misfit.p_value > 1e-3 or explained):
        noise, misfit = whole, everywhere
    return noise, _with_tones(misfit, power / noise.spectrum(frequency), moves)


SAME_LAW = 16.0
"""Fall of twice the log likelihood of the quiet frequencies by which their own law may be better
than one law of all frequencies, where chance alone can do it [-]: three numbers, 0.1 %."""


def _one_law(
    frequency: np.ndarray, power: np.ndarray, quiet: np.ndarray, own: Noise, whole: Noise
) -> bool:
    """Whether the law of all frequencies describes the quiet ones as well as their own does.

    Few quiet frequencies say little of a law's slope; carried on to the others it may be far off.
    """
    laws = (law.spectrum(frequency[quiet]) for law in (whole, own))
    costs = [2 * float(np.sum(np.log(law) + power[quiet] / law)) for law in laws]
    return costs[0] - costs[1] < SAME_LAW * TAPERED


def colour_of(residual: np.ndarray) -> Noise:
    """AR(1) law of a whole residual, shape (t,), errors of the model included [channel's unit].

    Generalized least squares with it spreads such errors evenly over frequency instead of
    chasing their slow drift; Aitken 1935, doi:10.1017/S0370164600014346.
    """
    frequency, power = periodogram(residual)
    return _whittle(frequency, power, 1)[1]


def _smooth(power: np.ndarray) -> np.ndarray:
    return _around(power, 9) / 9


def _around(values: np.ndarray, width: int) -> np.ndarray:
    """Sums over so many neighbors, of as many values as there are, however few (k,)."""
    whole = np.convolve(values, np.ones(width), mode="full")
    return whole[width // 2 : width // 2 + len(values)]


TONE = 1e-6
"""Chance of the loudest of all frequencies under the noise, below which it is a tone [-]."""


def _with_tones(misfit: Misfit, ratio: np.ndarray, where: np.ndarray) -> Misfit:
    """The misfit with what stands out of the noise where the model does not move."""
    loudest = float(np.max(ratio))
    chance = min(1.0, len(ratio) * float(np.exp(-min(loudest, 700.0))))
    if chance > TONE:
        return misfit
    tones = _around(ratio > np.log(len(ratio) / TONE), 3) > 0.5
    whole = _misfit(ratio, where | tones)
    return Misfit(whole.ratio, min(misfit.p_value, chance), whole.bins)


TAPERED = 1.9
"""Neighboring frequencies that a Hann taper makes one [-]."""


def _misfit(ratio: np.ndarray, where: np.ndarray) -> Misfit:
    bins = int(np.sum(where))
    if not bins:
        return Misfit(1.0, 1.0, 0)
    mean = float(np.mean(ratio[where]))
    dof = 2 * bins / TAPERED
    return Misfit(mean, float(chi2_distribution.sf(dof * mean, dof)), bins)


def _best(frequency: np.ndarray, power: np.ndarray, use: np.ndarray) -> Noise:
    """Smallest BIC over the orders; bins that stand out by far are left out of the fit."""
    keep = use.astype(bool).copy()
    noise = Noise((), float(np.sqrt(np.median(power[keep]) / np.log(2) + 1e-300)))
    for _ in range(4):
        fits = [_whittle(frequency[keep], power[keep], order) for order in (0, 1, 2)]
        costs = [cost + order * np.log(keep.sum()) for order, (cost, _) in enumerate(fits)]
        noise = fits[int(np.argmin(costs))][1]
        relative = power / noise.spectrum(frequency)
        loud = relative > 12.0
        loud = loud | (_around(relative > 40.0, 5) > 0.5)
        new = use.astype(bool) & ~loud
        if new.sum() < 24 or np.array_equal(new, keep):
            break
        keep = new
    return noise


GROUPS = 400
"""A periodogram is pooled into this many groups of neighbors before its law is sought [-]."""


def _pooled(frequency: np.ndarray, power: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of frequency and power over groups of neighbors, and the size of each group."""
    if len(power) <= GROUPS:
        return frequency, power, np.ones(len(power))
    starts = np.linspace(0, len(power), GROUPS + 1).astype(int)[:-1]
    sizes = np.diff(np.append(starts, len(power))).astype(float)
    pooled = np.add.reduceat(power, starts) / sizes
    return np.add.reduceat(frequency, starts) / sizes, pooled, sizes


def _whittle(frequency: np.ndarray, power: np.ndarray, order: int) -> tuple[float, Noise]:
    """Twice the negative log Whittle likelihood and its noise, for one order."""
    frequency, power, sizes = _pooled(frequency, power + 1e-300)
    count, turn = float(sizes.sum()), 2 * np.pi * frequency
    waves = np.array([np.ones_like(turn), np.cos(turn), np.cos(2 * turn)])
    loud = np.sum(waves * (sizes * power), axis=1)

    def cost(free: np.ndarray) -> tuple[float, np.ndarray]:
        parts, slopes = _inverse_parts(_limited(free))
        inverse = parts[0] + parts[1] * waves[1] + parts[2] * waves[2]
        level = float(parts @ loud)
        told = count * np.log(level / count) - np.sum(sizes * np.log(inverse))
        by_parts = count / level * loud - np.sum(waves * (sizes / inverse), axis=1)
        return float(told), (by_parts @ slopes) * _limited_slopes(free)

    best, partial = cost(np.zeros(0))[0], np.zeros(0)
    if order:
        starts = (np.zeros(order), np.eye(order)[0] * 1.2)
        runs = [minimize(cost, start, jac=True, method="L-BFGS-B") for start in starts]
        run = min(runs, key=lambda r: r.fun)
        best, partial = float(run.fun), _limited(run.x)
    std = float(np.sqrt(_inverse_parts(partial)[0] @ loud / count))
    return best, Noise(coefficients_of(partial), std)


def _inverse_parts(partial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The inverse of an autoregressive law's density, for unit innovations, as a sum of waves.

    Args:
        partial: partial autocorrelations, shape (order,) [-].

    Returns:
        What 1, cos(w) and cos(2 w) are multiplied by, shape (3,), and its derivatives by
        `partial`, shape (3, order) [-].

    Source: |1 - a z - b z^2|^2 with a = p (1 - q), b = q; Box and Jenkins 1976, section 3.2.
    """
    p, q = (*partial, 0.0, 0.0)[:2]
    a, kept = p * (1 - q), 1 - q
    parts = np.array([1 + a * a + q * q, -2 * a * kept, -2 * q])
    by_a = np.array([2 * a, -2 * kept, 0.0])
    slopes = np.array([kept * by_a, np.array([2 * q, 2 * a, -2.0]) - p * by_a])
    return parts, slopes[: len(partial)].T


def _limited(free: np.ndarray) -> np.ndarray:
    return np.array(MEMORY_LIMITS[: len(free)]) * np.tanh(free)


def _limited_slopes(free: np.ndarray) -> np.ndarray:
    return np.array(MEMORY_LIMITS[: len(free)]) * (1 - np.tanh(free) ** 2)


def coefficients_of(partial: Sequence[float] | np.ndarray) -> tuple[float, ...]:
    """Coefficients [-] from partial autocorrelations (Durbin and Levinson): always stationary."""
    if len(partial) == 0:
        return ()
    if len(partial) == 1:
        return (float(partial[0]),)
    first, second = partial
    return (float(first * (1 - second)), float(second))


def partials(coefficients: tuple[float, ...]) -> tuple[float, ...]:
    """Partial autocorrelations [-] of an autoregressive law of order 0, 1 or 2.

    Source: the recursion of Durbin and Levinson, backwards; tests/identification/test_sample.py.
    """
    if len(coefficients) == 2:
        return coefficients[0] / (1 - coefficients[1]), coefficients[1]
    return tuple(coefficients)


def ljung_box(white: np.ndarray, lags: int = 20) -> float:
    """p-value of the hypothesis that `white`, shape (t,), has no autocorrelation [-].

    Source: Ljung and Box 1978, doi:10.1093/biomet/65.2.297.
    """
    count = len(white)
    lags = min(lags, count // 5)
    centered = white - np.mean(white)
    power = float(centered @ centered)
    if lags < 1 or power <= 0:
        return 1.0
    correlation = np.array([centered[k:] @ centered[:-k] for k in range(1, lags + 1)]) / power
    statistic = count * (count + 2) * np.sum(correlation**2 / (count - np.arange(1, lags + 1)))
    return float(chi2_distribution.sf(statistic, lags))
