"""What the law that is really there foretells of records that were never fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import read_inputs

if TYPE_CHECKING:
    from ..identification.fit import Fit

EVALUATIONS = 60
"""Budget of the descent with the true law [-], more than a diagnosis spends on a trial."""


def foretold_by_the_true_law(
    sidecars: Sequence[Path], base: Fit, cause: Mapping[str, Any]
) -> float | None:
    """The held-out error of the hidden effect's own law, fitted to the records that are not.

    It is begun from the constants of the rig as it is stated, whatever a diagnosis has tried.

    Args:
        sidecars: of all records, held-out ones among them.
        base: the fit of the rig as it stands, to those that are not held out.
        cause: ``law`` and ``place`` of what is hidden.

    Returns:
        The error, as ``nrmse_after`` counts it [-]; None where no record is held out, or where
        the records cannot show that law at that place.

    Source: tests/studies/test_hidden_true.py.
    """
    from ..identification.extend import held_out
    from ..identification.fit import settle
    from ..identification.problem import make_problem
    from ..identification.records import split_records
    from ..identification.screen import screen
    from ..identification.spikes import without_spikes
    from ..identification.told import begun_from_told, told_fit, weighed_as
    from ..identification.trial import settled

    inputs = read_inputs(sidecars, None)
    _, kept, _ = split_records([without_spikes(one) for one in inputs.records], ())
    if not kept:
        return None
    told = told_fit(base)
    wanted = f"{cause['place']}/{cause['law']}"
    candidate = next((one for one in screen(told) if one.name == wanted), None)
    if candidate is None:
        return None
    begun = begun_from_told(told, candidate, base, EVALUATIONS)
    if begun is None:
        return None
    fit = settle(settled(weighed_as(base, begun, EVALUATIONS), True))
    return held_out(fit, make_problem(kept, inputs.rig)).nrmse
