"""A screen that no drawn-away constants bend: from what small motions, or the rig, say of them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model.law import Law
from .allowance import Allowance
from .base import fit_base
from .causes import possible_causes
from .extend import NO_STEP, UNASKED_STEP, calmed, extended_model, thinned, worst_ratio
from .fit import CRAWL, DOMINATED, Fit, constants_held, learn_noise, solve
from .free import Entry
from .motions import with_scales
from .prepare import Prepared
from .problem import Model
from .screen import Candidate, screen
from .sliding import in_place_of_spring
from .starts import told_start
from .tolerances import PULLED, worst_pull
from .trial import has_corners, of_other_kind, with_other_places, without_general

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


NOTHING = 0.01
"""Share of the cost that a law must take away beside held constants where no step asks for it [-].
"""

FALLING = 0.02
"""Share of the cost that a descent must still take away to go on [-]."""

ROUNDS = 3
"""Descents that follow the first one where each still falls, at most [-]."""

GLANCE = 4
"""Evaluations after which one of several starts of a law is chosen [-]."""

QUIETER = 0.7
"""Loudness of the quieter half of the records, over that of all, from which it is no other test
than the whole [-]."""


def quiet_fit(fit: Fit) -> Fit | None:
    """The fit of the quieter half of the records alone, where they fit.

    Most of what a model lacks shows in large motions first; constants that small ones tell have
    not made room for it.

    Args:
        fit: of a model whose errors dominate what is found.

    Returns:
        It; None where all records are as loud, where small motions are misfitted too or strain the
        rig, or where causes are named already.

    Source: tests/identification/test_quiet.py.
    """
    records = fit.problem.records
    loud = _loudness(records)
    calm = sorted(records, key=lambda one: loud[one.name])[: len(records) // 2]
    most = max((loud[one.name] for one in calm), default=np.inf)
    if fit.model.causes or most > QUIETER * max(loud.values()):
        return None
    names = {one.name for one in calm}
    kept = tuple(one for one in records if one.name in names)
    found = fit_base(replace(fit.problem, records=kept, floor={}), CRAWL)
    return found if worst_ratio(found) < DOMINATED and worst_pull(found) <= PULLED else None


def _loudness(records: Sequence[Prepared]) -> dict[str, float]:
    """Size of every record's readings over the largest of the same channels, their mean [-]."""
    sizes = {
        (one.name, sensor.channel.name): float(np.std(sensor.values))
        for one in records
        for sensor in one.sensors
    }
    largest: dict[str, float] = {}
    for (_, channel), size in sizes.items():
        largest[channel] = max(largest.get(channel, 1e-300), size)
    return {
        one.name: float(np.mean([sizes[one.name, s.channel.name] / largest[s.channel.name]
                                 for s in one.sensors]))
        for one in records
    }  # fmt: skip


def told_fit(fit: Fit) -> Fit:
    """The records' starts fitted, with all constants at what small motions or the rig say.

    Gains, delays and zeros of its instruments are held as well; `begun_from_told` lets them go.

    Weighed by the instruments' noise, and with no mode allowed for that rings by itself: where a
    cause is missing, constants and weights have moved to make room for it. Natural sizes of laws
    are those of the motions there.

    Args:
        fit: of a model whose errors dominate what is found.
    """
    plain = replace(fit.model, noises=learn_noise(fit), allowances=_told_motions(fit), followed={})
    x = told_start(fit.model, fit.x)
    calm = quiet_fit(fit)
    if calm is not None:
        known = {e.label: calm.value(i) for i, e in enumerate(calm.model.entries) if not e.record}
        for index, entry in enumerate(plain.entries):
            if entry.slot == "numbers" and entry.label in known:
                x[index] = known[entry.label] / entry.scale
    plain, x = _instruments_held(plain, x)
    found = solve(plain, constants_held(plain, x, 20), 0)
    return replace(found, model=replace(plain, problem=with_scales(plain, found.x)))


def _instruments_held(model: Model, x: np.ndarray) -> tuple[Model, np.ndarray]:
    """The model with the records' gains, delays and zeros where `x` has them, and the rest of `x`.

    Far from a minimum their priors hold nothing: where friction kept a wrist from moving, gains of
    2.5 and starts with them hid it from every channel.
    """
    own = [i for i, e in enumerate(model.entries) if not _is_of_instrument(e)]
    held = [(e, float(x[i] * e.scale)) for i, e in enumerate(model.entries) if _is_of_instrument(e)]
    entries = tuple(model.entries[i] for i in own)
    return replace(model, entries=entries, fixed=(*model.fixed, *held)), x[own]


def _is_of_instrument(entry: Entry) -> bool:
    return entry.nuisance and np.isfinite(entry.prior) and entry.slot not in ("numbers", "start")


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
    """The fit of told constants, and the laws that gain most there.

    Args:
        fit: of the model so far.
        always: which candidates are tried whatever they gain.

    Returns:
        That fit, and the `MOST` candidates of its screen that gain most, or twice as many where
        they are near each other, the best one's law at every other place where it is seen, and as
        many of the mechanism where that is an instrument's, one at least, or the reverse; none
        where errors of the model neither dominate nor strain the rig.

    Source: DESIGN's fourth step; tests/identification/test_told.py.
    """
    if worst_ratio(fit) <= DOMINATED and worst_pull(fit) <= PULLED:
        return fit, []
    told = told_fit(fit)
    found = screen(told)
    worth = [c for c in without_general(found) if c.gain > WORTH * found[0].gain]
    near = [c for c in worth[MOST : 2 * MOST] if c.gain > NEARLY * found[0].gain]
    chosen = with_other_places(worth, [c for c in found if c.gain > SEEN], MOST)
    others = of_other_kind(worth, MOST)
    if found and found[0].law.slot:  # a drawn-away channel outshines every law of the mechanism
        others = others or of_other_kind(found, 1)
    chosen += [c for c in (*near, *others) if c not in chosen]
    return told, chosen + [c for c in found if always(c) and c not in chosen]


def unasked_trials(told: Fit, tried: Collection[str]) -> list[Candidate]:
    """Laws of every joint that a small step may not ask for; the best one first.

    Play and what sticks change which share of the load a spring carries, and a loss that grows
    with the motion is a spring's own damping until that lets it go: beside constants that have not
    followed, such a law's slope may even point the other way.

    Args:
        told: as `told_trials` gives it.
        tried: names of causes that need no trial any more.

    Returns:
        The candidates of those laws there that hold all simpler ones, by what they gain.

    Source: tests/identification/test_told.py.
    """
    causes = [one for one in possible_causes(told) if _is_unasked(one[1])]
    simpler = {f"{place}/{law.limit}" for place, law in causes if law.limit}
    return [c for c in screen(told, causes) if c.name not in {*tried, *simpler}]


def _is_unasked(law: Law) -> bool:
    loses = law.dissipative and law.memory is None
    one_way = not law.signed and (loses or has_corners(law))
    return law.kind == "link" and (law.sticks or one_way)


@dataclass(frozen=True, eq=False)  # its arrays have no single truth
class Begun:
    """A law that was fitted from told constants, by the instruments' noise.

    Attributes:
        candidate: the law.
        model: with it, all constants free, on thinned records.
        x: scaled unknowns [-].
        cost: there [-]; it compares with that of other laws from the same told constants.
    """

    candidate: Candidate
    model: Model
    x: np.ndarray
    cost: float


def begun_from_told(told: Fit, candidate: Candidate, start: Fit, evaluations: int) -> Begun | None:
    """A law fitted from told constants, by the weights there.

    First the law's own numbers alone: a constant that is let go too early takes its place.

    Args:
        told: as `told_trials` gives it.
        candidate: one of its laws.
        start: the quick fit without the law.
        evaluations: budget of the descent with all constants free.

    Returns:
        It; None for a law that no step asks for and that takes nothing away beside held constants.

    Source: tests/identification/test_told.py.
    """
    first = thinned(extended_model(told, candidate))
    points = [calmed(first, x, told) for x in _begun_with(told, candidate)]
    opening, idle = replace(first, horizon=HORIZONS[0]), points[0]
    points = [constants_held(opening, x, GLANCE) for x in points]
    x = min(points, key=lambda one: _cost(opening, one))
    for horizon in HORIZONS:
        x = constants_held(replace(first, horizon=horizon), x, 10)
    if not candidate.gain and _cost(first, x) > (1.0 - NOTHING) * _cost(first, idle):
        return None
    whole, x = _released(first, x, len(told.x), start.model)
    found = solve(whole, x, evaluations)
    return Begun(candidate, whole, found.x, found.cost)


def weighed_as(start: Fit, begun: Begun, evaluations: int) -> Fit:
    """A law that was begun from told constants, weighed as another fit is.

    Args:
        start: the quick fit without the law.
        begun: the law.
        evaluations: budget of each descent.

    Returns:
        The quick refit with it.

    Source: tests/identification/test_told.py.
    """
    model = replace(extended_model(start, begun.candidate), entries=begun.model.entries)
    found = solve(model, begun.x, evaluations)
    for _ in range(ROUNDS):  # what rings by itself is sought along a narrow valley
        before, found = found, solve(model, found.x, evaluations)
        if found.cost > (1.0 - FALLING) * before.cost:
            break
    return found


def _cost(model: Model, x: np.ndarray) -> float:
    return float(np.sum(model.residual(x) ** 2))


def _released(model: Model, x: np.ndarray, count: int, bare: Model) -> tuple[Model, np.ndarray]:
    """The model with all that a bare one leaves open and its own law, the first `count` without."""
    known = {e.label: value / e.scale for e, value in model.fixed}
    known |= {e.label: float(value) for e, value in zip(model.entries, x, strict=True)}
    entries = (*bare.entries, *model.entries[count:])
    values = [known[e.label] for e in bare.entries]
    whole = replace(model, entries=entries, fixed=bare.fixed)
    return whole, np.append(values, x[count:])


def _begun_with(told: Fit, candidate: Candidate) -> list[np.ndarray]:
    """Scaled unknowns [-] with a law of the screen's size, or in place of a part of its spring.

    Where no step asks for it, it begins strong too.
    """
    low = candidate.entry.low / candidate.entry.scale
    shapes = [shape.value / shape.scale for shape in candidate.shapes]
    steps = [max(candidate.step, low)]
    if abs(candidate.step) < NO_STEP:
        steps.append(UNASKED_STEP)
    begun = [np.append(told.x, [step, *shapes]) for step in steps]
    return [*begun, *in_place_of_spring(told, candidate)]
