"""What stands below the first screen of a report: figures with captions, and tables."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from . import figures
from .words import cause_words, law_words, number_words, pair_words, unit_words

if TYPE_CHECKING:
    from ..identification.views import RecordView

_MOST_RECORDS = 6

NOISE_WORDS = {
    "ar1": "AR(1)",
    "ar2": "AR(2)",
    "growing": "growing with the motion",
    "student_t": "heavy-tailed (Student's t)",
}

_TOLD = {
    "yes": "well determined",
    "one_sided": "only bounded from one side",
    "flat": "not seen by these records",
    "coupled": "only together with",
}


def diagnosis_sections(
    diagnosis: Mapping[str, Any], views: Sequence["RecordView"]
) -> list[dict[str, Any]]:
    """Sections below the verdict of a diagnosis.

    Args:
        diagnosis: what ``diagnosis.json`` holds.
        views: channels of the records.

    Returns:
        Sections with ``title``, ``words``, ``figures``, ``head``, ``rows`` and ``left`` (how
        many columns are text); those with nothing to show are left out.
    """
    train = [view for view in views if view.split != "held_out"]
    held_out = [view for view in views if view.split == "held_out"]
    causes = diagnosis.get("causes") or []
    made = [
        _missing_force(diagnosis.get("missing_force")),
        _misreading(diagnosis.get("misreading")),
        _records("Measured against simulated", train),
        _structure(train or held_out),
        _backbones([*train, *held_out]),
        _evidence(diagnosis.get("candidates") or [], causes),
        _history(diagnosis.get("history") or []),
        _held_out(held_out),
        _constants(diagnosis),
        _nuisances(diagnosis.get("nuisances") or {}),
        _confusable(diagnosis),
        _decision(diagnosis),
        _noise(diagnosis.get("noise") or {}),
        _provenance(diagnosis),
    ]
    return [section for section in made if section is not None]


def fit_sections(fit: Mapping[str, Any], views: Sequence["RecordView"]) -> list[dict[str, Any]]:
    """Sections below the constants of a fit.

    Args:
        fit: what ``fit.json`` holds.
        views: channels of the records.

    Returns:
        Sections in the shape of those of a diagnosis.
    """
    made = [
        _records("Measured against simulated", views),
        _structure(views),
        _backbones(views),
        _clamped(fit.get("clamped") or {}),
        _nuisances(fit.get("nuisances") or {}),
        _noise(fit.get("noise") or {}),
        _provenance(fit),
    ]
    return [section for section in made if section is not None]


def constant_rows(parameters: Mapping[str, Mapping[str, Any]]) -> list[dict[str, str]]:
    """Rows of the table of constants of a fit.

    Args:
        parameters: name to ``value``, ``std``, ``low``, ``high``, ``unit`` and ``identifiable``;
            a coupled one carries the partner's name as ``partner``.

    Returns:
        One row of words a constant.
    """
    rows = []
    for name, one in parameters.items():
        told = str(one.get("identifiable", "yes"))
        words = _TOLD.get(told, told)
        partner = one.get("partner") or one.get("with")
        if told == "coupled":
            words = f"{words} {partner}" if partner else "only together with another constant"
        row = {"name": name, "words": words, "identifiable": told}
        row["value"] = pair_words(one.get("value"), one.get("std"))
        row["interval"] = f"{number_words(one.get('low'))} to {number_words(one.get('high'))}"
        row["unit"] = unit_words(str(one.get("unit", "")))
        rows.append(row)
    return rows


def _section(
    title: str,
    *words: str,
    drawn: Sequence[dict[str, Any]] = (),
    head: Sequence[str] = (),
    rows: Sequence[Sequence[str]] = (),
    left: int = 1,
) -> dict[str, Any]:
    return {
        "title": title,
        "words": [line for line in words if line],
        "figures": list(drawn),
        "head": list(head),
        "rows": [list(row) for row in rows],
        "left": left,
    }


def _drawn(figure: Figure, title: str, caption: str, narrow: bool = False) -> dict[str, Any]:
    alt = f"Figure: {title}. {caption}"
    image = figures.data_uri(figure)
    return {"image": image, "title": title, "caption": caption, "alt": alt, "narrow": narrow}


def _is_extended(views: Sequence["RecordView"]) -> bool:
    return any((view.after != view.before).any() for view in views)


def _record_figures(views: Sequence["RecordView"]) -> tuple[list[dict[str, Any]], str]:
    drawn = []
    for view in views[:_MOST_RECORDS]:
        see = (
            "The blue line (after) should lie on the points where the dashed one (before) leaves "
            "them, and its residual should be a band without shape"
            if _is_extended([view])
            else "The dashed line should lie on the points, and the residual be without shape"
        )
        caption = f"Channel {view.channel} ({view.quantity.replace('_', ' ')}). {see}."
        drawn.append(_drawn(figures.record_figure(view), f"Record {view.record}", caption))
    left = len(views) - len(drawn)
    return drawn, f"{left} more channels are not drawn." if left > 0 else ""


def _records(title: str, views: Sequence["RecordView"]) -> dict[str, Any] | None:
    if not views:
        return None
    drawn, words = _record_figures(views)
    return _section(title, words, drawn=drawn)


def _structure(views: Sequence["RecordView"]) -> dict[str, Any] | None:
    figure = figures.structure_figure(views)
    if figure is None:
        return None
    caption = (
        "What the model misses, in units of the noise. Gray: all samples. Lines: their root mean "
        "square against time, else their mean with twice its error. Dotted: one standard "
        "deviation of the noise. A mean that is flat at zero is noise; a step against velocity is "
        "friction, a curve against displacement a spring. "
        "Each row has its own scale."
    )
    return _section(
        "Where the misfit lives", drawn=[_drawn(figure, "Residual by what it hangs on", caption)]
    )


def _backbones(views: Sequence["RecordView"]) -> dict[str, Any] | None:
    figure = figures.backbone_figure(views)
    if figure is None:
        return None
    caption = (
        "Read off the peaks of the decays. A linear rig has two level lines. Frequency that "
        "falls with amplitude is softening; damping that grows as the swing dies is dry friction."
    )
    return _section("Backbone", drawn=[_drawn(figure, "Frequency and damping", caption)])


def _evidence(
    candidates: Sequence[Mapping[str, Any]], causes: Sequence[Mapping[str, Any]]
) -> dict[str, Any] | None:
    figure = figures.evidence_figure(candidates, causes)
    if figure is None:
        return None
    caption = "Blue: accepted. Gray: not needed, or not enough. Bars left of zero cost more "
    caption += "constants than they explain."
    return _section("Evidence", drawn=[_drawn(figure, "All candidates", caption)])


def _history(history: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    if not history:
        return None
    rows = [
        [
            cause_words(step["law"], step.get("place") or "")
            if step.get("law")
            else "fitted model",
            number_words(step.get("reduced_chi2"), 4),
            number_words(step.get("delta_bic"), 4),
        ]
        for step in history
    ]
    head = ["step", "misfit over noise", "ΔBIC"]
    return _section("One law at a time", head=head, rows=rows)


def _held_out(views: Sequence["RecordView"]) -> dict[str, Any] | None:
    figure = figures.held_out_figure(views)
    if figure is None:
        return None
    caption = "Error of the simulation on records that no fit has seen. Green: the noise."
    drawn, words = _record_figures(views)
    first = _drawn(figure, "Before and after", caption)
    return _section("Records held out", words, drawn=[first, *drawn])


def _constants(diagnosis: Mapping[str, Any]) -> dict[str, Any] | None:
    rows = []
    for name, one in (diagnosis.get("parameters") or {}).items():
        before, after = one.get("before"), one.get("after")
        change = "–"
        if isinstance(before, int | float) and isinstance(after, int | float) and before:
            change = f"{number_words(100.0 * (after / before - 1.0), 2)} %"
            change = change if after < before else f"+{change}"
        unit = unit_words(str(one.get("unit", "")))
        rows.append([name, unit, number_words(before), pair_words(after, one.get("std")), change])
    for cause in diagnosis.get("causes") or []:
        for name, one in (cause.get("parameters") or {}).items():
            label = f"{name} of {law_words(cause['law'])} at {cause['place']}"
            value = pair_words(one.get("value"), one.get("std"))
            rows.append([label, unit_words(str(one.get("unit", ""))), "none", value, "added"])
    if not rows:
        return None
    head = ["constant", "unit", "before", "after", "change"]
    return _section("Constants", head=head, rows=rows, left=2)


def _nuisances(nuisances: Mapping[str, Mapping[str, Any]]) -> dict[str, Any] | None:
    if not nuisances:
        return None
    rows = []
    for name, one in nuisances.items():
        known = one.get("tolerance", one.get("prior_std"))
        value = pair_words(one.get("value"), one.get("std"))
        rows.append([name, unit_words(str(one.get("unit", ""))), value, number_words(known, 2)])
    words = "What had to be estimated with the constants, and how well it was known before."
    head = ["nuisance", "unit", "estimate", "tolerance"]
    return _section("Nuisances", words, head=head, rows=rows, left=2)


def _clamped(told: Mapping[str, Mapping[str, Any]]) -> dict[str, Any] | None:
    if not told:
        return None
    from ..identification.clamped import clamped_words

    rows = [
        [
            bench.replace("_", " "),
            name.replace("_", " "),
            unit_words(one["unit"]),
            pair_words(one["value"], one["std"]),
        ]
        for bench, table in told.items()
        for name, one in table.items()
    ]
    head = ["bench", "first mode and pull at the head", "unit", "estimate"]
    return _section("The club on a bench", *clamped_words(told), head=head, rows=rows, left=3)


def _confusable(diagnosis: Mapping[str, Any]) -> dict[str, Any] | None:
    pairs = diagnosis.get("confusable") or []
    blind = diagnosis.get("cannot_tell") or []
    if not pairs and not blind:
        return None
    words = (
        f"Not visible in these records, whatever the truth: {', '.join(blind)}." if blind else ""
    )
    rows = [[pair["a"], pair["b"], number_words(pair.get("alikeness"), 3)] for pair in pairs]
    head = ["cause", "looks like", "alikeness (1: the same)"]
    return _section("What these records cannot separate", words, head=head, rows=rows, left=2)


def _decision(diagnosis: Mapping[str, Any]) -> dict[str, Any] | None:
    decision = diagnosis.get("decision") or {}
    before, after = decision.get("best_before") or {}, decision.get("best_after") or {}
    names = list(dict.fromkeys([*before, *after]))
    if not names:
        return None
    how = decision.get("how") or {}
    score = how.get("score") or {}
    units = {name: one.get("unit", "") for name, one in (diagnosis.get("parameters") or {}).items()}
    units |= dict.fromkeys((key for key in score if key in names), score.get("unit", ""))
    rows = [
        [
            name,
            unit_words(str(units.get(name, ""))),
            number_words(before.get(name)),
            number_words(after.get(name)),
        ]
        for name in names
    ]
    losses = [
        f"The design that the model chose before is {number_words(100.0 * loss, 2)} % worse in "
        f"{name} than the best one, both judged by the model after."
        for name, loss in (decision.get("loss_if_ignored") or {}).items()
        if isinstance(loss, int | float)
    ]
    head = ["best design", "unit", "before", "after"]
    return _section("What it changes", *losses, _how_words(how), head=head, rows=rows, left=2)


def _how_words(how: Mapping[str, Any]) -> str:
    """How the designs were compared, in words."""
    score, drive, grid = (how.get(key) or {} for key in ("score", "drive", "grid"))
    if not (score and drive and grid):
        return ""
    sides = [axis["count"] for axis in grid.values() if isinstance(axis, Mapping)]
    window = " to ".join(number_words(time) for time in score.get("window", ()))
    return (
        f"{' × '.join(map(str, sides))} designs, each simulated under one {drive['kind']} at the "
        f"{drive['place']} of {number_words(drive.get('force'))} N for "
        f"{number_words(1e3 * drive['duration'])} ms; rms of {score.get('rms', '')} over "
        f"{window} s."
    )


def _missing_force(missing: Mapping[str, Any] | None) -> dict[str, Any] | None:
    if not missing or not len(missing.get("x") or ()):
        return None
    caption = "The force that the model lacks and no law that was tried supplies."
    figure = figures.force_figure(missing)
    drawn = [_drawn(figure, "Shape of the missing force", caption, narrow=True)]
    return _section("The missing force", drawn=drawn)


def _misreading(error: Mapping[str, Any] | None) -> dict[str, Any] | None:
    if not error or not len(error.get("x") or ()):
        return None
    channel = error["place"]
    caption = f"What {channel} reads in {error['record']} beyond what all others say it should."
    drawn = []
    for curve in error["curves"]:
        figure = figures.error_figure({**curve, "place": channel})
        drawn.append(_drawn(figure, f"Error of {channel} against {curve['against']}", caption))
    return _section("What the channel adds", drawn=drawn)


def _noise(noise: Mapping[str, Any]) -> dict[str, Any] | None:
    if not noise:
        return None
    law = " and ".join(NOISE_WORDS.get(one, one) for one in str(noise.get("law")).split(" + "))
    rows = [
        [str(name), number_words(value) if isinstance(value, int | float) else str(value)]
        for name, value in (noise.get("parameters") or {}).items()
    ]
    words = f"Law of the noise, chosen before anything was tested: {law}."
    return _section("Noise", words, head=["constant", "value"], rows=rows)


def _provenance(result: Mapping[str, Any]) -> dict[str, Any] | None:
    origin = result.get("provenance") or {}
    if not origin:
        return None
    records = [
        f"{r['name']} ({str(r.get('split', '')).replace('_', ' ')}, {r.get('test', '')}, "
        f"{r.get('n_samples', '')} samples at {number_words(r.get('sample_rate'))} Hz)"
        for r in result.get("records") or []
    ]
    first = f"supple {origin.get('version', '')}, seed {origin.get('seed', '')}, "
    first += f"{number_words(origin.get('seconds'), 3)} s."
    second = f"Records: {'; '.join(records)}." if records else ""
    said = [line for r in result.get("records") or [] for line in r.get("warnings") or []]
    rows = [[str(name), str(digest)] for name, digest in (origin.get("inputs") or {}).items()]
    return _section("Provenance", first, second, *said, head=["input", "sha256"], rows=rows, left=2)
