"""Another start for a club: what its shaft and its sleeve lose, told the other way round."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..model.robot import Robot
from .problem import Model

SPRINGS = ("shaft_stiffness", "sleeve_stiffness")
DAMPERS = ("shaft_damping", "sleeve_damping")

NOUGHT = 2.0
"""Standard deviations from nought within which a part seems to lose nothing [-]."""

IDLE = 0.2
"""Share of a club's losses below which its sleeve seems to lose nothing [-]: rubber does, so that
shaft and sleeve are told apart by errors of the lumped form, not by the records."""

KEPT = 0.1
"""Share of the losses that the other part is left with [-]."""


def sleeve_share(p: Mapping[str, float]) -> float:
    """How far a sleeve lets the head go under a pull, over how far the shaft does [-].

    Args:
        p: the robot's numbers by name [SI].
    """
    return p["shaft_stiffness"] * (1.0 + _arm(p) ** 2) / (4.0 * p["sleeve_stiffness"])


def _arm(p: Mapping[str, float]) -> float:
    """Lever of the head about the sleeve's centre, over that of each of its two sets [-]."""
    return (p["club_length"] - p["grip_length"] / 2.0) / (p["sleeve_spacing"] / 2.0)


def sleeve_loss(p: Mapping[str, float]) -> float:
    """Share of what a club loses, as it rings with its collet held, that its sleeve does [-].

    Args:
        p: the robot's numbers by name [SI].
    """
    own, others = _lost(p)
    return others / max(own + others, 1e-300)


def _lost(p: Mapping[str, float]) -> tuple[float, float]:
    """What shaft and sleeve lose, as dampers beside the shaft would [N s/m]."""
    lever = (1.0 + _arm(p) ** 2) / 4.0
    return p["shaft_damping"], p["sleeve_damping"] / lever * sleeve_share(p) ** 2


def swapped_losses(model: Model, x: np.ndarray, stds: np.ndarray) -> np.ndarray | None:
    """Start values from which the other part loses what one of them seems to lose alone.

    A fit of a club has two ends: most of what the head gives way is the shaft's, or it is the
    sleeve's, and what is lost with it. Where one part loses nothing at all, the way to the other
    end may lead over a ridge; no curvature tells of it, and errors are far too small.

    Args:
        model: of any mechanism.
        x: where its fit stands, in natural sizes [-].
        stds: standard error of each entry [SI].

    Returns:
        As `x`; nothing where both parts lose, or where one constant of the two is not free in all
        records.

    Source: tests/identification/test_losses.py; a head on two springs in a row.
    """
    at = {e.name: i for i, e in enumerate(model.entries) if e.record is None and not e.nuisance}
    if not isinstance(model.problem.mechanism, Robot) or not {*SPRINGS, *DAMPERS} <= set(at):
        return None
    value = {name: float(x[i] * model.entries[i].scale) for name, i in at.items()}
    shaft, sleeve = (value[name] < NOUGHT * stds[at[name]] for name in DAMPERS)
    if shaft == sleeve:
        return None
    p = model.problem.numbers | value
    share, lever = sleeve_share(p), (1.0 + _arm(p) ** 2) / 4.0
    lost, kept = sum(_lost(p)), KEPT if sleeve else 1.0 - KEPT
    start = x.copy()
    sizes = kept * lost, (1.0 - kept) * lost * lever / share**2
    for name, size in zip(DAMPERS, sizes, strict=True):
        entry = model.entries[at[name]]
        start[at[name]] = np.clip(size, entry.low, entry.high) / entry.scale
    return start
