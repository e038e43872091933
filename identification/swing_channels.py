"""The gauges of a golfer's swing on the points of his profile: aligned, resolved, in metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .clocks import Points, Shift, on_points, shift_of_events
from .instant import LEAP, Instant, impact_instant
from .lowpass import STRAIN_CUTOFFS, Filtered, both_filters, zero_phase_lowpass
from .resolve import Resolved, resolve_accelerations, resolve_strains
from .strain import Calibration, deflection


@dataclass(frozen=True, eq=False)
class Gauges:
    """Two accelerometers on the hosel and two strain gauges below the grip, on one clock.

    Attributes:
        rate: samples a second [Hz].
        toe: acceleration in the plane of the face, shape (n,) [m/s^2].
        lead: acceleration perpendicular to the face, shape (n,) [m/s^2].
        toe_strain: shape (n,) [1].
        lead_strain: shape (n,) [1].
        noise: standard deviations of the accelerometers, toe and lead [m/s^2].
    """

    rate: float
    toe: np.ndarray
    lead: np.ndarray
    toe_strain: np.ndarray
    lead_strain: np.ndarray
    noise: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class GripTurn:
    """How the grip turns, at the points of a profile.

    Attributes:
        points: even, shape (p,), 1000 in a robot's file [s].
        grip: 0 at a square face, clockwise from above, shape (p,) [rad].
        impact: instant of impact [s].
        impact_std: its standard deviation [s].
        grip_std: standard deviation of the angle [rad].
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
        is_known: where the record reaches, shape (p,); nan elsewhere in every channel [-].
        acceleration: of the head [m/s^2].
        deflection: of the head [m].
        calibration_std: of the deflection in the swing plane by the calibration, shape (p,) [m].
        impact: on the gauges' clock.
        shift: of the gauges' clock to the profile's.
        filters: the lead/lag deflection by each low-pass, at the thesis's cut-offs [m].
        status: ``good`` or ``in_doubt``.
        warnings: in sentences.
    """

    points: np.ndarray
    is_known: np.ndarray
    acceleration: Resolved
    deflection: Resolved
    calibration_std: np.ndarray
    impact: Instant
    shift: Shift
    filters: tuple[Filtered, ...]
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
    found = impact_instant(gauges.lead, gauges.rate, threshold=threshold)
    if found.status == "none":
        raise ValueError(
            f"lead acceleration: expected an impact to align by, found none. {found.sentence} "
            "Mend: lower the threshold, or name a record with a ball."
        )
    shift = shift_of_events((turn.impact, turn.impact_std), (found.time, found.std))
    times = shift.ours(np.arange(len(gauges.lead)) / gauges.rate)
    toe_gauge, lead_gauge = calibrations or (Calibration(), Calibration())
    toe_bend = deflection(gauges.toe_strain, toe_gauge)
    lead_bend = deflection(gauges.lead_strain, lead_gauge)
    filters = tuple(both_filters(lead_bend.values, gauges.rate, one) for one in STRAIN_CUTOFFS)
    low = [_apart(one.values, gauges.rate, cutoff, found.time) for one in (toe_bend, lead_bend)]
    toe, lead, *bends = (_on_points(times, each, turn) for each in (gauges.toe, gauges.lead, *low))
    errors = [on_points(times, one.std, turn.points).values for one in (toe_bend, lead_bend)]
    acceleration = resolve_accelerations(
        toe.values, lead.values, turn.grip, _quieter(gauges, toe), turn.grip_std
    )
    bent = resolve_strains(bends[0].values, bends[1].values, turn.grip, (0.0, 0.0), turn.grip_std)
    own = np.hypot(errors[0] * np.sin(turn.grip), errors[1] * np.cos(turn.grip))
    warnings = _warnings(found, lead)
    doubt = found.status != "found"
    return SwingChannels(
        turn.points,
        lead.is_known,
        acceleration,
        bent,
        own,
        found,
        shift,
        filters,
        "in_doubt" if doubt else "good",
        warnings,
    )


def _on_points(times: np.ndarray, values: np.ndarray, turn: GripTurn) -> Points:
    """Resampled before and after the blow, each by itself, so that it does not reach ahead."""
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


def _apart(values: np.ndarray, rate: float, cutoff: float, impact: float) -> np.ndarray:
    """Low-passed before and after the blow, each by itself: no filter mixes the two."""
    at = math.ceil(impact * rate)
    least = max(16, round(rate / cutoff))
    parts = [values[:at], values[at:]]
    return np.concatenate([
        zero_phase_lowpass(one, rate, cutoff) if len(one) >= least else one for one in parts
    ])  # fmt: skip


def _quieter(gauges: Gauges, points: Points) -> tuple[float, float]:
    """What is left of white noise after the low-pass before resampling."""
    share = 1.0 if points.cutoff is None else float(np.sqrt(points.cutoff / (0.5 * gauges.rate)))
    return gauges.noise[0] * share, gauges.noise[1] * share


def _warnings(found: Instant, points: Points) -> tuple[str, ...]:
    said = [found.sentence] if found.status != "found" else []
    lost = int(np.sum(~points.is_known))
    if lost:
        said.append(f"{lost} of {len(points.is_known)} points lie beyond the record; they are nan.")
    return tuple(said)
