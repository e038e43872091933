"""The bench's command: `python -m tests.lab draw --bench B --seed 7 --out DIR`."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path


def main(words: list[str] | None = None) -> int:
    """Draws one sealed case; one line on standard error and 2 where the words are at fault."""
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
    asked = vars(parser.parse_args(words))
    del asked["command"]
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: more threads only wait
    from .sealed import draw_sealed

    try:
        draw_sealed(**asked)
    except ValueError as fault:
        print(fault, file=sys.stderr)
        return 2
    print(json.dumps({"records": str(asked["out"] / "records")}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
