"""Markers on a golfer and his club: lost ones filled, then hub, hand, shaft and clubhead."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

LONGEST = {"club": 0.03, "shoulder": 0.2}
"""Longest gap that is filled, of markers on the club and of those on the shoulders [s]."""

DEGREE = 5
"""Of the polynomial through a gap's neighbors [-]."""

SIDE = 6
"""Fewest frames on either side of a gap that fill it [-]."""

GHOST = 0.010
"""How far two markers on the shaft may leave their usual distance [m]; farther, both are lost."""

STRETCHED = 0.2
"""How far their usual distance may be from the gauge's [-]; farther, the unit is wrong."""

NAMES = ("left_shoulder", "right_shoulder", "club_top", "club_bottom", "tee_piece")
"""Markers that move, as the files name them; the sixth is the tee."""


@dataclass(frozen=True)
class ClubGauge:
    """Where the markers sit on the club, from the top of its grip along the shaft.

    Attributes:
        top: of the upper marker [m].
        bottom: of the lower marker [m].
        hand: of the middle of the hands [m].
        length: of the clubhead [m].

    Source: thesis, section 4.3.3; the length as in the preset ``robo_v``.
    """

    top: float = 0.265
    bottom: float = 0.550
    hand: float = 0.055
    length: float = 1.09


@dataclass(frozen=True, eq=False)
class GolferMarkers:
    """Markers in the room, frame by frame; nan where one was lost.

    Attributes:
        rate: frames a second [Hz].
        left_shoulder: shape (n, 3) [m].
        right_shoulder: shape (n, 3) [m].
        club_top: the upper one on the shaft, shape (n, 3) [m].
        club_bottom: the lower one on the shaft, shape (n, 3) [m].
        tee_piece: on the piece that stands off the shaft, shape (n, 3) [m].
        tee: the marker on the tee, where the ball's middle will be, shape (3,) [m].
    """

    rate: float
    left_shoulder: np.ndarray
    right_shoulder: np.ndarray
    club_top: np.ndarray
    club_bottom: np.ndarray
    tee_piece: np.ndarray
    tee: np.ndarray


@dataclass(frozen=True)
class Filled:
    """What was filled of one marker.

    Attributes:
        marker: its name.
        frames: how many were filled [-].
        gaps: in how many places [-].
        longest: of them [s].
    """

    marker: str
    frames: int
    gaps: int
    longest: float


@dataclass(frozen=True, eq=False)
class GolferPoints:
    """The points that make a double pendulum of a golfer.

    Attributes:
        times: of the frames kept, from the first frame of the file on, shape (n,) [s].
        hub: midway between the shoulders, shape (n, 3) [m].
        hand: on the line of the shaft, shape (n, 3) [m].
        head: where a straight shaft would have the clubhead, shape (n, 3) [m].
        shaft: from grip to head, of length 1, shape (n, 3) [-].
        tee_piece: from the line of the shaft, shape (n, 3) [m].
        filled: of each marker that had gaps.
        warnings: what was found, in sentences.
    """

    times: np.ndarray
    hub: np.ndarray
    hand: np.ndarray
    head: np.ndarray
    shaft: np.ndarray
    tee_piece: np.ndarray
    filled: tuple[Filled, ...] = ()
    warnings: tuple[str, ...] = field(default_factory=tuple)


def golfer_points(
    markers: GolferMarkers,
    gauge: ClubGauge | None = None,
    longest: Mapping[str, float] = LONGEST,
) -> GolferPoints:
    """Fills lost markers and constructs hub, hand and clubhead.

    Frames before all five markers were first seen, and after they were last, are left out. A gap
    between is filled by a polynomial of degree 5 through as many frames on either side as half
    the gap has, 6 at least, each coordinate for itself.

    Args:
        markers: as measured.
        gauge: of the club; as in the thesis where None.
        longest: gap that is filled, of markers on ``club`` and ``shoulder`` [s].

    Returns:
        The points.

    Raises:
        ValueError: naming the marker, the instant and the length of a gap that is too long, a
            marker that was never seen, or a unit that cannot be right.
    """
    gauge = gauge or ClubGauge()
    if not 0.0 <= gauge.top < gauge.bottom <= gauge.length:
        raise _wrong(
            "club", "0 <= top < bottom <= length, in m from the top of the grip",
            f"{gauge.top:g}, {gauge.bottom:g} and {gauge.length:g}", "correct the gauge",
        )  # fmt: skip
    places = {name: np.array(getattr(markers, name), dtype=float) for name in NAMES}
    warnings = _drop_ghosts(places, gauge)
    seen = {name: np.isfinite(one).all(axis=1) for name, one in places.items()}
    for name, frames in seen.items():
        if not frames.any():
            raise _wrong(name, "a marker that was seen", "it in no frame", "check its name")
    all_seen = np.flatnonzero(np.logical_and.reduce(list(seen.values())))
    if not all_seen.size:
        raise _wrong("markers", "a frame with all of them", "none", "measure again")
    first, last = int(all_seen[0]), int(all_seen[-1]) + 1
    kept, filled = {}, []
    for name in NAMES:
        limit = longest["shoulder" if "shoulder" in name else "club"]
        kept[name], report = _fill(places[name][first:last], name, markers.rate, limit, first)
        filled += [report] if report.frames else []
    along = kept["club_bottom"] - kept["club_top"]
    shaft = along / np.linalg.norm(along, axis=1)[:, None]
    butt = kept["club_top"] - gauge.top * shaft
    off = kept["tee_piece"] - kept["club_top"]
    return GolferPoints(
        times=np.arange(first, last) / markers.rate,
        hub=(kept["left_shoulder"] + kept["right_shoulder"]) / 2,
        hand=butt + gauge.hand * shaft,
        head=butt + gauge.length * shaft,
        shaft=shaft,
        tee_piece=off - np.sum(off * shaft, axis=1)[:, None] * shaft,
        filled=tuple(filled),
        warnings=tuple(warnings),
    )


def _wrong(name: str, expected: str, found: str, mend: str) -> ValueError:
    return ValueError(f"{name}: expected {expected}, found {found}. Mend: {mend}.")


def _drop_ghosts(places: dict[str, np.ndarray], gauge: ClubGauge) -> list[str]:
    """Markers on a stiff shaft keep their distance; where they do not, both are lost."""
    apart = np.linalg.norm(places["club_bottom"] - places["club_top"], axis=1)
    if not np.isfinite(apart).any():
        return []
    usual, wanted = float(np.nanmedian(apart)), gauge.bottom - gauge.top
    if abs(usual / wanted - 1) > STRETCHED:
        raise _wrong(
            "club_top and club_bottom", f"{1e3 * wanted:.0f} mm between them, as gauged",
            f"{1e3 * usual:.4g} mm", "state the unit of the markers, or correct the gauge",
        )  # fmt: skip
    with np.errstate(invalid="ignore"):
        ghosts = np.abs(apart - usual) > GHOST
    for name in ("club_top", "club_bottom"):
        places[name][ghosts] = np.nan
    count, warnings = int(ghosts.sum()), []
    if count:
        warnings.append(
            f"In {count} frames the markers on the shaft were more than {1e3 * GHOST:g} mm off "
            "their distance; they count as lost there."
        )
    if abs(usual - wanted) > GHOST:
        warnings.append(
            f"The markers on the shaft are {1e3 * usual:.0f} mm apart, the gauge says "
            f"{1e3 * wanted:.0f} mm."
        )
    return warnings


def _fill(
    places: np.ndarray, name: str, rate: float, limit: float, first: int
) -> tuple[np.ndarray, Filled]:
    lost = np.isnan(places.sum(axis=1))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]).astype(int)))
    filled, frames = places.copy(), np.arange(len(places))
    longest = 0.0
    for start, stop in edges.reshape(-1, 2).tolist():
        length = (stop - start) / rate
        if length > limit * (1 + 1e-9):
            where = f"{length:.3f} s from {(first + start) / rate:.3f} s on"
            mend = "cut the swing with 'samples' where it may be, allow longer gaps, or measure"
            raise _wrong(name, f"gaps of at most {limit:g} s", f"one of {where}", mend + " again")
        longest = max(longest, length)
        side = max(SIDE, (stop - start + 1) // 2)
        before = frames[:start][~lost[:start]][-side:]
        after = frames[stop:][~lost[stop:]][:side]
        known = np.concatenate([before, after])
        middle, half = (start + stop - 1) / 2, max((known[-1] - known[0]) / 2, 1.0)
        degree = min(DEGREE, len(known) - 1)
        terms = np.polynomial.legendre.legvander((known - middle) / half, degree)
        weights = np.linalg.lstsq(terms, places[known], rcond=None)[0]
        gap = (frames[start:stop] - middle) / half
        filled[start:stop] = np.polynomial.legendre.legvander(gap, degree) @ weights
    return filled, Filled(name, int(lost.sum()), len(edges) // 2, float(longest))
