"""How visible a hidden effect is: against its twin, and after free constants took their share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .effects import Effect, twin_values
from .motion import simulate
from .plants import Plant
from .trials import Trial, run_trial

STEP = 1e-4  # relative step of the numerical differences


def visibility(
    plant: Plant,
    effect: Effect,
    trials: list[Trial],
    clean: list[dict[str, np.ndarray]],
    shown: list[dict[str, np.ndarray]],
    noise: list[dict[str, float]],
    snr_db: float,
) -> dict[str, float]:
    """Detectability of an effect in the train records.

    Args:
        plant: the plant without the effect.
        effect: what is hidden.
        trials: the tests of the train records.
        clean: channels of the twin without the effect, one dict a trial.
        shown: the same channels with the effect, before noise.
        noise: standard deviation of each channel's noise.
        snr_db: each channel's rms over its noise's [dB]; blows themselves do not count in it.

    Returns:
        `rms` of the change in noise units, its `norm`, its `energy_share` of the records; and the
        `projected_norm` and `projected_energy_share` left when the rig's free constants and the
        start states have taken theirs (to first order, about the twin).
    """
    names = [sensor.name for sensor in plant.sensors]
    first = [trial.first for trial in trials]

    def stack(rows: list[dict[str, np.ndarray]]) -> np.ndarray:
        parts = [
            row[name][skip:] / std[name]
            for row, std, skip in zip(rows, noise, first, strict=True)
            for name in names
        ]
        return np.concatenate(parts)

    base = stack(clean)
    change = stack(shown) - base
    columns = _constant_columns(plant, effect, trials, base, stack) + _start_columns(
        plant, effect, trials, noise
    )
    matrix = np.column_stack([column / np.linalg.norm(column) for column in columns])
    left = change - matrix @ np.linalg.lstsq(matrix, change, rcond=1e-10)[0]
    energy = len(change) * 10 ** (snr_db / 10)
    return {
        "rms": float(np.sqrt(np.mean(change**2))),
        "norm": float(np.linalg.norm(change)),
        "energy_share": float(np.sum(change**2) / energy),
        "projected_norm": float(np.linalg.norm(left)),
        "projected_energy_share": float(np.sum(left**2) / energy),
    }


def _constant_columns(plant, effect, trials, base, stack) -> list[np.ndarray]:
    zero = twin_values(plant, effect.law, effect.place)
    columns = []
    for name in plant.free:
        value = plant.truth[name]
        machine = plant.machine({**zero, name: value * (1 + STEP)})
        rows = []
        for trial in trials:
            moved = run_trial(plant, replace(trial, release=False), machine)
            rows.append({sensor.name: sensor.read(moved) for sensor in plant.sensors})
        column = (stack(rows) - base) / STEP
        if np.linalg.norm(column) > 0:
            columns.append(column)
    return columns


def _start_columns(plant, effect, trials, noise) -> list[np.ndarray]:
    machine = plant.machine(twin_values(plant, effect.law, effect.place))
    size = 2 * len(machine.bodies)
    lengths = [(plant.count - trial.first) * len(plant.sensors) for trial in trials]
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    loads = np.zeros((plant.count, size // 2))
    columns = []
    for unit in np.eye(size):
        moved = simulate(machine, (), unit, loads, plant.rate)
        for index, trial in enumerate(trials):
            column = np.zeros(offsets[-1])
            parts = [
                sensor.read(moved)[: plant.count - trial.first] / noise[index][sensor.name]
                for sensor in plant.sensors
            ]
            column[offsets[index] : offsets[index + 1]] = np.concatenate(parts)
            if np.linalg.norm(column) > 0:
                columns.append(column)
    return columns
