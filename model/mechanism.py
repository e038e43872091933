"""From a rig that a user wrote to the mechanism that is simulated."""

from __future__ import annotations

from .chain import Chain
from .door import fault
from .linear import Mechanism
from .rig import Rig
from .robot import INCLINATION, PARAMETERS, Robot
from .shaft_form import NAMES as SHAFT_FORM


def mechanism_of(rig: Rig, planar: bool = False) -> Mechanism:
    """The chain or the robot that a rig describes.

    Args:
        rig: as read from a rig file; its parameters carry SI units.
        planar: whether a robot in the fidelity ``planar`` will do.

    Returns:
        A static mechanism whose `names` are all in ``rig.parameters``.

    Raises:
        ValueError: for a fidelity that will not do, a weight where nothing has one, an angle in
            degrees, or a club that is no longer than its grip.
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
    for name in SHAFT_FORM:
        if rig.fidelity != "thesis" and name in rig.parameters:
            mend = "remove this number: the planar robot's shaft is a lumped one"
            expected = "fidelity = 'thesis' beside it"
            raise fault(rig.path, f"[parameters] {name}", expected, f"'{rig.fidelity}'", mend)
    _check_numbers(rig)
    return Robot(rig.model, tuple(name for name in PARAMETERS if name in rig.parameters))


def _check_numbers(rig: Rig) -> None:
    """Refuse a swing plane beyond the upright and a club without a shaft."""
    values = {name: parameter.value for name, parameter in rig.parameters.items()}
    upright = PARAMETERS[INCLINATION].high
    if values.get(INCLINATION, 0.0) > upright:
        expected, found = f"an angle from 0 to {upright:.6g} rad", f"{values[INCLINATION]:g}"
        mend = "write it in rad: 90 degrees are 1.5708"
        raise fault(rig.path, f"[parameters] {INCLINATION}", expected, found, mend)
    club, grip = values["club_length"], values["grip_length"]
    if club <= grip:
        expected = f"more than the grip's {grip:g} m"
        mend = "write the length of the whole club, butt to clubhead, in m"
        raise fault(rig.path, "[parameters] club_length", expected, f"{club:g}", mend)
