"""Draws a case by its seed: records, sidecars and rig for the user; the truth is sealed."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import noise as noises
from .detect import visibility
from .effects import NOTHING, Effect, causes, draw_strength, size_effect, twin_values
from .files import seal, write_record, write_rig
from .plants import UNITS, Plant, draw_chain, draw_club, rig_tables
from .trials import Trial, draw_trials, run_trial

BENCHES = ("chain", "fixed_collet", "pinned_wrist")


@dataclass(frozen=True)
class Case:
    """A drawn case: paths of what the user gets, and the truth that the user does not."""

    folder: Path
    rig: Path
    train: tuple[Path, ...]
    held_out: tuple[Path, ...]
    truth: dict


def draw_case(
    folder: Path,
    seed: int,
    bench: str = "chain",
    effect: str | None = None,
    place: str | None = None,
    noise: str = "white",
    snr_db: float = 30.0,
    records: int = 3,
    held_out: int = 1,
    strength: float | None = None,
    noise_law: dict[str, float] | None = None,
) -> Case:
    """Writes the records of a random plant, with or without a hidden effect.

    Args:
        folder: where to write; made if absent. The truth goes to `folder/sealed/truth.json`.
        seed: the case; the same arguments give the same bytes.
        bench: chain, fixed_collet or pinned_wrist.
        effect: a law of the bench, "any" for a random one, None for a clean case.
        place: where it sits; drawn if None.
        noise: white, ar1, ar2, heteroscedastic, heavy_tailed, outliers or quantised.
        snr_db: each channel's rms over its noise's [dB].
        records: how many to train on.
        held_out: how many to hold out, of another amplitude or kind.
        strength: of the effect, as `effects.WEAKEST` defines it [1]; drawn if None.
        noise_law: parameters of the noise, for instance {"rho": 0.9}; drawn if None.

    Raises:
        ValueError: if the bench, effect, place or noise is not known.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    plant = _draw_plant(_chance(seed, "plant", bench), bench, effect)
    rng = _chance(seed, "effect", str(effect), str(place))
    law, place = _choose(plant, effect, place, rng)
    if law == "gravity":
        plant = replace(plant, amplitude=float(np.exp(rng.uniform(np.log(0.3), np.log(1.5)))))
    zero = twin_values(plant, law, place)
    if zero:
        free = tuple(name for name in plant.free if name not in zero)
        plant = replace(plant, truth={**plant.truth, **zero}, free=free)
    trials = draw_trials(
        plant, _chance(seed, "trials"), records, held_out, from_rest=law == "sensor_delay"
    )
    hidden = NOTHING
    if law:
        strength = draw_strength(law, rng) if strength is None else float(strength)
        twins = [run_trial(plant, trial, plant.machine()) for trial in trials]
        hidden = size_effect(plant, law, place, strength, twins, rng)
    noise_rng = _chance(seed, "noise", noise)
    told = noises.draw_law(noise, noise_rng) if noise_law is None else noise_law
    return write_case(
        folder,
        plant,
        trials,
        hidden,
        noise,
        snr_db,
        told,
        noise_rng,
        held=zero,
        facts={"bench": bench, "seed": seed},
    )


def _chance(seed: int, *purpose: str) -> np.random.Generator:
    """A source of chance for one purpose, so that a clean case is the twin of a hidden one."""
    return np.random.default_rng([seed, zlib.crc32("/".join(purpose).encode())])


def _draw_plant(rng: np.random.Generator, bench: str, effect: str | None) -> Plant:
    if bench not in BENCHES:
        raise ValueError(f"bench {bench!r}: expected one of {BENCHES}")
    if bench != "chain":
        return draw_club(rng, bench)
    return draw_chain(rng, "rotation", masses=1) if effect == "gravity" else draw_chain(rng)


def _choose(plant: Plant, effect, place, rng: np.random.Generator) -> tuple[str, str]:
    if effect is None:
        return "", ""
    pairs = [
        (law, spot)
        for law, spot in causes(plant)
        if effect == law or (effect == "any" and law != "gravity")
    ]
    pairs = [pair for pair in pairs if place in (None, pair[1])]
    if not pairs:
        raise ValueError(f"{effect} @ {place}: expected one of {causes(plant)}")
    laws = sorted({pair[0] for pair in pairs})
    law = str(rng.choice(laws))
    spots = [pair[1] for pair in pairs if pair[0] == law]
    return law, str(rng.choice(spots))


def write_case(
    folder: Path,
    plant: Plant,
    trials: list[Trial],
    hidden: Effect,
    noise: str,
    snr_db: float,
    noise_law: dict[str, float],
    rng: np.random.Generator,
    held: dict[str, float] | None = None,
    facts: dict | None = None,
    digits: int = 8,
    sealed: bool = True,
) -> Case:
    """Runs the trials with the hidden effect and writes records, rig and truth."""
    shown = [_read(plant, trial, hidden) for trial in trials]
    levels = [
        {
            name: float(np.sqrt(np.mean(values[_alive(trial) :] ** 2))) * 10 ** (-snr_db / 20)
            for name, values in channels.items()
        }
        for trial, channels in zip(trials, shown, strict=True)
    ]
    paths = []
    for trial, channels, level in zip(trials, shown, levels, strict=True):
        noisy = {
            name: values + noises.draw_noise(noise, level[name], values, rng, noise_law)
            for name, values in channels.items()
        }
        paths.append(_write_trial(folder, plant, trial, noisy, digits))
    rig = write_rig(folder / "rig.toml", rig_tables(plant, held or {}))
    truth = {**(facts or {}), **_effect_facts(plant, hidden)}
    trained = [index for index, trial in enumerate(trials) if trial.split == "train"]
    if hidden is not NOTHING:
        tests = [trials[index] for index in trained]
        clean = [_read(plant, trial, NOTHING) for trial in tests]
        seen, std = [shown[index] for index in trained], [levels[index] for index in trained]
        truth["visibility"] = visibility(plant, hidden, tests, clean, seen, std, snr_db)
    truth["noise"] = {"kind": noise, "snr_db": snr_db, "law": noise_law}
    constants = {**plant.truth, **dict(hidden.changes)}
    truth["constants"] = {name: float(value) for name, value in constants.items()}
    truth["free"] = list(plant.free)
    truth["records"] = [
        {"name": trial.name, "test": trial.test, "amplitude": trial.amplitude, "noise_std": level}
        for trial, level in zip(trials, levels, strict=True)
    ]
    if sealed:
        seal(folder, truth)
    train = tuple(paths[index] for index in trained)
    rest = tuple(path for path in paths if path not in train)
    return Case(folder, rig, train, rest, truth)


def _alive(trial: Trial) -> int:
    """First sample that counts for the rms: after a hold, a release or a blow."""
    if trial.test == "impact":
        return int(np.flatnonzero(trial.loads.any(axis=1))[-1]) + 1
    return trial.first


def _read(plant: Plant, trial: Trial, hidden: Effect) -> dict[str, np.ndarray]:
    """The channels without noise, the sensors' own effects included."""
    machine = hidden.machine(plant)
    moved = run_trial(plant, trial, machine, hidden.laws)
    channels = {sensor.name: sensor.read(moved) for sensor in plant.sensors}
    if hidden.delay:
        late = run_trial(plant, trial, machine, hidden.laws, hidden.delay)
        sensor = next(item for item in plant.sensors if item.name == hidden.channel)
        channels[sensor.name] = sensor.read(late)
    elif hidden.channel:
        sensor = next(item for item in plant.sensors if item.name == hidden.channel)
        channels[sensor.name] = channels[sensor.name] + hidden.size * UNITS[sensor.unit]
    return channels


PARAMETERS = {
    "cubic_stiffness": ("stiffness", "N/m^3", "N m/rad^3"),
    "asymmetric_stiffness": ("stiffness", "N/m", "N m/rad"),
    "coulomb_friction": ("force", "N", "N m"),
    "quadratic_damping": ("damping", "N s^2/m^2", "N m s^2/rad^2"),
    "clearance": ("gap", "m", "rad"),
    "linear_damping": ("damping", "N s/m", "N m s/rad"),
    "gravity": ("torque", "N m", "N m"),
    "sensor_offset": ("offset", "SI", "SI"),
    "sensor_delay": ("delay", "s", "s"),
}


def _effect_facts(plant: Plant, hidden: Effect) -> dict:
    if hidden is NOTHING:
        return {"law": None, "place": None}
    name, straight, turning = PARAMETERS[hidden.law]
    turns = hidden.place == "wrist" or plant.layout.get("motion") == "rotation"
    return {
        "law": hidden.law,
        "place": hidden.place,
        "channel": hidden.channel or None,
        "strength": hidden.strength,
        "parameters": {name: {"value": hidden.size, "unit": turning if turns else straight}},
    }


def _write_trial(
    folder: Path, plant: Plant, trial: Trial, channels: dict[str, np.ndarray], digits: int
) -> Path:
    turning = plant.layout.get("motion") == "rotation"
    unit = "N m" if turning else "N"
    record = {"test": trial.test, "rig": "rig.toml", "sample_rate": plant.rate}
    tables: dict[str, dict[str, object]] = {"record": {**record, "split": trial.split}}
    tables["channels.time"] = {"column": "time", "unit": "s"}
    columns = dict(channels)
    for sensor in plant.sensors:
        tables[f"channels.{sensor.name}"] = {
            "column": sensor.name,
            "unit": sensor.unit,
            "role": "response",
            "quantity": sensor.quantity,
            "place": sensor.place,
            "frame": sensor.frame,
        }
    if trial.told_force:
        columns["push"] = trial.loads[:, plant.machine().body(plant.head)]
        tables["channels.push"] = {
            "column": "push",
            "unit": unit,
            "role": "input",
            "quantity": "torque" if turning else "force",
            "place": plant.head,
        }
    if trial.told_at:
        tables["start"] = {"at": trial.first / plant.rate}
    return write_record(folder, trial.name, plant.rate, columns, tables, digits)
