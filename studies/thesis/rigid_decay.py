"""Whether a rigidly gripped club rings as the thesis simulates it (Figure 62)."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .runs import RIGID_GRIP, club, instants, move, slowest, spaced
from .table import Found, answering, claim, number, show

NAME, QUESTION = "thesis/rigid_decay", "Does a rigidly gripped club ring as in Figure 62?"
MEASURED = (4.15, 0.0076)  # Hz and ratio, line 1174
BEST_FIT = (400e3, 5.0)  # line 1176


def find() -> Found:
    """Modes and the release from 0.15 m of the fixed collet, with a grip of 500 kN/m."""
    from ...model.drives import release
    from ...model.score import log_decrement

    p = club(RIGID_GRIP)
    ours, fitted, wider = slowest(p), slowest(club(BEST_FIT)), slowest(p | spaced(0.0590))
    natural = np.sqrt(p["shaft_stiffness"] / p["clubhead_mass"]) / (2 * np.pi)
    times = instants(8.0)
    motion = move("fixed_collet", p, release("clubhead", 0.15, "collet"), times)
    heard = motion.samples[:, 0]
    told = float(log_decrement(motion.positions[:, 2], times, reading="local"))
    sampled = told / np.hypot(2 * np.pi, told)
    fit_words = f"{fitted.frequency:.3f} Hz against {ours.frequency:.3f} Hz"
    rows = (
        number("natural", "natural frequency of shaft and head, eq. 16", "Hz", 4.167, natural,
               "line 1157", limit="The head's mass is computed from it."),
        number("frequency", "frequency with the rigid grip", "Hz", 4.02, ours.frequency,
               "line 1174", stated=-0.015,
               definition="damped frequency of the slowest mode of the fixed collet",
               why=f"With springs 59 mm apart it is {wider.frequency:.3f} Hz; 49 mm is the best "
               "compromise with the maps."),
        number("damping", "damping ratio with the rigid grip", "1", 0.0067, ours.ratio,
               "line 1174", stated=-0.027,
               definition="that of the same mode; the shaft alone is damped"),
        number("damping_sampled", "the same, read from the decay peak by peak", "1", 0.0067,
               sampled, "line 1174, Figure 62b",
               definition="decrement over successive maxima of 8 s at 2048 Hz"),
        claim("best_fit", "400 kN/m with 5 N s/m fits the measured decay better than 500 kN/m",
              f"{fit_words}: farther from the measured {MEASURED[0]} Hz",
              abs(fitted.frequency - MEASURED[0]) < abs(ours.frequency - MEASURED[0]),
              "line 1176", why="A softer grip lowers a frequency that is too low already."),
    )  # fmt: skip
    panels = (
        Panel("Simulated decay", "time [s]", "clubhead acceleration [m/s²]",
              (Curve(times, heard),)),
        Panel("Its first second", "time [s]", "clubhead acceleration [m/s²]",
              (Curve(times[:2048], heard[:2048]),)),
    )  # fmt: skip
    caption = "Release of the clubhead from 0.15 m, rigid collet, rigid grip (Figure 62b)."
    return Found(rows, panels, caption)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
