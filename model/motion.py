"""respond(mechanism, numbers, drive, times) -> Motion; and the same for many designs at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .balance import law_equilibrium
from .drives import Drive
from .exact import Plan, exact_outputs, plan_of
from .extended import (
    Acting,
    acting_laws,
    law_places,
    march,
    strengths,
    widths,
)
from .linear import Array, Mechanism, Port, state_space
from .plant import Plant, numbers_vector
from .swung_plant import swings_of, swung_readings

TILE = 256
"""Designs that are computed at once [-]; the last tile is filled up."""

TOLERANCE = 1e-6
"""Largest estimated error of a motion with laws, as a share of its largest value [-]."""

FOURTH_ORDER = 15.0
"""What halved steps change, over the error that they leave: 2^4 - 1 [-]."""

MOST_REFINEMENT = 64
"""Most steps a sample that a motion with laws is given [-]."""

MOST_STEPS = 4_000_000
"""Most steps of one motion with laws [-]; some seconds."""

CONVERGED, NOT_CONVERGED, LEFT_MODEL = "converged", "not_converged", "left_model"

SENTENCES = {
    CONVERGED: "The motion was simulated.",
    NOT_CONVERGED: "Not converged: the steps were not fine enough. Raise the sample_rate.",
}
"""What a status means [-]."""


@dataclass(frozen=True)
class Motion:
    """How a mechanism moves.

    Attributes:
        times: shape (t,) [s].
        names: the coordinates.
        positions: shape (t, coordinates) [m or rad].
        velocities: shape (t, coordinates) [m/s or rad/s].
        accelerations: shape (t, coordinates); where the drive jumps, that after the jump
            [m/s^2 or rad/s^2].
        sensors: what was asked for.
        samples: shape (t, sensors) [SI unit of each sensor].
        error: estimated error of the worst state as a share of its largest value; 0 where the
            response is exact [-].
        refinement: steps of the integrator a sample; 1 where the response is exact [-].
        doubt: one sentence where the motion went beyond what its model holds for [-].
    """

    times: np.ndarray
    names: tuple[str, ...]
    positions: np.ndarray
    velocities: np.ndarray
    accelerations: np.ndarray
    sensors: tuple[Port, ...]
    samples: np.ndarray
    error: float = 0.0
    refinement: int = 1
    doubt: str = ""

    @property
    def status(self) -> str:
        """``converged``; ``not_converged`` where `error` exceeds the tolerance; ``left_model``."""
        if self.doubt:
            return LEFT_MODEL
        return CONVERGED if self.error <= TOLERANCE else NOT_CONVERGED

    @property
    def sentence(self) -> str:
        """The status in words."""
        return self.doubt or SENTENCES[self.status]

    def columns(self) -> dict[str, np.ndarray]:
        """Every curve by its name in a table, ``time`` first [SI].

        Raises:
            ValueError: where two curves would have the same name.
        """
        named = [("time", self.times)]
        parts = (("", self.positions), ("_velocity", self.velocities))
        for ending, values in (*parts, ("_acceleration", self.accelerations)):
            named += [(name + ending, values[:, i]) for i, name in enumerate(self.names)]
        for index, port in enumerate(self.sensors):
            named.append((sensor_name(port), self.samples[:, index]))
        table = dict(named)
        if len(table) < len(named):
            names = [name for name, _ in named]
            twice = next(name for name in names if names.count(name) > 1)
            raise ValueError(
                f"motion: expected columns of different names, found '{twice}' twice. "
                "Mend: rename that mass, or ask for each sensor once."
            )
        return table


def sensor_name(port: Port) -> str:
    """Name of a sensor's column: ``PLACE:QUANTITY:FRAME``."""
    return f"{port.place}:{port.quantity}:{port.frame}"


def respond(
    mechanism: Mechanism,
    numbers: Mapping[str, float],
    drive: Drive,
    times: np.ndarray,
    sensors: tuple[Port, ...] = (),
    laws: Iterable[Mapping[str, Any]] = (),
) -> Motion:
    """One motion: exact for a linear rig, by a refined implicit integrator where laws act.

    Args:
        mechanism: chain or robot.
        numbers: its numbers by name [SI].
        drive: what moves it, see `supple.model.drives`.
        times: uniform samples from 0 on, at least two [s].
        sensors: what to measure beside the coordinates.
        laws: tables of an extended rig: ``law``, ``place``, ``parameters``; laws of sensors are
            passed over.

    Returns:
        The motion. With laws, steps are halved until the error that this shows is within
        `TOLERANCE`; where `MOST_REFINEMENT` is not enough, its status says so.

    Raises:
        ValueError: for times that are not uniform, numbers that are missing, a law that does not
            fit, a release without a balance, or a motion that grows beyond all bounds.

    Source: tests/model/test_motion.py, against scipy's expm and solve_ivp.
    """
    times = uniform(times)
    numbers = {name: float(number) for name, number in _numbers(mechanism, numbers).items()}
    acting = acting_laws(laws, mechanism)
    plan = plan_of(mechanism, drive, sensors, whole=True)
    table = {name: np.array([value]) for name, value in numbers.items()}
    linear = exact_outputs(plan, table, drive, times)[0]
    n = len(mechanism.coordinates)
    size = 2 * n + 2 * len(drive.joints)
    if not acting:
        q, v, _, a, samples = np.split(_finite(linear), [n, 2 * n, size, size + n], axis=1)
        return Motion(times, mechanism.coordinates, q, v, a, sensors, samples)
    return _respond_with_laws(plan, numbers, drive, times, acting, linear[:, :size])


def respond_batch(
    mechanism: Mechanism,
    table: Mapping[str, float | np.ndarray],
    drive: Drive,
    times: np.ndarray,
    sensors: tuple[Port, ...],
) -> np.ndarray:
    """The exact linear response of many designs at once, at the sensors.

    Args:
        mechanism: chain or robot.
        table: its numbers by name: one for all, or an array of shape (designs,) [SI].
        drive: what moves every design.
        times: uniform samples from 0 on, at least two [s].
        sensors: what is measured, at least one.

    Returns:
        Samples, shape (designs, t, sensors) [SI].

    Raises:
        ValueError: as for `respond`; also for arrays of different lengths.

    Source: as for `respond`; `supple.studies.benchmark` times it.
    """
    times = uniform(times)
    named = {name: np.asarray(v, float) for name, v in _numbers(mechanism, table).items()}
    lengths = {value.size for value in named.values() if value.ndim}
    if len(lengths) > 1 or any(value.ndim > 1 for value in named.values()):
        raise ValueError(
            f"designs: expected arrays of one length, found {sorted(lengths)}. "
            "Mend: give every number one value for each design, or one for all."
        )
    count = lengths.pop() if lengths else 1
    whole = {name: np.broadcast_to(value, (count,)) for name, value in named.items()}
    plan = plan_of(mechanism, drive, sensors)
    found = np.empty((count, len(times), len(sensors)))
    edges = max((len(joint.edges) for joint in drive.joints), default=0)
    tile = min(max(1, TILE // (1 + edges // 64)), count)
    for low in range(0, count, tile):
        chosen = np.minimum(np.arange(low, low + tile), count - 1)
        part = exact_outputs(
            plan, {name: value[chosen] for name, value in whole.items()}, drive, times
        )
        found[low : low + tile] = part[: count - low]
    return _finite(found)


def _numbers(mechanism: Mechanism, given: Mapping[str, Any]) -> dict[str, Any]:
    missing = [name for name in mechanism.names if name not in given]
    if missing:
        raise ValueError(
            f"numbers: expected every number of the rig, found none for '{missing[0]}'. "
            "Mend: add it."
        )
    return {name: given[name] for name in mechanism.names}


def uniform(times: np.ndarray) -> np.ndarray:
    """Sample times [s] as an array, checked to be uniform from 0 on.

    Raises:
        ValueError: where they are not, or are fewer than two.
    """
    times = np.asarray(times, dtype=float)
    step = (times[-1] - times[0]) / (len(times) - 1) if times.ndim == 1 and len(times) > 1 else 0.0
    if not step > 0 or times[0] != 0 or np.ptp(np.diff(times)) > 1e-6 * step:
        raise ValueError(
            "times: expected at least two uniform samples from 0 on [s], found others. "
            "Mend: give np.arange(count) / sample_rate."
        )
    return times


def _finite(values: np.ndarray) -> np.ndarray:
    if not np.all(np.isfinite(values)):
        raise ValueError(
            "motion: expected one that stays bounded, found one that grows beyond all numbers. "
            "Mend: look for a law or a constant of the wrong sign or size, or simulate less long."
        )
    return values


def _respond_with_laws(
    plan: Plan,
    numbers: Mapping[str, float],
    drive: Drive,
    times: np.ndarray,
    laws: tuple[Acting, ...],
    linear: np.ndarray,
) -> Motion:
    if any(joint.leaps for joint in drive.joints):
        raise ValueError(
            "drive: expected a prescribed angle without leaps where laws act, found one that "
            "leaps. Mend: give a profile, or a sine that ends with a half wave."
        )
    mechanism, places = plan.mechanism, law_places(laws)
    names = tuple(dict.fromkeys(one.law.name for one in laws))
    plant = Plant(mechanism, plan.inputs, (), places, names)
    z = numbers_vector(plant, numbers)
    z[plant.slots["strengths"]] = strengths(plant, laws)
    compiled = _matrices(mechanism, plan.inputs, plan.sensors, places, numbers)
    space = {name: np.asarray(matrix) for name, matrix in compiled.items()}
    rounding = _rounding(plant, space, numbers, laws, linear)
    if drive.hold is not None:
        known = dict(zip(places, map(tuple, rounding), strict=True))
        held = law_equilibrium(mechanism, numbers, drive.hold, laws, known)
        z[plant.slots["start"]][: len(held)] = held
    states, forces, error, refinement = _refined(plant, z, drive, times, rounding)
    felt = np.concatenate([drive.sampled(times), forces], axis=1)
    n = len(mechanism.coordinates)
    bend = states @ space["a"][n : 2 * n].T + felt @ space["b"][n : 2 * n].T
    samples = states @ space["c"].T + felt @ space["d"].T
    if swings_of(mechanism):
        known = {acting.law.name: acting.strength for acting in laws}
        seen = replace(plant, sensors=plan.sensors)
        inputs = jnp.asarray(drive.sampled(times))
        more = swung_readings(seen, numbers, known, jnp.asarray(states), inputs)
        samples = samples + np.asarray(more)
    q, v = states[:, :n], states[:, n : 2 * n]
    return Motion(
        times, mechanism.coordinates, q, v, bend, plan.sensors, samples, error, refinement
    )


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _matrices(
    mechanism: Mechanism,
    inputs: tuple[Port, ...],
    sensors: tuple[Port, ...],
    places: tuple[str, ...],
    numbers: Mapping[str, Array],
) -> dict[str, Array]:
    """The matrices of a state space, compiled as one."""
    return vars(state_space(mechanism, numbers, inputs, sensors, places))


def _refined(
    plant: Plant, z: np.ndarray, drive: Drive, times: np.ndarray, rounding: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, int]:
    """States, law forces, estimated error and steps a sample, halved until they settle."""
    refinement, error = 1, np.inf
    states, forces = march(plant, z, drive, times, rounding, refinement)
    most = max(2, min(MOST_REFINEMENT, MOST_STEPS // len(times)))
    while error > TOLERANCE and refinement < most:
        refinement *= 2
        finer, forces = march(plant, z, drive, times, rounding, refinement)
        size = np.maximum(np.max(np.abs(finer), axis=0), 1e-300)
        change = np.max(np.abs(finer - states) / size) / FOURTH_ORDER
        error = float(change) if np.isfinite(change) else np.inf
        states = finer
    return _finite(states), forces, error, refinement


def _rounding(
    plant: Plant,
    space: Mapping[str, np.ndarray],
    numbers: Mapping[str, float],
    laws: tuple[Acting, ...],
    linear: np.ndarray,
) -> np.ndarray:
    """Widths of the law places: as the rig states, or a share of the linear motion there."""
    rows = [len(plant.mechanism.place_rows(place, numbers)[1]) for place in plant.law_places]
    ends = np.cumsum(rows)[:-1]
    sizes = []
    for look in (space["stretch"], space["rate"]):
        moved = np.mean((linear @ look.T) ** 2, axis=0)
        sizes.append(np.array([np.sqrt(np.mean(part)) for part in np.split(moved, ends)]))
    return widths(plant, laws, *sizes)
