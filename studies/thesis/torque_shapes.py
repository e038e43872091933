"""How much the shape of a drive shakes the clubhead (Figures 99 and 100)."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .runs import FINAL_WRIST, RIGID_GRIP, TABLE_4, club, instants, move, rms
from .swings import TURN, turns
from .table import Found, answering, claim, show

NAME = "thesis/torque_shapes"
QUESTION = "How much does the shape of a drive shake the clubhead (Figures 99 and 100)?"
CLUBS = {
    "rigid": club(RIGID_GRIP),
    "golfer's wrist": club(TABLE_4[50], (500.0, 5.0)),
    "final wrist": club(TABLE_4[50], FINAL_WRIST),
}

MADE_UP = "Which wrist and how long a turn the thesis took is not told."


def find() -> Found:
    """Four arm motions from 0 to 180 degrees in 1 s, for three clubs."""
    times = instants(1.5 * TURN)
    reach = {name: {} for name in CLUBS}
    curves: dict[str, list[Curve]] = {name: [] for name in CLUBS}
    drives = turns()
    for name, p in CLUBS.items():
        for shape, drive in drives.items():
            y = move("passive_wrist", p, drive, times).positions[:, 3]
            reach[name][shape] = float(np.max(np.abs(y))), rms(y[times > TURN])
            curves[name].append(Curve(times, y, shape))
    largest = {name: {s: top for s, (top, _) in one.items()} for name, one in reach.items()}
    left = {name: {s: rest for s, (_, rest) in one.items()} for name, one in reach.items()}
    sudden = {n: one["instantaneous"] / sorted(one.values())[-2] for n, one in largest.items()}
    gentlest = {name: min(one, key=lambda shape: one[shape]) for name, one in largest.items()}
    quietest = {name: min(one, key=lambda shape: one[shape]) for name, one in left.items()}
    rows = (
        claim("sudden", "an instantaneous acceleration displaces the head over twice as far as "
              "any other", _listed(sudden, "{:.2f} times"), min(sudden.values()) > 2.0,
              "line 1745, Figure 100", definition="largest relative displacement, over that of "
              "the next shape; in all three clubs",
              limit=MADE_UP),
        claim("gentle", "a sinusoidal torque displaces it least", _listed(gentlest, "{}"),
              all("sine" in shape for shape in gentlest.values()), "line 1745",
              definition="shape of the smallest largest displacement, in all three clubs",
              limit=MADE_UP,
              why="A sine wave that begins gently must be steeper in the middle."),
        claim("quiet", "a sinusoidal torque leaves the least vibration at rest",
              _listed(quietest, "{}"), all("sine" in shape for shape in quietest.values()),
              "line 1745", definition="smallest RMS displacement in the final third", limit=MADE_UP,
              why="A square wave of 1 s is nearly four waves of the rigid club and cancels."),
        claim("matters", "small differences of the drive make large ones of the head",
              _listed({n: max(one.values()) / min(one.values()) for n, one in largest.items()},
                      "{:.1f} times"),
              min(max(one.values()) / min(one.values()) for one in largest.values()) > 2.0,
              "line 1752", definition="largest over smallest of the four, more than twice",
              limit=MADE_UP),
    )  # fmt: skip
    (angles,) = (
        [Curve(times, np.degrees(drive.joints[0].at(times)[:, 0]), shape)
         for shape, drive in drives.items()],
    )  # fmt: skip
    panels = [Panel("Figure 99: the arm", "time [s]", "angle [degrees]", tuple(angles))]
    panels += [
        Panel(f"Figure 100: {name}", "time [s]", "clubhead displacement [m]", tuple(each))
        for name, each in curves.items()
    ]
    notes = (
        "The turn takes 1 s, and the arm rests for half a second; lengths and wrist are not "
        "printed. 'Half a sine wave' is read as a half wave of a cosine, from push to pull, and "
        "'a suppressed initial gradient' as a whole sine wave.",
    )
    return Found(rows, tuple(panels), "Four drives that turn the arm by 180 degrees.", notes)


def _listed(values: dict[str, float] | dict[str, str], form: str) -> str:
    return "; ".join(f"{name}: {form.format(value)}" for name, value in values.items())


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
