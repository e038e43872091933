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
from .words import number_words

if TYPE_CHECKING:
    from ..identification.records import Record
    from ..identification.resolve import Carrier, Relative
    from ..identification.swing_channels import SwingChannels
    from ..optimize.profile import SwingProfile
    from .thesis.draw import Panel

NAME = "channels"
QUESTION = "What do the gauges of a swing say of the swing plane?"
HEADINGS = ("what", "number")
NEEDED = ("toe", "lead", "toe_strain", "lead_strain")
"""Channels of a record: two accelerations at the head [m/s^2] and two strains of the shaft [1]."""

PRESET = "robo_v_sleeve_50"

SLOPE = 1.5
"""Turn of the end of a bar clamped at the other, times its length, for its deflection [-]."""

CLEAR = 0.010
"""How long before impact the collet's motion is taken off: resampling spreads the blow [s]."""

COLUMNS = "time,acceleration,acceleration_std,deflection,deflection_std,relative,relative_by_drive"
NOTES = (
    "Accelerations by eq. 42, strains by eq. 43, 0.024 of strain for a metre; the clocks meet at "
    "the impact. Beyond the record cells are empty.",
    "Head less collet: less the motion of a wrist that yields, by the record's rig or else by 300 "
    "N m/rad and 15 N m s/rad (line 1801); beside it less that of its drive alone, as the thesis "
    "has it. Both up to 10 ms before impact.",
    "FFT: all lines above the cut-off set to zero. Zero phase: Butterworth forth and back.",
)


def run(call: Call) -> dict[str, Any]:
    """Resolve every record of a folder with the ``profile.pod`` in it.

    Args:
        call: who asks; ``data`` is a folder with ``profile.pod`` and sidecars whose channels are
            named as in `NEEDED`. Nothing is drawn by chance.

    Returns:
        Numbers a swing, notes and provenance.

    Raises:
        ValueError: in the words of the door.
    """
    start_engine()
    began, inputs = time.perf_counter(), dict[str, str]()
    profile, records = _inputs(call.data, inputs)
    swings, panels, tables = [], [], {}
    for record in records:
        call.progress(record.name)
        found, relative = resolved(record, profile)
        swings.append(_numbers(record, found, relative))
        panels += _panels(record, found, relative)
        tables[f"{record.name}.csv"] = _csv(found, relative)
    call.progress("")
    found = {"swings": swings, "notes": list(NOTES)}
    return answered(call, NAME, QUESTION, found, as_text, panels, inputs, began, tables)


def _inputs(folder: Path | None, inputs: dict[str, str]) -> tuple[SwingProfile, list[Record]]:
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
    return profile, records


def resolved(record: Record, profile: SwingProfile) -> tuple[SwingChannels, Relative]:
    """The gauges of a swing on the points of its profile, in the swing plane.

    Args:
        record: with the channels of `NEEDED` [SI].
        profile: of the same swing [s, rad].

    Returns:
        Its channels [m/s^2, m], and the head's acceleration less the collet's up to the blow.

    Raises:
        ValueError: where no impact is found.
    """
    from ..identification.lowpass import STRAIN_CUTOFFS
    from ..identification.resolve import relative_acceleration
    from ..identification.strain import STRAIN_PER_METER, Calibration
    from ..identification.swing_channels import Gauges, GripTurn, swing_channels

    channels = [record.channel(name) for name in NEEDED]
    toe, lead, *strains = channels
    gauges = Gauges(record.sample_rate, *(one.values for one in channels),
                    noise=(toe.noise or 0.0, lead.noise or 0.0))  # fmt: skip
    first, second = (Calibration(gain_std=STRAIN_PER_METER * one.tolerance.get("gain", 0.0))
                     for one in strains)  # fmt: skip
    turn = GripTurn(profile.time, profile.angles[:, 2], profile.impact_time)
    try:
        found = swing_channels(gauges, turn, (first, second))
    except ValueError as error:
        raise ValueError(f"{record.path}: {error}") from None
    known = _before(found)
    angles = profile.angles[known]
    relative = relative_acceleration(
        profile.time[known], found.acceleration.in_plane[known], angles[:, 0], angles[:, 1],
        _carrier(record), found.deflection.in_plane[known], STRAIN_CUTOFFS[0],
    )  # fmt: skip
    return found, relative


def _carrier(record: Record) -> Carrier:
    """Lengths and masses by the record's rig, or by the preset with the thesis's final wrist."""
    from ..identification.resolve import Carrier
    from ..model.rig import read_rig
    from ..model.robot import PRESETS
    from .thesis.runs import FINAL_WRIST

    p = PRESETS[PRESET] | dict(zip(("wrist_stiffness", "wrist_damping"), FINAL_WRIST, strict=True))
    if record.rig_path is not None:
        rig = read_rig(record.rig_path)
        p = p | {name: one.value for name, one in rig.parameters.items()}
    p = p | record.parameters
    grip = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    shaft = p["club_length"] - p["grip_length"] / 2
    return Carrier(
        grip + shaft,
        p["arm_length"],
        p["collet_inertia"] + p["grip_inertia"] + p["grip_mass"] * grip**2,
        p["collet_mass"] * p["collet_centre"] + p["grip_mass"] * grip,
        p["clubhead_mass"],
        p["wrist_stiffness"],
        p["wrist_damping"],
        SLOPE / shaft,
    )


def _before(found: SwingChannels) -> np.ndarray:
    """Points with a record that lie clear of the blow."""
    impact = found.shift.ours(np.array([found.impact.time]))[0]
    return found.is_known & (found.points < impact - CLEAR)


def _numbers(record: Record, found: SwingChannels, relative: Relative) -> dict[str, Any]:
    from ..identification.shaft_type import shaft_type

    known, before = found.is_known, _before(found)
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
        "name": record.name,
        "status": found.status,
        "impact": {"value": found.impact.time, "std": found.impact.std, "unit": "s"},
        "leap": {"value": found.impact.leap, "threshold": found.impact.threshold, "unit": "m/s^2"},
        "offset": {"value": found.shift.offset, "std": found.shift.offset_std, "unit": "s"},
        "points": {"all": len(known), "known": int(known.sum())},
        "filters": filters,
        "largest_acceleration": _largest(found.acceleration.in_plane[before]),
        "largest_deflection": _largest(found.deflection.in_plane[before]),
        "calibration_std": float(np.max(found.calibration_std[before])),
        "out_of_plane": _largest(found.acceleration.out_of_plane[before]),
        "yielding": {"rms": float(np.sqrt(np.mean(off**2))), "unit": "m/s^2",
                     "twist": _largest(relative.twist)},
        "loading": {"name": kind.name, "status": kind.status, "sentence": kind.sentence},
        "warnings": list(found.warnings),
    }  # fmt: skip


def _largest(values: np.ndarray) -> float:
    return float(np.max(np.abs(values)))


def _panels(record: Record, found: SwingChannels, relative: Relative) -> list[Panel]:
    from .thesis.draw import Curve, Panel

    clock = found.shift.ours(np.arange(len(found.filters[0].by_fft)) / record.sample_rate)
    known, name, axis = _before(found), record.name, "time on the profile's clock [s]"
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
    own = (Curve(points, relative.values, "less a yielding wrist"),
           Curve(points, relative.by_drive, "less its drive"))  # fmt: skip
    panels.append(Panel(f"{name}: head, up to impact", axis, "acceleration [m/s²]", felt))
    panels.append(
        Panel(f"{name}: head less collet, up to impact", axis, "acceleration [m/s²]", own)
    )
    return panels


def _csv(found: SwingChannels, relative: Relative) -> str:
    known = np.flatnonzero(_before(found))
    own = np.full((len(found.points), 2), np.nan)
    own[known] = np.stack([relative.values, relative.by_drive], axis=1)
    columns = np.column_stack([
        found.points, found.acceleration.in_plane, found.acceleration.std,
        found.deflection.in_plane, found.calibration_std, own,
    ])  # fmt: skip
    rows = [",".join("" if math.isnan(cell) else f"{cell:.9g}" for cell in row) for row in columns]
    return "\n".join([COLUMNS, *rows]) + "\n"


def _rows(result: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [
        (f"{one['name']}: {what}", text) for one in result["swings"] for what, text in _told(one)
    ]


def _told(one: Mapping[str, Any]) -> list[tuple[str, str]]:
    impact, offset, points, shown = one["impact"], one["offset"], one["points"], number_words
    bent, error = (1e3 * one[name] for name in ("largest_deflection", "calibration_std"))
    twist = math.degrees(one["yielding"]["twist"])
    rows = [
        ("impact on the gauges' clock", f"{impact['value']:.5f} ± {impact['std']:.5f} s"),
        ("that clock begins at", f"{offset['value']:.5f} ± {offset['std']:.5f} s"),
        ("points with a record", f"{points['known']} of {points['all']}"),
        ("largest acceleration", f"{shown(one['largest_acceleration'], 3)} m/s² before impact"),
        ("largest deflection", f"{bent:.1f} ± {error:.1f} mm before impact"),
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
