"""The thesis's grid of 75 by 75 wrists at 200 random points, by an integration without modes."""

from typing import Any

import numpy as np
import pytest
import scipy.linalg
from scipy.integrate import solve_ivp

from supple.model.drives import impact
from supple.model.linear import Port, state_space
from supple.model.robot import PRESETS, Robot
from supple.optimize.sweep import Axis, SweepTask, sweep

NUMBERS = PRESETS["robo_v_sleeve_50"]
RATE, LASTS, FORCE = 1000, 0.005, -1600.0
TASK = SweepTask(
    Robot("pinned_wrist", tuple(NUMBERS)),
    NUMBERS,
    impact("clubhead", FORCE, 0.0, LASTS),
    np.arange(2 * RATE) / RATE,
    (LASTS, 2.0),
    Port("clubhead", "acceleration", "collet"),
    ("rms", "peak"),
    (
        Axis("wrist_stiffness", 50.0 + 75.0 * np.arange(75), "N m/rad"),
        Axis("wrist_damping", 2.0 + 2.0 * np.arange(75), "N m s/rad"),
    ),
)


def test_200_points_of_the_map_are_those_of_an_integration_to_1e_8():
    """Steps of a millisecond by the matrix exponential of each design's own equations."""
    found = sweep(TASK).scores
    chosen = np.random.default_rng(200).choice(TASK.count, 200, replace=False)
    numbers, first = TASK.numbers_of(chosen), round(LASTS * RATE)
    worst = {"rms": 0.0, "peak": 0.0}
    for row, at in enumerate(chosen):
        own = {**NUMBERS, **{name: float(values[row]) for name, values in numbers.items()}}
        space = state_space(TASK.mechanism, own, TASK.drive.ports, (TASK.sensor,))
        a, b, c = (np.asarray(one) for one in (space.a, space.b, space.c))
        size = len(a)
        whole = np.zeros((size + 1, size + 1))
        whole[:size, :size], whole[:size, size] = a, b[:, 0]
        step = scipy.linalg.expm(whole / RATE)
        pushed, free = np.append(np.zeros(size), FORCE), step[:size, :size]
        for _ in range(first):
            pushed = step @ pushed
        x, samples = pushed[:size], []
        for _ in range(first, 2 * RATE):
            samples.append(c[0] @ x)
            x = free @ x
        seen = np.array(samples)
        for name, value in (("rms", np.sqrt(np.mean(seen**2))), ("peak", np.abs(seen).max())):
            worst[name] = max(worst[name], abs(found[name].ravel()[at] / value - 1.0))
    assert worst["rms"] < 1e-8 and worst["peak"] < 1e-8, worst


def integrated(numbers: dict[str, float]) -> float:
    """RMS of one design by DOP853 at 1e-12, which knows nothing of matrix exponentials."""
    space = state_space(TASK.mechanism, numbers, TASK.drive.ports, (TASK.sensor,))
    a, b, c = (np.asarray(one) for one in (space.a, space.b, space.c))
    told: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12}
    push = solve_ivp(lambda t, x: a @ x + b[:, 0] * FORCE, (0, LASTS), np.zeros(len(a)), **told)
    times = TASK.times[round(LASTS * RATE) :]
    span = (LASTS, times[-1])
    free = solve_ivp(lambda t, x: a @ x, span, push.y[:, -1], t_eval=times, **told)
    return float(np.sqrt(np.mean((c[0] @ free.y) ** 2)))


def test_a_few_of_them_are_those_of_a_runge_kutta_integration():
    found = sweep(TASK).scores["rms"].ravel()
    for at in np.random.default_rng(3).choice(TASK.count, 3, replace=False):
        own = {name: float(v[0]) for name, v in TASK.numbers_of(np.array([at])).items()}
        assert found[at] == pytest.approx(integrated({**NUMBERS, **own}), rel=1e-8)
