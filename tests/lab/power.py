"""How visible a cause is: its change in noise units, and what the free constants cannot absorb."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
from scipy.optimize import least_squares

from .clubs import Club
from .gauges import clock, row_of
from .runs import Run, channels, counts_from, run_linear
from .structure import Structure

Table = Mapping[str, np.ndarray]
STEP = 1e-4  # relative step of the numerical differences
MODES_BELOW = 150.0
MOST_MODES = 6
LEAST_NORM = 10.0
LEAST_SHARE = 0.02  # of the records, as amplitudes and as energies
PASSES = 25
BOLD, FARTHEST = 0.3, 4.0  # logarithms by which a constant moves in a first step, and in all
BEGINNINGS = (0.05, 0.1, 0.2, 0.4, 1.0)  # of the records
LOOSE = 0.5  # prior of a free constant while only beginnings count [-]
LATE = "late"  # the wrist's feedback [s]


class Weighing:
    """Stacks channels of all runs, counted samples only, in units of their noise."""

    def __init__(self, club: Club, runs: Sequence[Run], noise: Sequence[Mapping[str, float]]):
        self.club, self.runs, self.noise = club, runs, noise
        self.names = [g.name for g in club.gauges if g.role == "response"]
        self.masks: list[dict[str, np.ndarray]] = []
        for run in runs:
            begin = counts_from(run, club.rate)
            times = {name: clock(club.gauge(name), club.rate, club.count) for name in self.names}
            self.masks.append({name: t >= begin for name, t in times.items()})
        sizes = [int(m[name].sum()) for m in self.masks for name in self.names]
        self.ends = np.concatenate([[0], np.cumsum(sizes)])

    def stack(self, tables: Sequence[Table]) -> np.ndarray:
        """All counted samples in noise units."""
        return np.concatenate(
            [
                table[name][mask[name]] / std[name]
                for table, mask, std in zip(tables, self.masks, self.noise, strict=True)
                for name in self.names
            ]
        )

    def beginning(self, share: float) -> np.ndarray:
        """Which stacked samples lie in the first part of what counts of their record."""
        sizes = np.diff(self.ends)
        return np.concatenate([np.arange(size) < share * size for size in sizes])

    def part(self, run: int, name: str) -> slice:
        """Where the samples of one channel of one run lie."""
        index = run * len(self.names) + self.names.index(name)
        return slice(int(self.ends[index]), int(self.ends[index + 1]))


def power(
    club: Club,
    runs: Sequence[Run],
    clean: Sequence[Table],
    changed: Sequence[Table],
    noise: Sequence[Mapping[str, float]],
) -> dict[str, float | bool]:
    """Detectability of what is hidden in the runs.

    Args:
        club: without the cause.
        runs: the tests that count.
        clean: channels of the twin without the cause, before noise [SI].
        changed: the same with it.
        noise: standard deviation of each channel in each run [SI].

    Returns:
        `norm` of the change in noise units and its `energy_share`; `projected_norm` and
        `projected_energy_share` of what is left after the free constants, the start states, the
        offsets, gains, clocks and held constants (these within their tolerances) have taken
        theirs, to first order about the twin, or where that leaves much, by a refit;
        `detectable`: the norm is above `LEAST_NORM` and above `LEAST_SHARE` of the records' own;
        `strong`: the energy is above `LEAST_SHARE` of theirs as well, which at 30 dB is a change
        twenty times the power of the noise.
    """
    weighing = Weighing(club, runs, noise)
    base = weighing.stack(clean)
    change = weighing.stack(changed) - base
    energy = float(base @ base)
    starts = _starts(weighing, club.structure())
    constants = _columns([_turned(weighing), starts, _chains(weighing, clean)])
    least = residual(change, *constants)
    if least @ least > LEAST_SHARE**2 * energy:  # so large a change is no step from the twin
        linear, least = least, refitted(weighing, clean, change)
        if least @ least > max(linear @ linear, LEAST_SHARE**2 * energy):  # it lost its way
            straight = refitted(weighing, clean, change, (1.0,))
            least = min(least, straight, key=lambda one: one @ one)
    norm, share = float(np.linalg.norm(least)), float(least @ least) / energy
    return {
        "norm": float(np.linalg.norm(change)),
        "energy_share": float(change @ change) / energy,
        "projected_norm": norm,
        "projected_energy_share": share,
        "detectable": bool(norm > LEAST_NORM and share > LEAST_SHARE**2),
        "strong": bool(norm > LEAST_NORM and share > LEAST_SHARE),
    }


def refitted(
    weighing: Weighing,
    clean: Sequence[Table],
    change: np.ndarray,
    beginnings: Sequence[float] = BEGINNINGS,
) -> np.ndarray:
    """What the constants of a club leave of a change, by least squares in a region of trust.

    One step from the twin does not do: a spring that moves a frequency by a tenth is a change
    of phase by many turns in a record, and yet only another constant. So the constants are found
    on the beginnings of the records first, where each free one is held loosely. By their
    logarithms: a sleeve that relaxes is one of eight times the damping.
    """
    constants = _constants(weighing)
    priors = np.array([prior for _, prior in constants])
    late = np.array([name == LATE for name, _ in constants])
    still = _simulated(weighing, constants, np.zeros(len(constants)))

    def moves(x: np.ndarray) -> np.ndarray:
        return np.where(late, x * np.where(late, priors, 0.0), np.expm1(np.where(late, 0.0, x)))

    def left_at(x: np.ndarray, mine: np.ndarray, held: np.ndarray, away: _Away) -> np.ndarray:
        """What is left at these constants, the pulls of their priors last."""
        seen = _simulated(weighing, constants, moves(x)) - still
        return np.append(away(change[mine] - seen[mine]), np.where(late, x, moves(x) / held))

    def slopes(x: np.ndarray, *rest) -> np.ndarray:
        here, rows = left_at(x, *rest), STEP * np.eye(len(x))
        return np.array([(left_at(x + row, *rest) - here) / STEP for row in rows]).T

    x, left = np.zeros(len(constants)), change
    for share in beginnings:
        mine = weighing.beginning(share)
        held = np.minimum(priors, LOOSE if share < 1.0 else np.inf)
        starts = _starts(weighing, _moved(weighing.club, constants, moves(x))[0])
        others, their_priors = _columns([starts, _chains(weighing, clean)])
        away = _Away(others[mine], their_priors)
        run = least_squares(
            left_at, x, cast(Any, slopes), args=(mine, held, away), x_scale=BOLD, ftol=1e-3,
            bounds=(-FARTHEST, FARTHEST), max_nfev=PASSES,
        )  # fmt: skip
        x, left = run.x, run.fun
    return left


class _Away:
    """Takes columns, each with a prior standard deviation, out of what they may explain."""

    def __init__(self, columns: np.ndarray, priors: np.ndarray):
        wide = np.vstack([columns, np.diag(1 / priors)])
        basis, sizes, _ = np.linalg.svd(wide / np.linalg.norm(wide, axis=0), full_matrices=False)
        self.basis, self.pulls = basis[:, sizes > 1e-10 * sizes[0]], np.zeros(len(priors))

    def __call__(self, change: np.ndarray) -> np.ndarray:
        target = np.append(change, self.pulls)
        return target - self.basis @ (self.basis.T @ target)


def residual(change: np.ndarray, columns: np.ndarray, priors: np.ndarray) -> np.ndarray:
    """What `columns` leave of `change` where each has a prior standard deviation (inf: none).

    The pulls of the priors are part of it, so that its square is the smallest cost.
    """
    return _Away(columns, priors)(change)


def _columns(parts) -> tuple[np.ndarray, np.ndarray]:
    """All columns that may absorb a change, and the prior standard deviation of each."""
    kept = [(c, p) for part in parts for c, p in part if np.linalg.norm(c) > 1e-9]
    return np.column_stack([c for c, _ in kept]), np.array([p for _, p in kept])


def _simulated(
    weighing: Weighing, constants: Sequence[tuple[str, float]], moves: np.ndarray
) -> np.ndarray:
    """Stacked channels where constants moved by these shares, and `LATE` by seconds."""
    club, tables = weighing.club, []
    structure, behind = _moved(club, constants, moves)
    for run in weighing.runs:
        moved = run_linear(club, run, structure, behind)
        tables.append(channels(club, run, structure, moved))
    return weighing.stack(tables)


def _moved(
    club: Club, constants: Sequence[tuple[str, float]], moves: np.ndarray
) -> tuple[Structure, float]:
    """The club with constants moved, and how late its drive is [s]; see `_simulated`."""
    shares = dict(zip([name for name, _ in constants], moves, strict=True))
    late = shares.pop(LATE, 0.0)
    return club.structure({name: club.truth[name] * (1 + by) for name, by in shares.items()}), late


def _turned(weighing: Weighing):
    """What each constant's own move does at the twin, with its prior."""
    constants = _constants(weighing)
    here = _simulated(weighing, constants, np.zeros(len(constants)))
    for row, (_, prior) in zip(np.eye(len(constants)), constants, strict=True):
        yield (_simulated(weighing, constants, STEP * row) - here) / STEP, prior


def _constants(weighing: Weighing) -> list[tuple[str, float]]:
    """Free constants without prior, held ones within their tolerance, each by its share [-]."""
    club = weighing.club
    names = {name: np.inf for name in club.free}
    if club.bench == "B":  # by the names of the elements
        named = {"shaft_damping": "shaft_ratio", "clubhead_mass": "clamped_hertz"}
        names = {named.get(name, name): prior for name, prior in names.items()}
    else:
        named = {}
    for name, std in club.known.items():
        own = named.get(name, name)
        factor = 0.5 if own == "clamped_hertz" else 1.0  # the frequency goes by the root of it
        names[own] = factor * std / abs(club.told[name])
    if any(np.any(run.loads.angle) for run in weighing.runs):
        names[LATE] = club.gauge("wrist_feedback").tolerance["delay"]
    return list(names.items())


def _starts(weighing: Weighing, structure: Structure):
    """Free motions of the lowest modes, from each record's own start; none where it is at rest."""
    club = weighing.club
    roots, shapes = np.linalg.eig(structure.state_matrix())
    wanted = np.flatnonzero((np.imag(roots) >= 0) & (np.abs(roots) < 2 * np.pi * MODES_BELOW))
    wanted = wanted[np.argsort(np.abs(roots[wanted]))][:MOST_MODES]
    for index, run in enumerate(weighing.runs):
        if run.kind == "driven":
            continue
        begin = counts_from(run, club.rate)
        for which in wanted:
            parts: dict[str, np.ndarray] = {}
            for name in weighing.names:
                gauge = club.gauge(name)
                times = clock(gauge, club.rate, club.count)[weighing.masks[index][name]] - begin
                order = structure.views[gauge.view].order
                seen = row_of(gauge, structure) @ shapes[: structure.size, which]
                reply = seen * roots[which] ** order * np.exp(roots[which] * times)
                parts[name] = reply / weighing.noise[index][name]
            for pick in (np.real, np.imag):
                column = np.zeros(weighing.ends[-1])
                for name, reply in parts.items():
                    column[weighing.part(index, name)] = pick(reply)
                yield column, np.inf


def _chains(weighing: Weighing, clean: Sequence[Table]):
    """Offset and clock of each channel in each record, and its gain in all, within tolerances."""
    for name in weighing.names:
        gauge = weighing.club.gauge(name)
        whole = np.zeros(weighing.ends[-1])
        for index, table in enumerate(clean):
            mine, mask = weighing.part(index, name), weighing.masks[index][name]
            std = weighing.noise[index][name]
            whole[mine] = table[name][mask] / std
            one = np.zeros(weighing.ends[-1])
            one[mine] = 1 / std
            yield one, gauge.tolerance.get("offset", 1e-12)
            if "delay" in gauge.tolerance:
                late = np.zeros(weighing.ends[-1])
                late[mine] = -np.gradient(table[name], 1 / gauge.rate)[mask] / std
                yield late, gauge.tolerance["delay"]
        if "gain" in gauge.tolerance:
            yield whole, gauge.tolerance["gain"]
