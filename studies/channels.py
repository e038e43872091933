"""What do a swing's gauges say of the swing plane? Records beside the profile of the same swing."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .answer import answered
from .engine import start_engine
from .listing import markdown, printed
from .study import Call, Study
from .swing_read import NEEDED, before_blow, read_swing, stated_errors
from .words import number_words

if TYPE_CHECKING:
    from ..identification.records import Record
    from ..identification.resolve import Relative
    from ..identification.swing_channels import SwingChannels
    from ..optimize.profile import SwingProfile
    from .swing_read import SwingRead
    from .thesis.draw import Panel

NAME = "channels"
QUESTION = "What do the gauges of a swing say of the swing plane?"
HEADINGS = ("what", "number")
COLUMNS = (
    "time,acceleration,acceleration_std,deflection,deflection_std,relative,relative_std,"
    "relative_by_drive"
)
NOTES = (
    "Accelerations by eq. 42, strains by eq. 43; profile and gauges meet at the impact. Each gauge "
    "is read by its own clock, filtered at its own rate and splined at the profile's points; "
    "beyond its record cells are empty.",
    "Strain is 0.024 for a metre unless the sidecar has readings: [channels.NAME.calibration] with "
    "deflection = [...] and reading = [...].",
    "Errors: noise, calibrations, the grip's angle and the clocks; of head less collet by draws of "
    "these, with the wrist's constants and the profile's arm and wrist taken for exact.",
    "Head less collet: less the motion of a wrist that yields, by the record's rig or else by 300 "
    "N m/rad and 15 N m s/rad (line 1801); beside it less that of its drive alone, as the thesis "
    "has it. Both up to 10 ms before impact.",
    "FFT: all lines above the cut-off set to zero. Zero phase: Butterworth forth and back.",
)


def run(call: Call) -> dict[str, Any]:
    """Resolve every record of a folder with the ``profile.pod`` in it.

    Args:
        call: who asks; ``data`` is a folder with ``profile.pod`` and sidecars whose channels are
            named as in `NEEDED`, each with a file and clock of its own if need be; ``seed`` draws
            the errors behind the standard deviation of head less collet.

    Returns:
        Numbers a swing, notes and provenance.

    Raises:
        ValueError: in the words of the door.
    """
    start_engine()
    began, inputs = time.perf_counter(), dict[str, str]()
    profile, stated, records = _inputs(call.data, inputs)
    swings, panels, tables = [], [], {}
    for record in records:
        call.progress(record.name)
        swing = read_swing(record, profile, stated, call.seed)
        swings.append(_numbers(swing))
        panels += _panels(record, swing.found, swing.relative)
        tables[f"{record.name}.csv"] = _csv(swing.found, swing.relative)
    call.progress("")
    found = {"swings": swings, "notes": list(NOTES)}
    return answered(call, NAME, QUESTION, found, as_text, panels, inputs, began, tables)


def _inputs(
    folder: Path | None, inputs: dict[str, str]
) -> tuple[SwingProfile, dict[str, float], list[Record]]:
    from ..identification.records import read_record
    from ..model.door import fault, one_of, sha256_of
    from ..optimize.profile import POD, read_pod

    expected = f"a folder with {POD} and sidecars of records"
    if folder is None or not (folder / POD).is_file():
        mend = f"name it; `supple profile` makes {POD} of the swing's markers"
        raise fault(folder or "study", "--data", expected, f"no {POD}", mend)
    profile = read_pod(folder / POD)
    inputs[str(folder / POD)] = sha256_of((folder / POD).read_bytes())
    sidecars = [path for path in sorted(folder.glob("*.toml")) if path.name != "rig.toml"]
    records = [read_record(path) for path in sidecars]
    if not records:
        raise fault(folder, "--data", expected, "no sidecar", "write one for the record")
    for record in records:
        inputs |= record.files
        missing = [name for name in NEEDED if name not in {one.name for one in record.channels}]
        if missing:
            listed = one_of(one.name for one in record.channels)
            mend = f"name the channels {one_of(NEEDED)}"
            raise fault(record.path, "[channels]", one_of(missing), listed, mend)
    return profile, stated_errors(folder, inputs), records


def _numbers(swing: SwingRead) -> dict[str, Any]:
    from ..identification.shaft_type import shaft_type

    found, relative = swing.found, swing.relative
    known, before = found.is_known, before_blow(found)
    points, bent = found.points[known], found.deflection.in_plane[known]
    impact = float(found.shift.ours(np.array([found.impact.time]))[0])
    kind = shaft_type(points, -bent, impact)
    off = relative.values - relative.by_drive
    filters = [
        {name: getattr(one, name)
         for name in ("cutoff", "rms", "rms_at_ends", "largest", "at", "ringing", "removed")}
        for one in found.filters
    ]  # fmt: skip
    return {
        "name": swing.name,
        "status": found.status,
        "impact": {"value": found.impact.time, "std": found.impact.std, "unit": "s"},
        "leap": {"value": found.impact.leap, "threshold": found.impact.threshold, "unit": "m/s^2"},
        "offset": {"value": found.shift.offset, "std": found.shift.offset_std, "unit": "s"},
        "points": {"all": len(known), "known": int(known.sum())},
        "filters": filters,
        "largest_acceleration": _largest(found.acceleration.in_plane[before]),
        "largest_deflection": _largest(found.deflection.in_plane[before]),
        "largest_deflection_std": _at_largest(
            found.deflection.in_plane, found.errors.deflection_std, before
        ),
        "largest_acceleration_std": _at_largest(
            found.acceleration.in_plane, found.errors.acceleration_std, before
        ),
        "calibration_std": float(np.max(found.calibration_std[before])),
        "calibrations": list(swing.calibrations),
        "clocks": list(swing.clocks),
        "profile_std": dict(swing.profile_std),
        "out_of_plane": _largest(found.acceleration.out_of_plane[before]),
        "relative": {"rms": float(np.sqrt(np.mean(relative.values**2))),
                     "std_rms": float(np.sqrt(np.mean(relative.std**2))), "unit": "m/s^2"},
        "yielding": {"rms": float(np.sqrt(np.mean(off**2))), "unit": "m/s^2",
                     "twist": _largest(relative.twist)},
        "loading": {"name": kind.name, "status": kind.status, "holder": kind.holder,
                    "sentence": kind.sentence},
        "read": list(swing.words),
        "warnings": [*found.warnings, *swing.warnings],
    }  # fmt: skip


def _at_largest(values: np.ndarray, stds: np.ndarray, before: np.ndarray) -> float:
    return float(stds[before][np.argmax(np.abs(values[before]))])


def _largest(values: np.ndarray) -> float:
    return float(np.max(np.abs(values)))


def _panels(record: Record, found: SwingChannels, relative: Relative) -> list[Panel]:
    from .thesis.draw import Curve, Panel

    strain = found.clocks[3]
    own = strain.start + np.arange(len(found.filters[0].by_fft)) / strain.rate
    clock = found.shift.ours(own)
    known, name, axis = before_blow(found), record.name, "time on the profile's clock [s]"
    points = found.points[known]
    panels = []
    for one in found.filters:
        curves = (
            Curve(clock, 1e3 * one.zero_phase, "zero phase"),
            Curve(clock, 1e3 * one.by_fft, "FFT"),
            Curve(clock, 1e3 * (one.by_fft - one.zero_phase), "difference"),
        )
        panels.append(
            Panel(f"{name}: lead/lag, {one.cutoff:g} Hz", axis, "deflection [mm]", curves)
        )
    felt = (Curve(points, found.acceleration.in_plane[known], "in the swing plane"),
            Curve(points, found.acceleration.out_of_plane[known], "across it"))  # fmt: skip
    carried = (Curve(points, relative.values, "less a yielding wrist"),
               Curve(points, relative.by_drive, "less its drive"),
               Curve(points, relative.std, "standard deviation"))  # fmt: skip
    panels.append(Panel(f"{name}: head, up to impact", axis, "acceleration [m/s²]", felt))
    panels.append(
        Panel(f"{name}: head less collet, up to impact", axis, "acceleration [m/s²]", carried)
    )
    return panels


def _csv(found: SwingChannels, relative: Relative) -> str:
    known = np.flatnonzero(before_blow(found))
    own = np.full((len(found.points), 3), np.nan)
    own[known] = np.stack([relative.values, relative.std, relative.by_drive], axis=1)
    columns = np.column_stack([
        found.points, found.acceleration.in_plane, found.errors.acceleration_std,
        found.deflection.in_plane, found.errors.deflection_std, own,
    ])  # fmt: skip
    rows = [",".join("" if math.isnan(cell) else f"{cell:.9g}" for cell in row) for row in columns]
    return "\n".join([COLUMNS, *rows]) + "\n"


def _rows(result: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [
        (f"{one['name']}: {what}", text) for one in result["swings"] for what, text in _told(one)
    ]


def _told(one: Mapping[str, Any]) -> list[tuple[str, str]]:
    impact, offset, points, shown = one["impact"], one["offset"], one["points"], number_words
    bent, error = (1e3 * one[name] for name in ("largest_deflection", "largest_deflection_std"))
    felt, own = (one["largest_acceleration"], one["largest_acceleration_std"])
    twist = math.degrees(one["yielding"]["twist"])
    rows = [
        ("impact on the gauges' clock", f"{impact['value']:.5f} ± {impact['std']:.5f} s"),
        ("that clock begins at", f"{offset['value']:.5f} ± {offset['std']:.5f} s"),
        ("points with a record", f"{points['known']} of {points['all']}"),
        (
            "largest acceleration",
            f"{shown(felt, 3)} ± {shown(own, 2)} m/s² before impact",
        ),
        ("largest deflection", f"{bent:.1f} ± {error:.1f} mm before impact"),
        (
            "head less collet",
            f"{shown(one['relative']['rms'], 3)} m/s² RMS, uncertain by "
            f"{shown(one['relative']['std_rms'], 2)} m/s²",
        ),
        (
            "what the drive alone misses",
            f"{shown(one['yielding']['rms'], 3)} m/s² RMS; the wrist yields by {twist:.1f} degrees",
        ),
        ("loading", one["loading"]["sentence"]),
    ]
    for each in one["filters"]:
        rms, ends, most = (1e3 * each[name] for name in ("rms", "rms_at_ends", "largest"))
        text = f"{rms:.2f} mm RMS, {ends:.2f} mm at the ends, {most:.2f} mm at most"
        rows.append((f"FFT against zero phase, {each['cutoff']:g} Hz", text))
    rows += [("read", text) for text in one["read"]]
    return rows + [("!", text) for text in one["warnings"]]


def as_text(result: Mapping[str, Any]) -> str:
    """The numbers and notes as Markdown."""
    below = [f"![{result['question']}]({result['figure']})", ""]
    below += [f"- {line}" for line in result["notes"]]
    table = markdown(HEADINGS, _rows(result))
    return "\n".join([f"# {result['question']}", "", *table, "", *below]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the numbers and notes."""
    printed(
        result["question"], HEADINGS, _rows(result), [f"  - {line}" for line in result["notes"]]
    )


STUDY = Study(NAME, QUESTION, run, show)
