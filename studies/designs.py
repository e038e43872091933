"""Studies of designs: the club that they strike, and how they tell what they found."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .answer import answered
from .engine import start_engine
from .listing import markdown, printed
from .study import Call
from .thesis.draw import Panel
from .words import number_words

if TYPE_CHECKING:
    from ..model.robot import Robot
    from ..optimize.sweep import Axis, SweepTask

PRESET = "robo_v_sleeve_50"
FORCE, LASTS, SPAN, RATE = -1600.0, 0.005, 2.0, 1000.0
"""Force [N] and duration [s] of the blow, how long is looked at [s], and how densely [Hz]."""

TOLD = (
    f"Preset {PRESET} on a wrist; a blow of {-FORCE:g} N for {1e3 * LASTS:g} ms to the head; root "
    f"mean square of the clubhead's acceleration relative to the collet, from then to {SPAN:g} s."
)
"""The same in words."""


def robot() -> Robot:
    """The club on a wrist."""
    from ..model.robot import PRESETS, Robot

    return Robot("pinned_wrist", tuple(PRESETS[PRESET]))


def struck_task(axes: tuple[Axis, ...], scores: tuple[str, ...] = ("rms",)) -> SweepTask:
    """What is asked of a grid of designs that are struck.

    Args:
        axes: the grid [SI].
        scores: names of scores.
    """
    from ..model.drives import impact
    from ..model.linear import Port
    from ..model.robot import PRESETS
    from ..optimize.sweep import SweepTask

    times = np.arange(round(SPAN * RATE)) / RATE
    blow, sensor = impact("clubhead", FORCE, 0.0, LASTS), Port("clubhead", "acceleration", "collet")
    numbers = dict(PRESETS[PRESET])
    return SweepTask(robot(), numbers, blow, times, (LASTS, SPAN), sensor, scores, axes)


@dataclass(frozen=True, eq=False)
class Answer:
    """What a study found.

    Attributes:
        headings: of the table, with units.
        cells: the table as text, row by row.
        rows: the same as numbers that JSON can hold, row by row [SI].
        sentences: what it means, the first one the answer.
        notes: how it was found.
        panels: of the figure.
        more: further entries of the result, as JSON can hold them.
    """

    headings: tuple[str, ...]
    cells: Sequence[tuple[str, ...]]
    rows: Sequence[Mapping[str, Any]]
    sentences: Sequence[str]
    notes: Sequence[str]
    panels: Sequence[Panel]
    more: Mapping[str, Any]


def finding(
    name: str, question: str, find: Callable[[Call], Answer]
) -> Callable[[Call], dict[str, Any]]:
    """What runs a study: it writes its answer as JSON, Markdown and one figure.

    Args:
        name: what it is called on the command line.
        question: in one sentence.
        find: answers it.
    """

    def run(call: Call) -> dict[str, Any]:
        start_engine()
        began = time.perf_counter()
        found = find(call)
        call.progress("")
        told = {
            "headings": list(found.headings),
            "cells": [list(row) for row in found.cells],
            "rows": [dict(row) for row in found.rows],
            "sentences": list(found.sentences),
            "notes": list(found.notes),
            **found.more,
        }
        return answered(call, name, question, told, _text, found.panels, {}, began)

    return run


def _text(result: Mapping[str, Any]) -> str:
    table = markdown(result["headings"], result["cells"])
    lines = [f"# {result['question']}", "", *result["sentences"], "", *table, ""]
    lines += [f"![{result['question']}]({result['figure']})", ""]
    return "\n".join(lines + [f"- {note}" for note in result["notes"]]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the table, what it means and how it was found."""
    below = [*result["sentences"], *(f"  - {note}" for note in result["notes"])]
    printed(result["question"], result["headings"], result["cells"], below)


def percent(share: float) -> str:
    """A share [1] in percent, to two digits behind the point at most."""
    return number_words(round(100.0 * share, 2) + 0.0, 3)


def listed(names: Sequence[str]) -> str:
    """Names as they are spoken: "a, b and c"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
