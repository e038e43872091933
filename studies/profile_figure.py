"""What a swing profile looks like: angles and derivatives with their limits, and what it shakes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..optimize.profile import AXES, QUANTITIES, Limits
from .figures import _STYLE, AFTER, BEFORE, OTHER, _new
from .words import unit_words

if TYPE_CHECKING:
    from ..optimize.smooth import Smoothed, Spectrum

_SHOWN = ("degrees", "rad/s", "rad/s^2", "rad/s^3")
FINE = 5
"""Instants drawn in each step of the profile [-]."""


def motion_figure(made: Smoothed, limits: Limits) -> Figure:
    """Angles, velocities, accelerations and jerks of the three axes, beside their limits.

    Args:
        made: the profile and what it was made of.
        limits: of the motors.

    Returns:
        Four rows of three panels; the measured angles lie under the profile's.
    """
    profile, track = made.profile, made.track
    times = np.linspace(0.0, profile.time[-1], FINE * len(profile.time))
    course = profile.at(times)
    pace = profile.impact_time / (track.impact_time - made.start)
    measured = pace * (track.times - made.start)
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 10.5)
        panels: Any = figure.subplots(4, 3, sharex=True)
        for column, axis in enumerate(AXES):
            for row, (quantity, unit) in enumerate(zip(QUANTITIES, _SHOWN, strict=True)):
                axes: Axes = panels[row, column]
                scale = math.degrees(1.0) if row == 0 else 1.0
                if row == 0:
                    seen = np.degrees(track.angles[:, column])
                    axes.plot(measured, seen, color=OTHER, linewidth=3.0, label="measured")
                    axes.set_title(axis)
                values = scale * course[row][:, column]
                axes.plot(times, values, color=AFTER, label="profile")
                axes.axvline(profile.impact_time, color=BEFORE, linestyle=":", label="impact")
                middle, half = getattr(limits, axis).most(quantity)
                _bound(axes, scale * (middle - half), scale * (middle + half), values)
                if column == 0:
                    axes.set_ylabel(f"{quantity} [{unit_words(unit)}]")
                if row == 3:
                    axes.set_xlabel("time [s]")
        panels[0, 0].set_xlim(0.0, profile.time[-1])
        handles, labels = panels[0, 0].get_legend_handles_labels()
        handles.append(Line2D([], [], color=BEFORE, linestyle="--"))
        figure.legend(handles, [*labels, "limit"], loc="outside upper right", ncols=4)
    return figure


def _bound(axes: Axes, low: float, high: float, values: np.ndarray) -> None:
    """Limits as lines where they are near enough to be seen beside the curve."""
    reach = float(np.max(np.abs(values)))
    for bound in (low, high):
        if math.isfinite(bound) and abs(bound) < 4 * reach:
            axes.axhline(bound, color=BEFORE, linestyle="--", linewidth=1.0)


def spectrum_figure(found: Spectrum, cutoff: float | None) -> Figure:
    """Amplitudes of the accelerations by frequency, before and after.

    Args:
        found: of `supple.optimize.smooth.spectrum`.
        cutoff: edge of the filter's pass band [Hz]; None where nothing was filtered.

    Returns:
        A panel an axis.
    """
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 3.6)
        panels: Any = figure.subplots(1, 3, sharex=True)
        for column, axis in enumerate(AXES):
            axes: Axes = panels[column]
            for values, color, name in (
                (found.before, BEFORE, "measured"), (found.after, AFTER, "profile")
            ):  # fmt: skip
                axes.semilogy(found.frequencies[1:], values[1:, column], color=color, label=name)
            if cutoff is not None:
                axes.axvline(cutoff, color=OTHER, linestyle="--", label="edge of the filter")
            axes.set(title=axis, xlabel="frequency [Hz]")
        panels[0].set_ylabel(f"acceleration [{unit_words('rad/s^2')}]")
        panels[0].set_xlim(0.0, found.frequencies[-1])
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
    return figure
