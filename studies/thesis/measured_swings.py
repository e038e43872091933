"""Full swings as a laboratory measured them: markers to a profile, gauges to the swing plane."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .runs import FINAL_WRIST, RIGID_GRIP, TABLE_4, club

if TYPE_CHECKING:
    from ...model.drives import Drive
    from ...optimize.profile import SwingProfile

AFTER = 0.6
"""How long the points go on at rest behind a profile, to see what still swings [s]."""

CLEAR = 0.010
"""How long before impact a comparison ends: resampling spreads the blow [s]."""

BALL = (-1000.0, 5e-4)
"""Blow of the ball on the head [N] and how long it lasts [s]; line 1857."""


@dataclass(frozen=True, eq=False)
class MeasuredSwing:
    """One golfer's swing on the points of his profile, and behind it.

    Attributes:
        name: of the golfer.
        profile: as the robot would play it.
        points: those of the profile and as many behind it as `AFTER` takes, shape (n,) [s].
        impact: on their clock [s].
        begin: from where the profile is the golfer's own motion and the gauges are known [s].
        clock_std: standard deviation of the gauges' clock against it [s].
        acceleration: of the head in the swing plane, nan where unknown, shape (n,) [m/s^2].
        acceleration_std: of its noise [m/s^2].
        deflection: of the head in the swing plane, nan where unknown, shape (n,) [m].
        deflection_std: of its noise [m].
        tolerance: of the gains of accelerometers and of strain gauges [1].
        arm_length: hub to hands as the markers show it [m].
        club_length: hands to head, of the record's rig [m].
        inclination: of the swing plane against the ground [rad].
        speed: of the clubhead at impact, on a straight shaft [m/s].
    """

    name: str
    profile: SwingProfile
    points: np.ndarray
    impact: float
    begin: float
    clock_std: float
    acceleration: np.ndarray
    acceleration_std: float
    deflection: np.ndarray
    deflection_std: float
    tolerance: tuple[float, float]
    arm_length: float
    club_length: float
    inclination: float
    speed: float

    @property
    def before(self) -> np.ndarray:
        """Points from `begin` to shortly before impact, shape (n,) [-]."""
        return (self.points >= self.begin) & (self.points < self.impact - CLEAR)

    def numbers(self, is_compliant: bool = True) -> dict[str, float]:
        """Numbers of the model [SI]: the 50 % sleeve and the final wrist, or neither."""
        chosen = club(TABLE_4[50], FINAL_WRIST) if is_compliant else club(RIGID_GRIP)
        return chosen | {"arm_length": self.arm_length, "club_length": self.club_length}

    def drive(self, is_struck: bool = True) -> Drive:
        """The profile as it drives the model, with the ball of line 1857 where struck."""
        return driven_by(
            self.profile.time, self.profile.read_angles[:, :2], float(self.points[-1]),
            self.impact if is_struck else None,
        )  # fmt: skip


def driven_by(
    times: np.ndarray, angles: np.ndarray, duration: float, impact: float | None
) -> Drive:
    """Arm and wrist through given angles, and a ball.

    Args:
        times: shape (n,) [s].
        angles: of arm and wrist, shape (n, 2) [rad].
        duration: of the motion; at rest behind the angles [s].
        impact: when the ball is struck [s]; None without one.

    Returns:
        The drive.
    """
    from ...model.drives import impact as blow
    from .runs import driven

    joints = driven(duration, arm=(times, angles[:, 0]), wrist=(times, angles[:, 1]))
    if impact is None:
        return joints
    force, contact = BALL
    return replace(blow("clubhead", force, impact, contact), joints=joints.joints)


def require_swings() -> None:
    """Check that the bench which makes the swings lies beside the package; it is not shipped.

    Raises:
        ValueError: where it does not.
    """
    from ..hidden_cases import require_bench

    try:
        require_bench()
    except ValueError as fault:
        raise ValueError(str(fault).removeprefix("hidden_effect: ")) from None


def ask_bench(words: Sequence[str]) -> None:
    """Lets the independent bench do what is asked, by its own command.

    Args:
        words: such as ``swings --out DIR``.

    Raises:
        ValueError: in the words of the bench, where it refuses.
    """
    from ..hidden_cases import ROOT

    command = [sys.executable, "-m", "tests.lab", *words]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if told.returncode:
        said = told.stderr.strip().splitlines()
        raise ValueError(
            f"bench: expected '{words[0]}', found that it says '{said[-1] if said else '-'}'. "
            "Mend: see `python -m tests.lab --help`."
        )


def read_measured(folder: Path) -> MeasuredSwing:
    """Makes a golfer's profile and brings his gauges onto it.

    Args:
        folder: with ``markers.toml`` and, in ``gauges``, the record of the same swing; takes up
            the profile's files.

    Returns:
        The swing, aligned by the impact and resolved into the swing plane [SI].

    Raises:
        ValueError: in the words of the door.
    """
    from ...identification.lowpass import STRAIN_CUTOFFS
    from ...identification.records import read_record
    from ...identification.strain import STRAIN_PER_METER
    from ...model.rig import read_rig
    from ...optimize.profile import POD, read_pod
    from ..profile import profile_file
    from ..swing_read import read_swing

    told, _ = profile_file(folder / "markers.toml", folder / "profile")
    profile = read_pod(folder / "profile" / POD)
    record = read_record(folder / "gauges" / f"{folder.name}.toml")
    found = read_swing(record, _longer(profile)).found
    assert record.rig_path is not None
    rig = read_rig(record.rig_path)
    start = told["impact"]["time"]["value"] - profile.impact_time
    known = found.points[found.is_known]
    return MeasuredSwing(
        name=folder.name,
        profile=profile,
        points=found.points,
        impact=profile.impact_time,
        begin=max(told["profile"]["kept"]["from"] - start, float(known[0])),
        clock_std=found.shift.offset_std,
        acceleration=found.acceleration.in_plane,
        acceleration_std=float(np.nanmedian(found.acceleration.std)),
        deflection=found.deflection.in_plane,
        deflection_std=(record.channel("lead_strain").noise or 0.0)
        / STRAIN_PER_METER
        * float(np.sqrt(2 * STRAIN_CUTOFFS[1] / record.sample_rate)),
        tolerance=(
            record.channel("lead").tolerance.get("gain", 0.0),
            record.channel("lead_strain").tolerance.get("gain", 0.0),
        ),
        arm_length=told["plane"]["arm_length"]["value"],
        club_length=rig.parameters["club_length"].value,
        inclination=told["plane"]["inclination"]["value"],
        speed=told["impact"]["clubhead_speed"]["value"],
    )


def _longer(profile: SwingProfile) -> SwingProfile:
    """The profile with points at rest behind it."""
    step = float(profile.time[1] - profile.time[0])
    count = len(profile.time) + round(AFTER / step)
    rest = count - len(profile.time)
    angles = np.concatenate([profile.angles, np.repeat(profile.angles[-1:], rest, axis=0)])
    return replace(
        profile, time=step * np.arange(count), arm_angle=angles[:, 0], wrist_angle=angles[:, 1],
        grip_angle=angles[:, 2],
    )  # fmt: skip


def robot_feedback(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """What the bench's robot says of a profile that it played.

    Args:
        folder: of the golfer, with his profile.

    Returns:
        Times at 250 Hz, shape (n,) [s], and angles of arm and wrist, shape (n, 2) [rad].
    """
    path = folder / "feedback.csv"
    ask_bench(
        ["feedback", "--profile", str(folder / "profile" / "profile.csv"), "--out", str(path)]
    )
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    return table[:, 0], np.radians(table[:, 1:])


def record_files(swing: MeasuredSwing, every: int = 2) -> Mapping[str, str]:
    """One swing as a record for a diagnosis: the profile drives, the head answers, up to impact.

    Args:
        swing: as measured.
        every: of so many points one is kept [-].

    Returns:
        Texts by name: the table and its sidecar, for ``rig.toml`` beside them [SI].
    """
    from ...model.door import toml_text

    part = np.flatnonzero(swing.before)[::every]
    times = swing.points[part] - swing.points[part[0]]
    driven = swing.profile.read_angles[part, :2]
    table = np.column_stack([times, driven, swing.acceleration[part], swing.deflection[part]])
    rows = [",".join(f"{cell:.10g}" for cell in row) for row in table]
    late = {"delay": swing.clock_std}

    def channel(column: str, unit: str, role: str, quantity: str, place: str, **more: Any) -> dict:
        told = {"column": column, "unit": unit, "role": role, "quantity": quantity, "place": place}
        return told | more

    felt, bent = swing.tolerance
    channels = {
        "time": {"column": "time", "unit": "s"},
        "arm": channel("arm", "rad", "input", "angle", "arm"),
        "wrist": channel("wrist", "rad", "input", "angle", "wrist"),
        "head": channel("head", "m/s^2", "response", "acceleration", "clubhead",
                        noise=swing.acceleration_std, tolerance={"gain": felt, **late}),
        "shaft": channel("shaft", "m", "response", "deflection", "shaft",
                         noise=swing.deflection_std, tolerance={"gain": bent, **late}),
    }  # fmt: skip
    sidecar = {
        "record": {
            "test": "swing",
            "rig": "rig.toml",
            "description": f"{swing.name}, up to impact",
        },
        "channels": channels,
        "parameters": {"arm_length": swing.arm_length},
    }
    return {
        f"{swing.name}.csv": "\n".join(["time,arm,wrist,head,shaft", *rows]) + "\n",
        f"{swing.name}.toml": toml_text(sidecar),
    }
