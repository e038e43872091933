"""Which laws are linear in the motion: with those alone a mechanism still answers in proportion."""

from __future__ import annotations

from functools import cache

import numpy as np

from ..model.law import Law, Place, Scales

SAMPLES, STEP = 24, 0.05
"""Motions that a law is tried on: so many instants, so far apart [s]."""

STILL = 5
"""Instants by which a motion is moved to see whether a law hangs on the date [-]."""


@cache
def is_linear(law: Law) -> bool:
    """Whether a law's force on two motions together is that on each, and hangs on no date [-].

    Tried on a few motions from rest. Laws of a told motion count for not linear.

    Source: tests/identification/test_linear_laws.py.
    """
    if not law.acts or law.swing is not None:
        return False
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(2, 2, SAMPLES))
    late = np.concatenate([np.zeros((2, STILL)), first[:, :-STILL]], axis=1)
    alone = _forces(law, first)
    same = np.allclose(_forces(law, first + second), alone + _forces(law, second), rtol=1e-6)
    return same and np.allclose(_forces(law, late)[STILL:], alone[:-STILL], rtol=1e-6)


def _forces(law: Law, motion: np.ndarray) -> np.ndarray:
    """Force [N or N m] on a motion of stretch and rate, shape (2, n), that sets out from rest."""
    strength, place = 0.5, Place(1.0, 1.0, 0.01, 0.01)
    if law.memory is None:
        assert law.force is not None
        stretch, rate = motion
        return np.asarray(law.force(strength, stretch, rate, place))
    scales = Scales(1.0, 1.0, 1.0, 1.0, 1.0)
    shapes = law.memory.shapes_at([s.trials(scales)[0] for s in law.shapes], strength, place)
    before = np.zeros((2, 1))
    memory, found = law.memory.begin(shapes, *before), []
    for after in motion.T[:, :, None]:
        memory = law.memory.advance(shapes, memory, before, after, STEP)
        found.append(float(np.asarray(law.memory.force(strength, shapes, memory, *after))[0]))
        before = after
    return np.array(found)
