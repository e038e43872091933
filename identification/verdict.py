"""A diagnosis in words and in the contract's JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .evidence import effective_samples, excess, explained
from .extend import HeldOut
from .finding import Diagnosis
from .fit import Fit
from .form import form_words, stated_std, within_form
from .free import Entry
from .identifiable import identifiability
from .screen import Candidate
from .tolerances import allowed_json, beyond_words, strained
from .trial import Trial
from .where_told import all_else, stand_ins, where_json, where_words
from .whereabouts import SMALL_EXCESS

NORMAL_95 = 1.959964
NOISE_WORDS = {"ar1": "AR(1)", "ar2": "AR(2)"}


def amount(value: float, std: float, unit: str) -> str:
    """A number with its error as a reader wants it: ``0.42 ± 0.03 N m`` in the given unit."""
    unit = "" if unit in ("1", "") else f" {unit}"
    if not np.isfinite(std) or std <= 0:
        return f"{value:.4g}{unit}"
    digits = int(np.floor(np.log10(std)))
    if -5 < digits < 5 and abs(value) < 1e6:
        places = max(0, 1 - digits) if std < 10.0 ** (digits) * 2 else max(0, -digits)
        return f"{value:.{places}f} ± {std:.{places}f}{unit}"
    figures = int(np.clip(np.floor(np.log10(max(abs(value), std))) - digits + 2, 2, 8))
    return f"{value:.{figures}g} ± {std:.2g}{unit}"


LARGEST_EXPONENT = 300.0
"""Largest natural logarithm of the factor by which a number may be uncertain [-]."""


def cause_json(trial: Trial, fit: Fit, probability: float) -> dict[str, Any]:
    """One accepted cause with its strength in `fit` [SI]."""
    candidate = trial.candidate
    law, entry = trial.law, candidate.entry
    index = fit.index(entry.label)
    value, std = fit.value(index), fit.std(index)
    mechanism = fit.problem.mechanism
    rotation = candidate.place in mechanism.law_places() and mechanism.turns(candidate.place)
    return {
        "law": law.name,
        "place": candidate.place,
        "probability": probability,
        "parameters": {
            law.symbol_at(rotation): _interval(value, std, entry.low, entry.unit),
            **{s.keys[-1]: _shape(fit, s) for s in candidate.shapes if s.record is None},
        },
        "delta_bic": trial.delta_bic,
        "score_p_value": max(candidate.p_value, 1e-300),
        "formula": law.formula,
        "cure": law.cure,
        "source": law.source,
        "sentence": law.sentence.format(
            place=candidate.place, value=amount(value, std, entry.unit)
        ),
    }


def _shape(fit: Fit, shape: Entry) -> dict[str, Any]:
    index = fit.index(shape.label)
    return _interval(fit.value(index), fit.std(index), shape.low, shape.unit)


def _interval(value: float, std: float, low: float, unit: str) -> dict[str, Any]:
    """95 % interval [SI]; of a positive number known to less than its size, about its logarithm.

    What the records refuse to be zero is known by its factor, not by its difference.
    """
    first, last = value - NORMAL_95 * std, value + NORMAL_95 * std
    if value > 0.0 and low >= 0.0 and first <= low:
        factor = float(np.exp(min(NORMAL_95 * std / value, LARGEST_EXPONENT)))
        first, last = value / factor, value * factor
    return {"value": value, "std": std, "low": max(first, low), "high": last, "unit": unit}


def probabilities(diagnosis: Diagnosis) -> dict[str, float]:
    """Share of each refitted law among all that were refitted and no law at all [-].

    By BIC, halved for the number of laws tried; laws that were never refitted get none.
    """
    count = max(len(diagnosis.candidates), 1)
    found: dict[str, float] = {}
    for stage in range(len(diagnosis.stages)):
        accepted = diagnosis.accepted[stage] if stage < len(diagnosis.accepted) else None
        if accepted is None:
            continue
        others = [t for t in diagnosis.trials if t.candidate.name != accepted.candidate.name]
        rivals = [t.delta_bic for t in others if t.fit.model.causes[:-1] == _before(accepted)]
        best = accepted.delta_bic
        weights = [1.0, count * np.exp(-0.5 * min(best, 700.0))]
        weights += [float(np.exp(0.5 * min(r - best, 0.0))) for r in rivals]
        found[accepted.candidate.name] = float(1.0 / np.sum(weights))
    return found | contested(diagnosis)


def contested(diagnosis: Diagnosis) -> dict[str, float]:
    """Shares of the laws that the records cannot tell apart, by the sets made of each [-]."""
    if not diagnosis.rivals:
        return {}
    shares = [one.contest.share if one.contest else 0.5 for one in diagnosis.rivals]
    weights = [1.0, *((1.0 - share) / share for share in shares)]
    names = [one.candidate.name for one in (diagnosis.accepted[-1], *diagnosis.rivals)]
    return {
        name: float(weight / np.sum(weights)) for name, weight in zip(names, weights, strict=True)
    }


def _before(trial: Trial) -> tuple:
    return trial.fit.model.causes[:-1]


def sentence_of(diagnosis: Diagnosis) -> str:
    """What is wrong, in one sentence, with strengths in SI units."""
    base, final = diagnosis.base, diagnosis.final
    if diagnosis.status == "adequate":
        club = " and what a lumped club leaves of a real one" if within_form(final) else ""
        return (
            f"The model explains these records to within their noise{club}; nothing that is "
            "missing shows."
        )
    told = []
    for trial in diagnosis.accepted:
        told.append(cause_json(trial, final, 1.0)["sentence"])
    if diagnosis.status == "named":
        return " ".join(told)
    if diagnosis.status == "ambiguous":
        names = [t.candidate.name for t in (*diagnosis.accepted[-1:], *diagnosis.rivals)]
        return (
            f"These records cannot tell {' from '.join(names)}; each explains them as well. "
            + " ".join(told)
        )
    beyond = beyond_words(final)
    if beyond and not diagnosis.crowded and excess(final) < SMALL_EXCESS:
        return f"What was told of these records does not hold. {beyond}"
    where = diagnosis.where
    first = diagnosis.candidates[0].place if diagnosis.candidates else "the model"
    place = where.place if where else first
    left = np.sqrt(1.0 + excess(final))
    guess = f" Best guess: {' '.join(told)}" if told else ""
    start = np.sqrt(1.0 + excess(base))
    return (
        f"Something is missing that no law of the library explains, most likely at {place}: the "
        f"misfit is {left:.2g} times the noise ({start:.2g} times before)."
        f"{all_else(where)}{stand_ins(diagnosis)}{guess}"
    )


def why_of(diagnosis: Diagnosis) -> list[str]:
    """The evidence in a few sentences [-]."""
    base, final = diagnosis.base, diagnosis.final
    noise = noise_json(final)
    count = len(diagnosis.accepted)
    with_laws = f"; with {_counted(count)} {1.0 + excess(final):.3g} times" if count else ""
    said = [
        f"Noise law chosen first: {NOISE_WORDS.get(noise['law'], noise['law'])}. Without any law "
        f"the residual has {1.0 + excess(base):.3g} times its power{with_laws}."
    ]
    if diagnosis.accepted:
        share = explained(base, final)
        who = "The law explains" if count == 1 else f"The {count} laws explain"
        said.append(f"{who} {100 * share:.1f} % of the misfit beyond the noise.")
        first = diagnosis.accepted[0]
        said.append(
            f"{first.candidate.name} was first of {len(diagnosis.candidates)} tried: BIC falls by "
            f"{first.delta_bic:.0f} on {effective_samples(first.fit):.0f} independent samples."
        )
    said += where_words(diagnosis.where)
    said += [
        f"Of {one.contest.sets} sets made with {diagnosis.accepted[-1].candidate.name} "
        f"{100 * one.contest.first:.0f} % speak for {one.candidate.name} as much as the records do "
        f"or more; of as many made with that, {100 * one.contest.second:.0f} % speak against it so."
        for one in diagnosis.rivals
        if one.contest
    ]
    said += [words for words in (form_words(final), beyond_words(final)) if words]
    for trial in diagnosis.trials:
        if trial.verdict.startswith("refused"):
            said.append(f"{trial.candidate.name} {trial.verdict}.")
    return said[:6]


def _counted(count: int) -> str:
    return "one law" if count == 1 else f"{count} laws"


def next_of(diagnosis: Diagnosis) -> str:
    """What to do next, in words."""
    if diagnosis.status == "adequate":
        return "Use the constants. To look for weaker effects, record at another amplitude."
    if diagnosis.status == "ambiguous":
        return "Record the same test at clearly smaller and larger amplitude: there the laws part."
    if diagnosis.where and diagnosis.where.kind == "channel":
        return (
            f"Check {diagnosis.where.place}: mount, zero, range, cable; read its place by "
            "a second sensor."
        )
    pulled = strained(diagnosis.final)
    if diagnosis.status == "unknown" and pulled and excess(diagnosis.final) < SMALL_EXCESS:
        return (
            f"Measure {pulled[0][0]} again, with all that is mounted there, or state it with a "
            "tolerance that holds it."
        )
    if diagnosis.status == "unknown":
        return (
            "Add a sensor next to the place, or a test that moves it alone; look at the residual "
            "against displacement and velocity below."
        )
    cures = [trial.law.cure for trial in diagnosis.accepted]
    return " ".join(dict.fromkeys(cures))


def noise_json(fit: Fit) -> dict[str, Any]:
    """The most common noise law over the channels with median numbers [-]."""
    laws = [noise.law for noise in fit.problem.floor.values()]
    law = max(sorted(set(laws)), key=laws.count) if laws else "white"
    chosen = [noise for noise in fit.problem.floor.values() if noise.law == law]
    numbers: dict[str, float] = {}
    if chosen:
        numbers["std"] = float(np.median([noise.marginal_std for noise in chosen]))
        names = {"white": (), "ar1": ("rho",), "ar2": ("phi_1", "phi_2")}[law]
        for index, name in enumerate(names):
            numbers[name] = float(np.median([noise.coefficients[index] for noise in chosen]))
    channels = {
        f"{record}:{channel}": {"law": n.law, "std": n.marginal_std, "phi": list(n.coefficients)}
        for (record, channel), n in fit.problem.floor.items()
    }
    return {"law": law, "parameters": numbers, "channels": channels}


def gain_json(before: HeldOut | None, after: HeldOut | None, split: str) -> dict[str, Any]:
    """The gain on held-out records: errors over the size of what was measured [-]."""
    if before is None or after is None:
        return {"records": [], "how": split}
    floor = min(before.noise_floor, after.noise_floor)
    reach = before.nrmse**2 - floor**2
    share = (before.nrmse**2 - after.nrmse**2) / reach if reach > 0 else 0.0
    errors = {
        f"{record}:{channel}": {
            "rms_before": before.errors[record, channel],
            "rms_after": after.errors[record, channel],
            "mean_before": before.mean_errors[record, channel],
            "mean_after": after.mean_errors[record, channel],
        }
        for record, channel in before.errors
    }
    return {
        "records": sorted({record for record, _ in before.errors}),
        "nrmse_before": before.nrmse,
        "nrmse_after": after.nrmse,
        "noise_floor": floor,
        "explained": float(np.clip(share, -1.0, 1.0)),
        "errors": errors,
        "how": split,
    }


def parameters_json(before: Fit, after: Fit) -> dict[str, Any]:
    """The rig's constants before and after, each in its SI unit."""
    told = identifiability(after)
    found = {}
    for i, entry in enumerate(after.model.entries):
        if entry.nuisance or entry.slot != "numbers":
            continue
        value, std = after.value(i), stated_std(after, i)
        found[entry.label] = {
            "before": before.value(before.index(entry.label)),
            "after": value,
            "std": std,
            "low": value - NORMAL_95 * std,
            "high": value + NORMAL_95 * std,
            "unit": entry.unit,
            **told[entry.label],
        }
    return found


def nuisances_json(fit: Fit) -> dict[str, Any]:
    """Offsets, tolerances and drives' zeros of a fit [SI]; start states are left out.

    A number that nothing was known of before, as a phase, has no tolerance.
    """
    found = {}
    for i, entry in enumerate(fit.model.entries):
        if entry.nuisance and entry.slot != "start":
            found[entry.label] = {
                "value": fit.value(i) - entry.center,
                "std": fit.std(i),
                "unit": entry.unit,
                "tolerance": entry.prior if np.isfinite(entry.prior) else None,
            }
    return found


def candidates_json(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Every law tried in the first screen, the refitted ones with their evidence [-]."""
    chances = probabilities(diagnosis)
    best: dict[str, Trial] = {}
    for trial in diagnosis.trials:
        best.setdefault(trial.candidate.name, trial)
    found = []
    for candidate in diagnosis.candidates:
        trial = best.get(candidate.name)
        found.append(
            {
                "law": candidate.law.name,
                "place": candidate.place,
                "probability": chances.get(candidate.name, 0.0),
                "delta_bic": trial.delta_bic if trial else _promise(candidate),
                "refitted": trial is not None,
                "score_p_value": max(candidate.p_value, 1e-300),
                "verdict": trial.verdict if trial else "not refitted",
            }
        )
    return sorted(found, key=lambda one: -one["delta_bic"])


def _promise(candidate: Candidate) -> float:
    """What one linear step promises of BIC for a law that was not refitted [-]."""
    return candidate.gain - float(np.log(max(len(candidate.column), 2)))


def history_json(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """The greedy steps: misfit in noise units squared and evidence [-]."""
    rows = []
    for index, fit in enumerate(diagnosis.stages):
        trial = diagnosis.accepted[index - 1] if index else None
        rows.append(
            {
                "law": trial.law.name if trial else "",
                "place": trial.candidate.place if trial else "",
                "reduced_chi2": 1.0 + excess(fit),
                "bic": fit.cost + len(fit.x) * float(np.log(max(fit.count, 2))),
                "delta_bic": trial.delta_bic if trial else 0.0,
            }
        )
    return rows


def diagnosis_json(diagnosis: Diagnosis, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """The whole contract's ``diagnosis.json``; numbers in the SI units that stand beside them."""
    base, final = diagnosis.base, diagnosis.final
    chances = probabilities(diagnosis)
    causes = [cause_json(t, final, chances.get(t.candidate.name, 0.0)) for t in diagnosis.accepted]
    for rival in diagnosis.rivals:
        causes.append(cause_json(rival, rival.fit, chances[rival.candidate.name]))
    rig = final.problem.rig
    channels = {c.name: c.place for p in final.problem.records for c in p.record.channels}
    held = diagnosis.held_before.fit.problem.records if diagnosis.held_before else ()
    rows = [(p, "train") for p in final.problem.records] + [(p, "held_out") for p in held]
    return {
        "status": diagnosis.status,
        "cannot_tell": list(diagnosis.cannot_tell),
        "sentence": sentence_of(diagnosis),
        "why": why_of(diagnosis),
        "what_next": next_of(diagnosis),
        "causes": causes if diagnosis.status in ("named", "ambiguous") else [],
        "best_guess": causes if diagnosis.status == "unknown" else [],
        "candidates": candidates_json(diagnosis),
        "confusable": [
            {"a": first, "b": second, "alikeness": alike}
            for first, second, alike in diagnosis.confusable
        ],
        "misfit": {
            "before": {"reduced_chi2": 1.0 + excess(base), "whiteness_p": diagnosis.whiteness[0]},
            "after": {"reduced_chi2": 1.0 + excess(final), "whiteness_p": diagnosis.whiteness[1]},
        },
        "noise": noise_json(final),
        "gain": gain_json(diagnosis.held_before, diagnosis.held_after, diagnosis.split),
        "parameters": parameters_json(base, final),
        "nuisances": nuisances_json(final),
        "allowed": allowed_json(final),
        "decision": {"best_before": {}, "best_after": {}, "loss_if_ignored": {}},
        "history": history_json(diagnosis),
        **where_json(diagnosis),
        "records": [
            {
                "name": p.name,
                "split": split,
                "test": p.record.test,
                "n_samples": p.count,
                "sample_rate": 1.0 / p.step,
                "window": p.reason,
                "warnings": list(p.record.warnings),
            }
            for p, split in rows
        ],
        "rig": {
            "kind": rig.kind,
            "motion": rig.motion,
            "masses": list(rig.masses),
            "links": {name: list(ends) for name, ends in rig.links.items()},
            "channels": channels,
        },
        "provenance": dict(provenance),
    }
