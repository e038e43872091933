"""What a bench would measure of a fitted club: its collet held, and its grip clamped in a vice."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ..model.energies import stiffness_matrix
from ..model.linear import modes
from ..model.robot import Robot
from ..model.shaft_form import GRIP_BENDING
from .fit import Fit
from .form import form_error, loses_nothing
from .losses import DAMPERS, SPRINGS, sleeve_share

TAPER = (0.2, 0.5)
"""Bending stiffness of a shaft's tip over that of its butt [-]: a tube of even wall that narrows
from 15.2 to 9 mm has 0.21, and walls grow thicker towards the tip."""

FORM = 0.03
"""Standard deviation of how much more a shaft bends in its sleeve, beyond what its taper and its
gauge leave open [-]: no sleeve is even. Set by hand; not learned."""

LOSSES = 0.5
"""Standard deviation of the power of that by which damping in a vice is larger [-]: 1 where what
bends inside the grip loses as much as what bends beyond, 2 where it loses nothing."""

STIFF = 0.3
"""How far a sleeve lets the head go over how far the shaft seems to, below which nothing but loss
tells the two apart [-]."""

APART = (0.1, 0.5)
"""Standard deviations there, where no gauge sees the shaft alone: of how much more it bends, and of
its damping over itself [-]. Set by hand by two clubs of finite elements with stiff sleeves, whose
shafts came out 10 % too stiff, one with 3.5 times its damping."""

ASTRAY = (0.5, 5.0)
"""The same where the sleeve seems to lose nothing: shafts of such clubs came out 29 to 62 % too
stiff, with four to seven times their damping [-]. Set by hand by five of fifty clubs."""

UNITS = {"frequency": "Hz", "damping_ratio": "1", "stiffness": "N/m"}
CONSTANTS = (*SPRINGS, *DAMPERS)
STRIDE = 1e-4
"""Step of a derivative, in natural sizes of the unknowns [-]."""


ELEMENTS = 16
"""Beams in a row that stand for a grip [-]."""


def grip_bending(club_length: float, grip_length: float, taper: float, sleeve: float) -> float:
    """How much softer a shaft looks at the head in its sleeve than with its grip clamped [-].

    A sleeve carries the grip along all of its length, so that the shaft goes on to bend in it: of a
    soft one the more. What gives way at the head and is not the sleeve's is taken for the shaft.

    Args:
        club_length: butt to head [m].
        grip_length: butt to the sleeve's end [m].
        taper: bending stiffness at the head over that at the butt, linear between [-].
        sleeve: how far the sleeve lets the head go, over how far the shaft seems to [-].

    Source: Euler and Bernoulli's beam on even springs, Hetenyi 1946; what is the sleeve's by its
    share of the energy; tests/identification/test_clamped.py.
    """
    beyond = club_length - grip_length
    nodes, weights = np.polynomial.legendre.leggauss(12)
    along = beyond * (1.0 + nodes) / 2.0
    bending = 1.0 + (taper - 1.0) * (grip_length + along) / club_length
    shaft = beyond / 2.0 * float(weights @ ((beyond - along) ** 2 / bending))
    beam, springs = _grip(club_length, grip_length, taper)
    load = np.zeros(len(beam))
    load[-2:] = 1.0, beyond  # a force at the head, carried to where the sleeve ends

    def split(log_springs: float) -> tuple[float, float]:
        held = np.exp(log_springs) * springs
        moved = np.linalg.solve(beam + held, load)
        own = float(moved @ held @ moved)
        return own, shaft + float(load @ moved) - own

    def gap(log_springs: float) -> float:
        own, rest = split(log_springs)
        return float(np.log(own / rest / sleeve))

    ends = np.log(1.0 / grip_length**4) + np.array(SPRINGS)
    if gap(ends[0]) < 0.0 or gap(ends[1]) > 0.0:  # softer or stiffer than any sleeve
        return split(ends[0] if gap(ends[0]) < 0.0 else ends[1])[1] / shaft - 1.0
    found: Any = brentq(gap, *ends)
    return split(float(found))[1] / shaft - 1.0


SPRINGS = (-3.0, 9.0)
"""Softest and stiffest springs along a grip, beside its own bending: logarithms [-]."""


def _grip(club_length: float, grip_length: float, taper: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness of a grip of unit bending stiffness at its butt, and of unit springs along it."""
    h, size = grip_length / ELEMENTS, 2 * ELEMENTS + 2
    one = np.array([[12, 6 * h, -12, 6 * h], [0, 4 * h * h, -6 * h, 2 * h * h],
                    [0, 0, 12, -6 * h], [0, 0, 0, 4 * h * h]]) / h**3  # fmt: skip
    on = np.array([[156, 22 * h, 54, -13 * h], [0, 4 * h * h, 13 * h, -3 * h * h],
                   [0, 0, 156, -22 * h], [0, 0, 0, 4 * h * h]]) * h / 420  # fmt: skip
    one, on = (upper + np.triu(upper, 1).T for upper in (one, on))
    beam, springs = np.zeros((size, size)), np.zeros((size, size))
    for index in range(ELEMENTS):
        mine = slice(2 * index, 2 * index + 4)
        beam[mine, mine] += one * (1.0 + (taper - 1.0) * (index + 0.5) * h / club_length)
        springs[mine, mine] += on
    return beam, springs


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
    more, wide, loose = _more(fit)
    for name, bench in benches.items():
        values, stds = _told(fit, bench, more, wide)
        if name == "grip_clamped":
            lost = float(np.hypot(LOSSES * np.log1p(more), loose))
            stds[1] = np.hypot(stds[1], lost * values[1])
        rows = zip(UNITS.items(), values, stds, strict=True)
        found[name] = {
            word: _row(fit, f"{name}.{word}", float(value), float(std), unit)
            for (word, unit), value, std in rows
        }
    return found


def _row(fit: Fit, name: str, value: float, std: float, unit: str) -> dict[str, Any]:
    form = form_error(fit, name, value)
    return {"value": value, "std": float(np.hypot(std, form)), "unit": unit}


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


def _more(fit: Fit) -> tuple[float, float, float]:
    """How much more the shaft bends in its sleeve, with its error, and that of losses by it [-].

    By a gauge where there is one, else by its taper.
    """
    entries, given = fit.model.entries, fit.problem.rig.parameters
    p = fit.problem.numbers | {e.name: fit.value(i) for i, e in enumerate(entries)}
    if GRIP_BENDING in given:
        labels = [entry.label for entry in entries]
        own = fit.std(labels.index(GRIP_BENDING)) if GRIP_BENDING in labels else 0.0
        return p[GRIP_BENDING], float(np.hypot(own, FORM)), 0.0
    lengths = p["club_length"], p["grip_length"]
    sleeve = sleeve_share(p)
    form, loose = APART if sleeve < STIFF else (FORM, 0.0)
    form, loose = ASTRAY if loses_nothing(fit) else (form, loose)
    ends = [grip_bending(*lengths, taper, sleeve) for taper in TAPER]
    return float(np.mean(ends)), float(np.hypot(np.ptp(ends) / 2.0, form)), loose


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
