"""Records as a reader sees them: measured, simulated before and after, and how the place moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .fit import Fit
from .motions import motions


@dataclass(frozen=True, eq=False)
class RecordView:
    """One channel of one record with what the models said of it.

    Attributes:
        record: its name.
        split: train or held_out.
        channel: the channel's name.
        quantity: the contract's word.
        unit: SI unit as text [-].
        time: from the window's start, shape (t,) [s].
        measured: shape (t,) [unit].
        before: simulated without any cause, shape (t,) [unit].
        after: simulated with the causes, shape (t,) [unit].
        displacement: stretch at the place in question, shape (t,) [unit_displacement].
        velocity: its rate, shape (t,) [unit_velocity].
        unit_displacement: m or rad [-].
        unit_velocity: m/s or rad/s [-].
        noise_std: marginal deviation of the channel's noise [unit].
        is_decay: whether nothing drives it.
    """

    record: str
    split: str
    channel: str
    quantity: str
    unit: str
    time: np.ndarray
    measured: np.ndarray
    before: np.ndarray
    after: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    unit_displacement: str
    unit_velocity: str
    noise_std: float
    is_decay: bool


def record_views(before: Fit, after: Fit, place: str, split: str) -> list[RecordView]:
    """Views of every channel of the records of two fits.

    Args:
        before: without causes.
        after: with causes; may be the same.
        place: whose stretch and rate [SI] the residual is shown against.
        split: train or held_out.

    Returns:
        One view a channel.
    """
    mechanism = after.problem.mechanism
    places = list(mechanism.law_places())
    place = place if place in places else places[0]
    turns = mechanism.turns(place)
    moved = motions(after.model, after.x, [place])[place]
    rows = len(moved) // len(after.problem.records)
    found = []
    for index, prepared in enumerate(after.problem.records):
        stretch, rate = moved[index * rows]
        grid = np.arange(len(stretch)) * prepared.step
        for sensor in prepared.sensors:
            key = prepared.name, sensor.channel.name
            floor = after.problem.floor or before.problem.floor
            found.append(
                RecordView(
                    prepared.name,
                    split,
                    sensor.channel.name,
                    sensor.port.quantity,
                    sensor.channel.unit,
                    sensor.times,
                    sensor.values,
                    before.predicted[key],
                    after.predicted[key],
                    np.interp(sensor.times, grid, stretch),
                    np.interp(sensor.times, grid, rate),
                    "rad" if turns else "m",
                    "rad/s" if turns else "m/s",
                    floor[key].marginal_std if key in floor else float("nan"),
                    prepared.free,
                )
            )
    return found
