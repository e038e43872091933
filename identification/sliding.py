"""Starts for what slides: a spring that is found in small motions is partly what gives way."""

from __future__ import annotations

import numpy as np

from .causes import numbers_at
from .fit import Fit
from .screen import Candidate

SLIDES = 0.5
"""Share of a spring that is tried as the part that slides [-]."""


def in_place_of_spring(fit: Fit, candidate: Candidate) -> list[np.ndarray]:
    """Unknowns of a fit and of one law more, which takes over a part of the spring beside it.

    What sticks in small motions is a spring there, which the fitted stiffness holds already: on top
    of that, a law that slides in large ones could only do harm.

    Args:
        fit: without the law.
        candidate: any law.

    Returns:
        Scaled unknowns [-], one for each knee that the law tries; none for a law that does not
        stick, or where no stiffness is free.

    Source: tests/identification/test_sliding.py.
    """
    law = candidate.law
    at = [
        index
        for name in numbers_at(fit, candidate.place, "stiffness")
        for index, entry in enumerate(fit.model.entries)
        if entry.label == name
    ]
    if not (law.sticks and at):
        return []
    (knee,) = candidate.shapes
    slides = SLIDES * fit.value(at[0])
    found = []
    for value in law.shapes[0].trials(fit.problem.scales[candidate.place]):
        x = np.append(fit.x, [slides * value / candidate.entry.scale, value / knee.scale])
        x[at] *= 1.0 - SLIDES
        found.append(x)
    return found
