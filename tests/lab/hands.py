"""Made-up motions of a straight arm that holds a club, seen by two accelerometers; section 6.5."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from .files import toml_table

MOTIONS = {  # waypoints [s, degrees]
    "-90 to 90": ((0.4, -90.0), (1.4, 90.0)),
    "0 to -90 to 90 to 0": ((0.3, 0.0), (0.9, -90.0), (1.7, 90.0), (2.3, 0.0)),
    "-90 to 90 to -90": ((0.4, -90.0), (1.3, 90.0), (2.2, -90.0)),
}
HAND, HEAD = 0.62, 1.68  # from the shoulder [m]
GRAVITY = 9.81  # m/s^2
GOLFERS = {"golfer_1": 0.7, "golfer_2": 1.0, "golfer_3": 1.6}  # damping ratios of their holds
SLOW = 512.0  # samples a second of the records that are written [Hz]


def moved(
    name: str,
    seed: int,
    frequency: float,
    ratio: float,
    rate: float = 2048.0,
    noise: float = 0.3,
    length: float = 3.0,
    steep: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations of hand and head [m/s^2]; the hand's sensor points the other way.

    Args:
        frequency, ratio: of the club in its hold [Hz, -].
        noise: of each sensor, white [m/s^2].
        steep: sine of the swing plane against the ground; 1 swings up and down.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(int(length * rate)) / rate
    shake = 2 * np.pi * rng.uniform(8.0, 11.0)
    turn, angle = np.zeros(len(times)), np.full(len(times), np.radians(MOTIONS[name][0][1]))
    points = MOTIONS[name]
    for (t0, a0), (t1, a1) in pairwise(points):
        s = np.clip((times - t0) / (t1 - t0), 0.0, 1.0)
        turn += np.radians(a1 - a0) * (60 * s - 180 * s**2 + 120 * s**3) / (t1 - t0) ** 2
        angle += np.radians(a1 - a0) * s**3 * (10 - 15 * s + 6 * s**2)
    trembling = ((times > points[0][0]) & (times < points[-1][0])) * np.sin(shake * times)
    turn = turn + 0.6 * trembling  # physiological tremor

    omega = 2 * np.pi * frequency

    def rates(t: float, state: np.ndarray) -> list[float]:
        pull = HEAD * np.interp(t, times, turn)
        return [state[1], -pull - 2 * ratio * omega * state[1] - omega**2 * state[0]]

    run = solve_ivp(rates, (0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-7, atol=1e-9,
                    max_step=0.01)  # fmt: skip
    bend, speed = run.y
    head = -2 * ratio * omega * speed - omega**2 * bend
    weight = GRAVITY * steep * np.sin(angle)
    seen = (-(HAND * turn + weight), head + weight)
    one, two = (each + noise * rng.standard_normal(len(times)) for each in seen)
    return one, two


def write_hands(folder: Path, seed: int = 0) -> list[Path]:
    """Records of golfers' hands in the three motions, each golfer in one; their sidecars."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for number, ((name, ratio), motion) in enumerate(zip(GOLFERS.items(), MOTIONS)):
        hand, head = moved(motion, seed + number, 4.17, ratio, SLOW)
        table = np.stack([hand, head], axis=1)
        np.savetxt(folder / f"{name}.csv", table, fmt="%.3f", delimiter=",", header="hand,head",
                   comments="")  # fmt: skip
        record: dict[str, object] = {
            "file": f"{name}.csv", "test": "swing", "sample_rate": SLOW, "description": motion,
        }  # fmt: skip
        tables = [toml_table("record", record)]
        for channel, place in (("hand", "hand"), ("head", "clubhead")):
            told: dict[str, object] = {
                "column": channel, "unit": "m/s^2", "role": "response",
                "quantity": "acceleration", "place": place,
            }  # fmt: skip
            tables.append(toml_table(f"channels.{channel}", told))
        written.append(folder / f"{name}.toml")
        written[-1].write_text("\n\n".join(tables) + "\n", encoding="utf-8")
    return written
