"""Do two instruments agree? Bias and limits of agreement, with intervals, and who is unlike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

LEVEL = 0.95
"""Share of differences within the limits, and confidence of every interval [-]."""

FEWEST = 3
"""Fewest pairs of a subject whose own limits are told [-]."""

FEWEST_ALIKE = 6
"""Fewest subjects among whom one can be told to stand out [-]."""


@dataclass(frozen=True)
class Told:
    """A number with its interval of confidence.

    Attributes:
        value: the estimate [unit of the difference].
        low: lower end [unit of the difference].
        high: upper end [unit of the difference].
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Limits:
    """Bias and limits of agreement of one subject, or of all.

    Attributes:
        subject: its name; empty for all.
        count: pairs [-].
        bias: mean difference [unit of the difference].
        lower: below which one difference in forty lies [unit of the difference].
        upper: above which one difference in forty lies [unit of the difference].
        spread: standard deviation of a difference, about the bias [unit of the difference].
        within: its part from swing to swing [unit of the difference].
        between: its part from subject to subject; 0 for one subject [unit of the difference].
    """

    subject: str
    count: int
    bias: Told
    lower: Told
    upper: Told
    spread: float
    within: float
    between: float


@dataclass(frozen=True)
class Outlier:
    """A subject on whom the instruments differ more than on the others.

    Attributes:
        subject: its name.
        size: its typical discrepancy [unit of the difference].
        others: that of the others, their geometric mean [unit of the difference].
        statistic: its distance from the mean in standard deviations, by logarithm [-].
        critical: from which it counts as unlike [-].
        rank: in the order of being found, from 1 [-].
    """

    subject: str
    size: float
    others: float
    statistic: float
    critical: float
    rank: int


@dataclass(frozen=True)
class Agreement:
    """What two instruments make of the same quantity.

    Attributes:
        overall: of all pairs.
        subjects: of each subject with pairs enough.
        sizes: root mean square difference of each subject, by name [unit of the difference].
        outliers: subjects whose differences are unlike the others'.
        is_tested: whether there are subjects enough to tell whether one is unlike the others.
        without: of all pairs without the outliers; None where there are none.
        slope: change of the difference with the size of what is measured [-].
        slope_p: how likely such a slope is by chance [-].
    """

    overall: Limits
    subjects: tuple[Limits, ...]
    sizes: dict[str, float]
    outliers: tuple[Outlier, ...]
    is_tested: bool
    without: Limits | None
    slope: float
    slope_p: float


def agreement(subjects: Sequence[str], first: np.ndarray, second: np.ndarray) -> Agreement:
    """Bias and limits of agreement of two instruments on the same swings.

    Args:
        subjects: who swung, n names.
        first: by the first instrument, shape (n,) [any unit].
        second: by the second one, shape (n,) [same unit].

    Returns:
        Differences are first less second.

    Raises:
        ValueError: where there are too few pairs, or numbers that are not finite.

    Source: Bland and Altman 1986 and 2007 (several swings a subject); intervals of the limits by
    Carkeet 2015, exact for one subject, and by Zou 2013 for several; outliers by `outliers`.
    """
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    _check(subjects, first, second)
    names = list(dict.fromkeys(subjects))
    difference, who = first - second, np.array([names.index(one) for one in subjects])
    groups = {name: difference[who == k] for k, name in enumerate(names)}
    sizes = {name: float(np.sqrt(np.mean(each**2))) for name, each in groups.items()}
    strange = outliers(sizes)
    kept = {n: each for n, each in groups.items() if n not in {one.subject for one in strange}}
    mean = (first + second) / 2
    line: Any = stats.linregress(mean, difference) if np.ptp(mean) > 0.0 else None
    return Agreement(
        _overall(groups),
        tuple(limits(each, name) for name, each in groups.items() if len(each) >= FEWEST),
        sizes,
        strange,
        _comparable(sizes) >= FEWEST_ALIKE,
        _overall(kept) if strange and sum(map(len, kept.values())) >= FEWEST else None,
        math.nan if line is None else float(line.slope),
        math.nan if line is None else float(line.pvalue),
    )


def _check(subjects: Sequence[str], first: np.ndarray, second: np.ndarray) -> None:
    if not len(subjects) == len(first) == len(second):
        found = f"{len(subjects)} subjects, {len(first)} and {len(second)} numbers"
        raise ValueError(
            f"agreement: expected as many subjects as pairs, found {found}. Mend: give them all."
        )
    if len(first) < FEWEST:
        raise ValueError(
            f"agreement: expected at least {FEWEST} pairs, found {len(first)}. Mend: measure more."
        )
    if not (np.isfinite(first).all() and np.isfinite(second).all()):
        raise ValueError(
            "agreement: expected finite numbers, found some that are not. Mend: leave out swings "
            "that one of the instruments missed."
        )


def limits(difference: np.ndarray, subject: str = "") -> Limits:
    """Bias and limits of agreement of independent differences.

    Args:
        difference: shape (n,), n at least 2 [any unit].
        subject: whose.

    Returns:
        With exact intervals where differences are normal.

    Source: Carkeet 2015, Optometry and Vision Science 92 e71, by the noncentral t distribution.
    """
    n, mean = len(difference), float(np.mean(difference))
    spread = float(np.std(difference, ddof=1))
    reach, tail = float(stats.norm.ppf(0.5 + LEVEL / 2)), (1 - LEVEL) / 2
    half = float(stats.t.ppf(1 - tail, n - 1)) * spread / math.sqrt(n)
    near, far = (
        float(stats.nct.ppf(p, n - 1, reach * math.sqrt(n))) * spread / math.sqrt(n)
        for p in (tail, 1 - tail)
    )
    return Limits(
        subject,
        n,
        Told(mean, mean - half, mean + half),
        Told(mean - reach * spread, mean - far, mean - near),
        Told(mean + reach * spread, mean + near, mean + far),
        spread,
        spread,
        0.0,
    )


def _overall(groups: dict[str, np.ndarray]) -> Limits:
    """Limits for a new swing of a new subject: variance within and between subjects added."""
    sizes = np.array([len(each) for each in groups.values()], dtype=float)
    count, rows = int(sizes.sum()), len(sizes)
    means = np.array([np.mean(each) for each in groups.values()])
    if rows == 1 or count == rows:
        return limits(np.concatenate(list(groups.values())))
    within = sum(float(np.sum((e - m) ** 2)) for e, m in zip(groups.values(), means, strict=True))
    within /= count - rows
    typical = rows / np.sum(1 / sizes)  # harmonic mean of the swings a subject
    of_means = float(np.var(means, ddof=1))
    between = max(0.0, of_means - within / typical)
    total = of_means + (1 - 1 / typical) * within
    mean, reach = float(np.mean(means)), float(stats.norm.ppf(0.5 + LEVEL / 2))
    tail = (1 - LEVEL) / 2
    error = math.sqrt(of_means / rows)
    half = float(stats.t.ppf(1 - tail, rows - 1)) * error
    high = total + math.hypot(
        of_means * ((rows - 1) / stats.chi2.ppf(tail, rows - 1) - 1),
        (1 - 1 / typical) * within * ((count - rows) / stats.chi2.ppf(tail, count - rows) - 1),
    )
    low = total - math.hypot(
        of_means * (1 - (rows - 1) / stats.chi2.ppf(1 - tail, rows - 1)),
        (1 - 1 / typical) * within * (1 - (count - rows) / stats.chi2.ppf(1 - tail, count - rows)),
    )
    spread = math.sqrt(total)
    inner = math.hypot(half, reach * (spread - math.sqrt(max(low, 0.0))))
    outer = math.hypot(half, reach * (math.sqrt(high) - spread))
    return Limits(
        "",
        count,
        Told(mean, mean - half, mean + half),
        Told(mean - reach * spread, mean - reach * spread - outer, mean - reach * spread + inner),
        Told(mean + reach * spread, mean + reach * spread - inner, mean + reach * spread + outer),
        spread,
        math.sqrt(within),
        math.sqrt(between),
    )


def outliers(
    sizes: dict[str, float], share: float = 0.25, chance: float = 0.05
) -> tuple[Outlier, ...]:
    """Subjects whose typical discrepancy is too large to be one of the others'.

    A typical discrepancy is a spread: its logarithm is what scatters evenly.

    Args:
        sizes: by subject, above 0 [any unit].
        share: most subjects that can be named [of all].
        chance: of naming anybody where all are alike [-].

    Returns:
        The outliers, the strangest first; none where fewer than `FEWEST_ALIKE` subjects are
        compared, which is no sign that all are alike.

    Source: Rosner 1983, the generalized extreme Studentized deviate, on the upper side alone.
    """
    names = [name for name, size in sizes.items() if size > 0.0]
    if len(names) < FEWEST_ALIKE:
        return ()
    left = {name: math.log(sizes[name]) for name in names}
    found: list[Outlier] = []
    last = 0
    for rank in range(1, max(1, math.floor(share * len(names))) + 1):
        n, values = len(left), np.array(list(left.values()))
        mean, spread = float(values.mean()), float(values.std(ddof=1))
        if spread < 1e-12:
            break
        name = max(left, key=lambda one: left[one])
        statistic = (left.pop(name) - mean) / spread
        t = float(stats.t.ppf(1 - chance / n, n - 2))
        critical = (n - 1) * t / math.sqrt(n * (n - 2 + t * t))
        others = math.exp(float(np.mean(list(left.values()))))
        found.append(Outlier(name, sizes[name], others, float(statistic), critical, rank))
        last = rank if statistic > critical else last
    return tuple(found[:last])


def _comparable(sizes: dict[str, float]) -> int:
    """Subjects whose typical discrepancy has a logarithm."""
    return sum(size > 0.0 for size in sizes.values())


@dataclass(frozen=True)
class Averages:
    """What averages without signs tell of agreement, a number a subject.

    Attributes:
        mean: over the subjects [unit of the averages].
        lower: limit below which one subject's average in forty lies [unit of the averages].
        upper: limit above which one subject's average in forty lies [unit of the averages].
        single: within which 95 % of single swings would lie, if there were no bias and the typical
            subject's errors were normal [unit of the averages].
        outliers: subjects unlike the others.
        is_tested: whether there are subjects enough to tell whether one is unlike the others.
        count: subjects [-].
        without: the same without them; None where there are none.
    """

    mean: Told
    lower: float
    upper: float
    single: float
    outliers: tuple[Outlier, ...]
    is_tested: bool
    count: int
    without: Averages | None


def averages(sizes: dict[str, float], is_distance: bool) -> Averages:
    """Agreement from each subject's average discrepancy, where no single swing is kept.

    Neither bias nor limits of single swings follow from such averages: their signs are lost. What
    follows is how far subjects' averages scatter, about their geometric mean, and who is unlike.

    Args:
        sizes: average discrepancy by subject, above 0 [any unit].
        is_distance: whether of two points in a plane, not of two numbers.

    Returns:
        Mean, limits of subjects' averages, and outliers [unit of `sizes`].

    Raises:
        ValueError: for fewer than three subjects, or an average that is not above 0.
    """
    values = np.array(list(sizes.values()), dtype=float)
    if len(values) < FEWEST or not (np.isfinite(values) & (values > 0.0)).all():
        raise ValueError(
            f"averages: expected at least {FEWEST} numbers above 0, found {values.tolist()}. Mend: "
            "leave out subjects without a number."
        )
    found = limits(np.log(values))
    strange = outliers(sizes)
    mean = Told(*(math.exp(x) for x in (found.bias.value, found.bias.low, found.bias.high)))
    # mean to 95 % point: of a length with two normal parts, and of a normal number's size
    factor = math.sqrt(-2 * math.log(1 - LEVEL)) / math.sqrt(math.pi / 2)
    if not is_distance:
        factor = float(stats.norm.ppf(0.5 + LEVEL / 2)) * math.sqrt(math.pi / 2)
    names = {one.subject for one in strange}
    kept = {name: size for name, size in sizes.items() if name not in names}
    return Averages(
        mean,
        math.exp(found.lower.value),
        math.exp(found.upper.value),
        factor * mean.value,
        strange,
        len(values) >= FEWEST_ALIKE,
        len(values),
        averages(kept, is_distance) if strange else None,
    )
