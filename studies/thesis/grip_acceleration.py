"""How much more the shaft shakes below a soft sleeve than below a rigid grip (Figure 73)."""

from __future__ import annotations

from ..study import Study
from .draw import Curve, Panel
from .runs import RIGID_GRIP, RIGID_WRIST, TABLE_4, club, instants, move, rms, square_turn
from .table import Found, answering, claim, show

NAME = "thesis/grip_acceleration"
QUESTION = "How much more does the shaft shake below a soft sleeve than below a rigid grip?"
LENGTH, RATE, CUT = 1.5, 4000.0, 100.0  # s, Hz, Hz

MADE_UP = "The swing is made up, since the thesis describes none."


def find() -> Found:
    """Acceleration at the lower end of the grip, relative to the collet, over the square turn."""
    from scipy.signal import butter, sosfiltfilt

    from ...model.robot import PRESETS

    times = instants(LENGTH, RATE)
    cases = {
        "rigid grip": club(RIGID_GRIP),
        "50 % sleeve, Table 4": club(TABLE_4[50]),
        "50 % sleeve, fitted to line 1060": PRESETS["robo_v_sleeve_50"]
        | {"wrist_stiffness": RIGID_WRIST[0], "wrist_damping": RIGID_WRIST[1]},
    }
    heard = {}
    for name, p in cases.items():
        motion = move("driven_wrist", p, square_turn(), times)
        names = [*motion.names]
        slide, tilt = (names.index(each) for each in ("grip_displacement", "grip_angle"))
        arm = p["grip_length"] / 2
        felt = motion.accelerations[:, slide] + arm * motion.accelerations[:, tilt]
        heard[name] = sosfiltfilt(butter(4, CUT, fs=RATE, output="sos"), felt)
    levels = {name: rms(each) for name, each in heard.items()}
    rigid, table, fitted = levels.values()
    rows = (
        claim("table", "the shaft below the sleeve vibrates far more than in the rigid grip",
              f"{table:.3f} against {rigid:.3f} m/s² RMS", table > 2 * rigid,
              "line 1318, Figure 73",
              definition="more than twice, below 100 Hz; 50 % sleeve of Table 4",
              limit=MADE_UP, why="Table 4's dashpots lock the sleeve."),
        claim("fitted", "the same with a sleeve that rings as measured",
              f"{fitted:.3f} against {rigid:.3f} m/s² RMS", fitted > 2 * rigid,
              "line 1318, Figure 73",
              definition="the same with 60 kN/m and 1470 N s/m, fitted to line 1060",
              limit=MADE_UP),
    )  # fmt: skip
    panels = tuple(
        Panel(name, "time [s]", "shaft acceleration [m/s²]",
              (Curve(times, each),))
        for name, each in heard.items()
    )  # fmt: skip
    notes = (
        "The thesis gives no numbers and does not describe its 'simple swing'; this is the square "
        "turn of line 1287 with a rigid wrist. The sensor sits at the lower end of the grip.",
    )
    return Found(rows, panels, "Shaft below the grip, relative to the collet.", notes)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
