"""Surfaces of a map: in three dimensions as in the thesis, and as contours with their optimum."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .figures import _STYLE, AFTER, BEFORE, OTHER, _new
from .optimum_words import plain
from .words import number_words, unit_words

if TYPE_CHECKING:
    from ..optimize.sweep import Map

COLORS = "viridis"
"""Colors that the color-blind can tell apart, and that print in gray."""

DOTS_PER_INCH = 200
"""Of figures for print, some 11 inches wide [1/inch]."""

MOST_LINES = 75
"""Lines of a surface along each axis at most [-]; a contour takes every design."""

LEVELS = 16
"""Bands of a contour [-]."""

REGIONS = {
    "overdamped": ("//", "overdamped"),
    "mode_changes": ("..", "mode changes"),
    "grip_beyond": ("x", "grip beyond its limit"),
}
"""Hatching and words of the regions that a map marks."""

MOST_PLANES = 3
"""Slices of a map of three axes or more [-]."""


@dataclass(frozen=True)
class Plane:
    """A slice of a map along two axes.

    Attributes:
        first: name of the axis that runs to the right.
        second: name of the other.
        x: values of the first, shape (n,) [SI].
        y: values of the second, shape (m,) [SI].
        values: the score, shape (n, m) [SI unit of the score].
        marks: regions by name, truth values, each of shape (n, m) [-].
        cut: where the further axes are held, by name [SI].
    """

    first: str
    second: str
    x: np.ndarray
    y: np.ndarray
    values: np.ndarray
    marks: Mapping[str, np.ndarray]
    cut: Mapping[str, float]


def planes_of(found: Map, name: str, at: Mapping[str, float]) -> list[Plane]:
    """Slices of a map through a design, one for each pair of axes, `MOST_PLANES` at most.

    Args:
        found: the map.
        name: of the score.
        at: the design through which the further axes are cut [SI].

    Returns:
        The slices; none where fewer than two axes have several values.
    """
    axes = found.task.axes
    wide = [k for k, axis in enumerate(axes) if len(axis.values) > 1]
    planes = []
    for first, second in list(combinations(wide, 2))[:MOST_PLANES]:
        place: list[Any] = []
        cut = {}
        for k, axis in enumerate(axes):
            near = int(np.argmin(np.abs(axis.values - at.get(axis.name, axis.values[0]))))
            place.append(slice(None) if k in (first, second) else near)
            if k in wide and k not in (first, second):
                cut[axis.name] = float(axis.values[near])
        own = tuple(place)
        order = [np.argsort(axes[k].values, kind="stable") for k in (first, second)]
        grid = np.ix_(*order)
        planes.append(
            Plane(
                axes[first].name,
                axes[second].name,
                np.asarray(axes[first].values, float)[order[0]],
                np.asarray(axes[second].values, float)[order[1]],
                np.asarray(found.scores[name][own], float)[grid],
                {key: np.asarray(one[own])[grid] > 0 for key, one in found.regions.items()},
                cut,
            )
        )
    return planes


def surface_figure(
    planes: Sequence[Plane],
    label: str,
    units: Mapping[str, str],
    best: Mapping[str, Any] | None,
    cloud: Mapping[str, Any] | None = None,
) -> Figure:
    """The first slice as a surface in three dimensions, and every slice as a contour.

    Args:
        planes: slices of one map, at least one.
        label: of the score, with its unit.
        units: of the axes, by name.
        best: the optimum, with ``design``, ``value`` and ``which``; None where there is none.
        cloud: optima over what is not known, with ``optima`` by name, and the ``best`` for all.

    Returns:
        One figure: two panels for a map of two axes, four for one of more.
    """
    rows = 1 if len(planes) == 1 else 2
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 4.9 * rows)
        figure.set_facecolor("white")
        solid: Any = figure.add_subplot(rows, 2, 1, projection="3d")
        _solid(solid, planes[0], label, units)
        for k, plane in enumerate(planes):
            axes = figure.add_subplot(rows, 2, k + 2)
            _contour(figure, axes, plane, label, units, best)
            if cloud is not None:
                _cloud(axes, plane, cloud)
    return figure


def _solid(axes: Any, plane: Plane, label: str, units: Mapping[str, str]) -> None:
    """A surface seen from above and in front, as the thesis draws its maps."""
    steps = [max(1, -(-size // MOST_LINES)) for size in plane.values.shape]
    part = (slice(None, None, steps[0]), slice(None, None, steps[1]))
    values = np.ma.masked_invalid(plane.values[part])
    x, y = np.meshgrid(plane.x[part[0]], plane.y[part[1]], indexing="ij")
    low, high = _span(plane.values)
    axes.plot_surface(
        x, y, values.filled(np.nan), cmap=COLORS, vmin=low, vmax=high,
        rcount=MOST_LINES, ccount=MOST_LINES, linewidth=0.15, edgecolor="#00000040",
        antialiased=True, rasterized=True,
    )  # fmt: skip
    axes.set_xlabel(axis_label(plane.first, units), labelpad=9)
    axes.set_ylabel(axis_label(plane.second, units), labelpad=9)
    axes.set_zlabel(label, labelpad=7)
    axes.tick_params(labelsize=8.5, pad=1)
    for each in (axes.xaxis, axes.yaxis, axes.zaxis):
        each.set_major_locator(MaxNLocator(6))
    axes.view_init(elev=28, azim=-128)
    axes.set_box_aspect(None, zoom=0.88)


def _contour(
    figure: Figure,
    axes: Axes,
    plane: Plane,
    label: str,
    units: Mapping[str, str],
    best: Mapping[str, Any] | None,
) -> None:
    """Bands of one slice; its marked regions; the optimum and what costs 1 % more."""
    values = np.ma.masked_invalid(plane.values.T)
    low, high = _span(plane.values)
    bands = MaxNLocator(LEVELS).tick_values(low, high)
    drawn = axes.contourf(plane.x, plane.y, values, levels=bands, cmap=COLORS, extend="both")
    figure.colorbar(drawn, ax=axes, label=label)
    for key, marked in plane.marks.items():
        if marked.any():
            look, words = REGIONS[key]
            axes.contourf(
                plane.x, plane.y, marked.T.astype(float),
                levels=[0.5, 1.5], colors="none", hatches=[look],
            )  # fmt: skip
            handle = axes.fill_between([], [], hatch=look, facecolor="none", edgecolor="black")
            handle.set_label(words)
    if best is not None:
        sign = 1.0 if best["which"] == "lowest" else -1.0
        price = best["value"] + sign * 0.01 * abs(best["value"])
        if np.nanmin(values) < price < np.nanmax(values):
            axes.contour(plane.x, plane.y, values, levels=[price], colors="white", linewidths=1.6)
            axes.plot([], [], color=OTHER, linewidth=1.6, label="1 % worse (white line)")
        place = (best["design"].get(plane.first), best["design"].get(plane.second))
        if None not in place:
            look = {"markersize": 12, "markeredgecolor": "white", "zorder": 5}
            axes.plot(*place, "*", color=BEFORE, label=f"{best['which']}", **look)
    for setter, numbers in ((axes.set_xscale, plane.x), (axes.set_yscale, plane.y)):
        if is_geometric(numbers):
            setter("log")
    cut = ", ".join(
        f"{plain(k)} {number_words(v)} {unit_words(units[k])}" for k, v in plane.cut.items()
    )
    axes.set(
        xlabel=axis_label(plane.first, units),
        ylabel=axis_label(plane.second, units),
        title=f"At {cut}" if cut else "",
    )
    axes.grid(visible=False)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper right", frameon=True, framealpha=0.85, fontsize=8.5)


def _cloud(axes: Axes, plane: Plane, cloud: Mapping[str, Any]) -> None:
    """The optimum of each draw of what is not known, and the design that is best for all."""
    if not {plane.first, plane.second} <= set(cloud["optima"]):
        return
    places = [np.asarray(cloud["optima"][name]) for name in (plane.first, plane.second)]
    look: dict[str, Any] = {"markeredgewidth": 0.4, "markeredgecolor": "black", "zorder": 4}
    axes.plot(*places, "o", markersize=4, color="white", label="best of a draw", **look)
    place = (cloud["best"][plane.first], cloud["best"][plane.second])
    look = {"markersize": 9, "markeredgecolor": "white", "zorder": 6}
    axes.plot(*place, "D", color=OTHER, label="best for all draws", **look)
    axes.legend(loc="upper right", frameon=True, framealpha=0.85, fontsize=8.5)


def line_figure(
    found: Map,
    name: str,
    label: str,
    units: Mapping[str, str],
    best: Mapping[str, Any] | None,
    cloud: Mapping[str, Any] | None = None,
) -> Figure:
    """A score along the only axis with several values."""
    axis = next((one for one in found.task.axes if len(one.values) > 1), found.task.axes[0])
    order = np.argsort(axis.values, kind="stable")
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 3.8)
        figure.set_facecolor("white")
        axes = figure.subplots()
        values = np.asarray(found.scores[name], float).ravel()
        axes.plot(axis.values[order], values[order], ".-", color=AFTER, markersize=4)
        if best is not None:
            place = best["design"][axis.name]
            axes.plot(place, best["value"], "*", color=BEFORE, markersize=13, label=best["which"])
            axes.legend()
        if cloud is not None:
            places = cloud["optima"][axis.name]
            axes.plot(places, np.full(len(places), best["value"] if best else np.nan), "|",
                      color=OTHER, markersize=16, label="best of a draw")  # fmt: skip
            axes.legend()
        if is_geometric(axis.values[order]):
            axes.set_xscale("log")
        axes.set(xlabel=axis_label(axis.name, units), ylabel=label)
    return figure


def axis_label(name: str, units: Mapping[str, str]) -> str:
    """Name and unit of an axis, as figures write them."""
    return f"{plain(name)} [{unit_words(units[name])}]"


def is_geometric(values: np.ndarray) -> bool:
    """Whether ascending values [any unit] grow by a factor instead of a step."""
    if len(values) < 3 or values[0] <= 0:
        return False
    return bool(np.ptp(np.diff(np.log(values))) < 1e-6 * np.log(values[-1] / values[0]))


def _span(values: np.ndarray) -> tuple[float, float]:
    """What colors range over: all but the very few largest values, which would hide the rest."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()), float(np.percentile(finite, 99.5))
    return (low, high) if high > low else (low - 0.5 * (abs(low) or 1), low + 0.5 * (abs(low) or 1))


def image(figure: Figure, kind: str) -> bytes:
    """A figure as a file for print.

    Args:
        figure: the figure.
        kind: ``png`` or ``svg``.

    Returns:
        The file's bytes, the same for the same figure.
    """
    memory = io.BytesIO()
    told = {"Date": None, "Creator": "supple"} if kind == "svg" else {"Software": "supple"}
    with mpl.rc_context(_STYLE):
        figure.savefig(memory, format=kind, dpi=DOTS_PER_INCH, metadata=told)
    figure.set_layout_engine("none")  # what is laid out once is not laid out again
    return memory.getvalue()
