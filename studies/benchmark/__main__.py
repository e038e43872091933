"""Prints how long motions take, beside what else there is at the same accuracy."""

from __future__ import annotations

import os
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ..engine import start_engine

if TYPE_CHECKING:
    from .responses import Row


def main(words: Sequence[str] | None = None) -> None:
    """Measure and print, all parts or those that are named; some minutes."""
    parts = {
        "responses": _responses,
        "maps": _maps,
        "planar": _planar,
        "optimal": _optimal,
        "fits": _fits,
        "peers": _peers,
        "first": _first,
    }
    parser = ArgumentParser("python -m supple.studies.benchmark", description=__doc__)
    parser.add_argument("part", nargs="*", help=f"all of {', '.join(parts)} by default")
    asked = parser.parse_args(words).part or list(parts)
    for name in asked:
        if name not in parts:
            parser.error(f"expected one of {', '.join(parts)}, found '{name}'. Mend: name these.")
    start_engine()
    for name in asked:
        parts[name]()
    if asked != ["first"]:
        print("* what the ratios are against")


def _responses() -> None:
    from .responses import BATCH, GOAL, SAMPLES, linear, with_law

    print(f"{'':<46}{'error':>10}{'each':>12}{'ratio':>9}")
    print(f"A linear response of {SAMPLES} samples, {BATCH} at once, to an impact on the robot")
    rows = linear()
    _show(rows)
    peer = next(row for row in rows if row.matches)
    equal = peer.seconds / rows[0].seconds
    reached = peer.error <= rows[0].error
    words = (
        "at the same accuracy" if reached else "than the most accurate solve_ivp, which has less"
    )
    coarse = min(row.seconds for row in rows[1:]) / rows[0].seconds
    print(f"  {equal:.0f} times faster {words} (goal {GOAL}: {_met(equal >= GOAL)}),")
    print(f"  {coarse:.0f} times faster than the fastest setting, however coarse")
    print(f"A response of {SAMPLES} samples with friction in the wrist, alone")
    _show(with_law())


def _maps() -> None:
    from .maps import GOALS, RATE, SECONDS, SIDE, map_rows

    print(
        f"A design of a map of {SIDE} by {SIDE} wrists, {SECONDS:g} s at {RATE:g} Hz, its RMS, "
        "decrement and peak; processor time"
    )
    _goals(map_rows(), GOALS)


def _planar() -> None:
    from .swings import BATCH, FRICTION, GOALS, planar_rows

    for friction, words in ((FRICTION, "with friction in the wrist"), (0.0, "without a law")):
        print(
            f"A planar swing of 1.2 s with its arm driven, {words}, {BATCH} at once; processor time"
        )
        _goals(planar_rows(friction), GOALS)


def _optimal() -> None:
    from .optimal import GOALS, POINTS, SPEED, optimal_seconds

    print(f"The optimal swing, {SPEED:g} m/s, {POINTS} points, 3 scenarios and the worst between")
    for name, spent in optimal_seconds().items():
        goal = GOALS[name]
        print(f"  {name:<42}{spent:>18.2f} s (goal {goal:g} s: {_met(spent <= goal)})")


def _fits() -> None:
    from .fits import AGREE, GOALS, RECORDS, SAMPLES, raced

    print(f"Eight constants of three masses in a row, {RECORDS} records of {SAMPLES} samples")
    race = raced()

    def told(words: str, value: float, goal: float, most: bool) -> None:
        met = value <= goal if most else value >= goal
        which = "not installed: pip install '.[bench]'" if value != value else _met(met)
        print(f"  {words:<58}{_figure(value):>9} (goal {goal:g}: {which})")

    told("fit, compiled [s]", race.fit, GOALS["fit"], most=True)
    words = "times less than lmfit over solve_ivp, at least"
    if race.apart > AGREE:  # then there is no ratio: it did not do the same
        print(f"  lmfit stopped after {race.lmfit:.0f} s, {race.apart:.2g} standard errors away")
        print(f"  with {100 * race.worse:.2g} % more left than ours: no ratio is claimed")
    else:
        told(words, race.lmfit / race.fit, GOALS["lmfit"], most=False)
        print(f"  their answers are {race.apart:.2g} standard errors apart at most; it leaves")
        print(f"  {100 * race.worse:.2g} % more than ours, from a start that is nearer")
    gate = "passed" if race.converged else "NOT passed"
    told(f"posterior on the clock, gate {gate} [s]", race.posterior, GOALS["posterior"], most=True)
    print(f"  {race.work:.0f} s of processor time, on {os.cpu_count()} cores")
    for name, theirs in (("emcee", race.emcee), ("PINTS", race.pints)):
        words = f"times the effective samples a second of {name} over solve_ivp"
        told(words, race.ours / theirs, GOALS[name], most=False)
    print(f"  {race.ours:.0f} a second; one likelihood by solve_ivp takes {race.likelihood:.2f} s")


def _peers() -> None:
    from .swing_peers import GOAL, beside

    print("The linear optimal swing from nothing, as its peers' users write it; wall time")
    found = beside()
    for one in found:
        told = f"{one.theirs.words}, {one.theirs.seconds:.2f} s, cost {one.theirs.cost:.6g}"
        print(f"  {one.peer}: {told}")
        same = "at most 1 % more" if one.is_equal else "HIGHER"
        told = f"{one.seconds:.2f} s, cost {one.cost:.6g}, {same}"
        print(f"    supple, {one.splines} splines: {told}")
        goal = f"goal {GOAL:g}: {_met(one.is_equal and one.ratio >= GOAL)}"
        goal = "no equal: what it found is worth little" if one.is_unusable else goal
        print(f"    {_figure(one.ratio)} times less time ({goal})")
    if len(found) < 2:
        print("  rockit or dymos is not installed: pip install '.[bench]'")


def _goals(rows: list[Row], goals: Mapping[str, float]) -> None:
    """A table, and how the ratios against those that are marked stand to their goals."""
    _show(rows)
    for peer, goal in goals.items():
        row = next((row for row in rows if row.matches and row.name.startswith(peer)), None)
        if row is None:
            print(f"  {peer} is not installed: pip install '.[bench]'")
        else:
            ratio = row.seconds / rows[0].seconds
            met = f"goal {goal:g}: {_met(ratio >= goal)}"
            print(f"  {_figure(ratio)} times less than {row.name} ({met})")


def _first() -> None:
    from .first import GOALS, first_calls
    from .responses import HELP_GOAL, help_seconds

    print("First call in a process of its own: compiled, and with compiled code on disk")
    for name, both in first_calls().items():
        met = all(spent <= goal for spent, goal in zip(both, GOALS, strict=True))
        told = " and ".join(f"{spent:.2f} s" for spent in both)
        wanted = " and ".join(f"{goal:g}" for goal in GOALS)
        print(f"  {name:<42}{told:>20} (goals {wanted} s: {_met(met)})")
    seconds = help_seconds()
    print(f"supple --help: {seconds:.2f} s (goal {HELP_GOAL} s: {_met(seconds <= HELP_GOAL)})")


def _met(yes: bool) -> str:
    return "met" if yes else "MISSED"


def _figure(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"


def _show(rows: list[Row]) -> None:
    for row in rows:
        ratio = "" if row is rows[0] else _figure(row.seconds / rows[0].seconds)
        mark = " *" if row.matches else ""
        line = f"  {row.name:<44}{row.error:>10.1e}{row.seconds * 1e6:>9.0f} us{ratio:>9}{mark}"
        print(line)


if __name__ == "__main__":
    main()
