"""Tasks and rigs of swings for the tests, small enough to be quick."""

from pathlib import Path

RIG = '[rig]\nkind = "robot"\nmodel = "driven_arm"\nfidelity = "{fidelity}"\npreset = "robo_v"\n'

TASK = """\
[swing]
rig = "rig.toml"
duration = 2.0
points = {points}
[start]
arm_angle = -3.0
wrist_angle = -1.6
[impact]
time = 1.6
clubhead_speed = {speed}
hold = "{hold}"
force = {force}
[limits]
arm   = {{ angle = [-3.5, 3.5], velocity = {velocity}, acceleration = 600.0, jerk = 2.0e4 }}
wrist = {{ angle = [-2.2, 2.2], velocity = 60.0, acceleration = 1200.0, jerk = 8.0e4 }}
shaft = {{ deflection_before = 0.30, deflection_after = 0.45 }}
[robust]
parameter = "shaft_frequency"
factors = [0.9, 1.1]
scenarios = {scenarios}
impact = {robust}
"""


def write_task(folder: Path, fidelity: str = "thesis", **changed: object) -> Path:
    """Writes rig and task into a folder, and returns the task's path."""
    told = {
        "points": 401, "speed": 30.0, "hold": "chord", "force": -1000.0, "velocity": 25.0,
        "scenarios": 1, "robust": "false",
    }  # fmt: skip
    (folder / "rig.toml").write_text(RIG.format(fidelity=fidelity))
    path = folder / "task.toml"
    path.write_text(TASK.format(**{**told, **changed}))
    return path
