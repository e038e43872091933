"""Channels of a TDMS file, as LabVIEW writes them: by name, or by group and name."""

from __future__ import annotations

import functools
import io
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..model.door import fault
from .vectors import CLOCK, Rows, clock_key, rows_of, vector_number

_UNITS = ("unit_string", "NI_UnitDescription")
_STEP, _START = "wf_increment", "wf_start_offset"


@dataclass(frozen=True)
class TdmsTable:
    """A TDMS file; a channel is named ``group/channel``, or ``channel`` where one alone has it.

    Attributes:
        path: the file.
        sha256: of its bytes.
        content: its bytes.
    """

    path: Path
    sha256: str
    content: bytes = field(repr=False)

    def name(self, key: str | int) -> str:
        """The name of a channel that exists, with its unit in brackets where one is stated [-]."""
        if clock_key(key, self._names) is not None:
            return f"{CLOCK} [s]"
        channel = self._found(key, "column")
        unit = next(
            (str(channel.properties[one]) for one in _UNITS if one in channel.properties), ""
        )
        name = f"{channel.group_name}/{channel.name}"
        return f"{name} [{unit}]" if unit.strip() else name

    @property
    def own_rate(self) -> float | None:
        """Samples a second of the first channel that states them [Hz]; None where none does."""
        rates = [_rate(channel) for channel in self._channels]
        return next((rate for rate in rates if rate is not None), None)

    def rate_of(self, key: str | int, place: str) -> float | None:
        """Samples a second of a channel [Hz]; None where the file does not say."""
        return _rate(self._found(key, place))

    def column(self, key: str | int, rows: Rows, place: str) -> np.ndarray:
        """Numbers of one channel, scaled as the file says; ``time`` is the first one's clock.

        Args:
            key: name, ``group/channel`` or 0-based number; ``time:X`` is the clock of X.
            rows: the first and one past the last; None for all.
            place: the key of the sidecar that asks, for messages.

        Returns:
            float64, shape (n,), in the file's unit, finite.

        Raises:
            ValueError: where there is no such channel, or where it holds no real numbers.
        """
        whose = clock_key(key, self._names)
        if whose is not None:
            return rows_of(self._times(whose, place), rows, self.path, "its clock")
        channel = self._found(key, place)
        return rows_of(self._read(channel), rows, self.path, f"channel '{channel.name}'")

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Every channel of real numbers that is not empty, by its number [-]."""
        kinds = [np.dtype(one.dtype).kind if len(one) else "" for one in self._channels]
        return tuple(i for i, kind in enumerate(kinds) if kind and kind in "biuf")

    def times_of(self, key: str | int, place: str) -> np.ndarray | None:
        """Times of a channel, shape (n,) [s]; None where the file does not say."""
        number = vector_number(key, self._names, self.path, place)
        return None if _rate(self._channels[number]) is None else self._clock(number)

    def _found(self, key: str | int, place: str) -> Any:
        return self._channels[vector_number(key, self._names, self.path, place)]

    @property
    def _names(self) -> list[tuple[str, str]]:
        return [(f"{one.group_name}/{one.name}", one.name) for one in self._channels]

    def _times(self, whose: str | int, place: str) -> np.ndarray:
        """The clock of a channel [s]; of the first one that states a rate where number 0 asks."""
        asked = self._channels if whose == 0 else (self._found(whose, place),)
        channel = next((one for one in asked if _rate(one) is not None), None)
        if channel is None:
            mend = "name a channel of times, or give 'sample_rate' in [record]"
            raise fault(self.path, place, f"a channel with '{_STEP}'", "none", mend)
        return self._clock(self._channels.index(channel))

    def _clock(self, number: int) -> np.ndarray:
        channel = self._channels[number]
        self._check_length(channel)
        start = float(channel.properties.get(_START, 0.0))
        return start + np.arange(len(channel)) * float(channel.properties[_STEP])

    def _check_length(self, channel: Any) -> None:
        if len(channel) > len(self.content):  # a sample takes a byte at least
            found = f"{len(channel)} samples announced in {len(self.content)} bytes"
            mend = "copy or export it again; it is damaged"
            raise fault(self.path, f"channel '{channel.name}'", "a whole TDMS file", found, mend)

    @functools.cached_property
    def _channels(self) -> tuple[Any, ...]:
        try:
            from nptdms import TdmsFile  # pyright: ignore[reportMissingImports]
        except ImportError:
            mend = "run 'pip install supple[tdms]', or export the record as CSV"
            raise fault(self.path, "", "the library npTDMS for TDMS files", "none installed",
                        mend) from None  # fmt: skip
        if not self.content.startswith(b"TDSm"):
            found = f"a file that begins with {self.content[:8]!r}"
            raise fault(self.path, "", "a TDMS file", found, "name the .tdms file itself")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of segments cut short: the lengths are compared
                file = TdmsFile.open(io.BytesIO(self.content))
            found = tuple(channel for group in file.groups() for channel in group.channels())
        except Exception as error:  # npTDMS raises nothing narrower
            raise self._unreadable(error) from None
        if not found:
            raise fault(self.path, "", "a TDMS file with channels", "none", "export it again")
        return found

    def _unreadable(self, error: Exception) -> ValueError:
        text = f"'{' '.join(str(error).split())[:80] or type(error).__name__}'"
        mend = "copy or export it again, or as CSV"
        return fault(self.path, "", "a whole TDMS file", text, mend)

    def _read(self, channel: Any) -> np.ndarray:
        called = f"channel '{channel.name}'"
        self._check_length(channel)
        kind = np.dtype(channel.dtype).kind
        if kind not in "biuf":
            words = {"O": "text", "M": "dates", "c": "complex numbers"}.get(kind, "something else")
            raise fault(self.path, called, "real numbers", words, "name a channel of numbers")
        try:
            values = np.asarray(channel[:], dtype=np.float64)
        except Exception as error:  # npTDMS raises nothing narrower
            raise self._unreadable(error) from None
        if len(values) != len(channel):
            mend = "copy or export the file again; it may be cut short"
            expected = f"the {len(channel)} samples that it announces"
            raise fault(self.path, called, expected, f"{len(values)}", mend)
        return values


def _rate(channel: Any) -> float | None:
    step = channel.properties.get(_STEP)
    if not isinstance(step, int | float) or not 0.0 < step < np.inf:
        return None
    return 1.0 / float(step)
