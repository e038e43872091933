"""Pre-flight: what cannot work is refused in words before any fit, what is doubtful is said."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..model.linear import modes
from .preflight_motion import motion_remarks, sight_remarks
from .prepare import Prepared, Sensor
from .problem import Problem
from .remark import Remark, place_of
from .signals import noise_std, quantization_step

FEWEST_SAMPLES = 2.5
"""Samples a period of the slowest mode below which nothing can be told [-]."""

COARSE_SAMPLES = 6.0
"""Samples a period below which a warning is due [-]."""

SHORTEST = (1.0, 3.0)
"""Periods of the slowest mode that a record must last, and below which a warning is due [-]."""

FEWEST_LEVELS = 4
"""Different values below which a channel is taken for dead [-]."""

ONLY_NOISE = 1.5
"""Spread over its own noise below which a channel is taken for dead [-]."""

STUCK = 0.08
"""Share of a record that a value may stand still while things move [-]."""


def preflight(problem: Problem) -> tuple[Remark, ...]:
    """Everything that speaks against fitting these records with this rig; refusals first.

    The checks ask for free constants that change nothing or start on a bound, excitation, time
    and units that are off by a factor, channels that are dead, stuck or clipped, and sampling.

    Args:
        problem: records and rig, prepared.

    Returns:
        Remarks; empty where nothing is wrong.

    Source: tests/identification/test_preflight.py, on faults made by an independent bench.
    """
    found = [*_bounds(problem), *_pinned(problem), *_sampling(problem)]
    for prepared in problem.records:
        for sensor in prepared.sensors:
            found += _channel(prepared, sensor)
    if not any(remark.refuses for remark in found):
        found += motion_remarks(problem)
    if not any(remark.refuses for remark in found):
        found += sight_remarks(problem)
    return tuple(sorted(found, key=lambda remark: not remark.refuses))


def require_ready(remarks: Sequence[Remark]) -> None:
    """Refuse where a remark says that no fit can work.

    Args:
        remarks: of `preflight`.

    Raises:
        ValueError: the first refusal, and how many more there are.
    """
    refusals = [remark for remark in remarks if remark.refuses]
    if refusals:
        more = len(refusals) - 1
        tail = f" ({more} more: `supple check` lists all.)" if more else ""
        raise ValueError(refusals[0].text + tail)


def remarks_json(remarks: Sequence[Remark]) -> list[dict[str, Any]]:
    """Remarks as tables that JSON can hold: ``check``, ``refuses`` and ``text``."""
    return [{"check": r.check, "refuses": r.refuses, "text": r.text} for r in remarks]


def _bounds(problem: Problem) -> list[Remark]:
    found = []
    for name, number in problem.rig.parameters.items():
        room = 1e-6 * abs(number.value)
        on_low, on_high = number.value - number.low <= room, number.high - number.value <= room
        if not number.free or not (on_low or on_high):
            continue
        which, bound = ("lower", number.low) if on_low else ("upper", number.high)
        expected = f"a start value inside its bounds, {number.low:g} to {number.high:g}"
        where = f"{number.value:g} {number.unit}, on the {which} bound {bound:g}"
        mend = "start from a value of its usual size" if on_low else "widen 'max', or start lower"
        place = place_of(problem, name)
        found.append(Remark("bound", True, problem.rig.path, place, expected, where, mend))
    return found


def _pinned(problem: Problem) -> list[Remark]:
    """Free constants that every record states for its own day, so that nothing is left to vary."""
    found = []
    for name, number in problem.rig.parameters.items():
        if number.free and all(name in p.numbers for p in problem.records):
            found.append(
                Remark(
                    "liveness",
                    True,
                    problem.rig.path,
                    place_of(problem, name),
                    "a free number that some record leaves open",
                    "one that every record states in [parameters]",
                    "remove it from the sidecars, or remove 'free'",
                )
            )
    return found


def slow_and_fast(problem: Problem, prepared: Prepared) -> tuple[float, float]:
    """Slowest and fastest lightly damped mode at the rig's own numbers [Hz]; 0 where none."""
    seen = modes(problem.mechanism, problem.numbers | prepared.numbers)
    rings = seen.damped_frequencies[(seen.damped_frequencies > 0) & (seen.damping_ratios < 0.3)]
    return (float(rings.min()), float(rings.max())) if len(rings) else (0.0, 0.0)


def _sampling(problem: Problem) -> list[Remark]:
    found = []
    for prepared in problem.records:
        slow, fast = slow_and_fast(problem, prepared)
        path = prepared.record.path
        if not slow:
            continue
        rate = max(sensor.channel.sample_rate for sensor in prepared.sensors)
        if rate < COARSE_SAMPLES * slow:
            expected = f"at least {COARSE_SAMPLES:g} samples a period of the mode at {slow:.4g} Hz"
            told = f"{rate / slow:.2g}, at {rate:.6g} Hz"
            mend = "sample faster; if sample_rate or the unit of time is wrong, correct it"
            refuses = rate < FEWEST_SAMPLES * slow
            found.append(Remark("sampling", refuses, path, "[record]", expected, told, mend))
        elif rate < 2.0 * fast:
            expected = f"more than {2 * fast:.4g} Hz, twice the fastest mode that rings"
            mend = "mind that this mode folds into lower frequencies, or sample faster"
            told = f"{rate:.6g} Hz"
            found.append(Remark("sampling", False, path, "[record]", expected, told, mend))
        periods = prepared.count * prepared.step * slow
        if periods < SHORTEST[1]:
            expected = f"a record of several periods of the mode at {slow:.4g} Hz"
            mend = "record for longer; if sample_rate or the unit of time is wrong, correct it"
            refuses = periods < SHORTEST[0]
            told = f"{periods:.2g} periods"
            found.append(Remark("excitation", refuses, path, "[record]", expected, told, mend))
    return found


def _channel(prepared: Prepared, sensor: Sensor) -> list[Remark]:
    """Dead, stuck and clipped channels."""
    channel, values = sensor.channel, sensor.values
    path, place = prepared.record.path, f"[channels.{channel.name}]"

    def remark(refuses: bool, expected: str, found: str, mend: str) -> Remark:
        return Remark("channel", refuses, path, place, expected, found, mend)

    told = []
    levels = len(np.unique(values))
    mend = "check cable, range and column, or leave that channel out"
    if levels < FEWEST_LEVELS:
        return [remark(True, "a channel that moves", f"{levels} different values only", mend)]
    noise = noise_std(values, channel.sample_rate)
    trend = np.polyfit(np.arange(len(values)), values, 1)
    spread = float(np.std(values - np.polyval(trend, np.arange(len(values)))))
    if noise is not None and spread < ONLY_NOISE * noise:
        told.append(remark(True, "a channel that moves", "noise alone", mend))
    run = stuck_run(channel.values)
    if run > STUCK * len(channel.values):
        share = (
            f"one value held for {100 * run / len(channel.values):.0f} % of its samples amid motion"
        )
        how = "cut that part off with 'samples', or leave the channel out"
        told.append(remark(True, "a channel that goes on", share, how))
    if channel.clipped is not None:
        share = f"{100 * channel.clipped.share:.2g} % of its samples on flat tops"
        told.append(
            remark(False, "a channel within its range", share, "repeat with a larger range")
        )
    return told


def stuck_run(values: np.ndarray) -> int:
    """Samples of the longest stand-still that begins while a channel moves [-].

    A decay that has faded into a converter's steps is none: there the motion before is small.

    Args:
        values: shape (n,), in any unit.

    Returns:
        Equal samples in a row; 0 where things come to rest by themselves.
    """
    same = np.concatenate([[False], np.diff(values) == 0.0, [False]]).astype(np.int8)
    turns = np.flatnonzero(np.diff(same))
    step = quantization_step(values) or 0.0
    longest = 0
    for start, stop in zip(turns[0::2], turns[1::2], strict=True):
        length = int(stop - start) + 1
        if length <= max(longest, 16) or start < 8:
            continue
        # friction may stop things for good, but gently; a cable does not wait for that
        window = values[max(0, start - max(16, int(len(values) * STUCK / 2))) : start + 1]
        moved, speed = float(np.ptp(window)), float(np.max(np.abs(np.diff(window))))
        leap = abs(float(values[start] - values[start - 1]))
        goes_on = float(np.ptp(values[stop:])) > 0.1 * float(np.ptp(values))
        if moved > max(0.25 * float(np.ptp(values)), 12.0 * step):
            longest = length if leap > 0.1 * speed or goes_on else longest
    return longest
