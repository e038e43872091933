"""What an arm's motion and a club's angle tell of the stiffness and damping of a passive wrist."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .engine import start_engine, write_together
from .listing import markdown, printed
from .study import Call, Study

NAME = "wrist"
QUESTION = (
    "Which stiffness and damping of a passive wrist do an arm's motion and a club's angle ask for?"
)
FOLDER = Path(__file__).resolve().parent / "data" / "wrist"
MADE_WITH = {"golfer_1": (500.0, 5.0), "golfer_2": (350.0, 3.0)}
"""Wrists of the thesis's two golfers [N m/rad, N m s/rad], line 1615, with which the bundled swings
were made by an independent chain of links."""

INCLINATION = 0.8  # of the swing plane [rad]
KNOTS = 4
HEADINGS = ("swing", "k [N m/rad]", "made with", "c [N m s/rad]", "made with", "stiffness varies")


def find(folder: Path = FOLDER) -> list[dict[str, Any]]:
    """The wrist of every swing in a folder: constant, and varying where the swing asks for it.

    Args:
        folder: of CSV files with time [s], arm and club angle [deg] in this order.
    """
    import numpy as np

    from ..identification.wrist_joint import fit_wrist, likelier_wrist

    rows = []
    for path in sorted(folder.glob("*.csv")):
        times, arm, club = np.loadtxt(path, delimiter=",", skiprows=1).T
        angles = np.radians(arm), np.radians(club)
        constant = fit_wrist(times, *angles, inclination=INCLINATION)
        varying = fit_wrist(times, *angles, inclination=INCLINATION, knots=KNOTS)
        chosen = likelier_wrist(constant, varying)
        made = MADE_WITH.get(path.stem, (None, None)) if folder == FOLDER else (None, None)
        rows.append(
            {
                "swing": path.stem,
                "stiffness": _number(chosen.stiffness, chosen.stiffness_std, made[0], "N m/rad"),
                "damping": _number(chosen.damping, chosen.damping_std, made[1], "N m s/rad"),
                "rest": _number(chosen.rest, chosen.rest_std, None, "rad"),
                "varies": chosen is varying,
                "delta_bic": constant.bic - varying.bic,
                "knots": [float(t) for t in chosen.knots],
                "knot_stiffness": [float(k) for k in chosen.knot_stiffness],
                "misfit": {"ratio": chosen.misfit.ratio, "p_value": chosen.misfit.p_value},
                "status": chosen.status,
            }
        )
    return rows


def _number(value: float, std: float, made: float | None, unit: str) -> dict[str, Any]:
    found = {"value": value, "std": std, "low": value - 1.96 * std, "high": value + 1.96 * std}
    return {**found, "unit": unit, **({} if made is None else {"made_with": made})}


def run(call: Call) -> dict[str, Any]:
    """Answer the question for the bundled swings, or those of a folder; write table and JSON."""
    from .. import __version__

    start_engine()
    began = time.perf_counter()
    folder = FOLDER if call.data is None else call.data
    if not list(folder.glob("*.csv")):
        raise ValueError(
            f"{folder}: --data: expected CSV files of time [s], arm and club angle [deg], found "
            "none. Mend: name their folder."
        )
    call.progress("fitting wrists")
    rows = find(folder)
    call.progress("")
    result = {"study": NAME, "question": QUESTION, "rows": rows}
    seconds = round(time.perf_counter() - began, 1)
    result["provenance"] = {"version": __version__, "seed": call.seed, "seconds": seconds}
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_together(
        call.out,
        {
            f"{NAME}.json": lambda path: path.write_text(text, encoding="utf-8"),
            f"{NAME}.md": lambda path: path.write_text(as_text(result), encoding="utf-8"),
        },
    )
    return result


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    cells = [row["swing"]]
    for name in ("stiffness", "damping"):
        one = row[name]
        digits = ".1f" if name == "stiffness" else ".2f"
        made = one.get("made_with")
        cells.append(f"{one['value']:{digits}} ± {one['std']:{digits}}")
        cells.append("–" if made is None else f"{made:g}")
    return (*cells, "yes" if row["varies"] else "no")


def as_text(result: Mapping[str, Any]) -> str:
    """The table as Markdown."""
    table = markdown(HEADINGS, [_cells(row) for row in result["rows"]])
    return "\n".join([f"# {result['question']}", "", *table]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the table."""
    lines = [f"  - {row['swing']}: {row['status']}" for row in result["rows"]]
    printed(result["question"], HEADINGS, [_cells(row) for row in result["rows"]], lines)


STUDY = Study(NAME, QUESTION, run, show)
