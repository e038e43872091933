"""Errors of a told motion: a robot's slow and coarse feedback is not believed, but estimated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from scipy.interpolate import BSpline

from ..model.chain import DERIVATIVES
from ..model.plant import numbers_vector
from ..model.respond import simulate
from .allowance import Allowance
from .prepare import Prepared
from .problem import Model, sample
from .records import Channel

KNOT = 0.004
"""Shortest distance of the knots of a drive's error [s]: the robot reports at 250 Hz."""

MOST_KNOTS = 600
"""Knots of a record [-]; a long one has them further apart."""

ORDER = 5
"""Differences of this order leave the noise of a smooth motion [-]."""


def drive_allowances(model: Model, x: np.ndarray) -> dict[str, list[Allowance]]:
    """Errors of every told motion, by record: its noise at knots, and its clock.

    The response to the error at one knot is that at the first one, later: the mechanism without
    its laws is linear, and the errors are small.

    Args:
        model: with its constants.
        x: scaled unknowns [-].

    Returns:
        Allowances of the records that are driven by a motion.

    Source: errors in variables, Fuller 1987, chapter 1; tests/identification/test_allowance.py.
    """
    found: dict[str, list[Allowance]] = {}
    for prepared in model.problem.records:
        for index, port in enumerate(prepared.ports):
            if DERIVATIVES.get(port.quantity) != 0 or not prepared.drives[index]:
                continue
            channel = prepared.record.channel(prepared.drives[index])
            if np.ptp(channel.values) > 0:
                numbers = model.numbers(prepared, x)
                parts = found.setdefault(prepared.name, [])
                parts.append(_knots(model, prepared, numbers, index, channel))
                parts += _clock(model, prepared, numbers, index, channel)
    return found


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


def _knots(
    model: Model, prepared: Prepared, numbers: Mapping[str, float], index: int, channel: Channel
) -> Allowance:
    rate = 1.0 / prepared.step
    every = max(KNOT, 1.0 / channel.sample_rate, prepared.count / rate / MOST_KNOTS)
    stride = max(1, round(every * rate))
    bump = np.zeros(len(prepared.inputs))
    at = np.arange(1, 4 * stride) / stride
    bump[1 : 4 * stride] = _spline(at)
    told = _response(model, prepared, numbers, index, bump)
    count = (prepared.count - 1) // stride + 4
    # the first bumps begin before the record; what they did before it is in the start state
    shifts = stride * np.arange(-3, count - 3)
    columns = []
    for number, sensor in enumerate(prepared.sensors):
        wide = np.zeros((len(told), count))
        for column, shift in enumerate(shifts):
            if shift < 0:
                wide[:shift, column] = told[-shift:, number]
            else:
                wide[shift:, column] = told[: len(told) - shift, number]
        columns.append(np.asarray(sample(sensor, wide)))
    noise = told_noise(channel) * np.sqrt(1.0 / (channel.sample_rate * every))
    # of bumps of unit size the sum of squares at any time is 0.5 on average
    priors = np.full(count, noise / np.sqrt(0.5))
    return Allowance(("drive",) * count, tuple(columns), priors)


def _clock(
    model: Model, prepared: Prepared, numbers: Mapping[str, float], index: int, channel: Channel
) -> list[Allowance]:
    delay = channel.tolerance.get("delay", 0.0)
    if delay <= 0:
        return []
    late = -np.gradient(prepared.inputs[:, index], prepared.step)
    told = _response(model, prepared, numbers, index, late)
    columns = tuple(np.asarray(sample(s, told[:, [i]])) for i, s in enumerate(prepared.sensors))
    return [Allowance(("delay",), columns, np.array([delay]))]


def _response(
    model: Model,
    prepared: Prepared,
    numbers: Mapping[str, float],
    index: int,
    motion: np.ndarray,
) -> np.ndarray:
    """Sensors on the grid, shape (padded, sensors), when one input alone moves so [SI]."""
    bare = replace(model.plant(prepared), law_places=())
    z = numbers_vector(bare, numbers)
    inputs = np.zeros_like(prepared.inputs)
    inputs[:, index] = motion
    seen = simulate(bare, 1, z, jnp.asarray(inputs), jnp.asarray(prepared.step), np.zeros((0, 2)))
    return np.asarray(seen)[:, :-1]


def _spline(at: np.ndarray) -> np.ndarray:
    """The cubic B-spline over 0 to 4 [1]."""
    return np.asarray(BSpline.basis_element(np.arange(5.0))(at))
