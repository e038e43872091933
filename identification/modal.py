"""Constants from modal tables: least squares on the modes of the rig, joined with other records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2 as chi2_distribution

from ..model.door import fault
from ..model.energies import damping_matrix, mass_matrix, stiffness_matrix
from ..model.linear import Mechanism
from ..model.mechanism import mechanism_of
from ..model.rig import Rig
from .errors import BLIND
from .fit import CONVERGED, STOPPED, Fit
from .identifiable import information_root, words_of
from .modal_table import MeasuredMode, ModalTable
from .verdict import NORMAL_95, amount

STEP = 1e-6
"""Relative step of central differences of the poles [-]."""

FACTORS = (1.0, 0.3, 3.0)
"""Factors on the start values of stiffnesses and dampings that are tried [-]."""

HONEST = 1e-3
"""Chance below which a misfit is no chance, and errors grow by it [-]."""

TOO_MANY = "The records ask for more constants than they hold numbers."


@dataclass(frozen=True)
class ModalEntry:
    """One number that a fit of modal tables varies.

    Attributes:
        name: the rig's.
        condition: the only condition it belongs to; None where all share it.
        value: start value [SI].
        low: lower bound [SI].
        high: upper bound [SI].
        prior: prior standard deviation about `value` [SI]; inf without one.
        unit: SI unit as text.
        nuisance: whether it is known to a tolerance rather than free.
    """

    name: str
    condition: str | None
    value: float
    low: float
    high: float
    prior: float
    unit: str
    nuisance: bool

    @property
    def label(self) -> str:
        """Name with the condition that it belongs to."""
        return self.name if self.condition is None else f"{self.name}[{self.condition}]"


@dataclass(frozen=True, eq=False)
class Known:
    """What other records say of shared numbers: normal, jointly.

    Attributes:
        names: the rig's names.
        values: shape (names,) [SI].
        root: of their information, shape (rows, names): ``root @ (x - values)`` is in standard
            deviations [1/SI]; directions that those records do not tell are in no row.
    """

    names: tuple[str, ...]
    values: np.ndarray
    root: np.ndarray


@dataclass(frozen=True, eq=False)
class ModalFit:
    """A rig whose modes are those of the tables.

    Attributes:
        rig: as read at the door.
        modes: as measured.
        entries: what varied.
        values: best numbers, shape (entries,) [SI].
        covariance: shape (entries, entries) [SI].
        predicted: frequency [Hz] and damping ratio [-] of each mode, shape (modes, 2).
        chi2: sum of squared misfits in standard deviations, priors included [-].
        p_value: chance of a larger one [-]; 1 where as many numbers as measurements.
        status: one sentence.
    """

    rig: Rig
    modes: tuple[MeasuredMode, ...]
    entries: tuple[ModalEntry, ...]
    values: np.ndarray
    covariance: np.ndarray
    predicted: np.ndarray
    chi2: float
    p_value: float
    status: str

    @property
    def converged(self) -> bool:
        """Whether the numbers may be trusted as a minimum."""
        return self.status == CONVERGED

    @property
    def std(self) -> np.ndarray:
        """Standard errors, shape (entries,) [SI]."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def of(self, label: str) -> tuple[float, float]:
        """Value and standard error of the entry with this label [SI]."""
        index = [entry.label for entry in self.entries].index(label)
        return float(self.values[index]), float(self.std[index])


def ringing(mechanism: Mechanism, p: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Damped frequencies [Hz], rising, and damping ratios [-] of the modes that oscillate.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI].
    """
    rows, n = mechanism.rows(p, np), len(mechanism.coordinates)
    mass, damping, stiffness = (
        np.asarray(of(rows))[:n, :n] for of in (mass_matrix, damping_matrix, stiffness_matrix)
    )
    a = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, np.hstack([stiffness, damping]))]]
    )
    poles = np.linalg.eigvals(a)
    poles = poles[np.imag(poles) > 1e-9 * np.abs(poles)]
    poles = poles[np.argsort(np.abs(poles))]
    return np.imag(poles) / (2 * np.pi), -np.real(poles) / np.abs(poles)


def known_from(fit: Fit) -> Known:
    """What a fit of records against time says of the rig's numbers that all records share [SI].

    The information left when everything else of that fit is solved for; it shrinks as the fit's
    own errors grow where misfit is left.
    """
    entries = fit.model.entries
    which = [i for i, e in enumerate(entries) if e.slot == "numbers" and e.record is None]
    names = tuple(entries[i].keys[0] for i in which)
    values = np.array([fit.value(i) for i in which])
    return Known(names, values, information_root(fit, which))


def fit_modal(tables: Sequence[ModalTable], rig: Rig, known: Known | None = None) -> ModalFit:
    """Find the rig's free numbers from modes.

    A number that is ``per = "record"`` has its own value under each condition; one that a table
    states for a condition does not vary there. Free numbers, bounds and priors are those of the
    rig's file, as for records against time.

    Args:
        tables: as read at the door.
        rig: as read at the door.
        known: what other records say of shared numbers, in place of their priors.

    Returns:
        The fit; `status` says whether it converged, and whether it could.

    Raises:
        ValueError: where no number is free under any condition.

    Source: tests/identification/test_modal.py, on modes of an independent bench.
    """
    task = _task(tables, rig, known)
    runs = [_run(task, k, c) for k in FACTORS for c in FACTORS[: 3 if k == 1.0 else 1]]
    best = min(runs, key=lambda run: float(run.cost))
    x, jacobian = best.x, task.jacobian(best.x)
    hessian = jacobian.T @ jacobian
    ridge = BLIND * np.diag(np.diag(hessian))
    covariance = np.linalg.pinv(hessian + ridge, rcond=1e-15, hermitian=True)
    chi2 = float(2 * best.cost)
    spare = len(jacobian) - len(x)
    p_value = float(chi2_distribution.sf(chi2, spare)) if spare > 0 else 1.0
    if p_value < HONEST:
        covariance = covariance * chi2 / spare
    status = TOO_MANY if spare < 0 else CONVERGED if best.status > 0 else STOPPED
    scale = task.scale
    return ModalFit(
        rig, task.modes, task.entries, x * scale, covariance * np.outer(scale, scale),
        task.predicted(x), chi2, p_value, status,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Task:
    """Modes, entries and what is known, as functions of x, the values over their scales."""

    mechanism: Mechanism
    numbers: dict[str, float]
    modes: tuple[MeasuredMode, ...]
    given: Mapping[str, Mapping[str, float]]
    entries: tuple[ModalEntry, ...]
    known: Known | None

    @property
    def scale(self) -> np.ndarray:
        return np.array([abs(e.value) or e.prior for e in self.entries])

    def under(self, condition: str, x: np.ndarray) -> dict[str, float]:
        """Every number of the rig under one condition [SI]."""
        own = {
            e.name: value
            for e, value in zip(self.entries, x * self.scale, strict=True)
            if e.condition in (None, condition)
        }
        return {**self.numbers, **own, **self.given[condition]}

    def predicted(self, x: np.ndarray) -> np.ndarray:
        seen = {
            name: ringing(self.mechanism, self.under(name, x))
            for name in dict.fromkeys(mode.condition for mode in self.modes)
        }
        found = []
        for mode in self.modes:
            frequencies, ratios = seen[mode.condition]
            lost = mode.order >= len(frequencies)
            order = mode.order
            found.append((0.0, 1.0) if lost else (frequencies[order], ratios[order]))
        return np.array(found)

    def residual(self, x: np.ndarray) -> np.ndarray:
        off = self.predicted(x)
        parts = [
            np.array(
                [(f - m.frequency) / m.frequency_std, (z - m.damping_ratio) / m.damping_ratio_std]
            )
            for m, (f, z) in zip(self.modes, off, strict=True)
        ]
        value = dict(zip((e.label for e in self.entries), x * self.scale, strict=True))
        told = () if self.known is None else self.known.names
        pulls = [
            (value[e.label] - e.value) / e.prior
            for e in self.entries
            if np.isfinite(e.prior) and e.label not in told
        ]
        return np.concatenate([*parts, pulls, self._pull(value)])

    def _pull(self, value: Mapping[str, float]) -> np.ndarray:
        if self.known is None:
            return np.zeros(0)
        off = [
            value.get(n, v) - v for n, v in zip(self.known.names, self.known.values, strict=True)
        ]
        return self.known.root @ np.array(off)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        columns = []
        for index in range(len(x)):
            step = np.zeros(len(x))
            step[index] = STEP * max(abs(x[index]), 1e-3)
            rise = self.residual(x + step) - self.residual(x - step)
            columns.append(rise / (2 * step[index]))
        return np.stack(columns, axis=1)


def _task(tables: Sequence[ModalTable], rig: Rig, known: Known | None) -> _Task:
    several = len(tables) > 1

    def of(table: ModalTable, condition: str) -> str:
        return f"{table.name}: {condition}" if several else condition

    modes = tuple(replace(m, condition=of(t, m.condition)) for t in tables for m in t.modes)
    given = {of(t, name): numbers for t in tables for name, numbers in t.numbers.items()}
    entries = []
    for name, number in rig.parameters.items():
        opened = [c for c in given if name not in given[c]]
        if not number.varies or not opened:
            continue
        prior = number.std if number.std is not None else np.inf
        low = 0.0 if number.free and np.isinf(number.low) and number.value > 0 else number.low
        for condition in opened if number.per_record else [None]:
            entries.append(
                ModalEntry(
                    name, condition, number.value, low, number.high, prior, number.unit,
                    not number.free,
                )
            )  # fmt: skip
    if not any(not entry.nuisance for entry in entries):
        mend = "write free = true at what the modes are to tell"
        raise fault(rig.path, "[parameters]", "at least one free number", "none", mend)
    numbers = {name: number.value for name, number in rig.parameters.items()}
    return _Task(mechanism_of(rig), numbers, modes, given, tuple(entries), known)


def _run(task: _Task, stiffness: float, damping: float) -> Any:
    scale = task.scale
    factor = [
        stiffness if "stiffness" in e.name else damping if "damping" in e.name else 1.0
        for e in task.entries
    ]
    low = np.array([e.low for e in task.entries]) / scale
    high = np.array([e.high for e in task.entries]) / scale
    start = np.array([e.value for e in task.entries]) / scale * factor
    room = 1e-6 * np.minimum(high - low, 1.0)
    start = np.clip(start, low + room, high - room)
    return least_squares(
        task.residual, start, cast(Any, task.jacobian), bounds=(low, high), x_scale="jac",
        ftol=1e-12, xtol=1e-12, gtol=1e-12, max_nfev=200,
    )  # fmt: skip


def modal_json(fit: ModalFit, provenance: Mapping[str, Any]) -> dict[str, Any]:
    """The contract's ``fit.json`` of modal tables; numbers in the SI units beside them.

    Args:
        fit: the fit.
        provenance: version, inputs, seed, seconds [s].

    Returns:
        Tables and numbers that JSON can hold; ``modes`` holds each mode measured and fitted.
    """
    told = modal_words(fit)
    parameters, nuisances, said = {}, {}, []
    for index, entry in enumerate(fit.entries):
        value, std = float(fit.values[index]), float(fit.std[index])
        row = {"value": value, "std": std, "unit": entry.unit}
        if entry.nuisance:
            nuisances[entry.label] = row | {"expected": entry.value}
            continue
        low, high = value - NORMAL_95 * std, value + NORMAL_95 * std
        bounds = {"low": max(low, entry.low), "high": min(high, entry.high)}
        parameters[entry.label] = row | bounds | told[entry.label]
        said.append(f"{entry.label} {amount(value, std, entry.unit)}")
    spare = max(2 * len(fit.modes) - len(parameters), 1)
    doubts = [
        f"{k} {v['note']}"
        for k, v in told.items()
        if v["identifiable"] != "yes" and k in parameters
    ]
    tail = f" In doubt: {'; '.join(doubts)}." if doubts else ""
    return {
        "status": fit.status,
        "sentence": f"{', '.join(said[:8])}.{tail}",
        "parameters": parameters,
        "noise": {"law": "stated", "parameters": {}},
        "misfit": {"reduced_chi2": fit.chi2 / spare, "whiteness_p": fit.p_value},
        "nuisances": nuisances,
        "modes": [_mode(mode, row) for mode, row in zip(fit.modes, fit.predicted, strict=True)],
        "provenance": dict(provenance),
    }  # fmt: skip


def _mode(mode: MeasuredMode, fitted: np.ndarray) -> dict[str, Any]:
    rows = {
        "frequency": (mode.frequency, mode.frequency_std),
        "damping_ratio": (mode.damping_ratio, mode.damping_ratio_std),
    }
    return {"condition": mode.condition} | {
        name: {"measured": value, "std": std, "fitted": float(told)}
        for (name, (value, std)), told in zip(rows.items(), fitted, strict=True)
    }


def modal_words(fit: ModalFit) -> dict[str, dict[str, Any]]:
    """Whether the modes tell each number, by label; correlations are dimensionless [-]."""
    bound = {
        entry.label
        for entry, value in zip(fit.entries, fit.values, strict=True)
        if min(value - entry.low, entry.high - value) < 1e-3 * abs(entry.value)
    }
    return words_of(
        [entry.label for entry in fit.entries],
        fit.values,
        np.array([entry.value for entry in fit.entries]),
        fit.covariance,
        bound,
    )
