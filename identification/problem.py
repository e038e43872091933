"""A problem is records and a rig, ready to be fitted; a model adds what varies and what acts."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from ..model.law import Law, Scales
from ..model.linear import Mechanism
from ..model.mechanism import mechanism_of
from ..model.plant import Plant, numbers_vector
from ..model.respond import simulate, still_tangents, tangents
from ..model.rig import Rig
from .allowance import Allowance, Followed, Marginal, summed_out
from .beside import each
from .faults import FaultyReading, faulty_readings, misread, misread_along, told_motion
from .free import Entry, day_entries, drive_entries, nuisance_entries, rig_entries, slot_index
from .noise import Noise, Trust
from .prepare import Prepared, Sensor, prepare_all
from .records import Record
from .shaft_form import with_shaft_form
from .slopes import Block, Slopes, padded_lanes

LONG = 2048
"""Samples from which a program of the laws that act alone is worth compiling [-]; shorter records
share one of all that fit."""

RUNAWAY = 1e3
"""A simulation that runs away counts as wrong by this many times the largest value measured [-]."""

Cause = tuple[str, Law]
Key = tuple[str, str]


@dataclass(frozen=True)
class Problem:
    """Records and a rig, ready to be fitted.

    Attributes:
        rig: as read at the door.
        mechanism: what the rig describes.
        records: the prepared records.
        widths: rounding of corners by place: (stretch [m or rad], rate [m/s or rad/s]).
        scales: natural motions and forces by place.
        floor: the quietest noise law found so far of each (record, channel) [SI].
        corner: corners of laws are rounded over this share of the root mean square motion at
            their place [-].
        left_out: names of laws that are not to be tried.
    """

    rig: Rig
    mechanism: Mechanism
    records: tuple[Prepared, ...]
    widths: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    scales: Mapping[str, Scales] = field(default_factory=dict)
    floor: Mapping[Key, Noise] = field(default_factory=dict)
    corner: float = 0.01
    left_out: frozenset[str] = frozenset()

    @cached_property
    def numbers(self) -> dict[str, float]:
        """The rig's own numbers by name [SI]."""
        return {name: number.value for name, number in self.rig.parameters.items()}

    @cached_property
    def lanes(self) -> int:
        """Directions that a Jacobian of the base and two laws needs [-].

        Smaller ones are padded to it, so that they share its compiled code.
        """
        entries = base_entries(self)
        own = [sum(e.record in (None, p.name) for e in entries) for p in self.records]
        return padded_lanes(max(own, default=0) + 2)


def make_problem(records: Sequence[Record], rig: Rig) -> Problem:
    """Prepare records for fits of a rig.

    Args:
        records: as read at the door.
        rig: as read at the door.

    Returns:
        The problem, without widths; `fit_base` finds them.

    Raises:
        ValueError: in the words of the door that a record or the rig fails.
    """
    rig = with_shaft_form(rig, records)
    mechanism = mechanism_of(rig)
    numbers = {name: number.value for name, number in rig.parameters.items()}
    return Problem(rig, mechanism, prepare_all(records, mechanism, numbers))


@dataclass(frozen=True)
class Model:
    """A problem with its entries, laws and noise: residual and Jacobian as functions of x.

    Attributes:
        problem: records and rig.
        entries: what varies.
        causes: laws in force, each with its place.
        noises: noise law of each (record, channel).
        horizon: only so many periods of each record count [-]; inf for all.
        fixed: further entries, held at the given values [SI].
        only_opening: whether only what tells the start states counts.
        allowances: by record, what is left open and summed out of whole records.
        followed: by record, a told motion as it is believed to have been.
    """

    problem: Problem
    entries: tuple[Entry, ...]
    causes: tuple[Cause, ...]
    noises: Mapping[Key, Noise] | Mapping[Key, Trust]
    horizon: float = np.inf
    fixed: tuple[tuple[Entry, float], ...] = ()
    only_opening: bool = False
    allowances: Mapping[str, Allowance] = field(default_factory=dict)
    followed: Mapping[str, Followed] = field(default_factory=dict)

    @cached_property
    def places(self) -> tuple[str, ...]:
        """Places where force laws act."""
        found = [place for place, law in self.causes if law.acts]
        return tuple(dict.fromkeys(found))

    @cached_property
    def scale(self) -> np.ndarray:
        """Natural size of each entry [SI]."""
        return np.array([entry.scale for entry in self.entries])

    def plant(self, prepared: Prepared) -> Plant:
        """The plant that simulates one record."""
        return self._wired(prepared)[0]

    @cached_property
    def _wirings(self) -> dict[int, tuple[Prepared, Plant, list[tuple[int, int]]]]:
        return {}

    def _wired(self, prepared: Prepared) -> tuple[Plant, list[tuple[int, int]]]:
        """Plant and links of one record, found when first asked for: every evaluation asks."""
        known = self._wirings.get(id(prepared))  # kept beside it, so that the number stays its own
        if known is None:
            sensors = tuple(sensor.port for sensor in prepared.sensors)
            acting = tuple(dict.fromkeys(law.name for _, law in self.causes if law.acts))
            if self.places and len(prepared.inputs) < LONG:
                acting = None
            plant = _plant(self.problem.mechanism, prepared.ports, sensors, self.places, acting)
            pairs = [(i, slot_index(plant, prepared, e)) for i, e in enumerate(self.entries)]
            known = prepared, plant, [(i, at) for i, at in pairs if at is not None]
            self._wirings[id(prepared)] = known
        return known[1:]

    def substeps(self, prepared: Prepared) -> int:
        """Steps of the integrator a sample [-]: enough for the third harmonic where laws act."""
        if not self.places:
            return 1
        turn = 2 * np.pi * prepared.frequency * prepared.step
        wanted = max(1.0, 3.0 * turn / 0.6)
        return int(min(8, 2 ** int(np.ceil(np.log2(wanted)))))

    def links(self, prepared: Prepared) -> list[tuple[int, int]]:
        """Pairs (entry, element of z) for one record."""
        return self._wired(prepared)[1]

    def vector(self, prepared: Prepared, x: np.ndarray) -> np.ndarray:
        """The plant's z [SI] for one record at scaled unknowns x."""
        plant = self.plant(prepared)
        z = numbers_vector(plant, self.problem.numbers | prepared.numbers)
        z[plant.slots["since"]] = prepared.since
        links = self.links(prepared)
        for i, at in links:
            if self.entries[i].slot == "numbers":
                z[at] = 0.0
        plant_slots = [(slot_index(plant, prepared, e), e, v) for e, v in self.fixed]
        for at, entry, _ in plant_slots:
            if at is not None and entry.slot == "numbers":
                z[at] = 0.0
        for at, _, value in plant_slots:
            if at is not None:
                z[at] += value
        for i, at in links:
            z[at] += x[i] * self.scale[i]
        return z

    def numbers(self, prepared: Prepared, x: np.ndarray) -> dict[str, float]:
        """The mechanism's numbers by name [SI] for one record at scaled unknowns x."""
        plant = self.plant(prepared)
        z = self.vector(prepared, x)[plant.slots["numbers"]]
        return dict(zip(plant.mechanism.names, (float(value) for value in z), strict=True))

    def widths(self) -> np.ndarray:
        """Rounding widths of the law places, shape (places, 2) [SI]."""
        known = self.problem.widths
        return np.array([known.get(p, (1e-6, 1e-6)) for p in self.places]).reshape(-1, 2)

    def arguments(self, prepared: Prepared) -> tuple:
        """Inputs, sampling interval [s] and widths of one record, as the simulation takes them."""
        followed = self._followed(prepared)
        inputs = prepared.inputs if followed is None else followed.inputs
        return inputs, np.asarray(prepared.step), self.widths()

    def _followed(self, prepared: Prepared) -> Followed | None:
        found = self.followed.get(prepared.name)
        lengths = [len(sensor.values) for sensor in prepared.sensors]
        return found if found is not None and found.fits(prepared.inputs, lengths) else None

    def grid(self, prepared: Prepared, x: np.ndarray, finer: int = 1) -> np.ndarray:
        """Every sensor on the simulation's grid, shape (padded, sensors + 1) [SI]."""
        substeps = self.substeps(prepared) * (finer if self.places else 1)
        z = self.vector(prepared, x)
        return np.asarray(simulate(self.plant(prepared), substeps, z, *self.arguments(prepared)))

    def predict(self, x: np.ndarray, finer: int = 1) -> dict[Key, np.ndarray]:
        """What each channel should have read by the told motions, by (record, channel) [SI]."""

        def read(prepared: Prepared) -> dict[Key, np.ndarray]:
            grid, found = self.grid(prepared, x, finer), {}
            for index, sensor in enumerate(prepared.sensors):
                seen = sample(sensor, grid[:, index])
                if faults := self.faults(prepared, sensor, x):
                    seen = misread(faults, before(sensor, grid[:, index]), seen, sensor.step)
                if (followed := self._followed(prepared)) is not None:
                    seen = seen - followed.moved[index]
                found[prepared.name, sensor.channel.name] = seen
            return found

        found: dict[Key, np.ndarray] = {}
        for one in each(read, self.problem.records, lambda p: ("read", finer, *self.code(p))):
            found |= one
        return found

    def code(self, prepared: Prepared) -> tuple[Hashable, ...]:
        """What the compiled code that simulates a record depends on, see `each`."""
        return self.plant(prepared), self.substeps(prepared), prepared.inputs.shape

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Whitened measured minus simulated of all channels, then the priors' pulls [-]."""
        parts = []
        predicted = self.predict(x)
        for prepared in self.problem.records:
            parts.append(self.allowed(prepared, self._white_gap(prepared, predicted)))
        return np.concatenate([*parts, self._prior_pull(x)])

    def _white_gap(self, prepared: Prepared, predicted: Mapping[Key, np.ndarray]) -> np.ndarray:
        """Whitened measured minus simulated of one record, its channels stacked [-]."""
        parts = []
        for sensor in prepared.sensors:
            key = prepared.name, sensor.channel.name
            gap = sensor.values - predicted[key]
            limit = RUNAWAY * np.max(np.abs(sensor.values))
            gap = np.clip(np.where(np.isfinite(gap), gap, limit), -limit, limit)
            parts.append(self._cut(prepared, sensor, self.noises[key].whiten(gap)))
        return np.concatenate(parts)

    @cached_property
    def marginals(self) -> dict[str, Marginal]:
        """What sums the allowances out, by record; none where only part of the records counts."""
        if np.isfinite(self.horizon) or self.only_opening:
            return {}
        found = {}
        for prepared in self.problem.records:
            allowance = self.allowances.get(prepared.name)
            lengths = tuple(len(sensor.values) for sensor in prepared.sensors)
            if allowance is None or allowance.lengths != lengths:  # a record that was thinned
                continue
            noises = tuple(self.noises[prepared.name, s.channel.name] for s in prepared.sensors)
            found[prepared.name] = summed_out(allowance, noises)
        return found

    def allowed(self, prepared: Prepared, white: np.ndarray) -> np.ndarray:
        """Whitened rows of one record, shape (samples, ...), its allowance summed out [-]."""
        marginal = self.marginals.get(prepared.name)
        return white if marginal is None else marginal.apply(white)

    def estimates(self, predicted: Mapping[Key, np.ndarray]) -> dict[str, np.ndarray]:
        """Best numbers of each record's allowance, in units of their priors [-]."""
        return {
            p.name: self.marginals[p.name].estimate(self._white_gap(p, predicted))
            for p in self.problem.records
            if p.name in self.marginals
        }

    def taken(self, prepared: Prepared) -> list[float]:
        """How many samples of each sensor the estimates of its record's allowance follow [-]."""
        if prepared.name not in self.marginals:
            return [0.0] * len(prepared.sensors)
        every = self.marginals[prepared.name].taken()
        ends = np.cumsum([len(sensor.values) for sensor in prepared.sensors])
        return [float(np.sum(part)) for part in np.split(every, ends[:-1])]

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Derivative of `residual`, exact, shape (residuals, entries) [-]."""
        return self.slopes(x).matrix()

    def slopes(self, x: np.ndarray) -> Slopes:
        """Derivative of `residual`, exact, by records and then priors [-]."""

        def code(prepared: Prepared) -> tuple[Hashable, ...]:
            still = self._holds_numbers(prepared)
            return "slopes", still, self._lanes(prepared), *self.code(prepared)

        blocks = each(lambda p: self._slopes(p, x), self.problem.records, code)
        pulled = np.flatnonzero(self._has_prior)
        priors = Block(np.diag(self._prior_rate()[pulled]), pulled)
        return Slopes((*blocks, priors), len(self.entries))

    def columns(self, x: np.ndarray, which: list[int]) -> np.ndarray:
        """The Jacobian's columns of some unknowns, shape (residuals, which) [-].

        The others are held: where those are the mechanism's numbers, it is the lesser work by far.
        """
        rest = [i for i in range(len(x)) if i not in which]
        held = tuple((self.entries[i], float(x[i] * self.scale[i])) for i in rest)
        asked = tuple(self.entries[i] for i in which)
        own = replace(self, entries=asked, fixed=(*self.fixed, *held))
        measured = own.jacobian(x[which])[: -sum(own._has_prior) or None]
        return np.concatenate([measured, np.diag(self._prior_rate())[self._has_prior][:, which]])

    def _slopes(self, prepared: Prepared, x: np.ndarray) -> Block:
        """One record's rows of the Jacobian, its channels stacked [-]."""
        faulty = any(law.fault is not None for _, law in self.causes)
        which = [i for i, _ in self.links(prepared)]
        grid = self.grid(prepared, x) if faulty else None
        moved, record = self.sensitivity(prepared, x), []
        for index, sensor in enumerate(prepared.sensors):
            whole = np.ascontiguousarray(moved[..., index].T)
            if faulty:  # faults' own numbers are among all of them
                wide = np.zeros((len(whole), len(self.entries)))
                wide[:, which] = whole
                whole = wide
            columns = sample(sensor, whole)
            if grid is not None and (faults := self.faults(prepared, sensor, x)):
                true, early = grid[:, index], before(sensor, whole)
                readings = before(sensor, true), sample(sensor, true)
                both = early, columns
                columns = misread_along(faults, readings, both, sensor.step, self.scale)[1]
                # as in `sensitivity`: what ran away is a constant to `residual`
                columns = np.where(np.isfinite(columns), columns, 0.0)
            noise = self.noises[prepared.name, sensor.channel.name]
            record.append(self._cut(prepared, sensor, -noise.whiten(columns)))
        rows = np.concatenate(record)
        if faulty:  # others' numbers do not move this record
            moving = np.flatnonzero(np.any(rows != 0.0, axis=0))
            rows, which = rows[:, moving], list(moving)
        return Block(rows, np.array(which, dtype=int), self.marginals.get(prepared.name))

    def _holds_numbers(self, prepared: Prepared) -> bool:
        """Whether no law acts and nothing that varies moves the mechanism's own numbers."""
        moved = (self.entries[i].slot for i, _ in self.links(prepared))
        return not self.places and "numbers" not in moved

    def _lanes(self, prepared: Prepared) -> int:
        """Directions that a record's derivatives are computed along, filled up [-]."""
        own = padded_lanes(len(self.links(prepared)))
        return own if self._holds_numbers(prepared) else max(own, self.problem.lanes)

    def sensitivity(self, prepared: Prepared, x: np.ndarray) -> np.ndarray:
        """Derivatives of the sensors' grids, shape (links, padded, sensors) [SI].

        By the scaled unknowns in `links`, in their order.
        """
        plant, links = self.plant(prepared), self.links(prepared)
        directions = np.zeros((self._lanes(prepared), plant.size))
        for lane, (i, at) in enumerate(links):
            directions[lane, at] = self.scale[i]
        z, (inputs, step, widths) = self.vector(prepared, x), self.arguments(prepared)
        if self._holds_numbers(prepared):
            moved = np.asarray(still_tangents(plant, z, directions, inputs, step))
        else:
            substeps = self.substeps(prepared)
            moved = np.asarray(tangents(plant, substeps, z, directions, inputs, step, widths))
        moved = moved[: len(links)]
        if not np.all(np.isfinite(moved)):
            # a simulation that ran away is a constant to `residual`: its slope is zero
            moved = np.where(np.isfinite(moved), moved, 0.0)
        return moved

    def faults(self, prepared: Prepared, sensor: Sensor, x: np.ndarray) -> list[FaultyReading]:
        """Faults in force on one channel of a record at scaled unknowns x [-]."""
        if all(law.fault is None for _, law in self.causes):
            return []
        driven = told_motion(prepared)
        held, values = self.fixed, x * self.scale
        return faulty_readings(
            self.causes, self.entries, values, held, sensor, driven, prepared.name
        )

    def _cut(self, prepared: Prepared, sensor: Sensor, block: np.ndarray) -> np.ndarray:
        if not np.isfinite(self.horizon) and not self.only_opening:
            return block
        seconds = self.horizon / max(prepared.frequency, 1e-9)
        if self.only_opening:
            seconds = min(seconds, prepared.opening)
        late = sensor.times > max(seconds, 24 * prepared.step)
        shape = (-1,) + (1,) * (block.ndim - 1)
        return np.where(late.reshape(shape), 0.0, block)

    @cached_property
    def _has_prior(self) -> np.ndarray:
        return np.array([np.isfinite(entry.prior) for entry in self.entries], dtype=bool)

    def _prior_rate(self) -> np.ndarray:
        return np.array([entry.scale / entry.prior for entry in self.entries])

    def _prior_pull(self, x: np.ndarray) -> np.ndarray:
        center = np.array([entry.center / entry.scale for entry in self.entries])
        return ((x - center) * self._prior_rate())[self._has_prior]


@cache
def _plant(*parts: Any) -> Plant:
    """The plant of these parts, the same one for all who ask: what hangs on it is found once."""
    return Plant(*parts)


def sample(sensor: Sensor, grid: np.ndarray) -> np.ndarray:
    """Values on the simulation's grid at a sensor's own samples, shape (n, ...) [unit]."""
    if sensor.sampling is not None:
        return sensor.sampling @ grid
    return grid[: len(sensor.values)]


def before(sensor: Sensor, grid: np.ndarray) -> np.ndarray:
    """Values on the simulation's grid at the sensor's interval before its first sample [unit]."""
    return grid[:0] if sensor.before is None else sensor.before @ grid


def base_entries(problem: Problem) -> tuple[Entry, ...]:
    """Entries of the rig's free numbers and of every record's nuisances [SI]."""
    found = list(rig_entries(problem.rig.parameters, problem.records))
    found += drive_entries(problem.records)
    for prepared in problem.records:
        found += day_entries(problem.rig.parameters, prepared)
        found += nuisance_entries(problem.mechanism, problem.numbers, prepared)
    return tuple(found)


def rough_noise(problem: Problem) -> dict[Key, Noise]:
    """White noise of a hundredth of each channel's range: weights before anything is known."""
    return {
        (p.name, s.channel.name): Noise((), max(0.01 * float(np.ptp(s.values)), 1e-300))
        for p in problem.records
        for s in p.sensors
    }
