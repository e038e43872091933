"""swing(model, numbers, drive) -> Swing: one motion of the planar robot, or many at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from . import planar
from .lagrange import MODELS, REFRESH, WITH_SPRING, Acting, trace
from .law import library
from .quick import quickly
from .radau import NODES
from .shaft import LARGEST_BEND, LARGEST_TILT

FINISHED = "The swing was simulated."
LEFT_SHAFT = (
    "The shaft bends by {bend:.2f} m: beyond {limit:.2f} m, {share:g} of its length, its force is "
    "no longer good; slow the swing, stiffen the shaft, or take these numbers for a first look."
)
LEFT_SLEEVE = (
    "The grip tilts by {tilt:.2f} rad in the collet: beyond {limit:g} rad the place of the "
    "clubhead is no longer good; stiffen the sleeve, or take these numbers for a first look."
)
NOT_CONVERGED = (
    "The stage equations did not converge (last change {change:.1e}): take shorter steps."
)
RAN_AWAY = "The motion grew beyond all numbers: look for a constant of the wrong sign or size."
TOLERANCE = 1e-4
"""Largest last change of an acceleration that counts as converged [-]; what is left after it is a
hundredth or less."""

MANY = 16
"""Designs from which on it pays to compile longer for a quicker swing [-]."""

_trace = quickly(trace, (0, 1, 2, 3, 12))

ITERATIONS = {False: ((3, REFRESH), (12, 5)), True: ((4, REFRESH), (12, 5))}
"""Newton steps of every step, and steps for which one of their matrices serves, without and with
laws; of a swing that these leave open, more of the ones and fewer of the others [-]."""


@dataclass(frozen=True)
class Signals:
    """What moves the planar robot, at the stages of every step.

    Attributes:
        times: ends of the steps, the start first, uniform, shape (t,) [s].
        values: arm and wrist drive angle, their rates, their accelerations, torque on the collet
            and force on the clubhead across the collet, shape (t - 1, 8, 3) [rad, ..., N m, N].
        start: the first two, with their rates, at the start, shape (4,) [rad, rad/s].
    """

    times: np.ndarray
    values: np.ndarray
    start: np.ndarray


def signals_of(
    times: np.ndarray,
    arm: np.ndarray | None = None,
    wrist: np.ndarray | None = None,
    torque: np.ndarray | None = None,
    force: np.ndarray | None = None,
) -> Signals:
    """Signals from samples: angles join by cubic splines of two derivatives, forces by lines.

    Args:
        times: uniform, at least three [s].
        arm: arm angle, shape (t,) [rad]; at rest at zero by default.
        wrist: wrist drive angle against the arm, shape (t,) [rad]; zero by default.
        torque: on the collet, shape (t,) [N m]; none by default.
        force: on the clubhead, across the collet's axis, shape (t,) [N]; none by default.

    Raises:
        ValueError: for times that are not uniform or samples of another length.
    """
    times = np.asarray(times, dtype=float)
    if times.ndim != 1 or len(times) < 3 or np.ptp(np.diff(times)) > 1e-6 * (times[1] - times[0]):
        raise ValueError(
            "times: expected at least three uniform samples [s], found others. "
            "Mend: give np.arange(count) / sample_rate."
        )
    nodes = times[:-1, None] + (times[1] - times[0]) * NODES[None, :]
    columns, start = [], np.zeros(4)
    splines = []
    for index, angle in enumerate((arm, wrist)):
        given = np.zeros_like(times) if angle is None else _samples(angle, times, "angle")
        spline = CubicSpline(times, given)
        splines.append(spline)
        start[index], start[2 + index] = spline(times[0]), spline(times[0], 1)
    columns += [spline(nodes, order) for order in (0, 1, 2) for spline in splines]
    for load in (torque, force):
        given = np.zeros_like(times) if load is None else _samples(load, times, "load")
        columns.append(np.interp(nodes, times, given))
    return Signals(times, np.stack(columns, axis=1), start)


def _samples(values: np.ndarray, times: np.ndarray, what: str) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    if values.shape != times.shape or not np.all(np.isfinite(values)):
        raise ValueError(
            f"{what}: expected {len(times)} finite samples, one for each of the times, found shape "
            f"{values.shape}. Mend: sample it on the same times."
        )
    return values


@dataclass(frozen=True)
class Swing:
    """How the planar robot moved.

    Attributes:
        times: shape (t,) [s].
        positions: `planar.COORDINATES`, shape (t, 4) [rad, m, rad, m].
        velocities: their rates, shape (t, 4) [rad/s, m/s, rad/s, m/s].
        accelerations: the rates of these, zero at the start, shape (t, 4) [rad/s^2, m/s^2, ...].
        bend: of the shaft at the head, shape (t,) [m].
        clubhead_speed: of its mass centre, shortening of the shaft included, shape (t,) [m/s].
        energy: kinetic, elastic and weight, shape (t,) [J].
        change: largest last change in the stage equations [-].
        most_bend: up to which the shaft is good [m].
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    bend: np.ndarray
    clubhead_speed: np.ndarray
    energy: np.ndarray
    change: float
    most_bend: float

    @property
    def status(self) -> str:
        """One sentence: whether, and how far, the swing can be trusted."""
        if not np.all(np.isfinite(self.positions)):
            return RAN_AWAY
        if self.change > TOLERANCE:
            return NOT_CONVERGED.format(change=self.change)
        largest = float(np.max(np.abs(self.bend)))
        if largest > self.most_bend:
            return LEFT_SHAFT.format(bend=largest, limit=self.most_bend, share=LARGEST_BEND)
        tilt = float(np.max(np.abs(self.positions[:, 2])))
        if tilt > LARGEST_TILT:
            return LEFT_SLEEVE.format(tilt=tilt, limit=LARGEST_TILT)
        return FINISHED


def swing(
    model: str,
    numbers: Mapping[str, float],
    signals: Signals,
    inclination: float = np.pi / 2,
    gravity: float = planar.GRAVITY,
    laws: Mapping[tuple[str, str], float] | None = None,
    widths: tuple[float, float] = (1e-5, 1e-3),
    start: np.ndarray | None = None,
) -> Swing:
    """Simulate one swing in the plane.

    Args:
        model: one of `MODELS`.
        numbers: the robot's numbers by contract name [SI].
        signals: what drives it, see `signals_of`.
        inclination: of the swing plane against the horizontal; pi/2 is upright [rad].
        gravity: acceleration of free fall; 0 for none [m/s^2].
        laws: strength by (place, law) [SI]; none by default.
        widths: rounding of corners of laws in stretch and rate [m or rad, and a second].
        start: positions and velocities, shape (8,); in balance with the drives by default.

    Returns:
        The swing; its status says whether it converged and whether the shaft's law still holds.

    Raises:
        ValueError: for an unknown model or a law that is not of the library.

    Source: Lagrange's equations of `planar`; tests/model/test_planar.py, tests/model/test_swing.py.
    """
    table = {name: np.array([float(value)]) for name, value in numbers.items()}
    many = swings(model, table, [signals], inclination, gravity, laws, widths, start)
    return many[0]


def swings(
    model: str,
    table: Mapping[str, np.ndarray],
    signals: list[Signals],
    inclination: float = np.pi / 2,
    gravity: float = planar.GRAVITY,
    laws: Mapping[tuple[str, str], float] | None = None,
    widths: tuple[float, float] = (1e-5, 1e-3),
    start: np.ndarray | None = None,
) -> list[Swing]:
    """Simulate many designs, each with its own numbers, under one drive or one each.

    Args:
        model: one of `MODELS`.
        table: numbers by contract name, each of shape (designs,) [SI].
        signals: one for all, or one a design, of the same times.
        inclination: as for `swing` [rad].
        gravity: as for `swing` [m/s^2].
        laws: as for `swing`.
        widths: as for `swing`.
        start: as for `swing`.

    Returns:
        One swing a design.

    Raises:
        ValueError: as for `swing`.
    """
    _check(model, laws)
    acting = tuple(Acting(*key) for key in sorted(laws or {}))
    strengths = np.array([(laws or {})[a.place, a.name] for a in acting])
    count = len(next(iter(table.values())))
    values = np.stack([one.values for one in signals], axis=-1)
    starts = np.stack([one.start for one in signals], axis=-1)
    named = {name: np.broadcast_to(np.asarray(x, float), (count,)) for name, x in table.items()}
    step = float(signals[0].times[1] - signals[0].times[0])
    given = np.zeros(8) if start is None else np.asarray(start, float)
    pull = gravity * np.sin(inclination)
    rest = (named, values, starts, given, step, pull, strengths, np.asarray(widths))
    parts: list[np.ndarray] = []
    for iterations, refresh in ITERATIONS[bool(acting)]:
        call = trace if count >= MANY else _trace
        found = call(model, acting, start is None, iterations, *rest, refresh)
        parts = [np.asarray(part) for part in found]
        if np.all(parts[6] <= TOLERANCE):
            break
    q, v, a, bend, speed, energy, change = parts
    times, most = signals[0].times, planar.most_bend(named)
    return [
        Swing(
            times, q[i], v[i], a[i], bend[i], speed[i], energy[i], float(change[i]), float(most[i])
        )
        for i in range(count)
    ]  # fmt: skip


def _check(model: str, laws: Mapping[tuple[str, str], float] | None) -> None:
    if model not in MODELS:
        raise ValueError(
            f"model: expected one of {', '.join(MODELS)}, found '{model}'. Mend: write one of them."
        )
    places = {*planar.PLACES} if model in WITH_SPRING else {*planar.PLACES[:-1]}
    for place, name in laws or {}:
        law = library().get(name)
        if place not in places or law is None or law.force is None or law.kind != "link":
            raise ValueError(
                f"laws: expected a force law of a link at {', '.join(sorted(places))}, found "
                f"'{place}/{name}'. Mend: name another law or place."
            )
