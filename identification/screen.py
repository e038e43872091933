"""The screen: which laws at which places could explain the residual, before any is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2 as chi2_distribution

from ..model.law import Law, Scales, library
from .fit import Fit
from .free import Entry, law_entry
from .problem import Cause

VISIBLE = 3.0
"""A law of natural strength that moves the records by less than this many noise units, after
projection off everything that is fitted anyway, cannot be told [-]."""


@dataclass(frozen=True)
class Candidate:
    """A law at a place, with what the residual says of it.

    Attributes:
        place: link, mass or channel.
        law: the law.
        entry: its strength as an unknown of a fit [SI].
        gain: drop of the cost that one linear step promises [-].
        p_value: chance of such a gain by noise alone, one law tried [-].
        step: strength of that step, scaled [-].
        column: its Jacobian column, projected off all that is fitted and normalized.
        visible: norm of the projected column at natural strength, in noise units [-].
    """

    place: str
    law: Law
    entry: Entry
    gain: float
    p_value: float
    step: float
    column: np.ndarray
    visible: float

    @property
    def name(self) -> str:
        """``place/law``."""
        return f"{self.place}/{self.law.name}"


def possible_causes(fit: Fit) -> list[Cause]:
    """Every law at every place where it makes sense and is not yet in force."""
    problem = fit.problem
    mechanism, had = problem.mechanism, {(p, law.name) for p, law in fit.model.causes}
    found: list[Cause] = []
    for place, kind in mechanism.law_places().items():
        for law in library().values():
            fits = law.force is not None and law.kind == kind
            fits = fits and law.rotation in (None, mechanism.turns(place))
            if fits and (place, law.name) not in had and not _said_already(fit, place, law):
                found.append((place, law))
    for channel, is_input, driven in _channels(fit):
        for law in library().values():
            if not law.slot or (channel, law.name) in had:
                continue
            if law.kind == "channel" or (law.kind == "response" and not is_input and driven):
                found.append((channel, law))
    return found


def _channels(fit: Fit) -> list[tuple[str, bool, bool]]:
    """Name, whether an input, whether a record with it is driven."""
    found: dict[str, tuple[str, bool, bool]] = {}
    for prepared in fit.problem.records:
        for channel in prepared.record.channels:
            is_input = channel.role == "input"
            if is_input and channel.quantity not in ("force", "torque"):
                continue
            before = found.get(channel.name, (channel.name, is_input, False))
            found[channel.name] = (channel.name, is_input, before[2] or not prepared.free)
    return list(found.values())


def numbers_at(fit: Fit, place: str, word: str) -> list[str]:
    """The rig's numbers of a kind (stiffness, damping) at a place, by name."""
    rig = fit.problem.rig
    if rig.kind == "chain":
        name = f"links.{place}.{word}"
        return [name] if name in rig.parameters else []
    return [n for n in rig.parameters if n.startswith(f"{place}_{word}")]


def _said_already(fit: Fit, place: str, law: Law) -> bool:
    if not law.replaces:
        return False
    parameters = fit.problem.rig.parameters
    return any(parameters[name].free for name in numbers_at(fit, place, law.replaces))


def entry_of(fit: Fit, cause: Cause) -> Entry:
    """The unknown strength of a cause, with its natural size [SI]."""
    place, law = cause
    problem = fit.problem
    rotation = problem.mechanism.turns(place) if place in problem.scales else False
    if law.slot:
        channels = [c for p in problem.records for c in p.record.channels if c.name == place]
        rms = float(np.mean([np.std(c.values) for c in channels])) or 1.0
        first = next(iter(problem.scales.values()))
        scales = replace(first, stretch=0.1 * rms)
        unit = law.unit(False, channels[0].unit)
    else:
        scales, unit = problem.scales[place], law.unit(rotation)
    entry = law_entry(law, place, _natural(law, scales), unit, problem.records)
    names = numbers_at(fit, place, law.replaces) if law.replaces else []
    if names:
        low = -sum(problem.rig.parameters[name].value for name in names)
        entry = replace(entry, low=low)
    return entry


def _natural(law: Law, scales: Scales) -> float:
    size = abs(law.natural(scales))
    return size if np.isfinite(size) and size > 0 else 1.0


def screen(fit: Fit, causes: Sequence[Cause] | None = None) -> list[Candidate]:
    """Score (Lagrange multiplier) test of every possible cause.

    One Jacobian column each, projected off the columns of everything that is fitted.

    Args:
        fit: converged, with its noise law.
        causes: what to try; all that make sense by default.

    Returns:
        Candidates, largest gain first; p-values of one trial each.

    Source: Rao 1948, doi:10.1017/S0305004100023987; tests/identification/test_screen.py.
    """
    model = fit.model
    causes = possible_causes(fit) if causes is None else list(causes)
    residual = model.residual(fit.x)
    basis = np.linalg.qr(model.jacobian(fit.x))[0] if len(fit.x) else np.zeros((len(residual), 0))
    groups: dict[str, list[Cause]] = {}
    for cause in causes:
        groups.setdefault(cause[0] if cause[1].force else "", []).append(cause)
    found = []
    for group in groups.values():
        entries = tuple(entry_of(fit, cause) for cause in group)
        wide = replace(model, entries=entries, causes=model.causes + tuple(group), fixed=_held(fit))
        columns = wide.jacobian(np.zeros(len(entries)))[: fit.count]
        pad = np.zeros((len(residual) - fit.count, columns.shape[1]))
        columns = np.concatenate([columns, pad])
        columns = columns - basis @ (basis.T @ columns)
        for cause, entry, column in zip(group, entries, columns.T, strict=True):
            found.append(_candidate(cause, entry, column, residual))
    return sorted(found, key=lambda candidate: -candidate.gain)


def _held(fit: Fit) -> tuple[tuple[Entry, float], ...]:
    """All entries of a fit as fixed numbers, so that only new columns are computed."""
    values = tuple((e, fit.value(i)) for i, e in enumerate(fit.model.entries))
    return fit.model.fixed + values


def _candidate(cause: Cause, entry: Entry, column: np.ndarray, residual: np.ndarray) -> Candidate:
    size = float(np.linalg.norm(column))
    if size < 1e-9:
        return Candidate(*cause, entry, 0.0, 1.0, 0.0, np.zeros_like(column), size)
    unit = column / size
    pull = -float(unit @ residual)
    step = pull / size
    if step < entry.low / entry.scale:
        step = entry.low / entry.scale
        pull = 0.0
    gain = pull**2
    p_value = float(chi2_distribution.sf(gain, 1))
    return Candidate(*cause, entry, gain, p_value, step, unit, size)


def alikeness(first: Candidate, second: Candidate) -> float:
    """How alike two causes look in these records: cosine of their projected columns [-]."""
    return float(abs(first.column @ second.column))
