"""What a robot's feedback shows of its lag: the error over the swing, and how fast it shrinks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ..optimize.profile import AXES
from .figures import _STYLE, OTHER, _new
from .thesis.draw import LOOKS

if TYPE_CHECKING:
    from ..optimize.servo import Round


def error_figure(found: Round) -> Figure:
    """What is wanted less the feedback over the swing, one line an axis that moves.

    Args:
        found: a round.

    Returns:
        One panel, impact marked.
    """
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 3.6)
        axes: Any = figure.subplots()
        for column, axis in _moving(found):
            color, style = LOOKS[column]
            off = np.degrees(found.errors[:, column])
            axes.plot(found.times, off, color=color, linestyle=style, label=axis)
        axes.axvline(found.profile.impact_time, color=OTHER, linewidth=0.8, label="impact")
        axes.set(xlabel="time [s]", ylabel="wanted less feedback [degrees]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def factor_figure(found: Round) -> Figure:
    """By what an error is multiplied at each frequency that the swing holds.

    Args:
        found: a round.

    Returns:
        One panel, logarithmic; one is dashed.
    """
    with mpl.rc_context(_STYLE):
        figure = _new(7.0, 3.6)
        axes: Any = figure.subplots()
        for column, axis in _moving(found):
            held = np.isfinite(found.factors[:, column]) & (found.frequencies > 0)
            color = LOOKS[column][0]
            axes.loglog(
                found.frequencies[held], found.factors[held, column], ".-", color=color, label=axis
            )
        axes.axhline(1.0, color=OTHER, linestyle="--")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set(xlabel="frequency [Hz]", ylabel="factor of the error [-]")
        axes.legend(loc="best")
    return figure


def _moving(found: Round) -> list[tuple[int, str]]:
    """Columns and names of the axes that move."""
    known = {one.axis for one in found.lags}
    return [(column, axis) for column, axis in enumerate(AXES) if axis in known]
