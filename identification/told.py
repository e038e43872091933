"""What the records say from where the rig stands: a screen that no drawn-away constants bend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .allowance import Allowance
from .extend import calmed, extended_model, thinned, worst_ratio
from .fit import DOMINATED, Fit, learn_noise, solve
from .problem import Model
from .screen import Candidate, screen
from .starts import told_start
from .trial import with_other_places, without_general

MOST = 2
"""Laws that are tried from there [-]."""

NEARLY = 0.9
"""Share of the best law's gain from which as many more are tried: between slip and hysteresis of a
joint, steps of the screen's size tell little [-]."""

HORIZONS = (4.0, 20.0, np.inf)
"""Parts of each record that a law is first fitted to with the constants held, in periods [-]."""

WORTH = 0.5
"""Share of the best law's gain that another one must promise there [-]."""

SEEN = 10.0
"""Fall of the cost that the best one's law must promise at another place [-]."""


def told_fit(fit: Fit) -> Fit:
    """The records' own numbers fitted, with all constants at what the rig says.

    Weighed by the instruments' noise, and with no mode allowed for that rings by itself: where a
    cause is missing, constants and weights have moved to make room for it.

    Args:
        fit: of a model whose errors dominate what is found.
    """
    plain = replace(fit.model, noises=learn_noise(fit), allowances=_told_motions(fit))
    return solve(plain, _constants_held(plain, told_start(fit.model, fit.x), 20), 0)


def _constants_held(model: Model, x: np.ndarray, evaluations: int) -> np.ndarray:
    """Scaled unknowns [-] of the best fit by all but the rig's shared constants."""
    shared = [i for i, e in enumerate(model.entries) if e.slot == "numbers" and e.record is None]
    own = [i for i in range(len(model.entries)) if i not in set(shared)]
    held = tuple((model.entries[i], float(x[i] * model.scale[i])) for i in shared)
    near = replace(model, entries=tuple(model.entries[i] for i in own), fixed=(*model.fixed, *held))
    best = x.copy()
    best[own] = solve(near, x[own], evaluations).x
    return best


def _told_motions(fit: Fit) -> dict[str, Allowance]:
    """Allowances without those for what rings."""
    found = {}
    for name, allowance in fit.model.allowances.items():
        keep = np.array([kind != "ringing" for kind in allowance.kinds])
        if keep.any():
            found[name] = replace(
                allowance,
                kinds=tuple(np.array(allowance.kinds)[keep]),
                columns=tuple(block[:, keep] for block in allowance.columns),
                priors=allowance.priors[keep],
            )
    return found


def told_trials(
    fit: Fit, always: Callable[[Candidate], bool] = lambda one: False
) -> tuple[Fit, list[Candidate]]:
    """The fit where the rig stands, and the laws that gain most there.

    Args:
        fit: of the model so far.
        always: which candidates are tried whatever they gain.

    Returns:
        That fit, and the `MOST` candidates of its screen that gain most, or twice as many where
        they are near each other, the best one's law at every other place where it is seen; none
        where errors of the model do not dominate.

    Source: DESIGN's fourth step; tests/identification/test_told.py.
    """
    if worst_ratio(fit) <= DOMINATED:
        return fit, []
    told = told_fit(fit)
    found = screen(told)
    worth = [c for c in without_general(found) if c.gain > WORTH * found[0].gain]
    near = [c for c in worth[MOST : 2 * MOST] if c.gain > NEARLY * found[0].gain]
    chosen = with_other_places(worth, [c for c in found if c.gain > SEEN], MOST)
    chosen += [c for c in near if c not in chosen]
    return told, chosen + [c for c in found if always(c) and c not in chosen]


def from_told(told: Fit, candidate: Candidate, start: Fit, evaluations: int) -> Fit:
    """A quick refit with a law from where the rig stands, weighed at last as `start` is.

    First the law's own numbers alone: a constant that is let go too early takes its place.

    Args:
        told: as `told_trials` gives it.
        candidate: one of its laws.
        start: the quick fit without the law.
        evaluations: budget of each descent.
    """
    first = thinned(extended_model(told, candidate))
    step = max(candidate.step, candidate.entry.low / candidate.entry.scale)
    shapes = [shape.value / shape.scale for shape in candidate.shapes]
    x = calmed(first, np.append(told.x, [step, *shapes]), told)
    for horizon in HORIZONS:
        x = _constants_held(replace(first, horizon=horizon), x, 10)
    x = solve(first, x, 2 * evaluations).x
    model = replace(extended_model(start, candidate), entries=first.entries)
    return solve(model, x, evaluations)
