"""A drive's ripple far above all other motion: there a lumped club is off by a share of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..model.robot import Robot
from .allowance import Allowance
from .problem import Key, Model
from .ringing import clamped_frequency

SECOND = 12.0
"""Second mode of a clamped shaft with a head, in units of its first [-], see `ringing.BAND`."""

MOST, NEAR = 0.5, 0.05
"""The most that is allowed at shaft and head, and how much of that at the collet, which is next to
the drive [-]. Set by hand by two sets of an independent finite-element bench: at 0.5 and 0.7 of the
second mode's frequency heads were off by 0.1 and 0.2 of the response, collets by 0.03 and less; a
gauge on the shaft, where the first two modes nearly cancel, by 0.1 and 0.8. Of 0.05, 0.06 and 0.15
the first was kept, for it told the ripples of these sets best: they count as tuned on."""

OUTER = ("shaft", "clubhead")
"""Places beyond the sleeve [-]."""

EVIDENCE = 10.0
"""Fall of BIC below which nothing is taken to be missed [-]."""


def ripple_allowances(
    model: Model, x: np.ndarray, left: Mapping[Key, np.ndarray]
) -> dict[str, Allowance]:
    """Free shares of what a ripple in force does to each channel, in phase and a quarter turn on.

    Motions that a fit was made for lie below a club's second mode. A ripple's tone may come near
    it, and says as much about a lumped club's form as about the drive.

    Args:
        model: what is fitted.
        x: scaled unknowns [-].
        left: measured minus simulated, by (record, channel) [SI].

    Returns:
        Allowances by record; none where no ripple is fitted, where the rig is no robot, or where
        what is left holds no such tone or is not finite.

    Source: tests/identification/test_ripple_form.py.
    """
    entries = model.entries
    sizes = [i for i, e in enumerate(entries) if e.slot == "ripple" and not e.keys[2] and x[i]]
    if not sizes or not isinstance(model.problem.mechanism, Robot):
        return {}
    far = max(
        share_missed(model, float(x[i] * entry.scale))
        for i, entry in enumerate(entries)
        if entry.slot == "ripple" and entry.keys[2] == "frequency"
    )
    still, later = x.copy(), x.copy()
    still[sizes] = 0.0
    for i, entry in enumerate(entries):
        if entry.slot == "ripple" and entry.keys[2] == "phase":
            later[i] += 0.5 * np.pi / entry.scale
    none, now, then = (model.predict(at) for at in (still, x, later))
    found, gain, count = {}, 0.0, 0
    for prepared in model.problem.records:
        keys = [(prepared.name, sensor.channel.name) for sensor in prepared.sensors]
        if not any(np.any(now[key] != none[key]) for key in keys):
            continue
        total = 2 * len(keys)
        columns, priors = [], []
        for index, (key, sensor) in enumerate(zip(keys, prepared.sensors, strict=True)):
            tones = np.stack([now[key] - none[key], then[key] - none[key]], axis=1)
            if not (np.all(np.isfinite(tones)) and np.all(np.isfinite(left[key]))):
                return {}  # it ran away
            gain += _gain(model.noises[key].whiten(tones), model.noises[key].whiten(left[key]))
            count += len(tones)
            block = np.zeros((len(tones), total))
            block[:, 2 * index : 2 * index + 2] = tones
            columns.append(block)
            priors += 2 * [far if sensor.port.place in OUTER else NEAR * far]
        found[prepared.name] = Allowance(("ripple",) * total, tuple(columns), np.array(priors))
    numbers = sum(len(one.priors) for one in found.values())
    return found if gain - numbers * np.log(max(count, 1)) > EVIDENCE else {}


def share_missed(model: Model, frequency: float) -> float:
    """Standard deviation of what a lumped club misses of its response to a tone, as a share [-].

    Args:
        model: of a robot's club.
        frequency: of the tone [Hz].

    Source: a mode that is left out adds about the square of the tone's frequency over its own;
    tests/identification/test_ripple_form.py.
    """
    return min((frequency / (SECOND * clamped_frequency(model))) ** 2, MOST)


def _gain(tones: np.ndarray, white: np.ndarray) -> float:
    """Fall of the cost with free shares of two whitened tones in a whitened residual [-]."""
    best = np.linalg.lstsq(tones, white, rcond=None)[0]
    return float(white @ (tones @ best))
