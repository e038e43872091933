"""A posterior as a reader sees it: sampled with a bar, drawn as corner and trace, told in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .engine import Progress
from .figures import _STYLE, AFTER, BEFORE, _new, data_uri
from .words import number_words, pair_words, unit_words

if TYPE_CHECKING:
    from ..identification.fit import Fit
    from ..identification.posterior import Posterior

CHECKPOINT = "posterior.unfinished.h5"
"""Beside the results: what has been sampled so far, until the posterior has converged."""

MOST_DRAWN = 6
"""Constants in a figure."""

ENSEMBLES = ("#0072b2", "#d55e00", "#009e73", "#a0487c", "#8a5a00", "#3a3f45")
"""Colors of independent ensembles."""

BAR = 28
"""Width of the bar [characters]."""


def sample_fit(
    fit: Fit, out: Path | None, seed: int, steps: int | None, progress: Progress
) -> Posterior:
    """Sample a fit's posterior, with a checkpoint in the folder for results.

    Args:
        fit: with errors attached.
        out: folder; without one nothing survives a kill.
        seed: of everything that is drawn.
        steps: the most that each ensemble may take; None for the usual number.
        progress: told what is being done.

    Returns:
        The posterior.

    Raises:
        ValueError: in the words of the door.
    """
    from ..identification.sample import Plan, sample

    plan = Plan(seed=seed) if steps is None else Plan(seed=seed, most_steps=steps)
    checkpoint = None if out is None else out / CHECKPOINT

    def tell(done: int, wanted: int) -> None:
        share = min(done / max(wanted, 1), 1.0)
        full = round(BAR * share)
        bar = "━" * full + "╌" * (BAR - full)
        progress(f"sampling {bar} {done} of about {wanted} steps")

    posterior = sample(fit, plan, checkpoint, tell)
    progress("")
    return posterior


def drop_checkpoint(out: Path | None) -> None:
    """Remove the checkpoint of a posterior that has converged and been written."""
    if out is not None:
        (out / CHECKPOINT).unlink(missing_ok=True)


def posterior_section(posterior: Posterior, told: Mapping[str, Any]) -> dict[str, Any]:
    """The section of a report: corner, traces, and a table of the gate's numbers.

    Args:
        posterior: what was sampled.
        told: what ``fit.json`` says of it.

    Returns:
        A section in the shape of those of `supple.studies.sections`, and in ``opening`` what the
        first screen says.
    """
    shown = [i for i, u in enumerate(posterior.unknowns) if u.is_constant][:MOST_DRAWN]
    drawn = []
    if shown:
        figure = corner_figure(posterior, shown)
        caption = (
            "Diagonal: density of each constant. Below it: regions that hold 39 and 86 % of the "
            "draws. Orange: the same by least squares, which may reach out of the frame. Where "
            "both differ, the posterior is not normal, or least squares counts misfit that the "
            "posterior takes for noise."
        )
        drawn.append(_drawn(figure, "Corner", caption))
        figure = trace_figure(posterior, shown)
        caption = (
            "Each color is an independent ensemble: the median of its walkers and the band of "
            "nine tenths of them at every step. Converged ensembles lie on each other and drift "
            "nowhere."
        )
        drawn.append(_drawn(figure, "Traces", caption))
    head = ["unknown", "unit", "mean ± std", "95 % interval", "R-hat", "ESS bulk", "ESS tail"]
    rows = []
    for label, one in (told["parameters"] | told["nuisances"]).items():
        interval = f"{number_words(one['low'])} to {number_words(one['high'])}"
        mean = pair_words(one["mean"], one["std"])
        gate = [number_words(one["r_hat"], 4)]
        gate += [number_words(one[name], 3) for name in ("ess_bulk", "ess_tail")]
        rows.append([label, unit_words(one["unit"]), mean, interval, *gate])
    words = [line for line in (_status_words(told), told["laplace"]["sentence"]) if line]
    words.append(f"{len(told['integrated'])} start states, offsets and zeros were integrated.")
    section = {"title": "Posterior", "words": words, "figures": drawn}
    return section | {"head": head, "rows": rows, "left": 2, "opening": _opening(told)}


def _opening(told: Mapping[str, Any]) -> str:
    """What the first screen of a report says of a posterior."""
    return f"{_status_words(told)} {told['laplace']['sentence']}".strip()


def _status_words(told: Mapping[str, Any]) -> str:
    status = str(told["status"]).rstrip(".")
    how = f"{told['ensembles']} ensembles of {told['walkers']} walkers, {told['steps']} steps"
    return f"{status[:1].upper()}{status[1:]} ({how} after the warm-up)."


def show_posterior(told: Mapping[str, Any]) -> None:
    """Print the constants' posterior as a table, and the gate's sentence under it."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("posterior", "mean", "± std", "95 % interval", "unit", "R-hat", "ESS"):
        side = "left" if heading in ("posterior", "unit") else "right"
        table.add_column(heading, justify=side, overflow="fold")
    for name, one in told["parameters"].items():
        fewest = min((one[key] or 0.0) for key in ("ess_bulk", "ess_tail"))
        table.add_row(
            name,
            f"{one['mean']:.6g}",
            f"{one['std']:.2g}",
            f"{one['low']:.5g} to {one['high']:.5g}",
            one["unit"],
            "–" if one["r_hat"] is None else f"{one['r_hat']:.3f}",
            f"{fewest:.0f}",
        )
    console.print(table)
    console.print(_opening(told))


def corner_figure(posterior: Posterior, which: Sequence[int]) -> Figure:
    """Densities of constants, one by one and in pairs, with those of least squares.

    Args:
        posterior: what was sampled.
        which: unknowns to draw.

    Returns:
        A triangle of panels.
    """
    count = len(which)
    side = min(2.6, 11.6 / count)
    with mpl.rc_context(_STYLE):
        figure = _new(side * count + 0.6, side * count + 0.4)
        grid = np.atleast_2d(figure.subplots(count, count, squeeze=False))
        draws = [posterior.draws[..., i].ravel() for i in which]
        for row in range(count):
            for column in range(count):
                axes = grid[row, column]
                if column > row:
                    axes.set_visible(False)
                    continue
                if column == row:
                    _density(axes, posterior, which[row], draws[row])
                else:
                    _pair(axes, posterior, (which[column], which[row]), draws[column], draws[row])
                _labelled(axes, posterior, which, row, column)
    return figure


def _labelled(
    axes: Axes, posterior: Posterior, which: Sequence[int], row: int, column: int
) -> None:
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(3))
    axes.tick_params(axis="x", labelrotation=35, labelsize=8)
    axes.tick_params(axis="y", labelsize=8)
    axes.tick_params(labelbottom=row == len(which) - 1, labelleft=column == 0 and row > 0)
    if row == len(which) - 1:
        axes.set_xlabel(_name(posterior, which[column]), fontsize=8)
    if column == 0 and row > 0:
        axes.set_ylabel(_name(posterior, which[row]), fontsize=8)


def _name(posterior: Posterior, index: int) -> str:
    unknown = posterior.unknowns[index]
    label = unknown.label.removeprefix("links.").removeprefix("masses.")
    unit = f" [{unit_words(unknown.unit)}]" if unknown.unit not in ("", "1") else ""
    return f"{label.replace('[', chr(10) + '[')}{unit}"


def _entry(posterior: Posterior, index: int) -> int:
    return posterior.fit.index(posterior.unknowns[index].label)


def _density(axes: Axes, posterior: Posterior, index: int, draws: np.ndarray) -> None:
    height, edges = np.histogram(draws, bins=50, density=True)
    axes.stairs(height, edges, color=AFTER, fill=True, alpha=0.25)
    axes.stairs(height, edges, color=AFTER)
    entry = _entry(posterior, index)
    value, std = posterior.fit.value(entry), posterior.fit.std(entry)
    if 0 < std < np.inf:
        x = np.linspace(edges[0], edges[-1], 200)
        normal = np.exp(-0.5 * ((x - value) / std) ** 2) / (std * np.sqrt(2 * np.pi))
        axes.plot(x, normal, "--", color=BEFORE)
    axes.set_xlim(edges[0], edges[-1])
    axes.set_yticks([])


def _pair(
    axes: Axes, posterior: Posterior, which: tuple[int, int], x: np.ndarray, y: np.ndarray
) -> None:
    from scipy.ndimage import gaussian_filter

    mass, edges_x, edges_y = np.histogram2d(x, y, bins=40)
    smooth = gaussian_filter(mass, 1.2)
    order = np.sort(smooth.ravel())[::-1]
    share = np.cumsum(order) / np.sum(order)
    levels = [float(order[np.searchsorted(share, part)]) for part in (0.865, 0.393)]
    middle = [0.5 * (edges[1:] + edges[:-1]) for edges in (edges_x, edges_y)]
    if levels[0] < levels[1]:
        top = max(float(order[0]), levels[1] * (1 + 1e-9))
        colors = ["#bcd9ea", "#6fb0d6"]
        axes.contourf(*middle, smooth.T, levels=[*levels, top], colors=colors)
    entries = [_entry(posterior, index) for index in which]
    fit = posterior.fit
    size = fit.model.scale[entries]
    spread = fit.covariance[np.ix_(entries, entries)] * np.outer(size, size)
    values, vectors = np.linalg.eigh(spread)
    turn = np.linspace(0, 2 * np.pi, 90)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    ellipse = vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)
    for radius in (1.0, 2.0):
        axes.plot(
            fit.value(entries[0]) + radius * ellipse[0],
            fit.value(entries[1]) + radius * ellipse[1],
            "--",
            color=BEFORE,
            linewidth=1.0,
        )
    axes.set_xlim(edges_x[0], edges_x[-1])
    axes.set_ylim(edges_y[0], edges_y[-1])


def trace_figure(posterior: Posterior, which: Sequence[int]) -> Figure:
    """Every ensemble against its steps: median and band of its walkers.

    Args:
        posterior: what was sampled.
        which: unknowns to draw.

    Returns:
        One panel an unknown.
    """
    steps = posterior.draws.shape[0]
    few = np.unique(np.linspace(0, steps - 1, min(steps, 240)).astype(int))
    with mpl.rc_context(_STYLE):
        figure = _new(11.6, 1.5 * len(which) + 0.5)
        grid = np.atleast_1d(figure.subplots(len(which), 1, sharex=True, squeeze=False)[:, 0])
        for axes, index in zip(grid, which, strict=True):
            for ensemble in range(posterior.draws.shape[1]):
                color = ENSEMBLES[ensemble % len(ENSEMBLES)]
                part = posterior.draws[few, ensemble, :, index]
                low, middle, high = np.quantile(part, [0.05, 0.5, 0.95], axis=1)
                axes.fill_between(few, low, high, color=color, alpha=0.12, linewidth=0)
                axes.plot(few, middle, color=color, linewidth=0.9)
            axes.set_ylabel(_name(posterior, index), fontsize=8)
            axes.margins(x=0)
        grid[-1].set_xlabel("step after the warm-up")
    return figure


def _drawn(figure: Figure, title: str, caption: str) -> dict[str, Any]:
    alt = f"Figure: {title}. {caption}"
    image = data_uri(figure)
    return {"image": image, "title": title, "caption": caption, "alt": alt, "narrow": False}
