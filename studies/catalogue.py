"""Which spring and dashpot to buy for the wrist? Those of a list, searched with a limit."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import TOLD, Answer, finding, percent, show, struck_task
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..optimize.search import Search
    from ..optimize.search_spec import Choice

NAME = "catalogue"
QUESTION = "What does it cost to buy the wrist's spring and dashpot from a list?"
HEADINGS = ("list", "spring [N m/rad]", "dashpot [N m s/rad]", "RMS [m/s²]", "costs [%]", "trials")
SERIES = {3: "three sizes a decade", 5: "five sizes a decade", 10: "ten sizes a decade"}
"""Lists of sizes that are evenly spaced by their logarithm, by how many a decade."""

DECADES = {"wrist_stiffness": (10.0, 1000.0), "wrist_damping": (1.0, 100.0)}
UNITS = {"wrist_stiffness": "N m/rad", "wrist_damping": "N m s/rad"}
LIMIT = 4.5e-4
"""What the grip may move [m]."""

TRIALS, BATCH = 192, 32


def parts_of(a_decade: int) -> tuple[Choice, ...]:
    """A list of springs and one of dashpots, evenly spaced by their logarithm [SI]."""
    from ..optimize.search_spec import Choice

    found = []
    for name, (low, high) in DECADES.items():
        count = round(a_decade * np.log10(high / low)) + 1
        values = np.array([float(f"{v:.3g}") for v in np.geomspace(low, high, count)])
        word = name.split("_")[1]
        parts = tuple(f"{word} {v:g}" for v in values)
        found.append(Choice(word, parts, {name: values}, {name: UNITS[name]}))
    return tuple(found)


def searched(a_decade: int, folder: Path, seed: int, trials: int = TRIALS) -> Search:
    """The best pair of a list, by TPE, with a limit for the grip.

    Args:
        a_decade: sizes a decade [-].
        folder: for the journal of trials.
        seed: of what is drawn.
        trials: designs in all [-].
    """
    from ..optimize.search import SearchTask, search
    from ..optimize.search_spec import Limit, axes_for

    parts = parts_of(a_decade)
    task = struck_task(axes_for((), parts), ("rms", "grip_displacement_peak"))
    limits = (Limit("grip_displacement_peak", None, LIMIT),)
    asked = SearchTask(
        task, (), parts, (("rms", "minimize"),), limits, "tpe", trials, BATCH, 1, seed
    )
    return search(asked, f"journal:{folder / f'{a_decade}.log'}", NAME)


def free_best() -> tuple[dict[str, float], float]:
    """The best wrist where any can be had, and its RMS [SI]; it keeps the grip's limit."""
    from ..optimize.optimum import certify
    from ..optimize.sweep import Axis, score_designs, sweep

    axes = tuple(Axis(n, np.geomspace(*ends, 41), UNITS[n]) for n, ends in DECADES.items())
    one = certify(sweep(struck_task(axes)), "rms")
    assert one is not None, "every wrist has a finite score"
    there = {name: np.array([value]) for name, value in one.design.items()}
    moved = score_designs(struck_task(axes, ("grip_displacement_peak",)), there)
    assert moved["grip_displacement_peak"][0] <= LIMIT, "otherwise the limit decides, not the list"
    return one.design, one.value


def find(call: Call, series: Sequence[int] = tuple(SERIES)) -> Answer:
    """The best pair of each list, beside the best wrist of all.

    Args:
        call: who asks.
        series: sizes a decade of each list [-].

    Returns:
        The answer [SI].
    """
    call.progress("any wrist")
    design, lowest = free_best()
    rows: list[dict[str, Any]] = [
        {"list": "any that one likes", **design, "rms": lowest, "cost": 0.0, "trials": None}
    ]
    panels = []
    with tempfile.TemporaryDirectory() as folder:
        for a_decade in series:
            call.progress(SERIES[a_decade])
            found = searched(a_decade, Path(folder), call.seed)
            at = found.front[0]
            own = {name: float(values[at]) for name, values in found.numbers.items()}
            rms = float(found.scores["rms"][at])
            told = {"rms": rms, "cost": rms / lowest - 1.0, "trials": len(found.draws)}
            rows.append({"list": SERIES[a_decade], **own, **told})
            panels.append(_panel(SERIES[a_decade], found))
    last = rows[-1]
    sentences = (
        f"With {rows[1]['list']} it costs {percent(rows[1]['cost'])} %, with {last['list']} "
        f"{percent(last['cost'])} %.",
    )
    notes = (
        TOLD,
        f"TPE over {TRIALS} trials in batches of {BATCH}; the grip may move "
        f"{1e3 * LIMIT:g} mm. Sizes are evenly spaced, not those of a maker: "
        "`supple search` takes a maker's list as a CSV file.",
    )
    return Answer(HEADINGS, [_cells(row) for row in rows], rows, sentences, notes, panels, {})


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    numbers = (number_words(row[key], 3) for key in (*DECADES, "rms"))
    return row["list"], *numbers, percent(row["cost"]), number_words(row["trials"])


def _panel(title: str, found: Search) -> Any:
    """The best of the first trials against their number."""
    from .thesis.draw import Curve, Panel

    rms = np.where(found.usable, found.scores["rms"], np.inf)
    best = np.minimum.accumulate(rms)
    count = np.arange(1, len(best) + 1)
    kept = np.isfinite(best)
    lines = (Curve(count[kept], best[kept], "best so far"),)
    return Panel(title, "trials", "RMS [m/s²]", lines)


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
