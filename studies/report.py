"""One self-contained page for a diagnosis or a fit: what, where, why, how sure, what it gains."""

import math
import os
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from . import figures
from .sections import constant_rows, diagnosis_sections, fit_sections
from .sketch import sketch
from .words import cause_words, chance_words, number_words, pair_words, unit_words

if TYPE_CHECKING:
    from ..identification.views import RecordView

_CHIPS = {
    "adequate": "Model adequate",
    "named": "Cause named",
    "ambiguous": "Causes not separated",
    "unknown": "Cause unknown",
    "refused": "No verdict",
}
_SURE = {
    "adequate": "The misfit is explained by the noise; no law earns a place in the model.",
    "unknown": "No law that was tried explains the misfit well enough to be named.",
    "refused": "These records do not allow a verdict.",
}
_NEXT = {
    "adequate": "Use the fitted constants. Measure a larger amplitude to test the model harder.",
    "named": "Use the extended rig that was written beside this page.",
    "ambiguous": "Make a test that separates the causes left, then diagnose again.",
    "unknown": "Look at the shape of the misfit below; do not trust the model where it is large.",
    "refused": "Mend what the sentence above names, and run it again.",
}


def write_report(diagnosis: Mapping[str, Any], views: Sequence["RecordView"], path: Path) -> Path:
    """Write the page of a diagnosis: one screen with the verdict, and the figures below it.

    Args:
        diagnosis: what ``diagnosis.json`` holds. Also understood: ``title``, ``what_next``,
            ``why``, ``records``, ``history``, ``where``, ``missing_force``, ``misreading``,
            ``nuisances``, and ``rig``
            (``kind``, ``motion``, ``masses``, ``links``, ``channels``), from which the sketch
            is drawn.
        views: channels of the records, measured and simulated; may be empty.
        path: file to write; its folder exists. An earlier file stays whole until the new one is.

    Returns:
        The path.
    """
    status = str(diagnosis.get("status", "refused"))
    causes = [_cause(cause) for cause in diagnosis.get("causes") or []]
    places = [str(cause["place"]) for cause in diagnosis.get("causes") or []]
    where = diagnosis.get("where") or diagnosis.get("missing_force") or {}
    if where and not places:
        places = [str(where["place"])]
    context = {
        "title": diagnosis.get("title") or "What the simulation gets wrong",
        "status": status,
        "chip": _CHIPS.get(status, status),
        "sentence": diagnosis.get("sentence", ""),
        "dense": len(str(diagnosis.get("sentence"))) > 170
        or len(causes) > 2
        or sum(map(len, diagnosis.get("why") or [])) > 500,
        "places": places,
        "sketch": Markup(sketch(_rig(diagnosis), places)),
        "shape": _shape(diagnosis),
        "causes": causes,
        "sure": _sure(status, diagnosis),
        "misfit": _misfit(diagnosis.get("misfit") or {}),
        "why": [*(diagnosis.get("why") or ["No evidence was recorded."])],
        "gain": _gain(diagnosis.get("gain") or {}),
        "no_gain": _no_gain(status, diagnosis),
        "what_next": diagnosis.get("what_next") or _NEXT.get(status, ""),
        "sections": diagnosis_sections(diagnosis, views),
        "version": (diagnosis.get("provenance") or {}).get("version", ""),
    }
    return _write("diagnosis.html", context, path)


def write_fit_report(
    fit: Mapping[str, Any],
    views: Sequence["RecordView"],
    path: Path,
    posterior: Mapping[str, Any] | None = None,
) -> Path:
    """Write the page of a fit: constants with error bars, what can be told of them, the misfit.

    Args:
        fit: what ``fit.json`` holds, and ``title`` and ``sentence`` if there are any.
        views: channels of the records, measured and simulated; may be empty.
        path: file to write; its folder exists. An earlier file stays whole until the new one is.
        posterior: its section, and in ``opening`` what the first screen says; None without one.

    Returns:
        The path.
    """
    from ..identification.fit import CONVERGED

    constants = constant_rows(fit.get("parameters") or {})
    status = str(fit.get("status", ""))
    n_told = sum(row["identifiable"] == "yes" for row in constants)
    told = f"These records tell {n_told} of {len(constants)} constants."
    trusted = status in ("", "converged", CONVERGED)
    trusted = trusted and (posterior is None or bool(fit["posterior"]["converged"]))
    sections = [*([] if posterior is None else [posterior]), *fit_sections(fit, views)]
    context = {
        "title": fit.get("title") or "Constants with error bars",
        "status": "adequate" if trusted and n_told == len(constants) else "ambiguous",
        "chip": "Fitted" if trusted else "Not converged",
        "sentence": told,
        "dense": len(constants) > 12,
        "constants": constants,
        "words": fit.get("sentence") or "",
        "posterior": "" if posterior is None else posterior["opening"],
        "misfit": _misfit(fit.get("misfit") or {}),
        "sections": sections,
        "version": (fit.get("provenance") or {}).get("version", ""),
    }
    return _write("fit.html", context, path)


def write_page(page: Mapping[str, Any], path: Path) -> Path:
    """Write a page made of sections alone.

    Args:
        page: ``title``, ``status`` (its color), ``chip``, ``sentence``, ``sections`` and
            ``version``; each section with ``title``, ``words``, ``figures`` and ``rows``.
        path: file to write; its folder exists. An earlier file stays whole until the new one is.

    Returns:
        The path.
    """
    return _write("page.html", {"dense": len(page["sentence"]) > 170, **page}, path)


def _write(template: str, context: Mapping[str, Any], path: Path) -> Path:
    """Fill a template, write it beside the target, and rename."""
    environment = Environment(
        loader=FunctionLoader(_source), autoescape=True, undefined=StrictUndefined
    )
    page = environment.get_template(template).render(context)
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_text(page, encoding="utf-8")
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
    return path


def _source(name: str) -> str:
    return files("supple.studies").joinpath(name).read_text(encoding="utf-8")


def _cause(cause: Mapping[str, Any]) -> dict[str, Any]:
    """One accepted cause in words."""
    sizes = []
    for name, size in (cause.get("parameters") or {}).items():
        unit = "" if size.get("unit") in (None, "1") else f" {unit_words(size['unit'])}"
        value = pair_words(size.get("value"), size.get("std"))
        sizes.append(f"{name.replace('_', ' ')} {value}{unit}")
    return {
        "words": cause_words(cause["law"], cause["place"]),
        "chance": chance_words(cause.get("probability")),
        "p_value": _p_words(cause.get("score_p_value")),
        "delta_bic": number_words(cause.get("delta_bic"), 3),
        "sizes": sizes,
    }


def _p_words(value: Any) -> str:
    if not isinstance(value, int | float) or math.isnan(value):
        return "–"
    return "< 10⁻³⁰⁰" if value < 1e-300 else number_words(value, 2)


def _sure(status: str, diagnosis: Mapping[str, Any]) -> str:
    if status in _SURE:
        return _SURE[status]
    n_tried = len(diagnosis.get("candidates") or [])
    tried = f"{n_tried} candidates were tried. " if n_tried else ""
    if status == "ambiguous":
        return tried + "The causes named look so alike in these records that any may be the one."
    return tried + "ΔBIC: fall of the misfit less the price of the added constants; 10 is strong."


def _misfit(misfit: Mapping[str, Any]) -> str:
    """The absolute misfit in a sentence, from one fit or from two."""
    before, after = misfit.get("before"), misfit.get("after")
    if not isinstance(before, Mapping):
        before, after = misfit, None
    first = number_words(before.get("reduced_chi2"), 3)
    if first == "–":
        return ""
    if isinstance(after, Mapping) and after.get("reduced_chi2") != before.get("reduced_chi2"):
        last = number_words(after.get("reduced_chi2"), 3)
        return f"Misfit over noise (1 is perfect): {first} before, {last} after."
    white = before.get("whiteness_p")
    words = f"Misfit over noise (1 is perfect): {first}"
    return words + (f"; whiteness p {_equal(white)}." if white is not None else ".")


def _equal(value: Any) -> str:
    words = _p_words(value)
    return words if words.startswith("<") else f"= {words}"


def _gain(gain: Mapping[str, Any]) -> dict[str, Any] | None:
    """Bars for the error on held-out records, or None where there is none."""
    before, after = gain.get("nrmse_before"), gain.get("nrmse_after")
    if not isinstance(before, int | float) or not isinstance(after, int | float):
        return None
    reach = max(before, after, 1e-300)
    floor = gain.get("noise_floor")
    bars = [
        {
            "name": name,
            "width": round(100.0 * min(value / reach, 1.0), 2),
            "color": color,
            "value": f"{number_words(100.0 * value, 3)} %",
        }
        for name, value, color in (
            ("before", before, figures.BEFORE),
            ("after", after, figures.AFTER),
        )
    ]
    names = ", ".join(str(name) for name in gain.get("records") or [])
    words = f"Error as a share of the signal, on {names or 'the records held out'}."
    if isinstance(floor, int | float):
        words += f" Green line: the noise, {number_words(100.0 * floor, 3)} %."
    explained = gain.get("explained")
    if isinstance(explained, int | float) and math.isfinite(explained):
        words += f" Explained of the excess: {number_words(100.0 * explained, 3)} %."
    at = round(100.0 * min(floor / reach, 0.995), 2) if isinstance(floor, int | float) else None
    return {"bars": bars, "words": words, "floor_at": at}


def _no_gain(status: str, diagnosis: Mapping[str, Any]) -> str:
    if any(r.get("split") == "held_out" for r in diagnosis.get("records") or []):
        return "Nothing was added to the model, so there is nothing to gain."
    if status in ("named", "ambiguous"):
        return "No record was held out, so the gain is not proven: add --held-out RECORD."
    return "No record was held out."


_AGAINST = {"reading": "what it should read", "rate": "how fast that changes", "time": "time"}


def _shape(diagnosis: Mapping[str, Any]) -> str:
    missing, error = diagnosis.get("missing_force"), diagnosis.get("misreading")
    if error:
        return (
            f"The error of {error['place']} is drawn below, against {_AGAINST[error['against']]}."
        )
    if not missing:
        return ""
    return f"The missing force is drawn below, against {missing['against']}."


def _rig(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """The rig as given, or guessed from the names of its parameters."""
    given = diagnosis.get("rig")
    if isinstance(given, Mapping):
        return dict(given)
    names = [name.split(".") for name in diagnosis.get("parameters") or {}]
    masses = list(dict.fromkeys(n[1] for n in names if n[0] == "masses" and len(n) == 3))
    links = list(dict.fromkeys(n[1] for n in names if n[0] == "links" and len(n) == 3))
    if not masses and not links:
        return {"kind": "robot"}
    masses = masses or ["mass"]
    ends = ["ground", *masses]
    between = {
        name: (ends[min(i, len(ends) - 2)], ends[min(i, len(ends) - 2) + 1])
        for i, name in enumerate(links)
    }
    return {"kind": "chain", "masses": masses, "links": between}
