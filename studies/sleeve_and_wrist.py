"""Is the best wrist another one with another sleeve? Maps of both, apart and together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import TOLD, Answer, finding, listed, percent, show, struck_task
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..optimize.sweep import Axis, Map

NAME = "sleeve_and_wrist"
QUESTION = "Is the best wrist another one, if the sleeve may be chosen too?"
HEADINGS = (
    "what is chosen", "wrist k [N m/rad]", "wrist c [N m s/rad]", "sleeve k [N/m]",
    "sleeve c [N s/m]", "RMS [m/s²]", "gain [%]",
)  # fmt: skip
ENDS: Mapping[str, tuple[float, float, str]] = {
    "wrist_stiffness": (5.0, 600.0, "N m/rad"),
    "wrist_damping": (1.0, 60.0, "N m s/rad"),
    "sleeve_stiffness": (10e3, 290e3, "N/m"),
    "sleeve_damping": (100.0, 12e3, "N s/m"),
}
"""Ends of each axis, which is even in logarithms: from silicone of our rig to the thesis's."""

WRIST, SLEEVE = tuple(ENDS)[:2], tuple(ENDS)[2:]
SIDE = 10
"""Values along each axis [-]."""


def axes_of(names: tuple[str, ...], side: int) -> tuple[Axis, ...]:
    """Axes of some parameters, `side` values each [SI]."""
    from ..optimize.sweep import Axis

    return tuple(Axis(n, np.geomspace(*ENDS[n][:2], side), ENDS[n][2]) for n in names)


def find(call: Call, side: int = SIDE) -> Answer:
    """The best wrist, the best sleeve, one after the other, and both together.

    Args:
        call: who asks.
        side: values along each axis [-].

    Returns:
        The answer [SI].
    """
    from ..optimize.optimum import certify
    from ..optimize.sweep import sweep

    task = struck_task(axes_of(WRIST, side))
    start = {name: float(task.numbers[name]) for name in ENDS}
    nominal = {name: np.array([value]) for name, value in start.items()}
    from ..optimize.sweep import score_designs

    rms = float(score_designs(task, nominal)["rms"][0])
    rows: list[dict[str, Any]] = [{"chosen": "nothing: the preset", **start, "rms": rms}]
    steps = (
        ("wrist", WRIST, 0),
        ("sleeve", SLEEVE, 0),
        ("wrist, then sleeve", SLEEVE, 1),
        ("both together", (*WRIST, *SLEEVE), 0),
    )
    maps = {}
    for word, names, after in steps:
        call.progress(word)
        held = {name: rows[after][name] for name in ENDS}
        own = replace(task, axes=axes_of(names, side), numbers={**task.numbers, **held})
        maps[word] = sweep(own)
        one = certify(maps[word], "rms")
        assert one is not None, "every design of these axes has a finite score"
        rows.append({"chosen": word, **held, **one.design, "rms": one.value, "bounds": one.bounds})
    for row in rows:
        row["gain"] = 1.0 - row["rms"] / rows[0]["rms"]
    together, apart = rows[-1], rows[3]
    lost = apart["rms"] / together["rms"] - 1.0
    moved = together["wrist_stiffness"] / rows[1]["wrist_stiffness"]
    answer = "Yes" if max(moved, 1 / moved) > 1.1 else "No"
    sentences = (
        f"{answer}: with the preset's sleeve the best wrist is {_wrist(rows[1])}, with a sleeve of "
        f"one's choice {_wrist(together)}.",
        f"Both together are {percent(together['gain'])} % quieter than the preset; "
        f"the wrist first and then the sleeve vibrates {percent(lost)} % more.",
    )
    ends = [name.replace("_", " ") for name in together["bounds"]]
    if ends:
        edge = f"It stands at the end of {listed(ends)}: a part beyond it would do still better."
        sentences = (*sentences, edge)
    ends = (f"{n.replace('_', ' ')} {low:g} to {high:g} {u}" for n, (low, high, u) in ENDS.items())
    notes = (
        TOLD,
        f"{side} values along each axis, even in logarithms ({', '.join(ends)}), {side**4} designs "
        "for both; each best design polished by its gradient and checked on a finer grid.",
    )
    more = {"designs": {word: one.task.count for word, one in maps.items()}}
    cells = [_cells(row) for row in rows]
    return Answer(HEADINGS, cells, rows, sentences, notes, _panels(maps, rows), more)


def _wrist(row: Mapping[str, Any]) -> str:
    stiffness, damping = (number_words(row[name], 3) for name in WRIST)
    return f"{stiffness} N m/rad and {damping} N m s/rad"


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    numbers = (number_words(row[name], 3) for name in (*ENDS, "rms"))
    return row["chosen"], *numbers, percent(row["gain"])


def _panels(maps: Mapping[str, Map], rows: list[dict[str, Any]]) -> list[Any]:
    """The wrist's map with the preset's sleeve, and with the best sleeve of every wrist."""
    from .thesis.draw import Curve, Field, Panel

    whole = maps["both together"]
    x, y = (np.log10(axis.values) for axis in whole.task.axes[:2])
    best = np.asarray(whole.scores["rms"]).min(axis=(2, 3))
    labels = "log10 of wrist stiffness [N m/rad]", "log10 of wrist damping [N m s/rad]"

    def panel(title: str, values: np.ndarray, row: Mapping[str, Any]) -> Panel:
        k, c = (np.log10([row[name]]) for name in WRIST)
        field = Field(x, y, values, "RMS [m/s²]")
        return Panel(title, *labels, (Curve(k, c, "best", True),), field)

    alone = np.asarray(maps["wrist"].scores["rms"])
    return [
        panel("With the preset's sleeve", alone, rows[1]),
        panel("With the sleeve that suits each wrist best", best, rows[-1]),
    ]


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
