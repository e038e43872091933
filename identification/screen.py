"""The screen: which laws at which places could explain the residual, before any is fitted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import jax.numpy as jnp
import numpy as np
from scipy.stats import chi2 as chi2_distribution

from ..model.law import Law, Place, Scales
from ..model.plant import numbers_vector
from ..model.respond import force_responses, pushed_tangents
from .beside import each
from .causes import numbers_at, possible_causes
from .drive_error import estimated_errors
from .evidence import held_back
from .faults import DRIVE, FaultyReading, felt, misread_along, told_motion
from .fit import Fit
from .free import Entry, law_entry, own_shapes, shape_entries
from .motions import motions
from .null_forces import Spot, unit_forces
from .prepare import Prepared
from .problem import Cause, before, sample
from .slopes import padded_lanes
from .swung import UNIT, is_swung

VISIBLE = 3.0
"""A law of natural strength that moves the records by less than this many noise units, after
projection off everything that is fitted anyway, cannot be told [-]."""


@dataclass(frozen=True)
class Candidate:
    """A law at a place, with what the residual says of it.

    Attributes:
        place: link, mass or channel.
        law: the law.
        entry: its strength as an unknown of a fit [SI].
        gain: drop of the cost that one linear step promises [-].
        p_value: chance of such a gain by noise alone, one law tried [-].
        step: strength of that step, scaled [-].
        column: its Jacobian column, projected off all that is fitted and normalized [-].
        visible: norm of the projected column at natural strength, in noise units [-].
        shapes: the law's further numbers, at the values that gain most [SI].
    """

    place: str
    law: Law
    entry: Entry
    gain: float
    p_value: float
    step: float
    column: np.ndarray
    visible: float
    shapes: tuple[Entry, ...] = ()

    @property
    def cause(self) -> Cause:
        """Place and law."""
        return self.place, self.law

    @property
    def name(self) -> str:
        """``place/law``."""
        return f"{self.place}/{self.law.name}"


def entry_of(fit: Fit, cause: Cause) -> Entry:
    """The unknown strength of a cause, with its natural size [SI]."""
    place, law = cause
    problem = fit.problem
    rotation = problem.mechanism.turns(place) if place in problem.scales else False
    scales = _scales_at(fit, cause)
    turns = rotation and not law.slot
    if law.slot == "ripple":
        turns = any(problem.mechanism.turns(joint) for joint in problem.mechanism.grounds)
    unit = law.unit(turns, _channel_unit(fit, place))
    entry = law_entry(law, place, _natural(law, scales), unit, problem.records)
    names = numbers_at(fit, place, law.replaces) if law.replaces else []
    if names:
        low = -sum(problem.rig.parameters[name].value for name in names)
        entry = replace(entry, low=low)
    return entry


def _scales_at(fit: Fit, cause: Cause) -> Scales:
    """How large motions are at a place, or readings of a channel [SI]."""
    place, law = cause
    scales = fit.problem.scales
    if is_swung(fit.problem, cause):
        return UNIT
    if not law.slot:
        return scales[place]
    channels = [c for p in fit.problem.records for c in p.record.channels if c.name == place]
    rms = float(np.mean([np.std(c.values) for c in channels])) if channels else 0.0
    rms = rms or 1.0
    return replace(next(iter(scales.values())), stretch=0.1 * rms)


def _channel_unit(fit: Fit, place: str) -> str:
    """Unit of the channels of that name; nothing where there is none [-]."""
    named = (c for p in fit.problem.records for c in p.record.channels if c.name == place)
    return next((channel.unit for channel in named), "")


def _natural(law: Law, scales: Scales) -> float:
    size = abs(law.natural(scales))
    return size if np.isfinite(size) and size > 0 else 1.0


def screen(fit: Fit, causes: Sequence[Cause] | None = None) -> list[Candidate]:
    """Score (Lagrange multiplier) test of every possible cause.

    One Jacobian column each, projected off the columns of everything that is fitted. What stands
    on a bound, and is pushed beyond it, takes nothing up.

    Args:
        fit: converged, with its noise law.
        causes: what to try; all that make sense by default.

    Returns:
        Candidates, largest gain first; p-values of one trial each.

    Source: Rao 1948, doi:10.1017/S0305004100023987; tests/identification/test_screen.py.
    """
    model = fit.model
    causes = possible_causes(fit) if causes is None else list(causes)
    residual = model.residual(fit.x)
    basis = _taken_up(fit, residual)
    trials = [trial for cause in causes for trial in trials_of(fit, cause)]
    columns = np.zeros((len(residual), len(trials)))
    for which, block in _columns(fit, trials):
        columns[: fit.count, which] = block
    columns -= basis @ (basis.T @ columns)
    best: dict[Cause, Candidate] = {}
    for trial, column in zip(trials, columns.T, strict=True):
        found = _candidate(trial, column, residual)
        before = best.get(trial.cause)
        if before is None or found.gain > before.gain:
            best[trial.cause] = found
    counts = Counter(trial.cause for trial in trials)
    several = [
        replace(found, p_value=min(1.0, found.p_value * counts[cause]))
        for cause, found in best.items()
    ]
    return sorted(several, key=lambda candidate: -candidate.gain)


def _taken_up(fit: Fit, residual: np.ndarray) -> np.ndarray:
    """Orthonormal directions of the residual that what is fitted takes up, shape (m, k) [-]."""
    if not len(fit.x):
        return np.zeros((len(residual), 0))
    jacobian = fit.model.jacobian(fit.x)
    return np.linalg.qr(jacobian[:, ~held_back(fit, jacobian, residual)])[0]


@dataclass(frozen=True)
class Attempt:
    """A cause with its strength and one choice of its shapes [SI]."""

    cause: Cause
    entry: Entry
    shapes: tuple[Entry, ...]


def trials_of(fit: Fit, cause: Cause) -> list[Attempt]:
    """A cause with each choice of its shapes that is worth a trial, strengths in SI units."""
    place, law = cause
    entry = entry_of(fit, cause)
    if not law.shapes:
        return [Attempt(cause, entry, ())]
    turns = not law.slot and fit.problem.mechanism.turns(place)
    scales, unit = _scales_at(fit, cause), _channel_unit(fit, place)
    left = _left(fit, place)
    choices = [s.sought(left) if s.sought and left else s.trials(scales) for s in law.shapes]
    if fit.model.places and law.acts and not law.rings:  # a march each: only the middle ones
        choices = [(values[len(values) // 2],) for values in choices]
    found = []
    for values in product(*choices):
        shared = shape_entries(law, place, values, turns, unit)
        own = own_shapes(law, place, [e.value for e in shared], left)
        found.append(Attempt(cause, entry, (*shared, *own)))
    return found


def _left(fit: Fit, channel: str) -> dict[str, tuple[np.ndarray, float]]:
    """What a channel shows beyond the model by record, shapes (n,) [SI], and its interval [s].

    Of the drive: how far it was from what is told, as estimated.
    """
    if channel == DRIVE:
        return estimated_errors(fit.model, fit.estimates)
    return {
        prepared.name: (fit.residual_of((prepared.name, channel)), sensor.step)
        for prepared in fit.problem.records
        for sensor in prepared.sensors
        if sensor.channel.name == channel
    }


def _columns(fit: Fit, trials: Sequence[Attempt]) -> Iterator[tuple[list[int], np.ndarray]]:
    """Whitened Jacobian columns by groups that are computed together."""
    groups: dict[str, list[int]] = {}
    for index, trial in enumerate(trials):
        place, law = trial.cause
        if law.fault is not None:
            name = "faults"
        elif is_swung(fit.problem, trial.cause):
            name = place  # its force and what sensors feel of it hang on what is told
        else:
            name = "forces" if law.acts else "channels"
        groups.setdefault(name, []).append(index)
    for name, which in groups.items():
        chosen = [trials[i] for i in which]
        if name == "forces":
            yield which, _force_columns(fit, chosen)
        elif name == "faults":
            yield which, _fault_columns(fit, chosen)
        else:
            held = tuple((shape, shape.value) for trial in chosen for shape in trial.shapes)
            wide = replace(
                fit.model,
                entries=tuple(trial.entry for trial in chosen),
                causes=fit.model.causes + tuple(trial.cause for trial in chosen),
                fixed=_held(fit) + held,
            )
            yield which, wide.jacobian(np.zeros(len(which)))[: fit.count]


def _fault_columns(fit: Fit, trials: Sequence[Attempt]) -> np.ndarray:
    """Columns of a channel's faults at their null, about what the mechanism alone says it reads.

    Allowances follow the noise in part, and a filter feels most what is fast: a fit's own columns
    are without them too.
    """
    blocks, predicted = [], fit.model.predict(fit.x)
    for prepared in fit.problem.records:
        driven = told_motion(prepared)
        for sensor in prepared.sensors:
            key = prepared.name, sensor.channel.name
            seen = predicted[key]
            block = np.zeros((len(seen), len(trials)))
            for column, trial in enumerate(trials):
                place, law = trial.cause
                if law.fault is None or not felt(place, law, sensor, driven):
                    continue
                own = [s for s in trial.shapes if s.record in (None, prepared.name)]
                numbers = (0.0, *(shape.value for shape in own))
                held = (None,) * len(own)
                past = sensor.since, sensor.gathered
                faulty = FaultyReading(law, law.fault, numbers, (0, *held), *past)
                still, scale = np.zeros((len(seen), 1)), np.array([trial.entry.scale])
                block[:, column] = faulty.along(seen, still, sensor.step, scale)[:, 0]
            blocks.append(-fit.model.noises[key].whiten(block))
    return _allowed(fit, np.concatenate(blocks))


def _allowed(fit: Fit, columns: np.ndarray) -> np.ndarray:
    """Whitened columns of all records with the allowances summed out."""
    blocks, low = [], 0
    for prepared in fit.problem.records:
        high = low + sum(len(sensor.values) for sensor in prepared.sensors)
        blocks.append(fit.model.allowed(prepared, columns[low:high]))
        low = high
    return np.concatenate(blocks)


def _force_columns(fit: Fit, trials: Sequence[Attempt]) -> np.ndarray:
    """Columns of laws at their null: responses to their forces about the motion as fitted."""
    model, problem = fit.model, fit.problem
    linear = not model.places
    tried = dict.fromkeys(trial.cause[0] for trial in trials)
    places = tuple(tried if linear else problem.mechanism.law_places())
    moved = motions(model, fit.x, places)
    rows = {place: len(moved[place]) // len(problem.records) for place in places}
    starts = dict(zip(places, np.cumsum([0, *rows.values()])[:-1], strict=True))

    def of(index: int) -> list[np.ndarray]:
        prepared = problem.records[index]
        numbers = model.numbers(prepared, fit.x)
        spots: dict[str, list[Spot]] = {}
        for place in places:
            own = moved[place][index * rows[place] : (index + 1) * rows[place]]
            _, k, c = problem.mechanism.place_rows(place, numbers, np)
            spots[place] = [
                Spot(starts[place] + row, Place(k[row], c[row], *problem.widths[place]), *motion)
                for row, motion in enumerate(own)
            ]
        forces = np.zeros((padded_lanes(len(trials)), len(prepared.inputs), sum(rows.values())))
        for law in dict.fromkeys(trial.cause[1] for trial in trials):
            at = [
                (lane, spot)
                for lane, trial in enumerate(trials)
                if trial.cause[1] == law
                for spot in spots[trial.cause[0]]
            ]
            shapes = [[shape.value for shape in trials[lane].shapes] for lane, _ in at]
            found = unit_forces(law, shapes, [spot for _, spot in at], prepared)
            for (lane, spot), force in zip(at, found, strict=True):
                forces[lane, : len(force), spot.row] = force * trials[lane].entry.scale
        plant = model.plant(prepared)
        if linear:
            plant = replace(plant, law_places=places)
            z = jnp.asarray(numbers_vector(plant, numbers))
            seen = force_responses(plant, z, jnp.asarray(forces), jnp.asarray(prepared.step))
        else:
            z, pushes = model.vector(prepared, fit.x), jnp.asarray(forces)
            inputs, *rest = model.arguments(prepared)
            seen = pushed_tangents(plant, model.substeps(prepared), z, pushes, inputs, *rest)
        seen = np.nan_to_num(np.asarray(seen)[: len(trials)], nan=0.0, posinf=0.0, neginf=0.0)
        return _misread_columns(fit, prepared, seen.transpose(1, 2, 0))

    laws = tuple(dict.fromkeys(trial.cause[1].name for trial in trials))

    def compiled(index: int) -> Hashable:
        return "forces", laws, len(trials), *model.code(problem.records[index])

    found = each(of, range(len(problem.records)), compiled)
    blocks = [block for blocks in found for block in blocks]
    return _allowed(fit, np.concatenate(blocks))


def _misread_columns(fit: Fit, prepared: Prepared, moved: np.ndarray) -> list[np.ndarray]:
    """Whitened columns of one record's channels, as the faults in force let them through.

    Args:
        fit: whose causes may be faults.
        prepared: the record.
        moved: derivatives of each sensor on the simulation's grid, shape (t, sensors, k) [SI].
    """
    model = fit.model
    still = replace(model, entries=(), fixed=_held(fit))
    grid, blocks = None, []
    for index, sensor in enumerate(prepared.sensors):
        own = moved[:, index]
        columns = sample(sensor, own)
        if faults := still.faults(prepared, sensor, np.zeros(0)):
            grid = model.grid(prepared, fit.x) if grid is None else grid
            true = grid[:, index]
            readings = before(sensor, true), sample(sensor, true)
            both, none = (before(sensor, own), columns), np.zeros(columns.shape[1])
            columns = misread_along(faults, readings, both, sensor.step, none)[1]
        noise = model.noises[prepared.name, sensor.channel.name]
        blocks.append(-noise.whiten(columns))
    return blocks


def _held(fit: Fit) -> tuple[tuple[Entry, float], ...]:
    """All entries of a fit as fixed numbers, so that only new columns are computed."""
    values = tuple((e, fit.value(i)) for i, e in enumerate(fit.model.entries))
    return fit.model.fixed + values


def _candidate(trial: Attempt, column: np.ndarray, residual: np.ndarray) -> Candidate:
    cause, entry, shapes = trial.cause, trial.entry, trial.shapes
    size = float(np.linalg.norm(column))
    if size < 1e-9:
        return Candidate(*cause, entry, 0.0, 1.0, 0.0, np.zeros_like(column), size, shapes)
    unit = column / size
    pull = -float(unit @ residual)
    step = pull / size
    if step < entry.low / entry.scale:
        step = entry.low / entry.scale
        pull = 0.0
    gain = pull**2
    chosen = sum(shape.record is not None for shape in shapes)  # by the residual, each
    p_value = float(chi2_distribution.sf(gain, 1 + chosen))
    return Candidate(*cause, entry, gain, p_value, step, unit, size, shapes)


def alikeness(first: Candidate, second: Candidate) -> float:
    """How alike two causes look in these records: cosine of their projected columns [-]."""
    return float(abs(first.column @ second.column))
