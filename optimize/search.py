"""The hunt: designs drawn by optuna, a batch at a time, simulated in one call, kept when done."""

from __future__ import annotations

import hashlib
import json
import math
import random
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import numpy as np
import optuna
from optuna.importance import PedAnovaImportanceEvaluator, get_param_importances
from optuna.trial import FrozenTrial, TrialState

from ..model.linear import Port
from .search_samplers import Draw, Sampler, Space, space_of
from .search_spec import Choice, Limit, Range
from .search_storage import Archive, open_archive
from .sweep import SweepTask, score_designs

optuna.logging.set_verbosity(optuna.logging.WARNING)


@dataclass(frozen=True)
class SearchTask:
    """What is searched for.

    Attributes:
        sweep: mechanism, numbers, drive, sensor, window, and every score that is needed.
        ranges: parameters that take any value between two.
        choices: parts of catalogues and listed values.
        objectives: score and ``minimize`` or ``maximize``.
        limits: what scores may be.
        sampler: one of `supple.optimize.search_spec.SAMPLERS`.
        trials: designs in all [-].
        batch: designs of one call [-].
        ahead: batches that may be under way at the same time [-].
        seed: of everything that is drawn by chance [-].
    """

    sweep: SweepTask
    ranges: tuple[Range, ...]
    choices: tuple[Choice, ...]
    objectives: tuple[tuple[str, str], ...]
    limits: tuple[Limit, ...] = ()
    sampler: str = "tpe"
    trials: int = 1000
    batch: int = 64
    ahead: int = 1
    seed: int = 0

    @property
    def directions(self) -> tuple[str, ...]:
        """``minimize`` or ``maximize`` of each objective."""
        return tuple(direction for _, direction in self.objectives)

    def numbers_of(self, draws: Sequence[Draw]) -> dict[str, np.ndarray]:
        """The rig's numbers of some designs, by name, each of shape (designs,) [SI]."""
        found = {
            one.name: np.array([draw[one.name] for draw in draws], float) for one in self.ranges
        }
        for one in self.choices:
            rows = [one.parts.index(draw[one.name]) for draw in draws]
            found |= {name: np.asarray(values)[rows] for name, values in one.numbers.items()}
        return found

    def evaluate(self, draws: Sequence[Draw]) -> dict[str, np.ndarray]:
        """Scores of some designs in one call, by name, each of shape (designs,) [SI]."""
        return score_designs(self.sweep, self.numbers_of(draws))

    def fingerprint(self, inputs: Mapping[str, str]) -> str:
        """What tells this search from others, whatever the number of trials.

        Args:
            inputs: sums of the rig, the drive and the catalogues.

        Returns:
            A sum as text.
        """

        def plain(port: Port) -> list[str]:
            return [port.place, port.quantity, port.frame]

        told = {
            "ranges": [[one.name, one.low, one.high, one.is_log] for one in self.ranges],
            "choices": [
                [one.name, one.parts, {k: v.tolist() for k, v in one.numbers.items()}]
                for one in self.choices
            ],
            "objectives": self.objectives,
            "limits": [[one.score, one.low, one.high] for one in self.limits],
            "sampler": [self.sampler, self.batch, self.ahead, self.seed],
            "sensor": plain(self.sweep.sensor),
            "window": self.sweep.window,
            "inputs": sorted(inputs.values()),
        }
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Search:
    """Every design that was looked at, in the order in which they were drawn.

    Attributes:
        task: what was asked.
        draws: what was drawn for each design: a value for each range, a part for each choice.
        numbers: the rig's numbers by name, each of shape (designs,) [SI].
        scores: by name, each of shape (designs,); NaN where there is none [SI unit of the score].
        excess: by how much limits are passed, in shares of them, shape (designs,) [1].
        resumed: designs that were there before [-].
        importances: for each objective, each name's share in what changes it [1].
    """

    task: SearchTask
    draws: tuple[Draw, ...]
    numbers: dict[str, np.ndarray]
    scores: dict[str, np.ndarray]
    excess: np.ndarray
    resumed: int = 0
    importances: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def losses(self) -> np.ndarray:
        """The objectives, all to be small, shape (designs, objectives); infinite for none [SI]."""
        signs = [1.0 if d == "minimize" else -1.0 for d in self.task.directions]
        columns = [self.scores[name] for name, _ in self.task.objectives]
        found = np.stack(columns, axis=1) * signs
        return np.where(np.isnan(found), np.inf, found)

    @property
    def usable(self) -> np.ndarray:
        """Whether a design keeps all limits and has all objectives, shape (designs,) [-]."""
        return (self.excess <= 0) & np.isfinite(self.losses).all(axis=1)

    @property
    def front(self) -> list[int]:
        """Usable designs that no other beats in everything, by the first objective [-].

        With one objective: the best design alone.
        """
        places = np.flatnonzero(self.usable)
        losses = self.losses[places]
        order = np.lexsort(losses.T[::-1])
        kept: list[int] = []
        for at in order:
            own = losses[kept]
            if not np.any(np.all(own <= losses[at], axis=1)):
                kept.append(int(at))
        return [int(places[at]) for at in kept]


def search(
    task: SearchTask,
    storage: str,
    study: str,
    inputs: Mapping[str, str] | None = None,
    tell: Callable[[int, int], None] | None = None,
) -> Search:
    """Search on until the storage holds the number of trials that is asked for.

    Every batch depends on the seed, its number and the batches before it alone: a search that was
    killed goes on as if it had not been, and any number of processes on one storage find what one
    alone would find. Only finished batches are kept.

    Args:
        task: what is searched for.
        storage: ``sqlite:///FILE``, ``journal:FILE``, ``postgresql://...``.
        study: name of the search in it.
        inputs: sums of the files that the task was made from, which tell it from others.
        tell: hears how many designs of how many are done.

    Returns:
        All designs of the storage, those of earlier runs and of other processes included.

    Raises:
        ValueError: for a storage that cannot be opened or holds another search of that name, a
            library that is missing, or scores that cannot be computed.

    Source: tests/optimize/test_search.py.
    """
    if task.sampler == "gp":
        _check_torch()
    space = space_of(task.ranges, task.choices)
    archive = open_archive(storage, study, task.directions, task.fingerprint(inputs or {}))
    with closing(archive):
        batches, resumed = _filled(task, archive, space, tell)
    return _search(task, [batches[k] for k in sorted(batches)], resumed)


def _filled(
    task: SearchTask, archive: Archive, space: Space, tell: Callable[[int, int], None] | None
) -> tuple[dict[int, list[FrozenTrial]], int]:
    """All batches of an archive, those drawn that were missing; how many designs were there."""
    sampler = Sampler(task.sampler, space, task.directions, task.batch, task.ahead, task.seed)
    batches = archive.batches()
    resumed = sum(map(len, batches.values()))
    while True:
        sizes = _sizes(task, batches)
        if tell is not None:
            tell(sum(map(len, batches.values())), task.trials)
        ready = [k for k in range(len(sizes)) if k not in batches and _is_ready(task, batches, k)]
        if not ready:
            return batches, resumed
        number = random.choice(ready)  # who draws which does not change what is drawn
        earlier = [batches[k] for k in range(max(0, number - task.ahead + 1))]
        _renumber(earlier)
        draws = sampler.draw(number, sizes[number], earlier)
        trials = _trials(task, space, draws)
        if archive.append(number, trials):
            batches[number] = trials
        batches |= archive.batches()


def _check_torch() -> None:
    try:
        import torch  # noqa: F401  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise ValueError(
            "[search] sampler: expected PyTorch for 'gp', the Gaussian process, found none "
            "installed. Mend: pip install 'supple[gp]', or write sampler = 'tpe'."
        ) from None


def _sizes(task: SearchTask, batches: Mapping[int, Sequence[FrozenTrial]]) -> list[int]:
    """Designs of each batch, those of the finished ones as they are."""
    sizes: list[int] = []
    while sum(sizes) < task.trials or len(sizes) in batches:
        known = batches.get(len(sizes))
        sizes.append(min(task.batch, task.trials - sum(sizes)) if known is None else len(known))
    return sizes


def _is_ready(task: SearchTask, batches: Mapping[int, Any], number: int) -> bool:
    return all(k in batches for k in range(number - task.ahead + 1))


def _renumber(batches: Sequence[Sequence[FrozenTrial]]) -> None:
    """Trials in the order drawn, wherever they stand in the storage."""
    at = 0
    for batch in batches:
        if batch and batch[0].number == at and batch[0]._trial_id == at:
            at += len(batch)
            continue
        for trial in batch:
            trial.number, trial._trial_id = at, at
            at += 1


def _trials(task: SearchTask, space: Any, draws: Sequence[Draw]) -> list[FrozenTrial]:
    """Finished trials of a batch; one without its objectives has failed."""
    began = datetime.now()
    scores = task.evaluate(draws)
    ended, found = datetime.now(), []
    excess = {one.score: _excess(one, scores[one.score]) for one in task.limits}
    others = [name for name in scores if name not in dict(task.objectives)]
    for at, draw in enumerate(draws):
        values = [float(scores[name][at]) for name, _ in task.objectives]
        told = {name: float(scores[name][at]) for name in others}
        failed = any(map(math.isnan, [*values, *told.values()]))
        one = optuna.trial.create_trial(
            state=TrialState.FAIL if failed else TrialState.COMPLETE,
            values=None if failed else values,
            params=draw,
            distributions=space,
            user_attrs={name: value for name, value in told.items() if math.isfinite(value)},
            constraints={} if failed else {k: float(v[at]) for k, v in excess.items()},
        )
        one.datetime_start, one.datetime_complete = began, ended
        found.append(one)
    return found


def _excess(limit: Limit, values: np.ndarray) -> np.ndarray:
    """How far values lie beyond a limit, in shares of it; at most 0 where they keep it."""
    found = np.full(len(values), -np.inf)
    for bound, sign in ((limit.high, 1.0), (limit.low, -1.0)):
        if bound is not None:
            found = np.maximum(found, sign * (values - bound) / (abs(bound) or 1.0))
    return np.clip(found, -1e300, 1e300)


def _search(task: SearchTask, batches: Sequence[Sequence[FrozenTrial]], resumed: int) -> Search:
    """What the trials say, taken together."""
    _renumber(batches)
    trials = [trial for batch in batches for trial in batch]
    draws = tuple(dict(trial.params) for trial in trials)
    scores = {name: np.full(len(trials), np.nan) for name in task.sweep.scores}
    excess = np.zeros(len(trials))
    for at, trial in enumerate(trials):
        for k, (name, _) in enumerate(task.objectives):
            scores[name][at] = math.nan if trial.values is None else trial.values[k]
        for name, value in trial.user_attrs.items():
            if name in scores:
                scores[name][at] = value
        excess[at] = max([0.0, *trial.constraints.values()])
    found = Search(task, draws, task.numbers_of(draws), scores, excess, resumed)
    return Search(**{**vars(found), "importances": _importances(task, trials)})


def _importances(task: SearchTask, trials: Sequence[FrozenTrial]) -> dict[str, dict[str, float]]:
    """Each name's share in what makes designs good (PED-ANOVA); none from too few designs."""
    found = {}
    whole = [one for one in trials if one.values and all(map(math.isfinite, one.values))]
    space = space_of(task.ranges, task.choices)
    names = [name for name, one in space.items() if not one.single()]
    if len(whole) < 20 or len(names) < 2:
        return {}
    for k, (name, direction) in enumerate(task.objectives):
        study = optuna.create_study(direction="minimize" if direction == "minimize" else "maximize")
        own = [
            optuna.trial.create_trial(value=one.values[k], params=one.params, distributions=space)
            for one in whole
        ]
        study.add_trials(own)
        evaluator = PedAnovaImportanceEvaluator()
        shares = get_param_importances(study, evaluator=evaluator, params=names)
        found[name] = {one: float(shares[one]) for one in names}
    return found
