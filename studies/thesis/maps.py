"""Which wrist and collet quieten a struck club most (Figures 80 to 82, and the inertia line)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from ..study import Study
from .draw import Curve, Field, Panel
from .runs import FINAL_WRIST, IMPULSE, RIGID_GRIP, RIGID_WRIST, TABLE_4, club, head
from .table import Found, Row, answering, claim, number, show

if TYPE_CHECKING:
    from ...optimize.sweep import Map, SweepTask

NAME = "thesis/maps"
QUESTION = "Which wrist and collet quieten a struck club most (Figures 80 to 82)?"
COLLET, LIGHT = 0.02809, 0.0102  # kg m^2, lines 1491 and 1506
SCORES = ("rms", "log_decrement_local")
SHORT, RATE = 1e-7, 1000.0  # s, Hz
STIFF, DAMP = 50.0 + 75.0 * np.arange(75), 2.0 + 2.0 * np.arange(75)  # line 1491
FITTED = "The blow's impulse is fitted to this number."
PUBLISHED = {"lowest_rms": 4.116, "light_rms": 3.972, "peak": 19.3, "light_peak": 18.7}


@dataclass(frozen=True, eq=False)
class Maps:
    """The two maps and the line, for one blow of 0.255 N s.

    Attributes:
        real: with the robot's own collet.
        light: with the collet of the thesis's best inertia.
        task: that of the first map, for further designs.
        inertias: of the line, shape (75,) [kg m^2].
        line: its scores by name, each of shape (75,) [m/s^2 or 1].
    """

    real: Map
    light: Map
    task: SweepTask
    inertias: np.ndarray
    line: Mapping[str, np.ndarray]

    def lowest_peak(self, inertia: float) -> tuple[float, float, float]:
        """Wrist [N m/rad, N m s/rad] of the lowest peak [m/s^2] after t = 0, and that peak.

        Damping in whole numbers up to 40 and stiffness up to 1250, since the thesis's optima at
        9 and 15 do not lie on its grid of even numbers.
        """
        k, c = (each.ravel() for each in np.meshgrid(STIFF[:17], np.arange(2.0, 41.0)))
        late = replace(self.task, window=(2 / RATE, 2.0 + 1 / RATE), scores=("peak",))
        found = _scored(late, k, c, collet_inertia=inertia)["peak"]
        best = int(np.argmin(found))
        return float(k[best]), float(c[best]), float(found[best])

    def at(self, *wrists: tuple[float, float], **more: float) -> dict[str, np.ndarray]:
        """Scores of wrists [N m/rad, N m s/rad], by name [m/s^2 or 1]."""
        k, c = np.array(wrists).T
        return _scored(self.task, k, c, **more)


def _scored(task: SweepTask, k: np.ndarray, c: np.ndarray, **more: float) -> dict[str, np.ndarray]:
    from ...optimize.sweep import score_designs

    held = {name: np.full(len(k), value) for name, value in more.items()}
    return score_designs(task, {"wrist_stiffness": k, "wrist_damping": c, **held})


@cache
def computed() -> Maps:
    """Both maps of 75 by 75 wrists, and 75 collets at (1000, 30)."""
    from ...model.drives import impact
    from ...model.robot import Robot
    from ...optimize.sweep import Axis, SweepTask, score_designs, sweep

    axes = Axis("wrist_stiffness", STIFF, "N m/rad"), Axis("wrist_damping", DAMP, "N m s/rad")
    blow = impact("clubhead", IMPULSE / SHORT, 1 / RATE - SHORT, SHORT)  # ends on a sample
    times, window = np.arange(2002) / RATE, (1 / RATE, 2.0 + 1 / RATE)
    numbers = club(TABLE_4[50], FINAL_WRIST, collet_inertia=COLLET)
    task = SweepTask(Robot("pinned_wrist"), numbers, blow, times, window, head(), SCORES, axes)
    lighter = replace(task, numbers={**numbers, "collet_inertia": LIGHT})
    inertias = 0.002 + 0.001 * np.arange(75)  # line 1504
    held = {"wrist_stiffness": np.full(75, 1000.0), "wrist_damping": np.full(75, 30.0)}
    line = score_designs(task, held | {"collet_inertia": inertias})
    return Maps(sweep(task), sweep(lighter), task, inertias, line)


def find() -> Found:
    """Two maps of 5625 designs each, the inertia line, and the points that the thesis names."""
    maps = computed()
    rows = (*_decrements(maps), *_levels(maps), *_ratios(maps), *_inertia(maps), _range(maps))
    notes = (
        "t = 0 is the end of the blow; 2 s of the clubhead's acceleration relative to the collet, "
        "sampled at 1 kHz, the first sample included; 50 % sleeve of Table 4.",
        f"One blow for all: {IMPULSE} N s. Decrements and ratios do not depend on it.",
    )
    caption = "Wrist stiffness and damping, and the collet's inertia at (1000, 30)."
    return Found(rows, _panels(maps), caption, notes)


def _point(best: tuple[dict[str, float], float] | None) -> tuple[float, float, float]:
    assert best is not None
    return best[0]["wrist_stiffness"], best[0]["wrist_damping"], best[1]


def _decrements(maps: Maps) -> tuple[Row, ...]:
    local = maps.real.scores["log_decrement_local"]
    k, c, top = _point(maps.real.extreme("log_decrement_local", lowest=False))
    means = [float(np.mean(one.scores["log_decrement_local"])) for one in (maps.real, maps.light)]
    large = local > 1.0
    share = float(np.sum(large[:27, :20]) / np.sum(large))
    way = "ln(m0 / mN) / N over successive positive maxima, down to 1 % of the first; whole grid"
    return (
        number("decrement_maximum", "largest logarithmic decrement of the map", "1", 3.078, top,
               "line 1493, Figure 80", definition=f"{way}; ours is at ({k:g}, {c:g})",
               why="Where the wrist swings once at most, the reading of few maxima decides."),
        number("decrement_point", "decrement at the published place (50, 9)", "1", 3.078,
               float(maps.at((50.0, 9.0))["log_decrement_local"][0]), "line 1493", stated=0.164,
               definition=way, why="The thesis does not say how it reads a decrement."),
        claim("decrement_place", "it is found at the softest wrist, with a damping of 9",
              f"at stiffness {k:g}, damping {c:g}", k == STIFF[0] and abs(c - 9.0) <= 3.0,
              "line 1493", definition="softest of the grid, damping within 3 N m s/rad"),
        number("decrement_mean", "mean decrement of the map", "1", 0.6105, means[0],
               "line 1513", definition=way, stated=0.001),
        number("decrement_mean_light", "mean decrement with the light collet", "1", 0.6171,
               means[1], "line 1513", definition=way, stated=-0.014),
        claim("decrement_rise", "the light collet raises the mean decrement",
              f"{100 * (means[1] / means[0] - 1):+.2f} % (published +1.08 %)",
              means[1] > means[0], "line 1513",
              why="Readings of a decrement differ by more than this change."),
        claim("soft", "most damping is found below 2000 N m/rad and 40 N m s/rad",
              f"{100 * share:.0f} % of the {np.sum(large)} designs that damp well lie there",
              share > 0.5, "line 1493",
              definition="more than half of all designs with a decrement above 1, by which each "
              "wave is less than 37 % of the one before"),
    )  # fmt: skip


def _levels(maps: Maps) -> tuple[Row, ...]:
    k, c, lowest = _point(maps.real.extreme("rms", lowest=True))
    kl, cl, light = _point(maps.light.extreme("rms", lowest=True))
    kp, cp, peak = maps.lowest_peak(COLLET)
    kq, cq, light_peak = maps.lowest_peak(LIGHT)
    needed = IMPULSE * PUBLISHED["lowest_rms"] / lowest
    at = float(maps.at((200.0, 4.0))["rms"][0])
    steps = (abs(k - 200.0) / 75.0, abs(c - 4.0) / 2.0)
    return (
        number("lowest_rms", "lowest RMS of the map", "m/s²", PUBLISHED["lowest_rms"], lowest,
               "line 1495, Figure 81", definition=f"ours is at ({k:g}, {c:g})", limit=FITTED),
        number("impulse", "impulse of the blow: 1600 N for 5 ms", "N s", 8.0, needed,
               "line 1467", definition="impulse that makes the lowest RMS 4.116 m/s²",
               why=f"8 N s is {8.0 / needed:.0f} times what the published levels need; see B8 in "
               "thesis/errata."),
        claim("lowest_place", "the lowest RMS lies at (200, 4)",
              f"at ({k:g}, {c:g}); {at:.2f} m/s² at (200, 4)", max(steps) <= 1.0, "line 1495",
              definition="within one step of the grid along each axis"),
        number("light_rms", "lowest RMS with the light collet", "m/s²", PUBLISHED["light_rms"],
               light, "line 1513, Figure 82", definition=f"ours is at ({kl:g}, {cl:g})",
               stated=0.023),
        number("peak", "lowest peak of the map", "m/s²", PUBLISHED["peak"], peak, "line 1513",
               definition=f"largest magnitude after t = 0; ours is at ({kp:g}, {cp:g}); the blow "
               "is that fitted to the RMS", stated=0.053,
               why="The blow is fitted to the RMS alone; see lowest RMS over lowest peak."),
        number("light_peak", "lowest peak with the light collet", "m/s²", PUBLISHED["light_peak"],
               light_peak, "line 1513", definition=f"ours is at ({kq:g}, {cq:g})", stated=0.065,
               why="The blow is fitted to the RMS alone; see lowest RMS over lowest peak."),
    )  # fmt: skip


def _ratios(maps: Maps) -> tuple[Row, ...]:
    rms, light = (_point(one.extreme("rms", lowest=True))[2] for one in (maps.real, maps.light))
    peak, light_peak = (maps.lowest_peak(inertia)[2] for inertia in (COLLET, LIGHT))
    published = PUBLISHED["lowest_rms"] / PUBLISHED["light_rms"]
    peaks = PUBLISHED["peak"] / PUBLISHED["light_peak"]
    shape = PUBLISHED["lowest_rms"] / PUBLISHED["peak"]
    return (
        number("rms_ratio", "lowest RMS, robot's collet over light collet", "1", published,
               rms / light, "lines 1495, 1513", stated=-0.022,
               definition="needs no impulse",
               why="The gain itself is a third of the published one."),
        number("rms_gain", "what the light collet gains in lowest RMS", "%",
               100 * (published - 1), 100 * (rms / light - 1), "lines 1495, 1513",
               why="A light collet hardly helps by our equations."),
        number("peak_ratio", "lowest peak, robot's collet over light collet", "1", peaks,
               peak / light_peak, "line 1513", stated=-0.011),
        number("shape", "lowest RMS over lowest peak", "1", shape, rms / peak,
               "lines 1495, 1513", definition="needs no impulse",
               why="Peaks depend on how short the blow is."),
    )  # fmt: skip


def _inertia(maps: Maps) -> tuple[Row, ...]:
    line = maps.line["rms"]
    best = float(maps.inertias[np.argmin(line)])
    spread = 100 * (np.max(line) / np.min(line) - 1)
    steps = np.diff(line)
    steady = "steadily" if np.all(steps < 0) or np.all(steps > 0) else "not steadily"
    decay = maps.line["log_decrement_local"]
    highest = float(maps.inertias[np.argmax(decay)])
    change = 100 * (np.max(decay) / np.min(decay) - 1)
    return (
        number("best_inertia", "collet inertia of the lowest RMS at (1000, 30)", "kg m²", LIGHT,
               best, "lines 1504-1506", definition="on the grid 0.002 + 0.001 n, n < 75",
               why=f"The RMS changes by {spread:.2f} % over the whole line, {steady}."),
        claim("inertia_decrement", "the decrement is largest at 0.0102 as well",
              f"largest at {highest:.3f} kg m²",
              abs(highest - LIGHT) < 0.001,
              "line 1506", definition="within one step of the line",
              why=f"The decrement changes by {change:.2f} % over the whole line."),
    )  # fmt: skip


def _range(maps: Maps) -> Row:
    inside = maps.real.scores["rms"][2:8, 2:20]  # 200 to 575 by 6 to 40
    rigid = float(maps.at(RIGID_WRIST)["rms"][0])
    bare = float(maps.at(RIGID_WRIST, sleeve_stiffness=RIGID_GRIP[0],
                         sleeve_damping=RIGID_GRIP[1])["rms"][0])  # fmt: skip
    low, high = float(np.min(inside)), float(np.max(inside))
    return claim(
        "range", "stiffness 200 to 600 and damping 5 to 40 reduce vibration well",
        f"RMS {low:.1f} to {high:.1f} m/s² against {rigid:.1f} with a rigid wrist and {bare:.1f} "
        "with a rigid grip too", high < 0.8 * rigid, "line 1515",
        definition="every design inside at least a fifth below the rigid wrist with the sleeve",
    )  # fmt: skip


def _panels(maps: Maps) -> tuple[Panel, ...]:
    def panel(title: str, name: str, label: str, of: Map, place: tuple[float, float]) -> Panel:
        k, c, _ = _point(of.extreme(name, lowest=name == "rms"))
        marks = (
            Curve(np.array([k]), np.array([c]), "ours", True),
            Curve(np.array([place[0]]), np.array([place[1]]), "published", True),
        )
        part = slice(0, 28), slice(0, 25)  # the rest is flat
        field = Field(STIFF[part[0]], DAMP[part[1]], of.scores[name][part], label)
        axes = "wrist stiffness [N m/rad]", "wrist damping [N m s/rad]"
        return Panel(title, *axes, marks, field)

    at = np.array([LIGHT])
    rms, heavy = "RMS [m/s²]", maps.line["rms"]
    return (
        panel("Figure 80: decrement", "log_decrement_local", "decrement [1]", maps.real, (50, 9)),
        panel("Figure 81: RMS, robot's collet", "rms", rms, maps.real, (200, 4)),
        panel("Figure 82: RMS, light collet", "rms", rms, maps.light, (200, 15)),
        Panel("Collet inertia at (1000, 30)", "collet inertia [kg m²]", rms,
              (Curve(maps.inertias, heavy, "ours"),
               Curve(at, np.interp(at, maps.inertias, heavy), "published best", True))),
    )  # fmt: skip


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
