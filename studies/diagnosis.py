"""What the simulation gets wrong, where, why, and what is gained by mending it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import Inputs, Progress, read_inputs, write_together

if TYPE_CHECKING:
    from ..identification.finding import Diagnosis
    from ..identification.views import RecordView
    from ..model.rig import Rig


def diagnose_records(
    paths: Sequence[Path],
    rig: Path | None = None,
    held_out: Sequence[Path] = (),
    out: Path | None = None,
    seed: int = 0,
    progress: Progress = lambda text: None,
) -> tuple[dict[str, Any], bool]:
    """Diagnose records: read, fit, show the misfit, name the law, extend, measure the gain.

    Args:
        paths: sidecars.
        rig: a rig that overrides the sidecars'.
        held_out: sidecars of records never to be fitted.
        out: folder for diagnosis.json, rig.toml (extended) and report.html.
        seed: kept in the provenance; nothing here is drawn by chance.
        progress: told what is being done.

    Returns:
        The contract's ``diagnosis.json`` and whether it is to be trusted.

    Raises:
        ValueError: in the words of the door.
    """
    inputs = read_inputs(paths, rig, held_out)
    result, found = diagnosed(inputs, seed, progress)
    write_diagnosis(result, found, inputs, out)
    return result, found.final.converged


def diagnosed(
    inputs: Inputs,
    seed: int,
    progress: Progress = lambda text: None,
    left_out: Collection[str] = (),
) -> tuple[dict[str, Any], Diagnosis]:
    """Diagnose what was read: the contract's ``diagnosis.json``, and what stands behind it [SI].

    Raises:
        ValueError: in the words of the door.
    """
    from ..identification.diagnose import diagnose
    from ..identification.verdict import diagnosis_json

    found = diagnose(inputs.records, inputs.rig, inputs.held_out, progress, left_out)
    progress("")
    return diagnosis_json(found, inputs.provenance(seed)), found


def write_diagnosis(
    result: Mapping[str, Any], found: Diagnosis, inputs: Inputs, out: Path | None
) -> None:
    """Write diagnosis.json, the extended rig and the report together."""
    from ..model.door import write_beside
    from ..model.rig import write_rig

    def report(path: Path) -> None:
        from .report import write_report

        write_report(result, diagnosis_views(found), path)

    def table(path: Path) -> None:
        import json

        text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False)
        write_beside(path, text + "\n")

    write_together(
        out,
        {
            "diagnosis.json": table,
            "rig.toml": lambda path: write_rig(extended_rig(found, inputs.rig), path),
            "report.html": report,
        },
    )


def diagnosis_views(found: Diagnosis) -> list[RecordView]:
    """Views of all records, fitted and held out, at the place of the first cause."""
    from ..identification.views import record_views

    trials = found.accepted or found.trials
    place = trials[0].candidate.place if trials else ""
    views = record_views(found.base, found.final, place, "train")
    if found.held_before is not None and found.held_after is not None:
        noise = found.held_after.noise
        held = record_views(found.held_before.fit, found.held_after.fit, place, "held_out")
        views += [replace(view, noise_std=noise[view.record, view.channel]) for view in held]
    return views


def extended_rig(found: Diagnosis, rig: Rig) -> Rig:
    """The rig with fitted constants and, as tables of laws, the accepted causes [SI]."""
    fit = found.final
    values = {e.keys[0]: fit.value(i) for i, e in enumerate(fit.model.entries) if not e.record}
    numbers = {
        name: number.at(values[name]) if name in values and number.varies else number
        for name, number in fit.problem.rig.parameters.items()
    }
    laws = []
    for trial in found.accepted:
        candidate = trial.candidate
        index = fit.index(candidate.entry.label)
        strength = {"value": fit.value(index), "std": fit.std(index)}
        shapes = {
            shape.keys[-1]: {
                "value": fit.value(fit.index(shape.label)),
                "std": fit.std(fit.index(shape.label)),
            }
            for shape in candidate.shapes
        }
        turns = candidate.place in fit.problem.mechanism.law_places()
        turns = turns and fit.problem.mechanism.turns(candidate.place)
        rounding = fit.problem.widths.get(candidate.place, ())
        widths = dict(zip(("stretch_width", "rate_width"), rounding, strict=False))
        laws.append(
            {
                "law": candidate.law.name,
                "place": candidate.place,
                "parameters": {candidate.law.symbol_at(turns): strength, **shapes, **widths},
            }
        )
    return replace(rig, parameters=numbers, laws=(*rig.laws, *laws))


def show_diagnosis(result: Mapping[str, Any]) -> None:
    """Print the verdict on one screen."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    console.print(f"{result['status'].upper()}: {result['sentence']}")
    for line in result["why"]:
        console.print(f"  - {line}")
    gain = result["gain"]
    if gain.get("records"):
        console.print(
            f"Held out ({', '.join(gain['records'])}): error {100 * gain['nrmse_before']:.3g} % -> "
            f"{100 * gain['nrmse_after']:.3g} % of the signal (noise "
            f"{100 * gain['noise_floor']:.2g} %)."
        )
    else:
        console.print(f"No held-out gain: {gain['how']}.")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("constant", "before", "after", "± std", "unit"):
        table.add_column(heading, justify="left" if heading in ("constant", "unit") else "right")
    for name, one in result["parameters"].items():
        table.add_row(
            name, f"{one['before']:.5g}", f"{one['after']:.5g}", f"{one['std']:.2g}", one["unit"]
        )
    console.print(table)
    console.print(f"Next: {result['what_next']}")
