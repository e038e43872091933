"""The robot's own lag, taken out by its feedback: an iteration with a stated contraction."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from .profile import SwingProfile

FINE = 2000.0
"""Samples a second on which motions are compared [Hz]."""

CORNER = 25.0
"""Frequency up to which a lag is taken out, by default [Hz]; feedback at 250 Hz knows more, and
noise."""

SEEN = 0.02
"""Share of the strongest line of the spectrum of velocity from which a frequency counts [-]."""

QUIET = 0.5
"""How long a motion is held beyond both ends, so that its spectrum does not wrap around [s]."""

EASED = 0.03
"""How long before both ends of the command a correction fades, so that it begins and ends at rest
[s]."""

_AXES = ("arm", "wrist", "grip")


@dataclass(frozen=True)
class Feedback:
    """What the robot says that its axes did.

    Attributes:
        times: of the samples, usually 250 a second, shape (n,) [s].
        angles: one column an axis, shape (n, 3) [rad].
    """

    times: np.ndarray
    angles: np.ndarray

    def __post_init__(self) -> None:
        if self.angles.shape != (len(self.times), len(_AXES)) or len(self.times) < 8:
            raise ValueError(
                f"feedback: expected angles of shape (n, {len(_AXES)}) over at least 8 times, "
                f"found {self.angles.shape}. Mend: give arm, wrist and grip, 0 where not moved."
            )
        if not (np.isfinite(self.angles).all() and np.all(np.diff(self.times) > 0)):
            raise ValueError(
                "feedback: expected finite angles at ascending times, found others. "
                "Mend: remove lost samples."
            )


@dataclass(frozen=True)
class Lag:
    """How late an axis is.

    Attributes:
        axis: arm, wrist or grip.
        delay: [s].
        constant: of a first-order lag after it [s].
        left: rms of what this lag does not explain [rad].
    """

    axis: str
    delay: float
    constant: float
    left: float


@dataclass(frozen=True)
class Round:
    """One round of the iteration.

    Attributes:
        profile: what to command next.
        lags: as they were found, one an axis that moves.
        error: largest distance of the feedback from what is wanted [rad].
        impact_error: the same at impact, over the axes [rad].
        contraction: share of the error's rms that the next round is to leave; what shakes at
            frequencies that the swing hardly holds is not counted on to shrink [-].
        worst: largest factor at any frequency that the swing holds; below 1 the iteration
            converges, whatever the lag's exact law [-].
        times: within the swing, shape (t,) [s].
        errors: what is wanted less the feedback, one column an axis, shape (t, 3) [rad].
        frequencies: shape (f,) [Hz].
        factors: by which an error is multiplied at each frequency, one column an axis; nan where
            the swing does not hold the frequency, shape (f, 3) [-].
    """

    profile: SwingProfile
    lags: tuple[Lag, ...]
    error: float
    impact_error: float
    contraction: float
    worst: float
    times: np.ndarray
    errors: np.ndarray
    frequencies: np.ndarray
    factors: np.ndarray

    @property
    def converges(self) -> bool:
        """Whether every frequency of the swing shrinks from round to round."""
        return self.worst < 1.0

    @property
    def sentence(self) -> str:
        """What to expect, in words."""
        says = "converges" if self.converges else "need not converge"
        return (
            f"The robot is off by up to {np.degrees(self.error):.3g}°, at impact "
            f"{np.degrees(self.impact_error):.3g}°; the next round should leave at "
            f"most {100 * self.contraction:.2g} % of it. The iteration {says}: its factor is at "
            f"most {self.worst:.2g} at any frequency of the swing."
        )


def correct_lag(
    wanted: SwingProfile, commanded: SwingProfile, feedback: Feedback, corner: float = CORNER
) -> Round:
    """What to command so that the robot does what is wanted.

    The error is run backwards through the lag that the records show (advanced by its delay, its
    first-order lag undone), low-passed without phase, and added to the command. At a frequency w
    an error is multiplied by ``1 - Q(w) G(w) / L(w)``, with the lag L as modelled, G as the
    spectra of command and feedback show it, and Q the low-pass: the contraction is that number.
    Near both ends, where a command must rest, less is corrected, see `EASED`.

    Args:
        wanted: what the axes should do.
        commanded: what they were told.
        feedback: what they did.
        corner: of the low-pass [Hz].

    Returns:
        The next command and what to expect of it.

    Raises:
        ValueError: where the feedback does not cover the swing, or the corner is above what it
            can show.
    """
    rate = float(1.0 / np.median(np.diff(feedback.times)))
    if not 0.0 < corner < 0.4 * rate:
        raise ValueError(
            f"feedback: expected a corner below {0.4 * rate:.3g} Hz, two fifths of its rate, found "
            f"{corner:g} Hz. Mend: lower it."
        )
    end = float(wanted.time[-1])
    if feedback.times[0] > 1.0 / rate or feedback.times[-1] < end - 1.0 / rate:
        found = f"{feedback.times[0]:g} to {feedback.times[-1]:g} s"
        raise ValueError(
            f"feedback: expected samples from 0 to {end:g} s, found {found}. "
            "Mend: record the whole swing."
        )
    times = np.arange(-QUIET, end + QUIET, 1.0 / FINE)
    aims, told = wanted.at(times).angles, commanded.at(times).angles
    did = np.stack([_between(times, feedback, axis) for axis in range(3)], axis=1)
    inside = (times >= 0.0) & (times <= end)
    moving = [axis for axis in range(3) if np.ptp(told[:, axis]) > 0.0]
    angles, lags, parts = np.array(commanded.angles), [], []
    frequencies = np.fft.rfftfreq(len(times), 1.0 / FINE)
    factors = np.full((len(frequencies), 3), np.nan)
    for axis in moving:
        lag = lag_of(_AXES[axis], times, told[:, axis], did[:, axis])
        error = aims[:, axis] - did[:, axis]
        turn = 2j * np.pi * frequencies
        model = np.exp(-turn * lag.delay) / (1.0 + turn * lag.constant)
        low = np.exp(-((np.abs(turn) / (2 * np.pi * corner)) ** 4))
        spectrum = np.fft.rfft(error)
        step = _eased(times, end) * np.fft.irfft(low / model * spectrum, len(times))
        angles[:, axis] += np.interp(commanded.time, times, step)
        seen, law = _seen(told[:, axis], did[:, axis])
        factors[seen, axis] = np.abs(1.0 - low / model * law)[seen]
        after = error - np.fft.irfft(law * np.fft.rfft(step), len(times))
        parts.append((float(np.sum(after[inside] ** 2)), float(np.sum(error[inside] ** 2))))
        lags.append(lag)
    total = sum(whole for _, whole in parts)
    contraction = float(np.sqrt(sum(left for left, _ in parts) / total)) if total else 0.0
    errors = (aims - did)[inside]
    off = np.abs(errors)
    hit = int(np.argmin(np.abs(times[inside] - wanted.impact_time)))
    profile = replace(
        commanded, arm_angle=angles[:, 0], wrist_angle=angles[:, 1], grip_angle=angles[:, 2]
    )
    return Round(
        profile, tuple(lags), float(off.max()), float(off[hit].max()), contraction,
        float(np.nanmax(factors, initial=0.0)), times[inside], errors, frequencies, factors,
    )  # fmt: skip


def _eased(times: np.ndarray, end: float) -> np.ndarray:
    """A share that leaves 0 and comes back to it without velocity, acceleration and jerk [-]."""
    inner = np.clip(np.minimum(times, end - times) / EASED, 0.0, 1.0)
    return inner**4 * (35.0 + inner * (-84.0 + inner * (70.0 - 20.0 * inner)))


def _seen(told: np.ndarray, did: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which frequencies the swing holds, and what the axis makes of them; of others, nothing.

    An error of which nothing is known is not counted on to shrink.
    """
    rates = np.fft.rfft(np.gradient(told)), np.fft.rfft(np.gradient(did))
    size = np.abs(rates[0])
    seen = size > SEEN * size.max()
    return seen, np.where(seen, rates[1] / np.where(seen, rates[0], 1.0), 0.0)


def lag_of(axis: str, times: np.ndarray, told: np.ndarray, did: np.ndarray) -> Lag:
    """Delay and first-order lag of one axis.

    Args:
        axis: its name.
        times: equally spaced, shape (n,) [s].
        told: what it was told, at rest at both ends, shape (n,) [rad].
        did: what it did, shape (n,) [rad].

    Returns:
        The lag that explains most in least squares.
    """
    turn = 2j * np.pi * np.fft.rfftfreq(len(times), times[1] - times[0])
    drift = np.linspace(0.0, 1.0, len(times)) * (told[-1] - told[0]) + told[0]
    even = np.fft.rfft(told - drift)  # the same at both ends, so that it does not leap

    def late(p: np.ndarray) -> np.ndarray:
        model = np.exp(-turn * p[0]) / (1.0 + turn * p[1])
        slope = (told[-1] - told[0]) / (times[-1] - times[0])
        return np.fft.irfft(model * even, len(times)) + drift - slope * (p[0] + p[1])

    inside = slice(len(times) // 10, -(len(times) // 10))

    def misses(p: np.ndarray) -> np.ndarray:
        return (late(p) - did)[inside]

    bounds = ([0.0, 0.0], [0.1, 0.1])
    found = least_squares(misses, [0.005, 0.005], bounds=bounds, x_scale=0.01)
    left = float(np.sqrt(np.mean(found.fun**2)))
    return Lag(axis, float(found.x[0]), float(found.x[1]), left)


def _between(times: np.ndarray, feedback: Feedback, axis: int) -> np.ndarray:
    """The feedback of an axis on finer times, held beyond its ends [rad]."""
    from scipy.interpolate import make_interp_spline

    course = make_interp_spline(feedback.times, feedback.angles[:, axis], k=3)
    return course(np.clip(times, feedback.times[0], feedback.times[-1]))
