"""Where on the club an accelerometer sits: a head is no point, and turns as the shaft bends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model.chain import DERIVATIVES
from ..model.linear import Port
from ..model.respond import simulate
from ..model.robot import Robot
from .allowance import Allowance
from .prepare import Prepared, Sensor
from .problem import Model, sample

LEVER = 0.015
"""Standard deviation of the distance from where a lumped head feels its forces to the sensor on a
real one [m]: its centre of gravity is off the shaft's end, and the shaft has mass. Set by hand to
what the independent bench draws, heads that are off by 0.012 to 0.022 m; not learned from data."""

TURNS = ("angle", "angular_velocity", "angular_acceleration")


def lever_allowances(model: Model, x: np.ndarray) -> dict[str, Allowance]:
    """An unknown lever of every sensor at the clubhead, about the collet and about the grip.

    Args:
        model: what is fitted.
        x: scaled unknowns [-].

    Returns:
        Allowances by record; none where the rig is no robot.

    Source: tests/identification/test_allowance.py.
    """
    mechanism, found = model.problem.mechanism, {}
    if not isinstance(mechanism, Robot):
        return {}
    turning = [
        p for p in ("collet", "grip") if not (p, mechanism.model) == ("collet", "fixed_collet")
    ]
    for prepared in model.problem.records:
        at = [index for index, sensor in enumerate(prepared.sensors) if _turns(sensor)]
        if not at:
            continue
        ports, felt = [], []
        for index in at:
            sensor = prepared.sensors[index].port
            for place in turning:
                if (place, sensor.frame) != ("collet", "collet"):
                    quantity = TURNS[DERIVATIVES[sensor.quantity]]
                    ports.append(Port(place, quantity, "collet" if place == "grip" else "absolute"))
                    felt.append(index)
        if ports:
            found[prepared.name] = _levers(model, prepared, x, tuple(ports), felt)
    return found


def _turns(sensor: Sensor) -> bool:
    return sensor.port.place == "clubhead" and sensor.port.quantity in (
        "position",
        "velocity",
        "acceleration",
    )


def _levers(
    model: Model, prepared: Prepared, x: np.ndarray, ports: tuple[Port, ...], felt: list[int]
) -> Allowance:
    """Columns of levers of unit length: turns at `ports`, felt by the sensors of these indices."""
    whole = model.plant(prepared)
    plant, z = replace(whole, sensors=ports), model.vector(prepared, x)
    own = np.zeros(plant.size)
    for name in plant.slots:
        if name not in ("offset", "gain", "delay", "tilt"):
            own[plant.slots[name]] = z[whole.slots[name]]
    turned = simulate(plant, model.substeps(prepared), own, *model.arguments(prepared))
    turned = np.nan_to_num(np.asarray(turned)[:, :-1], posinf=0.0, neginf=0.0)
    columns = []
    for index, sensor in enumerate(prepared.sensors):
        block = turned * (np.array(felt) == index)
        columns.append(np.asarray(sample(sensor, block)))
    return Allowance(("lever",) * len(ports), tuple(columns), np.full(len(ports), LEVER))
