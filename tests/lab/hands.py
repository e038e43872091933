"""Made-up motions of a straight arm that holds a club, seen by two accelerometers; section 6.5."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

MOTIONS = {  # waypoints [s, degrees]
    "-90 to 90": ((0.4, -90.0), (1.4, 90.0)),
    "0 to -90 to 90 to 0": ((0.3, 0.0), (0.9, -90.0), (1.7, 90.0), (2.3, 0.0)),
    "-90 to 90 to -90": ((0.4, -90.0), (1.3, 90.0), (2.2, -90.0)),
}
HAND, HEAD = 0.62, 1.68  # from the shoulder [m]


def moved(
    name: str,
    seed: int,
    frequency: float,
    ratio: float,
    rate: float = 2048.0,
    noise: float = 0.3,
    length: float = 3.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations of hand and head [m/s^2]; the hand's sensor points the other way.

    Args:
        frequency, ratio: of the club in its hold [Hz, -].
        noise: of each sensor, white [m/s^2].
    """
    rng = np.random.default_rng(seed)
    times = np.arange(int(length * rate)) / rate
    shake = 2 * np.pi * rng.uniform(8.0, 11.0)
    turn = np.zeros(len(times))
    points = MOTIONS[name]
    for (t0, a0), (t1, a1) in pairwise(points):
        s = np.clip((times - t0) / (t1 - t0), 0.0, 1.0)
        turn += np.radians(a1 - a0) * (60 * s - 180 * s**2 + 120 * s**3) / (t1 - t0) ** 2
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
    seen = (-HAND * turn, head)
    one, two = (each + noise * rng.standard_normal(len(times)) for each in seen)
    return one, two
