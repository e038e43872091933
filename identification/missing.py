"""The force that a model lacks, from its residual: in time, and against stretch and rate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np

from ..model.plant import Plant, numbers_vector
from ..model.respond import force_responses, forced_motion
from .fit import Fit
from .motions import motions
from .prepare import Prepared, bucket
from .problem import sample

KNOTS_A_PERIOD = 16
"""Knots of the force in one period of the record [-]: up to the seventh harmonic."""

MOST_KNOTS = 320
"""Knots over all rows [-]; a longer record is used from its start as far as they go."""

MOST_NUMBERS = 25_000_000
"""Numbers of all states under the force of each knot [-]: they are held at once."""

CLASSES = 25
"""Points of a curve against stretch or rate [-]."""

REACH_OF_SAMPLING = 4
"""Samples before the end of the grid from which a sensor may still be read [-]."""

SHRINKS = np.geomspace(1e-4, 1e4, 25)
"""Strengths of the pull towards no force that are tried, about the columns' size [-]."""


@dataclass(frozen=True)
class Curve:
    """The missing force against one quantity.

    Attributes:
        against: displacement, velocity or time.
        x: of that quantity, shape (n,) [m, rad, m/s, rad/s or s].
        force: that resists the stretch, shape (n,) [N or N m].
        std: its standard deviation from sample to sample, shape (n,) [N or N m].
        share: of the force's variance that goes with it [-].
    """

    against: str
    x: np.ndarray
    force: np.ndarray
    std: np.ndarray
    share: float


@dataclass(frozen=True)
class MissingForce:
    """What the residual of one record says of the force that is missing at a place.

    Attributes:
        place: where it is sought.
        record: name of the record.
        curves: against displacement, velocity and time, largest share first.
        explained: share of the record's misfit that this force takes away [-].
        score: ``n ln(misfit left) + d ln(n)`` of n samples and d free numbers [-]; the least is the
            likeliest place.
        until: how much of the record was used [s].
    """

    place: str
    record: str
    curves: tuple[Curve, ...]
    explained: float
    score: float
    until: float


def missing_force(fit: Fit, place: str) -> MissingForce | None:
    """Estimate the force that is missing at a place, without any law.

    The force is a chain of straight lines in time; the record's response to it is linear, so the
    residual gives it in closed form, with all that a fit varies fitted along, and shrunk as much
    as generalized cross-validation asks. It is set against the motion that it makes with these.

    Args:
        fit: of the rig as it stands, no law in force.
        place: a link or mass.

    Returns:
        The estimate from the record that is explained worst; None where laws act already or the
        place takes no force.

    Source: input estimation by ridge regression; Golub, Heath and Wahba 1979,
    doi:10.1080/00401706.1979.10489751; tests/identification/test_missing.py.
    """
    mechanism = fit.problem.mechanism
    if fit.model.places or place not in mechanism.law_places() or not fit.misfits:
        return None
    worst = max(fit.misfits, key=lambda key: fit.misfits[key].ratio)[0]
    prepared = next(p for p in fit.problem.records if p.name == worst)
    alone = replace(fit.model, problem=replace(fit.problem, records=(prepared,)))
    rows = len(motions(alone, fit.x, (place,))[place])
    count = prepared.count
    apart = max(1.0 / (max(prepared.frequency, 1e-9) * KNOTS_A_PERIOD * prepared.step), 1.0)
    plant = _plant(fit, prepared, place)[0]
    most = MOST_NUMBERS // (MOST_KNOTS * plant.n_states)
    knots = int(min(MOST_KNOTS // rows, (min(count, most) - 1) / apart + 1))
    if knots < 8:
        return None
    used = min(int((knots - 1) * apart) + 1, count)
    hats = _hats(used, knots, apart)
    whole, gap, slopes = _system(fit, prepared, place, rows, hats, used)
    basis = np.linalg.qr(slopes)[0]
    values, explained, score = _shrunk(
        whole - basis @ (basis.T @ whole), gap - basis @ (basis.T @ gap)
    )
    step = np.linalg.lstsq(slopes, whole @ values - gap, rcond=1e-10)[0]
    seen = motions(alone, fit.x + step, (place,))[place]
    forces = values.reshape(rows, knots) @ hats
    at = np.arange(used) * prepared.step
    flat = forces.ravel()
    moves = _moved(fit, prepared, place, forces)
    stretch, rate = (
        np.concatenate(
            [pair[part][:used] + move for pair, move in zip(seen, moves[part].T, strict=True)]
        )
        for part in (0, 1)
    )
    curves = [
        curve_of("displacement", stretch, flat),
        curve_of("velocity", rate, flat),
        Curve("time", at, forces.mean(axis=0), np.zeros(used), 1.0),
    ]
    ordered = sorted(curves[:2], key=lambda curve: -curve.share)
    until = used * prepared.step
    return MissingForce(place, worst, (*ordered, curves[2]), explained, score, until)


def _hats(used: int, knots: int, apart: float) -> np.ndarray:
    """Straight lines between knots, shape (knots, used) [-]."""
    position = np.arange(used) / apart
    return np.maximum(1.0 - np.abs(position[None, :] - np.arange(knots)[:, None]), 0.0)


def _plant(fit: Fit, prepared: Prepared, place: str) -> tuple[Plant, np.ndarray]:
    """The plant on which a force acts at the place, with its numbers [SI]."""
    plant = replace(fit.model.plant(prepared), law_places=(place,))
    return plant, numbers_vector(plant, fit.model.numbers(prepared, fit.x))


def _moved(
    fit: Fit, prepared: Prepared, place: str, forces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What a force (rows, t) changes of stretch and rate, two of shape (t, rows)."""
    plant, z = _plant(fit, prepared, place)
    padded = np.zeros((1, len(prepared.inputs), len(forces)))
    padded[0, : forces.shape[1]] = forces.T
    found = forced_motion(plant, jnp.asarray(z), jnp.asarray(padded), jnp.asarray(prepared.step))
    stretch, rate = (np.asarray(part)[0, : forces.shape[1]] for part in found)
    return stretch, rate


def _system(
    fit: Fit, prepared: Prepared, place: str, rows: int, hats: np.ndarray, used: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whitened responses to each knot's force, the residual, and its slopes by all unknowns."""
    model = replace(fit.model, noises=fit.problem.floor, allowances={}, horizon=np.inf)
    plant, z = _plant(fit, prepared, place)
    length = min(len(prepared.inputs), bucket(used))
    forces = np.zeros((rows * len(hats), length, rows))
    for row in range(rows):
        forces[row * len(hats) : (row + 1) * len(hats), :used, row] = hats
    seen = np.asarray(
        force_responses(plant, jnp.asarray(z), jnp.asarray(forces), jnp.asarray(prepared.step))
    )
    blocks, gaps, kept = [], [], []
    for i, sensor in enumerate(prepared.sensors):
        noise = fit.problem.floor[prepared.name, sensor.channel.name]
        near = sensor.times <= (used - REACH_OF_SAMPLING) * prepared.step
        told = int(near.sum())
        sampling = None if sensor.sampling is None else sensor.sampling[:told, :length]
        short = replace(sensor, values=sensor.values[:told], sampling=sampling)
        blocks.append(noise.whiten(sample(short, seen[:, :, i].T)))
        measured = fit.residual_of((prepared.name, sensor.channel.name))
        gaps.append(noise.whiten(measured[:told]))
        kept.append(near)
    keep = np.concatenate(kept)
    alone = replace(model, problem=replace(fit.problem, records=(prepared,)))
    slopes = alone.jacobian(fit.x)  # priors' rows at the end keep what this record cannot tell
    counted = np.concatenate([keep, np.ones(len(slopes) - len(keep), dtype=bool)])
    rest = np.zeros((len(slopes) - len(keep), len(forces)))
    whole, gap = np.concatenate([*blocks, rest]), np.concatenate([*gaps, rest[:, 0]])
    return whole, gap, slopes[counted]


def _shrunk(whole: np.ndarray, gap: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Ridge estimate whose strength generalized cross-validation chooses; what it explains; score.

    The score is Schwarz's, with the numbers that shrinking has left free.
    """
    left, sizes, right = np.linalg.svd(whole, full_matrices=False)
    seen, total = left.T @ gap, float(gap @ gap)
    middle = float(np.median(sizes[sizes > 1e-12 * sizes[0]]))
    best, found, explained, schwarz = np.inf, np.zeros(len(sizes)), 0.0, np.inf
    count = len(gap)
    for strength in SHRINKS * middle:
        passed = sizes**2 / (sizes**2 + strength**2)
        rest = total - float(np.sum((1.0 - (1.0 - passed) ** 2) * seen**2))
        free = float(np.sum(passed))
        score = rest / (count - free) ** 2
        if score < best:
            best, found = score, passed * seen / np.maximum(sizes, 1e-300)
            explained = 1.0 - rest / max(total, 1e-300)
            schwarz = count * np.log(max(rest, 1e-300)) + free * np.log(count)
    return right.T @ found, float(np.clip(explained, 0.0, 1.0)), float(schwarz)


def curve_of(against: str, x: np.ndarray, force: np.ndarray) -> Curve:
    """Means over classes with equal numbers of samples, and how much they say of the force.

    Args:
        against: what `x` is, in words.
        x: shape (n,) [SI].
        force: at the same samples, shape (n,) [SI].
    """
    order = np.argsort(x)
    parts = np.array_split(order, CLASSES)
    means = np.array([force[part].mean() for part in parts])
    stds = np.array([force[part].std() for part in parts])
    spread = float(np.sum((force - force.mean()) ** 2))
    inside = float(sum(np.sum((force[p] - m) ** 2) for p, m in zip(parts, means, strict=True)))
    share = 1.0 - inside / spread if spread > 0 else 0.0
    return Curve(against, np.array([x[part].mean() for part in parts]), means, stds, share)


def missing_json(found: MissingForce, turns: bool) -> dict[str, Any]:
    """A missing force as JSON can hold it [SI].

    Args:
        found: the force.
        turns: whether its place turns, so that it is a torque.
    """
    length, force = ("rad", "N m") if turns else ("m", "N")
    units = {"displacement": length, "velocity": f"{length}/s", "time": "s"}
    curves = [curve_json(curve, units[curve.against], force) for curve in found.curves]
    first = curves[0]
    names = ("against", "x", "force", "unit_x", "unit_force")
    return {
        "place": found.place,
        "record": found.record,
        **{name: first[name] for name in names},
        "explained": found.explained,
        "until": found.until,
        "curves": curves,
    }


def curve_json(curve: Curve, unit_x: str, unit_force: str) -> dict[str, Any]:
    """A curve as JSON can hold it, in the units that are told."""
    return {
        "against": curve.against,
        "x": curve.x.tolist(),
        "force": curve.force.tolist(),
        "std": curve.std.tolist(),
        "unit_x": unit_x,
        "unit_force": unit_force,
        "share": curve.share,
    }
