"""Whether any damping of grip or shaft damps the fixed club critically (section 6.4)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .printed import equation_11, symmetric
from .runs import TABLE_4, club
from .table import Found, answering, claim, show

NAME = "thesis/critical_damping"
QUESTION = "Can any damping of grip or shaft damp the fixed club critically (section 6.4)?"
SOFT = 100.0  # N/m, line 1333

Intervals = tuple[tuple[float, float], ...]


def overdamped(p: Mapping[str, float], name: str) -> Intervals:
    """Every interval of one damping [N s/m] of the fixed collet without a swinging mode."""
    from ...model.critical import critical_damping
    from ...model.robot import Robot

    return critical_damping(Robot("fixed_collet"), p, name).intervals


def overdamped_as_printed(p: Mapping[str, float]) -> Intervals:
    """Every interval of grip damping [N s/m] without a swinging mode by the printed eq. 11."""
    from ...model.critical import damping_intervals

    bare, one = (equation_11({**p, "sleeve_damping": value}) for value in (0.0, 1.0))
    return damping_intervals(bare.mass, bare.damping, bare.stiffness, one.damping - bare.damping)


@cache
def stiffest(low: float = 2e3, high: float = 2e4, precision: float = 0.01) -> float:
    """The stiffest grip [N/m] that some grip damping makes overdamped, to a relative precision."""
    while high / low > 1 + precision:
        middle = math.sqrt(low * high)
        found = overdamped(club((middle, 1.0)), "sleeve_damping")
        low, high = (middle, high) if found else (low, middle)
    return low


def in_words(intervals: Intervals) -> str:
    """Intervals of damping [N s/m] as text."""
    spans = [f"from {low:.4g} to {high:.4g} N s/m" for low, high in intervals]
    return " and ".join(spans) or "none"


def find() -> Found:
    """Exact intervals of the dampings, without and with the slip of eq. 11."""
    from ...model.critical import check_aperiodic

    soft, silicone = club((SOFT, 1.0)), club(TABLE_4[50])
    grip, shaft = overdamped(soft, "sleeve_damping"), overdamped(silicone, "shaft_damping")
    printed, limit = overdamped_as_printed(soft), stiffest()
    middle = math.sqrt(math.prod(grip[0])) if grip else 1.0
    inside = symmetric("fixed_collet", soft | {"sleeve_damping": middle})
    proof = check_aperiodic(inside.mass, inside.damping, inside.stiffness)
    rows = (
        claim("none", "no grip damping makes a grip of 100 N/m critically damped",
              in_words(grip), not grip, "line 1355",
              definition="exact discriminant and Sturm count over every positive damping, "
              "shaft damping 0.0807 N s/m; all four elements alike",
              why=f"At {middle:.4g} N s/m {proof.n_negative} of six eigenvalues are real and "
              f"negative and {sum(m > 0 for m in proof.minors)} of six Hankel minors positive."),
        claim("printed", "none exists when eq. 11 is taken as it is printed", in_words(printed),
              not printed, "line 1119",
              definition="the same search with the lever l/2 of the printed entry (3,2)",
              why="The slip is the likely origin of the claim."),
        claim("shaft", "with an adjustable shaft damping it could be critically damped",
              f"shaft damping {in_words(shaft)} at 130 kN/m and 12 kN s/m", shaft, "line 1355",
              definition="search of the shaft's damping with the 50 % sleeve of Table 4"),
        claim("stiff", "for realistic grips the grip's damping alone is not enough",
              f"possible up to {limit / 1e3:.2f} kN/m; sleeves have 130 to 290 kN/m",
              limit < min(k for k, _ in TABLE_4.values()), "line 1355",
              definition="stiffest grip for which an interval exists, bisected to 1 %"),
    )  # fmt: skip
    return Found(rows, _panels(soft, grip), "Fixed collet, four alike grip elements.")


def _panels(soft: Mapping[str, float], grip: Intervals) -> tuple[Panel, ...]:
    dampings = np.logspace(1, 4, 241)
    ours, printed = np.empty(241), np.empty(241)
    for k, c in enumerate(dampings):
        for curve, each in ((ours, symmetric("fixed_collet", {**soft, "sleeve_damping": c})),
                            (printed, equation_11({**soft, "sleeve_damping": c}))):  # fmt: skip
            curve[k] = np.max(np.abs(np.imag(each.poles))) / (2 * np.pi)
    stiff = np.geomspace(SOFT, 6e3, 7)
    spans = [overdamped(club((k, 1.0)), "sleeve_damping") for k in stiff]
    ends = np.array([span[0] if span else (np.nan, np.nan) for span in spans])
    return (
        Panel("Fastest swing left at 100 N/m (0: overdamped)", "grip damping c_G [N s/m]",
              "frequency [Hz]", (Curve(dampings, ours, "ours"),
                                 Curve(dampings, printed, "eq. 11 as printed")), is_log=True),
        Panel("Where it is overdamped", "grip stiffness k_G [N/m]", "grip damping c_G [N s/m]",
              (Curve(stiff, ends[:, 1], "up to"), Curve(stiff, ends[:, 0], "from")), is_log=True),
    )  # fmt: skip


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
