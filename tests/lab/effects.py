"""What the bench may hide: each effect, where it can sit, and how strong it is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bodies import Machine
from .motion import Law, Motion
from .plants import UNITS, Plant

# Weakest strength of each effect; the strongest is 30 times that. In the twin without the effect,
# with A the largest stretch, V the largest speed at the place and k, m its stiffness and mass:
WEAKEST = {
    "cubic_stiffness": 0.01,  # size A^2 / k
    "asymmetric_stiffness": 0.02,  # size / k
    "coulomb_friction": 0.002,  # size / (k A)
    "quadratic_damping": 0.003,  # size V / (2 sqrt(k m))
    "clearance": 0.005,  # size / A
    "linear_damping": 0.002,  # size / (2 sqrt(k m))
    "gravity": 0.01,  # share of gravity in the stiffness times A^2 / 6
    "sensor_offset": 0.02,  # size / rms of the channel
    "sensor_delay": 0.01,  # size times the first mode's angular frequency
}
RANGE = 30.0
LAWS = tuple(WEAKEST)
CLUB_CAUSES: dict[str, tuple[tuple[str, str], ...]] = {
    "fixed_collet": (
        ("cubic_stiffness", "shaft"),
        ("cubic_stiffness", "sleeve"),
        ("asymmetric_stiffness", "shaft"),
        ("asymmetric_stiffness", "sleeve"),
        ("coulomb_friction", "sleeve"),
        ("clearance", "sleeve"),
        ("clearance", "shaft"),
        ("quadratic_damping", "clubhead"),
        ("quadratic_damping", "shaft"),
        ("linear_damping", "shaft"),
        ("linear_damping", "sleeve"),
        ("sensor_offset", "clubhead"),
        ("sensor_delay", "clubhead"),
    ),
}
CLUB_CAUSES["pinned_wrist"] = (
    *CLUB_CAUSES["fixed_collet"],
    ("cubic_stiffness", "wrist"),
    ("asymmetric_stiffness", "wrist"),
    ("coulomb_friction", "wrist"),
    ("clearance", "wrist"),
    ("quadratic_damping", "wrist"),
    ("linear_damping", "wrist"),
)


@dataclass(frozen=True)
class Effect:
    """A hidden cause; `size` in SI units of its law, of one element where there are several."""

    law: str
    place: str
    strength: float
    size: float
    laws: tuple[Law, ...] = ()
    changes: tuple[tuple[str, float], ...] = ()  # true parameters that the rig holds at zero
    delay: int = 0  # 16ths of a sample
    channel: str = ""

    def machine(self, plant: Plant) -> Machine:
        """The plant's true machine, the effect's own parameters included."""
        return plant.machine(dict(self.changes))


NOTHING = Effect("", "", 0.0, 0.0)


def causes(plant: Plant) -> tuple[tuple[str, str], ...]:
    """The (law, place) pairs that this plant can hide."""
    if plant.kind == "robot":
        return CLUB_CAUSES[plant.layout["model"]]
    seen = plant.sensors[0].place
    pairs = [("sensor_offset", seen), ("sensor_delay", seen)]
    for law in LAWS:
        if law == "gravity" and plant.layout["motion"] == "rotation":
            pairs.append((law, next(iter(plant.layout["links"]))))
        elif law != "gravity" and not law.startswith("sensor_"):
            pairs += [(law, link) for link in plant.layout["links"]]
    return tuple(pairs)


def draw_strength(law: str, rng: np.random.Generator) -> float:
    """A strength log-uniform over a factor of thirty."""
    return float(WEAKEST[law] * np.exp(rng.uniform(0, np.log(RANGE))))


def twin_values(plant: Plant, law: str, place: str) -> dict[str, float]:
    """Parameters that the plant without the effect has, and the rig holds: zero damping."""
    if law != "linear_damping":
        return {}
    return {_damping_name(plant, place): 0.0}


def _damping_name(plant: Plant, place: str) -> str:
    return f"{place}_damping" if plant.kind == "robot" else f"links.{place}.damping"


def size_effect(
    plant: Plant,
    law: str,
    place: str,
    strength: float,
    twins: list[Motion],
    rng: np.random.Generator,
) -> Effect:
    """The effect of a strength, sized by the motions of the plant without it.

    Raises:
        ValueError: if this plant cannot hide it there.
    """
    if (law, place) not in causes(plant):
        raise ValueError(f"{law} @ {place}: expected one of {causes(plant)}")
    machine = plant.machine()
    if law.startswith("sensor_"):
        return _sensor_effect(plant, law, place, strength, twins, machine, rng)
    numbers = machine.places[place]
    items = [machine.elements[number] for number in numbers]
    stretch = max(np.abs(item.stretch(m.position)).max() for item in items for m in twins)
    speed = max(np.abs(item.stretch(m.velocity)).max() for item in items for m in twins)
    item, mass = _spring_and_mass(plant, machine, place)
    critical = 2 * np.sqrt(item.stiffness * mass)
    if law == "linear_damping":
        size = float(strength * critical)
        return Effect(law, place, strength, size, changes=((_damping_name(plant, place), size),))
    sign = float(rng.choice([-1.0, 1.0]))
    size = {
        "cubic_stiffness": sign * strength * item.stiffness / stretch**2,
        "asymmetric_stiffness": sign * strength * item.stiffness,
        "coulomb_friction": strength * item.stiffness * stretch,
        "quadratic_damping": strength * critical / speed,
        "clearance": strength * stretch,
        "gravity": min(6 * strength / stretch**2, 1.0) * item.stiffness,
    }[law]
    laws = tuple(Law(law, number, float(size)) for number in numbers)
    return Effect(law, place, strength, float(size), laws)


def _spring_and_mass(plant: Plant, machine: Machine, place: str):
    """The element that scales a law at a place, and the mass that it swings."""
    name = {"clubhead": "shaft", "sleeve": "sleeve_upper"}.get(place, place)
    item = machine.element(name)
    if plant.kind == "chain":
        return item, 1 / (item.ends**2 @ (1 / machine.inertia))
    head = plant.truth["clubhead_mass"]
    if place == "wrist":
        return item, plant.truth["collet_inertia"] + head * plant.truth["club_length"] ** 2
    lever = plant.truth["club_length"] / plant.truth["sleeve_spacing"] if place == "sleeve" else 1
    return item, head * lever**2


def _sensor_effect(plant, law, place, strength, twins, machine, rng) -> Effect:
    sensor = next(item for item in plant.sensors if item.place == place)
    if law == "sensor_offset":
        level = np.sqrt(np.mean(np.concatenate([sensor.read(m) ** 2 for m in twins])))
        size = float(rng.choice([-1.0, 1.0]) * strength * level / UNITS[sensor.unit])
        return Effect(law, place, strength, size, channel=sensor.name)
    wanted = strength / (2 * np.pi * machine.modes()[0][0])
    ticks = max(1, round(wanted * plant.rate * 16))
    return Effect(law, place, strength, ticks / 16 / plant.rate, delay=ticks, channel=sensor.name)
