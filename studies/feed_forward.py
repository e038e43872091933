"""Can a drive make the compliant club follow the golfer's? The thesis's subtraction, and a QP."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .engine import start_engine
from .listing import printed, written
from .study import Call, Study
from .usual_swing import robot_file, task_file

SPEEDS = (30.0, 45.0)
"""Of the golfer's rigid club at impact [m/s]."""

ROUNDS = 5
"""How often the thesis's error is subtracted [-]."""

HEADINGS = ("fidelity", "m/s", "pose", "way", "at impact", "0.2 s before", "speed", "jerk")


def compare(call: Call) -> dict[str, Any]:
    """Follow smooth golfers by the thesis's repeated subtraction and by a program.

    Args:
        call: its folder gets ``feed_forward.md`` and ``feed_forward.json``.

    Returns:
        Rows of the table, zeros [1/s], and curves of roughness against error.
    """
    import tempfile

    start_engine()
    from ..model.rig import read_rig
    from ..optimize.classic import classic
    from ..optimize.task import read_task

    rows: list[dict[str, Any]] = []
    found: dict[str, Any] = {"rows": rows, "zeros": {}, "curves": []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rigs = {}
        for fidelity in ("planar", "thesis"):
            (folder / "rig.toml").write_text(robot_file(fidelity))
            rigs[fidelity] = read_rig(folder / "rig.toml")
        for speed in SPEEDS:
            (folder / "task.toml").write_text(task_file(speed, hold="drive"))
            call.progress(f"a golfer of {speed:g} m/s")
            golfer = classic(read_task(folder / "task.toml"), rigs["thesis"]).profile
            for fidelity in ("thesis", "planar"):
                for hold in ("grip", "chord"):
                    call.progress(f"{fidelity}, {speed:g} m/s, {hold}")
                    _one(found, golfer, rigs[fidelity], hold, speed)
    written("feed_forward", found, HEADINGS, rows_of(found), words_of(found), call.out)
    return found


def _one(found: dict[str, Any], golfer: Any, rig: Any, hold: Any, speed: float) -> None:
    """One golfer, fidelity and pose, by all ways."""
    from ..optimize.feedforward import RAN_AWAY, course_of, curve, follow, inverse_zeros, subtracted

    course = course_of(golfer, rig, hold)
    ways = subtracted(course, ROUNDS)
    named = [("the golfer's own drive", ways[0])]
    named += [(f"{count} subtracted", one) for count, one in enumerate(ways[1:], 1)]
    named.append(("feed-forward", follow(course)))
    for way, one in named:
        finite = one.status != RAN_AWAY
        degrees = np.degrees([abs(one.impact_error), one.window_error])
        found["rows"].append({
            "fidelity": rig.fidelity, "speed": speed, "hold": hold, "way": way,
            "status": one.status,
            "impact_degrees": float(degrees[0]) if finite else None,
            "window_degrees": float(degrees[1]) if finite else None,
            "clubhead_speed": one.speed if finite else None,
            "jerk_ratio": one.roughness if finite else None,
        })  # fmt: skip
    zeros = inverse_zeros(rig, hold)
    found["zeros"][hold] = [[float(one.real), float(one.imag)] for one in zeros]
    if rig.fidelity == "thesis":
        found["curves"].append({
            "speed": speed, "hold": hold,
            "window_degrees": [float(np.degrees(one.window_error)) for one in curve(course)],
            "jerk_ratio": [one.roughness for one in curve(course)],
        })  # fmt: skip


def rows_of(found: Mapping[str, Any]) -> list[list[str]]:
    """Rows of the table, of what `compare` returns [-]."""
    rows = []
    for one in found["rows"]:
        head = [one["fidelity"], f"{one['speed']:g}", one["hold"], one["way"]]
        if one["impact_degrees"] is None:
            rows.append([*head, "ran away", "", "", ""])
            continue
        degrees = [f"{one[key]:.3g}°" for key in ("impact_degrees", "window_degrees")]
        rows.append([
            *head, *degrees, f"{one['clubhead_speed']:.2f}", f"× {one['jerk_ratio']:.3g}"
        ])  # fmt: skip
    return rows


def words_of(found: Mapping[str, Any]) -> list[str]:
    """What the table does not say: zeros and curves, in lines [-]."""
    lines = []
    for hold, zeros in found["zeros"].items():
        told = ", ".join(f"{a:.2f} ± {b:.1f}j" if b else f"{a:.4g}" for a, b in zeros if b >= 0)
        worst = max(a for a, _ in zeros)
        says = "grows: exact following is impossible" if worst > 0 else "dies out"
        lines.append(
            f"Zeros from drive to {hold} [1/s]: {told}; what an exact inverse makes {says}."
        )
    for one in found["curves"]:
        pairs = zip(one["window_degrees"], one["jerk_ratio"], strict=True)
        told = ", ".join(f"{error:.3g}° × {rough:.3f}" for error, rough in pairs)
        lines.append(f"{one['speed']:g} m/s, {one['hold']}: error before impact, jerk: {told}.")
    return lines


def show(found: Mapping[str, Any]) -> None:
    """Print the table, the zeros and the curves."""
    title = "Pose of the club against the golfer's; jerk against the golfer's own drive."
    printed(title, HEADINGS, rows_of(found), words_of(found))


STUDY = Study(
    "feed_forward",
    "How nearly can the compliant club follow the golfer's, and what does it cost?",
    compare,
    show,
)
