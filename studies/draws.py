"""A posterior's draws, as `supple identify --posterior` leaves them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..model.rig import Rig


def read_draws(file: Path) -> dict[str, np.ndarray]:
    """Every unknown of a posterior, the chains one after the other in turn.

    Args:
        file: netCDF with a group ``posterior``, whose variables run over ``chain`` and ``draw``.

    Returns:
        By name, each of shape (draws,) [SI].

    Raises:
        ValueError: for a file that is not one.
    """
    import h5netcdf

    from ..model.door import fault

    found: dict[str, np.ndarray] = {}
    try:
        with h5netcdf.File(file, "r") as whole:
            group: Any = whole["posterior"]
            for name, one in group.variables.items():
                if set(one.dimensions) == {"chain", "draw"}:
                    values = np.asarray(one[...], float)
                    by_draw = values.T if one.dimensions[0] == "chain" else values
                    found[name] = by_draw.ravel()
    except (OSError, KeyError, ValueError) as error:
        mend = "name the posterior.nc of `supple identify --posterior`"
        expected = "netCDF with a group 'posterior'"
        raise fault(file, "", expected, type(error).__name__, mend) from None
    return found


def draws_of_rig(file: Path, rig: Rig, most: int) -> dict[str, np.ndarray]:
    """Some of a posterior's draws of a rig's numbers, equally spaced in the sample.

    Args:
        file: see `read_draws`.
        rig: the rig; draws say some of its numbers.
        most: draws at most [-].

    Returns:
        By the rig's names, each of shape (draws,), all above zero [SI].

    Raises:
        ValueError: for a file without draws of the rig's numbers, or with some below zero.
    """
    from ..model.door import fault

    table = read_draws(file)
    known = {name: values for name, values in table.items() if name in rig.parameters}
    if not known:
        expected = f"draws of the numbers of {rig.path.name}"
        found = ", ".join(list(table)[:6]) or "none"
        raise fault(file, "posterior", expected, found, "fit this rig with --posterior")
    whole = np.stack(list(known.values()), axis=1)
    if not np.isfinite(whole).all() or not (whole > 0.0).all():
        mend = "sample again with bounds above 0"
        raise fault(file, "posterior", "draws above 0", "others", mend)
    kept = whole[np.linspace(0, len(whole) - 1, min(most, len(whole))).astype(int)]
    return {name: kept[:, k] for k, name in enumerate(known)}
