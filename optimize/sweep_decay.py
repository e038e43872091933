"""Scores of a free decay: RMS by sums over modes, peak and decrement from two of its periods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.score import FADED
from .sweep_growth import growth, less_one, powers
from .sweep_tile import CANCELS, Grid, Tile

SCORES = ("rms", "log_decrement", "peak")
"""What can be told of a decay without all of its samples."""

ROUNDS = (8, 48)
"""Up to which bin of the spectrum the largest is looked for at first, and then [-]."""

POINTS = 24
"""Points of a period, at least, between which its samples are bounded [-]."""

AROUND = 3
"""Blocks around the largest point in which the largest sample is looked for [-]."""

TOGETHER = 2**17
"""Samples that are worked on together, so that they stay near the processor [-]."""


@dataclass(frozen=True)
class Sums:
    """What modes add up to over all samples, without samples.

    Attributes:
        rms: root mean square, shape (designs,) [SI unit of the sensor].
        largest: largest bin of the spectrum, shape (designs,) [-].
        sound: whether neither has lost digits, and no other bin can be larger, shape (designs,),
            truth values [-].
    """

    rms: np.ndarray
    largest: np.ndarray
    sound: np.ndarray


def sums(tile: Tile, grid: Grid, rounds: tuple[int, ...] = ROUNDS) -> Sums:
    """Sums of the first sensor's samples, of their squares, and of their lowest bins.

    What energy is left of the samples without the known bins is all that the others can have.

    Args:
        tile: designs with one segment that fills the window, and no force in it.
        grid: the samples that count.
        rounds: up to which bin the largest is looked for, until no later one can be larger [-].

    Returns:
        The sums, by geometric series of modes and of their pairs.
    """
    count = grid.count
    share = (tile.segments[0].state * tile.seen[:, 0]).T.copy()
    first, whole = (less_one(tile.poles.T, span) for span in (grid.step, grid.step * count))
    with np.errstate(all="ignore"):
        whole_share = share * whole
        total = np.real(np.sum(whole_share / first, axis=0))
        square, size = _squares(share, first, whole)
        energy, ratio = count * square - total**2, first + 1.0
        largest, certain = np.zeros(len(energy), int), np.zeros(len(energy), bool)
        left = slice(None)
        for bins in rounds:
            lowest = _lowest(whole_share[:, left], ratio[:, left], bins, count)
            largest[left] = 1 + np.argmax(lowest, axis=0)
            certain[left] = energy[left] - 2.0 * lowest.sum(axis=0) < lowest.max(axis=0)
            left = np.flatnonzero(~certain)
            if not len(left):
                break
        return Sums(np.sqrt(square / count), largest, certain & (size <= CANCELS * square))


def _squares(
    share: np.ndarray, first: np.ndarray, whole: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sum of squared samples, and of the magnitudes of what it is made of."""
    modes = len(share)
    total, size = np.zeros(share.shape[1]), np.zeros(share.shape[1])
    for apart in range(modes // 2 + 1):
        other = (np.arange(modes) + apart) % modes
        part = share * share[other]
        part *= whole + whole[other] + whole * whole[other]
        part /= first + first[other] + first * first[other]
        twice = 1.0 if 2 * apart in (0, modes) else 2.0  # each pair once, or from both its ends
        total += twice * np.real(part).sum(axis=0)
        size += twice * np.abs(part).sum(axis=0)
    return total, size


def _lowest(whole: np.ndarray, ratio: np.ndarray, bins: int, count: int) -> np.ndarray:
    """Squared magnitudes of the first bins, (bins, designs): sums of ``whole / (1 - ratio turn)``.

    Fractions are added pair by pair: one division is as long as six products.
    """
    found = np.empty((bins, whole.shape[1]))
    for k in range(bins):
        below, above = ratio * -np.exp(-2j * np.pi * (k + 1) / count), whole
        below += 1.0
        while len(below) % 2 == 0 and len(below) > 1:
            half = len(below) // 2
            above = above[:half] * below[half:] + above[half:] * below[:half]
            below = below[:half] * below[half:]
        found[k] = np.abs(np.sum(above / below, axis=0)) ** 2
    return found


def decay_scores(
    tile: Tile, grid: Grid, names: tuple[str, ...]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Scores of the first sensor's samples, of which most are bounded and not computed.

    Args:
        tile: designs with one segment that fills the window, and no force in it.
        grid: the samples that count.
        names: out of `SCORES`.

    Returns:
        By name, each of shape (designs,) [SI unit of the score], and which designs are certain,
        shape (designs,), truth values [-]; the others are to be sampled throughout.

    Source: the definitions are those of `supple.optimize.sweep_scores`.
    """
    known = sums(tile, grid)
    found, certain = {"rms": known.rms}, known.sound.copy()
    if "peak" in names or "log_decrement" in names:
        share = tile.segments[0].state * tile.seen[:, 0]
        certain &= np.all(np.real(tile.poles) <= 0, axis=1)
        found |= {name: np.full(len(certain), np.nan) for name in ("peak", "log_decrement")}
        for one in np.unique(known.largest[certain]):
            period = int(np.round(grid.count / one))
            group = np.flatnonzero(certain & (known.largest == one))
            width = max(1, TOGETHER // period)
            for low in range(0, len(group), width):
                chosen = group[low : low + width]
                told = _followed(tile.poles[chosen], share[chosen], grid, period)
                found["peak"][chosen], found["log_decrement"][chosen], certain[chosen] = told
    return {name: found[name] for name in names}, certain


@dataclass(frozen=True)
class _Turns:
    """Whole periods of some designs: starts of each, and what leads on from a start.

    Attributes:
        starts: modes at the start of periods 0, 1, ..., shape (periods, designs, modes).
        jumps: growth of modes from a start by 0, 1, ... blocks, shape (blocks + 1, designs, modes).
        inside: growth inside a block, shape (samples, designs, modes).
        period: samples [-].
    """

    starts: np.ndarray
    jumps: np.ndarray
    inside: np.ndarray
    period: int

    def only(self, chosen: np.ndarray) -> _Turns:
        """Some of the designs."""
        starts, jumps, inside = (one[:, chosen] for one in (self.starts, self.jumps, self.inside))
        return _Turns(starts, jumps, inside, self.period)

    def samples(self, start: np.ndarray) -> np.ndarray:
        """All samples of the period with a start of shape (designs, modes)."""
        found = _together(self.jumps[:-1], start * self.inside)
        return found.reshape(len(start), -1)[:, : self.period]

    def largest(self, start: np.ndarray, points: np.ndarray, slack: np.ndarray) -> np.ndarray:
        """Largest sample of the period with a start of shape (designs, modes).

        Args:
            start: modes at its start.
            points: samples at the ends of its blocks, shape (designs, blocks + 1).
            slack: how far samples between two points can be above them, broadcast to
                (designs, blocks).

        Returns:
            Shape (designs,): out of the blocks around the largest point, or where another block
            might have a larger one out of all samples.
        """
        blocks, rows = points.shape[1] - 1, np.arange(len(points))
        if blocks <= AROUND:
            return self.samples(start).max(axis=1)
        at = points[:, :-1].argmax(axis=1)
        left = at - 1 - (points[rows, at - 1] > points[rows, at + 1])
        left = np.clip(left, 0, blocks - AROUND)
        near = start * self.jumps[left, rows]
        seen = _together(self.jumps[:AROUND], near * self.inside).reshape(len(rows), -1)
        inside = self.period - (blocks - AROUND) * len(self.inside)
        seen[left == blocks - AROUND, inside:] = -np.inf
        found = seen.max(axis=1)
        above = np.maximum(points[:, :-1], points[:, 1:]) + slack
        for k in range(AROUND):
            above[rows, left + k] = -np.inf
        unsure = np.flatnonzero(above.max(axis=1) > found)
        if len(unsure):
            found[unsure] = self.only(unsure).samples(start[unsure]).max(axis=1)
        return found


def _together(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Real part of the sum over modes of products, (terms, designs, modes) each.

    Returns:
        Shape (designs, terms of one, terms of the other).
    """
    turned = one.view(float).transpose(1, 0, 2)
    return np.matmul(turned, other.conj().view(float).transpose(1, 2, 0))


def _followed(
    poles: np.ndarray, share: np.ndarray, grid: Grid, period: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Peak, decrement and whether they are certain, of designs of one period.

    Between two points the response is no further above them than the square of their distance
    times an eighth of its largest second derivative, for which the modes' own are added up.
    """
    block = 1 << max(0, (period // POINTS).bit_length() - 1)
    blocks, whole = -(-period // block), grid.count // period
    ratio = growth(poles, grid.step)
    inside = powers(np.ones_like(poles), ratio, block)
    jumps = powers(inside[0], ratio * inside[-1], blocks + 1)
    starts = powers(share, jumps[period // block] * inside[period % block], whole + 1)
    turns = _Turns(starts, jumps, inside, period)
    first = turns.samples(starts[0])
    top = first.max(axis=1)
    most = np.maximum(top, -first.min(axis=1))
    size, bend = np.abs(starts), (grid.step * block) ** 2 / 8 * np.abs(poles) ** 2
    certain = size[0].sum(axis=1) <= CANCELS * most
    points = _together(starts[1:], jumps)
    slack = np.einsum("kdm,dm->dk", size[1:], bend)
    quiet = size[1].sum(axis=1) <= most
    if not quiet.all():
        quiet |= np.max(np.abs(points).max(axis=2) + slack, axis=1) <= most
    certain &= quiet
    if whole < 2:
        return most, np.full(len(poles), np.nan), certain
    rows, limit = np.arange(len(poles)), FADED * top
    surely = points[:, : whole - 1, :blocks].max(axis=2)
    faded = surely < limit[:, None]
    at, ends = np.argmax(faded, axis=1), faded.any(axis=1)
    last = np.where(ends, np.maximum(at, 1), whole - 1)
    at_most = np.maximum(surely[rows, at], points[rows, at, blocks]) + slack[rows, at]
    certain &= (top > 0) & (~ends | (at_most < limit))
    bottom = turns.largest(starts[last, rows], points[rows, last - 1], slack[rows, last - 1, None])
    told = (top > 0) & (bottom > 0)
    ratio = np.where(told, top, 1.0) / np.where(told, bottom, 1.0)
    return most, np.where(told, np.log(ratio) / last, np.nan), certain
