"""From a rig that a user wrote to the mechanism that is simulated."""

from __future__ import annotations

from .chain import Chain
from .door import fault
from .linear import Mechanism
from .rig import Rig
from .robot import PARAMETERS, Robot


def mechanism_of(rig: Rig) -> Mechanism:
    """The chain or the robot that a rig describes.

    Args:
        rig: as read from a rig file; its parameters carry SI units.

    Returns:
        A static mechanism whose `names` are all in ``rig.parameters``.

    Raises:
        ValueError: for a fidelity that cannot be simulated.
    """
    if rig.kind == "chain":
        links = tuple((name, ends[0], ends[1]) for name, ends in rig.links.items())
        return Chain(tuple(rig.masses), links, rig.motion == "rotation")
    if rig.fidelity != "thesis":
        raise fault(
            rig.path,
            "[rig] fidelity",
            "'thesis', the small motions in the collet's frame that can be simulated",
            f"'{rig.fidelity}'",
            "write fidelity = 'thesis', or leave it out",
        )
    return Robot(rig.model, tuple(name for name in PARAMETERS if name in rig.parameters))
