"""The slips in the thesis's equations (A1 to A10), each put back into our own and counted."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from .critical_damping import overdamped, overdamped_as_printed
from .draw import Curve, Panel
from .printed import (
    COLLET,
    GRIP,
    TILT,
    TRANSLATION,
    TURN,
    Equations,
    base_on_collet_only,
    equation_11,
    lever,
    newton_euler,
    operations,
    symmetric,
)
from .runs import RIGID_GRIP, TABLE_4, club, driven, eased, instants
from .table import Row, claim, number

GIVING = (500.0, 5.0)  # wrist of line 1615
SWING, LENGTH = ((0.0, 0.0), (1.0, np.pi)), 2.0  # rad at s; s


def equations() -> tuple[Row, ...]:
    """Rows A1 to A10: what an independent calculation says of each slip, and what we find."""
    rigid, silicone = club(RIGID_GRIP), club(TABLE_4[50])
    final = club(TABLE_4[50], (300.0, 15.0))
    return (
        *_a1(rigid, silicone), *_a2(silicone), _a3(silicone), *_a4_a5(final), *_a6(), *_a7_a8(),
        *_a9_a10(final),
    )  # fmt: skip


def _row(key: str, what: str, unit: str, stated: float, ours: float, line: str, **more: str) -> Row:
    return number(key, what, unit, stated, ours, line, **more)


def _a1(rigid: Mapping[str, float], silicone: Mapping[str, float]) -> tuple[Row, ...]:
    source = "A1, line 1119 (eq. 11)"
    right, wrong = symmetric("fixed_collet", rigid).slowest, equation_11(rigid).slowest
    soft, soft_wrong = symmetric("fixed_collet", silicone).slowest, equation_11(silicone).slowest
    ratio = rigid["grip_length"] / (2 * lever(rigid))
    natural = np.sqrt(rigid["shaft_stiffness"] / rigid["clubhead_mass"]) / (2 * np.pi)
    grips = [{**rigid, "sleeve_stiffness": k} for k in np.logspace(2, 8, 25)]
    lowest = min(equation_11(each).slowest.frequency for each in grips)
    ours = min(symmetric("fixed_collet", each).slowest.frequency for each in grips)
    return (
        _row("a1_rigid", "frequency of the rigid grip, as it should be", "Hz", 3.96,
             right.frequency, source),
        _row("a1_rigid_printed", "the same with the printed lever l/2", "Hz", 4.14,
             wrong.frequency, source),
        _row("a1_sleeve", "frequency of the 50 % sleeve, as it should be", "Hz", 4.03,
             soft.frequency, source),
        _row("a1_sleeve_printed", "the same with the slip", "Hz", 4.15, soft_wrong.frequency,
             source),
        _row("a1_ratio", "damping ratio of the 50 % sleeve, as it should be", "1", 0.081,
             soft.ratio, source),
        _row("a1_ratio_printed", "the same with the slip", "1", 0.016, soft_wrong.ratio, source),
        _row("a1_floor", "lowest frequency that the slip allows", "Hz", 3.89,
             natural * np.sqrt(1 - ratio), source,
             definition="f_n sqrt(1 - l / 2a)"),
        claim("a1_impossible", "with the slip 3.76 and 3.12 Hz could not be", f"lowest over grips "
              f"of 0.1 kN/m to 100 MN/m: {lowest:.3f} Hz; without it {ours:.3f} Hz",
              lowest > 3.76 > 3.12 > ours, source),
    )  # fmt: skip


def _a2(silicone: Mapping[str, float]) -> tuple[Row, ...]:
    source = "A2, line 1119 (eq. 11)"
    right, slip = symmetric("fixed_collet", silicone), equation_11(silicone)
    force, moment = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    return (
        _row("a2_force", "static reach of the clubhead a unit force on it", "m/N", 1.02e-2,
             np.linalg.solve(right.stiffness, force)[2], source),
        _row("a2_moment", "the same with the force in the row of the grip's rotation", "m/N",
             3.1e-3, np.linalg.solve(right.stiffness, moment)[2], source,
             definition="this slip alone; with the lever of A1 too it is "
             f"{np.linalg.solve(slip.stiffness, moment)[2]:.3g} m/N"),
    )  # fmt: skip


def _a3(silicone: Mapping[str, float]) -> Row:
    slip = newton_euler("driven_collet", silicone)
    stiff = 2 * silicone["sleeve_stiffness"] * silicone["sleeve_spacing"]
    slip.stiffness[TRANSLATION, TILT] += stiff  # k1 d + k2 d where k2 d - k1 d belongs
    return _row("a3_unstable", "growth of the driven collet with the printed sign", "1/s", 27.6,
                slip.lasting, "A3, line 1281 (eq. 24)",
                why="Positive: the printed model runs away.")  # fmt: skip


def _a4_a5(final: Mapping[str, float]) -> tuple[Row, ...]:
    source, other = "A4, line 1437 (eq. 32)", "A5, line 1437 (eq. 32)"
    right, slip, gap = (newton_euler("pinned_wrist", final) for _ in range(3))
    offset, spacing = final["sleeve_offset"], final["sleeve_spacing"]
    for matrix, each in ((slip.stiffness, "sleeve_stiffness"), (slip.damping, "sleeve_damping")):
        matrix[COLLET, GRIP] = -2 * final[each] * (offset - (offset + spacing))
    gap.stiffness[COLLET, TILT] = 0.0  # the bracket closes late: x_G times theta_G is no spring
    back = np.linalg.inv(operations(final))
    free = back @ slip.stiffness
    torque = abs(free[TURN, GRIP]) / final["sleeve_stiffness"]
    sound = abs((back @ right.stiffness)[TURN, GRIP]) / final["sleeve_stiffness"]
    return (
        _row("a4_decay", "slowest rate of decay, as it should be", "1/s", -4.40, right.lasting,
             source, definition="pinned wrist, 300 N m/rad and 15 N m s/rad, 50 % sleeve"),
        _row("a4_decay_printed", "the same with the printed sign", "1/s", -4.19, slip.lasting,
             source),
        claim("a4_momentum", "the printed sign makes inner forces turn the whole club",
              f"torque of {torque:.3f} m times the sleeve's stiffness a metre of grip motion; "
              f"{sound:.1e} without the slip", torque > 1e-3 and sound < 1e-9, source),
        claim("a5_bracket", "read literally, the grip's rotation no longer acts on the collet",
              f"slowest rate of decay {gap.lasting:.2f} 1/s for {right.lasting:.2f} 1/s",
              abs(gap.lasting / right.lasting - 1) > 0.01, other,
              definition="stiffness term of theta_G dropped from the collet's row"),
    )  # fmt: skip


@cache
def arm_swing() -> tuple[np.ndarray, np.ndarray]:
    """Times [s], and the arm's acceleration, velocity and angle, 0 to 180 degrees in 1 s."""
    times = instants(LENGTH)
    (arm,) = driven(LENGTH, arm=eased(SWING, 400)).joints
    return times, arm.at(times)[:, ::-1]


def passive() -> tuple[Mapping[str, float], Equations]:
    """Numbers [SI] and our rows of the passive wrist on an arm."""
    p = club(TABLE_4[50], GIVING)
    return p, newton_euler("passive_wrist", p)


def _a6() -> tuple[Row, ...]:
    times, signals = arm_swing()
    _, right = passive()
    acceleration, reach = right.peaks(signals, times)
    less, shorter = base_on_collet_only(right).peaks(signals, times)
    source = "A6, lines 1597, 1629 (eq. 40, 41)"
    way = "arm 0 to 180 degrees in 1 s, one sine wave of acceleration; 500 N m/rad, 5 N m s/rad"
    return (
        _row("a6_acceleration", "peak relative acceleration, as it should be", "m/s²", 9.4,
             acceleration, source, definition=way),
        _row("a6_acceleration_printed", "the same with the arm pushing the collet alone", "m/s²",
             6.1, less, source),
        _row("a6_reach", "peak clubhead displacement, as it should be", "mm", 84.0, 1e3 * reach,
             source),
        _row("a6_reach_printed", "the same with the slip", "mm", 53.0, 1e3 * shorter, source),
        _row("a6_share", "what the slip hides of the acceleration", "%", -35.0,
             100 * (less / acceleration - 1), source),
    )  # fmt: skip


def _a7_a8() -> tuple[Row, ...]:
    times, signals = arm_swing()
    p, right = passive()
    center = p["collet_centre"]
    peaks = [base_on_collet_only(right, each / center).peaks(signals, times)[0]
             for each in (0.0, center, p["arm_length"])]  # fmt: skip
    flat, cocked, linear = cocked_peaks()
    return (
        claim("a7_lever", "eq. 41 names a lever l_w that is defined nowhere",
              f"peak {peaks[0]:.2f}, {peaks[1]:.2f} or {peaks[2]:.2f} m/s² for a lever of 0, "
              f"{center:g} or {p['arm_length']:g} m", abs(peaks[2] / peaks[1] - 1) > 0.05,
              "A7, lines 1597, 1629"),
        claim("a8_cocked", "without cosine and centripetal term it is wrong once the wrist is "
              "cocked", f"peak {linear:.1f} m/s² by eq. 41 with A6 mended at any angle; in the "
              f"plane {flat:.1f} m/s² aligned and {cocked:.1f} m/s² with the wrist at 90 degrees",
              abs(flat / linear - 1) < 0.05 < abs(cocked / linear - 1), "A8, lines 1597, 1629",
              definition="same arm swing, wrist held; plane: full kinematics of every mass"),
    )  # fmt: skip


@cache
def cocked_peaks() -> tuple[float, float, float]:
    """Peak relative acceleration [m/s^2]: planar aligned, planar cocked, linear."""
    from ...model.drives import Drive
    from ...model.motion import respond
    from ...model.planar_motion import respond_planar
    from ...model.robot import Robot
    from .runs import head, pieced

    p, times = club(TABLE_4[50], GIVING), instants(1.5, 1000.0)
    arm, robot = driven(LENGTH, arm=eased(SWING, 100)).joints, Robot("driven_arm")
    drives = [Drive(joints=(*arm, pieced("wrist", turn, (), ()))) for turn in (0.0, -np.pi / 2)]
    seen = [respond_planar(robot, p, drive, times, (head(),)).samples for drive in drives]
    seen.append(respond(robot, p, drives[0], times, (head(),)).samples)
    flat, cocked, linear = (float(np.max(np.abs(each))) for each in seen)
    return flat, cocked, linear


def _a9_a10(final: Mapping[str, float]) -> tuple[Row, ...]:
    twice = final["collet_inertia"] + final["collet_mass"] * final["collet_centre"] ** 2
    ours = symmetric("pinned_wrist", final)
    heavy = symmetric("pinned_wrist", {**final, "collet_inertia": twice})
    moved = {**final, "sleeve_offset": 0.0}
    energy, printed = symmetric("pinned_wrist", moved), newton_euler("pinned_wrist", moved)
    for row, arm in ((3, final["club_length"]), (2, final["sleeve_spacing"] / 2)):
        printed.mass[row, TURN] = (final["clubhead_mass"] if row == 3 else final["grip_mass"]) * arm
    source = "A10, lines 1281-1283, 1439-1443"
    return (
        claim("a9_inertia", "0.02809 kg m² must be about the pivot, or eq. 39 counts it twice",
              f"{twice:.4f} kg m² otherwise: {heavy.slowest.frequency:.3f} Hz and "
              f"{heavy.slowest.ratio:.3f} for {ours.slowest.frequency:.3f} Hz and "
              f"{ours.slowest.ratio:.3f}", twice > 1.05 * final["collet_inertia"],
              "A9, lines 1593, 1527",
              definition="slowest swing of the pinned wrist, 300 N m/rad and 15 N m s/rad"),
        _row("a10_printed", "frequency by the printed lever L_cl with l1 = 0", "Hz", 3.553,
             printed.slowest.frequency, source),
        _row("a10_energy", "the same with levers that belong together", "Hz", 3.599,
             energy.slowest.frequency, source),
        _row("a10_ratio_printed", "damping ratio by the printed lever", "1", 0.191,
             printed.slowest.ratio, source),
        _row("a10_ratio", "the same with levers that belong together", "1", 0.183,
             energy.slowest.ratio, source),
    )  # fmt: skip


def arm_panel() -> Panel:
    """Clubhead acceleration over the arm swing, with and without the slip A6."""
    times, signals = arm_swing()
    _, right = passive()
    both = ((right, "every mass carried"), (base_on_collet_only(right), "as printed"))
    curves = [Curve(times, each.moved(signals, times)[0], label) for each, label in both]
    title = "A6: arm 0 to 180 degrees in 1 s"
    return Panel(title, "time [s]", "clubhead acceleration [m/s²]", tuple(curves))


def critical_intervals(soft: float) -> tuple[Row, ...]:
    """B17: the interval of grip damping at a grip stiffness [N/m], right and as printed."""
    p = club((soft, 1.0))
    right, printed = overdamped(p, "sleeve_damping"), overdamped_as_printed(p)
    low, high = right[0] if right else (0.0, 0.0)
    source = "B17, line 1355"
    return (
        _row("b17_low", "least grip damping that is overdamped at 100 N/m", "N s/m", 185.0, low,
             source),
        _row("b17_high", "largest", "N s/m", 1030.0, high, source),
        claim("b17_printed", "none with the slip A1", f"{len(printed)} intervals", not printed,
              source),
    )  # fmt: skip
