"""From a posterior of the robot's constants to the robots for which a swing must do."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

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
    from ..model.door import fault
    from ..optimize.task import POSTERIOR

    file = task.robust.file
    if task.robust.parameter != POSTERIOR or file is None:
        return task
    table = _table(task)
    known = {name: values for name, values in table.items() if name in rig.parameters}
    if not known:
        expected = f"draws of the numbers of {rig.path.name}"
        found = ", ".join(list(table)[:6]) or "none"
        raise fault(file, "posterior", expected, found, "fit a rig of a robot with --posterior")
    whole = np.stack(list(known.values()), axis=1)
    if not np.isfinite(whole).all() or not (whole > 0.0).all():
        mend = "sample again with bounds above 0"
        raise fault(file, "posterior", "draws above 0", "others", mend)
    kept = whole[np.linspace(0, len(whole) - 1, min(DRAWS, len(whole))).astype(int)]
    scaled = (kept - kept.mean(axis=0)) / np.maximum(kept.std(axis=0), 1e-300)
    along = scaled @ np.linalg.svd(scaled, full_matrices=False)[2][0]
    rows = kept[np.argsort(along)]
    draws = tuple(dict(zip(known, map(float, row), strict=True)) for row in rows)
    return replace(task, robust=replace(task.robust, draws=draws))


def _table(task: SwingTask) -> dict[str, np.ndarray]:
    """Every variable of the posterior, all chains one after the other in turn, (draws,) [SI]."""
    import xarray

    from ..model.door import fault

    file: Any = task.robust.file
    try:
        with xarray.open_dataset(file, group="posterior", engine="h5netcdf") as group:
            names = [
                str(name) for name in group.data_vars if set(group[name].dims) == {"chain", "draw"}
            ]
            found = {
                name: np.asarray(group[name].transpose("draw", "chain")).ravel() for name in names
            }
    except (OSError, KeyError, ValueError) as error:
        mend = "name the posterior.nc of `supple identify --posterior`"
        expected = "netCDF with a group 'posterior'"
        raise fault(file, "", expected, type(error).__name__, mend) from None
    return found
