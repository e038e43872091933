"""The map: every design of a grid simulated exactly, tile by tile, with its scores and its mode."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from ..model.drives import Drive
from ..model.energies import mass_matrix
from ..model.linear import Mechanism, Port
from . import sweep_scores as score
from .sweep_designs import tile_scores
from .sweep_marks import mark_beyond, mark_changes
from .sweep_tile import Grid

TILE = 1408
"""Designs of one tile at most [-]: what a kill can lose; four make a map of 75 by 75."""

FEW = (128, 512)
"""Numbers to which fewer designs off the grid are filled up; more of them to tiles [-]."""

TILE_BYTES = 64e6
"""Samples of one tile take at most this much [byte]."""

WORKERS = 2
"""Tiles that are worked on side by side at most: the work leaves Python to numpy and jax [-]."""

KEPT_BYTES = 2**25 - 2**16
"""Size of the block that teaches the allocator to keep memory; glibc learns up to 32 MiB [byte]."""

SHAPE = "dominant_shape"
MODE_FIELDS = ("dominant_frequency", "dominant_damping_ratio")
MARKS = ("overdamped", "mode_changes")
GRIP_MARK, GRIP_PEAK = "grip_beyond", "grip_displacement_peak"


@dataclass(frozen=True)
class Axis:
    """One parameter and the values that it takes.

    Attributes:
        name: the rig's name of the parameter.
        values: shape (n,) [SI].
        unit: of the values, as text.
    """

    name: str
    values: np.ndarray
    unit: str = "1"


@dataclass(frozen=True)
class SweepTask:
    """What is asked of a grid.

    Attributes:
        mechanism: a chain or robot.
        numbers: its numbers by name [SI]; those of the axes are passed over.
        drive: what moves every design.
        times: uniform samples from 0 on, at least two, shape (t,) [s].
        window: first and last time that count [s].
        sensor: what is scored.
        scores: names out of `supple.optimize.sweep_scores.SCORES`.
        axes: the grid; the last axis runs fastest.
        planar: whether a robot moves in the plane; its modes stay those of small motions.
        grip_limit: motion of the grip beyond which designs are marked; None for no mark [m].
    """

    mechanism: Mechanism
    numbers: Mapping[str, float]
    drive: Drive
    times: np.ndarray
    window: tuple[float, float]
    sensor: Port
    scores: tuple[str, ...]
    axes: tuple[Axis, ...]
    planar: bool = False
    grip_limit: float | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Designs along each axis [-]."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def count(self) -> int:
        """Designs in all [-]."""
        return int(np.prod(self.shape))

    @property
    def tile(self) -> int:
        """Designs of one tile [-]."""
        return min(self._most, self.count)

    @property
    def _most(self) -> int:
        """Designs that are worked on together at most [-]."""
        return min(TILE, max(1, int(TILE_BYTES / (8 * len(self.times)))))

    @property
    def tiles(self) -> int:
        """Tiles in all [-]."""
        return -(-self.count // self.tile)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of what is found for every design: scores, then its dominant mode [-]."""
        return (*self.scores, *MODE_FIELDS)

    @property
    def marks(self) -> tuple[str, ...]:
        """Names of the regions that are marked [-]."""
        return MARKS if self.grip_limit is None else (*MARKS, GRIP_MARK)

    def numbers_of(self, designs: np.ndarray) -> dict[str, np.ndarray]:
        """The axes' numbers of some designs, by name, each of shape (designs,) [SI]."""
        found, stride = {}, self.count
        for axis in self.axes:
            stride //= len(axis.values)
            found[axis.name] = axis.values[(designs // stride) % len(axis.values)]
        return found

    def grid(self) -> Grid:
        """The samples that count.

        Raises:
            ValueError: for a window without at least two samples.
        """
        inside = np.flatnonzero((self.times >= self.window[0]) & (self.times <= self.window[1]))
        if len(inside) < 2:
            raise ValueError(
                f"window: expected one that holds two samples or more, found {list(self.window)} "
                f"for times from {self.times[0]:g} to {self.times[-1]:g} s. Mend: move the window."
            )
        return Grid(self.times, int(inside[0]), int(inside[-1]) + 1)


@dataclass(frozen=True)
class Sheet:
    """Where a sweep writes: one row a design; arrays in memory, or in a file that survives a kill.

    Attributes:
        fields: by name, each of shape (designs,) [SI unit of the field].
        shape: displacement part of each dominant mode, its real and imaginary parts, shape
            (designs, coordinates, 2) [1].
        marks: by name: 1 where it holds, shape (designs,) [-].
        done: 1 for each tile that is complete, shape (tiles,) [-].
    """

    fields: dict[str, np.ndarray]
    shape: np.ndarray
    marks: dict[str, np.ndarray]
    done: np.ndarray


@dataclass(frozen=True)
class Map:
    """Every design of a grid with its scores.

    Attributes:
        task: what was asked.
        scores: by name, each of the grid's shape [SI unit of the score].
        dominant_frequency: of the mode with most energy; 0 where overdamped [Hz].
        dominant_damping_ratio: of the same mode [-].
        overdamped: 1 where the mode with most energy does not oscillate [-].
        mode_changes: 1 where that mode is another one than in a neighbor along an axis [-].
        resumed: tiles that an earlier run had finished [-].
        grip_beyond: 1 where the grip moves more than the task's limit; None without one [-].
    """

    task: SweepTask
    scores: dict[str, np.ndarray]
    dominant_frequency: np.ndarray
    dominant_damping_ratio: np.ndarray
    overdamped: np.ndarray
    mode_changes: np.ndarray
    resumed: int = field(default=0)
    grip_beyond: np.ndarray | None = None

    @property
    def regions(self) -> dict[str, np.ndarray]:
        """What is marked, by name, each of the grid's shape: 1 where it holds [-]."""
        return {name: getattr(self, name) for name in self.task.marks}

    def extreme(self, name: str, lowest: bool) -> tuple[dict[str, float], float] | None:
        """The design with the lowest or highest finite value of a score [SI], and that value.

        Args:
            name: of the score.
            lowest: whether the lowest is wanted.

        Returns:
            The axes' numbers by name and the score; None where no design has a finite one.
        """
        values = np.asarray(self.scores[name]).ravel()
        usable = np.where(np.isfinite(values), values, np.inf if lowest else -np.inf)
        at = int(np.argmin(usable) if lowest else np.argmax(usable))
        if not np.isfinite(usable[at]):
            return None
        numbers = self.task.numbers_of(np.array([at]))
        return {key: float(value[0]) for key, value in numbers.items()}, float(usable[at])


def blank_sheet(task: SweepTask) -> Sheet:
    """A sheet in memory with nothing in it; its arrays carry the units of `Sheet`."""
    n = len(task.mechanism.coordinates)
    return Sheet(
        {name: np.full(task.count, np.nan) for name in task.fields},
        np.zeros((task.count, n, 2), np.float32),
        {name: np.zeros(task.count, np.int8) for name in task.marks},
        np.zeros(task.tiles, np.int8),
    )


Result = tuple[dict[str, np.ndarray], np.ndarray]
"""What a tile gives: its fields by name, and the shapes of its dominant modes."""

Workers = Callable[["TileWork", list[int]], Iterator[tuple[int, Result]]]
"""Who works on the tiles that are left; each is given back once, in any order."""


def sweep(
    task: SweepTask,
    sheet: Sheet | None = None,
    tell: Callable[[int, int], None] | None = None,
    workers: Workers | None = None,
) -> Map:
    """Simulate every design of a grid that the sheet does not hold yet, and score it.

    Args:
        task: the grid, the drive, the sensor and the scores.
        sheet: where results are kept, tile by tile; in memory where None.
        tell: hears how many tiles of how many are done.
        workers: who works on the tiles; threads of this process where None.

    Returns:
        The map; its arrays lie in the sheet.

    Raises:
        ValueError: for a score that is not known, a window without samples, a sensor or drive
            that the mechanism does not have, or a release without a balance.

    Source: tests/optimize/test_sweep.py.
    """
    _check_scores(task)
    sheet = sheet or blank_sheet(task)
    work, resumed = TileWork(task, task.grid(), _scales(task)), int(np.sum(sheet.done))
    left = np.flatnonzero(np.asarray(sheet.done) == 0).tolist()
    _keep_memory()
    for tile, (fields, shape) in (workers or _side_by_side)(work, left):
        low, high = tile * task.tile, min((tile + 1) * task.tile, task.count)
        for name, values in fields.items():
            sheet.fields[name][low:high] = values[: high - low]
        sheet.shape[low:high] = shape[: high - low]
        sheet.done[tile] = 1
        if tell is not None:
            tell(int(np.sum(sheet.done)), task.tiles)
    if tell is not None and resumed == task.tiles:
        tell(task.tiles, task.tiles)
    still = sheet.fields["dominant_frequency"]
    mark_changes(
        task.shape, still, sheet.shape, sheet.marks["overdamped"], sheet.marks["mode_changes"]
    )
    found = {name: sheet.fields[name].reshape(task.shape) for name in task.fields}
    if task.grip_limit is not None:
        mark_beyond(sheet.fields[GRIP_PEAK], task.grip_limit, sheet.marks[GRIP_MARK])
    marks = {name: sheet.marks[name].reshape(task.shape) for name in task.marks}
    scores = {name: found[name] for name in task.scores}
    return Map(
        task,
        scores,
        dominant_frequency=found["dominant_frequency"],
        dominant_damping_ratio=found["dominant_damping_ratio"],
        overdamped=marks["overdamped"],
        mode_changes=marks["mode_changes"],
        resumed=resumed,
        grip_beyond=marks.get(GRIP_MARK),
    )


@dataclass(frozen=True)
class TileWork:
    """What it takes to work on any tile of a map, here or in another process.

    Attributes:
        task: the whole.
        grid: its samples that count.
        scales: weights that make coordinates comparable, shape (coordinates,) [1/m or 1/rad].
    """

    task: SweepTask
    grid: Grid
    scales: np.ndarray

    def __call__(self, tile: int) -> Result:
        """Fields and mode shapes of one tile, filled up with its last design [SI]."""
        task = self.task
        designs = np.minimum(tile * task.tile + np.arange(task.tile), task.count - 1)
        return tile_scores(task, self.grid, self.scales, task.numbers_of(designs))


def _side_by_side(work: TileWork, tiles: list[int]) -> Iterator[tuple[int, Result]]:
    """Each of some tiles, with its fields and shapes, in their order."""
    left = iter(tiles)
    workers = min(WORKERS, os.cpu_count() or 1)
    with ThreadPoolExecutor(workers) as pool:
        ahead = deque((tile, pool.submit(work, tile)) for tile in islice(left, 2 * workers))
        try:
            while ahead:
                tile, found = ahead.popleft()
                yield tile, found.result()
                ahead.extend((tile, pool.submit(work, tile)) for tile in islice(left, 1))
        finally:
            for _, waiting in ahead:
                waiting.cancel()


def score_designs(task: SweepTask, numbers: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Scores of any designs, on the grid or off it.

    Args:
        task: as for `sweep`; of its axes only the first design is looked at.
        numbers: what differs from design to design, by name, each of shape (designs,) [SI].

    Returns:
        The task's scores by name, each of shape (designs,) [SI unit of the score].

    Raises:
        ValueError: as for `sweep`.

    Source: the same evaluation as that of `sweep`; filled up to few shapes that are compiled.
    """
    _check_scores(task)
    grid, scales = task.grid(), _scales(task)
    count = len(next(iter(numbers.values())))
    width = min(task._most, next((few for few in FEW if count <= few), TILE))
    found = {name: np.empty(count) for name in task.scores}
    for low in range(0, count, width):
        designs = np.minimum(np.arange(low, low + width), count - 1)
        fields, _ = tile_scores(
            task, grid, scales, {name: v[designs] for name, v in numbers.items()}
        )
        for name, values in found.items():
            values[low : low + width] = fields[name][: count - low]
    return found


def _keep_memory() -> None:
    """Have freed memory kept for the next array: to get it back from the system takes as long.

    glibc keeps blocks up to the largest that was ever mapped on its own and freed. This one is
    never written to.
    """
    np.empty(KEPT_BYTES, np.int8)


def _check_scores(task: SweepTask) -> None:
    unknown = [name for name in task.scores if name not in score.SCORES]
    if unknown or not task.scores:
        raise ValueError(
            f"scores: expected some of {', '.join(score.SCORES)}, found {unknown or 'none'}. "
            "Mend: name one of these."
        )


def _scales(task: SweepTask) -> np.ndarray:
    """Roots of the masses of the first design, which make coordinates comparable."""
    first = {name: float(value[0]) for name, value in task.numbers_of(np.array([0])).items()}
    n = len(task.mechanism.coordinates)
    rows = task.mechanism.rows({**task.numbers, **first})
    return np.sqrt(np.diagonal(np.asarray(mass_matrix(rows))[:n, :n]))
