"""Errors of a told motion: a robot's slow and coarse feedback is not believed, but estimated."""

from __future__ import annotations

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from scipy.interpolate import BSpline, CubicSpline

from ..model.chain import DERIVATIVES
from ..model.respond import simulate
from .allowance import Allowance, Followed, used
from .beside import each
from .linear_laws import is_linear
from .prepare import Prepared
from .problem import Model, sample
from .records import Channel

MOST_ERRORS = 600
"""Errors of a told motion that are estimated of one record [-]: each sample's where it has no more,
else those at as many knots of a smooth curve."""

ORDER = 5
"""Differences of this order leave the noise of a smooth motion [-]."""


def drive_allowances(model: Model, x: np.ndarray) -> dict[str, list[Allowance]]:
    """Errors of every told motion, by record: those of its samples, and its clock.

    A sample's error moves the curve through the samples, and the mechanism follows, with those of
    its laws that are linear; half the sampling rate and a little more is in it.

    Args:
        model: with its constants.
        x: scaled unknowns [-].

    Returns:
        Allowances of the records that are driven by a motion.

    Source: errors in variables, Fuller 1987, chapter 1; tests/identification/test_allowance.py.
    """

    def of(prepared: Prepared) -> list[Allowance]:
        parts, z = [], _of_small(model, prepared, x)
        for index, channel in _told(prepared):
            parts.append(_errors(model, prepared, z, index, channel))
            parts += _clock(model, prepared, z, index, channel)
        return parts

    told = [prepared for prepared in model.problem.records if _told(prepared)]
    found = each(of, told, lambda p: ("drive errors", *model.code(p)))
    return {prepared.name: parts for prepared, parts in zip(told, found, strict=True)}


def has_told_motion(model: Model) -> bool:
    """Whether `drive_allowances` finds any."""
    return any(_told(prepared) for prepared in model.problem.records)


def estimated_errors(
    model: Model, estimates: Mapping[str, np.ndarray]
) -> dict[str, tuple[np.ndarray, float]]:
    """How far told motions were from what is told, on the simulation's grid.

    Args:
        model: with the allowances of `drive_allowances`.
        estimates: best numbers of each record's allowance, in units of their priors [-].

    Returns:
        Errors, shape (count,) [m or rad], and the grid's interval [s], by record: of the last
        motion that is told where there are several.
    """
    found = {}
    for prepared in model.problem.records:
        allowance = model.allowances.get(prepared.name)
        if allowance is None or prepared.name not in estimates:
            continue
        numbers = (estimates[prepared.name] * allowance.priors)[
            np.array(allowance.kinds) == "drive"
        ]
        for _, channel in _told(prepared):
            curves = _along(prepared, channel)[: prepared.count]
            own, numbers = numbers[: curves.shape[1]], numbers[curves.shape[1] :]
            found[prepared.name] = (curves @ own, prepared.step)
    return found


def followed_motions(model: Model, estimates: Mapping[str, np.ndarray]) -> dict[str, Followed]:
    """Told motions less their estimated errors, by record; where they are of a size for noise.

    Beyond that they are what the model misses, and no motion that was.

    Args:
        model: with the allowances of `drive_allowances`.
        estimates: best numbers of each record's allowance, in units of their priors [-].

    Source: tests/identification/test_followed.py.
    """
    found = {}
    for prepared in model.problem.records:
        if prepared.name not in estimates:
            continue
        allowance = model.allowances[prepared.name]
        sizes = used(prepared.name, allowance, estimates[prepared.name])
        if any(one.kind == "drive" and one.beyond for one in sizes):
            continue
        ours = np.array(allowance.kinds) == "drive"
        numbers = (estimates[prepared.name] * allowance.priors)[ours]
        moved = tuple(block[:, ours] @ numbers for block in allowance.columns)
        inputs = prepared.inputs.copy()
        for index, channel in _told(prepared):
            curves = _along(prepared, channel)
            own, numbers = numbers[: curves.shape[1]], numbers[curves.shape[1] :]
            inputs[:, index] += curves @ own
        if np.any(ours):
            found[prepared.name] = Followed(inputs, moved)
    return found


def _told(prepared: Prepared) -> list[tuple[int, Channel]]:
    """Each input that is a told motion which moves, with its channel."""
    found = []
    for index, port in enumerate(prepared.ports):
        if DERIVATIVES.get(port.quantity) == 0 and prepared.drives[index]:
            channel = prepared.record.channel(prepared.drives[index])
            if np.ptp(channel.values) > 0:
                found.append((index, channel))
    return found


def _along(prepared: Prepared, channel: Channel) -> np.ndarray:
    """Motions on the grid for unit errors, held after the record's end, shape (padded, m)."""
    begin = prepared.start / prepared.record.sample_rate
    times = begin + np.arange(prepared.count) * prepared.step
    curves, _ = _curves(channel, times)
    return np.concatenate([curves, np.repeat(curves[-1:], len(prepared.inputs) - len(curves), 0)])


def told_noise(channel: Channel) -> float:
    """Standard deviation of a told motion's own noise [unit of the channel].

    From differences of high order, which a smooth motion hardly has; at least what rounding to
    the channel's smallest step leaves.
    """
    if channel.noise is not None:
        return channel.noise
    steps = np.diff(np.unique(channel.values))
    coarse = float(np.min(steps)) / np.sqrt(12.0) if len(steps) else 0.0
    if len(channel.values) <= 4 * ORDER:
        return coarse
    size = np.sqrt(float(np.prod(np.arange(ORDER + 1, 2 * ORDER + 1) / np.arange(1, ORDER + 1))))
    # the median is not moved by a few kinks
    spread = float(np.median(np.abs(np.diff(channel.values, ORDER)))) / 0.6745
    return max(spread / size, coarse)


def _errors(
    model: Model, prepared: Prepared, z: np.ndarray, index: int, channel: Channel
) -> Allowance:
    """Errors of a told motion's samples, as far as the curve through them carries them on."""
    begin = prepared.start / prepared.record.sample_rate
    times = begin + np.arange(len(prepared.inputs)) * prepared.step
    curves, each = _curves(channel, times[: prepared.count])
    wide = np.zeros((len(times), curves.shape[1]))
    wide[: prepared.count] = curves
    wide[prepared.count :] = curves[-1]
    # from the start the mechanism rides along with what stands or drifts already
    still, drift = np.ones(len(times)), times - begin
    at_first = wide[0], (-3.0 * wide[0] + 4.0 * wide[1] - wide[2]) / (2.0 * prepared.step)
    riding = [_response(model, prepared, z, index, motion) for motion in (still, drift)]
    wide = wide - np.outer(still, at_first[0]) - np.outer(drift, at_first[1])
    size = 2 * len(times)
    hat = np.zeros(len(times))
    hat[LEAD] = 1.0  # the curve through it bends before it, too
    pulse = _response(model, prepared, z, index, hat)
    motion = np.fft.rfft(wide, size, axis=0)
    columns = []
    for number, sensor in enumerate(prepared.sensors):
        of_pulse = np.fft.rfft(pulse[:, number], size)
        told = np.fft.irfft(of_pulse[:, None] * motion, size, axis=0)[LEAD : LEAD + len(times)]
        for seen, rate in zip(riding, at_first, strict=True):
            told += np.outer(seen[:, number], rate)
        columns.append(np.asarray(sample(sensor, told)))
    priors = np.full(curves.shape[1], told_noise(channel) * each)
    return Allowance(("drive",) * curves.shape[1], tuple(columns), priors)


def _curves(channel: Channel, times: np.ndarray) -> tuple[np.ndarray, float]:
    """Motions on the grid for unit errors, shape (t, m), and each one's size in noises [-]."""
    own = channel.start_time + np.arange(len(channel.values)) / channel.sample_rate
    near = np.flatnonzero((own > times[0] - REACH / channel.sample_rate)
                          & (own < times[-1] + REACH / channel.sample_rate))  # fmt: skip
    if 3 < len(near) <= MOST_ERRORS:
        curve = CubicSpline(own[near], np.eye(len(near)))
        return curve(np.clip(times, own[near[0]], own[near[-1]])), 1.0
    every = (times[-1] - times[0]) / (MOST_ERRORS - 4)
    at = (times[:, None] - times[0]) / every - np.arange(-3, MOST_ERRORS - 3)
    inside = (at > 0.0) & (at < 4.0)
    bumps = np.where(inside, _spline(np.where(inside, at, 0.0)), 0.0)
    # of bumps of unit size the sum of squares at any time is 0.5 on average
    return bumps, float(np.sqrt(1.0 / (channel.sample_rate * every) / 0.5))


LEAD = 32
"""Samples by which a unit pulse stands off the grid's start [-]."""

REACH = 8
"""Samples beyond a record that still bend the curve within it [-]."""


def _clock(
    model: Model, prepared: Prepared, z: np.ndarray, index: int, channel: Channel
) -> list[Allowance]:
    delay = channel.tolerance.get("delay", 0.0)
    if delay <= 0:
        return []
    late = -np.gradient(prepared.inputs[:, index], prepared.step)
    told = _response(model, prepared, z, index, late)
    columns = tuple(np.asarray(sample(s, told[:, [i]])) for i, s in enumerate(prepared.sensors))
    return [Allowance(("delay",), columns, np.array([delay]))]


def _response(
    model: Model, prepared: Prepared, z: np.ndarray, index: int, motion: np.ndarray
) -> np.ndarray:
    """Sensors on the grid, shape (padded, sensors), when one input alone moves so [SI]."""
    inputs = np.zeros_like(prepared.inputs)
    inputs[:, index] = motion
    _, step, widths = model.arguments(prepared)
    seen = simulate(
        model.plant(prepared), model.substeps(prepared), z, jnp.asarray(inputs), step, widths
    )
    return np.asarray(seen)[:, :-1]


LINEAR = ("numbers", "gain", "delay", "tilt")
"""Parts of a plant's z by which it answers a small push [-]; strengths of linear laws beside."""


def _of_small(model: Model, prepared: Prepared, x: np.ndarray) -> np.ndarray:
    """The plant's z [SI] as what it answers to a small push is felt by: at rest, its zeros right.

    A law that is not linear answers by where the motion is; it is left out.
    """
    plant = model.plant(prepared)
    z, kept = model.vector(prepared, x), np.zeros(plant.size, dtype=bool)
    for name in LINEAR:
        kept[plant.slots[name]] = True
    kept[plant.slots["strengths"]] = [
        bool(symbol) or is_linear(law) for _, law, symbol in plant.law_numbers
    ]
    return np.where(kept, z, 0.0)


def _spline(at: np.ndarray) -> np.ndarray:
    """The cubic B-spline over 0 to 4 [1]."""
    return np.asarray(BSpline.basis_element(np.arange(5.0))(at))
