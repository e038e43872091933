"""Servo lag: a drive that comes after what it is told."""

from __future__ import annotations

from ..law import Fault, Law
from .sensor_lowpass import LAW as LOWPASS

assert isinstance(LOWPASS.fault, Fault)

LAW = Law(
    name="servo_lag",
    kind="drive",
    symbol="time_constant",
    dimension=(0, 0, 1),
    natural=lambda scales: 0.1 * scales.time,
    slot="fault",
    # what follows a late drive is late as a whole: lags commute with a mechanism that does not age
    fault=LOWPASS.fault,
    signed=False,
    formula="time_constant dtheta/dt = theta_told - theta",
    sentence="The {place} lags behind what it is told, with a time constant of {value}.",
    cure="Tell the model where the drive really was, by an encoder on it, or lead the command.",
    source="first-order lag",
)
