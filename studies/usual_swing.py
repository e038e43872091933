"""The swing and the robot that the studies of swings share, as the files a user would write."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..model.rig import Rig
    from ..optimize.task import SwingTask


def robot_file(fidelity: str) -> str:
    """Text of the rig: the thesis's robot with arm and wrist, in fidelity thesis or planar."""
    head = '[rig]\nkind = "robot"\nmodel = "driven_arm"\n'
    return f'{head}fidelity = "{fidelity}"\npreset = "robo_v"\n'


def task_file(
    speed: float,
    force: float | None = None,
    *,
    points: int | None = None,
    hold: str | None = None,
    shaft_bounded: bool = False,
    scenarios: int | None = None,
    in_all: bool = False,
) -> str:
    """Text of the task: from the top of the backswing to rest in 2 s, impact after 1.6 s.

    Args:
        speed: of the clubhead at impact [m/s].
        force: of the ball; none of its own where not said [N].
        points: of an axis; the file's usual number where not said [-].
        hold: which pose is asked at impact; the usual one where not said.
        shaft_bounded: whether the shaft may bend by 0.30 m before impact and 0.45 m after it.
        scenarios: shaft frequencies within a tenth; the robot itself where not said [-].
        in_all: whether impact is asked of every scenario.

    Returns:
        TOML, as `supple swing` reads it.

    Source: tests/studies/test_swing_studies.py.
    """
    impact = [f"force = {force}"] * (force is not None) + [f'hold = "{hold}"'] * (hold is not None)
    lines = [
        *("[swing]", 'rig = "rig.toml"', "duration = 2.0"),
        *[f"points = {points}"] * (points is not None),
        *("[start]", "arm_angle = -3.0", "wrist_angle = -1.6"),
        *("[impact]", "time = 1.6", f"clubhead_speed = {speed}", *impact, "[limits]"),
        "arm = { angle = [-3.5, 3.5], velocity = 25.0, acceleration = 600.0, jerk = 2.0e4 }",
        "wrist = { angle = [-2.2, 2.2], velocity = 60.0, acceleration = 1200.0, jerk = 8.0e4 }",
        *["shaft = { deflection_before = 0.30, deflection_after = 0.45 }"] * shaft_bounded,
    ]
    if scenarios is not None:
        lines += ["[robust]", 'parameter = "shaft_frequency"', "factors = [0.9, 1.1]"]
        lines += [f"scenarios = {scenarios}", f"impact = {str(in_all).lower()}"]
    return "\n".join(lines) + "\n"


def usual(
    fidelity: str, speed: float, force: float | None = None, **more: Any
) -> tuple[SwingTask, Rig]:
    """Task and rig as their files are read; arguments and their units as of `task_file`."""
    from ..model.rig import read_rig
    from ..optimize.task import read_task

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "rig.toml").write_text(robot_file(fidelity))
        (folder / "task.toml").write_text(task_file(speed, force, **more))
        return read_task(folder / "task.toml"), read_rig(folder / "rig.toml")
