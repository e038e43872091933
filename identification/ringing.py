"""A club's next mode, which a lumped model lacks: it rings on after a release or a blow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ..model.robot import Robot
from .allowance import Allowance
from .noise import Noise, Trust
from .prepare import Prepared, Sensor
from .problem import Key, Model

BAND = (7.0, 22.0)
"""Where the second mode of a clamped shaft with a head lies, in units of its first [-]: a light
shaft's is at the upper end. Slower and faster tones are left to the laws."""

RATIOS = (0.01, 0.02, 0.04, 0.08, 0.15)
"""Damping ratios that are tried [-]; the least keeps a steady hum apart."""

LASTS = 0.5
"""How long of a record is searched for it [s]."""

EVIDENCE = 10.0
"""Fall of BIC below which no mode is taken to be there [-]."""


@dataclass(frozen=True)
class Ringing:
    """A decaying tone, shared by all records.

    Attributes:
        frequency: damped [Hz].
        ratio: of critical damping [-].
        gain: drop of the cost with a free amplitude and phase in each channel [-].
    """

    frequency: float
    ratio: float
    gain: float


def find_ringing(model: Model, residuals: Mapping[Key, np.ndarray]) -> Ringing | None:
    """The second mode in what a fit leaves, if it stands above the noise.

    Args:
        model: with the noise laws that weigh.
        residuals: measured minus simulated, by (record, channel) [SI].

    Returns:
        The tone, or None where there is none, or where the rig is no robot.

    Source: tests/identification/test_allowance.py.
    """
    problem = model.problem
    if not isinstance(problem.mechanism, Robot):
        return None
    heard = [
        _Heard(sensor, residuals[key], model.noises[key])
        for prepared in problem.records
        if _rings(prepared)
        for sensor in prepared.sensors
        for key in [(prepared.name, sensor.channel.name)]
        if sensor.channel.sample_rate > 4 * BAND[0] * clamped_frequency(model)
    ]
    if not heard:
        return None
    first = clamped_frequency(model)
    grid = np.arange(BAND[0] * first, BAND[1] * first, 1.0)
    trials = [(sum(h.gain(f, r) for h in heard), f, r) for f in grid for r in RATIOS]
    gain, frequency, ratio = max(trials)

    def cost(free: np.ndarray) -> float:
        f, r = frequency + free[0], ratio * float(np.exp(free[1]))
        inside = BAND[0] * first <= f <= BAND[1] * first and RATIOS[0] <= r <= RATIOS[-1]
        return -sum(h.gain(f, r) for h in heard) if inside else np.inf

    run = minimize(cost, np.zeros(2), method="Nelder-Mead", options={"maxiter": 60})
    frequency, ratio = frequency + run.x[0], ratio * float(np.exp(run.x[1]))
    gain = -float(run.fun)
    count = sum(len(h.white) for h in heard)
    faded = ratio > 0.9 * RATIOS[-1]  # no tone, but a start that is not fitted yet
    if faded or gain - (2 * len(heard) + 2) * np.log(count) < EVIDENCE:
        return None
    return Ringing(float(frequency), float(ratio), gain)


def ringing_allowances(model: Model, ringing: Ringing) -> dict[str, Allowance]:
    """A free amplitude and phase of the tone in each channel of each record that may ring.

    Args:
        model: what is fitted.
        ringing: as found.

    Returns:
        Allowances by record; priors are a third of each channel's largest value.
    """
    found = {}
    for prepared in model.problem.records:
        if not _rings(prepared):
            continue
        total = 2 * len(prepared.sensors)
        columns, priors = [], []
        for index, sensor in enumerate(prepared.sensors):
            block = np.zeros((len(sensor.values), total))
            block[:, 2 * index : 2 * index + 2] = _tones(
                sensor.times, ringing.frequency, ringing.ratio
            )
            columns.append(block)
            priors += 2 * [float(np.max(np.abs(sensor.values))) / 3.0]
        found[prepared.name] = Allowance(("ringing",) * total, tuple(columns), np.array(priors))
    return found


def _rings(prepared: Prepared) -> bool:
    return prepared.free or prepared.record.test == "impact"


def clamped_frequency(model: Model) -> float:
    """First frequency of the shaft with its head, clamped [Hz], by the rig's own numbers.

    Source: tests/identification/test_ripple_form.py.
    """
    numbers = model.problem.numbers
    return float(np.sqrt(numbers["shaft_stiffness"] / numbers["clubhead_mass"]) / (2 * np.pi))


def _tones(times: np.ndarray, frequency: float, ratio: float) -> np.ndarray:
    """Cosine and sine of the decaying tone, shape (n, 2), of size 1 at first [-]."""
    turn = 2 * np.pi * frequency * (times - times[0])
    fade = np.exp(-ratio / np.sqrt(1 - min(ratio, 0.9) ** 2) * turn)
    return np.stack([fade * np.cos(turn), fade * np.sin(turn)], axis=1)


class _Heard:
    """The opening of one channel's residual, whitened."""

    def __init__(self, sensor: Sensor, residual: np.ndarray, noise: Noise | Trust) -> None:
        count = int(np.sum(sensor.times <= sensor.times[0] + LASTS))
        self.times, self.noise = sensor.times[:count], noise
        self.white = noise.whiten(residual[:count])

    def _fit(self, frequency: float, ratio: float) -> tuple[np.ndarray, np.ndarray]:
        tones = self.noise.whiten(_tones(self.times, frequency, ratio))
        square = tones.T @ tones
        return np.linalg.solve(
            square + 1e-12 * np.trace(square) * np.eye(2), tones.T @ self.white
        ), tones

    def gain(self, frequency: float, ratio: float) -> float:
        best, tones = self._fit(frequency, ratio)
        return float(self.white @ (tones @ best))
