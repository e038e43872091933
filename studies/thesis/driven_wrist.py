"""What a flexible wrist makes of a driven one (Figures 83 and 84)."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .runs import RIGID_WRIST, TABLE_4, club, instants, move, rms, square_turn
from .table import Found, answering, claim, number, show

NAME = "thesis/driven_wrist"
QUESTION = "What does a flexible wrist make of the driven one (Figures 83 and 84)?"
SOFT = (200.0, 30.0)  # line 1550
REVERSAL, END = 0.5, 1.0  # s


@cache
def turned(grip: tuple[float, float], wrist: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and relative acceleration of the clubhead [m/s^2] over the square turn.

    Args:
        grip: stiffness and damping of an element [N/m, N s/m].
        wrist: stiffness and damping [N m/rad, N m s/rad].

    Returns:
        Both of shape (t,).
    """
    times = instants(1.5, 4000.0)
    motion = move("driven_wrist", club(grip, wrist), square_turn(), times)
    return times, motion.samples[:, 0]


def find() -> Found:
    """The turn from -90 to 90 degrees in 1 s with a rigid and with a flexible wrist."""
    times, soft = turned(TABLE_4[50], SOFT)
    _, rigid = turned(TABLE_4[50], RIGID_WRIST)
    first, whole = (float(np.max(np.abs(soft[: int(4000 * end)]))) for end in (REVERSAL, 1.5))
    hard = float(np.max(np.abs(rigid)))
    after = times >= REVERSAL
    jump = float(np.max(np.abs(soft[after])))
    rest = [rms(each[times > END + 0.25]) for each in (soft, rigid)]
    rows = (
        number("peak_first", "largest peak with (200, 30), before the reversal", "m/s²", 15.0,
               first, "line 1550, Figure 84", stated=-0.113,
               why="Line 1550 reads a figure; its sleeve or drive may differ.",
               definition="t < 0.5 s; acceleration relative to the collet"),
        number("peak_whole", "largest peak with (200, 30), whole turn", "m/s²", 15.0, whole,
               "line 1550, Figure 84", stated=0.69,
               why="A square drive reverses with twice the step with which it begins."),
        claim("reversal", "the change at 0.5 s is no longer visible",
              f"{jump:.1f} m/s² after it, {first:.1f} before", jump < 1.2 * first, "line 1550",
              definition="not a fifth larger than before",
              why="The step of the drive's acceleration there is twice that at the start."),
        claim("smaller", "peaks are smaller than with a rigid wrist",
              f"{whole:.1f} against {hard:.1f} m/s², {100 * whole / hard:.0f} %", whole < hard,
              "line 1550", definition="largest of the whole turn, 50 % sleeve in both"),
        claim("quieter", "vibration is hugely reduced",
              f"{rest[0]:.3f} against {rest[1]:.2f} m/s² RMS at the end",
              rest[0] < 0.2 * rest[1], "line 1550",
              definition="RMS less than a fifth, from a quarter of a second after the turn on",
              why="Half a second each way is two waves of the rigid club and leaves it little to "
              "ring; the soft wrist creeps back."),
    )  # fmt: skip
    label = "clubhead acceleration [m/s²]"
    panels = (
        Panel("Figure 83: rigid wrist", "time [s]", label, (Curve(times, rigid),)),
        Panel("Figure 84: 200 N m/rad, 30 N m s/rad", "time [s]", label, (Curve(times, soft),)),
    )
    notes = ("The wrist turns from -90 to 90 degrees in 1 s by a constant acceleration and its "
             "opposite; line 1287's torque would not turn it so far.",)  # fmt: skip
    return Found(rows, panels, "Square turn of the driven wrist, 50 % sleeve.", notes)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
