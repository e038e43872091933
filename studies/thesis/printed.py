"""The thesis's rows out of our energies, so that one printed slip at a time can be put back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .runs import Swing

COLLET, ROTATION, TRANSLATION, HEAD = range(4)
"""Rows of the thesis's eq. 36, in its order [-]."""

TURN, GRIP, TILT, REACH = range(4)
"""Its columns: collet angle, grip displacement, grip angle, clubhead displacement [-]."""


@dataclass(frozen=True, eq=False)
class Equations:
    """Rows M q'' + C q' + K q = push u; the thesis's by Newton and Euler, or the symmetric ones.

    Attributes:
        mass: shape (n, n) [SI].
        damping: shape (n, n) [SI].
        stiffness: shape (n, n) [SI].
        push: shape (n, 3), for acceleration, velocity and angle of a prescribed joint [SI].
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    push: np.ndarray

    @property
    def poles(self) -> np.ndarray:
        """Eigenvalues, shape (2 n,) [1/s]."""
        return np.asarray(np.linalg.eigvals(self.space[0]), complex)

    @property
    def space(self) -> tuple[np.ndarray, np.ndarray]:
        """State matrix and its input, for the state (q, q') [SI]."""
        n = len(self.mass)
        lower = [np.linalg.solve(self.mass, -each) for each in (self.stiffness, self.damping)]
        a = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), np.hstack(lower)])
        return a, np.vstack([np.zeros((n, 3)), np.linalg.solve(self.mass, self.push)])

    @property
    def slowest(self) -> Swing:
        """The slowest oscillation, its undamped frequency [Hz] and damping ratio [-]."""
        turning = self.poles[np.imag(self.poles) > 1e-6]
        pole = turning[np.argmin(np.abs(turning))]
        return Swing(float(np.abs(pole)) / (2 * np.pi), float(-np.real(pole) / np.abs(pole)))

    @property
    def lasting(self) -> float:
        """The largest real part of an eigenvalue [1/s]: minus the slowest rate of decay."""
        return float(np.max(np.real(self.poles)))

    def moved(self, signals: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Clubhead acceleration [m/s^2] and displacement [m] under prescribed joints, from rest.

        Args:
            signals: acceleration, velocity and angle, shape (t, 3) [rad/s^2, rad/s, rad].
            times: uniform samples [s].

        Returns:
            Each of shape (t,), relative to the collet; exact for signals that are straight
            between samples.
        """
        from scipy.signal import lsim

        (a, b), n = self.space, len(self.mass)
        look, feed = np.stack([a[-1], np.eye(2 * n)[n - 1]]), np.stack([b[-1], np.zeros(3)])
        seen = np.asarray(lsim((a, b, look, feed), signals, times)[1])
        return seen[:, 0], seen[:, 1]

    def peaks(self, signals: np.ndarray, times: np.ndarray) -> tuple[float, float]:
        """Largest clubhead acceleration [m/s^2] and displacement [m]; see `moved`."""
        acceleration, reach = self.moved(signals, times)
        return float(np.max(np.abs(acceleration))), float(np.max(np.abs(reach)))


def symmetric(model: str, p: Mapping[str, float]) -> Equations:
    """Our equations of a model with the numbers p [SI], from its energies; one joint at most."""
    from ...model.energies import damping_matrix, mass_matrix, stiffness_matrix
    from ...model.robot import Robot

    robot = Robot(model)
    n, rows = len(robot.coordinates), robot.rows(p, np)
    whole = [np.asarray(each(rows)) for each in (mass_matrix, damping_matrix, stiffness_matrix)]
    push = -np.stack([each[:n, n] for each in whole], axis=1)
    mass, damping, stiffness = (each[:n, :n].copy() for each in whole)
    return Equations(mass, damping, stiffness, push)


def newton_euler(model: str, p: Mapping[str, float]) -> Equations:
    """The rows of eq. 36 (or 22-25, 37, 40) for a model with a turning collet and numbers p [SI].

    The collet's row is Lagrange's less what grip and clubhead pass to it; the others stay.
    """
    ours, w = symmetric(model, p), operations(p)
    return Equations(w @ ours.mass, w @ ours.damping, w @ ours.stiffness, w @ ours.push)


def operations(p: Mapping[str, float]) -> np.ndarray:
    """From Lagrange's rows to those of Newton and Euler, shape (4, 4) [1 or m]."""
    r = p["sleeve_offset"] + p["sleeve_spacing"] / 2
    top = [1.0, -r, -1.0, -(r + lever(p))]
    return np.array([top, [0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def lever(p: Mapping[str, float]) -> float:
    """From the middle of the grip to the clubhead, the thesis's L_cl - l/2 [m]."""
    return p["club_length"] - p["grip_length"] / 2


def base_on_collet_only(right: Equations, share: float = 1.0) -> Equations:
    """Rows with the arm's acceleration on the collet alone, times `share` [-]: the slip A6."""
    push = right.push.copy()
    push[1:, 0] = 0.0
    push[COLLET, 0] *= share
    return replace(right, push=push)


def bent_by(p: Mapping[str, float], arm: np.ndarray, wrist: np.ndarray, step: float) -> np.ndarray:
    """Clubhead displacement of a driven arm that only follows, without vibrating.

    Its springs balance the drive's inertia forces, late by what their dashpots hold back.

    Args:
        p: numbers by name [SI].
        arm: its angular acceleration, shape (t,) [rad/s^2].
        wrist: that of the prescribed wrist, shape (t,) [rad/s^2].
        step: between the samples [s].

    Returns:
        Shape (t,), relative to the collet [m].
    """
    ours = symmetric("driven_arm", p)  # the first prescribed joint is the arm
    carried = np.outer(ours.mass[:, TURN], arm + wrist) - np.outer(ours.push[:, 0], arm)
    at_once = np.linalg.solve(ours.stiffness, -carried)
    held_back = ours.damping @ np.gradient(at_once, step, axis=1)
    return (at_once - np.linalg.solve(ours.stiffness, held_back))[REACH]


def equation_11(p: Mapping[str, float]) -> Equations:
    """The fixed collet of numbers p [SI] with the slip of line 1119: lever l/2 for L_cl - l/2."""
    ours = symmetric("fixed_collet", p)
    ours.damping[1, 2] = -p["shaft_damping"] * p["grip_length"] / 2
    ours.stiffness[1, 2] = -p["shaft_stiffness"] * p["grip_length"] / 2
    return ours
