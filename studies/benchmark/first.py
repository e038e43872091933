"""How long a first call takes in a process of its own, with and without compiled code on disk."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

GOALS = (4.0, 1.0)
"""First call without and with compiled code on disk [s]."""

CALLS = {
    "a map, one tile": (
        "from dataclasses import replace\n"
        "from supple.optimize.sweep import sweep\n"
        "from supple.studies.benchmark.maps import map_task\n"
        "task = map_task()\n"
        "task = replace(task, axes=tuple(replace(a, values=a.values[:20]) for a in task.axes))\n"
        "call = lambda: sweep(task)\n"
    ),
    "a planar swing": (
        "from supple.model.robot import PRESETS\n"
        "from supple.model.swing import swing\n"
        "from supple.studies.benchmark.swings import half_turn\n"
        "signals = half_turn()\n"
        "call = lambda: swing('passive_wrist', PRESETS['robo_v'], signals)\n"
    ),
    "a response to a blow": (
        "import numpy as np\n"
        "from supple.model.drives import impact\n"
        "from supple.model.motion import respond\n"
        "from supple.model.robot import PRESETS, Robot\n"
        "drive, times = impact('clubhead', -900.0, 0.0, 0.005), np.arange(4096) / 2048\n"
        "call = lambda: respond(Robot('pinned_wrist'), PRESETS['robo_v'], drive, times)\n"
    ),
}
"""What is called, as code that a user would write [-]."""

_TIMED = (
    "from supple.studies.engine import start_engine\nstart_engine()\n{}"
    "import time\nbegan = time.perf_counter()\ncall()\nprint(time.perf_counter() - began)\n"
)


def first_calls() -> dict[str, tuple[float, float]]:
    """Wall time of each first call without and with compiled code on disk [s]."""
    found = {}
    for name, code in CALLS.items():
        with tempfile.TemporaryDirectory() as folder:
            without = _seconds(code, folder)
            found[name] = without, min(_seconds(code, folder) for _ in range(2))
    return found


def _seconds(code: str, cache: str) -> float:
    """Wall time of the call alone: what is imported before it is imported by any other too."""
    told = os.environ | {"JAX_COMPILATION_CACHE_DIR": cache}
    done = subprocess.run(
        [sys.executable, "-c", _TIMED.format(code)], env=told, check=True, capture_output=True
    )
    return float(done.stdout)
