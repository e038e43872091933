"""Chains on disk: the checkpoint of an unfinished one, and the posterior as ArviZ reads it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..model.door import fault
from .posterior import Posterior

GENERATOR = "MT19937"
"""The generator whose state a checkpoint holds."""


@dataclass(frozen=True, eq=False)
class Chain:
    """All that is needed to go on with a chain.

    Attributes:
        points: shape (steps, ensembles, walkers, d), in standard deviations of Laplace's
            approximation from the fit [-].
        density: log density, shape (steps, ensembles, walkers) [-].
        accepted: proposals accepted, shape (ensembles, walkers) [-].
        last: where the walkers stand, shape (ensembles, walkers, d) [-].
        last_density: log density there, shape (ensembles, walkers) [-].
        states: state of each ensemble's generator.
    """

    points: np.ndarray
    density: np.ndarray
    accepted: np.ndarray
    last: np.ndarray
    last_density: np.ndarray
    states: tuple[Any, ...]

    @property
    def steps(self) -> int:
        """Steps that every walker has taken [-]."""
        return len(self.points)


ARRAYS = ("points", "density", "accepted", "last", "last_density")


def write_chain(path: Path, told: str, chain: Chain) -> None:
    """Write a checkpoint whole or not at all: a kill at any moment leaves the one before.

    Args:
        path: the file; its folder is made where it is missing.
        told: sum of all that decides the chain.
        chain: what has been sampled [-].

    Raises:
        ValueError: where it cannot be written.
    """
    import h5py

    beside = path.with_name(f".{path.name}.new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with h5py.File(beside, "w") as file:
            file.attrs["told"] = told
            for name in ARRAYS:
                file[name] = getattr(chain, name)
            for index, state in enumerate(chain.states):
                place = file.create_group(f"generators/{index}")
                place["keys"] = state[1]
                place.attrs["position"] = state[2]
                place.attrs["has_gauss"] = state[3]
                place.attrs["gauss"] = state[4]
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        os.replace(beside, path)
    except OSError as error:
        reason = error.strerror or "an error of the system"
        mend = "name another folder, or free this one"
        raise fault(path, "", "a place to write to", f"'{reason}'", mend) from None


def read_chain(path: Path, told: str) -> Chain | None:
    """The chain [-] of a checkpoint, where it is the beginning of the one that is told."""
    import h5py

    if not path.is_file():
        return None
    try:
        with h5py.File(path, "r") as file:
            if file.attrs.get("told") != told:
                return None
            arrays: list[Any] = [np.asarray(file[name]) for name in ARRAYS]
            states = []
            for index in range(len(arrays[3])):
                place: Any = file[f"generators/{index}"]
                marks = place.attrs
                numbers = int(marks["position"]), int(marks["has_gauss"]), float(marks["gauss"])
                states.append((GENERATOR, np.asarray(place["keys"]), *numbers))
    except (OSError, KeyError):
        return None
    points, density, accepted, last, last_density = arrays
    return Chain(points, density, accepted, last, last_density, tuple(states))


def write_posterior(posterior: Posterior, path: Path, told: Mapping[str, str]) -> Path:
    """Write draws as netCDF in ArviZ's layout.

    Every walker is a chain; ``ensemble`` and ``walker`` say which. Groups: ``posterior`` with one
    variable an unknown [SI], ``sample_stats`` with the log density, ``constant_data`` with the
    least-squares values and errors.

    Args:
        posterior: what was sampled.
        path: the file; an earlier one stays whole until the new one is.
        told: further attributes.

    Returns:
        The path.

    Source: the InferenceData schema of ArviZ; tests/identification/test_sample.py reads it with
    another program.
    """
    import h5netcdf

    steps, ensembles, walkers, _ = posterior.draws.shape
    chains = ensembles * walkers
    beside = path.with_name(f".{path.name}.new")
    with h5netcdf.File(beside, "w") as file:
        file.attrs.update({"inference_library": "emcee", "status": posterior.status, **told})
        for name in ("posterior", "sample_stats"):
            group = file.create_group(name)
            group.dimensions = {"chain": chains, "draw": steps}
            group.attrs.update({"inference_library": "emcee", "coordinates": "ensemble walker"})
            group.create_variable("chain", ("chain",), data=np.arange(chains))
            group.create_variable("draw", ("draw",), data=np.arange(steps))
            label = np.arange(chains)
            group.create_variable("ensemble", ("chain",), data=label // walkers)
            group.create_variable("walker", ("chain",), data=label % walkers)
        for index, unknown in enumerate(posterior.unknowns):
            values = posterior.draws[..., index].reshape(steps, chains).T
            _variable(file["posterior"], unknown.label, unknown.unit, values)
        density = posterior.log_density.reshape(steps, chains).T
        _variable(file["sample_stats"], "lp", "1", density)
        group = file.create_group("constant_data")
        for unknown in posterior.unknowns:
            for what, value in (("value", unknown.value), ("std", unknown.std)):
                name = f"{unknown.label}.least_squares_{what}"
                _variable(group, name, unknown.unit, np.asarray(value), ())
    os.replace(beside, path)
    return path


def _variable(
    group: Any, label: str, unit: str, values: np.ndarray, dims: tuple[str, ...] = ("chain", "draw")
) -> None:
    """One variable; a slash in a label, which would open a group, becomes a colon."""
    options = {"compression": "gzip", "compression_opts": 4, "shuffle": True} if dims else {}
    made = group.create_variable(label.replace("/", ":"), dims, data=values, **options)
    made.attrs["units"] = unit
    made.attrs["long_name"] = label
