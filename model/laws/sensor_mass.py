"""Sensor mass: what a sensor weighs rides along with the place where it sits."""

from __future__ import annotations

from ..law import Law

LAW = Law(
    name="sensor_mass",
    kind="load",
    symbol="mass",
    dimension=(1, -1, 2),
    natural=lambda scales: 0.02 * scales.stiffness * scales.time**2,
    slot="load",
    signed=False,
    replaces="mass",
    formula="m = m_rig + m_sensor",
    sentence="The place {place} carries {value} more than the rig says.",
    cure="Weigh the sensor with its cable, and add it to the rig; or choose a lighter one.",
    source="mass loading; McConnell and Varoto 2008, Vibration Testing, section 4.7",
)
