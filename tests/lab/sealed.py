"""Writes a sealed case of bench A or B: records and rig for whoever is tested, the truth beside."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.signal import resample_poly

from . import noise as noises
from .causes import ALSO, CAUSES, WEAKEST, Hidden, draw_cause, lets_go, possible, weaker
from .clubs import (
    COUNT,
    MODELS,
    Club,
    as_lumped,
    club_rig_tables,
    collet_held,
    draw_scattered_club,
    in_file,
)
from .files import toml_table, write_rig
from .gauges import Gauge, clock
from .power import power
from .runs import Run, carry_out, channels, counts_from, draw_runs, made_again

NOISES = ("white", "ar1", "heteroscedastic", "heavy_tailed", "outliers", "quantised")
SHARE_CLEAN = 0.25


def draw_sealed(
    out: Path,
    bench: str,
    seed: int,
    effects: int | None = None,
    law: str | None = None,
    place: str | None = None,
    strength: float | None = None,
    model: str | None = None,
    noise: str | None = None,
    snr_db: float = 30.0,
    train: int = 4,
    held_out: int = 2,
    samples: int = COUNT,
    again: str | None = None,
) -> dict:
    """Writes one case and returns its truth; the same arguments give the same bytes.

    Args:
        out: OUT/records gets what a lab would hand over, OUT/truth.json what it would not know.
        bench: A (lumped) or B (finite elements).
        seed: the case.
        effects: how many causes; drawn (none or one) if None.
        law: the first cause's law; drawn if None.
        place: its place.
        strength: its strength, as `causes.WEAKEST` has it; drawn if None.
        model: fixed_collet, pinned_wrist or driven_wrist; drawn if None.
        noise: its kind; drawn if None.
        snr_db: rms of each channel over its noise [dB].
        train: records to learn from.
        held_out: records to hold out, of another amplitude or kind.
        samples: of each record, at 2048 Hz.
        again: one record more to learn from, NAME:FACTOR, as `runs.made_again` has it; all others
            stay as they are.

    Raises:
        ValueError: for a bench, law, place, model, noise or test that there is not.
    """
    _check(law, place, model, noise)
    rng = _chance(seed, "case", bench)
    count = _how_many(rng, effects, law)
    pairs = _pairs(rng, count, law, place, model)
    chosen = _model_for(rng, pairs, model)
    club = draw_scattered_club(_chance(seed, "club", bench), bench, chosen, samples)
    pairs = [_there(pair, club, rng) for pair in pairs]
    runs = draw_runs(club, _chance(seed, "runs"), train, held_out)
    twins = [carry_out(club, run) for run in runs]
    motions = [moved for _, moved in twins]
    hidden: list[Hidden] = []
    chance = _chance(seed, "effect")
    for index, pair in enumerate(pairs):
        size = strength if index == 0 else None
        cause = draw_cause(club, *pair, size, motions, chance)
        hidden.append(held_back(cause, club, runs, hidden) if size is None else cause)
    if again is not None:
        runs.append(made_again(runs, again, _chance(seed, "again", again)))
        motions.append(carry_out(club, runs[-1])[1])
    noise_rng = _chance(seed, "noise")
    kind = noise or str(noise_rng.choice(NOISES))
    told = {"kind": kind, "snr_db": snr_db, "law": noises.draw_law(kind, noise_rng)}
    facts = {"bench": bench, "seed": seed, "model": club.model, "noise": told}
    return _write(out, club, runs, motions, hidden, told, noise_rng, facts)


MOST_HALVED = 6


def held_back(cause: Hidden, club: Club, runs: list[Run], beside: list[Hidden]) -> Hidden:
    """A drawn cause, so weak that no spring lets go: no lab keeps a robot that spins away."""
    if cause.law != "cubic_stiffness" or cause.size >= 0:
        return cause
    for _ in range(MOST_HALVED):
        if stays(cause, club, runs, beside):
            break
        cause = weaker(cause)
    return cause


def stays(cause: Hidden, club: Club, runs: list[Run], beside: list[Hidden]) -> bool:
    """Whether no spring that softens lets go in any of the runs."""
    try:
        motions = [carry_out(club, run, [*beside, cause])[1] for run in runs]
    except RuntimeError:  # gone so far that no step closes
        return False
    return not lets_go(cause, club.structure(), motions)


def _check(law: str | None, place: str | None, model: str | None, noise: str | None) -> None:
    asked = {"law": (law, WEAKEST), "model": (model, MODELS), "noise": (noise, noises.KINDS)}
    asked["place"] = (place, sorted({spot for _, spot in CAUSES}))
    for name, (value, known) in asked.items():
        if value is not None and value not in known:
            raise ValueError(f"{name} {value!r}: expected one of {', '.join(known)}")


def _chance(seed: int, *purpose: str) -> np.random.Generator:
    """A source of chance for one purpose, so that cases differ only in what is asked to differ."""
    return np.random.default_rng([seed, zlib.crc32("/".join(("sealed", *purpose)).encode())])


def _how_many(rng: np.random.Generator, effects: int | None, law: str | None) -> int:
    clean = rng.random() < SHARE_CLEAN
    if effects is not None:
        return effects
    return 0 if clean and law is None else 1


def _pairs(rng, count: int, law, place, model) -> list[tuple[str, str]]:
    """Causes at places that can be hidden together in one club of that model."""
    fitting = [
        pair
        for pair in CAUSES
        if law in (None, pair[0]) and place in (None, pair[1]) and _fits(pair, model)
    ]
    if count and not fitting:
        raise ValueError(f"{law} @ {place} in {model}: expected a pair of {CAUSES}")
    chosen: list[tuple[str, str]] = []
    while len(chosen) < count:
        open_ = fitting if not chosen else [pair for pair in CAUSES if _fits(pair, model)]
        laws = sorted({name for name, _ in open_})
        pick = str(rng.choice(laws))
        pair = open_[int(rng.choice([i for i, one in enumerate(open_) if one[0] == pick]))]
        if pair[0] not in [name for name, _ in chosen]:
            chosen.append(pair)
    return chosen


def _fits(pair: tuple[str, str], model: str | None) -> bool:
    if pair[1] == "drive":
        return model in (None, "driven_wrist")
    return model != "fixed_collet" or pair[1] not in ("wrist", "collet", "collet_encoder")


def _model_for(rng, pairs, model: str | None) -> str:
    drawn = str(rng.choice(MODELS, p=[0.25, 0.35, 0.4]))
    if model is not None:
        return model
    places = {place for _, place in pairs}
    if "drive" in places:
        return "driven_wrist"
    if drawn == "fixed_collet" and places & {"wrist", "collet", "collet_encoder"}:
        return "pinned_wrist"
    return drawn


def _there(pair: tuple[str, str], club: Club, rng) -> tuple[str, str]:
    """The pair, or the same law at another place where the club has no such instrument."""
    if pair in possible(club):
        return pair
    same = [one for one in possible(club) if one[0] == pair[0]]
    return same[int(rng.integers(len(same)))]


def _write(out: Path, club: Club, runs, motions, hidden, told, rng, facts) -> dict:
    folder = out / "records"
    folder.mkdir(parents=True, exist_ok=True)
    structure = club.structure()
    clean = [
        channels(club, run, structure, moved) for run, moved in zip(runs, motions, strict=True)
    ]
    changed = _shown(club, runs, hidden) if hidden else clean
    noise = [
        _levels(club, run, table, told["snr_db"]) for run, table in zip(runs, clean, strict=True)
    ]
    write_rig(folder / "rig.toml", club_rig_tables(club))
    for run, table, std in zip(runs, changed, noise, strict=True):
        _write_run(folder, club, run, table, std, told, rng)
    truth = {**facts, "causes": [_facts(cause, club) for cause in hidden]}
    truth["constants"] = {name: float(value) for name, value in club.truth.items()}
    truth["lumped"] = {name: float(value) for name, value in as_lumped(club).items()}
    truth["collet_held"] = collet_held(club)
    truth["records"] = [
        {"name": run.name, "kind": run.kind, "split": run.split, "amplitude": run.amplitude}
        | {"noise_std": {name: float(value) for name, value in std.items()}}
        for run, std in zip(runs, noise, strict=True)
    ]
    truth["power"] = _power(club, runs, clean, changed, noise) if hidden else None
    for cause, own in zip(hidden, truth["causes"], strict=True):
        others = [one for one in hidden if one is not cause]
        beside = _shown(club, runs, others) if others else clean
        own["power"] = _power(club, runs, beside, changed, noise) if others else truth["power"]
    (out / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    return truth


def _shown(club: Club, runs, hidden: list[Hidden]) -> list[dict[str, np.ndarray]]:
    """What the instruments write of each run with these causes, without noise [SI]."""
    moved = [carry_out(club, run, hidden) for run in runs]
    return [channels(club, run, *one, hidden) for run, one in zip(runs, moved, strict=True)]


def _power(club, runs, clean, changed, noise) -> dict:
    chosen = [index for index, run in enumerate(runs) if run.split == "train"]
    rows = ([rows[index] for index in chosen] for rows in (runs, clean, changed, noise))
    return power(club, *rows)


def _facts(cause: Hidden, club: Club) -> dict:
    errors = [gauge.errors for gauge in club.gauges if gauge.name == cause.place]
    return {
        "law": cause.law,
        "place": cause.place,
        "places": list(ALSO.get(cause.place, (cause.place,))),
        "strength": cause.strength,
        "size": cause.size,
        "unit": cause.unit,
        "gain": errors[0].get("gain", 0.0) if errors else None,  # of the channel, after its fault
        **dict(cause.facts),
    }


def _levels(club: Club, run: Run, table: Mapping[str, np.ndarray], snr_db: float) -> dict:
    """Standard deviation of each channel's noise [SI]; the robot's is that of its resolution."""
    found = {}
    for gauge in club.gauges:
        if gauge.name not in table:
            continue
        if gauge.step:
            found[gauge.name] = float(np.radians(gauge.step) * np.sqrt(1 / 12 + 0.2**2))
            continue
        late = clock(gauge, club.rate, club.count) >= counts_from(run, club.rate)
        level = float(np.sqrt(np.mean(table[gauge.name][late] ** 2)))
        found[gauge.name] = level * 10 ** (-snr_db / 20)
    return found


def _write_run(folder: Path, club: Club, run: Run, table, std, told, rng) -> None:
    record = {"test": run.kind, "rig": "rig.toml", "sample_rate": club.rate, "split": run.split}
    tables: dict[str, dict[str, object]] = {
        "record": record,
        "channels.time": {"column": "time", "unit": "s"},
    }
    shift = round(float(rng.uniform(-0.2, 0.2)), 3)  # the robot's clock against the record's [s]
    own: dict[str, np.ndarray] = {}
    robot: dict[str, np.ndarray] = {}
    for gauge in club.gauges:
        if gauge.name not in table:
            continue
        values = table[gauge.name]
        if gauge.step:
            values = in_file(gauge, values)
            shaken = values + 0.2 * gauge.step * rng.standard_normal(len(values))
            robot[gauge.name] = gauge.step * np.round(shaken / gauge.step)
        else:
            spread = noises.draw_noise(told["kind"], std[gauge.name], values, rng, told["law"])
            own[gauge.name] = in_file(gauge, values + spread)
        tables |= _channel_tables(club, run, gauge, shift)
    if run.told_force:
        own["hammer"] = sampled(run.loads.force, (len(run.loads.force) - 1) // (club.count - 1))
        tables["channels.hammer"] = {"column": "hammer", "unit": "N", "role": "input"}
        tables["channels.hammer"] |= {"quantity": "force", "place": "clubhead"}
    if run.told_at:
        at = run.first if run.kind == "decay" else np.flatnonzero(run.loads.force)[0] // 4
        tables["start"] = {"at": float(at / club.rate)}
    _write_table(folder / f"{run.name}.csv", "time", np.arange(club.count) / club.rate, own)
    if robot:
        gauge = club.gauge("collet_encoder")
        times = clock(gauge, club.rate, club.count) - shift
        _write_table(folder / f"{run.name}_robot.csv", "time_s", times, robot)
    text = "\n\n".join(toml_table(key, entries) for key, entries in tables.items())
    (folder / f"{run.name}.toml").write_text(text + "\n", encoding="utf-8")


def sampled(fine: np.ndarray, every: int) -> np.ndarray:
    """Every so many values of a force [N], after the filter against aliasing that any sampler has.

    Bare samples of a half sine have 0.6 % less impulse than the blow, by its kinks.
    """
    return np.asarray(resample_poly(fine, 1, every))


def _channel_tables(
    club: Club, run: Run, gauge: Gauge, shift: float
) -> dict[str, dict[str, object]]:
    if gauge.role == "input":
        what = {"quantity": "angle", "place": "wrist"}
    else:
        view = club.structure().views[gauge.view]
        what = {"quantity": view.quantity, "place": view.place, "frame": view.frame}
    entries: dict[str, object] = {
        "column": gauge.name,
        "unit": gauge.unit,
        "role": gauge.role,
        **what,
    }
    if gauge.rate != club.rate:
        entries |= {"file": f"{run.name}_robot.csv", "time": "time_s", "clock_offset": shift}
    stated: dict[str, object] = dict(gauge.tolerance)
    if "offset" in stated:
        stated["offset"] = float(in_file(gauge, np.asarray(gauge.tolerance["offset"])))
    return {
        f"channels.{gauge.name}": entries,
        f"channels.{gauge.name}.tolerance": stated,
    }


def _write_table(
    path: Path, first: str, times: np.ndarray, columns: Mapping[str, np.ndarray]
) -> None:
    table = np.column_stack([times, *columns.values()])
    header = ",".join([first, *columns])
    layout = ["%.10g"] + ["%.8g"] * len(columns)
    np.savetxt(path, table, fmt=layout, delimiter=",", header=header, comments="")
