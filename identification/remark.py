"""A remark is what a pre-flight has to say of one thing in one place."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..model.door import fault
from .problem import Problem


@dataclass(frozen=True)
class Remark:
    """One thing that stands in the way of a fit, or deserves a second look.

    Attributes:
        check: bound, liveness, excitation, timing, units, channel or sampling.
        refuses: whether no fit can work; otherwise it is a warning.
        path: the file at fault.
        place: where in it.
        expected: what should be there.
        found: what is there.
        mend: what to do about it.
    """

    check: str
    refuses: bool
    path: Path
    place: str
    expected: str
    found: str
    mend: str

    @property
    def text(self) -> str:
        """All of it in one line."""
        return str(fault(self.path, self.place, self.expected, self.found, self.mend))


def place_of(problem: Problem, name: str) -> str:
    """Where a constant stands in the rig's file [-]."""
    if problem.rig.kind == "robot":
        return f"[parameters] {name}"
    section, _, what = name.rpartition(".")
    return f"[{section}] {what}"
