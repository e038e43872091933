"""Makes the decays of the study: one club of elements in a rigid collet and in three sleeves."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from .clubs import SLEEVES, Club, as_lumped
from .files import write_record, write_rig
from .finite import CLUB, STATIONS
from .gauges import Gauge
from .march import Loads
from .noise import draw_noise
from .runs import SUBSTEPS, Run, carry_out, channels

DEFAULT = Path(__file__).resolve().parents[2] / "studies" / "data" / "decays"
RIGID = 1e9  # N/m
RATE, COUNT, FIRST = 1024.0, 4096, 102
HOLD = 0.12  # m
DECIBELS, COLOUR, SEED = 34.0, {"rho": 0.4}, 7
GIVEN = 0.005  # relative standard deviation of the head's mass in the rig


def clubs() -> dict[str, Club]:
    """The four clubs by the names of their records; the first one's sleeve does not give."""
    gauge = Gauge("head_acc", "head", "m/s^2", RATE, {})
    club = Club("B", "fixed_collet", CLUB, np.zeros(STATIONS), (), {}, {}, (gauge,), RATE, COUNT)
    sleeves = {"rigid": (RIGID, 0.0), **dict(zip(("soft_00", "soft_25", "soft_50"), SLEEVES["B"]))}
    return {
        name: replace(club, truth={**CLUB, "sleeve_stiffness": k, "sleeve_damping": c})
        for name, (k, c) in sleeves.items()
    }


def make_decays(folder: Path) -> dict[str, dict[str, float]]:
    """Writes four records and their rig; returns what a lab would find for each club [SI]."""
    folder.mkdir(parents=True, exist_ok=True)
    chance, lumped = np.random.default_rng(SEED), {}
    for name, club in clubs().items():
        loads = Loads.none((COUNT - FIRST - 1) * SUBSTEPS + 1)
        run = Run(name, "decay", "train", HOLD, loads, FIRST, HOLD, told_at=True)
        values = channels(club, run, *carry_out(club, run))["head_acc"]
        std = float(np.sqrt(np.mean(values[FIRST:] ** 2))) * 10 ** (-DECIBELS / 20)
        seen = values + draw_noise("ar1", std, values, chance, COLOUR)
        lumped[name] = as_lumped(club)
        record: dict[str, object] = {"test": "decay", "rig": "rig.toml", "sample_rate": RATE}
        tables: dict[str, dict[str, object]] = {
            "record": record,
            "channels.time": {"column": "time", "unit": "s"},
            "channels.head_acc": {
                "column": "head_acc", "unit": "m/s^2", "role": "response",
                "quantity": "acceleration", "place": "clubhead", "frame": "absolute",
            },
            "start": {"at": FIRST / RATE},
        }  # fmt: skip
        if name == "rigid":
            tables["parameters"] = {"sleeve_stiffness": 1e8, "sleeve_damping": 0.0}
        write_record(folder, name, RATE, {"head_acc": seen}, tables, 5)
    _write_rig(folder, lumped["rigid"])
    return lumped


def _write_rig(folder: Path, rigid: dict[str, float]) -> None:
    head = rigid["clubhead_mass"]
    own = {"free": True, "per": "record"}
    write_rig(
        folder / "rig.toml",
        {
            "rig": {"kind": "robot", "model": "fixed_collet", "preset": "robo_v"},
            "parameters": {
                "clubhead_mass": {"value": head, "std": GIVEN * head},
                "shaft_stiffness": {"value": 120.0, "free": True},
                "shaft_damping": {"value": 0.1, "free": True},
                "sleeve_stiffness": {"value": 90e3, "min": 5e3, "max": 2e6, **own},
                "sleeve_damping": {"value": 1500.0, "min": 0.0, **own},
            },
        },
    )


def main() -> None:
    """Command line: `python -m tests.lab.decays [FOLDER]`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=DEFAULT)
    for name, numbers in make_decays(parser.parse_args().folder).items():
        told = ("shaft_stiffness", "shaft_damping", "sleeve_stiffness", "sleeve_damping")
        print(name, {key: float(f"{numbers[key]:.5g}") for key in told})


if __name__ == "__main__":
    main()
