"""Matrices of the thesis as they are printed, slips included, each with its line in the source.

Source: "Minimising vibration in a flexible golf club during robotic simulations of a golf swing"
(Loughborough), lines of its text. `k1`, `c1` belong to one element of the upper set of springs,
`k2`, `c2` to one of the lower; `a` abbreviates the printed ``(L_cl - l/2)``. Nothing here is
shared with the package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Club:
    """The printed symbols [SI], with four sleeve elements in two sets."""

    m_G: float
    I_G: float
    m_cl: float
    I_col: float
    L_cl: float
    l: float  # noqa: E741 - printed so
    d: float
    l1: float
    k1: float
    k2: float
    c1: float
    c2: float
    k_sh: float
    c_sh: float
    k_w: float
    c_w: float

    @property
    def a(self) -> float:
        """Lever ``L_cl - l/2`` [m]."""
        return self.L_cl - self.l / 2

    @property
    def l2(self) -> float:
        """``L_2 = L_1 + d`` [m], line 1428."""
        return self.l1 + self.d


def equations_8_to_10(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K of lines 1111 (eq. 8), 1113 (eq. 9), 1115 (eq. 10) over (x_G, x_cl, theta_G)."""
    mass = np.diag([t.m_G, t.m_cl, t.I_G])

    def matrix(e1: float, e2: float, shaft: float) -> np.ndarray:
        a, d = t.a, t.d
        return np.array(
            [
                [2 * e2 + 2 * e1 + shaft, -shaft, e2 * d - e1 * d + shaft * a],  # line 1111
                [-shaft, shaft, -shaft * a],  # line 1113
                [
                    e2 * d - e1 * d + shaft * a,
                    -shaft * a,
                    e1 * d**2 / 2 + e2 * d**2 / 2 + shaft * a**2,
                ],  # line 1115
            ]
        )

    return mass, matrix(t.c1, t.c2, t.c_sh), matrix(t.k1, t.k2, t.k_sh)


def equation_11(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K and right side of line 1119 (eq. 11) over (x_G, x_cl, theta_G), slips included."""
    mass, damping, stiffness = equations_8_to_10(t)
    damping[2, 1] = -t.c_sh * t.l / 2
    stiffness[2, 1] = -t.k_sh * t.l / 2
    return mass, damping, stiffness, np.array([0.0, 0.0, 1.0])


def equation_36(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K and right side of lines 1448 (M), 1449 (C), 1451 (K) and 1452 (right side), eq. 36.

    Columns (theta_col, x_G, theta_G, x_cl); rows in the printed order: collet, rotation of the
    grip, translation of the grip, clubhead.
    """
    mass = np.array(
        [
            [t.I_col, 0, 0, 0],
            [t.I_G, 0, t.I_G, 0],
            [t.m_G * (t.l1 + t.d / 2), t.m_G, 0, 0],
            [t.m_cl * t.L_cl, 0, 0, t.m_cl],
        ]
    )

    def matrix(wrist: float, e1: float, e2: float, shaft: float) -> np.ndarray:
        a, d, l1, l2 = t.a, t.d, t.l1, t.l2
        return np.array(
            [
                [wrist, -2 * e1 * l1 - 2 * e2 * l2, e1 * d * l1 - e2 * d * l2, 0],
                [
                    0,
                    e2 * d - e1 * d + shaft * a,
                    0.5 * d**2 * (e1 + e2) + shaft * a * a,
                    -shaft * a,
                ],
                [0, 2 * e1 + 2 * e2 + shaft, e2 * d - e1 * d + shaft * a, -shaft],
                [0, -shaft, -shaft * a, shaft],
            ]
        )

    damping = matrix(t.c_w, t.c1, t.c2, t.c_sh)
    stiffness = matrix(t.k_w, t.k1, t.k2, t.k_sh)
    return mass, damping, stiffness, np.array([0.0, 0.0, 0.0, 1.0])
