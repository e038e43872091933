"""Made-up golfers seen by cameras: a double pendulum on a sloping plane, markers, and C3D files."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

import numpy as np

from .markers import turning

RADIUS = 0.021
TOP, BOTTOM, HAND, LENGTH = 0.265, 0.550, 0.055, 1.09
NAMES = ("left_shoulder", "right_shoulder", "club_top", "club_bottom", "tee_piece", "tee")


@dataclass(frozen=True)
class Golfer:
    """One swing: markers (n, m, 3) in m, nan where lost, and the truth behind them in SI units."""

    times: np.ndarray
    names: tuple[str, ...]
    seen: np.ndarray
    angles: np.ndarray
    slope: float
    aim: float
    hub: np.ndarray
    hand: np.ndarray
    head: np.ndarray
    impact: float
    speed: float
    arm: float


def _step(times: np.ndarray, at: float, width: float) -> np.ndarray:
    return 0.5 * (1.0 + np.tanh((times - at) / (2.0 * width)))


def motion(times: np.ndarray, impact: float, blow: float = 0.0) -> np.ndarray:
    """Arm, wrist and grip of a full swing [rad]; the ball takes `blow` [rad/s] off the wrist."""
    arm = -2.6 * _step(times, 0.75, 0.11) + 5.2 * _step(times, impact, 0.10)
    wrist = -1.5 * _step(times, 0.85, 0.11) + 2.6 * _step(times, impact + 0.01, 0.05)
    grip = -1.3 * _step(times, 0.80, 0.12) + 2.4 * _step(times, impact - 0.01, 0.06)
    late = np.maximum(times - impact, 0.0)
    return np.stack([arm, wrist - blow * 0.1 * (1 - np.exp(-late / 0.1)), grip], axis=1)


def make_golfer(
    seed: int = 0,
    rate: float = 400.0,
    noise: float = 0.0,
    slope: float = 0.9,
    aim: float = -0.07,
    arm: float = 0.62,
    impact: float = 1.4873,
    blow: float = 0.0,
    sway: float = 0.03,
    end: float = 2.3,
    lay_off: float = 0.0,
) -> Golfer:
    """A golfer who swings toward x on a plane that leans by `slope` and aims by `aim` [rad].

    Args:
        slope: of the plane's upward line against the level line to the left of the target; more
            than a right angle for a left-handed golfer [rad].
        aim: of the plane's level line, to the left of the target [rad].
        noise: of each marker's coordinates [m].
        blow: by how much the ball slows the wrist [rad/s].
        sway: by how far the hub moves along the plane [m].
        lay_off: by how much the shaft leans out of the plane, but for 0.1 s about impact [rad].
    """
    rng = np.random.default_rng(seed)
    times = np.arange(int(end * rate)) / rate

    def places(t: np.ndarray) -> tuple[np.ndarray, ...]:
        room = turning("z", aim) @ turning("x", slope)
        along, up, normal = room.T
        angles = motion(t, impact, blow)
        a, b, g = angles[:, 0], angles[:, 0] + angles[:, 1], angles[:, 2] + 0.4
        hub = np.array([0.1, 0.6, 1.35]) + sway * np.outer(np.sin(3.0 * t), along)
        hand = hub + arm * (np.outer(np.sin(a), along) - np.outer(np.cos(a), up))
        shaft = np.outer(np.sin(b), along) - np.outer(np.cos(b), up)
        lean = lay_off * (1 - np.exp(-(((t - impact) / 0.09) ** 8)))[:, None]
        shaft = np.cos(lean) * shaft + np.sin(lean) * normal
        piece = np.cos(g)[:, None] * normal + np.sin(g)[:, None] * np.cross(shaft, normal)
        return angles, hub, hand, shaft, piece

    angles, hub, hand, shaft, piece = places(times)
    turned = 1.2 * np.sin(2.0 * times)
    across = 0.19 * np.stack([np.cos(turned), np.sin(turned), 0.2 * np.sin(turned)], axis=1)
    butt = hand - HAND * shaft
    _, _, now, arrow, _ = places(np.array([impact - 1e-6, impact]))
    heads = now + (LENGTH - HAND) * arrow
    tee = heads[1] + [RADIUS, 0.0, 0.0]
    exact = np.stack([
        hub + across, hub - across, butt + TOP * shaft, butt + BOTTOM * shaft,
        butt + 0.4 * shaft + 0.08 * piece, np.broadcast_to(tee, hub.shape),
    ], axis=1)  # fmt: skip
    seen = exact + noise * rng.standard_normal(exact.shape)
    speed = float(np.linalg.norm(heads[1] - heads[0]) / 1e-6)
    grip = motion(np.array([impact]), impact)[0, 2]
    return Golfer(
        times, NAMES, seen, angles - [0.0, 0.0, grip], slope, aim, hub, hand,
        butt + LENGTH * shaft, impact, speed, arm,
    )  # fmt: skip


def lose(golfer: Golfer, marker: str, start: float, length: float) -> Golfer:
    """The same swing with a marker out of sight from `start` on for `length` [s]."""
    seen = golfer.seen.copy()
    gone = (golfer.times >= start - 1e-9) & (golfer.times < start + length - 1e-9)
    seen[gone, golfer.names.index(marker)] = np.nan
    return replace(golfer, seen=seen)


def marker_table(golfer: Golfer, unit: str = "mm", clock: bool = True) -> str:
    """The markers as the text of a CSV file; empty cells where they were lost."""
    scale = {"mm": 1e3, "m": 1.0}[unit]
    header = [f"{name}_{axis} [{unit}]" for name in golfer.names for axis in "xyz"]
    lines = [",".join((["time [s]"] if clock else []) + header)]
    for time, row in zip(golfer.times, golfer.seen.reshape(len(golfer.times), -1)):
        cells = ["" if np.isnan(value) else f"{scale * value:.5f}" for value in row]
        lines.append(",".join(([f"{time:.6f}"] if clock else []) + cells))
    return "\n".join(lines) + "\n"


def c3d_bytes(
    golfer: Golfer, unit: str = "mm", analog: dict[str, tuple[str, np.ndarray]] | None = None
) -> bytes:
    """The markers as a C3D file, byte by byte: floating point, Intel order; c3d.org's guide.

    Args:
        analog: unit and samples of analog channels by name, a whole number of samples a frame.
    """
    count, points = golfer.seen.shape[:2]
    rate, scale = 1.0 / (golfer.times[1] - golfer.times[0]), {"mm": 1e3, "m": 1.0}[unit]
    analog = analog or {}
    channels, each = len(analog), len(next(iter(analog.values()))[1]) // count if analog else 0
    parameters = b"".join([
        _group(1, "POINT"),
        _parameter(1, "USED", 2, (), struct.pack("<h", points)),
        _parameter(1, "SCALE", 4, (), struct.pack("<f", -1.0)),
        _parameter(1, "RATE", 4, (), struct.pack("<f", rate)),
        _parameter(1, "DATA_START", 2, (), struct.pack("<h", 4)),
        _parameter(1, "FRAMES", 2, (), struct.pack("<H", count)),
        _words(1, "LABELS", golfer.names),
        _parameter(1, "UNITS", -1, (len(unit),), unit.encode()),
        _group(2, "ANALOG"),
        _parameter(2, "USED", 2, (), struct.pack("<h", channels)),
        *_analog_parameters(analog, rate * each),
    ])  # fmt: skip
    parameters = struct.pack("<4B", 1, 0x50, 2, 84) + parameters + b"\0\0"
    assert len(parameters) <= 1024
    header = struct.pack(
        "<BBhhHHhfhhf", 2, 0x50, points, channels * each, 1, count, 10, -1.0, 4, each, rate
    )
    lost = np.isnan(golfer.seen.sum(axis=2))
    data = np.zeros((count, points, 4), dtype="<f4")
    data[:, :, :3] = np.where(lost[:, :, None], 0.0, scale * golfer.seen)
    data[:, :, 3] = np.where(lost, -1.0, 0.0)
    beside = np.zeros((count, channels * each), dtype="<f4")
    if analog:
        stacked = np.stack([values for _, values in analog.values()], axis=1)
        beside[:] = stacked[: count * each].reshape(count, -1)
    body = np.concatenate([data.reshape(count, -1), beside], axis=1).tobytes()
    return (
        header.ljust(512, b"\0") + parameters.ljust(1024, b"\0")
        + body.ljust(-(-len(body) // 512) * 512, b"\0")
    )  # fmt: skip


def _analog_parameters(analog: dict[str, tuple[str, np.ndarray]], rate: float) -> list[bytes]:
    if not analog:
        return []
    count = len(analog)
    return [
        _words(2, "LABELS", tuple(analog)),
        _words(2, "UNITS", tuple(unit for unit, _ in analog.values())),
        _parameter(2, "GEN_SCALE", 4, (), struct.pack("<f", 1.0)),
        _parameter(2, "SCALE", 4, (count,), struct.pack(f"<{count}f", *[1.0] * count)),
        _parameter(2, "OFFSET", 2, (count,), struct.pack(f"<{count}h", *[0] * count)),
        _parameter(2, "RATE", 4, (), struct.pack("<f", rate)),
    ]


def _words(group: int, name: str, words: tuple[str, ...]) -> bytes:
    width = max(len(word) for word in words)
    text = "".join(word.ljust(width) for word in words).encode()
    return _parameter(group, name, -1, (width, len(words)), text)


def _group(number: int, name: str) -> bytes:
    return struct.pack("<bb", len(name), -number) + name.encode() + struct.pack("<hB", 3, 0)


def _parameter(group: int, name: str, kind: int, sizes: tuple[int, ...], data: bytes) -> bytes:
    body = struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + data + b"\0"
    return (
        struct.pack("<bb", len(name), group) + name.encode()
        + struct.pack("<h", len(body) + 2) + body
    )  # fmt: skip
