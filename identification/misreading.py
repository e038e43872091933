"""What a channel says beyond what the others, and the model, say of its place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .fit import Fit
from .missing import Curve, curve_json, curve_of
from .problem import Model, base_entries
from .whereabouts import Apart, values_at


@dataclass(frozen=True)
class Misreading:
    """What one channel reads beyond what it should, as all others say.

    Attributes:
        place: the channel's name.
        record: name of the record.
        curves: of the surplus against what it should read, against how fast that changes, and
            against time; of the first two the one with the larger share first [unit].
        unit: the channel's SI unit.
    """

    place: str
    record: str
    curves: tuple[Curve, ...]
    unit: str


def misreading(fit: Fit, others: Apart) -> Misreading:
    """What a channel reads beyond what the fit of all others foretells of it.

    Args:
        fit: of all channels; its noise tells the record that is explained worst.
        others: the fit without the channel.

    Returns:
        The surplus in that record. The channel's own zero, gain and clock are taken as told.

    Source: tests/identification/test_whereabouts.py.
    """
    name = others.what
    own = {key: misfit.ratio for key, misfit in fit.misfits.items() if key[1] == name}
    worst = max(own, key=lambda key: own[key])
    records = tuple(p for p in fit.problem.records if p.name == worst[0])
    problem = replace(fit.problem, records=records)
    noises = {key: noise for key, noise in fit.problem.floor.items() if key[0] == worst[0]}
    model = Model(problem, base_entries(problem), (), noises)
    predicted = model.predict(values_at(model, others.fit))[worst]
    sensor = next(s for s in records[0].sensors if s.channel.name == name)
    surplus = sensor.values - predicted
    curves = [
        curve_of("reading", predicted, surplus),
        curve_of("rate", np.gradient(predicted, sensor.step), surplus),
    ]
    curves.sort(key=lambda curve: -curve.share)
    time = Curve("time", sensor.times - sensor.times[0], surplus, np.zeros(len(surplus)), 1.0)
    return Misreading(name, worst[0], (*curves, time), sensor.channel.unit)


def misreading_json(found: Misreading) -> dict[str, Any]:
    """A misreading as JSON can hold it [SI], in the words of a missing force."""
    unit = found.unit
    units = {"reading": unit, "rate": "1/s" if unit == "1" else f"{unit}/s", "time": "s"}
    curves = [curve_json(curve, units[curve.against], unit) for curve in found.curves]
    names = ("against", "x", "force", "unit_x", "unit_force")
    said = {name.replace("force", "error"): curves[0][name] for name in names}
    told = [{key.replace("force", "error"): v for key, v in curve.items()} for curve in curves]
    return {"place": found.place, "record": found.record, **said, "curves": told}
