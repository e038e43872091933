"""Noise that grows with the motion or has heavy tails: when a channel asks for it, and how much."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import gammaln

from .noise import MEMORY_LIMITS, Noise, coefficients_of, partials

GROWTH_LIMITS = (0.05, 30.0)
"""Noise that comes with the largest motion, over that at rest, from where it shows and up to where
the noise at rest would be too little to be believed [-]."""

TAIL_LIMITS = (1e-3, 0.4)
"""Inverse of Student's degrees of freedom: from what no record tells from the normal law, up to
where a standard deviation hardly exists [-]."""

WORTH = 6.0
"""Fall of BIC that each step away from even, normal noise must bring [-]: strong evidence after
Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572."""

FEWEST = 100
"""Samples below which a channel is not asked [-]."""

FORMS = ((False, False), (True, False), (False, True), (True, True))
"""Whether the noise grows, and whether its tails are heavy."""


@dataclass(frozen=True, eq=False)
class Uneven(Noise):
    """Noise whose samples are not all equally sure.

    ``e_t = (r_t / g_t - sum phi_i r_(t-i) / g_(t-i)) / std`` is white, where
    ``g_t^2 = 1 + (growth a_t)^2`` and e has a normal law, or Student's of unit scale.

    Attributes:
        growth: noise that comes with the largest motion over that at rest; 0 for none [-].
        tail: inverse of the degrees of freedom; 0 for the normal law [-].
        motion: a, departure of the reading from its median over the largest, shape (t,) [-].
        trust: root of the weight of each innovation in least squares, shape (t,) [-].

    Source: Rocke and Lorenzato 1995, doi:10.1080/00401706.1995.10484302 (two parts of noise that
    add up); Lange, Little and Taylor 1989, doi:10.1080/01621459.1989.10478852 (weights).
    """

    growth: float
    tail: float
    motion: np.ndarray
    trust: np.ndarray

    @property
    def law(self) -> str:
        """The words of the parts that it is made of, joined by plus signs."""
        parts = [super().law] if self.coefficients else []
        parts += ["growing"] if self.growth else []
        parts += ["student_t"] if self.tail else []
        return " + ".join(parts) or "white"

    @property
    def sizes(self) -> np.ndarray:
        """Deviation of each sample over that at rest, shape (t,) [-]."""
        return np.sqrt(1.0 + (self.growth * self.motion) ** 2)

    @property
    def even(self) -> Noise:
        """Normal noise of the same memory, as it is at rest [channel's unit]."""
        return Noise(self.coefficients, self.std)

    @property
    def marginal_std(self) -> float:
        """Standard deviation of the noise over the whole record [channel's unit]."""
        return float(self.even.marginal_std * np.sqrt(self._power))

    @property
    def _power(self) -> float:
        return float(np.mean(self.sizes**2)) / (1.0 - 2.0 * self.tail)

    def innovations(self, residual: np.ndarray) -> np.ndarray:
        """What is new in each sample of a residual, e, along the first axis [-]."""
        sizes = self.sizes.reshape((-1,) + (1,) * (residual.ndim - 1))
        return self.even.whiten(residual / sizes)

    def whiten(self, residual: np.ndarray) -> np.ndarray:
        """Innovations along the first axis as least squares weighs them [-]."""
        trust = self.trust.reshape((-1,) + (1,) * (residual.ndim - 1))
        return trust * self.innovations(residual)

    def spectrum(self, frequency: np.ndarray) -> np.ndarray:
        """Density per bin at `frequency` in cycles a sample [channel's unit squared]."""
        return self.even.spectrum(frequency) * self._power

    def weighed(self, residual: np.ndarray) -> Uneven:
        """The same law with the weights that a residual [channel's unit] asks for."""
        square = self.innovations(residual) ** 2
        return replace(self, trust=np.sqrt((1.0 + self.tail) / (1.0 + self.tail * square)))

    @property
    def expected(self) -> Uneven:
        """The same law weighed as its Fisher information has it: errors of a fit follow from it."""
        level = np.sqrt((1.0 + self.tail) / (1.0 + 3.0 * self.tail))
        return replace(self, trust=np.full(len(self.motion), level))


def motion_of(predicted: np.ndarray) -> np.ndarray:
    """Departure of a simulated reading [channel's unit] from its median over the largest [-]."""
    away = np.abs(predicted - np.median(predicted))
    return away / max(float(np.max(away)), 1e-300)


def choose_law(noise: Noise, residual: np.ndarray, predicted: np.ndarray) -> Noise:
    """Whether noise is even and normal, or grows, or has heavy tails, as its residual bears out.

    Args:
        noise: of the chosen memory, even and normal [channel's unit].
        residual: measured minus simulated, shape (t,) [channel's unit].
        predicted: simulated, shape (t,) [channel's unit].

    Returns:
        `noise` itself, or an `Uneven` of the same memory whose BIC is lower by `WORTH` for each of
        its two parts.

    Source: Schwarz 1978, doi:10.1214/aos/1176344136; tests/identification/test_uneven.py.
    """
    if len(residual) < FEWEST or np.ptp(predicted) == 0.0 or np.ptp(residual) == 0.0:
        return noise
    finest = _resolution(predicted + residual)
    motion, best, least = motion_of(predicted), noise, np.inf
    for form in FORMS:
        found = _likeliest(noise, residual, motion, form, finest)
        price = sum(form) * (np.log(len(residual)) + WORTH)
        cost = _cost(found, residual) + price
        if cost < least:
            least, best = cost, found if any(form) else noise
    return best


@dataclass(frozen=True, eq=False)
class Told:
    """What a channel tells of a fit's unknowns, and what else is known of them.

    Attributes:
        columns: derivative of its reading by the unknowns that move it, shape (t, d)
            [channel's unit].
        rest: information on these from all else, its other unknowns solved for, shape (d, d) [-].
    """

    columns: np.ndarray
    rest: np.ndarray

    def spent(self, noise: Uneven) -> float:
        """Log of the information on the unknowns under a noise law [-].

        What of the noise the unknowns follow is missing from a residual; this stands for it.
        """
        white = noise.expected.whiten(self.columns)
        sign, log = np.linalg.slogdet(self.rest + white.T @ white)
        return float(log) if sign > 0 else np.inf


def likeliest_law(
    noise: Noise, residual: np.ndarray, values: np.ndarray, told: Told | None = None
) -> Noise:
    """The law of the same parts under which a residual is likeliest.

    Args:
        noise: of these parts [channel's unit].
        residual: shape (t,) [channel's unit].
        values: as measured, shape (t,) [channel's unit].
        told: counts what the fit's unknowns have followed of the noise; None where that is done.

    Returns:
        It, with weights of that residual where it is uneven.

    Source: Patterson and Thompson 1971, doi:10.1093/biomet/58.3.545 (restricted likelihood);
    tests/identification/test_coverage.py.
    """
    uneven = isinstance(noise, Uneven)
    form = (noise.growth > 0, noise.tail > 0) if uneven else (False, False)
    motion = noise.motion if uneven else np.zeros(len(residual))
    found = _likeliest(noise, residual, motion, form, _resolution(values), told)
    return found if uneven else found.even


def _resolution(values: np.ndarray) -> float:
    """Least deviation that readings of so coarse an instrument can have."""
    steps = np.diff(np.unique(values))
    return 0.0 if len(steps) > 0.5 * len(values) else float(np.min(steps, initial=np.inf)) / 12**0.5


def _cost(noise: Uneven, residual: np.ndarray) -> float:
    """Twice the negative log likelihood of a residual, but for a constant."""
    e, tail = noise.innovations(residual), noise.tail
    first = np.log(noise.even.marginal_std / noise.std) * len(noise.coefficients)
    total = len(e) * np.log(noise.std) + first + float(np.sum(np.log(noise.sizes)))
    if not tail:
        return float(2 * total + e @ e)
    half = 0.5 / tail
    level = gammaln(half + 0.5) - gammaln(half) + 0.5 * np.log(2 * tail)
    return float(2 * (total - len(e) * level) + (1 / tail + 1) * np.sum(np.log1p(tail * e**2)))


def _likeliest(
    noise: Noise,
    residual: np.ndarray,
    motion: np.ndarray,
    form: tuple[bool, bool],
    finest: float,
    told: Told | None = None,
) -> Uneven:
    """The likeliest law of the memory's order and of that form, no finer than the instrument."""
    partial = partials(noise.coefficients)
    limits = MEMORY_LIMITS[: len(partial)]
    typical = max(float(np.median(np.abs(noise.whiten(residual)))) * noise.std, finest, 1e-300)
    ends = [(np.log(max(finest, 1e-4 * typical)), np.log(1e3 * typical))]
    ends += [(-limit, limit) for limit in limits]
    ends += [(np.log(low), np.log(high)) for low, high in [GROWTH_LIMITS] if form[0]]
    ends += [(np.log(low), np.log(high)) for low, high in [TAIL_LIMITS] if form[1]]

    def law(free: np.ndarray) -> Uneven:
        rest = list(np.exp(free[1 + len(partial) :]))
        growth = rest.pop(0) if form[0] else 0.0
        tail = rest.pop(0) if form[1] else 0.0
        phi = coefficients_of(free[1 : 1 + len(partial)])
        trust = np.ones(len(motion))
        return Uneven(phi, float(np.exp(free[0])), float(growth), float(tail), motion, trust)

    start = np.array([np.log(typical), *partial, *[0.0] * form[0], *[np.log(0.1)] * form[1]])
    low, high = np.array(ends).T

    def cost(free: np.ndarray) -> float:
        found = law(free)
        return _cost(found, residual) + (0.0 if told is None else told.spent(found))

    run = minimize(cost, np.clip(start, low, high), method="L-BFGS-B", bounds=ends)
    return law(run.x).weighed(residual)
