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
    m_col: float
    l_col: float
    l_arm: float

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


def _newton_euler(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K of lines 1448 (M), 1449 (C), 1451 (K): eq. 36, and the same again in eq. 37.

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
    return mass, damping, stiffness


def equations_22_to_25(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K and the torque's column of lines 1277 (eq. 22) to 1283 (eq. 25), as printed.

    Columns and rows as in eq. 36. The stiffness of eq. 24 (line 1281) has ``k_1 d + k_2 d``; its
    damping has ``c_2 d - c_1 d``, as it should be.
    """
    mass, damping, stiffness = _newton_euler(t)
    damping[0, 0] = stiffness[0, 0] = 0.0  # no wrist spring
    stiffness[2, 2] = t.k1 * t.d + t.k2 * t.d + t.k_sh * t.a  # line 1281
    return mass, damping, stiffness, np.array([1.0, 0.0, 0.0, 0.0])


def equations_32_to_35(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K and right side of lines 1437 (eq. 32) to 1443, with the sign of eq. 32 as printed.

    Line 1437 subtracts ``x_G (2 k_1 l_1 - 2 k l_2 ...)``, read with the bracket closed and k = k_2.
    """
    mass, damping, stiffness = _newton_euler(t)
    damping[0, 1] = -(2 * t.c1 * t.l1 - 2 * t.c2 * t.l2)
    stiffness[0, 1] = -(2 * t.k1 * t.l1 - 2 * t.k2 * t.l2)
    return mass, damping, stiffness, np.array([0.0, 0.0, 0.0, 1.0])


def equation_36(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K and right side (line 1452) of eq. 36."""
    return *_newton_euler(t), np.array([0.0, 0.0, 0.0, 1.0])


def equation_37(t: Club) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K and right side of eq. 37: columns for theta_w' and theta_w (line 1531)."""
    right = np.zeros((4, 2))
    right[0] = t.c_w, t.k_w
    return *_newton_euler(t), right


def equation_39(t: Club, centroid_inertia: float) -> tuple[float, float]:
    """Coefficients of theta_col'' and theta_arm'' in line 1593 (eq. 39).

    ``centroid_inertia`` is the printed I-bar; the first coefficient is what eq. 36 calls I_col.
    """
    return centroid_inertia + t.m_col * t.l_col * t.l_col, t.m_col * t.l_col * t.l_arm


def equation_40(t: Club) -> np.ndarray:
    """Right side of line 1597 (eq. 40): columns for theta_a'', theta_a', theta_a."""
    right = np.zeros((4, 3))
    right[0] = -t.l_arm * t.l_col * t.m_col, t.c_w, t.k_w
    return right


def equation_41(t: Club, l_w: float) -> np.ndarray:
    """Right side of line 1629 (eq. 41): theta_a'', theta_a' + theta_w', theta_a + theta_w.

    ``l_w`` is printed where eq. 40 has l_col, and is defined nowhere.
    """
    right = np.zeros((4, 3))
    right[0] = -t.l_arm * l_w * t.m_col, t.c_w, t.k_w
    return right
