"""What a spring may carry beside its line: laws with memory, for implicit steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Reply = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Force, its slopes by stretch and by rate, and the memory after the step."""

REST = -1.0
"""The step [s] that stands for 'held for so long that all has come to rest'."""


@dataclass(frozen=True)
class Carry:
    """A law at the stations of a place; `size` is of one spring of each station.

    ==================== =============================================================== ==========
    kind                 force beside the spring's and the dashpot's                      `other`
    ==================== =============================================================== ==========
    linear_stiffness     size d
    linear_damping       size v
    cubic_stiffness      size d^3
    asymmetric_stiffness size |d|
    quadratic_damping    size |v| v
    clearance            -k clip(d, -size, size): within the play the spring carries      k [N/m]
                         nothing
    coulomb_friction     at most size; sticks like a stiff bristle                        bristle
    slip                 a part of the spring, `other`, slides where it carries more      [N/m]
                         than size: that part's loss
    hysteresis           size z, Bouc and Wen with n = 1, beta = gamma: z follows d and   yield [m]
                         saturates at the yield; no path has a rate
    relaxation           size (d - x), x' = (d - x) / time: Zener's branch                time [s]
    stiffness_drift      size (1 - exp(-3 t / T)) d: creeps over the record               T [s]
    ==================== =============================================================== ==========
    """

    kind: str
    place: str
    size: np.ndarray
    other: np.ndarray

    def reply(
        self, stretch: np.ndarray, rate: np.ndarray, memory: np.ndarray, time: float, step: float
    ) -> Reply:
        """The force of one spring of each station at the end of a step; see `Reply`."""
        return REPLIES[self.kind](self, stretch, rate, memory, time, step)


def _linear_stiffness(law: Carry, d, v, memory, time, step) -> Reply:
    return law.size * d, law.size + 0 * d, 0 * d, memory


def _linear_damping(law: Carry, d, v, memory, time, step) -> Reply:
    return law.size * v, 0 * d, law.size + 0 * d, memory


def _cubic(law: Carry, d, v, memory, time, step) -> Reply:
    return law.size * d**3, 3 * law.size * d**2, 0 * d, memory


def _asymmetric(law: Carry, d, v, memory, time, step) -> Reply:
    return law.size * np.abs(d), law.size * np.sign(d), 0 * d, memory


def _quadratic(law: Carry, d, v, memory, time, step) -> Reply:
    return law.size * np.abs(v) * v, 0 * d, 2 * law.size * np.abs(v), memory


def _clearance(law: Carry, d, v, memory, time, step) -> Reply:
    inside = np.abs(d) < law.size
    return -law.other * np.clip(d, -law.size, law.size), -law.other * inside, 0 * d, memory


def _friction(law: Carry, d, v, memory, time, step) -> Reply:
    if step == REST:  # nobody knows which way it was left
        return 0 * d, 0 * d, 0 * d, d
    tried = law.other * (d - memory)
    sticks = np.abs(tried) <= law.size
    force = np.where(sticks, tried, law.size * np.sign(tried))
    root = np.where(sticks, memory, d - force / law.other)
    return force, law.other * sticks, 0 * d, root


def _slip(law: Carry, d, v, memory, time, step) -> Reply:
    held = law.other * (d - memory)
    kept = np.clip(held, -law.size, law.size)
    slides = np.abs(held) > law.size
    root = np.where(slides, d - kept / law.other, memory)
    return kept - law.other * d, -law.other * slides, 0 * d, root


def _hysteresis(law: Carry, d, v, memory, time, step) -> Reply:
    """Exact along any path between two stretches, as there is no rate in it."""
    before, z = memory.reshape(2, -1)
    way = np.where(d >= before, 1.0, -1.0)
    go, at = np.abs(d - before), way * z
    back = np.minimum(go, np.maximum(-at, 0.0))  # unloads along the straight line
    at, go = at + back, go - back
    top = law.other
    loaded = top - (top - at) * np.exp(-go / top)
    after = np.where(go > 0, loaded, at)
    slope = np.where(go > 0, 1 - np.clip(after, 0, None) / top, 1.0)
    memory = np.concatenate([d, way * after])
    return law.size * way * after, law.size * slope, 0 * d, memory


def _relaxation(law: Carry, d, v, memory, time, step) -> Reply:
    if step == REST:
        return 0 * d, 0 * d, 0 * d, np.concatenate([d, d])
    before, x = memory.reshape(2, -1)
    half = step / (2 * law.other)  # trapezoidal rule
    after = (x * (1 - half) + half * (before + d)) / (1 + half)
    slope = law.size / (1 + half)
    return law.size * (d - after), slope, 0 * d, np.concatenate([d, after])


def _drift(law: Carry, d, v, memory, time, step) -> Reply:
    now = law.size * (1 - np.exp(-3 * max(time, 0.0) / law.other))
    return now * d, now, 0 * d, memory


REPLIES: dict[str, Callable[..., Reply]] = {
    "linear_stiffness": _linear_stiffness,
    "linear_damping": _linear_damping,
    "cubic_stiffness": _cubic,
    "asymmetric_stiffness": _asymmetric,
    "quadratic_damping": _quadratic,
    "clearance": _clearance,
    "coulomb_friction": _friction,
    "slip": _slip,
    "hysteresis": _hysteresis,
    "relaxation": _relaxation,
    "stiffness_drift": _drift,
}


def blank(law: Carry) -> np.ndarray:
    """The memory of a law that nothing has moved yet."""
    stations = len(law.size)
    return np.zeros(2 * stations if law.kind in ("hysteresis", "relaxation") else stations)
