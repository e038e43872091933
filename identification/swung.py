"""Which laws of a told motion are worth a trial: those of swings that are told and large."""

from __future__ import annotations

import numpy as np

from ..model.chain import DERIVATIVES
from ..model.law import Law, Scales
from ..model.robot import Robot
from ..model.swung import KINDS
from ..model.swung_plant import swings_of
from .prepare import Prepared
from .problem import Cause, Problem

SMALL = 0.5
"""Range of a told angle up to which motions are small, as the model takes them to be [rad]: beyond
it a cosine is an eighth away from one at least."""

UNIT = Scales(1.0, 1.0, 1.0, 1.0, 1.0)
"""Scales that give a law of a told motion a natural strength of one [SI]."""


def is_swung(problem: Problem, cause: Cause) -> bool:
    """Whether a cause is a law of what a told motion swings."""
    return cause[1] in swings_of(problem.mechanism)


def swings(problem: Problem, law: Law) -> bool:
    """Whether a law of a told motion has anything to act on in these records.

    Its force hangs on angles from where arm and club point at the ball, so they must be told; of
    small motions the model's own equations are good.

    Args:
        problem: records and rig.
        law: one of the mechanism's laws of a told motion.
    """
    joints = ("arm",) if law.kind == "arm" else ("arm", "wrist")
    return any(_turn(prepared, joints) > SMALL for prepared in problem.records)


def _turn(prepared: Prepared, joints: tuple[str, ...]) -> float:
    """Largest range of the angles that are told of these joints [rad]."""
    ranges = [
        float(np.ptp(column[: prepared.count]))
        for port, column in zip(prepared.ports, prepared.inputs.T, strict=True)
        if port.place in joints and DERIVATIVES.get(port.quantity) == 0
    ]
    return max(ranges, default=0.0)


def is_swung_place(problem: Problem, place: str) -> bool:
    """Whether a place stands for what a told motion swings, not for a spring or body of its own."""
    swings = isinstance(problem.mechanism, Robot)
    return swings and problem.mechanism.law_places().get(place) in KINDS.values()
