"""Does the club swing on after the hand? Transfer from hand to head, and the damping of a hold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy import stats
from scipy.interpolate import CubicSpline
from scipy.signal import cont2discrete, lfilter

from .lowpass import zero_phase_lowpass
from .units import STANDARD_GRAVITY

BAND = 40.0
"""Highest frequency that is compared [Hz]."""

RATIOS = np.geomspace(0.003, 5.0, 60)
"""Damping ratios that are tried [-]; the highest passes on as much as a rigid club does."""

WIDE = 0.12
"""Damping ratio above which all frequencies are tried [-]."""

FREQUENCIES = (2.0, 8.0, 17)
"""Lowest and highest frequency of the club that is tried [Hz], and how many."""

LEFT, VISIBLE = 0.05, 1.0
"""Share of a swing that still shows, and how many cycles must show for an oscillation [-]."""

LEVEL = 0.95
"""Confidence of every interval [-]."""

STEP = 0.004
"""Steps in which the shift of a clock is tried at first [s]."""

REST, FELT, MEAN = 0.15, 0.25, 0.6
"""How long a rest is looked at [s], and which level at rest and on the average is gravity's [g]."""

PRESENT, ABSENT, UNTOLD = "oscillates", "no_oscillation", "cannot_tell"


@dataclass(frozen=True, eq=False)
class Hold:
    """What a hand, or a grip, does to the club in one motion.

    Attributes:
        status: ``oscillates``, ``no_oscillation`` or ``cannot_tell``.
        sentence: in words.
        gain: acceleration of the head for one of the hand, where nothing oscillates [-].
        gain_std: its standard deviation [-].
        frequency: undamped, of the club in the hold [Hz]; nan where none is told.
        ratio: equivalent damping, share of the critical one [-].
        ratio_low: lower end of its interval [-].
        ratio_high: upper end; inf where the record does not bound it [-].
        cycles: swings of the club that show at the most likely damping, above a twentieth [-].
        explained: share of the head's mean square that the hand's own motion explains, rigidly [-].
        left: root mean square of what a rigid club leaves [m/s^2].
        noise: root mean square of what the flexible one leaves [m/s^2].
        predicted: head as the hand moves it, shape (n,) [m/s^2].
        rest: head less the hand's rigid share, shape (n,) [m/s^2].
        times: of both, shape (n,) [s].
        late: by which the head's clock was found to be behind the hand's [s]; 0 where it is told.
        weight: what tells of gravity, in a sentence; empty where nothing does.
    """

    status: str
    sentence: str
    gain: float
    gain_std: float
    frequency: float
    ratio: float
    ratio_low: float
    ratio_high: float
    cycles: float
    explained: float
    left: float
    noise: float
    predicted: np.ndarray
    rest: np.ndarray
    times: np.ndarray
    late: float = 0.0
    weight: str = ""


class _Trial(NamedTuple):
    misfit: float
    frequency: float
    predicted: np.ndarray
    gain: float
    variance: float


def _misfit(trial: _Trial) -> float:
    return trial.misfit


def hold(
    hand: np.ndarray,
    head: np.ndarray,
    rate: float,
    frequency: float | None = None,
    apart: float = 0.0,
) -> Hold:
    """Compares the accelerations of a hand and of the clubhead that it moves.

    The head follows the hand as a mass on the shaft's spring and the hold's damping: what a rigid
    club would do is the limit of an infinite damping. Errors count as many samples as the residual
    has that are independent.

    **There is no gravity in this model.** It holds for motions in a level plane, as those of
    section 6.5, whose accelerometers feel none of it. Where the arm swings up and down, both feel
    g times the sine of its angle, which the head does not magnify as it does the hand's motion: a
    golfer's hold is then mostly ``cannot_tell``, or a damping that is none. `weight` says where a
    record shows it; a motion that begins, turns and ends with the arm at the same height does not.

    Args:
        hand: acceleration of the hand, from rest on, shape (n,) [m/s^2]; either sign.
        head: that of the clubhead, in the direction of the swing, shape (n,) [m/s^2].
        rate: samples a second [Hz].
        frequency: undamped one of the club, where it is known from a decay [Hz]; else sought.
        apart: by how much the two clocks may still be apart [s]; the likeliest shift is taken.

    Returns:
        Whether the club oscillates, and the equivalent damping with its interval.

    Raises:
        ValueError: where the hand does not move, or the record is short.

    Source: thesis, section 6.5; the model and its intervals are ours.
    """
    weight = weight_seen(hand, head, rate)
    hand, head, slow = _compared(hand, head, rate)
    hand, head, late, trials = _shifted(hand, head, slow, frequency, apart)
    columns = np.stack([np.ones(len(hand)), hand], axis=1)
    rigid, *_ = np.linalg.lstsq(columns, head, rcond=None)
    left = head - columns @ rigid
    misfits = np.array([one.misfit for one in trials])
    at = int(np.argmin(misfits))
    best = trials[at]
    free = _independent(head - best.predicted)
    above = free * np.log(misfits / misfits[at])
    inside = np.flatnonzero(above <= stats.chi2.ppf(LEVEL, 1))
    low, high = RATIOS[max(inside[0] - 1, 0)], RATIOS[min(inside[-1] + 1, len(RATIOS) - 1)]
    high = math.inf if inside[-1] + 1 >= len(RATIOS) else float(high)
    limit = _ratio_of(VISIBLE)
    status = PRESENT if high < limit else ABSENT if low >= limit else UNTOLD
    ratio = float(RATIOS[at])
    told = best.frequency if ratio < 1.0 else math.nan
    return Hold(
        status,
        _sentence(status, ratio, float(low), high, told),
        best.gain,
        math.sqrt(best.variance * len(head) / max(free, 3.0)),
        told,
        ratio,
        float(low),
        high,
        _cycles(ratio),
        1.0 - float(np.mean(left**2) / np.mean((head - head.mean()) ** 2)),
        float(np.sqrt(np.mean(left**2))),
        float(np.sqrt(misfits[at])),
        best.predicted,
        left,
        np.arange(len(head)) / slow,
        late,
        weight,
    )


def _shifted(
    hand: np.ndarray, head: np.ndarray, rate: float, frequency: float | None, apart: float
) -> tuple[np.ndarray, np.ndarray, float, list[_Trial]]:
    """Both where the hand, moved by the likeliest shift, is known, the shift, and the trials.

    For each damping ratio the likeliest shift is taken, so that intervals know of it.
    """
    if apart <= 0.0:
        return hand, head, 0.0, _profile(hand, head, rate, frequency)
    times, edge = np.arange(len(hand)) / rate, math.ceil(apart * rate) + 1
    inner, curve = slice(edge, -edge), CubicSpline(times, hand)
    found: dict[float, list[_Trial]] = {}

    def tried(late: float) -> float:
        moved = curve(times[inner] - late)
        found[late] = _profile(moved, head[inner], rate, frequency)
        return min(one.misfit for one in found[late])

    steps = np.linspace(-apart, apart, 2 * math.ceil(apart / STEP) + 1)
    best, width = float(min(steps, key=tried)), float(steps[1] - steps[0])
    for _ in range(3):
        width /= 2
        near = [one for one in (best - width, best + width) if abs(one) <= apart]
        best = min([best, *near], key=lambda late: tried(late) if late not in found
                   else min(one.misfit for one in found[late]))  # fmt: skip
    trials = [min(each, key=_misfit) for each in zip(*found.values(), strict=True)]
    return curve(times[inner] - best), head[inner], best, trials


def weight_seen(hand: np.ndarray, head: np.ndarray, rate: float) -> str:
    """What accelerometers say of gravity while they rest, or on the average.

    Args:
        hand: acceleration of the hand, shape (n,) [m/s^2].
        head: that of the clubhead, shape (n,) [m/s^2].
        rate: samples a second [Hz].

    Returns:
        A sentence; empty where neither feels a share of g, or where none of them rests [-].
    """
    count = max(4, round(REST * rate))
    for name, values in (("hand", np.asarray(hand, float)), ("head", np.asarray(head, float))):
        noise = float(np.median(np.abs(np.diff(values)))) / 0.6745
        for end, part in (("begins", values[:count]), ("ends", values[-count:])):
            still = float(np.ptp(np.convolve(part, np.ones(count // 4) / (count // 4), "valid")))
            level = float(np.mean(part))
            if abs(level) > FELT * STANDARD_GRAVITY and still < 0.2 * abs(level) + 2 * noise:
                return (
                    f"The {name}'s accelerometer feels {level:.1f} m/s^2 at rest where the record "
                    f"{end}: gravity, which this model has not. It is for motions in a level plane."
                )
        if abs(float(np.mean(values))) > MEAN * STANDARD_GRAVITY:
            return (
                f"The {name}'s accelerometer feels {np.mean(values):.1f} m/s^2 on the average: "
                "gravity, which this model has not. It is for motions in a level plane."
            )
    return ""


def _compared(
    hand: np.ndarray, head: np.ndarray, rate: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Both below `BAND`, at a rate that is enough for it."""
    hand, head = np.asarray(hand, dtype=float), np.asarray(head, dtype=float)
    if len(hand) != len(head) or len(hand) < rate / 2 or not np.isfinite([hand, head]).all():
        raise ValueError(
            "hand and head: expected as many finite samples of each, half a second at least, found "
            f"{len(hand)} and {len(head)}. Mend: align the two channels first."
        )
    if float(np.std(hand)) <= 1e-12:
        raise ValueError(
            "hand: expected an acceleration that changes, found none. Mend: check the channel."
        )
    cutoff = min(BAND, 0.4 * rate)
    stride = max(1, math.floor(rate / (6 * cutoff)))
    hand, head = (zero_phase_lowpass(one, rate, cutoff)[::stride] for one in (hand, head))
    return hand, head, rate / stride


def _profile(
    hand: np.ndarray, head: np.ndarray, rate: float, frequency: float | None
) -> list[_Trial]:
    """The best frequency for each of `RATIOS`, from the widest resonance to the sharpest."""
    if frequency is not None:
        return [_trial(hand, head, rate, ratio, frequency) for ratio in RATIOS]
    low, high, count = FREQUENCIES
    grid, found = np.linspace(low, high, count), []
    for ratio in RATIOS[::-1]:
        if ratio > WIDE or not found:
            best = min((_trial(hand, head, rate, ratio, one) for one in grid), key=_misfit)
        else:  # the next sharper resonance lies within the width of the last one
            best = _trial(hand, head, rate, ratio, found[-1].frequency)
            step = 0.7 * ratio * best.frequency
            for _ in range(5):
                near = [best.frequency - step, best.frequency + step]
                near = [one for one in near if low <= one <= high]
                tried = (_trial(hand, head, rate, ratio, one) for one in near)
                best = min([best, *tried], key=_misfit)
                step /= 1.8
        found.append(best)
    return found[::-1]


def _trial(
    hand: np.ndarray, head: np.ndarray, rate: float, ratio: float, frequency: float
) -> _Trial:
    omega = 2 * math.pi * frequency
    top, bottom = [2 * ratio * omega, omega**2], [1.0, 2 * ratio * omega, omega**2]
    discrete: Any = cont2discrete((top, bottom), 1 / rate, method="foh")
    moved = np.asarray(lfilter(np.ravel(discrete[0]), discrete[1], hand - hand[0]))
    columns = np.stack([np.ones(len(head)), moved], axis=1)
    weights, *_ = np.linalg.lstsq(columns, head, rcond=None)
    predicted = columns @ weights
    misfit = float(np.mean((head - predicted) ** 2))
    variance = misfit / float(np.sum((moved - moved.mean()) ** 2))
    return _Trial(misfit, frequency, predicted, float(weights[1]), variance)


def _independent(residual: np.ndarray) -> float:
    """Samples of a residual that count as independent, by its correlation in time."""
    own = residual - residual.mean()
    power = np.correlate(own, own, mode="full")[len(own) - 1 :]
    share = power / power[0]
    first = int(np.argmax(share < 0.05)) or len(share)
    return len(own) / (1 + 2 * float(np.sum(share[1:first])))


def _cycles(ratio: float) -> float:
    if ratio >= 1.0:
        return 0.0
    return -math.log(LEFT) * math.sqrt(1 - ratio**2) / (2 * math.pi * ratio)


def _ratio_of(cycles: float) -> float:
    """The damping ratio at which so many cycles show."""
    decrement = -math.log(LEFT) / cycles
    return decrement / math.hypot(2 * math.pi, decrement)


def _sentence(status: str, ratio: float, low: float, high: float, frequency: float) -> str:
    most = "no upper bound" if math.isinf(high) else f"{high:.2g}"
    span = f"damping ratio {ratio:.2g} ({low:.2g} to {most})"
    if status == PRESENT:
        return (
            f"The club oscillates at {frequency:.2f} Hz, {span}: {_cycles(ratio):.1f} cycles show."
        )
    if status == ABSENT:
        return f"The head follows the hand and does not oscillate: equivalent {span}."
    return f"This record does not tell whether the club oscillates: {span}."
