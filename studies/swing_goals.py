"""Does the optimal swing keep what it promises? Its file, played anew, against stated goals."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import Answer, finding, show
from .study import Call, Study
from .usual_swing import usual
from .words import number_words

if TYPE_CHECKING:
    from ..model.rig import Rig
    from ..optimize.swing_check import Verdict
    from ..optimize.task import SwingTask

NAME = "swing_goals"
QUESTION = "Does the optimal swing keep what it promises when its file is played anew?"
HEADINGS = (
    "fidelity", "m/s", "ball N", "shaft", "impact in all", "speed off [m/s]", "pose off [°]",
    "largest use of a limit", "pose within a tenth [°]", "speed [m/s]", "worst ring [mm]",
    "best classic [mm]", "share", "s", "missed",
)  # fmt: skip
FREE, BOUND, PLANE = "free", "0.30 / 0.45 m", "planar"
LINEAR = "thesis"
SPEED, POSE, EXCESS = 0.01, 0.005, 1e-3
"""Largest errors at impact [m/s, degrees], and excess of a limit [-]."""

ALL_POSE = 0.1
"""Largest error of the pose in any scenario where impact is asked of all [degrees]."""

SHARES = {(LINEAR, FREE): 0.01, (LINEAR, BOUND): 0.03, (PLANE, BOUND): 0.01}
"""Worst ring as a share of the best classic's that is to be kept [-]."""


@dataclass(frozen=True)
class Case:
    """One swing.

    Attributes:
        fidelity: ``thesis`` or ``planar``.
        speed: of the clubhead [m/s].
        force: of the ball [N].
        shaft: whether its bend is bounded, `FREE` or `BOUND`.
        in_all: whether impact is asked of every scenario.
    """

    fidelity: str
    speed: float
    force: float
    shaft: str = BOUND
    in_all: bool = False


CASES = (
    *(Case(LINEAR, v, f, s) for s in (FREE, BOUND) for v in (30.0, 45.0) for f in (0.0, -1000.0)),
    Case(LINEAR, 30.0, -1000.0, BOUND, True),
    Case(LINEAR, 45.0, -1000.0, FREE, True),
    *(Case(PLANE, v, f) for v in (30.0, 45.0) for f in (0.0, -1000.0)),
    Case(PLANE, 30.0, -1000.0, BOUND, True),
)
"""Both fidelities and speeds, with and without the ball."""


def asked(case: Case) -> tuple[SwingTask, Rig]:
    """Task and rig of a case; five scenarios where the robot is linear, three in the plane."""
    return usual(
        case.fidelity, case.speed, case.force, shaft_bounded=case.shaft == BOUND,
        scenarios=3 if case.fidelity == PLANE else 5, in_all=case.in_all,
    )  # fmt: skip


def played(case: Case) -> dict[str, Any]:
    """One swing: solved, written, read back, simulated anew, and beside the best classic.

    Args:
        case: what is asked.

    Returns:
        What was found, as JSON holds it [SI, pose in degrees].
    """
    from ..optimize.profile import read_pod, write
    from ..optimize.solve import SOLVED, solve
    from ..optimize.swing_check import examine

    task, rig = asked(case)
    began = time.perf_counter()
    swing = solve(task, rig)
    spent = time.perf_counter() - began
    row: dict[str, Any] = {**vars(case), "status": swing.status, "seconds": round(spent, 2)}
    if swing.status != SOLVED:
        return row | {"missed": ["no swing"], "sentence": swing.sentence}
    with tempfile.TemporaryDirectory() as folder:
        files = write(swing.profile, folder, task.limits)
        verdict = examine(read_pod(files[1]), task, rig)
    row |= _told(verdict)
    row["rms_jerk"] = np.sqrt(np.mean(swing.motion[:, :, 3] ** 2, axis=0)).tolist()
    if not case.in_all:
        name, ring = _classic(task, rig)
        row |= {"classic": name, "classic_ring": ring}
        row["share"] = None if ring is None else row["ring"] / ring
    return row | {"missed": missed(row)}


def _told(verdict: Verdict) -> dict[str, Any]:
    """Errors, limits, spreads and ring of a file [SI, pose in degrees]."""
    poses = {key: np.degrees(v) for key, v in verdict.errors.items() if key != "speed"}
    spread = [np.degrees(v) for key, v in verdict.spreads.items() if key not in ("speed", "arm")]
    uses = [use.ratio for use in (*verdict.uses, *verdict.torques) if np.isfinite(use.limit)]
    uses += [bent / most for _, bent, most in verdict.shaft_uses() if np.isfinite(most)]
    return {
        "speed_error": float(verdict.errors["speed"]),
        "pose_error": float(max(map(abs, poses.values()))),
        "limit_ratio": float(max(uses)),
        "pose_spread": [float(min(low for low, _ in spread)), float(max(up for _, up in spread))],
        "speed_spread": list(map(float, verdict.spreads["speed"])),
        "ring": float(verdict.residual.max()),
        "doubt": verdict.nominal.doubt,
    }


def _classic(task: SwingTask, rig: Rig) -> tuple[str, float | None]:
    """The quietest classic that keeps limits, impact and duration, and its worst ring [m]."""
    from ..optimize.classic import classic, slow_mode
    from ..optimize.shaper import ei, zv, zvd

    mode = slow_mode(rig)
    shapers = [None, zv(*mode), zvd(*mode), ei(*mode)]
    if rig.fidelity == "planar":  # there the plain one is better than any shaper
        shapers = [None, zvd(*mode)]
    tried = [classic(task, rig, shaper) for shaper in shapers]
    kept = [one for one in tried if one.works and len(one.rings) and np.isfinite(one.rings).all()]
    if not kept:
        return "none keeps the limits", None
    best = min(kept, key=lambda one: one.rings.max())
    return best.name, float(best.rings.max())


def missed(row: Mapping[str, Any]) -> list[str]:
    """Which goals a row misses."""
    found = []
    if not abs(row["speed_error"]) <= SPEED:
        found.append("speed")
    if not row["pose_error"] <= POSE:
        found.append("pose")
    if not row["limit_ratio"] <= 1.0 + EXCESS:
        found.append("limits")
    if row["in_all"] and not max(map(abs, row["pose_spread"])) <= ALL_POSE:
        found.append("pose in all")
    share = row.get("share")
    if share is not None and not share <= SHARES[row["fidelity"], row["shaft"]]:
        found.append("ring")
    return found


def find(call: Call, cases: Sequence[Case] = CASES) -> Answer:
    """Every case, one row each.

    Args:
        call: who asks.
        cases: the swings.

    Returns:
        The answer.
    """
    rows = []
    for case in cases:
        call.progress(f"{case.fidelity}, {case.speed:g} m/s, ball {case.force:g} N, {case.shaft}")
        rows.append(played(case))
    good = sum(not row["missed"] for row in rows)
    sentences = (
        f"{good} of {len(rows)} swings keep every goal.",
        *(
            f"{_words(row)}: missed {', '.join(row['missed'])}. {row.get('sentence', '')}".strip()
            for row in rows
            if row["missed"]
        ),
        *_price(rows),
    )  # fmt: skip
    notes = (
        "Pose: chord. File: 1e-4 degrees a digit, joined as a cubic of two derivatives, written, "
        "read back and played by the model alone; preset robo_v. Spread and ring: 41 shaft "
        "frequencies within a tenth.",
        f"Goals: speed within {SPEED:g} m/s and pose within {POSE:g} degrees in the robot itself; "
        f"no limit passed by more than {100 * EXCESS:g} %; where impact is asked of all, pose "
        f"within {ALL_POSE:g} degrees in all; the worst ring as a share of the best classic's with "
        "the same limits, impact and duration: linear 1 % with a free shaft, 3 % with one that is "
        "bounded; in the plane 1 %.",
    )
    cells = [_cells(row) for row in rows]
    return Answer(HEADINGS, cells, rows, sentences, notes, _panels(rows), {})


def _words(row: Mapping[str, Any]) -> str:
    all_of = ", impact in all" if row["in_all"] else ""
    return (
        f"{row['fidelity']}, {row['speed']:g} m/s, ball {row['force']:g} N, "
        f"shaft {row['shaft']}{all_of}"
    )


def _price(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """What it costs to ask impact of every scenario."""
    lines = []
    for row in rows:
        like = [
            one for one in rows
            if not one["in_all"] and all(one[k] == row[k] for k in ("fidelity", "speed", "force"))
            and one["shaft"] == row["shaft"] and "ring" in one
        ]  # fmt: skip
        if row["in_all"] and "ring" in row and like:
            ratio = np.array(row["rms_jerk"]) / np.array(like[0]["rms_jerk"])
            lines.append(
                f"{_words(row)}: {ratio[0]:.2g} and {ratio[1]:.2g} times the jerk of arm and "
                f"wrist, ring {1e3 * row['ring']:.2g} for {1e3 * like[0]['ring']:.2g} mm."
            )
    return lines


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    head = (
        row["fidelity"], f"{row['speed']:g}", f"{row['force']:g}", row["shaft"],
        "yes" if row["in_all"] else "",
    )  # fmt: skip
    if "ring" not in row:
        return (*head, *[""] * 8, f"{row['seconds']:g}", ", ".join(row["missed"]))
    low, high = row["pose_spread"]
    slow, fast = row["speed_spread"]
    ring = row.get("classic_ring")
    classic = "" if "classic" not in row else row["classic"]
    classic = classic if ring is None else f"{number_words(1e3 * ring, 3)}, {classic}"
    share = "" if row.get("share") is None else f"{100 * row['share']:.2g} %"
    return (
        *head, f"{row['speed_error']:+.4f}", f"{row['pose_error']:.4f}",
        f"{row['limit_ratio']:.5f}", f"{low:+.3g} to {high:+.3g}", f"{slow:+.3g} to {fast:+.3g}",
        f"{1e3 * row['ring']:.3g}", classic, share, f"{row['seconds']:g}",
        ", ".join(row["missed"]),
    )  # fmt: skip


def _panels(rows: Sequence[Mapping[str, Any]]) -> list[Any]:
    """Worst rings beside the best classics'."""
    from .thesis.draw import Curve, Panel

    found = []
    for fidelity in dict.fromkeys(row["fidelity"] for row in rows):
        own = [row for row in rows if row["fidelity"] == fidelity and row.get("classic_ring")]
        if not own:
            continue
        at = np.arange(1.0, len(own) + 1)
        lines = (
            Curve(at, np.log10([1e3 * row["ring"] for row in own]), "optimal", True),
            Curve(at, np.log10([1e3 * row["classic_ring"] for row in own]), "best classic", True),
        )
        found.append(Panel(f"{fidelity}: worst ring", "row", "log10 of mm", lines))
    return found


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
