"""Does the advice which wrist to buy change? A map under each law that a diagnosis can name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import LASTS, PRESET, Answer, finding, listed, percent, robot, show
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..optimize.wrist import WristMap
    from .thesis.draw import Panel

NAME = "advice"
QUESTION = "Does the best wrist change under each law that a diagnosis can name there?"
FORCE = -40.0
"""Force of the blow [N]: a soft one, whose motion friction can stop."""

STIFFNESS, DAMPING = (5.0, 600.0), (0.5, 50.0)
"""Ends of the grid, which is even in logarithms [N m/rad, N m s/rad]."""

SIDE = 9
"""Designs along each axis [-]."""

MATTERS = 0.01
"""Loss from which on the advice counts as another one [1]."""

HEADINGS = (
    "law at the wrist", "best k [N m/rad]", "best c [N m s/rad]", "RMS [m/s²]",
    "loss if ignored [%]", "advice",
)  # fmt: skip
RATE, SPAN = 2000.0, 1.0
"""How densely [Hz] and how long [s] each motion is looked at."""

LAWS: Sequence[tuple[str, Mapping[str, float]]] = (
    ("coulomb_friction", {"torque": 0.22}),
    ("coulomb_friction", {"torque": 0.5}),
    ("quadratic_damping", {"quadratic_damping": 5.0}),
    ("cubic_stiffness", {"cubic_stiffness": 1e5}),
    ("clearance", {"gap": 5e-3}),
    ("hysteresis", {"torque": 1.0, "knee": 5e-3}),
)
"""Laws with strengths that a diagnosis finds in a joint, by symbol [SI]; 0.22 N m is the demo's."""


@dataclass(frozen=True)
class Asked:
    """What is mapped.

    Attributes:
        laws: each with its strength and shapes by symbol [SI].
        side: designs along each axis [-].
        span: how long is looked at [s].
    """

    laws: Sequence[tuple[str, Mapping[str, float]]] = LAWS
    side: int = SIDE
    span: float = SPAN


def maps_of(asked: Asked, call: Call) -> list[WristMap]:
    """The map without a law, then with each of them.

    Args:
        asked: laws and grid.
        call: hears what is being done.
    """
    from ..model.drives import impact
    from ..model.linear import Port
    from ..model.robot import PRESETS
    from ..optimize.wrist import WristTask, map_wrists

    times = np.arange(round(asked.span * RATE)) / RATE
    axes = (np.geomspace(*ends, asked.side) for ends in (STIFFNESS, DAMPING))
    task = WristTask(
        impact("clubhead", FORCE, 0.0, LASTS), times, (LASTS, asked.span),
        Port("clubhead", "acceleration", "collet"), *axes,
    )  # fmt: skip
    numbers = dict(PRESETS[PRESET])
    found = [map_wrists(robot(), numbers, task)]
    for law, strengths in asked.laws:
        call.progress(f"map with {law.replace('_', ' ')}")
        table = {"law": law, "place": "wrist", "parameters": dict(strengths)}
        found.append(map_wrists(robot(), numbers, task, (table,)))
    return found


def find(call: Call, asked: Asked | None = None) -> Answer:
    """Best wrists without and with each law, and what it costs to ignore the law.

    Args:
        call: who asks.
        asked: laws and grid; the study's own where None.

    Returns:
        The answer [SI].
    """
    from ..optimize.wrist import decide

    asked = asked or Asked()
    maps, rows = maps_of(asked, call), []
    for (law, parameters), own in zip((("none", {}), *asked.laws), maps, strict=True):
        best = own.design(own.best)
        loss = decide(maps[0], own)["loss_if_ignored"]["rms"]
        rows.append(
            {
                "law": law,
                "parameters": dict(parameters),
                **best,
                "loss_if_ignored": loss,
                "changes": bool(loss > MATTERS),
                "inside": own.is_inside,
                "step_error": own.error,
            }
        )
    changed = [_named(row) for row in rows if row["changes"]]
    kept = [_named(row) for row in rows[1:] if not row["changes"]]
    sentences = [
        f"It changes under {listed(changed)}." if changed else "It changes under none of them.",
        f"Under {listed(kept)} the wrist that is best without stays within "
        f"{100 * MATTERS:g} % of the best." if kept else "No law leaves it as it is.",
    ]  # fmt: skip
    worst = max(row["step_error"] for row in rows)
    notes = (
        f"A soft blow of {-FORCE:g} N for {1e3 * LASTS:g} ms to the head; RMS of the clubhead's "
        f"acceleration relative to the collet up to {asked.span:g} s; {asked.side} by "
        f"{asked.side} wrists, even in logarithms.",
        "Halving the integrator's steps changes no score by more than "
        f"{number_words(100 * worst, 2)} %.",
        "Best wrists at an end of the grid: "
        + (listed([_named(row) for row in rows if not row["inside"]]) or "none")
        + ".",
        "Loss: how much more the wrist vibrates that is best without, by the model with the law.",
    )
    cells = [_cells(row) for row in rows]
    return Answer(HEADINGS, cells, rows, sentences, notes, _panels(rows, maps), {})


def _named(row: Mapping[str, Any]) -> str:
    """A law with its strength in words."""
    if row["law"] == "none":
        return "no law"
    symbol, value = next(iter(row["parameters"].items()))
    law, of = row["law"].replace("_", " "), symbol.replace("_", " ")
    return f"{law} of {number_words(value)}" if of == law else f"{law} ({of} {number_words(value)})"


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    numbers = (number_words(row[key], 3) for key in ("wrist_stiffness", "wrist_damping", "rms"))
    loss = percent(row["loss_if_ignored"])
    advice = "" if row["law"] == "none" else "another" if row["changes"] else "the same"
    return _named(row), *numbers, loss, advice


def _panels(rows: Sequence[Mapping[str, Any]], maps: Sequence[WristMap]) -> list[Panel]:
    from .thesis.draw import Curve, Field, Panel

    panels, base = [], maps[0].design(maps[0].best)
    for row, own in zip(rows, maps, strict=True):
        x, y = np.log10(own.task.stiffness), np.log10(own.task.damping)
        best = own.design(own.best)
        marks = tuple(
            Curve(np.log10([one["wrist_stiffness"]]), np.log10([one["wrist_damping"]]), word, True)
            for one, word in ((best, "best"), (base, "best without a law"))
        )
        field = Field(x, y, own.rms, "RMS [m/s²]")
        axes = "log10 of wrist stiffness [N m/rad]", "log10 of wrist damping [N m s/rad]"
        panels.append(Panel(_named(row), *axes, marks, field))
    return panels


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
