"""The robot's file of a swing: a header with the key instants, a checksum, a row for each point.

The layout of the Miyamae Robo V's own POD file is not public. This one, version 1, holds what that
file is known to hold (thesis, section 8.2.2); `pod_text` is all there is to replace. It is text in
UTF-8 with lines ended by a line feed:

    SUPPLE POD 1                    the layout and its version
    points: 1000                    rows below
    swing_time: 2.0                 from the first point to the last, in equal steps [s]
    impact_time: 1.6                need not be a point [s]
    impact_pose: 0.0 0.0 0.0        arm, wrist and grip to set the tee up by [degrees]
    quantum: 0.0001                 last digit of the angles; 0: not rounded [degrees]
    interpolation: cubic            how the points are joined: cubic (C2, at rest at both ends),
                                    pchip or linear
    phase top: 0.9                  an instant with a name, any number of them [s]
    sha256: ...                     of all other lines
    arm wrist grip                  then the rows [degrees]
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

import numpy as np

from ..model.door import fault, read_bytes, sha256_of, write_beside

LAYOUT = "SUPPLE POD 1"
"""First line of the file: the layout and its version."""

LARGEST_POD = 50_000_000
"""Largest file that is read [byte]; a thousand points are some thirty thousand."""

_COLUMNS = "arm wrist grip"
_KEYS = ("points", "swing_time", "impact_time", "impact_pose", "quantum", "interpolation", "sha256")


@dataclass(frozen=True)
class PodHeader:
    """What stands above the points.

    Attributes:
        points: rows of the table [-].
        swing_time: from the first point to the last [s].
        impact_time: instant of impact [s].
        impact_pose: arm, wrist and grip at impact [degrees].
        quantum: last digit of the angles [degrees]; 0 where they are not rounded.
        interpolation: ``cubic``, ``pchip`` or ``linear``.
        phases: instants by name [s].
    """

    points: int
    swing_time: float
    impact_time: float
    impact_pose: tuple[float, float, float]
    quantum: float
    interpolation: str
    phases: Mapping[str, float] = field(default_factory=dict)


def pod_text(header: PodHeader, degrees: np.ndarray) -> str:
    """The robot's file as text; the one function to replace for another layout.

    Args:
        header: what stands above the points.
        degrees: arm, wrist and grip, shape (points, 3) [degrees].

    Returns:
        The text, checksum included.
    """
    lines = [LAYOUT, f"points: {header.points}", f"swing_time: {header.swing_time!r}"]
    lines.append(f"impact_time: {header.impact_time!r}")
    lines.append("impact_pose: " + " ".join(f"{angle:.6f}" for angle in header.impact_pose))
    lines += [f"quantum: {header.quantum!r}", f"interpolation: {header.interpolation}"]
    lines += [f"phase {name}: {instant!r}" for name, instant in header.phases.items()]
    digits = _digits(header.quantum)
    rows = [" ".join(_written(angle, digits) for angle in row) for row in degrees.tolist()]
    return _summed(lines, [_COLUMNS, *rows])


def _digits(quantum: float) -> int | None:
    """Decimals that hold any whole number of quanta; None for all there are."""
    if not quantum:
        return None
    exponent = Decimal(repr(float(quantum))).normalize().as_tuple().exponent
    return max(-exponent, 0) if isinstance(exponent, int) else None


def _written(angle: float, digits: int | None) -> str:
    return repr(angle) if digits is None else f"{angle:.{digits}f}"


def _summed(above: list[str], below: list[str]) -> str:
    total = sha256_of(("\n".join([*above, *below]) + "\n").encode())
    return "\n".join([*above, f"sha256: {total}", *below]) + "\n"


def csv_text(time: np.ndarray, angles: np.ndarray) -> str:
    """The table ``time, arm_angle, wrist_angle, grip_angle`` as text.

    Args:
        time: shape (n,) [s].
        angles: arm, wrist and grip, shape (n, 3) [rad].

    Returns:
        The text; every number reads back to the same one.
    """
    lines = [",".join(map(repr, row)) for row in np.column_stack([time, angles]).tolist()]
    return "\n".join(["time,arm_angle,wrist_angle,grip_angle", *lines]) + "\n"


def write_pod(path: Path, header: PodHeader, degrees: np.ndarray) -> None:
    """Writes the robot's file whole or not at all.

    Args:
        path: the file.
        header: what stands above the points.
        degrees: arm, wrist and grip, shape (points, 3) [degrees].

    Raises:
        ValueError: where the folder cannot be written to.
    """
    write_beside(path, pod_text(header, degrees))


def read_pod_text(path: Path) -> tuple[PodHeader, np.ndarray]:
    """Reads the robot's file and verifies its checksum.

    Args:
        path: the file; line ends of another system do no harm.

    Returns:
        Header, and arm, wrist and grip, shape (points, 3) [degrees].

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    again = "write the profile again"
    try:
        lines = read_bytes(path, LARGEST_POD, "name a profile.pod").decode("utf-8").splitlines()
    except UnicodeDecodeError:
        raise fault(path, "", "text in UTF-8", "other bytes", "name a profile.pod") from None
    if not lines or lines[0] != LAYOUT:
        found = f"'{lines[0][:40]}'" if lines else "an empty file"
        raise fault(path, "line 1", f"'{LAYOUT}'", found, "name a profile.pod of this layout")
    if _COLUMNS not in lines:
        raise fault(path, "header", f"the line '{_COLUMNS}'", "none", again)
    at = lines.index(_COLUMNS)
    told = {key: value for key, _, value in (line.partition(": ") for line in lines[1:at])}
    for key in _KEYS:
        if key not in told:
            raise fault(path, "header", f"the key '{key}'", "nothing", again)
    place = next(i for i, line in enumerate(lines) if line.startswith("sha256: "))
    if _summed(lines[:place], lines[place + 1 :]).splitlines()[place] != lines[place]:
        expected = f"contents of the checksum {told['sha256'][:12]}..."
        raise fault(path, "sha256", expected, "others: the file was changed or cut", again)
    header = _header_of(path, told)
    rows = [line.split() for line in lines[at + 1 :]]
    if len(rows) != header.points or any(len(row) != 3 for row in rows):
        expected = f"{header.points} rows of three angles"
        raise fault(path, f"line {at + 2}", expected, f"{len(rows)} rows", again)
    try:
        return header, np.array(rows, dtype=float)
    except ValueError as error:
        raise fault(path, "table", "numbers", f"'{error}'", again) from None


def _header_of(path: Path, told: Mapping[str, str]) -> PodHeader:
    try:
        arm, wrist, grip = map(float, told["impact_pose"].split())
        return PodHeader(
            points=int(told["points"]),
            swing_time=float(told["swing_time"]),
            impact_time=float(told["impact_time"]),
            impact_pose=(arm, wrist, grip),
            quantum=float(told["quantum"]),
            interpolation=told["interpolation"],
            phases={
                key.removeprefix("phase "): float(value)
                for key, value in told.items()
                if key.startswith("phase ")
            },
        )
    except ValueError as error:
        raise fault(path, "header", "numbers", f"'{error}'", "write the profile again") from None
