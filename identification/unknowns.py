"""What is sampled: constants, tolerances and the noise's own numbers, each with its transform."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from .fit import Fit, solve
from .free import Entry
from .noise import MEMORY_LIMITS, Noise, coefficients_of, partials
from .problem import Key, Model
from .uneven import GROWTH_LIMITS, TAIL_LIMITS, Uneven, likeliest_law

LINEAR = ("start", "drive", "offset")
"""Slots in which the response of a model without laws is linear."""

INSIDE = 0.3
"""A number that a fit left on its bound starts this many standard errors inside [-]."""

FAR = 1.5
"""Largest standard deviation that a start is given in a transformed coordinate [-]."""


@dataclass(frozen=True)
class Unknown:
    """One number that is sampled, and how it is told in a coordinate without bounds.

    Without bounds the coordinate is ``value / scale``; above a lower bound the logarithm of the
    distance to it, below an upper one likewise; between two bounds the logit of the share of the
    way. The density is always that of the number itself: flat or normal about `center`, or for a
    standard deviation flat in its logarithm.

    Attributes:
        label: unique name.
        unit: SI unit as text [-].
        value: where the fit found it, inside the bounds [SI].
        std: its standard error there [SI].
        low: lower bound [SI].
        high: upper bound [SI].
        scale: size of a natural change [SI].
        center: prior mean [SI].
        prior: prior standard deviation [SI]; inf for a flat prior.
        is_scale: whether the prior is flat in the logarithm (Jeffreys's, of a deviation).
        is_constant: whether it is a constant of the rig or of a law.
        is_noise: whether it is a number of a channel's noise.
    """

    label: str
    unit: str
    value: float
    std: float
    low: float
    high: float
    scale: float
    center: float = 0.0
    prior: float = math.inf
    is_scale: bool = False
    is_constant: bool = False
    is_noise: bool = False

    @property
    def transform(self) -> str:
        """identity, above, below or between."""
        if math.isfinite(self.low) and math.isfinite(self.high):
            return "between"
        if math.isfinite(self.low):
            return "above"
        return "below" if math.isfinite(self.high) else "identity"

    def free(self, value: np.ndarray | float) -> np.ndarray:
        """The coordinate without bounds [-] of a value [SI]."""
        value = np.asarray(value, dtype=float)
        if self.transform == "between":
            return np.log((value - self.low) / (self.high - value))
        if self.transform == "above":
            return np.log((value - self.low) / self.scale)
        if self.transform == "below":
            return np.log((self.high - value) / self.scale)
        return value / self.scale

    def natural(self, free: np.ndarray | float) -> np.ndarray:
        """The value [SI] of a coordinate without bounds [-]."""
        free = np.asarray(free, dtype=float)
        if self.transform == "between":
            return self.low + (self.high - self.low) / (1.0 + np.exp(-free))
        if self.transform == "above":
            return self.low + self.scale * np.exp(free)
        if self.transform == "below":
            return self.high - self.scale * np.exp(free)
        return free * self.scale

    def log_slope(self, free: np.ndarray) -> np.ndarray:
        """Log of how fast the value grows with the coordinate, up to a constant [-]."""
        if self.transform == "between":
            return -np.logaddexp(0.0, free) - np.logaddexp(0.0, -free)
        return np.zeros_like(free) if self.transform == "identity" else free

    @property
    def slope(self) -> float:
        """Change of the value for one of the coordinate, where the fit stands [SI]."""
        if self.transform == "between":
            return (self.value - self.low) * (self.high - self.value) / (self.high - self.low)
        if self.transform == "above":
            return self.value - self.low
        return self.value - self.high if self.transform == "below" else self.scale


def is_linear(model: Model, entry: Entry) -> bool:
    """Whether the response is linear in an entry, so that it is integrated in closed form."""
    linear = LINEAR if not model.places else ("offset",)
    bounded = math.isfinite(entry.low) or math.isfinite(entry.high)
    own = entry.slot == "offset" or (entry.slot == "start") == (entry.record is not None)
    return entry.slot in linear and own and not bounded


def entry_unknowns(fit: Fit) -> tuple[list[int], list[Unknown]]:
    """Entries of a fit that are sampled: which they are, and as unknowns [SI]."""
    where, found = [], []
    for index, entry in enumerate(fit.model.entries):
        if is_linear(fit.model, entry):
            continue
        std = fit.std(index)
        std = std if 0 < std < math.inf else abs(entry.scale)
        value, room = fit.value(index), INSIDE * std
        both = math.isfinite(entry.low) and math.isfinite(entry.high)
        room = min(room, 0.25 * (entry.high - entry.low)) if both else room
        value = min(max(value, entry.low + room), entry.high - room)
        constant = not entry.nuisance and entry.slot in ("numbers", "strengths")
        where.append(index)
        found.append(
            Unknown(
                entry.label,
                entry.unit,
                value,
                std,
                entry.low,
                entry.high,
                abs(entry.scale) or 1.0,
                entry.center,
                entry.prior,
                is_constant=constant,
            )
        )
    return where, found


def noise_unknowns(fit: Fit) -> dict[Key, list[Unknown]]:
    """The numbers of each channel's noise law: innovations' deviation [SI], then its memory [-].

    The memory is told by partial autocorrelations, so that every law is stationary; each is flat
    between the limits within which the law was chosen. Of noise that is uneven, growth and tail
    follow.
    """
    found = {}
    for key, noise in fit.model.noises.items():
        assert isinstance(noise, Noise)
        record, channel = key
        sensor = fit.sensor_of(key)
        count, unit = len(sensor.values), sensor.channel.unit
        std = noise.std / math.sqrt(2 * count)
        label = f"{channel}.noise[{record}]"
        size = Unknown(label, unit, noise.std, std, 0.0, math.inf, noise.std, is_scale=True)
        mine = [replace(size, is_noise=True)]
        for lag, partial in enumerate(partials(noise.coefficients), 1):
            limit = MEMORY_LIMITS[lag - 1]
            error = math.sqrt(max(1 - partial**2, 1e-3) / count)
            inner = float(np.clip(partial, -limit + 0.5 * error, limit - 0.5 * error))
            name = f"{channel}.memory_{lag}[{record}]"
            mine.append(Unknown(name, "1", inner, error, -limit, limit, limit, is_noise=True))
        if isinstance(noise, Uneven):
            mine += _parts(noise, f"[{record}]", channel, count)
        found[key] = mine
    return found


def _parts(noise: Uneven, record: str, channel: str, count: int) -> list[Unknown]:
    """Growth and tail of a law that has them, with rough errors."""
    found, rough = [], 1.0 / math.sqrt(count)
    growth_error = 3.0 * rough * max(noise.growth, 1.0)
    for name, value, error, (low, high) in (
        ("growth", noise.growth, growth_error, GROWTH_LIMITS),
        ("tail", noise.tail, 1.2 * rough, TAIL_LIMITS),
    ):
        if value:
            room = min(0.5 * error, 0.25 * (high - low))
            inner = float(np.clip(value, low + room, high - room))
            label = f"{channel}.{name}{record}"
            found.append(Unknown(label, "1", inner, error, low, high, high, is_noise=True))
    return found


def noise_columns(noise: Noise) -> list[int]:
    """Which of deviation, two memories, growth and tail (0 to 4) a law has, in this order [-]."""
    found = list(range(1 + len(noise.coefficients)))
    if isinstance(noise, Uneven):
        found += [3] * (noise.growth > 0) + [4] * (noise.tail > 0)
    return found


def absorbed(fit: Fit) -> Fit:
    """The fit under the noise that its residuals have, whatever they are made of.

    Of each channel's law the form is kept; size and memory [SI] are those that explain all of the
    residual, misfit included, so that a posterior starts from where it will end.
    """
    for _ in range(2):
        noises = {}
        for key, noise in fit.model.noises.items():
            if not isinstance(noise, Noise):
                raise ValueError(
                    f"{key[0]}: expected a fit with noise laws, found weights of an opening. "
                    "Mend: fit the records first."
                )
            left, order = fit.residual_of(key), len(noise.coefficients)
            noises[key] = (
                likeliest_law(noise, left, fit.sensor_of(key).values)
                if isinstance(noise, Uneven)
                else _likeliest(left, order)
            )
        again = solve(replace(fit.model, noises=noises), fit.x, 15)
        fit = replace(again, covariance=fit.covariance)
    return fit


def _likeliest(residual: np.ndarray, order: int) -> Noise:
    """The autoregressive law of that order under which a residual is likeliest."""
    limits = np.array(MEMORY_LIMITS[:order])

    def law(free: np.ndarray) -> Noise:
        unit = Noise(coefficients_of(limits * np.tanh(free)), 1.0)
        return replace(unit, std=float(np.sqrt(np.mean(unit.whiten(residual) ** 2))) or 1e-300)

    if not order:
        return law(np.zeros(0))
    count = len(residual)
    run = minimize(
        lambda free: count * math.log(law(free).std), np.zeros(order) + 0.5, method="Nelder-Mead"
    )
    return law(run.x)
