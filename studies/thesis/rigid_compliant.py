"""What a soft grip and wrist change in a full swing with a ball (Figures 115 and 116)."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .printed import bent_by
from .runs import FINAL_WRIST, RATE, RIGID_GRIP, TABLE_4, club, instants, move, rms, slowest
from .swings import IMPACT, full_swing
from .table import Found, answering, claim, number, show

NAME = "thesis/rigid_compliant"
QUESTION = "What do a soft grip and wrist change in a full swing (Figures 115 and 116)?"
LENGTH = 4.0  # s
CLUBS = {"rigid": club(RIGID_GRIP), "compliant": club(TABLE_4[50], FINAL_WRIST)}
MADE_UP = "The golfers' profiles are not printed; our swing is made up."


def find() -> Found:
    """One made-up full swing with a ball at 1.8 s, rigid and compliant."""
    times, drive, bare = instants(LENGTH), full_swing(LENGTH), full_swing(LENGTH, is_struck=False)
    reach, ball, shaken = {}, {}, {}
    arm, wrist = (joint.at(times)[:, 2] for joint in drive.joints)
    for name, p in CLUBS.items():
        reach[name] = move("driven_arm", p, drive, times).positions[:, 3]
        unstruck = move("driven_arm", p, bare, times).positions[:, 3]
        ball[name] = reach[name] - unstruck
        shaken[name] = unstruck - bent_by(p, arm, wrist, times[1])
    settled = {name: _settled(y) for name, y in ball.items()}
    rest, before = (
        {name: rms(y[part]) for name, y in shaken.items()}
        for part in (times > 3.0, (times > 0.2) & (times < IMPACT))
    )
    lowest = {name: float(np.min(y)) for name, y in reach.items()}
    ringing = slowest(CLUBS["rigid"], "driven_arm")
    rows = (
        number("oscillation", "frequency at which the rigid robot's club swings on", "Hz", 4.0,
               ringing.frequency, "line 1643", stated=-0.011,
               definition="slowest mode of the driven arm, rigid grip and wrist"),
        number("compliant", "time in which the ball's vibration of the compliant club dies", "s",
               0.5, settled["compliant"], "line 1923", limit=MADE_UP,
               definition="from 1.8 s until what the ball alone moves stays below 10 % of its "
               "largest value; the equations are linear, so it can be told apart",
               why="Where a vibration counts as dead is not told."),
        claim("rigid", "the rigid club swings on to the end",
              f"{settled['rigid']:.2f} s of {LENGTH - IMPACT:.1f} s", settled["rigid"] > 0.9
              * (LENGTH - IMPACT), "line 1923", limit=MADE_UP),
        claim("after", "once the drive rests the compliant club hardly vibrates",
              f"{1e3 * rest['compliant']:.3f} mm RMS against {1e3 * rest['rigid']:.1f} mm rigid",
              rest["compliant"] < 0.1 * rest["rigid"], "line 1923", limit=MADE_UP,
              definition="less than a tenth, without the ball, from 3 s on"),
        claim("before", "vibration is noticeably less before impact too",
              f"{1e3 * before['compliant']:.1f} against {1e3 * before['rigid']:.1f} mm RMS",
              before["compliant"] < 0.8 * before["rigid"], "line 1923", limit=MADE_UP,
              definition="displacement less that by which springs and dashpots must follow the "
              "drive; 0.2 to 1.8 s, a fifth less"),
        claim("deeper", "the compliant club's lowest point lies lower",
              f"{lowest['compliant']:.3f} against {lowest['rigid']:.3f} m",
              lowest["compliant"] < lowest["rigid"], "line 1923", limit=MADE_UP,
              why="The sign of our blow and swing, and its speed, are our own."),
    )  # fmt: skip
    label = "clubhead displacement [m]"
    curves = tuple(Curve(times, y, name) for name, y in reach.items())
    fast = tuple(Curve(times, y, name) for name, y in ball.items())
    panels = (Panel("Figures 115, 116", "time [s]", label, curves),
              Panel("What the ball alone moves", "time [s]", label, fast))  # fmt: skip
    notes = (
        "Arm 0 to -149 to 149 degrees, wrist to 92 degrees either way, ball of 1 kN for 0.5 ms "
        "at 1.8 s; linear in the collet's frame as in the thesis, every mass carried along.",
    )
    return Found(rows, panels, "Full swing, rigid against compliant.", notes)


def _settled(y: np.ndarray, share: float = 0.1) -> float:
    """Time after the ball [s] from which on y stays below a share of its largest value [m]."""
    after = np.abs(y[int(IMPACT * RATE) :])
    above = np.flatnonzero(after > share * np.max(after))
    return float((above[-1] + 1) / RATE)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
