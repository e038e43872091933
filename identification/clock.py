"""A clock is a column of times; even steps are demanded, and whatever breaks them is named."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..model.door import fault

JITTER = 0.01
"""Largest deviation of one step from the usual one that passes for even [-]."""

WANDER = 0.5
"""Largest distance of a sample from an even clock [steps]."""

RATE_AGREEMENT = 0.01
"""How far a stated rate may be from that of the time column [-]."""


@dataclass(frozen=True)
class Clock:
    """An even clock.

    Attributes:
        rate: samples a second [Hz].
        start: the first time as the file states it [s].
    """

    rate: float
    start: float


def clock_of(times: np.ndarray, path: Path, column: str, first_row: int = 0) -> Clock:
    """Rate and start of a column of times, after checking that its steps are even.

    Times rounded to some decimals pass where they are an even clock within their rounding.

    Args:
        times: shape (n,) [s].
        path: their file, for messages.
        column: their column, for messages.
        first_row: number of the first of these rows in the file, for messages.

    Returns:
        The clock.

    Raises:
        ValueError: naming the row where time stands still, runs backwards, leaps or wanders.
    """
    steps = np.diff(times)
    usual = float(np.median(steps)) if steps.size else 0.0
    _check_forward(times, steps, path, column, first_row)
    rounding = _rounding(times, usual)
    allowed = JITTER * usual + rounding
    odd = np.flatnonzero(np.abs(steps - usual) > allowed * (1 + 1e-9))
    rate = _rate(times)
    if odd.size:
        row = int(odd[0])
        expected = f"even steps of {usual:.6g} s (within {100 * JITTER:g} %)"
        found = f"a step of {steps[row]:.6g} s, and {odd.size} uneven of {steps.size}"
        if steps[row] > 1.5 * usual:
            found = f"a gap of {steps[row]:.6g} s, and {odd.size} uneven steps of {steps.size}"
        mend = "resample to even steps, or use the rows before it with 'samples' in [record]"
        raise fault(path, _row(column, first_row + row + 1), expected, found, mend)
    away = np.abs(times - times[0] - np.arange(len(times)) / rate)
    away = np.abs(away - away.min())
    if away.max() > WANDER / rate + rounding:
        row = int(away.argmax())
        expected = "an even clock"
        found = f"a time {away.max() * rate:.2g} steps away from it"
        mend = "resample to even steps"
        raise fault(path, _row(column, first_row + row), expected, found, mend)
    return Clock(rate, float(times[0]))


def agreed_rate(path: Path, stated: float | None, measured: float, whose: str) -> float:
    """The stated rate, after checking that it is that of the file; the file's where none is.

    Args:
        path: whoever states it, for messages.
        stated: samples a second [Hz]; None where only the file tells.
        measured: samples a second by the file itself [Hz].
        whose: what of the file tells it, for messages.

    Returns:
        Samples a second [Hz].

    Raises:
        ValueError: where they differ by more than `RATE_AGREEMENT`.
    """
    if stated is None:
        return measured
    if abs(stated / measured - 1.0) > RATE_AGREEMENT:
        mend = "correct 'sample_rate' or the unit of the time column, or leave 'sample_rate' out"
        expected = f"the rate of {whose}, {measured:.6g} Hz"
        raise fault(path, "[record] sample_rate", expected, f"{stated:.6g} Hz", mend)
    return stated


def check_stated_rate(path: Path, stated: float, times: np.ndarray, header: str) -> None:
    """Refuses a stated rate that a column of times contradicts, even or not.

    A column that does not run forward is no clock. One without a unit may count ms or µs, and one
    with gaps has the rate of its usual steps.

    Args:
        path: whoever states it, for messages.
        stated: samples a second [Hz].
        times: the column's, shape (n,) [s, or its own unit where its header states none].
        header: of the column.

    Raises:
        ValueError: where the rates differ by more than `RATE_AGREEMENT`.
    """
    steps = np.diff(times)
    if len(steps) < 8 or not np.isfinite(times).all() or np.mean(steps >= 0.0) < 0.9:
        return
    long, usual = float(times[-1] - times[0]), float(np.median(steps))
    if long <= 0.0:
        return
    scales = (1.0,) if "[" in header or "(" in header else (1.0, 1e-3, 1e-6)
    known = [len(steps) / long] + ([1.0 / usual] if usual > 0.0 else [])
    near = [
        abs(stated * scale / rate - 1.0) <= RATE_AGREEMENT for scale in scales for rate in known
    ]
    if not any(near):
        agreed_rate(path, stated, known[0], f"the time column '{header}'")


def _row(column: str, row: int) -> str:
    return f"column '{column}', row {row}"


def _check_forward(
    times: np.ndarray, steps: np.ndarray, path: Path, column: str, first_row: int
) -> None:
    wrong = np.flatnonzero(steps <= 0)
    if not wrong.size:
        return
    row = int(wrong[0])
    before, after = times[row], times[row + 1]
    found = "time standing still" if after == before else "time running backwards"
    expected = f"a time after {before:.9g} s"
    mend = "cut the file there with 'samples', or leave [channels.time] out and give 'sample_rate'"
    text = f"{after:.9g} s ({found})"
    raise fault(path, _row(column, first_row + row + 1), expected, text, mend)


def _rounding(times: np.ndarray, usual: float) -> float:
    """The last decimal of printed times [s], where it is coarse enough to matter."""
    for decimals in range(13):
        unit = 10.0**-decimals
        if unit < 0.5 * JITTER * usual:
            return 0.0
        scaled = times / unit
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-9 * np.maximum(1.0, np.abs(scaled))):
            return unit if unit < 0.75 * usual else 0.0
    return 0.0


def _rate(times: np.ndarray) -> float:
    """Samples a second, by a straight line through all times [Hz]."""
    n = len(times)
    index = np.arange(n) - 0.5 * (n - 1)
    return float(np.sum(index**2) / np.sum(index * (times - times.mean())))
