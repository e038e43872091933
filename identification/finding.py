"""What a diagnosis finds, and where what it cannot name sits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from .extend import HeldOut
from .fit import Fit
from .screen import Candidate
from .swung import is_swung
from .trial import Trial
from .whereabouts import Whereabouts


@dataclass(frozen=True)
class Diagnosis:
    """What a model gets wrong, as far as the records tell.

    Attributes:
        status: adequate, named, ambiguous or unknown.
        base: fit of the rig as it stands.
        final: with all accepted laws, weighed by its noise; `base` where there are none.
        accepted: the accepted trials in order.
        rivals: trials that the records cannot tell from an accepted one.
        trials: every full refit that was made.
        candidates: the first screen, largest gain first.
        cannot_tell: names of causes that these records could not show.
        confusable: (first, second, alikeness [-]) of pairs that look alike.
        held_before: foretelling of held-out records by `base`.
        held_after: the same by `final`.
        split: how held-out records were chosen, in words.
        whiteness: p-values of the whitened residuals before and after [-].
        stages: the base, and the fit with each accepted law in turn.
        where: of a verdict that knows no cause, where what is missing sits.
    """

    status: str
    base: Fit
    final: Fit
    accepted: tuple[Trial, ...]
    rivals: tuple[Trial, ...]
    trials: tuple[Trial, ...]
    candidates: tuple[Candidate, ...]
    cannot_tell: tuple[str, ...]
    confusable: tuple[tuple[str, str, float], ...]
    held_before: HeldOut | None
    held_after: HeldOut | None
    split: str
    whiteness: tuple[float, float] = (1.0, 1.0)
    stages: tuple[Fit, ...] = field(default=())
    where: Whereabouts | None = None

    @property
    def crowded(self) -> str | None:
        """The place at which laws stand in for one that the library lacks."""
        return crowded(self.accepted)


STAND_INS = 3
"""Laws at one place from which they stand in for another one [-]: each takes its part of a misfit
that none of them has made. What a told motion swings truly lacks several at once."""


def crowded(accepted: Sequence[Trial]) -> str | None:
    """The place at which `STAND_INS` laws were accepted; None where there is none.

    Source: tests/identification/test_verdict.py.
    """
    own = [one for one in accepted if not is_swung(one.fit.problem, one.candidate.cause)]
    most = Counter(one.candidate.place for one in own).most_common(1)
    return most[0][0] if most and most[0][1] >= STAND_INS else None
