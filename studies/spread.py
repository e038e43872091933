"""Which design is best, given what we do not know? An optimum over draws, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .optimum_words import plain
from .words import number_words, unit_words

if TYPE_CHECKING:
    from ..model.rig import Rig
    from ..optimize.spread import Spread
    from ..optimize.sweep import Map

DRAWS = 100
"""Draws that stand for a posterior [-]."""


def check_spread(file: Path, rig: Rig, designed: Sequence[str]) -> dict[str, np.ndarray]:
    """The draws of a posterior over which an optimum is to be spread.

    Args:
        file: of ``supple identify --posterior``.
        rig: the rig that is swept.
        designed: names of the map's axes.

    Returns:
        By the rig's names, each of shape (draws,) [SI].

    Raises:
        ValueError: for a file without draws of the rig's other numbers, or a rig that moves in
            the plane.
    """
    from ..model.door import fault
    from .draws import draws_of_rig

    if rig.fidelity == "planar":
        mend = "leave --posterior out, or write fidelity = 'thesis'"
        found = "'planar', where an optimum of each draw would take hours"
        raise fault(rig.path, "[rig] fidelity", "small motions for --posterior", found, mend)
    draws = draws_of_rig(file, rig, DRAWS)
    if set(draws) <= set(designed):
        expected = f"draws of other numbers than the map's axes {', '.join(designed)}"
        mend = "sample a rig that leaves other numbers open"
        raise fault(file, "posterior", expected, ", ".join(draws), mend)
    return draws


def spread_of(
    found: Map,
    draws: Mapping[str, np.ndarray],
    optima: Mapping[str, Any],
    units: Mapping[str, str],
) -> dict[str, Any]:
    """How each score's optimum spreads over draws, as JSON can hold it.

    Args:
        found: the map.
        draws: see `check_spread` [SI].
        optima: of the rig as it stands, by score, as ``map.json`` holds them.
        units: of axes and scores by name, as text.

    Returns:
        ``draws``: how many; ``scores``: by name, with the optimum of each draw, the design that
        is best on average, what it costs, and a sentence.

    Raises:
        ValueError: for draws that say nothing but what the map designs.
    """
    from ..optimize.spread import SHARE, spread

    scores = {}
    for name, one in optima.items():
        cloud = spread(found, name, draws, None if one is None else one["design"])
        if cloud is None:
            continue
        nominal = cloud.of_nominal
        scores[name] = {
            "unknown": list(cloud.unknown),
            "optima": {key: values.tolist() for key, values in cloud.designs.items()},
            "interval": {key: list(cloud.interval(key)) for key in cloud.designs},
            "best": cloud.best,
            "mean": float(cloud.of_best.mean()),
            "price": _price(cloud, cloud.of_best),
            "price_of_nominal": None if nominal is None else _price(cloud, nominal),
            "sentence": spread_words(cloud, units),
        }
    return {"draws": len(next(iter(draws.values()))), "share": SHARE, "scores": scores}


def _price(cloud: Spread, scores: np.ndarray) -> dict[str, float]:
    """How much worse a design is than knowing: on average, and for nine draws of ten [1]."""
    from ..optimize.spread import SHARE

    price = cloud.price(scores)
    return {"mean": float(price.mean()), "high": float(np.quantile(price, SHARE))}


def spread_words(cloud: Spread, units: Mapping[str, str]) -> str:
    """A spread in a few sentences.

    Args:
        cloud: the spread.
        units: of axes and score by name, as text.

    Returns:
        The sentences.
    """

    def of(name: str, value: float) -> str:
        unit = unit_words(units.get(name, "1"))
        return number_words(value) + ("" if unit == "1" else f" {unit}")

    unknown = " and ".join(plain(name) for name in cloud.unknown)
    if len(cloud.unknown) > 3:
        unknown = f"{len(cloud.unknown)} numbers"
    ends = " and ".join(
        f"{plain(name)} from {of(name, low)} to {of(name, high)}"
        for name, (low, high) in ((key, cloud.interval(key)) for key in cloud.designs)
    )
    place = ", ".join(f"{plain(name)} {of(name, value)}" for name, value in cloud.best.items())
    own = _price(cloud, cloud.of_best)
    words = [
        f"Given what is not known of {unknown}, the best {plain(cloud.score)} lies at {ends} in "
        f"9 of 10 of {len(cloud.values)} draws.",
        f"Best for all of them is {place}, with {of(cloud.score, float(cloud.of_best.mean()))} on "
        f"average: {_percent(own['mean'])} worse than knowing, in 9 of 10 draws at most "
        f"{_percent(own['high'])}.",
    ]
    if cloud.of_nominal is not None:
        told = _price(cloud, cloud.of_nominal)
        words.append(f"The best of the rig as it stands is {_percent(told['mean'])} worse.")
    return " ".join(words)


def _percent(share: float) -> str:
    return f"{number_words(max(100 * share, 0.0), 2)} %" if share > 1e-5 else "not"
