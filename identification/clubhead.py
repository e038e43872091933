"""From markers on a club to its angles, speed and path, and where the ball met the face."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .clubhead_after import Departure
from .clubhead_ball import Ball
from .clubhead_blow import blow_of
from .clubhead_curves import curves_of
from .clubhead_frames import mended, sentences, slips
from .clubhead_impact import SHORTEST, Impact
from .clubhead_path import DEGREE
from .clubhead_pose import FEWEST, Poses, fit_poses
from .clubhead_swing import Club, Swing, check_size, matched, with_face, wrong

__all__ = ["GOOD", "IN_DOUBT", "NO_IMPACT", "Club", "Clubhead", "Swing", "intervals",
           "measure_clubhead", "with_face"]  # fmt: skip

PRACTICE = 0.012
"""Stretch over which a swing without an impact is smoothed [s]."""

STANDING = np.radians(60.0)
"""Lie or face angle at an impact beyond which the face is not as a club's is [rad]."""

ASIDE = 0.008
"""Distance of an impact from the middle of the face from which its side is sure [m]."""

GOOD = "good"
NO_IMPACT = "no_impact"
IN_DOUBT = "in_doubt"


@dataclass(frozen=True, eq=False)
class Clubhead:
    """What a swing's markers tell.

    Attributes:
        swing: the markers, with gaps where frames were missing.
        source: row of the file that each frame came from, shape (n,) [-]; -1 for a gap.
        club: the cloud.
        ball: None where there is none.
        poses: of the club, with the middle of the face as origin.
        angles: lie, dynamic loft, face of each frame, shape (n, 3) [rad]; see `Face.angles`.
        angle_stds: shape (n, 3) [rad].
        speeds: of the middle of the face, toe, heel and each point of the club, smoothed, shape
            (n, 3 + k) [m/s]; nan within a contact.
        speed_stds: shape (n, 3 + k) [m/s].
        path_angle: of the smoothed velocity, to the left of the target, shape (n,) [rad].
        path_std: shape (n,) [rad].
        attack_angle: of the smoothed velocity, upward, shape (n,) [rad].
        attack_std: shape (n,) [rad].
        raw_speed: distance from the frame before, times the rate, shape (n,) [m/s].
        raw_speed_std: shape (n,) [m/s].
        raw_attack_angle: of that step against the floor, shape (n,) [rad].
        raw_attack_std: shape (n,) [rad].
        width: of the smoothing before and after a contact [frames].
        impact: None where there was none; its frame is the row of the file.
        impact_frame: the last of these frames before the impact; -1 where there was none.
        losses: speed lost through impact by middle, toe and heel, each with its standard
            deviation, shape (3, 2) [m/s]; None where not told.
        status: ``good``, ``no_impact`` or ``in_doubt``.
        warnings: what was found, in sentences.
    """

    swing: Swing
    source: np.ndarray
    club: Club
    ball: Ball | None
    poses: Poses
    angles: np.ndarray
    angle_stds: np.ndarray
    speeds: np.ndarray
    speed_stds: np.ndarray
    path_angle: np.ndarray
    path_std: np.ndarray
    attack_angle: np.ndarray
    attack_std: np.ndarray
    raw_speed: np.ndarray
    raw_speed_std: np.ndarray
    raw_attack_angle: np.ndarray
    raw_attack_std: np.ndarray
    width: tuple[int, int]
    impact: Impact | None
    impact_frame: int
    losses: np.ndarray | None
    status: str
    warnings: tuple[str, ...]


def measure_clubhead(swing: Swing, club: Club, ball: Ball | None = None) -> Clubhead:
    """Pose, angles, speed and path of every frame, and the impact.

    Args:
        swing: markers in the room.
        club: markers on the club; matched by name.
        ball: at rest before the impact.

    Returns:
        Everything with its error; doubts are in its status and warnings.

    Raises:
        ValueError: where the cloud gives no pose, names do not match, or the units cannot be.

    Source: thesis chapter 3. Its ``dividing the distance by the sampling rate`` (section 3.4.6)
    is read as by the time between frames.
    """
    names, cloud, places = matched(swing, club)
    said = check_size(swing, names, cloud, places)
    own = cloud - np.array(club.face.center)
    poses = fit_poses(own, places, names)
    said += poses.warnings
    slipped = slips(poses.position, poses.found, _noise(poses))
    source = np.arange(len(places))
    if slipped:
        places, source = mended(places, slipped)
        poses = fit_poses(own, places, names)
        said += sentences(slipped)
    swing = replace(swing, names=names, places=places)
    axes = poses.rotation @ club.face.axes
    if poses.found.sum() <= DEGREE + 2:
        expected = f"more than {DEGREE + 2} frames with {FEWEST} markers that agree with the cloud"
        raise wrong(swing, expected, f"{poses.found.sum()} of {len(places)}", "check the names")
    blow = blow_of(swing, club, ball, poses, axes)
    impact, after = blow.impact, blow.after
    usual = max(SHORTEST, round(PRACTICE * swing.rate))
    width = (impact.smoothed, after.smoothed if after else usual) if impact else (usual, usual)
    segment = blow.segments(len(places), swing.rate)
    curves = curves_of(
        club.face, poses, axes, swing.rate, np.where(segment == 2, *width[::-1]), segment,
        club.own_points(),
    )  # fmt: skip
    losses = None if impact is None or after is None else _losses(club, impact, after)
    doubts = [*blow.doubts, *_contradictions(impact, losses)]
    said += [*doubts, *_parted(losses), *(ball.warnings if ball else ())]
    doubt = bool(doubts) or poses.drifting or poses.found.mean() < 0.5
    doubt = doubt or bool(ball and ball.warnings)
    last = -1 if impact is None else impact.frame
    if impact is not None:
        impact = replace(impact, frame=int(source[impact.frame]), warnings=tuple(doubts))
    status = IN_DOUBT if doubt else GOOD if impact else NO_IMPACT
    return Clubhead(
        swing=swing, source=source, club=club, ball=ball, poses=poses, **curves, width=width,
        impact=impact, impact_frame=last, losses=losses, status=status, warnings=tuple(said),
    )  # fmt: skip


def _noise(poses: Poses) -> float:
    spread = np.trace(poses.covariance[:, :3, :3], axis1=1, axis2=2)[poses.found]
    return float(np.sqrt(np.median(spread) / 3)) if len(spread) else 0.0


def _losses(club: Club, impact: Impact, after: Departure) -> np.ndarray:
    """Speed lost by middle, toe and heel, with standard deviations, shape (3, 2) [m/s]."""
    toe = club.face.toe
    left, stds = after.speeds(np.array([0 * toe, toe, -toe]))
    before = np.array([impact.values[key] for key in ("speed", "toe_speed", "heel_speed")])
    own = np.array([impact.stds[key] for key in ("speed", "toe_speed", "heel_speed")])
    return np.stack([before - left, np.hypot(own, stds)], axis=1)


def _side(losses: np.ndarray | None) -> float:
    """How much more the toe lost than the heel; 0 where that is not sure [m/s]."""
    if losses is None:
        return 0.0
    parted = float(losses[1, 0] - losses[2, 0])
    return parted if abs(parted) > 4 * np.hypot(losses[1, 1], losses[2, 1]) else 0.0


def _parted(losses: np.ndarray | None) -> list[str]:
    """A sentence where toe and heel part."""
    parted = _side(losses)
    if not parted:
        return []
    side, other = ("toe", "heel") if parted > 0 else ("heel", "toe")
    return [
        f"The {side} lost {abs(parted):.2g} m/s more than the {other}: an impact off the center, "
        f"on the {side} side."
    ]


def _contradictions(impact: Impact | None, losses: np.ndarray | None) -> list[str]:
    """What an impact says that cannot be so, in sentences."""
    if impact is None:
        return []
    told = []
    for name, word in (("lie_angle", "lie"), ("face_angle", "face")):
        if abs(impact.values[name]) > STANDING:
            told.append(
                f"The {word} angle at impact is {np.degrees(impact.values[name]):.0f} degrees: no "
                "club comes so. Check 'normal' and 'up' of the face, and the axes of the room."
            )
    toe, parted = impact.values.get("impact_toe", 0.0), _side(losses)
    if abs(toe) > ASIDE and parted * toe < 0:
        touched, lost = ("toe", "heel") if toe > 0 else ("heel", "toe")
        told.append(
            f"The ball touched {1e3 * abs(toe):.0f} mm to the {touched}, but the {lost} lost more "
            "speed: the ball, or the middle of the face, is not where it is said."
        )
    return told


def intervals(impact: Impact) -> dict[str, tuple[float, float]]:
    """95 % intervals of an impact's values.

    Args:
        impact: of a swing.

    Returns:
        Lower and upper end by name, in the SI units of the values.
    """
    return {
        name: (
            impact.values[name] - impact.quantile * impact.stds[name],
            impact.values[name] + impact.quantile * impact.stds[name],
        )
        for name in impact.values
    }
