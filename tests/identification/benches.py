"""One small bench for all tests of the fits: few shapes, so that little is compiled."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from supple.identification.records import Record, read_record
from supple.model.rig import Rig, read_rig
from tests.lab.bodies import chain
from tests.lab.draw import write_case
from tests.lab.effects import NOTHING, Effect
from tests.lab.motion import Law
from tests.lab.plants import Plant, Sensor
from tests.lab.trials import _scaled, decay

MASS, STIFFNESS, DAMPING = 0.5, 80.0, 0.126
"""A cart of 0.5 kg on a spring of 80 N/m: 2 Hz, 1 % of critical damping."""

RATE, COUNT, REACH = 50.0, 500, 0.02
LAYOUT = {"masses": ["cart"], "links": {"spring": ("ground", "cart")}}
UNITS = {"translation": ("mass", "position", "m"), "rotation": ("inertia", "angle", "rad")}


@dataclass(frozen=True)
class Bench:
    """What a lab hands over, and the truth behind it."""

    rig: Rig
    records: list[Record]
    held: list[Record]
    paths: list[Path]
    held_paths: list[Path]


def plant(motion: str = "translation", free: Sequence[str] = (), damping: float = DAMPING) -> Plant:
    """The cart (or the rotor of the same numbers) with one sensor of its position."""
    unit, quantity, si = UNITS[motion]
    layout = {**LAYOUT, "motion": motion}
    truth = {
        f"masses.cart.{unit}": MASS,
        "links.spring.stiffness": STIFFNESS,
        "links.spring.damping": damping,
    }
    told = {"links.spring.stiffness": 70.0, "links.spring.damping": 0.2}
    told[f"masses.cart.{unit}"] = 0.6
    names = tuple(free) or ("links.spring.stiffness", "links.spring.damping")
    sensor = Sensor("see_cart", quantity, "cart", "absolute", si, 0, np.ones(1))
    return Plant(
        kind="chain",
        build=lambda values: chain(values, layout),
        truth=truth,
        free=names,
        told=told,
        sensors=(sensor,),
        rate=RATE,
        count=COUNT,
        head="cart",
        amplitude=REACH,
        layout=layout,
    )


def multisine(count: int, seed: int) -> np.ndarray:
    """A force of many tones about the resonance that begins and ends at zero."""
    rng, time = np.random.default_rng(seed), np.arange(count) / RATE
    tones = np.arange(0.4, 5.0, 0.25)
    phase = rng.uniform(0, 2 * np.pi, len(tones))
    force = np.sum(np.sin(2 * np.pi * tones * time[:, None] + phase), axis=1)
    return force * np.minimum(1.0, np.minimum(time, time[-1] - time) / 1.0)


def make_bench(
    folder: Path,
    effects: Sequence[tuple[str, float]] = (),
    reaches: Sequence[float] = (1.0, 0.35),
    held: Sequence[float] = (0.65,),
    *,
    driven: bool = False,
    motion: str = "translation",
    free: Sequence[str] = (),
    damping: float = DAMPING,
    noise: str = "white",
    snr_db: float = 40.0,
    noise_law: dict[str, float] | None = None,
    seed: int = 1,
    prefix: str = "",
    finer: int = 1,
    sensors: Sequence[Sensor] = (),
) -> Bench:
    """Write and read records of the cart.

    Args:
        folder: where they go.
        effects: hidden (law, size in SI) at the spring; sizes as in `tests.lab`.
        reaches: amplitude of each record to fit, in shares of `REACH`.
        held: the same of each record to hold out.
        driven: by a recorded force; otherwise all are decays.
        motion: translation or rotation.
        free: names that the rig leaves free; stiffness and damping by default.
        damping: the truth.
        noise: kind of noise.
        snr_db: signal over noise [dB].
        noise_law: its parameters.
        seed: of the noise and of the forces.
        prefix: of the records' names.
        finer: samples in place of one.
        sensors: beside that of the cart's position.
    """
    folder.mkdir(parents=True, exist_ok=True)
    made = replace(plant(motion, free, damping), rate=RATE * finer, count=COUNT * finer)
    made = replace(made, sensors=(*made.sensors, *sensors))
    trials = []
    for index, share in enumerate((*reaches, *held)):
        if driven:
            force = multisine(COUNT, seed + index)
            trial = _scaled(made, "driven", share * REACH, force, 0, True)
        else:
            trial = decay(made, share * REACH)
        split = "train" if index < len(reaches) else "held_out"
        trials.append(replace(trial, name=f"{prefix}{split}_{index + 1:02d}", split=split))
    laws = tuple(Law(name, 0, size) for name, size in effects)
    hidden = Effect(laws[0].kind, "spring", 0.0, laws[0].size, laws) if laws else NOTHING
    chance = np.random.default_rng([seed, 7])
    case = write_case(
        folder, made, trials, hidden, noise, snr_db, noise_law or {}, chance, sealed=False
    )
    return Bench(
        read_rig(case.rig),
        [read_record(path) for path in case.train],
        [read_record(path) for path in case.held_out],
        list(case.train),
        list(case.held_out),
    )


def with_rig(bench: Bench, old: str, new: str) -> Rig:
    """The rig read again after a piece of its text was replaced."""
    path = bench.rig.path
    text = path.read_text()
    assert old in text, text
    path.write_text(text.replace(old, new, 1))
    return read_rig(path)
