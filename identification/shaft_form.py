"""What a fit leaves open of a real shaft: its mass along it, and how it bends inside the grip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..model.rig import Rig
from ..model.robot import PARAMETERS
from ..model.shaft_form import GRIP_BENDING, SHAFT_MASS
from .records import Record

OPEN = {SHAFT_MASS: 0.04, GRIP_BENDING: 0.2}
"""What is expected of both numbers, and their standard deviation, which is as large [kg and 1]:
whole shafts weigh 0.04 to 0.13 kg, and an even one bends 0.36 times more in a soft sleeve than
clamped, tapered ones less; a lumped club, as another program may have simulated it, has neither."""


def with_shaft_form(rig: Rig, records: Sequence[Record]) -> Rig:
    """The rig with what makes its shaft a real one left open, where it says nothing of it.

    Left in the head, a shaft's mass would be sought in the wrist's stiffness, the collet's inertia
    and the sensor's place: 0.05 kg couple wrist and club by 1.5 % more than the head alone does,
    and the inertia about the wrist is 4 % larger. A gauge on the shaft is calibrated with the grip
    clamped, and does not see what bends inside the grip.

    Args:
        rig: as read at the door.
        records: that are fitted.

    Returns:
        It with `shaft_mass` [kg] and `grip_bending` [1] as numbers known to a tolerance. The first
        only where the collet moves, since it hardly shows elsewhere; the second only where a gauge
        on the shaft tells it.

    Source: tests/identification/test_shaft_form.py.
    """
    if rig.kind != "robot":
        return rig
    gauges = ("strain", "deflection")
    gauged = any(c.quantity in gauges for record in records for c in record.responses)
    asked = {SHAFT_MASS: rig.model != "fixed_collet", GRIP_BENDING: gauged}
    added = {
        name: replace(PARAMETERS[name], value=usual, std=usual, source="left open by a fit")
        for name, usual in OPEN.items()
        if asked[name] and name not in rig.parameters
    }
    return replace(rig, parameters={**rig.parameters, **added}) if added else rig
