"""Made-up swings with an instrumented club: two accelerometers, two strain gauges, and a blow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from .golfer import motion

ARM, REACH = 0.62, 1.035  # hub to wrist, wrist to head [m]
HEAD_MASS, COLLET_INERTIA, COLLET_MOMENT = 0.203, 0.035, 0.25  # kg, kg m^2, kg m
SHAFT = 139.0, 0.0807  # N/m, N s/m
STRAIN = 0.024  # 1/m
SLOPE, SHORT = 1.5, 1.2  # rad of the head for a metre aside; metres shorter for half its square
FORCE, CONTACT = 4000.0, 5e-4  # N, s


@dataclass(frozen=True)
class Instrumented:
    """What the gauges of one swing show [SI], on their own clock, and the truth behind it."""

    times: np.ndarray  # on the motion's clock
    toe: np.ndarray
    lead: np.ndarray
    toe_strain: np.ndarray
    lead_strain: np.ndarray
    arm: np.ndarray
    wrist: np.ndarray
    grip: np.ndarray
    impact: float
    felt: np.ndarray  # in the swing plane, across the club
    deflection: np.ndarray
    relative: np.ndarray  # second derivative of the deflection
    twist: np.ndarray


def swing(
    seed: int = 0,
    rate: float = 5120.0,
    wrist: tuple[float, float] | None = None,
    noise: float = 0.0,
    strain_noise: float = 0.0,
    slope: float = 0.0,
    slow: float = 1.0,
    impact: float = 1.4873,
    blow: bool = True,
    end: float = 2.0,
    jolt: float = 0.0,
) -> Instrumented:
    """A golfer's arm and wrist drive a bending club in the plane, written in absolute coordinates.

    Args:
        wrist: stiffness and damping [N m/rad, N m s/rad]; a rigid one where None.
        noise: of each accelerometer [m/s^2].
        strain_noise: of each gauge [1].
        slope: by which the head turns with its deflection [rad/m].
        slow: how much slower than the golfer's swing [-].
        jolt: speed that an abrupt start of the motors gives the head [m/s].
    """
    rng = np.random.default_rng(seed)
    grid = np.arange(0.0, end + 0.2, 1 / 2000.0)
    angles = make_interp_spline(slow * grid, motion(grid, impact), k=7)
    first, second = angles.derivative(1), angles.derivative(2)
    hit, last = slow * impact, slow * end
    k, c = SHAFT

    def now(t: float) -> tuple[np.ndarray, ...]:
        return angles(t), first(t), second(t)

    def head(t: float, state: np.ndarray) -> tuple[float, float, float, float]:
        """Accelerations: of the head across and along the club, of the twist, of the deflection.

        The head sits at (REACH - SHORT y^2 / 2) along the club and y across it.
        """
        y, dy, p, dp = state
        (a, da, dda), follow = (one[0] for one in now(t)), [one[:2].sum() for one in now(t)]
        club, spin = follow[0] + p, follow[1] + dp
        along, across = (
            np.array([np.sin(club), -np.cos(club)]),
            np.array([np.cos(club), np.sin(club)]),
        )
        pivot = ARM * (
            dda * np.array([np.cos(a), np.sin(a)]) - da**2 * np.array([np.sin(a), -np.cos(a)])
        )
        u, du = REACH - SHORT * y**2 / 2, -SHORT * y * dy
        push = (
            -FORCE * np.sin(np.pi * (t - hit) / CONTACT)
            if blow and hit < t < hit + CONTACT
            else 0.0
        )
        # accelerations without those that are sought: y'' and that of the club's angle
        rest_across = pivot @ across + 2 * du * spin - y * spin**2
        rest_along = pivot @ along - SHORT * dy**2 - u * spin**2 - 2 * dy * spin
        own = (-k * y - c * dy + push) / HEAD_MASS - rest_across + SHORT * y * rest_along
        left, right = 1 + (SHORT * y) ** 2, u + SHORT * y**2
        if wrist is None:
            turn = follow[2]
            bend = (own - right * turn) / left
        else:
            moment = -wrist[0] * p - wrist[1] * dp + u * push - COLLET_MOMENT * (pivot @ across)
            moment += HEAD_MASS * (y * rest_along - u * rest_across)
            rows = [[left, right], [HEAD_MASS * right, HEAD_MASS * (u**2 + y**2) + COLLET_INERTIA]]
            bend, turn = np.linalg.solve(rows, [own, moment])
        felt = rest_across + u * turn + bend
        inward = rest_along - SHORT * y * bend - y * turn
        return felt, inward, turn - follow[2], bend

    def rates(t: float, state: np.ndarray) -> list[float]:
        _, _, twist, bend = head(t, state)
        return [state[1], bend, state[3] if wrist else 0.0, twist if wrist else 0.0]

    times = np.arange(int(last * rate)) / rate
    pieces, states = [(0.0, hit), (hit, hit + CONTACT), (hit + CONTACT, last)], np.zeros((0, 4))
    start = np.array([0.0, jolt, 0.0, 0.0])
    for low, high in pieces:
        inside = times[(times >= low) & (times < high)]
        run = solve_ivp(
            rates, (low, high), start, method="LSODA", t_eval=np.append(inside, high),
            rtol=1e-8, atol=1e-10, max_step=5e-3,
        )  # fmt: skip
        states = np.vstack([states, run.y[:, :-1].T])
        start = run.y[:, -1]
    seen = np.array([head(t, s) for t, s in zip(times, states)])
    drive = angles(times)
    y = states[:, 0]
    lean = slope * y
    felt = np.cos(lean) * seen[:, 0] - np.sin(lean) * seen[:, 1]
    grip = drive[:, 2] - angles(hit)[2]
    across = 3.0 * np.sin(2 * np.pi * 0.7 * times / slow)  # out of the plane, small [m/s^2]
    bent_across = 0.004 * np.sin(2 * np.pi * 0.6 * times / slow)
    return Instrumented(
        times,
        felt * np.sin(grip) + across * np.cos(grip) + noise * rng.standard_normal(len(times)),
        felt * np.cos(grip) - across * np.sin(grip) + noise * rng.standard_normal(len(times)),
        -STRAIN * (y * np.sin(grip) + bent_across * np.cos(grip))
        + strain_noise * rng.standard_normal(len(times)),
        STRAIN * (y * np.cos(grip) - bent_across * np.sin(grip))
        + strain_noise * rng.standard_normal(len(times)),
        drive[:, 0], drive[:, 1], grip, hit, felt, y, seen[:, 3], states[:, 2],
    )  # fmt: skip
