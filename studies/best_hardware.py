"""Which wrist and collet are best when each may have its own best swing? Searched along slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import Answer, finding, show
from .study import Call, Study
from .usual_swing import usual
from .words import number_words

if TYPE_CHECKING:
    from ..model.rig import Rig
    from ..optimize.solve_newton import Found
    from ..optimize.solve_problem import Problem
    from ..optimize.task import SwingTask

NAME = "best_hardware"
QUESTION = "Which wrist and collet are best when each may have its own best swing?"
HEADINGS = (
    "m/s", "ball N", "hardware", "k [N m/rad]", "c [N m s/rad]", "I [kg m²]", "cost",
    "of it vibration", "worst ring [mm]", "an unknown ball leaves [mm]",
    "the first swing on it misses by",
)  # fmt: skip
CASES = ((30.0, 0.0), (30.0, -1000.0), (45.0, 0.0), (45.0, -1000.0))
"""Clubhead speed [m/s] and force of the ball [N]."""

RANGES = {
    "wrist_stiffness": (50.0, 5600.0),
    "wrist_damping": (2.0, 150.0),
    "collet_inertia": (0.016, 0.1),
}
"""What can be bought [SI]; the wrist as in the thesis's map, line 1491, the collet's inertia not
below that of its mass where it sits."""

POINTS = 500
"""Points of an axis [-]; half of a robot's file, for many swings are solved."""

BLOWS = 25
"""Wrists along each axis of the map of a blow [-]."""

SIDE = 7
"""Values of each parameter on a curve [-]."""


@dataclass(frozen=True, eq=False)
class Solved:
    """The best swing of one piece of hardware.

    Attributes:
        rig: the hardware.
        found: the swing.
        problem: what was asked.
        ring: worst after the end, over 41 shaft frequencies [m].
    """

    rig: Rig
    found: Found
    problem: Problem
    ring: float


def asked(speed: float, force: float) -> tuple[SwingTask, Rig]:
    """Task and rig of one case [m/s, N]."""
    return usual("thesis", speed, force, points=POINTS, shaft_bounded=True, scenarios=3)


def solved(task: SwingTask, rig: Rig, numbers: Mapping[str, float]) -> Solved | None:
    """The best swing on other hardware [SI]; None where limits forbid it."""
    from ..optimize.hardware import with_numbers
    from ..optimize.solve import settled
    from ..optimize.solve_scenarios import between_scenarios, scenarios_of

    own, factors = with_numbers(rig, numbers), scenarios_of(task)
    found, problem = settled(task, own, None, factors)
    if not (found.settled and found.feasible):
        return None
    rings = between_scenarios(problem, own, found, factors)[1]
    return Solved(own, found, problem, float(rings.max()))


def for_a_blow(ranges: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """The wrist that leaves least after one blow, of a map, whatever swings it [SI]."""
    from ..optimize.sweep import Axis, sweep
    from .designs import struck_task

    units = {"wrist_stiffness": "N m/rad", "wrist_damping": "N m s/rad"}
    axes = tuple(
        Axis(name, np.geomspace(*ranges[name], BLOWS), unit) for name, unit in units.items()
    )
    rms = np.asarray(sweep(struck_task(axes)).scores["rms"])
    best = np.unravel_index(np.argmin(rms), rms.shape)
    return {axis.name: float(axis.values[k]) for axis, k in zip(axes, best, strict=True)}


def unknown_ball(one: Solved) -> float:
    """What a ball that the swing knows nothing of leaves once its drive has long come to rest [m].

    Root mean square of what the ball alone moves; the robot is linear, so it can be told apart.
    """
    from ..optimize.solve import profile_of
    from ..optimize.solve_program import swing_rows
    from ..optimize.swing_check import play
    from ..optimize.task import Impact
    from .six_swings import CONTACT, FORCE, RESTS, UNSTRUCK

    profile, moved = profile_of(one.problem, one.found), []
    for force in (FORCE, UNSTRUCK):
        ball = Impact(profile.impact_time, 0.0, 0.0, 1.0, force=force, duration=CONTACT)
        played = play(profile, one.rig, ball)
        drives = profile.at(played.times).angles[:, :2].T
        moved.append(swing_rows(played.numbers[0], played.states[0, :, :4].T, drives))
    end = float(profile.time[-1])
    rests = (played.times > end + RESTS) & (played.times < end + RESTS + 0.5)
    return float(np.sqrt(np.mean((moved[0] - moved[1])[rests] ** 2)))


def find(
    call: Call,
    cases: Sequence[tuple[float, float]] = CASES,
    ranges: Mapping[str, tuple[float, float]] = RANGES,
    side: int = SIDE,
) -> Answer:
    """The best hardware with its best swing, beside that for a swing that is held.

    Args:
        call: who asks.
        cases: clubhead speeds [m/s] and forces of the ball [N].
        ranges: what can be bought [SI].
        side: values of each parameter on a curve [-].

    Returns:
        The answer [SI].
    """
    rows: list[dict[str, Any]] = []
    panels: list[Any] = []
    for case in cases:
        rows += _case(call, case, ranges)
    call.progress("curves")
    panels = _panels(cases[-1], ranges, side)
    notes = (
        "Linear robot of preset robo_v, three shaft frequencies within a tenth; limits and impact "
        f"as in the study swing_methods; {POINTS} points. Cost: mean squared jerk in shares of its "
        "limit, and the clubhead's mean squared velocity against a rigid club's in shares of the "
        "speed at impact, with what rings on.",
        "The best is found along the slopes of what a swing costs at best, from the rig as it is: "
        "a local optimum. After a blow: the wrist of least vibration in a map, as in the thesis, "
        "which no swing entered. An unknown ball: 1 kN for 0.5 ms, root mean square for half a "
        "second from half a second after the end. The first swing: that of the robot as it is.",
    )
    cells = [_cells(row) for row in rows]
    return Answer(HEADINGS, cells, rows, _sentences(rows), notes, panels, {})


def _case(
    call: Call, case: tuple[float, float], ranges: Mapping[str, tuple[float, float]]
) -> list[dict[str, Any]]:
    """Three rows: the rig as it is, the best for its swing held, the best with its own."""
    from ..optimize.hardware import best_hardware, slopes

    task, rig = asked(*case)
    words = f"{case[0]:g} m/s, ball {case[1]:g} N"
    call.progress(words)
    first = solved(task, rig, {})
    if first is None:
        raise ValueError(
            f"best_hardware: expected a swing of {words}, found none within the limits. "
            "Mend: ask for a lower speed."
        )
    by = slopes(first.problem, first.found, rig, tuple(ranges))
    best = best_hardware(task, rig, ranges, lambda text: call.progress(f"{words}: {text}"))
    call.progress(f"{words}: one blow")
    chosen = {
        "as it is": {},
        "best after a blow": for_a_blow(ranges),
        "best with its own swing": dict(best.numbers),
    }
    rows = []
    for name, numbers in chosen.items():
        one = solved(task, rig, numbers)
        rows.append(_row(case, name, first, one, numbers, ranges))
    rows[0] |= {
        "slopes": dict(by.cost), "vibration_slopes": dict(by.vibration),
        "optimality_missed": by.left,
    }  # fmt: skip
    rows[-1] |= {"at_bound": list(best.at_bound), "swings": best.swings}
    return rows


def _row(
    case: tuple[float, float],
    name: str,
    first: Solved,
    one: Solved | None,
    numbers: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
) -> dict[str, Any]:
    from ..optimize.hardware import held

    known = {key: float(first.rig.parameters[key].value) for key in ranges} | dict(numbers)
    _, errors = held(first.problem, first.found, first.rig, known)
    pose = max(abs(value) for key, value in errors.items() if key != "speed")
    row = {"speed": case[0], "force": case[1], "hardware": name, **known}
    row |= {"missed_pose": float(pose), "missed_speed": errors["speed"]}
    if one is None:
        return row | {"cost": None, "vibration": None, "ring": None, "unknown_ball": None}
    return row | {
        "cost": one.found.cost, "vibration": one.found.parts["vibration"], "ring": one.ring,
        "unknown_ball": unknown_ball(one),
    }  # fmt: skip


def _sentences(rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    lines = []
    for start in range(0, len(rows), 3):
        first, other, best = rows[start : start + 3]
        saved = 100 * (1.0 - best["cost"] / first["cost"])
        ends = ", ".join(one.replace("_", " ") for one in best["at_bound"])
        blow = (
            "cannot swing so within the limits" if other["cost"] is None
            else f"costs {number_words(other['cost'] / best['cost'], 2)} times that"
        )  # fmt: skip
        lines.append(
            f"{first['speed']:g} m/s, ball {first['force']:g} N: {_bought(best)} saves "
            f"{saved:.3g} % of the cost{f' ({ends} at an end of its range)' if ends else ''}; what "
            f"is best after a blow, {_bought(other)}, {blow}."
        )
    balls = [[1e3 * row["unknown_ball"] for row in rows[k::3] if row["cost"]] for k in (0, 2)]
    lines.append(
        f"But of a ball that the swing does not know the best leaves {_span(balls[1])} mm, the "
        f"robot as it is {_span(balls[0])} mm: a swing needs no compliance for what it knows."
    )
    slope, vibration, cost = (rows[-3][key] for key in ("slopes", "vibration_slopes", "cost"))
    told = ", ".join(
        f"{name.replace('_', ' ')} {value / cost:+.2g} % and "
        f"{vibration[name] / rows[-3]['vibration']:+.2g} %"
        for name, value in slope.items()
    )
    lines.append(f"One percent more of each there changes cost and vibration by: {told}.")
    return tuple(lines)


def _span(values: Sequence[float]) -> str:
    low, high = (number_words(one, 2) for one in (min(values), max(values)))
    return f"{low} to {high}"


def _bought(row: Mapping[str, Any]) -> str:
    k, c, inertia = (number_words(row[name], 3) for name in RANGES)
    return f"{k} N m/rad, {c} N m s/rad and {inertia} kg m²"


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    own = (number_words(row[name], 3) for name in RANGES)
    if row["cost"] is None:
        worth = ("–", "–", "–", "–")
    else:
        worth = (
            f"{row['cost']:.4g}", f"{row['vibration']:.3g}", f"{1e3 * row['ring']:.3g}",
            f"{1e3 * row['unknown_ball']:.3g}",
        )  # fmt: skip
    missed = f"{np.degrees(row['missed_pose']):.2f}°, {row['missed_speed']:+.2f} m/s"
    return f"{row['speed']:g}", f"{row['force']:g}", row["hardware"], *own, *worth, missed


def _panels(
    case: tuple[float, float], ranges: Mapping[str, tuple[float, float]], side: int
) -> list[Any]:
    """Least cost against each parameter: with its own swing, and under the first one held."""
    from ..optimize.hardware import held
    from .thesis.draw import Curve, Panel

    task, rig = asked(*case)
    first, found = solved(task, rig, {}), []
    assert first is not None
    rest = first.found.cost - first.found.parts["vibration"]
    for name, (low, high) in ranges.items():
        values = np.geomspace(low, high, side)
        own, still = np.full(side, np.nan), np.full(side, np.nan)
        for k, value in enumerate(values):
            one = solved(task, rig, {name: float(value)})
            own[k] = np.nan if one is None else one.found.cost
            numbers = {name: float(value)}
            still[k] = rest + held(first.problem, first.found, first.rig, numbers)[0]
        begun = np.array([float(rig.parameters[name].value)])
        lines = (
            Curve(values, np.log10(own), "its own best swing"),
            Curve(values, np.log10(still), "the first swing, which misses the ball"),
            Curve(begun, np.log10([first.found.cost]), "as it is", True),
        )
        label = f"{name.replace('_', ' ')} [{rig.parameters[name].unit}]"
        found.append(Panel(f"{case[0]:g} m/s, ball {case[1]:g} N", label, "log10 of cost", lines,
                           None, True))  # fmt: skip
    return found


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
