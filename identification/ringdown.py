"""Modes of a ring-down: decrement, envelope, matrix pencil, and the likeliest modes with errors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import decimate, hilbert

from .backbone import extrema_of, period_of
from .noise import Noise, choose_noise

MOST_FOR_PENCIL = 900
"""Samples that the matrix pencil looks at [-]; longer records are thinned first."""

PER_PERIOD = 8.0
"""Samples a period of the main frequency that thinning leaves at least [-]."""

WORTH = 10.0
"""Fall of BIC that a further mode must bring [-]; Kass and Raftery 1995 call 10 very strong."""

MOST_DAMPED = 0.5
"""Damping ratio beyond which a pole is no ring [-]."""

BLOCKS = 12
"""Blocks of a jackknife [-]."""

GOOD = "The modes explain the ring-down."
LEFT = "The ring-down holds more than these modes and noise: its modes may change with amplitude."
NOTHING = "Nothing rings."


@dataclass(frozen=True)
class Ring:
    """One decaying oscillation.

    Attributes:
        frequency: damped [Hz].
        frequency_std: its standard error [Hz].
        damping_ratio: decay rate over the undamped angular frequency [-].
        damping_ratio_std: its standard error [-].
        amplitude: at the first sample [unit of the values].
    """

    frequency: float
    frequency_std: float
    damping_ratio: float
    damping_ratio_std: float
    amplitude: float


@dataclass(frozen=True, eq=False)
class RingDown:
    """The modes of a ring-down.

    Attributes:
        rings: by falling amplitude.
        rest: level about which it rings [unit of the values].
        noise: law of what is left [unit of the values].
        predicted: sum of the modes and the level, shape (t,) [unit of the values].
        status: one sentence.
    """

    rings: tuple[Ring, ...]
    rest: float
    noise: Noise
    predicted: np.ndarray
    status: str


def log_decrement(values: np.ndarray, rate: float) -> Ring:
    """The naive reading: a line through the logarithms of the peaks, and one through their times.

    A second mode, an offset that wanders and loud noise all bend it; errors are those of a
    jackknife over blocks of peaks.

    Args:
        values: a ring-down from its first free sample on, shape (t,) [any unit].
        rate: samples a second [Hz].

    Returns:
        The mode; all of it 0 where fewer than six peaks stand out.
    """
    period = period_of(values)
    noise = float(np.std(np.diff(values, 3)) / np.sqrt(20.0))
    places, extrema = extrema_of(values, period, 6.0 * noise)
    if len(places) < 6:
        return Ring(0.0, 0.0, 0.0, 0.0, 0.0)
    height = np.abs(extrema[1:-1] - 0.5 * (extrema[:-2] + extrema[2:])) / 2.0
    times, turns = places[1:-1] / rate, np.arange(len(height)) / 2.0
    loud = height > max(3.0 * noise, 1e-3 * float(height.max()))
    return _jackknifed(times[loud], np.log(height[loud]), turns[loud])


def hilbert_envelope(values: np.ndarray, rate: float) -> Ring:
    """Lines through the logarithm of the envelope and through the phase of the analytic signal.

    Args:
        values: a ring-down of one mode from its first free sample on, shape (t,) [any unit].
        rate: samples a second [Hz].

    Returns:
        The mode, with errors of a jackknife; all of it 0 where nothing stands out.

    Source: Feldman 2011, Hilbert Transform Applications in Mechanical Vibration, chapter 4.
    """
    period = period_of(values)
    count, edge = len(values), int(1.5 * period) + 1
    if count < 4 * edge:
        return Ring(0.0, 0.0, 0.0, 0.0, 0.0)
    rest = float(np.mean(values[-max(8, count // 3) :]))
    analytic = np.asarray(hilbert(values - rest))
    size, turns = np.abs(analytic), np.unwrap(np.angle(analytic)) / (2 * np.pi)
    noise = float(np.std(np.diff(values, 3)) / np.sqrt(20.0))
    quiet = np.flatnonzero(size[edge:-edge] < max(4.0 * noise, 0.03 * float(size.max())))
    stop = edge + (int(quiet[0]) if len(quiet) else count - 2 * edge)
    if stop - edge < 2 * period:
        return Ring(0.0, 0.0, 0.0, 0.0, 0.0)
    inside = slice(edge, stop)
    return _jackknifed(np.arange(count)[inside] / rate, np.log(size[inside]), turns[inside])


def _jackknifed(times: np.ndarray, level: np.ndarray, turns: np.ndarray) -> Ring:
    """Slopes of log size and of turns against time, with errors from leaving blocks out."""

    def read(keep: np.ndarray) -> np.ndarray:
        decay, first = np.polyfit(times[keep], level[keep], 1)
        beat = 2 * np.pi * float(np.polyfit(times[keep], turns[keep], 1)[0])
        return np.array([beat / (2 * np.pi), -decay / np.hypot(beat, decay), first])

    index = np.arange(len(times))
    whole = read(index)
    blocks = np.array_split(index, min(BLOCKS, len(index) - 2))
    parts = np.array([read(np.setdiff1d(index, block)) for block in blocks])
    spread = np.sqrt((len(parts) - 1) * np.mean((parts - parts.mean(axis=0)) ** 2, axis=0))
    frequency, ratio, first = (float(value) for value in whole)
    return Ring(frequency, float(spread[0]), ratio, float(spread[1]), float(np.exp(first)))


def matrix_pencil(values: np.ndarray, rate: float, order: int) -> np.ndarray:
    """Poles of a sum of decaying oscillations, by the matrix pencil.

    Args:
        values: a ring-down, shape (t,) [any unit].
        rate: samples a second [Hz].
        order: how many poles; an oscillation has two, a level one.

    Returns:
        Complex poles [1/s], shape (order,).

    Source: Hua and Sarkar 1990, doi:10.1109/29.56027; tests/identification/test_ringdown.py.
    """
    pencil = len(values) // 2
    rows = np.lib.stride_tricks.sliding_window_view(values, pencil + 1)
    _, _, right = np.linalg.svd(rows, full_matrices=False)
    space = right[:order].T
    shifts = np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0]
    return np.log(np.linalg.eigvals(shifts).astype(complex)) * rate


def ring_modes(
    values: np.ndarray, rate: float, most: int = 4, count: int | None = None
) -> RingDown:
    """The likeliest modes of a ring-down, as many as its noise bears out, with error bars.

    The matrix pencil proposes; least squares over the whole record disposes, weighed by the noise
    law of what it leaves. Close modes are told apart as far as the record's length allows.

    Args:
        values: a ring-down from its first free sample on, shape (t,) [any unit].
        rate: samples a second [Hz].
        most: the most modes that are tried.
        count: how many modes there are, where that is known.

    Returns:
        The modes; none where nothing rings.

    Raises:
        ValueError: for fewer than 32 samples.

    Source: tests/identification/test_ringdown.py, coverage of its errors included.
    """
    if len(values) < 32:
        raise ValueError(
            f"ring-down: expected at least 32 samples, found {len(values)}. Mend: give more."
        )
    values = np.asarray(values, float)
    best = _Sum(np.zeros(0), values, rate)
    best_bic = len(values) * np.log(max(best.power, 1e-300)) if count is None else np.inf
    for modes in range(1, most + 1) if count is None else (count,):
        start = _proposed(values, rate, modes)
        if start is None:
            continue
        found = _least(_Sum(start, values, rate))
        bic = len(values) * np.log(max(found.power, 1e-300)) + 4 * modes * np.log(len(values))
        if bic < best_bic - WORTH:
            best, best_bic = found, bic
        elif count is None:
            break
    return _told(best)


@dataclass(frozen=True, eq=False)
class _Sum:
    """Decaying oscillations by (decay rate, angular frequency) pairs, solved for their sizes."""

    numbers: np.ndarray
    values: np.ndarray
    rate: float
    noise: Noise | None = None

    @property
    def times(self) -> np.ndarray:
        return np.arange(len(self.values)) / self.rate

    def columns(self) -> np.ndarray:
        """Level, then cosine and sine of each mode."""
        times, found = self.times, [np.ones(len(self.values))]
        for decay, beat in self.numbers.reshape(-1, 2):
            fall = np.exp(-decay * times)
            found += [fall * np.cos(beat * times), fall * np.sin(beat * times)]
        return np.stack(found, axis=1)

    def white(self, rows: np.ndarray) -> np.ndarray:
        return rows if self.noise is None else self.noise.whiten(rows)

    def solved(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Whitened columns, sizes, and whitened residual."""
        columns = self.white(self.columns())
        sizes = np.linalg.lstsq(columns, self.white(self.values), rcond=None)[0]
        return columns, sizes, self.white(self.values) - columns @ sizes

    @property
    def power(self) -> float:
        return float(np.mean(self.solved()[2] ** 2))

    def slopes(self, sizes: np.ndarray) -> np.ndarray:
        """Derivative of the sum by decay rates and frequencies, whitened, sizes held."""
        times, found = self.times, []
        for k, (decay, beat) in enumerate(self.numbers.reshape(-1, 2)):
            a, b = sizes[1 + 2 * k : 3 + 2 * k]
            fall = np.exp(-decay * times)
            cosine, sine = fall * np.cos(beat * times), fall * np.sin(beat * times)
            found += [-times * (a * cosine + b * sine), times * (b * cosine - a * sine)]
        return self.white(np.stack(found, axis=1))


def _proposed(values: np.ndarray, rate: float, modes: int) -> np.ndarray | None:
    """Decay rates and frequencies by the pencil, the loudest first; None where too few."""
    period = period_of(values)
    thin = int(min(period / PER_PERIOD, 12.0))
    kept = values
    if thin >= 2 and len(values) // thin > 64:
        kept = decimate(values, thin, ftype="fir", zero_phase=True)
    else:
        thin = 1
    kept = kept[:MOST_FOR_PENCIL]
    best, least = None, np.inf
    for order in (2 * modes + 1, 2 * modes + 5):
        poles = matrix_pencil(kept, rate / thin, min(order, len(kept) // 3))
        rings = poles[(np.imag(poles) > 1e-6) & (-np.real(poles) < MOST_DAMPED * np.abs(poles))]
        rings = rings[np.imag(rings) < 0.95 * np.pi * rate / thin]
        if len(rings) < modes:
            continue
        numbers = np.stack([np.maximum(-np.real(rings), 0.0), np.imag(rings)], axis=1)
        _, sizes, _ = _Sum(numbers.ravel(), kept, rate / thin).solved()
        weight = sizes[1::2] ** 2 + sizes[2::2] ** 2
        weight = weight / np.maximum(numbers[:, 0], rate / thin / len(kept))
        chosen = numbers[np.argsort(-weight)[:modes]].ravel()
        power = _Sum(chosen, kept, rate / thin).power
        if power < least:
            best, least = chosen, power
    return best


def _least(found: _Sum) -> _Sum:
    """Least squares over the whole record, from given decay rates and frequencies."""
    size = np.maximum(np.abs(found.numbers), 1e-3)
    low = np.tile([-0.05, 0.0], len(size) // 2) * np.repeat(size[1::2], 2)
    start = np.maximum(found.numbers, low + 1e-9 * size) / size

    def residual(x: np.ndarray) -> np.ndarray:
        return replace(found, numbers=x * size).solved()[2]

    def jacobian(x: np.ndarray) -> np.ndarray:
        """Kaufman's form: slopes at the best sizes, less what the columns already explain."""
        here = replace(found, numbers=x * size)
        columns, sizes, _ = here.solved()
        slopes = here.slopes(sizes) * size
        basis = np.linalg.qr(columns)[0]
        return -(slopes - basis @ (basis.T @ slopes))

    run = least_squares(
        residual,
        start,
        cast(Any, jacobian),
        bounds=(low / size, np.inf),
        x_scale="jac",
        max_nfev=60,
    )
    return replace(found, numbers=run.x * size)


def _told(found: _Sum) -> RingDown:
    """Noise law, weighed refit, errors, and the verdict."""
    values = found.values
    if not len(found.numbers):
        mean = float(np.mean(values))
        noise, _ = choose_noise(values - mean, np.full(len(values), mean))
        return RingDown((), mean, noise, np.full(len(values), mean), NOTHING)
    predicted = found.columns() @ found.solved()[1]
    noise, misfit = choose_noise(values - predicted, predicted)
    found = _least(replace(found, noise=noise))
    columns, sizes, _ = found.solved()
    whole = np.concatenate([found.slopes(sizes), columns], axis=1)
    grow = misfit.ratio if misfit.p_value < 1e-3 else 1.0
    covariance = np.linalg.pinv(whole.T @ whole, hermitian=True) * max(grow, 1.0)
    rings = []
    for k, (decay, beat) in enumerate(found.numbers.reshape(-1, 2)):
        part = covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2]
        size = float(np.hypot(decay, beat))
        slope = np.array([beat**2, -decay * beat]) / size**3
        rings.append(
            Ring(
                float(beat / (2 * np.pi)),
                float(np.sqrt(part[1, 1]) / (2 * np.pi)),
                float(decay / size),
                float(np.sqrt(slope @ part @ slope)),
                float(np.hypot(*sizes[1 + 2 * k : 3 + 2 * k])),
            )
        )
    rings.sort(key=lambda ring: -ring.amplitude)
    predicted = found.columns() @ sizes
    status = GOOD if misfit.p_value > 1e-3 else LEFT
    return RingDown(tuple(rings), float(sizes[0]), noise, predicted, status)
