"""What files of named vectors share: a name is found, rows are chosen, and numbers are finite."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..model.door import fault, nearest, one_of

Rows = tuple[int, int] | None
"""The first row and one past the last; None for all of them."""

CLOCK = "time"
"""The column of times that a file with clocks of its own has: that of its first channel; ``time:X``
is that of the channel X."""


TIMES = ("time", "t", "zeit")
"""How columns of times are called, in small letters and without their unit [-]."""


def find_name(key: str, names: Sequence[str]) -> list[int]:
    """Columns that a name means: the exact one, or the one that differs by case, space or unit.

    Args:
        key: the name that the sidecar gives.
        names: the file's own.

    Returns:
        Their numbers from 0; several where the name is not clear.
    """

    def plain(name: str) -> str:
        return " ".join(name.split()).casefold()

    def without_unit(name: str) -> str:
        return plain(name.split("[")[0].split("(")[0])

    for form in (str, plain, without_unit):
        found = [i for i, name in enumerate(names) if name and form(name) == form(key)]
        if found:
            return found
    return []


def clock_key(key: str | int, names: Sequence[Sequence[str]]) -> str | int | None:
    """Whose clock a name asks for.

    Args:
        key: the name.
        names: the names that each channel of the file goes by.

    Returns:
        A channel, the first one as number 0; None where the name is no clock's.
    """
    if not isinstance(key, str) or any(key in each for each in names):
        return None
    first, colon, channel = key.partition(":")
    if first.strip().casefold() != CLOCK:
        return None
    return channel.strip() if colon else 0


def rows_of(values: np.ndarray, rows: Rows, path: Path, called: str) -> np.ndarray:
    """The rows of a vector that a sidecar asks for, after checking that they are numbers.

    Args:
        values: float64, shape (n,) [unit of the file].
        rows: the first and one past the last; None for all.
        path: the file, for messages.
        called: the vector in words, such as ``variable 'x'``.

    Returns:
        Those rows, finite [unit of the file].

    Raises:
        ValueError: where there are too few, or where one is no finite number.
    """
    start, stop = rows or (0, len(values))
    if stop > len(values):
        mend = "correct 'samples', which counts from 0"
        raise fault(path, called, f"at least {stop} samples", f"{len(values)}", mend)
    values = values[start:stop]
    strange = np.flatnonzero(~np.isfinite(values))
    if strange.size:
        found = f"{values[strange[0]]} ({strange.size} of {len(values)} numbers)"
        mend = "mend it, or leave that row out with 'samples' in [record]"
        place = f"{called}, row {start + int(strange[0])}"
        raise fault(path, place, "a finite number", found, mend)
    return values


def vector_number(key: str | int, names: Sequence[Sequence[str]], path: Path, place: str) -> int:
    """Which vector of a file a sidecar means.

    Args:
        key: its name, or its 0-based number.
        names: the names that each vector goes by; the first is shown.
        path: the file, for messages.
        place: the key of the sidecar that asks, for messages.

    Returns:
        Its number from 0.

    Raises:
        ValueError: where there is none, or where several go by that name.
    """
    listed = one_of(each[0] for each in names)
    if isinstance(key, int):
        if key < len(names):
            return key
        found = f"{len(names)}: {listed}"
        raise fault(path, place, f"a channel number {key}", found, "channels are counted from 0")
    for position in range(max((len(each) for each in names), default=0)):
        alike = [each[position] if position < len(each) else "" for each in names]
        found = find_name(key, alike)
        if len(found) == 1:
            return found[0]
        if found:
            numbers = ", ".join(map(str, found))
            mend = f"write column = {found[0]}, its number from 0, or its longer name"
            text = f"it {len(found)} times, as numbers {numbers}"
            raise fault(path, place, f"one channel '{key}'", text, mend)
    like = nearest(key, [name for each in names for name in each if name])
    mend = f"write column = '{like}'" if like else "write one of these names"
    raise fault(path, place, f"a channel '{key}'", f"the channels {listed}", mend)
