"""Sensor tilt: an accelerometer whose axis leans out along the club."""

from __future__ import annotations

from ..law import Law

LAW = Law(
    name="sensor_tilt",
    kind="axis",
    symbol="tilt",
    dimension=(0, 0, 0),
    natural=lambda scales: 0.05,
    slot="axis",
    formula="y = y_true cos(tilt) + a sin(tilt), a outwards along the club",
    sentence="The sensor {place} leans out along the club by {value} rad: it feels the pull "
    "towards the pivot.",
    cure="Mount it square to the shaft, or measure both axes.",
    source="projection on a turned axis; cross-axis sensitivity, ISO 16063-31",
)
