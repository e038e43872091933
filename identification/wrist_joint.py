"""Stiffness and damping of a passive wrist, out of the arm's motion and the club's angle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

from ..model.planar import GRAVITY
from ..model.robot import PRESETS
from .noise import Misfit, Noise, choose_noise
from .wrist_swing import Arm, Club, swing

STIFFNESSES = (30.0, 100.0, 300.0, 900.0, 2700.0)
DAMPINGS = (1.0, 5.0, 25.0)
"""Stiffnesses [N m/rad] and dampings [N m s/rad] that a fit starts from, the likeliest of all."""

START_PRIOR = (0.03, 0.3)
"""Standard deviations of the shaft's bend at the first sample [m] and of its rate [m/s]."""

KNOT_PRIOR = 1.0
"""Standard deviation of the change of the logarithm of the stiffness from knot to knot [-]."""

KNOTS = (0.2, 0.14, 0.1, 0.07, 0.05, 0.035, 0.025, 0.018)
"""Distances of the knots of the arm's curve that are tried [s]."""

WORTH = 10.0
"""Fall of BIC that a stiffness which varies must bring [-]."""

CONVERGED = "The wrist has converged."
STOPPED = "The wrist has not converged: give a longer swing, or one that moves the club more."
UNTOLD = "This swing does not tell the wrist: its stiffness is not known within a half of itself."


@dataclass(frozen=True, eq=False)
class WristJoint:
    """A passive wrist, with error bars.

    Attributes:
        stiffness: mean over the swing [N m/rad].
        stiffness_std: its standard error [N m/rad].
        damping: [N m s/rad].
        damping_std: its standard error [N m s/rad].
        rest: angle between club and arm at which the wrist pulls neither way [rad].
        rest_std: its standard error [rad].
        knots: instants at which a stiffness that varies is told, shape (k,) [s]; empty otherwise.
        knot_stiffness: stiffness there, straight lines between, shape (k,) [N m/rad].
        knot_std: standard errors, shape (k,) [N m/rad].
        predicted: the club's angle, shape (t,) [rad].
        noise: law of what is left [rad].
        misfit: absolute misfit of the club's angle.
        bic: Bayesian information criterion [-]; of two fits the lower one holds.
        status: one sentence.
    """

    stiffness: float
    stiffness_std: float
    damping: float
    damping_std: float
    rest: float
    rest_std: float
    knots: np.ndarray
    knot_stiffness: np.ndarray
    knot_std: np.ndarray
    predicted: np.ndarray
    noise: Noise
    misfit: Misfit
    bic: float
    status: str

    @property
    def converged(self) -> bool:
        """Whether the numbers may be trusted."""
        return self.status == CONVERGED


def fit_wrist(
    times: np.ndarray,
    arm_angle: np.ndarray,
    club_angle: np.ndarray,
    numbers: Mapping[str, float] | None = None,
    inclination: float = 0.0,
    knots: int = 0,
) -> WristJoint:
    """Find the passive wrist that makes the club follow the arm as it did.

    The arm's motion is prescribed, large angles and centrifugal terms included; the shaft bends.
    Start state and rest angle are unknown. Angles count from where the club points straight down
    the swing plane, both the same way round.

    Args:
        times: even, shape (t,) [s].
        arm_angle: as measured, shape (t,) [rad].
        club_angle: of the grip, absolute, shape (t,) [rad].
        numbers: of club, collet and arm by the robot's names [SI]; preset robo_v where None.
        inclination: of the swing plane against the horizontal, for its weight [rad].
        knots: how many instants tell a stiffness that varies, at least 3; 0 for a constant one.

    Returns:
        The wrist; `status` says whether to trust it.

    Raises:
        ValueError: for series of different length, uneven times, or too few samples.

    Source: thesis section 7.5, whose fits are (500, 5) and (350, 3), lines 1552-1620;
    tests/identification/test_wrist_joint.py.
    """
    _check(times, arm_angle, club_angle, knots)
    club = Club.of(PRESETS["robo_v"] | dict(numbers or {}))
    arm = _arm(times, arm_angle, club.arm, GRAVITY * np.sin(inclination))
    task = _Task(times, np.asarray(club_angle, float), arm, club, knots)
    x = _started(task)
    task = replace(task, std=float(np.std(task.values - task.simulated(x[:, None])[:, 0])))
    run = _run(task, x)
    for _ in range(2):
        task = task.doubted(run.x)
        off = np.zeros(arm.doubt.shape[1])
        x = np.concatenate([run.x, off]) if len(run.x) == task.own else run.x
        predicted = task.predicted(x)
        task = replace(task, noise=choose_noise(task.values - predicted, predicted)[0])
        run = _run(task, x)
    predicted = task.predicted(run.x)
    noise, misfit = choose_noise(task.values - predicted, predicted)
    task = replace(task, noise=noise)
    return _told(task, run, misfit)


def likelier_wrist(constant: WristJoint, varying: WristJoint) -> WristJoint:
    """Of two fits the one that varies only where the swing asks for it beyond doubt."""
    return varying if constant.bic - varying.bic > WORTH else constant


def _check(times: np.ndarray, arm: np.ndarray, club: np.ndarray, knots: int) -> None:
    if not len(times) == len(arm) == len(club) >= 50:
        found = f"{len(times)} times, {len(arm)} arm and {len(club)} club angles"
        raise ValueError(
            f"wrist: expected at least 50 times with an angle of arm and club each, found {found}. "
            "Mend: give all three for the same instants."
        )
    steps = np.diff(times)
    if np.ptp(steps) > 1e-3 * np.mean(steps):
        raise ValueError(
            f"times: expected even steps, found {steps.min():g} to {steps.max():g} s. "
            "Mend: resample the swing to an even clock."
        )
    if knots and not 3 <= knots <= len(times) // 20:
        raise ValueError(
            f"knots: expected 0, or 3 to {len(times) // 20} for this swing, found {knots}. "
            "Mend: ask for fewer, or for 0."
        )


def _arm(times: np.ndarray, angle: np.ndarray, length: float, pull: float) -> Arm:
    """The arm between samples: a spline one step finer than what its noise bears out, by BIC.

    What BIC takes for smooth has errors that no knot of it can mend; of finer knots the errors
    are noise, and the club's own angle helps to tell them. Least squares, not a penalty, which
    would take from the arm's acceleration.
    """
    count, least, chosen = len(times), np.inf, 0
    splines = []
    for spacing in KNOTS:
        pieces = min(max(1, round(float(np.ptp(times)) / spacing)), count // 6)
        inner = np.linspace(times[0], times[-1], pieces + 1)
        knots = np.concatenate([[times[0]] * 5, inner, [times[-1]] * 5])
        design = BSpline.design_matrix(times, knots, 5).toarray()
        sizes = np.linalg.lstsq(design, angle, rcond=None)[0]
        left = angle - design @ sizes
        bic = count * np.log(float(np.mean(left**2)) + 1e-24) + (pieces + 5) * np.log(count)
        if bic < least:
            least, chosen = bic, len(splines)
        splines.append((knots, design, sizes, left))
    knots, design, sizes, left = splines[min(chosen + 1, len(splines) - 1)]
    std = float(np.sqrt(np.sum(left**2) / (count - len(sizes))))
    root = np.linalg.qr(design)[1]
    return Arm(BSpline(knots, sizes, 5), length, pull, np.linalg.inv(root) * std)


@dataclass(frozen=True, eq=False)
class _Task:
    """What is measured, and unknowns x: log stiffnesses, log damping, rest, start state.

    Then how far the arm is off, once `moved` says what that does to the club's angle: from where
    it is off by `shift`, which `arm` has in it.
    """

    times: np.ndarray
    values: np.ndarray
    arm: Arm
    club: Club
    knots: int
    std: float = 1.0
    noise: Noise | None = None
    moved: np.ndarray | None = None
    shift: np.ndarray | float = 0.0

    @property
    def own(self) -> int:
        """Unknowns of the wrist."""
        return self.springs + 6

    @property
    def springs(self) -> int:
        return self.knots or 1

    @property
    def instants(self) -> np.ndarray:
        return np.linspace(self.times[0], self.times[-1], self.springs)

    def simulated(self, x: np.ndarray) -> np.ndarray:
        """The club's angle for each column of x, shape (t, columns) [rad]."""
        n = self.springs
        stiffness = np.exp(np.clip(x[:n], -5.0, 12.0))
        damping, rest = np.exp(np.clip(x[n], -12.0, 8.0)), x[n + 1]
        wrist = stiffness, damping, rest, x[n + 2 : self.own]
        return swing(self.club, self.arm, self.times, self.instants, *wrist)

    def predicted(self, x: np.ndarray) -> np.ndarray:
        """The club's angle, with the arm off as x says to first order, shape (t,) [rad]."""
        angle = self.simulated(x[:, None])[:, 0]
        return angle if self.moved is None else angle + self.moved @ (x[self.own :] - self.shift)

    def doubted(self, x: np.ndarray) -> _Task:
        """The task that knows what the arm's own errors do to the club's angle.

        About the arm as x has it: about the measured one slopes would be those of its noise, too
        small of a damping as of anything that is regressed on what is not exact.
        """
        curves = self.arm.doubt.shape[1]
        shift = x[self.own :] if len(x) > self.own else np.zeros(curves)
        arm = self.arm.shifted(shift - self.shift)
        n, off = self.springs, np.hstack([np.eye(curves), -np.eye(curves)]) * 1e-2
        same = np.repeat(x[: self.own, None], 2 * curves, axis=1)
        wrist = np.exp(same[:n]), np.exp(same[n]), same[n + 1], same[n + 2 :]
        both = swing(self.club, arm, self.times, self.instants, *wrist, off)
        moved = (both[:, :curves] - both[:, curves:]) / 2e-2
        return replace(self, arm=arm, shift=shift, moved=moved)

    def whitened(self, gap: np.ndarray) -> np.ndarray:
        return gap / self.std if self.noise is None else self.noise.whiten(gap)

    def residual(self, x: np.ndarray) -> np.ndarray:
        gap = self.values - self.predicted(x)
        return np.concatenate([self.whitened(np.clip(gap, -1e3, 1e3)), self._pulls(x)])

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Central differences, all columns in one simulation."""
        own, n = x[: self.own], self.springs
        steps = np.diag(np.maximum(np.abs(own), 0.1) * 1e-5)
        both = self.simulated(np.hstack([own[:, None] + steps, own[:, None] - steps]))
        moved = (both[:, : len(own)] - both[:, len(own) :]) / (2 * np.diag(steps))
        if self.moved is not None:
            moved = np.hstack([moved, self.moved])
        pulls = np.zeros((len(self._pulls(x)), len(x)))
        pulls[[0, 1], [self.own - 2, self.own - 1]] = 1.0 / np.array(START_PRIOR)
        pulls[2 : n + 1, :n] = np.diff(np.eye(n), axis=0) / KNOT_PRIOR
        pulls[n + 1 :, self.own :] = np.eye(len(x) - self.own)
        return np.concatenate([-self.whitened(np.nan_to_num(moved)), pulls])

    def _pulls(self, x: np.ndarray) -> np.ndarray:
        bend, stiffness = x[self.own - 2 : self.own], x[: self.springs]
        return np.concatenate([bend / START_PRIOR, np.diff(stiffness) / KNOT_PRIOR, x[self.own :]])


def _started(task: _Task) -> np.ndarray:
    """The likeliest of several wrists, its rest such that the club starts where it was."""
    pairs = [(np.log(k), np.log(c)) for k in STIFFNESSES for c in DAMPINGS]
    early = min(len(task.times), max(8, len(task.times) // 40))
    slope, first = np.polyfit(task.times[:early] - task.times[0], task.values[:early], 1)
    rest = first - float(task.arm.at(task.times[:1])[0, 0])
    n = task.springs
    x = np.array([[k] * n + [c, rest, first, slope, 0.0, 0.0] for k, c in pairs]).T
    gap = task.values[:, None] - task.simulated(x)
    gap = np.where(np.isfinite(gap), gap, 1e3)
    return x[:, int(np.argmin(np.mean(np.clip(gap, -1e3, 1e3) ** 2, axis=0)))]


def _run(task: _Task, x: np.ndarray) -> Any:
    return least_squares(
        task.residual, x, cast(Any, task.jacobian), x_scale="jac", max_nfev=40, ftol=1e-9
    )


def _told(task: _Task, run: Any, misfit: Misfit) -> WristJoint:
    x, n = run.x, task.springs
    assert task.noise is not None
    predicted = task.predicted(x)
    jacobian = task.jacobian(x)
    covariance = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    if misfit.p_value < 1e-3:
        covariance = covariance * max(misfit.ratio, 1.0)
    std = np.sqrt(np.diag(covariance))
    stiffness, damping = np.exp(x[:n]), float(np.exp(x[n]))
    weight = np.trapezoid(
        [np.interp(task.times, task.instants, row) for row in np.eye(n)], task.times, axis=1
    )
    weight = weight / weight.sum()
    slope = weight * stiffness
    mean = float(weight @ stiffness)
    mean_std = float(np.sqrt(slope @ covariance[:n, :n] @ slope))
    white = task.noise.whiten(task.values - predicted)
    count = len(white)
    spread = task.noise.std**2 * float(np.mean(white**2))
    bic = float(count * np.log(max(spread, 1e-300)) + task.own * np.log(count))
    bic += float(np.sum(x[task.own :] ** 2))
    status = CONVERGED if run.status > 0 else STOPPED
    if status == CONVERGED and mean_std > 0.5 * mean:
        status = UNTOLD
    varies = task.knots > 0
    none = np.empty(0)
    return WristJoint(
        mean, mean_std, damping, float(damping * std[n]), float(x[n + 1]), float(std[n + 1]),
        task.instants if varies else none, stiffness if varies else none,
        stiffness * std[:n] if varies else none, predicted, task.noise, misfit, bic, status,
    )  # fmt: skip
