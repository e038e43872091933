"""Input shapers: impulses that split a motion so that its parts cancel a vibration."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from scipy.optimize import brentq, root

STEP = 0.02
"""How far the damping ratio goes in one step of a continuation [-]."""

RESIDUAL = 1e-9
"""How exactly the conditions of an EI shaper are met [-]."""

MOST_DAMPING = 0.3
"""Largest damping ratio for which EI shapers are made [-]; above it there is little to shape."""


@dataclass(frozen=True, eq=False)
class Shaper:
    """A row of impulses; a motion is shaped by its convolution with them.

    Attributes:
        times: instants, the first 0, ascending, shape (k,) [s].
        amplitudes: shares of the motion, of sum 1, shape (k,) [-].
        name: of the method.
    """

    times: np.ndarray
    amplitudes: np.ndarray
    name: str = "shaper"

    @property
    def duration(self) -> float:
        """By how much it lengthens a motion [s]."""
        return float(self.times[-1])

    def shaped(self, motion: Callable[[np.ndarray], np.ndarray], times: np.ndarray) -> np.ndarray:
        """A motion after the shaper.

        Args:
            motion: of an array of instants [s].
            times: shape (t,) [s].

        Returns:
            What `motion` returns, in its unit, late by each impulse in turn.
        """
        parts = zip(self.amplitudes, self.times, strict=True)
        return sum(share * motion(times - late) for share, late in parts)  # type: ignore[return-value]

    def residual(self, frequencies: np.ndarray, damping_ratio: float = 0.0) -> np.ndarray:
        """Vibration that is left, as a share of that of one impulse of size 1.

        Args:
            frequencies: of the oscillator without damping, shape (f,) [Hz].
            damping_ratio: of the oscillator [-].

        Returns:
            Shape (f,) [-].

        Source: ``exp(-zeta w t_n) sqrt(C^2 + S^2)`` with ``C, S = sum A_i exp(zeta w t_i)
        (cos, sin)(w_d t_i)``; N. Singer, W. Seering, ASME J. Dyn. Syst. Meas. Control 112, 1990.
        """
        w = 2 * math.pi * np.asarray(frequencies, dtype=float)
        return np.abs(_phasor(self, w, damping_ratio))

    def insensitivity(
        self, frequency: float, level: float = 0.05, damping_ratio: float = 0.0
    ) -> float:
        """Width of the band around a frequency in which less than a level is left.

        Args:
            frequency: middle of the band [Hz].
            level: of the residual [-].
            damping_ratio: of the oscillator [-].

        Returns:
            Width over the frequency [-]; 0 where more is left at the frequency itself, infinite
            where no more is left from near 0 to twice the frequency on one side.
        """

        def above(ratio: float) -> float:
            return float(self.residual(np.array([ratio * frequency]), damping_ratio)[0]) - level

        if above(1.0) > 1e-9:
            return 0.0
        edges = []
        for sign in (-1.0, 1.0):
            offsets = np.arange(1, 1000) * 1e-3
            over = [1.0 + sign * offset for offset in offsets if above(1.0 + sign * offset) > 1e-9]
            if not over:
                return math.inf
            edges.append(brentq(above, over[0] - sign * 1e-3, over[0]))
        return edges[1] - edges[0]


def _phasor(shaper: Shaper, w: np.ndarray, damping_ratio: float) -> np.ndarray:
    """What is left at the last impulse, as rotating numbers, for frequencies w [rad/s]."""
    decay, turn = damping_ratio * w, w * math.sqrt(1 - damping_ratio**2)
    since = shaper.times[-1] - shaper.times
    return np.exp(-np.multiply.outer(decay + 1j * turn, since)) @ shaper.amplitudes


def _half_period(frequency: float, damping_ratio: float) -> float:
    if not (frequency > 0.0 and 0.0 <= damping_ratio < 1.0):
        raise ValueError(
            "shaper: expected a frequency above 0 Hz and a damping ratio of 0 to below 1, found "
            f"{frequency:g} Hz and {damping_ratio:g}. Mend: state the mode that rings."
        )
    return 0.5 / (frequency * math.sqrt(1 - damping_ratio**2))


def _binomial(count: int, frequency: float, damping_ratio: float, name: str) -> Shaper:
    half = _half_period(frequency, damping_ratio)
    left = math.exp(-damping_ratio * math.pi / math.sqrt(1 - damping_ratio**2))
    shares = np.array([math.comb(count, k) * left**k for k in range(count + 1)])
    return Shaper(half * np.arange(count + 1), shares / shares.sum(), name)


def zv(frequency: float, damping_ratio: float = 0.0) -> Shaper:
    """Two impulses that leave no vibration at one frequency [Hz] and damping ratio [-].

    Source: O. J. M. Smith, Proc. IRE 45, 1957; tests/optimize/test_shaper.py.
    """
    return _binomial(1, frequency, damping_ratio, "ZV")


def zvd(frequency: float, damping_ratio: float = 0.0) -> Shaper:
    """Three impulses that leave none, nor any slope of it, at a frequency [Hz] and damping [-].

    Source: N. Singer, W. Seering, ASME J. Dyn. Syst. Meas. Control 112, 1990.
    """
    return _binomial(2, frequency, damping_ratio, "ZVD")


def ei(frequency: float, damping_ratio: float = 0.0, level: float = 0.05) -> Shaper:
    """Three impulses that leave a level at the frequency and none at one on either side.

    Args:
        frequency: of the mode without damping [Hz].
        damping_ratio: of the mode [-].
        level: what is left at the frequency itself [-].

    Returns:
        The shaper; for a damped mode its conditions are solved, not fitted.

    Raises:
        ValueError: for numbers out of range.

    Source: W. Singhose, W. Seering, N. Singer, ASME J. Mech. Des. 116, 1994.
    """
    side = math.acos(-(1 - level) / (1 + level)) / math.pi
    shares = [(1 + level) / 4, (1 - level) / 2]
    start = np.array([*shares, 0.5, 1.0, side, 2 - side])
    return _robust(frequency, damping_ratio, level, start, 3, (0, 1), "EI")


def two_hump_ei(frequency: float, damping_ratio: float = 0.0, level: float = 0.05) -> Shaper:
    """Four impulses that leave a level in two humps, and none between and beside them.

    Args:
        frequency: of the mode without damping [Hz].
        damping_ratio: of the mode [-].
        level: what is left at most between the outer zeros [-].

    Returns:
        The shaper; for a damped mode its conditions are solved, not fitted.

    Raises:
        ValueError: for numbers out of range.

    Source: W. Singhose, L. Porter, N. Singer, Proc. American Control Conference, 1995; of a damped
    mode the outer zeros keep their places, the humps their height.
    """
    x = (level**2 * (math.sqrt(1 - level**2) + 1)) ** (1 / 3)
    first = (3 * x**2 + 2 * x + 3 * level**2) / (16 * x)
    # 2 A1 cos(3 p) + 2 A2 cos(p) with p = pi r / 2: zeros where 4 A1 cos^2 p = 3 A1 - A2
    second = 0.5 - first
    side = math.acos(math.sqrt((3 * first - second) / (4 * first))) * 2 / math.pi
    top = math.acos(math.sqrt((3 * first - second) / (12 * first))) * 2 / math.pi
    times = [0.5, 1.0, 1.5]
    start = np.array([first, second, second, *times, side, 2 - side, top, 2 - top])
    return _robust(frequency, damping_ratio, level, start, 4, (1, 2), "two-hump EI")


def _robust(
    frequency: float,
    damping_ratio: float,
    level: float,
    start: np.ndarray,
    impulses: int,
    sides: tuple[int, int],
    name: str,
) -> Shaper:
    """Follows a shaper from no damping to a damping ratio.

    Args:
        frequency: of the mode [Hz].
        damping_ratio: of the mode [-].
        level: residual at the humps [-].
        start: shares but the last, times but the first in periods, zeros and humps as ratios to
            the frequency, without damping.
        impulses: how many.
        sides: 1 where the frequency itself is a zero, and how many humps are free.
        name: of the method.
    """
    _half_period(frequency, damping_ratio)
    if not 0.0 < level < 0.5 or damping_ratio > MOST_DAMPING:
        raise ValueError(
            f"{name} shaper: expected a level between 0 and 0.5 and a damping ratio of at most "
            f"{MOST_DAMPING:g}, found {level:g} and {damping_ratio:g}. Mend: allow less vibration, "
            "or shape a mode with less damping."
        )
    is_zero, free = sides[0] == 1, sides[1]
    humps = slice(len(start) - free, None) if is_zero else slice(0, 0)
    zeros = slice(2 * impulses - 2, 2 * impulses)

    def misses(unknown: np.ndarray, damping: float) -> np.ndarray:
        trial = _normal(unknown, impulses, name)
        nulls = np.append(unknown[zeros], [1.0] if is_zero else [])
        tops = unknown[humps] if is_zero else np.array([1.0])
        left: Any = _phasor(trial, 2 * math.pi * nulls, damping)
        value = _phasor(trial, 2 * math.pi * tops, damping)
        slope = (_phasor(trial, 2 * math.pi * (tops + 1e-5), damping)
                 - _phasor(trial, 2 * math.pi * (tops - 1e-5), damping)) / 2e-5  # fmt: skip
        height = np.abs(value) - level
        return np.concatenate([left.real, left.imag, height, (value.conj() * slope).real])

    known = start
    count = math.ceil(damping_ratio / STEP)
    for damping in np.linspace(0.0, damping_ratio, count + 1)[1:]:
        known = root(misses, known, args=(damping,), tol=1e-13).x
    if np.max(np.abs(misses(known, damping_ratio))) > RESIDUAL:
        raise ValueError(
            f"{name} shaper: expected impulses that meet its conditions at a damping ratio of "
            f"{damping_ratio:g}, found none. Mend: take ZVD, or less damping."
        )
    unit = _normal(known, impulses, name)
    return Shaper(unit.times / frequency, unit.amplitudes, name)


def _normal(unknown: np.ndarray, impulses: int, name: str) -> Shaper:
    """The shaper of a mode of 1 Hz from the unknowns of a continuation."""
    shares = unknown[: impulses - 1]
    times = np.append(0.0, unknown[impulses - 1 : 2 * impulses - 2])
    return Shaper(times, np.append(shares, 1.0 - shares.sum()), name)


def combined(shapers: Sequence[Shaper]) -> Shaper:
    """One shaper for several modes: the convolution of theirs.

    Args:
        shapers: one for each mode.

    Returns:
        A shaper that leaves of each mode what that mode's own would leave, or less; impulses at
        the same instant are one.
    """
    if not shapers:
        raise ValueError("shapers: expected at least one, found none. Mend: name a mode.")
    return reduce(_convolved, shapers)


def _convolved(first: Shaper, second: Shaper) -> Shaper:
    times = np.add.outer(first.times, second.times).ravel()
    shares = np.multiply.outer(first.amplitudes, second.amplitudes).ravel()
    apart = 1e-12 * max(float(times.max()), 1e-300)
    order = np.argsort(times, kind="stable")
    times, shares = times[order], shares[order]
    group = np.cumsum(np.append(0, np.diff(times) > apart))
    return Shaper(
        times[np.searchsorted(group, np.arange(group[-1] + 1))],
        np.bincount(group, weights=shares),
        f"{first.name} × {second.name}",
    )
