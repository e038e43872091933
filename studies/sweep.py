"""Which design is best? Every one of a grid, simulated, scored, and kept as a map."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import release_memory, start_engine
from .simulate import TURNS, sensor_port

if TYPE_CHECKING:
    from ..model.drive_file import DriveSpec
    from ..model.linear import Port
    from ..model.rig import Rig
    from ..optimize.search_spec import Range
    from ..optimize.sweep import Axis, Map, SweepTask, Workers
    from ..optimize.sweep_spec import SweepSpec

_RATES = ("", "/s", "/s^2")


@dataclass(frozen=True)
class Asked:
    """A spec with everything that it names.

    Attributes:
        spec: as read.
        rig: as read, with the parameters that vary.
        drive: as read.
        task: what is swept.
        unit: of the sensor, as text.
    """

    spec: SweepSpec
    rig: Rig
    drive: DriveSpec
    task: SweepTask
    unit: str

    def inputs(self) -> dict[str, str]:
        """SHA-256 of every file read, by its path."""
        from ..model.door import sha256_of

        inputs = {str(self.spec.path): self.spec.sha256, str(self.rig.path): self.rig.sha256}
        inputs[str(self.drive.path)] = self.drive.sha256
        if self.drive.file is not None:
            inputs[str(self.drive.file)] = sha256_of(self.drive.file.read_bytes())
        return inputs

    def provenance(self, seed: int) -> dict[str, Any]:
        """Version, sums of the inputs, and seed; nothing that changes from run to run."""
        from .. import __version__

        return {"version": __version__, "inputs": self.inputs(), "seed": seed}


def sweep_spec(
    path: Path,
    out: Path | None = None,
    seed: int = 0,
    tell: Callable[[int, int], None] | None = None,
    cluster: str | None = None,
    posterior: Path | None = None,
) -> tuple[dict[str, Any], bool]:
    """Sweeps a grid and writes ``map.nc`` and ``map.json``; takes up what a kill left behind.

    Args:
        path: the spec.
        out: folder for the results; nothing is written where None. While the sweep runs its
            tiles are in ``map.unfinished.nc`` there.
        seed: kept in the provenance; nothing here is drawn by chance.
        tell: hears how many tiles of how many are done.
        cluster: address of a scheduler of dask whose workers simulate the tiles; None for this
            machine alone.
        posterior: draws of the rig's numbers, by ``supple identify --posterior``: over these the
            optimum of each score is spread.

    Returns:
        A summary that JSON can hold, and whether the map can be trusted.

    Raises:
        ValueError: for the first fault of the spec, the rig or the drive.
    """
    began = time.perf_counter()
    asked = _asked(path)
    provenance = asked.provenance(seed)
    from ..model.door import sha256_of, write_beside
    from ..optimize.sweep import sweep
    from ..optimize.sweep_file import open_sheet, publish
    from .spread import check_spread, spread_of

    draws = posterior and check_spread(posterior, asked.rig, [a.name for a in asked.task.axes])
    sheet, unfinished, ranges = None, None, ()
    if asked.spec.sensitivity is not None:
        from ..optimize.sensitivity import ranges_of

        ranges = ranges_of(asked.spec, asked.task.axes, asked.rig)
    with _workers(cluster) as workers:
        if out is not None:
            told = _told(asked, provenance)
            sheet, unfinished = open_sheet(out / "map.nc", asked.task, asked.unit, told)
        try:
            found = sweep(asked.task, sheet, tell, workers)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
    release_memory()
    result = {**_result(asked, found), "fidelity": asked.rig.fidelity}
    result["optima"] = {name: _optimum(asked, found, name) for name in found.scores}
    if ranges:
        result["sensitivity"] = _sensitivity(asked, ranges, seed)
    if draws and posterior:
        units = {k: v["unit"] for part in ("axes", "scores") for k, v in result[part].items()}
        result["spread"] = spread_of(found, draws, result["optima"], units)
        inputs = {**provenance["inputs"], str(posterior): sha256_of(posterior.read_bytes())}
        provenance = {**provenance, "inputs": inputs}
    if out is not None and unfinished is not None:
        from .surface_page import write_surfaces

        release_memory()
        written = write_surfaces(result, found, out)
        result["files"] = written
    seconds = round(time.perf_counter() - began, 3)
    result["provenance"] = {**provenance, "seconds": seconds}
    if out is not None and unfinished is not None:
        text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False)
        write_beside(out / "map.json", text + "\n")
        publish(unfinished, out / "map.nc")
    return result, result["status"] == "swept"


def _told(asked: Asked, provenance: Mapping[str, Any]) -> dict[str, str]:
    """What the map's file says of itself."""
    window = asked.task.window
    return {
        "title": "scores of every design of a grid",
        "Conventions": "CF-1.11",
        "rig": asked.rig.path.name,
        "drive": asked.drive.path.name,
        "sensor": asked.spec.of,
        "window": f"{window[0]!r} {window[1]!r} s",
        "provenance": json.dumps(provenance),
    }


def _workers(cluster: str | None) -> AbstractContextManager[Workers | None]:
    """The workers of a cluster, or none."""
    if cluster is None:
        return nullcontext()
    from ..optimize.sweep_cluster import cluster_at

    return cluster_at(cluster)


def _asked(path: Path) -> Asked:
    """Spec, rig and drive, read and fitted together."""
    start_engine()
    from ..model.rig import read_rig
    from ..optimize.sweep_spec import axes_of, read_spec

    spec = read_spec(path)
    rig = read_rig(spec.rig)
    return asked_of(spec, rig, axes_of(spec, rig), spec.scores)


def asked_of(spec: SweepSpec, rig: Rig, axes: tuple[Axis, ...], scores: tuple[str, ...]) -> Asked:
    """A spec with its rig and drive, fitted together.

    Args:
        spec: as read.
        rig: as read.
        axes: what varies.
        scores: what is wanted of every design.

    Returns:
        What a sweep or a search is asked for.

    Raises:
        ValueError: for the first fault of the drive, or of what does not fit together.
    """
    from ..model.door import fault
    from ..model.drive_file import read_drive
    from ..model.robot import PARAMETERS

    path, driven = spec.path, read_drive(spec.drive)
    import numpy as np

    from ..model.drives import drive_of
    from ..model.extended import acting_laws
    from ..model.mechanism import mechanism_of
    from ..optimize.sweep import SweepTask

    added = {axis.name: PARAMETERS[axis.name] for axis in axes if axis.name not in rig.parameters}
    rig = replace(rig, parameters={**rig.parameters, **added})
    mechanism = mechanism_of(rig, planar=True)
    try:
        acting = acting_laws(rig.laws, mechanism)
    except ValueError as error:
        raise ValueError(f"{rig.path}: {error}") from None
    if acting:
        law = f"'{acting[0].law.name}' at '{acting[0].place}'"
        mend = "sweep the rig without its laws"
        raise fault(rig.path, "[[laws]]", "a rig without laws that act", law, mend)
    count = round(driven.duration * driven.sample_rate)
    if count < 2:
        mend = "raise 'duration' or 'sample_rate'"
        raise fault(driven.path, "[times]", "two samples or more", str(count), mend)
    times = np.arange(count) / driven.sample_rate
    try:
        port = sensor_port(spec.of, rig, mechanism)
    except ValueError as error:
        text = str(error).replace("--sensor", "[sweep] of:", 1)
        raise ValueError(f"{path}: {text}") from None
    if "grip_displacement_peak" in scores and rig.kind == "chain":
        mend = "remove it, or write scores = ['peak'] with the place in 'of'"
        expected = "scores of a chain, which has no grip"
        named = "scores" if spec.grip_limit is None else "grip_limit"
        raise fault(path, f"[sweep] {named}", expected, "'grip_displacement_peak'", mend)
    window = spec.window or (0.0, float(times[-1]))
    numbers = {name: number.value for name, number in rig.parameters.items()}
    task = SweepTask(
        mechanism, numbers, drive_of(driven, mechanism), times, window, port, scores, axes,
        planar=rig.fidelity == "planar",
        grip_limit=spec.grip_limit if "grip_displacement_peak" in scores else None,
    )  # fmt: skip
    try:
        task.grid()
    except ValueError as error:
        raise ValueError(f"{path}: [sweep] {error}") from None
    return Asked(spec, rig, driven, task, _unit(port, rig))


def _unit(port: Port, rig: Rig) -> str:
    from ..model.chain import DERIVATIVES

    turns = port.quantity in TURNS or rig.motion == "rotation"
    return (
        "1"
        if port.quantity == "strain"
        else ("rad" if turns else "m") + _RATES[DERIVATIVES[port.quantity]]
    )


def _result(asked: Asked, found: Map) -> dict[str, Any]:
    """The map in words and numbers that JSON can hold."""
    import numpy as np

    from ..optimize.sweep_file import LONG_NAMES, unit_of

    task, scores = asked.task, {}
    for name, values in found.scores.items():
        finite = np.asarray(values)[np.isfinite(values)]
        scores[name] = {
            "unit": unit_of(name, asked.unit),
            "meaning": LONG_NAMES[name],
            "mean": float(finite.mean()) if finite.size else None,
            "lowest": _extreme(found, name, lowest=True),
            "highest": _extreme(found, name, lowest=False),
            "not_finite": int(np.size(values) - finite.size),
        }
    broken = [name for name in ("rms", "peak") if name in scores and scores[name]["not_finite"]]
    axes = {
        axis.name: {
            "unit": axis.unit,
            "count": len(axis.values),
            "lowest": float(axis.values.min()),
            "highest": float(axis.values.max()),
        }
        for axis in task.axes
    }
    return {
        "status": "not_finite" if broken else "swept",
        "rig": asked.rig.path.name,
        "drive": {"kind": asked.drive.kind, "place": asked.drive.place},
        "of": asked.spec.of,
        "window": list(task.window),
        "designs": task.count,
        "axes": axes,
        "scores": scores,
        "regions": {name: int(np.sum(marked)) for name, marked in found.regions.items()},
        **({} if task.grip_limit is None else {"grip_limit": task.grip_limit}),
        "tiles": {"all": task.tiles, "resumed": found.resumed},
    }


def _optimum(asked: Asked, found: Map, name: str) -> dict[str, Any] | None:
    """The certified optimum of a score, in words and numbers.

    None in the plane, where the thousand motions of a certificate would take a thousand seconds.
    """
    from ..optimize.optimum import certify
    from ..optimize.sweep_file import unit_of
    from .optimum_words import optimum_words

    one = None if found.task.planar else certify(found, name)
    if one is None:
        return None
    units = {axis.name: axis.unit for axis in found.task.axes} | {name: unit_of(name, asked.unit)}
    return {
        "status": one.status,
        "which": "lowest" if one.is_lowest else "highest",
        "value": one.value,
        "design": one.design,
        "on_grid": one.on_grid,
        "finer_grid": {"value": one.finer, "designs": one.finer_designs},
        "how": one.how,
        "bounds": one.bounds,
        "elasticity": one.elasticity,
        "curvature": None if one.curvature is None else one.curvature.tolist(),
        "one_percent": {key: list(ends) for key, ends in one.reach.items()},
        "shape": {key: one.sharpness(key) for key in one.design},
        "sentence": optimum_words(one, units),
    }


def _sensitivity(asked: Asked, ranges: tuple[Range, ...], seed: int) -> dict[str, Any]:
    """Sobol indices of all scores, as JSON can hold them."""
    from ..optimize.search_spec import axes_for
    from ..optimize.sensitivity import SAMPLES, sensitivity

    samples = (asked.spec.sensitivity or {}).get("samples", SAMPLES)
    task = asked_of(asked.spec, asked.rig, axes_for(ranges, ()), asked.task.scores).task
    held = {a.name: float(a.values[0]) for a in asked.task.axes if len(a.values) == 1}
    found = sensitivity(replace(task, numbers={**task.numbers, **held}), ranges, samples, seed)
    scores = {}
    for name, one in found.indices.items():
        scores[name] = {
            key: {
                "first": one.first[key],
                "first_interval": list(one.first_interval[key]),
                "total": one.total[key],
                "total_interval": list(one.total_interval[key]),
            }
            for key in one.first
        }
    told = {r.name: {"low": r.low, "high": r.high, "log": r.is_log, "unit": r.unit} for r in ranges}
    return {
        "samples": samples,
        "designs": found.designs,
        "parameters": told,
        "not_finite": found.not_finite,
        "scores": scores,
    }


def _extreme(found: Map, name: str, lowest: bool) -> dict[str, Any] | None:
    one = found.extreme(name, lowest)
    return None if one is None else {"value": one[1], "design": one[0]}


def show_map(result: Mapping[str, Any]) -> None:
    """Prints the best and the worst of each score as a table.

    Args:
        result: of `sweep_spec`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from .optimum_words import region_words

    console = Console(highlight=False, markup=False)
    console.print(
        f"{result['designs']} designs of {result['rig']} under a drive of kind "
        f"'{result['drive']['kind']}', scored by {result['of']}."
    )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in ("score", "", "value", "unit", "design"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    for name, one in result["scores"].items():
        for which in ("lowest", "highest"):
            if one[which] is not None:
                design = ", ".join(f"{k} {v:.5g}" for k, v in one[which]["design"].items())
                table.add_row(name, which, f"{one[which]['value']:.5g}", one["unit"], design)
    console.print(table)
    for one in result["optima"].values():
        if one is not None:
            console.print(one["sentence"])
    for one in result.get("spread", {"scores": {}})["scores"].values():
        console.print(one["sentence"])
    for line in region_words(result):
        console.print(line)
    if result["tiles"]["resumed"]:
        console.print(f"Taken up: {result['tiles']['resumed']} of {result['tiles']['all']} tiles.")
    if result["status"] != "swept":
        console.print("! Some designs have no finite score: look for a constant of the wrong size.")
