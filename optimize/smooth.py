"""From measured angles to a profile from rest to rest: the thesis's old way and the smooth one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import ellip, sosfiltfilt

from .profile import POINTS, Interpolation, SwingProfile

FIRST, LAST = math.pi / 4, math.pi / 2
"""Arm's turn at the beginning and at the end that is not kept [rad]; thesis, section 8.2.2."""

EVERY = 8
"""Of so many measured points one is kept, by the smooth way only far from impact [-]."""

DENSE = 0.05
"""How far from impact the smooth way keeps every point [s]."""

BUILD, FOLLOW = 0.35, 0.5
"""Length of the exponential beginning and end [s]."""

STEEPNESS = 5.0
"""Time constants of the exponential in each of them [-]."""

CUTOFF = 20.0
"""Edge of the elliptic filter's pass band [Hz]."""

ORDER, RIPPLE, STOP = 5, 0.01, 60.0
"""Of the elliptic filter: order, odd so that rest stays where it is [-]; ripple and stop [dB]."""

LONGEST_END = 1.5
"""Longest beginning or end of constant acceleration [s]; slower crops are refused."""

Method = Literal["smooth", "thesis"]


@dataclass(frozen=True, eq=False)
class Track:
    """Measured angles.

    Attributes:
        times: even steps, shape (n,) [s].
        angles: arm, wrist and grip, shape (n, 3) [rad].
        impact_time: [s].
        top_time: top of the backswing [s]; None where it is not known.
    """

    times: np.ndarray
    angles: np.ndarray
    impact_time: float
    top_time: float | None = None


@dataclass(frozen=True)
class Smoothing:
    """How a profile is made of a track.

    Attributes:
        method: ``smooth`` or ``thesis``.
        begin: what is kept begins so long before impact [s]; None: where the arm has turned by 45
            degrees.
        end: and ends so long after it [s]; None: where the arm still turns by 90 degrees.
        build: length of the exponential beginning [s].
        follow: length of the exponential end [s].
        cutoff: edge of the filter's pass band [Hz].
        dense: how far from impact every point is kept [s].
        every: of so many points one is kept elsewhere [-].
    """

    method: Method = "smooth"
    begin: float | None = None
    end: float | None = None
    build: float = BUILD
    follow: float = FOLLOW
    cutoff: float = CUTOFF
    dense: float = DENSE
    every: int = EVERY


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A profile made of a track.

    Attributes:
        profile: what the robot shall play.
        track: what was measured.
        start: instant of the track at which the profile begins; before the track, where the
            beginning that was made up is longer than what it replaces [s].
        kept: first and last instant of the track that was kept [s].
        points: how many measured points were kept [-].
        at_impact: profile less track at impact: angles and velocities, shape (2, 3) [rad, rad/s].
        near: RMS of profile less track within 50 ms of impact, shape (3,) [rad].
    """

    profile: SwingProfile
    track: Track
    start: float
    kept: tuple[float, float]
    points: int
    at_impact: np.ndarray
    near: np.ndarray


@dataclass(frozen=True, eq=False)
class Spectrum:
    """What frequencies the accelerations hold, before and after.

    Attributes:
        frequencies: shape (f,) [Hz].
        before: amplitudes of the measured arm, wrist and grip, shape (f, 3) [rad/s^2].
        after: of the profile over the same instants, shape (f, 3) [rad/s^2].
    """

    frequencies: np.ndarray
    before: np.ndarray
    after: np.ndarray

    def above(self, frequency: float) -> np.ndarray:
        """What is left above a frequency [Hz], RMS after over RMS before, shape (3,) [-]."""
        high = self.frequencies > frequency
        sums = [np.sum(one[high] ** 2, axis=0) for one in (self.after, self.before)]
        return np.sqrt(sums[0] / np.maximum(sums[1], 1e-300))


def make_profile(
    track: Track,
    smoothing: Smoothing | None = None,
    quantum: float = 1e-4,
    interpolation: Interpolation = "cubic",
    swing_time: float | None = None,
) -> Smoothed:
    """Makes a profile of 1000 points an axis from measured angles.

    ``thesis`` replaces the arm's first 45 and last 90 degrees by a constant acceleration from rest
    and to rest, keeps every eighth point between, and joins them by a cubic spline. ``smooth``
    keeps every point near impact, makes exponential ends that meet the velocity of each axis, and
    passes the whole, forth and back, through an elliptic filter.

    Args:
        track: as measured.
        smoothing: how; the smooth way where None.
        quantum: of the robot's file [degrees].
        interpolation: of the robot.
        swing_time: the profile is played in this time [s]; as fast as measured where None.

    Returns:
        The profile, and how far it is from the track.

    Raises:
        ValueError: where too little would be kept, or impact would not.

    Source: thesis, sections 8.2.2 and 8.2.3; "linear acceleration" is read as a velocity that
    grows linearly, and the lengths, the filter's numbers and the cut are ours.
    """
    how = smoothing or Smoothing()
    first, last = _kept(track, how)
    chosen = _chosen(track, how, first, last)
    middle = CubicSpline(track.times[chosen], track.angles[chosen])
    begin, end = float(track.times[first]), float(track.times[last])
    motion, start, stop = (_with_ramps if how.method == "thesis" else _with_exponentials)(
        middle, begin, end, how
    )
    times = np.linspace(0.0, stop - start, POINTS)
    angles = motion(start + times)
    if how.method == "smooth":
        angles = _filtered(angles, times[1], how.cutoff)
    pace = 1.0 if swing_time is None else swing_time / times[-1]
    if not pace > 0.0:
        raise _wrong("swing_time", "more than 0 s", f"{swing_time:g}", "state it in s")
    phases = {"measured": begin - start, "crop": end - start}
    if track.top_time is not None and begin < track.top_time < end:
        phases["top"] = track.top_time - start
    profile = SwingProfile(
        pace * times, *angles.T, impact_time=pace * (track.impact_time - start), quantum=quantum,
        interpolation=interpolation,
        phases={name: pace * at for name, at in sorted(phases.items(), key=lambda each: each[1])},
    )  # fmt: skip
    near = np.abs(track.times - track.impact_time) <= DENSE
    there = profile.at(pace * (track.times[near] - start)).angles - track.angles[near]
    at = profile.at(np.array([profile.impact_time]))
    since = track.times[near] - track.impact_time  # a quintic, so that noise is not differentiated
    measured = np.polynomial.polynomial.polyfit(since, track.angles[near], min(5, len(since) - 1))
    apart = np.stack([at.angles[0] - measured[0], pace * at.velocities[0] - measured[1]])
    rms = np.sqrt(np.mean(there**2, axis=0))
    return Smoothed(profile, track, start, (begin, end), len(chosen), apart, rms)


def _wrong(name: str, expected: str, found: str, mend: str) -> ValueError:
    return ValueError(f"swing profile: {name}: expected {expected}, found {found}. Mend: {mend}.")


def _kept(track: Track, how: Smoothing) -> tuple[int, int]:
    """First and last frame that is kept."""
    turned = np.abs(track.angles[:, 0] - track.angles[0, 0])
    left = np.abs(track.angles[:, 0] - track.angles[-1, 0])
    if how.begin is None:
        first = int(np.argmax(turned >= FIRST)) if np.any(turned >= FIRST) else 0
    else:
        first = int(np.searchsorted(track.times, track.impact_time - how.begin))
    if how.end is None:
        far = np.flatnonzero(left >= LAST)
        last = int(far[-1]) if far.size else len(left) - 1
    else:
        last = int(np.searchsorted(track.times, track.impact_time + how.end, side="right")) - 1
    first, last = max(first, 0), min(last, len(track.times) - 1)
    if not track.times[first] < track.impact_time < track.times[last]:
        raise _wrong(
            "crop", "impact within what is kept",
            f"impact at {track.impact_time:.3f} s, kept from {track.times[first]:.3f} s to "
            f"{track.times[last]:.3f} s", "state 'begin' and 'end', in s from impact",
        )  # fmt: skip
    if last - first < 4 * how.every:
        expected = f"at least {4 * how.every + 1} frames to keep"
        mend = "crop less, or measure at a higher rate"
        raise _wrong("crop", expected, f"{last - first + 1}", mend)
    return first, last


def _chosen(track: Track, how: Smoothing, first: int, last: int) -> np.ndarray:
    frames = np.arange(first, last + 1)
    keep = (frames - first) % how.every == 0
    if how.method == "smooth":
        keep |= np.abs(track.times[first : last + 1] - track.impact_time) <= how.dense
    keep[-1] = True
    if (last - first) % how.every < how.every // 2:  # no point close to the last one
        place = (last - first) // how.every * how.every
        keep[place] = place == last - first
    return frames[keep]


Motion = Callable[[np.ndarray], np.ndarray]


def _with_ramps(
    middle: CubicSpline, begin: float, end: float, how: Smoothing
) -> tuple[Motion, float, float]:
    """Constant acceleration over the arm's first 45 degrees, and from its last 90 to rest."""
    speeds = middle(np.array([begin, end]), 1)
    lengths = []
    for turn, speed, name in ((FIRST, speeds[0, 0], "begin"), (LAST, speeds[1, 0], "end")):
        length = 2 * turn / max(abs(float(speed)), 1e-9)
        if length > LONGEST_END:
            expected = f"an arm that turns by {math.degrees(turn):.0f} degrees in {LONGEST_END:g} s"
            found = f"{math.degrees(abs(float(speed))):.3g} degrees/s at that end"
            raise _wrong(name, expected, found, f"state '{name}' where the arm is quicker")
        lengths.append(length)

    def ramp(share: np.ndarray) -> np.ndarray:
        return share**2 / 2

    return _joined(middle, begin, end, lengths[0], lengths[1], ramp)


def _with_exponentials(
    middle: CubicSpline, begin: float, end: float, how: Smoothing
) -> tuple[Motion, float, float]:
    """Velocities that grow from rest like ``exp(x) - 1 - x``, and die out the same way."""
    scale = math.exp(STEEPNESS) - 1 - STEEPNESS

    def grown(share: np.ndarray) -> np.ndarray:
        x = STEEPNESS * share
        return (np.exp(x) - 1 - x - x**2 / 2) / (STEEPNESS * scale)

    return _joined(middle, begin, end, how.build, how.follow, grown)


def _joined(
    middle: CubicSpline, begin: float, end: float, build: float, follow: float, path: Motion
) -> tuple[Motion, float, float]:
    """What was kept, with ends of the velocity's own shape.

    Args:
        middle: angles over time.
        begin: first instant that is kept [s].
        end: last instant that is kept [s].
        build: length of the beginning [s].
        follow: length of the end [s].
        path: way of a motion from rest at 0 to a speed of 1 at 1.
    """
    places, speeds = middle(np.array([begin, end])), middle(np.array([begin, end]), 1)
    whole = path(np.array([1.0]))[0]

    def motion(times: np.ndarray) -> np.ndarray:
        before = np.clip((times - begin) / build + 1, 0.0, 1.0)[:, None]
        after = np.clip(1 - (times - end) / follow, 0.0, 1.0)[:, None]
        inside = middle(np.clip(times, begin, end))
        early = places[0] - build * speeds[0] * (whole - path(before))
        late = places[1] + follow * speeds[1] * (whole - path(after))
        here = times[:, None]
        return np.where(here < begin, early, np.where(here > end, late, inside))

    return motion, begin - build, end + follow


def _filtered(angles: np.ndarray, step: float, cutoff: float) -> np.ndarray:
    rate = 1.0 / step
    if not 0.0 < cutoff < 0.45 * rate:
        expected = f"between 0 and {0.45 * rate:.0f} Hz"
        raise _wrong("cutoff", expected, f"{cutoff:g} Hz", "state it in Hz")
    sos = ellip(ORDER, RIPPLE, STOP, cutoff, output="sos", fs=rate)
    settled = min(len(angles) - 1, math.ceil(5 * rate / cutoff))
    return sosfiltfilt(sos, angles, axis=0, padtype="constant", padlen=settled)


def spectrum(smoothed: Smoothed) -> Spectrum:
    """Accelerations of track and profile over what was kept, by frequency.

    Both are second differences of the angles at the track's own instants, under a Hann window, so
    that they are read alike; played slower or faster, the profile is put on the track's clock.

    Args:
        smoothed: of `make_profile`.

    Returns:
        Amplitudes [rad/s^2] by frequency [Hz].
    """
    track, (begin, end) = smoothed.track, smoothed.kept
    inside = (track.times >= begin - 1e-9) & (track.times <= end + 1e-9)
    times, step = track.times[inside], float(track.times[1] - track.times[0])
    profile = smoothed.profile
    pace = profile.impact_time / (track.impact_time - smoothed.start)
    played = profile.at(pace * (times - smoothed.start)).angles
    found = []
    for angles in (track.angles[inside], played):
        bend = np.diff(angles, 2, axis=0) / step**2
        window = np.hanning(len(bend) + 2)[1:-1, None]
        found.append(2 * np.abs(np.fft.rfft(bend * window, axis=0)) / window.sum())
    frequencies = np.fft.rfftfreq(len(times) - 2, step)
    return Spectrum(frequencies, found[0], found[1])
