"""What a record was allowed to leave open, told, and what of it went beyond its tolerance."""

from __future__ import annotations

from typing import Any

from .allowance import FEW, MANY, Used
from .fit import Fit

MEANINGS = {
    "drive": "errors of the told motion, a number every few milliseconds",
    "delay": "the told motion's clock",
    "lever": "where on the clubhead the sensor sits",
    "ringing": "the club's next mode, rung by a release or a blow",
}


def allowed_json(fit: Fit) -> list[dict[str, Any]]:
    """Every kind of numbers that each record left open, in units of their priors [-]."""
    return [
        {
            "record": one.record,
            "what": MEANINGS[one.kind],
            "kind": one.kind,
            "count": one.count,
            "rms": one.rms,
            "largest": one.largest,
            "beyond_tolerance": one.beyond,
        }
        for one in fit.used
    ]


def beyond_words(fit: Fit) -> str:
    """A sentence on what went beyond its tolerance [-]; empty where nothing did."""
    told = [_words(one) for one in fit.used if one.beyond]
    return f"Beyond its tolerance: {'; '.join(told)}." if told else ""


def _words(one: Used) -> str:
    if one.count > 50:
        return (
            f"{MEANINGS[one.kind]} in {one.record}, {one.rms:.1f} times what its noise and "
            f"rounding allow (limit {MANY:g})"
        )
    return f"{MEANINGS[one.kind]} in {one.record}, {one.largest:.1f} times its (limit {FEW:g})"
