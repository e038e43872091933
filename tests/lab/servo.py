"""A robot that plays a profile: loops that come late, cogging motors, feedback at 250 Hz."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

LOOP = (9.0, 0.8)  # of each axis's position loop: frequency [Hz] and damping ratio
COGGING = {"arm": (5.0, 18.0), "wrist": (9.0, 14.0)}  # rad/s^2, and waves a radian
FEEDBACK, FINE = 250.0, 4000.0  # Hz
QUANTUM = 1e-3  # of the feedback [degrees]
AFTER = 0.8  # s at rest behind the profile


def play(
    times: np.ndarray, told: dict[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """What each axis does of the angles that it is told [s, rad], at 250 Hz from 0 on."""
    clock = np.arange(int((times[-1] + AFTER) * FINE)) / FINE
    omega, ratio = 2 * np.pi * LOOP[0], LOOP[1]
    matrix = np.array([[0.0, 1.0], [-(omega**2), -2 * ratio * omega]])
    step = expm(matrix / FINE)
    kick = np.linalg.solve(matrix, (step - np.eye(2)) @ [0.0, 1.0])
    found = {}
    for axis, angles in told.items():
        want = CubicSpline(times, angles, bc_type="clamped")(np.minimum(clock, times[-1]))
        size, waves = COGGING[axis]
        state, played = np.array([want[0], 0.0]), np.empty(len(clock))
        for index, target in enumerate(want):
            played[index] = state[0]
            tug = size * np.sin(waves * state[0]) * np.tanh(abs(state[1]) / 0.05)
            state = step @ state + kick * (omega**2 * target + tug)
        found[axis] = played
    every = int(FINE / FEEDBACK)
    rounded = {a: np.rint(np.degrees(v[::every]) / QUANTUM) * QUANTUM for a, v in found.items()}
    return clock[::every], {axis: np.radians(values) for axis, values in rounded.items()}


def write_feedback(profile: Path, path: Path) -> None:
    """Plays ``profile.csv`` (time, arm and wrist angle in s and rad) and writes the feedback."""
    table = np.genfromtxt(profile, delimiter=",", names=True)
    times, played = play(table["time"], {axis: table[f"{axis}_angle"] for axis in COGGING})
    rows = np.column_stack([times, *(np.degrees(values) for values in played.values())])
    head = ",".join(["time [s]", *(f"{axis}_angle [deg]" for axis in played)])
    np.savetxt(path, rows, "%.7g", ",", header=head, comments="")
