"""The impact of a swing: by the ball where one is told, by the loss of speed where none is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .clubhead_after import Departure, depart
from .clubhead_arc import STRAIGHT, Arc
from .clubhead_ball import Ball
from .clubhead_face import Face
from .clubhead_impact import (
    LONGEST,
    ROUGH,
    Approach,
    Impact,
    approach_of,
    arrive,
    extrapolated,
    window_of,
)
from .clubhead_path import DEGREE, notch
from .clubhead_pose import Poses
from .clubhead_swing import Club, Swing

CONTACT = 0.0006
"""How long a ball stays on the face at most [s]."""

USUAL_CONTACT = 0.0005
"""How long it usually does [s]; thesis, section 3.2."""

CONTACT_STD = 0.00005
"""Standard deviation of that [s]."""

UNSHARP = 0.1
"""Share of a frame that is added to it for the shape of a blow, which no frame shows [-]."""

NEAR_FACE = 0.06
"""Distance from the middle of the face within which a ball can be met [m]."""

LEAST_ROUGHNESS = 1e-6
"""Misfit of the smooth motion that passes in silence, however exact the markers are [m]."""

APART = 4.0
"""Standard deviations by which ball and loss of speed may part [-]."""


@dataclass(frozen=True, eq=False)
class Blow:
    """The impact, the club after it, and what is to be said.

    Attributes:
        impact: None where there was none.
        after: None where there was none, or too few frames follow.
        doubts: sentences for which the impact is not to be trusted.
    """

    impact: Impact | None
    after: Departure | None = None
    doubts: tuple[str, ...] = ()

    def segments(self, count: int, rate: float) -> np.ndarray:
        """0 before, 1 during and 2 after a contact.

        Args:
            count: frames [-].
            rate: frames a second [Hz].

        Returns:
            Shape (n,) [-].
        """
        if self.impact is None:
            return np.zeros(count, dtype=int)
        row = np.arange(count)
        last = self.impact.frame + int(np.ceil(CONTACT * rate))
        return (row > self.impact.frame).astype(int) + (row > last)


def blow_of(swing: Swing, club: Club, ball: Ball | None, poses: Poses, axes: np.ndarray) -> Blow:
    """Finds and measures the impact.

    Args:
        swing: for its rate.
        club: its face and points.
        ball: at rest before the impact; None where none is told.
        poses: with the middle of the face as origin.
        axes: of the face in the room, shape (n, 3, 3) [-].

    Returns:
        The impact with its doubts.

    Source: thesis, section 3.4; tests/identification/test_clubhead_blow.py.
    """
    return _Finding(swing, club, ball, poses, axes).blow()


class _Finding:
    """One swing while its impact is found."""

    def __init__(
        self, swing: Swing, club: Club, ball: Ball | None, poses: Poses, axes: np.ndarray
    ) -> None:
        self.club, self.ball, self.poses, self.axes = club, ball, poses, axes
        self.rate = swing.rate
        along = np.sqrt(np.trace(poses.covariance[:, :3, :3], axis1=1, axis2=2) / 3)
        self.lost = notch(poses.position, poses.found, swing.rate, along, CONTACT)
        self.doubts: list[str] = []

    def blow(self) -> Blow:
        told = self._told() if self.lost else None
        if self.ball is None:
            if self.lost is None:
                return Blow(None)
            frame = int(self.lost[0]) if told is None else int(np.floor(told[0] * self.rate))
        else:
            near = _reached(
                self.club.face, self.ball, self.poses, self.axes, self.lost[0] if self.lost else 0.0
            )
            if isinstance(near, float):
                return self._none(
                    f"The face never reaches the ball: its middle passes {near:.3g} m from it. "
                    "Check the ball's place and unit, the middle of the face, and the axes."
                )
            frame = near
        rows = self._before(frame)
        if len(rows) < DEGREE + 3:
            return self._none(
                f"Only {len(rows)} frames come before the impact: too few for its speed."
            )
        after = (0.5 + frame - rows[-1]) / self.rate, 0.6 / self.rate
        if told is not None:
            after = told[0] - rows[-1] / self.rate, told[1]
        approach, smoothed = self._approach(rows), window_of(self._approach(rows, STRAIGHT))
        values, stds, count, chi2, quantile = arrive(
            approach, self.club.face, self.ball, after, self.poses.freedom, self.club.own_points()
        )
        if not all(map(np.isfinite, (*values.values(), *stds.values()))):
            return self._none("The frames before the impact give no motion towards the ball.")
        values["time"] += rows[-1] / self.rate
        if chi2 > ROUGH and np.sqrt(chi2) * self.poses.noise > LEAST_ROUGHNESS:
            self.doubts.append(
                f"The {count} frames before the impact are no smooth motion: their misfit has "
                f"{chi2:.2g} times the power of the noise. The errors were widened by that."
            )
        if self.ball is not None:
            self._compare(values["time"], stds["time"], frame, told)
        by = "notch" if self.ball is None else "ball"
        impact = Impact(values, stds, quantile, frame, count, smoothed, chi2, by, ())
        return Blow(impact, self._after(frame), tuple(self.doubts))

    def _none(self, why: str) -> Blow:
        return Blow(None, None, (*self.doubts, why))

    def _before(self, frame: int) -> np.ndarray:
        rows = np.flatnonzero(self.poses.found[: frame + 1])
        return rows[rows > rows[-1] - round(LONGEST * self.rate)] if len(rows) else rows

    def _approach(self, rows: np.ndarray, arc: Arc | None = None) -> Approach:
        seen = self.poses.position, self.axes, self.poses.covariance
        return approach_of(*seen, rows, self.rate, arc)

    def _after(self, frame: int) -> Departure | None:
        rows = np.flatnonzero(self.poses.found)
        rows = rows[rows > frame + int(np.ceil(CONTACT * self.rate))]
        seen = self.poses.position, self.axes, self.poses.covariance
        return depart(*seen, rows, self.rate, self.club.face.toe)

    def _told(self) -> tuple[float, float] | None:
        """When the blow began, as the paths before and after it tell, with its error [s]."""
        assert self.lost is not None
        frame, told = int(self.lost[0]) - 2, None
        for _ in range(3):
            rows, after = self._before(frame), self._after(max(frame, int(self.lost[0])))
            if len(rows) < DEGREE + 3 or after is None:
                return told
            approach = self._approach(rows)
            away = (after.frame - rows[-1]) / self.rate
            place, spread, velocity = extrapolated(approach, away)
            change = after.velocity - velocity
            behind = float((after.place - place) @ change / (change @ change))
            middle = after.frame / self.rate - behind
            noise = change @ (spread + after.covariance[:3, :3]) @ change / (change @ change) ** 2
            began = middle - 0.5 * USUAL_CONTACT
            told = began, float(np.hypot(np.sqrt(noise), 0.5 * CONTACT_STD + UNSHARP / self.rate))
            if int(np.floor(began * self.rate)) == frame:
                break
            frame = int(np.clip(np.floor(began * self.rate), self.lost[0] - 4, self.lost[0] + 2))
        return told

    def _compare(
        self, reached: float, std: float, frame: int, told: tuple[float, float] | None
    ) -> None:
        """Doubts where the ball and the loss of speed contradict each other."""
        if told is not None:
            apart = reached - told[0]
            if abs(apart) > APART * np.hypot(std, told[1]):
                word = "later" if apart > 0 else "earlier"
                self.doubts.append(
                    f"The face reaches the ball {1e3 * abs(apart):.2g} ms {word} than it loses "
                    "speed: the ball, or the middle of the face, is not where it is said."
                )
        elif self.lost is None and self.poses.found[frame:].sum() > 20:
            self.doubts.append(
                "No speed is lost where the face reaches the ball: it was not hit, or is not "
                "where it is said."
            )


def _reached(face: Face, ball: Ball, poses: Poses, axes: np.ndarray, likely: float) -> int | float:
    """The last frame before the face touches the ball; of several, the one nearest to `likely`.

    Where it never does, how near its middle comes [m].
    """
    rows = np.flatnonzero(poses.found)
    away = ball.center - poses.position[rows]
    own = np.einsum("nij,ni->nj", axes[rows], away)
    foot, distance = face.touch(own)
    gap = distance - ball.radius
    near = np.linalg.norm(foot, axis=1) < NEAR_FACE
    crossed = np.flatnonzero((gap[:-1] > 0) & (gap[1:] <= 0) & near[1:])
    if not crossed.size:
        return float(np.linalg.norm(away, axis=1).min())
    return int(rows[crossed[np.abs(rows[crossed] - likely).argmin()]])
