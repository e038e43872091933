"""From a rig that a user wrote to the mechanism that is simulated."""

from __future__ import annotations

from .chain import Chain
from .door import fault
from .linear import Mechanism
from .rig import Rig
from .robot import INCLINATION, PARAMETERS, Robot


def mechanism_of(rig: Rig, planar: bool = False) -> Mechanism:
    """The chain or the robot that a rig describes.

    Args:
        rig: as read from a rig file; its parameters carry SI units.
        planar: whether a robot in the fidelity ``planar`` will do.

    Returns:
        A static mechanism whose `names` are all in ``rig.parameters``.

    Raises:
        ValueError: for a fidelity that will not do, or a weight where nothing has one.
    """
    if rig.kind == "chain":
        if rig.fidelity != "thesis":
            mend = "leave 'fidelity' out; it belongs to a robot"
            raise fault(rig.path, "[rig] fidelity", "'thesis' for a chain", "'planar'", mend)
        links = tuple((name, ends[0], ends[1]) for name, ends in rig.links.items())
        return Chain(tuple(rig.masses), links, rig.motion == "rotation")
    if rig.fidelity != "thesis" and not planar:
        raise fault(
            rig.path,
            "[rig] fidelity",
            "'thesis', the small motions in the collet's frame that are fitted",
            f"'{rig.fidelity}'",
            "write fidelity = 'thesis', or leave it out; `supple simulate` and `supple sweep` know "
            "'planar' too",
        )
    if rig.fidelity == "thesis" and INCLINATION in rig.parameters:
        expected = "fidelity = 'planar', the only one with weight"
        mend = "write that under [rig], or remove this number"
        raise fault(rig.path, f"[parameters] {INCLINATION}", expected, "'thesis'", mend)
    return Robot(rig.model, tuple(name for name in PARAMETERS if name in rig.parameters))
