"""Makes the demonstration's records: a club on a flexible wrist that has dry friction."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from .bodies import ROBO_V
from .draw import Case, write_case
from .effects import Effect
from .motion import Law
from .plants import club, club_sensor
from .trials import decay, impact

DEFAULT = Path(__file__).resolve().parents[2] / "studies" / "data" / "demo"
FRICTION = 0.22  # N m
TRUTH = {
    **ROBO_V,
    "shaft_stiffness": 146.3,
    "shaft_damping": 0.0921,
    "sleeve_stiffness": 55.4e3,
    "sleeve_damping": 1610.0,
    "wrist_stiffness": 281.0,
    "wrist_damping": 4.6,
}
TOLD = {
    "shaft_stiffness": 139.0,
    "shaft_damping": 0.0807,
    "sleeve_stiffness": 60.0e3,
    "sleeve_damping": 1470.0,
    "wrist_stiffness": 300.0,
    "wrist_damping": 5.0,
}
DECIBELS = 34.0
COLOUR = {"rho": 0.35}
SEED = 20


def make_demo(folder: Path) -> Case:
    """Writes three records to learn from, two held out, and the rig; no sealed truth."""
    folder.mkdir(parents=True, exist_ok=True)
    bench = "pinned_wrist"
    sensors = (
        club_sensor(bench, TRUTH, "head", "m/s^2"),
        club_sensor(bench, TRUTH, "wrist", "deg"),
    )
    plant = club(bench, TRUTH, tuple(TOLD), TOLD, sensors, rate=1024.0, count=2048)
    trials = [
        replace(decay(plant, 0.15), name="release_150mm"),
        replace(impact(plant, 0.10, 64, told_force=False), name="blow_strong"),
        replace(impact(plant, 0.04, 64, told_force=False), name="blow_soft"),
        replace(decay(plant, 0.09), name="held_out_release_090mm", split="held_out"),
        replace(impact(plant, 0.03, 64, told_force=False), name="held_out_blow", split="held_out"),
    ]
    wrist = plant.machine().places["wrist"][0]
    law = Law("coulomb_friction", wrist, FRICTION)
    hidden = Effect("coulomb_friction", "wrist", 0.0, FRICTION, (law,))
    rng = np.random.default_rng(SEED)
    noise = ("ar1", DECIBELS, COLOUR)
    return write_case(folder, plant, trials, hidden, *noise, rng, digits=6, sealed=False)


def main() -> None:
    """Command line: `python -m tests.lab.demo [FOLDER]`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=DEFAULT)
    case = make_demo(parser.parse_args().folder)
    shown = {key: float(f"{value:.3g}") for key, value in case.truth["visibility"].items()}
    print(f"{len(case.train) + len(case.held_out)} records in {case.folder}; {shown}")


if __name__ == "__main__":
    main()
