"""The model on the first parts of the records, which tell how they start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .noise import trust_of
from .prepare import opening
from .problem import Model

MANY = 8192
"""Samples beyond which a record is cut short, not masked [-]."""


def opening_model(model: Model) -> Model:
    """The model on those first parts of the records that tell their start states.

    Long records are cut short; others are masked, which needs no further compiled length.
    """
    records = tuple(opening(p) if p.count > MANY else p for p in model.problem.records)
    trust = {
        (p.name, s.channel.name): trust_of(
            s.values, int(np.sum(s.times <= p.opening)), bool(s.times[0] > s.step)
        )
        for p in records
        for s in p.sensors
    }
    return replace(
        model, problem=replace(model.problem, records=records), noises=trust, only_opening=True
    )
