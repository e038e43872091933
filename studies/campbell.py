"""How the club's modes change with the speed of the swing: a Campbell diagram and its table."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .engine import start_engine, write_together
from .listing import markdown, printed
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..model.campbell import Campbell

NAME = "campbell"
QUESTION = "How do the club's frequencies and dampings change with the speed of the swing?"
PRESET, MODELS = "robo_v_sleeve_50", ("fixed_collet", "pinned_wrist")
FASTEST, STRIDE, SHOWN = 40.0, 0.5, 10.0
"""Highest speed, distance of two in the figure and of two in the table [rad/s]."""

AUDIBLE = 50.0
"""Highest frequency at rest of a mode that the figure shows [Hz]."""

HEADINGS = ("collet", "mode", "speed [rad/s]", "frequency [Hz]", "damping ratio [-]")
NOTES = (
    f"Sleeve of 50 % ({PRESET}), club in line with the arm, plane horizontal: no weight.",
    "The arm turns at a constant speed; damped oscillations about it, in axes that turn with it.",
    "The shaft's shortening is included. Without it the head would leave from {limit:.1f} rad/s "
    "on at the latest, the square root of shaft stiffness over head mass.",
    "A damping ratio of 1 is a motion that creeps; its frequency is its rate over 2 pi.",
)


def run(call: Call) -> dict[str, Any]:
    """Follow the modes, and write table, JSON and figure.

    Args:
        call: who asks; nothing is drawn by chance, so the seed is kept only.

    Returns:
        Rows of the table, a status and a sentence for each collet, notes and provenance.
    """
    from .. import __version__
    from ..model.campbell import campbell
    from ..model.robot import PRESETS, Robot

    start_engine()
    began, numbers, found = time.perf_counter(), PRESETS[PRESET], {}
    limit = float(np.sqrt(numbers["shaft_stiffness"] / numbers["clubhead_mass"]))
    speeds = np.arange(0.0, FASTEST + STRIDE / 2, STRIDE)
    for model in MODELS:
        call.progress(model.replace("_", " "))
        found[model] = campbell(Robot(model, tuple(numbers)), numbers, speeds)
    call.progress("")
    result = {
        "study": NAME,
        "question": QUESTION,
        "rows": [row for model, diagram in found.items() for row in _rows(model, diagram)],
        "status": {model: diagram.status for model, diagram in found.items()},
        "sentences": {model: diagram.sentence for model, diagram in found.items()},
        "notes": [note.format(limit=limit) for note in NOTES],
        "figure": f"{NAME}.svg",
        "provenance": {
            "version": __version__,
            "seed": call.seed,
            "seconds": round(time.perf_counter() - began, 1),
        },
    }
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    writers = {
        f"{NAME}.json": lambda path: path.write_text(text, encoding="utf-8"),
        f"{NAME}.md": lambda path: path.write_text(as_text(result), encoding="utf-8"),
        f"{NAME}.svg": lambda path: _draw(found, path),
    }
    write_together(call.out, writers)
    return result


def _rows(model: str, diagram: Campbell) -> list[dict[str, Any]]:
    """A row for each mode and each speed of the table."""
    shown = np.flatnonzero(np.isclose(diagram.speeds % SHOWN, 0.0))
    return [
        {
            "collet": model,
            "mode": mode + 1,
            "speed": float(diagram.speeds[at]),
            "frequency": float(diagram.frequencies[at, mode]),
            "damping_ratio": float(diagram.damping_ratios[at, mode]),
        }
        for mode in range(diagram.poles.shape[1])
        for at in shown
    ]


def _draw(found: Mapping[str, Campbell], path: Path) -> None:
    """Frequency and damping of the slow oscillations against speed, two panels a collet."""
    from .thesis.draw import Curve, Panel, drawn

    panels = []
    for model, diagram in found.items():
        at_rest = diagram.damped_frequencies[0]
        slow = np.flatnonzero((at_rest > 0) & (at_rest < AUDIBLE))
        name, axis = model.replace("_", " "), "speed of the arm [rad/s]"
        lines = [(mode, f"mode {mode + 1}") for mode in slow]
        frequency = [Curve(diagram.speeds, diagram.frequencies[:, i], word) for i, word in lines]
        turns = Curve(diagram.speeds, diagram.speeds / (2 * np.pi), "once a turn")
        damping = [Curve(diagram.speeds, diagram.damping_ratios[:, i], word) for i, word in lines]
        panels.append(Panel(f"{name}: frequency", axis, "frequency [Hz]", (*frequency, turns)))
        panels.append(Panel(f"{name}: damping", axis, "damping ratio [-]", tuple(damping)))
    path.write_bytes(drawn(panels))


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    numbers = (number_words(row[name], 4) for name in ("speed", "frequency", "damping_ratio"))
    return (row["collet"].replace("_", " "), str(row["mode"]), *numbers)


def _lines(result: Mapping[str, Any]) -> list[str]:
    told = result["sentences"].items()
    return [*(f"{model.replace('_', ' ')}: {text}" for model, text in told), *result["notes"]]


def as_text(result: Mapping[str, Any]) -> str:
    """The table and its notes as Markdown."""
    table = markdown(HEADINGS, [_cells(row) for row in result["rows"]])
    below = [f"![{result['question']}]({result['figure']})", ""]
    below += [f"- {line}" for line in _lines(result)]
    return "\n".join([f"# {result['question']}", "", *table, "", *below]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the table and its notes."""
    rows = [_cells(row) for row in result["rows"]]
    printed(result["question"], HEADINGS, rows, [f"  - {line}" for line in _lines(result)])


STUDY = Study(NAME, QUESTION, run, show)
