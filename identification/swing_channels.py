"""The gauges of a golfer's swing on the points of his profile: aligned, resolved, in metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .clock import Clock
from .clocks import Points, Shift, on_points, shift_of_events
from .instant import LEAP, Instant, impact_instant
from .lowpass import STRAIN_CUTOFFS, Filtered, both_filters, zero_phase_lowpass
from .resolve import Resolved, resolve_accelerations, resolve_strains
from .strain import Calibration, deflection
from .swing_errors import GaugeErrors


@dataclass(frozen=True, eq=False)
class Gauges:
    """Two accelerometers on the hosel and two strain gauges below the grip.

    Attributes:
        rate: samples a second, of all where `clocks` is None [Hz].
        toe: acceleration in the plane of the face, shape (n,) [m/s^2].
        lead: acceleration perpendicular to the face, shape (n,) [m/s^2].
        toe_strain: shape (m,) [1].
        lead_strain: shape (m,) [1].
        noise: standard deviations of the accelerometers, toe and lead [m/s^2].
        strain_noise: of the strains, toe and lead [1].
        clocks: rate [Hz] and first time [s] of each of the four, in the order above, on one clock;
            None where all begin together at `rate`.
        strain_clock_std: standard deviation of the strains' first times against those of the
            accelerometers [s].
    """

    rate: float
    toe: np.ndarray
    lead: np.ndarray
    toe_strain: np.ndarray
    lead_strain: np.ndarray
    noise: tuple[float, float] = (0.0, 0.0)
    strain_noise: tuple[float, float] = (0.0, 0.0)
    clocks: tuple[Clock, Clock, Clock, Clock] | None = None
    strain_clock_std: float = 0.0


@dataclass(frozen=True, eq=False)
class GripTurn:
    """How the grip turns, at the points of a profile.

    Attributes:
        points: even, shape (p,), 1000 in a robot's file [s].
        grip: 0 at a square face, clockwise from above, shape (p,) [rad].
        impact: instant of impact [s].
        impact_std: its standard deviation [s].
        grip_std: standard deviation of the angle, one error for the whole swing [rad].
    """

    points: np.ndarray
    grip: np.ndarray
    impact: float
    impact_std: float = 0.0
    grip_std: float = 0.0


@dataclass(frozen=True, eq=False)
class SwingChannels:
    """What the gauges say of the swing plane, at the points of the profile.

    Attributes:
        points: shape (p,) [s].
        is_known: where all four gauges reach, shape (p,) [-].
        acceleration: of the head, nan where its two gauges do not reach; `std` is of noise and of
            the grip's angle [m/s^2].
        deflection: of the head, nan where its two gauges do not reach [m].
        calibration_std: of the deflection in the swing plane by the calibration, shape (p,) [m].
        errors: all that is not known, with the standard deviations that follow.
        impact: on the lead accelerometer's clock.
        shift: of that clock to the profile's.
        filters: the lead/lag deflection by each low-pass, at the thesis's cut-offs [m].
        clocks: of toe, lead, toe's strain and lead's: rate [Hz] and first time [s].
        status: ``good`` or ``in_doubt``.
        warnings: in sentences.
    """

    points: np.ndarray
    is_known: np.ndarray
    acceleration: Resolved
    deflection: Resolved
    calibration_std: np.ndarray
    errors: GaugeErrors
    impact: Instant
    shift: Shift
    filters: tuple[Filtered, ...]
    clocks: tuple[Clock, ...]
    status: str
    warnings: tuple[str, ...]


def swing_channels(
    gauges: Gauges,
    turn: GripTurn,
    calibrations: tuple[Calibration, Calibration] | None = None,
    cutoff: float = STRAIN_CUTOFFS[1],
    threshold: float = LEAP,
) -> SwingChannels:
    """Aligns the gauges with a profile by the impact and resolves them into the swing plane.

    Each gauge is read by its own clock: filtered at its own rate, then brought to the points by a
    cubic spline, after a zero-phase low-pass where it is faster than they are. Beyond its own
    record it is nan.

    Args:
        gauges: as recorded, with the impact.
        turn: of the grip.
        calibrations: of the toe's and the lead's strain; the thesis's 0.024 for both where None.
        cutoff: of the strains' zero-phase low-pass [Hz].
        threshold: leap of the lead/lag acceleration that tells the impact [m/s^2].

    Returns:
        Acceleration and deflection in the direction of the swing, at the profile's points.

    Raises:
        ValueError: where no impact is found.

    Source: thesis, sections 8.3.1 and 8.3.2; the accelerations are not filtered, but for what the
    points are too far apart to show.
    """
    clocks = gauges.clocks or (Clock(gauges.rate, 0.0),) * 4
    own = clocks[1]
    found = impact_instant(gauges.lead, own.rate, own.start, threshold)
    if found.status == "none":
        raise ValueError(
            f"lead acceleration: expected an impact to align by, found none. {found.sentence} "
            "Mend: lower the threshold, or name a record with a ball."
        )
    shift = shift_of_events((turn.impact, turn.impact_std), (found.time, found.std))
    both = calibrations or (Calibration(), Calibration())
    strains = (gauges.toe_strain, gauges.lead_strain)
    bends = [deflection(one, by).values for one, by in zip(strains, both, strict=True)]
    filters = tuple(both_filters(bends[1], clocks[3].rate, one) for one in STRAIN_CUTOFFS)
    low = [_apart(one, clock, cutoff, found.time)
           for one, clock in zip(bends, clocks[2:], strict=True)]  # fmt: skip
    toe, lead, *bent = (
        _on_points(shift, clock, each, turn)
        for clock, each in zip(clocks, (gauges.toe, gauges.lead, *low), strict=True)
    )
    acceleration = resolve_accelerations(
        toe.values, lead.values, turn.grip, _quieter(gauges.noise, clocks, (toe, lead)),
        turn.grip_std,
    )  # fmt: skip
    shares = [math.sqrt(min(1.0, 2 * cutoff / clock.rate)) for clock in clocks[2:]]
    noise = [
        share * each / abs(by.gain)
        for share, each, by in zip(shares, gauges.strain_noise, both, strict=True)
    ]
    whole = resolve_strains(
        bent[0].values, bent[1].values, turn.grip, (noise[0], noise[1]), turn.grip_std
    )
    errors = GaugeErrors(
        turn.points, turn.grip, acceleration, whole, np.stack([one.values for one in bent]), both,
        _noise(acceleration, turn), _noise(whole, turn), turn.grip_std, shift.offset_std,
        gauges.strain_clock_std,
    )  # fmt: skip
    is_known = np.all([one.is_known for one in (toe, lead, *bent)], axis=0)
    return SwingChannels(
        turn.points,
        is_known,
        acceleration,
        whole,
        errors.calibration_std,
        errors,
        found,
        shift,
        filters,
        clocks,
        "in_doubt" if found.status != "found" else "good",
        _warnings(found, is_known),
    )


def _noise(resolved: Resolved, turn: GripTurn) -> np.ndarray:
    """What is left of a standard deviation without the grip's part."""
    turned = (resolved.out_of_plane * turn.grip_std) ** 2
    return np.sqrt(np.maximum(resolved.std**2 - turned, 0.0))


def _on_points(shift: Shift, clock: Clock, values: np.ndarray, turn: GripTurn) -> Points:
    """Resampled before and after the blow, each by itself, so that it does not reach ahead."""
    times = shift.ours(clock.start + np.arange(len(values)) / clock.rate)
    at = int(np.searchsorted(times, turn.impact))
    if not 16 <= at <= len(times) - 16:
        return on_points(times, values, turn.points)
    parts = [on_points(times[part], values[part], turn.points)
             for part in (slice(None, at), slice(at, None))]  # fmt: skip
    joint = np.where(turn.points < times[at], parts[0].values, parts[1].values)
    between = (turn.points > times[at - 1]) & (turn.points < times[at])
    joint[between] = np.interp(turn.points[between], times, values)
    is_known = (turn.points >= times[0]) & (turn.points <= times[-1])
    return Points(joint, is_known, parts[0].cutoff)


def _apart(values: np.ndarray, clock: Clock, cutoff: float, impact: float) -> np.ndarray:
    """Low-passed before and after the blow, each by itself: no filter mixes the two."""
    at = min(max(math.ceil((impact - clock.start) * clock.rate), 0), len(values))
    least = max(16, round(clock.rate / cutoff))
    parts = [values[:at], values[at:]]
    return np.concatenate([
        zero_phase_lowpass(one, clock.rate, cutoff) if len(one) >= least else one for one in parts
    ])  # fmt: skip


def _quieter(
    noise: tuple[float, float], clocks: tuple[Clock, ...], points: tuple[Points, Points]
) -> tuple[float, float]:
    """What is left of white noise after the low-pass before resampling."""
    toe, lead = (
        each if one.cutoff is None else each * math.sqrt(one.cutoff / (0.5 * clock.rate))
        for each, one, clock in zip(noise, points, clocks, strict=False)
    )
    return toe, lead


def _warnings(found: Instant, is_known: np.ndarray) -> tuple[str, ...]:
    said = [found.sentence] if found.status != "found" else []
    lost = int(np.sum(~is_known))
    if lost:
        said.append(f"{lost} of {len(is_known)} points lie beyond the record; they are nan.")
    return tuple(said)
