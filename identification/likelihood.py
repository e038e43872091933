"""The log posterior of a fit's unknowns: innovations likelihood, batched and compiled once."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from scipy.sparse import csr_matrix

from ..model.plant import Plant
from .coast import Coast, CoastData
from .coast_data import are_alike, coast_of, coasts, together
from .density import Data, Kind, Prior, log_densities
from .fit import Fit
from .free import Entry
from .noise import Noise
from .prepare import Prepared, Sensor
from .uneven import Uneven
from .unknowns import (
    FAR,
    Unknown,
    absorbed,
    entry_unknowns,
    is_linear,
    noise_columns,
    noise_unknowns,
)

KINDS = ("identity", "above", "below", "between")
MANY = 4
"""Batches beyond which they are evaluated side by side [-]."""

RIDGE = 1e-12
"""Information on a direction, relative to that on its single numbers, that counts as none [-]."""


@dataclass(frozen=True, eq=False)
class LogPosterior:
    """Log density of the unknowns of a fit, given its records.

    Start states, offsets and the zeros of drives, in which the response is linear and whose priors
    are normal, are integrated in closed form. Each channel's noise keeps the law that was chosen
    for it, but its size and memory are unknowns too: their uncertainty widens the others'. Noise
    that grows does so with the motion of the fit. Under heavy tails linear numbers are integrated
    by a normal law about their best values, see `tails`.

    Attributes:
        unknowns: what is sampled.
        mean: the fit, in coordinates without bounds, shape (d,) [-].
        covariance: Laplace's approximation there, shape (d, d) [-].
        kinds: kinds of records.
        data: their arrays.
        prior: transforms and priors.
        batch: points that are evaluated at once.

    Source: Box, Jenkins and Reinsel, Time Series Analysis, chapter 7 (innovations); Lindley and
    Smith 1972 (linear numbers); tests/identification/test_sample.py.
    """

    unknowns: tuple[Unknown, ...]
    mean: np.ndarray
    covariance: np.ndarray
    kinds: tuple[Kind | Coast, ...]
    data: tuple[Data | CoastData, ...]
    prior: Prior
    batch: int = 16

    def __call__(self, free: np.ndarray) -> np.ndarray:
        """Log density, up to a constant, of points in coordinates without bounds, shape (n, d) [-].

        Points are filled up to whole batches, so that one shape is compiled whatever n.
        """
        free = np.atleast_2d(free)
        count = len(free)
        whole = -(-count // self.batch) * self.batch
        padded = np.concatenate([free, np.repeat(free[-1:], whole - count, axis=0)])
        batches = padded.reshape(-1, self.batch, free.shape[1])
        if len(batches) > MANY:  # two at once: of small batches one core is all that each uses
            with ThreadPoolExecutor(min(os.cpu_count() or 1, 4)) as pool:
                parts = list(pool.map(self._batch, batches))
        else:
            parts = [self._batch(batch) for batch in batches]
        value = np.concatenate(parts)[:count]
        return np.where(np.isfinite(value), value, -np.inf)

    def _batch(self, free: np.ndarray) -> np.ndarray:
        return np.asarray(log_densities(self.kinds, free, self.prior, self._held))

    def log_prior(self, free: np.ndarray) -> np.ndarray:
        """The part of the log density that is no likelihood, of points of shape (n, d) [-]."""
        found = np.zeros(len(free))
        for at, unknown in zip(np.atleast_2d(free).T, self.unknowns, strict=True):
            if not unknown.is_scale:
                found += unknown.log_slope(at)
            if math.isfinite(unknown.prior):
                found -= 0.5 * ((unknown.natural(at) - unknown.center) / unknown.prior) ** 2
        return found

    @cached_property
    def _held(self) -> Any:
        return jax.tree.map(jnp.asarray, self.data)

    def natural(self, free: np.ndarray) -> np.ndarray:
        """Values [SI] of points in coordinates without bounds, shape (..., d)."""
        columns = [u.natural(free[..., i]) for i, u in enumerate(self.unknowns)]
        return np.stack(columns, axis=-1)


def log_posterior(fit: Fit, batch: int = 16) -> LogPosterior:
    """The log posterior of a fit, with Laplace's approximation at its best numbers.

    Args:
        fit: with errors attached.
        batch: points that are evaluated at once.

    Returns:
        The density as a function, in coordinates without bounds [-].

    Raises:
        ValueError: for a fit that has no noise laws yet.
    """
    fit = absorbed(fit)
    where, chosen = entry_unknowns(fit)
    noises = noise_unknowns(fit)
    unknowns = [*chosen, *(unknown for mine in noises.values() for unknown in mine)]
    at, low = {}, len(chosen)
    for key, mine in noises.items():
        at[key] = [low + i for i in range(len(mine))]
        low += len(mine)
    shared = [
        i for i, e in enumerate(fit.model.entries) if is_linear(fit.model, e) and e.record is None
    ]
    made: dict[Kind | Coast, list[Any]] = {}
    for prepared in fit.problem.records:
        kind, data = _record(fit, prepared, where, shared, at, len(unknowns))
        made.setdefault(kind, []).append(data)
    prior = _prior(fit, unknowns, shared)
    mean = np.array([float(unknown.free(unknown.value)) for unknown in unknowns])
    data = tuple(_stacked(several) for several in made.values())
    spread = _laplace(fit, unknowns, where)
    kinds = tuple(
        replace(kind, alike=are_alike(kind, several)) if isinstance(kind, Coast) else kind
        for kind, several in made.items()
    )
    return LogPosterior(tuple(unknowns), mean, spread, kinds, data, prior, batch)


def _prior(fit: Fit, unknowns: Sequence[Unknown], shared: Sequence[int]) -> Prior:
    entries = [fit.model.entries[i] for i in shared]
    bounds = [(u.low, u.high) for u in unknowns]
    return Prior(
        np.array([KINDS.index(u.transform) for u in unknowns]),
        np.array([low if math.isfinite(low) else 0.0 for low, _ in bounds]),
        np.array([high if math.isfinite(high) else 0.0 for _, high in bounds]),
        np.array([u.scale for u in unknowns]),
        np.array([u.center for u in unknowns]),
        np.array([1.0 / u.prior for u in unknowns]),
        np.array([not u.is_scale for u in unknowns], dtype=float),
        np.array([(e.center / e.scale) - fit.x[i] for i, e in zip(shared, entries, strict=True)]),
        np.array([e.scale / e.prior for e in entries]),
    )


def _record(
    fit: Fit,
    prepared: Prepared,
    where: Sequence[int],
    shared: Sequence[int],
    at: dict,
    size: int,
) -> tuple[Kind | Coast, Data | CoastData]:
    """One record as a kind and its arrays."""
    model = fit.model
    plant = model.plant(prepared)
    x = fit.x.copy()
    x[list(where)] = 0.0
    z = model.vector(prepared, x)
    scatter = np.zeros((plant.size, size))
    links = dict(model.links(prepared))
    for column, i in enumerate(where):
        if i in links:
            scatter[links[i], column] = 1.0
    local = [i for i, e in enumerate(model.entries) if is_linear(model, e) and i in links]
    local = [i for i in local if i not in shared]
    starts = [i for i in local if model.entries[i].slot == "start"]
    offsets = [i for i in local if model.entries[i].slot == "offset"]
    common = [(n, i) for n, i in enumerate(shared) if i in links]
    first = plant.slots["offset"].start
    delay = plant.slots["delay"]
    laws = [model.noises[prepared.name, sensor.channel.name] for sensor in prepared.sensors]
    noise = np.full((len(laws), 5), size)
    for row, (sensor, law) in enumerate(zip(prepared.sensors, laws, strict=True)):
        assert isinstance(law, Noise)
        noise[row, noise_columns(law)] = at[prepared.name, sensor.channel.name]
    uneven = [law for law in laws if isinstance(law, Uneven)]
    if coasts(fit, prepared) and all(model.entries[i].slot == "drive" for _, i in common):
        return coast_of(fit, prepared, z, scatter, (starts, offsets, common), noise)
    kind = Kind(
        plant if model.places else plant.bare,
        model.substeps(prepared),
        bool(model.places or np.any(prepared.inputs) or np.any(z[plant.slots["drive"]])),
        bool(np.any(z[delay]) or np.any(scatter[delay])),
        any(sensor.sampling is not None for sensor in prepared.sensors),
        tuple(links[i] for i in starts),
        tuple(links[i] - first for i in offsets),
        tuple(_slot(plant, model.entries[i], links[i]) for _, i in common),
        any(law.growth for law in uneven),
        any(law.tail for law in uneven),
    )
    values, mask, index, weight = _measured(prepared, kind.clocked)
    extra = _allowed(fit, prepared, values.shape[1])
    motion = np.zeros_like(values)
    for row, law in enumerate(laws):
        if isinstance(law, Uneven):
            motion[row, : len(law.motion)] = law.motion
    ordered = [model.entries[i] for i in (*starts, *offsets)]
    best = fit.x[[*starts, *offsets]]
    scale = np.array([e.scale for e in ordered])
    return kind, Data(
        z,
        scatter,
        prepared.inputs,
        np.array(prepared.step),
        model.widths(),
        values,
        mask,
        index,
        weight,
        noise,
        motion,
        extra,
        scale,
        np.append(np.array([e.center for e in ordered]) / scale - best, np.zeros(extra.shape[1])),
        np.append(scale / np.array([e.prior for e in ordered]), np.ones(extra.shape[1])),
        np.array([model.entries[i].scale for _, i in common]),
        np.array([n for n, _ in common], dtype=int),
    )


def _allowed(fit: Fit, prepared: Prepared, longest: int) -> np.ndarray:
    """Responses to what a record leaves open, in units of the priors, (sensors, numbers, n)."""
    allowance = fit.model.allowances.get(prepared.name)
    count = 0 if allowance is None else len(allowance.kinds)
    found = np.zeros((len(prepared.sensors), count, longest))
    if allowance is not None:
        for row, block in enumerate(allowance.columns):
            found[row, :, : len(block)] = (block * allowance.priors).T
    return found


def _slot(plant: Plant, entry: Entry, at: int) -> tuple[str, int]:
    return entry.slot, at - (plant.slots["offset"].start if entry.slot == "offset" else 0)


def _measured(prepared: Prepared, clocked: bool) -> tuple[np.ndarray, ...]:
    """Samples of every sensor filled up to the grid, which of them count, and whence they come."""
    count, padded = len(prepared.sensors), len(prepared.inputs)
    longest = max(padded, max(len(sensor.values) for sensor in prepared.sensors))
    values, mask = np.zeros((count, longest)), np.zeros((count, longest))
    width = 6 if clocked else 0
    index = np.zeros((count, longest, width), dtype=int)
    weight = np.zeros((count, longest, width))
    for row, sensor in enumerate(prepared.sensors):
        n = len(sensor.values)
        values[row, :n], mask[row, :n] = sensor.values, 1.0
        if clocked:
            index[row, :n], weight[row, :n] = _neighbors(sensor, width)
    return values, mask, index, weight


def _neighbors(sensor: Sensor, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Grid points and weights of each sample, `width` of them."""
    n = len(sensor.values)
    index, weight = np.zeros((n, width), dtype=int), np.zeros((n, width))
    if sensor.sampling is None:
        index[:, 0], weight[:, 0] = np.arange(n), 1.0
        return index, weight
    rows = csr_matrix(sensor.sampling)
    for row in range(n):
        part = slice(rows.indptr[row], rows.indptr[row + 1])
        size = part.stop - part.start
        index[row, :size], weight[row, :size] = rows.indices[part], rows.data[part]
    return index, weight


def _stacked(several: Sequence[Any]) -> Data | CoastData:
    """Records of one kind along a first axis, filled up to the longest of them."""
    if isinstance(several[0], CoastData):
        return together(several)
    grid = max(len(data.inputs) for data in several)
    longest = max(data.values.shape[1] for data in several)

    def filled(data: Data) -> Data:
        more, late = grid - len(data.inputs), longest - data.values.shape[1]
        wide = ((0, 0), (0, late))
        return data._replace(
            inputs=np.pad(data.inputs, ((0, more), (0, 0)), mode="edge"),
            values=np.pad(data.values, wide),
            motion=np.pad(data.motion, wide),
            extra=np.pad(data.extra, ((0, 0), (0, 0), (0, late))),
            mask=np.pad(data.mask, wide),
            index=np.pad(data.index, (*wide, (0, 0))),
            weight=np.pad(data.weight, (*wide, (0, 0))),
        )

    return Data(*(np.stack(column) for column in zip(*map(filled, several), strict=True)))


def _laplace(fit: Fit, unknowns: Sequence[Unknown], where: Sequence[int]) -> np.ndarray:
    """Covariance of the unknowns in coordinates without bounds [-], from the fit's own Jacobian."""
    jacobian = fit.model.jacobian(fit.x)
    information = jacobian.T @ jacobian
    size = np.sqrt(np.maximum(np.diag(information), 1e-300))
    unit = information / np.outer(size, size) + RIDGE * np.eye(len(size))
    whole = np.linalg.pinv(unit, rcond=1e-15, hermitian=True) / np.outer(size, size)
    count = len(where)
    spread = np.diag([unknown.std**2 for unknown in unknowns])
    scale = fit.model.scale[list(where)]
    spread[:count, :count] = whole[np.ix_(where, where)] * np.outer(scale, scale)
    slope = np.array([unknown.slope for unknown in unknowns])
    spread = spread / np.outer(slope, slope)
    std = np.sqrt(np.maximum(np.diag(spread), 1e-300))
    bounded = np.array([unknown.transform != "identity" for unknown in unknowns])
    cut = np.where(bounded, np.minimum(1.0, FAR / std), 1.0)
    return spread * np.outer(cut, cut)
