"""A golfer's arm with a passive wrist and a club of hinged links, in absolute angles."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from .bodies import ROBO_V

HAND = {"collet_mass": 1.5, "collet_centre": 0.10, "arm_length": 0.65}
LINKS = 5  # of the free shaft
NODE = 2e-4  # mass of a joint of the shaft [kg]; the rest is lumped at the head
GRAVITY = 9.80665


@dataclass(frozen=True)
class Swing:
    """Angles at all samples [rad], and the wrist behind them."""

    times: np.ndarray
    arm: np.ndarray
    club: np.ndarray
    stiffness: np.ndarray  # at all samples [N m/rad]
    damping: float
    bend: np.ndarray  # of the head off the grip's line [m]


def downswing(times: np.ndarray, low: float = -2.4, high: float = 1.9, shake: float = 0.02):
    """An arm's angle [rad] with its first two rates: backswing's end to follow-through."""
    span = times[-1] - times[0]
    u = (times - times[0]) / span
    size = high - low
    angle = low + size * u**3 * (10 - 15 * u + 6 * u**2)
    rate = size * u**2 * (30 - 60 * u + 30 * u**2) / span
    gain = size * u * (60 - 180 * u + 120 * u**2) / span**2
    for beat, phase in ((9.0, 0.3), (16.0, 1.1)):
        turn = beat * times + phase
        angle = angle + shake * (6 / beat) * np.sin(turn)
        rate = rate + shake * 6 * np.cos(turn)
        gain = gain - shake * 6 * beat * np.sin(turn)
    return angle, rate, gain


def draw_wrist(
    stiffness: float | Callable[[np.ndarray], np.ndarray],
    damping: float,
    seed: int = 0,
    noise: float = 0.0,
    duration: float = 1.2,
    rate: float = 400.0,
    rest: float = -0.3,
    inclination: float = 0.0,
    shake: float = 0.02,
) -> Swing:
    """A swing whose club follows an arm through a passive wrist; `noise` on both angles [rad]."""
    times = np.arange(round(duration * rate) + 1) / rate
    pull = GRAVITY * np.sin(inclination)

    def spring(time: float) -> float:
        if not callable(stiffness):
            return stiffness
        return float(stiffness(np.array([time]))[0])

    low = ROBO_V["grip_length"]
    reach = ROBO_V["sleeve_offset"] + ROBO_V["sleeve_spacing"] / 2 + ROBO_V["club_length"]
    reach -= ROBO_V["grip_length"] / 2
    length = np.append(low, np.full(LINKS, (reach - low) / LINKS))
    mass = np.append(np.full(LINKS, NODE), ROBO_V["clubhead_mass"])  # at the links' far ends
    to_tip = reach - np.append(low, low + np.cumsum(length[1:])[:-1])
    hinge = ROBO_V["shaft_stiffness"] * float(np.sum(to_tip**2))
    loss = ROBO_V["shaft_damping"] / ROBO_V["shaft_stiffness"] * hinge
    grip = ROBO_V["sleeve_offset"] + ROBO_V["sleeve_spacing"] / 2
    inertia = ROBO_V["collet_inertia"] + ROBO_V["grip_inertia"] + ROBO_V["grip_mass"] * grip**2
    moment = HAND["collet_mass"] * HAND["collet_centre"] + ROBO_V["grip_mass"] * grip
    beyond = np.cumsum(mass[::-1])[::-1]  # what hangs at and beyond each link's far end
    shared = np.minimum.outer(beyond, beyond) * np.outer(length, length)

    def arm_at(time: float) -> tuple[float, float, float]:
        ends = np.array([times[0], time, times[-1]])
        angle, speed, gain = downswing(ends, shake=shake)
        return float(angle[1]), float(speed[1]), float(gain[1])

    def slope(time: float, state: np.ndarray) -> np.ndarray:
        angle, turn = np.split(state, 2)
        lift, spin, gain = arm_at(time)
        apart = angle[:, None] - angle[None, :]
        matrix = shared * np.cos(apart)
        matrix[0, 0] += inertia
        load = -(shared * np.sin(apart)) @ turn**2
        first = beyond * length
        first[0] += moment
        swung = HAND["arm_length"] * (gain * np.cos(angle - lift) + spin**2 * np.sin(angle - lift))
        load -= first * (swung + pull * np.sin(angle))
        bent, bending = np.diff(angle), np.diff(turn)
        push = hinge * bent + loss * bending
        load[:-1] += push
        load[1:] -= push
        load[0] -= spring(time) * (angle[0] - lift - rest) + damping * (turn[0] - spin)
        return np.concatenate([turn, np.linalg.solve(matrix, load)])

    lift, spin, _ = arm_at(times[0])
    start = np.concatenate([np.full(LINKS + 1, lift + rest), np.full(LINKS + 1, spin)])
    run = solve_ivp(slope, times[[0, -1]], start, "Radau", times, rtol=1e-6, atol=1e-8)
    assert run.success, run.message
    rng = np.random.default_rng(seed)
    bend = np.sin(run.y[: LINKS + 1] - run.y[0]).T @ length
    arm = downswing(times, shake=shake)[0] + noise * rng.standard_normal(len(times))
    club = run.y[0] + noise * rng.standard_normal(len(times))
    return Swing(times, arm, club, np.array([spring(t) for t in times]), damping, bend)


def main() -> None:
    """Writes the two made-up swings of the study: `python -m tests.lab.wristed [FOLDER]`."""
    home = Path(__file__).resolve().parents[2] / "studies" / "data" / "wrist"
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=home)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for seed, (stiffness, damping) in enumerate(((500.0, 5.0), (350.0, 3.0)), 1):
        made = draw_wrist(stiffness, damping, seed, noise=np.radians(0.05), inclination=0.8)
        table = np.column_stack([made.times, np.degrees(made.arm), np.degrees(made.club)])
        path = folder / f"golfer_{seed}.csv"
        head = "time [s],arm angle [deg],club angle [deg]"
        np.savetxt(path, table, "%.6g", ",", header=head, comments="")


if __name__ == "__main__":
    main()
