"""What benches A and B may hide: every law at its places, sized by the motions without it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .carries import Carry
from .clubs import Club, true_head_mass
from .gauges import Fault, seen
from .march import Loads, Moved
from .structure import Springs, Structure

# Weakest strength of each law; the strongest is `RANGE` times that. A is the largest stretch at the
# place in the twin, V the largest rate, k the stiffness there, w the first mode [rad/s].
WEAKEST = {
    "linear_stiffness": 0.02,  # size / k
    "linear_damping": 0.006,  # size w / (2 k)
    "cubic_stiffness": 0.015,  # size A^2 / k, either sign below 0.3, then positive
    "asymmetric_stiffness": 0.03,  # size / k, either sign
    "quadratic_damping": 0.05,  # size V w / (2 k)
    "clearance": 0.01,  # size / A
    "coulomb_friction": 0.02,  # size / (k A)
    "slip": 0.03,  # share of its largest force that half of the spring cannot hold
    "hysteresis": 0.08,  # size / k, with a yield of 0.3 A
    "relaxation": 0.06,  # size / k, with a time of 20 to 150 ms
    "stiffness_drift": 0.03,  # size / k, at the end of the record
    "support_flexibility": 0.005,  # the head's compliance by it, against that by the shaft
    "extra_mode": 0.003,  # rider's mass over what it rides on, 6 to 30 Hz
    "servo_lag": 0.004,  # time constant [s] times w
    "drive_ripple": 0.002,  # size over the drive's largest angle, 8 to 40 Hz
    "sensor_offset": 0.02,  # size over the channel's rms
    "sensor_drift": 0.02,  # the same, gained over the record
    "sensor_gain": 0.01,
    "sensor_delay": 0.005,  # size times w
    "sensor_highpass": 0.01,  # 1 / (time constant w)
    "sensor_lowpass": 0.01,  # time constant times w
    "sensor_saturation": 0.03,  # share of the largest value that is cut off
    "sensor_mass": 0.004,  # over the head's mass
    "sensor_tilt": 0.02,  # [rad]
    "sensor_rectified": 0.01,  # size of |y|
    "mains_hum": 0.003,  # over the channel's largest value
}
RANGE = 30.0
SLEEVE = 1.5  # the sleeve is so much stiffer than all else that its laws are drawn stronger
SPRING_LAWS = (
    *("coulomb_friction", "cubic_stiffness", "asymmetric_stiffness", "clearance", "hysteresis"),
    *("relaxation", "stiffness_drift", "quadratic_damping"),
)
PLACES: dict[str, tuple[str, ...]] = {
    "wrist": SPRING_LAWS,
    "sleeve": (*SPRING_LAWS, "slip"),
    "shaft": ("cubic_stiffness", "asymmetric_stiffness", "stiffness_drift", "quadratic_damping"),
    "clubhead": ("quadratic_damping", "linear_damping", "linear_stiffness", "extra_mode"),
    "collet": ("extra_mode",),
    "base": ("support_flexibility",),
    "drive": ("servo_lag", "drive_ripple"),
    "head_acc": (
        *("sensor_offset", "sensor_drift", "sensor_gain", "sensor_delay", "sensor_highpass"),
        *("sensor_lowpass", "sensor_saturation", "sensor_mass", "sensor_tilt"),
        *("sensor_rectified", "mains_hum"),
    ),
    "shaft_gauge": ("sensor_drift", "sensor_gain", "sensor_delay", "mains_hum"),
    "collet_encoder": ("sensor_gain", "sensor_delay"),
}
CAUSES = tuple((law, place) for place, laws in PLACES.items() for law in laws)
# Where a verdict may put a cause whose place has several names.
ALSO = {
    "base": ("base", "wrist", "collet"),
    "drive": ("drive", "wrist", "wrist_feedback"),
    "collet": ("collet", "wrist"),
    "head_acc": ("head_acc", "clubhead"),
    "shaft_gauge": ("shaft_gauge", "shaft"),
    "collet_encoder": ("collet_encoder", "collet", "wrist"),
}


@dataclass(frozen=True)
class Hidden:
    """A cause; what it does to the springs, the structure, the drive or a channel."""

    law: str
    place: str
    strength: float
    size: float = 0.0
    unit: str = "1"
    facts: Mapping[str, float] = field(default_factory=dict)
    carries: tuple[Carry, ...] = ()
    reshape: Callable[[Structure], Structure] | None = None
    drive: Callable[[Loads, float], Loads] | None = None
    faults: tuple[Fault, ...] = ()


def possible(club: Club) -> tuple[tuple[str, str], ...]:
    """The (law, place) pairs that this club can hide."""
    names = {gauge.name for gauge in club.gauges}
    there = {"sleeve", "shaft", "clubhead", "base"} | names
    there |= set() if club.model == "fixed_collet" else {"wrist", "collet"}
    there |= {"drive"} if club.model == "driven_wrist" else set()
    return tuple(pair for pair in CAUSES if pair[1] in there)


def draw_cause(
    club: Club,
    law: str,
    place: str,
    strength: float | None,
    twins: Sequence[Moved],
    rng: np.random.Generator,
) -> Hidden:
    """A cause of a strength, drawn over a factor of `RANGE` if None.

    Raises:
        ValueError: if this club cannot hide it there.
    """
    if (law, place) not in possible(club):
        raise ValueError(f"{law} @ {place}: expected one of {possible(club)}")
    chance = float(RANGE ** np.sqrt(rng.uniform()))  # strong ones more often than weak ones
    bounded = law in (
        "slip",
        "asymmetric_stiffness",
        "stiffness_drift",
    )  # below 1, or it is no spring
    usual = WEAKEST[law] * (SLEEVE if place == "sleeve" and not bounded else 1.0)
    strength = usual * chance if strength is None else float(strength)
    structure = club.structure()
    beat = 2 * np.pi * float(structure.poles()[0][0])
    bare = Hidden(law, place, strength)
    if law.startswith("sensor_mass"):
        size = strength * true_head_mass(club)
        return replace(
            bare, size=size, unit="kg", reshape=lambda whole: whole.loaded("clubhead", size)
        )
    if law.startswith("sensor_") or law == "mains_hum":
        return _fault(bare, club, structure, twins, beat, rng)
    if place == "drive":
        return _drive(bare, twins, beat, rng)
    if law == "support_flexibility":
        return _support(bare, club, rng)
    if law == "extra_mode":
        return _rider(bare, club, structure, rng)
    return _carried(bare, structure.places[place], structure, twins, beat, rng)


def _carried(
    bare: Hidden,
    item: Springs,
    structure: Structure,
    twins: Sequence[Moved],
    beat: float,
    rng: np.random.Generator,
) -> Hidden:
    law, strength = bare.law, bare.strength
    stretches = [item.stretch(moved.position, moved.angle) for moved in twins]
    rates = [item.stretch(moved.velocity, moved.rate) for moved in twins]
    reach = max(float(np.abs(one).max()) for one in stretches)
    speed = max(float(np.abs(one).max()) for one in rates)
    stiff = item.stiffness
    if bare.place == "clubhead":
        stiff = structure.places["shaft"].stiffness
    sign = float(rng.choice([-1.0, 1.0]))
    uneven = 1 + 0.3 * rng.uniform(-1, 1, len(stiff)) if len(stiff) > 2 else np.ones(len(stiff))
    time = float(np.exp(rng.uniform(np.log(0.02), np.log(0.15))))
    sizes = {
        "linear_stiffness": strength * stiff,
        "linear_damping": strength * 2 * stiff / beat,
        "cubic_stiffness": (sign if strength < 0.3 else 1.0) * strength * stiff / reach**2,
        "asymmetric_stiffness": sign * strength * stiff,
        "quadratic_damping": strength * 2 * stiff / (beat * speed),
        "clearance": strength * reach * uneven,
        "coulomb_friction": strength * stiff * reach,
        "slip": 0.5 * stiff * reach * max(1 - strength, 0.0),
        "hysteresis": strength * stiff,
        "relaxation": strength * stiff,
        "stiffness_drift": sign * strength * stiff,
    }
    others = {
        "clearance": stiff,
        "coulomb_friction": 300 * strength * stiff if strength > 0 else stiff,
        "slip": 0.5 * stiff,
        "hysteresis": 0.3 * reach + 0 * stiff,
        "relaxation": time + 0 * stiff,
        "stiffness_drift": 2.0 + 0 * stiff,
    }
    size = np.asarray(sizes[law], float)
    other = np.asarray(others.get(law, 0 * stiff), float)
    carry = Carry(law, bare.place, size, other)
    facts = {"stations": float(len(size)), "largest": float(np.abs(size).max())}
    facts |= {"other": float(np.mean(other))} if law in others else {}
    unit = "SI, per radian" if bare.place == "wrist" else "SI, per meter"
    return replace(bare, size=float(np.mean(size)), unit=unit, facts=facts, carries=(carry,))


def lets_go(cause: Hidden, structure: Structure, motions: Sequence[Moved]) -> bool:
    """Whether a spring that softens is bent beyond where it pulls back at all."""
    for law in cause.carries:
        if law.kind != "cubic_stiffness" or not np.any(law.size < 0):
            continue
        item = structure.places[cause.place]
        end = np.sqrt(item.stiffness / np.maximum(-law.size, 1e-300))
        for moved in motions:
            stretch = np.abs(item.stretch(moved.position, moved.angle))
            if not np.all(stretch < end):  # not a number where it has gone
                return True
    return False


def weaker(cause: Hidden) -> Hidden:
    """A law of a spring of half its strength."""
    carries = tuple(replace(law, size=0.5 * law.size) for law in cause.carries)
    facts = {**cause.facts, "largest": 0.5 * cause.facts["largest"]}
    half = replace(cause, strength=0.5 * cause.strength, size=0.5 * cause.size, facts=facts)
    return replace(half, carries=carries)


def _support(bare: Hidden, club: Club, rng: np.random.Generator) -> Hidden:
    """The pivot rides on a mass in a spring; stiff where the strength is nought."""
    hertz = float(rng.uniform(10.0, 25.0))
    stiffness = club.truth["shaft_stiffness"] / bare.strength if bare.strength > 0 else 0.0
    mass = stiffness / (2 * np.pi * hertz) ** 2

    def reshape(whole: Structure) -> Structure:
        if bare.strength == 0:
            return whole
        size, grown = whole.size, whole.grown(1)
        item = grown.places["sleeve"]
        rows = item.rows.copy()
        rows[:, size] = -1.0
        change = [
            rows.T @ np.diag(item.count * value) @ rows
            - item.rows.T @ np.diag(item.count * value) @ item.rows
            for value in (item.stiffness, item.damping)
        ]
        own = np.zeros((size + 1, size + 1))
        own[size, size] = 1.0
        ratio = 2 * 0.03 * 2 * np.pi * hertz * mass
        return replace(
            grown,
            mass=grown.mass + mass * own,
            stiffness=grown.stiffness + change[0] + stiffness * own,
            damping=grown.damping + change[1] + ratio * own,
            places={**grown.places, "sleeve": replace(item, rows=rows)},
        )

    facts = {"hertz": hertz, "mass": mass}
    return replace(bare, size=stiffness, unit="N/m", facts=facts, reshape=reshape)


def _rider(bare: Hidden, club: Club, structure: Structure, rng: np.random.Generator) -> Hidden:
    hertz, ratio = float(rng.uniform(6.0, 30.0)), float(rng.uniform(0.01, 0.03))
    heavy = true_head_mass(club) if bare.place == "clubhead" else club.truth["collet_inertia"]
    factor = 1.0 if bare.place == "clubhead" else 10.0
    mass = factor * bare.strength * heavy

    def reshape(whole: Structure) -> Structure:
        return whole.with_rider(bare.place, mass, hertz, ratio) if mass > 0 else whole

    facts = {"hertz": hertz, "ratio": ratio}
    unit = "kg" if bare.place == "clubhead" else "kg m^2"
    return replace(bare, size=mass, unit=unit, facts=facts, reshape=reshape)


def _drive(bare: Hidden, twins: Sequence[Moved], beat: float, rng: np.random.Generator) -> Hidden:
    reach = max((float(np.abs(moved.angle).max()) for moved in twins), default=0.0)
    if bare.law == "servo_lag":
        size = bare.strength / beat
        return replace(
            bare, size=size, unit="s", drive=lambda loads, rate: lagged(loads, size, rate)
        )
    hertz, phase = float(rng.uniform(8.0, 40.0)), float(rng.uniform(0, 2 * np.pi))
    size = bare.strength * reach

    def ripple(loads: Loads, rate: float) -> Loads:
        if not np.any(loads.angle):
            return loads
        turn = 2 * np.pi * hertz
        times = np.arange(len(loads.angle)) / rate
        begun = np.flatnonzero(loads.angle)[0] / rate
        fade = np.clip((times - begun) / 0.1, 0.0, 1.0)
        rise = np.where((fade > 0) & (fade < 1), 10.0, 0.0)
        wave, slope = np.sin(turn * times + phase), turn * np.cos(turn * times + phase)
        return replace(
            loads,
            angle=loads.angle + size * fade * wave,
            rate=loads.rate + size * (fade * slope + rise * wave),
        )

    return replace(bare, size=size, unit="rad", facts={"hertz": hertz}, drive=ripple)


def lagged(loads: Loads, time: float, rate: float) -> Loads:
    """The drive behind a lag of first order, exact for an angle straight between fine steps."""
    if time <= 0 or not np.any(loads.angle):
        return loads
    decay = np.exp(-1 / (rate * time))
    angle = np.empty_like(loads.angle)
    angle[0] = now = loads.angle[0]
    slopes = np.diff(loads.angle) * rate
    for index, slope in enumerate(slopes):
        gap = now - loads.angle[index] + slope * time
        now = loads.angle[index + 1] - slope * time + gap * decay
        angle[index + 1] = now
    return replace(loads, angle=angle, rate=(loads.angle - angle) / time)


def _fault(
    bare: Hidden,
    club: Club,
    structure: Structure,
    twins: Sequence[Moved],
    beat: float,
    rng: np.random.Generator,
) -> Hidden:
    gauge = club.gauge(bare.place)
    values = [seen(gauge, structure, moved) for moved in twins]
    level = float(np.sqrt(np.mean(np.concatenate(values) ** 2)))
    top = max(float(np.abs(one).max()) for one in values)
    strength, sign = bare.strength, float(rng.choice([-1.0, 1.0]))
    size, unit = {
        "sensor_offset": (sign * strength * level, "SI"),
        "sensor_drift": (sign * strength * level, "SI"),
        "sensor_gain": (sign * strength, "1"),
        "sensor_delay": (strength / beat, "s"),
        "sensor_highpass": (1 / (strength * beat) if strength > 0 else 0.0, "s"),
        "sensor_lowpass": (strength / beat, "s"),
        "sensor_saturation": (top * max(1 - strength, 0.0), "SI"),
        "sensor_tilt": (strength, "rad"),
        "sensor_rectified": (sign * strength, "1"),
        "mains_hum": (strength * top, "SI"),
    }[bare.law]
    lever = club.truth["club_length"]
    return replace(bare, size=size, unit=unit, faults=(Fault(bare.law, gauge.name, size, lever),))
