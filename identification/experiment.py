"""Which next test would tell two causes apart, and how clearly, before anybody makes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares

from .fit import Fit
from .free import Entry
from .noise import Noise
from .possible_tests import Planned, planned_tests
from .problem import Key, Model

CLEAR = 20.0
"""Fall of the cost beyond which a test is said to tell two causes apart [-]: twice the evidence
that a diagnosis asks for before it names one."""

STEPS = 12
"""Evaluations of one fit to a foretold test [-]."""

ASSUMED_NOISE = 0.03
"""Noise of a sensor that no record has, as a share of its reading's root mean square [-]."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Rival:
    """One of the explanations that are left.

    Attributes:
        name: ``place/law``, several joined by `` + ``; ``nothing missing`` without any.
        fit: everything fitted to the records with these laws in force.
    """

    name: str
    fit: Fit


@dataclass(frozen=True)
class Proposal:
    """A test with what it is expected to tell.

    Attributes:
        planned: the test.
        evidence: expected rise of the cost if the wrong one of the closest pair is fitted [-].
        pair: names of that pair.
        all_pairs: of every pair the names, and the evidence where the first and where the second
            is true [-].
    """

    planned: Planned
    evidence: float
    pair: tuple[str, str]
    all_pairs: tuple[tuple[str, str, float, float], ...]


def propose(
    rivals: Sequence[Rival],
    most: float = 2.0,
    progress: Progress = lambda text: None,
) -> list[Proposal]:
    """Tests that a lab could make next, those that separate the rivals best first.

    Both rivals foretell each test. What the one sees and the other cannot follow, when its
    constants may move as far as the records made so far allow and the test's own start state
    and zeros are free, is the evidence to expect.

    Args:
        rivals: two at least, fitted to the same records.
        most: largest factor on amplitudes and forces that the rig may bear [-].
        progress: told what is being done.

    Returns:
        All planned tests with their expected evidence [-], largest first.

    Raises:
        ValueError: for less than two rivals.

    Source: the T-optimum of Atkinson and Fedorov 1975, doi:10.1093/biomet/62.1.57, with what the
    records told as prior; tests/identification/test_experiment.py.
    """
    if len(rivals) < 2:
        raise ValueError(f"rivals: expected two at least, found {len(rivals)}.")
    known = [_information(rival.fit) for rival in rivals]
    found = []
    for planned in planned_tests(rivals[0].fit, most):
        progress(f"foretelling: {planned.words}")
        pairs = _pairs(planned, rivals, known)
        closest = min(pairs, key=lambda pair: min(pair[2:]))
        found.append(Proposal(planned, min(closest[2:]), closest[:2], tuple(pairs)))
    return sorted(found, key=lambda proposal: -proposal.evidence)


def _pairs(
    planned: Planned, rivals: Sequence[Rival], known: Sequence[np.ndarray]
) -> list[tuple[str, str, float, float]]:
    """Evidence of one test for every pair, where the first and where the second is true."""
    models = [_test_model(planned, rival.fit) for rival in rivals]
    seen = [model.predict(x) for model, x in models]
    sane = [all(np.isfinite(values).all() for values in told.values()) for told in seen]
    noises = _noises(planned, rivals[0].fit, seen[0])
    found = []
    for i, j in combinations(range(len(rivals)), 2):
        ways = []
        for true, fitted in ((i, j), (j, i)):
            if not (sane[true] and sane[fitted]):
                ways.append(0.0)  # a motion that runs away foretells nothing
                continue
            model, x = models[fitted]
            ways.append(_left(replace(model, noises=noises), x, seen[true], known[fitted]))
        found.append((rivals[i].name, rivals[j].name, ways[0], ways[1]))
    return found


def _left(model: Model, x: np.ndarray, told: Mapping[Key, np.ndarray], known: np.ndarray) -> float:
    """What is left of the cost when a model is fitted to what another one foretells [-].

    Its first unknowns may move as far as what the records tell of them, `known`, allows.
    """
    (prepared,) = model.problem.records
    sensors = tuple(
        replace(sensor, values=told[prepared.name, sensor.channel.name])
        for sensor in prepared.sensors
    )
    problem = replace(model.problem, records=(replace(prepared, sensors=sensors),))
    model = replace(model, problem=problem)
    values, vectors = np.linalg.eigh(known)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    begun, size = model.residual(x), len(known)
    wide = np.hstack([root, np.zeros((size, len(x) - size))])

    def gap(at: np.ndarray) -> np.ndarray:
        moved = model.residual(at)
        moved[fixed:] -= begun[fixed:]  # priors pull towards where the records left them
        return np.concatenate([moved, wide @ (at - x)])

    fixed = sum(len(sensor.values) for sensor in sensors)
    low = np.array([entry.low / entry.scale for entry in model.entries])
    high = np.array([entry.high / entry.scale for entry in model.entries])
    run = least_squares(
        gap,
        np.clip(x, low + 1e-12, high),
        lambda at: np.vstack([model.jacobian(at), wide]),  # type: ignore[arg-type]
        bounds=(low, high),
        x_scale="jac",
        max_nfev=STEPS,
    )
    return 2.0 * float(run.cost)


def _information(fit: Fit) -> np.ndarray:
    """What the records tell of the shared unknowns, all others fitted along, scaled [-]."""
    # by the instruments' noise: weights that allow for errors of a model know less than they
    jacobian = replace(fit.model, noises=fit.problem.floor).jacobian(fit.x)
    square = jacobian.T @ jacobian
    shared = np.array([entry.record is None for entry in fit.model.entries])
    own = ~shared
    if not own.any():
        return square
    cross = square[np.ix_(shared, own)]
    inner = np.linalg.pinv(square[np.ix_(own, own)], rcond=1e-13, hermitian=True)
    return square[np.ix_(shared, shared)] - cross @ inner @ cross.T


def _test_model(planned: Planned, fit: Fit) -> tuple[Model, np.ndarray]:
    """The rival's model of a test, and its unknowns: shared ones as fitted, then the test's own."""
    model = fit.model
    entries: list[Entry] = []
    x: list[float] = []
    for i, entry in enumerate(model.entries):
        if entry.record is None:
            entries.append(replace(entry, prior=np.inf))
            x.append(fit.x[i])
    for i, entry in enumerate(model.entries):
        if entry.record == planned.template:
            entries.append(replace(entry, record=planned.prepared.name))
            begun = planned.factor * fit.x[i] if entry.slot == "start" else fit.x[i]
            x.append(begun if entry.slot in ("start", "numbers") else 0.0)
    if planned.added:
        at = len(planned.prepared.sensors) - 1
        name = f"{planned.prepared.sensors[at].channel.name}.offset"
        entries.append(Entry(name, "offset", (str(at),), planned.prepared.name, 0.0))
        x.append(0.0)
    problem = replace(model.problem, records=(planned.prepared,))
    told = replace(
        model,
        problem=problem,
        entries=tuple(entries),
        noises={},
        allowances={},
        horizon=np.inf,
    )
    return told, np.array(x)


def _noises(planned: Planned, fit: Fit, seen: dict[Key, np.ndarray]) -> dict[Key, Noise]:
    """Noise [SI] of a test's channels: as in the record it is made after, or assumed."""
    found, floor = {}, fit.problem.floor
    for key, values in seen.items():
        like = floor.get((planned.template, key[1]))
        found[key] = like or Noise((), ASSUMED_NOISE * max(float(np.std(values)), 1e-300))
    return found
