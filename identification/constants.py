"""The constants of a fit in the contract's JSON and in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .clamped import clamped_json
from .evidence import excess
from .fit import Fit
from .form import form_error, stated_std
from .identifiable import identifiability
from .noise import ljung_box
from .problem import Key
from .uneven import Uneven
from .verdict import NORMAL_95, amount, noise_json, nuisances_json


def fit_json(fit: Fit, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """The contract's ``fit.json``; numbers in the SI units that stand beside them.

    Args:
        fit: with errors attached.
        provenance: version, inputs, seed, seconds [s].

    Returns:
        Tables and numbers that JSON can hold.
    """
    told = identifiability(fit)
    parameters = {}
    for i, entry in enumerate(fit.model.entries):
        if entry.nuisance or entry.slot not in ("numbers", "strengths"):
            continue
        value, std = fit.value(i), stated_std(fit, i)
        form = form_error(fit, entry.name, value)
        parameters[entry.label] = {
            "value": value,
            "std": std,
            "low": max(value - NORMAL_95 * std, entry.low),
            "high": min(value + NORMAL_95 * std, entry.high),
            "unit": entry.unit,
            **({"form": form} if form else {}),
            **told[entry.label],
        }
    laws = {**fit.problem.floor, **_uneven(fit)}
    white = [ljung_box(laws[k].whiten(fit.residual_of(k))) for k in fit.keys]
    return {
        "status": fit.status,
        "sentence": _sentence(fit),
        "parameters": parameters,
        "noise": _noise(fit),
        "misfit": {"reduced_chi2": 1.0 + excess(fit), "whiteness_p": float(min(white))},
        "channels": {
            f"{record}:{channel}": {
                "rms": float(np.std(fit.residual_of((record, channel)))),
                "ratio": misfit.ratio,
                "p_value": misfit.p_value,
            }
            for (record, channel), misfit in fit.misfits.items()
        },
        "nuisances": nuisances_json(fit),
        "clamped": clamped_json(fit),
        "records": [
            {
                "name": p.name,
                "split": "train",
                "test": p.record.test,
                "n_samples": p.count,
                "sample_rate": 1.0 / p.step,
                "window": p.reason,
            }
            for p in fit.problem.records
        ],
        "provenance": dict(provenance),
    }


def _uneven(fit: Fit) -> dict[Key, Uneven]:
    return {key: noise for key, noise in fit.model.noises.items() if isinstance(noise, Uneven)}


def _noise(fit: Fit) -> dict[str, Any]:
    """As a diagnosis tells the noise, and the laws under which samples are not equally sure."""
    told, uneven = noise_json(fit), _uneven(fit)
    if not uneven:
        return told
    rows: dict[str, dict[str, Any]] = told["channels"]
    for (record, channel), noise in uneven.items():
        row = {"law": noise.law, "std": noise.marginal_std, "phi": list(noise.coefficients)}
        row |= {"growth": noise.growth} if noise.growth else {}
        row |= {"freedom": 1.0 / noise.tail} if noise.tail else {}
        rows[f"{record}:{channel}"] = row
    laws = [row["law"] for row in rows.values()]
    law = max(sorted(set(laws)), key=laws.count)
    chosen = [row for row in rows.values() if row["law"] == law]
    numbers = {
        name: float(np.median([row[name] for row in chosen]))
        for name in ("std", "growth", "freedom")
        if name in chosen[0]
    }
    phi = np.median([row["phi"] for row in chosen], axis=0)
    names = ("rho",) if len(phi) == 1 else ("phi_1", "phi_2")
    numbers |= {name: float(value) for name, value in zip(names, phi, strict=False)}
    return {"law": law, "parameters": numbers, "channels": rows}


def _sentence(fit: Fit) -> str:
    told = identifiability(fit)
    entries = [
        (i, e)
        for i, e in enumerate(fit.model.entries)
        if not e.nuisance and e.slot in ("numbers", "strengths")
    ]
    said = ", ".join(
        f"{e.label} {amount(fit.value(i), stated_std(fit, i), e.unit)}" for i, e in entries[:4]
    )
    doubts = [
        f"{label} {one['note']}" for label, one in told.items() if one["identifiable"] != "yes"
    ]
    left = excess(fit)
    tail = f" In doubt: {'; '.join(doubts)}." if doubts else ""
    if left > 0.3:
        tail += (
            f" The misfit has {1 + left:.3g} times the noise's power: something is missing; "
            "`supple diagnose` asks what."
        )
    return f"{said}.{tail}"
