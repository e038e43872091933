"""What the diagnosis says of measured full swings, and what it leaves unexplained."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..study import Call
from .runs import FINAL_WRIST, TABLE_4
from .table import Listed, Row, claim

if TYPE_CHECKING:
    from ...identification.views import RecordView
    from .measured_swings import MeasuredSwing

BENCH = "The swings are those of an independent bench, not the thesis's golfers'."
"""Why agreement on them counts in part only [-]."""

LACKING = ("base_acceleration", "centrifugal_stiffening", "gravity")
"""What the planar model has and the thesis's lacks, by the names of laws [-]."""

SPREAD = 0.2, 0.3
"""Standard deviations of the wrist's stiffness and damping, of their best values [1]."""

ENOUGH = 0.9
"""Share of the misfit beyond noise that causes must explain to count as found [-]."""


@dataclass(frozen=True)
class Verdict:
    """What the diagnosis says.

    Attributes:
        result: as ``diagnosis.json``; empty where it refuses.
        refused: in the words of the door; empty where it does not.
        trained: records that were fitted.
        held: records that were held out.
        files: the records, by name.
        views: every channel with what was simulated before and after; none where it refuses.
    """

    result: Mapping[str, Any]
    refused: str
    trained: tuple[str, ...]
    held: tuple[str, ...]
    files: Mapping[str, str]
    views: tuple[RecordView, ...] = ()

    @property
    def causes(self) -> list[Mapping[str, Any]]:
        """Causes that it names or, where it is not sure of them all, guesses, in order."""
        return [*self.result["causes"], *self.result.get("best_guess", ())] if self.result else []

    @property
    def explained(self) -> float:
        """Share of the misfit beyond noise that the named causes take away [-]."""
        if not self.result:
            return 0.0
        before, after = (self.result["misfit"][k]["reduced_chi2"] for k in ("before", "after"))
        return 1.0 - max(after - 1.0, 0.0) / max(before - 1.0, 1e-12)

    def told(self) -> dict[str, Any]:
        """As JSON holds it."""
        records = {"fitted": list(self.trained), "held_out": list(self.held)}
        if self.refused:
            return {"refused": self.refused, "records": records}
        keys = (
            *("status", "sentence", "why", "causes", "best_guess", "candidates", "misfit", "gain"),
            *("history", "cannot_tell", "parameters", "nuisances"),
        )
        kept = {key: self.result[key] for key in keys if key in self.result}
        return kept | {"explained": self.explained, "records": records, "asked_of": list(LACKING)}

    def row(self) -> Row:
        """Whether it names what the thesis's model lacks."""
        if self.refused:
            found, holds = f"refused: {self.refused}", False
        else:
            named = [cause["law"] for cause in self.result["causes"]]
            holds = bool(named) and set(named) <= set(LACKING) and self.explained > ENOUGH
            found = f"{self.result['status']}: {self.result['sentence']}"
        why = "What else it names stands in for a club that is no lumped one."
        return claim(
            "diagnosis", "the diagnosis names what the thesis's model lacks in full swings",
            found, holds, "lines 1949, 1955; A6, A8", limit=BENCH, why=why,
            definition="the same records, fidelity thesis; names only "
            f"{', '.join(LACKING)} and explains {100 * ENOUGH:.0f} % of the misfit beyond noise",
        )  # fmt: skip

    def tables(self) -> tuple[Listed, ...]:
        """What each cause explains, one a row, in the words of the diagnosis."""
        if self.refused:
            return (Listed("Diagnosis", ("status",), (("refused",),), (self.refused,)),)
        steps = [(_name(one), one["reduced_chi2"]) for one in self.result["history"]]
        first = steps[0][1] - 1.0
        rows, last = [], steps[0][1]
        for name, size in steps:
            share = (last - size) / first
            rows.append((name, f"{size:.3g}", "–" if name == _NONE else f"{100 * share:.0f} %"))
            last = size
        gain = self.result["gain"]
        words = [self.result["sentence"], *self.result["why"]]
        if gain.get("records"):
            words.append(
                f"Held out ({', '.join(gain['records'])}): error "
                f"{100 * gain['nrmse_before']:.0f} % before, {100 * gain['nrmse_after']:.0f} % "
                f"after, noise {100 * gain['noise_floor']:.1f} %."
            )
        head = ("with the cause", "misfit over noise", "it explains")
        title = f"Diagnosis of the same records: {self.result['status']}"
        return (Listed(title, head, tuple(rows), tuple(words)),)


_NONE = "none"


def _name(step: Mapping[str, Any]) -> str:
    return f"{step['place']}/{step['law']}" if step.get("law") else _NONE


def asked(swings: Sequence[MeasuredSwing], call: Call) -> Verdict:
    """Lets the public diagnosis judge the thesis's model by the measured swings.

    Args:
        swings: as measured; the last third of them is held out.
        call: who asks.

    Returns:
        What it says; a refusal is an answer too.
    """
    from ..diagnosis import diagnosed, diagnosis_views
    from ..engine import read_inputs
    from .measured_swings import record_files

    texts: dict[str, str] = {"rig.toml": rig_text(swings[0])}
    for swing in swings:
        texts |= record_files(swing)
    names = [swing.name for swing in swings]
    kept = len(names) // 3
    trained, held = tuple(names[: len(names) - kept]), tuple(names[len(names) - kept :])
    with tempfile.TemporaryDirectory() as folder:
        for name, text in texts.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        paths = [[Path(folder) / f"{name}.toml" for name in part] for part in (trained, held)]
        try:
            inputs = read_inputs(paths[0], None, paths[1])
            result, found = diagnosed(inputs, call.seed, call.progress)
        except ValueError as fault:
            return Verdict({}, str(fault).replace(folder, "."), trained, held, texts)
    plain = json.loads(json.dumps(result).replace(folder, "."))
    return Verdict(plain, "", trained, held, texts, tuple(diagnosis_views(found)))


def rig_text(swing: MeasuredSwing) -> str:
    """The thesis's driven arm with its best wrist, known within `SPREAD`."""
    from ...model.door import toml_text

    numbers: dict[str, Any] = {
        "club_length": swing.club_length,
        "sleeve_stiffness": TABLE_4[50][0],
        "sleeve_damping": TABLE_4[50][1],
    }
    names = ("wrist_stiffness", "wrist_damping")
    for name, value, spread in zip(names, FINAL_WRIST, SPREAD, strict=True):
        numbers[name] = {"value": value, "std": spread * value}
    head = {"kind": "robot", "model": "driven_arm", "fidelity": "thesis", "preset": "robo_v"}
    return toml_text({"rig": head, "parameters": numbers})
