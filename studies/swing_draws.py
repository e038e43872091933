"""From a posterior of the robot's constants to the robots for which a swing must do."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..model.rig import Rig
    from ..optimize.task import SwingTask

DRAWS = 41
"""Draws that stand for a posterior [-]."""


def with_draws(task: SwingTask, rig: Rig) -> SwingTask:
    """The task with draws from its posterior, where it names one.

    Args:
        task: as read.
        rig: the robot; draws say some of its numbers.

    Returns:
        The task; its draws, equally spaced in the sample, are ordered along the direction in
        which they differ most, so that neighbors are alike [SI].

    Raises:
        ValueError: for a file without draws of the rig's numbers.
    """
    from ..optimize.task import POSTERIOR
    from .draws import draws_of_rig

    file = task.robust.file
    if task.robust.parameter != POSTERIOR or file is None:
        return task
    known = draws_of_rig(file, rig, DRAWS)
    kept = np.stack(list(known.values()), axis=1)
    scaled = (kept - kept.mean(axis=0)) / np.maximum(kept.std(axis=0), 1e-300)
    along = scaled @ np.linalg.svd(scaled, full_matrices=False)[2][0]
    rows = kept[np.argsort(along)]
    draws = tuple(dict(zip(known, map(float, row), strict=True)) for row in rows)
    return replace(task, robust=replace(task.robust, draws=draws))
