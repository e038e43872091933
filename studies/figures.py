"""The figures of the reports, each drawn from views of records or from the evidence."""

import base64
import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

from ..identification.backbone import backbone
from .views import Cloud, binned_mean, clouds, envelope, normalized_error, telling_window
from .words import cause_words, number_words, unit_words

if TYPE_CHECKING:
    from ..identification.views import RecordView

# Okabe and Ito's palette, which the color-blind can tell apart.
MEASURED, BEFORE, AFTER, OTHER = "#3a3f45", "#d55e00", "#0072b2", "#9aa2ab"
_STYLE: dict[Any, Any] = {
    "font.size": 10.5,
    "font.family": ["DejaVu Sans"],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#6b737c",
    "axes.labelcolor": "#22262a",
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": "#e3e7eb",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "legend.fontsize": 10,
    "lines.linewidth": 1.3,
    "svg.fonttype": "path",
    "svg.hashsalt": "supple",
    "axes.formatter.limits": (-3, 4),
}


def _new(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained", facecolor="none")


def data_uri(figure: Figure) -> str:
    """A figure as the address of an image that carries its own content (SVG).

    Args:
        figure: a figure of this file.

    Returns:
        ``data:image/svg+xml;base64,...``, the same for the same figure.
    """
    memory = io.BytesIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(memory, format="svg", dpi=110, metadata={"Date": None, "Creator": "supple"})
    drawn = re.sub(rb'\bd="[^"]*"', _shortened, memory.getvalue())
    return "data:image/svg+xml;base64," + base64.b64encode(drawn).decode("ascii")


def _shortened(path: re.Match[bytes]) -> bytes:
    """A path with its coordinates cut to hundredths of a point, a third of the size."""
    return re.sub(rb"(\.\d\d)\d+", rb"\1", path[0])


def record_figure(view: "RecordView") -> Figure:
    """Measured against simulated, before and after; the residuals; a zoom where it matters.

    Args:
        view: one channel of one record.

    Returns:
        Three panels: the whole record, its residuals, and a few periods.
    """
    extended = bool(np.any(np.asarray(view.after) != np.asarray(view.before)))
    unit = unit_words(view.unit)
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 4.3)
        grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0], height_ratios=[1.35, 1.0])
        whole, zoom = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[:, 1])
        rest = figure.add_subplot(grid[1, 0], sharex=whole)
        start, end = telling_window(view)
        _series(whole, view, MEASURED, view.measured, label="measured", linewidth=1.0)
        part = end - start < 0.9 * (view.time[-1] - view.time[0])
        if part:
            whole.axvspan(start, end, color="#f0e442", alpha=0.45, linewidth=0)
        title = "Whole record (yellow: enlarged)" if part else "Measured"
        whole.set(ylabel=f"{view.channel} [{unit}]", title=title)
        whole.tick_params(labelbottom=False)
        _series(rest, view, BEFORE, view.measured - view.before, linewidth=1.0)
        if extended:
            _series(rest, view, AFTER, view.measured - view.after, linewidth=1.0)
        rest.set(xlabel="time [s]", ylabel=f"residual [{unit}]")
        inside = (view.time >= start) & (view.time <= end)
        few = np.count_nonzero(inside) <= 250
        marks: dict[str, Any] = {"linewidth": 3}
        if few:
            marks = {"marker": "o", "markersize": 3.2, "linestyle": "none"}
        zoom.plot(view.time[inside], view.measured[inside], color=OTHER, label="measured", **marks)
        name = "before" if extended else "simulated"
        zoom.plot(view.time[inside], view.before[inside], "--", color=BEFORE, label=name)
        if extended:
            zoom.plot(view.time[inside], view.after[inside], color=AFTER, label="after")
        title = "Enlarged: where it was worst" if part else "Measured and simulated"
        zoom.set(xlabel="time [s]", title=title)
        figure.legend(*zoom.get_legend_handles_labels(), loc="outside upper right", ncols=3)
        _tight(whole, view.time)
        _tight(zoom, view.time[inside])
    return figure


def _series(axes: Axes, view: "RecordView", color: str, values: np.ndarray, **options: Any) -> None:
    axes.plot(*envelope(np.asarray(view.time), np.asarray(values)), color=color, **options)


def _tight(axes: Axes, x: np.ndarray) -> None:
    if len(x) > 1 and x[-1] > x[0]:
        axes.set_xlim(float(x[0]), float(x[-1]))


def structure_figure(views: Sequence["RecordView"]) -> Figure | None:
    """Residual against time, displacement and velocity, before and after.

    Args:
        views: channels of records.

    Returns:
        A figure with a row before and a row after (one row where nothing was added), or None
        where there is nothing finite to draw.
    """
    found = clouds(views) if views else []
    if not found:
        return None
    extended = any(np.any(cloud.before != cloud.after) for cloud in found)
    rows = [("before", BEFORE), ("after", AFTER)] if extended else [("before", BEFORE)]
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 2.6 * len(rows) + 0.3)
        panels = figure.subplots(len(rows), len(found), squeeze=False, sharex="col", sharey="row")
        for (name, color), line in zip(rows, panels, strict=True):
            for cloud, axes in zip(found, line, strict=True):
                _density(axes, cloud, getattr(cloud, name), color)
            word = f"residual {name}" if extended else "residual"
            line[0].set_ylabel(f"{word}\n[noise std]")
        for cloud, axes in zip(found, panels[-1], strict=True):
            axes.set_xlabel(f"{cloud.axis} [{unit_words(cloud.unit)}]")
        for cloud, axes in zip(found, panels[0], strict=True):
            axes.set_title(f"against {cloud.axis}")
    return figure


def _density(axes: Axes, cloud: Cloud, y: np.ndarray, color: str) -> None:
    """Gray density of a cloud, the band of the noise, and the mean along the axis."""
    reach = max(3.0, 1.15 * float(np.percentile(np.abs(y), 99.3)))
    low, high = (float(v) for v in np.percentile(cloud.x, [0.2, 99.8]))
    columns = int(np.clip(np.sqrt(len(y)) / 1.3, 30, 120))
    counts, _, _ = np.histogram2d(
        cloud.x, y, bins=(columns, columns * 3 // 5), range=[[low, high], [-reach, reach]]
    )
    shade = np.log1p(counts.T)
    axes.imshow(
        np.ma.masked_equal(shade, 0.0),
        extent=(low, high, -reach, reach),
        origin="lower",
        aspect="auto",
        cmap="Greys",
        vmin=-0.6 * shade.max(),
        vmax=1.5 * shade.max(),
        interpolation="nearest",
    )
    for level in (-1.0, 1.0):
        axes.axhline(level, color="#009e73", linewidth=1.2, linestyle=":")
    if cloud.axis == "time":  # the mean of an oscillation says nothing: draw its strength
        middles, power, _ = binned_mean(cloud.x, y**2)
        axes.plot(middles, np.sqrt(power), color=color, linewidth=2.2)
        axes.plot(middles, -np.sqrt(power), color=color, linewidth=2.2)
    else:
        middles, means, errors = binned_mean(cloud.x, y)
        axes.fill_between(middles, means - 2 * errors, means + 2 * errors, color=color, alpha=0.35)
        axes.plot(middles, means, color=color, linewidth=2.2)
    axes.set_ylim(-reach, reach)
    axes.grid(visible=False)


def backbone_figure(views: Sequence["RecordView"]) -> Figure | None:
    """Frequency and damping against amplitude, of decays measured, simulated before and after.

    Args:
        views: channels of records; only decays are drawn, four at most.

    Returns:
        Two panels, or None without any decay that has a backbone.
    """
    drawn = 0
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 3.6)
        left, right = figure.subplots(1, 2)
        decays = [view for view in views if view.is_decay]
        unit = decays[0].unit if decays else ""
        for view in [view for view in decays if view.unit == unit][:4]:
            drawn += _draw_backbone(left, right, view, first=not drawn)
        if not drawn:
            return None
        amplitude = f"amplitude [{unit_words(unit)}]"
        left.set(xlabel=amplitude, ylabel="frequency [Hz]", title="Frequency against amplitude")
        right.set(xlabel=amplitude, ylabel="damping ratio [1]", title="Damping against amplitude")
        low, high = left.get_xlim()
        if high > 5.0 * max(low, 1e-300):
            for axes in (left, right):
                axes.set_xscale("log")
                axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
                axes.xaxis.set_minor_locator(NullLocator())
        right.set_ylim(bottom=0.0)
        low, high = left.get_ylim()
        if high - low < 0.02 * high:  # do not magnify the scatter of a frequency that is constant
            left.set_ylim(0.98 * low, 1.02 * high)
        figure.legend(*left.get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return figure


def _draw_backbone(left: Axes, right: Axes, view: "RecordView", first: bool) -> bool:
    """Draw the three backbones of a decay; say whether it had any."""
    noise = float(view.noise_std)
    measured = backbone(view.time, view.measured, noise)
    if not len(measured.amplitude):
        return False
    lines = [("measured", measured, {"color": MEASURED, "marker": "o", "linestyle": "none"})]
    extended = bool(np.any(np.asarray(view.after) != np.asarray(view.before)))
    name = "before" if extended else "simulated"
    before = backbone(view.time, view.before, noise)
    lines.append((name, before, {"color": BEFORE, "linestyle": "--", "marker": "."}))
    if extended:
        after = backbone(view.time, view.after, noise)
        lines.append(("after", after, {"color": AFTER, "linestyle": "-", "marker": "."}))
    for label, curve, look in lines:
        options: dict[str, Any] = {
            "markersize": 4.5,
            "linewidth": 2.0,
            "label": label if first else None,
        } | look
        left.plot(curve.amplitude, curve.frequency, **options)
        right.plot(curve.amplitude, curve.damping_ratio, **options)
    return True


def evidence_figure(
    candidates: Sequence[Mapping[str, Any]], accepted: Sequence[Mapping[str, Any]]
) -> Figure | None:
    """Evidence for every candidate as bars of the gain in BIC.

    Args:
        candidates: each with ``law``, ``place`` and ``delta_bic``.
        accepted: the accepted causes, in the same shape.

    Returns:
        Bars, the strongest on top, eighteen at most; None without any candidate.
    """
    named = {(c["law"], c["place"]): c for c in accepted}
    table = {(c["law"], c["place"]): c for c in candidates} | named
    rows = [(key, _number(row.get("delta_bic"))) for key, row in table.items()]
    rows = sorted((r for r in rows if np.isfinite(r[1])), key=lambda row: row[1])[-18:]
    if not rows:
        return None
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 0.9 + 0.3 * len(rows))
        axes = figure.subplots()
        colors = [AFTER if key in named else OTHER for key, _ in rows]
        axes.barh(range(len(rows)), [value for _, value in rows], color=colors, height=0.66)
        axes.set_yticks(range(len(rows)), [cause_words(*key) for key, _ in rows])
        axes.set_xscale("symlog", linthresh=10.0)
        reach = max(abs(value) for _, value in rows)
        low = min(0.0, *(value for _, value in rows))
        axes.set_xlim(2.5 * low if low < 0.0 else 0.0, max(30.0, 3.0 * reach))
        for i, (_, value) in enumerate(rows):
            axes.annotate(
                number_words(value, 4 if abs(value) >= 10 else 2),
                (max(value, 0.0), i),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
            )
        axes.axvline(0.0, color="#6b737c", linewidth=1.0)
        axes.axvline(10.0, color="#009e73", linewidth=1.2, linestyle=":")
        axes.set_xlabel("evidence: how much the BIC falls when the law is added (dotted: 10)")
        axes.grid(visible=False, axis="y")
    return figure


def held_out_figure(views: Sequence["RecordView"]) -> Figure | None:
    """Normalized error of every held-out channel, before and after.

    Args:
        views: channels of records; only held-out ones are drawn, ten at most.

    Returns:
        Pairs of bars, or None where nothing was held out.
    """
    chosen = [view for view in views if view.split == "held_out"][:10]
    if not chosen:
        return None
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 1.0 + 0.62 * len(chosen))
        axes = figure.subplots()
        for i, view in enumerate(chosen):
            for shift, key, color in ((-0.19, "before", BEFORE), (0.19, "after", AFTER)):
                error = 100.0 * normalized_error(view, getattr(view, key))
                label = key if i == 0 else None
                axes.barh(i + shift, error, height=0.34, color=color, label=label)
                axes.annotate(
                    f"{error:.3g} %",
                    (error, i + shift),
                    xytext=(4, 0),
                    textcoords="offset points",
                    va="center",
                )
            spread = float(np.std(view.measured)) or 1.0
            floor = 100.0 * view.noise_std / spread
            axes.plot([floor, floor], [i - 0.4, i + 0.4], color="#009e73", linewidth=2.0)
        if any(np.isfinite(view.noise_std) for view in chosen):
            axes.plot([], [], color="#009e73", linewidth=2.0, label="noise")
        axes.set_yticks(range(len(chosen)), [f"{v.record}\n{v.channel}" for v in chosen])
        axes.invert_yaxis()
        axes.set_xlim(0.0, 1.15 * axes.get_xlim()[1])
        axes.set_xlabel("error, as a share of the channel's standard deviation [%]")
        axes.grid(visible=False, axis="y")
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return figure


def force_figure(missing: Mapping[str, Any]) -> Figure:
    """Shape of the force that no law explains.

    Args:
        missing: ``place``, ``against``, ``x``, ``force``, ``unit_x`` and ``unit_force``.

    Returns:
        One panel, force against displacement, velocity or time.
    """
    with mpl.rc_context(_STYLE):
        figure = _new(7.4, 3.6)
        axes = figure.subplots()
        order = np.argsort(missing["x"])
        x, force = np.asarray(missing["x"])[order], np.asarray(missing["force"])[order]
        axes.axhline(0.0, color="#6b737c", linewidth=1.0)
        axes.plot(*envelope(x, force), color="#a0487c", linewidth=2.0)
        axes.set_xlabel(f"{missing['against']} [{unit_words(missing['unit_x'])}]")
        axes.set_ylabel(f"missing force [{unit_words(missing['unit_force'])}]")
        axes.set_title(f"At {missing['place']}")
    return figure


def error_figure(error: Mapping[str, Any]) -> Figure:
    """What a channel reads beyond what it should.

    Args:
        error: ``place``, ``against`` (reading, rate or time), ``x``, ``error``, its standard
            deviation ``std``, ``unit_x`` and ``unit_error``.

    Returns:
        One panel, the error against what it should read, its rate, or time.
    """
    words = {"reading": "what it should read", "rate": "rate of that", "time": "time"}
    with mpl.rc_context(_STYLE):
        figure = _new(7.4, 3.2)
        axes = figure.subplots()
        order = np.argsort(error["x"])
        x, y, std = (np.asarray(error[key])[order] for key in ("x", "error", "std"))
        axes.axhline(0.0, color="#6b737c", linewidth=1.0)
        if np.any(std > 0):
            axes.fill_between(x, y - std, y + std, color="#a0487c", alpha=0.2, linewidth=0)
        axes.plot(*envelope(x, y), color="#a0487c", linewidth=1.6)
        axes.set_xlabel(f"{words[error['against']]} [{unit_words(error['unit_x'])}]")
        axes.set_ylabel(f"error [{unit_words(error['unit_error'])}]")
        axes.set_title(f"{error['place']}")
    return figure


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")
