"""Prints how long a response takes, beside scipy's solve_ivp at the same accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..engine import start_engine

if TYPE_CHECKING:
    from .responses import Row


def main() -> None:
    """Measure and print; a few tens of seconds."""
    start_engine()
    from .responses import BATCH, GOAL, HELP_GOAL, SAMPLES, help_seconds, linear, with_law

    print(f"{'':<44}{'error':>10}{'one response':>14}{'ratio':>9}")
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
    met = "met" if equal >= GOAL else "MISSED"
    print(f"  {equal:.0f} times faster {words} (goal {GOAL}: {met}),")
    print(f"  {coarse:.0f} times faster than the fastest setting, however coarse")
    print(f"A response of {SAMPLES} samples with friction in the wrist, alone")
    _show(with_law())
    _planar()
    print("* the fastest setting of solve_ivp that is as accurate, or its most accurate one")
    seconds = help_seconds()
    met = "met" if seconds <= HELP_GOAL else "MISSED"
    print(f"supple --help: {seconds:.2f} s (goal {HELP_GOAL} s: {met})")


def _planar() -> None:
    from .swings import BATCH, GOAL, planar_rows

    print(f"A planar swing of 1.2 s with its arm driven, {BATCH} at once, processor time")
    rows = planar_rows()
    _show(rows)
    peer = next(row for row in rows if row.matches)
    ratio = peer.seconds / rows[0].seconds
    met = "met" if ratio >= GOAL else "MISSED"
    print(f"  {ratio:.0f} times less than solve_ivp at rtol 1e-6 (goal {GOAL}: {met})")


def _figure(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"


def _show(rows: list[Row]) -> None:
    for row in rows:
        ratio = "" if row is rows[0] else _figure(row.seconds / rows[0].seconds)
        mark = " *" if row.matches else ""
        line = f"  {row.name:<42}{row.error:>10.1e}{row.seconds * 1e6:>11.0f} us{ratio:>9}{mark}"
        print(line)


if __name__ == "__main__":
    main()
