"""The verdict in JSON and in words: the contract's keys and types, all finite."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from supple.identification.constants import fit_json
from supple.identification.finding import Diagnosis, crowded
from supple.identification.verdict import (
    _interval,
    amount,
    diagnosis_json,
    next_of,
    probabilities,
    sentence_of,
    why_of,
)
from supple.identification.whereabouts import whereabouts

PROVENANCE = {"version": "0", "inputs": {"a.csv": "00"}, "seed": 0, "seconds": 1.0}
NUMBER = (int, float)
CONTRACT: dict[str, Any] = {
    "status": str,
    "cannot_tell": list,
    "sentence": str,
    "causes": list,
    "candidates": list,
    "confusable": list,
    "misfit": dict,
    "noise": dict,
    "gain": dict,
    "parameters": dict,
    "decision": dict,
    "provenance": dict,
}
ADDED = {"why": list, "what_next": str, "history": list, "records": list, "nuisances": dict}
INTERVAL = {"value": NUMBER, "std": NUMBER, "low": NUMBER, "high": NUMBER, "unit": str}


def of_kind(table: dict, kinds: dict) -> None:
    for key, kind in kinds.items():
        assert isinstance(table[key], kind), (key, table.get(key))


def walk(value: Any, where: str = "") -> None:
    """Every leaf is plain, and every number finite."""
    if isinstance(value, dict):
        for key, one in value.items():
            assert isinstance(key, str)
            walk(one, f"{where}.{key}")
    elif isinstance(value, list):
        for index, one in enumerate(value):
            walk(one, f"{where}[{index}]")
    else:
        assert value is None or type(value) in (str, bool, int, float), (where, type(value))
        assert not isinstance(value, float) or math.isfinite(value), where


@pytest.fixture(params=["clean", "softening"])
def found(request, clean_diagnosis, softening_diagnosis) -> Diagnosis:
    """A diagnosis that names nothing, and one that names a cause."""
    return {"clean": clean_diagnosis, "softening": softening_diagnosis}[request.param]


def test_the_table_obeys_the_contract(found):
    told = diagnosis_json(found, PROVENANCE)
    of_kind(told, CONTRACT | ADDED)
    walk(json.loads(json.dumps(told, allow_nan=False)))
    assert told["status"] in ("adequate", "named", "ambiguous", "unknown", "refused")
    for state in ("before", "after"):
        of_kind(told["misfit"][state], {"reduced_chi2": NUMBER, "whiteness_p": NUMBER})
    of_kind(told["noise"], {"law": str, "parameters": dict})
    gain = {k: NUMBER for k in ("nrmse_before", "nrmse_after", "noise_floor", "explained")}
    of_kind(told["gain"], {"records": list} | gain)
    for one in told["parameters"].values():
        of_kind(one, {"before": NUMBER, "after": NUMBER, "std": NUMBER, "unit": str})
        assert one["low"] < one["after"] < one["high"]
    for one in told["candidates"]:
        of_kind(one, {"law": str, "place": str, "probability": NUMBER, "delta_bic": NUMBER})
        assert 0.0 <= one["probability"] <= 1.0
    for one in told["confusable"]:
        of_kind(one, {"a": str, "b": str, "alikeness": NUMBER})
    assert set(told["decision"]) == {"best_before", "best_after", "loss_if_ignored"}
    assert told["provenance"] == PROVENANCE
    assert [r["split"] for r in told["records"]] == ["train", "train", "held_out"]


def test_nothing_but_plain_python_reaches_json(found):
    walk(diagnosis_json(found, PROVENANCE))


def test_a_cause_carries_its_strength_and_evidence(softening_diagnosis):
    told = diagnosis_json(softening_diagnosis, PROVENANCE)
    (cause,) = told["causes"]
    assert (cause["law"], cause["place"]) == ("cubic_stiffness", "spring")
    of_kind(cause, {"probability": NUMBER, "delta_bic": NUMBER, "score_p_value": NUMBER})
    (one,) = cause["parameters"].values()
    of_kind(one, INTERVAL)
    assert one["unit"] == "N/m^3" and one["low"] < one["value"] < one["high"]
    assert cause["probability"] > 0.99 and cause["score_p_value"] > 0
    assert [row["law"] for row in told["history"]] == ["", "cubic_stiffness"]
    assert told["history"][0]["reduced_chi2"] > told["history"][1]["reduced_chi2"]
    assert told["gain"]["explained"] > 0.9
    best = max(told["candidates"], key=lambda c: c["delta_bic"])
    assert (best["law"], best["refitted"]) == ("cubic_stiffness", True)


def test_nothing_is_named_where_nothing_is_missing(clean_diagnosis):
    told = diagnosis_json(clean_diagnosis, PROVENANCE)
    assert told["causes"] == [] and told["status"] == "adequate"
    assert len(told["history"]) == 1
    assert probabilities(clean_diagnosis) == {}


def test_sentences_name_the_place_and_the_strength(softening_diagnosis, clean_diagnosis):
    said = sentence_of(softening_diagnosis)
    assert said.startswith("The spring ") and "N/m^3" in said and "±" in said
    assert said.endswith(".") and "{" not in said
    assert "within their noise" in sentence_of(clean_diagnosis)
    lost = replace(softening_diagnosis, status="unknown")
    lost = replace(lost, where=whereabouts(lost.base))
    assert "no law of the library explains" in sentence_of(lost)
    torn = replace(softening_diagnosis, status="ambiguous", rivals=softening_diagnosis.accepted)
    assert "cannot tell spring/cubic_stiffness from" in sentence_of(torn)
    for one in (softening_diagnosis, clean_diagnosis, lost, torn):
        assert next_of(one).strip().endswith(".")
        assert why_of(one) and all(line.endswith(".") for line in why_of(one))
    assert diagnosis_json(lost, {})["causes"] == []
    assert diagnosis_json(lost, {})["best_guess"][0]["law"] == "cubic_stiffness"
    assert len(diagnosis_json(torn, {})["causes"]) == 2
    assert diagnosis_json(torn, {})["missing_force"] is None
    missing = diagnosis_json(lost, {})["missing_force"]
    assert (missing["place"], missing["against"]) == ("spring", "displacement")
    assert (missing["unit_x"], missing["unit_force"]) == ("m", "N")
    assert len(missing["x"]) == len(missing["force"]) and len(missing["curves"]) == 3


def test_many_laws_at_one_place_stand_in_for_another(softening_diagnosis):
    (trial,) = softening_diagnosis.accepted
    assert crowded([trial, trial]) is None
    assert crowded([trial] * 3) == "spring"
    torn = replace(softening_diagnosis, status="unknown", accepted=(trial,) * 3)
    torn = replace(torn, where=whereabouts(torn.base))
    assert "So many laws at spring stand in for one" in sentence_of(torn)
    assert "stand in" not in sentence_of(replace(torn, accepted=(trial,)))


@pytest.mark.parametrize(
    ("value", "std", "unit", "words"),
    [
        (0.4213, 0.0312, "N m", "0.42 ± 0.03 N m"),
        (24.2551, 0.0607, "N/m", "24.26 ± 0.06 N/m"),
        (95.562, 1.553, "kg", "95.6 ± 1.6 kg"),
        (3.0, 0.0, "1", "3"),
        (2.5, float("nan"), "s", "2.5 s"),
        (-0.01234, 0.0004, "", "-0.0123 ± 0.0004"),
    ],
)
def test_amounts_as_a_reader_wants_them(value, std, unit, words):
    assert amount(value, std, unit) == words


def test_a_positive_strength_that_is_hardly_known_is_known_by_its_factor():
    shown = _interval(2.0, 1.5, 0.0, "N")
    assert shown["low"] * shown["high"] == pytest.approx(4.0)
    assert 0.0 < shown["low"] < 2.0 < shown["high"]
    assert _interval(2.0, 0.1, 0.0, "N")["low"] == pytest.approx(2.0 - 0.196, abs=1e-4)
    assert _interval(-2.0, 1.5, -math.inf, "N")["high"] > 0.0  # of either sign: as it was
    assert math.isfinite(_interval(1e-9, 1.0, 0.0, "N")["high"])


def test_no_digits_are_lost_for_tiny_or_huge_numbers():
    assert "±" in amount(-49962.6, 130.0, "N/m^3")
    assert amount(3.512e8, 2.0e6, "N/m^3") == "3.512e+08 ± 2e+06 N/m^3"
    assert amount(1.2345e-7, 3.0e-9, "m") == "1.235e-07 ± 3e-09 m"


def test_the_constants_of_a_fit_obey_the_contract(clean_fit, softening_fit):
    for fit in (clean_fit, softening_fit):
        told = fit_json(fit, PROVENANCE)
        walk(json.loads(json.dumps(told, allow_nan=False)))
        walk(told)
        of_kind(told, {"status": str, "parameters": dict, "noise": dict, "misfit": dict})
        assert set(told["parameters"]) == {"links.spring.stiffness", "links.spring.damping"}
        for one in told["parameters"].values():
            of_kind(one, INTERVAL | {"identifiable": str})
            assert one["identifiable"] in ("yes", "one_sided", "flat", "coupled")
            assert one["low"] <= one["value"] <= one["high"]
    assert "supple diagnose" in fit_json(softening_fit, {})["sentence"]
    assert "supple diagnose" not in fit_json(clean_fit, {})["sentence"]
