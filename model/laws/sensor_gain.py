"""Sensor gain: a channel that reads everything too large or too small."""

from __future__ import annotations

from ..law import Law

LAW = Law(
    name="sensor_gain",
    kind="response",
    symbol="gain_error",
    dimension=(0, 0, 0),
    natural=lambda scales: 0.05,
    slot="gain",
    formula="y = (1 + g) y_true",
    sentence="The channel {place} misreads by a factor: its gain is off by {value}.",
    cure="Calibrate the channel, or check its mounting and its radius.",
    source="VIM 2012, 4.12 (sensitivity)",
)
