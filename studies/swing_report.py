"""The page of a swing: what it does, how it was checked, and what a classic would have done."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .report import write_page
from .sections import _drawn, _section
from .swing_figures import (
    club_figure,
    limit_rows,
    motor_figure,
    price_figure,
    residual_figure,
)
from .swing_film import SLOWER, film
from .words import unit_words

if TYPE_CHECKING:
    from ..optimize.classic import Classic
    from ..optimize.swing_check import Verdict


def write_swing_report(
    result: Mapping[str, Any], verdict: Verdict | None, classics: Sequence[Classic], path: Path
) -> Path:
    """Writes the page.

    Args:
        result: what ``swing.json`` holds.
        verdict: of the robot's file; None where there is no swing.
        classics: swings of the same limits, impact and duration; may be empty.
        path: file to write; its folder exists.

    Returns:
        The path.
    """
    passed = bool(result["check"]["passed"])
    chips = {"solved": "Swing found", "infeasible": "Not feasible", "check_failed": "Check failed"}
    status = str(result["status"])
    page = {
        "title": "The optimal swing",
        "status": "adequate" if passed else "refused",
        "chip": chips.get(status, "Not settled"),
        "sentence": result["sentence"],
        "sections": [one for one in _sections(result, verdict, classics) if one is not None],
        "version": result["provenance"]["version"],
    }
    return write_page(page, path)


def _sections(
    result: Mapping[str, Any], verdict: Verdict | None, classics: Sequence[Classic]
) -> list[dict[str, Any] | None]:
    found: list[dict[str, Any] | None] = [_terms(result)]
    if verdict is not None:
        found += [_film(verdict), _impact(result), _motors(result, verdict), _club(verdict)]
        found += [_residual(result, verdict, classics)]
    found += [_binding(result), _price(result), _prices(result), _hardware(result)]
    return found


def _terms(result: Mapping[str, Any]) -> dict[str, Any]:
    at, file = result["impact"], result["file"]
    fidelity = {
        "thesis": "linear robot with the base's acceleration on every mass",
        "planar": "planar robot with centrifugal terms and shortening of the shaft",
    }[result["fidelity"]]
    words = (
        f"Fidelity: {fidelity}. Pose: {result['hold']}. File: {file['quantum']:g}° a digit, points "
        f"joined as {file['interpolation']}. Impact at {at['time']:.6g} s with "
        f"{at['clubhead_speed']:.4f} m/s."
    )
    doubt = result["check"].get("doubt") or ""
    failures = [f"Failed: {one}." for one in result["check"]["failures"]]
    return _section("What was asked, and of which robot", words, doubt, *failures)


def _film(verdict: Verdict) -> dict[str, Any]:
    import numpy as np

    played, profile = verdict.nominal, verdict.profile
    kept = played.times <= profile.time[-1]
    times = played.times[kept]
    drives: Any = profile.at(times).angles[:, :2]
    address = film(
        played.numbers[0], times, np.nan_to_num(played.states[0, kept]), drives, profile.impact_time
    )
    caption = (
        f"The swing {SLOWER:g} times slower, seen across the swing plane; the circle is the ball."
    )
    picture = {
        "image": address, "title": "The swing", "caption": caption, "narrow": True,
        "alt": f"Figure: the swing. {caption}",
    }  # fmt: skip
    return _section("The swing", drawn=[picture])


def _impact(result: Mapping[str, Any]) -> dict[str, Any]:
    at = result["impact"]
    spread = at["spread"]
    rows = [
        [
            "speed", f"{at['speed_error']:+.5f} m/s",
            f"{spread['speed'][0]:+.3f} to {spread['speed'][1]:+.3f} m/s",
        ]
    ]  # fmt: skip
    for name, error in at["pose_errors_degrees"].items():
        low, high = spread["pose_degrees"][name]
        rows.append([name, f"{error:+.5f}°", f"{low:+.3f} to {high:+.3f}°"])
    factors = result["residual"]["factor"]
    words = (
        "Errors at impact when the robot's file is read back, rounded and joined as it states, and "
        "simulated anew by the model alone."
    )
    head = ["", "the robot itself", f"{factors[0]:g} to {factors[-1]:g} of its parameter"]
    return _section("Is it at the ball?", words, head=head, rows=rows)


def _motors(result: Mapping[str, Any], verdict: Verdict) -> dict[str, Any]:
    figure = _drawn(motor_figure(verdict), "Motors", "As the controller joins the file's points.")
    head = ["limit", "used", "at", "value", "bound"]
    words = "Largest use of every limit, exact between the points."
    return _section("The motors", words, drawn=[figure], head=head, rows=limit_rows(result))


def _club(verdict: Verdict) -> dict[str, Any]:
    caption = "Nominal robot; grey: after the end of the swing, motors at rest."
    return _section("The club", drawn=[_drawn(club_figure(verdict), "Clubhead", caption)])


def _residual(
    result: Mapping[str, Any], verdict: Verdict, classics: Sequence[Classic]
) -> dict[str, Any]:
    worst = result["residual"]["worst"]
    rows = [["this swing", f"{1e3 * worst:.3g} mm", ""]]
    for one in classics:
        size = f"{1e3 * float(one.rings.max()):.3g} mm" if len(one.rings) else "no motion"
        rows.append([one.name, size, "" if one.works else "does not meet impact"])
    words = (
        "Classics are the least jerk, passed through a shaper for the slowest mode, with the same "
        "limits, impact and duration. No shaper "
        "knows the ball, and all of them need a robot that is linear."
    )
    shown = [one for one in classics if one.works and len(one.rings)]
    caption = "Lower is quieter; a shaper for the nominal robot loses what it gained beside it."
    figure = _drawn(residual_figure(verdict, shown), "Ring after the end", caption)
    head = ["method", "worst ring", ""]
    return _section("What rings on", words, drawn=[figure], head=head, rows=rows)


def _binding(result: Mapping[str, Any]) -> dict[str, Any] | None:
    if not result["binding"]:
        return None
    rows = [
        [one["limit"], f"{one['time']:.3f} s", f"{100 * one['share']:.0f} %"]
        for one in result["binding"]
    ]
    words = "The limits that cost most, with their share of all prices: widen the first one first."
    return _section("What holds it up", words, head=["limit", "most at", "share"], rows=rows)


def _price(result: Mapping[str, Any]) -> dict[str, Any]:
    price = result["price"]
    rows = [
        [
            name,
            f"{price[name]['rms_jerk']:.4g} rad/s³",
            f"{price[name]['peak_acceleration']:.4g} rad/s²",
            f"{price[name]['peak_torque']:.4g} N m" if "peak_torque" in price[name] else "",
        ]
        for name in ("arm", "wrist")
    ]
    cost = ", ".join(f"{name} {value:.3g}" for name, value in price["cost"].items())
    words = f"Cost: {cost}."
    head = ["axis", "rms jerk", "peak acceleration", "peak torque"]
    return _section("What it costs", words, head=head, rows=rows)


def _prices(result: Mapping[str, Any]) -> dict[str, Any] | None:
    """What less vibration costs, in a figure and a table of the swings that no other beats."""
    listed = result.get("prices")
    if not listed:
        return None
    rows = [
        [
            f"{one['duration']:.3g} s", f"{1e3 * one['ring']:.3g} mm",
            f"{one['vibration']:.3g} m/s", " / ".join(f"{x:.4g}" for x in one["rms_jerk"]),
            " / ".join(f"{x:.4g}" for x in one["peak_acceleration"]),
            " / ".join(f"{x:.3g}" for x in one["peak_torque"]),
        ]
        for one in listed
        if one["efficient"]
    ]  # fmt: skip
    words = (
        f"{len(listed)} swings with the same impact, for other weights of vibration and other "
        "times to stop; the table holds those that no other beats. Arm / wrist in every column."
    )
    caption = "Each line is one duration; leftmost is smoothest, lowest is quietest."
    head = ["duration", "worst ring", "vibration", "rms jerk", "peak acceleration", "peak torque"]
    figure = _drawn(price_figure(listed), "Price list", caption)
    return _section("What less vibration costs", words, drawn=[figure], head=head, rows=rows)


def _hardware(result: Mapping[str, Any]) -> dict[str, Any] | None:
    """What a wrist or a collet that is a little other would change."""
    told = result.get("hardware")
    if not told:
        return None
    rows = [
        [
            one["parameter"].replace("_", " "), f"{one['value']:.4g} {unit_words(one['unit'])}",
            f"{one['cost']:+.2g} %", f"{one['vibration']:+.2g} %",
        ]
        for one in told["slopes"]
    ]  # fmt: skip
    words = (
        "By how much the best swing's cost and its vibration would change with one percent more "
        "of each, the swing being the best one for it: `supple study run best_hardware` goes on."
    )
    head = ["one percent more of", "now", "cost", "vibration"]
    return _section("What other hardware would change", words, head=head, rows=rows, left=2)
