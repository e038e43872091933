"""Sensor offset: a channel whose zero is not zero."""

from __future__ import annotations

from ..law import Law

LAW = Law(
    name="sensor_offset",
    kind="channel",
    symbol="offset",
    dimension=(0, 0, 0),
    natural=lambda scales: scales.stretch,
    slot="offset",
    of_channel=True,
    formula="y = y_true + b",
    sentence="The channel {place} is off by {value}.",
    cure="Zero the channel before the test, or let the fit subtract the offset.",
    source="VIM 2012, 4.20 (instrument bias)",
)
