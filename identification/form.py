"""What a lumped club leaves of a real one, learned from clean sets; below it nothing is missing."""

from __future__ import annotations

import numpy as np

from ..model.robot import Robot
from .evidence import SURE_SHARE, explained
from .fit import DOMINATED, Fit
from .losses import DAMPERS, ENDS, IDLE, SPRINGS, sleeve_loss
from .problem import Cause
from .standing import MISFIT_SHOWN, misfit_chance
from .swung import is_swung

LUMPED = 0.01
"""Root mean square that was left beyond the noise of a channel where nothing was hidden, at most,
as a share of what was measured, twice [-]."""

LEARNED = "33 clean sets of an independent finite-element bench"
"""What `LUMPED` was learned from [-]: in 31 no misfit showed, in the others 0.4 and
0.5 %. One of these was known to be hard. Without the shaft's own mass and its bending in the sleeve
it was up to 2.4 %."""

NEXT = 0.02
"""The same once a cause is named [-]: a law that is lumped too leaves part of what it takes away, a
fortieth of it on the set that this was learned from. An effect that moves less than this counts as
none that records could show; it is also what a law must take away where no misfit shows, since
the form's error passes for noise there: of two clean clubs at 40 dB 0.8 and 1.4 % were taken."""

SHOWN = 1e-3
"""Chance of a channel's misfit under its noise below which it counts [-]."""


ERRORS = {"wrist_stiffness": 0.007, "wrist_damping": 0.009, "collet_held.stiffness": 0.0075}
"""Standard deviations by which a fit of a lumped club misses constants of a real one, beside what
noise does to them, as shares of them [-]: what makes their squared errors come out as stated on
40 clean sets of an independent finite-element bench, none of which is among those reported."""


ASTRAY = {"wrist_stiffness": 0.04, "wrist_damping": 0.05, "collet_held.stiffness": 0.03}
"""The same where the sleeve seems to lose nothing [-]: set by hand by five of fifty such clubs."""


def loses_nothing(fit: Fit) -> bool:
    """Whether a club's sleeve is found to lose nothing, which no rubber does."""
    found = {e.name: fit.value(i) for i, e in enumerate(fit.model.entries)}
    numbers = fit.problem.numbers | found
    known = isinstance(fit.problem.mechanism, Robot) and {*SPRINGS, *DAMPERS} <= set(numbers)
    return known and "sleeve_damping" in found and sleeve_loss(numbers) < IDLE


def form_error(fit: Fit, name: str, value: float) -> float:
    """What a club's lumped form adds to the standard error of one constant, in its unit [SI].

    Args:
        fit: of any mechanism; of a chain, which is told to be what it is, it is nothing.
        name: of the constant, or of what a bench would show of the club.
        value: of it [SI].

    Source: tests/identification/test_recovery.py.
    """
    if name not in ERRORS or not isinstance(fit.problem.mechanism, Robot):
        return 0.0
    return (ASTRAY if loses_nothing(fit) else ERRORS)[name] * abs(value)


def stated_std(fit: Fit, index: int) -> float:
    """Standard error of a constant by its index: of noise, and of the club's lumped form [SI]."""
    error = form_error(fit, fit.model.entries[index].name, fit.value(index))
    return float(np.hypot(fit.std(index), error))


def form_share(fit: Fit) -> float:
    """Largest share of a channel's motion that is misfit beyond its noise [-].

    Only channels whose misfit shows count: by their whole residual, or by the frequencies where the
    model moves and the noise is known from elsewhere.
    """
    shares = [0.0]
    for key, (noise, misfit) in fit.judged.items():
        if misfit.p_value < SHOWN:
            residual, power = fit.residual_of(key), noise.marginal_std**2
            seen = (misfit.ratio - 1.0) * power * 2.0 * misfit.bins / len(residual)
            gap = max(float(np.mean(residual**2)) - power, seen, 0.0)
            size = float(np.std(fit.sensor_of(key).values))
            shares.append(float(np.sqrt(gap)) / max(size, 1e-300))
    return max(shares)


def within_form(fit: Fit) -> bool:
    """Whether what misfit shows is no more than a lumped club leaves of a real one.

    Chains are told to be what they are: they have no such allowance.

    Source: tests/identification/test_form.py.
    """
    return isinstance(fit.problem.mechanism, Robot) and 0.0 < form_share(fit) <= LUMPED


def within_next(fit: Fit) -> bool:
    """Whether what misfit shows beside named causes is no more than lumped laws leave of real ones.

    Source: tests/identification/test_form.py.
    """
    return isinstance(fit.problem.mechanism, Robot) and form_share(fit) <= NEXT


def taken_share(before: Fit, after: Fit) -> float:
    """Largest share of a channel's motion, as amplitudes, that a richer fit takes off what is left.

    Args:
        before: any fit [SI].
        after: of the same records, with a law more [SI].
    """
    shares = [0.0]
    for key in before.keys:
        first, last = (np.mean(fit.residual_of(key) ** 2) for fit in (before, after))
        size = max(float(np.std(before.sensor_of(key).values)), 1e-300)
        shares.append(float(np.sqrt(max(first - last, 0.0))) / size)
    return max(shares)


def mends_form(before: Fit, after: Fit, cause: Cause) -> bool:
    """Whether a cause that acts by a force takes no more off than a lumped club's form may leave.

    So it is asked where no misfit shows beyond that form: many such laws mend a little of a real
    club's, and foretell better by it. Chains are told to be what they are; what a told motion
    swings is exact.

    Args:
        before: without the cause.
        after: with it.
        cause: place and law.

    Source: tests/identification/test_form.py.
    """
    robot = isinstance(before.problem.mechanism, Robot)
    if not robot or not cause[1].acts or is_swung(before.problem, cause):
        return False
    shows = misfit_chance(before) < MISFIT_SHOWN and not within_form(before)
    return not shows and taken_share(before, after) <= NEXT


def mends_lumping(base: Fit, before: Fit, after: Fit, cause: Cause) -> bool:
    """Whether a cause takes no more off than lumping a law of the club that is named may leave.

    A shaft and a sleeve are long: a law of theirs acts where they bend most, and a lumped one only
    nearly so. Where it explains nearly all, and errors of the model dominate with a further law of
    theirs as they did without it, that one mends its form.

    Args:
        base: without any cause.
        before: with those named so far.
        after: with the cause too.
        cause: place and law.

    Source: tests/identification/test_form.py; of a shaft that softens, further laws at the shaft
    took 1.7 and 1.1 % of the motion; without that law stand-ins explained half, and took 12 %.
    """
    place, law = cause
    beside = law.acts and place in ENDS and any(at in ENDS for at, _ in before.model.causes)
    if not beside or not isinstance(before.problem.mechanism, Robot):
        return False
    left = all(any(m.ratio > DOMINATED for m in fit.misfits.values()) for fit in (before, after))
    sure = left and explained(base, before) >= SURE_SHARE
    return sure and taken_share(before, after) <= NEXT


def form_words(fit: Fit) -> str:
    """The allowance in words where a verdict rests on it; nothing elsewhere [-]."""
    share, left = form_share(fit), "What is left beyond the noise is "
    if within_form(fit):
        return (
            f"{left}{100 * share:.1f} % of the motion of its channel; a lumped club leaves up to "
            f"{100 * LUMPED:.0f} % of a real one ({LEARNED})."
        )
    if fit.model.causes and share > 0.0 and within_next(fit):
        return (
            f"{left}{100 * share:.1f} % of the motion of its channel; beside a named cause up to "
            f"{100 * NEXT:.0f} % are taken for what lumped laws leave of a real club."
        )
    return ""
