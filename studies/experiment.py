"""Which test to make next, from a diagnosis that was written before and the records it names."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .engine import Progress, read_inputs

if TYPE_CHECKING:
    from ..identification.experiment import Proposal, Rival
    from ..identification.fit import Fit

ALTERNATIVES = 3
"""Explanations that are compared at most, beside what was named [-]."""

NOTHING = "nothing missing"


def propose_experiment(
    path: Path,
    most: float = 2.0,
    seed: int = 0,
    progress: Progress = lambda text: None,
) -> dict[str, Any]:
    """Rank the tests that a lab could make next by how well they separate the causes left.

    Args:
        path: a ``diagnosis.json``; the records that it names must lie where they lay.
        most: largest factor on amplitudes and forces that the rig may bear [-].
        seed: kept in the provenance; nothing here is drawn by chance.
        progress: told what is being done.

    Returns:
        ``experiment.json``: status, sentence, causes, tests with their expected evidence.

    Raises:
        ValueError: in the words of the door.
    """
    if not 0.0 < most < 1000.0:
        raise ValueError(
            f"--most: expected a factor above 0 and below 1000, found {most:g}. Mend: say how many "
            "times the largest amplitude so far the rig may bear."
        )
    diagnosis = _read(path)
    sidecars, rig = _files(path, diagnosis)
    inputs = read_inputs(sidecars, rig)
    _check_unchanged(path, diagnosis, inputs.files)
    from ..identification.base import fit_base
    from ..identification.experiment import CLEAR, propose
    from ..identification.problem import make_problem

    progress("fitting the rig as it stands")
    base = fit_base(make_problem(inputs.records, inputs.rig))
    rivals = _rivals(diagnosis, base, progress)
    found = propose(rivals, most, progress) if len(rivals) > 1 else []
    progress("")
    clear = [one for one in found if one.evidence >= CLEAR]
    status = "separable" if clear else "not_separable" if found else "nothing_to_separate"
    return {
        "status": status,
        "sentence": _sentence(status, found, rivals),
        "causes": [rival.name for rival in rivals],
        "tests": [_test(one, CLEAR) for one in found],
        "assumptions": [
            "Noise as in the record that a test is made after; of a sensor that none has, 3 % of "
            "its reading.",
            "Constants move as far as the records made so far allow, linearly about their best "
            "values; a test's start state and zeros are free.",
            f"The rig bears {most:g} times the largest amplitude so far.",
        ],
        "provenance": inputs.provenance(seed),
    }


def _fault(path: Path, where: str, expected: str, found: str) -> ValueError:
    return ValueError(
        f"{path.name}: {where}: expected {expected}, found {found}. Mend: run `supple diagnose "
        "RECORD... --out DIR` and give DIR/diagnosis.json."
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise _fault(path, "file", "one that can be read", f"'{error.strerror}'") from None
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise _fault(path, "file", "JSON", f"'{error}'") from None
    shapes = {"causes": list, "candidates": list, "cannot_tell": list, "records": list}
    shapes |= {"history": list, "best_guess": list, "status": str, "provenance": dict}
    for key, kind in shapes.items():
        if not isinstance(told, dict) or not isinstance(told.get(key), kind):
            raise _fault(path, key, f"a {kind.__name__} of a diagnosis", "none")
    pairs = [*told["causes"], *told["best_guess"], *told["candidates"]]
    for pair in pairs:
        if not (isinstance(pair, dict) and {"law", "place"} <= pair.keys()):
            raise _fault(path, "causes", "entries with a law and a place", repr(pair)[:60])
        if not isinstance(pair.get("delta_bic", 0.0), int | float):
            raise _fault(path, "delta_bic", "a number", repr(pair["delta_bic"])[:60])
    if not all(isinstance(one, str) and "/" in one for one in told["cannot_tell"]):
        raise _fault(path, "cannot_tell", "names as PLACE/LAW", repr(told["cannot_tell"])[:60])
    if not all(
        isinstance(one, dict) and isinstance(one.get("name"), str) for one in told["records"]
    ):
        raise _fault(path, "records", "entries with a name", repr(told["records"])[:60])
    if not isinstance(told["provenance"].get("inputs"), dict):
        raise _fault(path, "provenance.inputs", "the files that were read", "none")
    return told


def _files(path: Path, diagnosis: Mapping[str, Any]) -> tuple[list[Path], Path | None]:
    """Sidecars of the fitted records, and the rig."""
    train = {one["name"] for one in diagnosis["records"] if one.get("split") != "held_out"}
    names = {one["name"] for one in diagnosis["records"]}
    tables = [Path(name) for name in diagnosis["provenance"]["inputs"] if name.endswith(".toml")]
    sidecars = [one for one in tables if one.stem in train]
    rigs = [one for one in tables if one.stem not in names]
    if len(sidecars) != len(train) or not train:
        raise _fault(path, "provenance.inputs", f"sidecars of {len(train)} records", "others")
    gone = [one for one in (*sidecars, *rigs) if not one.is_file()]
    if gone:
        raise _fault(path, "provenance.inputs", "files that are still there", f"no '{gone[0]}'")
    return sidecars, rigs[0] if len(rigs) == 1 else None


def _check_unchanged(path: Path, diagnosis: Mapping[str, Any], files: Mapping[str, str]) -> None:
    told = diagnosis["provenance"]["inputs"]
    changed = [name for name, digest in files.items() if told.get(name, digest) != digest]
    if changed:
        raise _fault(path, "provenance.inputs", "files as they were", f"'{changed[0]}' changed")


def _rivals(diagnosis: Mapping[str, Any], base: Fit, progress: Progress) -> list[Rival]:
    """Explanations that are left, each fitted to the records."""
    from ..identification.experiment import Rival

    status, history = diagnosis["status"], diagnosis["history"]
    told = diagnosis["causes"] or diagnosis["best_guess"]
    accepted = max(len(history) - 1, 0)
    names = [(cause["law"], cause["place"]) for cause in told]
    if status == "adequate":
        hidden = [tuple(reversed(name.split("/", 1))) for name in diagnosis["cannot_tell"]]
        unseen = [_at_natural(base, pair) for pair in hidden[: ALTERNATIVES + 1]]
        return [Rival(NOTHING, base), *(rival for rival in unseen if rival is not None)]
    common, left = names[: accepted - 1] if accepted else [], names[max(accepted - 1, 0) :]
    if status != "ambiguous":
        others = sorted(diagnosis["candidates"], key=lambda one: -float(one.get("delta_bic", 0.0)))
        pairs = [(one["law"], one["place"]) for one in others]
        left += [pair for pair in pairs if pair not in names][:ALTERNATIVES]
    fit, joined = base, []
    for pair in common:
        grown = _with(fit, pair, progress)
        if grown is not None:
            fit = grown
            joined.append("/".join(reversed(pair)))
    found = []
    for pair in left:
        grown = _with(fit, pair, progress)
        if grown is not None:
            found.append(Rival(" + ".join([*joined, "/".join(reversed(pair))]), grown))
    return found


def _with(fit: Fit, pair: Sequence[str], progress: Progress) -> Fit | None:
    """The fit with one more law at its place; None where it cannot act there."""
    from ..identification.causes import possible_causes
    from ..identification.extend import extend
    from ..identification.screen import screen

    causes = [c for c in possible_causes(fit) if (c[1].name, c[0]) == tuple(pair)]
    if not causes:
        return None
    progress(f"fitting {pair[1]}/{pair[0]}")
    return extend(fit, screen(fit, causes)[0], 30)


def _at_natural(base: Fit, pair: Sequence[str]) -> Rival | None:
    """A law of natural strength, held there: what these records could not show."""
    from dataclasses import replace

    from ..identification.causes import possible_causes
    from ..identification.experiment import Rival
    from ..identification.screen import trials_of

    causes = [c for c in possible_causes(base) if (c[1].name, c[0]) == tuple(pair)]
    if not causes:
        return None
    attempt = trials_of(base, causes[0])[0]
    held = [(attempt.entry, attempt.entry.scale), *((one, one.value) for one in attempt.shapes)]
    model = replace(
        base.model,
        causes=(*base.model.causes, causes[0]),
        fixed=(*base.model.fixed, *held),
    )
    return Rival("/".join(reversed(pair)), replace(base, model=model))


def _test(one: Proposal, clear: float) -> dict[str, Any]:
    planned = one.planned
    return {
        "test": planned.words,
        "kind": planned.kind,
        "like": planned.template,
        "amplitude_factor": planned.factor,
        "added_sensor": planned.added,
        "expected_evidence": one.evidence,
        "closest": list(one.pair),
        "tells": one.evidence >= clear,
        "pairs": [
            {"a": a, "b": b, "if_a": by_a, "if_b": by_b} for a, b, by_a, by_b in one.all_pairs
        ],
    }


def _sentence(status: str, found: Sequence[Proposal], rivals: Sequence[Rival]) -> str:
    if status == "nothing_to_separate":
        return "Only one explanation is left; no test can separate it from another one."
    best = found[0]
    told = f"{best.planned.words}: it parts {best.pair[0]} from {best.pair[1]}"
    if status == "separable":
        return f"{told} by {best.evidence:.3g} units of evidence, more than any other test here."
    return (
        f"No test here tells {', '.join(rival.name for rival in rivals)} all apart. The best is: "
        f"{told} by {best.evidence:.2g} units of evidence only; look for another sensor or place."
    )


def show_experiment(result: Mapping[str, Any]) -> None:
    """Print what to do next, and the tests in their order."""
    from .listing import printed

    rows = [
        (one["test"], f"{one['expected_evidence']:.3g}", " / ".join(one["closest"]))
        for one in result["tests"]
    ]
    below = [result["sentence"], *result["assumptions"]]
    title = f"{result['status'].upper()}: what would tell {', '.join(result['causes'])} apart."
    printed(title, ("test", "expected evidence", "closest pair"), rows, below)
