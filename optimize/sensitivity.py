"""Which parameters matter: Sobol's shares of the variance, first and total, with intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from ..model.door import fault, one_of
from ..model.rig import Rig
from .search_spec import Range
from .sweep import Axis, SweepTask, score_designs
from .sweep_spec import SweepSpec, axes_of

MOST_PARAMETERS = 8
"""Parameters of one analysis at most [-]."""

SAMPLES = 4096
"""Base samples if nothing is said [-]."""

RESAMPLES = 200
"""How often designs are drawn again for the intervals [-]."""

EDGE = 0.025
"""Share of these beyond each end of an interval [1]."""

MOST_LOST = 0.95
"""Share of samples that must be finite, so that the others may be left out [1]."""

Function = Callable[[dict[str, np.ndarray]], Mapping[str, np.ndarray]]


@dataclass(frozen=True)
class Indices:
    """Shares of one score's variance.

    Attributes:
        first: of each parameter alone, by name [1].
        total: of each parameter with all its company [1].
        first_interval: lower and upper end of the first, by name [1].
        total_interval: of the total, likewise [1].
    """

    first: dict[str, float]
    total: dict[str, float]
    first_interval: dict[str, tuple[float, float]]
    total_interval: dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Sensitivity:
    """What each score depends on, over the ranges that were given.

    Attributes:
        ranges: what was varied.
        samples: base samples [-].
        designs: designs that were simulated [-].
        indices: by score; none for a score that is constant, or that too many designs lack.
        not_finite: designs without a finite score, by score [-].
    """

    ranges: tuple[Range, ...]
    samples: int
    designs: int
    indices: dict[str, Indices]
    not_finite: dict[str, int]


def sensitivity(
    task: SweepTask, ranges: Sequence[Range], samples: int = SAMPLES, seed: int = 0
) -> Sensitivity:
    """Sobol indices of all of a task's scores at once, over ranges of parameters.

    Args:
        task: mechanism, drive, sensor and scores; its axes are not looked at but for the first
            design.
        ranges: what varies, each evenly, or evenly in its logarithm.
        samples: base samples, a power of two; ``samples (len(ranges) + 2)`` designs are simulated.
        seed: of the samples and of the intervals [-].

    Returns:
        The indices.

    Raises:
        ValueError: for no range, more than `MOST_PARAMETERS`, or samples that are no power of two.
    """
    return analyze(lambda numbers: score_designs(task, numbers), ranges, samples, seed)


def analyze(
    function: Function, ranges: Sequence[Range], samples: int = SAMPLES, seed: int = 0
) -> Sensitivity:
    """Sobol indices of any function of parameters.

    Args:
        function: takes numbers by name, each of shape (designs,), and gives scores likewise.
        ranges: what varies.
        samples: base samples, a power of two [-].
        seed: of the samples and of the intervals [-].

    Returns:
        The indices.

    Raises:
        ValueError: as for `sensitivity`.

    Source: Saltelli et al. 2010, doi:10.1016/j.cpc.2009.09.018, table 2: (b) for the first and
    (f), Jansen's, for the total, on scrambled Sobol points; intervals by the bootstrap. The same
    as scipy's and SALib's; tests/optimize/test_sensitivity.py.
    """
    if not 1 <= len(ranges) <= MOST_PARAMETERS:
        raise ValueError(
            f"parameters: expected 1 to {MOST_PARAMETERS}, found {len(ranges)}. "
            "Mend: leave out those that matter least."
        )
    if samples < 2 or samples & (samples - 1):
        raise ValueError(
            f"samples: expected a power of two, found {samples}. "
            f"Mend: write {2 ** max(1, round(math.log2(max(samples, 2))))}."
        )
    size, generator = len(ranges), np.random.default_rng(seed)
    both = qmc.Sobol(2 * size, rng=generator).random(samples)
    mixed = [both[:, :size], both[:, size:]]
    for k in range(size):  # the first set with one column of the second
        mixed.append(both[:, :size].copy())
        mixed[-1][:, k] = both[:, size + k]
    points = np.concatenate(mixed)
    numbers = {one.name: _spread(points[:, k], one) for k, one in enumerate(ranges)}
    found, lost = {}, {}
    weights = generator.multinomial(samples, np.full(samples, 1.0 / samples), RESAMPLES)
    names = tuple(one.name for one in ranges)
    for name, values in function(numbers).items():
        table = np.asarray(values, float).reshape(size + 2, samples)
        whole = np.isfinite(table).all(axis=0)
        lost[name] = int(np.sum(~np.isfinite(table)))
        if whole.sum() >= MOST_LOST * samples and np.ptp(table[:2, whole]) > 0:
            found[name] = _indices(names, table[:, whole], weights[:, whole].astype(float))
    return Sensitivity(tuple(ranges), samples, points.shape[0], found, lost)


def _spread(part: np.ndarray, one: Range) -> np.ndarray:
    if one.is_log:
        return one.low * np.exp(part * np.log(one.high / one.low))
    return one.low + part * (one.high - one.low)


def _indices(names: tuple[str, ...], table: np.ndarray, weights: np.ndarray) -> Indices:
    """Indices of one score: of all samples, and of each set of weights for the intervals."""
    table = table - table[:2].mean()
    ones = np.ones((1, table.shape[1]))
    first, total = _estimates(table, ones)
    spread = [np.quantile(one, [EDGE, 1.0 - EDGE], axis=0) for one in _estimates(table, weights)]
    ends = [
        {name: (float(low[k]), float(high[k])) for k, name in enumerate(names)}
        for low, high in spread
    ]
    alone = dict(zip(names, first[0].tolist(), strict=True))
    together = dict(zip(names, total[0].tolist(), strict=True))
    return Indices(alone, together, ends[0], ends[1])


def _estimates(table: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and total indices by weighted samples, each of shape (sets, parameters)."""
    one, other, mixed = table[0], table[1], table[2:]
    count = weights.sum(axis=1, keepdims=True)
    mean = weights @ (one + other)[:, None] / (2.0 * count)
    variance = weights @ (one**2 + other**2)[:, None] / (2.0 * count) - mean**2
    change = mixed - one
    first = weights @ (other * change).T / count - mean * (weights @ change.T / count)
    total = 0.5 * (weights @ (change**2).T) / count
    return first / variance, total / variance


def ranges_of(spec: SweepSpec, axes: Sequence[Axis], rig: Rig) -> tuple[Range, ...]:
    """What an analysis varies: the axes from end to end, and what ``[sensitivity]`` adds.

    Args:
        spec: as read, with ``[sensitivity]``.
        axes: of the sweep.
        rig: tells the parameters with their units and what they may be.

    Returns:
        One range a parameter.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    told = spec.sensitivity or {}
    place = "[sensitivity.parameters]"
    found = {
        axis.name: (axis, spec.axes[axis.name].get("scale") == "log")
        for axis in axes
        if len(axis.values) > 1
    }
    for name, table in told.get("parameters", {}).items():
        wanted = {"count": 2, **table}
        if not {"low", "high"} <= table.keys() or len(wanted.keys() - {"scale"}) > 3:
            mend = f"write {name} = {{ low = 1.0, high = 2.0 }}"
            raise fault(spec.path, f"{place} {name}", "'low' and 'high'", one_of(table), mend)
        own = replace(spec, axes={name: wanted})
        found[name] = (axes_of(own, rig)[0], table.get("scale") == "log")
    if not 1 <= len(found) <= MOST_PARAMETERS:
        mend = "leave out those that matter least"
        expected = f"1 to {MOST_PARAMETERS} parameters that vary"
        raise fault(spec.path, "[sensitivity]", expected, str(len(found)), mend)
    samples = told.get("samples", SAMPLES)
    if samples & (samples - 1):
        mend = f"write {2 ** round(math.log2(samples))}"
        raise fault(spec.path, "[sensitivity] samples", "a power of two", str(samples), mend)
    return tuple(
        Range(name, float(axis.values.min()), float(axis.values.max()), is_log, axis.unit)
        for name, (axis, is_log) in found.items()
    )
