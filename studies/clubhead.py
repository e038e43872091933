"""How did the club arrive? From markers to angles, path, speed and the point of impact."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from ..identification.clubhead import Clubhead
    from ..identification.clubhead_impact import Impact

COLUMNS = (
    "time", "center_x", "center_y", "center_z", "center_std", "lie_angle", "lie_angle_std",
    "dynamic_loft", "dynamic_loft_std", "face_angle", "face_angle_std", "speed", "speed_std",
    "toe_speed", "toe_speed_std", "heel_speed", "heel_speed_std", "path_angle", "path_angle_std",
    "attack_angle", "attack_angle_std", "raw_speed", "raw_speed_std", "raw_attack_angle",
    "raw_attack_angle_std", "bandwidth", "markers_used",
)  # fmt: skip
"""Columns of ``clubhead.csv`` after swing and frame, in SI units [s, m, rad, m/s, Hz, -]; after
them ``NAME_speed`` and ``NAME_speed_std`` of each point of the club [m/s]."""


def clubhead_files(
    paths: Sequence[Path], out: Path | None = None, seed: int = 0
) -> tuple[dict[str, Any], bool]:
    """Measures every swing.

    Args:
        paths: sidecars, or tables of markers beside one.
        out: folder for ``clubhead.csv``; None for none.
        seed: kept in the provenance; nothing here is drawn by chance.

    Returns:
        The contents of ``clubhead.json``, and whether they are to be trusted.

    Raises:
        ValueError: in the words of the door.
    """
    from .. import __version__
    from ..identification.clubhead import IN_DOUBT, NO_IMPACT, measure_clubhead
    from ..identification.clubhead_file import read_swing
    from ..model.door import write_beside

    began = time.perf_counter()
    heads = [measure_clubhead(*read_swing(path)) for path in paths]
    statuses = [head.status for head in heads]
    worst = next((one for one in (IN_DOUBT, NO_IMPACT) if one in statuses), "good")
    inputs: dict[str, str] = {}
    for head in heads:
        inputs |= head.swing.files
    if out is not None:
        write_beside(out / "clubhead.csv", _csv(heads))
    result = {
        "status": worst,
        "sentence": " ".join(_sentence(head) for head in heads),
        "swings": [_swing(head) for head in heads],
        "provenance": {
            "version": __version__,
            "inputs": inputs,
            "seed": seed,
            "seconds": round(time.perf_counter() - began, 3),
        },
    }
    return result, worst != IN_DOUBT


def _told(value: float, std: float, unit: str, quantile: float) -> dict[str, Any]:
    low, high = value - quantile * std, value + quantile * std
    return {"value": value, "std": std, "low": low, "high": high, "unit": unit}


def _swing(head: Clubhead) -> dict[str, Any]:
    from ..identification.clubhead_face import REACH
    from ..identification.clubhead_path import bandwidth

    poses, ball, rate = head.poses, head.ball, head.swing.rate
    return {
        "name": head.swing.name,
        "file": str(head.swing.path),
        "status": head.status,
        "sentence": _sentence(head),
        "frames": int((head.source >= 0).sum()),
        "frames_found": int(poses.found.sum()),
        "sample_rate": rate,
        "markers": len(poses.used[0]),
        "noise": poses.noise,
        "noise_std": poses.noise / math.sqrt(2.0 * max(poses.freedom, 1)),
        "smoothing": {
            "frames": head.width[0],
            "frames_after": head.width[1],
            "bandwidth": bandwidth(head.width[0], rate),
            "bandwidth_after": bandwidth(head.width[1], rate),
            "frames_at_impact": head.impact.frames if head.impact else None,
            "bandwidth_at_impact": bandwidth(head.impact.frames, rate, at_end=True)
            if head.impact
            else None,
            "at_impact": "of what the club does beside the arc on which it swings",
            "unit": "Hz",
        },
        "toe_and_heel_at": REACH,
        "impact": None if head.impact is None else _impact(head.impact),
        "speed_loss": _losses(head),
        "ball": None
        if ball is None
        else {
            "center": list(map(float, ball.center)),
            "std": [math.sqrt(ball.covariance[i, i]) for i in range(3)],
            "radius": ball.radius,
            "misfit": ball.misfit,
            "unit": "m",
        },
        "warnings": list(head.warnings),
    }


def _impact(impact: Impact) -> dict[str, Any]:
    from ..identification.clubhead_impact import UNITS

    told: dict[str, Any] = {
        name: _told(value, impact.stds[name], UNITS.get(name, "m/s"), impact.quantile)
        for name, value in impact.values.items()
    }
    return told | {
        "by": impact.by,
        "frame": impact.frame,
        "frames": impact.frames,
        "reduced_chi2": impact.reduced_chi2,
    }


def _losses(head: Clubhead) -> dict[str, Any] | None:
    if head.losses is None or head.impact is None:
        return None
    rows = zip(("center", "toe", "heel"), head.losses.tolist(), strict=True)
    quantile = head.impact.quantile
    return {name: _told(value, std, "m/s", quantile) for name, (value, std) in rows}


def _sentence(head: Clubhead) -> str:
    if head.impact is None:
        return f"{head.swing.name}: no impact was found."
    values, stds = head.impact.values, head.impact.stds

    def short(name: str, factor: float = 1.0) -> str:
        return f"{factor * values[name]:.2f} ± {factor * stds[name]:.2g}"

    turn = math.degrees(1.0)
    text = (
        f"{head.swing.name}: {short('speed')} m/s at impact, attack "
        f"{short('attack_angle', turn)}, path {short('path_angle', turn)}, face "
        f"{short('face_angle', turn)}, dynamic loft {short('dynamic_loft', turn)}, lie "
        f"{short('lie_angle', turn)} degrees"
    )
    if "impact_toe" in values:
        toe, up = short("impact_toe", 1e3), short("impact_up", 1e3)
        text += f"; the ball touched {toe} mm to the toe and {up} mm up"
    return text + "."


def _csv(heads: Sequence[Clubhead]) -> str:
    points = dict.fromkeys(name for head in heads for name in head.club.points)
    extra = [column for name in points for column in (f"{name}_speed", f"{name}_speed_std")]
    lines = [",".join(("swing", "frame", *COLUMNS, *extra))]
    for head in heads:
        name = head.swing.name
        quoted = '"' + name.replace('"', '""') + '"' if set(name) & set('",\n') else name
        for frame, row in zip(head.source, _table(head, list(points)).tolist(), strict=True):
            cells = ("" if math.isnan(value) else f"{value:.10g}" for value in row)
            if frame >= 0:
                lines.append(f"{quoted},{frame},{','.join(cells)}")
    return "\n".join(lines) + "\n"


def _table(head: Clubhead, points: Sequence[str]) -> np.ndarray:
    import numpy as np

    from ..identification.clubhead_path import bandwidth

    poses, count, rate = head.poses, len(head.poses.found), head.swing.rate
    spread = np.sqrt(np.trace(poses.covariance[:, :3, :3], axis1=1, axis2=2) / 3)
    turned = np.stack([head.angles, head.angle_stds], axis=2).reshape(count, 6)
    speeds = np.stack([head.speeds, head.speed_stds], axis=2)
    before, after = (bandwidth(width, rate) for width in head.width)
    late = head.impact is not None and np.arange(count) > head.impact_frame
    rest = (
        head.path_angle, head.path_std, head.attack_angle, head.attack_std, head.raw_speed,
        head.raw_speed_std, head.raw_attack_angle, head.raw_attack_std,
        np.where(late, after, before), poses.used.sum(axis=1),
    )  # fmt: skip
    own = {name: speeds[:, 3 + k] for k, name in enumerate(head.club.points)}
    further = [own.get(name, np.full((count, 2), np.nan)) for name in points]
    times = np.arange(count) / rate
    main = speeds[:, :3].reshape(count, 6)
    return np.column_stack([times, poses.position, spread, turned, main, *rest, *further])


def show_clubhead(result: Mapping[str, Any]) -> None:
    """Prints each swing's impact as a line of a table, and the findings under it.

    Args:
        result: of `clubhead_files`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("swing", overflow="fold")
    shown = (("speed", "m/s", 1.0), ("attack_angle", "deg", math.degrees(1.0)),
             ("face_angle", "deg", math.degrees(1.0)), ("impact_toe", "mm", 1e3),
             ("impact_up", "mm", 1e3))  # fmt: skip
    for name, unit, _ in shown:
        table.add_column(f"{name.replace('_', ' ')}, {unit}", justify="right")
    table.add_column("status")
    for swing in result["swings"]:
        impact = swing["impact"] or {}
        cells = ["-" if name not in impact else _cell(impact[name], f) for name, _, f in shown]
        table.add_row(swing["name"], *cells, swing["status"])
    console.print(table)
    for swing in result["swings"]:
        for warning in swing["warnings"]:
            console.print(f"! {swing['name']}: {warning}")
        smooth = swing["smoothing"]
        console.print(
            f"{swing['name']}: speeds and directions are smoothed over {smooth['frames']} frames, "
            f"to {smooth['bandwidth']:.3g} Hz; the raw steps from frame to frame stand beside."
        )
    console.print(result["sentence"])


def _cell(one: Mapping[str, Any], factor: float) -> str:
    return f"{factor * one['value']:.2f} ± {factor * one['std']:.2g}"
