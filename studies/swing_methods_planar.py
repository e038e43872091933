"""The same nine classics and the optimal swing on the planar robot, where shapers fail."""

from __future__ import annotations

from functools import partial

from .study import Study
from .swing_methods import compare, show

STUDY = Study(
    "swing_methods_planar",
    "Which method leaves the least vibration at the same impact (planar robot; minutes)?",
    partial(compare, fidelity="planar"),
    show,
)
