"""The main job on bundled records: from data to the named cause, its gain, and a better wrist."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .diagnosis import extended_rig, write_diagnosis
from .engine import Progress, read_inputs

if TYPE_CHECKING:
    from ..model.drive_file import DriveSpec
    from ..model.rig import Rig

FOLDER = Path("demo-report")
"""Where the demo writes when it is not told."""

SENSOR = "clubhead", "acceleration", "collet"
"""What a good wrist keeps small: place, quantity and frame."""

WINDOW = 0.005, 2.0
"""First and last time that count in the root mean square: from the end of the blow on [s]."""

STIFFNESS = {"low": 20.0, "high": 2000.0, "count": 13}
"""Wrist stiffnesses that are tried, evenly spaced by their logarithm [N m/rad]."""

DAMPING = {"low": 0.5, "high": 50.0, "count": 13}
"""Wrist dampings that are tried, evenly spaced by their logarithm [N m s/rad]."""


def diagnose_demo(
    out: Path | None = None, seed: int = 0, progress: Progress = lambda text: None
) -> tuple[dict[str, Any], bool]:
    """Diagnose the bundled records and search the wrist again with what was found.

    Args:
        out: folder for diagnosis.json, rig.toml (extended) and report.html.
        seed: kept in the provenance; nothing here is drawn by chance.
        progress: told what is being done.

    Returns:
        The contract's ``diagnosis.json`` with its decision, and whether it is to be trusted.

    Raises:
        ValueError: where the folder cannot be written to.
    """
    with ExitStack() as stack:
        folder = stack.enter_context(as_file(files("supple.studies") / "data" / "demo"))
        blow = stack.enter_context(as_file(files("supple.studies") / "data" / "blow.toml"))
        sidecars = sorted(path for path in folder.glob("*.toml") if path.name != "rig.toml")
        inputs = read_inputs(sidecars, None)
        from ..identification.diagnose import diagnose
        from ..identification.verdict import diagnosis_json
        from ..model.drive_file import read_drive

        found = diagnose(inputs.records, inputs.rig, inputs.held_out, progress)
        progress("searching the wrist again")
        bare = extended_rig(replace(found, final=found.base, accepted=()), inputs.rig)
        spec = read_drive(blow)
        inputs.files[str(blow)] = spec.sha256
        decision = wrist_decision(bare, extended_rig(found, inputs.rig), spec)
        progress("")
        result = diagnosis_json(found, inputs.provenance(seed))
        result["decision"] = decision
        result["what_next"] = f"{result['what_next']} {decision_words(decision)}"
        write_diagnosis(result, found, inputs, out)
    return result, found.final.converged


def wrist_decision(before: Rig, after: Rig, spec: DriveSpec) -> dict[str, Any]:
    """The best wrist by two models of one rig, and what ignoring the difference costs.

    Args:
        before: the rig as fitted without its cause.
        after: the rig as fitted with it.
        spec: what moves every design.

    Returns:
        The contract's ``decision``: stiffness [N m/rad], damping [N m s/rad] and root mean square
        [m/s^2] of the best designs, the relative loss [-], and how it was made.

    Raises:
        ValueError: where the drive or a rig is at fault.
    """
    import numpy as np

    from ..model.drives import drive_of
    from ..model.linear import Port
    from ..model.mechanism import mechanism_of
    from ..optimize.wrist import WristTask, decide, map_wrists

    mechanism = mechanism_of(before)
    axes = [np.geomspace(axis["low"], axis["high"], axis["count"]) for axis in (STIFFNESS, DAMPING)]
    times = np.arange(round(spec.duration * spec.sample_rate)) / spec.sample_rate
    task = WristTask(drive_of(spec, mechanism), times, WINDOW, Port(*SENSOR), *axes)
    maps = []
    for rig in (before, after):
        numbers = {name: number.value for name, number in rig.parameters.items()}
        maps.append(map_wrists(mechanism_of(rig), numbers, task, rig.laws))
    how = {
        "score": {"rms": ":".join(SENSOR), "unit": "m/s^2", "window": list(WINDOW)},
        "grid": {"wrist_stiffness": STIFFNESS, "wrist_damping": DAMPING, "scale": "log"},
        "drive": {
            "kind": spec.kind,
            "place": spec.place,
            "force": spec.force,
            "start": spec.start,
            "duration": spec.drive_duration,
        },
        "samples": len(times),
        "sample_rate": spec.sample_rate,
        "is_minimum": all(one.is_inside for one in maps),
        "step_error": max(one.error for one in maps),
    }
    return decide(*maps) | {"how": how}


def decision_words(decision: Mapping[str, Any]) -> str:
    """What a decision says, in a sentence; its numbers in [SI]."""
    before, after = (decision[key] for key in ("best_before", "best_after"))
    wrists = [
        f"{one['wrist_stiffness']:.3g} N m/rad and {one['wrist_damping']:.3g} N m s/rad"
        for one in (before, after)
    ]
    if wrists[0] == wrists[1]:
        return f"The best wrist stays at {wrists[0]}."
    loss = 100.0 * decision["loss_if_ignored"]["rms"]
    return (
        f"The best wrist moves from {wrists[0]} to {wrists[1]}; the old choice vibrates "
        f"{loss:.2g} % more."
    )
