"""Which method leaves the least vibration at the same impact? Nine classics and an optimum."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .engine import start_engine
from .listing import printed, written
from .study import Call, Study
from .usual_swing import robot_file, task_file

WAVES = ("instantaneous", "square", "half_sine", "suppressed_half_sine", "s_curve")
"""Torque waves and the S-curve: one motion an axis."""

CASES = {"thesis": ((45.0, 0.0), (45.0, -1000.0)), "planar": ((30.0, -1000.0),)}
"""Clubhead speed [m/s] and force of the ball [N], by fidelity."""

HEADINGS = (
    "fidelity", "m/s", "ball N", "method", "worst mm", "nominal mm", "speed off", "pose off",
    "limits", "jerk arm / wrist", "peak N m", "",
)  # fmt: skip


def compare(call: Call, fidelity: str = "thesis") -> dict[str, Any]:
    """Find and score the swings of all methods: same robot, impact, duration and limits.

    Args:
        call: its folder gets the table as Markdown and JSON.
        fidelity: ``thesis`` or ``planar``.

    Returns:
        One row a case and method, and how long each case took [s].
    """
    import tempfile

    start_engine()
    from ..model.rig import read_rig
    from ..optimize.task import read_task

    rows: list[dict[str, Any]] = []
    found = {"fidelity": fidelity, "hold": "chord", "quantum": 1e-4, "rows": rows, "seconds": []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "rig.toml").write_text(robot_file(fidelity))
        rig = read_rig(folder / "rig.toml")
        for speed, force in CASES[fidelity]:
            (folder / "task.toml").write_text(task_file(speed, force, scenarios=5))
            began = time.perf_counter()
            rows += _case(read_task(folder / "task.toml"), rig, call)
            found["seconds"].append(round(time.perf_counter() - began, 2))
    written("swing_methods", found, HEADINGS, rows_of(found), words_of(found), call.out)
    return found


def _case(task: Any, rig: Any, call: Call) -> list[dict[str, Any]]:
    """Rows of one task."""
    from ..optimize.classic import classic, slow_mode
    from ..optimize.classic_wave import wave
    from ..optimize.shaper import ei, zv, zvd
    from ..optimize.solve import solve

    rows, mode = [], slow_mode(rig)
    for shape in WAVES:
        call.progress(shape)
        one: Any = wave(task, rig, shape)  # type: ignore[arg-type]
        rows.append(_scored(shape.replace("_", " "), one and one.profile, task, rig))
    for shaper in (None, zv(*mode), zvd(*mode), ei(*mode)):
        name = "least jerk" if shaper is None else f"least jerk, {shaper.name}"
        call.progress(name)
        one = classic(task, rig, shaper)
        rows.append(
            _scored(name, one.profile if np.isfinite(one.found.c).all() else None, task, rig)
        )
    call.progress("optimal")
    rows.append(_scored("optimal, robust", solve(task, rig).profile, task, rig))
    return rows


def _scored(name: str, profile: Any, task: Any, rig: Any) -> dict[str, Any]:
    """The one scorer: the file's points played by the model, whatever method they came from."""
    from ..optimize.swing_check import EXCESS, POSE, SPEED, examine

    row: dict[str, Any] = {
        "fidelity": rig.fidelity, "speed": task.impact.clubhead_speed, "force": task.impact.force,
        "method": name, "scored": False, "verdict": "no motion meets impact",
    }  # fmt: skip
    if profile is None:
        return row
    verdict = examine(profile, task, rig)
    pose = max(abs(v) for k, v in verdict.errors.items() if k != "speed")
    limits = max((use for use in verdict.uses), key=lambda use: use.ratio)
    course = profile.at(np.linspace(0.0, profile.time[-1], 4001))
    fails = []
    if not (abs(verdict.errors["speed"]) <= SPEED and pose <= POSE):
        fails.append("misses impact")
    if not limits.ratio <= 1.0 + EXCESS:
        fails.append(f"breaks the {limits.axis} {limits.quantity} limit")
    rings = verdict.residual
    if not np.isfinite(rings).all():
        fails.append("the model runs away")
    told = {
        "worst": float(rings.max()), "nominal": float(verdict._ring(verdict.nominal, 0)),
        "speed_error": verdict.errors["speed"], "pose_error": pose, "limit_ratio": limits.ratio,
        "rms_jerk": [float(np.sqrt(np.mean(course.jerks[:, axis] ** 2))) for axis in (0, 1)],
        "peak_torque": [abs(use.value) for use in verdict.torques],
    }  # fmt: skip
    row |= {key: _finite(value) for key, value in told.items()}
    return row | {"scored": True, "verdict": ", ".join(fails)}


def _finite(value: Any) -> Any:
    if isinstance(value, list):
        return [_finite(one) for one in value]
    return float(value) if np.isfinite(value) else None


def rows_of(found: Mapping[str, Any]) -> list[list[str]]:
    """Rows of the table, of what `compare` returns [-]."""
    return [_row(one) for one in found["rows"]]


def _row(one: Mapping[str, Any]) -> list[str]:
    head = [one["fidelity"], f"{one['speed']:g}", f"{one['force']:g}", one["method"]]
    if not one["scored"]:
        return [*head, *[""] * (len(HEADINGS) - 5), one["verdict"]]

    def figure(value: float | None, scale: float = 1.0, digits: int = 3) -> str:
        return "–" if value is None else f"{scale * value:.{digits}g}"

    return [
        *head, figure(one["worst"], 1e3), figure(one["nominal"], 1e3),
        figure(one["speed_error"], digits=2), f"{figure(one['pose_error'], 180 / np.pi, 2)}°",
        f"× {figure(one['limit_ratio'])}", " / ".join(figure(j, digits=4) for j in one["rms_jerk"]),
        " / ".join(figure(t) for t in one["peak_torque"]), one["verdict"],
    ]  # fmt: skip


def words_of(found: Mapping[str, Any]) -> list[str]:
    """What the table says, in lines [-]."""
    lines = [
        f"Every row: the file's points ({found['quantum']:g}° a digit, cubic), played by the model "
        f"of fidelity {found['fidelity']}; pose: {found['hold']}; 41 shaft frequencies within a "
        "tenth; the least jerk, shaped or not, obeys the same limits, the waves obey none."
    ]
    for speed, force in dict.fromkeys((one["speed"], one["force"]) for one in found["rows"]):
        rows = [one for one in found["rows"] if (one["speed"], one["force"]) == (speed, force)]
        fair = [one for one in rows[:-1] if one["scored"] and not one["verdict"]]
        best = min(fair, key=lambda one: one["worst"], default=None)
        ours = rows[-1]["worst"] if rows[-1]["scored"] else None
        case = f"{speed:g} m/s, ball {force:g} N"
        if best is None or ours is None:
            lines.append(f"{case}: no classic keeps limits and impact.")
            continue
        share = 100 * ours / best["worst"]
        lines.append(
            f"{case}: the best classic that keeps limits and impact is {best['method']} with "
            f"{1e3 * best['worst']:.3g} mm; the optimal swing leaves {1e3 * ours:.3g} mm, "
            f"{share:.2g} % of it."
        )
        plain = next((one for one in fair if one["method"] == "least jerk"), None)
        worse = [
            one["method"] for one in rows[:-1]
            if plain and "," in one["method"]
            and (not one["scored"] or one["verdict"] or one["worst"] > plain["worst"])
        ]  # fmt: skip
        if worse:
            lines.append(
                f"{case}: {'; '.join(worse)} fail: worse than the least jerk without a shaper, "
                "past a limit, or not at the ball."
            )
    if any(one["force"] for one in found["rows"]):
        lines.append(
            "No shaper knows the ball: it shapes what the motors do, not what the ball does."
        )
    if found["fidelity"] == "planar":
        lines.append("Shapers cancel vibration of a linear robot; this one is not.")
    return lines


def show(found: Mapping[str, Any]) -> None:
    """Print the table and what it says."""
    below = [*words_of(found), f"{', '.join(f'{s:g} s' for s in found['seconds'])} a case."]
    printed(
        "One scorer for all: worst and nominal ring after the end.", HEADINGS, rows_of(found), below
    )


STUDY = Study(
    "swing_methods",
    "Which method leaves the least vibration at the same impact (linear robot)?",
    compare,
    show,
)
