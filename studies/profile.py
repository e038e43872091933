"""Which profile plays this golfer's swing? From markers to the robot's file, with its picture."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..optimize.plane import PlaneSwing
    from ..optimize.profile import Limits, Use
    from ..optimize.smooth import Smoothed, Spectrum
    from .profile_sidecar import GolferFile


def profile_file(path: Path, out: Path | None = None, seed: int = 0) -> tuple[dict[str, Any], bool]:
    """Makes a profile of a golfer's markers.

    Args:
        path: a sidecar, or a table or C3D file of markers.
        out: folder for ``profile.csv``, ``profile.pod``, ``golfer.csv`` (the angles as measured,
            on the profile's clock) and ``report.html``; None for none.
        seed: kept in the provenance; nothing here is drawn by chance.

    Returns:
        The contents of ``profile.json``, and whether they are to be trusted.

    Raises:
        ValueError: in the words of the door; also where the profile breaks a limit, and then
            nothing is written.
    """
    from .. import __version__
    from ..optimize.markers import golfer_points
    from ..optimize.plane import plane_swing
    from ..optimize.profile import AXES, check_limits, excess
    from ..optimize.smooth import Track, make_profile, spectrum
    from .profile_sidecar import read_golfer

    began = time.perf_counter()
    golfer = read_golfer(path)
    try:
        points = golfer_points(golfer.markers, golfer.gauge, golfer.longest)
        swing = plane_swing(points, golfer.markers.tee, golfer.radius, golfer.target)
        track = Track(swing.times, swing.angles, swing.impact.time, swing.top_time)
        made = make_profile(
            track, golfer.smoothing, golfer.quantum, golfer.interpolation, golfer.swing_time
        )
        check_limits(made.profile, golfer.limits)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    uses, heard = excess(made.profile, golfer.limits), spectrum(made)
    result = {
        "status": "in_doubt" if swing.doubts else "good",
        "sentence": _sentence(golfer.name, swing, made),
        "impact": _impact(swing, made),
        "plane": _plane(swing),
        "profile": _profile(golfer, made),
        "limits": [_use(use) for use in uses if math.isfinite(use.limit)],
        "limits_stated": golfer.limits_stated,
        "high_frequencies": {
            "above": golfer.smoothing.cutoff,
            "unit": "Hz",
            "left": dict(zip(AXES, heard.above(golfer.smoothing.cutoff).tolist(), strict=True)),
        },
        "filled": [vars(one) for one in swing.filled],
        "warnings": [*swing.warnings, *_warnings(golfer, made)],
        "doubts": list(swing.doubts),
        "provenance": {
            "version": __version__,
            "inputs": golfer.files,
            "seed": seed,
            "seconds": 0.0,
        },
    }
    if out is not None:
        _write(result, made, heard, golfer.limits, out)
    result["provenance"]["seconds"] = round(time.perf_counter() - began, 3)
    return result, not swing.doubts


def _warnings(golfer: GolferFile, made: Smoothed) -> list[str]:
    found = []
    if not golfer.limits_stated:
        found.append("No limits are stated; those assumed of the Robo V were checked.")
    if made.start < made.track.times[0] - 1e-9:
        found.append(
            f"The profile begins {made.track.times[0] - made.start:.2f} s before the markers do, "
            "because its made-up beginning is longer than what it replaces."
        )
    return found


def _told(value: float, unit: str) -> dict[str, Any]:
    return {"value": float(value), "unit": unit}


def _impact(swing: PlaneSwing, made: Smoothed) -> dict[str, Any]:
    import numpy as np

    impact, at = swing.impact, made.profile
    course = at.at(np.array([at.impact_time]))
    apart = made.at_impact
    return {
        "time": _told(impact.time, "s"),
        "bottom_dead_center": _told(impact.bottom_time - impact.time, "s"),
        "distance": _told(impact.distance, "m"),
        "clubhead_speed": _told(impact.speed, "m/s"),
        "profile_time": _told(at.impact_time, "s"),
        "angles": _axes(course.angles[0], "rad"),
        "velocities": _axes(course.velocities[0], "rad/s"),
        "angle_errors": _axes(apart[0], "rad"),
        "velocity_errors": _axes(apart[1], "rad/s"),
        "near": _axes(made.near, "rad"),
        "tee_piece_angle": _told(swing.tee_piece_angle, "rad"),
    }


def _axes(values: Any, unit: str) -> dict[str, Any]:
    arm, wrist, grip = map(float, values)
    return {"arm": arm, "wrist": wrist, "grip": grip, "unit": unit}


def _plane(swing: PlaneSwing) -> dict[str, Any]:
    plane = swing.plane
    return {
        "inclination": _told(plane.inclination, "rad"),
        "about_target": _told(plane.about_target, "rad"),
        "about_vertical": _told(plane.about_vertical, "rad"),
        "scatter": _told(plane.scatter, "m"),
        "frames": plane.frames,
        "hands_off_plane": _told(swing.off_plane[0], "m"),
        "clubhead_off_plane": _told(swing.off_plane[1], "m"),
        "arm_length": _told(swing.arm_length, "m"),
        "top_time": _told(swing.top_time, "s"),
    }


def _profile(golfer: GolferFile, made: Smoothed) -> dict[str, Any]:
    profile = made.profile
    return {
        "method": golfer.smoothing.method,
        "points": len(profile.time),
        "swing_time": _told(profile.time[-1], "s"),
        "kept": {"from": made.kept[0], "to": made.kept[1], "points": made.points, "unit": "s"},
        "phases": {name: _told(at, "s") for name, at in profile.phases.items()},
        "quantum": _told(profile.quantum, "deg"),
        "interpolation": profile.interpolation,
    }


def _use(use: Use) -> dict[str, Any]:
    return {
        "axis": use.axis,
        "quantity": use.quantity,
        "ratio": use.ratio,
        "time": use.time,
        "value": use.value,
        "limit": use.limit,
        "unit": use.unit,
    }


def _sentence(name: str, swing: PlaneSwing, made: Smoothed) -> str:
    turn, impact, plane = math.degrees(1.0), swing.impact, swing.plane
    late = 1e3 * (impact.bottom_time - impact.time)
    return (
        f"{name}: impact at {impact.time:.4f} s with {impact.speed:.1f} m/s, {abs(late):.0f} ms "
        f"{'before' if late > 0 else 'after'} the lowest point; the plane leans by "
        f"{turn * plane.inclination:.1f} degrees and aims {abs(turn * plane.about_vertical):.1f} "
        f"degrees to the {'left' if plane.about_vertical > 0 else 'right'}; the profile takes "
        f"{made.profile.time[-1]:.2f} s and is within "
        f"{turn * float(max(abs(made.at_impact[0]))):.2f} degrees of the golfer at impact."
    )


def _write(
    result: Mapping[str, Any], made: Smoothed, heard: Spectrum, limits: Limits, out: Path
) -> None:
    from ..optimize.profile import CSV, POD, write
    from .engine import write_together
    from .report import write_page

    page = _page(result, made, heard, limits)
    write_together(
        out,
        {
            CSV: lambda path: write(made.profile, path.parent, limits),
            POD: lambda path: path,  # written along with the table
            "golfer.csv": lambda path: path.write_text(_golfer(made), encoding="utf-8"),
            "report.html": lambda path: write_page(page, path),
        },
    )


def _golfer(made: Smoothed) -> str:
    """The measured angles on the profile's clock, for those who follow the golfer."""
    from ..optimize.profile_file import csv_text

    track, profile = made.track, made.profile
    pace = profile.impact_time / (track.impact_time - made.start)
    times = pace * (track.times - made.start)
    inside = (times >= 0.0) & (times <= profile.time[-1])
    return csv_text(times[inside], track.angles[inside])


def _page(
    result: Mapping[str, Any], made: Smoothed, heard: Spectrum, limits: Limits
) -> dict[str, Any]:
    from .profile_figure import motion_figure, spectrum_figure
    from .words import number_words, unit_words

    high = result["high_frequencies"]["above"]
    cutoff = high if result["profile"]["method"] == "smooth" else None
    left = result["high_frequencies"]["left"]
    shares = ", ".join(f"{axis} {100 * share:.2g} %" for axis, share in left.items())
    caption = "The profile as the robot plays it, over the measured angles (gray), and its limits."
    words = f"Of the measured accelerations above {high:g} Hz the profile keeps: {shares}."
    rows = [
        [
            f"{one['axis']} {one['quantity']}",
            f"{100 * one['ratio']:.1f} %",
            f"{number_words(one['value'])} {unit_words(one['unit'])}",
            f"{number_words(one['limit'])} {unit_words(one['unit'])}",
            f"{one['time']:.3f} s",
        ]
        for one in result["limits"]
    ]
    return {
        "title": "A profile of a golfer's swing",
        "status": "adequate" if result["status"] == "good" else "ambiguous",
        "chip": "Good" if result["status"] == "good" else "In doubt",
        "sentence": result["sentence"],
        "version": result["provenance"]["version"],
        "sections": [
            {
                "title": "Motion",
                "words": [*result["doubts"], *result["warnings"]],
                "figures": [_figure("Arm, wrist and grip", caption, motion_figure(made, limits))],
                "rows": [],
            },
            {
                "title": "Accelerations by frequency",
                "words": [],
                "figures": [_figure("Before and after", words, spectrum_figure(heard, cutoff))],
                "rows": [],
            },
            {
                "title": "Limits, at and between the points",
                "words": [],
                "figures": [],
                "head": ["limit", "used", "largest", "limit", "at"],
                "rows": rows,
                "left": 1,
            },
        ],
    }


def _figure(title: str, caption: str, figure: Any) -> dict[str, Any]:
    from .figures import data_uri

    uri = data_uri(figure)
    return {"title": title, "alt": caption, "caption": caption, "image": uri, "narrow": False}


def show_profile(result: Mapping[str, Any]) -> None:
    """Prints what was found, and how much of each limit is used.

    Args:
        result: of `profile_file`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from .words import number_words, unit_words

    console = Console(highlight=False, markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("limit")
    for name in ("used, %", "largest", "at, s"):
        table.add_column(name, justify="right")
    for one in result["limits"]:
        largest = f"{number_words(one['value'])} {unit_words(one['unit'])}"
        name = f"{one['axis']} {one['quantity']}"
        table.add_row(name, f"{100 * one['ratio']:.1f}", largest, f"{one['time']:.3f}")
    console.print(table)
    for one in result["filled"]:
        console.print(
            f"filled: {one['marker']}, {one['frames']} frames in {one['gaps']} gaps, the longest "
            f"{1e3 * one['longest']:.0f} ms"
        )
    for warning in (*result["warnings"], *result["doubts"]):
        console.print(f"! {warning}")
    console.print(result["sentence"])
