"""The search for causes: one law at a time, while the gain is real."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

from .bootstrap import contest
from .evidence import (
    SURE_SHARE,
    at_its_end,
    believable,
    delta_bic,
    explained,
    least_explained,
    on_bounds,
)
from .extend import HeldOut, as_weighed, extend, held_out, shown_by, without, worst_ratio
from .fit import CRAWL, DOMINATED, PATIENCE, Fit, polished, settle, solve
from .form import mends_form, mends_lumping, within_next
from .problem import Problem
from .refits import (
    Progress,
    Quick,
    elsewhere,
    ends_swapped,
    exchanged,
    quick_refits,
    whole_refits,
)
from .screen import Candidate, screen
from .standing import MISFIT_SHOWN, gains_unseen, misfit_chance, spares
from .swung import is_swung
from .trial import (
    AMBIGUOUS,
    HALFWAY,
    HOLDS_ZERO,
    IDLE,
    LEAST_EVIDENCE,
    LEAST_GAIN,
    LED,
    MENDS_FORM,
    NO_GAIN,
    SIMPLER,
    TAKEN,
    UNSHOWN,
    Trial,
    best_of_each,
    explains_only,
    interval,
    is_named_alike,
    limit_of,
    outdone,
    quietest_first,
    retold,
    settled,
)
from .weighing import with_laws
from .whereabouts import Apart, Whereabouts, apart, whereabouts

MOST_CAUSES = 4

SIGNIFICANCE = 1e-3
"""Chance of any false law in one screen, after correction for the number of laws tried [-]."""

UNASKED = 1e-6
"""The same where the absolute misfit is within the noise already: a relative score alone must be
beyond doubt there [-], and the law explain most of what is left and foretell better."""

BEYOND_DOUBT = 150.0
"""Fall of BIC that counts as a misfit shown, where zeros and tolerances take it in [-]: twice the
most that a law was seen to gain on a clean set of a finite-element club."""

LEAST_STEP = 0.1
"""Share of the misfit beyond noise, as it stands, that a law must take away [-]: where a lumped
model meets a club that is not, many laws take a little, and none of them is the cause."""

LEAST_SHARE = 0.5
"""Share of the misfit beyond noise that named causes must explain; otherwise unknown [-]."""

REFUTED = 0.01
"""Chance of what was measured, of sets made with a law, below which it is no rival [-]."""


class Search:
    """Greedy growth of the model, one law at a time."""

    def __init__(self, base: Fit, unseen: Problem | None, progress: Progress) -> None:
        self.base, self.fit, self.unseen, self.progress = base, base, unseen, progress
        self.accepted: list[Trial] = []
        self.rivals: list[Trial] = []
        self.trials: list[Trial] = []
        self.stages: list[Fit] = [base]
        self.idle: set[str] = set()
        self.first: list[Candidate] = []
        self.left: list[Candidate] = []
        self.held: HeldOut | None = None
        self._held_before: HeldOut | None = None
        self._bare: tuple[Fit, Fit] | None = None

    def grow(self) -> None:
        """Accept laws while one gains, then weigh what is named by each channel's noise.

        Where none does, the rig as it stands is the answer, and followed to its very minimum.
        """
        while len(self.accepted) < MOST_CAUSES and self.step():
            pass
        if not self.accepted and worst_ratio(self.base) > DOMINATED:
            self.base = self.fit = polished(self.base)
            self.stages, self._held_before = [self.base], None
        self.weigh()

    def _foretell(self, fit: Fit) -> HeldOut | None:
        return held_out(fit, self.unseen) if self.unseen is not None else None

    @property
    def held_before(self) -> HeldOut | None:
        """What the base foretells; found when first asked for."""
        if self._held_before is None:
            self._held_before = self._foretell(self.base)
        return self._held_before

    @property
    def held_now(self) -> HeldOut | None:
        """What the model as grown so far foretells."""
        return self.held if self.accepted else self.held_before

    def _foretold(self) -> tuple[float, float]:
        """Errors in foretelling held-out records before and now [-]; 1 where none is held out."""
        before, now = self.held_before, self.held_now
        return (before.nrmse, now.nrmse) if before is not None and now is not None else (1.0, 1.0)

    def believed(self, share: float) -> bool:
        """Whether what is named is the cause although errors of the model still dominate.

        What leaves one channel as wrong as it was is a stand-in. `share` is that of the misfit
        beyond noise that it explains [-].
        """
        least = least_explained(self.base, self.fit, DOMINATED)
        return least >= LEAST_SHARE and believable(share, *self._foretold())

    def step(self) -> bool:
        """Try to accept one more law (or a pair); whether one was accepted."""
        if self.rivals:
            return False
        candidates = [c for c in screen(self.fit) if c.name not in self.idle]
        if self.accepted and within_next(self.fit):  # a told motion's laws are exact
            candidates = [c for c in candidates if self._swings(c)]
        self.left = candidates
        self.first = self.first or candidates
        count = max(len(candidates), 1)
        limit = SIGNIFICANCE if misfit_chance(self.fit) < MISFIT_SHOWN else UNASKED
        open_ = [c for c in candidates if c.p_value * count < limit]
        if not open_:
            return False
        return self._tried(quick_refits(self.fit, open_, self.accepted, self.progress))

    def _tried(self, quick: Quick) -> bool:
        """Accept the first law of a ranking that stands; whether one does."""
        while quick.tried:
            trials, quick = whole_refits(self.fit, quick)
            verdicts = set()
            for rank, trial in enumerate(trials):
                trial = self._judge(trial, self.fit)
                self.trials.append(trial)
                if trial.verdict == "accepted":
                    trial = self._simpler(trial, trials)
                    trial, alike = self._exchanged(trial)
                    trial, near = self._placed(trial)
                    trial, gone = self._at_right_end(trial)
                    near = [one for one in (*alike, *near) if one.candidate.name != gone]
                    others = [one for one in trials if not rank and one.candidate.name != gone]
                    rivals = self._rivals(trial, best_of_each([*others, *near]), near)
                    self._accept([trial], rivals)
                    return True
                if trial.verdict == HOLDS_ZERO and self._led(trial):
                    return True
                alone = not rank and not self.accepted  # later pairs are two stand-ins more
                if alone and trial.verdict == NO_GAIN and self._pair(trial):
                    return True
                verdicts.add(trial.verdict)
            if verdicts != {NO_GAIN}:  # a stand-in may hide one that foretells better
                return False
        return False

    def _led(self, trial: Trial) -> bool:
        """Whether a law that is nothing itself led the rig as it stands to a far better minimum.

        That is its fit from then on: laws were on their way to it, and none of them is the cause.
        """
        if self.accepted:
            return False
        bare = self._without(trial)
        idle = delta_bic(bare, trial.fit) < LEAST_EVIDENCE
        if not idle or bare.cost > (1.0 - LEAST_STEP) * self.fit.cost:
            return False
        self.progress("fitting the rig as it stands from better constants")
        self.base = self.fit = settle(bare, crawling=CRAWL)
        self.stages, self._held_before, self.first = [self.base], None, []
        self.trials[-1] = replace(trial, verdict=LED)
        return True

    def _judge(self, trial: Trial, before: Fit) -> Trial:
        """Accept or refuse one trial, in words."""
        idle = trial.fit.cost > (1 - LEAST_GAIN) * before.cost
        idle = idle and explained(before, trial.fit) < LEAST_STEP
        if worst_ratio(before) > DOMINATED and idle:
            return replace(trial, verdict="refused: it takes away next to none of the misfit")
        if trial.delta_bic < LEAST_EVIDENCE:
            return replace(trial, verdict=f"refused: BIC falls by only {trial.delta_bic:.1f}")
        shown = misfit_chance(before) < MISFIT_SHOWN or trial.delta_bic > BEYOND_DOUBT
        if not shown and trial.delta_bic < UNSHOWN:
            return replace(trial, verdict=f"refused: no misfit shows, {trial.delta_bic:.0f} of BIC")
        asked = LEAST_STEP if shown and not self._half_asked(trial) else LEAST_SHARE
        share = explained(before, trial.fit)
        if share < HALFWAY * asked:
            return replace(trial, verdict=explains_only(share))
        fit = settled(trial.fit, worst_ratio(before) > DOMINATED)
        trial = replace(trial, fit=fit)
        share = explained(before, fit)
        if share < asked:
            return replace(trial, verdict=explains_only(share))
        cause = trial.candidate.cause
        if mends_form(before, fit, cause) or mends_lumping(self.base, before, fit, cause):
            return replace(trial, verdict=MENDS_FORM)
        index = fit.index(trial.candidate.entry.label)
        told = trial.delta_bic > UNSHOWN and misfit_chance(fit) > MISFIT_SHOWN
        near_zero = abs(fit.value(index)) < 3.0 * fit.std(index)
        if near_zero and not told and not self._is_missed(trial):
            return replace(trial, verdict=HOLDS_ZERO)
        if trial.candidate.law.slot == "delay" and abs(fit.value(index)) < interval(trial):
            return replace(trial, verdict="refused: it is shorter than a sampling interval")
        if at_its_end(fit, index):
            return replace(trial, verdict="refused: it would have to be larger than it can be")
        pushed = set(on_bounds(fit)) - set(on_bounds(before, 2.0))
        if pushed and share < LEAST_SHARE:
            which = ", ".join(sorted(pushed))
            return replace(trial, verdict=f"refused: it only replaces {which}")
        unseen, held = self._foretell(fit), self.held_now
        trial = replace(trial, held=unseen)
        lenient = shown and not self.accepted
        if unseen is not None and held is not None:
            shows = shown_by(unseen, *trial.candidate.cause)
            spared = spares(held, unseen)
            if not (gains_unseen(held, unseen, lenient) if shows else spared):
                return replace(trial, verdict=NO_GAIN)
        return replace(trial, verdict="accepted")

    def _without(self, trial: Trial) -> Fit:
        """The rig without a trial's law, from the constants that it asks for."""
        if self._bare is None or self._bare[0] is not trial.fit:
            bare = without(trial.fit, *trial.candidate.cause)
            self._bare = trial.fit, solve(bare.model, bare.x, PATIENCE, CRAWL)
        return self._bare[1]

    def _is_missed(self, trial: Trial) -> bool:
        """Whether all would be far worse without a law whose standard error is as large as it is.

        Along a bent valley that error says little: a sleeve whose spring gives way all but wholly
        hardly tells its stiffness, and yet nothing else fits.
        """
        fall = self._without(trial).cost - trial.fit.cost
        return fall > BEYOND_DOUBT * max(1.0, worst_ratio(trial.fit))

    def _swings(self, candidate: Candidate) -> bool:
        return is_swung(self.base.problem, candidate.cause)

    def _half_asked(self, trial: Trial) -> bool:
        """Whether a law must take away half of what is left.

        So it is once what small motions leave out of a swing explains nearly all: of what is left,
        many laws take a little.
        """
        named = any(self._swings(one.candidate) for one in self.accepted)
        more = not self._swings(trial.candidate)
        return named and more and explained(self.base, self.fit) >= SURE_SHARE

    def _simpler(self, trial: Trial, trials: Sequence[Trial]) -> Trial:
        """The simpler law that an accepted one holds, where it foretells unseen records better."""
        for other in trials:
            if other.candidate.name == limit_of(trial.candidate) and trial.held is not None:
                judged = self._judge(other, self.fit)
                self.trials.append(judged)
                better = judged.held is not None and judged.held.nrmse < trial.held.nrmse
                if judged.verdict == "accepted" and better:
                    index = self.trials.index(trial)
                    self.trials[index] = replace(trial, verdict=SIMPLER)
                    return judged
        return trial

    def _exchanged(self, trial: Trial) -> tuple[Trial, list[Trial]]:
        """The law that takes an accepted one's part better, from its constants, or that one.

        With it those that take its part about as well.
        """
        self.progress(f"trying what looks like {trial.candidate.name}")
        alike = exchanged(trial, self.left)
        for other in alike:
            if other.delta_bic <= trial.delta_bic + AMBIGUOUS:
                break
            judged = self._judged_instead(other, trial)
            if judged is not trial:
                return judged, [*alike, trial]
        return trial, alike

    def _placed(self, trial: Trial) -> tuple[Trial, list[Trial]]:
        """An accepted law at the place where it explains most, and its trials at the others."""
        near = elsewhere(trial, self.left, self.fit)
        best = max(near, key=lambda one: one.delta_bic, default=trial)
        if best.delta_bic > trial.delta_bic:
            judged = self._judged_instead(best, trial)
            if judged is not trial:
                return judged, [*near, trial]
        return trial, near

    def _at_right_end(self, trial: Trial) -> tuple[Trial, str]:
        """An accepted law where the rig's guesses put it, of two springs in a row.

        With it the name of the one whose place it takes; that is no rival any more.
        """
        other = ends_swapped(trial, self.left)
        judged = trial if other is None else self._judged_instead(other, trial)
        return judged, "" if judged is trial else trial.candidate.name

    def _judged_instead(self, other: Trial, trial: Trial) -> Trial:
        """The other trial, judged, where it is accepted in an accepted one's place, or that one."""
        judged = self._judge(other, self.fit)
        self.trials.append(judged)
        if judged.verdict != "accepted":
            return trial
        self.trials[self.trials.index(trial)] = replace(trial, verdict=TAKEN)
        return judged

    def _pair(self, first: Trial) -> bool:
        """A law that gains nothing unseen by itself may do so together with a second one."""
        self.progress(f"trying pairs with {first.candidate.name}")
        candidates = screen(first.fit)
        open_ = [c for c in candidates if c.p_value * len(candidates) < SIGNIFICANCE]
        for candidate in open_[:2]:
            fit = extend(first.fit, candidate, 25)
            second = Trial(candidate, fit, delta_bic(first.fit, fit))
            second = self._judge(second, first.fit)
            self.trials.append(second)
            if second.verdict == "accepted":
                self._accept([replace(first, verdict="accepted with the next"), second], [])
                return True
        return False

    def _accept(self, trials: list[Trial], rivals: list[Trial]) -> None:
        last = trials[-1]
        fit = polished(retold(last.fit))
        if fit is not last.fit:
            trials = [*trials[:-1], replace(last, fit=fit, held=self._foretell(fit))]
        self.accepted += trials
        self.rivals += rivals
        self.fit, self.held = trials[-1].fit, trials[-1].held
        self._drop_idle()
        self.stages = [self.base, *(trial.fit for trial in self.accepted)]

    def _drop_idle(self) -> None:
        """The backward step: causes that a later one made idle are none.

        Neither is the last one, where it only led the way to better constants.
        """
        for name in [one.candidate.name for one in self.accepted]:
            if len(self.accepted) == 1:
                return
            trial = next(one for one in self.accepted if one.candidate.name == name)
            self.progress(f"trying without {name}")
            bare = without(self.fit, *trial.candidate.cause)
            bare = solve(bare.model, bare.x, 40, CRAWL)
            gain = delta_bic(bare, self.fit)
            if gain >= (UNSHOWN if misfit_chance(bare) > MISFIT_SHOWN else LEAST_EVIDENCE):
                continue
            fit = polished(settle(bare, at_last=False))
            *kept, last = [one for one in self.accepted if one is not trial]
            last = replace(last, fit=fit, held=self._foretell(fit))
            self.accepted, self.fit, self.held = [*kept, last], fit, last.held
            self.trials.append(replace(trial, verdict=IDLE))
            self.idle.add(name)

    def _rivals(
        self, best: Trial, others: Sequence[Trial], near: Sequence[Trial] = ()
    ) -> list[Trial]:
        """Other laws that explain the records as well and cannot be told apart.

        A close one is out where sets made with it hardly ever speak for the best one as loudly as
        the records do, and sets made with the best one do so. Those from `near` are fits of the
        best one's weights, which know the noise better than any without a cause.
        """
        found = []
        name = best.candidate.name
        own = next((one for one in others if one.candidate.name == name), best)
        for other in others:
            if name in (other.candidate.name, limit_of(other.candidate)):
                continue  # itself, or one that holds it as its simplest case
            if is_named_alike(best, other):
                continue
            if quietest_first(self.fit, [other, best])[0] is best:
                continue  # what it costs says little
            if best.delta_bic - other.delta_bic < AMBIGUOUS:
                if any(other is one for one in near):
                    close = contest(best.fit, as_weighed(other.fit, best.fit))
                else:
                    close = contest(own.fit, other.fit)
                other = replace(other, contest=close)
                if close.second < REFUTED <= close.first:
                    self.trials.append(replace(other, verdict=outdone(close, name)))
                    continue
                judged = self._judge(other, self.stages[-1])
                if judged.verdict == "accepted" and not is_named_alike(best, judged):
                    found.append(replace(judged, verdict="cannot be told from the best"))
        return found

    def weigh(self) -> None:
        """Fit what is named once more, by the noise laws that every channel bears out.

        Until then noise is taken for even: what the model lacks grows with the motion too.
        """
        if not self.accepted:
            return
        fit = with_laws(self.fit)
        if fit is not self.fit:
            self.progress("weighing by the noise of each channel")
            held = self._foretell(fit)
            self.accepted[-1] = replace(self.accepted[-1], fit=fit, held=held)
            self.fit, self.held = fit, held
            self.stages = [*self.stages[:-1], fit]

    @cached_property
    def apart(self) -> tuple[Apart, ...]:
        """What is left of the records when one thing is not believed."""
        return apart(self.base, self.progress)

    @cached_property
    def where(self) -> Whereabouts | None:
        """Where what the rig lacks sits, asked without any law."""
        return whereabouts(self.base, self.progress, self.apart)
