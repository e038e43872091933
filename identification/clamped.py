"""What a bench would measure of a fitted club: its collet held, and its grip clamped in a vice."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..model.energies import stiffness_matrix
from ..model.linear import modes
from ..model.robot import Robot
from ..model.shaft_form import GRIP_BENDING
from .fit import Fit

TAPER = (0.2, 0.5)
"""Bending stiffness of a shaft's tip over that of its butt [-]: a tube of even wall that narrows
from 15.2 to 9 mm has 0.21, and walls grow thicker towards the tip."""

FORM = 0.03
"""Standard deviation of how much more a shaft bends in its sleeve, beyond what its taper and its
gauge leave open [-]: a stiff sleeve holds the grip where it bends. Set by hand; not learned."""

LOSSES = 0.5
"""Standard deviation of the power of that by which damping in a vice is larger [-]: 1 where what
bends inside the grip loses as much as what bends beyond, 2 where it loses nothing."""

UNITS = {"frequency": "Hz", "damping_ratio": "1", "stiffness": "N/m"}
CONSTANTS = ("shaft_stiffness", "shaft_damping", "sleeve_stiffness", "sleeve_damping")
STRIDE = 1e-4
"""Step of a derivative, in natural sizes of the unknowns [-]."""


def grip_bending(club_length: float, grip_length: float, taper: float) -> float:
    """How much more a shaft bends at the head in a soft sleeve than with its grip clamped [-].

    A soft sleeve carries the grip along all of its length, so that the shaft goes on to bend in it.

    Args:
        club_length: butt to head [m].
        grip_length: butt to the sleeve's end [m].
        taper: bending stiffness at the head over that at the butt, linear between [-].

    Source: energy of bending under a load at the head, the grip rigid on even springs;
    tests/identification/test_clamped.py.
    """
    nodes, weights = np.polynomial.legendre.leggauss(12)
    shares = (1.0 + nodes) / 2.0
    inside, beyond = grip_length * shares, grip_length + (club_length - grip_length) * shares
    lever = club_length - grip_length / 2.0
    within = lever * shares**2 * (3.0 - 2.0 * shares) - grip_length * shares**2 / 2.0

    def bent(moment: np.ndarray, at: np.ndarray, length: float) -> float:
        return length * float(weights @ (moment**2 / (1.0 + (taper - 1.0) * at / club_length)))

    inner = bent(within, inside, grip_length)
    return inner / bent(club_length - beyond, beyond, club_length - grip_length)


def held(p: Mapping[str, float]) -> np.ndarray:
    """Frequency [Hz], damping ratio [-] and static stiffness at the head [N/m], the collet held.

    Args:
        p: the robot's numbers by name [SI].
    """
    robot = Robot("fixed_collet", tuple(p))
    found = modes(robot, p)
    rings = np.flatnonzero(found.damped_frequencies > 0.0)
    first = rings[np.argmin(found.frequencies[rings])]
    soft = np.linalg.inv(np.asarray(stiffness_matrix(robot.rows(p, np)))[:3, :3])
    head = np.asarray(robot.sensor_row("clubhead", "position", "collet", p, np))[:3]
    shown = found.frequencies[first], found.damping_ratios[first], 1.0 / (head @ soft @ head)
    return np.array(shown, dtype=float)


def in_a_vice(p: Mapping[str, float], more: float) -> np.ndarray:
    """The same of the shaft and the head alone, the grip clamped.

    What bends inside the grip is taken to lose as much of its energy as what bends beyond.

    Args:
        p: the robot's numbers by name [SI].
        more: how much more the shaft bends in its sleeve [-].
    """
    stiffness, damping = p["shaft_stiffness"] * (1 + more), p["shaft_damping"] * (1 + more)
    beat = np.sqrt(stiffness / p["clubhead_mass"])
    return np.array([beat / (2 * np.pi), damping * beat / (2 * stiffness), stiffness])


def clamped_json(fit: Fit) -> dict[str, Any]:
    """Frequency, damping ratio and static stiffness of a fitted club on two benches.

    They are defined for every club, of which lumped constants are not: the shaft of a lumped club
    is as soft as the real one is with its grip in the sleeve, where it bends too.

    Args:
        fit: of a robot, with errors.

    Returns:
        ``collet_held`` and ``grip_clamped``, each with ``frequency`` [Hz], ``damping_ratio`` [-]
        and ``stiffness`` at the head [N/m]: value, std and unit. Nothing for a chain, for a sleeve
        whose sets differ, or where the rig leaves none of the club's constants free.

    Source: tests/identification/test_recovery.py (against finite elements).
    """
    numbers = fit.problem.rig.parameters
    free = [name for name in CONSTANTS if name in numbers and numbers[name].free]
    known = isinstance(fit.problem.mechanism, Robot) and set(CONSTANTS) <= set(numbers)
    if not known or not free or any(numbers[name].per_record for name in free):
        return {}
    benches: dict[str, Bench] = {"collet_held": lambda p, _: held(p), "grip_clamped": in_a_vice}
    found = {}
    more, wide = _more(fit)
    for name, bench in benches.items():
        values, stds = _told(fit, bench, more, wide)
        if name == "grip_clamped":
            stds[1] = np.hypot(stds[1], LOSSES * np.log1p(more) * values[1])
        rows = zip(UNITS.items(), values, stds, strict=True)
        found[name] = {
            word: {"value": float(value), "std": float(std), "unit": unit}
            for (word, unit), value, std in rows
        }
    return found


def clamped_words(told: Mapping[str, Any]) -> list[str]:
    """The same in a sentence for each bench [-].

    Args:
        told: what `clamped_json` returned.
    """
    benches = {
        "collet_held": "With its collet held the club",
        "grip_clamped": "With its grip clamped in a vice (not in the sleeve, where the shaft goes "
        "on to bend, as the lumped shaft does) it",
    }
    said = []
    for bench, words in benches.items():
        if bench in told:
            f, z, k = (told[bench][name] for name in UNITS)
            said.append(
                f"{words} rings at {f['value']:.4g} ± {f['std']:.2g} Hz with a damping ratio of "
                f"{100 * z['value']:.3g} ± {100 * z['std']:.2g} %, and a static pull at the head "
                f"finds {k['value']:.4g} ± {k['std']:.2g} N/m."
            )
    return said


def _more(fit: Fit) -> tuple[float, float]:
    """How much more the shaft bends in its sleeve, with its error: by a gauge, or by its taper."""
    labels = [entry.label for entry in fit.model.entries]
    if GRIP_BENDING in labels:
        index = labels.index(GRIP_BENDING)
        return fit.value(index), float(np.hypot(fit.std(index), FORM))
    given = fit.problem.rig.parameters
    if GRIP_BENDING in given:
        return given[GRIP_BENDING].value, FORM
    lengths = given["club_length"].value, given["grip_length"].value
    ends = [grip_bending(*lengths, taper) for taper in TAPER]
    return float(np.mean(ends)), float(np.hypot(np.ptp(ends) / 2.0, FORM))


Bench = Callable[[Mapping[str, float], float], np.ndarray]


def _told(fit: Fit, bench: Bench, more: float, wide: float) -> tuple[np.ndarray, np.ndarray]:
    """What a bench shows of a fit, with errors: the fit's, and what the grip's bending leaves."""
    at = [i for i, e in enumerate(fit.model.entries) if e.slot == "numbers" and e.record is None]
    names, scale = [fit.model.entries[i].name for i in at], fit.model.scale[at]

    def shown(x: np.ndarray) -> np.ndarray:
        own = dict(zip(names, x[:-1] * scale, strict=True))
        return bench(fit.problem.numbers | own, float(x[-1]))

    best, steps = np.append(fit.x[at], more), STRIDE * np.eye(len(at) + 1)
    rows = np.array([(shown(best + step) - shown(best - step)) / (2 * STRIDE) for step in steps])
    spread = np.zeros((len(best), len(best)))
    spread[:-1, :-1], spread[-1, -1] = fit.covariance[np.ix_(at, at)], wide**2
    variance = np.einsum("ik,ij,jk->k", rows, spread, rows)
    return shown(best), np.sqrt(np.maximum(variance, 0.0))
