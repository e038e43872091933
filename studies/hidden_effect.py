"""Hides effects in records of the independent bench and counts how often they are found."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .diagnosis import diagnosed
from .engine import forget_programs, read_inputs, write_together
from .experiment import propose_experiment
from .hidden_baselines import sparse_regression, white_bic
from .hidden_cases import ROOT, USUAL_DECIBELS, draw_case, require_bench
from .hidden_page import HEADINGS, lines, power_figure, write_hidden_page
from .hidden_score import BENCHES, FAILED, outcome, sure, tables
from .hidden_sizes import gains_most
from .hidden_true import foretold_by_the_true_law
from .listing import markdown, printed
from .study import Call, Study

if TYPE_CHECKING:
    from ..identification.fit import Fit

QUESTION = "How often is a hidden effect found, named and placed, and how often is one invented?"
USUAL_CASES = 8
"""Cases of each bench where nothing is said [-]."""

Case = tuple[str, int]
"""Bench and seed."""

WORKERS = 2
BLOCK = 20
"""Cases that a worker does before it is replaced [-]: compiled code piles up in a process."""

WITHOUT_EVERY = 4
"""Of so many cases one is diagnosed again without the law that is hidden in it [-]."""

CODE = ("identification", "model", "tests/lab")
"""Folders whose code decides what a case is and what is said of it [-]."""

CASES = "hidden_effect_cases.jsonl"
PROTOCOL = (
    "A case is a seed. The bench draws a club, its tests, noise and what is hidden, and writes the "
    "records to one folder and the truth beside it.",
    "Bench A is of lumped bodies; bench B of finite elements, with a distributed sleeve.",
    "What is tested is given the records and the rig as a lab would have it. The truth is read "
    "when the verdict is written.",
    "Detectable: what the effect changes, projected off free constants, start states, offsets, "
    "gains and clocks, is above 10 noise units and above 2 % of the records' norm. Strong: it is "
    "above 2 % of their energy as well, at 30 dB twenty times the power of the noise.",
    "On bench B an extra mode at the shaft is right whatever is hidden: such a club has one.",
    "Laws that the library lacks are counted apart: there, 'unknown' is the right answer. Of every "
    "fourth case, if its one effect could be found, the records are diagnosed once more without "
    "its law: 'unknown' is right there too, at the effect's place.",
    "The strength that is told is compared where the bench means the same number: not for laws of "
    "a sleeve, nor of the shaft of finite elements, nor where a law's form is another one.",
    "An extension is to take away four fifths of the held-out error that lies beyond the noise, or "
    "of what the hidden effect's own law takes away where that is less: where it has not, that law "
    "is fitted to the same records, begun from the rig's stated constants. A fit of it that gains "
    "nothing excuses nothing. How often all beyond the noise was reached has its own row.",
    "Every eighth case hides two effects; of the others a quarter hides none. Whether each of two "
    "is detectable is asked of its twin that has the other.",
    f"Records stand {USUAL_DECIBELS:g} dB above their noise; of sixteen cases one 40 dB and one "
    "20 dB. These count in their own rows and among the clean ones, nowhere else.",
    "Where two causes are told to be alike, the best of the proposed tests at another amplitude is "
    "made on the bench and all records are diagnosed once more.",
    "The yardsticks begin with the diagnosis's own fit of the rig as it stands. "
    "Pick-by-BIC refits the three most promising laws with the noise taken for white. Sparse "
    "regression (pysindy's STLSQ, threshold 0.1 of the residual's size) picks the largest term of "
    "what is left, on powers of every place's stretch and rate and on what a sensor may add.",
    "A case that the bench fails to draw is told apart and counted nowhere.",
    "Intervals are of 95 %, after Clopper and Pearson.",
)


def run(call: Call) -> dict[str, Any]:
    """Draw cases on both benches, diagnose each from its records alone, and count.

    Args:
        call: seed, number of cases of each bench, folder for the results, progress.

    Returns:
        The tables; hidden_effect.json, .md, .svg and .html hold the same, the page with every case
        that was not answered rightly, and hidden_effect_cases.jsonl every case, from which a run
        that was stopped goes on.

    Raises:
        ValueError: where this is no source checkout, or the bench refuses to draw.
    """
    from .. import __version__

    require_bench()
    began = time.perf_counter()
    count = USUAL_CASES if call.cases is None else call.cases
    wanted = [(bench, 1000 * call.seed + index) for index in range(count) for bench in BENCHES]
    kept = None if call.out is None else call.out / CASES
    rows = {key: row for key, row in done(kept).items() if key in wanted}
    left = [key for key in wanted if key not in rows]
    undrawn = []
    for row in answers(left):
        if "undrawn" in row:
            undrawn.append(row)
            call.progress(row["undrawn"])
            continue
        rows[row["bench"], row["seed"]] = row
        _append(kept, row)
        call.progress(f"{len(rows)} of {len(wanted)}: {row['bench']} {row['seed']} {outcome(row)}")
    call.progress("")
    ordered = [rows[key] for key in wanted if key in rows]
    result = {
        "question": QUESTION,
        "protocol": list(PROTOCOL),
        "benches": {b: tables([row for row in ordered if row["bench"] == b]) for b in BENCHES},
        "cases": ordered,
        "undrawn": undrawn,
        "provenance": {
            "version": __version__,
            "code": code(),
            "seed": call.seed,
            "seconds": round(time.perf_counter() - began, 1),
        },
    }
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    write_together(
        call.out,
        {
            "hidden_effect.json": lambda path: path.write_text(text, encoding="utf-8"),
            "hidden_effect.md": lambda path: path.write_text(as_text(result), encoding="utf-8"),
            "hidden_effect.svg": lambda path: draw(result, path),
            "hidden_effect.html": lambda path: write_hidden_page(result, path),
        },
    )
    return result


def done(path: Path | None) -> dict[tuple[str, int], dict[str, Any]]:
    """Cases that an earlier run has answered with this very code, by bench and seed."""
    if path is None or not path.is_file():
        return {}
    lines = path.read_text(encoding="utf-8").split("\n")
    rows = [json.loads(line) for line in lines[:-1]]  # the last one is empty, or was cut off
    return {(r["bench"], r["seed"]): r for r in rows if r.get("code") == code()}


def _append(path: Path | None, row: Mapping[str, Any]) -> None:
    if path is None:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    cut = path.is_file() and not path.read_bytes().endswith(b"\n") and path.stat().st_size > 0
    with path.open("a", encoding="utf-8") as file:
        file.write(("\n" if cut else "") + json.dumps(row, allow_nan=False) + "\n")


def answers(
    cases: Sequence[Case], work: Callable[[Case], dict[str, Any]] | None = None
) -> Iterator[dict[str, Any]]:
    """Rows of the cases as they are answered, by processes that are replaced now and then.

    Args:
        cases: benches with seeds.
        work: what answers one; `answer` where nothing is said.

    Returns:
        A row for each. A case whose process dies is asked once more, alone; if it dies again, that
        is its verdict.
    """
    spawn = multiprocessing.get_context("spawn")
    left, struck = list(cases), set[Case]()
    while left:
        batch = left[:1] if left[0] in struck else left[: BLOCK * WORKERS]
        died: Case | None = None
        with ProcessPoolExecutor(WORKERS, spawn) as pool:
            waiting = {pool.submit(work or answer, case): case for case in batch}
            for future in as_completed(waiting):  # a slow case keeps no other from being written
                case = waiting[future]
                try:
                    row = future.result()
                except BrokenProcessPool:
                    died = case if died is None else min(died, case, key=batch.index)
                    continue
                left.remove(case)
                yield row
        if died in struck:
            left.remove(died)
            yield _lost(died)
        elif died is not None:
            struck.add(died)


def _lost(case: Case) -> dict[str, Any]:
    """The row of a case that no process has answered."""
    with tempfile.TemporaryDirectory() as folder:
        draw_case(*case, Path(folder))
        truth = json.loads((Path(folder) / "truth.json").read_text(encoding="utf-8"))
    bare = dict.fromkeys(("baseline", "sparse", "seconds", "without", "next", "true_after"))
    fault = "the process died twice"
    return _begun(case) | _failed(fault) | bare | _truth(truth)


def _begun(case: Case) -> dict[str, Any]:
    from .. import __version__

    return {"bench": case[0], "seed": case[1], "version": __version__, "code": code()}


@cache
def code() -> str:
    """A digest of what draws cases and what answers them, 12 hexadecimal digits.

    Rates of two codes are no rates: a row counts with those of its own alone.
    """
    found = hashlib.sha256()
    for folder in CODE:
        for path in sorted((ROOT / folder).rglob("*.py")):
            found.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()[:12]


def answer(case: Case) -> dict[str, Any]:
    """Draw one case, diagnose its records, and only then read its truth.

    Of every so many causes that could be found, the law is taken out of the library then and the
    records are diagnosed once more. A case that the bench cannot draw says so (``undrawn``).
    """
    with tempfile.TemporaryDirectory() as folder:
        try:
            sidecars = draw_case(*case, Path(folder))
        except ValueError as fault:
            return _begun(case) | {"undrawn": str(fault)}
        began = time.perf_counter()
        verdict, base, result = _verdict(sidecars)
        row = _begun(case) | verdict
        row["seconds"] = round(time.perf_counter() - began, 1)
        row["baseline"] = white_bic(base)
        row["sparse"] = sparse_regression(base)
        truth = json.loads((Path(folder) / "truth.json").read_text(encoding="utf-8"))
        row |= _truth(truth)
        row["true_after"] = _true_after(row, sidecars, base)
        asked = case[1] % WITHOUT_EVERY == 1 and sure(row)
        row["without"] = _verdict(sidecars, [row["truth"][0]["law"]])[0] if asked else None
        row["next"] = None
        if result is not None and row["status"] == "ambiguous":
            row["next"] = _after_next_test(case, result, Path(folder))
    forget_programs()
    return row


def _after_next_test(case: Case, result: Mapping[str, Any], folder: Path) -> dict[str, Any] | None:
    """What is said when the best proposed test that the bench can make has been made.

    It can make every test again at another amplitude; none where no such test is proposed.
    """
    told = folder / "diagnosis.json"
    told.write_text(json.dumps(result), encoding="utf-8")
    tests = [one for one in propose_experiment(told)["tests"] if one["amplitude_factor"] != 1.0]
    if not tests:
        return None
    best = tests[0]
    again = f"{best['like']}:{best['amplitude_factor']:g}"
    try:
        sidecars = draw_case(*case, folder / "next", again)
    except ValueError:  # the bench cannot make it
        return None
    verdict = _verdict(sidecars)[0]
    return {**verdict, "test": best["test"], "evidence": best["expected_evidence"]}


def _true_after(row: Mapping[str, Any], sidecars: Sequence[Path], base: Fit | None) -> float | None:
    """Held-out error of the hidden effect's own law [-], where what is named leaves much of it.

    None too where that law cannot be fitted; then all that lies beyond the noise is asked for.
    """
    if base is None or not sure(row) or row["nrmse_before"] is None or gains_most(row):
        return None
    try:
        return foretold_by_the_true_law(sidecars, base, row["truth"][0])
    except (ArithmeticError, AssertionError, LookupError, RuntimeError, ValueError):
        return None


def _verdict(
    sidecars: Sequence[Path], left_out: Sequence[str] = ()
) -> tuple[dict[str, Any], Fit | None, dict[str, Any] | None]:
    """What the public road says, the fit that it began with, and its whole answer.

    A failure is a verdict too.
    """
    try:
        result, found = diagnosed(read_inputs(sidecars, None), 0, left_out=left_out)
    except (ArithmeticError, AssertionError, LookupError, RuntimeError, ValueError) as fault:
        return _failed(str(fault)[:300]), None, None
    keys = ("law", "place", "probability", "parameters")
    causes = [{key: cause[key] for key in keys} for cause in result["causes"]]
    gain, place = result["gain"], result["where"]
    errors = {key: gain.get(key) for key in ("nrmse_before", "nrmse_after", "noise_floor")}
    where = place["place"] if place else None
    row = {"status": result["status"], "causes": causes, "where": where, **errors}
    return row, found.base, result


def _failed(fault: str) -> dict[str, Any]:
    empty = dict.fromkeys(("nrmse_before", "nrmse_after", "noise_floor"))
    return {"status": FAILED, "causes": [], "where": None, "fault": fault, **empty}


def _truth(truth: Mapping[str, Any]) -> dict[str, Any]:
    """What is kept of the truth, and whether the library has a law of each cause's name."""
    from ..model.law import library

    keys = ("law", "place", "places", "strength", "size", "other", "gain", "power")
    causes = [{key: cause.get(key) for key in keys} for cause in truth["causes"]]
    return {
        "model": truth["model"],
        "noise": truth["noise"]["kind"],
        "decibels": truth["noise"]["snr_db"],
        "truth": causes,
        "known": all(cause["law"] in library() for cause in causes),
        "power": truth["power"],
    }


def as_text(result: Mapping[str, Any]) -> str:
    """The summary, the confusion matrices and the protocol as Markdown."""
    parts = [f"# {result['question']}", "", *markdown(HEADINGS, lines(result))]
    for bench in BENCHES:
        parts += ["", f"## Bench {bench}: what was hidden, and what was said"]
        for truth, said in result["benches"][bench]["confusion"].items():
            ordered = sorted(said.items(), key=lambda pair: -pair[1])
            parts.append(f"- {truth}: " + "; ".join(f"{count} {name}" for name, count in ordered))
    if result["undrawn"]:
        parts += ["", "## Not drawn", *(f"- {row['undrawn']}" for row in result["undrawn"])]
    parts += ["", "## Protocol", *(f"- {line}" for line in result["protocol"])]
    return "\n".join(parts) + "\n"


def draw(result: Mapping[str, Any], path: Path) -> None:
    """Draw the power against the detectability, and the calibration."""
    import matplotlib as mpl

    with mpl.rc_context({"svg.hashsalt": "supple", "font.size": 10}):
        power_figure(result).savefig(path, format="svg", metadata={"Date": None})


def show(result: Mapping[str, Any]) -> None:
    """Print the summary."""
    below = []
    for bench in BENCHES:
        told = result["benches"][bench]["outcomes"]
        words = ", ".join(f"{count} {name}" for name, count in sorted(told.items()))
        below.append(f"bench {bench}: {words}")
    below += [row["undrawn"] for row in result["undrawn"]]
    printed(result["question"], HEADINGS, lines(result), below)


STUDY = Study("hidden_effect", QUESTION, run, show)
