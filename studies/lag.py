"""How late is the robot, and what must it be told instead? From its own feedback of a swing."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..optimize.profile import Limits
    from ..optimize.servo import Feedback, Round

CONVERGES, NEED_NOT, OVER_LIMITS = "converges", "need_not_converge", "over_limits"
"""What may become of a round."""


def lag_files(
    wanted: Path,
    feedback: Path,
    told: Path | None = None,
    limits: Path | None = None,
    corner: float | None = None,
    out: Path | None = None,
    seed: int = 0,
) -> tuple[dict[str, Any], bool]:
    """One round of taking a robot's lag out of a swing.

    Args:
        wanted: ``profile.pod`` that the axes should follow.
        feedback: what they did on the profile's clock: a table ``time, arm_angle, wrist_angle``
            and, if it turns, ``grip_angle`` [s, rad], or a record whose channels are angles of
            these places.
        told: ``profile.pod`` that the robot played; by default what is wanted, as in a first round.
        limits: a file with ``[limits]``, such as the task of the swing; by default those assumed
            of the Robo V.
        corner: frequency up to which the lag is taken out [Hz]; that of
            `supple.optimize.servo.CORNER` by default.
        out: folder for ``lag.json``, ``report.html`` and, where the round can be trusted,
            ``profile.csv`` and ``profile.pod`` to be played next.
        seed: kept in the provenance; nothing here is drawn by chance.

    Returns:
        What ``lag.json`` holds, and whether the next profile may be played.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    from ..optimize.profile import ROBO_V, excess, read_pod
    from ..optimize.servo import CORNER, correct_lag

    began = time.perf_counter()
    files: dict[str, str] = {}
    aim, played = read_pod(wanted), read_pod(wanted if told is None else told)
    _check_alike(aim, played, told)
    heard = _feedback(feedback, files)
    bounds = ROBO_V if limits is None else _limits(limits, files)
    try:
        found = correct_lag(aim, played, heard, CORNER if corner is None else corner)
    except ValueError as error:
        raise ValueError(f"{feedback}: {error}") from None
    uses = [use for use in excess(found.profile, bounds) if math.isfinite(use.limit)]
    status, sentence = _status(found, bounds)
    result = {
        "status": status,
        "sentence": sentence,
        "lags": [
            {
                "axis": one.axis,
                "delay": _told(one.delay, "s"),
                "constant": _told(one.constant, "s"),
                "left": _told(one.left, "rad"),
            }
            for one in found.lags
        ],
        "error": {
            "largest": _told(found.error, "rad"),
            "at_impact": _told(found.impact_error, "rad"),
        },
        "contraction": found.contraction,
        "worst_factor": found.worst,
        "limits": [
            {
                "axis": use.axis, "quantity": use.quantity, "ratio": use.ratio, "time": use.time,
                "value": use.value, "limit": use.limit, "unit": use.unit,
            }
            for use in uses
        ],
        "limits_stated": limits is not None,
        "provenance": _provenance((wanted, told), files, seed, began),
    }  # fmt: skip
    if out is not None:
        _write(result, found, bounds, out)
    return result, status == CONVERGES


def _told(value: float, unit: str) -> dict[str, Any]:
    return {"value": float(value), "unit": unit}


def _check_alike(aim: Any, played: Any, told: Path | None) -> None:
    """A command of another clock belongs to another swing."""
    from ..model.door import fault

    if len(aim.time) == len(played.time) and aim.time[-1] == played.time[-1]:
        return
    assert told is not None
    expected = f"{len(aim.time)} points over {aim.time[-1]:g} s, as in the profile that is wanted"
    found = f"{len(played.time)} over {played.time[-1]:g} s"
    raise fault(told, "--told", expected, found, "name what the robot played of this swing")


def _feedback(path: Path, files: dict[str, str]) -> Feedback:
    """What the robot says that its axes did, from a record or from a plain table."""
    import numpy as np

    from ..model.door import sha256_of
    from ..model.drive_file import read_profile
    from ..optimize.profile import AXES
    from ..optimize.servo import Feedback

    if path.suffix.lower() == ".toml":
        times, columns = _record(path, files)
    else:
        table = read_profile(path, ("arm_angle", "wrist_angle"))
        with path.open(encoding="utf-8-sig") as file:
            turns = "grip_angle" in file.readline()
        table |= read_profile(path, ("grip_angle",)) if turns else {}
        files[str(path)] = sha256_of(path.read_bytes())
        times = table["time"]
        columns = {axis: table[f"{axis}_angle"] for axis in AXES if f"{axis}_angle" in table}
    none = np.zeros(len(times))
    return Feedback(times, np.stack([columns.get(axis, none) for axis in AXES], axis=1))


def _record(path: Path, files: dict[str, str]) -> tuple[Any, dict[str, Any]]:
    """Times [s] and angles [rad] by axis, of a record whose channels are angles of these places."""
    from ..identification.records import read_record
    from ..model.door import fault, one_of
    from ..optimize.profile import AXES

    record = read_record(path)
    files |= record.files
    found = {one.place: one for one in record.channels if one.quantity == "angle"}
    for axis in AXES[:2]:
        if axis not in found:
            mend = f"add a channel with quantity = 'angle' and place = '{axis}'"
            raise fault(path, "[channels]", f"the angle of the {axis}", one_of(found), mend)
    clocks = {(len(one.values), one.start_time, one.sample_rate) for one in found.values()}
    if len(clocks) > 1:
        mend = "give all axes in one table"
        raise fault(path, "[channels]", "one clock for all axes", f"{len(clocks)}", mend)
    times = record.times + next(iter(found.values())).start_time
    return times, {axis: one.values for axis, one in found.items()}


def _limits(path: Path, files: dict[str, str]) -> Limits:
    """The limits of any file that has [limits]; its other tables are not looked at."""
    from ..model.door import fault, read_toml
    from ..optimize.limits_file import AxisTable, axis_limits
    from ..optimize.profile import AXES, QUANTITIES, Limits as Found

    document, files[str(path)] = read_toml(path)
    if "limits" not in document:
        raise fault(path, "[limits]", "limits of the motors", "none", "name a task that has some")
    found = {}
    for axis in AXES:
        told = document["limits"].get(axis, {})
        known = {key: value for key, value in told.items() if key in QUANTITIES}
        try:
            table = AxisTable.model_validate(known)
        except ValueError:
            mend = "write velocity = 25.0 and the like"
            raise fault(path, f"[limits.{axis}]", "numbers above 0", f"{known}", mend) from None
        found[axis] = axis_limits(table, axis, path)
    return Found(**found)


def _status(found: Round, bounds: Limits) -> tuple[str, str]:
    """Whether the next profile may be played, and what there is to say."""
    from ..optimize.profile import check_limits

    if not found.converges:
        return NEED_NOT, (
            f"{found.sentence} No next profile is written: look whether the feedback is of this "
            "swing, has its sign, and begins when the robot does."
        )
    try:
        check_limits(found.profile, bounds)
    except ValueError as error:
        told = str(error).removeprefix("swing profile: ")
        return OVER_LIMITS, f"{found.sentence} No next profile is written: {told}"
    return CONVERGES, found.sentence


def _provenance(
    profiles: tuple[Path, Path | None], files: Mapping[str, str], seed: int, began: float
) -> dict[str, Any]:
    from .. import __version__
    from ..model.door import sha256_of

    inputs = {str(one): sha256_of(one.read_bytes()) for one in profiles if one is not None}
    seconds = round(time.perf_counter() - began, 3)
    return {
        "version": __version__, "inputs": {**inputs, **files}, "seed": seed, "seconds": seconds,
    }  # fmt: skip


def _write(result: Mapping[str, Any], found: Round, bounds: Limits, out: Path) -> None:
    """All files together; no profile where it may not be played."""
    import json

    from ..optimize.profile import CSV, POD, write
    from .engine import write_together
    from .report import write_page

    page = _page(result, found)
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    writers: dict[str, Any] = {}
    if result["status"] == CONVERGES:
        writers[CSV] = lambda path: write(found.profile, path.parent, bounds)
        writers[POD] = lambda path: path  # written along with the table
    writers["lag.json"] = lambda path: path.write_text(text, encoding="utf-8")
    writers["report.html"] = lambda path: write_page(page, path)
    write_together(out, writers)


def _page(result: Mapping[str, Any], found: Round) -> dict[str, Any]:
    from .lag_figure import error_figure, factor_figure
    from .sections import _drawn, _section

    good = result["status"] == CONVERGES
    head, rows = ["axis", "delay", "first-order lag after it", "left"], _rows(result)
    off = "What is wanted less what the feedback says; the next round should leave at "
    off += f"most {100 * result['contraction']:.2g} % of its root mean square."
    factors = (
        "By what an error at a frequency is multiplied in the next round, for every frequency that "
        "the swing holds: below one it shrinks, whatever the exact law of the lag."
    )
    return {
        "title": "A robot's lag, taken out of a swing",
        "status": "adequate" if good else "refused",
        "chip": "Converges" if good else "Not to be played",
        "sentence": result["sentence"],
        "version": result["provenance"]["version"],
        "sections": [
            _section(
                "How late it is", head=head, rows=rows,
                drawn=[_drawn(error_figure(found), "Off what is wanted", off)],
            ),
            _section(
                "What the next round does",
                drawn=[_drawn(factor_figure(found), "Contraction", factors, narrow=True)],
            ),
        ],
    }  # fmt: skip


def _rows(result: Mapping[str, Any]) -> list[list[str]]:
    return [
        [
            one["axis"], f"{1e3 * one['delay']['value']:.2f} ms",
            f"{1e3 * one['constant']['value']:.2f} ms",
            f"{math.degrees(one['left']['value']):.3g}° rms",
        ]
        for one in result["lags"]
    ]  # fmt: skip


def show_lag(result: Mapping[str, Any]) -> None:
    """Print how late each axis is, and what the next round should do.

    Args:
        result: of `lag_files`.
    """
    from .listing import printed

    used = [
        f"  - {one['axis']} {one['quantity']}: {100 * one['ratio']:.1f} % of its limit"
        for one in result["limits"]
        if one["ratio"] > 0.9
    ]
    headings = ("axis", "delay", "first-order lag after it", "left")
    printed(result["sentence"], headings, _rows(result), used)
