"""Where what no law explains sits, in words and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from .finding import Diagnosis
from .misreading import misreading, misreading_json
from .missing import missing_json
from .whereabouts import Whereabouts


def all_else(where: Whereabouts | None) -> str:
    """What the records say without the one thing that is not believed."""
    if where is None or where.kind == "place" or not where.apart:
        return ""
    what = "all that is not driven by the told motion" if where.kind == "drive" else "all else"
    return f" Without it {what} fits to within its noise."


def stand_ins(diagnosis: Diagnosis) -> str:
    """A sentence on laws that crowd at one place; empty where none do."""
    place = diagnosis.crowded
    if place is None:
        return ""
    return f" So many laws at {place} stand in for one that is not among them."


def where_words(where: Whereabouts | None) -> list[str]:
    """Why it is there, in a sentence or two."""
    if where is None:
        return []
    each = [f"{np.sqrt(1.0 + one.left):.2g} without {one.what}" for one in where.apart]
    said = [f"Misfit of all else, in units of its noise: {', '.join(each)}."] if each else []
    if where.forces:
        shares = [f"{100 * one.explained:.0f} % at {one.place}" for one in where.forces[:3]]
        said.append(
            f"A free force explains of the misfit of {where.forces[0].record}: {', '.join(shares)}."
        )
    return said


def where_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Where what no law explains sits, and its shape: a force, or a channel's error [SI]."""
    where, force, error = diagnosis.where, None, None
    if where is None:
        return {"where": None, "missing_force": None, "misreading": None}
    if where.kind == "channel" and where.apart:
        error = misreading_json(misreading(diagnosis.base, where.apart[0]))
    if where.forces:
        turns = diagnosis.base.problem.mechanism.turns(where.place)
        force = missing_json(where.forces[0], turns)
    told = {
        "place": where.place,
        "kind": where.kind,
        "without": [
            {"what": one.what, "reduced_chi2": 1.0 + one.left, "fits": one.fits}
            for one in where.apart
        ],
        "forces": [{"place": one.place, "explained": one.explained} for one in where.forces],
    }
    return {"where": told, "missing_force": force, "misreading": error}
