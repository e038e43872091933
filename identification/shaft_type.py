"""How a shaft is loaded: a ramp, a peak, a double peak, or none of them, as where a club rings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from .lowpass import zero_phase_lowpass

RAMP, PEAK, DOUBLE_PEAK, NONE = "ramp", "peak", "double_peak", "none"
NOT_TOLD, RIGID = "not_told", "rigid"

END = 0.020
"""How long before impact a record may end and still show the whole loading [s]."""

WHOSE = "Whether a golfer's hands or a rigid grip held the club, such a curve does not tell."

CUTOFF = 15.0
"""Low-pass before the look, as the thesis filters strain [Hz]; line 847."""

PROMINENCE = 0.10
"""Rise above the dip beside it from which a hump counts as a peak [of the largest load]."""

LATE = 0.33
"""Share of the loading that passes before the load is there, above which it is a ramp [-]."""

BEFORE = 0.35
"""Size of a swing back and forth before the loading that no golfer's hands let [of the largest
load]."""

RINGS = 4
"""Humps of either sign of such a swing that takeaway and top of a golfer's do not make [-]."""

APART, SPRUNG = 0.35, 0.05
"""Longest time between two humps of one loading [s], and the lead between them that ends it [of the
largest load]."""

LEAST = 0.01
"""Smallest load that is told from rest [m]."""


@dataclass(frozen=True)
class ShaftType:
    """How the shaft was loaded.

    Attributes:
        name: ``ramp``, ``peak``, ``double_peak`` or ``none``; ``not_told`` where the record ends
            before the loading does.
        holder: ``rigid`` where the club rings as only a grip without damping lets it, else
            ``not_told``; never a golfer's hands, see `shaft_type`.
        peaks: instants of the humps [s].
        heights: their loads [m].
        largest: largest load before impact [m].
        start: when the loading begins [s].
        lateness: 0 for a load that is there at once, 0.5 for one that grows evenly [-].
        margin: distance to the next kind of answer, relative to its limit [-].
        status: ``told``, or ``in_doubt`` where the margin is below a tenth; of the kind alone, not
            of `holder`.
        sentence: in words.
    """

    name: str
    holder: str
    peaks: tuple[float, ...]
    heights: tuple[float, ...]
    largest: float
    start: float
    lateness: float
    margin: float
    status: str
    sentence: str


def shaft_type(times: np.ndarray, lag: np.ndarray, impact: float) -> ShaftType:
    """Tells the kind of a loading from a record of the head's deflection.

    Args:
        times: even, from before the downswing on, shape (n,) [s].
        lag: deflection of the head behind the grip, in the direction of the swing, positive where
            it lags, shape (n,) [m].
        impact: instant of impact [s].

    Returns:
        The kind, with how near the next one is.

    Raises:
        ValueError: where less than a tenth of a second lies before impact.

    A kind is one of the curve, not of who made it. The thesis tells a robot's curve by its
    oscillations (line 152), and so does this: a club that swings back and forth before the
    downswing is held by a grip without damping, and its curve is none of the kinds. But a rigid
    grip that plays a golfer's arm and wrist gently excites hardly any oscillation before the
    downswing, and the downswing itself takes about one period of the shaft, 0.25 s: the shaft then
    bends under the same inertia as in hands, and the curve **is** a ramp or a double peak. No
    limit on it could tell the two apart, for any curve follows from some motion of either hold;
    that takes the motion of the hand beside it, as in `hold`.

    Source: Butler and Winfield 1994, thesis lines 85 and 851: a double peak loads to begin the
    downswing and again where the wrists uncock, a peak loads at once and holds, a ramp grows
    evenly. The limits in numbers are ours.
    """
    times, lag = np.asarray(times, dtype=float), np.asarray(lag, dtype=float)
    inside = times < impact
    if inside.sum() < 16 or times[inside][-1] - times[0] < 0.1:
        raise ValueError(
            "lag: expected at least a tenth of a second before impact, found less. Mend: begin the "
            "record before the downswing."
        )
    rate = 1.0 / (times[1] - times[0])
    if times[-1] < impact - END:
        return _cut_short(times[-1], lag, impact)
    load = lag[inside]
    if rate > CUTOFF / 0.45:
        load = zero_phase_lowpass(load, rate, CUTOFF)
    times = times[inside]
    top = int(np.argmax(load))
    largest = float(load[top])
    if largest < LEAST:
        return _told(NONE, times, load, [], 0, "the shaft is hardly loaded", 1.0)
    whole = np.append(load, min(0.0, float(load[-1])))  # the blow ends every load
    humps, found = find_peaks(whole, prominence=0.3 * PROMINENCE * largest)
    first = _first_of_loading(load, [int(one) for one in humps], top, rate)
    low = np.flatnonzero(load[:first] < 0.1 * largest)
    start = int(low[-1]) if low.size else 0
    shaken = _shaken(load[:start], largest)
    late = humps >= start
    rises = found["prominences"][late] / largest
    clear = [int(one) for one in humps[late][rises >= PROMINENCE]]
    nearest = min((abs(rise / PROMINENCE - 1.0) for rise in rises), default=1.0)
    if shaken >= 2:
        text = f"it swings back and forth {shaken} times before the downswing loads it"
        holder = RIGID if shaken >= RINGS else NOT_TOLD
        return _told(NONE, times, load, clear, start, text, 1.0, holder)
    if len(clear) > 2:
        text = f"it has {len(clear)} humps"
        return _told(NONE, times, load, clear, start, text, nearest)
    if len(clear) == 2:
        return _told(DOUBLE_PEAK, times, load, clear, start, "it is loaded twice", nearest)
    late = _lateness(load, start)
    kind, word = (
        (RAMP, "the load grows evenly") if late > LATE else (PEAK, "the load comes at once")
    )
    return _told(kind, times, load, clear or [top], start, word, min(nearest, abs(late / LATE - 1)))


def _cut_short(last: float, lag: np.ndarray, impact: float) -> ShaftType:
    text = f"Not told: the record ends {impact - last:.3f} s before the impact."
    largest = float(lag.max())
    return ShaftType(NOT_TOLD, NOT_TOLD, (), (), largest, np.nan, np.nan, 0.0, "in_doubt", text)


def _first_of_loading(load: np.ndarray, humps: list[int], top: int, rate: float) -> int:
    """The first hump of the downswing: shortly before the largest, with no lead between them."""
    first = top
    for hump in reversed([one for one in humps if one < top]):
        between = load[hump:first]
        if (first - hump) / rate > APART or between.min() < -SPRUNG * load[top]:
            break
        if load[hump] >= PROMINENCE * load[top]:
            first = hump
    return first


def _shaken(load: np.ndarray, largest: float) -> int:
    """Humps of either sign, each well above the dips beside it, before the loading."""
    if len(load) < 8:
        return 0
    wanted = BEFORE * largest
    return sum(len(find_peaks(sign * load, prominence=wanted)[0]) for sign in (1.0, -1.0))


def _lateness(load: np.ndarray, start: int) -> float:
    """Mean of what the load, at its highest so far, still lacks of its largest [of it]."""
    part = load[start:]
    highest = np.maximum.accumulate(part)
    return 1.0 - float(np.mean(np.maximum(highest, 0.0))) / float(part.max())


def _told(
    name: str,
    times: np.ndarray,
    load: np.ndarray,
    peaks: list[int],
    start: int,
    why: str,
    margin: float,
    holder: str = NOT_TOLD,
) -> ShaftType:
    largest = float(load.max())
    late = _lateness(load, start) if largest > 0 else 0.0
    words = {NONE: "None of the three kinds"}.get(name, f"A {name.replace('_', ' ')}")
    status = "told" if margin >= 0.1 else "in_doubt"
    doubt = "" if status == "told" else " It is close to another kind."
    whose = "No golfer's hands let it." if holder == RIGID else WHOSE
    return ShaftType(
        name,
        holder,
        tuple(float(times[one]) for one in peaks),
        tuple(float(load[one]) for one in peaks),
        largest,
        float(times[start]),
        late,
        float(margin),
        status,
        f"{words}: {why}; the largest load is {1e3 * largest:.0f} mm.{doubt} {whose}",
    )
