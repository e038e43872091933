"""What swing should this robot play? The optimal one, its files, and an independent check."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import start_engine, write_together
from .swing_draws import with_draws

if TYPE_CHECKING:
    from ..model.rig import Rig
    from ..optimize.solve import Swing
    from ..optimize.swing_check import Verdict
    from ..optimize.task import SwingTask

Tell = Callable[[str], None]


def swing_task(
    path: Path,
    out: Path | None = None,
    seed: int = 0,
    tell: Tell = lambda text: None,
    prices: bool = False,
    hardware: bool = False,
) -> tuple[dict[str, Any], bool]:
    """Finds the swing of a task, writes its files, and checks the file that the robot reads.

    Args:
        path: the task.
        out: folder for ``swing.json``, ``profile.csv``, ``profile.pod`` and ``report.html``;
            nothing is kept where None. A swing that breaks a limit gets no profile.
        seed: kept in the provenance; nothing here is drawn by chance.
        tell: told what is being done.
        prices: whether to add a price list: swings for other weights and times to stop.
        hardware: whether to add what another wrist or collet would change.

    Returns:
        What ``swing.json`` holds, and whether the swing can be trusted.

    Raises:
        ValueError: for the first fault of the task, the rig or the golfer's file.
    """
    from ..model.rig import read_rig
    from ..optimize.solve_torque import check_torque
    from ..optimize.task import read_task

    began = time.perf_counter()
    task = read_task(path)
    rig = read_rig(task.rig)
    _check_rig(rig)
    check_torque(task.shaft, rig)
    golfer, task = _golfer_of(task), with_draws(task, rig)
    start_engine()
    from ..optimize.solve import solve

    swing = solve(task, rig, golfer, tell)
    seconds = time.perf_counter() - began
    tell("checking the robot's file")
    verdict, texts = _played_back(swing, rig)
    result = swing_result(swing, verdict, rig)
    result["provenance"] = _provenance(task, rig, seed, began, seconds)
    if prices and swing.status == "solved":
        result["prices"] = _prices(swing.task, rig, golfer, tell)
    if hardware and swing.status == "solved":
        tell("what other hardware would change")
        result["hardware"] = _hardware(swing, rig)
    classics = [] if out is None or verdict is None else _classics(swing.task, rig, tell)
    _write(result, (verdict, classics), texts, out)
    return result, swing.status == "solved" and verdict is not None and verdict.passed


def _prices(task: SwingTask, rig: Rig, golfer: Any, tell: Tell) -> list[dict[str, Any]]:
    """The price list as tables that JSON can hold."""
    from dataclasses import asdict
    from math import isfinite

    from ..optimize.front import front

    listed = []
    for one in front(task, rig, golfer, tell=tell):
        row = asdict(one)
        listed.append(row | {"ring": one.ring if isfinite(one.ring) else None})
    return listed


def _hardware(swing: Swing, rig: Rig) -> dict[str, Any]:
    """What the best swing would cost on hardware that is a little other, as JSON holds it."""
    from ..optimize.hardware import NAMES, slopes

    by = slopes(swing.problem, swing.found, rig, NAMES)
    parts, whole = swing.found.parts, swing.found.cost
    return {
        "optimality_missed": by.left,
        "slopes": [
            {
                "parameter": name, "value": float(rig.parameters[name].value),
                "unit": rig.parameters[name].unit, "cost": by.cost[name] / whole,
                "vibration": by.vibration[name] / parts["vibration"],
            }
            for name in NAMES
        ],
    }  # fmt: skip


def _check_rig(rig: Rig) -> None:
    from ..model.door import fault

    if rig.kind != "robot" or rig.model != "driven_arm":
        found = "a chain" if rig.kind != "robot" else f"'{rig.model}'"
        mend = "write model = 'driven_arm'"
        raise fault(rig.path, "[rig] model", "a robot whose arm and wrist are driven", found, mend)


def _golfer_of(task: SwingTask) -> dict[str, Any] | None:
    """The golfer's motion, with the grip's angle where the file has it."""
    from ..model.drive_file import read_profile

    if task.golfer is None:
        return None
    columns = read_profile(task.golfer, ("arm_angle", "wrist_angle"))
    with task.golfer.open(encoding="utf-8-sig") as file:
        has_grip = "grip_angle" in file.readline()
    if has_grip:
        columns |= read_profile(task.golfer, ("grip_angle",))
    return columns


def _played_back(swing: Swing, rig: Rig) -> tuple[Verdict | None, dict[str, str]]:
    """The check of the file as it is read back, and the texts of both files; none if refused."""
    import tempfile

    from ..optimize.profile import read_pod, write
    from ..optimize.swing_check import examine

    if swing.status == "infeasible":
        return None, {}
    with tempfile.TemporaryDirectory() as folder:
        try:
            files = write(swing.profile, folder, swing.task.limits)
        except ValueError:  # the excess is in the verdict, with place and factor
            return examine(swing.profile, swing.task, rig), {}
        texts = {path.name: path.read_text(encoding="utf-8") for path in files}
        return examine(read_pod(files[1]), swing.task, rig), texts


def swing_result(swing: Swing, verdict: Verdict | None, rig: Rig) -> dict[str, Any]:
    """What ``swing.json`` holds, without its provenance.

    Args:
        swing: as solved.
        verdict: of the check; None for a swing that limits forbid.
        rig: the robot.

    Returns:
        Tables and numbers that JSON can hold.
    """
    import numpy as np

    task, found = swing.task, swing.found
    motion = swing.motion
    price = {}
    for axis, name in enumerate(("arm", "wrist")):
        price[name] = {
            "rms_jerk": float(np.sqrt(np.mean(motion[:, axis, 3] ** 2))),
            "peak_acceleration": float(np.abs(motion[:, axis, 2]).max()),
        }
    for use in () if verdict is None else verdict.torques:
        price[use.axis]["peak_torque"] = abs(use.value)
    price["cost"] = {"total": found.cost, **found.parts}
    result = {
        "status": swing.status if verdict is None or verdict.passed else "check_failed",
        "sentence": swing.sentence,
        "fidelity": rig.fidelity,
        "hold": task.impact.hold,
        "file": {"quantum": task.quantum, "interpolation": task.interpolation},
        "impact": _impact(swing, verdict),
        "limits": _limits(swing, verdict),
        "binding": [
            {"limit": one.words, "time": one.time, "share": one.share} for one in swing.binding
        ],
        "residual": _residual(swing, verdict),
        "price": price,
        "check": _check(verdict),
        "solver": {
            "programs": found.programs, "error": found.error, "gap": found.answer.gap,
            "scenarios": list(swing.factors), "unknowns": len(found.c),
        },
    }  # fmt: skip
    if swing.fastest is not None:
        result["fastest_feasible_speed"] = swing.fastest
    return result


def _impact(swing: Swing, verdict: Verdict | None) -> dict[str, Any]:
    from math import degrees

    at = swing.task.impact
    result: dict[str, Any] = {
        "time": swing.profile.impact_time, "clubhead_speed": at.clubhead_speed,
        "arm_angle": at.arm_angle, "wrist_angle": at.wrist_angle,
    }  # fmt: skip
    if verdict is None:
        return result
    errors = verdict.errors
    result["clubhead_speed"] = at.clubhead_speed + errors["speed"]
    result["speed_error"] = errors["speed"]
    result["pose_errors_degrees"] = {k: degrees(v) for k, v in errors.items() if k != "speed"}
    result["spread"] = {
        "speed": list(verdict.spreads["speed"]),
        "pose_degrees": {
            name: [degrees(low), degrees(high)]
            for name, (low, high) in verdict.spreads.items()
            if name != "speed"
        },
    }
    return result


def _limits(swing: Swing, verdict: Verdict | None) -> dict[str, Any]:
    import math

    from ..optimize.profile import excess

    uses = excess(swing.profile, swing.task.limits)
    uses = uses if verdict is None else (*verdict.uses, *verdict.torques)
    listed = [
        {
            "axis": use.axis, "quantity": use.quantity, "ratio": use.ratio, "time": use.time,
            "value": use.value, "limit": use.limit, "unit": use.unit,
        }
        for use in uses
        if math.isfinite(use.limit)
    ]  # fmt: skip
    for name, bent, most in [] if verdict is None else verdict.shaft_uses():
        if math.isfinite(most):
            listed.append(
                {
                    "axis": "shaft", "quantity": name, "ratio": bent / most, "value": bent,
                    "limit": most, "unit": "m",
                }
            )  # fmt: skip
    worst = max((one["ratio"] for one in listed), default=0.0)
    return {"largest_ratio": worst, "uses": listed}


def _residual(swing: Swing, verdict: Verdict | None) -> dict[str, Any]:
    if verdict is None:
        return {}
    ring = verdict.residual
    return {
        "parameter": swing.task.robust.parameter or "shaft_frequency",
        "factor": verdict.factors.tolist(),
        "amplitude": ring.tolist(),
        "worst": float(ring.max()),
        "nominal": float(verdict._ring(verdict.nominal, 0)),
        "unit": "m",
    }


def _check(verdict: Verdict | None) -> dict[str, Any]:
    if verdict is None:
        return {"passed": False, "failures": ["there is no swing to check"]}
    before, after = verdict.vibration()
    return {
        "passed": verdict.passed,
        "failures": list(verdict.failures),
        "doubt": verdict.nominal.doubt,
        "simulated_step": float(verdict.nominal.times[1]),
        "clubhead_velocity_rms": {"before_impact": before, "after_impact": after},
    }


def _provenance(
    task: SwingTask, rig: Rig, seed: int, began: float, solved: float
) -> dict[str, Any]:
    from .. import __version__
    from ..model.door import sha256_of

    inputs = {str(task.path): task.sha256, str(rig.path): rig.sha256}
    for file in (task.golfer, task.robust.file):
        if file is not None:
            inputs[str(file)] = sha256_of(file.read_bytes())
    return {
        "version": __version__, "inputs": inputs, "seed": seed,
        "seconds": round(time.perf_counter() - began, 3), "seconds_to_solve": round(solved, 3),
    }  # fmt: skip


def _write(
    result: Mapping[str, Any],
    drawn: tuple[Verdict | None, list[Any]],
    texts: Mapping[str, str],
    out: Path | None,
) -> None:
    """All files together, or none of them."""
    import json

    if out is None:
        return
    whole = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    contents = {**texts, "swing.json": whole}
    writers: dict[str, Callable[[Path], Any]] = {
        name: (lambda path, text=text: path.write_text(text, encoding="utf-8"))
        for name, text in contents.items()
    }
    from .swing_report import write_swing_report

    writers["report.html"] = lambda path: write_swing_report(result, *drawn, path)
    write_together(out, writers)


def _classics(task: SwingTask, rig: Rig, tell: Tell) -> list[Any]:
    """Classic swings to draw beside the optimal one; fewer where each takes seconds."""
    from ..optimize.classic import classic, slow_mode
    from ..optimize.shaper import ei, zv, zvd

    mode = slow_mode(rig)
    shapers = [None, zvd(*mode)] if rig.fidelity == "planar" else [None, zv(*mode), zvd(*mode)]
    shapers += [] if rig.fidelity == "planar" else [ei(*mode)]
    found = []
    for shaper in shapers:
        tell(f"to compare with: {'least jerk' if shaper is None else shaper.name}")
        found.append(classic(task, rig, shaper))
    return found


def show_swing(result: Mapping[str, Any]) -> None:
    """Prints what was found and what the check says.

    Args:
        result: of `swing_task`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    console.print(result["sentence"])
    at = result["impact"]
    if "speed_error" in at:
        poses = ", ".join(f"{k} {v:+.4f}°" for k, v in at["pose_errors_degrees"].items())
        console.print(
            f"From the file, simulated anew: speed {at['speed_error']:+.4f} m/s, {poses}."
        )
        ring = result["residual"]
        low, high = ring["factor"][0], ring["factor"][-1]
        console.print(
            f"Ring after the end: {1e3 * ring['nominal']:.3g} mm, at worst "
            f"{1e3 * ring['worst']:.3g} mm for {ring['parameter']} × {low:g} to {high:g}."
        )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("limit")
    for heading in ("used", "at [s]", "value", "bound"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for use in result["limits"]["uses"]:
        when = f"{use['time']:.3f}" if "time" in use else ""
        share, value, bound = (f"{use[key]:.4g}" for key in ("ratio", "value", "limit"))
        table.add_row(f"{use['axis']} {use['quantity']}", share, when, value, bound, use["unit"])
    console.print(table)
    for one in result.get("hardware", {}).get("slopes", ()):
        name = one["parameter"].replace("_", " ")
        console.print(
            f"A {name} 1 % higher, with its own best swing: cost {one['cost']:+.2g} %, "
            f"vibration {one['vibration']:+.2g} %."
        )
    for failure in result["check"]["failures"]:
        console.print(f"! {failure[0].upper()}{failure[1:]}.")
    if result["check"].get("doubt"):
        console.print(f"! {result['check']['doubt']}")
