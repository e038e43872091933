"""What do a soft wrist and sleeve change in full swings? Six of them, rigid beside compliant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import Answer, finding, show
from .golfers import GOLFERS, Golfer, angles_of, instants_of
from .study import Call, Study
from .words import number_words

if TYPE_CHECKING:
    from ..model.rig import Rig
    from ..optimize.profile import SwingProfile
    from ..optimize.swing_check import Played

NAME = "six_swings"
QUESTION = "What do a soft wrist and sleeve change in six golfer-like swings with a ball?"
HEADINGS = (
    "swing", "fidelity", "club", "speed at the ball [m/s]", "pose off a rigid club's [°]",
    "gives way before the ball [mm]", "ball's vibration dies [s]", "left at rest [mm]",
)  # fmt: skip
RIGID, COMPLIANT = "rigid", "compliant"
FIDELITIES = ("thesis", "planar")
POINTS = 1000
FORCE, CONTACT = -1000.0, 5e-4
"""Of the ball [N, s]."""

AFTER = 1.5
"""How long the club is watched behind the drive [s]."""

DEAD, RESTS = 0.1, 0.5
"""Share of its largest value below which a vibration counts as dead [-], and how long after the
drive the club is watched for what is left [s]."""

UNSTRUCK = -1e-9
"""Force of a ball that is not there, on the clock of one that is [N]."""


def clubs() -> dict[str, dict[str, float]]:
    """Numbers of the robot without and with its wrist and sleeve [SI]."""
    from ..model.robot import PRESETS
    from .thesis.runs import RIGID_GRIP, club

    return {RIGID: club(RIGID_GRIP), COMPLIANT: dict(PRESETS["robo_v"])}


def rig_of(fidelity: str) -> Rig:
    """A rig of driven arm and wrist, of preset ``robo_v``."""
    import tempfile
    from pathlib import Path

    from ..model.rig import read_rig

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.toml"
        text = f'[rig]\nkind = "robot"\nmodel = "driven_arm"\nfidelity = "{fidelity}"\n'
        path.write_text(text + 'preset = "robo_v"\n', encoding="utf-8")
        return read_rig(path)


def profile_of(golfer: Golfer) -> SwingProfile:
    """A golfer's swing as the robot would be told it."""
    from ..optimize.profile import SwingProfile

    _, _, ball, end = instants_of(golfer)
    times = np.linspace(0.0, end + 0.1, POINTS)
    angles = angles_of(golfer, times)
    return SwingProfile(times, angles["arm"], angles["wrist"], np.zeros(POINTS), ball)


@dataclass(frozen=True, eq=False)
class Swung:
    """What a club does in one swing, beside a rigid club on the same drives.

    Attributes:
        times: shape (t,) [s].
        away: clubhead against that of a rigid club on the drives, shape (t,) [m].
        speed: of the clubhead at the ball [m/s].
        pose: of the chord at the ball against the drives' [rad].
    """

    times: np.ndarray
    away: np.ndarray
    speed: float
    pose: float


def swung(profile: SwingProfile, rig: Rig, force: float = FORCE) -> dict[str, Swung]:
    """A profile on both clubs.

    Args:
        profile: what the robot is told.
        rig: tells the fidelity.
        force: of the ball [N].

    Returns:
        By club what it does.
    """
    from ..optimize.swing_check import play
    from ..optimize.task import Impact

    ball = Impact(profile.impact_time, 0.0, 0.0, 1.0, force=force, duration=CONTACT)
    named = clubs()
    played = play(profile, rig, ball, after=AFTER, robots=list(named.values()))
    return {name: _seen(profile, played, index) for index, name in enumerate(named)}


def _seen(profile: SwingProfile, played: Played, index: int) -> Swung:
    from ..optimize.solve_program import impact_of, swing_rows

    numbers, x = played.numbers[index], played.states[index]
    drives = profile.at(played.times)
    away = swing_rows(numbers, x[:, :4].T, drives.angles[:, :2].T)
    hit, at = played.hit, profile.at(np.array([profile.impact_time]))
    told = at.angles[0, :2], at.velocities[0, :2]
    seen = impact_of(numbers, x[hit], *told, played.flat)
    pose = float(seen["chord"] - told[0].sum())
    return Swung(played.times, away, float(seen["speed"]), pose)


def rms(values: np.ndarray) -> float:
    """Root mean square of samples [their unit]."""
    return float(np.sqrt(np.mean(values**2)))


def told(profile: SwingProfile, rig: Rig) -> dict[str, dict[str, Any]]:
    """Numbers of one swing on both clubs.

    Args:
        profile: what the robot is told.
        rig: tells the fidelity.

    Returns:
        By club: speed [m/s] and pose [rad] at the ball, how far it gives way before it and what is
        left at rest, without a ball [m], and the time after which what the ball alone moves is
        dead [s]; None where it is not while the club is watched.
    """
    struck, bare, found = swung(profile, rig), swung(profile, rig, UNSTRUCK), {}
    end = float(profile.time[-1])
    for name, one in struck.items():
        times, quiet = one.times, bare[name].away
        blow = np.abs(one.away - quiet)
        above = np.flatnonzero(blow > DEAD * blow.max())
        dies = float(times[above[-1]] - profile.impact_time)
        before = times < profile.impact_time
        rest = (times > end + RESTS) & (times < end + RESTS + 0.5)
        found[name] = {
            "speed": one.speed, "pose": one.pose, "before": rms(quiet[before]),
            "dies": dies if above[-1] < len(times) - 1 else None, "left": rms(quiet[rest]),
        }  # fmt: skip
    return found


def find(call: Call, golfers: Sequence[Golfer] = GOLFERS) -> Answer:
    """Six swings on both clubs, in both fidelities.

    Args:
        call: who asks.
        golfers: the swings.

    Returns:
        The answer [SI].
    """
    rows, panels, rigs = [], [], {name: rig_of(name) for name in FIDELITIES}
    for golfer in golfers:
        profile = profile_of(golfer)
        for fidelity, rig in rigs.items():
            call.progress(f"the {golfer.name} swing, {fidelity}")
            for name, one in told(profile, rig).items():
                rows.append({"swing": golfer.name, "fidelity": fidelity, "club": name, **one})
        panels.append(_panel(golfer, swung(profile, rigs["planar"])))
    notes = (
        "Preset robo_v: wrist 300 N m/rad and 15 N m s/rad, sleeve 60 kN/m and 1470 N s/m an "
        "element; rigid: wrist 1e5 N m/rad and 2 N m s/rad, sleeve 500 kN/m without damping. "
        "The swings are made up, not measured; a ball of 1 kN for 0.5 ms.",
        "The clubhead against a rigid club on the same drives, root mean square: before the ball, "
        f"and for half a second from {RESTS:g} s after the drive rests, both without a ball. The "
        f"ball's is dead where what it alone moves stays below {100 * DEAD:g} % of its largest.",
    )
    cells = [_cells(row) for row in rows]
    return Answer(HEADINGS, cells, rows, _sentences(rows), notes, panels, {})


def _sentences(rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """What the table says, in the plane."""
    plane = {
        name: [row for row in rows if row["fidelity"] == "planar" and row["club"] == name]
        for name in (RIGID, COMPLIANT)
    }
    pairs = list(zip(plane[COMPLIANT], plane[RIGID], strict=True))
    left = [soft["left"] / stiff["left"] for soft, stiff in pairs]
    before = [soft["before"] / stiff["before"] for soft, stiff in pairs]
    dies = [soft["dies"] for soft, _ in pairs]
    rings = [stiff["dies"] for _, stiff in pairs]
    speed = [soft["speed"] - stiff["speed"] for soft, stiff in pairs]
    pose = [np.degrees(soft["pose"] - stiff["pose"]) for soft, stiff in pairs]
    died = [one for one in dies if one is not None]
    still = sum(one is None for one in rings)
    lost = "" if len(died) == len(dies) else f" in {len(died)} of {len(dies)} swings"
    return (
        f"In the plane the compliant club leaves {_span(left)} times the rigid club's vibration "
        f"once the drive rests; before the ball it gives way {_span(before)} times as far.",
        f"What the ball moves is dead after {_span(died)} s{lost}; on the rigid club it outlasts "
        f"the {AFTER:g} s behind the drive in {still} of {len(rings)} swings.",
        f"The price: {_span(speed)} m/s at the ball and {_span(pose)} degrees of pose against the "
        "rigid club, on drives that do not know of it.",
    )


def _span(values: Sequence[float]) -> str:
    """Lowest to highest of some numbers, in words [their unit]."""
    low, high = (number_words(one, 2) for one in (min(values), max(values)))
    return f"{low} to {high}"


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    numbers = (
        number_words(row["speed"], 3), number_words(float(np.degrees(row["pose"])), 3),
        number_words(1e3 * row["before"], 3), "not yet" if row["dies"] is None
        else number_words(row["dies"], 2), number_words(1e3 * row["left"], 3),
    )  # fmt: skip
    return row["swing"], row["fidelity"], row["club"], *numbers


def _panel(golfer: Golfer, motions: Mapping[str, Swung]) -> Any:
    from .thesis.draw import Curve, Panel

    lines = tuple(Curve(one.times, one.away, name) for name, one in motions.items())
    return Panel(f"{golfer.name}, in the plane", "time [s]", "off a rigid club [m]", lines)


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
