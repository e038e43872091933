"""fit(records, rig) -> Fit: bounded least squares with exact Jacobians over all records at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .allowance import Allowance, Used, joined, used
from .descent import descend, spring_pairs
from .drive_error import drive_allowances, followed_motions, has_told_motion
from .errors import covariance_of
from .lever import lever_allowances
from .motions import with_scales
from .noise import Misfit, Noise, Trust, choose_noise, colour_of, known_noise
from .openings import opening_model
from .prepare import Sensor
from .problem import Key, Model, Problem, base_entries
from .ringing import find_ringing, ringing_allowances
from .ripple_form import ripple_allowances

CONVERGED = "The fit has converged."
STOPPED = "The fit stopped before it converged: more iterations or better start values are needed."


@dataclass(frozen=True)
class Fit:
    """A model with its best numbers.

    Attributes:
        model: what was fitted.
        x: best unknowns, in units of their scales [-].
        covariance: of the scaled unknowns [-]; coloured misfit is taken into account.
        predicted: what each channel should have read, by (record, channel) [SI].
        cost: sum of squared whitened residuals and prior pulls [-].
        count: number of measured samples that count [-].
        status: one sentence.
        step_error: change of the response when the integrator's step is halved, in noise units.
        estimates: best numbers of each record's allowance, in units of their priors [-].
        taken: of each channel, how many samples these follow [-]; what is left of it is quieter
            than its noise by as much.
    """

    model: Model
    x: np.ndarray
    covariance: np.ndarray
    predicted: Mapping[Key, np.ndarray]
    cost: float
    count: int
    status: str
    step_error: float = 0.0
    estimates: Mapping[str, np.ndarray] = field(default_factory=dict)
    taken: Mapping[Key, float] = field(default_factory=dict)

    @property
    def problem(self) -> Problem:
        """Records and rig."""
        return self.model.problem

    @property
    def converged(self) -> bool:
        """Whether the numbers may be trusted as a minimum."""
        return self.status == CONVERGED

    def value(self, index: int) -> float:
        """Best value of entry `index` [SI]."""
        return float(self.x[index] * self.model.scale[index])

    def std(self, index: int) -> float:
        """Standard error of entry `index` [SI]."""
        return float(np.sqrt(max(self.covariance[index, index], 0.0)) * self.model.scale[index])

    def index(self, label: str) -> int:
        """Where the entry with this label stands [-]."""
        return [entry.label for entry in self.model.entries].index(label)

    def sensor_of(self, key: Key) -> Sensor:
        """The measured channel of one (record, channel) [SI]."""
        for prepared in self.problem.records:
            for sensor in prepared.sensors:
                if (prepared.name, sensor.channel.name) == key:
                    return sensor
        raise KeyError(key)

    def residual_of(self, key: Key) -> np.ndarray:
        """Measured minus simulated of one (record, channel) [SI]."""
        return self.sensor_of(key).values - self.predicted[key]

    @cached_property
    def judged(self) -> dict[Key, tuple[Noise, Misfit]]:
        """Noise law [SI] that each (record, channel) shows, and the misfit against it."""
        found = {}
        for key in self.keys:
            sensor, taken = self.sensor_of(key), self.taken.get(key, 0.0)
            louder = np.sqrt(len(sensor.values) / max(len(sensor.values) - taken, 1.0))
            said = sensor.values - louder * self.residual_of(key)
            found[key] = noise_of(sensor, said)
        return found

    @cached_property
    def misfits(self) -> dict[Key, Misfit]:
        """Absolute misfit of each (record, channel), against the noise that its residual shows."""
        return {key: misfit for key, (_, misfit) in self.judged.items()}

    @cached_property
    def keys(self) -> tuple[Key, ...]:
        """All (record, channel) pairs."""
        return tuple((p.name, s.channel.name) for p in self.problem.records for s in p.sensors)

    @cached_property
    def used(self) -> list[Used]:
        """How far what is left open of each record had to go, in units of its priors [-]."""
        open_ = self.model.allowances
        return [u for name, e in self.estimates.items() for u in used(name, open_[name], e)]

    @property
    def reduced_chi2(self) -> float:
        """Squared whitened residuals over samples less unknowns [-]."""
        return self.cost / max(1, self.count - len(self.x))


def solve(model: Model, start: np.ndarray, evaluations: int = 40, crawling: float = 0.0) -> Fit:
    """Least squares from one start.

    Args:
        model: what is fitted, with the noise law that weights it.
        start: scaled unknowns [-].
        evaluations: the most that the trust region may take.
        crawling: share of the cost below which twelve of its steps are given up [-].

    Returns:
        The fit, its noise law unchanged; `status` says whether it converged.
    """
    low = np.array([entry.low / entry.scale for entry in model.entries])
    high = np.array([entry.high / entry.scale for entry in model.entries])
    inside = np.clip(start, low, high)
    if len(inside) == 0 or evaluations == 0:
        return _finish(model, inside, True)
    positive = [e.slot == "numbers" and e.low >= 0.0 for e in model.entries]
    pairs = spring_pairs([entry.label for entry in model.entries], positive)
    bounds = (low, high)
    run = descend(
        model.residual, model.slopes, inside, bounds, pairs, evaluations, crawling=crawling
    )
    return _finish(model, run.x, run.converged)


def constants_held(model: Model, x: np.ndarray, evaluations: int) -> np.ndarray:
    """Unknowns of the best fit by all but the rig's shared constants.

    Args:
        model: any.
        x: where it begins, scaled [-].
        evaluations: of the residual, at most.

    Returns:
        Scaled unknowns [-].
    """
    shared = [i for i, e in enumerate(model.entries) if e.slot == "numbers" and e.record is None]
    own = [i for i in range(len(model.entries)) if i not in set(shared)]
    held = tuple((model.entries[i], float(x[i] * model.scale[i])) for i in shared)
    near = replace(model, entries=tuple(model.entries[i] for i in own), fixed=(*model.fixed, *held))
    best = x.copy()
    best[own] = solve(near, x[own], evaluations).x
    return best


def _finish(model: Model, x: np.ndarray, converged: bool) -> Fit:
    predicted = model.predict(x)
    estimates, taken = model.estimates(predicted), {}
    for prepared in model.problem.records:
        if prepared.name in estimates:
            allowance = model.allowances[prepared.name]
            numbers = estimates[prepared.name] * allowance.priors
            parts = zip(prepared.sensors, allowance.columns, model.taken(prepared), strict=True)
            for sensor, block, count in parts:
                key = prepared.name, sensor.channel.name
                predicted[key] = predicted[key] + block @ numbers
                taken[key] = count
    count = sum(len(s.values) for p in model.problem.records for s in p.sensors)
    cost = float(np.sum(model.residual(x) ** 2))
    status = CONVERGED if converged else STOPPED
    empty = np.zeros((len(x), len(x)))
    return Fit(model, x, empty, predicted, cost, count, status, 0.0, estimates, taken)


def noise_of(sensor: Sensor, predicted: np.ndarray) -> tuple[Noise, Misfit]:
    """Noise law [SI] and absolute misfit of a channel, from its residual or as its sidecar says."""
    residual = sensor.values - predicted
    if sensor.channel.noise is not None:
        return known_noise(residual, sensor.channel.noise)
    return choose_noise(residual, predicted)


def learn_noise(fit: Fit) -> dict[Key, Noise]:
    """Noise law of every channel out of the residuals of a fit.

    Args:
        fit: any fit. A quieter noise than its problem's floor replaces that; a louder never does.

    Returns:
        The noise law by (record, channel) [SI].
    """
    found, floor = {}, fit.problem.floor
    for key in fit.keys:
        noise, _ = fit.judged[key]
        if key in floor and floor[key].marginal_std < 0.95 * noise.marginal_std:
            noise = floor[key]
        found[key] = noise
    return found


def with_errors(fit: Fit) -> Fit:
    """The fit with its covariance, see `covariance_of`."""
    if len(fit.x) == 0:
        return fit
    return replace(fit, covariance=covariance_of(fit.model, fit.x, fit.cost, fit.misfits))


DOMINATED = 10.0
"""Misfit ratio beyond which errors of the model, not noise, are what a fit should spread [-]."""


def dominated(fit: Fit) -> bool:
    """Whether errors of the model, not noise, are what some channel shows."""
    return any(misfit.ratio > DOMINATED for misfit in fit.misfits.values())


def with_known_starts(model: Model, x: np.ndarray) -> tuple[Model, np.ndarray]:
    """Bind the start state of driven records to what their first samples say.

    Otherwise a start that never was (a carriage thrown at rest) hides errors of the model. What
    they say hangs on the model: where it has grown or its constants have moved, anew.

    Args:
        model: whose start states may be bound already.
        x: scaled unknowns [-].

    Returns:
        The model with other priors, and the unknowns at their centers [-].

    Source: tests/identification/test_allowance.py.
    """
    driven = {p.name for p in model.problem.records if not p.free}
    which = [i for i, e in enumerate(model.entries) if e.slot == "start" and e.record in driven]
    if not which:
        return model, x
    chosen = set(which)
    rest = [i for i in range(len(model.entries)) if i not in chosen]
    held = tuple((model.entries[i], float(x[i] * model.scale[i])) for i in rest)
    unbound = {entry.label: entry for entry in base_entries(model.problem)}
    own = [(model.entries[i], unbound[model.entries[i].label]) for i in which]
    own = [replace(entry, center=first.center, prior=first.prior) for entry, first in own]
    near = opening_model(replace(model, entries=tuple(own), fixed=(*model.fixed, *held)))
    started = solve(near, x[which], 10)
    jacobian = near.jacobian(started.x)
    spread = np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)))
    entries, x = list(model.entries), x.copy()
    for k, i in enumerate(which):
        entries[i] = own[k]
        std = max(spread[k], 1e-6) * own[k].scale
        if std < own[k].prior:
            entries[i] = replace(own[k], center=started.x[k] * own[k].scale, prior=std)
            x[i] = started.x[k]
    return replace(model, entries=tuple(entries)), x


def _alike(new: Noise, old: Noise | Trust) -> bool:
    if isinstance(old, Trust):
        return False
    close = abs(np.log(new.std / old.std)) < 0.03 and new.law == old.law
    return close and np.allclose(new.coefficients, old.coefficients, atol=0.02)


def weights_of(fit: Fit, noises: Mapping[Key, Noise]) -> dict[Key, Noise]:
    """Noise laws [SI] to weigh by: where errors of the model dominate a channel, their own."""
    return {
        key: colour_of(fit.residual_of(key)) if fit.misfits[key].ratio > DOMINATED else noise
        for key, noise in noises.items()
    }


def allowances_of(model: Model, fit: Fit) -> dict[str, Allowance]:
    """What each record leaves open: errors of told motions, a club's next mode, what is lumped.

    Args:
        model: with the noise laws that weigh.
        fit: of the same records.

    Returns:
        Allowances by record.
    """
    parts = drive_allowances(model, fit.x)
    predicted = fit.model.predict(fit.x)
    left = {key: fit.sensor_of(key).values - predicted[key] for key in fit.keys}
    ringing = find_ringing(model, left)
    if ringing is not None:
        for name, part in ringing_allowances(model, ringing).items():
            parts.setdefault(name, []).append(part)
    for name, part in lever_allowances(model, fit.x).items():
        parts.setdefault(name, []).append(part)
    for name, part in ripple_allowances(model, fit.x, left).items():
        parts.setdefault(name, []).append(part)
    found = {name: joined(some) for name, some in parts.items()}
    return {name: some for name, some in found.items() if some is not None}


DESCENTS = 3
"""Rounds of noise learned and fit repeated on the way down, at most [-]."""


def descended(fit: Fit) -> Fit:
    """The fit weighed by the instruments' noise alone, whatever errors of the model are left.

    Weights by the misfit's own spectrum forgive slow errors. Where a model can follow the records
    they hide it: the way down leads past them.
    """
    for _ in range(DESCENTS):
        floor = learn_noise(fit)
        problem = replace(fit.problem, floor=floor)
        model = replace(fit.model, problem=problem, noises=floor, horizon=np.inf)
        fit = solve(replace(model, allowances=allowances_of(model, fit)), fit.x, 40, ROUGH_CRAWL)
        if all(misfit.ratio < DOMINATED for misfit in fit.misfits.values()):
            break
    return fit


def loudness(fit: Fit) -> float:
    """Squared misfit of all channels in units of the instruments' noise [-]."""
    floor = {key: noise.marginal_std for key, noise in learn_noise(fit).items()}
    return sum(float(np.sum(fit.residual_of(key) ** 2)) / floor[key] ** 2 for key in fit.keys)


PATIENCE = 200
"""Evaluations that a last fit may take [-]: where two constants trade off along a bent valley, as
a stiff sleeve and a soft shaft do, each step is short."""


def settle(fit: Fit, at_last: bool = True, crawling: float = 0.0) -> Fit:
    """Learn the noise law, weigh by it, fit again, and attach errors and scales.

    Args:
        fit: any.
        at_last: whether to go on to the very minimum; of a law that is only tried nobody needs it.
        crawling: share of the cost below which that is given up where errors of the model dominate
            [-].
    """
    for _ in range(3):
        floor = learn_noise(fit)
        model, x = with_known_starts(fit.model, fit.x)
        # errors of told motions that nobody has estimated yet are not errors of the model
        bare = not fit.model.allowances and has_told_motion(fit.model)
        noises = floor if bare else weights_of(fit, floor)
        before = fit.model.noises
        same = all(_alike(noises[key], before[key]) for key in noises)
        problem = replace(fit.problem, floor=floor)
        model = replace(model, problem=problem, noises=noises, horizon=np.inf)
        model = replace(model, allowances=allowances_of(model, fit))
        model = replace(model, followed=followed_motions(model, model.estimates(model.predict(x))))
        fit = solve(model, x, 40, CRAWL if at_last or not dominated(fit) else ROUGH_CRAWL)
        if same:
            break
    if not fit.converged and at_last:
        fit = solve(fit.model, fit.x, PATIENCE, crawling if dominated(fit) else 0.0)
    return _with_scales(fit)


def _with_scales(fit: Fit) -> Fit:
    problem = with_scales(fit.model, fit.x)
    return with_errors(replace(fit, model=replace(fit.model, problem=problem)))


CRAWL = 2e-4
"""Share of the cost that twelve steps must gain [-], until a law is accepted or noise is known."""

ROUGH_CRAWL = 1e-3
"""The same of a law's trial where errors of the model dominate [-]: nothing hangs on less there."""


def polished(fit: Fit) -> Fit:
    """A fit at its very minimum, as far as patience leads, with its errors."""
    if fit.converged:
        return fit
    return _with_scales(solve(fit.model, fit.x, PATIENCE))
