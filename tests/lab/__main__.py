"""The bench's commands: `python -m tests.lab draw --bench B --seed 7 --out DIR`, and more."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any


def main(words: list[str] | None = None) -> int:
    """Does what is asked; one line on standard error and 2 where the words are at fault."""
    parser = argparse.ArgumentParser(prog="python -m tests.lab", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    draw = commands.add_parser("draw", help="write the records, rig and truth of one case")
    draw.add_argument("--bench", choices=("A", "B"), required=True)
    draw.add_argument("--seed", type=int, required=True)
    draw.add_argument("--out", type=Path, required=True)
    draw.add_argument("--effects", type=int, help="how many causes; drawn (0 or 1) if left out")
    for name in ("law", "place", "model", "noise"):
        draw.add_argument(f"--{name}", help="drawn if left out")
    draw.add_argument("--strength", type=float)
    draw.add_argument("--snr-db", type=float, default=30.0)
    draw.add_argument("--train", type=int, default=4)
    draw.add_argument("--held-out", type=int, default=2)
    draw.add_argument("--samples", type=int, default=4096)
    draw.add_argument("--again", help="NAME:FACTOR, one record more after one of the others")
    swings = commands.add_parser("swings", help="write markers and gauges of golfers' full swings")
    swings.add_argument("--out", type=Path, required=True)
    swings.add_argument("--seed", type=int, default=0)
    swings.add_argument("--count", type=int, help="the first so many; all if left out")
    hands = commands.add_parser("hands", help="write accelerations of golfers' hands and heads")
    hands.add_argument("--out", type=Path, required=True)
    hands.add_argument("--seed", type=int, default=0)
    feedback = commands.add_parser("feedback", help="let a robot play a profile")
    feedback.add_argument("--profile", type=Path, required=True)
    feedback.add_argument("--out", type=Path, required=True)
    asked = vars(parser.parse_args(words))
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait
    try:
        print(json.dumps(_do(asked.pop("command"), asked)))
    except (OSError, ValueError) as fault:
        print(fault, file=sys.stderr)
        return 2
    return 0


def _do(command: str, asked: dict[str, Any]) -> dict[str, Any]:
    if command == "swings":
        from .full_swings import write_swings

        found = write_swings(asked["out"], asked["seed"], asked["count"])
        return {"swings": [str(path) for path in found]}
    if command == "hands":
        from .hands import write_hands

        return {"hands": [str(path) for path in write_hands(asked["out"], asked["seed"])]}
    if command == "feedback":
        from .servo import write_feedback

        write_feedback(asked["profile"], asked["out"])
        return {"feedback": str(asked["out"])}
    from .sealed import draw_sealed

    draw_sealed(**asked)
    return {"records": str(asked["out"] / "records")}


if __name__ == "__main__":
    sys.exit(main())
