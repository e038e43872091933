"""Pre-flight by the rig's own motion: time and units off by a factor, constants nobody sees."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..model.chain import DERIVATIVES
from ..model.linear import Modes, modes
from ..model.robot import Robot
from .free import Entry
from .guess import bounded, constants_named, solve_linear
from .noise import Noise
from .prepare import Prepared, Sensor, coarser
from .problem import Key, Model, Problem, base_entries, rough_noise
from .remark import Remark, place_of
from .signals import dominant_frequency, noise_std, quantization_step, spectrum_of

OFF_TIME = (2.5, 1.7)
"""Factor between measured and simulated frequency that is refused, and that is warned of [-]; a
fit's first guess scales stiffnesses by no more than 4, frequencies by 2."""

OFF_SIZE = (5.0, 3.5)
"""Factor between measured and simulated size that is refused, and that is warned of [-]."""

UNSEEN = (1.0, 0.3)
"""Relative error that noise alone leaves to a constant, all others known, that is refused, and
that is warned of [-]."""

DEAD = 1e-9
"""Change of the whitened response by a constant's whole size that counts as none, relative to
that of the liveliest constant [-]."""

_TIMES = {1000.0: "ms for s", 60.0: "minutes", 2 * np.pi: "rad/s for Hz", 10.0: "a decimal place"}
_SIZES = {
    9.80665: "g for m/s^2",
    180 / np.pi: "degrees for radians",
    1000.0: "mm for m, or N for kN",
    1e6: "micrometers for m",
    4.4482: "lbf for N",
    25.4: "inches for mm",
    100.0: "cm for m, or per cent",
    39.37: "inches for m",
}


def motion_remarks(problem: Problem) -> list[Remark]:
    """Time and units against what the rig would do at its start values.

    Args:
        problem: records and rig.

    Returns:
        Remarks; factors are dimensionless [-].
    """
    found = []
    for prepared in problem.records:
        own = modes(problem.mechanism, problem.numbers | prepared.numbers)
        told = _ring(prepared) if _rings_freely(prepared) else _resonance(prepared)
        if told:
            found += _timing(prepared, own, told)
        if told and _rings_freely(prepared):
            found += _shape(problem, prepared, own, told)
            found += _reach(problem, prepared, told)
    if not any(remark.refuses for remark in found):
        found += _driven_sizes(problem)
    return found


def _rings_freely(prepared: Prepared) -> bool:
    return prepared.free or prepared.record.test in ("decay", "impact")


def _ring(prepared: Prepared) -> float:
    """Main frequency of the first response that has one [Hz]; 0 where none has."""
    for sensor in prepared.sensors:
        seen = dominant_frequency(sensor.values, sensor.channel.sample_rate)
        periods = (seen or 0.0) * len(sensor.values) / sensor.channel.sample_rate
        if seen and periods > 3.0:
            return seen
    return 0.0


def _resonance(prepared: Prepared) -> float:
    """Frequency at which a response, as a displacement, stands out of its drive [Hz]; 0 if none."""
    count = prepared.count
    for sensor in prepared.sensors:
        if sensor.sampling is not None or len(sensor.values) != count:
            continue
        rate = 1.0 / prepared.step
        frequency, power = spectrum_of(sensor.values, rate)
        drive = sum(
            (
                spectrum_of(column[:count], rate)[1]
                for column in prepared.inputs.T
                if np.ptp(column)
            ),
            np.zeros(len(power)),
        )
        order = DERIVATIVES[sensor.port.quantity]
        edges = np.unique(np.round(np.geomspace(3, len(power), 40)).astype(int))
        ratio, at = [], []
        for low, high in pairwise(edges):
            push = float(np.sum(drive[low:high]))
            if push > 1e-3 * float(np.max(drive)) * (high - low):
                middle = float(np.mean(frequency[low:high]))
                ratio.append(float(np.sum(power[low:high])) / push / middle ** (2 * order))
                at.append(middle)
        if len(ratio) < 7:
            continue
        top = int(np.argmax(ratio))
        low, high = np.median(ratio[:top] or [np.inf]), np.median(ratio[top + 1 :] or [np.inf])
        if 1 < top < len(ratio) - 2 and ratio[top] > 9.0 * max(low, high):
            return at[top]
    return 0.0


def _timing(prepared: Prepared, own: Modes, seen: float) -> list[Remark]:
    rings = own.damped_frequencies[own.damped_frequencies > 0]
    if not len(rings):
        return []
    nearest = float(rings[np.argmin(np.abs(np.log(rings / seen)))])
    factor = seen / nearest
    off = max(factor, 1 / factor)
    if off < OFF_TIME[1]:
        return []
    expected = f"a main frequency near one of the rig's, {nearest:.4g} Hz at its start values"
    told = f"{seen:.4g} Hz, {off:.3g} times {'higher' if factor > 1 else 'lower'}"
    mend = "correct sample_rate or the unit of time, or the rig's start values" + _likely(
        off, _TIMES
    )
    path = prepared.record.path
    return [Remark("timing", off > OFF_TIME[0], path, "[record]", expected, told, mend)]


def _likely(off: float, known: dict[float, str]) -> str:
    """What a factor looks like, in words; empty where nothing is near."""
    for factor, words in known.items():
        if abs(np.log(off / factor)) < 0.4:
            return f" (a factor of {factor:.3g} is {words})"
    return ""


def _size_at(sensor: Sensor, frequency: float) -> float:
    """Root mean square about a frequency, within 20 % [channel's unit]."""
    at, power = spectrum_of(sensor.values, sensor.channel.sample_rate)
    near = (at > 0.8 * frequency) & (at < 1.25 * frequency)
    return float(np.sqrt(np.sum(power[near]) * (at[1] - at[0])))


def _shape(problem: Problem, prepared: Prepared, own: Modes, seen: float) -> list[Remark]:
    """Sizes of a record's channels against each other, by the mode that rings."""
    found: list[Remark] = []
    if len(prepared.sensors) < 2:
        return found
    numbers = problem.numbers | prepared.numbers
    index = int(np.argmin(np.abs(np.log(np.maximum(own.damped_frequencies, 1e-9) / seen))))
    count = len(problem.mechanism.coordinates)
    ratios = []
    for sensor in prepared.sensors:
        port = sensor.port
        row = problem.mechanism.sensor_row(port.place, port.quantity, port.frame, numbers)
        rate = (2 * np.pi * seen) ** DERIVATIVES[port.quantity]
        expected = abs(np.asarray(row)[:count] @ own.shapes[:, index]) * rate
        size = _size_at(sensor, seen)
        noise = noise_std(sensor.values, sensor.channel.sample_rate) or 0.0
        if expected > 0 and size > 3.0 * noise / np.sqrt(len(sensor.values)):
            ratios.append((size / expected, sensor))
    for ratio, sensor in ratios[1:]:
        factor = ratio / ratios[0][0]
        other = ratios[0][1].channel.name
        found += _sized(
            prepared, sensor, factor, f"motion that fits '{other}' by the mode at {seen:.3g} Hz"
        )
    return found


def _reach(problem: Problem, prepared: Prepared, seen: float) -> list[Remark]:
    """How far a robot's head would have to move, against its release and its length."""
    if not isinstance(problem.mechanism, Robot):
        return []
    held = prepared.record.start.get("clubhead_deflection")
    length = problem.numbers["club_length"]
    for sensor in prepared.sensors:
        if sensor.port.place != "clubhead" or sensor.port.quantity not in (
            "acceleration", "velocity", "position",
        ):  # fmt: skip
            continue
        rate = (2 * np.pi * seen) ** DERIVATIVES[sensor.port.quantity]
        moved = np.sqrt(2.0) * float(np.std(sensor.values[: len(sensor.values) // 3 + 8])) / rate
        if held:
            words = f"about the {abs(held):g} m of its release"
            return _sized(prepared, sensor, moved / abs(held), words, told=moved)
        if moved > length:
            return _sized(prepared, sensor, 10 * moved / length, "less than a club's", told=moved)
    return []


def _sized(
    prepared: Prepared, sensor: Sensor, factor: float, words: str, told: float | None = None
) -> list[Remark]:
    off = max(factor, 1 / factor)
    if off < OFF_SIZE[1]:
        return []
    found = f"{off:.3g} times {'more' if factor > 1 else 'less'}"
    found += "" if told is None else f", {told:.3g} m"
    mend = "correct its unit or scale" + _likely(off, _SIZES)
    place = f"[channels.{sensor.channel.name}] unit"
    path = prepared.record.path
    return [Remark("units", off > OFF_SIZE[0], path, place, words, found, mend)]


def _driven_sizes(problem: Problem) -> list[Remark]:
    """Sizes of driven responses against the rig's, over a range of stiffness and damping."""
    chosen = tuple(p for p in problem.records if not p.free and p.at_rest and p.name)
    if not chosen:
        return []
    near = replace(problem, records=tuple(coarser(p) for p in chosen))
    model = Model(near, base_entries(near), (), rough_noise(near))
    x = np.array([entry.value / entry.scale for entry in model.entries])
    stiff, damped = constants_named(model, "stiffness"), constants_named(model, "damping")
    span: dict[Key, list[float]] = {}
    for k in (0.6, 0.8, 1.0, 1.25, 1.6) if stiff else (1.0,):
        for c in (0.5, 2.0) if damped else (1.0,):
            trial = x.copy()
            trial[stiff] *= k
            trial[damped] *= c
            for key, values in model.predict(bounded(model, trial)).items():
                if np.all(np.isfinite(values)):
                    span.setdefault(key, []).append(float(np.std(values)))
    found = []
    for prepared in near.records:
        for sensor in prepared.sensors:
            sizes = span.get((prepared.name, sensor.channel.name), [])
            measured = float(np.std(sensor.values))
            if not sizes or max(sizes) <= 0:
                continue
            factor = max(measured / max(sizes), 1.0) * min(measured / min(sizes), 1.0)
            names = " and ".join(f"'{name}'" for name in prepared.drives if name)
            words = f"the motion that {names} makes of the rig, at its start values"
            found += _sized(prepared, sensor, factor, words)
    return found


def sight_remarks(problem: Problem) -> list[Remark]:
    """Free constants that these records do not show, each with all other constants known.

    The rig moves as its records say, from start values; noise is what the highest frequencies
    show. A constant that noise hides alone no fit can tell with others.

    Args:
        problem: records and rig.

    Returns:
        Remarks; errors are relative to the start value [-].
    """
    near = replace(problem, records=tuple(coarser(p) for p in problem.records))
    entries = base_entries(near)
    guess = Model(near, entries, (), rough_noise(near), horizon=2.0)
    x = np.array([entry.value / entry.scale for entry in entries])
    x = _begun(guess, bounded(guess, x))
    quiet = {
        (p.name, s.channel.name): Noise((), quiet_std(s)) for p in near.records for s in p.sensors
    }
    jacobian = Model(near, entries, (), quiet).jacobian(x)
    constants = [i for i, e in enumerate(entries) if e.slot == "numbers" and not e.nuisance]
    others = [i for i in range(len(entries)) if i not in constants]
    basis = np.linalg.qr(jacobian[:, others])[0] if others else np.zeros((len(jacobian), 0))
    columns = jacobian[:, constants]
    seen = np.linalg.norm(columns - basis @ (basis.T @ columns), axis=0)
    plain = np.linalg.norm(columns, axis=0)
    return [
        remark
        for k, i in enumerate(constants)
        for remark in _sight(problem, entries[i], plain[k], seen[k], float(np.max(plain)))
    ]


FORCED = 0.3
"""Share of a driven record's size that its drive alone makes of the rig, from which on its start is
taken to be at rest [-]: a start state that is fitted to little would ring without end."""


def _begun(model: Model, x: np.ndarray) -> np.ndarray:
    """Scaled unknowns with start states that the first periods ask for."""
    forced = model.predict(x)
    begun = solve_linear(model, x)[0]
    resting = set()
    for prepared in model.problem.records:
        shares = [
            float(np.std(forced[prepared.name, s.channel.name])) / float(np.std(s.values) or 1.0)
            for s in prepared.sensors
        ]
        if not prepared.free and min(shares) > FORCED:
            resting.add(prepared.name)
    everywhere = len(resting) == len(model.problem.records)
    for i, entry in enumerate(model.entries):
        if (entry.slot == "start" and entry.record in resting) or (
            entry.slot == "drive" and everywhere
        ):
            begun[i] = 0.0
    return begun


def quiet_std(sensor: Sensor) -> float:
    """Standard deviation of a channel's noise, at most what its sidecar states [SI]."""
    rate = sensor.channel.sample_rate
    seen = noise_std(sensor.values, rate) or 1e-3 * float(np.ptp(sensor.values))
    stated = sensor.channel.noise
    floor = (quantization_step(sensor.values) or 0.0) / np.sqrt(12.0)
    least = max(floor, 1e-9 * float(np.ptp(sensor.values)), 1e-300)
    return max(seen if stated is None else min(seen, stated), least)


def _sight(
    problem: Problem, entry: Entry, plain: float, seen: float, liveliest: float
) -> list[Remark]:
    path, place = problem.rig.path, place_of(problem, entry.keys[0])
    if plain <= DEAD * liveliest:
        expected = "a free number that changes what these records show"
        where = "no response that moves with it"
        mend = "remove 'free', or choose the model or the sensor that knows it"
        return [Remark("liveness", True, path, place, expected, where, mend)]
    if np.isfinite(entry.prior):
        return []
    relative = entry.scale / max(seen, 1e-300) / max(abs(entry.value), 1e-300)
    if relative < UNSEEN[1]:
        return []
    expected = "records that excite what this number does"
    error = "far beyond itself" if relative > 1e3 else f"of {100 * relative:.0f} % of itself"
    where = f"an error {error} by noise alone, all others known"
    mend = "excite its mode, move farther, add a sensor nearby, or remove 'free'"
    return [Remark("excitation", relative > UNSEEN[0], path, place, expected, where, mend)]
