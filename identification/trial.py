"""A trial is a candidate after its full refit; which of several goes first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .evidence import effective_samples
from .extend import HeldOut
from .fit import Fit
from .screen import Candidate

LEAST_EVIDENCE = 10.0
"""Fall of BIC below which no law is accepted [-]; Kass and Raftery 1995 call 10 very strong."""


@dataclass(frozen=True, eq=False)  # a trial is itself; its arrays have no single truth
class Trial:
    """A candidate after its full refit.

    Attributes:
        candidate: law, place and what the screen said.
        fit: everything refitted with the law in force.
        delta_bic: fall of BIC against the fit without the law [-].
        held: its foretelling of held-out records, where there are any.
        verdict: why it was accepted or not, in words.
    """

    candidate: Candidate
    fit: Fit
    delta_bic: float
    held: HeldOut | None = None
    verdict: str = ""


def limit_of(candidate: Candidate) -> str:
    """Name of the simpler cause that a candidate holds in itself; nothing where there is none."""
    return f"{candidate.place}/{candidate.law.limit}" if candidate.law.limit else ""


def with_limits(chosen: Sequence[Candidate], open_: Sequence[Candidate]) -> list[Candidate]:
    """The chosen candidates, each with the simpler one that it holds, largest gain first."""
    names = {c.name for c in chosen} | {limit_of(c) for c in chosen}
    return [c for c in open_ if c.name in names]


def with_other_places(worth: Sequence[Candidate], count: int) -> list[Candidate]:
    """The first `count` candidates, and the best one's law wherever else it is worth a trial.

    A column at zero strength says less of the place than of the law: springs in a row share a
    motion, and a strong law changes how they do.
    """
    chosen = list(worth[:count])
    return chosen + [c for c in worth[count:] if c.law.name == worth[0].law.name]


def interval(trial: Trial) -> float:
    """Longest sampling interval of the channels at a trial's place [s].

    When within its interval a sample was taken is rarely known; no shorter delay is a finding.
    """
    channels = [c for p in trial.fit.problem.records for c in p.record.channels]
    return max(1.0 / c.sample_rate for c in channels if c.name == trial.candidate.place)


GENERAL = 0.5
"""A law that holds a simpler one waits where that one gains this share of what it gains [-]."""


def without_general(open_: Sequence[Candidate]) -> list[Candidate]:
    """Candidates without those that hold a simpler one which gains nearly as much."""
    gains = {c.name: c.gain for c in open_}
    return [c for c in open_ if gains.get(limit_of(c), 0.0) < GENERAL * c.gain]


def promising(fit: Fit, chosen: Sequence[Candidate]) -> list[Candidate]:
    """The first candidate, and those whose linear step promises half of `LEAST_EVIDENCE` [-]."""
    count = effective_samples(fit)

    def promise(candidate: Candidate) -> float:
        left = max(1.0 - candidate.gain / max(fit.cost, 1e-300), 1e-300)
        return float(-count * np.log(left) - np.log(count))

    return [c for i, c in enumerate(chosen) if not i or promise(c) > 0.5 * LEAST_EVIDENCE]


def simplest_first(trials: Sequence[Trial]) -> list[Trial]:
    """Trials by falling evidence; a law goes before one that holds it and is hardly better.

    Hardly better is less than `LEAST_EVIDENCE` [-] of BIC: further numbers must earn their place.
    """
    order = sorted(trials, key=lambda trial: -trial.delta_bic)
    for trial in list(order):
        for other in list(order):
            holds = limit_of(trial.candidate) == other.candidate.name
            if holds and trial.delta_bic - other.delta_bic < LEAST_EVIDENCE:
                order.remove(trial)
                order.insert(order.index(other) + 1, trial)
                break
    return order
