"""How the club rings in the three silicone sleeves (Figure 67 and Table 4)."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .draw import Curve, Panel
from .runs import RIGID_GRIP, TABLE_4, club, instants, move, slowest
from .table import Found, Row, answering, claim, number, show

NAME = "thesis/sleeves"
QUESTION = "How does the club ring in the three silicone sleeves (Figure 67, Table 4)?"
MEASURED = {0: (3.64, 0.02), 25: (3.55, 0.08), 50: (3.08, 0.11)}  # Hz and ratio, line 1060


def find() -> Found:
    """Modes with Table 4 and with equivalents of the measured decays; the sleeve's geometry."""
    modes = {deadener: slowest(club(grip)) for deadener, grip in TABLE_4.items()}
    bare = slowest(club(RIGID_GRIP))
    locked = "Table 4's dashpots are 4 to 9 times what its own tan delta gives and lock the sleeve."
    rows = (
        number("frequency_0", "simulated frequency, 0 % deadener", "Hz", 3.76,
               modes[0].frequency, "line 1259, Figure 67a", stated=0.031,
               definition="damped, slowest mode of the fixed collet with Table 4"),
        number("frequency_50", "simulated frequency, 50 % deadener", "Hz", 3.12,
               modes[50].frequency, "line 1259, Figure 67c", stated=0.29, why=locked),
        claim("trend", "the softer sleeve rings slower", f"{modes[0].frequency:.2f} Hz with 0 %, "
              f"{modes[50].frequency:.2f} Hz with 50 %", modes[50].frequency < modes[0].frequency,
              "line 1259", definition="slowest mode with 50 % against 0 %", why=locked),
        claim("over_damped_0", "the simulation over-damps the 0 % sleeve",
              f"damping ratio {modes[0].ratio:.3f}, measured {MEASURED[0][1]}",
              modes[0].ratio > MEASURED[0][1], "line 1259"),
        claim("over_damped_50", "simulations generally over-damp (50 % sleeve)",
              f"damping ratio {modes[50].ratio:.3f}, measured {MEASURED[50][1]}",
              modes[50].ratio > MEASURED[50][1], "line 1259",
              why="A locked sleeve damps less than the measured one."),
        claim("damps", "sleeves damp more than the rigid grip, and more with more deadener",
              f"{bare.ratio:.4f} rigid, then {modes[0].ratio:.3f}, {modes[25].ratio:.3f}, "
              f"{modes[50].ratio:.3f}",
              bare.ratio < modes[0].ratio < modes[25].ratio < modes[50].ratio, "lines 1060, 1259"),
        *_equivalents(), *_geometry(),
    )  # fmt: skip
    return Found(rows, _panels(), "Release from 0.15 m: Table 4 against lumped equivalents.")


def _equivalents() -> tuple[Row, ...]:
    """Whether one spring and dashpot an element can ring as the tests of chapter 5 did."""
    from ...model.robot import PRESETS

    rows = []
    for deadener, (frequency, ratio) in MEASURED.items():
        mode = slowest(PRESETS[f"robo_v_sleeve_{deadener}"])
        more = {"limit": "Stiffness and damping of the sleeve are fitted to it."}
        rows += [
            number(f"measured_{deadener}", f"measured frequency, {deadener} % deadener", "Hz",
                   frequency, mode.frequency, "line 1060", **more),
            number(f"measured_ratio_{deadener}", f"measured damping ratio, {deadener} % deadener",
                   "1", ratio, mode.ratio, "line 1060", **more),
        ]  # fmt: skip
    return tuple(rows)


def _geometry() -> tuple[Row, ...]:
    from ...identification.coupon import Sample
    from ...identification.sleeve import SleeveShape

    sample = Sample(0.008, np.pi / 4 * 0.019**2)  # lines 1039-1041
    sleeve = SleeveShape(0.015, 0.035, 0.250, compression=1 / 3)  # lines 1031, 1056
    return (
        number("factor", "stiffness of sleeve over coupon", "1", TABLE_4[0][0] / 14500.0,
               sleeve.factor(sample), "lines 1243-1248", stated=0.04,
               definition="radial segments over half the circumference, mean radius, wall after "
               "33 % compression, cosine squared"),
        claim("geometry", "the coupon's geometry factor is within 25 to 30",
              f"{sample.geometry_factor:.2f} 1/m", 25.0 <= sample.geometry_factor <= 30.0,
              "lines 1039-1041", definition="eq. 6 for 19 mm by 8 mm"),
    )  # fmt: skip


def _panels() -> tuple[Panel, ...]:
    from ...model.drives import release
    from ...model.robot import PRESETS

    times, drive = instants(4.0), release("clubhead", 0.15, "collet")
    panels = []
    for letter, (deadener, grip) in zip("abc", TABLE_4.items(), strict=True):
        fitted = PRESETS[f"robo_v_sleeve_{deadener}"]
        curves = [
            Curve(times, move("fixed_collet", p, drive, times).samples[:, 0], label)
            for p, label in ((club(grip), "Table 4"), (fitted, "fitted to line 1060"))
        ]
        title = f"Figure 67{letter}: {deadener} % deadener"
        panels.append(Panel(title, "time [s]", "clubhead acceleration [m/s²]", tuple(curves)))
    return tuple(panels)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
