"""The thesis's contradictory numbers (B1 to B17): each contradiction, and what it is worth."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .critical_damping import overdamped, stiffest
from .errata_equations import critical_intervals
from .printed import lever, symmetric
from .runs import IMPULSE, RIGID_GRIP, TABLE_4, club, instants, rms, slowest, spaced, struck
from .table import Row, claim, number

SAMPLE = {0: (14500.0, 300.0, 0.13), 25: (9000.0, 400.0, 0.17), 50: (6500.0, 600.0, 0.26)}
"""Stiffness [N/m], damping [N s/m] and tan delta of a coupon by deadener; lines 1241-1248."""

MODULI = {0: 480e3, 25: 265e3, 50: 190e3}  # Pa, line 1190 read as kPa
TESTED = 4.0  # Hz, line 1239
NATURAL = 4.167  # Hz, line 1157


def numbers() -> tuple[Row, ...]:
    """Rows B1 to B17: what an independent calculation says of each, and what we find."""
    return (
        *_b1_b2_b16(), *_b3(), *_b4(), *_b5_to_b7(), *_b8(), *_b9(), *_b10_to_b14(), *_b15(),
        *critical_intervals(100.0), *_b17(),
    )  # fmt: skip


def _b1_b2_b16() -> tuple[Row, ...]:
    from ...identification.coupon import Sample

    factor = Sample(0.008, np.pi / 4 * 0.019**2).geometry_factor
    rows = [
        claim("b1_force", "480 N/m at 3 mm is a force below the machine's accuracy of 2 N",
              f"{480 * 3e-3:.2f} N", 480 * 3e-3 < 2.0, "B1, lines 1186, 1190"),
        number("b16_factor", "factor of eq. 6, 19 mm by 8 mm", "1/m", 28.2, factor,
               "B16, lines 1039-1041", why="The unit is missing; the equation is right."),
    ]  # fmt: skip
    stated = {0: (17012.0, 75.0, 4.0), 25: (9392.0, 61.0, 6.6), 50: (6734.0, 67.0, 8.9)}
    for deadener, (k, c, loss) in SAMPLE.items():
        own = k * loss / (2 * np.pi * TESTED)
        guess = SAMPLE[0][0] * loss / (2 * np.pi)
        k_stated, c_stated, times = stated[deadener]
        name, source = f"{deadener} % deadener", "B2, lines 1241, 1246-1248"
        rows += [
            number(f"b1_{deadener}", f"coupon's stiffness from a modulus in kPa, {name}", "N/m",
                   k_stated, MODULI[deadener] / factor, "B1, line 1190",
                   definition="modulus over eq. 6"),
            number(f"b2_{deadener}", f"coupon's damping by its own tan delta, {name}", "N s/m",
                   c_stated, own, source, definition="k tan(delta) / omega at 4 Hz, eq. 18-21"),
            number(f"b2_{deadener}_times", f"Table 4's damping over that, {name}", "1", times,
                   c / own, source),
            number(f"b2_{deadener}_guess", f"damping by the 0 % stiffness at 1 Hz, {name}",
                   "N s/m", c, guess, source, definition="14500 tan(delta) / (2 pi 1 Hz)"),
        ]  # fmt: skip
    return tuple(rows)


def _b3() -> tuple[Row, ...]:
    rows, stated = [], {0: (0.49, 3.88), 25: (1.1, 3.87), 50: (1.8, 4.01)}
    found = {}
    for deadener, (k, c) in TABLE_4.items():
        mode = slowest(club((k, c)))
        found[deadener] = mode.frequency
        at = {0: 3.76, 25: mode.frequency, 50: 3.12}[deadener]
        rows += [
            number(f"b3_{deadener}_loss", f"loss factor of the sleeve, {deadener} % deadener",
                   "1", stated[deadener][0], 2 * np.pi * at * c / k, "B3, lines 1246-1259",
                   definition=f"omega c / k at {at:.2f} Hz"),
            number(f"b3_{deadener}", f"frequency with Table 4, {deadener} % deadener", "Hz",
                   stated[deadener][1], mode.frequency, "B3, line 1259"),
        ]  # fmt: skip
    rows.append(
        claim("b3_locks", "the dashpot locks the sleeve: more deadener, stiffer club",
              f"{found[0]:.2f}, {found[25]:.2f}, {found[50]:.2f} Hz", found[50] > found[0],
              "B3, line 1259")
    )  # fmt: skip
    return tuple(rows)


def _spacing_for(frequency: float, grip: tuple[float, float]) -> float:
    """Distance of the springs [m] at which a grip [N/m, N s/m] rings at `frequency` [Hz]."""
    from scipy.optimize import brentq

    def off(spacing: float) -> float:
        mode = symmetric("fixed_collet", club(grip) | spaced(spacing)).slowest
        return mode.frequency * np.sqrt(1 - mode.ratio**2) - frequency

    return float(brentq(off, 5e-3, 0.2))  # type: ignore[arg-type]


def _b4() -> tuple[Row, ...]:
    def give(frequency: float) -> float:
        return (NATURAL / frequency) ** 2 - 1

    offered = TABLE_4[0][0] / TABLE_4[50][0]
    rows = [
        number("b4_needed", "ratio of grip compliances that 3.12 and 3.76 Hz need", "1", 3.4,
               give(3.12) / give(3.76), "B4, line 1259"),
        number("b4_offered", "ratio that Table 4 offers", "1", 2.23, offered, "B4, line 1246"),
    ]  # fmt: skip
    cases = {268.0: (4.02, RIGID_GRIP), 556.0: (3.76, TABLE_4[0]), 1769.0: (3.12, TABLE_4[50])}
    for stated, (frequency, grip) in cases.items():
        spacing, free = (_spacing_for(frequency, (grip[0], c)) for c in (grip[1], 0.0))
        rows.append(
            number(f"b4_{frequency}", f"square of a / d that {frequency} Hz needs", "1", stated,
                   (lever(club(RIGID_GRIP)) / spacing) ** 2, "B4, line 1259",
                   definition=f"damped frequency with {grip[0] / 1e3:g} kN/m and {grip[1]:g} N "
                   f"s/m: d = {1e3 * spacing:.1f} mm; undamped {1e3 * free:.1f} mm")
        )  # fmt: skip
    return tuple(rows)


def _stiffness_for(frequency: float) -> float:
    """Sleeve stiffness [N/m] at which an undamped grip rings at `frequency` [Hz]."""
    from scipy.optimize import brentq

    def off(logarithm: float) -> float:
        p = club((float(np.exp(logarithm)), 0.0))
        return symmetric("fixed_collet", p).slowest.frequency - frequency

    return float(np.exp(brentq(off, np.log(1e3), np.log(1e7))))  # type: ignore[arg-type]


def _b5_to_b7() -> tuple[Row, ...]:
    p = club(RIGID_GRIP)
    mass = 2 * p["clubhead_mass"] * 2 * np.pi * NATURAL
    ours, other = slowest(p), slowest(club((400e3, 5.0)))
    earlier, later = (_stiffness_for(f) for f in (3.64, 3.87))
    soft = [_stiffness_for(f) for f in (3.08, 2.89)]
    return (
        claim("b5_sleeves", "chapters 5 and 6 measure different frequencies for the same sleeves",
              f"0 %: {earlier / 1e3:.0f} or {later / 1e3:.0f} kN/m would be needed; 50 %: "
              f"{soft[0] / 1e3:.0f} or {soft[1] / 1e3:.0f} kN/m",
              min(later / earlier, soft[0] / soft[1]) > 1.1, "B5, lines 1060, 1259",
              definition="stiffness of an undamped sleeve that rings at 3.64 or 3.87, 3.08 or "
              "2.89 Hz"),
        number("b6_low", "shaft damping by the ratio 0.0049", "N s/m", 0.052, 0.0049 * mass,
               "B6, lines 980, 1174"),
        number("b6_high", "shaft damping by the ratio 0.0076", "N s/m", 0.081, 0.0076 * mass,
               "B6, lines 980, 1174"),
        number("b6_ratio", "the simulated ratio by the cube of the frequencies", "1", 0.0068,
               0.0076 * (4.02 / NATURAL) ** 3, "B6, line 1174"),
        claim("b7_grip", "4.02 Hz belong to 500 kN/m, not to 400 kN/m with 5 N s/m",
              f"{ours.frequency:.3f} Hz and {other.frequency:.3f} Hz",
              abs(ours.frequency - 4.02) < abs(other.frequency - 4.02), "B7, lines 1161, 1176"),
    )  # fmt: skip


def _b8() -> tuple[Row, ...]:
    from ...model.drives import impact
    from .runs import move

    p, times = club(RIGID_GRIP), instants(1.0)
    reach, hard = {}, 0.0
    for length in (5e-3, 5e-4):
        motion = move("fixed_collet", p, impact("clubhead", 1600.0, 0.0, length), times)
        reach[length] = float(np.max(np.abs(motion.positions[:, 2])))
        if length == 5e-3:
            later = motion.samples[times > length, 0]
            hard = float(np.max(np.abs(later)))
    wrist = club(TABLE_4[50], (200.0, 4.0))
    heard = rms(struck(wrist, instants(2.0, 1000.0), 1600 * 5e-3))
    source = "B8, lines 1467, 1161"
    return (
        number("b8_speed", "speed that 1600 N for 5 ms gives the clubhead", "m/s", 39.0,
               1600 * 5e-3 / p["clubhead_mass"], source),
        number("b8_reach", "amplitude after it, rigid", "m", 1.57, reach[5e-3], source),
        number("b8_hard", "acceleration after it, rigid", "m/s²", 1000.0, hard, source),
        number("b8_rms", "RMS after it at (200, 4) instead of 4.116", "m/s²", 142.0, heard, source,
               definition="50 % sleeve, 2 s; as an impulse"),
        number("b8_short", "amplitude after 1600 N for 0.5 ms", "m", 0.157, reach[5e-4], source),
        number("b8_needed", "length of 1600 N that gives the fitted impulse", "ms", 0.16,
               1e3 * IMPULSE / 1600, source),
    )  # fmt: skip


def _b9() -> tuple[Row, ...]:
    p = club(RIGID_GRIP)
    inertia = float(symmetric("driven_collet", p).mass[0, 0])
    needed, source = 4 * np.pi * inertia, "B9, line 1287"
    return (
        number("b9_inertia", "inertia that 0.637 N m turns by 180 degrees in 1 s", "kg m²",
               0.0507, 0.637 / (4 * np.pi), source),
        number("b9_head", "inertia of the clubhead alone", "kg m²", 0.24,
               p["clubhead_mass"] * p["club_length"] ** 2, source),
        number("b9_torque", "torque that the turn needs", "N m", 3.4, needed, source,
               definition="4 pi times the inertia of collet, grip and head"),
        number("b9_turn", "turn that 0.637 N m gives", "degrees", 34.0,
               180.0 * 0.637 / needed, source),
        number("b9_guess", "0.637 is 2 / pi", "1", 0.637, 2 / np.pi, source),
    )  # fmt: skip


def _b10_to_b14() -> tuple[Row, ...]:
    from .driven_wrist import turned
    from .maps import DAMP, STIFF, computed

    line = computed().line["rms"]
    steps = np.diff(line)
    spread = 100 * (np.max(line) / np.min(line) - 1)
    inertias = 0.002 + 0.001 * np.arange(75)
    times, heard = turned(TABLE_4[50], (200.0, 30.0))
    at_reversal, before = (float(np.max(np.abs(heard[part])))
                           for part in (times >= 0.5, times < 0.5))  # fmt: skip
    return (
        claim("b10_grid", "the optima at 9 and 15 N m s/rad are not on the grid 2 + 2 n",
              "they are not; 200 N m/rad and 4 N m s/rad are",
              not np.any(np.isin([9.0, 15.0], DAMP)) and 200.0 in STIFF and 4.0 in DAMP,
              "B10, lines 1491-1513"),
        claim("b11_grid", "0.0102 is not on the grid of inertias, nor 0.028 its center",
              f"nearest {inertias[np.argmin(np.abs(inertias - 0.0102))]:.3f}, center "
              f"{inertias.mean():.3f} kg m²", np.min(np.abs(inertias - 0.0102)) > 1e-4,
              "B11, lines 1504-1506"),
        claim("b12_inertia", "the RMS at (1000, 30) falls steadily with the inertia, by under 2 %",
              f"by {spread:.2f} %, lowest at {inertias[np.argmin(line)]:.3f} kg m²",
              np.all(steps < 0) and spread < 2.0, "B12, lines 1504-1506"),
        number("b13_first", "peak of the driven wrist (200, 30) before 0.5 s", "m/s²", 13.3, before,
               "B13, line 1550"),
        number("b13_reversal", "peak at the reversal of 0.5 s", "m/s²", 25.0, at_reversal,
               "B13, line 1550"),
        claim("b14_name", "a sleeve of 20 % (line 1287) is none of those tested",
              f"tested: {', '.join(f'{each} %' for each in TABLE_4)}", 20 not in TABLE_4,
              "B14, lines 1054, 1287"),
    )  # fmt: skip


def _b15() -> tuple[Row, ...]:
    step, k, p = 5e-4, RIGID_GRIP[0], club(RIGID_GRIP)
    mass = 4 * k * (step / 2) ** 2
    inertia = k * p["sleeve_spacing"] ** 2 * (step / 2) ** 2
    poles = symmetric("fixed_collet", p).poles
    critical = 2.0 / float(np.max(np.abs(poles)))
    source = "B15, line 1161 (eq. 15)"
    return (
        number("b15_mass", "least grip mass for which steps of 0.5 ms are stable", "kg", 0.125,
               mass, source, definition="t = 2 / omega with four springs of 500 kN/m"),
        number("b15_inertia", "least grip inertia for which they are", "kg m²", 7.5e-5, inertia,
               source),
        claim("b15_step", "0.5 ms is hardly the step of the integration",
              f"critical step {1e3 * critical:.3f} ms with a grip of {p['grip_mass']:g} kg",
              critical < step, source),
    )  # fmt: skip


def _b17() -> tuple[Row, ...]:
    limit, source = stiffest(), "B17, line 1355"
    cases: Mapping[float, bool] = {
        c: bool(overdamped(club((130e3, 1.0), shaft_damping=c), "sleeve_damping"))
        for c in (0.0807, 5.0, 20.0)
    }
    able = overdamped(club(TABLE_4[50]), "shaft_damping")
    return (
        number("b17_limit", "stiffest grip that the grip's damping can make overdamped", "N/m",
               6300.0, limit, source, definition="bisected to 1 %",
               why="We find the limit a little higher, by exact arithmetic."),
        claim("b17_whatever", "beyond it no grip damping does it, whatever the shaft's damping",
              ", ".join(f"{'some does' if does else 'none does'} with a shaft of {c:g} N s/m"
                        for c, does in cases.items())
              + (f"; possible from {able[0][0]:.2f} N s/m on with Table 4's 50 %" if able else ""),
              not any(cases.values()) and not able, source,
              definition="grip of 130 kN/m, every grip damping, three shaft dampings",
              why="We disagree: with a shaft damped enough it can, as the thesis guessed."),
    )  # fmt: skip
