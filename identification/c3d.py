"""Channels of a C3D file: what its analog inputs measured, and where its markers were."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..model.door import fault
from .vectors import CLOCK, Rows, clock_key, rows_of, vector_number


class C3dContent(NamedTuple):
    """What a C3D file holds; the clocks of points and analog channels begin together.

    Attributes:
        names: of the markers; as many as points, or the file is at fault.
        places: shape (frames, markers, 3), nan where a marker was lost [unit of the file].
        unit: of the places, as text.
        rate: frames a second [Hz]; 0 where there are no points.
        analog_names: of the analog channels.
        analog: shape (channels, samples) [each channel's own unit].
        analog_units: as text; empty where none is stated.
        analog_rate: samples a second [Hz]; 0 where there are none.
    """

    names: tuple[str, ...]
    places: np.ndarray
    unit: str
    rate: float
    analog_names: tuple[str, ...]
    analog: np.ndarray
    analog_units: tuple[str, ...]
    analog_rate: float


def open_c3d(path: Path) -> C3dContent:
    """Reads a C3D file; a point whose residual is negative was lost.

    Args:
        path: the file.

    Returns:
        Its markers and analog channels, in the units of the file.

    Raises:
        ValueError: where the library is missing, or the file is no whole C3D file.
    """
    try:
        from ezc3d import c3d  # pyright: ignore[reportMissingImports]
    except ImportError:
        mend = "run 'pip install supple[c3d]', or export the file as CSV"
        raise fault(path, "", "the library ezc3d for C3D files", "none installed", mend) from None
    try:
        return _content(c3d(str(path)))
    except (OSError, RuntimeError, ValueError, KeyError, IndexError) as error:
        text = f"'{' '.join(str(error).split())[:80] or type(error).__name__}'"
        expected = "a C3D file with points"
        raise fault(path, "", expected, text, "export it again, or as CSV") from None


def _content(read: Any) -> C3dContent:
    told, analog_told = read["parameters"]["POINT"], read["parameters"].get("ANALOG", {})
    points = np.asarray(read["data"]["points"], dtype=float)
    lost = np.asarray(read["data"]["meta_points"]["residuals"], dtype=float)[0] < 0.0
    places = np.moveaxis(points[:3], 0, -1).swapaxes(0, 1).copy()
    places[lost.T] = np.nan
    analog = np.asarray(read["data"]["analogs"], dtype=float)
    analog = analog.reshape(analog.shape[-2], analog.shape[-1])
    labels, units = (_texts(analog_told, name, len(analog)) for name in ("LABELS", "UNITS"))
    return C3dContent(
        tuple(str(name).strip() for name in told["LABELS"]["value"]),
        places,
        str((told["UNITS"]["value"] or [""])[0]).strip(),
        float(told["RATE"]["value"][0]),
        tuple(name or f"analog {i + 1}" for i, name in enumerate(labels)),
        analog,
        units,
        float(analog_told["RATE"]["value"][0]) if analog.size else 0.0,
    )


def _texts(table: Any, name: str, count: int) -> tuple[str, ...]:
    """As many texts as there are channels; empty ones where the file has too few."""
    found = [str(one).strip() for one in table.get(name, {}).get("value", [])][:count]
    return tuple(found + [""] * (count - len(found)))


@dataclass(frozen=True)
class C3dTable:
    """A C3D file as columns: analog channels by their label, then markers as ``NAME_x`` and so on.

    Attributes:
        path: the file.
        sha256: of its bytes.
        content: what it holds.
    """

    path: Path
    sha256: str
    content: C3dContent = field(repr=False)

    def name(self, key: str | int) -> str:
        """The name of a column that exists, with its unit in brackets where one is stated [-]."""
        if clock_key(key, self._names) is not None:
            return f"{CLOCK} [s]"
        number = vector_number(key, self._names, self.path, "column")
        units = (*self.content.analog_units, *[self.content.unit] * (3 * self._n_points))
        unit = units[number]
        return f"{self._names[number][0]} [{unit}]" if unit else self._names[number][0]

    @property
    def own_rate(self) -> float | None:
        """Samples a second of the first column [Hz]: that of the analog channels, if any."""
        return self._rate(0) if self._names else None

    def rate_of(self, key: str | int, place: str) -> float | None:
        """Samples a second of a column [Hz]."""
        return self._rate(vector_number(key, self._names, self.path, place))

    def column(self, key: str | int, rows: Rows, place: str) -> np.ndarray:
        """Numbers of one column; ``time`` is the first one's clock, ``time:X`` that of X.

        Args:
            key: name, or 0-based number.
            rows: the first and one past the last; None for all.
            place: the key of the sidecar that asks, for messages.

        Returns:
            float64, shape (n,), in the file's unit, finite.

        Raises:
            ValueError: where there is no such column, or where a marker was lost.
        """
        whose = clock_key(key, self._names)
        if whose is not None:
            return rows_of(self.times_of(whose, place), rows, self.path, "its clock")
        number = vector_number(key, self._names, self.path, place)
        called = f"column '{self._names[number][0]}'"
        return rows_of(self._values(number), rows, self.path, called)

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Every analog channel and every coordinate, by its number [-]."""
        return tuple(range(len(self._names)))

    def times_of(self, key: str | int, place: str) -> np.ndarray:
        """Times of a column's samples from the first frame on, shape (n,) [s]."""
        number = vector_number(key, self._names, self.path, place)
        return np.arange(len(self._values(number))) / self._rate(number)

    @property
    def analog_columns(self) -> tuple[int, ...]:
        """The analog channels, by number [-]."""
        return tuple(range(len(self.content.analog)))

    @property
    def _n_points(self) -> int:
        return self.content.places.shape[1]

    @functools.cached_property
    def _names(self) -> list[tuple[str]]:
        labels = self.content.names + tuple(
            f"point {i + 1}" for i in range(len(self.content.names), self._n_points)
        )
        points = [(f"{name}_{axis}",) for name in labels[: self._n_points] for axis in "xyz"]
        return [*((name,) for name in self.content.analog_names), *points]

    def _rate(self, number: int) -> float:
        is_analog = number < len(self.content.analog)
        rate = self.content.analog_rate if is_analog else self.content.rate
        if not 0.0 < rate < np.inf:
            place = f"{'ANALOG' if is_analog else 'POINT'}:RATE"
            raise fault(self.path, place, "samples a second", f"{rate:g}", "export it again")
        return rate

    def _values(self, number: int) -> np.ndarray:
        analog = self.content.analog
        if number < len(analog):
            return analog[number]
        marker, axis = divmod(number - len(analog), 3)
        return self.content.places[:, marker, axis]
