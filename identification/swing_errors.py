"""Errors of a swing's gauges: what each makes of the swing plane, and draws of all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .resolve import Carrier, Resolved, relative_acceleration
from .strain import Calibration

DRAWS = 64
"""Draws behind a standard deviation [-]; it is uncertain by 9 % for that."""


@dataclass(frozen=True, eq=False)
class GaugeErrors:
    """What is not known of a swing's gauges, at the points of its profile.

    Attributes:
        points: even, shape (p,) [s].
        grip: rotation of the grip, shape (p,) [rad].
        acceleration: in the swing plane [m/s^2].
        deflection: in the swing plane [m].
        bends: by the toe's and the lead's gauge, shape (2, p) [m].
        calibrations: of both.
        noise: of the acceleration in the plane, white, shape (p,) [m/s^2].
        bend_noise: of the deflection in the plane, shape (p,) [m].
        grip_std: of the grip's angle, one error for the whole swing [rad].
        clock_std: of the gauges' clock against the points' [s].
        strain_clock_std: of the strains' clock against the accelerometers' [s].
    """

    points: np.ndarray
    grip: np.ndarray
    acceleration: Resolved
    deflection: Resolved
    bends: np.ndarray
    calibrations: tuple[Calibration, Calibration]
    noise: np.ndarray
    bend_noise: np.ndarray
    grip_std: float
    clock_std: float
    strain_clock_std: float

    @property
    def calibration_std(self) -> np.ndarray:
        """Of the deflection in the plane by both calibrations, shape (p,) [m]."""
        toe, lead = (
            np.sqrt(np.maximum(one.zero_std**2 + 2 * bend * one.covariance
                               + (bend * one.gain_std) ** 2, 0.0)) / abs(one.gain)
            for one, bend in zip(self.calibrations, self.bends, strict=True)
        )  # fmt: skip
        return np.hypot(toe * np.sin(self.grip), lead * np.cos(self.grip))

    @property
    def acceleration_std(self) -> np.ndarray:
        """Of the acceleration in the plane: noise, grip and clock, shape (p,) [m/s^2]."""
        turned = self.acceleration.out_of_plane * self.grip_std
        late = self._slope(self.acceleration.in_plane) * self.clock_std
        return np.sqrt(self.noise**2 + turned**2 + late**2)

    @property
    def deflection_std(self) -> np.ndarray:
        """Of the deflection in the plane: noise, calibrations, grip and clocks, shape (p,) [m]."""
        turned = self.deflection.out_of_plane * self.grip_std
        late = self._slope(self.deflection.in_plane) * math.hypot(
            self.clock_std, self.strain_clock_std
        )
        return np.sqrt(self.bend_noise**2 + self.calibration_std**2 + turned**2 + late**2)

    def _slope(self, values: np.ndarray) -> np.ndarray:
        """Of what is known; nan elsewhere."""
        known = np.isfinite(values)
        found = np.full(len(values), np.nan)
        if known.sum() > 1:
            found[known] = np.gradient(values[known], self.points[known])
        return found

    def drawn(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """One acceleration and deflection in the plane as they may be, each of shape (p,).

        Args:
            rng: that draws the errors: one of the grip, of each calibration and of each clock for
                the whole swing, noise for each point.

        Returns:
            Acceleration [m/s^2] and deflection [m].
        """
        turn, late = rng.normal(0.0, self.grip_std), rng.normal(0.0, self.clock_std)
        other = late + rng.normal(0.0, self.strain_clock_std)
        felt = self.acceleration.in_plane + turn * self.acceleration.out_of_plane
        felt = felt + late * self._slope(self.acceleration.in_plane)
        felt = felt + self.noise * rng.standard_normal(len(self.points))
        toe, lead = (
            _redrawn(bend, one, rng)
            for one, bend in zip(self.calibrations, self.bends, strict=True)
        )
        bent = self.deflection.in_plane + turn * self.deflection.out_of_plane
        bent = bent + lead * np.cos(self.grip) - toe * np.sin(self.grip)
        bent = bent + other * self._slope(self.deflection.in_plane)
        # smooth below the strains' cut-off: one error for the whole swing would be too kind, white
        # noise at the points too harsh; it is small beside the others
        return felt, bent + self.bend_noise * rng.standard_normal()


def _redrawn(bend: np.ndarray, one: Calibration, rng: np.random.Generator) -> np.ndarray:
    """What another gain and zero, as likely, make of a deflection, less the deflection [m]."""
    spread = [[one.gain_std**2, one.covariance], [one.covariance, one.zero_std**2]]
    gain, zero = rng.multivariate_normal([one.gain, one.zero], spread, method="svd")
    return (bend * one.gain + one.zero - zero) / gain - bend


def relative_std(
    errors: GaugeErrors,
    known: np.ndarray,
    angles: np.ndarray,
    carrier: Carrier,
    cutoff: float,
    seed: int = 0,
) -> np.ndarray:
    """Standard deviation of the head's acceleration less the collet's, by draws of the errors.

    The carrier's own numbers and the profile's angles of arm and wrist are taken for exact.

    Args:
        errors: of the gauges.
        known: which points are looked at, shape (p,) [-].
        angles: of arm and wrist there, shape (k, 2) [rad].
        carrier: as of `relative_acceleration`.
        cutoff: as there [Hz].
        seed: of the draws.

    Returns:
        Shape (k,) [m/s^2].
    """
    rng, found = np.random.default_rng(seed), []
    for _ in range(DRAWS):
        felt, bent = errors.drawn(rng)
        found.append(
            relative_acceleration(
                errors.points[known], felt[known], angles[:, 0], angles[:, 1], carrier,
                bent[known], cutoff,
            ).values
        )  # fmt: skip
    return np.std(found, axis=0, ddof=1)
