"""Whether compliance quietens a swing whose drive lags and ripples (Figures 117 and 118)."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .printed import bent_by
from .rigid_compliant import CLUBS
from .runs import instants, move, rms
from .swings import IMPACT, fed_back
from .table import Found, Row, answering, claim, show

NAME = "thesis/feedback_ripple"
QUESTION = "Does compliance quieten a swing whose drive lags and ripples (Figures 117, 118)?"
GOLFERS = {"A": (4.0, 1.0), "B": (4.5, 1.2)}  # s and stretch; swings of 2.5 and 3 s, line 1927
MADE_UP = "The robot's feedback is not printed; lag and ripple are made up."


def find() -> Found:
    """Two made-up swings with lag and ripple, rigid and compliant, no ball."""
    rows: list[Row] = []
    panels = []
    for golfer, (length, stretch) in GOLFERS.items():
        times, drive = instants(length), fed_back(length, stretch)
        smooth = fed_back(length, stretch, ripple=0.0)
        begin = fed_back(length, stretch, until=0.7)
        arm, wrist = (joint.at(times)[:, 2] for joint in smooth.joints)
        reach, shaken, early = {}, {}, {}
        for name, p in CLUBS.items():
            reach[name] = move("driven_arm", p, drive, times).positions[:, 3]
            shaken[name] = reach[name] - bent_by(p, arm, wrist, times[1])
            begun, calm = (
                move("driven_arm", p, each, times).positions[:, 3] for each in (begin, smooth)
            )
            early[name] = begun - calm
        rows += _claims(golfer, times / stretch, shaken, early)
        curves = tuple(Curve(times, y, name) for name, y in reach.items())
        figure = "Figure 117" if golfer == "A" else "Figure 118"
        panels.append(
            Panel(f"{figure}: golfer {golfer}", "time [s]", "clubhead displacement [m]", curves)
        )
    notes = (
        "Arm and wrist of the full swing, 30 ms late, with 2 mrad at 6 Hz and 1 mrad at 11 Hz "
        "while they move; golfer B is 1.2 times slower.",
    )
    return Found(tuple(rows), tuple(panels), "Swings as a robot plays them, without a ball.", notes)


def _claims(
    golfer: str, own: np.ndarray, shaken: dict[str, np.ndarray], early: dict[str, np.ndarray]
) -> list[Row]:
    """Rows of one golfer; `own` is the time on the full swing's clock [s]."""
    whole, rest = ({n: rms(y[part]) for n, y in shaken.items()} for part in (own > 0.0, own > 3.0))
    start = {name: rms(y[(own > 1.4) & (own < IMPACT)]) for name, y in early.items()}
    way = (
        "displacement less that by which springs and dashpots must follow the smooth drive; RMS, "
        "less than half"
    )

    def words(of: dict[str, float]) -> str:
        return f"{1e3 * of['compliant']:.2f} mm against {1e3 * of['rigid']:.2f} mm rigid"

    source = "line 1931, Figure 117" if golfer == "A" else "line 1931, Figure 118"
    return [
        claim(f"most_{golfer}", f"most of the vibration is quashed, golfer {golfer}", words(whole),
              whole["compliant"] < 0.5 * whole["rigid"], source, definition=way, limit=MADE_UP,
              why="A ripple that goes on is forced, not left to ring."),
        claim(f"start_{golfer}", f"that of the start is gone by impact, golfer {golfer}",
              words(start), start["compliant"] < 0.1 * start["rigid"], source, limit=MADE_UP,
              definition="what a ripple of the first half second leaves in the downswing, told "
              "apart from the smooth drive; less than a tenth"),
        claim(f"end_{golfer}", f"that after the swing is, golfer {golfer}", words(rest),
              rest["compliant"] < 0.1 * rest["rigid"], source, limit=MADE_UP,
              definition="the same from 0.2 s after the drive has come to rest; less than a tenth"),
    ]  # fmt: skip


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
