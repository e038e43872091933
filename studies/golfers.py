"""Which wrist is best for golfers? A map over six swings instead of one blow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import LASTS, PRESET, Answer, finding, percent, show, struck_task
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..model.drives import Drive
    from ..optimize.sweep import Axis

NAME = "golfers"
QUESTION = "Is the wrist that is best for one blow also best over six swings of golfers?"
HEADINGS = (
    "motion", "tempo [s]", "best k [N m/rad]", "best c [N m s/rad]", "RMS [m/s²]",
    "best for the blow costs [%]", "best for all costs [%]",
)  # fmt: skip
STIFFNESS, DAMPING, SIDE = (50.0, 5600.0), (2.0, 150.0), 10
"""Ends of the thesis's grid (line 1491), here even in logarithms [N m/rad, N m s/rad], and values
along each axis [-]."""

EDGE = (
    "It stands at an end of the grid. Vibration alone asks for a softer wrist still; how soft it "
    "may be, the pose at the ball decides, which is not scored here."
)
RATE, AFTER = 500.0, 2.0
"""How densely a swing is looked at [Hz], and for how long after it meets the ball [s]."""


@dataclass(frozen=True)
class Golfer:
    """A swing in a few numbers.

    Attributes:
        name: what it is called.
        tempo: time from the first motion to the ball [s].
        arm: backswing of the arm [rad].
        wrist: cock of the wrist [rad].
        arm_speed: of the arm at the ball [rad/s].
        wrist_speed: of the wrist at the ball [rad/s].
    """

    name: str
    tempo: float
    arm: float
    wrist: float
    arm_speed: float
    wrist_speed: float


GOLFERS = (
    Golfer("steady", 1.6, 2.6, 1.6, 9.0, 16.0),
    Golfer("quick", 1.2, 2.4, 1.5, 11.0, 20.0),
    Golfer("slow", 2.0, 2.8, 1.6, 7.0, 12.0),
    Golfer("short", 1.4, 1.8, 1.3, 8.0, 17.0),
    Golfer("arms", 1.6, 2.7, 1.1, 11.0, 11.0),
    Golfer("hands", 1.6, 2.2, 1.9, 7.0, 22.0),
)
"""Six ways to swing, around the full swing that the studies of the thesis make up."""


def instants_of(golfer: Golfer) -> tuple[float, float, float, float]:
    """When a swing begins, is at its top, meets the ball and ends [s]."""
    begin = 0.2
    return begin, begin + 0.65 * golfer.tempo, begin + golfer.tempo, begin + 1.5 * golfer.tempo


def angles_of(golfer: Golfer, times: np.ndarray) -> dict[str, np.ndarray]:
    """Arm and wrist of a swing: quintics through top, ball and follow-through.

    Args:
        golfer: how it swings.
        times: any instants; at rest before the beginning and after the end, shape (t,) [s].

    Returns:
        By joint, shape (t,) [rad].
    """
    from scipy.interpolate import BPoly

    instants, found = instants_of(golfer), {}
    for joint, far, speed in (
        ("arm", golfer.arm, golfer.arm_speed),
        ("wrist", golfer.wrist, golfer.wrist_speed),
    ):
        angles = ((0.0, 0.0), (-far, 0.0), (0.0, speed), (far, 0.0))
        curve = BPoly.from_derivatives(instants, [(angle, rate, 0.0) for angle, rate in angles])
        found[joint] = curve(np.clip(times, instants[0], instants[-1]))
    return found


def swing_of(golfer: Golfer) -> tuple[Drive, np.ndarray, tuple[float, float]]:
    """The drive of arm and wrist, its samples [s], and the window that counts [s].

    The joints move as in the studies of the thesis; the ball pushes back for 0.5 ms.
    """
    from dataclasses import replace

    from ..model.drives import impact
    from .thesis.runs import driven

    _, _, ball, end = instants_of(golfer)
    fine = np.arange(round(end / 0.02) + 2) * 0.02
    joints = {joint: (fine, angles) for joint, angles in angles_of(golfer, fine).items()}
    last = np.ceil((ball + AFTER) * RATE) / RATE
    motion = driven(last, **joints)
    times = np.arange(round(last * RATE)) / RATE
    blow = impact("clubhead", -1000.0, ball, 5e-4)
    return replace(blow, joints=motion.joints), times, (ball + LASTS, last)


def axes_of(side: int) -> tuple[Axis, ...]:
    """The grid of wrists, `side` values along each axis [SI]."""
    from ..optimize.sweep import Axis

    return (
        Axis("wrist_stiffness", np.geomspace(*STIFFNESS, side), "N m/rad"),
        Axis("wrist_damping", np.geomspace(*DAMPING, side), "N m s/rad"),
    )


def find(call: Call, golfers: Sequence[Golfer] = GOLFERS, side: int = SIDE) -> Answer:
    """The best wrist of each swing, of the blow, and of all swings together.

    Args:
        call: who asks.
        golfers: the swings.
        side: wrists along each axis [-].

    Returns:
        The answer [SI].
    """
    from ..model.robot import PRESETS, Robot
    from ..optimize.sweep import SweepTask, sweep

    axes, maps = axes_of(side), {}
    struck = struck_task(axes)
    blow = np.asarray(sweep(struck).scores["rms"])
    numbers = dict(PRESETS[PRESET])
    arm = Robot("driven_arm", tuple(numbers))
    for golfer in golfers:
        call.progress(f"the {golfer.name} swing")
        drive, times, window = swing_of(golfer)
        task = SweepTask(arm, numbers, drive, times, window, struck.sensor, ("rms",), axes)
        maps[golfer.name] = np.asarray(sweep(task).scores["rms"])
    price = {name: rms / rms.min() - 1.0 for name, rms in maps.items()}
    whole = np.mean(list(price.values()), axis=0)
    of_all, of_blow = (np.unravel_index(np.argmin(one), one.shape) for one in (whole, blow))
    rows = [{"motion": "one blow", "tempo": None, **_design(axes, of_blow), "rms": blow.min(),
             "of_blow": 0.0, "of_all": blow[of_all] / blow.min() - 1.0}]  # fmt: skip
    for golfer in golfers:
        own, rms = price[golfer.name], maps[golfer.name]
        best = np.unravel_index(np.argmin(rms), rms.shape)
        rows.append({"motion": golfer.name, "tempo": golfer.tempo, **_design(axes, best),
                     "rms": rms.min(), "of_blow": own[of_blow], "of_all": own[of_all]})  # fmt: skip
    rows.append({"motion": "all swings", "tempo": None, **_design(axes, of_all), "rms": None,
                 "of_blow": whole[of_blow], "of_all": whole[of_all]})  # fmt: skip
    rows = [{k: float(v) if isinstance(v, np.floating) else v for k, v in r.items()} for r in rows]
    last, first = rows[-1], rows[0]
    same = of_all == of_blow
    sentences = (
        f"{'Yes' if same else 'No'}: over {len(golfers)} swings {_wrist(last)} is best, for one "
        f"blow {_wrist(first)}.",
        f"The blow's best costs {percent(last['of_blow'])} % over the swings on "
        f"average, the best of all {percent(last['of_all'])} %.",
    )
    if not all(0 < at < side - 1 for at in of_all):
        sentences = (*sentences, EDGE)
    notes = (
        f"Preset {PRESET} on driven arm and wrist; quintics through top, ball and follow-through; "
        "a ball of 1 kN for 0.5 ms. RMS of the clubhead's acceleration relative to the collet "
        f"from {1e3 * LASTS:g} ms to {AFTER:g} s after it; costs count "
        "against each motion's own best wrist.",
        f"{side} by {side} wrists, even in logarithms. The swings are made up, not measured.",
    )
    cells = [_cells(row) for row in rows]
    return Answer(HEADINGS, cells, rows, sentences, notes, _panels(axes, blow, whole, rows), {})


def _design(axes: Sequence[Axis], at: tuple[Any, ...]) -> dict[str, float]:
    return {axis.name: float(axis.values[k]) for axis, k in zip(axes, at, strict=True)}


def _wrist(row: Mapping[str, Any]) -> str:
    stiffness, damping = (number_words(row[f"wrist_{k}"], 3) for k in ("stiffness", "damping"))
    return f"a wrist of {stiffness} N m/rad and {damping} N m s/rad"


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    numbers = (number_words(row[key], 3) for key in ("wrist_stiffness", "wrist_damping", "rms"))
    costs = (percent(row[key]) for key in ("of_blow", "of_all"))
    return row["motion"], number_words(row["tempo"]), *numbers, *costs


def _panels(
    axes: Sequence[Axis], blow: np.ndarray, whole: np.ndarray, rows: Sequence[Mapping[str, Any]]
) -> list[Any]:
    from .thesis.draw import Curve, Field, Panel

    x, y = (np.log10(axis.values) for axis in axes)
    labels = "log10 of wrist stiffness [N m/rad]", "log10 of wrist damping [N m s/rad]"

    def mark(chosen: Sequence[Mapping[str, Any]], word: str) -> Curve:
        k, c = (np.log10([row[f"wrist_{n}"] for row in chosen]) for n in ("stiffness", "damping"))
        return Curve(k, c, word, True)

    cost = Field(x, y, 100 * whole, "mean cost [%]")
    marks = mark(rows[-1:], "best"), mark(rows[1:-1], "each swing's best")
    field = Field(x, y, blow, "RMS [m/s²]")
    return [
        Panel("One blow", *labels, (mark(rows[:1], "best"),), field),
        Panel("All swings", *labels, marks, cost),
    ]


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
