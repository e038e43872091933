"""Lets the bench write sealed cases: what is hidden, how noisy, and tests made again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

TWO_EVERY = 8
"""Every so many cases two effects are hidden at once [-]; in the others one or none."""

USUAL_DECIBELS = 30.0
"""Root mean square of a channel over its noise's, where nothing else is said [dB]."""

OTHER_DECIBELS = {3: 40.0, 11: 20.0}
"""The same of every sixteenth case, by the rest that its seed leaves [dB]."""

ROOT = Path(__file__).resolve().parents[1]


def require_bench(root: Path = ROOT) -> None:
    """Check that the bench lies beside the package; it is not shipped.

    Raises:
        ValueError: where it does not.
    """
    if not (root / "tests" / "lab" / "__main__.py").is_file():
        raise ValueError(
            f"hidden_effect: expected the bench at {root / 'tests' / 'lab'}, found none: it is not "
            "part of what is installed. Mend: run this study from a source checkout."
        )


def decibels(seed: int) -> float:
    """How far the records of a case stand above their noise [dB]."""
    return OTHER_DECIBELS.get(seed % 16, USUAL_DECIBELS)


def draw_case(bench: str, seed: int, folder: Path, again: str | None = None) -> list[Path]:
    """Let the bench write one case by its own command.

    Args:
        bench: A or B.
        seed: the case.
        folder: where to write.
        again: one test more than the case has, ``NAME:FACTOR``: like which, how many times as far
            or hard.

    Returns:
        The sidecars, held-out ones among them.

    Raises:
        ValueError: in the words of the bench.
    """
    command = [sys.executable, "-m", "tests.lab", "draw", "--bench", bench, "--seed", str(seed)]
    command += ["--effects", "2"] if seed % TWO_EVERY == TWO_EVERY - 1 else []
    command += ["--snr-db", f"{decibels(seed):g}"]
    command += ["--again", again] if again is not None else []
    told = subprocess.run(
        [*command, "--out", str(folder)], cwd=ROOT, capture_output=True, text=True
    )
    if told.returncode:
        words = told.stderr.strip().splitlines()
        raise ValueError(
            f"hidden_effect: {bench} {seed}: expected a case, found that the bench says "
            f"'{words[-1] if words else told.returncode}'. Mend: see `python -m tests.lab --help`."
        )
    found = sorted((folder / "records").glob("*.toml"))
    return [path for path in found if path.name != "rig.toml"]
