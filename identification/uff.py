"""Channels of a universal file: the time histories of its datasets 58, in ASCII or binary."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..model.door import fault, one_of
from .vectors import CLOCK, Rows, clock_key, rows_of, vector_number

_TIME, _UNKNOWN = 17, 0
_HISTORIES = (0, 1)
_REAL = (2, 4)
_AXES = {0: "S", 1: "+X", 2: "+Y", 3: "+Z", 4: "+RX", 5: "+RY", 6: "+RZ"}
_MOST_SETS = 10_000


@dataclass(frozen=True)
class UffTable:
    """A universal file; a channel is named by its first line, or by node and direction: ``12:+Z``.

    Attributes:
        path: the file.
        sha256: of its bytes.
    """

    path: Path
    sha256: str

    def name(self, key: str | int) -> str:
        """The name of a channel that exists, with its unit in brackets where one is stated [-]."""
        if clock_key(key, self._names) is not None:
            return f"{CLOCK} [s]"
        one = self._found(key, "column")
        return f"{one.name} [{one.unit}]" if one.unit else one.name

    @property
    def own_rate(self) -> float | None:
        """Samples a second of the first channel [Hz]; None where its steps are uneven."""
        return self._sets[0].rate

    def rate_of(self, key: str | int, place: str) -> float | None:
        """Samples a second of a channel [Hz]; None where its steps are uneven."""
        return self._found(key, place).rate

    def column(self, key: str | int, rows: Rows, place: str) -> np.ndarray:
        """Numbers of one channel; ``time`` is the abscissa of the first one, ``time:X`` of X.

        Args:
            key: name, ``NODE:DIRECTION`` or 0-based number among the time histories.
            rows: the first and one past the last; None for all.
            place: the key of the sidecar that asks, for messages.

        Returns:
            float64, shape (n,), in the file's unit, finite.

        Raises:
            ValueError: where there is no such channel, or where it is cut short.
        """
        whose = clock_key(key, self._names)
        if whose is not None:
            return rows_of(self._read(self._found(whose, place))[0], rows, self.path, "its clock")
        one = self._found(key, place)
        return rows_of(self._read(one)[1], rows, self.path, f"channel '{one.name}'")

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Every time history of real numbers, by its number [-]."""
        return tuple(i for i, one in enumerate(self._sets) if one.form in _REAL)

    def times_of(self, key: str | int, place: str) -> np.ndarray:
        """Abscissa of a channel, shape (n,) [s]."""
        return self._read(self._found(key, place))[0]

    def _found(self, key: str | int, place: str) -> _Set:
        return self._sets[vector_number(key, self._names, self.path, place)]

    @property
    def _names(self) -> list[tuple[str, str]]:
        return [(one.name, one.node) for one in self._sets]

    @functools.cached_property
    def _file(self) -> Any:
        try:
            from pyuff import UFF  # pyright: ignore[reportMissingImports]
        except ImportError:
            mend = "run 'pip install supple[uff]', or export the record as CSV"
            raise fault(self.path, "", "the library pyuff for universal files", "none installed",
                        mend) from None  # fmt: skip
        try:
            return UFF(str(self.path))
        except Exception as error:  # pyuff raises nothing narrower
            raise self._unreadable(error) from None

    def _unreadable(self, error: Exception) -> ValueError:
        text = f"'{' '.join(str(error).split())[:80] or type(error).__name__}'"
        mend = "export it again as UFF58, or as CSV"
        return fault(self.path, "", "a universal file with datasets 58", text, mend)

    @functools.cached_property
    def _sets(self) -> tuple[_Set, ...]:
        file = self._file
        kinds = [int(kind) for kind in file.get_set_types()]
        numbers = [i for i, kind in enumerate(kinds) if kind == 58]
        if not numbers or len(numbers) > _MOST_SETS:
            found = f"datasets {one_of(map(str, sorted(set(kinds))))}" if kinds else "no dataset"
            found = f"{len(numbers)} of them" if numbers else found
            mend = "export time histories as UFF58, or as CSV"
            raise fault(self.path, "", "datasets 58 of time histories", found, mend)
        try:
            headers = [(i, file.read_sets(i, header_only=True)) for i in numbers]
        except Exception as error:  # pyuff raises nothing narrower
            raise self._unreadable(error) from None
        found = tuple(_set_of(number, header) for number, header in headers if _is_history(header))
        if not found:
            kinds_found = one_of(sorted({str(header.get("func_type")) for _, header in headers}))
            mend = "export the time histories, not their spectra"
            raise fault(self.path, "", "a time history (function type 1)",
                        f"function types {kinds_found}", mend)  # fmt: skip
        return found

    def _read(self, one: _Set) -> tuple[np.ndarray, np.ndarray]:
        called = f"channel '{one.name}'"
        if one.form not in _REAL:
            mend = "export the time history itself"
            found = f"ordinate data type {one.form}"
            raise fault(self.path, called, "real numbers", found, mend)
        try:
            read = self._file.read_sets(one.number)
            times, values = (np.asarray(read[name], dtype=float) for name in ("x", "data"))
        except Exception as error:  # pyuff raises nothing narrower
            raise self._unreadable(error) from None
        if len(values) != one.count or len(times) != one.count:
            found = f"{len(values)}"
            mend = "copy or export the file again; it may be cut short"
            raise fault(self.path, called, f"the {one.count} samples that it announces", found,
                        mend)  # fmt: skip
        return times, values


@dataclass(frozen=True)
class _Set:
    number: int
    name: str
    node: str
    unit: str
    form: int
    count: int
    rate: float | None = field(default=None)


def _is_history(header: dict[str, Any]) -> bool:
    """Whether a dataset 58 is a time history: by its function type and its abscissa."""
    abscissa = header.get("abscissa_spec_data_type", _UNKNOWN)
    return header.get("func_type") in _HISTORIES and abscissa in (_TIME, _UNKNOWN)


def _set_of(number: int, header: dict[str, Any]) -> _Set:
    direction = int(header.get("rsp_dir", 0))
    axis = _AXES.get(abs(direction), "S")
    node = f"{header.get('rsp_node', 0)}:{axis.replace('+', '-') if direction < 0 else axis}"
    first = _text(header, "id1")
    step = float(header.get("abscissa_inc", 0.0))
    is_even = header.get("abscissa_spacing") == 1 and step > 0.0
    return _Set(
        number,
        first or node,
        node,
        _text(header, "ordinate_axis_units_lab"),
        int(header.get("ord_data_type", 0)),
        int(header.get("num_pts", 0)),
        1.0 / step if is_even else None,
    )


def _text(header: dict[str, Any], name: str) -> str:
    text = " ".join(str(header.get(name, "")).split())
    return "" if text.upper() == "NONE" else text
