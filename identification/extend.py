"""extend(fit, cause) -> Fit with the law in force, and its gain on records it has never seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model.law import Law
from .allowance import Allowance, joined
from .drive_error import drive_allowances, estimated_errors
from .fit import CRAWL, DOMINATED, Fit, learn_noise, solve
from .free import Entry, own_shapes
from .openings import opening_model
from .prepare import Prepared, coarser, shortened
from .problem import Key, Model, Problem, base_entries, rough_noise
from .screen import Candidate
from .sliding import in_place_of_spring

MOST_SAMPLES = 4096
WORTHWHILE = 0.3
"""Records are thinned only below this share of their length [-]: a new length is compiled anew,
which costs more than some simulations of what is there."""

LEAST_PERIODS = 6.0

NO_STEP = 0.05
"""Step of the screen below which it asks for no law [a law's natural strength]."""

UNASKED_STEP = 0.5
"""Strength that a law is tried with where no step asks for it [its natural strength]."""


@dataclass(frozen=True)
class HeldOut:
    """How well a fit foretells records that it has never seen.

    Every shared number is held. Of the record only its start state and zeros are fitted, to its
    first three periods (or its first fiftieth where it is driven); numbers that are
    ``per = "record"`` need the whole record, and so do errors of a told motion, which are
    estimated within its noise.

    Attributes:
        fit: that fit of the nuisances alone.
        errors: root mean square error of each (record, channel) [SI].
        sizes: root mean square of the measured values about their mean [SI].
        noise: marginal standard deviation of the noise [SI].
        mean_errors: mean magnitude of the error over the largest magnitude measured [-].
    """

    fit: Fit
    errors: Mapping[Key, float]
    sizes: Mapping[Key, float]
    noise: Mapping[Key, float]
    mean_errors: Mapping[Key, float]

    @property
    def nrmse(self) -> float:
        """Root mean square over all channels of error over size [-]."""
        ratios = [self.errors[key] / self.sizes[key] for key in self.errors]
        return float(np.sqrt(np.mean(np.square(ratios))))

    @property
    def noise_floor(self) -> float:
        """The same for the noise alone [-]."""
        ratios = [self.noise[key] / self.sizes[key] for key in self.noise]
        return float(np.sqrt(np.mean(np.square(ratios))))


def thinned(model: Model) -> Model:
    """The model on long records sampled more coarsely and cut short, for trials that rank."""
    problem = model.problem
    records = tuple(_cut(coarser(p)) for p in problem.records)
    longest, whole = (max(len(p.inputs) for p in some) for some in (records, problem.records))
    if longest >= WORTHWHILE * whole:
        return model
    allowances = {
        name: _at_samples(allowance, before, after)
        for before, after in zip(problem.records, records, strict=True)
        for name, allowance in model.allowances.items()
        if name == before.name
    }
    return replace(model, problem=replace(problem, records=records), allowances=allowances)


def _at_samples(allowance: Allowance, before: Prepared, after: Prepared) -> Allowance:
    """An allowance at those samples of a record that a thinned one has kept."""
    blocks = [
        block[np.searchsorted(old.times, new.times - 1e-9)]
        for block, old, new in zip(allowance.columns, before.sensors, after.sensors, strict=True)
    ]
    return replace(allowance, columns=tuple(blocks))


def _cut(prepared: Prepared) -> Prepared:
    rate = 1.0 / prepared.step
    wanted = max(MOST_SAMPLES, LEAST_PERIODS * rate / max(prepared.frequency, 1e-9))
    return shortened(prepared, int(wanted))


def extended_model(fit: Fit, candidate: Candidate) -> Model:
    """The model of a fit with a candidate's law in force."""
    cause = (candidate.place, candidate.law)
    return replace(
        fit.model,
        entries=(*fit.model.entries, candidate.entry, *candidate.shapes),
        causes=(*fit.model.causes, cause),
    )


def extend(fit: Fit, candidate: Candidate, evaluations: int = 12) -> Fit:
    """Refit everything together with the candidate's law, from more than one start.

    Args:
        fit: the fit without the law.
        candidate: the law, its place and the step that the screen proposes.
        evaluations: budget of each start.

    Returns:
        The better fit; weighed by the same noise law, so that costs compare.
    """
    model = extended_model(fit, candidate)
    low = candidate.entry.low / candidate.entry.scale
    step = float(np.clip(candidate.step, -3.0, 3.0))
    starts = [max(step, low)]
    if worst_ratio(fit) > DOMINATED:
        starts.append(UNASKED_STEP if abs(step) < NO_STEP else float(np.sign(step)))
    shapes = [shape.value / shape.scale for shape in candidate.shapes]
    points = [calmed(model, np.append(fit.x, [start, *shapes]), fit) for start in starts]
    if worst_ratio(fit) > DOMINATED:
        points += _nearest(model, in_place_of_spring(fit, candidate))
    points = [_begun(model, x) for x in points]
    if all(np.isfinite(cost) for _, cost in points):  # the openings tell which start is better
        points = [min(points, key=lambda point: point[1])]
    best: Fit | None = None
    for x, _ in points:
        if best is not None and best.cost < 0.5 * fit.cost:
            break
        trial = solve(model, x, evaluations, CRAWL)
        if best is None or trial.cost < best.cost:
            best = trial
    assert best is not None
    return best


def _nearest(model: Model, points: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The one of the unknowns that fits best as it stands; none of none."""
    return [min(points, key=lambda x: float(np.sum(model.residual(x) ** 2)))] if points else []


RUNS_AWAY = 1e4
"""Cost of a law's start beside that of the fit without it beyond which it runs away [-]."""

CALMER = 0.25
"""Share of a strength that is tried where a motion runs away with it [-]."""

MOST_CALMED = 5
"""How often, at most [-]."""


def calmed(model: Model, x: np.ndarray, fit: Fit) -> np.ndarray:
    """Unknowns of a fit and of one law more, its strength small enough for a bounded motion.

    From a motion that runs away no step leads back, and the law would be refused untried.

    Args:
        model: with the law.
        x: scaled unknowns; the law's strength is the first one that `fit` has not [-].
        fit: without it.

    Source: tests/identification/test_extend.py.
    """
    x = x.copy()
    for _ in range(MOST_CALMED):
        residual = model.residual(x)
        if float(residual @ residual) < RUNS_AWAY * fit.cost:
            break
        x[len(fit.x)] *= CALMER
    return x


def grown(model: Model, x: np.ndarray, evaluations: int) -> Fit:
    """Solve on a growing part of the records, so that long decays do not lock a cycle off.

    `x` are the scaled unknowns [-].
    """
    return solve(model, _begun(model, x)[0], evaluations, CRAWL)


def _begun(model: Model, x: np.ndarray) -> tuple[np.ndarray, float]:
    """Unknowns that fit the openings of long decays, and the cost there; infinite for others."""
    cost = np.inf
    for horizon in (4.0, 20.0):
        longest = max(p.frequency * p.count * p.step for p in model.problem.records)
        if all(p.free for p in model.problem.records) and longest > 1.5 * horizon:
            found = solve(replace(model, horizon=horizon), x, 8)
            x, cost = found.x, found.cost
    return x, cost


def worst_ratio(fit: Fit) -> float:
    """Largest misfit ratio of any channel [-]."""
    return max((misfit.ratio for misfit in fit.misfits.values()), default=1.0)


def held_out(fit: Fit, problem: Problem) -> HeldOut:
    """Foretell records that were never fitted.

    Args:
        fit: of other records of the same rig.
        problem: the held-out records.

    Returns:
        Errors with only the records' own nuisances fitted.

    Source: tests/identification/test_extend.py.
    """
    problem = replace(problem, widths=fit.problem.widths, scales=fit.problem.scales)
    shared = {e.name: (e, fit.value(i)) for i, e in enumerate(fit.model.entries) if not e.record}
    own = [e for e in base_entries(problem) if e.name not in shared]
    driven = {p.name for p in problem.records if not p.free}
    own = [_at_typical(e, fit, e.record in driven) for e in own]
    own += _own_of_laws(fit, problem)
    entries = tuple(own)
    fixed = tuple(shared.values())
    model = Model(problem, entries, fit.model.causes, rough_noise(problem), fixed=fixed)
    x = _opened(model)
    if any(entry.slot == "numbers" for entry in entries):
        x = grown(model, x, 20).x
    found = _told_motions(solve(model, x, 0))
    errors, sizes, noises, means = {}, {}, {}, {}
    for prepared in problem.records:
        for sensor in prepared.sensors:
            key = prepared.name, sensor.channel.name
            gap = found.residual_of(key)
            errors[key] = float(np.sqrt(np.mean(gap**2)))
            sizes[key] = float(np.std(sensor.values)) or 1.0
            noises[key] = found.judged[key][0].marginal_std
            means[key] = float(np.mean(np.abs(gap)) / np.max(np.abs(sensor.values)))
    return HeldOut(found, errors, sizes, noises, means)


def _opened(model: Model) -> np.ndarray:
    """Scaled unknowns [-] of records' own numbers that fit their openings.

    Where a law acts, the way to them may end elsewhere: then from what is found without it, too.
    """
    x = np.array([entry.value / entry.scale for entry in model.entries])
    near = opening_model(model)
    null = tuple((e, 0.0 if e.slot == "strengths" else value) for e, value in near.fixed)
    ways = [near]
    if any(e.slot == "strengths" and value != 0.0 for e, value in near.fixed):
        ways.append(replace(near, fixed=null))
    found = []
    for way in ways:
        at = x
        for horizon in (0.3, 1.0, np.inf):
            at = solve(replace(way, horizon=horizon), at, 20).x
        found.append(solve(near, at, 0 if way is near else 20))
    return min(found, key=lambda one: one.cost).x


def _own_of_laws(fit: Fit, problem: Problem) -> list[Entry]:
    """Numbers of laws that every record has of its own, as the records' openings show them."""
    found = []
    for place, law in fit.model.causes:
        at = [i for i, e in enumerate(fit.model.entries) if _is_of(e, place, law)]
        shared = {fit.model.entries[i].keys[-1]: fit.value(i) for i in at}
        opened = {
            p.name: (sensor.values[sensor.times <= p.opening], sensor.step)
            for p in problem.records
            for sensor in p.sensors
            if sensor.channel.name == place
        }
        known = [shared[shape.symbol] for shape in law.shapes if shape.guess is None]
        if law.slot != "ripple":
            found += own_shapes(law, place, known, opened)
            continue
        told = held_out(without(fit, place, law), problem).fit
        guessed = own_shapes(law, place, known, estimated_errors(told.model, told.estimates))
        found += [replace(one, center=one.value, prior=OWN[one.keys[2]]) for one in guessed]
    return found


OWN = {"phase": 0.05, "onset": 0.01}
"""Standard deviations of a ripple's own numbers as the whole record shows them [rad and s]; the
record's opening, in which the drive hardly moves yet, tells nothing of them."""


def _is_of(entry: Entry, place: str, law: Law) -> bool:
    """Whether an entry is a law's strength there or one of its shapes; channels' have few keys."""
    return f"{entry.name}.".startswith(f"{place}/{law.name}.")


def without(fit: Fit, place: str, law: Law) -> Fit:
    """A fit whose model has forgotten a law [SI]; nothing is fitted again.

    Source: tests/identification/test_extend.py.
    """
    keep = [i for i, e in enumerate(fit.model.entries) if not _is_of(e, place, law)]
    model = replace(
        fit.model,
        entries=tuple(fit.model.entries[i] for i in keep),
        causes=tuple(cause for cause in fit.model.causes if cause != (place, law)),
    )
    return replace(fit, model=model, x=fit.x[keep], covariance=fit.covariance[np.ix_(keep, keep)])


FELT = 0.1
"""Change of a channel, over its noise, from which records show a law at all [-]."""


def shown_by(held: HeldOut, place: str, law: Law) -> bool:
    """Whether held-out records move otherwise with a law of the model that foretells them.

    A drive's fault does nothing where nothing is driven, nor a channel's where that is missing:
    such records say neither yes nor no.

    Source: tests/identification/test_extend.py.
    """
    model = held.fit.model
    name = f"{place}/{law.name}"
    if all(entry.name != name for entry, _ in model.fixed):
        return True  # its strength is each record's own
    null = tuple((e, 0.0 if e.name == name else value) for e, value in model.fixed)
    bare = replace(model, fixed=null).predict(held.fit.x)
    whole = model.predict(held.fit.x)
    return any(
        float(np.sqrt(np.mean((whole[key] - bare[key]) ** 2))) > FELT * noise
        for key, noise in held.noise.items()
    )


def _told_motions(fit: Fit) -> Fit:
    """The fit with errors of told motions estimated, of sizes that their own noise allows.

    Nothing of the mechanism is fitted; two rounds, since they colour what first seems noise.
    """
    for _ in range(2):
        parts = drive_allowances(fit.model, fit.x)
        open_ = {name: joined(some) for name, some in parts.items()}
        if not open_:
            return fit
        allowances = {name: some for name, some in open_.items() if some is not None}
        model = replace(fit.model, noises=learn_noise(fit), allowances=allowances)
        fit = solve(model, fit.x, 0)
    return fit


def _at_typical(entry: Entry, fit: Fit, driven: bool) -> Entry:
    """What was learned of the like on fitted records: numbers start there; the rest is bound to it.

    The opening of a `driven` record tells little of a channel's zero; other records of the same
    channel tell it well. An instrument keeps its gain and its delay whatever it sees.
    """
    which = [i for i, e in enumerate(fit.model.entries) if e.name == entry.name]
    if not which:
        return entry
    values = [fit.value(i) for i in which]
    typical = float(np.median(values))
    if entry.slot == "numbers" and entry.prior == np.inf:
        return entry.at(typical)
    if entry.slot in ("gain", "delay") or (entry.slot == "offset" and driven):
        spread = max(float(np.ptp(values)), 3.0 * max(fit.std(i) for i in which))
        return replace(entry, value=typical, center=typical, prior=min(spread, entry.prior))
    return entry


def as_weighed(fit: Fit, by: Fit, evaluations: int = 25) -> Fit:
    """A fit by the weights of another one of the same records.

    Args:
        fit: where it begins.
        by: the fit whose noise laws and allowances weigh the records.
        evaluations: budget [-].

    Source: tests/identification/test_exchange.py.
    """
    own = {name: getattr(by.model, name) for name in ("noises", "allowances", "followed")}
    return solve(replace(fit.model, **own), fit.x, evaluations, CRAWL)
