"""How a passive wrist follows the two basic arm swings (Figures 90 and 91)."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .runs import TABLE_4, club, instants, move
from .swings import ACROSS, BACK_AND_FORTH, arm, stretched
from .table import Found, answering, claim, number, show

NAME = "thesis/basic_swings"
QUESTION = "How does a passive wrist follow the two basic arm swings (Figures 90 and 91)?"
WRISTS = {"across": (500.0, 5.0), "back": (350.0, 3.0)}  # line 1615
LENGTHS = {"across": 2.0, "back": 4.2}  # s
PEAK = 45.0  # m/s^2, line 1617
MADE_UP = "The golfer's record is not printed; our arm motion is made up."


def find() -> Found:
    """Both swings, and how fast the first must be for the published peak."""
    times = {name: instants(length) for name, length in LENGTHS.items()}
    peak = _peak(1.0)
    quick = _length_for(PEAK)
    moved = {"across": stretched(ACROSS, quick), "back": stretched(BACK_AND_FORTH, quick)}
    runs, beyond = {}, {}
    for name, far in (("across", np.pi), ("back", np.pi / 2)):
        p = club(TABLE_4[50], WRISTS[name])
        runs[name] = move("passive_wrist", p, arm(moved[name], LENGTHS[name]), times[name])
        beyond[name] = float(np.degrees(np.max(runs[name].positions[:, 0]) - far))
    back = runs["back"].samples[:, 0]
    later = times["back"] > moved["back"][-1][0]
    rest = float(np.max(np.abs(back[later])) / np.max(np.abs(back)))
    rows = (
        number("peak", "largest simulated acceleration, arm 0 to 180 degrees", "m/s²", PEAK, peak,
               "line 1617, Figure 90", limit=MADE_UP, definition="made-up swing of 1 s",
               why="The length of the golfer's swing is not told."),
        claim("quick", "an arm swing by hand can reach it", f"180 degrees in {quick:.2f} s would",
              0.3 < quick < 1.5, "line 1617", limit=MADE_UP,
              definition="length of the same swing whose peak is 45 m/s²; 0.3 to 1.5 s passes for "
              "a swing by hand"),
        claim("gives", "the wrist gives way at the end: the collet turns beyond the arm",
              f"by {beyond['across']:.1f} degrees beyond 180, {beyond['back']:.1f} beyond 90",
              min(beyond.values()) > 1.0, "lines 1603, 1615", limit=MADE_UP,
              definition=f"more than 1 degree in both, arm moved at the pace of {quick:.2f} s"),
        claim("oscillates", "the second swing goes on oscillating",
              f"{100 * rest:.0f} % of its peak after the arm has stopped", rest > 0.05,
              "line 1617, Figure 91", limit=MADE_UP, definition="more than 5 %"),
    )  # fmt: skip
    panels = []
    for name, points in moved.items():
        t, run = times[name], runs[name]
        (joint,) = arm(points, LENGTHS[name]).joints
        figure = "Figure 90" if name == "across" else "Figure 91"
        angles = (Curve(t, np.degrees(joint.at(t)[:, 0]), "arm"),
                  Curve(t, np.degrees(run.positions[:, 0]), "collet"))  # fmt: skip
        panels += [Panel(f"{figure}: angles", "time [s]", "angle [degrees]", angles),
                   Panel(f"{figure}: clubhead", "time [s]", "acceleration [m/s²]",
                         (Curve(t, run.samples[:, 0]),))]  # fmt: skip
    notes = (
        "The arm carries every mass; eq. 40 as printed carries the collet's alone and would make "
        "the first peak a third smaller (see thesis/errata, A6).",
        "The wrists of 500, 5 and 350, 3 are the thesis's fits to a golfer, line 1615.",
    )
    return Found(rows, tuple(panels), "Arm driven, wrist passive, 50 % sleeve.", notes)


def _length_for(peak: float) -> float:
    """Length [s] of the first swing that gives a peak acceleration [m/s^2]; by bisection."""
    low, high = 0.3, 1.5
    for _ in range(8):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if _peak(middle) > peak else (low, middle)
    return float(np.sqrt(low * high))


def _peak(length: float) -> float:
    """Largest relative acceleration [m/s^2] of the first swing, done in `length` [s]."""
    p, whole = club(TABLE_4[50], WRISTS["across"]), LENGTHS["across"]
    drive = arm(stretched(ACROSS, length), whole)
    return float(np.max(np.abs(move("passive_wrist", p, drive, instants(whole)).samples)))


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
