"""Which sleeve constants the thesis's measured modes ask for, and how far its coupon's are."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .engine import start_engine, write_together
from .listing import markdown, printed
from .study import Call, Study

NAME = "sleeve_constants"
QUESTION = (
    "Which sleeve constants do the measured modes of the rigid club and of three sleeves ask for, "
    "and how far are they from the coupon's?"
)
MODES = Path(__file__).resolve().parent / "data" / "sleeves" / "modes.toml"
RIGID = "rigid collet"
WHOLE_TURN = 2 * np.pi
MADE_WITH = {  # how a coupon's tan delta may have been turned into its damping
    "its own stiffness and 4 Hz": ("own", 4.0),
    "its own stiffness and 1 Hz": ("own", 1.0),
    "the 0 % stiffness and 4 Hz": ("first", 4.0),
    "the 0 % stiffness and 1 Hz": ("first", 1.0),
}
RIGHT = "its own stiffness and 4 Hz"
ALIKE = 0.03  # what rounding to two digits leaves
HEADINGS = (
    "sleeve", "k [kN/m]", "coupon", "c [N s/m]", "coupon", "over", "B2", "without B2", "over",
)  # fmt: skip


def find() -> dict[str, Any]:
    """Constants that the modes ask for beside those of the coupon, as printed and without B2."""
    from ..identification.modal import fit_modal
    from .modal import read_tables
    from .thesis.errata_numbers import SAMPLE
    from .thesis.runs import TABLE_4, club, slowest

    tables, rig = read_tables([MODES], None)
    fit = fit_modal(tables, rig)
    origin, off = _origin(SAMPLE)
    rows = []
    for mode, told in zip(fit.modes, fit.predicted, strict=True):
        if mode.condition == RIGID:
            continue
        deadener = int(mode.condition.rstrip(" %"))
        k, c = TABLE_4[deadener]
        _, damping, loss = SAMPLE[deadener]
        factor = damping / _damping(SAMPLE, deadener, RIGHT)
        asked_k, asked_c = (
            fit.of(f"sleeve_{w}[{mode.condition}]") for w in ("stiffness", "damping")
        )
        with_table, mended = slowest(club((k, c))), slowest(club((k, c / factor)))
        rows.append(
            {
                "sleeve": mode.condition,
                "stiffness": {"asked": asked_k[0], "std": asked_k[1], "coupon": k},
                "damping": {"asked": asked_c[0], "std": asked_c[1], "coupon": c},
                "factor": factor,
                "coupon_without_factor": c / factor,
                "loss_factor": {
                    "asked": asked_c[0] * WHOLE_TURN * told[0] / asked_k[0],
                    "coupon": c * WHOLE_TURN * told[0] / k,
                    "tan_delta": loss,
                },
                "frequency": {
                    "measured": mode.frequency,
                    "coupon": with_table.frequency,
                    "without_factor": mended.frequency,
                },
                "damping_ratio": {
                    "measured": mode.damping_ratio,
                    "coupon": with_table.ratio,
                    "without_factor": mended.ratio,
                },
            }
        )
    shaft = fit.of("shaft_damping")
    return {
        "rows": rows,
        "shaft_damping": {"value": shaft[0], "std": shaft[1], "unit": "N s/m"},
        "chi2": fit.chi2,
        "status": fit.status,
        "cause": {"erratum": "B2", "made_with": origin, "largest_deviation": off},
        "sentences": _sentences(rows, origin, off),
    }


def _damping(sample: Mapping[int, tuple[float, float, float]], deadener: int, way: str) -> float:
    """A coupon's damping from its tan delta [N s/m]."""
    whose, hertz = MADE_WITH[way]
    stiffness = sample[deadener if whose == "own" else 0][0]
    return stiffness * sample[deadener][2] / (WHOLE_TURN * hertz)


def _origin(sample: Mapping[int, tuple[float, float, float]]) -> tuple[str, float]:
    """Which of the ways gives the printed dampings, and by how much it misses at most [-]."""
    off = {
        way: max(abs(c / _damping(sample, d, way) - 1) for d, (_, c, _) in sample.items())
        for way in MADE_WITH
    }
    best = min(off, key=lambda way: off[way])
    return best, off[best]


def _sentences(rows: list[dict[str, Any]], origin: str, off: float) -> list[str]:
    def listed(values: list[float], form: str = ".2g") -> str:
        words = [f"{value:{form}}" for value in values]
        return f"{', '.join(words[:-1])} and {words[-1]}"

    factors = [row["factor"] for row in rows]
    before = [row["damping"]["coupon"] / row["damping"]["asked"] for row in rows]
    after = [row["coupon_without_factor"] / row["damping"]["asked"] for row in rows]
    soft = [row["stiffness"]["coupon"] / row["stiffness"]["asked"] for row in rows]
    said = [
        f"The coupon's stiffness is {listed(soft)} times what the modes ask for (0, 25 and 50 %), "
        f"its damping {listed(before)} times.",
    ]
    if off < ALIKE and origin != RIGHT:
        said.append(
            f"The cause is B2: the printed dampings are made of tan delta with {origin}, to "
            f"{100 * off:.0f} %, not with {RIGHT} (lines 1241 to 1248). That alone makes them "
            f"{listed(factors)} times too large; without it they are {listed(after)} times what "
            "the modes ask for."
        )
    rings = {
        key: listed([row["frequency"][key] for row in rows], ".3g")
        for key in ("coupon", "without_factor", "measured")
    }
    said.append(
        f"With the printed dampings the club rings at {rings['coupon']} Hz: the dashpots lock the "
        f"sleeves. Without the factor it rings at {rings['without_factor']} Hz; it was measured at "
        f"{rings['measured']} Hz."
    )
    asked = listed([row["loss_factor"]["asked"] for row in rows])
    told = listed([row["loss_factor"]["tan_delta"] for row in rows])
    said.append(
        f"The modes ask for loss factors of {asked}; the coupons' tan delta is {told}. What is "
        "left beyond B2 with 25 and 50 % deadener is a loss that no coupon showed, and all sleeves "
        "are softer than their coupons; the modes cannot tell why."
    )
    return said


def run(call: Call) -> dict[str, Any]:
    """Answer the question; write its table and JSON."""
    from .. import __version__

    start_engine()
    began = time.perf_counter()
    found = {"study": NAME, "question": QUESTION, **find()}
    seconds = round(time.perf_counter() - began, 1)
    found["provenance"] = {"version": __version__, "seed": call.seed, "seconds": seconds}
    text = json.dumps(found, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_together(
        call.out,
        {
            f"{NAME}.json": lambda path: path.write_text(text, encoding="utf-8"),
            f"{NAME}.md": lambda path: path.write_text(as_text(found), encoding="utf-8"),
        },
    )
    return found


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    k, c, mended = row["stiffness"], row["damping"], row["coupon_without_factor"]
    return (
        row["sleeve"],
        f"{k['asked'] / 1e3:.3g} ± {k['std'] / 1e3:.1g}",
        f"{k['coupon'] / 1e3:.3g}",
        f"{c['asked']:.0f} ± {c['std']:.0f}",
        f"{c['coupon']:.0f}",
        f"{c['coupon'] / c['asked']:.2g}",
        f"{row['factor']:.2g}",
        f"{mended:.0f}",
        f"{mended / c['asked']:.2g}",
    )


def as_text(result: Mapping[str, Any]) -> str:
    """The table and what it means, as Markdown."""
    table = markdown(HEADINGS, [_cells(row) for row in result["rows"]])
    below = [f"- {line}" for line in result["sentences"]]
    return "\n".join([f"# {result['question']}", "", *table, "", *below]) + "\n"


def show(result: Mapping[str, Any]) -> None:
    """Print the table and what it means."""
    rows = [_cells(row) for row in result["rows"]]
    printed(result["question"], HEADINGS, rows, [f"  - {line}" for line in result["sentences"]])


STUDY = Study(NAME, QUESTION, run, show)
