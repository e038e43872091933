"""From a rig that a user wrote to the mechanism that is simulated."""

from __future__ import annotations

from .chain import Chain
from .linear import Mechanism
from .rig import Rig
from .robot import MODELS_THAT_WORK, PARAMETERS, Robot


def mechanism_of(rig: Rig) -> Mechanism:
    """The chain or the robot that a rig describes.

    Args:
        rig: as read from a rig file; its parameters carry SI units.

    Returns:
        A static mechanism whose `names` are all in ``rig.parameters``.

    Raises:
        ValueError: for a robot model or fidelity that cannot be simulated.
    """
    if rig.kind == "chain":
        links = tuple((name, ends[0], ends[1]) for name, ends in rig.links.items())
        return Chain(tuple(rig.masses), links, rig.motion == "rotation")
    if rig.model not in MODELS_THAT_WORK or rig.fidelity != "thesis":
        found = f"model = {rig.model!r}, fidelity = {rig.fidelity!r}"
        raise ValueError(
            f"{rig.path.name}: [rig] model: expected one of {', '.join(MODELS_THAT_WORK)} in "
            f"fidelity 'thesis', found {found}. Mend: choose one of these."
        )
    return Robot(rig.model, tuple(name for name in PARAMETERS if name in rig.parameters))
