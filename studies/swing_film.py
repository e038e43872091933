"""A swing as a picture that moves by itself: arm, bent club and rigid club, without any script."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence

import numpy as np

from ..model import planar
from .figures import AFTER, BEFORE

FRAMES = 120
"""Pictures of one swing [-]."""

SLOWER = 4.0
"""How many times slower than the swing the picture runs [-]."""

_ARM = "#3a3f45"


def film(
    numbers: Mapping[str, float],
    times: np.ndarray,
    states: np.ndarray,
    drives: np.ndarray,
    impact: float,
) -> str:
    """The film of one swing as the address of an image that carries its own content.

    Args:
        numbers: of the robot [SI].
        times: shape (t,) [s].
        states: coordinates and rates of the club, shape (t, 8) [SI].
        drives: arm and wrist angle, shape (t, 2) [rad].
        impact: instant of impact [s].

    Returns:
        ``data:image/svg+xml;base64,...`` in which arm, bent club and a rigid club on the same
        drives move; a program that shows no motion shows the instant of impact.
    """
    at = np.linspace(times[0], times[-1], FRAMES)
    x = np.stack([np.interp(at, times, column) for column in states.T[:4]], axis=1)
    turned = np.stack([np.interp(at, times, column) for column in drives.T], axis=1)
    frames = [_frame(numbers, q, drive) for q, drive in zip(x, turned, strict=True)]
    shown = int(np.argmin(np.abs(at - impact)))
    paths = [np.array([frame[kind][-1] for frame in frames]) for kind in ("club", "rigid")]
    reach = 1.06 * (numbers["arm_length"] + planar.points_of(numbers).head)
    size = f"{-reach:.2f} {-reach:.2f} {2 * reach:.2f} {2 * reach:.2f}"
    ball = frames[shown]["rigid"][-1]
    length = SLOWER * (times[-1] - times[0])
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{size}" width="760" height="760">',
        f'<rect x="{-reach}" y="{-reach}" width="{2 * reach}" height="{2 * reach}" fill="#fff"/>',
        _line(paths[1], BEFORE, 0.006, "0.02 0.02", 0.55),
        _line(paths[0], AFTER, 0.006, "", 0.55),
        f'<circle cx="{ball[0]:.3f}" cy="{ball[1]:.3f}" r="0.022" fill="#fff" stroke="#3a3f45" '
        'stroke-width="0.006"/>',
        _moving("rigid", frames, shown, length, BEFORE, 0.012),
        _moving("club", frames, shown, length, AFTER, 0.016),
        _moving("arm", frames, shown, length, _ARM, 0.03),
        _head(frames, shown, length),
        '<circle r="0.03" fill="#3a3f45"/>',
        f'<text x="{-0.97 * reach:.2f}" y="{-0.9 * reach:.2f}" font-family="sans-serif" '
        f'font-size="{0.05 * reach:.3f}" fill="{AFTER}">club as it bends</text>',
        f'<text x="{-0.97 * reach:.2f}" y="{-0.82 * reach:.2f}" font-family="sans-serif" '
        f'font-size="{0.05 * reach:.3f}" fill="{BEFORE}">rigid club on the same drives</text>',
        "</svg>",
    ]
    text = "\n".join(parts)
    return "data:image/svg+xml;base64," + base64.b64encode(text.encode()).decode("ascii")


def _frame(
    numbers: Mapping[str, float], q: np.ndarray, drive: np.ndarray
) -> dict[str, list[tuple[float, float]]]:
    """Corners of arm, rigid club and bent club, hub at the origin, the ball's side down [m]."""
    at = planar.points_of(numbers)
    wrist = _place((0.0, 0.0), drive[0], numbers["arm_length"], 0.0)
    rigid = _place(wrist, drive[0] + drive[1], at.head, 0.0)
    grip = _place(wrist, q[0], at.grip, q[1])
    middle = _place(wrist, q[0], at.grip + 0.5 * at.lever, q[1] + 0.5 * at.lever * q[2])
    head = _place(wrist, q[0], at.grip + planar.head_of(numbers, q).along, q[3])
    return {
        "arm": [(0.0, 0.0), wrist],
        "rigid": [wrist, rigid],
        "club": [wrist, grip, middle, head],
    }


def _place(
    start: tuple[float, float], angle: float, along: float, across: float
) -> tuple[float, float]:
    """A point seen along and across a direction that points at the ball at angle 0 [m]."""
    sine, cosine = float(np.sin(angle)), float(np.cos(angle))
    return (
        start[0] + along * sine + across * cosine,
        start[1] + along * cosine - across * sine,
    )


def _d(kind: str, points: Sequence[tuple[float, float]]) -> str:
    """A path's outline: straight, or for the club straight to the grip and curved to the head."""
    told = [f"{x:.3f} {y:.3f}" for x, y in points]
    if kind == "club":
        return f"M{told[0]} L{told[1]} Q{told[2]} {told[3]}"
    return "M" + " L".join(told)


def _moving(
    kind: str,
    frames: Sequence[Mapping[str, list[tuple[float, float]]]],
    shown: int,
    length: float,
    color: str,
    width: float,
) -> str:
    values = ";".join(_d(kind, frame[kind]) for frame in frames)
    return (
        f'<path d="{_d(kind, frames[shown][kind])}" fill="none" stroke="{color}" '
        f'stroke-width="{width}" stroke-linecap="round">'
        f'<animate attributeName="d" dur="{length:.1f}s" repeatCount="indefinite" '
        f'values="{values}"/></path>'
    )


def _head(
    frames: Sequence[Mapping[str, list[tuple[float, float]]]], shown: int, length: float
) -> str:
    heads = [frame["club"][-1] for frame in frames]
    moves = []
    for name, index in (("cx", 0), ("cy", 1)):
        values = ";".join(f"{head[index]:.3f}" for head in heads)
        moves.append(
            f'<animate attributeName="{name}" dur="{length:.1f}s" repeatCount="indefinite" '
            f'values="{values}"/>'
        )
    at = heads[shown]
    whole = "".join(moves)
    return f'<circle cx="{at[0]:.3f}" cy="{at[1]:.3f}" r="0.04" fill="{AFTER}">{whole}</circle>'


def _line(points: np.ndarray, color: str, width: float, dashes: str, opacity: float) -> str:
    told = " ".join(f"{x:.3f},{y:.3f}" for x, y in points)
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return (
        f'<polyline points="{told}" fill="none" stroke="{color}" stroke-width="{width}"{dashed} '
        f'opacity="{opacity}"/>'
    )
