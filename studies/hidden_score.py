"""Sets verdicts on sealed cases beside their truths: right or wrong, how often, and how surely."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from .hidden_cases import OTHER_DECIBELS, USUAL_DECIBELS
from .hidden_sizes import compared, error_of, gains_beyond_noise, gains_most, holds

Row = Mapping[str, Any]

BENCHES = ("A", "B")
ADEQUATE, UNKNOWN, FAILED = "adequate", "unknown", "failed"
NORMS = (0.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
"""Lower edges of the detectability's classes: projected norm in noise units [-]."""

CHANCES = (0.0, 0.5, 0.9)
"""Lower edges of the classes of stated probability [-]."""


def intervals(hits: int, count: int) -> dict[str, Any]:
    """A share with its 95 % interval after Clopper and Pearson [-].

    Args:
        hits: how many of them.
        count: of how many.

    Returns:
        ``hits``, ``count``, ``share`` (None of none), ``low`` and ``high`` [-].
    """
    from scipy.stats import beta

    low = float(beta.ppf(0.025, hits, count - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, count - hits)) if hits < count else 1.0
    share = hits / count if count else None
    return {"hits": hits, "count": count, "share": share, "low": low, "high": high}


def named(row: Row) -> list[tuple[str, str]]:
    """The (law, place) pairs that the verdict names.

    A finite-element club has a second bending mode that no lumped club has: an ``extra_mode`` at
    its shaft is right whatever else is hidden, and counts neither for nor against.
    """
    pairs = [(cause["law"], cause["place"]) for cause in row["causes"]]
    own = ("extra_mode", "shaft")
    hidden = {cause["law"] for cause in row["truth"]}
    if row["bench"] == "B" and "extra_mode" not in hidden:
        pairs = [pair for pair in pairs if pair != own]
    return pairs


def outcome(row: Row) -> str:
    """What became of a case.

    Returns:
        Of a clean case ``adequate``, ``flagged`` (unknown) or ``invented``. Of a hidden cause
        ``right``; ``right pair`` where an ambiguous verdict holds it; ``right law`` at another
        place; ``some`` where only some of several, or others beside them, are named; ``unknown``,
        ``missed`` (adequate) or ``wrong``. Of both ``failed``.
    """
    if row["status"] == FAILED:
        return FAILED
    pairs, truths = named(row), row["truth"]
    if not truths:
        if pairs:
            return "invented"
        return "flagged" if row["status"] == UNKNOWN else ADEQUATE
    if not pairs:
        return UNKNOWN if row["status"] == UNKNOWN else "missed"
    hits = [truth for truth in truths if any(_is(truth, pair) for pair in pairs)]
    if len(hits) == len(truths) == len(pairs):
        return "right"
    if len(hits) == len(truths) and row["status"] == "ambiguous":
        return "right pair"
    if hits:
        return "some"
    laws = {truth["law"] for truth in truths}
    return "right law" if laws == {law for law, _ in pairs} else "wrong"


def _is(truth: Row, pair: tuple[str, str]) -> bool:
    return truth["law"] == pair[0] and pair[1] in truth["places"]


def answered(row: Row) -> str:
    """The verdict as a column of the confusion matrix."""
    pairs = sorted(f"{place}/{law}" for law, place in named(row))
    mark = "ambiguous: " if row["status"] == "ambiguous" else ""
    if pairs:
        return mark + " + ".join(pairs)
    return row["status"] if row["status"] in (UNKNOWN, FAILED) else ADEQUATE


def asked(row: Row) -> str:
    """The truth as a row of the confusion matrix."""
    found = sorted(f"{truth['place']}/{truth['law']}" for truth in row["truth"])
    return " + ".join(found) or ADEQUATE


def tables(rows: Sequence[Row]) -> dict[str, Any]:
    """All tables of one bench.

    Args:
        rows: one a case: ``bench``, ``truth``, ``power``, ``status``, ``causes``, ``seconds``,
            ``nrmse_before``, ``nrmse_after``, ``noise_floor``, ``known``, ``baseline``,
            ``decibels`` [dB], ``without``, ``next`` and ``true_after``.

    Returns:
        Tables that JSON can hold; shares in [-] with intervals, times in [s].
    """
    confusion: dict[str, Counter[str]] = {}
    for row in rows:
        confusion.setdefault(asked(row), Counter())[answered(row)] += 1
    usual = [row for row in rows if row["decibels"] == USUAL_DECIBELS]
    single = [row for row in usual if len(row["truth"]) == 1]
    known = [row for row in single if row["known"]]
    found = [row for row in known if sure(row)]
    strong = [row for row in known if row["power"].get("strong")]
    strange = [row for row in single if not row["known"] and row["power"]["detectable"]]
    several = [row for row in usual if len(row["truth"]) > 1 and row["known"]]
    foretold = [row for row in found if row["nrmse_before"] is not None]
    return {
        "cases": len(rows),
        "outcomes": dict(Counter(outcome(row) for row in rows)),
        "confusion": {name: dict(counts) for name, counts in sorted(confusion.items())},
        "false_alarms": false_alarms(rows),
        "law_right": _share(found, _law_right),
        "place_right_too": _share(found, _right),
        "strong_law_right": _share(strong, _law_right),
        "strong_place_right_too": _share(strong, _right),
        "right_where_named": _share([row for row in found if named(row)], _right),
        "law_absent_named_wrongly": _share(strange, lambda row: bool(named(row))),
        "by_noise": _by_noise(rows),
        "without": _without(usual),
        "strength": _strengths(found),
        "gains_most": _share(foretold, gains_most),
        "gains_beyond_noise": _share(foretold, gains_beyond_noise),
        "several_all_right": _share(filter(_each_detectable, several), _right),
        "several_none_wrong": _share(several, none_wrong),
        "several_no_more": _share(several, lambda row: len(named(row)) <= len(row["truth"])),
        "after_next_test": _after_next_test(rows),
        "power": power_curve(known),
        "calibration": calibration(usual),
        "held_out": _held_out(found),
        "seconds": _seconds(rows),
        "baselines": _baselines(usual, found),
    }


def sure(row: Row) -> bool:
    """Whether a case hides one effect that could be found, by a law that the library has."""
    return len(row["truth"]) == 1 and row["known"] and row["power"]["detectable"]


def _each_detectable(row: Row) -> bool:
    """Whether each of the effects could be found beside the others."""
    return all(truth["power"]["detectable"] for truth in row["truth"])


def _by_noise(rows: Sequence[Row]) -> dict[str, Any]:
    """How often the law of a single effect that could be found is right, at other noise [dB]."""
    found = {}
    for level in OTHER_DECIBELS.values():
        some = [row for row in rows if row["decibels"] == level and sure(row)]
        found[f"{level:g}"] = _share(some, _law_right)
    return found


def _after_next_test(rows: Sequence[Row]) -> dict[str, Any]:
    """How often the cause is right when the test that parts two has been made."""
    again = [{**row, **row["next"]} for row in rows if row["next"]]
    return _share(again, lambda row: outcome(row) == "right")


def _without(rows: Sequence[Row]) -> dict[str, Any]:
    """What is said where the law of the hidden effect has been taken out of the library."""
    apart = [{**row, **row["without"]} for row in rows if row.get("without")]
    return {
        "named_wrongly": _share(apart, lambda row: bool(named(row))),
        "unknown": _share(apart, lambda row: row["status"] == UNKNOWN),
        "unknown_and_placed": _share(apart, lambda r: r["status"] == UNKNOWN and _at_its_place(r)),
    }


def _at_its_place(row: Row) -> bool:
    return row["where"] in row["truth"][0]["places"]


def _strengths(rows: Sequence[Row]) -> dict[str, Any]:
    """How well strengths are told where the cause is named, and how often intervals hold them."""
    import numpy as np

    told = [row for row in rows if compared(row) is not None]
    errors = [error for row in told if (error := error_of(row)) is not None]
    median = float(np.median(errors)) if errors else None
    return {"interval_holds": _share(told, holds), "median_error": median}


def _law_right(row: Row) -> bool:
    return outcome(row) in ("right", "right pair", "right law")


def _right(row: Row) -> bool:
    return outcome(row) in ("right", "right pair")


def none_wrong(row: Row) -> bool:
    """Whether every named pair is one that is there."""
    return all(any(_is(truth, pair) for truth in row["truth"]) for pair in named(row))


def _share(rows: Iterable[Row], holds: Callable[[Row], bool]) -> dict[str, Any]:
    chosen = list(rows)
    return intervals(sum(map(holds, chosen)), len(chosen))


def false_alarms(rows: Sequence[Row]) -> dict[str, Any]:
    """Share of clean cases in which a cause was invented, in all and by kind of noise [-]."""
    clean = [row for row in rows if not row["truth"]]
    found = {"all": _share(clean, lambda row: outcome(row) == "invented")}
    for kind in sorted({row["noise"] for row in clean}):
        some = [row for row in clean if row["noise"] == kind]
        found[kind] = _share(some, lambda row: outcome(row) == "invented")
    return found


def power_curve(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """How often a single cause is named rightly, by its projected norm in noise units [-]."""
    curve = []
    for index, low in enumerate(NORMS):
        high = NORMS[index + 1] if index + 1 < len(NORMS) else float("inf")
        inside = [row for row in rows if low <= row["power"]["projected_norm"] < high]
        seen = _share(inside, lambda row: outcome(row) != "missed")
        top = None if high == float("inf") else high
        curve.append({"low": low, "high": top, "right": _share(inside, _right), "noticed": seen})
    return curve


def calibration(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """How often a named cause is one that is there, by its stated probability [-].

    Returns:
        For each class of probability its ends ``from`` and ``to``, and `intervals`.
    """
    told = []
    for row in rows:
        pairs = set(named(row))
        for cause in row["causes"]:
            if (cause["law"], cause["place"]) in pairs:
                pair = cause["law"], cause["place"]
                there = any(_is(truth, pair) for truth in row["truth"])
                told.append((float(cause["probability"]), there))
    found = []
    for index, low in enumerate(CHANCES):
        high = CHANCES[index + 1] if index + 1 < len(CHANCES) else 1.0
        inside = [there for chance, there in told if low <= chance < high or low < chance == high]
        found.append({"from": low, "to": high, **intervals(sum(inside), len(inside))})
    return found


def _held_out(rows: Sequence[Row]) -> dict[str, Any]:
    """Errors of what was never fitted, over the noise's own: medians [-]."""
    import numpy as np

    told = [row for row in rows if row["nrmse_before"] and row["noise_floor"]]
    if not told:
        return {"cases": 0}
    before, after = (
        [row[which] / row["noise_floor"] for row in told]
        for which in ("nrmse_before", "nrmse_after")
    )
    return {
        "cases": len(told),
        "before": float(np.median(before)),
        "after": float(np.median(after)),
    }


def _seconds(rows: Sequence[Row]) -> dict[str, float]:
    import numpy as np

    times = [row["seconds"] for row in rows if row["seconds"] is not None] or [0.0]
    shares = {"median": 0.5, "most": 0.9, "longest": 1.0}
    return {name: round(float(np.quantile(times, share)), 1) for name, share in shares.items()}


def _baselines(rows: Sequence[Row], sure: Sequence[Row]) -> dict[str, Any]:
    """What simpler tools would say, and the thesis's own way, which extends nothing."""
    found: dict[str, Any] = {
        name: _baseline(rows, sure, key)
        for name, key in (("white_bic", "baseline"), ("sparse",) * 2)
    }
    bare = {"right": intervals(0, len(sure)), "held_out": _held_out(sure)}
    return {**found, "no_extension": bare}


def _baseline(rows: Sequence[Row], sure: Sequence[Row], key: str) -> dict[str, Any]:
    """How often a tool that picks one law invents one, and finds the one that is there [-]."""
    told = [row for row in rows if row.get(key) is not None]

    def hit(row: Row) -> bool:
        pair = row[key]["law"], row[key]["place"]
        return any(_is(truth, pair) for truth in row["truth"])

    clean = [row for row in told if not row["truth"]]
    return {
        "false_alarms": _share(clean, lambda row: bool(row[key]["law"])),
        "right": _share([row for row in told if row in sure], hit),
    }
