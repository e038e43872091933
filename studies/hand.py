"""Does a club swing on after the hand that holds it? Grips of robots, and records of golfers."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .answer import answered
from .engine import start_engine
from .listing import markdown, printed
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..identification.hand import Hold
    from ..identification.records import Channel, Record

NAME = "hand"
QUESTION = "Does the club swing on after the hand, and how much damping does its hold have?"
HEADINGS = ("hold", "motion", "swings on?", "Hz", "damping ratio", "cycles", "hand explains")
REACH = 0.62
"""Shoulder to hand of the made-up arm [m]."""

RATE, NOISE = 2048.0, 0.3
"""Samples a second [Hz], line 1369, and white noise of both made-up accelerometers [m/s^2]."""

ANSWERS = {"oscillates": "yes", "no_oscillation": "no", "cannot_tell": "unknown"}

MOTIONS = {
    "-90 to 90": ((0.0, -90.0), (1.0, 90.0)),
    "0 to -90 to 90 to 0": ((0.0, 0.0), (0.6, -90.0), (1.4, 90.0), (2.0, 0.0)),
    "-90 to 90 to -90": ((0.0, -90.0), (0.9, 90.0), (1.8, -90.0)),
}
"""Waypoints of section 6.5's three motions [s, degrees], line 1377; the times are ours."""

HOLDS = {
    "rigid": "robo_v_rigid",
    "0 % sleeve": "robo_v_sleeve_0",
    "50 % sleeve": "robo_v_sleeve_50",
}
GOLFERS = "data/hand"
"""Where the records of golfers' hands lie that the study brings along."""

APART = 0.040
"""By how much a clock that the motion alone tells may be off, as the club lags behind [s]."""

NOTES = (
    "Robots: the thesis's models with rigid wrists, made-up motions of the three kinds, noise of "
    f"{NOISE:g} m/s² on both accelerometers. Golfers: records that the independent bench made up, "
    "with tremor and noise, since the thesis prints none of its own; --data takes yours.",
    "The head follows the hand as a mass on the shaft's spring and the hold's damping. A rigid "
    "club is the limit of an infinite damping; brackets are intervals of 95 % by the likelihood.",
    "There is no gravity in this: it is for motions in a level plane, as in section 6.5. In a "
    "motion up and down both accelerometers feel the arm's angle, and a golfer's hold is mostly "
    "'unknown'.",
    "The hand explains: share of the head's mean square that a rigid club would have too.",
    "It oscillates where a whole cycle stays above a twentieth: damping ratio below 0.43.",
)


def run(call: Call) -> dict[str, Any]:
    """Compare hand and head in three motions of robots' grips and golfers' hands, or in records.

    Where hand and head have clocks of their own, both are brought to the slower one; where
    ``clock_offset`` is not told, to the one at which the motions meet, which is then fitted along.

    Args:
        call: who asks; ``data`` is a folder of records with an acceleration at ``hand`` and one at
            ``clubhead``; ``seed`` draws the noise of made-up ones.

    Returns:
        A row a motion with its answer, notes and provenance.

    Raises:
        ValueError: in the words of the door.
    """
    from ..identification.hand import hold
    from .thesis.draw import Curve, Panel

    start_engine()
    began, inputs = time.perf_counter(), dict[str, str]()
    rows, panels = [], []
    cases = _default(call.seed, inputs) if call.data is None else _measured(call.data, inputs)
    for case in cases:
        call.progress(f"{case.holder}, {case.motion}")
        found = hold(case.hand, case.head, case.rate, apart=case.apart)
        rows.append(_row(case, found))
        curves = (Curve(found.times, found.predicted, "head"),
                  Curve(found.times, found.rest, "less a rigid club's"))  # fmt: skip
        title = f"{case.holder}: {case.motion}"
        panels.append(Panel(title, "time [s]", "acceleration [m/s²]", curves))
    call.progress("")
    told = {"rows": rows, "notes": list(NOTES if call.data is None else NOTES[1:])}
    return answered(call, NAME, QUESTION, told, as_text, panels, inputs, began)


class Case(NamedTuple):
    """Hand and head of one motion.

    Attributes:
        holder: of the club.
        motion: in words.
        hand: its acceleration, shape (n,) [m/s^2].
        head: that of the clubhead, shape (n,) [m/s^2].
        rate: samples a second [Hz].
        apart: by how much their clocks may still be off [s].
        words: what was done to bring them to one clock.
    """

    holder: str
    motion: str
    hand: np.ndarray
    head: np.ndarray
    rate: float
    apart: float = 0.0
    words: tuple[str, ...] = ()


def _default(seed: int, inputs: dict[str, str]) -> Iterator[Case]:
    """Robots' grips, then golfers' hands."""
    yield from _made_up(seed)
    with as_file(files("supple.studies") / GOLFERS) as folder:
        for case in _measured(folder, inputs):
            yield case._replace(holder="golfer's hands")


def _made_up(seed: int) -> Iterator[Case]:
    """Hand and head of three grips in three motions, by the thesis's driven wrist."""
    from ..model.motion import respond
    from ..model.robot import PRESETS, Robot
    from .thesis.runs import RIGID_WRIST, driven, eased, head, instants

    rng, times = np.random.default_rng(seed), instants(4.0, RATE)
    stiff = {"wrist_stiffness": RIGID_WRIST[0], "wrist_damping": RIGID_WRIST[1]}
    for holder, preset in HOLDS.items():
        numbers = PRESETS[preset] | stiff
        for motion, points in MOTIONS.items():
            waypoints = [(0.4 + at, math.radians(angle)) for at, angle in points]
            drive = driven(4.0, wrist=eased(waypoints))
            port = head(frame="absolute")
            seen = respond(Robot("driven_wrist"), numbers, drive, times, (port,)).samples[:, 0]
            hand = -REACH * drive.joints[0].at(times)[:, 2]
            hand, seen = (one + NOISE * rng.standard_normal(len(times)) for one in (hand, seen))
            yield Case(holder, motion, hand, seen, RATE)


def _measured(folder: Path, inputs: dict[str, str]) -> Iterator[Case]:
    from ..identification.one_clock import together
    from ..identification.records import read_record
    from ..model.door import fault

    sidecars = sorted(folder.glob("*.toml"))
    if not sidecars:
        what = "none in it" if folder.is_dir() else "no folder of that name"
        raise fault(folder, "--data", "a folder with sidecars of records", what, "name another")
    for path in sidecars:
        record = read_record(path)
        inputs |= record.files
        head, hand = _at(record, "clubhead"), _at(record, "hand")
        both = together(path, (head, hand), {hand.name: head.name})
        yield Case(
            record.name, record.description or "–", both.values[:, 1], both.values[:, 0],
            both.rate, APART if both.is_found else 0.0, both.words,
        )  # fmt: skip


def _at(record: Record, place: str) -> Channel:
    from ..model.door import fault

    found = [
        one for one in record.channels if one.place == place and one.quantity == "acceleration"
    ]
    if len(found) != 1:
        expected = f"one acceleration at place '{place}'"
        mend = "map the hand's and the head's accelerometer"
        raise fault(record.path, "[channels]", expected, f"{len(found)}", mend)
    return found[0]


def _row(case: Case, found: Hold) -> dict[str, Any]:
    def finite(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "hold": case.holder,
        "motion": case.motion,
        "status": found.status,
        "sentence": found.sentence,
        "gain": {"value": found.gain, "std": found.gain_std, "unit": "1"},
        "frequency": finite(found.frequency),
        "damping_ratio": {"value": found.ratio, "low": found.ratio_low,
                          "high": finite(found.ratio_high), "unit": "1"},
        "cycles": found.cycles,
        "explained_by_hand": found.explained,
        "left_rigid": found.left,
        "left_flexible": found.noise,
        "read": [*case.words, *([LATE.format(1e3 * found.late)] if case.apart else [])],
        "warnings": [found.weight] if found.weight else [],
    }  # fmt: skip


LATE = "With the hold's own lag taken for such, the hand's clock moved by another {:.1f} ms."


def _said(result: Mapping[str, Any]) -> list[str]:
    """What was done to a record, and what is in doubt of it."""
    return [
        f"{sign}{row['hold']}, {row['motion']}: {text}"
        for row in result["rows"]
        for sign, key in (("", "read"), ("! ", "warnings"))
        for text in row[key]
    ]


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    ratio = row["damping_ratio"]
    value, low = (number_words(ratio[name], 2) for name in ("value", "low"))
    high = "–" if ratio["high"] is None else number_words(ratio["high"], 2)
    return (
        row["hold"], row["motion"], ANSWERS[row["status"]],
        "–" if row["frequency"] is None else f"{row['frequency']:.2f}",
        f"{value} [{low}, {high}]", f"{row['cycles']:.1f}",
        f"{100 * row['explained_by_hand']:.0f} %",
    )  # fmt: skip


def as_text(result: Mapping[str, Any]) -> str:
    """The table and its notes as Markdown."""
    table = markdown(HEADINGS, [_cells(row) for row in result["rows"]])
    below = [f"![{result['question']}]({result['figure']})", ""]
    below += [f"- {line}" for line in (*_said(result), *result["notes"])]
    return "\n".join([f"# {result['question']}", "", *table, "", *below]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the table and its notes."""
    rows = [_cells(row) for row in result["rows"]]
    lines = [f"  - {line}" for line in (*_said(result), *result["notes"])]
    printed(result["question"], HEADINGS, rows, lines)


STUDY = Study(NAME, QUESTION, run, show)
