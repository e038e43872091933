"""Six golfers at full swing, as a lab would record them: markers, and the gauges of the club."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .files import write_record, write_rig
from .golfer import BOTTOM, NAMES, TOP, Golfer, marker_table
from .links import (
    GRAVITY,
    HAND,
    LENGTH,
    Club,
    Curve,
    Hold,
    Swung,
    arrows,
    make_club,
    swing,
)
from .markers import turning

STRAIN = 0.024  # of the gauge below the grip, for a metre at the head [1/m]
MARKER_NOISE, FELT_NOISE, STRAIN_NOISE = 3e-4, 0.5, 2e-5  # m, m/s^2, 1
FELT_GAIN, STRAIN_GAIN = 0.01, 0.015  # scatter of the gauges' gains
LARGEST = 5000.0  # that the accelerometers show [m/s^2]
CAMERAS, GAUGES = 400.0, 5120.0  # Hz
SIDECAR = """[record]
file = "markers.csv"
[profile]
begin = {begin:.2f}
end = 0.5
"""
TURNED = 0.4  # of the tee piece about the shaft where the face is square [rad]


@dataclass(frozen=True)
class Style:
    """How one golfer swings: (instant, size, width) of each step of an angle [s, rad, s].

    Instants of `down` count from the impact.
    """

    impact: float
    arm: tuple[tuple[float, float, float], ...]
    wrist: tuple[tuple[float, float, float], ...]
    grip: tuple[tuple[float, float, float], ...]
    hands: tuple[float, float]
    length: float
    slope: float
    aim: float


GOLFERS = {
    "golfer_1": Style(1.49, ((-0.74, -2.6, 0.11), (-0.01, 5.1, 0.10)),
                      ((-0.64, -1.5, 0.11), (-0.015, 2.5, 0.052)),
                      ((-0.69, -1.3, 0.12), (-0.01, 2.4, 0.06)), (160.0, 7.0), 0.62, 0.90, -0.07),
    "golfer_2": Style(1.62, ((-0.80, -2.4, 0.12), (-0.02, 4.7, 0.11)),
                      ((-0.70, -1.3, 0.12), (-0.020, 2.2, 0.058)),
                      ((-0.75, -1.2, 0.12), (-0.01, 2.2, 0.07)), (120.0, 6.0), 0.60, 0.86, 0.03),
    "golfer_3": Style(1.45, ((-0.70, -2.7, 0.10), (0.00, 5.3, 0.105)),
                      ((-0.60, -1.6, 0.10), (-0.012, 2.7, 0.048)),
                      ((-0.62, -1.4, 0.11), (-0.02, 2.5, 0.055)), (200.0, 8.0), 0.64, 0.93, -0.02),
    "golfer_4": Style(1.75, ((-0.92, -2.3, 0.14), (-0.03, 4.5, 0.12)),
                      ((-0.80, -1.2, 0.13), (-0.025, 2.1, 0.062)),
                      ((-0.85, -1.1, 0.13), (-0.02, 2.0, 0.075)), (140.0, 8.0), 0.58, 0.82, 0.05),
    "golfer_5": Style(1.55, ((-0.76, -2.5, 0.11), (-0.01, 5.0, 0.11)),
                      ((-0.66, -1.7, 0.12), (-0.010, 2.7, 0.050)),
                      ((-0.70, -1.2, 0.11), (-0.01, 2.3, 0.06)), (180.0, 6.0), 0.63, 0.88, 0.00),
    "golfer_6": Style(1.66, ((-0.84, -2.5, 0.13), (-0.02, 4.9, 0.105)),
                      ((-0.74, -1.4, 0.12), (-0.022, 2.4, 0.054)),
                      ((-0.78, -1.3, 0.12), (-0.02, 2.4, 0.065)), (150.0, 9.0), 0.61, 0.91, -0.04),
}  # fmt: skip


def stepped(steps: tuple[tuple[float, float, float], ...], impact: float, zero: bool) -> Curve:
    """A sum of smooth steps, 0 at impact if `zero`, else at the beginning."""

    def curve(time: float) -> tuple[float, float, float]:
        angle = rate = turn = 0.0
        for at, size, width in steps:
            wave = np.tanh((time - impact - at) / (2 * width))
            steep = 1 - wave**2
            angle += size * (1 + wave) / 2
            rate += size * steep / (4 * width)
            turn -= size * steep * wave / (4 * width**2)
        return angle, rate, turn

    middle = curve(impact)[0] if zero else 0.0
    return lambda time: (curve(time)[0] - middle, *curve(time)[1:])


def hold_of(style: Style) -> Hold:
    """Who swings so."""
    return Hold(
        stepped(style.arm, style.impact, True),
        stepped(style.wrist, style.impact, True),
        style.length,
        style.hands,
        GRAVITY * np.sin(style.slope),
        (0.03, 3.0),
    )


def swung_by(style: Style, club: Club | None = None, rate: float = GAUGES) -> Swung:
    """The golfer's swing with a ball, to a second after it."""
    return swing(club or make_club(), hold_of(style), style.impact, style.impact + 1.25, rate)


def seen_by_cameras(style: Style, club: Club, swung: Swung, rng: np.random.Generator) -> Golfer:
    """Markers on shoulders, club and tee, in the room; those on the shaft bend with it."""
    times = np.arange(int(swung.times[-1] * CAMERAS)) / CAMERAS
    axes = turning("z", style.aim) @ turning("x", style.slope)
    level, up, normal = axes.T
    room = np.array([0.1, 0.6, 1.35])

    def placed(plane: np.ndarray) -> np.ndarray:
        return room + np.outer(plane[:, 0], level) + np.outer(plane[:, 1], up)

    def at(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(times, swung.times, one) for one in values.T], axis=1)

    hub, hand, angle = placed(at(swung.hub)), at(swung.hand), at(swung.angle)
    shaft, _ = arrows(angle)

    def on_club(from_butt: float) -> np.ndarray:
        left = np.clip(
            from_butt - HAND - np.append(0.0, np.cumsum(club.length)[:-1]), 0.0, club.length
        )
        left[0] = min(from_butt - HAND, club.length[0])
        return placed(hand + np.einsum("k,tkx->tx", left, shaft))

    along = shaft[:, 0, :1] * level + shaft[:, 0, 1:] * up
    turn = np.array([stepped(style.grip, style.impact, True)(t)[0] for t in times]) + TURNED
    piece = np.cos(turn)[:, None] * normal + np.sin(turn)[:, None] * np.cross(along, normal)
    body = 1.2 * np.sin(2.0 * times)
    across = 0.19 * np.stack([np.cos(body), np.sin(body), 0.2 * np.sin(body)], axis=1)
    tee = np.broadcast_to(placed(swung.ball[None])[0], hub.shape)
    exact = np.stack([
        hub + across, hub - across, on_club(TOP), on_club(BOTTOM),
        on_club(0.4) + 0.08 * piece, tee,
    ], axis=1)  # fmt: skip
    seen = exact + MARKER_NOISE * rng.standard_normal(exact.shape)
    angles = np.stack([np.interp(times, swung.times, one) for one in _angles(style, swung)], axis=1)
    index = int(np.searchsorted(swung.times, swung.impact)) - 1
    speed = float(np.linalg.norm(np.diff(swung.head[index - 1 : index + 1], axis=0)) * GAUGES)
    return Golfer(
        times, NAMES, seen, angles, style.slope, style.aim, hub, placed(hand),
        placed(at(swung.head)), swung.impact, speed, style.length,
    )  # fmt: skip


def _angles(style: Style, swung: Swung) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arm, wrist as the club's grip really turns against it, and grip [rad]."""
    arm = np.array([stepped(style.arm, style.impact, True)(t)[0] for t in swung.times])
    grip = np.array([stepped(style.grip, style.impact, True)(t)[0] for t in swung.times])
    return arm, swung.angle[:, 0] - arm, grip


def gauges(
    style: Style, club: Club, swung: Swung, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """What two accelerometers on the hosel and two strain gauges below the grip show [SI]."""
    _, normal = arrows(swung.angle[:, -1])
    felt = np.sum(swung.head_acceleration * normal, axis=1)
    bent = deflection(club, swung)
    grip, times = _angles(style, swung)[2], swung.times
    across = 3.0 * np.sin(2 * np.pi * 0.7 * times)  # out of the plane, small [m/s^2]
    aside = 0.004 * np.sin(2 * np.pi * 0.6 * times)
    s, c = np.sin(grip), np.cos(grip)
    clean = {
        "toe": felt * s + across * c,
        "lead": felt * c - across * s,
        "toe_strain": -STRAIN * (bent * s + aside * c),
        "lead_strain": STRAIN * (bent * c - aside * s),
    }
    found = {}
    for name, values in clean.items():
        strain = name.endswith("strain")
        gain, noise = (STRAIN_GAIN, STRAIN_NOISE) if strain else (FELT_GAIN, FELT_NOISE)
        values = values * (1 + gain * rng.standard_normal())
        values = values + noise * rng.standard_normal(len(values))
        found[name] = values if strain else np.clip(values, -LARGEST, LARGEST)
    return found


def deflection(club: Club, swung: Swung) -> np.ndarray:
    """What the gauge below the grip stands for, calibrated by pulling at the head [m]."""
    return np.diff(swung.angle[:, :2], axis=1)[:, 0] / club.first_bend


def write_swing(folder: Path, name: str, seed: int) -> Path:
    """Writes one golfer's markers, gauges and rig; the truth lies beside his folder."""
    style, club = GOLFERS[name], make_club()
    rng = np.random.default_rng([seed, *name.encode()])
    swung = swung_by(style, club)
    golfer = seen_by_cameras(style, club, swung, rng)
    own = folder / name
    (own / "gauges").mkdir(parents=True, exist_ok=True)
    (own / "markers.csv").write_text(marker_table(golfer), encoding="utf-8")
    (own / "markers.toml").write_text(SIDECAR.format(begin=0.5 - style.arm[0][0]), encoding="utf-8")
    numbers: dict[str, object] = {
        "arm_length": style.length, "club_length": LENGTH - HAND, "wrist_stiffness": 300.0,
        "wrist_damping": 15.0,
    }  # fmt: skip
    head: dict[str, object] = {"kind": "robot", "model": "driven_arm", "preset": "robo_v"}
    write_rig(own / "gauges" / "rig.toml", {"rig": head, "parameters": numbers})
    shown = gauges(style, club, swung, rng)
    begin = int(0.12 * GAUGES)  # the recorder was started later than the cameras
    write_record(own / "gauges", name, GAUGES, {k: v[begin:] for k, v in shown.items()},
                 _sidecar(name), 7)  # fmt: skip
    truth = {
        "impact": swung.impact, "clubhead_speed": golfer.speed, "ball_speed": swung.ball_speed,
        "largest_force": float(-swung.force.min()), "clock": begin / GAUGES,
        "hands": style.hands, "largest_bend": float(np.max(np.abs(deflection(club, swung)))),
    }  # fmt: skip
    (folder / f"{name}.truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    return own


def _sidecar(name: str) -> dict[str, dict[str, object]]:
    tables: dict[str, dict[str, object]] = {
        "record": {"file": f"{name}.csv", "test": "swing", "rig": "rig.toml",
                   "sample_rate": GAUGES, "description": "a full swing with a ball"},
    }  # fmt: skip
    for channel in ("toe", "lead", "toe_strain", "lead_strain"):
        strain = channel.endswith("strain")
        tables[f"channels.{channel}"] = {
            "column": channel, "unit": "1" if strain else "m/s^2", "role": "response",
            "quantity": "strain" if strain else "acceleration",
            "place": "shaft" if strain else "clubhead",
            "noise": STRAIN_NOISE if strain else FELT_NOISE,
            "tolerance": {"gain": STRAIN_GAIN if strain else FELT_GAIN},
        }  # fmt: skip
    return tables


def write_swings(folder: Path, seed: int = 0, count: int | None = None) -> list[Path]:
    """Writes the golfers' folders, all or the first so many."""
    folder.mkdir(parents=True, exist_ok=True)
    return [write_swing(folder, name, seed) for name in list(GOLFERS)[:count]]
