"""Sets what comes out of real records beside what is known of them from elsewhere."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .diagnosis import diagnose_records
from .engine import Progress, write_together
from .identify import identify_records
from .listing import markdown, printed
from .study import Call, Study

QUESTION = "Does the suite find, on real records, what is known of them from elsewhere?"

USUAL = Path("..", "shared", "data")
"""Where the records lie, as seen from the current folder or from the package's own."""

PROTOCOL = (
    "Every set is fitted and diagnosed as its sidecars and its rig stand; no true value, no law "
    "and no place was given.",
    "Held-out records take no part in the fit, nor in the choice of the noise law, the scales or "
    "the laws.",
    "When a held-out record is foretold, every constant, every law's strength and the drive's "
    "zero keep the values that the other records gave. Only its start state and the zeros of its "
    "sensors are fitted, and these only to its opening: three periods of a decay; of a driven "
    "record ten periods or a fiftieth of it, whichever is shorter, and 24 samples where nothing "
    "oscillates.",
    "From there on the simulation runs freely to the record's end. Its error is taken over the "
    "whole record, opening included, from a decay's first crossing of rest on.",
    "'Linear' is the same rig, fitted and foretold in the same way, without any law.",
)

STATIC = {"stiff": (24.25, 0.14, 0.003), "soft": (3.226, 0.021, 0.01)}
"""Stiffness and its error by static loading [N/m], and the relative error that is allowed [-]."""

EMPS_MASS, EMPS_FRICTION = 95.1, 20.4
"""Mass [kg] and dry friction [N] after Janot, Gautier and Brunot 2019."""

DAMPING = ("quadratic_damping", "coulomb_friction", "linear_damping")
SOFTENING = ("cubic_stiffness", "gravity", "asymmetric_stiffness")

FADING = "stiffness_drift"
"""A decay whose large swings are slower is stiffer later: by amplitude or by time."""

YIELDING = "hysteresis"
"""What lags behind the way both slows large swings and damps them. Of the four soft springs' decays
each was foretold from the other three: by it with 2.1, 2.8, 1.2 and 5.1 % of error, by air drag and
a drift with 1.7, 3.3, 1.8 and 5.4 %, by air drag and a cubic with 10, 4.0, 1.8 and 5.6 %."""


@dataclass(frozen=True)
class Claim:
    """One row of the table.

    Attributes:
        key: short name, for tests.
        records: the record set, in words.
        must: what must come out, in words.
        ours: what came out, in words.
        holds: whether it did.
        figures: the numbers behind the words, in the units that the words name.
    """

    key: str
    records: str
    must: str
    ours: str
    holds: bool
    figures: Mapping[str, Any]


def run(call: Call) -> dict[str, Any]:
    """Run every set and set its figures beside what must come out.

    Args:
        call: folder of the records, folder for the results, progress.

    Returns:
        The table with its protocol; real_records.json and real_records.md hold the same.

    Raises:
        ValueError: where the folder of records is missing or lacks a set.
    """
    from .. import __version__

    data = folder_of(call.data)
    began = time.perf_counter()
    claims: list[Claim] = []
    for part in (_spring_mass, _emps, _silverbox, _pendulum, _sloshing):
        claims += part(data, call.progress)
    call.progress("")
    result = {
        "question": QUESTION,
        "protocol": list(PROTOCOL),
        "rows": [asdict(claim) for claim in claims],
        "holds": all(claim.holds for claim in claims),
        "provenance": {
            "version": __version__,
            "seed": call.seed,
            "seconds": round(time.perf_counter() - began, 1),
        },
    }
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_together(
        call.out,
        {
            "real_records.json": lambda path: path.write_text(text, encoding="utf-8"),
            "real_records.md": lambda path: path.write_text(as_text(result), encoding="utf-8"),
        },
    )
    return result


def folder_of(given: Path | None) -> Path:
    """The folder of measured records: the given one, or the usual place where it exists."""
    beside = Path(__file__).resolve().parents[1] / USUAL
    tried = [given] if given is not None else [USUAL, beside]
    for folder in tried:
        if folder.is_dir():
            return folder
    raise ValueError(
        f"{tried[0]}: --data: expected the folder of measured records, found no such folder. "
        "Mend: name the folder that holds spring_mass, emps, silverbox, pendulum and sloshing."
    )


def _paths(data: Path, folder: str, names: Sequence[str]) -> list[Path]:
    return [data / folder / f"{name}.toml" for name in names]


def _diagnosed(
    data: Path, folder: str, train: Sequence[str], held: Sequence[str], progress: Progress
) -> dict[str, Any]:
    def tell(text: str) -> None:
        if text:
            progress(f"{folder}: {text}")

    inputs = _paths(data, folder, train), None, _paths(data, folder, held)
    result, _ = diagnose_records(*inputs, progress=tell)
    return result


def _causes(result: Mapping[str, Any]) -> list[str]:
    return [f"{one['place']}/{one['law']}" for one in result["causes"]]


def _named(result: Mapping[str, Any], law: str, place: str) -> dict[str, Any] | None:
    same = (one for one in result["causes"] if (one["law"], one["place"]) == (law, place))
    return next(same, None)


def _strength(cause: Mapping[str, Any]) -> dict[str, Any]:
    return next(iter(cause["parameters"].values()))


def _told(result: Mapping[str, Any]) -> str:
    return f"{result['status']}: {', '.join(_causes(result)) or 'no cause'}"


def _verdict_figures(result: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "status": result["status"],
        "causes": _causes(result),
        "why": result["why"],
        "seconds": result["provenance"]["seconds"],
    }


def _error(result: Mapping[str, Any], record: str, which: str) -> float:
    """One error of a held-out record [SI, or - for means]."""
    found = [one for key, one in result["gain"]["errors"].items() if key.startswith(f"{record}:")]
    return float(found[0][which])


def _spring_mass(data: Path, progress: Progress) -> list[Claim]:
    claims = []
    for kind, (static, error, allowed) in STATIC.items():
        names = [f"{kind}_{disc}_run{run}" for disc in ("disc", "mesh") for run in (1, 2)]
        records = f"spring_mass, four {kind}"
        progress(f"{records}: fitting")
        fitted, _ = identify_records(_paths(data, "spring_mass", names))
        one = fitted["parameters"]["links.spring.stiffness"]
        off = abs(one["value"] / static - 1.0)
        overlaps = one["low"] <= static + error and one["high"] >= static - error
        claims.append(
            Claim(
                f"{kind}_stiffness",
                records,
                f"stiffness within {100 * allowed:g} % of the static {static} ± {error} N/m, "
                "95 % interval holds it within its error",
                f"{one['value']:.3f} ± {one['std']:.3f} N/m, {one['low']:.3f} to "
                f"{one['high']:.3f} ({100 * off:.2f} % off)",
                off <= allowed and overlaps,
                {k: one[k] for k in ("value", "std", "low", "high")} | {"static": static},
            )
        )
        result = _diagnosed(data, "spring_mass", names, (), progress)
        counted = counted_softening(data, "spring_mass", names)
        claims.append(
            Claim(
                f"{kind}_causes",
                records,
                "adequate, or air damping; a spring that softens in large swings, yields there or "
                "stiffens as they fade, only where cycles, counted without a model, are slower",
                f"{_told(result)}; {result['why'][0]} Counted: {in_words(counted)}",
                _damping_or_counted(result, counted),
                _verdict_figures(result) | {"counted": counted},
            )
        )
    return claims


def counted_softening(data: Path, folder: str, names: Sequence[str]) -> list[tuple[float, float]]:
    """How much slower the cycles of each decay are at its largest swing, without any model.

    Returns:
        Relative change of frequency [-] from the smallest swings to the largest, and its standard
        error, one pair a record: the slope over the square of the amplitude.
    """
    from ..identification.backbone import counted_change
    from ..identification.records import read_record

    channels = [read_record(path).responses[0] for path in _paths(data, folder, names)]
    return [counted_change(channel.values, channel.sample_rate) for channel in channels]


def in_words(counted: Sequence[tuple[float, float]]) -> str:
    """Counted changes of frequency [-] as text."""
    parts = ", ".join(f"{100 * change:+.2f} ± {100 * std:.2f} %" for change, std in counted)
    return f"frequency at the largest swing {parts}."


def _damping_or_counted(result: Mapping[str, Any], counted: Sequence[tuple[float, float]]) -> bool:
    """Whether the verdict is one that the counted cycles allow."""
    signs = dict.fromkeys(SOFTENING, -1.0) | {FADING: 1.0, YIELDING: 1.0}
    slower = [c for c in result["causes"] if c["law"] in signs]
    rest = {c["law"] for c in result["causes"]} - set(signs)
    seen = sum(change < -3.0 * std for change, std in counted) > len(counted) / 2
    right = all(_strength(cause)["value"] * signs[cause["law"]] > 0 for cause in slower)
    allowed = not slower or (seen and right)
    return result["status"] in ("adequate", "named") and allowed and rest <= set(DAMPING)


def _emps(data: Path, progress: Progress) -> list[Claim]:
    result = _diagnosed(data, "emps", ["train"], ["pulses"], progress)
    friction = _named(result, "coulomb_friction", "screw")
    mass = result["parameters"]["masses.carriage.mass"]
    force = _strength(friction) if friction else {"value": 0.0, "std": 0.0}
    before, after = (1e3 * _error(result, "pulses", f"rms_{w}") for w in ("before", "after"))
    name = "emps/train, held out pulses"
    return [
        Claim(
            "emps_cause",
            name,
            "coulomb_friction at the screw",
            _told(result),
            result["status"] == "named" and friction is not None,
            _verdict_figures(result),
        ),
        Claim(
            "emps_mass",
            name,
            f"mass within 2 % of {EMPS_MASS} kg",
            f"{mass['after']:.2f} ± {mass['std']:.2f} kg",
            abs(mass["after"] / EMPS_MASS - 1.0) <= 0.02,
            {"mass": mass["after"], "std": mass["std"]},
        ),
        Claim(
            "emps_friction",
            name,
            f"friction within 6 % of {EMPS_FRICTION} N",
            f"{force['value']:.2f} ± {force['std']:.2f} N",
            abs(force["value"] / EMPS_FRICTION - 1.0) <= 0.06,
            {"friction": force["value"], "std": force["std"]},
        ),
        Claim(
            "emps_pulses",
            name,
            "position error on the pulses at most 0.55 of the linear model's",
            f"{before:.2f} mm linear, {after:.2f} mm with the law(s): {after / before:.3f}",
            after <= 0.55 * before,
            {"before_mm": before, "after_mm": after, "ratio": after / before},
        ),
    ]


def _silverbox(data: Path, progress: Progress) -> list[Claim]:
    held = ["test_multisine", "test_arrow"]
    result = _diagnosed(data, "silverbox", ["train"], held, progress)
    name = "silverbox/train, held out both tests"
    claims = [
        Claim(
            "silverbox_cause",
            name,
            "cubic_stiffness at the spring",
            _told(result),
            result["status"] == "named" and _named(result, "cubic_stiffness", "spring") is not None,
            _verdict_figures(result),
        )
    ]
    for record, words in zip(held, ("the multisine", "the whole arrow"), strict=True):
        before, after = (1e3 * _error(result, record, f"rms_{w}") for w in ("before", "after"))
        claims.append(
            Claim(
                f"silverbox_{record.removeprefix('test_')}",
                name,
                f"free-run error on {words} at most 1.0 mV",
                f"{after:.3f} mV ({before:.2f} mV linear)",
                after <= 1.0,
                {"before_mv": before, "after_mv": after},
            )
        )
    return claims


def _pendulum(data: Path, progress: Progress) -> list[Claim]:
    import numpy as np

    result = _diagnosed(data, "pendulum", ["swing_01", "swing_03"], ["swing_02"], progress)
    causes, status = _causes(result), result["status"]
    sine, cubic = "bob/gravity" in causes, _named(result, "cubic_stiffness", "pivot")
    softens = cubic is not None and _strength(cubic)["value"] < 0
    dry = [why for why in result["why"] if why.startswith("pivot/coulomb_friction")]
    friction = "pivot/coulomb_friction" in causes
    errors = [_error(result, "swing_02", f"rms_{w}") for w in ("before", "after")]
    before, after = np.degrees(errors).tolist()
    name = "pendulum, two smaller swings; held out the 135° one"
    return [
        Claim(
            "pendulum_cause",
            name,
            "softening named as gravity's sine, or ambiguous with a cubic of its sign",
            _told(result),
            (sine and status in ("named", "ambiguous")) or (softens and status == "ambiguous"),
            _verdict_figures(result),
        ),
        Claim(
            "pendulum_friction",
            name,
            "dry friction as second cause, or the evidence why not",
            "coulomb_friction at the pivot" if friction else "; ".join(dry) or "nothing said of it",
            friction or bool(dry),
            {"named": friction, "why_not": dry},
        ),
        Claim(
            "pendulum_error",
            name,
            "error on the 135° swing at most 1.5°",
            f"{after:.2f}° ({before:.1f}° linear)",
            after <= 1.5,
            {"before_deg": before, "after_deg": after},
        ),
    ]


def _sloshing(data: Path, progress: Progress) -> list[Claim]:
    result = _diagnosed(data, "sloshing", ["decay_01", "decay_03"], ["decay_02"], progress)
    laws = {cause["law"] for cause in result["causes"]}
    before, after = (100 * _error(result, "decay_02", f"mean_{w}") for w in ("before", "after"))
    name = "sloshing 1 and 3, held out 2"
    named = result["status"] in ("named", "ambiguous")
    return [
        Claim(
            "sloshing_frequency",
            name,
            "amplitude-dependent frequency named",
            _told(result),
            named and bool(laws & set(SOFTENING)),
            _verdict_figures(result),
        ),
        Claim(
            "sloshing_damping",
            name,
            "amplitude-dependent damping named",
            ", ".join(sorted(laws & set(DAMPING))) or "; ".join(result["why"][1:]) or "not named",
            named and bool(laws & set(DAMPING)),
            {"causes": _causes(result)},
        ),
        Claim(
            "sloshing_error",
            name,
            "decay 2 foretold with a mean error of at most 2.5 % of its largest value",
            f"{after:.2f} % ({before:.2f} % linear)",
            after <= 2.5,
            {"before_percent": before, "after_percent": after},
        ),
    ]


HEADINGS = ("record set", "must come out", "ours", "verdict")


def _cells(row: Mapping[str, Any]) -> tuple[str, str, str, str]:
    return row["records"], row["must"], row["ours"], "holds" if row["holds"] else "DOES NOT HOLD"


def as_text(result: Mapping[str, Any]) -> str:
    """The table and its protocol as Markdown."""
    table = markdown(HEADINGS, [_cells(row) for row in result["rows"]])
    protocol = [f"- {line}" for line in result["protocol"]]
    lines = [f"# {result['question']}", "", *table, "", "## Protocol", *protocol]
    return "\n".join(lines) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the table and its protocol."""
    rows = [_cells(row) for row in result["rows"]]
    printed(result["question"], HEADINGS, rows, [f"  - {line}" for line in result["protocol"]])


STUDY = Study("real_records", QUESTION, run, show)
