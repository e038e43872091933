"""The door of a swing's task: what is read, and what is refused in one line."""

import pytest

from supple.optimize.task import SHAFT_FREQUENCY, read_task
from tests.optimize.swing_tasks import write_task


def test_a_task_is_read_with_its_defaults(tmp_path):
    task = read_task(write_task(tmp_path, scenarios=3))
    assert task.duration == (2.0, 2.0)
    assert (task.impact.time, task.impact.arm_angle, task.impact.duration) == (1.6, 0.0, 0.0005)
    assert task.limits.arm.angle == (-3.5, 3.5)
    assert task.robust.parameter == SHAFT_FREQUENCY and task.robust.factors == (0.9, 1.1)
    assert (task.quantum, task.interpolation, task.at_rest) == (1e-4, "cubic", True)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('hold = "chord"', 'hold = "cord"', ("[impact] hold", "write 'chord'")),
        ("time = 1.6", "time = 2.1", ("[impact] time", "2.1")),
        ("time = 1.6", "", ("[impact] time", "free = true")),
        ("time = 1.6", "time = 1.6\nfree = true", ("[impact]", "both")),
        ("points = 401", "points = 4", ("[swing] points", "50")),
        ("duration = 2.0", "duration = { min = 3.0, max = 2.0 }", ("[swing] duration", "exchange")),
        ('rig = "rig.toml"', 'rig = "no.toml"', ("[swing] rig", "no.toml")),
        ("angle = [-3.5, 3.5]", "angle = [3.5, -3.5]", ("[limits.arm] angle", "[-3.5, 3.5]")),
        ("arm_angle = -3.0", "arm_angle = -4.0", ("[start] arm_angle", "-3.5")),
        ("factors = [0.9, 1.1]", "factors = [1.1, 1.2]", ("[robust] factors", "0.9")),
        ('parameter = "shaft_frequency"', 'parameter = "shaft"', ("[robust] parameter", "shaft_")),
        (
            'parameter = "shaft_frequency"',
            'parameter = "posterior"',
            ("[robust] file", "posterior.nc"),
        ),
        ("clubhead_speed = 30.0", "clubhead_speed = -1.0", ("[impact] clubhead_speed", "greater")),
        ("clubhead_speed = 30.0", "speed = 30.0", ("unknown key 'speed'", "clubhead_speed")),
    ],
)
def test_a_fault_is_named_with_the_way_out(tmp_path, old, new, words):
    path = write_task(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError) as told:
        read_task(path)
    line = str(told.value)
    assert "task.toml" in line and "Mend:" in line and "\n" not in line
    for word in words:
        assert word in line
