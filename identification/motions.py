"""How far and how fast each place moves in a fit: natural sizes for laws, curves for figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from ..model.law import Scales
from ..model.linear import Mechanism, mass_matrix
from ..model.respond import law_geometry, state_history
from .problem import Model, Problem

BODIES = ("head", "body", "mass")
"""Kinds of place that a law pushes against the ground: there a tenth of what its own inertia asks
for is a natural force, not a tenth of what a spring carries."""


def motions(
    model: Model, x: np.ndarray, places: Sequence[str]
) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    """Stretch and rate at each place, one pair a record and row, as the fit sees them [SI]."""
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {place: [] for place in places}
    numbers = model.problem.numbers
    owner = [
        place for place in places for _ in model.problem.mechanism.place_rows(place, numbers, np)[1]
    ]
    for prepared in model.problem.records:
        plant = model.plant(prepared)
        z = jnp.asarray(model.vector(prepared, x))
        states = state_history(plant, model.substeps(prepared), z, *model.arguments(prepared))[0]
        # a motion that ran away has no size; where it did, it counts as rest
        states = np.nan_to_num(states[: prepared.count], nan=0.0, posinf=0.0, neginf=0.0)
        bare = replace(plant, law_places=())
        everywhere = replace(plant, law_places=tuple(places))
        wide = np.zeros(everywhere.size)
        for name in bare.slots:
            if name != "strengths":
                wide[everywhere.slots[name]] = np.asarray(z)[plant.slots[name]]
        rows = [np.asarray(part) for part in law_geometry(everywhere, jnp.asarray(wide))]
        stretch = states @ rows[0].T
        rate = states @ rows[1].T + prepared.inputs[: prepared.count] @ rows[2].T
        for index, place in enumerate(owner):
            found[place].append((stretch[:, index], rate[:, index]))
    return found


def with_scales(model: Model, x: np.ndarray) -> Problem:
    """The problem with natural scales and widths [SI] of every place, from the motions at x."""
    problem = model.problem
    places = list(problem.mechanism.law_places())
    moved = motions(model, x, places)
    numbers = problem.numbers
    scales, widths = {}, {}
    force, kinds = _force_scale(problem), problem.mechanism.law_places()
    frequency = max(float(np.median([p.frequency for p in problem.records])), 1e-6)
    for place in places:
        stretch = float(np.sqrt(np.mean([np.mean(s**2) for s, _ in moved[place]]))) or 1e-12
        rate = float(np.sqrt(np.mean([np.mean(v**2) for _, v in moved[place]]))) or 1e-12
        _, k, c = problem.mechanism.place_rows(place, numbers)
        stiffness, damping = float(np.max(np.abs(k))), float(np.max(np.abs(c)))
        size = max(stiffness * stretch, damping * rate, force if stiffness == 0 else 0.0)
        if kinds[place] in BODIES:
            carried = inertia_at(problem.mechanism, place, numbers)
            size = carried * (2 * np.pi * frequency) ** 2 * stretch
        scales[place] = Scales(
            stretch, rate, 0.1 * (size or 1.0), stiffness, 1 / (2 * np.pi * frequency)
        )
        widths[place] = (problem.corner * stretch, problem.corner * rate)
    return replace(problem, scales=scales, widths=widths)


def inertia_at(mechanism: Mechanism, place: str, numbers: Mapping[str, float]) -> float:
    """What a body that nothing holds sets against a fast push [kg or kg m^2].

    Args:
        mechanism: a robot or a chain.
        place: one of its bodies.
        numbers: the mechanism's, by contract name [SI].

    Source: the driving point's inertia ``1 / (r M^-1 r')``; tests/identification/test_motions.py.
    """
    n = len(mechanism.coordinates)
    row = np.asarray(mechanism.place_rows(place, numbers, np)[0])[0, :n]
    mass = np.asarray(mass_matrix(mechanism.rows(numbers, np)))[:n, :n]
    return 1.0 / float(row @ np.linalg.pinv(mass, hermitian=True) @ row)


def _force_scale(problem: Problem) -> float:
    """Root mean square of the forces that drive the records, or of the inertia of the first."""
    pushes = [
        float(np.sqrt(np.mean(c.values**2)))
        for p in problem.records
        for c in p.record.inputs
        if c.quantity in ("force", "torque")
    ]
    if pushes:
        return max(pushes)
    numbers = problem.numbers
    inertia = float(np.max(np.asarray(problem.mechanism.rows(numbers).inertias)))
    frequency = problem.records[0].frequency
    reach = float(np.std(problem.records[0].sensors[0].values))
    return inertia * (2 * np.pi * frequency) ** 2 * reach
