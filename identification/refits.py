"""Which laws that a screen left open deserve a refit on the whole records, and what that finds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .beside import THREADS, each_whole
from .evidence import delta_bic
from .extend import as_weighed, extend, extended_model, thinned, without, worst_ratio
from .fit import CRAWL, DOMINATED, Fit, constants_held, solve
from .losses import ENDS, at_other_end, farness, swapped_ends
from .problem import Cause
from .screen import Candidate, alikeness, screen
from .standing import MISFIT_SHOWN, misfit_chance
from .starts import eased_start
from .swung import is_swung
from .told import Begun, begun_from_told, told_trials, unasked_trials, weighed_as
from .tolerances import PULLED, worst_pull
from .trial import (
    AMBIGUOUS,
    RIVAL,
    UNSHOWN,
    Trial,
    limit_of,
    may_rival,
    of_other_kind,
    promising,
    quietest_first,
    simplest_first,
    with_limits,
    with_other_places,
    without_general,
)

TRIALS = 5

QUICK, RINGING = 10, 30
"""Budget of a quick refit, and of one of a law that rings [-]: the screen knows its frequency only
as it is seen, and what gives way rings by itself elsewhere. With 10 a support was left on the way,
at a cost of 32.3k where 29.8k is its minimum, and a rider was named in its place."""

EVALUATIONS = 15
"""Budget of a law's descent from told constants, weighed as others are [-]."""

UNASKED = 4
"""Laws that no step asks for that are weighed so: those which fit best before [-]."""

REST, QUIET = 0.025, 2.0
"""Share of the worst channel's misfit ratio, and ratio where errors of the model dominated, below
which a law needs no trial from told constants, nor one of its places from where it began [-]."""

HOPELESS = 100.0
"""A quick refit that is worse than the best one by more than this, and by more than a fifth of
what that gained, is not repeated on the whole records; units of the noise's variance [-]."""

BEHIND = 0.3
"""A quick refit at its minimum whose cost is behind the best one's by more than this share of it is
not repeated on the whole records either [-]."""

WORTH = 0.2
"""Laws that promise less than this share of the best law's gain are not refitted [-]."""

OTHERS = 1
"""Laws of the mechanism that are tried where errors of the model dominate and an instrument's gains
most, or the reverse [-]."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Quick:
    """Quick refits on thinned records, cheapest first, that await one on the whole.

    Attributes:
        start: fit without any of the laws, on the thinned records.
        tried: (fit with the law, the law).
    """

    start: Fit
    tried: tuple[tuple[Fit, Candidate], ...]


def quick_refits(
    fit: Fit, open_: Sequence[Candidate], accepted: Sequence[Trial], progress: Progress
) -> Quick:
    """Rank laws by quick refits on thinned records.

    Args:
        fit: of the model as grown so far.
        open_: candidates that the screen could not refuse, largest gain first.
        accepted: causes named so far.
        progress: told what is tried.

    Returns:
        The ranking; empty where none promises enough.

    Source: tests/identification/test_refits.py.
    """
    start = solve(thinned(fit.model), fit.x, 6)
    quick: list[tuple[Fit, Candidate]] = []
    worth = [c for c in without_general(open_) if c.gain > WORTH * open_[0].gain]
    chosen = with_other_places(worth if len(worth) > 1 else open_[:2], open_, TRIALS)
    others = of_other_kind(open_, OTHERS) if worst_ratio(fit) > DOMINATED else []
    chosen += [c for c in others if c not in chosen]
    done: Candidate | None = None  # one that leaves no misfit, nor strains the rig
    least = 0.0 if misfit_chance(fit) < MISFIT_SHOWN else UNSHOWN
    promise = promising(fit, chosen, least)
    if not promise:
        return Quick(start, ())
    awaited = with_limits(promise, open_)
    while awaited:
        if done is not None:
            awaited = [c for c in awaited if c in others or may_rival(c, done)]
        now, awaited = awaited[:THREADS], awaited[THREADS:]
        for refit, candidate in zip(_extended(start, now, progress), now, strict=True):
            if done is None or candidate in others or may_rival(candidate, done):
                quick.append((refit, candidate))
            clear = misfit_chance(refit) > MISFIT_SHOWN and worst_pull(refit) <= PULLED
            if done is None and clear:
                done = candidate
    problem = fit.problem
    swung = bool(accepted) and is_swung(problem, accepted[-1].candidate.cause)
    told, fresh = fit, []  # one of what a told motion swings hides the next
    if done is None and (swung or (not accepted and not _is_found(start, quick))):
        told, fresh = told_trials(fit, lambda one: swung and is_swung(problem, one.cause))
    begun = _begun(told, fresh, start, progress)
    quick += _weighed(start, begun)
    tried = {one.candidate.name for one in begun}
    asked = [c.cause for c in chosen if not c.law.slot and c.name not in tried]
    if fresh and not swung and _is_lost(start, quick):
        there = screen(told, asked) if asked else []
        quick += _weighed(start, _begun(told, there, start, progress))
    if fresh and not swung and _is_lost(start, quick):
        unasked = unasked_trials(told, tried | {f"{place}/{law.name}" for place, law in asked})
        begun = sorted(_begun(told, unasked, start, progress), key=lambda one: one.cost)[:UNASKED]
        quick += _weighed(start, begun)
    return Quick(start, tuple(sorted(quick, key=lambda pair: pair[0].cost)))


def _is_lost(start: Fit, quick: Sequence[tuple[Fit, Candidate]]) -> bool:
    """Whether errors of the model dominate beside every law that was tried."""
    return all(worst_ratio(one) > DOMINATED for one, _ in quick) and not _is_found(start, quick)


def _is_found(start: Fit, quick: Sequence[tuple[Fit, Candidate]]) -> bool:
    """Whether a law takes nearly all away and leaves the rig where it is stated to be."""
    before = worst_ratio(start)
    most = max(REST * before, QUIET if before > DOMINATED else 0.0)
    return any(worst_ratio(one) < most and worst_pull(one) <= PULLED for one, _ in quick)


def _begun(told: Fit, laws: Sequence[Candidate], start: Fit, progress: Progress) -> list[Begun]:
    """Laws fitted from told constants, without those that do nothing there."""

    def begin(candidate: Candidate) -> Begun | None:
        progress(f"trying {candidate.name} from told constants")
        return begun_from_told(told, candidate, start, 2 * EVALUATIONS)

    return [one for one in each_whole(begin, laws) if one is not None]


def _weighed(start: Fit, begun: Sequence[Begun]) -> list[tuple[Fit, Candidate]]:
    """Quick refits of laws that were begun from told constants."""
    found = each_whole(lambda one: weighed_as(start, one, EVALUATIONS), begun)
    return [(fit, one.candidate) for fit, one in zip(found, begun, strict=True)]


def _extended(start: Fit, laws: Sequence[Candidate], progress: Progress) -> list[Fit]:
    """Quick refits of laws from where the fit without them stands."""

    def refit(candidate: Candidate) -> Fit:
        progress(f"trying {candidate.name}")
        return extend(start, candidate, RINGING if candidate.law.rings else QUICK)

    return each_whole(refit, laws)


def whole_refits(fit: Fit, quick: Quick) -> tuple[list[Trial], Quick]:
    """Refit the best of the ranking on the whole records.

    Args:
        fit: of the model as grown so far, on the whole records.
        quick: a ranking that is not empty.

    Returns:
        The trials by falling evidence, one that leaves far less before them; and the ranking of
        those that the best one put aside,
        whose turn it is where none of these foretells better.

    Source: tests/identification/test_refits.py.
    """
    near, aside = _worth_whole(quick)

    def refit(pair: tuple[Fit, Candidate]) -> Trial:
        one, candidate = pair
        whole = replace(one.model, problem=fit.problem, allowances=fit.model.allowances)
        full = solve(whole, one.x, 25, CRAWL)
        return Trial(candidate, full, delta_bic(fit, full))

    found = each_whole(refit, near)
    return quietest_first(fit, simplest_first(found)), Quick(quick.start, tuple(aside))


def _worth_whole(
    quick: Quick,
) -> tuple[list[tuple[Fit, Candidate]], list[tuple[Fit, Candidate]]]:
    """Refits that are worth one on the whole records, each at its own minimum; and the others."""
    best = quick.tried[0][0].cost
    gained = quick.start.cost - best
    limits = {limit_of(candidate) for _, candidate in quick.tried[:1]}  # never left out
    close, aside = [], []
    for rank, (fit, candidate) in enumerate(quick.tried):
        hopeless = fit.cost - best > max(HOPELESS, 0.2 * gained)
        far = (rank > 2 or (rank and hopeless)) and candidate.name not in limits
        (aside if far else close).append((fit, candidate))
    near = each_whole(lambda pair: (_at_minimum(pair[0]), pair[1]), close)
    near.sort(key=lambda pair: pair[0].cost)
    best = near[0][0].cost
    kept = []
    for fit, candidate in near:
        hopeless = fit.cost - best >= max(HOPELESS, BEHIND * best)
        (aside if hopeless and candidate.name not in limits else kept).append((fit, candidate))
    return kept, sorted(aside, key=lambda pair: pair[0].cost)


def _at_minimum(fit: Fit) -> Fit:
    """A quick refit followed further, or a better one from where nothing strains its tolerance."""
    found = solve(fit.model, fit.x, 30)
    strained = max(fit, found, key=worst_pull)
    if worst_pull(strained) <= PULLED:
        return found
    other = solve(fit.model, eased_start(fit.model, strained.x), 60)
    return min(found, other, key=lambda one: one.cost)


EXCHANGE = 0.5
"""Share of a law's gain, where its constants stand, beyond which one that looks like it is tried
from there [-]."""


def exchanged(trial: Trial, candidates: Sequence[Candidate]) -> list[Trial]:
    """Trials of the laws that look like a trial's own, from the constants that it asks for.

    Without a cause constants are drawn far away, and the way from there to where a law belongs may
    be closed to it while it is open to one that is like it, or that is its simplest case: where
    errors of the model are left, those that hold the trial's law are tried, too.

    Args:
        trial: a law that would be accepted.
        candidates: the screen without it.

    Returns:
        The trials that explain more than it does, or about as much, by the weights of its own fit.

    Source: tests/identification/test_exchange.py.
    """
    own = next((c for c in candidates if c.name == trial.candidate.name), trial.candidate)
    far = worst_ratio(trial.fit) > DOMINATED
    alike = [
        c
        for c in candidates
        if (far if limit_of(c) == own.name else alikeness(c, own) > RIVAL)
        and c.name not in (own.name, limit_of(own))
    ]
    if not alike:
        return []
    found = _from_its_constants(trial, [c.cause for c in alike], 25)
    return sorted(found, key=lambda one: -one.delta_bic)


def elsewhere(trial: Trial, candidates: Sequence[Candidate], before: Fit) -> list[Trial]:
    """Trials of a law at the other places where it may sit as well, from the constants it asks for.

    Springs in a row share a motion; from constants that were drawn away without a cause the way to
    one of its places may be closed. Where the law leaves errors of the model, the constants that it
    asks for may be those of the wrong place: the others are tried from where it began, too.

    Args:
        trial: a law of the mechanism that would be accepted.
        candidates: the screen without it.
        before: the fit without it, that it began from.

    Returns:
        The trials that explain about as much as it does, by the weights of its own fit, or more.

    Source: tests/identification/test_exchange.py.
    """
    own = trial.candidate
    same = [c.cause for c in candidates if c.law.name == own.law.name and c.place != own.place]
    if own.law.kind != "link" or not same:
        return []
    found = _from_its_constants(trial, same, 40)
    if worst_ratio(before) > DOMINATED and worst_ratio(trial.fit) > QUIET:
        found += _from_where_it_began(trial, same, before)
    return found


def ends_swapped(trial: Trial, candidates: Sequence[Candidate]) -> Trial | None:
    """The trial of a club whose shaft and sleeve are told for each other, its law with them.

    Args:
        trial: a law that would be accepted.
        candidates: the screen without it.

    Returns:
        The trial, by the weights of the fit it stands for, where it explains as much or more and
        the rig says that this is the right end; None where it says nothing of the kind.

    Source: tests/identification/test_exchange.py.
    """
    fit, own = trial.fit, trial.candidate
    start = swapped_ends(fit.model, fit.x)
    if start is None or any(place in ENDS for place, _ in fit.model.causes[:-1]):
        return None
    model, candidate = fit.model, own
    if own.place in ENDS:
        wanted = (ENDS[1 - ENDS.index(own.place)], own.law)
        found = next((c for c in candidates if c.cause == wanted), None)
        if found is None:
            return None
        candidate = found
        bare = without(replace(fit, x=start), *own.cause)
        model = extended_model(bare, candidate)
        entries = [own.entry, *own.shapes]
        dimensions = [own.law.dimension, *(shape.dimension for shape in own.law.shapes)]
        values = [fit.value(fit.index(entry.label)) for entry in entries]
        there = at_other_end(
            fit.model, fit.x, own.place, list(zip(values, dimensions, strict=True))
        )
        scales = [entry.scale for entry in (candidate.entry, *candidate.shapes)]
        start = np.append(bare.x, np.divide(there, scales))
    other = solve(model, constants_held(model, start, 20), 60, CRAWL)
    nearer = farness(fit.model, fit.x) - farness(model, other.x)
    if other.cost > fit.cost + 2.0 * nearer:
        return None
    return Trial(candidate, other, trial.delta_bic + delta_bic(fit, other))


def _from_its_constants(trial: Trial, causes: Sequence[Cause], evaluations: int) -> list[Trial]:
    """Trials of causes in a trial's place that explain about as much as it does, or more."""
    own = trial.candidate
    bare = without(trial.fit, *own.cause)
    bare = solve(bare.model, bare.x, 0)
    there = screen(bare, [own.cause, *causes])
    least = EXCHANGE * next(c.gain for c in there if c.name == own.name)
    tried = [c for c in there if c.name != own.name and c.gain >= least]
    fits = each_whole(lambda candidate: extend(bare, candidate, evaluations), tried)
    return [
        Trial(candidate, other, trial.delta_bic + delta_bic(trial.fit, other))
        for candidate, other in zip(tried, fits, strict=True)
        if other.cost < trial.fit.cost + AMBIGUOUS
    ]


def _from_where_it_began(trial: Trial, causes: Sequence[Cause], before: Fit) -> list[Trial]:
    """Trials of causes from the fit without a trial's law that explain more than it does."""

    def refit(candidate: Candidate) -> Fit:
        return as_weighed(extend(before, candidate, RINGING), trial.fit, 40)

    tried = screen(before, causes)
    fits = each_whole(refit, tried)
    return [
        Trial(candidate, other, trial.delta_bic + delta_bic(trial.fit, other))
        for candidate, other in zip(tried, fits, strict=True)
        if other.cost < trial.fit.cost
    ]
