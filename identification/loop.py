"""Load against displacement: slope of the loop, phase by two roads, damping, and all doubts."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import butter, sosfiltfilt

from .coupon import Coupon
from .signals import dominant_frequency

HARMONICS = 3
"""Harmonics that a run is described by [-]."""

PERIODS_A_SEGMENT = 4.0
"""Periods of one segment of the cross-spectrum [-]."""

FEWEST_PERIODS = 2.0
"""Periods below which there is no phase [-]."""

LEAST_SIGMAS = 2.0
"""A phase closer to zero than so many standard deviations is not told [-]."""

MOST_OPEN = 0.02
"""Largest gap of a loop, as a share of the span of its load, that passes for closed [-]."""

MOST_FLAT = 0.2
"""Largest share of samples within 2 % of an extreme; a sine has 0.09 [-]."""

RESOLVED = 0.45
"""Highest frequency that samples tell, in cycles a sample [-]; half would be the limit."""

SMOOTH = 12.0
"""Samples a period below which the few at an extreme say nothing of a flat top [-]."""

MOST_DISTORTED = 0.1
"""Largest harmonic of the load, as a share of its fundamental, that passes in silence [-]."""

APART = 4.0
"""Two phases so many standard deviations apart do not agree [-]."""

GOOD = "good"
SATURATED = "saturated"
OPEN = "open_loop"
NO_PHASE = "phase_not_told"
STIFFNESS_ONLY = "stiffness_only"


@dataclass(frozen=True)
class Loop:
    """What one run tells.

    Attributes:
        coupon: the run.
        frequency: of the displacement [Hz]; 0 for a single loading.
        periods: how many there are [-].
        amplitude: of the displacement [m].
        load_amplitude: of the load [N].
        stiffness: slope of the loop, the part in phase [N/m].
        stiffness_std: its standard deviation [N/m].
        loss_stiffness: the part out of phase [N/m]; nan where there is no phase.
        loss_stiffness_std: its standard deviation [N/m].
        phase: by which the load leads, from the cross-spectrum [rad]; nan where there is none.
        phase_std: its standard deviation, with what the machine cannot resolve [rad].
        phase_by_peaks: from the instants of the extremes [rad].
        phase_by_peaks_std: its standard deviation [rad].
        gap: by how much a loop fails to close, as a share of the span of its load [-].
        status: ``good``, ``saturated``, ``open_loop``, ``phase_not_told`` or ``stiffness_only``.
        warnings: what is in doubt, in sentences.
    """

    coupon: Coupon
    frequency: float
    periods: float
    amplitude: float
    load_amplitude: float
    stiffness: float
    stiffness_std: float
    loss_stiffness: float
    loss_stiffness_std: float
    phase: float
    phase_std: float
    phase_by_peaks: float
    phase_by_peaks_std: float
    gap: float
    status: str
    warnings: tuple[str, ...]

    @property
    def tan_delta(self) -> float:
        """Loss over storage, thesis eq. 18 [-]."""
        return self.loss_stiffness / self.stiffness

    @property
    def tan_delta_std(self) -> float:
        """Its standard deviation [-]."""
        return self.phase_std / np.cos(self.phase) ** 2

    @property
    def damping(self) -> float:
        """Equivalent dashpot ``k tan(delta) / omega``, thesis eq. 21 [N s/m]."""
        return equivalent_damping(self.stiffness, self.tan_delta, self.frequency)

    @property
    def damping_std(self) -> float:
        """Its standard deviation [N s/m]."""
        return self.loss_stiffness_std / (2 * np.pi * self.frequency)


def equivalent_damping(stiffness: float, tan_delta: float, frequency: float) -> float:
    """Dashpot beside a spring that loses what the material loses at one frequency.

    Args:
        stiffness: in phase [N/m].
        tan_delta: loss over storage [-].
        frequency: [Hz].

    Returns:
        ``k tan(delta) / omega`` [N s/m].

    Source: thesis eq. 18, 19a and 21 (lines 1216-1240), with ``E'' A / h = k tan(delta)``.
    """
    return stiffness * tan_delta / (2 * np.pi * frequency)


def measure_loop(coupon: Coupon) -> Loop:
    """Stiffness, phase and damping of one run, each with its error, and what is in doubt.

    Args:
        coupon: the run [SI].

    Returns:
        The loop; doubts are in its status and warnings.

    Raises:
        ValueError: where the displacement does not move to and fro, or less than one period is
            there.
    """
    frequency = dominant_frequency(coupon.displacement, coupon.rate) or 0.0
    duration = len(coupon.load) / coupon.rate
    if frequency * duration < FEWEST_PERIODS:
        return _single_loading(coupon)
    return _Run(coupon, _refined(coupon, frequency)).loop()


def _basis(times: np.ndarray, frequency: float) -> np.ndarray:
    """Constant, drift, and cosine and sine of each harmonic, shape (n, 2 + 2 harmonics).

    Harmonics that the samples are too few for are zero: they would stand for lower ones.
    """
    angles = 2 * np.pi * frequency * times
    drift = times / times[-1] - 0.5
    seen = [h == 1 or h * frequency * times[1] < RESOLVED for h in range(1, HARMONICS + 1)]
    waves = [s * f(h * angles) for h, s in enumerate(seen, 1) for f in (np.cos, np.sin)]
    return np.stack([np.ones_like(times), drift, *waves], axis=1)


def _refined(coupon: Coupon, frequency: float) -> float:
    """The frequency at which harmonics describe the displacement best [Hz]."""
    times = np.arange(len(coupon.load)) / coupon.rate
    size = np.std(coupon.displacement)

    def rest(log_ratio: np.ndarray) -> np.ndarray:
        basis = _basis(times, frequency * float(np.exp(log_ratio[0])))
        weights, *_ = np.linalg.lstsq(basis, coupon.displacement, rcond=None)
        return (coupon.displacement - basis @ weights) / size

    reach = 0.5 / (frequency * times[-1])
    found = least_squares(rest, [0.0], bounds=(-reach, reach), x_scale=0.1 * reach, xtol=1e-12)
    return frequency * float(np.exp(found.x[0]))


class _Run:
    """One run while it is measured."""

    def __init__(self, coupon: Coupon, frequency: float) -> None:
        self.coupon, self.frequency = coupon, frequency
        n = len(coupon.load)
        self.times = np.arange(n) / coupon.rate
        self.periods = n * frequency / coupon.rate
        self.basis = _basis(self.times, frequency)
        self.weights, *_ = np.linalg.lstsq(
            self.basis, np.stack([coupon.load, coupon.displacement], axis=1), rcond=None
        )
        self.rests = np.stack([coupon.load, coupon.displacement], axis=1) - (
            self.basis @ self.weights
        )

    def amplitude(self, which: int, harmonic: int = 1) -> float:
        """Of the load (0) or the displacement (1)."""
        return float(np.hypot(*self.weights[2 * harmonic : 2 * harmonic + 2, which]))

    def crossed(self) -> np.ndarray:
        """Cross-spectrum of each segment, a whole number of periods long, at the frequency."""
        whole = min(PERIODS_A_SEGMENT, np.floor(self.periods + 1e-6))
        length = round(whole * self.coupon.rate / self.frequency)
        length = min(length, len(self.times))
        starts = range(0, len(self.times) - length + 1, max(length // 2, 1))
        window = np.hanning(length + 1)[:-1]
        wave = window * np.exp(-2j * np.pi * self.frequency * self.times[:length])
        both = np.stack([self.coupon.load, self.coupon.displacement], axis=1)
        both = both - self.basis[:, :2] @ self.weights[:2]  # without rest level and drift
        lines = np.array([wave @ both[start : start + length] for start in starts])
        self.auto = np.abs(lines[:, 1]) ** 2
        return lines[:, 0] * np.conj(lines[:, 1])

    def loop(self) -> Loop:
        """Everything that the run tells."""
        crossed = self.crossed()
        whole = complex(np.sum(crossed) / np.sum(self.auto))
        flipped = whole.real < 0
        whole = -whole if flipped else whole
        noise = self._noise(crossed, abs(whole))
        phase, size = float(np.angle(whole)), abs(whole)
        blind = self._blind()
        phase_std = float(np.hypot(noise, blind))
        peaks, peaks_std = _phase_by_peaks(self.coupon, self.frequency, flipped)
        found = Loop(
            self.coupon,
            self.frequency,
            self.periods,
            self.amplitude(1),
            self.amplitude(0),
            whole.real,
            float(size * np.hypot(noise * np.cos(phase), phase_std * np.sin(phase))),
            whole.imag,
            float(size * np.hypot(noise * np.sin(phase), phase_std * np.cos(phase))),
            phase,
            phase_std,
            peaks,
            float(np.hypot(peaks_std, blind)),
            self._gap(whole.real, flipped),
            GOOD,
            (),
        )
        return _judged(found, flipped, self.amplitude(0, 2), self.amplitude(0, 3))

    def _noise(self, crossed: np.ndarray, size: float) -> float:
        """Standard deviation of the complex ratio, of one of its parts, as a share of it."""
        quiet = self.rests.std(axis=0, ddof=min(len(self.times) - 1, self.basis.shape[1]))
        # a Hann window keeps 2/3 of the samples' worth of a line
        white = float(np.hypot(quiet[0] / self.amplitude(0), quiet[1] / self.amplitude(1)))
        white *= np.sqrt(2.0 / (2 / 3 * len(self.times)))
        if len(crossed) < 4:
            return float(white)
        each = crossed / self.auto
        scatter = np.sqrt(np.mean(np.abs(each - each.mean()) ** 2) / 2)
        # half-overlapping Hann windows are almost independent: 0.9 of their number counts
        return float(max(white, scatter / size / np.sqrt(0.9 * len(crossed) - 1)))

    def _blind(self) -> float:
        """What the machine cannot resolve of a phase [rad]: its steps and its delay."""
        per_period = self.coupon.rate / self.frequency
        load, moved = (step / self.amplitude(i) for i, step in enumerate(self.coupon.steps))
        coarse = np.hypot(load, moved) / np.sqrt(12.0) * np.sqrt(2.0 / per_period)
        return float(np.hypot(coarse, 2 * np.pi * self.frequency * self.coupon.delay))

    def _gap(self, stiffness: float, flipped: bool) -> float:
        drifts = self.weights[1] / self.periods
        load = -drifts[0] if flipped else drifts[0]
        return float(abs(load - stiffness * drifts[1]) / (2 * self.amplitude(0)))


def _phase_by_peaks(coupon: Coupon, frequency: float, flipped: bool) -> tuple[float, float]:
    """Mean distance of the extremes of load and displacement, thesis eq. 20, and its error [rad].

    Both are passed through one low-pass without delay at five times the frequency; an extreme is
    the top of a parabola through a fourth of a period.
    """
    rate = coupon.rate
    cut = min(5 * frequency, 0.45 * rate)
    sections = butter(4, cut, fs=rate, output="sos")
    load = -coupon.load if flipped else coupon.load
    pad = min(len(load) - 1, round(2 * rate / frequency))
    smooth = [sosfiltfilt(sections, y - y.mean(), padlen=pad) for y in (load, coupon.displacement)]
    period, n = rate / frequency, len(load)
    reach = max(int(period / 8), 2)
    gaps = []
    for sign in (1.0, -1.0):
        first = int(np.argmax(sign * smooth[1][: int(np.ceil(1.25 * period))]))
        for k in range(int(n / period) + 1):
            near = round(first + k * period)
            tops = [_top(sign * y, near, reach, n, period) for y in smooth]
            if all(top is not None for top in tops):
                gaps.append((tops[1] or 0.0) - (tops[0] or 0.0))
    if not gaps:
        return float("nan"), float("nan")
    phases = 2 * np.pi * np.array(gaps) / period
    spread = float(np.std(phases, ddof=1) / np.sqrt(len(phases))) if len(phases) > 1 else np.pi
    return float(np.mean(phases)), spread


def _top(y: np.ndarray, near: int, reach: int, n: int, period: float) -> float | None:
    """Instant of the extreme nearest to a sample [samples], away from the ends of the run."""
    half = int(period / 3)
    if near - half - reach < period / 4 or near + half + reach >= n - period / 4:
        return None
    top = near - half + int(np.argmax(y[near - half : near + half + 1]))
    at = np.arange(-reach, reach + 1)
    bend, slope, _ = np.polyfit(at, y[top - reach : top + reach + 1], 2)
    return top - slope / (2 * bend) if bend < 0 else None


def _single_loading(coupon: Coupon) -> Loop:
    """The slope of the middle half of the loading, where there is less than a phase needs.

    Source: thesis lines 1184-1190: loading before unloading, and a value from the middle.
    """
    moved = coupon.displacement - coupon.displacement[0]
    end = int(np.argmax(np.abs(moved)))
    travel = moved[: end + 1] * np.sign(moved[end])
    middle = np.flatnonzero((travel > 0.25 * travel[-1]) & (travel < 0.75 * travel[-1]))
    if len(middle) < 5:
        raise ValueError(
            f"{coupon.path}: displacement: expected a loading of at least 10 samples, found "
            f"{len(travel)}. Mend: name the right column, or sample faster."
        )
    x, y = coupon.displacement[middle], coupon.load[middle]
    away = x - x.mean()
    slope = float(away @ (y - y.mean()) / (away @ away))
    rest = y - y.mean() - slope * away
    std = float(np.sqrt(rest @ rest / (len(x) - 2) / (away @ away)))
    span, resolution = float(np.ptp(y)), coupon.steps[0]
    warnings = [
        f"{coupon.name} holds less than {FEWEST_PERIODS:g} periods: it tells a stiffness, no phase."
    ]
    none, status = float("nan"), STIFFNESS_ONLY
    if coupon.clipped:
        status = SATURATED
        warnings.append(_saturation(coupon))
    elif abs(slope) < LEAST_SIGMAS * max(std, resolution / np.ptp(x)):
        warnings.append(
            f"{coupon.name}: the load changes by {span:.3g} N over the middle of the loading, "
            f"where {max(resolution, std * np.ptp(x)):.3g} N can be told: no stiffness either."
        )
        status = NO_PHASE
    return Loop(
        coupon, 0.0, 0.0, float(np.ptp(coupon.displacement) / 2), float(np.ptp(coupon.load) / 2),
        abs(slope), std, none, none, none, none, none, none, 0.0, status, tuple(warnings),
    )  # fmt: skip


def _judged(loop: Loop, flipped: bool, second: float, third: float) -> Loop:
    """The same loop with its status and warnings."""
    coupon, name, said, statuses = loop.coupon, loop.coupon.name, list(loop.coupon.warnings), []
    if flipped:
        said.append(f"{name}: load and displacement have opposite signs; the load was turned.")
    flat = [
        word
        for word, y in (("load", coupon.load), ("displacement", coupon.displacement))
        for end in (y.max(), y.min())
        if coupon.rate > SMOOTH * loop.frequency
        and np.mean(np.abs(y - end) < 0.02 * np.ptp(y)) > MOST_FLAT
    ]
    if coupon.clipped or flat:
        statuses.append(SATURATED)
        said.append(_saturation(coupon, flat))
    if loop.gap > MOST_OPEN:
        statuses.append(OPEN)
        said.append(
            f"{name}: a loop does not close: from one to the next the load creeps by "
            f"{100 * loop.gap:.2g} % of its span. Let the sample settle, and cut the beginning off."
        )
    if loop.load_amplitude < coupon.steps[0] or loop.amplitude < coupon.steps[1]:
        statuses.append(NO_PHASE)
        said.append(
            f"{name}: a load of {loop.load_amplitude:.3g} N and a travel of {loop.amplitude:.3g} m "
            f"are below what the machine tells ({coupon.steps[0]:.3g} N, {coupon.steps[1]:.3g} m)."
        )
    elif loop.phase < LEAST_SIGMAS * loop.phase_std:
        statuses.append(NO_PHASE)
        said.append(
            f"{name}: the phase {loop.phase:.3g} rad cannot be told from none: the machine and the "
            f"noise leave {loop.phase_std:.2g} rad. Drive it further, or sample longer."
        )
    if max(second, third) > MOST_DISTORTED * loop.load_amplitude:
        share = 100 * max(second, third) / loop.load_amplitude
        said.append(
            f"{name}: the load is no sine, a harmonic has {share:.0f} % of it: "
            "the sample is not linear over this travel."
        )
    spread = np.hypot(loop.phase_std, loop.phase_by_peaks_std)
    if abs(loop.phase - loop.phase_by_peaks) > APART * spread + 0.01:
        said.append(
            f"{name}: the phase is {loop.phase:.3g} rad by the cross-spectrum and "
            f"{loop.phase_by_peaks:.3g} rad by the peaks, which do not agree."
        )
    return replace(loop, status=statuses[0] if statuses else GOOD, warnings=tuple(said))


def _saturation(coupon: Coupon, flat: list[str] | None = None) -> str:
    words = " and ".join(dict.fromkeys([*coupon.clipped, *(flat or [])]))
    return (
        f"{coupon.name}: {words} stands on flat tops: the machine saturates or the plate lifts "
        "off. Reduce the travel, or use a larger range."
    )
