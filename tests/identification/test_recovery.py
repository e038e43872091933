"""Constants from driven records, decays and blows of two benches that share no code with us."""

from pathlib import Path

import numpy as np

from supple.identification.fit import Fit, fit_base
from supple.identification.identifiable import identifiability
from supple.identification.problem import make_problem
from supple.identification.records import read_record
from supple.identification.weighing import with_laws
from supple.model.rig import read_rig
from tests.lab.sealed import draw_sealed

SEEDS = range(9000, 9100)
LOUD = 30.0


def fitted(folder: Path, bench: str, seed: int) -> tuple[Fit, dict]:
    """A driven record, a decay and a blow of a club on a driven wrist, fitted; and the truth."""
    truth = draw_sealed(
        folder, bench, seed, effects=0, model="driven_wrist", noise="white", snr_db=LOUD,
        train=3, held_out=0,
    )  # fmt: skip
    records = folder / "records"
    told = [read_record(path) for path in sorted(records.glob("train_*.toml"))]
    assert {record.test for record in told} == {"driven", "decay", "impact"}
    return with_laws(fit_base(make_problem(told, read_rig(records / "rig.toml")))), truth


def values(fit: Fit) -> dict[str, float]:
    return {entry.label: fit.value(i) for i, entry in enumerate(fit.model.entries)}


def lumped_errors(folder: Path, seed: int) -> dict[str, float]:
    """Relative error of every constant that is told, bench of lumped bodies."""
    fit, truth = fitted(folder, "A", seed)
    told, found = identifiability(fit), values(fit)
    seen = [name for name, one in told.items() if one["identifiable"] == "yes"]
    return {name: found[name] / truth["lumped"][name] - 1.0 for name in seen}


def club_errors(folder: Path, seed: int) -> dict[str, float]:
    """Relative errors of what a club of elements has in common with a lumped one."""
    fit, truth = fitted(folder, "B", seed)
    found, real = values(fit), truth["lumped"]
    both = []
    for of in (found, real):
        k, c, m = (of[name] for name in ("shaft_stiffness", "shaft_damping", "clubhead_mass"))
        beat = np.sqrt(k / m)
        both.append({
            "frequency": beat, "ratio": c * beat / (2 * k), "stiffness": k,
            "wrist_stiffness": of["wrist_stiffness"], "wrist_damping": of["wrist_damping"],
        })  # fmt: skip
    return {name: both[0][name] / both[1][name] - 1.0 for name in both[0]}


def medians(rows: list[dict[str, float]]) -> dict[str, float]:
    """Median size of each error over the cases that tell it."""
    names = sorted({name for row in rows for name in row})
    return {name: float(np.median([abs(r[name]) for r in rows if name in r])) for name in names}
