"""Draws what stands on the bench: a random chain or club, its sensors and the rig as told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .bodies import ROBO_V, SLEEVES, Machine, chain, fixed_collet, levers, pinned_wrist
from .motion import Motion

UNITS = {  # unit -> how many of it in one SI unit
    "m": 1.0,
    "mm": 1e3,
    "m/s": 1.0,
    "m/s^2": 1.0,
    "g": 1 / 9.80665,
    "rad": 1.0,
    "deg": 180 / np.pi,
    "rad/s": 1.0,
    "deg/s": 180 / np.pi,
    "rad/s^2": 1.0,
}
QUANTITIES = {
    "translation": (
        ("position", ("m", "mm")),
        ("velocity", ("m/s",)),
        ("acceleration", ("m/s^2", "g")),
    ),
    "rotation": (
        ("angle", ("rad", "deg")),
        ("angular_velocity", ("rad/s", "deg/s")),
        ("angular_acceleration", ("rad/s^2",)),
    ),
}


@dataclass(frozen=True)
class Sensor:
    """One channel: `weights` over the bodies' positions (order 0), velocities or accelerations."""

    name: str
    quantity: str
    place: str
    frame: str
    unit: str
    order: int
    weights: np.ndarray

    def read(self, motion: Motion) -> np.ndarray:
        """What a perfect sensor shows, in its unit."""
        rows = (motion.position, motion.velocity, motion.acceleration)[self.order]
        return rows @ self.weights * UNITS[self.unit]


@dataclass(frozen=True)
class Plant:
    """A machine to be tested; `truth` has its true parameters by the rig's names."""

    kind: str
    build: Callable[[dict[str, float]], Machine]
    truth: dict[str, float]
    free: tuple[str, ...]
    told: dict[str, float]  # start values that the rig gives for what is free
    sensors: tuple[Sensor, ...]
    rate: float
    count: int
    head: str  # the body that is pulled, struck and driven
    amplitude: float  # largest motion of the head [m, rad]
    layout: dict = field(default_factory=dict)

    def machine(self, changes: dict[str, float] | None = None) -> Machine:
        """The machine with its true parameters, or some of them changed."""
        return self.build({**self.truth, **(changes or {})})


def draw_chain(rng: np.random.Generator, motion: str | None = None, masses: int = 0) -> Plant:
    """One to three masses in a line, 0.5 to 60 Hz, damping ratios 0.3 to 5 %."""
    motion = motion or str(rng.choice(["translation", "rotation"], p=[0.6, 0.4]))
    masses = masses or int(rng.choice([1, 2, 3], p=[0.4, 0.35, 0.25]))
    unit = "inertia" if motion == "rotation" else "mass"
    names = (["cart", "block", "tip"] if motion == "translation" else ["rotor", "disc", "tip"])[
        :masses
    ]
    links = {f"spring_{'abc'[i]}": (["ground", *names][i], names[i]) for i in range(masses)}
    layout = {"motion": motion, "masses": names, "links": links}
    truth = _draw_constants(rng, layout, unit)
    machine = chain(truth, layout)
    tones, _ = machine.modes()
    rate = float(f"{rng.uniform(25, 45) * tones[-1]:.3g}")
    count = int(np.clip(rate * rng.uniform(14, 26) / tones[0], 1000, 4000))
    head = str(rng.choice(names))
    sensors = _chain_sensors(rng, layout, head)
    amplitude = np.exp(rng.uniform(np.log(1e-3), np.log(5e-2)))
    free = [f"links.{link}.{what}" for link in links for what in ("stiffness", "damping")]
    if motion == "rotation":
        amplitude *= 6
    return Plant(
        kind="chain",
        build=lambda values: chain(values, layout),
        truth=truth,
        free=tuple(free),
        told=_misled(rng, truth, free),
        sensors=sensors,
        rate=rate,
        count=count,
        head=head,
        amplitude=float(amplitude),
        layout=layout,
    )


def _draw_constants(rng: np.random.Generator, layout: dict, unit: str) -> dict[str, float]:
    """Random constants whose modes are apart and neither dead nor overdamped."""
    size = len(layout["masses"])
    heavy = np.exp(rng.uniform(np.log(0.05), np.log(20.0)))
    if unit == "inertia":
        heavy *= 2e-3
    first = np.exp(rng.uniform(np.log(0.5), np.log(20.0)))
    while True:
        inertia = heavy * np.exp(rng.uniform(-0.9, 0.9, size))
        stiffness = heavy * (2 * np.pi) ** 2 * np.exp(rng.uniform(-0.9, 0.9, size))
        ratio = np.exp(rng.uniform(np.log(0.003), np.log(0.05), size))
        values = {}
        for index, (name, link) in enumerate(zip(layout["masses"], layout["links"], strict=True)):
            values[f"masses.{name}.{unit}"] = float(inertia[index])
            values[f"links.{link}.stiffness"] = float(stiffness[index])
            damping = 2 * ratio[index] * np.sqrt(stiffness[index] * inertia[index])
            values[f"links.{link}.damping"] = float(damping)
        tones, ratios = chain(values, layout).modes()
        scale = first / tones[0]
        apart = np.all(tones[1:] > 1.25 * tones[:-1]) and tones[-1] < 6 * tones[0]
        if apart and len(tones) == size and ratios.min() > 0.003 and ratios.max() < 0.05:
            if tones[-1] * scale < 60:
                break
            first *= 0.8
    for link in layout["links"]:
        values[f"links.{link}.stiffness"] *= scale**2
        values[f"links.{link}.damping"] *= scale
    return values


def _chain_sensors(rng: np.random.Generator, layout: dict, head: str) -> tuple[Sensor, ...]:
    names = layout["masses"]
    seen = [str(rng.choice(names))]
    if len(names) > 1 and rng.random() < 0.6:
        seen.append(str(rng.choice([name for name in names if name != seen[0]])))
    sensors = []
    for name in seen:
        order = int(rng.choice([0, 1, 2], p=[0.4, 0.2, 0.4]))
        quantity, units = QUANTITIES[layout["motion"]][order]
        weights = np.eye(len(names))[names.index(name)]
        unit = str(rng.choice(units))
        sensors.append(Sensor(f"see_{name}", quantity, name, "absolute", unit, order, weights))
    return tuple(sensors)


def _misled(rng: np.random.Generator, truth: dict[str, float], free: list[str]) -> dict[str, float]:
    """Start values as an engineer has them: stiffness off by 20 % at most, damping by a factor."""
    told = {}
    for name in free:
        if name.endswith("damping") and name.startswith("links."):
            told[name] = truth[name] * float(np.exp(rng.uniform(-0.7, 0.7)))
        else:
            told[name] = truth[name] * float(rng.uniform(0.82, 1.2))
    return told


def draw_club(rng: np.random.Generator, bench: str, sleeve: str | None = None) -> Plant:
    """The thesis's club in its sleeve, collet fixed or on a wrist; constants scattered."""
    sleeve = sleeve or str(rng.choice(["0 %", "25 %", "50 %"], p=[0.2, 0.2, 0.6]))
    truth = dict(ROBO_V)
    truth["sleeve_stiffness"], truth["sleeve_damping"] = SLEEVES[sleeve]
    free = ["shaft_stiffness", "shaft_damping", "sleeve_stiffness", "sleeve_damping"]
    scattered = [*free, "clubhead_mass"]
    if bench == "pinned_wrist":
        free += ["wrist_stiffness", "wrist_damping"]
        scattered += ["wrist_stiffness", "wrist_damping", "collet_inertia"]
    for name in scattered:
        spread = 0.1 if name in ("clubhead_mass", "collet_inertia") else 0.2
        truth[name] *= float(rng.uniform(1 - spread, 1 + spread))
    sensors = _club_sensors(rng, bench, truth)
    return club(bench, truth, tuple(free), _misled(rng, truth, free), sensors)


def club(
    bench: str,
    truth: dict[str, float],
    free: tuple[str, ...],
    told: dict[str, float],
    sensors: tuple[Sensor, ...],
    rate: float = 2048.0,
    count: int = 8192,
) -> Plant:
    """A club on the bench with given constants."""
    return Plant(
        kind="robot",
        build=fixed_collet if bench == "fixed_collet" else pinned_wrist,
        truth=truth,
        free=free,
        told=told,
        sensors=sensors,
        rate=rate,
        count=count,
        head="clubhead",
        amplitude=0.15,
        layout={"model": bench},
    )


def club_sensor(bench: str, truth: dict[str, float], what: str, unit: str) -> Sensor:
    """A sensor of the club: head, head_collet, grip, shaft or wrist.

    Raises:
        ValueError: if there is no such sensor.
    """
    near, reach, _ = levers(truth)
    places = {  # over collet, grip, grip_turn, clubhead
        "head": ("acceleration", "clubhead", "absolute", 2, [0, 0, 0, 1]),
        "head_collet": ("acceleration", "clubhead", "collet", 2, [-(near + reach), 0, 0, 1]),
        "grip": ("position", "grip", "collet", 0, [-near, 1, 0, 0]),
        "shaft": ("deflection", "shaft", "collet", 0, [0, -1, -reach, 1]),
        "wrist": ("angle", "wrist", "absolute", 0, [1, 0, 0, 0]),
    }
    if what not in places:
        raise ValueError(f"sensor {what!r}: expected one of {sorted(places)}")
    quantity, place, frame, order, weights = places[what]
    row = np.array(weights[1:] if bench == "fixed_collet" else weights, float)
    return Sensor(f"see_{what}", quantity, place, frame, unit, order, row)


def _club_sensors(
    rng: np.random.Generator, bench: str, truth: dict[str, float]
) -> tuple[Sensor, ...]:
    unit = str(rng.choice(["m/s^2", "g"]))
    if bench == "fixed_collet":
        seen = [("head", unit)]
        if rng.random() < 0.5:
            seen.append(("grip", "mm") if rng.random() < 0.5 else ("shaft", "mm"))
    else:
        seen = [("head" if rng.random() < 0.75 else "head_collet", unit)]
        seen.append(("wrist", str(rng.choice(["deg", "rad"]))))
    return tuple(club_sensor(bench, truth, *item) for item in seen)


def rig_tables(plant: Plant, held: dict[str, float]) -> dict[str, dict[str, object]]:
    """The tables of rig.toml as the user has them; `held` overrides what is told as known."""

    def entry(name: str) -> object:
        if name in held:
            return held[name]
        if name not in plant.free:
            return plant.truth[name]
        value = plant.told[name]
        low = 0.0 if name.endswith("damping") else value / 6
        return {"value": value, "min": low, "max": value * (6 if low else 40), "free": True}

    if plant.kind == "robot":
        known = ["clubhead_mass"]
        known += ["collet_inertia"] if plant.layout["model"] == "pinned_wrist" else []
        values = {name: entry(name) for name in [*known, *plant.free, *held]}
        rig = {"kind": "robot", "model": plant.layout["model"], "fidelity": "thesis"}
        return {"rig": {**rig, "preset": "robo_v"}, "parameters": values}
    tables: dict[str, dict[str, object]] = {"rig": {"kind": "chain"}}
    if plant.layout["motion"] == "rotation":
        tables["rig"]["motion"] = "rotation"
    unit = "inertia" if plant.layout["motion"] == "rotation" else "mass"
    for name in plant.layout["masses"]:
        tables[f"masses.{name}"] = {unit: entry(f"masses.{name}.{unit}")}
    for link, ends in plant.layout["links"].items():
        tables[f"links.{link}"] = {
            "between": list(ends),
            "stiffness": entry(f"links.{link}.stiffness"),
            "damping": entry(f"links.{link}.damping"),
        }
    return tables
