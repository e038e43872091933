"""Files of a golfer's markers: a sidecar names the swing, the club, the tee, limits and the way.

Every table may be left out, and a table of markers needs no sidecar at all:

    [record]
    file = "swing.c3d"             # or a CSV with left_shoulder_x [mm] ...; default: the own stem
    sample_rate = 400.0            # where the file does not tell [Hz]
    [markers]                      # what the file calls them, and the longest gaps filled [s]
    club_top = "C1"
    longest_gap = 0.03
    [club]                         # from the top of the grip [m]
    top = 0.265
    length = 1.09
    [ball]                         # z is up; the tee in m where it has no marker of its own
    radius = 0.021
    target = [1.0, 0.0, 0.0]
    [profile]                      # begin and end in s from impact
    method = "smooth"              # or "thesis"
    cutoff = 20.0
    [limits]                       # as in a task
    arm = { velocity = 25.0 }
    [file]
    quantum = 1.0e-4
    interpolation = "cubic"
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from ..identification.marker_file import MarkerFile, MarkerRecord, MarkerTable
from ..model.door import fault, nearest, one_of, read_toml, validated
from ..optimize.limits_file import AxisTable, axis_limits
from ..optimize.markers import LONGEST, NAMES, ClubGauge, GolferMarkers
from ..optimize.plane import BALL_RADIUS
from ..optimize.profile import ROBO_V, Limits
from ..optimize.smooth import BUILD, CUTOFF, DENSE, EVERY, FOLLOW, Smoothing

Triple = tuple[float, float, float]


class _Markers(MarkerTable):
    unit: str | None = None
    left_shoulder: str = "left_shoulder"
    right_shoulder: str = "right_shoulder"
    club_top: str = "club_top"
    club_bottom: str = "club_bottom"
    tee_piece: str = "tee_piece"
    tee: str = "tee"
    longest_gap: float = Field(default=LONGEST["club"], ge=0.0)
    longest_shoulder_gap: float = Field(default=LONGEST["shoulder"], ge=0.0)


class _Club(MarkerTable):
    top: float = ClubGauge.top
    bottom: float = ClubGauge.bottom
    hand: float = ClubGauge.hand
    length: float = ClubGauge.length


class _Ball(MarkerTable):
    radius: float = Field(default=BALL_RADIUS, gt=0.0)
    tee: Triple | None = None
    target: Triple = (1.0, 0.0, 0.0)


class _Profile(MarkerTable):
    method: Literal["smooth", "thesis"] = "smooth"
    begin: float | None = Field(default=None, gt=0.0)
    end: float | None = Field(default=None, gt=0.0)
    build: float = Field(default=BUILD, gt=0.0)
    follow: float = Field(default=FOLLOW, gt=0.0)
    cutoff: float = Field(default=CUTOFF, gt=0.0)
    dense: float = Field(default=DENSE, ge=0.0)
    every: int = Field(default=EVERY, ge=1)
    swing_time: float | None = Field(default=None, gt=0.0)


class _Output(MarkerTable):
    quantum: float = Field(default=1e-4, ge=0.0)
    interpolation: Literal["cubic", "pchip", "linear"] = "cubic"


class _Limits(MarkerTable):
    arm: AxisTable = AxisTable()
    wrist: AxisTable = AxisTable()
    grip: AxisTable = AxisTable()


class _Sidecar(MarkerTable):
    record: MarkerRecord = MarkerRecord()
    markers: _Markers = _Markers()
    club: _Club = _Club()
    ball: _Ball = _Ball()
    profile: _Profile = _Profile()
    limits: _Limits | None = None
    file: _Output = _Output()


@dataclass(frozen=True, eq=False)
class GolferFile:
    """What a golfer's files say.

    Attributes:
        name: of the swing.
        markers: as measured.
        gauge: of the club.
        longest: gap that is filled, of markers on club and shoulder [s].
        radius: of the ball [m].
        target: level direction of the shot, shape (3,) [-].
        smoothing: how the profile is made.
        swing_time: of the profile [s]; None for as fast as measured.
        quantum: of the robot's file [degrees].
        interpolation: of the robot.
        limits: of the motors.
        limits_stated: whether the files state them.
        files: every file read, with its SHA-256.
    """

    name: str
    markers: GolferMarkers
    gauge: ClubGauge
    longest: dict[str, float]
    radius: float
    target: np.ndarray
    smoothing: Smoothing
    swing_time: float | None
    quantum: float
    interpolation: Literal["cubic", "pchip", "linear"]
    limits: Limits
    limits_stated: bool
    files: dict[str, str]


def read_golfer(path: Path) -> GolferFile:
    """Reads a golfer's markers, by their sidecar or alone.

    Args:
        path: ``NAME.toml``, or a table (columns ``left_shoulder_x [mm]`` ...) or C3D file, whose
            sidecar may lie beside it; without one everything is as in the thesis.

    Returns:
        Markers in metres and what to do with them, with units as in `GolferFile`.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    sidecar = path if path.suffix.lower() == ".toml" else path.with_suffix(".toml")
    files: dict[str, str] = {}
    document = {}
    if sidecar == path or (path.is_file() and sidecar.is_file()):
        document, files[str(sidecar)] = read_toml(sidecar)
    asked = validated(_Sidecar, document, sidecar)
    data = path
    if sidecar == path:
        data = path.parent / asked.record.file if asked.record.file else _beside(path)
    elif asked.record.file and (path.parent / asked.record.file).resolve() != path.resolve():
        expected, found = f"'{path.name}', the file that was asked for", f"'{asked.record.file}'"
        raise fault(sidecar, "[record] file", expected, found, f"name {sidecar.name} instead")
    seen = asked.record.markers(data, files, asked.markers.unit)
    how = asked.profile
    return GolferFile(
        name=path.stem,
        markers=_golfer(seen, asked, sidecar if document else data),
        gauge=ClubGauge(**asked.club.model_dump()),
        longest={
            "club": asked.markers.longest_gap,
            "shoulder": asked.markers.longest_shoulder_gap,
        },
        radius=asked.ball.radius,
        target=np.array(asked.ball.target),
        smoothing=Smoothing(**how.model_dump(exclude={"swing_time"})),
        swing_time=how.swing_time,
        quantum=asked.file.quantum,
        interpolation=asked.file.interpolation,
        limits=_limits(asked.limits, sidecar),
        limits_stated=asked.limits is not None,
        files=files,
    )


def _beside(sidecar: Path) -> Path:
    """The table or C3D file of a sidecar's own name."""
    c3d = sidecar.with_suffix(".c3d")
    return c3d if c3d.is_file() else sidecar.with_suffix(".csv")


def _limits(stated: _Limits | None, path: Path) -> Limits:
    if stated is None:
        return ROBO_V
    return Limits(
        axis_limits(stated.arm, "arm", path),
        axis_limits(stated.wrist, "wrist", path),
        axis_limits(stated.grip, "grip", path),
    )


def _golfer(seen: MarkerFile, asked: _Sidecar, path: Path) -> GolferMarkers:
    wanted = {name: getattr(asked.markers, name) for name in NAMES}
    found = {name: _marker(seen, name, label, path) for name, label in wanted.items()}
    if asked.ball.tee is not None:
        tee = np.array(asked.ball.tee)
    else:
        places = _marker(seen, "tee", asked.markers.tee, path)
        visible = np.isfinite(places).all(axis=1)
        if not visible.any():
            mend = "write its place under [ball] as tee = [x, y, z] in m"
            raise fault(seen.path, "tee", "a tee that was seen", "it in no frame", mend)
        tee = np.median(places[visible], axis=0)
    return GolferMarkers(seen.rate, **found, tee=tee)


def _marker(seen: MarkerFile, name: str, label: str, path: Path) -> np.ndarray:
    if label in seen.names:
        return seen.places[:, seen.names.index(label)]
    like = nearest(label, seen.names)
    mend = f"write [markers] {name} = '{like}'" if like else f"write [markers] {name} = its name"
    if name == "tee":
        mend += ", or its place as [ball] tee = [x, y, z] in m"
    raise fault(path, f"[markers] {name}", one_of(seen.names), f"'{label}'", mend)
