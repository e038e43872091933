"""A golfer's club as a chain of hinged links in absolute angles, swung by an arm at a ball."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.optimize import brentq

GRAVITY = 9.80665
HAND, GRIP_END, LENGTH = 0.055, 0.250, 1.09  # from the butt: hands, end of the grip, head [m]
OFFSET = 0.022  # from the tip of the shaft to the head's centre of mass [m]
BENDING = 62.0, 21.0  # EI at the butt and at the tip, before it is scaled [N m^2]
LINE_MASS = 0.058, 0.042  # of the shaft, butt and tip [kg/m]
GRIP_MASS = 0.10  # rubber and its part of the shaft [kg]
HEAD_INERTIA = 3.2e-4  # [kg m^2]
HANDS = 0.026, 0.16  # inertia about the wrist [kg m^2], mass times distance from it [kg m]
TIP_STIFFNESS, CLAMPED_HERTZ, RATIO = 139.0, 4.167, 0.0076
BALL, BALL_RADIUS = 0.0459, 0.021  # kg, m
CONTACT = 1.9e6, 33.0  # spring [N/m] and dashpot [N s/m] between face and ball

Curve = Callable[[float], tuple[float, float, float]]
"""An angle or a place with its first two rates."""


@dataclass(frozen=True)
class Club:
    """Links from the hands to the head's centre; joints' masses sit at the links' far ends."""

    length: np.ndarray  # [m]
    mass: np.ndarray  # at the far end of each link [kg]
    inertia: np.ndarray  # of each link's own turn [kg m^2]
    moment: float  # mass times distance of what turns with the first link beside its end [kg m]
    hinge: np.ndarray  # stiffness between a link and the next [N m/rad]
    loss: float  # damping over stiffness [s]

    @property
    def shared(self) -> np.ndarray:
        """Inertia matrix of a straight chain about its pivot, without the links' own inertia."""
        beyond = np.cumsum(self.mass[::-1])[::-1]
        return np.minimum.outer(beyond, beyond) * np.outer(self.length, self.length)

    def clamped(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stiffness, mass and the head's row, small angles, the first link held."""
        step = np.eye(len(self.length)) - np.eye(len(self.length), k=-1)
        stiffness = step[1:].T @ np.diag(self.hinge) @ step[1:]
        mass = self.shared + np.diag(self.inertia)
        return stiffness[1:, 1:], mass[1:, 1:], self.length[1:]

    def tones(self) -> np.ndarray:
        """Frequencies with the grip clamped [Hz], rising."""
        stiffness, mass, _ = self.clamped()
        return np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)

    @property
    def first_bend(self) -> float:
        """Angle of the hinge below the grip for a metre by which the head is pulled aside."""
        stiffness, _, row = self.clamped()
        shape = np.linalg.solve(stiffness, row)
        return float(shape[0] / (row @ shape))


def make_club(links: int = 8, tip: float = TIP_STIFFNESS, hertz: float = CLAMPED_HERTZ) -> Club:
    """A tapered shaft of so many links; scaled to a stiffness at the head and a frequency."""
    span = LENGTH - OFFSET - GRIP_END
    h = span / links
    middles = GRIP_END + h * (np.arange(links) + 0.5)
    joints = GRIP_END + h * np.arange(links)
    whole = LENGTH - OFFSET

    def between(ends: tuple[float, float], place: np.ndarray) -> np.ndarray:
        return ends[0] + (ends[1] - ends[0]) * place / whole

    own = between(LINE_MASS, middles) * h
    mass = np.append(own, 0.0) / 2 + np.append(0.0, own) / 2
    length = np.append(GRIP_END - HAND, np.full(links, h))
    length[-1] += OFFSET
    hinge = between(BENDING, joints) / h
    hinge[0] *= 2  # it stands for the half link beside the clamp
    middle = GRIP_END / 2 - HAND
    inertia = np.zeros(links + 1)
    inertia[0] = HANDS[0] + GRIP_MASS * (GRIP_END**2 / 12 + middle**2)
    inertia[-1] = HEAD_INERTIA
    moment = HANDS[1] + GRIP_MASS * middle
    club = Club(length, mass, inertia, moment, hinge, 0.0)
    stiffness, _, row = club.clamped()
    hinge = hinge * tip * float(row @ np.linalg.solve(stiffness, row))

    def with_head(kilograms: float) -> Club:
        heavy = mass + kilograms * np.eye(links + 1)[-1]
        return Club(length, heavy, inertia, moment, hinge, RATIO / (np.pi * hertz))

    return with_head(float(brentq(lambda m: with_head(m).tones()[0] - hertz, 0.05, 0.4)))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Hold:
    """Who swings the club, in the plane of the swing: level toward the target, and up the slope."""

    arm: Curve
    wrist: Curve  # what the hands want of the club, against the arm
    length: float = 0.62  # hub to hands [m]
    hands: tuple[float, float] = (600.0, 14.0)  # stiffness [N m/rad] and damping [N m s/rad]
    pull: float = 0.0  # weight down the slope [m/s^2]
    sway: tuple[float, float] = (0.0, 3.0)  # of the hub along the level [m, rad/s]


@dataclass(frozen=True)
class Swung:
    """A swing at its samples [SI]; the links' absolute angles are 0 down the slope."""

    times: np.ndarray
    angle: np.ndarray
    rate: np.ndarray
    turn: np.ndarray  # second rates
    hub: np.ndarray
    hand: np.ndarray
    head: np.ndarray
    head_acceleration: np.ndarray
    hand_motion: np.ndarray  # its velocity and acceleration, shape (n, 4)
    torque: np.ndarray  # of the hands
    force: np.ndarray  # of the ball on the head, level
    impact: float
    ball: np.ndarray  # its centre before the blow
    ball_speed: float


def arrows(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Along a link and across it, in the direction of growing angles, last axis level and up."""
    s, c = np.sin(angle), np.cos(angle)
    return np.stack([s, -c], axis=-1), np.stack([c, s], axis=-1)


@dataclass(frozen=True)
class _Swing:
    club: Club
    hold: Hold

    def hands(self, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place, velocity and acceleration of the hands."""
        a, da, dda = self.hold.arm(time)
        along, across = arrows(np.array(a))
        far, beat = self.hold.sway
        level, r = np.array([1.0, 0.0]), self.hold.length
        hub = far * np.sin(beat * time) * level
        speed = far * beat * np.cos(beat * time) * level
        gain = -far * beat**2 * np.sin(beat * time) * level
        return (
            hub + r * along,
            speed + r * da * across,
            gain + r * (dda * across - da**2 * along),
        )

    def torque(self, time: float, angle: float, rate: float) -> float:
        """What the hands turn the grip with."""
        (a, da, _), (w, dw, _) = self.hold.arm(time), self.hold.wrist(time)
        k, c = self.hold.hands
        return -k * (angle - a - w) - c * (rate - da - dw)

    def turns(self, time: float, state: np.ndarray, push: float = 0.0) -> np.ndarray:
        """Second rates of the links' angles under a level force on the head."""
        club = self.club
        angle, rate = np.split(state, 2)
        s, c = np.sin(angle), np.cos(angle)
        apart_c = np.outer(c, c) + np.outer(s, s)
        apart_s = np.outer(s, c) - np.outer(c, s)
        shared = club.shared
        matrix = shared * apart_c
        matrix[np.diag_indices(len(angle))] += club.inertia
        load = -(shared * apart_s) @ rate**2
        first = np.cumsum(club.mass[::-1])[::-1] * club.length
        first[0] += club.moment
        base = self.hands(time)[2] + [0.0, self.hold.pull]
        load -= first * (c * base[0] + s * base[1])
        load += push * club.length * c
        bend = club.hinge * (np.diff(angle) + club.loss * np.diff(rate))
        load[:-1] += bend
        load[1:] -= bend
        load[0] += self.torque(time, angle[0], rate[0])
        return np.linalg.solve(matrix, load)

    def energy(self, time: float, state: np.ndarray) -> float:
        """Kinetic, elastic and potential energy of the club in the room."""
        club, (hand, speed, _) = self.club, self.hands(time)
        angle, rate = np.split(state, 2)
        along, across = arrows(angle)
        places = hand + np.cumsum(club.length[:, None] * along, axis=0)
        moving = speed + np.cumsum((club.length * rate)[:, None] * across, axis=0)
        # what turns with the first link beside its end: inertia, first moment, and no mass of its
        # own, for the hands' own motion is prescribed
        own = 0.5 * float(club.inertia @ rate**2) + club.moment * rate[0] * float(speed @ across[0])
        lift = float(club.mass @ places[:, 1]) + club.moment * float(along[0, 1])
        bent = 0.5 * float(club.hinge @ np.diff(angle) ** 2)
        return (
            own + 0.5 * float(club.mass @ np.sum(moving**2, axis=1)) + bent + self.hold.pull * lift
        )

    def head(self, time: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Place and velocity of the head's centre."""
        angle, rate = np.split(state, 2)
        along, across = arrows(angle)
        hand, speed, _ = self.hands(time)
        return hand + self.club.length @ along, speed + (self.club.length * rate) @ across


def start_of(club: Club, hold: Hold) -> np.ndarray:
    """All links in line, turning as the hands want it at time 0."""
    (a, da, _), (w, dw, _) = hold.arm(0.0), hold.wrist(0.0)
    return np.concatenate([np.full(len(club.length), a + w), np.full(len(club.length), da + dw)])


def swing(
    club: Club,
    hold: Hold,
    impact: float | None,
    end: float,
    rate: float = 5120.0,
    start: np.ndarray | None = None,
    exact: float = 1e-8,
) -> Swung:
    """Swings the club; at `impact` the face reaches a ball that lies where the head is then.

    Forces are summed link by link in the room's axes, and LSODA integrates; there is nothing here
    of small angles or of a frame that turns. None for `impact` leaves the ball out.
    """
    one = _Swing(club, hold)
    times = np.arange(int(end * rate)) / rate
    state = start_of(club, hold) if start is None else start
    size, none = len(state), np.zeros(2)

    def run(rates, state, low: float, high: float, step: float) -> tuple[np.ndarray, np.ndarray]:
        inside = times[(times >= low) & (times < high)]
        found = solve_ivp(
            rates, (low, high), state, "LSODA", np.append(inside, high),
            rtol=exact, atol=exact / 10, max_step=step,
        )  # fmt: skip
        assert found.success, found.message
        return found.y[:, :-1].T, found.y[:, -1]

    def free(time: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([state[size // 2 :], one.turns(time, state)])

    hit = end if impact is None else impact
    first, state = run(free, state, 0.0, hit, 5e-3)
    states, pushes, ball, leaves = [first], [np.zeros(len(first))], none, 0.0
    if impact is not None:
        place, _ = one.head(hit, state)
        ball = place + BALL_RADIUS * np.array([1.0, 0.0])

        def push(time: float, both: np.ndarray) -> float:
            place, speed = one.head(time, both[:size])
            deep, quick = place[0] - ball[0] + BALL_RADIUS - both[size], speed[0] - both[size + 1]
            return -max(0.0, CONTACT[0] * deep + CONTACT[1] * quick) if deep > 0.0 else 0.0

        def struck(time: float, both: np.ndarray) -> np.ndarray:
            force = push(time, both)
            turns = one.turns(time, both[:size], force)
            return np.concatenate([both[size // 2 : size], turns, [both[size + 1], -force / BALL]])

        begun = np.concatenate([state, [0.0, 0.0]])
        blow, state = run(struck, begun, hit, hit + 2e-3, 1e-5)
        leaves = float(state[size + 1])
        inside = times[(times >= hit) & (times < hit + 2e-3)]
        pushes += [np.array([push(t, each) for t, each in zip(inside, blow)])]
        last, _ = run(free, state[:size], hit + 2e-3, end, 5e-3)
        states += [blow[:, :size], last]
        pushes += [np.zeros(len(last))]
    whole, force = np.vstack(states), np.concatenate(pushes)
    return _seen(one, times[: len(whole)], whole, force, hit, ball, leaves)


def _seen(one: _Swing, times, states, force, impact: float, ball, leaves: float) -> Swung:
    size = states.shape[1] // 2
    angle, rate = states[:, :size], states[:, size:]
    turn = np.array([one.turns(t, s, f) for t, s, f in zip(times, states, force)])
    hands = [np.array(part) for part in zip(*(one.hands(t) for t in times))]
    along, across = arrows(angle)
    reach = one.club.length[:, None]
    head = hands[0] + np.sum(reach * along, axis=1)
    gain = hands[2] + np.sum(
        reach * (turn[..., None] * across - rate[..., None] ** 2 * along), axis=1
    )
    torque = np.array([one.torque(t, a, r) for t, a, r in zip(times, angle[:, 0], rate[:, 0])])
    far, beat = one.hold.sway
    hub = np.outer(far * np.sin(beat * times), [1.0, 0.0])
    moved = np.hstack(hands[1:])
    return Swung(
        times,
        angle,
        rate,
        turn,
        hub,
        hands[0],
        head,
        gain,
        moved,
        torque,
        force,
        impact,
        ball,
        leaves,
    )


def power(club: Club, hold: Hold, swung: Swung) -> np.ndarray:
    """What hands, arm and ball put in, less what the shaft loses [W], at the samples.

    The arm's force on the hands is the rate of the club's momentum less its weight and the ball's
    push: nothing of the equations of motion for the angles is used.
    """
    along, across = arrows(swung.angle)
    reach = club.length[None, :, None]
    bases = swung.hand_motion[:, None, 2:]
    gains = bases + np.cumsum(
        reach * (swung.turn[..., None] * across - swung.rate[..., None] ** 2 * along), axis=1
    )
    weight = np.array([0.0, hold.pull])
    first = swung.turn[:, :1] * across[:, 0] - swung.rate[:, :1] ** 2 * along[:, 0]
    ball = np.outer(swung.force, [1.0, 0.0])
    needed = np.einsum("k,tkx->tx", club.mass, gains + weight) + club.moment * first - ball
    arm = np.sum(needed * swung.hand_motion[:, :2], axis=1)
    speed = swung.hand_motion[:, :2] + np.einsum(
        "k,tkx->tx", club.length, swung.rate[..., None] * across
    )
    lost = club.loss * np.sum(club.hinge * np.diff(swung.rate, axis=1) ** 2, axis=1)
    return arm + swung.torque * swung.rate[:, 0] + np.sum(ball * speed, axis=1) - lost


def energies(club: Club, hold: Hold, swung: Swung) -> np.ndarray:
    """Energy of the club at the samples [J]."""
    one = _Swing(club, hold)
    states = np.hstack([swung.angle, swung.rate])
    return np.array([one.energy(t, s) for t, s in zip(swung.times, states)])
