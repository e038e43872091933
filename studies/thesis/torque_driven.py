"""What the square torque makes of the collet and the club (Figures 69 and 71)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .runs import RIGID_GRIP, TABLE_4, club, instants, move, rms, slowest
from .table import Found, answering, claim, number, show

if TYPE_CHECKING:
    from ...model.drives import Drive

NAME = "thesis/torque_driven"
QUESTION = "What does the square torque make of collet and club (Figures 69 and 71)?"
TORQUE, PHASE, LENGTH = 0.637, 0.5, 1.5  # N m, s, s; line 1287


def find() -> Found:
    """The free collet under the torque of line 1287, and under that which turns it by 180."""
    from ...model.drives import torque

    times = instants(LENGTH)
    over = times > 2 * PHASE

    def push(size: float) -> Drive:
        return torque("collet", (0.0, PHASE, 2 * PHASE), (size, -size, 0.0))

    stiff = move("driven_collet", club(RIGID_GRIP), push(TORQUE), times)
    turn = float(np.mean(stiff.positions[over, 0]))
    needed = TORQUE * np.pi / turn
    runs = {
        deadener: move("driven_collet", club(grip), push(needed), times)
        for deadener, grip in TABLE_4.items()
    }
    ring = {deadener: rms(run.samples[over, 0]) for deadener, run in runs.items()}
    modes = {d: slowest(club(grip), "driven_collet") for d, grip in TABLE_4.items()}
    ratios = {d: mode.ratio for d, mode in modes.items()}
    stiff_mode = slowest(club(RIGID_GRIP), "driven_collet")
    shafts = {d: float(np.max(np.abs(run.positions[:, 2]))) for d, run in runs.items()}
    rows = (
        number("torque", "torque that turns the wrist from -90 to 90 degrees in 1 s", "N m",
               TORQUE, needed, "line 1287", stated=4.35,
               definition="half a second each way; mean angle after it; rigid grip",
               why=f"Collet and club have {needed / (4 * np.pi):.3f} kg m²; that torque fits "
               f"{TORQUE / (4 * np.pi):.3f} kg m²."),
        number("turn", "angle that 0.637 N m turns it", "degrees", 180.0, np.degrees(turn),
               "line 1287, Figure 69b",
               why="The torque is too small for the inertia of collet and club."),
        claim("order", "more deadener leaves less vibration",
              "damping ratio " + ", ".join(f"{d} %: {z:.3f}" for d, z in ratios.items()),
              ratios[0] < ratios[25] < ratios[50], "line 1309, Figure 71",
              definition="slowest mode on the free collet; RMS after 1.0 s ("
              + ", ".join(f"{d} %: {level:.1f}" for d, level in ring.items())
              + " m/s²) hangs on how many waves fit into 0.5 s",
              why="Table 4's dashpots lock the sleeve, the more the more deadener."),
        claim("sleeves_damp", "sleeves leave less vibration than a rigid grip would",
              f"damping ratio at least {min(ratios.values()):.3f}, rigid {stiff_mode.ratio:.3f}",
              min(ratios.values()) > stiff_mode.ratio, "line 1316",
              definition=f"the same mode, at {stiff_mode.frequency:.1f} Hz with a rigid grip"),
        claim("grip_turns", "the grip turns inside a soft sleeve",
              ", ".join(f"{d} %: {np.degrees(angle):.2f}" for d, angle in shafts.items())
              + " degrees", shafts[50] > shafts[0], "line 1316",
              definition="largest grip angle in the collet, 50 % against 0 %"),
    )  # fmt: skip
    label = "clubhead acceleration [m/s²]"
    panels = [
        Panel(f"Figure 71: {d} % deadener", "time [s]", label, (Curve(times, run.samples[:, 0]),))
        for d, run in runs.items()
    ]
    angles = tuple(
        Curve(times, np.degrees(run.positions[:, 0]), name)
        for run, name in ((stiff, "0.637 N m"), (runs[50], f"{needed:.2f} N m"))
    )
    panels.append(Panel("Figure 69b: collet", "time [s]", "angle [degrees]", angles))
    notes = ("The collet starts at 0 here; only the turn counts.",)
    return Found(rows, tuple(panels), "Square torque on a free collet, Table 4's sleeves.", notes)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
