"""The thesis's central difference for M a + C v + K x = f, a reference with a critical step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigvalsh, lu_factor, lu_solve

BEYOND = (
    "The step {step:.6g} s is beyond the critical one, {critical:.6g} s: the motion grows without "
    "bound. Take a smaller step."
)
WITHIN = "The step {step:.6g} s is below the critical one, {critical:.6g} s."


@dataclass(frozen=True)
class CentralMotion:
    """A motion by central difference.

    Attributes:
        times: shape (t,) [s].
        positions: shape (t, n) [m or rad].
        velocities: central differences of these, shape (t, n); NaN at the last instant, which
            has no next [m/s or rad/s].
        accelerations: shape (t, n); NaN at the last instant [m/s^2 or rad/s^2].
        step: h [s].
        critical: step from which on the scheme is unstable [s].
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    step: float
    critical: float

    @property
    def is_stable(self) -> bool:
        """Whether the step is below the critical one."""
        return self.step < self.critical

    @property
    def sentence(self) -> str:
        """The verdict on the step, in words."""
        words = WITHIN if self.is_stable else BEYOND
        return words.format(step=self.step, critical=self.critical)


def critical_step(mass: np.ndarray, stiffness: np.ndarray) -> float:
    """Step from which on the central difference is unstable, ``2 / omega_max``.

    Damping that is central at the same instant does not change it.

    Args:
        mass: shape (n, n), symmetric and positive [kg or kg m^2].
        stiffness: shape (n, n), symmetric [N/m or N m/rad].

    Returns:
        The step [s]; infinite where nothing is stiff.

    Raises:
        ValueError: for matrices of unlike shapes, or a mass that is not symmetric and positive.

    Source: Rao 1990 as the thesis uses it, lines 1121-1125; tests/model/test_central_difference.py.
    """
    m, k = _matrices(mass, stiffness)
    fastest = float(eigvalsh(k, m)[-1])
    return 2.0 / np.sqrt(fastest) if fastest > 0 else np.inf


def respond_central(
    mass: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    forces: np.ndarray,
    step: float,
    start: tuple[np.ndarray, np.ndarray] | None = None,
) -> CentralMotion:
    """One motion by the thesis's scheme; slow, of second order, and only below a critical step.

    It is kept to show the error of that scheme; `supple.model.respond` has none.

    Args:
        mass: shape (n, n), symmetric and positive [kg or kg m^2].
        damping: shape (n, n) [N s/m or N m s/rad].
        stiffness: shape (n, n), symmetric [N/m or N m/rad].
        forces: at every instant, shape (t, n), t at least two [N or N m].
        step: h between two instants [s].
        start: positions and velocities, each (n,) [m or rad, and a second]; None for rest.

    Returns:
        The motion; its sentence says where the step is too long.

    Raises:
        ValueError: as `critical_step`, and for forces or a step that do not fit.

    Source: Rao 1990 as in the thesis's lines 1121-1125, started by ``x0 - h v0 + h^2 a0 / 2``;
    line 1123 calls for it where there is no closed form, which a linear system has;
    tests/model/test_central_difference.py.
    """
    m, c, k = _matrices(mass, damping, stiffness)
    pushed = np.asarray(forces, dtype=float)
    if pushed.ndim != 2 or pushed.shape[1] != len(m) or len(pushed) < 2:
        raise ValueError(
            f"forces: expected shape (t, {len(m)}) with t of at least 2, found {pushed.shape}. "
            "Mend: give a row for every instant."
        )
    if not 0 < step < np.inf:
        raise ValueError(
            f"step: expected one above 0 s, found {step:g}. Mend: take one below the critical."
        )
    critical = critical_step(m, k)
    x, v = (np.array(part, dtype=float) for part in start or (np.zeros(len(m)),) * 2)
    positions = np.empty_like(pushed)
    positions[0] = x
    before = x - step * v + 0.5 * step**2 * np.linalg.solve(m, pushed[0] - c @ v - k @ x)
    ahead = lu_factor(m / step**2 + c / (2 * step))
    here, behind = k - 2 * m / step**2, m / step**2 - c / (2 * step)
    first = before
    with np.errstate(over="ignore", invalid="ignore"):  # beyond the critical step it may overflow
        for index in range(len(pushed) - 1):
            right = pushed[index] - here @ positions[index] - behind @ before
            before = positions[index]
            positions[index + 1] = lu_solve(ahead, right, check_finite=False)
        rates, bends = _differences(np.vstack([first, positions]), step)
    times = step * np.arange(len(pushed))
    return CentralMotion(times, positions, rates, bends, float(step), critical)


def _differences(x: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """First and second central differences; the last instant has none."""
    last = np.full((1, x.shape[1]), np.nan)
    rates = (x[2:] - x[:-2]) / (2 * step)
    bends = (x[2:] - 2 * x[1:-1] + x[:-2]) / step**2
    return np.vstack([rates, last]), np.vstack([bends, last])


def _matrices(mass: np.ndarray, *others: np.ndarray) -> list[np.ndarray]:
    """Matrices of one shape, the first symmetric and positive, the last symmetric."""
    found = [np.asarray(matrix, dtype=float) for matrix in (mass, *others)]
    shapes = [matrix.shape for matrix in found]
    if found[0].ndim != 2 or any(shape != (len(found[0]),) * 2 for shape in shapes):
        raise ValueError(
            f"matrices: expected square ones of one size, found {shapes}. "
            "Mend: give all of them over the same coordinates."
        )
    alike = [np.allclose(m, m.T, rtol=1e-9, atol=1e-12 * np.abs(m).max()) for m in found]
    if not (alike[0] and alike[-1] and np.linalg.eigvalsh(found[0]).min() > 0):
        raise ValueError(
            "matrices: expected a symmetric, positive mass and a symmetric stiffness, found "
            "others. Mend: give every coordinate some inertia, and both energies' matrices."
        )
    return found
