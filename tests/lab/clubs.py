"""Draws the clubs of benches A and B: their true constants, their instruments, the rig as told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .bodies import ROBO_V, levers
from .finite import CLUB, STATIONS, clamped, finite_club, head_mass
from .gauges import TO_FILE, Gauge
from .structure import Structure, lumped

MODELS = ("fixed_collet", "pinned_wrist", "driven_wrist")
RATE, COUNT = 2048.0, 4096
ROBOT_RATE = 250.0
RESOLUTION = 0.01  # of the robot's angles [deg]
REACH = 0.15  # how far a hand pulls the head [m]

# Sleeves of 0, 25 and 50 % deadener: stiffness and damping of one of the four lumped elements.
# Those of the distributed sleeve bring the club of elements near the frequencies of 3.64, 3.55 and
# 3.08 Hz and the damping ratios of 2, 8 and 11 % that the thesis measured (line 1060).
SLEEVES = {
    "A": ((172e3, 950.0), (120e3, 3010.0), (60e3, 1470.0)),
    "B": ((600e3, 6600.0), (160e3, 7000.0), (77e3, 2900.0)),
}
SPREAD = 0.2  # of stiffness and damping, evenly to both sides
STD = {"clubhead_mass": 0.01, "collet_inertia": 0.02, "club_length": 0.003}  # relative


@dataclass(frozen=True)
class Club:
    """A club on its bench; `truth` are its true constants, `told` what the rig says of them."""

    bench: str
    model: str
    truth: Mapping[str, float]
    scatter: np.ndarray
    free: tuple[str, ...]
    told: Mapping[str, float]
    known: Mapping[str, float]  # standard deviation of what is held, by name [SI]
    gauges: tuple[Gauge, ...]
    rate: float = RATE
    count: int = COUNT

    def structure(self, changes: Mapping[str, float] | None = None) -> Structure:
        """The linear structure, with some true constants changed."""
        numbers = {**self.truth, **(changes or {})}
        if self.bench == "A":
            return lumped(numbers, self.model)
        return finite_club(numbers, self.model, self.scatter)

    def gauge(self, name: str) -> Gauge:
        """The instrument of that name."""
        return next(item for item in self.gauges if item.name == name)


def draw_scattered_club(
    rng: np.random.Generator, bench: str, model: str, count: int = COUNT
) -> Club:
    """A club of bench A or B whose true constants are scattered about the thesis's.

    Raises:
        ValueError: if there is no such bench or model.
    """
    if bench not in SLEEVES or model not in MODELS:
        raise ValueError(f"{bench}, {model}: expected A or B and one of {MODELS}")
    truth = dict(ROBO_V if bench == "A" else CLUB)
    sleeve = SLEEVES[bench][int(rng.choice(3, p=[0.2, 0.2, 0.6]))]
    truth["sleeve_stiffness"], truth["sleeve_damping"] = sleeve
    for name in ("shaft_stiffness", "sleeve_stiffness", "sleeve_damping", "wrist_stiffness"):
        truth[name] *= float(rng.uniform(1 - SPREAD, 1 + SPREAD))
    truth["wrist_damping"] = float(np.exp(rng.uniform(np.log(1.5), np.log(15.0))))
    truth["collet_inertia"] *= float(rng.uniform(0.9, 1.1))
    if bench == "A":
        truth["clubhead_mass"] *= float(rng.uniform(0.9, 1.1))
        truth["shaft_damping"] *= float(rng.uniform(0.7, 1.4))
    else:
        _scatter_elements(truth, rng)
    free = ["shaft_stiffness", "shaft_damping", "sleeve_stiffness", "sleeve_damping"]
    free += [] if model == "fixed_collet" else ["wrist_stiffness", "wrist_damping"]
    scatter = rng.uniform(-0.15, 0.15, STATIONS)
    club = Club(bench, model, truth, scatter, tuple(free), {}, {}, (), count=count)
    real = as_lumped(club)
    told = {name: real[name] * float(rng.uniform(0.82, 1.2)) for name in free}
    known = {name: share * real[name] for name, share in STD.items()}
    if model == "fixed_collet":
        known.pop("collet_inertia")
    for name, std in known.items():
        told[name] = real[name] + std * float(np.clip(rng.standard_normal(), -2, 2))
    return replace(club, told=told, known=known, gauges=_gauges(rng, model))


def _scatter_elements(truth: dict[str, float], rng: np.random.Generator) -> None:
    for name in ("bending_butt", "bending_tip", "line_mass_butt", "line_mass_tip", "rubber"):
        truth[name] *= float(rng.uniform(0.85, 1.15))
    for name in ("head_inertia", "head_offset", "shaft_ratio", "second_ratio"):
        truth[name] *= float(rng.uniform(0.7, 1.3))
    stiffer = truth["shaft_stiffness"] / CLUB["shaft_stiffness"]
    truth["clamped_hertz"] *= float(rng.uniform(0.97, 1.03)) * stiffer**0.5
    truth["sleeve_tilt"] = float(rng.uniform(-0.4, 0.4))
    truth["butt"] = float(rng.uniform(-0.004, 0.004))


def as_lumped(club: Club) -> dict[str, float]:
    """What a lab would find for the lumped constants of the true club, each by its own test [SI].

    Of the elements: shaft and head from a clamped grip (static pull, first frequency); the sleeve
    from a pull in the fixed collet and the share of damping that it has.
    """
    truth = dict(club.truth)
    if club.bench == "A":
        return truth
    found = {**ROBO_V, **{name: truth[name] for name in ROBO_V if name in truth}}
    beat = 2 * np.pi * truth["clamped_hertz"]
    found["clubhead_mass"] = truth["shaft_stiffness"] / beat**2
    found["shaft_damping"] = 2 * truth["shaft_ratio"] * truth["shaft_stiffness"] / beat
    free = replace(club, model="fixed_collet").structure()
    row = free.points["clubhead"]
    _, reach, half = levers(found)
    soft = row @ np.linalg.solve(free.stiffness, row) - 1 / truth["shaft_stiffness"]
    element = float((0.25 + (reach / (2 * half)) ** 2) / soft)
    found["sleeve_stiffness"] = element
    found["sleeve_damping"] = element * truth["sleeve_damping"] / truth["sleeve_stiffness"]
    found["club_length"] = truth["club_length"] + truth["butt"]
    return found


def true_head_mass(club: Club) -> float:
    """Mass of the head itself [kg]."""
    return club.truth["clubhead_mass"] if club.bench == "A" else head_mass(club.truth)


def clamped_check(club: Club) -> tuple[float, float]:
    """Static stiffness at the head [N/m] and first frequency [Hz] of the clamped shaft."""
    stiffness, mass, row = clamped(club.truth)
    pull = 1 / (row @ np.linalg.solve(stiffness, row))
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness))
    return float(pull), float(np.sqrt(squares.real.min()) / (2 * np.pi))


def collet_held(club: Club) -> dict[str, float]:
    """First frequency [Hz], damping ratio and static stiffness at the head [N/m], the collet held.

    These any club has, whatever it is made of.
    """
    structure = replace(club, model="fixed_collet").structure()
    row = structure.points["clubhead"]
    tones, ratios = structure.poles()
    pull = 1 / float(row @ np.linalg.solve(structure.stiffness, row))
    return {"frequency": float(tones[0]), "damping_ratio": float(ratios[0]), "stiffness": pull}


def _gauges(rng: np.random.Generator, model: str) -> tuple[Gauge, ...]:
    def errors(tolerance: Mapping[str, float]) -> dict[str, float]:
        return {
            k: std * float(np.clip(rng.standard_normal(), -2, 2)) for k, std in tolerance.items()
        }

    head = {"gain": 0.005, "offset": 0.02, "radius": 0.003}
    unit = str(rng.choice(["m/s^2", "g"]))
    view = "head" if model == "fixed_collet" or rng.random() < 0.75 else "head_collet"
    found = [Gauge("head_acc", view, unit, RATE, head, errors(head))]
    if model == "fixed_collet" or rng.random() < 0.4:
        bend = {"gain": 0.03, "offset": 2e-4}
        found.append(Gauge("shaft_gauge", "shaft", "mm", RATE, bend, errors(bend)))
    if model == "fixed_collet":
        return tuple(found)
    slow = {"offset": np.radians(0.02), "delay": 2e-4}
    off = errors(slow)
    fine = Gauge("collet_encoder", "collet", "deg", ROBOT_RATE, slow, off, RESOLUTION)
    found.append(fine)
    if model == "driven_wrist":
        told = {"delay": slow["delay"]}
        own = {"delay": off["delay"]}  # the robot has one clock
        found.append(
            Gauge("wrist_feedback", "", "deg", ROBOT_RATE, told, own, RESOLUTION, role="input")
        )
    return tuple(found)


def club_rig_tables(club: Club) -> dict[str, dict[str, object]]:
    """The tables of rig.toml: nominal values, those that are held with their tolerance."""
    values: dict[str, object] = {}
    for name, std in club.known.items():
        values[name] = {"value": club.told[name], "std": std}
    for name in club.free:
        value = club.told[name]
        low = 0.0 if name.endswith("damping") else value / 6
        values[name] = {"value": value, "min": low, "max": value * (6 if low else 40), "free": True}
    rig: dict[str, object] = {"kind": "robot", "model": club.model, "fidelity": "thesis"}
    return {"rig": rig | {"preset": "robo_v"}, "parameters": values}


def in_file(gauge: Gauge, values: np.ndarray) -> np.ndarray:
    """SI to the unit of the gauge's file."""
    return values * TO_FILE[gauge.unit]
