"""The search that the tests of samplers and stores share: a wrist under an impact."""

import numpy as np

from supple.model.drives import impact
from supple.model.linear import Port
from supple.model.robot import PRESETS, Robot
from supple.optimize.search import SearchTask
from supple.optimize.search_spec import Range
from supple.optimize.sweep import Axis, SweepTask

NUMBERS = PRESETS["robo_v_sleeve_50"]
RANGES = (
    Range("wrist_stiffness", 20.0, 2000.0, True, "N m/rad"),
    Range("wrist_damping", 0.5, 100.0, True, "N m s/rad"),
)
TASK = SearchTask(
    SweepTask(
        Robot("pinned_wrist", tuple(NUMBERS)),
        NUMBERS,
        impact("clubhead", -1600.0, 0.0, 0.005),
        np.arange(500) / 250.0,
        (0.005, 2.0),
        Port("clubhead", "acceleration", "collet"),
        ("rms",),
        tuple(Axis(one.name, np.array([one.low, one.high])) for one in RANGES),
    ),
    RANGES,
    (),
    (("rms", "minimize"),),
    sampler="nsga2",
    batch=32,
    ahead=4,
)
