"""A batch of designs at a time from optuna's samplers: what does not change in it is done once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import cmaes
import numpy as np
import optuna
from optuna._transform import _SearchSpaceTransform
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution
from optuna.samplers import CmaEsSampler, GPSampler, NSGAIISampler, RandomSampler, TPESampler
from optuna.samplers._tpe import sampler as tpe
from optuna.samplers._tpe.parzen_estimator import _ParzenEstimator
from optuna.storages import InMemoryStorage
from optuna.study import Study, StudyDirection
from optuna.trial import FrozenTrial, TrialState
from scipy.special import ndtr, ndtri
from scipy.stats import qmc

from .search_spec import Choice, Range

Space = dict[str, BaseDistribution]
Draw = dict[str, Any]

STARTUP = 10
"""Finished designs without which TPE and a Gaussian process have too little to learn from [-]."""

CANDIDATES = 24
"""Points that TPE draws for each design that it proposes [-]; optuna's own choice."""

ROWS = 64
"""Candidates whose densities are worked out together, so that they stay near the processor [-]."""


def space_of(ranges: Sequence[Range], choices: Sequence[Choice]) -> Space:
    """What optuna is told of ranges and choices; a choice is among the names of its parts."""
    space: Space = {
        one.name: FloatDistribution(one.low, one.high, log=one.is_log) for one in ranges
    }
    return space | {one.name: CategoricalDistribution(one.parts) for one in choices}


class _Known(InMemoryStorage):
    """The trials that a sampler may look at, without a copy of each."""

    def __init__(self) -> None:
        super().__init__()
        self.trials: list[FrozenTrial] = []

    def get_all_trials(
        self, study_id: int, deepcopy: bool = True, states: Any = None
    ) -> list[FrozenTrial]:
        if states is None:
            return list(self.trials)
        return [trial for trial in self.trials if trial.state in states]


class Sampler:
    """Draws batches: each from its number, the seed and earlier trials alone, so it can be redone.

    Args:
        kind: one of `supple.optimize.search_spec.SAMPLERS`.
        space: what may vary.
        directions: ``minimize`` or ``maximize`` of each objective.
        batch: designs of a whole batch [-].
        ahead: batches that may be under way at the same time [-].
        seed: of everything that is drawn by chance [-].
    """

    def __init__(
        self,
        kind: str,
        space: Space,
        directions: Sequence[str],
        batch: int,
        ahead: int,
        seed: int,
    ) -> None:
        self.space = {name: one for name, one in space.items() if not one.single()}
        self.single: Draw = {
            name: one.choices[0] if isinstance(one, CategoricalDistribution) else None
            for name, one in space.items()
            if one.single()
        }
        self.directions, self.batch, self.ahead, self.seed = directions, batch, ahead, seed
        self.known = _Known()
        self.study = _study(self.known, directions)
        kinds: dict[str, Callable[[int, int, list[list[FrozenTrial]]], list[Draw]]] = {
            "tpe": self._tpe,
            "cmaes": self._cmaes,
            "nsga2": self._nsga2,
            "gp": self._gp,
        }
        self._draw = kinds[kind]
        self._optimizer: tuple[int, Any] = (0, None)
        self._chosen = 0  # generations whose parents are known

    def draw(self, number: int, count: int, batches: list[list[FrozenTrial]]) -> list[Draw]:
        """The designs of a batch.

        Args:
            number: of the batch, from 0 on [-].
            count: designs wanted [-].
            batches: trials of the batches that it may learn from: all but the last `ahead`.

        Returns:
            One value for each name of the space and each design [SI, or the name of a part].
        """
        self.known.trials = [trial for batch in batches for trial in batch]
        self.study._thread_local.cached_all_trials = None
        if number < self.ahead:
            found = self._spread(number, count)
        else:
            found = self._draw(number, count, batches)
        return [self.single | one for one in found]

    def _word(self, number: int) -> int:
        """A seed for one batch; batches and seeds do not share any."""
        return int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0])

    def _spread(self, number: int, count: int) -> list[Draw]:
        """Designs that spread over the space: a Latin hypercube."""
        generator = np.random.default_rng([self.seed, number])
        points = qmc.LatinHypercube(len(self.space), rng=generator).random(count)
        return [self._placed(point) for point in points]

    def _placed(self, point: np.ndarray) -> Draw:
        found: Draw = {}
        for part, (name, one) in zip(point, self.space.items(), strict=True):
            if isinstance(one, CategoricalDistribution):
                found[name] = one.choices[min(int(part * len(one.choices)), len(one.choices) - 1)]
            elif isinstance(one, FloatDistribution):
                low, high = (np.log(one.low), np.log(one.high)) if one.log else (one.low, one.high)
                value = low + part * (high - low)
                value = float(np.exp(value) if one.log else value)
                found[name] = min(max(value, one.low), one.high)
        return found

    def _tpe(self, number: int, count: int, batches: list[list[FrozenTrial]]) -> list[Draw]:
        """Tree-structured Parzen estimators, built once for the whole batch."""
        trials = [t for t in self.known.trials if t.state == TrialState.COMPLETE]
        if len(trials) < STARTUP:
            return self._spread(number, count)
        sampler = TPESampler(
            seed=self._word(number),
            multivariate=True,
            constant_liar=False,
            n_startup_trials=STARTUP,
            n_ei_candidates=CANDIDATES,
        )
        sampler._parzen_estimator_cls = _Parzen
        many = len(self.directions) > 1
        gamma = tpe.default_gamma_multiobjective if many else tpe.default_gamma
        below, above = tpe._split_trials(self.study, trials, gamma(len(trials)))
        build = sampler._build_parzen_estimator
        good = build(self.study, self.space, below, handle_below=True)
        rest = build(self.study, self.space, above, handle_below=False)
        points = good.sample(sampler._rng.rng, CANDIDATES * count)
        gain = sampler._compute_acquisition_func(points, good, rest).reshape(count, CANDIDATES)
        best = np.arange(count) * CANDIDATES + np.argmax(gain, axis=1)
        return [
            {
                name: one.to_external_repr(points[name][at].item())
                for name, one in self.space.items()
            }
            for at in best
        ]

    def _cmaes(self, number: int, count: int, batches: list[list[FrozenTrial]]) -> list[Draw]:
        """CMA-ES, with a batch as its generation; a search that has come to rest begins anew."""
        transform = _SearchSpaceTransform(self.space, transform_step=True, transform_0_1=True)
        sampler = CmaEsSampler(seed=self._word(0), popsize=self.batch)
        told, optimizer = self._optimizer
        if optimizer is None or told > len(batches):
            told, optimizer = 0, sampler._init_optimizer(transform, self.study.direction)
        for at in range(told, len(batches)):
            if len(batches[at]) == optimizer.population_size:
                points = [transform.transform(trial.params) for trial in batches[at]]
                ranks = self._ranks(batches[at])
                optimizer.tell(list(zip(points, ranks.tolist(), strict=True)))
            if optimizer.should_stop():
                optimizer = self._anew(at)
        self._optimizer = (len(batches), optimizer)
        optimizer._rng.seed(self._word(number))
        points = [np.asarray(optimizer.ask()) for _ in range(count)]
        return [transform.untransform(point) for point in points]

    def _anew(self, at: int) -> Any:
        """An optimizer that starts at a place of its own."""
        generator = np.random.default_rng([self.seed, at, 1])
        size = len(self.space)
        return cmaes.CMA(
            mean=generator.random(size),
            sigma=1.0 / 6.0,
            bounds=np.tile([0.0, 1.0], (size, 1)),
            population_size=self.batch,
            n_max_resampling=10 * size,
            seed=self._word(at),
        )

    def _ranks(self, trials: list[FrozenTrial]) -> np.ndarray:
        """Places from the best on: usable designs by their score, then others by their excess."""
        sign = 1.0 if self.directions[0] == "minimize" else -1.0
        excess = np.array([sum(max(v, 0.0) for v in t.constraints.values()) for t in trials])
        score = np.array([np.inf if t.values is None else sign * t.values[0] for t in trials])
        order = np.lexsort((np.where(excess > 0, 0.0, score), excess))
        ranks = np.empty(len(trials))
        ranks[order] = np.arange(len(trials))
        return ranks

    def _nsga2(self, number: int, count: int, batches: list[list[FrozenTrial]]) -> list[Draw]:
        """NSGA-II: children of the best that is known; a batch is a generation."""
        sampler = NSGAIISampler(population_size=self.batch, seed=self._word(number))
        key = sampler._get_generation_key()
        for generation, batch in enumerate(batches):
            for trial in batch:
                trial._system_attrs.setdefault(key, generation)
        last = number - self.ahead + 1
        # one generation after the other: what a set of parents is must not depend on what was
        # asked before, and a set that is remembered comes in the order drawn
        for generation in range(self._chosen + 1, last + 1):
            sampler.get_parent_population(self.study, generation)
        self._chosen = max(self._chosen, last)
        parents = sampler.get_parent_population(self.study, last)
        if not parents:
            return self._spread(number, count)
        found = []
        for _ in range(count):
            child = sampler._child_generation_strategy(self.study, self.space, parents)
            for name in self.space:  # in an order that no process chooses for itself
                if name not in child:  # to be mutated
                    child[name] = self._placed(sampler._rng.rng.rand(len(self.space)))[name]
            found.append({name: child[name] for name in self.space})
        return found

    def _gp(self, number: int, count: int, batches: list[list[FrozenTrial]]) -> list[Draw]:
        """A Gaussian process, asked once a design, with the batch's earlier ones as pending."""
        if len(self.known.trials) < STARTUP:
            return self._spread(number, count)
        sampler = GPSampler(seed=self._word(number), n_startup_trials=1)
        storage = InMemoryStorage()
        study = _study(storage, self.directions, sampler)
        for trial in self.known.trials:
            storage.create_new_trial(study._study_id, trial)
        asked = [study.ask(dict(self.space)) for _ in range(count)]
        return [dict(one.params) for one in asked]


def _study(storage: InMemoryStorage, directions: Sequence[str], sampler: Any = None) -> Study:
    wanted = [StudyDirection[one.upper()] for one in directions]
    chosen = sampler or RandomSampler(seed=0)
    return optuna.create_study(storage=storage, directions=wanted, sampler=chosen)


class _Parzen(_ParzenEstimator):
    """Optuna's mixture of truncated normals, drawn from and looked at for many points at once."""

    def sample(self, rng: np.random.RandomState, size: int) -> dict[str, np.ndarray]:
        """Points drawn from the mixture; shapes and units as in optuna."""
        mixture: Any = self._mixture_distribution
        if any(getattr(one, "step", 0.0) for one in mixture.distributions):
            return super().sample(rng, size)
        kernel = rng.choice(len(mixture.weights), p=mixture.weights, size=size)
        found = {}
        for name, one in zip(self._search_space, mixture.distributions, strict=True):
            part = rng.rand(size)
            if not hasattr(one, "mu"):
                shares = np.cumsum(one.weights[kernel], axis=1)
                most = one.weights.shape[1] - 1
                found[name] = np.minimum(np.sum(shares < part[:, None], axis=1), most)
                continue
            middle, width = one.mu[kernel], one.sigma[kernel]
            low = ndtr((one.adapted_low - middle) / width)
            high = ndtr((one.adapted_high - middle) / width)
            value = middle + width * ndtri(low + part * (high - low))
            value = np.exp(value) if one.is_log else value
            found[name] = np.clip(value, one.low, one.high)
        return found

    def log_pdf(self, samples_dict: dict[str, np.ndarray]) -> np.ndarray:
        """Logarithm of the density at each point [-]; shapes as in optuna."""
        points = self._transform(samples_dict)
        mixture: Any = self._mixture_distribution
        if any(getattr(one, "step", 0.0) for one in mixture.distributions):
            return super().log_pdf(samples_dict)
        constant = np.log(mixture.weights)
        left, right, lists = [], [], []
        for column, one in zip(points.T, mixture.distributions, strict=True):
            if not hasattr(one, "mu"):
                lists.append((np.log(one.weights), column.astype(int)))
                continue
            low, span = one.adapted_low, one.adapted_high - one.adapted_low
            u = ((np.log(column) if one.is_log else column) - low) / span
            middle, width = (one.mu - low) / span, one.sigma / span
            left += [u * u, u]
            right += [-0.5 / width**2, middle / width**2]
            mass = ndtr((1.0 - middle) / width) - ndtr(-middle / width)
            constant -= 0.5 * (middle / width) ** 2 + np.log(width * mass)
            constant -= np.log(span * np.sqrt(2.0 * np.pi))
        rows = np.stack([*left, np.ones(len(points))], axis=1)
        columns = np.stack([*right, constant])
        found = np.empty(len(points))
        for begin in range(0, len(points), ROWS):
            part = rows[begin : begin + ROWS] @ columns
            for weights, chosen in lists:
                part += weights[:, chosen[begin : begin + ROWS]].T
            found[begin : begin + ROWS] = np.exp(part, out=part).sum(axis=1)
        return np.log(found)
