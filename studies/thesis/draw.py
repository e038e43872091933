"""Panels of curves and maps, described as data and drawn as one SVG figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette, which the color-blind can tell apart; line styles say the same again.
LOOKS = (
    ("#3a3f45", "-"),
    ("#d55e00", "--"),
    ("#0072b2", "-."),
    ("#009e73", ":"),
    ("#cc79a7", (0, (5, 1))),
)
WIDTH, HEIGHT = 11.6, 3.3
"""Of a figure, and of each row of its panels [inch]."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A line, or marks where `is_marks`.

    Attributes:
        x: shape (n,) [unit of the panel's axis].
        y: shape (n,) [unit of the panel's axis].
        label: in the legend; none where empty.
        is_marks: whether points are drawn instead of a line.
    """

    x: np.ndarray
    y: np.ndarray
    label: str = ""
    is_marks: bool = False


@dataclass(frozen=True, eq=False)
class Field:
    """Values over a plane.

    Attributes:
        x: shape (n,) [unit of the panel's axis].
        y: shape (m,) [unit of the panel's axis].
        values: shape (n, m) [see `label`].
        label: of the values, with their unit.
    """

    x: np.ndarray
    y: np.ndarray
    values: np.ndarray
    label: str


@dataclass(frozen=True)
class Panel:
    """One pair of axes.

    Attributes:
        title: short.
        x: label of the axis, with its unit.
        y: label of the axis, with its unit.
        curves: lines and marks, in the order of the palette.
        field: a map below them.
        is_log: whether the x axis is logarithmic.
    """

    title: str
    x: str
    y: str
    curves: tuple[Curve, ...] = ()
    field: Field | None = None
    is_log: bool = False


def drawn(panels: Sequence[Panel]) -> bytes:
    """Panels side by side, two a row, as an SVG file.

    Args:
        panels: at least one.

    Returns:
        The file's bytes, the same for the same panels.
    """
    from ..surface import image

    return image(_figure(panels), "svg")


def _figure(panels: Sequence[Panel]) -> Figure:
    import matplotlib as mpl

    from ..figures import _STYLE, _new

    rows = -(-len(panels) // 2)
    with mpl.rc_context(_STYLE):
        figure = _new(WIDTH, HEIGHT * rows + 0.3)
        figure.set_facecolor("white")
        wide = 1 if len(panels) == 1 else 2
        for k, panel in enumerate(panels):
            _draw(figure, figure.add_subplot(rows, wide, k + 1), panel)
    return figure


def _draw(figure: Figure, axes: Axes, panel: Panel) -> None:
    from ..views import envelope

    if panel.field is not None:
        field = panel.field
        bands = axes.contourf(field.x, field.y, field.values.T, levels=12, cmap="viridis")
        figure.colorbar(bands, ax=axes, label=field.label)
    for k, curve in enumerate(panel.curves):
        color, style = LOOKS[k % len(LOOKS)]
        look: dict[str, Any] = {"color": color, "linestyle": style}
        if curve.is_marks:
            white = "white" if panel.field is not None else color
            look = {"linestyle": "none", "marker": "osD^v"[k % 5], "markersize": 6.5,
                    "markerfacecolor": white, "markeredgecolor": "#d55e00"}  # fmt: skip
        told = (curve.x, curve.y) if curve.is_marks else envelope(curve.x, curve.y)
        axes.plot(*told, label=curve.label or None, **look)
    axes.set(title=panel.title, xlabel=panel.x, ylabel=panel.y)
    if panel.is_log:
        axes.set_xscale("log")
    if any(curve.label for curve in panel.curves):
        on_color = panel.field is not None  # where black words alone would not be read
        axes.legend(loc="best", frameon=on_color, facecolor="white", framealpha=0.9)
