"""Motion of any linear mechanism that is struck, by the matrix exponential alone."""

import numpy as np
from scipy.linalg import expm

STEP = 1e-3
"""Between samples [s]."""


def struck(whole: np.ndarray, push: np.ndarray, start: np.ndarray, count: int) -> np.ndarray:
    """Positions, shape (count, n) [SI], from a start at rest.

    Args:
        whole: mass, stiffness and damping, shape (3, n, n) [SI].
        push: generalized force of one newton, which 40 N are of from 0.02 s to 0.024 s, (n,).
        start: positions [SI], shape (n,).
        count: of samples [-].
    """
    n, (mass, stiffness, damping) = len(push), whole
    a = np.zeros((2 * n + 1, 2 * n + 1))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n] = -np.linalg.solve(mass, stiffness)
    a[n : 2 * n, n : 2 * n] = -np.linalg.solve(mass, damping)
    calm = expm(a * STEP)
    a[n : 2 * n, -1] = 40.0 * np.linalg.solve(mass, push)
    hit = expm(a * STEP)
    x, found = np.concatenate([start, np.zeros(n), [1.0]]), []
    for index in range(count):
        found.append(x[:n])
        x = (hit if 20 <= index < 24 else calm) @ x
    return np.array(found)
