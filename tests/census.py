"""Counts verdicts on clean sets of the bench: run me with ``python -m tests.census``."""

from __future__ import annotations

import argparse
import json
import multiprocessing
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

BENCHES = ("chain", "fixed_collet")
NOISES = ("white", "ar1")
MOST_MEMORY = 0.9  # of the AR(1) noise, drawn evenly from zero on


def clean_set(seed: int) -> dict[str, Any]:
    """Verdict on one clean set; benches and noises take turns over the seeds."""
    import jax

    from supple.identification.diagnose import diagnose
    from supple.identification.records import read_record
    from supple.model.rig import read_rig
    from tests.lab.draw import draw_case

    bench, noise = BENCHES[seed % 2], NOISES[seed // 2 % 2]
    rho = float(np.random.default_rng([seed, 90]).uniform(0.0, MOST_MEMORY))
    law = {"rho": rho} if noise == "ar1" else None
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        case = draw_case(Path(folder), seed, bench=bench, noise=noise, noise_law=law)
        train, held = ([read_record(path) for path in some] for some in (case.train, case.held_out))
        found = diagnose(train, read_rig(case.rig), held)
    jax.clear_caches()
    return {
        "seed": seed,
        "bench": bench,
        "noise": noise,
        "rho": law and rho,
        "status": found.status,
        "causes": [trial.candidate.name for trial in found.accepted],
        "misfit": max(misfit.ratio for misfit in found.final.misfits.values()),
        "seconds": round(time.perf_counter() - began, 1),
    }


def census(seeds: Sequence[int], workers: int = 2) -> Iterator[dict[str, Any]]:
    """Verdicts on the clean sets of `seeds`, in processes that are replaced now and then."""
    spawn = multiprocessing.get_context("spawn")
    block = 25 * workers
    for low in range(0, len(seeds), block):  # compiled code piles up in a process that lives on
        with ProcessPoolExecutor(workers, spawn) as pool:
            yield from pool.map(clean_set, seeds[low : low + block])


def main() -> None:
    """Run the census, one JSON line a set, and print the tally."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=60_000)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    rows = []
    for row in census(range(asked.first, asked.first + asked.sets), asked.workers):
        rows.append(row)
        if asked.out:
            with asked.out.open("a") as file:
                file.write(json.dumps(row) + "\n")
    tally = Counter((row["bench"], row["noise"], row["status"]) for row in rows)
    for key, count in sorted(tally.items()):
        print(*key, count)
    share = sum(row["status"] == "adequate" for row in rows) / len(rows)
    print(f"adequate in {100 * share:.1f} % of {len(rows)} sets")


if __name__ == "__main__":
    main()
