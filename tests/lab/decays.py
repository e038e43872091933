"""Makes the decays of the study: one club of lumped bodies, clamped and in three sleeves."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from .bodies import ROBO_V
from .clubs import SLEEVES, Club
from .files import write_record, write_rig
from .gauges import Gauge
from .march import Loads
from .noise import draw_noise
from .runs import SUBSTEPS, Run, carry_out, channels

DEFAULT = Path(__file__).resolve().parents[2] / "studies" / "data" / "decays"
TRUTH = {**ROBO_V, "shaft_stiffness": 143.6, "shaft_damping": 0.0742}
CLAMPED = (1e8, 0.0)  # a sleeve that does not give, N/m and N s/m
RATE, COUNT, FIRST = 1024.0, 4096, 102
HOLD = 0.12  # m
DECIBELS, COLOUR, SEED = 34.0, {"rho": 0.4}, 7
GIVEN = 0.005  # relative standard deviation of the head's mass in the rig


def clubs() -> dict[str, Club]:
    """The four clubs by the names of their records; the first one's sleeve does not give."""
    gauge = Gauge("head_acc", "head", "m/s^2", RATE, {})
    club = Club("A", "fixed_collet", TRUTH, np.zeros(1), (), {}, {}, (gauge,), RATE, COUNT)
    sleeves = {"clamped": CLAMPED}
    sleeves |= dict(zip(("sleeve_00", "sleeve_25", "sleeve_50"), SLEEVES["A"], strict=True))
    return {
        name: replace(club, truth={**TRUTH, "sleeve_stiffness": k, "sleeve_damping": c})
        for name, (k, c) in sleeves.items()
    }


def make_decays(folder: Path) -> None:
    """Writes four records and their rig."""
    folder.mkdir(parents=True, exist_ok=True)
    chance = np.random.default_rng(SEED)
    for name, club in clubs().items():
        loads = Loads.none((COUNT - FIRST - 1) * SUBSTEPS + 1)
        run = Run(name, "decay", "train", HOLD, loads, FIRST, HOLD, told_at=True)
        values = channels(club, run, *carry_out(club, run))["head_acc"]
        std = float(np.sqrt(np.mean(values[FIRST:] ** 2))) * 10 ** (-DECIBELS / 20)
        seen = values + draw_noise("ar1", std, values, chance, COLOUR)
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
        if name == "clamped":
            tables["parameters"] = dict(zip(("sleeve_stiffness", "sleeve_damping"), CLAMPED))
        write_record(folder, name, RATE, {"head_acc": seen}, tables, 5)
    head = TRUTH["clubhead_mass"]
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
    make_decays(parser.parse_args().folder)


if __name__ == "__main__":
    main()
