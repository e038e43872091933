"""diagnose(records, rig) -> Diagnosis: where the misfit is, which law explains it, how sure."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..model.rig import Rig
from .base import fit_base
from .causes import hidden_masses, leaving_out
from .evidence import excess, explained
from .extend import worst_ratio
from .finding import Diagnosis, crowded
from .fit import CRAWL, DOMINATED, Fit
from .form import within_form
from .problem import make_problem
from .records import Record, check_record_against_rig, split_records
from .refits import Progress
from .screen import VISIBLE
from .search import LEAST_SHARE, Search
from .spikes import without_spikes
from .standing import alike_pairs, floor_visibility, misfit_chance, whiteness
from .tolerances import strained, strays
from .whereabouts import CLEARED, SMALL_EXCESS, stray_place


def diagnose(
    records: Sequence[Record],
    rig: Rig,
    held: Sequence[Record] = (),
    progress: Progress = lambda text: None,
    left_out: Collection[str] = (),
) -> Diagnosis:
    """Find what a rig's model lacks, place it, and measure the gain on records never fitted.

    Args:
        records: measured, as read at the door; those that say ``split = "held_out"`` are held out.
            Samples that stand out alone are taken for what their neighbours say.
        rig: the model that is asked, as read at the door; its numbers carry SI units.
        held: further records to hold out.
        progress: told what is being done.
        left_out: names of laws that are not to be tried, where they cannot be the cause or where
            it is asked what would be said without them.

    Returns:
        The diagnosis; laws are accepted one at a time while the gain is real.

    Raises:
        ValueError: in the words of the door.

    Source: DESIGN's order; tests/identification/test_diagnose.py, tests/test_real_records.py.
    """
    smooth, smooth_held = ([without_spikes(one) for one in some] for some in (records, held))
    train, kept, split = split_records(smooth, smooth_held)
    for record in (*train, *kept):
        check_record_against_rig(record, rig)
    unseen = make_problem(kept, rig) if kept else None
    problem = leaving_out(make_problem(train, rig), left_out)
    progress("fitting the rig as it stands")
    base = fit_base(problem, CRAWL)
    progress("screening laws and places")
    search = Search(base, unseen, progress)
    search.grow()
    return _verdict(search, split)


def _shows(fit: Fit) -> bool:
    """Whether a fit leaves more than noise and what the form of lumped laws misses."""
    left = excess(fit) > SMALL_EXCESS and misfit_chance(fit) < CLEARED
    return left and not within_form(fit)


def _stands_in(search: Search) -> bool:
    """Whether a channel errs, or the drive, and what is named does not tell how.

    Without it all else fits; with what is named it does not. A law of an instrument is exact.
    One of the mechanism may leave what its form misses, but never ten times the noise.
    """
    if not _shows(search.fit):
        return False
    places = {one.candidate.place for one in search.accepted}
    sensors = {s.channel.name for p in search.base.problem.records for s in p.sensors}
    own = len(places) == 1 and places <= sensors
    far = worst_ratio(search.fit) > DOMINATED
    if not (own or far) or not search.apart or not search.apart[0].fits:
        return False
    return far or places == {search.apart[0].what}


def _verdict(search: Search, split: str) -> Diagnosis:
    """Sum up."""
    left = excess(search.fit)
    share = explained(search.base, search.fit)
    if not search.accepted:
        beyond = any(one.beyond for one in search.fit.used) or bool(strays(search.fit))
        beyond = beyond or bool(strained(search.fit))
        status = "unknown" if beyond or _shows(search.fit) else "adequate"
    elif crowded(search.accepted) or (left > SMALL_EXCESS and share < LEAST_SHARE):
        status = "unknown"
    elif worst_ratio(search.fit) > DOMINATED and not search.believed(share):
        status = "unknown"
    elif _stands_in(search):
        status = "unknown"
    else:
        status = "ambiguous" if search.rivals else "named"
    lost = status == "unknown" and excess(search.base) > SMALL_EXCESS
    where = search.where if lost else None
    if status == "unknown" and where is None:
        where = stray_place(search.fit)
    blind = tuple(c.name for c in search.first if floor_visibility(search.base, c) < VISIBLE)
    blind += hidden_masses(search.base.problem)
    return Diagnosis(
        status,
        search.base,
        search.fit,
        tuple(search.accepted),
        tuple(search.rivals),
        tuple(search.trials),
        tuple(search.first),
        blind,
        alike_pairs(search.first),
        search.held_before,
        search.held_now,
        split,
        (whiteness(search.base), whiteness(search.fit)),
        tuple(search.stages),
        where,
    )
