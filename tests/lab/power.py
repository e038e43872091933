"""How visible a cause is: its change in noise units, and what the free constants cannot absorb."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .clubs import Club
from .gauges import clock, row_of
from .runs import Run, channels, counts_from, run_linear
from .structure import Structure

Table = Mapping[str, np.ndarray]
STEP = 1e-3  # relative step of the numerical differences
MODES_BELOW = 150.0
MOST_MODES = 6
LEAST_NORM = 10.0
LEAST_SHARE = 0.02
DETECTABLE = f"projected norm above {LEAST_NORM:g} and above {LEAST_SHARE:g} of the energy"


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
        theirs, to first order about the twin; `detectable` by both.
    """
    weighing = Weighing(club, runs, noise)
    base = weighing.stack(clean)
    change = weighing.stack(changed) - base
    left = residual(change, *nuisances(weighing, clean))
    energy = float(base @ base)
    norm, share = float(np.linalg.norm(left)), float(left @ left) / energy
    return {
        "norm": float(np.linalg.norm(change)),
        "energy_share": float(change @ change) / energy,
        "projected_norm": norm,
        "projected_energy_share": share,
        "detectable": bool(norm > LEAST_NORM and share > LEAST_SHARE),
    }


def residual(change: np.ndarray, columns: np.ndarray, priors: np.ndarray) -> np.ndarray:
    """What `columns` leave of `change` where each has a prior standard deviation (inf: none).

    The pulls of the priors are part of it, so that its square is the smallest cost.
    """
    weights = 1 / priors
    wide = np.vstack([columns, np.diag(weights)])
    target = np.concatenate([change, np.zeros(len(priors))])
    scale = np.linalg.norm(wide, axis=0)
    found = np.linalg.lstsq(wide / scale, target, rcond=1e-10)[0]
    return target - (wide / scale) @ found


def nuisances(weighing: Weighing, clean: Sequence[Table]) -> tuple[np.ndarray, np.ndarray]:
    """All columns that may absorb a change, and the prior standard deviation of each."""
    columns: list[np.ndarray] = []
    priors: list[float] = []
    for parts in (_constants(weighing), _starts(weighing), _chains(weighing, clean)):
        for column, prior in parts:
            if np.linalg.norm(column) > 1e-9:
                columns.append(column)
                priors.append(prior)
    return np.column_stack(columns), np.array(priors)


def _simulated(weighing: Weighing, structure: Structure, late: float = 0.0) -> np.ndarray:
    tables = []
    for run in weighing.runs:
        moved = run_linear(weighing.club, run, structure, late)
        tables.append(channels(weighing.club, run, structure, moved))
    return weighing.stack(tables)


def _constants(weighing: Weighing):
    """Free constants without prior, held ones within their tolerance; relative steps."""
    club = weighing.club
    base = _simulated(weighing, club.structure())
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
    for name, prior in names.items():
        structure = club.structure({name: club.truth[name] * (1 + STEP)})
        yield (_simulated(weighing, structure) - base) / STEP, prior
    if any(np.any(run.loads.angle) for run in weighing.runs):
        std = club.gauge("wrist_feedback").tolerance["delay"]
        yield (_simulated(weighing, club.structure(), STEP) - base) / STEP, std


def _starts(weighing: Weighing):
    """Free motions of the lowest modes, from each record's own start; none where it is at rest."""
    club = weighing.club
    structure = club.structure()
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
