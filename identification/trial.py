"""A trial is a candidate after its full refit; which of several goes first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model.law import Law, Place, library
from .bootstrap import Contest
from .evidence import effective_samples
from .extend import HeldOut, grown, worst_ratio
from .fit import CRAWL, DOMINATED, Fit, descended, loudness, settle, solve
from .motions import with_scales
from .screen import Candidate, alikeness
from .starts import told_start

BETTER = 10.0
"""Fall of the cost for which constants jump to another minimum, or corners become sharper [-]."""

SHARP = 0.003
"""Rounding of a law's corners that is tried beside the usual one [-]: dry friction that truly
sticks has sharp ones, that of a lubricated guide has not. Steps pass over sharper ones."""

LEAST_EVIDENCE = 10.0
"""Fall of BIC below which no law is accepted [-]; Kass and Raftery 1995 call 10 very strong."""


UNSHOWN = 90.0
"""Fall of BIC that a law needs where no misfit shows [-]: an effect counts as detectable from ten
units of noise on, which is 100 of the cost, and a number more costs about 10.

Beyond it, and where no misfit is left, a strength is not zero whatever its standard deviation
says: one that trades off with another constant has a wide one, and the records still refuse zero
(Hauck and Donner 1977, doi:10.1080/01621459.1977.10479969)."""


AMBIGUOUS = 6.0
"""Two laws whose BIC differ by less than this are both named, unless sets that are made of each
tell them apart [-]."""


@dataclass(frozen=True, eq=False)  # a trial is itself; its arrays have no single truth
class Trial:
    """A candidate after its full refit.

    Attributes:
        candidate: law, place and what the screen said.
        fit: everything refitted with the law in force.
        delta_bic: fall of BIC against the fit without the law [-].
        held: its foretelling of held-out records, where there are any.
        verdict: why it was accepted or not, in words.
        contest: sets made of the law that explains the records best, and of this one, where the two
            were close.
    """

    candidate: Candidate
    fit: Fit
    delta_bic: float
    held: HeldOut | None = None
    verdict: str = ""
    contest: Contest | None = None

    @property
    def law(self) -> Law:
        """The law to name: the simpler one that the candidate's is where its shape says so.

        A contact that sticks gives a little before it slides: what fits it is hysteresis with a
        short knee, and what an engineer calls it is dry friction.
        """
        law, shapes = self.candidate.law, self.candidate.shapes
        if not law.limit or not shapes or law.limit in self.fit.problem.left_out:
            return law
        knee = self.fit.value(self.fit.index(shapes[0].label))
        reach = self.fit.problem.scales[self.candidate.place].stretch
        return library()[law.limit] if knee < law.limit_share * reach else law


def is_named_alike(trial: Trial, other: Trial) -> bool:
    """Whether two trials would be named alike: slip and hysteresis of next to no way are friction.

    Source: tests/identification/test_trial.py.
    """
    places = trial.candidate.place, other.candidate.place
    return places[0] == places[1] and trial.law.name == other.law.name


def limit_of(candidate: Candidate) -> str:
    """Name of the simpler cause that a candidate holds in itself; nothing where there is none."""
    return f"{candidate.place}/{candidate.law.limit}" if candidate.law.limit else ""


def with_limits(chosen: Sequence[Candidate], open_: Sequence[Candidate]) -> list[Candidate]:
    """The chosen candidates, each with the simpler one that it holds, largest gain first."""
    names = {c.name for c in chosen} | {limit_of(c) for c in chosen}
    return [c for c in open_ if c.name in names]


def with_other_places(
    worth: Sequence[Candidate], open_: Sequence[Candidate], count: int
) -> list[Candidate]:
    """The first `count` that are worth a trial, and the best one's law wherever else it is open.

    A column at zero strength says less of the place than of the law: springs in a row share a
    motion, and a strong law changes how they do. So a place is no worse for gaining little there.
    What rings may be ridden by a mass or stand on a spring: one tone brings all laws of that kind.
    """
    chosen, best = list(worth[:count]), worth[0].law
    alike = [c for c in open_ if c.law.name == best.name or (c.law.rings and best.rings)]
    return chosen + [c for c in alike if c not in chosen]


def of_other_kind(open_: Sequence[Candidate], count: int) -> list[Candidate]:
    """The `count` best laws of the mechanism where an instrument's is the best one, or the reverse.

    Where errors of the model dominate, a reading out of scale or late gains as much as what the
    motions lack, and constants have made room for that.
    """
    return [c for c in open_ if bool(c.law.slot) != bool(open_[0].law.slot)][:count]


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


def promising(fit: Fit, chosen: Sequence[Candidate], least: float = 0.0) -> list[Candidate]:
    """The first candidate, and those whose linear step promises half of `LEAST_EVIDENCE` [-].

    Where a law must gain at least so much to be accepted, all must promise that.
    """
    count = effective_samples(fit)

    def promise(candidate: Candidate) -> float:
        left = max(1.0 - candidate.gain / max(fit.cost, 1e-300), 1e-300)
        return float(-count * np.log(left) - np.log(count))

    if least:
        return [c for c in chosen if promise(c) > least]
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


def best_of_each(trials: Sequence[Trial]) -> list[Trial]:
    """Of several trials of one law at one place the one that explains most."""
    best: dict[str, Trial] = {}
    for trial in trials:
        name = trial.candidate.name
        if name not in best or trial.delta_bic > best[name].delta_bic:
            best[name] = trial
    return list(best.values())


def quietest_first(fit: Fit, trials: Sequence[Trial]) -> list[Trial]:
    """Trials with the one before all others that leaves by far the least, where there is one.

    Where errors of the model dominate, each channel is weighed by its own, and a law that leaves
    one channel as wrong as it was may cost the least.

    Args:
        fit: without any of the laws.
        trials: those that go first first.

    Source: tests/identification/test_trial.py.
    """
    trials = list(trials)
    if worst_ratio(fit) > DOMINATED:
        left = [loudness(trial.fit) for trial in trials]
        best = int(np.argmin(left))
        if left[best] < QUIETER * left[0]:
            trials.insert(0, trials.pop(best))
    return trials


def settled(fit: Fit, far: bool) -> Fit:
    """A fit with its noise law learned, the better one from here and from what the rig says.

    Args:
        fit: with a law that was just added.
        far: whether the law's absence may have drawn the constants far away.

    Returns:
        The settled fit.

    Source: tests/identification/test_trial.py, tests/studies/test_demo.py.
    """
    found = settle(fit, at_last=False)
    if worst_ratio(found) > DOMINATED:
        found = _quieter(found, descended(fit))
    if worst_ratio(found) > DOMINATED:
        return found  # costs say little there
    if far:
        found = _better(found, grown(found.model, told_start(found.model, found.x), 40))
    if any(has_corners(law) for _, law in found.model.causes):
        problem = with_scales(
            replace(found.model, problem=replace(found.problem, corner=SHARP)), found.x
        )
        found = _better(found, solve(replace(found.model, problem=problem), found.x, 40, CRAWL))
    return found


def retold(fit: Fit) -> Fit:
    """A fit with a law that is accepted, or a better one from what the rig says.

    Without its cause a club's shaft and sleeve take each other's part, and where they have done so
    there may be a ridge on the way back.

    Source: tests/identification/test_trial.py.
    """
    told = solve(fit.model, told_start(fit.model, fit.x), 40, CRAWL)
    if worst_ratio(fit) <= DOMINATED:
        return _better(fit, told)
    if _left(told) >= _left(fit):  # costs say little there
        return fit
    told = settle(told, at_last=False)
    return told if _left(told) < QUIETER * _left(fit) else fit


def _left(fit: Fit) -> float:
    """Squared misfit beyond what the instruments' noise brings, in units of that noise [-]."""
    return max(loudness(fit) - fit.count, 0.0)


def _quieter(found: Fit, start: Fit) -> Fit:
    """The better by far of two fits where errors of the model dominate the first one."""
    if loudness(start) > QUIETER * loudness(found):
        return found
    other = settle(start, at_last=False)
    return other if loudness(other) < QUIETER * loudness(found) else found


QUIETER = 0.5
"""Share of the squared misfit, in units of the instruments' noise, below which it is another
minimum and no matter of weights [-]."""


def has_corners(law: Law) -> bool:
    """Whether a law's force depends on how its corners are rounded."""
    if law.force is None:
        return False
    seen = np.linspace(-2.0, 2.0, 41)
    wide, sharp = (
        np.asarray(law.force(0.5, seen, seen[::-1], Place(1.0, 1.0, width, width)))
        for width in (0.1, 0.01)
    )
    return not np.allclose(wide, sharp, rtol=1e-9, atol=1e-12)


def _better(found: Fit, other: Fit) -> Fit:
    return settle(other, at_last=False) if other.cost < found.cost - BETTER else found


def may_rival(candidate: Candidate, done: Candidate) -> bool:
    """Whether a law may explain what another one explains to the noise already.

    Of those that ring a step says little: their frequencies move far.
    """
    names = {limit_of(candidate), limit_of(done)}
    ring = candidate.law.rings and done.law.rings
    return ring or bool(names & {candidate.name, done.name}) or alikeness(candidate, done) > RIVAL


RIVAL = 0.7
"""Alikeness below which two laws cannot both explain all of a misfit [-]."""


HALFWAY = 0.5
"""A trial that explains less than this share of what it must is refused before its noise laws are
learned, which takes longest and moves little [-]."""


def explains_only(share: float) -> str:
    """The verdict on a trial that explains too small a share of the misfit [-]."""
    return f"refused: it explains only {100 * share:.0f} % of the misfit beyond the noise"


def outdone(close: Contest, name: str) -> str:
    """The verdict on a law whose own sets do not show what was measured."""
    return (
        f"refused: of {close.sets} sets made with it {100 * close.second:.1f} % speak for {name} "
        f"as the records do; of as many made with that {100 * close.first:.0f} %"
    )


IDLE = "dropped: beside the other causes it is idle"

HOLDS_ZERO = "refused: its interval holds zero"

LED = "refused: it is nothing itself, but led the rig to better constants"

MENDS_FORM = "refused: it takes away no more than a lumped club may leave of a real one"

SIMPLER = "refused: its simpler case foretells held-out records better"

TAKEN = "refused: a law that looks like it explains more from the same constants"

NO_GAIN = "refused: held-out records are foretold no better"

LEAST_GAIN = 0.05
"""Where errors of the model dominate, a law must take away this share of the cost, or
a tenth of the misfit beyond noise [-]."""
