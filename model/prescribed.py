"""A prescribed joint: the angle that a motor holds, whatever the club does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

AT_REST = 1e-9
"""A jump this small, as a share of the largest value, is none [-]."""


@dataclass(frozen=True)
class Prescribed:
    """The angle of a joint: a cubic in time, or a sine, between the instants at which it changes.

    Attributes:
        joint: arm or wrist.
        begin: angle and velocity with which the motion begins; the collet is carried along
            [rad, rad/s].
        edges: instants from which on the next piece holds, ascending, none before 0 [s].
        pieces: angle, velocity, acceleration and its rate just after each edge
            [rad, rad/s, rad/s^2, rad/s^3].
        frequency: 0 for cubics; otherwise pieces turn on as sines of this frequency [rad/s].
    """

    joint: str
    begin: tuple[float, float] = (0.0, 0.0)
    edges: tuple[float, ...] = ()
    pieces: tuple[tuple[float, float, float, float], ...] = ()
    frequency: float = 0.0

    @cached_property
    def _known(self) -> tuple[np.ndarray, np.ndarray]:
        """Instants and pieces, from the beginning on."""
        first = (*self.begin, 0.0, 0.0)
        return np.array([0.0, *self.edges]), np.array([first, *self.pieces])

    @cached_property
    def jumps(self) -> np.ndarray:
        """By how much angle, velocity, acceleration and its rate jump, shape (edges, 4) [SI]."""
        edges, pieces = self._known
        left = self._piece(np.arange(len(self.edges)), edges[1:])
        return pieces[1:] - left

    @property
    def leaps(self) -> bool:
        """Whether the angle itself jumps."""
        new, leap = self._known[1][1:, 0], self.jumps[:, 0]
        left = self._known[1][:-1]  # what moves before each edge
        reach = np.abs(left[:, 0]) + np.abs(left[:, 1]) * np.diff(self._known[0])
        return bool(np.any(np.abs(leap) > AT_REST * (np.abs(new) + reach)))

    def at(self, times: np.ndarray, inside: np.ndarray | None = None) -> np.ndarray:
        """Angle, velocity and acceleration, the new ones at an edge.

        Args:
            times: shape (t,) [s].
            inside: times that tell which piece is meant, where not `times` itself [s].

        Returns:
            Shape (t, 3) [rad, rad/s, rad/s^2].
        """
        times = np.asarray(times, float)
        asked = times if inside is None else np.asarray(inside, float)
        which = np.searchsorted(self.edges, asked, side="right")
        return self._piece(which, times)[:, :3]

    def _piece(self, which: np.ndarray, times: np.ndarray) -> np.ndarray:
        edges, pieces = self._known
        angle, speed, bend, rate = pieces[which].T
        t, w = times - edges[which], self.frequency
        if not w:
            return np.stack(
                [
                    angle + t * (speed + t * (bend / 2 + t * rate / 6)),
                    speed + t * (bend + t * rate / 2),
                    bend + t * rate,
                    rate,
                ],
                axis=1,
            )
        sine, cosine = np.sin(w * t), np.cos(w * t)
        swing = bend * cosine + rate / w * sine
        turn = rate * cosine - bend * w * sine
        gained = (rate - turn) / w**2
        return np.stack(
            [angle + speed * t + (bend - swing + rate * t) / w**2, speed + gained, swing, turn],
            axis=1,
        )


def through(
    joint: str, times: Sequence[float], angles: Sequence[float], duration: float
) -> Prescribed:
    """The smoothest curve through the rows of a profile: a cubic spline, at rest beyond its ends.

    Args:
        joint: arm or wrist.
        times: at least two, ascending; those before 0 only shape the beginning [s].
        angles: of the joint at these times [rad].
        duration: length of the motion [s].

    Returns:
        The angle, with two continuous derivatives inside the profile; not-a-knot at its ends.
    """
    spline = CubicSpline(times, angles)
    knots = np.asarray(times, float)
    inner = knots[(knots > 0) & (knots < duration)]
    edges = np.unique(np.concatenate([[max(0.0, knots[0])], inner]))
    edges = edges[edges < knots[-1]]
    which = np.clip(np.searchsorted(knots, edges, side="right") - 1, 0, len(knots) - 2)
    columns = np.stack([spline(edges), spline(edges, 1), spline(edges, 2), 6 * spline.c[0][which]])
    table = [(float(a), float(v), float(b), float(r)) for a, v, b, r in [*columns.T]]
    marks = [float(edge) for edge in edges]
    if knots[-1] < duration:
        marks.append(max(float(knots[-1]), 0.0))
        table.append((float(angles[-1]), 0.0, 0.0, 0.0))
    start = float(spline(max(0.0, knots[0]))) if knots[-1] > 0 else float(angles[-1])
    speed = float(spline(0.0, 1)) if knots[0] <= 0.0 < knots[-1] else 0.0
    return Prescribed(joint, (start, speed), tuple(marks), tuple(table))


def shaped(
    joint: str,
    shape: str,
    amplitude: float,
    period: float,
    start: float,
    end: float,
    duration: float,
) -> Prescribed:
    """An angle that is a square or a sine wave, 0 before `start` and from `end` on.

    Args:
        joint: arm or wrist.
        shape: ``square``, which leaps to ``+amplitude`` for half a period, or ``sine``.
        amplitude: [rad].
        period: [s].
        start: [s].
        end: [s].
        duration: length of the motion; what comes later is left out [s].

    Returns:
        The angle.
    """
    rest = (0.0, 0.0, 0.0, 0.0)
    w = 2 * np.pi / period if shape == "sine" else 0.0
    if shape == "sine":
        listed = [(start, (0.0, amplitude * w, 0.0, -amplitude * w**3))]
    else:
        count = int(np.ceil((end - start) / (0.5 * period) - AT_REST))
        signs = [amplitude if k % 2 == 0 else -amplitude for k in range(count)]
        listed = [(start + 0.5 * period * k, (sign, *rest[1:])) for k, sign in enumerate(signs)]
    kept = [each for each in (*listed, (end, rest)) if each[0] < duration]
    return Prescribed(
        joint,
        edges=tuple(edge for edge, _ in kept),
        pieces=tuple(piece for _, piece in kept),
        frequency=w,
    )
