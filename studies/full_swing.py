"""What does the thesis's model lack in full swings? The diagnosis says it from six of them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .designs import Answer, finding, listed, percent, show
from .study import Call, Study
from .words import law_words, number_words

if TYPE_CHECKING:
    from ..model.linear import Port
    from .thesis.draw import Panel
    from .thesis.measured_swings import MeasuredSwing
    from .thesis.swing_diagnosis import Verdict

NAME = "full_swing"
QUESTION = "What does the thesis's model lack in full swings, and how much does each thing weigh?"
HEADINGS = ("cause", "explains [%]", "left over noise", "size, planar 1")
NONE, PLANAR = "none", "planar"
CHANNELS = ("head", "shaft")

NOTES = (
    "Six swings of an independent bench, as measured: markers make the profile that drives arm and "
    "wrist, accelerometers and strain gauges answer, up to the ball.",
    "Model: the thesis's driven arm with Table 4's 50 % sleeve and the final wrist, fidelity "
    "thesis. All records are fitted together; none that is held out is ever fitted.",
    "Explains: share of the squared misfit beyond the noise, channels alike by their noise, "
    "each cause as it came. A size, 1 being what the planar model has of the law, is fitted along "
    "with everything else; its error holds the scatter from swing to swing.",
    "Held out: root mean square error over what varies of each channel. Before and after, a "
    "record's start, zeros and told tolerances are fitted to its opening; the planar model has "
    "the final wrist and nothing fitted.",
    "A size of the stiffening above 1: the planar model bends the shaft from the grip's centre on, "
    "as the thesis does; one that bends from the grip's end on, by these lengths, the same turn "
    "stiffens {more:.2f} times as much.",
    "A size off 1 by more than its error: what a lumped club cannot do is left over, many times "
    "the noise, and sizes take a part of it. What they come to at 1 is told above.",
)


def find(call: Call) -> Answer:
    """Lets the bench swing, asks the diagnosis, and sets what it found against the planar model.

    Args:
        call: who asks; ``seed`` draws the noise, ``cases`` is how many golfers swing.

    Returns:
        The answer [SI].

    Raises:
        ValueError: where the bench is not beside the package, or the diagnosis refuses.
    """
    from .thesis.measured_swings import ask_bench, read_measured, require_swings
    from .thesis.swing_diagnosis import asked

    require_swings()
    with tempfile.TemporaryDirectory() as folder:
        count = [] if call.cases is None else ["--count", str(call.cases)]
        ask_bench(["swings", "--out", folder, "--seed", str(call.seed), *count])
        swings = [read_measured(path) for path in sorted(Path(folder).iterdir()) if path.is_dir()]
    verdict = asked(swings, call)
    if verdict.refused:
        raise ValueError(verdict.refused)
    return answer(swings, verdict)


def answer(swings: Sequence[MeasuredSwing], verdict: Verdict) -> Answer:
    """A verdict on swings as a study's answer: order, shares and sizes of causes, and what is left.

    Args:
        swings: as measured.
        verdict: of the diagnosis, not refused.
    """
    sizes = [_size(cause, swings) for cause in verdict.causes]
    rows = steps(verdict.result["history"], dict(sizes))
    held, whole = _held_out(swings, verdict), at_full_size(swings)
    more = {"diagnosis": verdict.told(), "held_out": held, "at_full_size": whole}
    notes = [note.format(more=_from_grip_end(swings[0])) for note in NOTES]
    cells = [_cells(row) for row in rows]
    words = [*_sentences(rows, held, verdict), *_not_found(verdict), _full_size_words(whole)]
    return Answer(HEADINGS, cells, rows, words, notes, _panels(verdict, held), more)


def steps(
    history: Sequence[Mapping[str, Any]], sizes: Mapping[str, tuple[float, float] | None]
) -> list[dict[str, Any]]:
    """One row a cause in the order in which it was found, the model without any first.

    Args:
        history: of the diagnosis: cause and reduced chi squared at each step [-].
        sizes: of each cause by its law, as a share of the planar model's, with its error [-].

    Returns:
        ``cause``, ``law``, ``explains`` (of the first misfit beyond noise), ``misfit`` (over the
        noise), ``size`` and ``size_std`` where the planar model has the law [-].
    """
    first, last, rows = history[0]["reduced_chi2"], history[0]["reduced_chi2"], []
    for step in history:
        law, size = step["law"], step["reduced_chi2"]
        known = sizes.get(law) or (None, None)
        rows.append({
            "cause": f"{step['place']}/{law}" if law else NONE,
            "law": law,
            "explains": (last - size) / max(first - 1.0, 1e-12) if law else None,
            "misfit": float(np.sqrt(size)),
            "size": known[0],
            "size_std": known[1],
        })  # fmt: skip
        last = size
    return rows


def _size(
    cause: Mapping[str, Any], swings: Sequence[MeasuredSwing]
) -> tuple[str, tuple[float, float] | None]:
    """A cause's law, and its strength over the planar model's with its error [-]."""
    from .thesis.swing_diagnosis import LACKING

    if cause["law"] not in LACKING:
        return cause["law"], None
    (one,) = cause["parameters"].values()
    unit = weight_moment(swings) if cause["law"] == "gravity" else 1.0
    return cause["law"], (one["value"] / unit, one["std"] / unit)


def weight_moment(swings: Sequence[MeasuredSwing]) -> float:
    """Moment of the club's weight in the swing planes about the wrist, on average [N m]."""
    from ..model.planar import GRAVITY
    from ..model.swung import first_moment

    return float(np.mean([first_moment(one.numbers()) * GRAVITY * np.sin(one.inclination)
                          for one in swings]))  # fmt: skip


def _from_grip_end(swing: MeasuredSwing) -> float:
    """How much more a turn stiffens a shaft that bends from the grip's end on [-]."""
    from ..model.planar import points_of

    p = swing.numbers()
    at = points_of(p)
    # tension times the shortening of a cantilever, less what draws the head out of line
    of_centre, of_end = (
        1.2 * at.head / length - 1.0 for length in (at.lever, at.lever - p["grip_length"] / 2)
    )
    return float(of_end / of_centre)


def _held_out(swings: Sequence[MeasuredSwing], verdict: Verdict) -> dict[str, Any]:
    """Errors in foretelling held-out swings, over what varies of each channel [-]."""
    planar, before, after = {}, {}, {}
    for swing in swings:
        if swing.name in verdict.held:
            planar[swing.name] = _planar_samples(swing)
    for view in verdict.views:
        if view.split != "held_out":
            continue
        key, spread = f"{view.record}:{view.channel}", float(np.std(view.measured))
        before[key] = _rms(view.before - view.measured) / spread
        after[key] = _rms(view.after - view.measured) / spread
        times, samples = planar[view.record]
        plane = np.interp(view.time, times, samples[view.channel])
        planar[key] = _rms(plane - view.measured) / spread
    errors = {"before": before, "after": after, "planar": {k: planar[k] for k in before}}
    whole = {k: _rms(np.array(list(each.values()))) for k, each in errors.items() if each}
    return {"records": list(verdict.held), "errors": errors, "nrmse": whole}


def at_full_size(swings: Sequence[MeasuredSwing]) -> list[dict[str, Any]]:
    """Errors over all swings when each law comes at the planar model's size, nothing fitted.

    Args:
        swings: as measured.

    Returns:
        ``with`` (the law that comes next; the planar model last) and, for each channel, root mean
        square of the difference over that of what was measured, up to the ball [-].
    """
    from .thesis.swing_diagnosis import LACKING

    gaps: dict[str, list[tuple[float, float]]] = {}
    for swing in swings:
        tables = full_size_laws(swing)
        for count, name in enumerate((NONE, *LACKING)):
            gaps.setdefault(name, []).append(_gap(swing, _linear_samples(swing, tables[:count])))
        gaps.setdefault(PLANAR, []).append(_gap(swing, _planar_samples(swing)[1]))
    return [
        {"with": name, **dict(zip(CHANNELS, map(_rms, np.array(found).T), strict=True))}
        for name, found in gaps.items()
    ]


def full_size_laws(swing: MeasuredSwing) -> list[dict[str, Any]]:
    """What the thesis's model lacks of a swing at the planar model's size, as laws [SI]."""
    from ..model.planar import GRAVITY
    from ..model.swung import SWUNG_HEAD, first_moment
    from .thesis.swing_diagnosis import LACKING

    weight = first_moment(swing.numbers()) * GRAVITY * float(np.sin(swing.inclination))
    sizes = {"arm": ("share", 1.0), SWUNG_HEAD: ("share", 1.0), "club": ("moment", weight)}
    return [
        {"law": law, "place": place, "parameters": dict([sizes[place]])}
        for law, place in zip(LACKING, sizes, strict=True)
    ]


def _gap(swing: MeasuredSwing, samples: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Error of each channel over what was measured of it [-]."""
    measured = (swing.acceleration[swing.before], swing.deflection[swing.before])
    pairs = zip(samples.values(), measured, strict=True)
    head, shaft = (_rms(one - told) / _rms(told) for one, told in pairs)
    return head, shaft


def _linear_samples(
    swing: MeasuredSwing, laws: Sequence[Mapping[str, Any]]
) -> dict[str, np.ndarray]:
    """What the thesis's model makes of a swing with laws in force, up to the ball [SI]."""
    from ..model.motion import respond
    from ..model.robot import Robot

    drive = swing.drive(is_struck=False)
    motion = respond(Robot("driven_arm"), swing.numbers(), drive, swing.points, _ports(), laws)
    samples = np.asarray(motion.samples)[swing.before]
    return dict(zip(CHANNELS, samples.T, strict=True))


def _ports() -> tuple[Port, Port]:
    from ..model.linear import Port

    return Port("clubhead", "acceleration"), Port("shaft", "deflection", "collet")


def _planar_samples(swing: MeasuredSwing) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """What full kinematics make of a swing: times of its record [s] and each channel [SI]."""
    from ..model.planar_motion import respond_planar
    from ..model.robot import INCLINATION, Robot

    numbers = swing.numbers() | {INCLINATION: swing.inclination}
    drive = swing.drive(is_struck=False)
    motion = respond_planar(Robot("driven_arm"), numbers, drive, swing.points, _ports())
    part = np.flatnonzero(swing.before[: len(motion.times)])
    samples = np.asarray(motion.samples)[part]
    times = swing.points[part] - swing.points[part[0]]
    return times, dict(zip(CHANNELS, samples.T, strict=True))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _sentences(
    rows: Sequence[Mapping[str, Any]], held: Mapping[str, Any], verdict: Verdict
) -> list[str]:
    found = [law_words(row["law"]) for row in rows[1:]]
    shares = [f"{percent(row['explains'])} % by {law_words(row['law'])}" for row in rows[1:]]
    if not found:
        return [f"The diagnosis finds no cause: {verdict.result['sentence']}"]
    order = "alone" if len(found) == 1 else "in this order"
    said = [
        f"The diagnosis ({verdict.result['status']}) finds {listed(found)}, {order}: of the "
        f"squared misfit {listed(shares)} are explained, {percent(verdict.explained)} % in all.",
        f"What is left is {number_words(rows[-1]['misfit'], 2)} times the noise, "
        f"{number_words(rows[0]['misfit'], 2)} times before.",
    ]
    error = held["nrmse"]
    if error:
        said.append(
            f"Held-out swings ({listed(held['records'])}) are foretold to "
            f"{percent(error['after'])} %, before to {percent(error['before'])} %; full planar "
            f"kinematics come to {percent(error['planar'])} %."
        )
    return said


def _not_found(verdict: Verdict) -> list[str]:
    """What the thesis's model is known to lack and the diagnosis does not name, with its reason."""
    from .thesis.swing_diagnosis import LACKING

    named = {cause["law"] for cause in verdict.causes}
    said = []
    for law in LACKING:
        tried = [one for one in verdict.result["candidates"] if one["law"] == law]
        if law in named or not tried:
            continue
        why = tried[0]["verdict"] if tried[0]["refitted"] else UNTRIED
        said.append(f"{law_words(law).capitalize()} is not named: {why}.")
    return said


UNTRIED = "where the others act it promises too little to be told apart"


def _full_size_words(whole: Sequence[Mapping[str, Any]]) -> str:
    """Errors as the laws come one after another, in a sentence."""
    words = {NONE: "without any law", PLANAR: "by the planar model"}
    told = [
        f"{one['head']:.2f} ({one['shaft']:.2f}) "
        + words.get(one["with"], f"with {law_words(one['with'])}{' too' * (k > 1)}")
        for k, one in enumerate(whole)
    ]
    return (
        "With every law at the planar model's size and nothing fitted, the error of the "
        f"acceleration (deflection) over all swings is {', '.join(told)}."
    )


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    share = "–" if row["explains"] is None else percent(row["explains"])
    size = "–" if row["size"] is None else f"{row['size']:.2f} ± {row['size_std']:.2f}"
    return row["cause"], share, number_words(row["misfit"], 3), size


def _panels(verdict: Verdict, held: Mapping[str, Any]) -> list[Panel]:
    """Every held-out channel, measured and simulated; of the fitted ones where none is held out."""
    from .thesis.draw import Curve, Panel

    names = {"head": "clubhead acceleration [m/s²]", "shaft": "shaft deflection [m]"}
    wanted = "held_out" if held["records"] else "train"
    return [
        Panel(
            f"{view.record}, {wanted.replace('_', ' ')}", "time [s]", names[view.channel],
            tuple(Curve(view.time, values, label) for label, values in (
                ("measured", view.measured), ("the thesis's model", view.before),
                ("with what was found", view.after),
            )),
        )
        for view in verdict.views if view.split == wanted
    ]  # fmt: skip


STUDY = Study(NAME, QUESTION, finding(NAME, QUESTION, find), show)
