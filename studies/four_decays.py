"""What four decays of a club tell together that none tells alone: shaft and sleeves apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import Answer, finding, show
from .study import Call, Study
from .words import number_words, pair_words

if TYPE_CHECKING:
    from ..identification.fit import Fit

NAME = "four_decays"
QUESTION = (
    "What do decays of one club, clamped and in three sleeves, tell together that none tells alone?"
)
FOLDER = Path(__file__).resolve().parent / "data" / "decays"
MADE_WITH: Mapping[str, float] = {
    "shaft_stiffness": 143.6,
    "shaft_damping": 0.0742,
    "sleeve_stiffness[sleeve_00]": 172e3,
    "sleeve_stiffness[sleeve_25]": 120e3,
    "sleeve_stiffness[sleeve_50]": 60e3,
    "sleeve_damping[sleeve_00]": 950.0,
    "sleeve_damping[sleeve_25]": 3010.0,
    "sleeve_damping[sleeve_50]": 1470.0,
}
"""Constants of the bundled decays [SI], which an independent bench of lumped bodies made: the
thesis's three sleeves as the modes that it measured ask for them."""

HEADINGS = ("constant", "unit", "together", "made with", "alone", "alone it is")


def fits(folder: Path) -> tuple[Fit, dict[str, Fit]]:
    """All decays of a folder fitted together, and each alone by its name."""
    from ..identification.base import fit_base
    from ..identification.problem import make_problem
    from ..identification.records import read_record
    from ..identification.weighing import with_laws
    from ..model.rig import read_rig

    rig = read_rig(folder / "rig.toml")
    paths = sorted(path for path in folder.glob("*.toml") if path.name != "rig.toml")
    records = [read_record(path) for path in paths]

    def fitted(some: Sequence[Any]) -> Fit:
        return with_laws(fit_base(make_problem(some, rig)))

    return fitted(records), {record.name: fitted([record]) for record in records}


def find(call: Call) -> Answer:
    """The constants of all decays together beside those of each alone.

    Args:
        call: who asks; its data are a folder of decays with their rig.toml.

    Returns:
        The answer [SI].
    """
    from ..identification.constants import fit_json

    folder = FOLDER if call.data is None else call.data
    if not (folder / "rig.toml").is_file():
        raise ValueError(
            f"{folder}: --data: expected decays with their rig.toml, found no rig.toml. "
            "Mend: name their folder."
        )
    call.progress("fitting decays, together and alone")
    joint, single = fits(folder)
    together = fit_json(joint, {})["parameters"]
    alone = {name: fit_json(fit, {})["parameters"] for name, fit in single.items()}
    rows = []
    for label, one in together.items():
        own = {name: told[label] for name, told in alone.items() if label in told}
        made = MADE_WITH.get(label) if folder == FOLDER else None
        rows.append({"constant": label, **one, "made_with": made, "alone": own})
    more = {
        "status": joint.status,
        "misfit": {f"{r}:{c}": m.p_value for (r, c), m in joint.misfits.items()},
    }
    notes = (
        "Alone: in the order of the decays' names. "
        "Shaft constants are shared by all decays, each sleeve has its own; the head's mass is "
        "known to a tolerance, and stiffness and damping follow it.",
        "The bundled decays come from an independent bench of lumped bodies, 34 dB above noise of "
        "AR(1) 0.4.",
    )
    return Answer(
        HEADINGS, [_cells(row) for row in rows], rows, _sentences(rows), notes, _panels(joint), more
    )


def _sentences(rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    shaft = next(row for row in rows if row["constant"] == "shaft_stiffness")
    sleeves = [row for row in rows if row["constant"].startswith("sleeve_")]
    sure = [row for row in rows if row["identifiable"] == "yes"]
    lost = [r["constant"] for r in sleeves if any(_in_doubt(one) for one in r["alone"].values())]
    spread = [one["value"] for one in shaft["alone"].values()]
    said = [
        f"Together they tell {len(sure)} of {len(rows)} constants one by one; alone, "
        f"{len(lost)} of the {len(sleeves)} constants of sleeves are in doubt.",
        f"A decay in a sleeve is followed as well by a stiff sleeve on a soft shaft: alone the "
        f"shaft comes out between {number_words(min(spread), 3)} and "
        f"{number_words(max(spread), 3)} N/m, together at "
        f"{pair_words(shaft['value'], shaft['std'])} N/m.",
    ]
    made = [row for row in rows if row["made_with"]]
    if made:
        off = max(made, key=lambda row: abs(row["value"] / row["made_with"] - 1.0))
        share = 100.0 * abs(off["value"] / off["made_with"] - 1.0)
        inside = sum(row["low"] <= row["made_with"] <= row["high"] for row in made)
        said.append(
            f"{inside} of {len(made)} 95 % intervals hold what the decays were made with; the "
            f"farthest value, {_words(off['constant'])}, is {number_words(share, 2)} % off."
        )
    return tuple(said)


def _in_doubt(one: Mapping[str, Any]) -> bool:
    return one["identifiable"] != "yes"


def _words(label: str) -> str:
    """A label as it is spoken: ``sleeve damping, sleeve_00``."""
    name, _, record = label.rstrip("]").partition("[")
    return name.replace("_", " ") + (f", {record}" if record else "")


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    """One line a constant; where several decays tell it alone, all of them."""
    alone = row["alone"].values()
    made = "–" if row["made_with"] is None else number_words(row["made_with"], 4)
    together = pair_words(row["value"], row["std"])
    told = ", ".join(number_words(one["value"], 3) for one in alone)
    said = ", ".join(str(one["identifiable"]).replace("_", " ") for one in alone)
    return _words(row["constant"]), row["unit"], together, made, told, said


def _panels(joint: Fit) -> list[Any]:
    """Measured and simulated of every decay, its first two seconds."""
    from .thesis.draw import Curve, Panel

    panels = []
    for key in joint.keys:
        sensor = joint.sensor_of(key)
        early = sensor.times <= 2.0
        times = sensor.times[early]
        curves = (
            Curve(times, sensor.values[early], "measured"),
            Curve(times, np.asarray(joint.predicted[key])[early], "all four together"),
        )
        panels.append(Panel(key[0], "time [s]", f"{key[1]} [{sensor.channel.unit}]", curves))
    return panels


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
