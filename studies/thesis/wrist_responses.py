"""How a struck club rings on a rigid and on a flexible wrist (Figure 79)."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .runs import RIGID_GRIP, RIGID_WRIST, TABLE_4, club, instants, maxima, rms, slowest, struck
from .table import Found, answering, claim, number, show

NAME = "thesis/wrist_responses"
QUESTION = "How does a struck club ring on a rigid and on a flexible wrist (Figure 79)?"
CASES = (
    (RIGID_GRIP, RIGID_WRIST, "a: rigid grip and wrist"),
    (TABLE_4[50], (1000.0, 30.0), "b: 1000 N m/rad, 30 N m s/rad"),
    (TABLE_4[50], (500.0, 50.0), "c: 500 N m/rad, 50 N m s/rad"),
)
SETTLED = 0.02  # s


def find() -> Found:
    """The three responses of Figure 79 to one blow, and the fixed collet's of Figure 78."""
    times = instants(2.0, 2000.0)
    heard = [struck(club(grip, wrist), times) for grip, wrist, _ in CASES]
    fixed = struck(club(RIGID_GRIP), times, model="fixed_collet")
    pinned, held = slowest(club(RIGID_GRIP), "pinned_wrist"), slowest(club(RIGID_GRIP))
    waves = [maxima(each) for each in heard]
    late = times > SETTLED
    peaks = [float(np.max(np.abs(each[late]))) for each in heard]
    levels = [rms(each[late]) for each in heard]
    rows = (
        number("rigid_wrist", "frequency: rigid wrist against fixed collet", "Hz",
               held.frequency, pinned.frequency, "line 1469, Figures 78, 79a", stated=0.001,
               definition="published: that of our fixed collet, which it should equal"),
        claim("rigid_level", "rigid wrist and fixed collet vibrate alike",
              f"RMS {levels[0]:.2f} against {rms(fixed[late]):.2f} m/s²",
              abs(levels[0] / rms(fixed[late]) - 1) < 0.05, "line 1469",
              definition="RMS from 0.02 to 2 s within 5 %"),
        number("cycles", "full cycles left with (500, 50)", "1", 2.0, waves[2] - 1.0,
               "line 1469, Figure 79c",
               definition="periods between the first and last positive maximum above 5 % of the "
               f"peak: {waves[2]} maxima; {waves[1]} with (1000, 30), {waves[0]} rigid"),
        claim("lower_peak", "flexible wrists lower the peak too",
              f"{peaks[0]:.1f} rigid, {peaks[1]:.1f} and {peaks[2]:.1f} m/s²",
              max(peaks[1:]) < peaks[0], "line 1469",
              definition="largest magnitude from 0.02 s on, after the sleeve's own ring"),
        claim("quieter", "the third vibrates least", f"RMS {levels[0]:.1f}, {levels[1]:.1f}, "
              f"{levels[2]:.1f} m/s²", levels[2] < levels[1] < levels[0], "line 1469",
              definition="RMS from 0.02 to 2 s, 50 % sleeve of Table 4 in b and c",
              why="The third decays faster but begins higher."),
    )  # fmt: skip
    label = "clubhead acceleration [m/s²]"
    panels = (
        Panel("Figure 78: fixed collet", "time [s]", label, (Curve(times, fixed),)),
        *(
            Panel(f"Figure 79{name}", "time [s]", label, (Curve(times, each),))
            for each, (_, _, name) in zip(heard, CASES, strict=True)
        ),
    )
    notes = ("The blow is 0.255 N s, not the printed 8 N s; t = 0 is its end.",)
    return Found(rows, panels, "A blow on the clubhead, relative acceleration.", notes)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
