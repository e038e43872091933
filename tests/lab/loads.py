"""Made-up loads of golfers' shafts up to the impact, by their kind."""

from __future__ import annotations

import numpy as np

KINDS = ("ramp", "peak", "double_peak")


def load(kind: str, seed: int, rate: float = 2048.0, noise: float = 5e-4) -> tuple:
    """Times [s], lag of the head [m] and the instant of impact [s] of one golfer.

    Hands push the shaft by a torque that rises and falls; the head answers as a damped mass. In the
    end it springs forward into the lead.
    """
    rng = np.random.default_rng(seed)
    rest, swing = rng.uniform(0.6, 1.0), rng.uniform(0.28, 0.45)
    size = rng.uniform(0.04, 0.11)
    impact = rest + swing
    times = np.arange(int((impact + 0.1) * rate)) / rate
    u = (times - rest) / swing

    def rise(at: float, width: float) -> np.ndarray:
        return 0.5 * (1 + np.tanh((u - at) / width))

    release = 1 - 1.25 * rise(rng.uniform(0.88, 0.95), rng.uniform(0.04, 0.06))
    if kind == "ramp":
        push = np.clip(u / 0.85, 0.0, 1.0) ** rng.uniform(0.9, 1.4)
    elif kind == "peak":
        held = rng.uniform(-0.1, 0.1)
        push = rise(rng.uniform(0.08, 0.16), rng.uniform(0.05, 0.08)) * (
            1 + held * np.clip(u, 0, 1)
        )
    else:
        first, second = rng.uniform(0.15, 0.25), rng.uniform(0.65, 0.75)
        humps = [(first, rng.uniform(0.75, 1.0)), (second, rng.uniform(0.75, 1.0))]
        push = sum(h * np.exp(-(((u - at) / 0.15) ** 2)) for at, h in humps)
    wanted = size * push * release
    wanted = wanted + 0.06 * size * np.sin(2 * np.pi * (0.8 * times + rng.random()))
    # the head follows as a mass on a damped spring: the shaft in two hands
    omega, ratio = 2 * np.pi * rng.uniform(9.0, 11.0), rng.uniform(0.5, 0.8)
    lag, speed, seen = wanted[0], 0.0, np.empty(len(times))
    for i, to in enumerate(wanted):
        speed += (omega**2 * (to - lag) - 2 * ratio * omega * speed) / rate
        lag += speed / rate
        seen[i] = lag
    return times, seen + noise * rng.standard_normal(len(times)), impact
