"""Sensor delay: a channel that tells late what happened."""

from __future__ import annotations

from ..law import Law

LAW = Law(
    name="sensor_delay",
    kind="response",
    symbol="delay",
    dimension=(0, 0, 1),
    natural=lambda scales: 0.1 * scales.time,
    slot="delay",
    signed=False,  # what is early by more than a clock's tolerance stands for what another lacks
    formula="y(t) = y_true(t - delay)",
    sentence="The channel {place} is late by {value}.",
    cure="Synchronize the clocks, or let the fit shift the channel.",
    source="pure dead time",
)
