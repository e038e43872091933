"""How does this rig move under that drive? One motion, as a table of curves."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import start_engine

if TYPE_CHECKING:
    from ..model.drive_file import DriveSpec
    from ..model.linear import Mechanism, Port
    from ..model.motion import Motion
    from ..model.rig import Rig
    from ..model.sensors import Sensor

FRAMES = ("absolute", "collet")
MOVES = ("position", "velocity", "acceleration")
TURNS = ("angle", "angular_velocity", "angular_acceleration")
_RATES = ("", "/s", "/s^2")


def simulate_rig(
    rig_path: Path,
    drive_path: Path,
    sensors: Sequence[str] = (),
    out: Path | None = None,
    seed: int = 0,
    sensors_path: Path | None = None,
) -> tuple[dict[str, Any], bool]:
    """Simulates one motion and writes ``motion.csv``.

    Args:
        rig_path: the rig; laws that a diagnosis added to it are in force, those of a sensor where
            a sensor of that name is asked for.
        drive_path: the drive.
        sensors: ``PLACE:QUANTITY:FRAME`` each, or ``NAME=PLACE:QUANTITY:FRAME``.
        out: folder for ``motion.csv``; nothing is written where None.
        seed: kept in the provenance; nothing here is drawn by chance.
        sensors_path: a file of sensors with their faults.

    Returns:
        A summary that JSON can hold, and whether the motion can be trusted.

    Raises:
        ValueError: for the first fault of the rig, the drive or a sensor.
    """
    from ..model.door import write_beside
    from ..model.drive_file import read_drive
    from ..model.rig import read_rig

    began = time.perf_counter()
    rig, spec = read_rig(rig_path), read_drive(drive_path)
    start_engine()
    import numpy as np

    from ..model.drives import drive_of
    from ..model.extended import acting_laws
    from ..model.mechanism import mechanism_of
    from ..model.motion import CONVERGED, respond
    from ..model.planar_motion import respond_planar
    from ..model.robot import Robot
    from ..model.sensors import loaded, readings, seen_ports, with_laws

    mechanism = mechanism_of(rig, planar=True)
    asked, files = _asked(sensors, sensors_path, rig, mechanism)
    drive = drive_of(spec, mechanism)
    count = round(spec.duration * spec.sample_rate)
    at_fault = rig.path
    try:
        acting = acting_laws(rig.laws, mechanism)
        bench, loads, used = with_laws(asked, rig.laws, mechanism)
        numbers = loaded({name: n.value for name, n in rig.parameters.items()}, loads)
        at_fault = spec.path
        times, ports = np.arange(count) / spec.sample_rate, seen_ports(bench)
        if isinstance(mechanism, Robot) and rig.fidelity == "planar":
            motion = respond_planar(mechanism, numbers, drive, times, ports, rig.laws)
        else:
            motion = respond(mechanism, numbers, drive, times, ports, rig.laws)
        columns = _columns(motion, readings(bench, mechanism, numbers, drive, motion))
    except ValueError as error:
        raise ValueError(f"{at_fault}: {error}") from None
    if out is not None:
        write_beside(out / "motion.csv", csv_text(columns))
    units = _units(rig, motion) | {sensor.name: _unit(sensor.port) for sensor in bench}
    forced = [{"law": a.law.name, "place": a.place, "strength": a.strength} for a in acting]
    own = {sensor.name: len(sensor.effects) for sensor in asked}
    faulty = [_shown(rig.laws[index]) for index in used]
    result = {
        "status": motion.status,
        "sentence": motion.sentence,
        "rig": rig.path.name,
        "model": rig.model or "chain",
        "fidelity": rig.fidelity,
        "drive": {"kind": spec.kind, "place": spec.place},
        "samples": len(motion.times),
        "sample_rate": spec.sample_rate,
        "laws": [*forced, *faulty],
        "laws_passed_over": _passed_over(rig, [*forced, *faulty]),
        "sensors": [_described(sensor, own[sensor.name]) for sensor in bench],
        "error": None if np.isinf(motion.error) else motion.error,
        "columns": {name: _seen(values, units[name]) for name, values in columns.items()},
        "provenance": _provenance(rig, spec, files, seed, began),
    }
    return result, motion.status == CONVERGED


def _asked(
    texts: Sequence[str], path: Path | None, rig: Rig, mechanism: Mechanism
) -> tuple[tuple[Sensor, ...], dict[str, str]]:
    """The sensors that are asked for, and the SHA-256 of the file that some come from."""
    from ..model.sensor_file import read_sensors
    from ..model.sensors import plain_sensor

    asked, files = [], {}
    if path is not None:
        listed, files[str(path)] = read_sensors(path)
        for sensor in listed:
            port = sensor.port
            text = f"{port.place}:{port.quantity}:{port.frame}"
            sensor_port(text, rig, mechanism, f"{path}: [sensors.{sensor.name}]")
            asked.append(sensor)
    for text in texts:
        name, _, port = text.rpartition("=")
        asked.append(plain_sensor(sensor_port(port, rig, mechanism), name.strip()))
    names = [sensor.name for sensor in asked]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(
            f"--sensor '{twice}': expected sensors of different names, found it twice. "
            "Mend: write NAME=PLACE:QUANTITY:FRAME, or ask for it once."
        )
    return tuple(asked), files


def _columns(motion: Motion, seen: Mapping[str, Any]) -> dict[str, Any]:
    """Every curve by its name, those of the sensors last [SI]."""
    bare = replace(motion, sensors=(), samples=motion.samples[:, :0]).columns()
    twice = next((name for name in seen if name in bare), None)
    if twice is not None:
        raise ValueError(
            f"sensor '{twice}': expected a name that no other column has, found one. "
            "Mend: rename it."
        )
    return bare | dict(seen)


def _described(sensor: Sensor, own: int) -> dict[str, Any]:
    """A sensor as JSON holds it; the first `own` of its effects are its own."""
    effects = [
        {
            "law": effect.law.name,
            "strength": effect.strength,
            "shapes": {
                shape.symbol: value
                for shape, value in zip(effect.law.shapes, effect.shapes, strict=True)
            },
            "of": "sensor" if index < own else "rig",
        }
        for index, effect in enumerate(sensor.effects)
    ]
    port = sensor.port
    return {
        "name": sensor.name, "place": port.place, "quantity": port.quantity, "frame": port.frame,
        "scale": sensor.scale, "rate": sensor.rate, "quantum": sensor.quantum, "effects": effects,
    }  # fmt: skip


def _shown(table: Mapping[str, Any]) -> dict[str, Any]:
    """A law of a sensor as it is listed among those in force."""
    from ..model.law import library

    entry = table["parameters"][library()[str(table["law"])].symbol]
    strength = float(entry["value"] if isinstance(entry, Mapping) else entry)
    return {"law": str(table["law"]), "place": str(table["place"]), "strength": strength}


def csv_text(columns: Mapping[str, Any]) -> str:
    """A table as CSV with every digit that the numbers have.

    Args:
        columns: arrays of one length [SI] by name.

    Returns:
        A header and one line a sample.
    """
    import numpy as np

    rows = np.stack(list(columns.values()), axis=1).tolist()
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    return "\n".join(lines) + "\n"


def sensor_port(text: str, rig: Rig, mechanism: Mechanism, told: str = "") -> Port:
    """A sensor as it is asked for, checked against the rig.

    Args:
        text: ``PLACE:QUANTITY:FRAME``.
        rig: tells the places.
        mechanism: tells what turns and what moves.
        told: where it stands in a file, for the message; the command line where empty.

    Returns:
        Where it sits and what it sees [-].

    Raises:
        ValueError: where the rig has no such sensor.
    """
    from ..model.door import nearest, one_of
    from ..model.linear import Port

    def refuse(expected: str, found: str, mend: str) -> ValueError:
        line = (
            f"{told or f'--sensor {text!r}'}: expected {expected}, found '{found}'. Mend: {mend}."
        )
        return ValueError(" ".join(line.split()))

    parts = text.split(":")
    if len(parts) != 3:
        mend = "write one such as clubhead:acceleration:collet"
        raise refuse("PLACE:QUANTITY:FRAME", text, mend)
    place, quantity, frame = parts
    known = sensor_quantities(rig, mechanism)
    for expected, found in ((known, place), (known.get(place, ()), quantity), (FRAMES, frame)):
        if found not in expected:
            like = nearest(found, expected) or next(iter(expected))
            raise refuse(f"{one_of(expected)} in {rig.path.name}", found, f"write '{like}'")
    if rig.kind == "chain" and frame != "absolute":
        raise refuse("'absolute': a chain has no collet", frame, "write 'absolute'")
    return Port(place, quantity, frame)


def sensor_quantities(rig: Rig, mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """What can be seen at each place of a rig [-]."""
    if rig.kind == "chain":
        seen = TURNS if rig.motion == "rotation" else (*MOVES, "deflection")
        return dict.fromkeys(mechanism.law_places(), seen)
    bend = ("deflection", "strain")
    found: dict[str, tuple[str, ...]]
    found = {"clubhead": (*MOVES, *bend), "grip": (*MOVES, *TURNS), "shaft": bend}
    if "collet_angle" in mechanism.coordinates:
        on_arm = "arm" in mechanism.grounds
        seen = (*TURNS, *MOVES) if on_arm else TURNS
        found |= {"collet": seen, "wrist": seen, "hand": seen}
        found |= {"arm": TURNS} if on_arm else {}
    return found


def _units(rig: Rig, motion: Motion) -> dict[str, str]:
    units = {"time": "s"}
    for name in motion.names:
        turns = rig.motion == "rotation" or (rig.kind == "robot" and name.endswith("angle"))
        for ending, rate in zip(("", "_velocity", "_acceleration"), _RATES, strict=True):
            units[name + ending] = ("rad" if turns else "m") + rate
    return units


def _unit(port: Port) -> str:
    """SI unit of what a sensor sees [-]."""
    from ..model.chain import DERIVATIVES

    base = "rad" if port.quantity in TURNS else "m"
    return "1" if port.quantity == "strain" else base + _RATES[DERIVATIVES[port.quantity]]


def _seen(values: Any, unit: str) -> dict[str, Any]:
    return {
        "unit": unit,
        "lowest": float(values.min()),
        "highest": float(values.max()),
        "rms": float((values**2).mean() ** 0.5),
    }


def _passed_over(rig: Rig, forced: list[dict[str, Any]]) -> list[dict[str, str]]:
    """Laws of sensors that nobody asked for."""
    used = {(each["law"], each["place"]) for each in forced}
    listed = [{"law": str(law["law"]), "place": str(law["place"])} for law in rig.laws]
    return [law for law in listed if (law["law"], law["place"]) not in used]


def _provenance(
    rig: Rig, spec: DriveSpec, files: Mapping[str, str], seed: int, began: float
) -> dict[str, Any]:
    from .. import __version__
    from ..model.door import sha256_of

    inputs = {str(rig.path): rig.sha256, str(spec.path): spec.sha256, **files}
    if spec.file is not None:
        inputs[str(spec.file)] = sha256_of(spec.file.read_bytes())
    seconds = round(time.perf_counter() - began, 3)
    return {"version": __version__, "inputs": inputs, "seed": seed, "seconds": seconds}


def show_motion(result: Mapping[str, Any]) -> None:
    """Prints what moved, and how far, as a table.

    Args:
        result: of `simulate_rig`.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    drive = result["drive"]
    console.print(
        f"{result['rig']} ({result['model']}) under a drive of kind '{drive['kind']}' at "
        f"'{drive['place']}': {result['samples']} samples at {result['sample_rate']:.6g} Hz."
    )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("curve", overflow="fold")
    for heading in ("lowest", "highest", "rms"):
        table.add_column(heading, justify="right")
    table.add_column("unit")
    for name, one in result["columns"].items():
        if name != "time":
            figures = (f"{one[key]:.5g}" for key in ("lowest", "highest", "rms"))
            table.add_row(name, *figures, one["unit"])
    console.print(table)
    for law in result["laws"]:
        console.print(f"In force: {law['law']} of {law['strength']:.5g} at '{law['place']}'.")
    for law in result["laws_passed_over"]:
        console.print(
            f"! Passed over: {law['law']} of '{law['place']}', of which no sensor was asked for: "
            f"add --sensor {law['place']}=PLACE:QUANTITY:FRAME."
        )
    for sensor in result["sensors"]:
        for effect in sensor["effects"]:
            if effect["of"] == "sensor":
                more = "".join(f", {key} {x:.5g}" for key, x in effect["shapes"].items())
                told = f"{effect['law']} of {effect['strength']:.5g}{more}"
                console.print(f"In force: {told} at '{sensor['name']}'.")
    if result["status"] != "converged":
        console.print(f"! {result['sentence']}")
