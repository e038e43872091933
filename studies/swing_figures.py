"""The figures of a swing: motors with their limits, what the club does, and what rings on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ..optimize.solve_program import bend_rows
from . import figures
from .figures import AFTER, BEFORE, OTHER
from .words import unit_words

if TYPE_CHECKING:
    from ..optimize.classic import Classic
    from ..optimize.swing_check import Verdict

_TITLES = ("angle [rad]", "velocity [rad/s]", "acceleration [rad/s²]", "jerk [rad/s³]")
_COLORS = ("#d55e00", "#009e73", "#cc79a7", "#e69f00")


def _panels(rows: int, columns: int, height: float) -> tuple[Figure, Any]:
    figure = Figure(figsize=(11.6, height), layout="constrained", facecolor="none")
    return figure, figure.subplots(rows, columns, sharex=rows > 1, squeeze=False)


def motor_figure(verdict: Verdict) -> Figure:
    """Angle, velocity, acceleration and jerk of arm and wrist as the robot plays them.

    Args:
        verdict: of the robot's file.

    Returns:
        Eight panels, limits dashed, impact marked.
    """
    profile, limits = verdict.profile, verdict.task.limits
    times = np.linspace(0.0, profile.time[-1], 2001)
    course: Any = profile.at(times)
    with mpl.rc_context(figures._STYLE):
        figure, panels = _panels(4, 2, 8.2)
        for column, name in enumerate(("arm", "wrist")):
            own = getattr(limits, name)
            for order, title in enumerate(_TITLES):
                axes = panels[order, column]
                axes.plot(times, course[order][:, column], color=AFTER)
                middle, half = own.most(("angle", "velocity", "acceleration", "jerk")[order])
                for bound in (middle - half, middle + half) if np.isfinite(half) else ():
                    axes.axhline(bound, color=BEFORE, linestyle="--", linewidth=0.9)
                axes.axvline(profile.impact_time, color=OTHER, linewidth=0.8)
                axes.set_ylabel(title)
            panels[0, column].set_title(f"{name}: limits dashed, impact grey")
            panels[-1, column].set_xlabel("time [s]")
    return figure


def club_figure(verdict: Verdict) -> Figure:
    """Bend of the shaft, and speed and acceleration of the clubhead against the collet.

    Args:
        verdict: of the robot's file.

    Returns:
        Three panels over time.
    """
    played, task = verdict.nominal, verdict.task
    x = played.states[0]
    bend = bend_rows(played.numbers[0], x[:, :4].T, played.flat)
    relative = x[:, 7]
    step = float(played.times[1])
    with mpl.rc_context(figures._STYLE):
        figure, panels = _panels(3, 1, 6.2)
        first, second, third = panels[:, 0]
        first.plot(played.times, 1e3 * bend, color=AFTER)
        hit, end = verdict.profile.impact_time, verdict.profile.time[-1]
        before, after = task.shaft.deflection_before, task.shaft.deflection_after
        for most, low, high in ((before, 0.0, hit), (after, hit, played.times[-1])):
            if np.isfinite(most):
                for sign in (-1, 1):
                    first.hlines(1e3 * sign * most, low, high, color=BEFORE, linestyle="--")
        first.set_ylabel("bend of the\nshaft [mm]")
        second.plot(played.times, relative, color=AFTER)
        second.set_ylabel("clubhead in the\ncollet [m/s]")
        third.plot(played.times, np.gradient(relative, step), color=AFTER)
        third.set_ylabel("clubhead in the\ncollet [m/s²]")
        third.set_xlabel("time [s]")
        for axes in (first, second, third):
            axes.axvline(hit, color=OTHER, linewidth=0.8)
            axes.axvspan(end, played.times[-1], color="#eef1f4", linewidth=0)
    return figure


def residual_figure(verdict: Verdict, classics: Sequence[Classic]) -> Figure:
    """What is left ringing after the end against the factor, beside the classics.

    Args:
        verdict: of the robot's file.
        classics: swings of the same limits, impact and duration.

    Returns:
        One panel, logarithmic.
    """
    parameter = verdict.task.robust.parameter or "shaft_frequency"
    with mpl.rc_context(figures._STYLE):
        figure, panels = _panels(1, 1, 4.0)
        axes = panels[0, 0]
        for one, color in zip(classics, _COLORS, strict=False):
            axes.semilogy(one.dense, 1e3 * one.rings, color=color, label=one.name)
        axes.semilogy(verdict.factors, 1e3 * verdict.residual, color=AFTER, label="this swing")
        axes.set(
            xlabel=f"{parameter.replace('_', ' ')}, as a share of the rig's",
            ylabel="clubhead from rest,\nlargest after the end [mm]",
        )
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def price_figure(prices: Sequence[Mapping[str, Any]]) -> Figure:
    """Ring after the end against rms jerk of arm and wrist, one line a duration.

    Args:
        prices: as ``swing.json`` holds them.

    Returns:
        Two panels, logarithmic.
    """
    kept = [one for one in prices if one["ring"] is not None]
    with mpl.rc_context(figures._STYLE):
        figure, panels = _panels(1, 2, 4.0)
        for column, name in enumerate(("arm", "wrist")):
            axes = panels[0, column]
            for color, duration in zip(
                (AFTER, *_COLORS), sorted({one["duration"] for one in kept}), strict=False
            ):
                own = sorted(
                    (one["rms_jerk"][column], 1e3 * one["ring"])
                    for one in kept
                    if one["duration"] == duration
                )
                axes.loglog(*zip(*own, strict=True), "o-", color=color, label=f"{duration:.3g} s")
            axes.xaxis.set_minor_formatter(NullFormatter())
            axes.set(xlabel=f"{name}: rms jerk [rad/s³]", ylabel="worst ring after the end [mm]")
        panels[0, 1].legend(title="duration", loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def limit_rows(result: Mapping[str, Any]) -> list[list[str]]:
    """Rows of the table of limits, from what ``swing.json`` holds [-]."""
    rows = []
    for use in result["limits"]["uses"]:
        when = f"{use['time']:.3f} s" if "time" in use else ""
        unit = unit_words(use["unit"])
        rows.append(
            [
                f"{use['axis']} {use['quantity']}", f"{100 * use['ratio']:.1f} %", when,
                f"{use['value']:.4g} {unit}", f"{use['limit']:.4g} {unit}",
            ]
        )  # fmt: skip
    return rows
